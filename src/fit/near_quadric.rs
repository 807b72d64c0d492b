//! Whether any quadric comes near some points, told without a fit of each family.

use super::constrained::{cholesky, constrained_minimiser, forward};
use super::local_quadric::Sums;
use super::scaled::Scaled;
use crate::geometry::Vec3;

/// Mean square over that of the points' extent below which deviations may be rounding of the sums.
const ROUNDING: f64 = 1e-10;

/// Whether some quadric may come within `sq_reach`, mean square, of all points but `outliers` of them.
///
/// To first order distances are F / |grad F|, and Taubin's quadric has the least sum of F2 over that of its gradients'
/// squares: the least mean square distance that any quadric has, each point weighed by its gradient. The point without
/// which the least is lowest, by e2 / (1 - h) with residual e and leverage h, goes first. A quadric whose gradients
/// differ much over the points (a cone near its apex) comes nearer than that says, so `sq_reach` is to be several times
/// what is meant. Fewer points than tell a quadric always have one.
pub fn may_hold(points: &[Vec3], outliers: usize, sq_reach: f64) -> bool {
    let scaled = Scaled::of(points);
    let reach = (sq_reach / (scaled.scale * scaled.scale)).max(ROUNDING);
    let mut kept = points.to_vec();
    for left in (0..=outliers).rev() {
        if kept.len() <= LEAST {
            return true;
        }
        let sums = Sums::within(scaled, &kept);
        let gradient = sums.gradient();
        let Some(a) = constrained_minimiser(&sums.scatter, &gradient) else { return true };
        let features: Vec<_> = kept.iter().map(|p| sums.features(p)).collect();
        let sq: f64 = features.iter().map(|f| a.dot(f).powi(2)).sum();
        if sq <= reach * (gradient * a).dot(&a) {
            return true;
        }
        if left == 0 {
            return false;
        }
        let Some(l) = cholesky(&sums.scatter) else { return true };
        let share = 1.0 / kept.len() as f64;
        let gain = |f: &_| {
            let leverage = forward(&l, f).norm_squared() + share;
            a.dot(f).powi(2) / (1.0 - leverage).max(ROUNDING)
        };
        let gains = features.iter().map(gain).enumerate();
        let most = gains.max_by(|a, b| a.1.total_cmp(&b.1));
        kept.swap_remove(most.map_or(0, |m| m.0));
    }
    false
}

/// Points that any quadric may go through, and a few to tell.
const LEAST: usize = 12;

#[cfg(test)]
mod tests {
    use super::super::fits::{Random, shapes};
    use super::super::shape::Family;
    use super::*;

    /// Points near the surface of a shape, about one place of it, `reach` wide.
    fn patch(shape: &crate::fit::Shape, reach: f64, random: &mut Random) -> Vec<Vec3> {
        let onto = |mut x: Vec3| {
            for _ in 0..30 {
                let o = shape.offset(&x);
                x -= o.normal * o.distance;
            }
            x
        };
        let middle = onto(shape.origin + shape.frame * Vec3::new(4.0, 3.0, 1.0));
        let mut any = || random.normal();
        let place = |_| onto(middle + reach * Vec3::new(any(), any(), any()));
        (0..30).map(place).collect()
    }

    #[test]
    fn every_quadric_is_near_its_points_with_noise_and_a_few_outliers() {
        let random = &mut Random::new(11);
        let sigma = 0.01;
        for shape in shapes().into_iter().filter(|s| s.family != Family::Torus) {
            for reach in [0.3, 1.0, 2.0] {
                for outliers in 0..3 {
                    let mut points = patch(&shape, reach, random);
                    for p in &mut points {
                        *p += shape.offset(p).normal * (sigma * random.normal());
                    }
                    for p in points.iter_mut().take(outliers) {
                        *p += shape.offset(p).normal * random.uniform(0.1, 0.5);
                    }
                    let near = may_hold(&points, 3, 10.0 * sigma * sigma);
                    assert!(near, "{shape:?} {reach} {outliers}");
                }
            }
        }
    }

    #[test]
    fn points_of_three_planes_or_of_none_are_near_no_quadric() {
        let random = &mut Random::new(12);
        let mut corner = |_| {
            let mut p = Vec3::new(random.uniform(0.0, 1.0), random.uniform(0.0, 1.0), 0.0);
            p.swap_rows(2, (random.uniform(0.0, 3.0) as usize).min(2));
            p
        };
        let points: Vec<Vec3> = (0..40).map(&mut corner).collect();
        assert!(!may_hold(&points, 3, 1e-5));
        // Two of them are a quadric.
        let two: Vec<Vec3> = points.into_iter().filter(|p| p.x * p.y == 0.0).collect();
        assert!(may_hold(&two, 0, 1e-5));
        let mut any = || Vec3::from_fn(|_, _| random.uniform(0.0, 1.0));
        let filled: Vec<Vec3> = (0..40).map(|_| any()).collect();
        assert!(!may_hold(&filled, 3, 1e-5) && may_hold(&filled, 3, 1.0));
        assert!(may_hold(&filled[..12], 3, 0.0));
    }
}
