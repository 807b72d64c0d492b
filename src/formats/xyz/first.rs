//! Whether the first column of a text that names no columns is x.
//!
//! Before the coordinates there may be a running number, a time, the number of a scan or a ring. Three
//! things tell: how the columns are written ([`super::style`]), how the first one runs from row to row, and
//! whether the others run smoothly, as along a scan. What they leave open is refused, but a cloud in any
//! usual order is not: sorted, in rows of a grid, along scan lines, in none.

use super::super::FormatError;
use super::{
    dialect::{Dialect, Line},
    order::{self, Order},
    running::{self, FEWEST},
    style::{Style, are_alike, sets_apart},
};

/// Rows that are enough to tell numbers in no order from coordinates: so many along x that are whole, none of
/// them twice, beside others that are not, are no scan's.
const FEWEST_SHUFFLED: usize = 20;
/// Up to so many rows such numbers must also be dense: half as many as there is room for between the least
/// and the largest. Chance leaves none twice among 20 in less than 1 % of clouds, among 100 never.
const FEWEST_SPARSE: usize = 100;
/// Rows that are enough to tell times from coordinates.
const FEWEST_ASCENDING: usize = 20;
/// A profile across its plane, as a share of its height: noise of the one is less, a surface more.
const THIN: f64 = 0.05;
/// Seconds since 1970 or 1980 are above this, and this many times any coordinate on Earth in metres.
const LEAST_TIME: f64 = 1e8;
const TIMES_COORDINATES: f64 = 20.0;
/// How far from 1 the squared length of a unit normal may be, written with three decimals.
const NORMAL: f64 = 0.01;

/// What the first column is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum First {
    /// x.
    Coordinate,
    /// Running numbers; the coordinates are behind them.
    Running,
    /// Something else before the coordinates.
    Other,
}

/// Tells what the first column is. `rows` are the first, `later` some from everywhere behind them.
///
/// # Errors
/// It cannot be told.
pub(super) fn judge(
    dialect: Dialect,
    rows: &[Line],
    later: &[&[u8]],
) -> Result<First, FormatError> {
    let four: Option<Vec<[f64; 4]>> = rows.iter().map(|(_, row)| values(dialect, row)).collect();
    let Some(four) = four.filter(|four| four.len() >= FEWEST) else {
        return Ok(First::Coordinate);
    };
    let whole_rows: Vec<&[u8]> = rows
        .iter()
        .zip(&four)
        .filter_map(|((_, row), four)| four.iter().all(|x| x.is_finite()).then_some(*row))
        .collect();
    let later = later.iter().filter_map(|row| values(dialect, row)).map(|four| four[0]);
    let sample = Sample {
        dialect,
        rows,
        styles: styles(dialect, &whole_rows),
        later: later.filter(|x| x.is_finite()).collect(),
        points: four.into_iter().filter(|four| four.iter().all(|x| x.is_finite())).collect(),
    };
    if sample.points.len() < FEWEST || sample.begins_with_x(&whole_rows) {
        return Ok(First::Coordinate);
    }
    let told = match sample.numbers() {
        Some(numbers) => sample.judge_numbers(&numbers),
        None => sample.judge_fractions(),
    };
    told.ok_or(FormatError::FirstColumn { line: rows[0].0 })
}

/// The first four values of a row.
fn values(dialect: Dialect, row: &[u8]) -> Option<[f64; 4]> {
    match dialect.fields(row)[..] {
        [a, b, c, d, ..] => {
            let value = |field| dialect.value(field);
            Some([value(a)?, value(b)?, value(c)?, value(d)?])
        }
        _ => None,
    }
}

fn styles(dialect: Dialect, rows: &[&[u8]]) -> [Style; 4] {
    let fields: Vec<_> = rows.iter().map(|row| dialect.fields(row)).collect();
    [0, 1, 2, 3].map(|column| Style::of(dialect, fields.iter().map(|fields| fields[column])))
}

