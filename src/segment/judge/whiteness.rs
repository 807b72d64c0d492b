//! Whether the residuals of neighbours go together.

use crate::fit::constant::constants;
use crate::fit::{Ruler, Shape};
use crate::segment::objective::{CHANCE, CORRELATED, PART, SLIGHT};
use crate::segment::prepare::scene::Scene;

constants! {
    /// Neighbours whose residuals are compared with a point's.
    AROUND: usize = 6, Derived("a point has six neighbours in a triangulation of a surface");
    /// Points whose residuals are compared with their neighbours'.
    SAMPLE: usize = 600, Effort("points looked at");
}

/// Whether a correlation of the residuals of `n` points is more than chance and what is `common` to all surfaces give.
pub fn correlated(correlation: f64, common: f64, n: usize) -> bool {
    correlation > common + 3.0 * CORRELATED.get() + CHANCE.get() / (n.max(1) as f64).sqrt()
}

/// The mean product of neighbouring residuals over their mean square, on a sample of `support`: near 0
/// for a surface that explains its points, towards 1 where a form error is left. 0 where residuals
/// are far below `sigma`, so that rounding does not count as form.
///
/// Only neighbours that are `inside` the support count: those beyond a joint lie on one side.
pub fn correlation(
    scene: &Scene,
    shape: &Shape,
    support: &[u32],
    sigma: f64,
    inside: impl Fn(u32) -> bool,
) -> f64 {
    let ruler = Ruler::of(shape);
    let m = support.len().min(SAMPLE.get());
    // Strips of other faces that lie within reach along an edge say nothing about this one: its
    // interior does, where it has one.
    let (mut all, mut interior) = (Products::default(), Products::default());
    for k in 0..m {
        let i = support[k * support.len() / m] as usize;
        let r = ruler.distance(&scene.points[i]);
        let around = &scene.neighbours(i)[..AROUND.get()];
        let (mut sum, mut near) = (0.0, 0);
        for &j in around {
            if inside(j) {
                sum += ruler.distance(&scene.points[j as usize]);
                near += 1;
            }
        }
        let sq_reach =
            (scene.points[around[AROUND.get() - 1] as usize] - scene.points[i]).norm_squared();
        if near > 0 {
            all.add(r, sum / near as f64, sq_reach);
        }
        if near == AROUND.get() {
            interior.add(r, sum / near as f64, sq_reach);
        }
    }
    if f64::from(interior.count) > PART.get() * f64::from(all.count) { interior } else { all }
        .correlation(sigma)
}

/// Sums of products of residuals.
#[derive(Clone, Copy, Default)]
struct Products {
    product: f64,
    square: f64,
    /// Inverse squares of the neighbourhoods' radii.
    inverse_sq: f64,
    count: u32,
}

impl Products {
    fn add(&mut self, r: f64, around: f64, sq_reach: f64) {
        self.product += r * around;
        self.square += r * r;
        self.inverse_sq += 1.0 / sq_reach.max(f64::MIN_POSITIVE);
        self.count += 1;
    }

    /// What of the products is not due to how neighbours are chosen.
    ///
    /// Of points whose noise comes to a good part of their spacing the nearest are those with like residuals: a
    /// point at height z over the surface finds those at z' within a circle of area pi (R2 - (z - z')2), so
    /// E[z' | z] = 2 z s2 / R2 to first order in s2 / R2.
    fn correlation(&self, sigma: f64) -> f64 {
        let count = f64::from(self.count.max(1));
        let mean_sq = self.square / count;
        if mean_sq.sqrt() < SLIGHT.get() * sigma {
            return 0.0;
        }
        let chosen = 2.0 * mean_sq * self.inverse_sq / count;
        // Written so that points all but on top of each other give 1.
        self.product / self.square - 1.0 / (1.0 + 1.0 / chosen)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Family;
    use crate::fit::fits::Random;
    use crate::geometry::Vec3;

    #[test]
    fn noise_of_a_thick_sheet_is_not_correlated_and_a_wave_is() {
        let mut random = Random::new(8);
        let plane = Shape::with_axis(Family::Plane, Vec3::zeros(), Vec3::z(), [0.0; 3]);
        let (n, side) = (4000, 63.0);
        for sigma in [0.05, 0.3, 0.6] {
            let mut points = |wave: f64| -> Vec<Vec3> {
                let mut at = |_| {
                    let (x, y) = (random.uniform(0.0, side), random.uniform(0.0, side));
                    Vec3::new(x, y, sigma * random.normal() + wave * sigma * (x / 6.0).sin())
                };
                (0..n).map(&mut at).collect()
            };
            let mut measured = |wave| {
                let scene = Scene::new(points(wave));
                let all: Vec<u32> = (0..n as u32).collect();
                correlation(&scene, &plane, &all, sigma, |_| true)
            };
            assert!(measured(0.0).abs() < 0.06, "{sigma}: {}", measured(0.0));
            assert!(measured(1.0) > 0.15, "{sigma}: {}", measured(1.0));
        }
    }
}
