//! Equations of up to nine unknowns.

#![expect(clippy::needless_range_loop, reason = "triangles of small matrices read best by index")]

use nalgebra::DMatrix;

use super::pose::SLOTS;

/// A square of up to nine rows.
pub type Square = [[f64; SLOTS]; SLOTS];

/// Solves (A + damping diag A) x = b for the first `p` rows of a symmetric A, scaled to a unit diagonal; `None` where that is not
/// positive definite.
pub fn solve(a: &Square, b: &[f64; SLOTS], p: usize, damping: f64) -> Option<[f64; SLOTS]> {
    let mut scale = [0.0; SLOTS];
    for i in 0..p {
        if a[i][i] <= 0.0 || !a[i][i].is_finite() {
            return None;
        }
        scale[i] = 1.0 / a[i][i].sqrt();
    }
    let mut l = [[0.0; SLOTS]; SLOTS];
    for i in 0..p {
        for j in 0..=i {
            let mut s = a[i][j] * scale[i] * scale[j];
            if i == j {
                s += damping;
            }
            for k in 0..j {
                s -= l[i][k] * l[j][k];
            }
            if i == j {
                // Below this rounding alone made it.
                if s <= 1e-16 || !s.is_finite() {
                    return None;
                }
                l[i][i] = s.sqrt();
            } else {
                l[i][j] = s / l[j][j];
            }
        }
    }
    let mut x = [0.0; SLOTS];
    for i in 0..p {
        let mut s = b[i] * scale[i];
        for k in 0..i {
            s -= l[i][k] * x[k];
        }
        x[i] = s / l[i][i];
    }
    for i in (0..p).rev() {
        let mut s = x[i];
        for k in i + 1..p {
            s -= l[k][i] * x[k];
        }
        x[i] = s / l[i][i];
    }
    for i in 0..p {
        x[i] *= scale[i];
    }
    Some(x)
}

/// Inverse of a symmetric positive matrix, scaled to a unit diagonal.
pub fn inverse(a: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = a.diagonal().map(|d| 1.0 / d.max(f64::MIN_POSITIVE).sqrt());
    let scaled = |m: &DMatrix<f64>| m.map_with_location(|i, j, v| v * scale[i] * scale[j]);
    Some(scaled(&scaled(a).cholesky()?.inverse()))
}
