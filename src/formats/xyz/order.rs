//! How the values of a column run from row to row.

/// What three of four steps from row to row are below, over the range of the middle half, where values run
/// smoothly: it is 1 to 1.2 for values in no order, and about 2/n along lines of n rows each.
const SMOOTH: f64 = 0.5;
/// Steps up to this share of the median one away from it are even; a share of the steps that are so in
/// times, with gaps where lines end. Of a sorted cloud's 17 % are, and 40 % where few decimals are written:
/// chance makes 17 of 19 even in less than one of ten thousand.
const EVEN: f64 = 0.25;
const EVEN_SHARE: f64 = 0.85;
/// Rows that may stay where they were in a column that ascends: more are the rows of a grid.
const STAYING: f64 = 0.1;
/// The least range, as a share of the largest value, of intensities: heights of a plane have less.
const INTENSITIES: f64 = 0.2;

/// How a column runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Order {
    /// All its values are one.
    Constant,
    /// Most neighbours are alike.
    Smooth,
    /// Neighbours are as different as any two.
    Rough,
}

impl Order {
    pub(super) fn of(values: &[f64]) -> Self {
        if values.windows(2).all(|pair| pair[0] == pair[1]) {
            return Self::Constant;
        }
        let step = at_quarter(3, &sorted(steps(values).map(f64::abs)));
        if step <= SMOOTH * spread(values) { Self::Smooth } else { Self::Rough }
    }
}

/// The range of the middle half.
pub(super) fn spread(values: &[f64]) -> f64 {
    let sorted = sorted(values.iter().copied());
    at_quarter(3, &sorted) - at_quarter(1, &sorted)
}

/// The value that so many quarters of those in order are below; 0 of none.
fn at_quarter(quarters: usize, sorted: &[f64]) -> f64 {
    sorted.get(quarters * sorted.len() / 4).copied().unwrap_or_default()
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted
}

fn steps(values: &[f64]) -> impl Iterator<Item = f64> + Clone + '_ {
    values.windows(2).map(|pair| pair[1] - pair[0])
}

/// Whether values ascend; a few may stay.
pub(super) fn ascends(values: &[f64]) -> bool {
    let stay = steps(values).filter(|step| *step == 0.0).count();
    steps(values).all(|step| step >= 0.0) && stay as f64 <= STAYING * values.len() as f64
}

/// Whether nearly all values that ascend do so in even steps.
pub(super) fn is_even(values: &[f64]) -> bool {
    let usual = at_quarter(2, &sorted(steps(values)));
    let even = steps(values).filter(|step| (step - usual).abs() <= EVEN * usual).count();
    even as f64 >= EVEN_SHARE * (values.len() - 1) as f64
}

/// Whether all steps are one.
pub(super) fn are_equal(values: &[f64]) -> bool {
    let mut others = steps(values);
    let first = others.next();
    others.all(|step| Some(step) == first)
}

/// Whether values may be intensities: none below 0, and not all about one.
pub(super) fn is_like_intensity(values: &[f64]) -> bool {
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    least >= 0.0 && most - least > INTENSITIES * most
}

/// A column that ascends line after line, and begins each line anew.
pub(super) struct Lines<'a> {
    /// All of them; the last one may be cut off.
    lines: Vec<&'a [f64]>,
}

impl<'a> Lines<'a> {
    /// The fewest values of a line.
    const SHORTEST: usize = 4;

    /// The lines of a column; `None` where there is but one, or a whole one is short.
    pub(super) fn of(values: &'a [f64]) -> Option<Self> {
        let lines: Vec<&[f64]> = values.chunk_by(|a, b| a < b).collect();
        let (_, whole) = lines.split_last()?;
        let long = whole.iter().all(|line| line.len() >= Self::SHORTEST);
        (long && !whole.is_empty()).then_some(Self { lines })
    }

    /// Whether all lines begin with one value and go on in one step, up to the digits written.
    pub(super) fn are_equal(&self) -> bool {
        /// Of a step: what rounding leaves where it is written with three digits.
        const ROUNDED: f64 = 0.01;
        let begin = self.lines[0][0];
        let step = self.lines[0][1] - begin;
        let mut steps = self.lines.iter().flat_map(|line| steps(line));
        let near = |a: f64, b: f64| (a - b).abs() <= ROUNDED * step;
        steps.all(|s| near(s, step)) && self.lines.iter().all(|line| near(line[0], begin))
    }

    /// Whether there are some whole lines, and all of them are as long.
    pub(super) fn are_long(&self) -> bool {
        /// Whole lines that come about by chance in no cloud.
        const FEWEST: usize = 3;
        let whole = &self.lines[..self.lines.len() - 1];
        whole.len() >= FEWEST && whole.iter().all(|line| line.len() == whole[0].len())
    }

    /// Whether another column varies in every whole line.
    pub(super) fn vary(&self, values: &[f64]) -> bool {
        let mut rest = values;
        self.lines[..self.lines.len() - 1].iter().all(|line| {
            let (here, behind) = rest.split_at(line.len().min(rest.len()));
            rest = behind;
            here.windows(2).any(|pair| pair[0] != pair[1])
        })
    }
}
