use nalgebra::SymmetricEigen;

use super::constant::constants;
use super::scatter::{Matrix10, Scatter, Vector10, features};
use super::taubin::taubin_fit;
use crate::geometry::{Frame, Quadric, Vec3};

constants! {
    /// Most steps of the fit; it converges in a few.
    STEPS: usize = 30, Effort("steps of one fit");
}

/// The quadric of any type with the least orthogonal distances from `points`, from Taubin's: Gauss and
/// Newton's steps on its ten coefficients, their common factor held. Cauchy weights 1 / (1 + (r/c)2)
/// where `cauchy` gives c.
///
/// Distances are of second order, as [`Quadric::distance`]; by a coefficient they change as its feature at
/// the foot point over the gradient. `None` for points in one plane, or fewer than ten.
pub fn general_fit(points: &[Vec3], cauchy: Option<f64>) -> Option<Quadric> {
    if points.len() < 10 {
        return None;
    }
    let frame = Frame::of(points.iter().copied());
    let local: Vec<Vec3> = points.iter().map(|p| frame.local_from_world(p)).collect();
    let mut best = unit(&taubin_fit(&Scatter::of(points.iter().copied(), &frame))?);
    let cut = cauchy.map(|c| c / frame.scale);
    let mut least = cost(&best, &local, cut);
    for _ in 0..STEPS.get() {
        let next = unit(&step(&best, &local, cut)?);
        let cost = cost(&next, &local, cut);
        if cost.is_nan() || cost >= least {
            break;
        }
        let gain = (least - cost) / least;
        (best, least) = (next, cost);
        if gain < 1e-9 {
            break;
        }
    }
    Some(frame.world_quadric(&best))
}

fn unit(q: &Quadric) -> Quadric {
    Quadric((Vector10::from(q.0).normalize()).into())
}

fn cost(q: &Quadric, points: &[Vec3], cut: Option<f64>) -> f64 {
    let rho = |d: f64| cut.map_or(d * d, |c| c * c * (d * d / (c * c)).ln_1p());
    points.iter().map(|x| rho(q.distance(x))).sum()
}

/// The quadric after one step: (sum w jj') delta = -sum w j d over the nine directions that change it.
fn step(q: &Quadric, points: &[Vec3], cut: Option<f64>) -> Option<Quadric> {
    let (mut a, mut b) = (Matrix10::zeros(), Vector10::zeros());
    for x in points {
        let d = q.distance(x) * q.value(x).signum();
        let gradient = q.gradient(x).norm();
        if !(d.is_finite() && gradient > 0.0) {
            continue;
        }
        let foot = x - q.gradient(x) * (d / gradient);
        let slope = q.gradient(&foot).norm().max(1e-12);
        let j = features(&foot) / slope;
        let w = cut.map_or(1.0, |c| 1.0 / (1.0 + d * d / (c * c)));
        a += j * j.transpose() * w;
        b += j * (w * d);
    }
    // The common factor changes nothing: its eigenvalue is raised, those of the others kept.
    let own = Vector10::from(q.0);
    a += own * own.transpose() * a.trace();
    let e = SymmetricEigen::new(a);
    let floor = 1e-14 * e.eigenvalues.max();
    let solved = e.eigenvectors.tr_mul(&b).component_div(&e.eigenvalues.map(|l| l.max(floor)));
    let next = own - e.eigenvectors * solved;
    next.iter().all(|v| v.is_finite()).then(|| Quadric(next.into()))
}

#[cfg(test)]
mod tests {
    use super::super::fits::Random;
    use super::*;

    #[test]
    fn it_reaches_the_bound_of_cramer_and_rao_on_a_hyperboloid_and_a_saddle() {
        type Surface = fn(f64, f64) -> Vec3;
        let hyperboloid: Surface = |u, v| {
            let (r, a) = ((1.0 + v * v).sqrt(), 3.0 * u);
            Vec3::new(4.0 * r * a.cos(), 4.0 * r * a.sin(), 5.0 * v)
        };
        let saddle: Surface = |u, v| Vec3::new(8.0 * u, 8.0 * v, 3.0 * u * u - 2.0 * v * v);
        let (sigma, n, rounds) = (0.01, 800, 40);
        for surface in [hyperboloid, saddle] {
            let mut sum = 0.0;
            for round in 0..rounds {
                let random = &mut Random::new(round);
                let truth: Vec<Vec3> = (0..n)
                    .map(|_| surface(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)))
                    .collect();
                let mut noise = || sigma * random.normal();
                let points: Vec<Vec3> =
                    truth.iter().map(|x| x + Vec3::new(noise(), noise(), noise())).collect();
                let found = general_fit(&points, None).unwrap();
                let sq: f64 = truth.iter().map(|x| found.distance(x).powi(2)).sum();
                sum += sq / (sigma * sigma) / rounds as f64;
            }
            // Nine degrees of freedom; the mean of 40 rounds has a standard deviation of 0.7.
            assert!((sum - 9.0).abs() < 1.4, "{sum}");
        }
    }

    #[test]
    fn points_in_a_plane_or_too_few_have_no_fit() {
        let flat: Vec<Vec3> =
            (0..100).map(|k| Vec3::new(f64::from(k % 10), f64::from(k / 10), 0.0)).collect();
        assert!(general_fit(&flat[..9], None).is_none());
        assert!(general_fit(&flat, None).is_none_or(|q| q.distance(&flat[5]) < 1e-6));
    }
}
