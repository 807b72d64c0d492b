//! Whether the sum of squares rises beside an estimate as its uncertainty says.
//!
//! An uncertainty from derivatives at the estimate is that of a sum of squares that rises as a parabola. On short arcs the estimate may
//! lie where the sum bends and then hardly rises for a long way: then the truth lies far outside. So the profile of the
//! sum is looked at, each size in turn held beside its estimate and the rest fitted anew (D. M. Bates, D. G. Watts, *Nonlinear regression
//! analysis and its applications*, 1988, ch. 6).

use nalgebra::DMatrix;

use super::descend::{Freedoms, descend};
use super::kind::FeatureType;
use super::pose::{Pose, SLOTS};
use crate::geometry::Vec3;

/// Standard uncertainties of an expanded uncertainty, in the test.
const K: f64 = 2.0;
/// Where the profile is looked at, in expanded uncertainties: by there it must have risen as a parabola does within one.
const AT: f64 = 1.5;
/// Share of a size below which a standard uncertainty is small: what bends is then so nearly a parabola that it is not looked at.
const SMALL: f64 = 0.01;
/// Most points that it is looked at on: some stand for more.
const MOST: usize = 2000;

/// The sizes, as numbers among the open places, that the points tell less well than `covariance` says, which is that of the open places of
/// `pose`; `sq` is, for each, what the sum of squares rises by within one standard uncertainty.
pub fn untold(
    pose: &Pose,
    points: &[Vec3],
    free: &Freedoms,
    covariance: &DMatrix<f64>,
    sq: impl Fn(usize) -> f64,
) -> Vec<usize> {
    let is_in_doubt = |&(a, slot): &(usize, usize)| {
        let of_size = if is_angle(pose, slot) { 1.0 } else { pose.size[slot - 6].abs() };
        covariance[(a, a)].sqrt() > SMALL * of_size
    };
    // the radius of a cone beside its points is none of its parameters
    let is_size =
        |(_, slot): &(usize, usize)| *slot >= 6 && !(pose.kind == FeatureType::Cone && *slot == 6);
    let sizes = free.slots().iter().copied().enumerate().filter(is_size);
    let doubtful: Vec<(usize, usize)> = sizes.filter(is_in_doubt).collect();
    if doubtful.is_empty() {
        return Vec::new();
    }
    let stride = points.len().div_ceil(MOST);
    let some: Vec<Vec3> = points.iter().step_by(stride).copied().collect();
    let share = points.len() as f64 / some.len() as f64;
    // some points' own minimum is another than that of all
    let Some(here) = descend(pose, &some, free, STEPS, GAIN) else { return Vec::new() };
    let rises = |a: usize, slot: usize, side: f64| {
        let by = side * AT * K * covariance[(a, a)].sqrt();
        let mut step = [0.0; SLOTS];
        for (b, &other) in free.slots().iter().enumerate() {
            step[other] = covariance[(b, a)] / covariance[(a, a)] * by;
        }
        // beyond zero there is none, so it has risen without end
        let Some(start) = here.pose.stepped(&step) else { return true };
        let rest = Freedoms::of(free.slots().iter().copied().filter(|other| *other != slot));
        let there = descend(&start, &some, &rest, STEPS, GAIN);
        there.is_none_or(|there| (there.cost - here.cost) * share >= K * K * sq(a))
    };
    let is_untold = |&(a, slot): &(usize, usize)| !rises(a, slot, 1.0) || !rises(a, slot, -1.0);
    doubtful.iter().filter(|size| is_untold(size)).map(|s| s.0).collect()
}

fn is_angle(pose: &Pose, slot: usize) -> bool {
    pose.kind == FeatureType::Cone && slot == 7
}

/// Steps of one descent, and the share of its cost that ends it.
const STEPS: usize = 40;
const GAIN: f64 = 1e-7;

#[cfg(test)]
mod tests {
    use super::super::assess::assess;
    use super::super::{Asked, Association, Fixed};
    use super::*;
    use crate::fit::fits::Random;

    /// A piece of an elliptic cylinder, 10 and 6, seen over so many radians.
    fn piece(n: usize, arc: f64, noise: f64, random: &mut Random) -> Vec<Vec3> {
        let point = |_| {
            let t = random.uniform(-0.5, 0.5) * arc;
            let normal = Vec3::new(t.cos() / 10.0, t.sin() / 6.0, 0.0).normalize();
            let at = Vec3::new(10.0 * t.cos(), 6.0 * t.sin(), random.uniform(0.0, 20.0));
            at + normal * (noise * random.normal())
        };
        (0..n).map(point).collect()
    }

    /// On a short arc half of the estimates that seemed to be told were further off than twice their uncertainty.
    #[test]
    fn semi_axes_are_told_where_they_are_as_exact_as_they_say_and_else_not() {
        for (degrees, noise, expected) in
            [(60.0_f64, 0.1, 0.0), (45.0, 0.02, 0.0), (120.0, 0.1, 1.0)]
        {
            let (rounds, mut told, mut covered) = (30, 0, 0);
            for seed in 0..rounds {
                let points = piece(1000, degrees.to_radians(), noise, &mut Random::new(seed));
                let asked = Asked {
                    kind: Some(FeatureType::EllipticCylinder),
                    association: Association::Gaussian,
                    fixed: Fixed::default(),
                    outliers: None,
                    type_b: 0.0,
                    coverage: 0.9545,
                };
                let Ok(found) = assess(&points, &asked) else { continue };
                let exactness = found.exactness.unwrap();
                let axes = exactness.parameters.iter().find(|p| p.name == "semi_axes");
                told += usize::from(axes.is_some());
                assert_eq!(axes.is_none(), found.unknown.contains(&"semi_axes"));
                covered += usize::from(axes.is_some_and(|p| {
                    let off = |k: usize, truth: f64| (p.values[k] - truth).abs() < p.expanded[k];
                    off(0, 10.0) && off(1, 6.0)
                }));
            }
            let share = told as f64 / rounds as f64;
            assert!((share - expected).abs() < 0.1, "{degrees}: told {share}");
            assert!(covered as f64 >= 0.8 * told as f64, "{degrees}: {covered} of {told}");
        }
    }
}
