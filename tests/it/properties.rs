//! What must not change the answer of the default method: pose, place, scale, order, repetition and
//! the number of threads.

use std::collections::HashMap;

use conicoid::geometry::{PointCloud, Quadric, Vec3};
use conicoid::segment::{Parameters, Segmentation, Silent, segment};

use super::support::truth::{Cloud, Random, cad, smooth};

/// Joined elliptic cylinders, separate bodies, and a machined part.
fn inputs() -> Vec<Cloud> {
    vec![
        smooth::make("chain3", 3).unwrap(),
        smooth::make("scene_10k", 3).unwrap(),
        cad::make("clevis", 3, 15_000, 0.02, true).unwrap(),
    ]
}

fn run(points: &[Vec3], threads: usize) -> Segmentation {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let cloud = PointCloud::from_points(points.to_vec());
    pool.install(|| segment(&cloud, &Parameters::default(), &Silent)).unwrap()
}

/// Largest distance, in noise sigmas, of a region's points from the partner's surface: what counts is
/// where two surfaces lie, not how well their parameters are known.
fn apart(cloud: &Cloud, labels: &[i32], label: i32, quadrics: [&Quadric; 2]) -> f64 {
    let points = cloud.points.iter().zip(labels).filter(|(_, l)| **l == label).map(|(p, _)| p);
    let difference = |p: &Vec3| (quadrics[0].distance(p) - quadrics[1].distance(p)).abs();
    points.map(difference).fold(0.0, f64::max) / cloud.sigma
}

/// Points of a region below which its surface is not compared: a few dozen points of a fillet's rest allow several.
const LEAST: usize = 100;

/// How two answers for the same points compare.
struct Comparison {
    /// Points that moved to a region that is not their old region's partner, as a share.
    moved: f64,
    /// Largest distance between partner surfaces of enough points, in noise sigmas.
    apart: f64,
}

/// Compares `second`, brought back into the frame of `first`, with it.
fn compare(cloud: &Cloud, first: &Segmentation, second: (&[i32], &[Quadric])) -> Comparison {
    let (labels, quadrics) = second;
    let mut votes: HashMap<(i32, i32), usize> = HashMap::new();
    first.labels.iter().zip(labels).for_each(|(&a, &b)| *votes.entry((a, b)).or_default() += 1);
    let partner = |a: i32| {
        let of_a = votes.iter().filter(|((first, _), _)| *first == a);
        of_a.max_by_key(|((_, b), votes)| (**votes, *b)).map(|((_, b), _)| *b)
    };
    let partners: HashMap<i32, i32> =
        (0..first.regions.len() as i32).filter_map(|a| Some((a, partner(a)?))).collect();
    let moved = first.labels.iter().zip(labels).filter(|(a, b)| match partners.get(a) {
        Some(partner) => partner != *b,
        None => **b >= 0,
    });
    let gap = |(&a, &b): (&i32, &i32)| {
        let region = &first.regions[a as usize];
        let Some(quadric) = usize::try_from(b).ok().and_then(|b| quadrics.get(b)) else {
            return f64::INFINITY;
        };
        apart(cloud, &first.labels, a, [&Quadric(region.coefficients.unwrap()), quadric])
    };
    let known = |(a, _): &(&i32, &i32)| first.regions[**a as usize].point_count >= LEAST;
    Comparison {
        moved: moved.count() as f64 / labels.len() as f64,
        apart: partners.iter().filter(known).map(gap).fold(0.0, f64::max),
    }
}

fn quadrics(result: &Segmentation) -> Vec<Quadric> {
    result.regions.iter().map(|r| Quadric(r.coefficients.unwrap())).collect()
}

fn types(result: &Segmentation) -> Vec<&'static str> {
    let mut names: Vec<_> = result.regions.iter().map(|r| r.surface_type.name()).collect();
    names.sort_unstable();
    names
}

/// A quadric of scaled or moved points, back in the original frame: x_there = factor x + shift.
fn back(quadric: &Quadric, factor: f64, shift: &Vec3) -> Quadric {
    let local = quadric.moved_to(shift);
    let powers = [2, 2, 2, 2, 2, 2, 1, 1, 1, 0].map(|p| factor.powi(p));
    let mut scaled = local.0;
    scaled.iter_mut().zip(powers).for_each(|(a, p)| *a *= p);
    Quadric(scaled)
}

