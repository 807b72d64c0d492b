//! Whether the residuals about a surface go together, over what length, and what that does to its parameters.
//!
//! The residuals are taken for a Gaussian process on the surface: a white part, one that goes together over less than
//! a block, and one that goes together over a length (covariance exp(-d2 / 2 l2)). What of it the surface's own
//! parameters could have taken up tells nothing, so only the combinations of block means on which these have no
//! influence are looked at (residual, or restricted, likelihood: Patterson and Thompson 1971). All shares and lengths
//! on a grid are weighed by their likelihood, and whiteness by a prior of its own: a mean over all that may be, not
//! a choice, so that few blocks give neither false alarm nor false calm.

use nalgebra::{DMatrix, DVector};

use super::blocks::Block;
use super::constant::constants;

constants! {
    /// How probable white residuals are before any is seen, over all that may be instead.
    WHITE: f64 = 19.0, Trial(9.0, 50.0);
    /// Deviations by which the blocks' means must stand out for more to be asked.
    SUSPICIOUS: f64 = 1.5, Effort("eigenvectors where white residuals are nearly sure");
    /// Factor between neighbouring shares of the grid.
    SHARE_STEP: f64 = 2.0, Effort("shares looked at");
    /// Factor between neighbouring lengths of the grid.
    LENGTH_STEP: f64 = 2.0, Effort("lengths looked at");
    /// Share of the blocks' distance that the shortest length takes: neighbours go together by exp(-2) at half.
    SHORTEST: f64 = 0.5, Derived("what goes together over less is white between blocks");
    /// Share of the longest side that the longest length takes: what goes together over more, a surface takes up itself.
    LONGEST: f64 = 0.25, Trial(0.25, 0.5);
    /// Combinations of blocks without the parameters' influence, fewer of which tell nothing.
    LEAST: usize = 6, Derived("the least whose variance is told within a factor of two");
}

/// What the residuals have in common: variances in units of the residuals'.
pub struct Correlation {
    /// Of independent residuals.
    pub white: f64,
    /// Of what goes together over less than a block, in the sum of a block.
    pub short: f64,
    /// Share and length of what goes together over more.
    pub long: Vec<(f64, f64)>,
}

impl Correlation {
    /// None.
    fn none() -> Self {
        Self { white: 1.0, short: 0.0, long: Vec::new() }
    }

    /// That of residuals of deviation `sigma` about a surface with `freedoms` degrees of freedom.
    pub fn of(blocks: &[Block], freedoms: usize, sigma: f64) -> Self {
        let is_exact = sigma.is_nan() || sigma <= 0.0;
        if blocks.len() < freedoms + LEAST.get() || is_exact {
            return Self::none();
        }
        let contrasts = Contrasts::of(blocks, freedoms, sigma);
        let count = blocks.iter().map(|b| b.count).sum::<f64>() / blocks.len() as f64;
        let lengths = lengths(blocks);
        let mut weighed = vec![(contrasts.white(), [1.0, 0.0, 0.0, 0.0])];
        let kernels: Vec<DMatrix<f64>> =
            lengths.iter().map(|l| contrasts.kernel(blocks, *l)).collect();
        if !kernels.iter().any(|k| contrasts.are_suspicious(k, freedoms)) {
            return Self::none();
        }
        for (&length, kernel) in lengths.iter().zip(kernels) {
            let spectrum = contrasts.spectrum(kernel);
            for (share, times) in grid(count) {
                let white = 1.0 - share;
                let likelihood = spectrum.likelihood(white * times, share);
                weighed.push((likelihood, [white, white * (times - 1.0), share, length]));
            }
        }
        averaged(&weighed, &lengths)
    }
}

