use super::surface::FittedSurface;
use super::*;
use crate::geometry::SurfaceType;
use crate::segment::{Cancelled, Silent};

const RCOND: f64 = 1e-18;
const ALGEBRAIC: f64 = 3e-4;

/// Even numbers in 0..1, and errors of a few micrometres, from a generator of their own.
struct Draw(SplitMix64);

impl Draw {
    fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn error(&mut self) -> f64 {
        0.003 * (self.unit() + self.unit() + self.unit() - 1.5)
    }
}

/// `count` points on a circular arc about (x, z) from `start` over `sweep`, extruded along y.
fn arc(
    draw: &mut Draw,
    (x, z): (f64, f64),
    radius: f64,
    [start, sweep]: [f64; 2],
    count: usize,
) -> Vec<Vec3> {
    (0..count)
        .map(|_| {
            let (angle, r) = (start + sweep * draw.unit(), radius + draw.error());
            Vec3::new(x + r * angle.cos(), 40.0 * draw.unit() + draw.error(), z + r * angle.sin())
        })
        .collect()
}

/// Two cylinders of radius 16 and 9 that join smoothly in a point of inflexion at (100, 120), and how
/// many points the first has.
fn wave() -> (Vec<Vec3>, usize) {
    let mut draw = Draw(SplitMix64::new(1));
    let quarter = std::f64::consts::FRAC_PI_2;
    let mut points = arc(&mut draw, (100.0, 104.0), 16.0, [quarter, 1.6], 2400);
    points.extend(arc(&mut draw, (100.0, 129.0), 9.0, [-quarter, 1.8], 1600));
    (points, 2400)
}

fn parameters(seed: u64) -> Parameters {
    Parameters {
        rcond_threshold: RCOND,
        algebraic_threshold: ALGEBRAIC,
        seed,
        ..Parameters::default()
    }
}

fn run(points: Vec<Vec3>, parameters: &Parameters) -> Segmentation {
    segment(&PointCloud::from_points(points), parameters, &Silent).unwrap()
}

fn fitted(points: &[Vec3]) -> FittedSurface {
    FittedSurface::fit(points.iter().copied(), [points[0], points[1]]).unwrap()
}

