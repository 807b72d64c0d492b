//! Ellipses that are parabolas where their points lie: those of surfaces that are no ellipses there either.

use rayon::prelude::*;

use crate::fit::constant::constants;
use crate::fit::{Family, Shape, Spread};
use crate::geometry::Vec3;
use crate::segment::judge::one_quadric::one_quadric;
use crate::segment::objective::{LITTLE, MOST};
use crate::segment::partition::Partition;
use crate::segment::prepare::scene::Scene;
use crate::segment::prepare::take::take;
use crate::segment::report::uncertainty::SAMPLE;

constants! {
    /// A centre so many times further off than the points reach towards it is none that they lie around.
    FAR: f64 = 10.0, Trial(10.0, 10.0);
    /// Sigmas between two walls up to which they may be one face.
    NEAR: f64 = 5.0, Trial(4.5, 5.5);
    /// Cosine of the angle to the shortest axis up to which a wall is flat.
    FLAT: f64 = 0.98, Trial(0.98, 0.98);
    /// Semi-axes further apart than this many times are those of no ellipse.
    PARABOLIC: f64 = 25.0, Trial(25.0, 25.0);
}

/// Which of the regions of a scene are pieces of another form: ellipses as good as parabolas, most of what was found.
///
/// Growth on a parabola, or on any profile that straightens out, ends in such shapes, another one wherever it starts.
/// A true arc may be too short to tell as well, but it comes alone or with others that tell.
///
/// Where residuals go together, that is what makes a far centre known.
pub fn open(scene: &Scene, model: &Partition, groups: &[Vec<u32>], sigma: f64) -> Vec<bool> {
    let form = model.allowed > 0.0;
    let look = |(s, g): (&Shape, &Vec<u32>)| {
        if scene.cancelled() {
            return (None, false);
        }
        let points = take(scene, g, SAMPLE.get());
        let axis = far_axis(s, &points);
        let known = axis.is_some_and(|k| !form && is_known(s, k, &points, sigma));
        (axis.map(|_| points), axis.is_some() && !known)
    };
    let (far, open): (Vec<Option<Vec<Vec3>>>, Vec<bool>) =
        model.shapes.par_iter().zip(groups).map(look).unzip();
    let points: usize = groups.iter().map(Vec::len).sum();
    let within: usize = groups.iter().zip(&open).filter(|g| *g.1).map(|g| g.0.len()).sum();
    let several = form || open.iter().filter(|o| **o).count() > 1;
    if several && 2 * within > points {
        return open;
    }
    // Pieces of one quadric that is no ellipse.
    let together: Vec<Vec3> = far.iter().flatten().flatten().copied().collect();
    let pieces = far.iter().flatten().count() > 1 && one_quadric(&together, sigma).is_some();
    far.iter().map(|f| f.is_some() && pieces).collect()
}

/// The semi-axis of an elliptic shape along which its centre lies far beyond its points, if any.
fn far_axis(shape: &Shape, points: &[Vec3]) -> Option<usize> {
    let axes = match shape.family {
        Family::EllipticCylinder => 2,
        Family::Ellipsoid => 3,
        _ => return None,
    };
    (0..axes).find(|&k| {
        let axis = shape.frame.column(k);
        let along = points.iter().map(|p| (p - shape.origin).dot(&axis));
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        let (low, high) = along.fold(ends, |(low, high), x| (low.min(x), high.max(x)));
        (low + high).abs() > 2.0 * FAR.get() * (high - low)
    })
}

/// Whether points that scatter by `sigma` tell how long a semi-axis is.
fn is_known(shape: &Shape, axis: usize, points: &[Vec3], sigma: f64) -> bool {
    // The logarithms of the semi-axes are the last degrees of freedom.
    let axes = if shape.family == Family::Ellipsoid { 3 } else { 2 };
    let freedom = shape.family.dof() - axes + axis;
    let variance = Spread::of(shape, points).covariance(sigma, 1.0)[(freedom, freedom)];
    variance.is_finite() && variance.sqrt() < 1.0 / FAR.get()
}