/// Shares that go together, each with each factor of the white part in a block, of blocks of `count` points.
fn grid(count: f64) -> Vec<(f64, f64)> {
    let steps = |from: f64, to: f64| {
        std::iter::successors(Some(from), |s| Some(s * SHARE_STEP.get()))
            .take_while(move |s| *s < to)
    };
    let times: Vec<f64> = steps(1.0, count.max(1.5)).collect();
    let share = steps(1.0 / count.max(2.0), 0.7).chain([0.8, 0.95]);
    share.flat_map(|s| times.iter().map(move |t| (s, *t))).collect()
}

/// Lengths from half of a block's to a quarter of the whole.
fn lengths(blocks: &[Block]) -> Vec<f64> {
    let far = |from: &Block| {
        blocks.iter().map(|b| (b.centre - from.centre).norm_squared()).fold(0.0, f64::max)
    };
    let near = |from: &Block| {
        let others = blocks.iter().map(|b| (b.centre - from.centre).norm_squared());
        others.filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min)
    };
    let longest = LONGEST.get() * blocks.iter().map(far).fold(0.0, f64::max).sqrt();
    let mut apart: Vec<f64> = blocks.iter().map(near).filter(|d| d.is_finite()).collect();
    apart.sort_by(f64::total_cmp);
    let shortest =
        apart.get(apart.len() / 2).map_or(longest, |d| SHORTEST.get() * d.sqrt()).min(longest);
    if shortest.is_nan() || shortest <= 0.0 {
        return Vec::new();
    }
    std::iter::successors(Some(shortest), |l| Some(l * LENGTH_STEP.get()))
        .take_while(|l| *l <= longest * 1.001)
        .collect()
}

/// The mean over what may be, by logarithms of likelihoods: the first is that of white residuals.
fn averaged(weighed: &[(f64, [f64; 4])], lengths: &[f64]) -> Correlation {
    let top = weighed.iter().map(|w| w.0).fold(f64::NEG_INFINITY, f64::max);
    let others = (weighed.len() - 1).max(1) as f64;
    let weight =
        |k: usize, l: f64| (l - top).exp() * if k == 0 { WHITE.get() } else { 1.0 / others };
    let total: f64 = weighed.iter().enumerate().map(|(k, w)| weight(k, w.0)).sum();
    let mut out =
        Correlation { white: 0.0, short: 0.0, long: lengths.iter().map(|l| (0.0, *l)).collect() };
    for (k, (likelihood, [white, short, share, length])) in weighed.iter().enumerate() {
        let w = weight(k, *likelihood) / total;
        out.white += w * white;
        out.short += w * short;
        if let Some(at) = lengths.iter().position(|l| l == length) {
            out.long[at].0 += w * share;
        }
    }
    out
}

/// Means of blocks, weighed so that white residuals give unit variance, without the parameters' influence.
struct Contrasts {
    /// Orthonormal columns: what the parameters move.
    moved: DMatrix<f64>,
    /// The weighed means less these.
    means: DVector<f64>,
}

impl Contrasts {
    fn of(blocks: &[Block], freedoms: usize, sigma: f64) -> Self {
        let root = |k: usize| blocks[k].count.sqrt();
        let slopes = DMatrix::from_fn(blocks.len(), freedoms, |k, a| root(k) * blocks[k].slope[a]);
        let means = DVector::from_fn(blocks.len(), |k, _| root(k) * blocks[k].residual / sigma);
        let moved = orthonormal(slopes);
        let means = &means - &moved * (moved.transpose() * &means);
        Self { moved, means }
    }

    /// Logarithm of the likelihood of white residuals.
    fn white(&self) -> f64 {
        -0.5 * self.means.norm_squared()
    }

    /// Covariance of the contrasts where residuals go together over `length`.
    fn kernel(&self, blocks: &[Block], length: f64) -> DMatrix<f64> {
        let mut kernel = kernel(blocks, length);
        for (i, a) in blocks.iter().enumerate() {
            for (j, b) in blocks.iter().enumerate() {
                kernel[(i, j)] *= (a.count * b.count).sqrt();
            }
        }
        let q = &self.moved;
        let right = &kernel * q;
        let both = q.transpose() * &right;
        let left = q * right.transpose();
        kernel - &left - left.transpose() + q * both * q.transpose()
    }

