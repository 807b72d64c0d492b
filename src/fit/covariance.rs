//! How exactly a fit is known.

use nalgebra::DMatrix;

use super::columns::Columns;
use super::constant::constants;
use super::normal::Normal;
use super::shape::{MAX_DOF, Shape};
use crate::geometry::Vec3;

/// Combinations of freedoms that the points tell worse than this share of the best count as known that
/// badly, so that variances are large there and yet finite.
const LEAST_INFORMATION: f64 = 1e-13;
constants! {
    /// Runs of consecutive points whose gradients are summed apart.
    BLOCKS: usize = 256, Effort("sums kept apart");
    /// Fewer blocks than this tell nothing about correlation.
    LEAST_BLOCKS: usize = 16, Derived("a variance is known to sqrt(2 / 16), a third, from so many");
    /// Standard deviations by which correlated residuals must stand out.
    SURE: f64 = 3.0, Derived("three standard deviations: chance exceeds them once in 370");
}

/// What points tell about a shape: J'J, and J'r of each of up to 256 runs of consecutive points, J the
/// derivatives of the distances r by the degrees of freedom.
pub struct Spread {
    information: DMatrix<f64>,
    gradients: Vec<[f64; MAX_DOF]>,
}

impl Spread {
    /// That of `points` about `shape`, in the order of [`Shape::distance_jacobian`]. Consecutive points
    /// should lie near each other, as along a Morton curve.
    pub fn of(shape: &Shape, points: &[Vec3]) -> Self {
        let p = shape.family.dof();
        let mut information = DMatrix::zeros(p, p);
        let mut columns = Columns::default();
        let mut gradient = |run: &[Vec3]| {
            columns.clear();
            columns.extend(run, 1.0);
            columns.fill_up();
            let sums = Normal::of(shape, &columns);
            for a in 0..p {
                for b in 0..=a {
                    information[(a, b)] += sums.jj[a][b];
                }
            }
            sums.jr
        };
        let run = points.len().div_ceil(BLOCKS.get()).max(1);
        let gradients = points.chunks(run).map(&mut gradient).collect();
        information.fill_upper_triangle_with_lower_triangle();
        Self { information, gradients }
    }

    /// Covariance of the degrees of freedom: sigma2 (J'J)^-1, times what correlated residuals add, where
    /// each of the points stands for `share` like it. Very large, and finite, where the points do not
    /// determine the shape.
    pub fn covariance(&self, sigma: f64, share: f64) -> DMatrix<f64> {
        let inverse = inverse(&self.information);
        let inflation = 1.0 + share * self.correlation(&inverse, sigma);
        inverse * (sigma * sigma * inflation / share)
    }

    /// [`covariance`](Self::covariance) of the degrees of freedom that are `free`, where the others are known: their rows
    /// and columns are zero.
    pub fn covariance_of(&self, free: &[bool; MAX_DOF], sigma: f64, share: f64) -> DMatrix<f64> {
        let p = self.information.nrows();
        let kept: Vec<usize> = (0..p).filter(|&a| free[a]).collect();
        if kept.len() == p {
            return self.covariance(sigma, share);
        }
        let q = kept.len();
        let information = DMatrix::from_fn(q, q, |a, b| self.information[(kept[a], kept[b])]);
        let of_kept = |g: &[f64; MAX_DOF]| {
            let mut own = [0.0; MAX_DOF];
            kept.iter().enumerate().for_each(|(k, &a)| own[k] = g[a]);
            own
        };
        let gradients = self.gradients.iter().map(of_kept).collect();
        let mut all = DMatrix::zeros(p, p);
        if q > 0 {
            let part = Self { information, gradients }.covariance(sigma, share);
            for (a, b) in (0..q).flat_map(|a| (0..q).map(move |b| (a, b))) {
                all[(kept[a], kept[b])] = part[(a, b)];
            }
        }
        all
    }

    /// How many times more than independent residuals of deviation `sigma` would, the residuals shake the
    /// parameters, where each of the points stands for `share` like it; at least 1.
    pub fn inflation(&self, sigma: f64, share: f64) -> f64 {
        1.0 + share * self.correlation(&inverse(&self.information), sigma)
    }

    /// How much more than independent residuals would, runs of residuals shake the parameters: the mean
    /// over the degrees of freedom of the variance from sums over runs (White's and Liang and Zeger's
    /// sandwich) over sigma2 (J'J)^-1, less 1; the largest over lengths of runs, 0 where it may be chance.
    ///
    /// Form error is the same for all points nearby, and more points do not average it out.
    fn correlation(&self, inverse: &DMatrix<f64>, sigma: f64) -> f64 {
        let p = inverse.nrows();
        // g' (J'J)^-1 g
        let square = |g: &[f64; MAX_DOF]| {
            let row = |a: usize| (0..p).map(|b| inverse[(a, b)] * g[b]).sum::<f64>();
            (0..p).map(|a| g[a] * row(a)).sum::<f64>()
        };
        let add =
            |pair: &[[f64; MAX_DOF]]| std::array::from_fn(|a| pair.iter().map(|g| g[a]).sum());
        let mut runs = self.gradients.clone();
        let mut most = 0.0_f64;
        while runs.len() >= LEAST_BLOCKS.get() {
            let m = runs.len() as f64;
            let sum: f64 = runs.iter().map(square).sum();
            let excess = sum * m / (m - 1.0) / (p as f64 * sigma * sigma) - 1.0;
            if excess > SURE.get() * (2.0 / (m * p as f64)).sqrt() {
                most = most.max(excess);
            }
            runs = runs.chunks(2).map(add).collect();
        }
        most
    }
}

