//! The eigenvector of one end of a small symmetric matrix's spectrum.
//!
//! Starts of fits need nothing else of matrices of three to nine rows, and need it for every family and every set of
//! points: the whole decomposition takes several times as long.

use nalgebra::{SMatrix, SVector};

/// Unit eigenvector of the largest eigenvalue of a symmetric matrix, of which the lower triangle is looked at. Where
/// several eigenvalues are the largest, any of theirs; `None` where an entry is not finite.
///
/// Householder's reflections make the matrix tridiagonal, Laguerre's method finds the largest root of its characteristic
/// polynomial from above, inverse iteration the eigenvector (Golub and Van Loan, *Matrix Computations*, 8.3 and 7.6).
pub fn largest<const D: usize>(m: &SMatrix<f64, D, D>) -> Option<SVector<f64, D>> {
    if !m.iter().all(|v| v.is_finite()) {
        return None;
    }
    let size = m.iter().fold(0.0_f64, |s, v| s.max(v.abs()));
    let unit = 1.0 / size.max(f64::MIN_POSITIVE);
    let mut a = [[0.0; D]; D];
    for i in 0..D {
        for j in 0..=i {
            a[i][j] = m[(i, j)] * unit;
            a[j][i] = a[i][j];
        }
    }
    let (tridiagonal, reflections) = Tridiagonal::of(a);
    let mut v = tridiagonal.eigenvector(tridiagonal.largest_root());
    for k in (0..D.saturating_sub(2)).rev() {
        reflect(&reflections[k], &mut v);
    }
    Some(SVector::from(v).normalize())
}

/// [`largest`] of the smallest eigenvalue.
pub fn smallest<const D: usize>(m: &SMatrix<f64, D, D>) -> Option<SVector<f64, D>> {
    largest(&-m)
}

/// x - u (u.x).
fn reflect<const D: usize>(u: &[f64; D], x: &mut [f64; D]) {
    let mut dot = 0.0;
    for i in 0..D {
        dot += u[i] * x[i];
    }
    for i in 0..D {
        x[i] -= u[i] * dot;
    }
}

/// A symmetric matrix with entries on and beside the diagonal alone.
struct Tridiagonal<const D: usize> {
    diagonal: [f64; D],
    /// Entry i stands between rows i and i + 1; the last is 0.
    beside: [f64; D],
}

impl<const D: usize> Tridiagonal<D> {
    /// A full matrix reduced, and the reflections I - u u' that did it, in their order.
    fn of(mut a: [[f64; D]; D]) -> (Self, [[f64; D]; D]) {
        let mut reflections = [[0.0; D]; D];
        let mut beside = [0.0; D];
        for k in 0..D.saturating_sub(1) {
            let mut u = [0.0; D];
            let mut sq = 0.0;
            for i in k + 1..D {
                u[i] = a[i][k];
                sq += u[i] * u[i];
            }
            let length = sq.sqrt();
            if k + 2 == D {
                beside[k] = u[k + 1];
                break;
            }
            let first = u[k + 1];
            beside[k] = if first > 0.0 { -length } else { length };
            // |u|2 is to be 2.
            u[k + 1] -= beside[k];
            let sq = length * (length + first.abs());
            let scale = if sq > 0.0 { 1.0 / sq.sqrt() } else { 0.0 };
            u.iter_mut().for_each(|v| *v *= scale);
            // A - u q' - q u' with q = A u - u (u'A u) / 2.
            let mut q = [0.0; D];
            for i in k + 1..D {
                for j in k + 1..D {
                    q[i] += a[i][j] * u[j];
                }
            }
            let half = 0.5 * (k + 1..D).map(|i| u[i] * q[i]).sum::<f64>();
            for i in k + 1..D {
                q[i] -= half * u[i];
            }
            for i in k + 1..D {
                for j in k + 1..D {
                    a[i][j] -= u[i] * q[j] + q[i] * u[j];
                }
            }
            reflections[k] = u;
        }
        (Self { diagonal: std::array::from_fn(|i| a[i][i]), beside }, reflections)
    }

    /// The largest eigenvalue. All roots of the polynomial are real, so that Laguerre's method from above them
    /// comes down to the largest without passing it, cubically once near.
    fn largest_root(&self) -> f64 {
        const STEPS: usize = 30;
        let n = D as f64;
        // Gershgorin's bound.
        let mut x = f64::NEG_INFINITY;
        for i in 0..D {
            let before = if i > 0 { self.beside[i - 1].abs() } else { 0.0 };
            x = x.max(self.diagonal[i] + before + self.beside[i].abs());
        }
        for _ in 0..STEPS {
            let (slope, bend) = self.log_derivatives(x);
            // At the root, and by rounding below it.
            if slope.is_nan() || slope <= 0.0 {
                break;
            }
            let spread = ((n - 1.0) * (n * bend - slope * slope)).max(0.0).sqrt();
            let step = n / (slope + spread);
            if !step.is_finite() || x - step >= x {
                break;
            }
            x -= step;
            if step < 1e-15 * (1.0 + x.abs()) {
                break;
            }
        }
        x
    }

