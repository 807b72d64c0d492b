//! How the numbers of a column are written. Programs write the three coordinates of a point alike, and
//! what stands beside them often in another way.

use super::{super::text, dialect::Dialect};

/// How one number is written.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Written {
    /// Digits behind the point; `None` without one.
    decimals: Option<usize>,
    /// Whether a power of ten stands behind them.
    exponent: bool,
    /// Whether the last digit behind the point is a nought: who rounds as far as needed leaves it out.
    padded: bool,
}

impl Written {
    fn of(dialect: Dialect, field: &[u8]) -> Self {
        let field = text::unquoted(field);
        let end = field.iter().position(|b| b"eEdD".contains(b)).unwrap_or(field.len());
        let digits = &field[..end];
        let point = digits.iter().position(|b| *b == dialect.point());
        let decimals = point.map(|at| digits.len() - at - 1);
        let padded = decimals.is_some_and(|n| n > 0) && digits.ends_with(b"0");
        Self { decimals, exponent: end < field.len(), padded }
    }
}

/// How all numbers of a column are written.
#[derive(Clone, Copy, Debug)]
pub(super) struct Style {
    /// The decimals that all of them have, and whether they have exponents; `None` where they differ.
    fixed: Option<(Option<usize>, bool)>,
    /// Whether each has a point.
    pointed: bool,
    /// Whether none has.
    plain: bool,
    /// Whether a nought ends one of the fractions.
    padded: bool,
}

impl Style {
    /// The style of one column's fields; of none, that of whole numbers.
    pub(super) fn of<'a>(dialect: Dialect, fields: impl Iterator<Item = &'a [u8]>) -> Self {
        let mut style = Self { fixed: None, pointed: true, plain: true, padded: false };
        for (row, field) in fields.enumerate() {
            let written = Written::of(dialect, field);
            let form = (written.decimals, written.exponent);
            style.fixed = if row == 0 { Some(form) } else { style.fixed.filter(|f| *f == form) };
            style.pointed &= written.decimals.is_some();
            style.plain &= written.decimals.is_none();
            style.padded |= written.padded;
        }
        style
    }

    /// Whether no number has a point.
    pub(super) fn is_plain(self) -> bool {
        self.plain
    }

    /// Whether another column is written with the same number of decimals throughout.
    fn fits(self, other: Self) -> bool {
        self.fixed.is_some() && self.fixed == other.fixed
    }
}

/// Whether these columns surely have one style, by a format with decimals, and `other` has not.
pub(super) fn sets_apart(columns: &[Style; 3], other: Style) -> bool {
    // a column of whole numbers beside others that are never written without a point
    let pointed = columns.iter().all(|c| c.pointed) && is_format(columns);
    (pointed && other.plain) || (are_alike(columns) && !other.fits(columns[0]))
}

/// Whether these columns surely are written with one number of decimals, and not by chance.
pub(super) fn are_alike(columns: &[Style]) -> bool {
    columns.iter().all(|c| c.pointed && c.fits(columns[0])) && is_format(columns)
}

/// Whether the first two columns, coordinates in any case, are written to some number of decimals.
fn is_format(columns: &[Style]) -> bool {
    columns.iter().take(2).any(|c| c.padded)
}
