//! The lines before the first point: titles, names of columns, units, a count of points.

use super::super::{Bounds, Format, FormatError, error::excerpt, text};
use super::{
    dialect::{DIALECTS, Dialect, Line, MAX_COLUMNS},
    first::{self, First},
    line,
    names::{self, Ambiguous},
    running,
};
use crate::geometry::LengthUnit;

/// Lines of titles and units there may be before the points without a comment's mark.
const MAX_OTHER_LINES: usize = 3;

/// What stands before the first row.
#[derive(Default)]
pub(super) struct Heading<'a> {
    /// The last line of names.
    names: Option<Names<'a>>,
    /// The last comment that has names in it: it may be about something else.
    comment: Option<Names<'a>>,
    /// Lines that are neither names nor a count.
    pub(super) others: Vec<Line<'a>>,
    /// A number alone in its line.
    pub(super) announced: Option<u64>,
}

pub(super) fn error(line: usize, reason: impl Into<String>) -> FormatError {
    FormatError::Header { format: Format::Xyz, line, reason: reason.into() }
}

impl<'a> Heading<'a> {
    /// Parts the first lines into what stands before the first row, and the rows without comments.
    pub(super) fn take(
        dialect: Dialect,
        sample: &[Line<'a>],
        limits: &dyn Bounds,
    ) -> Result<(Self, Vec<Line<'a>>), FormatError> {
        let mut heading = Self::default();
        for (place, &(number, line)) in sample.iter().enumerate() {
            limits.go_on()?;
            if text::is_comment(line) {
                let names = Names::of(dialect, (number, comment_text(line)));
                heading.comment = names.or(heading.comment);
            } else if let (None | Some(0), Some(count)) = (heading.announced, count(dialect, line))
            {
                heading.announced = Some(count);
            } else if let Some(names) = Names::of(dialect, (number, line)) {
                heading.names = Some(names);
            } else if is_row(dialect, line) {
                let rows = sample[place..].iter().filter(|(_, line)| !text::is_comment(line));
                return Ok((heading, rows.copied().collect()));
            } else if DIALECTS.iter().any(|dialect| dialect.is_wide(line)) {
                // it may have names: to pass it over could be to take other columns than it says
                return Err(line::wide(number));
            } else {
                heading.others.push((number, line));
                if heading.others.len() > MAX_OTHER_LINES {
                    if !sample.iter().any(|(_, line)| is_row(dialect, line)) {
                        // no heading: what is wrong with the first line is wrong with all
                        break;
                    }
                    let line = excerpt(line);
                    let reason = format!(
                        "'{line}' is no point: mark lines that are none with #, or say how many stand \
                         before the points by the parameter skip_lines"
                    );
                    return Err(error(number, reason));
                }
            }
        }
        Ok((heading, vec![]))
    }

    /// The unit that the names of these columns state, or a line of units.
    pub(super) fn unit(&self, dialect: Dialect, columns: [usize; 3]) -> Option<LengthUnit> {
        let named = self.names.as_ref().or(self.comment.as_ref());
        let named = named.and_then(|names| common(names.named().ok()?.map(|at| names.units[at])));
        let below = || {
            let lines = self.others.iter().map(|(_, line)| dialect.fields(line));
            lines.into_iter().find_map(|line| {
                let unit = |at: usize| line.get(at).and_then(|field| names::unit(field));
                common(columns.map(unit))
            })
        };
        named.or_else(below)
    }

    /// The columns that the heading names; `None` where it names none.
    pub(super) fn columns(
        &self,
        dialect: Dialect,
        rows: &[Line],
    ) -> Result<Option<[usize; 3]>, FormatError> {
        let Some(fields) = rows.first().map(|(_, row)| dialect.fields(row)) else {
            return Ok(None);
        };
        if let Some(names) = &self.names {
            return names.above(&fields, dialect, rows).map(Some);
        }
        // a comment may speak of x, y and z and name no columns
        if let Some(names) = self.comment.as_ref().filter(|n| n.fields.len() == fields.len()) {
            return names.columns().map(Some);
        }
        let others = self.others.iter().map(|(_, line)| dialect.fields(line));
        match others.into_iter().find(|other| other.len() >= 3 && other.len() == fields.len()) {
            Some(other) => {
                let found = listed(&other);
                Err(FormatError::NoCoordinates { format: Format::Xyz, found })
            }
            None => Ok(None),
        }
    }
}

/// The unit of three columns, where all of them have the same.
fn common(units: [Option<LengthUnit>; 3]) -> Option<LengthUnit> {
    units[0].filter(|_| units[0] == units[1] && units[1] == units[2])
}

/// The number of points that a line announces.
pub(super) fn count(dialect: Dialect, line: &[u8]) -> Option<u64> {
    let fields = dialect.fields(line);
    let [field] = fields[..] else { return None };
    std::str::from_utf8(field).ok()?.parse().ok()
}

/// Whether a line is a point: three numbers at least, or three values that may be missing in its first
/// columns.
fn is_row(dialect: Dialect, line: &[u8]) -> bool {
    let values = || dialect.fields(line).into_iter().take(3).map(|field| dialect.value(field));
    dialect.has_numbers(line) || (values().len() == 3 && values().all(|value| value.is_some()))
}

/// What a comment says: `// Columns: X Y Z` says `X Y Z`.
fn comment_text(line: &[u8]) -> &[u8] {
    let marks = line.iter().take_while(|b| b"#/%".contains(b)).count();
    let said = &line[marks..];
    let label = said.windows(2).position(|pair| pair == b": ");
    label.map_or(said, |at| &said[at + 2..]).trim_ascii()
}

/// Some names as an error shows them.
fn listed(fields: &[&[u8]]) -> String {
    fields.iter().take(12).map(|field| excerpt(field)).collect::<Vec<_>>().join(", ")
}

/// The unit of each name.
type Units = Vec<Option<LengthUnit>>;

/// The fields of a line of names without the units behind them, and the unit of each; `None` where they are more than
/// [`MAX_COLUMNS`].
fn parted(dialect: Dialect, line: &[u8]) -> Option<(Vec<&[u8]>, Units)> {
    let (mut names, mut units) = (Vec::new(), Units::new());
    dialect.each_field(line, |_, field| {
        let unit = field.starts_with(b"[") || field.starts_with(b"(");
        if !(unit && dialect.parts_at_blanks()) {
            names.push(field);
            units.push(names::unit(field));
        } else if let Some(last) = units.last_mut() {
            *last = names::unit(field);
        }
        names.len() <= MAX_COLUMNS
    });
    (names.len() <= MAX_COLUMNS).then_some((names, units))
}

/// A line of names, those of coordinates among them.
struct Names<'a> {
    line: usize,
    fields: Vec<&'a [u8]>,
    units: Units,
    columns: Result<[usize; 3], Ambiguous>,
}

