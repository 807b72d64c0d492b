//! Text clouds: one point a line, coordinates separated by spaces, tabs, commas or semicolons.
//!
//! Fields between tabs may be empty where tabs part all of them; those in quotes may hold what parts fields elsewhere.
//! Lines that start with `#`, `//` or `%` are comments. The first lines show how the others are written:
//! what parts fields and whether fractions begin with a comma; a line (or a comment) of names tells the
//! columns of x, y and z, else they are the first three, or those behind running numbers or times. A line
//! with one number alone (PTS) announces that many points; behind them another block may begin in the same way.
//! Further columns are ignored. An empty field between separators is a missing value (NaN). What can be
//! read in two ways is refused until the sender names the columns. A line of more than
//! 1000 columns or 64 KiB is refused; a comment so long is passed over.

mod dialect;
mod first;
mod heading;
mod layout;
mod line;
mod names;
mod order;
mod running;
mod style;

use first::First;
use layout::Layout;
use running::Running;

use super::{
    Bounds, Format, FormatError, Hints,
    error::excerpt,
    line::Pace,
    odd,
    sink::{About, Singly, Sink},
    text,
};
use crate::geometry::{PointCloud, Vec3};

/// Reads one point a line; `hints` say the columns of x, y and z where the sender names them, and how many lines stood
/// before these bytes.
pub(super) fn read(
    bytes: &[u8],
    hints: &Hints,
    limits: &dyn Bounds,
) -> Result<PointCloud, FormatError> {
    let mut points = Vec::new();
    Ok(pass(bytes, hints, limits, &mut points)?.cloud(points))
}

/// Hands the points on, as [`read`] finds them.
pub(super) fn pass(
    bytes: &[u8],
    hints: &Hints,
    limits: &dyn Bounds,
    sink: &mut dyn Sink,
) -> Result<About, FormatError> {
    let bytes = text::without_end_mark(text::without_bom(bytes));
    let layout = Layout::of(bytes, hints, limits)?;
    let mut block = Block { announced: layout.announced, begin: 0 };
    sink.expect(text::line_count(bytes).min(limits.most()))?;
    let mut points = Singly::new(sink, limits);
    let mut running = Running::default();
    let mut pace = Pace::new(limits);
    for (number, line) in (1 + hints.skip_lines..).zip(text::lines(bytes)) {
        pace.pass(line)?;
        let (trimmed, line) = (line.trim_ascii(), text::without_blanks(line));
        if number < layout.first_row || trimmed.is_empty() || text::is_comment(trimmed) {
            continue;
        }
        line::check(layout.dialect, line, number)?;
        let point = match layout.point(line, number) {
            Err(FormatError::TooFewColumns { .. })
                if block.next(points.count(), &layout, trimmed) =>
            {
                running = Running::default();
                continue;
            }
            point => point?,
        };
        if layout.first == First::Running {
            running.check(layout.dialect, line, number)?;
        }
        points.push(point)?;
    }
    block.check_end(points.count())?;
    points.end()?;
    Ok(About { unit: layout.unit, ..About::default() })
}

/// Points whose number is announced before them.
struct Block {
    announced: Option<u64>,
    begin: usize,
}

impl Block {
    /// Begins the next block where the last one is full and `line` announces another.
    fn next(&mut self, points: usize, layout: &Layout, line: &[u8]) -> bool {
        let full = self.announced == Some((points - self.begin) as u64);
        let count = heading::count(layout.dialect, line).filter(|_| full);
        if count.is_some() {
            (self.announced, self.begin) = (count, points);
        }
        count.is_some()
    }

    /// A file with fewer points than announced was cut off.
    fn check_end(&self, points: usize) -> Result<(), FormatError> {
        let found = (points - self.begin) as u64;
        match self.announced.filter(|announced| *announced > found) {
            Some(announced) => {
                Err(FormatError::Truncated { format: Format::Xyz, announced, found })
            }
            None => Ok(()),
        }
    }
}

impl Layout {
    fn point(&self, line: &[u8], number: usize) -> Result<Vec3, FormatError> {
        let mut point = Vec3::zeros();
        let (mut seen, mut bad) = (0, None);
        self.dialect.each_field(line, |column, field| {
            seen = column + 1;
            if let Some(axis) = self.columns.iter().position(|&c| c == column) {
                match self.dialect.value(field) {
                    Some(value) => point[axis] = value,
                    None => bad = Some(field),
                }
            }
            bad.is_none() && seen < self.needed
        });
        if let Some(field) = bad {
            let text = excerpt(field);
            return Err(match odd::cure(field) {
                Some(cure) => FormatError::OddNumber { line: number, text, cure },
                None => FormatError::BadNumber { format: Format::Xyz, line: number, text },
            });
        }
        if seen < self.needed {
            return Err(FormatError::TooFewColumns {
                format: Format::Xyz,
                line: number,
                found: seen,
                needed: self.needed,
            });
        }
        Ok(point)
    }
}

#[cfg(test)]
mod clouds;
#[cfg(test)]
mod first_tests;
#[cfg(test)]
mod long_lines;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod written_tests;
