//! Clouds of one surface whose noise hides it: neighbourhoods as wide as the noise see no normals, and wider ones bend.

use crate::fit::constant::constants;
use crate::fit::feature::{Fixed, Local, least, simplest};
use crate::fit::{Ruler, Shape};
use crate::geometry::{Mat3, Vec3};
use crate::segment::judge::parabola::{is_open, is_parabolic};
use crate::segment::judge::whiteness::{correlated, correlation};
use crate::segment::median::deviation;
use crate::segment::monitor::Monitor;
use crate::segment::objective::{ACCEPT, GOOD};
use crate::segment::prepare::even::even;
use crate::segment::prepare::place::place;
use crate::segment::prepare::scene::Scene;

constants! {
    /// Points that the surface is looked for on.
    SAMPLE: usize = 1_000, Effort("points of one fit");
    /// Share of the points that lie near a surface that is all there is.
    ALL: f64 = 0.98, Trial(0.98, 0.98);
    /// Sigmas between points whose noise is judged: nearer ones are near because their noise is alike.
    APART: f64 = 2.0, Trial(2.0, 2.0);
    /// Sigmas that a surface reaches at least in its second direction: less, and it is no wider than thick.
    WIDE: f64 = 3.0, Derived("noise reaches three sigmas");
    /// Standard deviation from the median over that from squares up to which residuals are noise.
    EVENLY: f64 = 1.13, Derived("half way from the 1 of normal residuals to the 1.28 of those spread evenly, as in a volume");
    /// Points that tell so much at least.
    FEWEST: usize = 40, Derived("the ratio of two standard deviations of so many normal residuals is off by 0.12");
}

/// The one surface of a cloud.
pub struct Whole {
    pub shape: Shape,
    /// Standard deviation of the points about it.
    pub sigma: f64,
    /// 0 for each point within four of these, else -1.
    pub labels: Vec<i32>,
}

/// The surface, of the type that tells the points in the fewest words, about which nearly all `points` scatter as noise
/// does: normal, and alike only where they are nearer to each other than it is large. None where there is none.
///
/// `noise` is what is known of it. Time of one fit, and of neighbours of points that lie as far apart as the noise.
pub fn one_surface(points: &[Vec3], noise: Option<f64>, monitor: &dyn Monitor) -> Option<Whole> {
    let m = points.len().min(SAMPLE.get());
    let few: Vec<Vec3> = (0..m).map(|k| points[place(k, m, points.len())]).collect();
    let local = Local::of(&few).ok()?;
    let kind = simplest(&local.points, &Fixed::default()).ok()?;
    let pose = least(kind, &local.points, &Fixed::default()).ok()?.pose;
    let shape = local.world(&pose).shape().filter(|s| !is_parabolic(s))?;
    let ruler = Ruler::of(&shape);
    let distances: Vec<f64> = points.iter().map(|p| ruler.distance(p)).collect();
    let freedom = m.checked_sub(shape.family.dof()).filter(|f| *f > 0)? as f64;
    let square = distances.iter().map(|d| d * d).sum::<f64>() / points.len() as f64;
    let sigma = (square * m as f64 / freedom).sqrt();
    // Whoever gives the noise means it.
    if noise.is_some_and(|given| sigma * sigma > GOOD.get() * given * given) {
        return None;
    }
    if is_open(&shape, &few, sigma) {
        return None;
    }
    let near = |d: &f64| d.abs() <= ACCEPT.get() * sigma;
    let within = distances.iter().filter(|d| near(d)).count() as f64;
    let evenly = deviation(distances.iter().copied())? > EVENLY.get() * sigma;
    if within < ALL.get() * points.len() as f64 || evenly || !is_wide(&few, sigma) {
        return None;
    }
    let labels = distances.iter().map(|d| if near(d) { 0 } else { -1 }).collect();
    is_white(points, &shape, sigma, monitor).then_some(Whole { shape, sigma, labels })
}

