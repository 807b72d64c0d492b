use super::*;
use crate::fit::fits::Random;
use crate::geometry::{PointCloud, SurfaceType, Vec3};
use crate::segment::prepare::morton::{Codes, order_by};
use crate::segment::{Parameters, Segmentation, Silent, segment};

const SIGMA: f64 = 0.02;

/// A plate, a tube that stands on it, a ball and a few points anywhere; `copies` of the first ones.
fn part(n: usize, copies: usize) -> Vec<Vec3> {
    let random = &mut Random::new(11);
    let mut points: Vec<Vec3> = Vec::new();
    for k in 0..n {
        let noise = SIGMA * random.normal();
        let angle = random.uniform(0.0, std::f64::consts::TAU);
        points.push(match k % 10 {
            0..5 => Vec3::new(random.uniform(-10.0, 10.0), random.uniform(-10.0, 10.0), noise),
            5..8 => {
                let radius = 3.0 + noise;
                Vec3::new(radius * angle.cos(), radius * angle.sin(), random.uniform(0.0, 8.0))
            }
            8 => {
                let d = Vec3::new(random.normal(), random.normal(), random.normal()).normalize();
                Vec3::new(7.0, 7.0, 6.0) + (2.0 + noise) * d
            }
            _ if k % 100 == 9 => Vec3::from_fn(|_, _| random.uniform(-10.0, 10.0)),
            _ => Vec3::new(-9.0 + noise, random.uniform(-10.0, 10.0), random.uniform(1.0, 6.0)),
        });
    }
    points.extend_from_within(..copies);
    points
}

/// The cloud as it is worked on in `n` tiles, `some`-th points of which are looked at: the result, labels in the cloud's
/// order.
fn in_tiles(cloud: &[Vec3], n: usize, some: usize, parameters: &Parameters) -> Segmentation {
    let codes = Codes::of(cloud);
    let order = order_by(cloud, &codes, &Silent).unwrap();
    let mut ends: Vec<usize> = (1..=n).map(|k| k * order.len() / n).collect();
    for end in &mut ends {
        // copies stay together
        while *end < order.len() && cloud[order[*end] as usize] == cloud[order[*end - 1] as usize] {
            *end += 1;
        }
    }
    let mut from = 0;
    let mut tiles: Vec<Vec<u32>> = Vec::new();
    for end in ends {
        let mut tile = order[from..end].to_vec();
        tile.sort_unstable();
        tiles.push(tile);
        from = end;
    }
    let of = |tile: &[u32]| -> Vec<Vec3> { tile.iter().map(|&i| cloud[i as usize]).collect() };
    let sample = order.iter().step_by(some).map(|&i| cloud[i as usize]).collect();
    let sample = PointCloud::from_points(sample);
    let survey = Survey::of(&sample, &of(&tiles[0]), parameters, &Silent).unwrap();
    let through_json = |guide: Guide| -> Guide {
        let read: Guide = serde_json::from_slice(&serde_json::to_vec(&guide).unwrap()).unwrap();
        assert_eq!(read, guide);
        read
    };
    let round = |guide: &Guide| {
        let answers: Vec<Labelled> =
            tiles.iter().map(|t| label(&of(t), guide, &Silent).unwrap().unwrap()).collect();
        let mut sums = answers[0].sums.clone();
        for other in &answers[1..] {
            sums.iter_mut().zip(&other.sums).for_each(|(a, b)| a.add(b));
        }
        (answers, sums)
    };
    let (_, sums) = round(&through_json(survey.guide()));
    let judgement = survey.judged(&sums).unwrap();
    let (answers, sums) = round(&through_json(judgement.guide()));
    let distinct = answers.iter().map(|a| a.distinct).sum();
    let mut out = judgement.report(&sums, cloud.len(), distinct).unwrap();
    out.labels = vec![-1; cloud.len()];
    for (tile, answer) in tiles.iter().zip(&answers) {
        tile.iter().zip(&answer.labels).for_each(|(&i, &l)| out.labels[i as usize] = l);
    }
    out
}