/// Points that may change sides, as a share, and how far apart surfaces may lie, in sigmas: rounding moves no point
/// and surfaces by 0.01 at most, and leaves what noise tells well alone.
const SAME: (f64, f64) = (0.001, 0.03);

fn expect_same(
    what: &str,
    cloud: &Cloud,
    first: &Segmentation,
    second: &Comparison,
    regions: bool,
) {
    assert!(regions, "{} {what}: other regions or types", cloud.name);
    assert!(
        second.moved <= SAME.0,
        "{} {what}: {:.4} of the points moved",
        cloud.name,
        second.moved
    );
    assert!(
        second.apart <= SAME.1,
        "{} {what}: surfaces {:.3} sigmas apart, {} regions",
        cloud.name,
        second.apart,
        first.regions.len()
    );
}

#[test]
fn shifting_by_a_million_changes_nothing_but_rounding() {
    let shift = Vec3::new(1e6, -1e6, 1e6);
    for cloud in inputs() {
        let first = run(&cloud.points, 2);
        let there: Vec<_> = cloud.points.iter().map(|p| p + shift).collect();
        let second = run(&there, 2);
        let home: Vec<_> = quadrics(&second).iter().map(|q| back(q, 1.0, &shift)).collect();
        let comparison = compare(&cloud, &first, (&second.labels, &home));
        expect_same("shifted", &cloud, &first, &comparison, types(&first) == types(&second));
    }
}

#[test]
fn the_unit_of_length_does_not_matter() {
    for cloud in inputs() {
        let first = run(&cloud.points, 2);
        for factor in [1e-3, 1e3] {
            let there: Vec<_> = cloud.points.iter().map(|p| factor * p).collect();
            let second = run(&there, 2);
            let home: Vec<_> =
                quadrics(&second).iter().map(|q| back(q, factor, &Vec3::zeros())).collect();
            let comparison = compare(&cloud, &first, (&second.labels, &home));
            expect_same("scaled", &cloud, &first, &comparison, types(&first) == types(&second));
        }
    }
}

#[test]
fn the_pose_does_not_matter() {
    let random = &mut Random::new(5);
    for cloud in inputs() {
        let first = run(&cloud.points, 2);
        let rotation = random.rotation();
        let there: Vec<_> = cloud.points.iter().map(|p| rotation * p).collect();
        let second = run(&there, 2);
        let turned = |q: &Quadric| {
            let (e, r) = (q.e(), rotation.matrix());
            Quadric::from_parts(&(r.transpose() * e * r), &(r.transpose() * q.linear()), q.0[9])
        };
        let home: Vec<_> = quadrics(&second).iter().map(turned).collect();
        let comparison = compare(&cloud, &first, (&second.labels, &home));
        expect_same("rotated", &cloud, &first, &comparison, types(&first) == types(&second));
    }
}

#[test]
fn the_order_of_the_points_does_not_matter() {
    let random = &mut Random::new(6);
    for cloud in inputs() {
        let first = run(&cloud.points, 2);
        let mut order: Vec<usize> = (0..cloud.points.len()).collect();
        random.shuffle(&mut order);
        let there: Vec<_> = order.iter().map(|&i| cloud.points[i]).collect();
        let second = run(&there, 2);
        let mut labels = vec![-1; order.len()];
        order.iter().zip(&second.labels).for_each(|(&i, &label)| labels[i] = label);
        let comparison = compare(&cloud, &first, (&labels, &quadrics(&second)));
        expect_same("reordered", &cloud, &first, &comparison, types(&first) == types(&second));
    }
}

#[test]
fn repeated_points_get_the_label_of_their_twin() {
    for cloud in inputs() {
        let first = run(&cloud.points, 2);
        let n = cloud.points.len();
        let there = [&cloud.points[..], &cloud.points[..n / 10]].concat();
        let second = run(&there, 2);
        let other = (0..n / 10).filter(|&i| second.labels[i] != second.labels[n + i]);
        assert_eq!(other.count(), 0, "{}: a point and its copy differ", cloud.name);
        let comparison = compare(&cloud, &first, (&second.labels[..n], &quadrics(&second)));
        expect_same("repeated", &cloud, &first, &comparison, types(&first) == types(&second));
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    for cloud in inputs() {
        let bytes = |threads| {
            let result = run(&cloud.points, threads);
            (serde_json::to_vec(&result).unwrap(), result.labels)
        };
        let one = bytes(1);
        for threads in [2, 5] {
            assert!(one == bytes(threads), "{} differs on {threads} threads", cloud.name);
        }
    }
}
