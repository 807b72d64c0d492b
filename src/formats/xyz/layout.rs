//! Where the coordinates stand in the lines of a text, as its first lines show.

use super::super::{
    Bounds, FormatError, Hints,
    line::{MAX_LINE_BYTES, Pace, check_length},
    text,
};
use super::{
    dialect::{Dialect, Line},
    first::{self, First},
    heading::{Heading, error},
    line,
};
use crate::geometry::LengthUnit;

/// Lines that are looked at to tell how the text is written, and as many comments.
const SAMPLE_LINES: usize = 1000;
/// Bytes that are looked at to tell the same, and as many of comments: none further when there are so many.
const SAMPLE_BYTES: usize = 1024 * 1024;

/// How to read the lines.
#[derive(Debug)]
pub(super) struct Layout {
    pub(super) dialect: Dialect,
    /// The columns of x, y and z.
    pub(super) columns: [usize; 3],
    /// Columns up to the last coordinate.
    pub(super) needed: usize,
    /// The line of the first point.
    pub(super) first_row: usize,
    /// How many points a line before the first one announces.
    pub(super) announced: Option<u64>,
    /// What stands in the first column, where that is looked at.
    pub(super) first: First,
    /// The unit that the names of the coordinates, or a line below them, state.
    pub(super) unit: Option<LengthUnit>,
}

impl Layout {
    /// The layout that the first lines show, and `hints` where the sender knows more.
    ///
    /// # Errors
    /// They can be read in two ways or are too long, or the cloud is not wanted any more.
    pub(super) fn of(text: &[u8], hints: &Hints, limits: &dyn Bounds) -> Result<Self, FormatError> {
        let (sample, passed) = sample(text, hints.skip_lines, limits)?;
        let told = sample.iter().map(|(_, line)| *line).filter(|line| !text::is_comment(line));
        let dialect = Dialect::of(told);
        let (heading, rows) = Heading::take(dialect, &sample, limits)?;
        let mut layout = Self {
            dialect,
            columns: [0, 1, 2],
            needed: 3,
            // where no line is a row, the first that should be one has the error
            first_row: rows.first().or(heading.others.first()).map_or(usize::MAX, |line| line.0),
            announced: heading.announced,
            first: First::Coordinate,
            unit: None,
        };
        let Some(&(number, row)) = rows.first() else { return Ok(layout) };
        line::check(dialect, row, number)?;
        if dialect.is_unsure(row) {
            let reason =
                "its commas may part numbers or be in them: put semicolons between numbers";
            return Err(error(number, reason));
        }
        if dialect.may_be_thousands(&rows) {
            let reason = "the commas in its numbers may mark thousands or fractions: write fractions \
                          with a point, and no marks of thousands";
            return Err(error(number, reason));
        }
        if let Some(columns) = hints.columns {
            layout.columns = columns.places();
        } else if let Some(named) = heading.columns(dialect, &rows)? {
            layout.columns = named;
        } else {
            layout.first = first::judge(dialect, &rows, &later(text, passed))?;
            if layout.first != First::Coordinate {
                layout.columns = [1, 2, 3];
            }
        }
        layout.unit = heading.unit(dialect, layout.columns);
        layout.needed = 1 + layout.columns.into_iter().max().unwrap_or_default();
        Ok(layout)
    }
}

/// What there is room for among the lines that are looked at.
struct Room {
    lines: usize,
    bytes: usize,
}

impl Room {
    const SAMPLE: Self = Self { lines: SAMPLE_LINES, bytes: SAMPLE_BYTES };

    fn is_left(&self) -> bool {
        self.lines > 0 && self.bytes > 0
    }

    fn take(&mut self, line: &[u8]) {
        self.lines -= 1;
        self.bytes = self.bytes.saturating_sub(line.len());
    }
}

/// The first lines and comments, empty lines and long comments apart, and the bytes up to there.
fn sample<'a>(
    text: &'a [u8],
    lines_before: usize,
    limits: &dyn Bounds,
) -> Result<(Vec<Line<'a>>, usize), FormatError> {
    let (mut told, mut comments) = (Room::SAMPLE, Room::SAMPLE);
    let (mut sample, mut passed) = (Vec::new(), 0);
    let mut pace = Pace::new(limits);
    for (number, line) in (1 + lines_before..).zip(text::lines(text)) {
        pace.pass(line)?;
        passed += line.len() + 1;
        let (trimmed, line) = (line.trim_ascii(), text::without_blanks(line));
        if trimmed.is_empty() {
            continue;
        }
        if text::is_comment(trimmed) {
            if comments.is_left() && trimmed.len() <= MAX_LINE_BYTES {
                comments.take(trimmed);
                sample.push((number, trimmed));
            }
            continue;
        }
        check_length(trimmed, number)?;
        told.take(line);
        sample.push((number, line));
        if !told.is_left() {
            break;
        }
    }
    Ok((sample, passed))
}

/// A few lines, comments apart, from each of many places behind the first `passed` bytes, in order.
fn later(text: &[u8], passed: usize) -> Vec<&[u8]> {
    /// Places, evenly spread: many, for most may lie in one line of a scan.
    const PLACES: usize = 64;
    /// Lines at each, and the bytes they are looked for in.
    const LINES: usize = 8;
    const REACH: usize = 4096;
    let behind = text.get(passed..).unwrap_or_default();
    let places = (0..PLACES).map(|place| behind.len() / PLACES * place);
    let lines = places.flat_map(|begin| {
        let reach = &behind[begin..behind.len().min(begin + REACH.min(behind.len() / PLACES))];
        // the first and the last may be cut
        let lines: Vec<_> = text::lines(reach).take(LINES + 2).collect();
        let whole = lines.len().saturating_sub(1);
        lines.into_iter().take(whole).skip(1).map(text::without_blanks)
    });
    lines.filter(|line| !text::is_comment(line)).collect()
}
