//! Clouds made in many orders, written in many forms, with and without something before x.

use std::f64::consts::TAU;

/// How a column is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Form {
    Fixed(usize),
    Exponent(usize),
    /// As few digits as hold it, a whole number without a point.
    Shortest,
    /// The same, a whole number with one.
    Pointed,
    Whole,
}

impl Form {
    pub(super) fn write(self, x: f64) -> String {
        match self {
            Self::Fixed(n) => format!("{x:.n$}"),
            Self::Exponent(n) => format!("{x:.n$e}"),
            Self::Shortest => format!("{}", (x * 1e6).round() / 1e6),
            Self::Pointed => format!("{:?}", (x * 1e6).round() / 1e6),
            Self::Whole => format!("{x:.0}"),
        }
    }
}

pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(super) fn noise(&mut self, sigma: f64) -> f64 {
        sigma * ((0..6).map(|_| self.unit()).sum::<f64>() - 3.0)
    }
}

pub(super) const SIZES: [usize; 4] = [12, 60, 400, 3000];
pub(super) const FORMS: [Form; 5] =
    [Form::Fixed(3), Form::Fixed(6), Form::Exponent(9), Form::Shortest, Form::Pointed];

/// Points of a surface in no order, and of a scan in lines.
pub(super) fn surface(kind: usize, n: usize, random: &mut Random) -> Vec<[f64; 3]> {
    let point = |_| {
        let (u, v) = (random.unit(), random.unit());
        let (sin, cos) = (TAU * u).sin_cos();
        let noise = random.noise(1e-3);
        match kind {
            0 => [10.0 * u, 8.0 * v, 0.3 * u + 0.2 * v + noise],
            1 => [3.0 * cos, 3.0 * sin, 10.0 * v + noise],
            _ => {
                let (z, r) = (2.0 * v - 1.0, (1.0 - (2.0 * v - 1.0).powi(2)).sqrt());
                [50.0 * r * cos, 50.0 * r * sin, 50.0 * z + noise]
            }
        }
    };
    (0..n).map(point).collect()
}

/// Lines of a scanner that turns, `along` points each: the surface is curved, noise is in the range.
pub(super) fn scan(n: usize, along: usize, random: &mut Random) -> Vec<[f64; 3]> {
    let point = |i: usize| {
        let (row, column) = ((i / along) as f64, (i % along) as f64);
        let (turn, tilt) = (0.9 * column / along as f64 - 0.4, 0.01 * row - 0.2);
        let range = 6.0 + 0.8 * (3.0 * turn).sin() + 0.5 * tilt + random.noise(2e-3);
        [range * turn.cos() * tilt.cos(), range * turn.sin(), range * tilt.sin()]
    };
    (0..n).map(point).collect()
}

/// Every usual order of points.
pub(super) fn orders(n: usize, random: &mut Random) -> Vec<(String, Vec<[f64; 3]>)> {
    let mut all = Vec::new();
    for kind in 0..3 {
        let points = surface(kind, n, random);
        for axis in 0..3 {
            let mut sorted = points.clone();
            sorted.sort_by(|a, b| a[axis].total_cmp(&b[axis]));
            all.push((format!("surface {kind} sorted by {axis}"), sorted));
        }
        // whole coordinates along x, in no order and sorted
        let mut whole = points.clone();
        whole.iter_mut().for_each(|p| p[0] = p[0].round());
        all.push((format!("surface {kind}, x whole"), whole.clone()));
        whole.sort_by(|a, b| a[0].total_cmp(&b[0]));
        all.push((format!("surface {kind}, x whole, sorted"), whole));
        all.push((format!("surface {kind}"), points));
    }
    let side = (n as f64).sqrt().ceil() as usize;
    for step in [1.0, 0.25, 0.1] {
        // a grid's rows along either axis, every height its own
        let grid = (0..n).map(|i| ((i / side) as f64 * step, (i % side) as f64 * step));
        for (name, swap) in [("x stays along rows", false), ("y stays along rows", true)] {
            let points = grid.clone().map(|(a, b)| {
                let (x, y) = if swap { (b, a) } else { (a, b) };
                [x, y, (x / 7.0).sin() + 0.1 * y + random.noise(0.01)]
            });
            all.push((format!("grid of {step}, {name}"), points.collect()));
        }
        // a stage's lines: x in steps, the others measured
        let lines = (0..n).map(|i| {
            let y = (i % side) as f64 * 0.07 + random.noise(0.01);
            [(i / side) as f64 * step, y, y.cos() + random.noise(0.01)]
        });
        all.push((format!("lines {step} apart"), lines.collect()));
    }
    for along in [side, 50, 2000] {
        let points = scan(n, along, random);
        let turned = |axes: [usize; 3]| points.iter().map(|p| axes.map(|axis| p[axis])).collect();
        all.push((format!("scan, {along} a line"), points.clone()));
        all.push((format!("scan, {along} a line, turned"), turned([1, 2, 0])));
        all.push((format!("scan, {along} a line, turned again"), turned([2, 0, 1])));
    }
    all
}

/// Where the clouds are: about the origin, in a country's system in metres, far off in millimetres.
pub(super) const PLACES: [[f64; 3]; 3] =
    [[0.0; 3], [694_386.0, 5_155_487.0, 381.0], [-4e6, 1.25e6, 1e3]];

/// What may stand behind the coordinates of a row.
pub(super) fn behind(kind: usize, form: Form, random: &mut Random) -> Vec<String> {
    let [r, g, b] = [0; 3].map(|_| (random.unit() * 256.0).floor().to_string());
    match kind {
        0 => vec![],
        1 => vec![r],
        2 => vec![r, g, b],
        3 => vec![b.clone(), r, g, b],
        4 => vec![form.write(random.unit())],
        5 => vec![format!("{:.2}", random.unit())],
        6 => vec![form.write(random.unit()), r, g, b],
        7 => vec![form.write(0.5)],
        _ => {
            let n = [random.noise(1.0), random.noise(1.0), random.noise(1.0) + 1e-3];
            let norm = n.iter().map(|x| x * x).sum::<f64>().sqrt();
            n.map(|x| form.write(x / norm)).to_vec()
        }
    }
}

pub(super) fn text(rows: &[Vec<String>], separator: &str) -> String {
    rows.iter().map(|row| row.join(separator) + "\n").collect()
}

/// The same with what is usual in other places.
pub(super) fn parted(rows: &[Vec<String>], which: usize) -> String {
    match which % 5 {
        0 => text(rows, " "),
        1 => text(rows, ","),
        2 => text(rows, ";"),
        3 => text(rows, "\t"),
        _ => text(rows, ";").replace('.', ","),
    }
}

/// A row of three coordinates behind something else.
pub(super) fn behind_lead(
    points: &[[f64; 3]],
    lead: &[f64],
    (lead_form, form): (Form, Form),
    kind: usize,
    random: &mut Random,
) -> Vec<Vec<String>> {
    let row = |(p, lead): (&[f64; 3], &f64)| {
        let lead = std::iter::once(lead_form.write(*lead));
        lead.chain(p.map(|x| form.write(x))).chain(behind(kind, form, random)).collect()
    };
    points.iter().zip(lead).map(row).collect()
}
