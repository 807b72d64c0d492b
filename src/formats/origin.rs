//! Points at exactly 0, 0, 0 that are holes.

use crate::geometry::{PointCloud, Vec3};

/// Copies from which on they are holes: programs that write no NaN put each there. Of a triangle list, whose corners stand
/// once for each triangle, they would be one corner, of which nothing is lost to speak of.
const FEWEST: usize = 10;

/// Takes out the points at exactly 0, 0, 0 where there are many; they count as skipped.
pub(super) fn take_holes(cloud: &mut PointCloud) {
    let is_hole = |p: &Vec3| *p == Vec3::zeros();
    let holes = cloud.points.iter().filter(|p| is_hole(p)).count();
    if holes < FEWEST {
        return;
    }
    let index =
        cloud.input_index.take().unwrap_or_else(|| (0..).take(cloud.points.len()).collect());
    let kept = index.into_iter().zip(&cloud.points).filter(|(_, p)| !is_hole(p));
    cloud.input_index = Some(kept.map(|(i, _)| i).collect());
    cloud.points.retain(|p| !is_hole(p));
    cloud.holes_at_origin = holes;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_points_at_the_origin_are_holes_and_a_few_are_points() {
        for (copies, holes) in [(FEWEST - 1, 0), (FEWEST, FEWEST)] {
            let mut points = vec![Vec3::zeros(); copies];
            points.insert(3, Vec3::repeat(f64::NAN));
            points.push(Vec3::new(0.0, 0.0, 1e-300));
            let mut cloud = PointCloud::from_points(points);
            take_holes(&mut cloud);
            assert_eq!((cloud.holes_at_origin, cloud.skipped()), (holes, holes + 1));
            assert_eq!(cloud.input_index.as_ref().unwrap().last(), Some(&(copies as u32 + 1)));
            assert_eq!(cloud.input_index.unwrap().len(), cloud.points.len());
        }
    }
}