/// Whether points reach further than their noise in two directions.
fn is_wide(points: &[Vec3], sigma: f64) -> bool {
    let n = points.len() as f64;
    let mean = points.iter().sum::<Vec3>() / n;
    let scatter: Mat3 = points.iter().map(|p| (p - mean) * (p - mean).transpose()).sum();
    let mut variances: [f64; 3] = (scatter / n).symmetric_eigenvalues().into();
    variances.sort_by(f64::total_cmp);
    variances[1] > (WIDE.get() * sigma).powi(2)
}

/// Whether residuals of points that lie further apart than the noise have nothing in common.
fn is_white(points: &[Vec3], shape: &Shape, sigma: f64, monitor: &dyn Monitor) -> bool {
    let apart: Vec<Vec3> =
        even(points, APART.get() * sigma).into_iter().map(|k| points[k as usize]).collect();
    if apart.len() < FEWEST.get() {
        return false;
    }
    let Ok(scene) = Scene::watched(apart, monitor) else { return false };
    let all: Vec<u32> = (0..scene.len() as u32).collect();
    let own = correlation(&scene, shape, &all, sigma, |_| true);
    !correlated(own, 0.0, all.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Family;
    use crate::fit::fits::Random;
    use crate::segment::Silent;
    use crate::segment::fixtures::ordered;

    /// A slice of a stem of radius 15 and height 10, with noise of `sigma` in each coordinate.
    fn slice(n: usize, sigma: f64, random: &mut Random) -> Vec<Vec3> {
        let mut at = || {
            let (angle, height) =
                (random.uniform(0.0, std::f64::consts::TAU), random.uniform(0.0, 10.0));
            let noise = Vec3::from_fn(|_, _| sigma * random.normal());
            Vec3::new(15.0 * angle.cos(), 15.0 * angle.sin(), height) + noise
        };
        ordered(&(0..n).map(|_| at()).collect::<Vec<_>>())
    }

    #[test]
    fn a_slice_is_a_cylinder_however_dense_within_its_noise() {
        let random = &mut Random::new(7);
        for (n, sigma) in [(300, 1.0), (5_000, 1.0), (5_000, 1.4), (20_000, 1.0)] {
            let found = one_surface(&slice(n, sigma, random), None, &Silent).unwrap();
            assert_eq!(found.shape.family, Family::Cylinder, "{n} {sigma}");
            assert!((found.shape.size[0] - 15.0).abs() < 0.3, "{:?}", found.shape);
            assert!((found.sigma / sigma - 1.0).abs() < 0.1, "{}", found.sigma);
            assert!(found.labels.iter().filter(|l| **l == 0).count() > 98 * n / 100);
        }
    }

    #[test]
    fn volumes_waves_pairs_and_lines_are_no_surface() {
        let random = &mut Random::new(8);
        let mut of = |at: &dyn Fn([f64; 3], &mut Random) -> Vec3| {
            let mut one = || {
                let u = std::array::from_fn(|_| random.uniform(-1.0, 1.0));
                at(u, random)
            };
            ordered(&(0..5_000).map(|_| one()).collect::<Vec<_>>())
        };
        let volume = of(&|[x, y, z], _| Vec3::new(x, y, z));
        let ball = of(&|[x, y, z], r| Vec3::new(x, y, z).normalize() * r.uniform(0.0, 1.0).cbrt());
        let wave =
            of(&|[x, y, z], _| Vec3::new(x, y, 0.1 * (6.0 * x).sin() * (6.0 * y).cos() + 0.01 * z));
        let pair = of(&|[x, y, z], r| Vec3::new(x, y, 0.1 * z.signum() + 0.02 * r.normal()));
        let line = of(&|[x, _, _], r| Vec3::new(x, 0.05 * r.normal(), 0.05 * r.normal()));
        for (name, points) in
            [("volume", volume), ("ball", ball), ("wave", wave), ("pair", pair), ("line", line)]
        {
            assert!(one_surface(&points, None, &Silent).is_none(), "{name}");
        }
    }
}