/// Whether an elliptic shape is as good as a parabola where `points` lie, which scatter by `sigma`.
pub fn is_open(shape: &Shape, points: &[Vec3], sigma: f64) -> bool {
    far_axis(shape, points).is_some_and(|k| !is_known(shape, k, points, sigma))
}

/// Whether an elliptic shape is so long that it is a parabola where its points lie: what growth makes of an edge
/// with both its faces, or of a fillet beside its own.
pub fn is_parabolic(shape: &Shape) -> bool {
    shape.elongation() > PARABOLIC.get()
}

/// The two walls of so long an ellipse that it is flat almost everywhere: where points lie on both it is two planes at a
/// distance, or one with a step in it.
pub struct Walls<'a> {
    shape: &'a Shape,
    across: Vec3,
}

impl<'a> Walls<'a> {
    /// Those of `shape`, if it is as long as that.
    pub fn of(shape: &'a Shape) -> Option<Self> {
        let axes = if shape.family == Family::Ellipsoid { 3 } else { 2 };
        let short = (0..axes).min_by(|&i, &j| shape.size[i].total_cmp(&shape.size[j]))?;
        let across = shape.frame.column(short).into_owned();
        is_parabolic(shape).then_some(Self { shape, across })
    }

    /// Whether points that scatter by `sigma` lie on both, which are apart, and hardly any at the ends. Nearer to each other
    /// walls hold the points of one rougher face.
    ///
    /// The walls of an ellipse close towards its ends, wherever these are: apart somewhere is apart.
    pub fn hold(&self, points: &[Vec3], sigma: f64) -> bool {
        let n = points.len() as f64;
        let apart = |p: &&Vec3| self.shape.thickness(p) > NEAR.get() * sigma;
        if points.iter().filter(apart).count() as f64 <= LITTLE.get() * n {
            return false;
        }
        let flat =
            |side: f64| points.iter().filter(|p| side * self.towards(p) > FLAT.get()).count();
        let (over, under) = (flat(1.0), flat(-1.0));
        over.min(under) as f64 > LITTLE.get() * n && (over + under) as f64 > MOST.get() * n
    }

    /// Whether a point is on the one or on the other.
    pub fn side(&self, p: &Vec3) -> bool {
        self.towards(p) > 0.0
    }

    fn towards(&self, p: &Vec3) -> f64 {
        self.shape.offset(p).normal.dot(&self.across)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fits::Random;

    /// Points within `x` of an elliptic cylinder with semi-axes `a` along x and `b` along y.
    fn arc(a: f64, b: f64, x: [f64; 2], sigma: f64) -> bool {
        let random = &mut Random::new(1);
        let shape =
            Shape::with_axis(Family::EllipticCylinder, Vec3::zeros(), Vec3::z(), [a, b, 0.0]);
        let points: Vec<Vec3> = (0..3000)
            .map(|k| {
                let x = random.uniform(x[0], x[1]);
                let side = f64::from(1 - 2 * (k % 2));
                let y = side * b * (1.0 - (x / a).powi(2)).sqrt() + sigma * random.normal();
                Vec3::from(shape.frame * Vec3::new(x, y, random.uniform(0.0, 50.0)))
            })
            .collect();
        is_open(&shape, &points, sigma)
    }

    #[test]
    fn the_tip_of_a_long_ellipse_is_open_unless_its_length_is_known() {
        assert!(arc(2000.0, 200.0, [1950.0, 2000.0], 0.5));
        assert!(!arc(2000.0, 200.0, [1950.0, 2000.0], 1e-4));
    }

    #[test]
    fn arcs_of_ellipses_that_reach_towards_their_centre_are_not() {
        for x in [[-40.0, 40.0], [0.0, 10.0], [30.0, 40.0]] {
            assert!(!arc(40.0, 25.0, x, 0.05), "{x:?}");
        }
    }
}