    /// Whether the contrasts are longer than white ones, or lie along those that a kernel makes long (the score of its
    /// share: x'Kx less its mean tr K, by its deviation).
    fn are_suspicious(&self, kernel: &DMatrix<f64>, freedoms: usize) -> bool {
        let count = self.means.len().saturating_sub(freedoms) as f64;
        let length = (self.means.norm_squared() - count) / (2.0 * count).sqrt();
        let score = (self.means.dot(&(kernel * &self.means)) - kernel.trace())
            / (2.0 * kernel.norm_squared()).sqrt();
        length > SUSPICIOUS.get() || score > SUSPICIOUS.get()
    }

    fn spectrum(&self, kernel: DMatrix<f64>) -> Spectrum {
        let eigen = kernel.symmetric_eigen();
        let squares = (eigen.eigenvectors.transpose() * &self.means).map(|z| z * z);
        Spectrum { values: eigen.eigenvalues, squares, without: self.moved.ncols() }
    }
}

/// An orthonormal basis of a matrix's columns.
fn orthonormal(mut a: DMatrix<f64>) -> DMatrix<f64> {
    for mut column in a.column_iter_mut() {
        let norm = column.norm();
        if norm > 0.0 {
            column /= norm;
        }
    }
    let e = (a.transpose() * &a).symmetric_eigen();
    let told: Vec<usize> = (0..e.eigenvalues.len()).filter(|&k| e.eigenvalues[k] > 1e-10).collect();
    let columns: Vec<DVector<f64>> =
        told.iter().map(|&k| &a * e.eigenvectors.column(k) / e.eigenvalues[k].sqrt()).collect();
    if columns.is_empty() { DMatrix::zeros(a.nrows(), 0) } else { DMatrix::from_columns(&columns) }
}

/// How blocks' residuals go together where they do over `length`.
pub fn kernel(blocks: &[Block], length: f64) -> DMatrix<f64> {
    let factor = -0.5 / (length * length);
    DMatrix::from_fn(blocks.len(), blocks.len(), |i, j| {
        (factor * (blocks[i].centre - blocks[j].centre).norm_squared()).exp()
    })
}

/// A kernel's eigenvalues among the contrasts, and the squares of the weighed means along them.
struct Spectrum {
    values: DVector<f64>,
    squares: DVector<f64>,
    /// Combinations that the parameters move, which are eigenvectors of value 0 here.
    without: usize,
}

impl Spectrum {
    /// Logarithm of the likelihood of variance `white` in each and `share` times the kernel.
    fn likelihood(&self, white: f64, share: f64) -> f64 {
        let mut sum = self.without as f64 * white.ln();
        for (value, square) in self.values.iter().zip(&self.squares) {
            let variance = white + share * value.max(0.0);
            sum -= variance.ln() + square / variance;
        }
        0.5 * sum
    }
}

#[cfg(test)]
mod tests {
    use super::super::blocks::blocks;
    use super::super::covariance::Spread;
    use super::super::fits::Random;
    use super::super::least_squares::{Options, fit};
    use super::super::shape::{Family, Shape};
    use crate::geometry::Vec3;

