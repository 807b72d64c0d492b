//! Quadratic forms minimised under another one.

#![expect(clippy::needless_range_loop, reason = "triangles of small matrices read best by index")]

use nalgebra::{SMatrix, SVector};

use super::eigen::largest;

/// What is added to the diagonal, over its largest entry: forms of exact points are singular.
const RIDGE: f64 = 1e-13;

/// The minimiser of a'Ma subject to a'Ca = 1, for positive definite M = LL': the eigenvector of the largest eigenvalue of
/// L^-1 C L^-T carried back. `None` where M is not positive definite.
pub(super) fn constrained_minimiser<const D: usize>(
    m: &SMatrix<f64, D, D>,
    c: &SMatrix<f64, D, D>,
) -> Option<SVector<f64, D>> {
    let l = cholesky(m)?;
    let rows = |m: &SMatrix<f64, D, D>| std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)]));
    // L^-1 C, and once more from its other side.
    let half = solved(&l, rows(c));
    let whole = solved(&l, std::array::from_fn(|i| std::array::from_fn(|j| half[j][i])));
    let b = SMatrix::<f64, D, D>::from_fn(|i, j| 0.5 * (whole[i][j] + whole[j][i]));
    let mut a = largest(&b)?;
    for i in (0..D).rev() {
        for k in i + 1..D {
            a[i] -= l[k][i] * a[k];
        }
        a[i] /= l[i][i];
    }
    Some(a)
}

/// The lower triangle L with M + ridge = LL'; `None` where there is none.
pub(super) fn cholesky<const D: usize>(m: &SMatrix<f64, D, D>) -> Option<[[f64; D]; D]> {
    let top = (0..D).map(|i| m[(i, i)]).fold(0.0, f64::max);
    let mut l = [[0.0; D]; D];
    for i in 0..D {
        for j in 0..=i {
            let mut s = m[(i, j)];
            for k in 0..j {
                s -= l[i][k] * l[j][k];
            }
            if i == j {
                s += RIDGE * top;
                if s <= 0.0 || !s.is_finite() {
                    return None;
                }
                l[i][i] = s.sqrt();
            } else {
                l[i][j] = s / l[j][j];
            }
        }
    }
    Some(l)
}

/// L^-1 X.
fn solved<const D: usize>(l: &[[f64; D]; D], mut x: [[f64; D]; D]) -> [[f64; D]; D] {
    for i in 0..D {
        for k in 0..i {
            let (before, own) = x.split_at_mut(i);
            for j in 0..D {
                own[0][j] -= l[i][k] * before[k][j];
            }
        }
        let inverse = 1.0 / l[i][i];
        x[i].iter_mut().for_each(|v| *v *= inverse);
    }
    x
}

/// L^-1 x.
pub(super) fn forward<const D: usize>(l: &[[f64; D]; D], x: &SVector<f64, D>) -> SVector<f64, D> {
    let mut x = *x;
    for i in 0..D {
        for k in 0..i {
            x[i] -= l[i][k] * x[k];
        }
        x[i] /= l[i][i];
    }
    x
}

#[cfg(test)]
mod tests {
    use super::super::fits::Random;
    use super::*;

    #[test]
    fn no_other_vector_of_the_same_constraint_has_a_smaller_form() {
        let mut random = Random::new(3);
        for _ in 0..50 {
            let mut any = || SMatrix::<f64, 6, 6>::from_fn(|_, _| random.uniform(-1.0, 1.0));
            let (a, b) = (any(), any());
            let (m, c) = (a * a.transpose(), b + b.transpose());
            let form = |m: &SMatrix<f64, 6, 6>, v: &SVector<f64, 6>| (m * v).dot(v);
            let best = constrained_minimiser(&m, &c).unwrap();
            let ratio = form(&m, &best) / form(&c, &best);
            assert!(ratio > 0.0);
            for _ in 0..100 {
                let v = SVector::<f64, 6>::from_fn(|i, _| {
                    best[i] + 0.1 * best.norm() * random.uniform(-1.0, 1.0)
                });
                let constraint = form(&c, &v);
                assert!(constraint <= 0.0 || form(&m, &v) / constraint >= ratio * (1.0 - 1e-9));
            }
        }
    }

    #[test]
    fn a_form_that_is_not_definite_has_none() {
        let m = SMatrix::<f64, 3, 3>::from_diagonal(&SVector::from([1.0, -1.0, 1.0]));
        assert!(constrained_minimiser(&m, &SMatrix::identity()).is_none());
    }
}
