//! A few points of a region, for a first look at what it may have to do with surfaces elsewhere.

use crate::fit::Shape;
use crate::geometry::Vec3;
use crate::segment::median::median;

/// A few points of a region, their centre and how far they reach from it.
pub struct Glance {
    /// The points.
    pub points: Vec<Vec3>,
    /// Their centre.
    pub centre: Vec3,
    /// How far they reach from it.
    pub reach: f64,
}

impl Glance {
    /// At most so many of some points, evenly.
    pub fn of(points: &[Vec3], most: usize) -> Self {
        let m = points.len().min(most);
        let points: Vec<Vec3> = (0..m).map(|k| points[k * points.len() / m]).collect();
        let centre = points.iter().sum::<Vec3>() / m.max(1) as f64;
        let reach = points.iter().map(|x| (x - centre).norm()).fold(0.0, f64::max);
        Self { points, centre, reach }
    }

    /// A distance from a surface that no point is nearer to it than: those of two points differ by no more than the
    /// points do.
    pub fn least_distance(&self, s: &Shape) -> f64 {
        s.distance(&self.centre).abs() - self.reach
    }

    /// The typical distance from a surface.
    pub fn distance(&self, s: &Shape) -> f64 {
        let mut d: Vec<f64> = self.points.iter().map(|x| s.distance(x).abs()).collect();
        // a region may have lost its last points to its neighbours
        median(&mut d).unwrap_or(f64::INFINITY)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Family;

    #[test]
    fn no_point_is_nearer_than_the_least_distance() {
        let shape = Shape::with_axis(Family::Cylinder, Vec3::zeros(), Vec3::z(), [2.0, 0.0, 0.0]);
        let points: Vec<Vec3> = (0..300)
            .map(|k| Vec3::new(5.0 + (0.1 * f64::from(k)).sin(), 0.3, f64::from(k % 7)))
            .collect();
        let glance = Glance::of(&points, 50);
        assert_eq!(glance.points.len(), 50);
        let nearest =
            glance.points.iter().map(|p| shape.distance(p).abs()).fold(f64::INFINITY, f64::min);
        assert!(glance.least_distance(&shape) <= nearest);
        assert!(glance.distance(&shape) > 2.0 && glance.distance(&shape) < 4.1);
        assert_eq!(Glance::of(&[], 50).distance(&shape), f64::INFINITY);
    }
}