    /// The plane fitted to points 10 x 10 about z = 0 whose heights are `height`, the points, and how high it lies
    /// in the middle.
    fn plane(
        n: usize,
        random: &mut Random,
        height: impl Fn(&mut Random, f64, f64) -> f64,
    ) -> (Shape, Vec<Vec3>, f64) {
        let mut at = || {
            let (x, y) = (random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0));
            Vec3::new(x, y, height(random, x, y))
        };
        let points: Vec<Vec3> = (0..n).map(|_| at()).collect();
        let start = Shape::with_axis(Family::Plane, Vec3::zeros(), Vec3::z(), [0.0; 3]);
        let options = Options { cauchy: None, steps: 20, tolerance: 1e-12 };
        let shape = fit(&start, &points, None, &options).unwrap().shape;
        let height = -shape.distance(&Vec3::zeros()) * shape.w().z.signum();
        (shape, points, height)
    }

    /// A smooth field of unit variance that goes together over `length`.
    fn field(length: f64, random: &mut Random) -> impl Fn(f64, f64) -> f64 + use<> {
        let wave = |r: &mut Random| (r.normal() / length, r.normal() / length, r.uniform(0.0, 6.3));
        let waves: Vec<_> = (0..80).map(|_| wave(random)).collect();
        move |x, y| {
            let sum: f64 = waves.iter().map(|(u, v, phase)| (u * x + v * y + phase).cos()).sum();
            sum * (2.0 / waves.len() as f64).sqrt()
        }
    }

    #[test]
    fn white_residuals_are_seldom_taken_for_more() {
        let rounds = 40;
        for n in [200, 2000, 20_000] {
            let mut sum = 0.0;
            for seed in 0..rounds {
                let random = &mut Random::new(seed);
                let (shape, points, _) = plane(n, random, |r, _, _| 0.1 * r.normal());
                sum += Spread::of(&shape, &points).inflation(0.1, 1.0) / rounds as f64;
            }
            assert!((1.0..1.1).contains(&sum), "{n}: {sum}");
        }
    }

    #[test]
    fn blocks_are_not_parted_by_noise_larger_than_the_spacing() {
        // Tilted, as a cut along a coordinate runs through the noise there.
        let turn = crate::geometry::perpendicular_frame(&Vec3::new(1.0, 1.0, 1.0).normalize());
        let normal = Vec3::new(1.0, 1.0, 1.0).normalize();
        let random = &mut Random::new(3);
        let mut at = || {
            let (x, y) = (random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0));
            turn.0 * x + turn.1 * y + 0.3 * random.normal() * normal
        };
        let points: Vec<Vec3> = (0..60_000).map(|_| at()).collect();
        let shape = Shape::with_axis(Family::Plane, Vec3::zeros(), normal, [0.0; 3]);
        let blocks = blocks(&shape, &points);
        let chi2: f64 = blocks.iter().map(|b| b.count * (b.residual / 0.3).powi(2)).sum();
        let expected = blocks.len() as f64;
        assert!((chi2 - expected).abs() < 4.0 * (2.0 * expected).sqrt(), "{chi2} of {expected}");
    }

    #[test]
    fn errors_are_as_large_as_said_where_residuals_go_together() {
        let rounds = 60;
        for length in [0.5, 1.5, 3.0] {
            let (mut honest, mut naive) = (0.0, 0.0);
            for seed in 0..rounds {
                let random = &mut Random::new(100 + seed);
                let field = field(length, random);
                let both = |r: &mut Random, x: f64, y: f64| 0.1 * (r.normal() + field(x, y));
                let (shape, points, error) = plane(2000, random, both);
                let sigma = 0.02_f64.sqrt();
                let spread = Spread::of(&shape, &points);
                // The third freedom of a plane is its height.
                let freedom = (0..3).max_by(|a, b| {
                    let moved = |k: usize| {
                        let mut j = [0.0; super::super::shape::MAX_DOF];
                        shape.distance_jacobian(&Vec3::zeros(), &mut j);
                        j[k].abs()
                    };
                    moved(*a).total_cmp(&moved(*b))
                });
                let variance = spread.covariance(sigma, 1.0)[(freedom.unwrap(), freedom.unwrap())];
                honest += error * error / variance / rounds as f64;
                naive += error * error / (sigma * sigma / 2000.0) / rounds as f64;
            }
            assert!(naive > 5.0, "{length}: {naive}");
            assert!((0.3..2.0).contains(&honest), "{length}: {honest} (naive {naive})");
        }
    }
}
