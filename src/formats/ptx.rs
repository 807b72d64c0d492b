//! PTX (Leica): scans in rows and columns, one behind the other, each with its pose.
//!
//! A scan is the number of its columns, that of its rows, the scanner's place and axes, four rows of a matrix, and
//! columns times rows lines `x y z [intensity [r g b]]`, column by column. The matrix is for row vectors,
//! [x y z 1] M, and may scale. A point at exactly 0, 0, 0, the scanner itself, is a hole; it is written with an intensity
//! of 0.5.

mod pose;

use pose::Pose;

use super::{
    Bounds, Format, FormatError,
    error::excerpt,
    line::{Pace, check_length},
    sink::{About, Singly, Sink},
    text,
};
use crate::geometry::{Grid, PointCloud, Vec3};

/// Lines of a scan whose decimals are counted.
const LOOKED_AT: u64 = 1000;

/// Whether a text begins as one: two counts, then a place and three axes, then a matrix.
pub(super) fn begins(bytes: &[u8]) -> bool {
    /// Bytes that the ten lines have at most: numbers of 25 characters, blanks, and lines without anything.
    const HEAD: usize = 4096;
    let head = text::without_bom(bytes);
    let lines = text::lines(&head[..head.len().min(HEAD)]).map(<[u8]>::trim_ascii);
    let is_told = |line: &&[u8]| !line.is_empty() && !text::is_comment(line);
    let lines: Vec<&[u8]> = lines.filter(is_told).take(10).collect();
    let has = |(line, fields): (&&[u8], usize)| numbers(line).is_some_and(|n| n.len() == fields);
    // the counts stand in a line each, or in one
    let counted = lines.iter().take_while(|line| counts(line).is_some_and(|n| n.len() < 3)).count();
    (1..=2).contains(&counted)
        && lines.len() >= counted + 8
        && lines[..counted].iter().filter_map(|line| counts(line)).flatten().count() == 2
        && lines[counted..].iter().zip([3, 3, 3, 3, 4, 4, 4, 4]).all(has)
}

/// Reads every scan, in the frame that their poses lead to.
///
/// # Errors
/// A header is wrong, a line is no point, lines are missing, or `limits` are exceeded.
pub(super) fn read(bytes: &[u8], limits: &dyn Bounds) -> Result<PointCloud, FormatError> {
    let mut points = Vec::new();
    Ok(pass(bytes, limits, &mut points)?.cloud(points))
}

/// Hands the points on, as [`read`] finds them.
pub(super) fn pass(
    bytes: &[u8],
    limits: &dyn Bounds,
    sink: &mut dyn Sink,
) -> Result<About, FormatError> {
    let bytes = text::without_bom(bytes);
    let mut lines = Lines { all: text::lines(bytes), number: 0, pace: Pace::new(limits) };
    sink.expect(text::line_count(bytes).min(limits.most()))?;
    let mut points = Singly::new(sink, limits);
    let (mut grid, mut scans, mut resolution) = (None, 0, 0.0_f64);
    while let Some(scan) = Scan::next(&mut lines)? {
        let announced = scan.columns.saturating_mul(scan.rows);
        let mut decimals = Decimals::default();
        for k in 0..announced {
            let Some((number, line)) = lines.next()? else {
                return Err(FormatError::Truncated { format: Format::Ptx, announced, found: k });
            };
            let local = point(line, number)?;
            if k < LOOKED_AT {
                decimals.see(line);
            }
            // nothing is measured at the scanner itself
            let hole = local == Vec3::zeros();
            points.push(if hole { Vec3::repeat(f64::NAN) } else { scan.pose.world(&local) })?;
        }
        scans += 1;
        // the points of a column follow each other
        let size = usize::try_from(scan.rows).ok().zip(usize::try_from(scan.columns).ok());
        grid = size.filter(|_| scans == 1).map(|(width, height)| Grid { width, height });
        resolution = resolution.max(decimals.step() * scan.pose.scale());
    }
    points.end()?;
    Ok(About { grid, resolution, unit: None })
}

/// The lines of a file that have anything in them and are no comments.
struct Lines<'a, I> {
    all: I,
    number: usize,
    pace: Pace<'a>,
}

impl<'b, I: Iterator<Item = &'b [u8]>> Lines<'_, I> {
    /// The next one, trimmed, and its number.
    fn next(&mut self) -> Result<Option<(usize, &'b [u8])>, FormatError> {
        for line in self.all.by_ref() {
            self.pace.pass(line)?;
            self.number += 1;
            let line = line.trim_ascii();
            check_length(line, self.number)?;
            if !line.is_empty() && !text::is_comment(line) {
                return Ok(Some((self.number, line)));
            }
        }
        Ok(None)
    }
}

/// What stands before the points of a scan.
struct Scan {
    columns: u64,
    rows: u64,
    pose: Pose,
}

