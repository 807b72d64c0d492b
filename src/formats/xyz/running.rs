//! Running numbers before the coordinates of text that names no columns.

use super::super::{FormatError, text};
use super::dialect::{Dialect, Line};

/// Rows that are enough to tell running numbers from coordinates.
const FEWEST: usize = 5;

/// The running number that a field may be.
pub(super) fn number(field: &[u8]) -> Option<u64> {
    std::str::from_utf8(text::unquoted(field)).ok()?.parse().ok()
}

/// Whether the first columns of all rows are numbers that count up by one.
pub(super) fn by_one(dialect: Dialect, rows: &[Line]) -> bool {
    firsts(dialect, rows).is_some_and(|n| steps(&n).all(|step| step == 1)) && rows.len() >= FEWEST
}

/// Whether running numbers stand before the coordinates.
///
/// # Errors
/// It cannot be told: the numbers leave some out, or the columns behind them do not look like those of
/// points.
pub(super) fn stand_first(dialect: Dialect, rows: &[Line]) -> Result<bool, FormatError> {
    let points: Option<Vec<[f64; 3]>> = rows.iter().map(|(_, row)| behind(dialect, row)).collect();
    let (Some(points), Some(numbers)) = (points, firsts(dialect, rows)) else { return Ok(false) };
    if rows.len() < FEWEST || steps(&numbers).any(|step| step < 1) {
        return Ok(false);
    }
    let whole = points.iter().flatten().all(|x| x.fract() == 0.0);
    let even = steps(&numbers).all(|step| step == 1);
    if whole && !even {
        return Ok(false);
    }
    // one row of a grid counts up too: its other coordinate stays
    let stays = |axis: usize| points.iter().all(|p| p[axis] == points[0][axis]);
    if even && !whole && ![0, 1, 2].into_iter().any(stays) {
        return Ok(true);
    }
    Err(FormatError::RunningNumbers { line: rows[0].0 })
}

/// The three values behind the first field.
fn behind(dialect: Dialect, row: &[u8]) -> Option<[f64; 3]> {
    match dialect.fields(row)[..] {
        [_, x, y, z, ..] => Some([dialect.value(x)?, dialect.value(y)?, dialect.value(z)?]),
        _ => None,
    }
}

fn firsts(dialect: Dialect, rows: &[Line]) -> Option<Vec<i128>> {
    rows.iter().map(|(_, row)| number(dialect.first(row)).map(i128::from)).collect()
}

fn steps(numbers: &[i128]) -> impl Iterator<Item = i128> + '_ {
    numbers.windows(2).map(|pair| pair[1] - pair[0])
}
