//! Points at exactly 0, 0, 0 that are holes.

use crate::geometry::{PointCloud, Vec3};

/// Copies from which on they are holes: programs that write no NaN put each there.
const FEWEST: usize = 10;
/// Other points whose copies are counted: where they have as many, all points stand there again and again.
pub(super) const COMPARED: usize = 16;

/// Takes out the points at exactly 0, 0, 0 where there are many; they count as skipped.
pub fn take_holes(cloud: &mut PointCloud) {
    let is_hole = |p: &Vec3| *p == Vec3::zeros();
    let holes = cloud.points.iter().filter(|p| is_hole(p)).count();
    if !may_be_holes(holes) || !are_holes(holes, most_copies(&cloud.points)) {
        return;
    }
    let index =
        cloud.input_index.take().unwrap_or_else(|| (0..).take(cloud.points.len()).collect());
    let kept = index.into_iter().zip(&cloud.points).filter(|(_, p)| !is_hole(p));
    cloud.input_index = Some(kept.map(|(i, _)| i).collect());
    cloud.points.retain(|p| !is_hole(p));
    cloud.holes_at_origin = holes;
}

/// Whether so many points at exactly 0, 0, 0 may be holes.
pub(super) fn may_be_holes(points: usize) -> bool {
    points >= FEWEST
}

/// Whether so many points at exactly 0, 0, 0 are holes where others have as many copies.
pub(super) fn are_holes(points: usize, copies: usize) -> bool {
    2 * copies < points
}

/// The most copies that some points elsewhere have, evenly spread over the cloud.
fn most_copies(points: &[Vec3]) -> usize {
    let others: Vec<&Vec3> = points.iter().filter(|p| **p != Vec3::zeros()).collect();
    let compared = others.len().min(COMPARED);
    let looked_at = (0..compared).map(|k| others[k * others.len() / compared]);
    let copies = looked_at.map(|at| points.iter().filter(|p| *p == at).count());
    copies.max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_that_are_all_there_as_often_are_no_holes() {
        let points = [Vec3::zeros(), Vec3::x(), Vec3::y()].repeat(3 * FEWEST);
        let mut cloud = PointCloud::from_points(points.clone());
        take_holes(&mut cloud);
        assert_eq!((cloud.holes_at_origin, &cloud.points), (0, &points));
    }

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
