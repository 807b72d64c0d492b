//! Running numbers before the coordinates of text that names no columns.

use std::collections::BTreeSet;

use super::super::{FormatError, text};
use super::dialect::{Dialect, Line};

/// Rows that are enough to tell running numbers from coordinates.
const FEWEST: usize = 5;
/// The same where they stand in no order: so many coordinates along x that are whole, none of them twice,
/// beside others that are not, are no scan's.
const FEWEST_SHUFFLED: usize = 20;

/// The running number that a field may be; some write it as `12.0` or `1.2e1`.
pub(super) fn number(field: &[u8]) -> Option<i64> {
    /// Above this not every whole number is a double.
    const MOST: f64 = (1_u64 << 53) as f64;
    let field = text::unquoted(field);
    let whole = || text::number(field).filter(|x| x.fract() == 0.0 && x.abs() < MOST);
    std::str::from_utf8(field).ok()?.parse().ok().or_else(|| whole().map(|x| x as i64))
}

/// Whether the first columns of all rows are numbers that count up by one.
pub(super) fn by_one(dialect: Dialect, rows: &[Line]) -> bool {
    firsts(dialect, rows).is_some_and(|n| steps(&n).all(|step| step == 1)) && rows.len() >= FEWEST
}

/// Whether running numbers stand before the coordinates.
///
/// # Errors
/// It cannot be told: the numbers leave some out or stand in no order, or the columns behind them do not
/// look like those of points.
pub(super) fn stand_first(dialect: Dialect, rows: &[Line]) -> Result<bool, FormatError> {
    let points: Option<Vec<[f64; 3]>> = rows.iter().map(|(_, row)| behind(dialect, row)).collect();
    let (Some(points), Some(numbers)) = (points, firsts(dialect, rows)) else { return Ok(false) };
    let whole = points.iter().flatten().all(|x| x.fract() == 0.0);
    if rows.len() < FEWEST {
        return Ok(false);
    }
    if steps(&numbers).any(|step| step < 1) {
        let shuffled = !whole && rows.len() >= FEWEST_SHUFFLED && are_distinct(&numbers);
        let line = rows[0].0;
        return if shuffled { Err(FormatError::RunningNumbers { line }) } else { Ok(false) };
    }
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

fn are_distinct(numbers: &[i128]) -> bool {
    numbers.iter().collect::<BTreeSet<_>>().len() == numbers.len()
}

fn steps(numbers: &[i128]) -> impl Iterator<Item = i128> + '_ {
    numbers.windows(2).map(|pair| pair[1] - pair[0])
}
