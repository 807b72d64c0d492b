//! Whether the residuals of neighbours go together.

use crate::fit::{Ruler, Shape};
use crate::segment::prepare::candidates::K;
use crate::segment::prepare::scene::Scene;

/// Correlation times the root of the number of points that chance seldom exceeds.
pub const CHANCE: f64 = 1.5;

/// Whether a correlation of residuals is more than chance gives for `n` points.
pub fn correlated(correlation: f64, n: usize) -> bool {
    correlation > 0.15 + CHANCE / (n.max(1) as f64).sqrt()
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
    let products = products(scene, shape, support, 0, inside);
    // Of points whose noise comes to a good part of their spacing the nearest are those with like residuals.
    products.correlation(sigma, products.chosen())
}

/// The same with neighbours that are further off: beyond what a row of points, or software that averages a few of
/// them, has in common, but not what a form error has. Which of the neighbours they are does not depend on residuals.
pub fn far_correlation(
    scene: &Scene,
    shape: &Shape,
    support: &[u32],
    sigma: f64,
    inside: impl Fn(u32) -> bool,
) -> f64 {
    products(scene, shape, support, K - AROUND, inside).correlation(sigma, 0.0)
}

/// Products of residuals of a sample of `support` with those of neighbours, the `first` nearest left out.
fn products(
    scene: &Scene,
    shape: &Shape,
    support: &[u32],
    first: usize,
    inside: impl Fn(u32) -> bool,
) -> Products {
    let ruler = Ruler::of(shape);
    let m = support.len().min(600);
    // Strips of other faces that lie within reach along an edge say nothing about this one: its
    // interior does, where it has one.
    let (mut all, mut interior) = (Products::default(), Products::default());
    for k in 0..m {
        let i = support[k * support.len() / m] as usize;
        let r = ruler.distance(&scene.points[i]);
        let around = &scene.neighbours(i)[first..first + AROUND];
        let (mut sum, mut near) = (0.0, 0);
        for &j in around {
            if inside(j) {
                sum += ruler.distance(&scene.points[j as usize]);
                near += 1;
            }
        }
        let sq_reach = (scene.points[around[AROUND - 1] as usize] - scene.points[i]).norm_squared();
        if near > 0 {
            all.add(r, sum / near as f64, sq_reach);
        }
        if near == AROUND {
            interior.add(r, sum / near as f64, sq_reach);
        }
    }
    if interior.count * 4 > all.count { interior } else { all }
}

/// Neighbours whose residuals are compared with a point's.
const AROUND: usize = 6;

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

    /// What of the products is due to how the nearest neighbours are chosen, over the squares.
    ///
    /// A point at height z over the surface finds those at z' within a circle of area pi (R2 - (z - z')2), so
    /// E[z' | z] = 2 z s2 / R2 to first order in s2 / R2.
    fn chosen(&self) -> f64 {
        let count = f64::from(self.count.max(1));
        let chosen = 2.0 * self.square / count * self.inverse_sq / count;
        // Written so that points all but on top of each other give 1.
        1.0 / (1.0 + 1.0 / chosen)
    }

    /// The products over the squares, without what is due to the choice; nought where residuals are far below `sigma`.
    fn correlation(&self, sigma: f64, chosen: f64) -> f64 {
        let mean_sq = self.square / f64::from(self.count.max(1));
        if mean_sq.sqrt() < 0.3 * sigma {
            return 0.0;
        }
        self.product / self.square - chosen
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Family;
    use crate::fit::fits::Random;
    use crate::geometry::Vec3;

    #[test]
    fn noise_that_a_row_has_in_common_is_near_and_a_wave_is_far() {
        let mut random = Random::new(9);
        let plane = Shape::with_axis(Family::Plane, Vec3::zeros(), Vec3::z(), [0.0; 3]);
        let mut measured = |row: f64, wave: f64| {
            let mut points = Vec::new();
            for y in 0..80 {
                let own = row * random.normal();
                for x in 0..160 {
                    let (x, y) = (0.5 * f64::from(x) + 0.2 * random.normal(), f64::from(y));
                    let z = own + random.normal() + wave * (x / 6.0).sin();
                    points.push(Vec3::new(x, y, 0.01 * z));
                }
            }
            let scene = Scene::new(crate::segment::fixtures::ordered(&points));
            let all: Vec<u32> = (0..scene.len() as u32).collect();
            let of = |f: fn(&Scene, &Shape, &[u32], f64, fn(u32) -> bool) -> f64| {
                f(&scene, &plane, &all, 0.01, |_| true)
            };
            (of(correlation), of(far_correlation))
        };
        let (near, far) = measured(0.8, 0.0);
        assert!(near > 0.1 && far < 0.5 * near, "{near} {far}");
        let (near, far) = measured(0.0, 1.0);
        assert!(near > 0.2 && far > 0.7 * near, "{near} {far}");
    }

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
