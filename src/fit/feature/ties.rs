//! Steps that points stop which hold nothing themselves: of many points at one distance, a program names few.

use nalgebra::DMatrix;

use super::exchange::{Piece, exchange};
use super::pose::SLOTS;

/// Functions nearer to the largest than this are as large.
pub const TIE: f64 = 1e-10;
/// Most functions that are tried as holders together.
pub const MANY: usize = 64;
/// A step along which no tied function rises by this share of it is not stopped: within [`TIE`] of one that is, curvature lowers a function by
/// less than rounding.
const STEEP: f64 = 0.01;

/// The steps that leave functions of the derivatives `rows` as they are, an orthonormal basis; `None` where there are none.
pub fn open(rows: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let p = rows.ncols();
    let e = (rows.transpose() * rows).symmetric_eigen();
    let top = e.eigenvalues.max();
    let open: Vec<_> = (0..p).filter(|&k| e.eigenvalues[k] < 1e-12 * top).collect();
    let basis = |row: usize, k: usize| e.eigenvectors[(row, open[k])];
    (!open.is_empty()).then(|| DMatrix::from_fn(p, open.len(), basis))
}

/// Whether every step within `open` raises one of the functions of the derivatives `slopes`.
pub fn is_stopped(slopes: &[[f64; SLOTS]], open: &DMatrix<f64>) -> bool {
    let d = open.ncols();
    let within: Vec<Vec<f64>> = slopes
        .iter()
        .map(|slope| (0..d).map(|k| (0..open.nrows()).map(|j| slope[j] * open[(j, k)]).sum()))
        .map(Iterator::collect)
        .collect();
    // of each step the largest component is one or minus one, but for its length
    (0..d).all(|k| [1.0, -1.0].into_iter().all(|side| is_steep(&within, k, side)))
}

/// Whether every step whose component `pivot` is `side`, and whose others are no longer, raises one of the functions.
fn is_steep(within: &[Vec<f64>], pivot: usize, side: f64) -> bool {
    let piece = |row: &Vec<f64>| {
        let mut slope = [0.0; SLOTS];
        let others = row.iter().enumerate().filter(|(k, _)| *k != pivot);
        others.zip(&mut slope).for_each(|((_, v), slope)| *slope = *v);
        Piece { value: side * row[pivot], slope }
    };
    let pieces: Vec<Piece> = within.iter().map(piece).collect();
    let Some(free) = pieces.first().and(within.first()).map(|row| row.len() - 1) else {
        return false;
    };
    let least = match free {
        0 => Some(pieces.iter().map(|piece| piece.value).fold(f64::NEG_INFINITY, f64::max)),
        _ => exchange(&pieces, free, false, 1.0).map(|found| found.bound),
    };
    least.is_some_and(|least| least > STEEP)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_stopped_where_points_rise_on_either_side() {
        let slope = |x: f64, y: f64| {
            std::array::from_fn(|k| if k == 0 { x } else { f64::from(k == 1) * y })
        };
        let across = open(&DMatrix::from_row_slice(2, 2, &[1.0, 0.0, -1.0, 0.0])).unwrap();
        assert_eq!(across.ncols(), 1);
        assert!(is_stopped(&[slope(0.0, 1.0), slope(0.3, -0.2)], &across));
        assert!(!is_stopped(&[slope(0.0, 1.0), slope(1.0, 0.0)], &across));
        assert!(!is_stopped(&[], &across));
        let all = DMatrix::identity(2, 2);
        let three = [slope(1.0, 0.0), slope(-0.5, 0.8), slope(-0.5, -0.8)];
        assert!(is_stopped(&three, &all));
        assert!(!is_stopped(&three[..2], &all));
        assert!(open(&DMatrix::identity(2, 2)).is_none());
    }
}
