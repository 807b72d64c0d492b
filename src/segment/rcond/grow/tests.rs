use super::*;
use crate::fit::Condition;
use crate::geometry::{Frame, Vec3};

/// Points at 0, 1, 2, ... on the x axis.
fn line(count: u32) -> Pool {
    let points: Vec<_> = (0..count).map(|i| Vec3::new(f64::from(i), 0.0, 0.0)).collect();
    Pool::new(&points).unwrap()
}

/// A region to which each of `seeds` brought these points in this order.
fn region(pool: &Pool, seeds: &[&[u32]]) -> Region {
    let frame = Frame { origin: Vec3::zeros(), scale: 1.0 };
    let mut region = Region::new(pool, Condition::new(frame));
    for points in seeds {
        region.begin_seed();
        for &i in *points {
            let condition = region.condition().with(pool.point(i));
            region.add(i, condition);
        }
    }
    region
}

#[test]
fn strategy_1_goes_half_way_between_the_marker_and_the_point_farthest_from_it() {
    let pool = line(30);
    // Marker 20 is the 8th point; 2, the farthest of the current seed's, the 2nd: (2 + 8)/2 = 5.
    let grown = region(&pool, &[&[0, 1], &[10, 2, 11, 9, 12, 8, 13]]);
    assert_eq!(Halfway.next_seed(&pool, &grown, 20), Some(12));
    // 7th point and 8th: 7.5 rounds to the marker, and the point before it stands in.
    let grown = region(&pool, &[&[10, 11, 9, 12, 8, 13, 7]]);
    assert_eq!(Halfway.next_seed(&pool, &grown, 20), Some(7));
}

#[test]
fn strategy_2_goes_to_the_point_of_the_whole_region_farthest_from_the_marker() {
    let pool = line(30);
    let grown = region(&pool, &[&[5, 4, 6], &[10, 11, 9]]);
    assert_eq!(Farthest.next_seed(&pool, &grown, 20), Some(4));
    assert_eq!(Farthest.next_seed(&pool, &grown, 0), Some(11));
}

#[test]
fn strategy_3_goes_to_the_point_five_before_the_marker() {
    let pool = line(30);
    let grown = region(&pool, &[&[0, 1, 2], &[10, 11, 9, 12, 8, 13, 7]]);
    assert_eq!(NearMarker.next_seed(&pool, &grown, 20), Some(9));
    let few = region(&pool, &[&[0, 1, 2], &[10, 11, 9]]);
    assert_eq!(NearMarker.next_seed(&pool, &few, 20), Some(10));
}

#[test]
fn a_region_without_points_has_no_next_seed() {
    let (pool, strategies) = (line(3), [&Halfway as &dyn Reseed, &Farthest, &NearMarker]);
    let empty = region(&pool, &[]);
    assert!(strategies.iter().all(|s| s.next_seed(&pool, &empty, 1).is_none()));
}

/// A strip of a cylinder, 2400 points with errors of micrometres, 80 mm long from y = 0.
fn strip() -> Vec<Vec3> {
    (0..2400)
        .map(f64::from)
        .map(|i| {
            let angle = 1.0 + 1.2 * (i * 0.618_034).fract();
            let r = 20.0 + 0.003 * (i * 78.233).sin();
            Vec3::new(
                100.0 + r * angle.cos(),
                80.0 * (i * 0.414_214).fract(),
                90.0 + r * angle.sin(),
            )
        })
        .collect()
}

fn grow_from(points: &[Vec3], near: Vec3) -> Grown {
    let pool = Pool::new(points).unwrap();
    let sq_dist = |i: u32| (pool.point(i) - near).norm_squared();
    let seed = (0..pool.len() as u32).min_by(|&a, &b| sq_dist(a).total_cmp(&sq_dist(b)));
    let growth = Growth { criterion: RcondBelow(1e-18), scale: 25.0 };
    growth.grow(&pool, seed.unwrap(), &|| false)
}

#[test]
fn growth_takes_in_a_clean_surface_without_a_new_seed() {
    let grown = grow_from(&strip(), Vec3::new(100.0, 40.0, 110.0));
    assert_eq!((grown.region.members().len(), grown.strategies), (2400, [0, 0, 0]));
}

#[test]
fn new_seeds_lead_growth_past_a_point_that_is_not_of_the_surface() {
    let mut points = strip();
    points.push(Vec3::new(100.0, 32.0, 104.0));
    let grown = grow_from(&points, Vec3::new(100.0, 40.0, 110.0));
    let foreign = points.len() as u32 - 1;
    assert!(!grown.region.contains(foreign));
    assert!(grown.strategies.iter().sum::<usize>() > 0);
    assert!(grown.region.members().len() > 1500, "{}", grown.region.members().len());
}
