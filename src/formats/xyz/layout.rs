//! Where the coordinates stand in the lines of a text, as its first lines show.

use super::super::{Columns, FormatError, text};
use super::{
    dialect::{Dialect, Line},
    heading::{Heading, error},
    running,
};

/// Lines that are looked at to tell how the text is written.
const SAMPLE_LINES: usize = 1000;

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
    /// Whether running numbers stand in the first column.
    pub(super) running: bool,
}

impl Layout {
    /// The layout that the first lines show; `columns` are those the sender names.
    pub(super) fn of(text: &[u8], columns: Option<Columns>) -> Result<Self, FormatError> {
        let lines = text::lines(text).enumerate().map(|(i, line)| (i + 1, line.trim_ascii()));
        let sample: Vec<Line> =
            lines.filter(|(_, line)| !line.is_empty()).take(SAMPLE_LINES).collect();
        let told = sample.iter().map(|(_, line)| *line).filter(|line| !text::is_comment(line));
        let dialect = Dialect::of(told);
        let (heading, rows) = Heading::take(dialect, &sample)?;
        let mut layout = Self {
            dialect,
            columns: [0, 1, 2],
            needed: 3,
            // where no line is a row, the first that should be one has the error
            first_row: rows.first().or(heading.others.first()).map_or(usize::MAX, |line| line.0),
            announced: heading.announced,
            running: false,
        };
        let Some(&(number, row)) = rows.first() else { return Ok(layout) };
        if dialect.is_unsure(row) {
            let reason =
                "its commas may part numbers or be in them: put semicolons between numbers";
            return Err(error(number, reason));
        }
        if let Some(columns) = columns {
            layout.columns = columns.places();
        } else if let Some(named) = heading.columns(dialect, &rows)? {
            layout.columns = named;
        } else if running::stand_first(dialect, &rows)? {
            (layout.columns, layout.running) = ([1, 2, 3], true);
        }
        layout.needed = 1 + layout.columns.into_iter().max().unwrap_or_default();
        Ok(layout)
    }
}