    /// Of p(x) = det(x I - T), x above its roots: p'/p and (p'/p)2 - p''/p.
    fn log_derivatives(&self, x: f64) -> (f64, f64) {
        // By the pivots q of x I - T, p = q1 q2 ... : q = x - d - b2 / q_before, and what its derivatives add.
        let (mut q, mut first, mut second) = (1.0, 0.0, 0.0);
        let (mut slope, mut bend) = (0.0, 0.0);
        for i in 0..D {
            let sq = if i > 0 { self.beside[i - 1] * self.beside[i - 1] } else { 0.0 };
            let inverse = 1.0 / q;
            let ratio = sq * inverse * inverse;
            let next = x - self.diagonal[i] - sq * inverse;
            let next_first = 1.0 + ratio * first;
            let next_second = ratio * (second - 2.0 * first * first * inverse);
            (q, first, second) = (next, next_first, next_second);
            let by = first / q;
            slope += by;
            bend += by * by - second / q;
        }
        (slope, bend)
    }

    /// The eigenvector of an eigenvalue, not scaled, by two steps of inverse iteration.
    fn eigenvector(&self, value: f64) -> [f64; D] {
        // Rows of the upper triangle after elimination with exchange of rows: three entries each.
        let mut rows = [[0.0; 3]; D];
        let mut factors = [(0.0, false); D];
        let mut row = [self.diagonal[0] - value, self.beside[0], 0.0];
        for i in 0..D - 1 {
            let after = if i + 2 < D { self.beside[i + 1] } else { 0.0 };
            let next = [self.beside[i], self.diagonal[i + 1] - value, after];
            let exchanged = next[0].abs() > row[0].abs();
            let (upper, lower) = if exchanged { (next, row) } else { (row, next) };
            let pivot = if upper[0] == 0.0 { f64::EPSILON } else { upper[0] };
            let factor = lower[0] / pivot;
            rows[i] = [pivot, upper[1], upper[2]];
            factors[i] = (factor, exchanged);
            row = [lower[1] - factor * upper[1], lower[2] - factor * upper[2], 0.0];
        }
        // It is zero but for rounding.
        let last = if row[0].abs() < f64::EPSILON { f64::EPSILON } else { row[0] };
        rows[D - 1] = [last, 0.0, 0.0];
        let mut x = [1.0; D];
        for round in 0..2 {
            // The first step begins with what elimination would make of a good start.
            if round > 0 {
                for i in 0..D - 1 {
                    let (factor, exchanged) = factors[i];
                    if exchanged {
                        x.swap(i, i + 1);
                    }
                    x[i + 1] -= factor * x[i];
                }
            }
            for i in (0..D).rev() {
                let one = if i + 1 < D { rows[i][1] * x[i + 1] } else { 0.0 };
                let two = if i + 2 < D { rows[i][2] * x[i + 2] } else { 0.0 };
                x[i] = (x[i] - one - two) / rows[i][0];
            }
            let size = x.iter().fold(0.0_f64, |s, v| s.max(v.abs()));
            x.iter_mut().for_each(|v| *v /= size);
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::super::fits::Random;
    use super::*;

    /// How far `v` is from an eigenvector, over the matrix's size, and by how much its eigenvalue is not `value`.
    fn check<const D: usize>(m: &SMatrix<f64, D, D>) {
        let dynamic = nalgebra::DMatrix::from_fn(D, D, |i, j| m[(i, j)]).symmetric_eigen();
        let size = m.norm().max(1e-300);
        let (most, least) = (dynamic.eigenvalues.max(), dynamic.eigenvalues.min());
        for (v, expected) in [(largest(m), most), (smallest(m), least)] {
            let v = v.unwrap();
            assert!((v.norm() - 1.0).abs() < 1e-12);
            let value = (m * v).dot(&v);
            // Of many that are all but the same any will do.
            assert!((value - expected).abs() < 1e-11 * size, "{value} {expected} {m}");
            assert!((m * v - v * value).norm() < 1e-11 * size, "{m}");
        }
    }

    fn check_all<const D: usize>(random: &mut Random) {
        for round in 0..200 {
            let a = SMatrix::<f64, D, D>::from_fn(|_, _| random.uniform(-1.0, 1.0));
            // full, of low rank, with eigenvalues far apart
            let thin = a.map_with_location(|_, j, v| if j < 2 { v } else { 0.0 });
            let graded = a.map_with_location(|_, j, v| v * 10f64.powi(-2 * j as i32));
            let scale = 10f64.powi(round % 40 - 20);
            check(&((a + a.transpose()) * scale));
            check(&(thin * thin.transpose()));
            check(&(graded * graded.transpose()));
        }
        check(&SMatrix::<f64, D, D>::zeros());
        check(&SMatrix::<f64, D, D>::identity());
        check(&SMatrix::<f64, D, D>::from_fn(|i, j| if i == j { i as f64 } else { 0.0 }));
        check(&SMatrix::<f64, D, D>::from_fn(|_, _| 1.0));
    }

    #[test]
    fn it_is_that_of_the_whole_decomposition() {
        let random = &mut Random::new(4);
        check_all::<2>(random);
        check_all::<3>(random);
        check_all::<4>(random);
        check_all::<6>(random);
        check_all::<9>(random);
    }

    #[test]
    fn what_is_not_finite_has_none() {
        for bad in [f64::NAN, f64::INFINITY] {
            let mut m = SMatrix::<f64, 3, 3>::identity();
            m[(1, 0)] = bad;
            assert!(largest(&m).is_none() && smallest(&m).is_none());
        }
    }
}