/// For each region of one result that of the other which has most of its points.
fn names(tiles: &Segmentation, whole: &Segmentation) -> Vec<i32> {
    let to = |l: i32| -> i32 {
        let mut counts = vec![0; whole.regions.len()];
        let both = tiles.labels.iter().zip(&whole.labels).filter(|(a, b)| **a == l && **b >= 0);
        both.for_each(|(_, b)| counts[*b as usize] += 1);
        (0..counts.len()).max_by_key(|&k| counts[k]).unwrap() as i32
    };
    (0..tiles.regions.len() as i32).map(to).collect()
}

fn check_labels(cloud: &[Vec3], tiles: &Segmentation, whole: &Segmentation, names: &[i32]) {
    let differ: Vec<usize> = (0..cloud.len())
        .filter(|&i| {
            let l = tiles.labels[i];
            let l = if l < 0 { -1 } else { names[l as usize] };
            l != whole.labels[i]
        })
        .collect();
    // only what belongs to two surfaces, lies at the reach of one, or is of none and lies where one would go on
    for &i in differ.iter().filter(|&&i| i % 100 != 9) {
        let p = &cloud[i];
        let mut off = [
            p.z.abs(),
            (p.xy().norm() - 3.0).abs(),
            ((p - Vec3::new(7.0, 7.0, 6.0)).norm() - 2.0).abs(),
            (p.x + 9.0).abs(),
        ];
        off.sort_by(f64::total_cmp);
        let is_at_reach = (3.7..4.3).contains(&(off[0] / SIGMA));
        assert!(off[1] < 4.3 * SIGMA || is_at_reach, "{p:?} {off:?}");
    }
    assert!(differ.len() < cloud.len() / 250, "{} differ", differ.len());
}

fn check_regions(tiles: &Segmentation, whole: &Segmentation, names: &[i32]) {
    for region in &tiles.regions {
        let other = &whole.regions[names[region.id] as usize];
        let count = tiles.labels.iter().filter(|l| **l == region.id as i32).count();
        assert_eq!(region.point_count, count);
        let (a, b) = (region.fit, other.fit);
        assert!((a.rms / b.rms - 1.0).abs() < 0.1 && (a.noise / b.noise - 1.0).abs() < 0.05);
        assert!((a.max - b.max).abs() < 0.5 * SIGMA, "{} {}", a.max, b.max);
        let (a, b) = (&region.uncertainty, &other.uncertainty);
        let (a, b) = (a.as_ref().unwrap(), b.as_ref().unwrap());
        if let (Some(a), Some(b)) = (a["radius"].as_f64(), b["radius"].as_f64()) {
            assert!((a / b - 1.0).abs() < 0.1, "{a} {b}");
            let radius = |r: &crate::segment::Region| {
                serde_json::to_value(r.surface).unwrap()["radius"].as_f64().unwrap()
            };
            let apart = (radius(region) - radius(other)).abs();
            assert!(apart < 0.2 * b, "{apart} of {b}");
        }
    }
}

#[test]
fn a_cloud_in_tiles_is_answered_as_the_whole_is() {
    let cloud = part(120_000, 500);
    let parameters = Parameters::default();
    let whole = segment(&PointCloud::from_points(cloud.clone()), &parameters, &Silent).unwrap();
    for n in [1, 4, 7] {
        let tiles = in_tiles(&cloud, n, 2, &parameters);
        let types = |s: &Segmentation| -> Vec<SurfaceType> {
            let mut types: Vec<_> = s.regions.iter().map(|r| r.surface_type).collect();
            types.sort_by_key(|t| t.name());
            types
        };
        assert_eq!(types(&tiles), types(&whole), "{n}");
        let names = names(&tiles, &whole);
        check_labels(&cloud, &tiles, &whole, &names);
        check_regions(&tiles, &whole, &names);
        let (a, b) = (&tiles.unassigned, &whole.unassigned);
        assert_eq!(a.count, tiles.labels.iter().filter(|l| **l < 0).count());
        assert_eq!(a.reasons.values().sum::<usize>(), a.count);
        assert!(a.count.abs_diff(b.count) < cloud.len() / 2000, "{a:?} {b:?}");
    }
}

#[test]
fn what_needs_the_whole_cloud_is_not_worked_on_in_tiles() {
    let default = Parameters::default();
    assert!(Survey::can(&default));
    assert!(!Survey::can(&Parameters { connectivity: Some(1.0), ..default.clone() }));
    assert!(!Survey::can(&Parameters { surfaces: SurfaceType::ALL.to_vec(), ..default }));
}