#[test]
fn every_seed_separates_two_cylinders_with_a_smooth_joint() {
    let (points, first) = wave();
    for seed in 0..10 {
        let result = run(points.clone(), &parameters(seed));
        assert_eq!(result.regions.len(), 2, "seed {seed}");
        let (a, b) = (result.labels[0], result.labels[first]);
        let right = |labels: &[i32], id: i32| labels.iter().filter(|l| **l == id).count();
        assert!(a != b && right(&result.labels[..first], a) > 2300, "seed {seed}");
        assert!(right(&result.labels[first..], b) > 1500, "seed {seed}");
        for region in &result.regions {
            assert!(region.fit.rms < 0.003 && region.coefficients.unwrap()[9] == 1.0);
            let count = right(&result.labels, region.id as i32);
            assert_eq!(region.point_count, count);
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_result() {
    let (points, _) = wave();
    assert_eq!(run(points.clone(), &parameters(7)), run(points, &parameters(7)));
}

#[test]
fn a_region_grown_over_a_joint_still_yields_the_surface_it_began_on() {
    let (points, first) = wave();
    let pool = Pool::new(&points).unwrap();
    // So lax that growth takes in everything.
    let growth = Growth { criterion: RcondBelow(1.0), scale: 20.0 };
    let seed =
        (0..first as u32).max_by(|&a, &b| points[b as usize].x.total_cmp(&points[a as usize].x));
    let grown = growth.grow(&pool, seed.unwrap(), &|| false);
    assert_eq!(grown.region.members().len(), points.len());
    let whole = fitted(&points);
    let candidate = Candidate::of(grown, &pool, ALGEBRAIC, &Silent).unwrap();
    let extracted = extract(&pool, &candidate, ALGEBRAIC, &Silent).unwrap();
    assert!(extracted.surface.mean_sq_residual() < 0.1 * whole.mean_sq_residual());
    let of_first = extracted.members.iter().filter(|i| (**i as usize) < first).count();
    assert!(of_first > 2300 && extracted.members.len() < 2800, "{of_first}");
}

#[test]
fn extraction_cycles_take_in_the_whole_surface_from_a_small_start() {
    let mut draw = Draw(SplitMix64::new(2));
    let points = arc(&mut draw, (100.0, 104.0), 16.0, [0.0, 2.5], 3000);
    let pool = Pool::new(&points).unwrap();
    let growth = Growth { criterion: RcondBelow(1e-22), scale: 20.0 };
    let candidate =
        Candidate::of(growth.grow(&pool, 0, &|| false), &pool, ALGEBRAIC, &Silent).unwrap();
    let start = candidate.grown.region.members().len();
    let extracted = extract(&pool, &candidate, ALGEBRAIC, &Silent).unwrap();
    assert!(start < 2000 && extracted.members.len() == 3000, "{start}");
    assert!(!extracted.cycles.is_empty());
    assert_eq!(start + extracted.cycles.iter().sum::<usize>(), 3000);
}

#[test]
fn an_over_segmented_cylinder_is_merged_and_others_are_not() {
    let mut draw = Draw(SplitMix64::new(3));
    let left = arc(&mut draw, (100.0, 104.0), 16.0, [0.0, 1.2], 1000);
    let right = arc(&mut draw, (100.0, 104.0), 16.0, [1.2, 1.2], 1000);
    let other = arc(&mut draw, (140.0, 104.0), 12.0, [0.0, 2.0], 1000);
    let mut found = Found {
        surfaces: vec![fitted(&left), fitted(&other), fitted(&right)],
        labels: [0, 1, 2].into_iter().flat_map(|l| [l; 1000]).collect(),
        ..Found::default()
    };
    let points = [left, other, right].concat();
    merge(&mut found, &points, ALGEBRAIC, &Silent);
    assert_eq!((found.surfaces.len(), found.counters.merges), (2, 1));
    let expected: Vec<i32> = [0, 1, 0].into_iter().flat_map(|l| [l; 1000]).collect();
    assert_eq!(found.labels, expected);
    let alone = found.surfaces[0];
    assert_eq!(alone.scatter.count(), 2000.0);
    assert!(points[..1000].iter().all(|p| alone.residual_within(p, ALGEBRAIC).is_some()));
}

#[test]
fn points_that_the_first_region_took_over_a_joint_go_back() {
    let (points, first) = wave();
    let leaked = points.iter().zip(0..).map(|(p, i)| {
        let over_the_joint = i >= first && p.x < 102.0;
        i32::from(i >= first && !over_the_joint)
    });
    let mut found = Found {
        surfaces: vec![fitted(&points[..first]), fitted(&points[first..])],
        labels: leaked.collect(),
        ..Found::default()
    };
    let wrong =
        |labels: &[i32]| (0..points.len()).filter(|&i| labels[i] != i32::from(i >= first)).count();
    assert!(wrong(&found.labels) > 100);
    refine(&mut found, &points, &parameters(0), &Silent);
    assert!(wrong(&found.labels) < 60, "{}", wrong(&found.labels));
}

#[test]
fn points_in_a_box_are_no_region_and_the_search_stops() {
    let mut draw = Draw(SplitMix64::new(4));
    let points = (0..2000).map(|_| Vec3::from_fn(|_, _| 100.0 + 50.0 * draw.unit())).collect();
    let result =
        segment(&PointCloud::from_points(points), &Parameters::default(), &Silent).unwrap();
    assert_eq!((result.regions.len(), result.unassigned.count), (0, 2000));
    assert_eq!(result.counters.trials, result.counters.failed_trials);
    assert!(result.counters.trials >= 50);
}

#[test]
fn a_sphere_is_reported_with_its_centre_and_radius() {
    let mut draw = Draw(SplitMix64::new(5));
    let center = Vec3::new(80.0, 90.0, 100.0);
    let points = (0..2000)
        .map(|_| {
            let z = 0.2 + 0.8 * draw.unit();
            let angle = std::f64::consts::TAU * draw.unit();
            let s = (1.0_f64 - z * z).sqrt();
            center + (15.0 + draw.error()) * Vec3::new(s * angle.cos(), s * angle.sin(), z)
        })
        .collect();
    let result = run(points, &parameters(0));
    let [region] = &result.regions[..] else { panic!("{} regions", result.regions.len()) };
    assert_eq!(region.surface_type, SurfaceType::Sphere);
    let Some(crate::geometry::Surface::Sphere(s)) = region.surface else { panic!() };
    assert!((s.center - center).norm() < 0.01 && (s.radius - 15.0).abs() < 0.01);
}

#[test]
fn a_surface_through_the_origin_is_found_and_scaled_to_unit_length() {
    let points = (0..1500)
        .map(f64::from)
        .map(|i| {
            let angle = std::f64::consts::TAU * (i * 0.618_034).fract();
            Vec3::new(8.0 * (1.0 + angle.cos()), 30.0 * (i * 0.414_214).fract(), 8.0 * angle.sin())
        })
        .collect();
    let result = run(points, &parameters(0));
    let [region] = &result.regions[..] else { panic!("{} regions", result.regions.len()) };
    assert_eq!(region.coefficients_scale, Some(crate::geometry::Scale::Unit));
    assert_eq!((region.surface_type, region.point_count), (SurfaceType::Cylinder, 1500));
}

#[test]
fn a_cancelled_run_says_so() {
    struct Cancel;
    impl Monitor for Cancel {
        fn progress(&self, _: Stage, _: f64) {}
        fn cancelled(&self) -> bool {
            true
        }
    }
    let result = segment(&PointCloud::from_points(wave().0), &parameters(0), &Cancel);
    assert_eq!(result, Err(SegmentError::Cancelled(Cancelled)));
}