/// Inverse of a symmetric matrix scaled to a unit diagonal, small eigenvalues raised.
fn inverse(a: &DMatrix<f64>) -> DMatrix<f64> {
    let top = a.diagonal().max().max(1e-300);
    let scale = a.diagonal().map(|d| 1.0 / d.max(1e-30 * top).sqrt());
    let scaled = |m: &DMatrix<f64>| m.map_with_location(|i, j, v| v * scale[i] * scale[j]);
    let e = scaled(a).symmetric_eigen();
    let reciprocal = e.eigenvalues.map(|l| 1.0 / l.max(LEAST_INFORMATION));
    let diagonal = DMatrix::from_diagonal(&reciprocal);
    scaled(&(&e.eigenvectors * diagonal * e.eigenvectors.transpose()))
}

#[cfg(test)]
mod tests {
    use super::super::fits::Random;
    use super::super::least_squares::{Options, fit};
    use super::super::shape::Family;
    use super::*;

    fn tube() -> Shape {
        Shape::with_axis(Family::Cylinder, Vec3::zeros(), Vec3::z(), [10.0, 0.0, 0.0])
    }

    /// `n` points along a quarter tube, 20 long, in runs of neighbours; `wave` is the height of a form error
    /// with three periods round the quarter, at phase `phase`.
    fn quarter(n: usize, noise: f64, wave: f64, phase: f64, random: &mut Random) -> Vec<Vec3> {
        let point = |k: usize| {
            let angle = k as f64 / n as f64 * std::f64::consts::FRAC_PI_2;
            let r = 10.0 + wave * (12.0 * angle + phase).sin() + noise * random.normal();
            Vec3::new(r * angle.cos(), r * angle.sin(), random.uniform(-10.0, 10.0))
        };
        (0..n).map(point).collect()
    }

    #[test]
    fn independent_noise_gives_sigma2_over_the_information() {
        let random = &mut Random::new(1);
        let points = quarter(2000, 0.01, 0.0, 0.0, random);
        let mut sum = nalgebra::SMatrix::<f64, 5, 5>::zeros();
        let shape = tube();
        for x in &points {
            let mut j = [0.0; MAX_DOF];
            shape.distance_jacobian(x, &mut j);
            let j = nalgebra::SVector::<f64, 5>::from_column_slice(&j[..5]);
            sum += j * j.transpose();
        }
        let expected = sum.try_inverse().unwrap() * 1e-4;
        let found = Spread::of(&shape, &points).covariance(0.01, 1.0);
        for (a, b) in found.iter().zip(expected.iter()) {
            assert!((a - b).abs() < 1e-9 * expected.norm(), "{found} {expected}");
        }
        let shared = Spread::of(&shape, &points).covariance(0.01, 4.0);
        assert!((shared * 4.0 - found).norm() < 1e-12);
    }

    #[test]
    fn the_deviation_of_a_wavy_surface_covers_its_error() {
        let (wave, rounds) = (0.03, 40);
        let sigma = wave / 2_f64.sqrt();
        let (mut honest, mut naive) = (0.0, 0.0);
        for round in 0..rounds {
            let random = &mut Random::new(round);
            let phase = random.uniform(0.0, std::f64::consts::TAU);
            let points = quarter(4000, 0.003, wave, phase, random);
            let options = Options { cauchy: None, steps: 30, tolerance: 1e-10 };
            let found = fit(&tube(), &points, None, &options).unwrap().shape;
            let spread = Spread::of(&found, &points);
            let error = (found.size[0] - 10.0).powi(2);
            honest += error / spread.covariance(sigma, 1.0)[(4, 4)] / rounds as f64;
            naive += error / (inverse(&spread.information)[(4, 4)] * sigma * sigma) / rounds as f64;
        }
        assert!(naive > 9.0 && (0.1..2.0).contains(&honest), "{naive} {honest}");
    }

    #[test]
    fn what_is_not_determined_has_a_large_and_finite_variance() {
        let variance = Spread::of(&tube(), &[Vec3::new(10.0, 0.0, 0.0); 50]).covariance(0.01, 1.0);
        assert!(variance.iter().all(|v| v.is_finite()) && variance[(4, 4)] > 1e4, "{variance}");
    }
}