/// The rows that are looked at.
struct Sample<'a> {
    dialect: Dialect,
    rows: &'a [Line<'a>],
    /// The first four values of those rows that have no missing ones.
    points: Vec<[f64; 4]>,
    styles: [Style; 4],
    /// The first values of rows from everywhere behind.
    later: Vec<f64>,
}

impl Sample<'_> {
    /// Whether the fourth column shows that the first three are the coordinates: it is written in another
    /// way, or unit normals begin there.
    fn begins_with_x(&self, rows: &[&[u8]]) -> bool {
        let [x, y, z, next] = self.styles;
        let label = next.is_plain() && ![x, y, z].into_iter().any(Style::is_plain);
        label || sets_apart(&[x, y, z], next) || rows.iter().all(|row| self.has_normal(row))
    }

    fn has_normal(&self, row: &[u8]) -> bool {
        let fields = self.dialect.fields(row);
        let normal = fields.get(3..6).map(|n| n.iter().filter_map(|f| self.dialect.value(f)));
        normal.is_some_and(|n| (n.map(|x| x * x).sum::<f64>() - 1.0).abs() < NORMAL)
    }

    /// The whole numbers of the first column, of rows without coordinates too.
    fn numbers(&self) -> Option<Vec<i64>> {
        let numbers = self.rows.iter().map(|(_, row)| running::number(self.dialect.first(row)));
        numbers.collect()
    }

    fn column(&self, column: usize) -> Vec<f64> {
        self.points.iter().map(|p| p[column]).collect()
    }

    fn orders(&self) -> [Order; 3] {
        [1, 2, 3].map(|column| Order::of(&self.column(column)))
    }

    /// Whether the first column is written in another way than the three behind it.
    fn is_apart(&self) -> bool {
        let [first, x, y, z] = self.styles;
        sets_apart(&[x, y, z], first)
    }

    /// Whether the three columns behind have no fraction.
    fn others_are_whole(&self) -> bool {
        self.points.iter().flat_map(|p| &p[1..]).all(|x| x.fract() == 0.0)
    }

    /// `None` where it cannot be told.
    fn judge_numbers(&self, numbers: &[i64]) -> Option<First> {
        if running::are_all(self.dialect, self.rows) {
            return self.is_running().then_some(First::Running);
        }
        if self.are_dates() {
            return Some(First::Other);
        }
        if self.is_apart() {
            return None;
        }
        let sure = if numbers.windows(2).all(|pair| pair[0] < pair[1]) {
            // numbers with gaps, or x in order
            let even = self.is_regular() || order::are_equal(&self.column(0));
            let many = is_dense(numbers) || numbers.len() >= FEWEST_SPARSE;
            self.others_are_whole() || (!even && (!many || are_alike(&self.styles)))
        } else {
            !self.is_shuffled(numbers) && !self.is_label(numbers) && !self.has_rings()
        };
        sure.then_some(First::Coordinate)
    }

    /// Whether numbers that count up are running numbers, and not the x of a profile or of a grid's row.
    fn is_running(&self) -> bool {
        let orders = self.orders();
        if self.others_are_whole() || orders.contains(&Order::Constant) {
            return false;
        }
        if are_alike(&self.styles) {
            // x in steps of one and the others in no order: no profile
            return orders == [Order::Rough; 3];
        }
        let [_, y, z, next] = self.styles;
        let intensity = orders[2] == Order::Rough && order::is_like_intensity(&self.column(3));
        let profile = intensity && self.is_profile(&orders);
        let coordinate = match (are_alike(&[y, z]), next.is_plain()) {
            (true, _) => are_alike(&[y, z, next]),
            (false, plain) => !plain || y.is_plain() || z.is_plain(),
        };
        coordinate && !profile
    }

    /// Whether the second and third column run smoothly, or hardly vary beside the other one.
    fn is_profile(&self, orders: &[Order; 3]) -> bool {
        let [y, z] = [1, 2].map(|column| order::spread(&self.column(column)));
        let smooth = |at: usize| orders[at] == Order::Smooth;
        (smooth(0) || y < THIN * z) && (smooth(1) || z < THIN * y) && (smooth(0) || smooth(1))
    }

    /// Whether each number is there once, in no order.
    fn is_shuffled(&self, numbers: &[i64]) -> bool {
        let mut sorted = numbers.to_vec();
        sorted.sort_unstable();
        let distinct = sorted.windows(2).all(|pair| pair[0] < pair[1]);
        distinct
            && numbers.len() >= FEWEST_SHUFFLED
            && (is_dense(numbers) || numbers.len() >= FEWEST_SPARSE)
            && !self.others_are_whole()
    }

    /// Whether the first column has whole numbers and the others fractions, and it stays throughout or the
    /// fourth column is below 0 as no intensity is.
    fn is_label(&self, numbers: &[i64]) -> bool {
        let [first, others @ ..] = self.styles;
        let plain = first.is_plain() && !others.into_iter().any(Style::is_plain);
        let number = self.points[0][0];
        let stays = self.column(0).iter().chain(&self.later).all(|x| *x == number);
        let signed = || numbers.iter().all(|n| *n >= 0) && self.column(3).iter().any(|x| *x < 0.0);
        plain && self.points.len() >= FEWEST_SHUFFLED && (stays || signed())
    }

    /// Whether the first column counts up to one number again and again, while no other column stays.
    fn has_rings(&self) -> bool {
        let first = self.column(0);
        let rings = order::Lines::of(&first).filter(|lines| lines.are_equal() && lines.are_long());
        self.styles[0].is_plain() && rings.is_some_and(|rings| self.vary_along(&rings))
    }

    fn vary_along(&self, lines: &order::Lines) -> bool {
        [1, 2, 3].into_iter().all(|column| lines.vary(&self.column(column)))
    }

    /// `None` where it cannot be told.
    fn judge_fractions(&self) -> Option<First> {
        if self.is_apart() || self.are_dates() {
            return Some(First::Other);
        }
        let scanned = || self.is_ascending() && self.orders() == [Order::Smooth; 3];
        let time = self.is_regular() || scanned() || self.starts_over();
        (!time).then_some(First::Coordinate)
    }

    /// Whether the first column has seconds since some year, or parts of them.
    fn are_dates(&self) -> bool {
        let most = |x: f64, p: &[f64; 4]| p[1..].iter().fold(x, |most, x| most.max(x.abs()));
        let coordinates = self.points.iter().fold(0.0, most);
        let least = self.points.iter().fold(f64::INFINITY, |least, p| least.min(p[0]));
        least >= LEAST_TIME.max(TIMES_COORDINATES * coordinates)
    }

    /// Whether the first column ascends through all of the text but for a few rows that stay.
    fn is_ascending(&self) -> bool {
        let first = self.column(0);
        let whole: Vec<f64> = first.iter().chain(&self.later).copied().collect();
        let many = first.len() >= FEWEST_ASCENDING;
        many && order::ascends(&first) && whole.windows(2).all(|pair| pair[0] <= pair[1])
    }

    /// Whether it does so in even steps.
    fn is_regular(&self) -> bool {
        self.is_ascending() && order::is_even(&self.column(0))
    }

    /// Whether the first column counts in the same way along every line, while no other stays or jumps.
    fn starts_over(&self) -> bool {
        let first = self.column(0);
        let lines = order::Lines::of(&first).filter(order::Lines::are_equal);
        self.orders() == [Order::Smooth; 3] && lines.is_some_and(|lines| self.vary_along(&lines))
    }
}

/// Whether numbers are half as many as there is room for between the least and the largest.
fn is_dense(numbers: &[i64]) -> bool {
    let ends = numbers.iter().min().zip(numbers.iter().max());
    ends.is_some_and(|(least, most)| most.abs_diff(*least) < 2 * numbers.len() as u64)
}