impl Scan {
    /// The next header; `None` at the end of the file.
    fn next<'b, I: Iterator<Item = &'b [u8]>>(
        lines: &mut Lines<'_, I>,
    ) -> Result<Option<Self>, FormatError> {
        let Some((number, line)) = lines.next()? else { return Ok(None) };
        let told = counts(line).unwrap_or_default();
        let mut next = || lines.next()?.ok_or_else(|| ends(number));
        let (columns, rows) = match told[..] {
            [columns, rows] => (columns, rows),
            [columns] => {
                let (number, line) = next()?;
                let told = counts(line).unwrap_or_default();
                let [rows] = told[..] else {
                    return Err(error(number, line, "where the number of a scan's rows should be"));
                };
                (columns, rows)
            }
            _ => {
                let what = "where the next scan should begin with its number of columns";
                return Err(error(number, line, what));
            }
        };
        for _ in 0..4 {
            let (number, line) = next()?;
            let found = numbers(line).filter(|n| n.len() == 3);
            found.ok_or_else(|| {
                error(number, line, "where the scanner's place or one of its axes should be")
            })?;
        }
        let mut matrix = [[0.0; 4]; 4];
        let (mut at, mut of) = (0, 0);
        for row in &mut matrix {
            let (number, line) = next()?;
            let found = numbers(line).and_then(|n| <[f64; 4]>::try_from(n).ok());
            *row = found.ok_or_else(|| {
                error(number, line, "where one of the matrix' rows of four numbers should be")
            })?;
            of = if at == 0 { number } else { of };
            at += 1;
        }
        let pose = Pose::of(&matrix).map_err(|reason| header(of, reason))?;
        Ok(Some(Self { columns, rows, pose }))
    }
}

fn header(line: usize, reason: impl Into<String>) -> FormatError {
    FormatError::Header { format: Format::Ptx, line, reason: reason.into() }
}

fn error(number: usize, line: &[u8], what: &str) -> FormatError {
    header(number, format!("'{}' stands {what}", excerpt(line)))
}

fn ends(line: usize) -> FormatError {
    header(line, "the file ends within the header of a scan: send the whole file")
}

/// The numbers of columns or rows in a line that has nothing else and not many.
fn counts(line: &[u8]) -> Option<Vec<u64>> {
    const MOST: usize = 3;
    let fields = line.split(u8::is_ascii_whitespace).filter(|field| !field.is_empty());
    fields.take(MOST).map(|field| std::str::from_utf8(field).ok()?.parse().ok()).collect()
}

/// The numbers of a line that has nothing else and not many.
fn numbers(line: &[u8]) -> Option<Vec<f64>> {
    const MOST: usize = 8;
    let fields = line.split(u8::is_ascii_whitespace).filter(|field| !field.is_empty());
    let numbers: Vec<f64> = fields.take(MOST).map(number).collect::<Option<_>>()?;
    numbers.iter().all(|x| x.is_finite()).then_some(numbers)
}

/// The number of a field, with a point or a comma.
fn number(field: &[u8]) -> Option<f64> {
    text::number(field).or_else(|| text::rare_number(field)).or_else(|| {
        let point = |&b: &u8| if b == b',' { b'.' } else { b };
        text::number(&field.iter().map(point).collect::<Vec<u8>>())
    })
}

/// The point of a line, in its scanner's frame.
fn point(line: &[u8], number_of_line: usize) -> Result<Vec3, FormatError> {
    let mut fields = line.split(u8::is_ascii_whitespace).filter(|field| !field.is_empty());
    let mut point = Vec3::zeros();
    for axis in 0..3 {
        let Some(field) = fields.next() else {
            return Err(FormatError::TooFewColumns {
                format: Format::Ptx,
                line: number_of_line,
                found: axis,
                needed: 3,
            });
        };
        point[axis] = number(field).ok_or_else(|| FormatError::BadNumber {
            format: Format::Ptx,
            line: number_of_line,
            text: excerpt(field),
        })?;
    }
    Ok(point)
}

/// How many decimals coordinates are written with.
#[derive(Default)]
struct Decimals {
    most: i32,
    /// Whether a power of ten stands behind one: then decimals tell no step.
    powers: bool,
}

impl Decimals {
    fn see(&mut self, line: &[u8]) {
        let fields = line.split(u8::is_ascii_whitespace).filter(|field| !field.is_empty());
        for field in fields.take(3) {
            let point = field.iter().position(|b| matches!(b, b'.' | b','));
            let decimals = point.map_or(0, |at| field.len() - at - 1);
            self.most = self.most.max(i32::try_from(decimals).unwrap_or(i32::MAX));
            self.powers |= field.iter().any(|b| b"eEdD".contains(b));
        }
    }

    /// The step in which coordinates come; 0 where it is not known.
    fn step(&self) -> f64 {
        if self.powers { 0.0 } else { 10_f64.powi(-self.most) }
    }
}

#[cfg(test)]
pub(super) mod tests;