impl<'a> Names<'a> {
    /// The names in a line, parted like the points or in another way; `None` where none of them is a
    /// coordinate's, or there are more than [`MAX_COLUMNS`].
    fn of(dialect: Dialect, (line, text): Line<'a>) -> Option<Self> {
        let ways = std::iter::once(dialect).chain(DIALECTS);
        ways.into_iter().find_map(|dialect| {
            let (fields, units) = parted(dialect, text)?;
            let columns = names::coordinates(&fields).transpose()?;
            Some(Self { line, fields, units, columns })
        })
    }

    /// The places of the coordinates among the names.
    fn named(&self) -> Result<[usize; 3], Ambiguous> {
        self.columns
    }

    fn columns(&self) -> Result<[usize; 3], FormatError> {
        let found = || listed(&self.fields);
        self.columns.map_err(|Ambiguous| FormatError::AmbiguousColumns { found: found() })
    }

    /// The columns above rows of which the first has `fields`. Names and fields differ in number where a
    /// name has blanks in it, and where rows begin with a number or name of their own that has no name.
    fn above(
        &self,
        fields: &[&[u8]],
        dialect: Dialect,
        rows: &[Line],
    ) -> Result<[usize; 3], FormatError> {
        let columns = self.columns()?;
        let end = if fields.last().is_some_and(|field| field.is_empty()) { 1 } else { 0 };
        let (names, fields_there) = (self.fields.len(), fields.len());
        let unsure = || {
            let reason = format!(
                "it has {names} names and the next line {fields_there} columns: say which are x, y \
                 and z by the parameter columns"
            );
            error(self.line, reason)
        };
        if names == fields_there || names + end == fields_there {
            return Ok(columns);
        }
        if names > fields_there {
            // the names before the coordinates may be fewer than their words
            return if columns == [0, 1, 2] { Ok(columns) } else { Err(unsure()) };
        }
        if names + 1 < fields_there {
            return Ok(columns);
        }
        let mut firsts = rows.iter().map(|(_, row)| dialect.first(row));
        let named = firsts.clone().all(|first| dialect.value(first).is_none());
        // names that begin with others do not say x for the first column
        let x_first = columns.iter().all(|column| *column < 3);
        let passed = if x_first {
            first::judge(dialect, rows, &[]).map_err(|_| unsure())? != First::Coordinate
        } else {
            running::are_all(dialect, rows)
        };
        if named || passed {
            return Ok(columns.map(|column| column + 1));
        }
        let whole = firsts.all(|first| running::number(first).is_some());
        if whole { Err(unsure()) } else { Ok(columns) }
    }
}
