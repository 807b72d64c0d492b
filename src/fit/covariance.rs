//! How exactly a fit is known.

use nalgebra::{DMatrix, DVector};

use super::blocks::{Block, blocks};
use super::columns::Columns;
use super::correlation::{Correlation, kernel};
use super::normal::Normal;
use super::shape::{MAX_DOF, Shape};
use crate::geometry::Vec3;

/// Combinations of freedoms that the points tell worse than this share of the best count as known that
/// badly, so that variances are large there and yet finite.
const LEAST_INFORMATION: f64 = 1e-13;

/// What points tell about a shape: J'J, J the derivatives of the distances by the degrees of freedom, and the means of
/// distances and derivatives over blocks of neighbours.
pub struct Spread {
    information: DMatrix<f64>,
    blocks: Vec<Block>,
    /// Standard deviation of the distances, what the fit took counted in.
    deviation: f64,
    /// What they have in common.
    correlation: Correlation,
}

impl Spread {
    /// That of `points` about `shape`, in the order of [`Shape::distance_jacobian`].
    pub fn of(shape: &Shape, points: &[Vec3]) -> Self {
        let p = shape.family.dof();
        let mut columns = Columns::default();
        columns.extend(points, 1.0);
        columns.fill_up();
        let sums = Normal::of(shape, &columns);
        let information = DMatrix::from_fn(p, p, |a, b| sums.jj[a.max(b)][a.min(b)]);
        let blocks = blocks(shape, points);
        let freedom = points.len().saturating_sub(p).max(1) as f64;
        let deviation = (blocks.iter().map(|b| b.squares).sum::<f64>() / freedom).sqrt();
        Self::with(information, blocks, deviation)
    }

    /// That of blocks of points whose distances have deviation `deviation` and tell `information`.
    pub fn with(information: DMatrix<f64>, blocks: Vec<Block>, deviation: f64) -> Self {
        let correlation = Correlation::of(&blocks, information.nrows(), deviation);
        Self { information, blocks, deviation, correlation }
    }

    /// Covariance of the degrees of freedom where the residuals have deviation `sigma` and each of the points stands
    /// for `share` like it: sigma2 (J'J)^-1 J'CJ (J'J)^-1, C the correlations of the residuals (see [`Correlation`]).
    /// Very large, and finite, where the points do not determine the shape.
    pub fn covariance(&self, sigma: f64, share: f64) -> DMatrix<f64> {
        let inverse = inverse(&self.information);
        let correlation = &self.correlation;
        let apart = correlation.white / share + correlation.short;
        let mut out = &inverse * apart;
        if correlation.long.iter().any(|(share, _)| *share > 0.0) {
            out += &inverse * self.together() * &inverse;
        }
        out * (sigma * sigma)
    }

    /// J'CJ, C the correlations of the residuals in units of the square of their deviation.
    pub fn shaken(&self) -> DMatrix<f64> {
        let Correlation { white, short, .. } = self.correlation;
        &self.information * (white + short) + self.together()
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
        let of_kept = |block: &Block| {
            let mut slope = [0.0; MAX_DOF];
            kept.iter().enumerate().for_each(|(k, &a)| slope[k] = block.slope[a]);
            Block { slope, ..*block }
        };
        let blocks = self.blocks.iter().map(of_kept).collect();
        let mut all = DMatrix::zeros(p, p);
        if q > 0 {
            let part = Self::with(information, blocks, self.deviation).covariance(sigma, share);
            for (a, b) in (0..q).flat_map(|a| (0..q).map(move |b| (a, b))) {
                all[(kept[a], kept[b])] = part[(a, b)];
            }
        }
        all
    }

    /// How many times more than independent residuals of deviation `sigma` would, the residuals shake the
    /// parameters, in the mean, where each of the points stands for `share` like it; at least 1.
    pub fn inflation(&self, sigma: f64, share: f64) -> f64 {
        let together = inverse(&self.information) * self.together();
        let long = together.trace() / together.nrows() as f64;
        self.times(long, sigma, share)
    }

    /// How many times more than independent residuals do those shake a sum of them, `long` of which is by what goes
    /// together over more than a block.
    fn times(&self, long: f64, sigma: f64, share: f64) -> f64 {
        let Correlation { white, short, .. } = self.correlation;
        let times = white + share * (short + long);
        (times * (self.deviation / sigma).powi(2)).max(1.0)
    }

    /// How many times more than independent residuals of deviation `sigma` would, the residuals shake a change of the
    /// surface that moves it by `change` at a point; at least 1.
    pub fn inflation_along(&self, sigma: f64, share: f64, change: impl Fn(&Vec3) -> f64) -> f64 {
        let blocks = &self.blocks;
        let moved = DVector::from_fn(blocks.len(), |k, _| change(&blocks[k].centre));
        let squares: f64 = moved.iter().zip(blocks).map(|(d, b)| b.count * d * d).sum();
        let sums = DVector::from_fn(blocks.len(), |k, _| blocks[k].count * moved[k]);
        let long =
            if squares > 0.0 { sums.dot(&(self.covariances() * &sums)) / squares } else { 0.0 };
        self.times(long, sigma, share)
    }

    /// J'CJ of the part that goes together over more than a block.
    fn together(&self) -> DMatrix<f64> {
        let (p, blocks) = (self.information.nrows(), &self.blocks);
        let sums = DMatrix::from_fn(blocks.len(), p, |k, a| blocks[k].count * blocks[k].slope[a]);
        sums.transpose() * self.covariances() * sums
    }

    /// C of that part between blocks.
    fn covariances(&self) -> DMatrix<f64> {
        let mut out = DMatrix::zeros(self.blocks.len(), self.blocks.len());
        for (share, length) in self.correlation.long.iter().filter(|l| l.0 > 0.0) {
            out += kernel(&self.blocks, *length) * *share;
        }
        out
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
    use super::super::shape::MAX_DOF;
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
        // White residuals are seldom taken for anything else, and then for little of it.
        for k in 0..5 {
            let times = found[(k, k)] / expected[(k, k)];
            assert!((0.999..1.1).contains(&times), "{k}: {times}");
        }
        let shared = Spread::of(&shape, &points).covariance(0.01, 4.0);
        let times = 4.0 * shared[(4, 4)] / found[(4, 4)];
        assert!((0.999..1.3).contains(&times), "{times}");
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
