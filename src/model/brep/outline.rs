//! The lines around a region's points in its chart.

use std::collections::BTreeMap;

use super::sheet::{Sheet, Uv};
use crate::fit::constant::constants;
use crate::geometry::Vec3;

constants! {
    /// Side of a cell in spacings of the points: the fourth neighbour stands at the radius of a disc with four points, so about
    /// five fall into one.
    CELL: f64 = 2.0, Derived("the fourth neighbour stands at the radius of a disc with four points, so about five fall into one");
    /// Cells along one parameter, at most.
    MOST_CELLS: f64 = 1000.0, Trial(1000.0, 1000.0);
    /// Loops of less than this many cells are noise.
    LEAST_CELLS: f64 = 4.0, Trial(4.0, 4.0);
}

/// A closed line in a chart, the points on its left.
#[derive(Clone, Debug)]
pub struct Loop {
    /// Its places, unrolled: from one to the next there is no jump.
    pub places: Vec<Uv>,
    /// How often it goes around each parameter that closes.
    pub turns: [i32; 2],
}

/// The raster of a region and the lines around it.
pub struct Outline {
    /// The lines.
    pub loops: Vec<Loop>,
    /// Size of a cell.
    pub cell: Uv,
    /// Area of the surface within.
    pub area: f64,
}

struct Raster {
    size: [usize; 2],
    wraps: [bool; 2],
    low: Uv,
    cell: Uv,
    values: Vec<f64>,
}

impl Raster {
    fn count(sheet: &Sheet, points: &[Vec3], spacing: f64) -> Self {
        let places: Vec<Uv> = points.iter().map(|p| sheet.chart(p)).collect();
        let low: Uv =
            std::array::from_fn(|k| places.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min));
        let high: Uv =
            std::array::from_fn(|k| places.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max));
        let period = [0, 1].map(|k| sheet.period(k));
        let extent: Uv = std::array::from_fn(|k| period[k].unwrap_or(high[k] - low[k]));
        let wanted: Uv = std::array::from_fn(|k| {
            (CELL.get() * spacing).max(extent[k] / MOST_CELLS.get()).max(1e-300)
        });
        let mut out = Self {
            size: [0; 2],
            wraps: [period[0].is_some(), period[1].is_some()],
            low,
            cell: wanted,
            values: Vec::new(),
        };
        for k in 0..2 {
            if let Some(p) = period[k] {
                out.size[k] = ((p / wanted[k]).round() as usize).max(4);
                out.cell[k] = p / out.size[k] as f64;
                out.low[k] = 0.5 * out.cell[k];
            } else {
                out.size[k] = (extent[k] / wanted[k]) as usize + 5;
                // Two empty cells all round; the middle of the first.
                out.low[k] -= 1.5 * out.cell[k];
            }
        }
        out.values = vec![0.0; out.size[0] * out.size[1]];
        for (p, x) in places.iter().zip(points) {
            let at: [usize; 2] = std::array::from_fn(|k| {
                let i = ((p[k] - out.low[k]) / out.cell[k] + 0.5).floor().max(0.0) as usize;
                if out.wraps[k] { i % out.size[k] } else { i.min(out.size[k] - 1) }
            });
            out.values[at[1] * out.size[0] + at[0]] += sheet.stretch(x);
        }
        out
    }

    /// The place of a cell that many steps further; none beyond the border.
    fn beside(&self, i: usize, j: usize, di: i64, dj: i64) -> Option<usize> {
        let go = |at: usize, by: i64, k: usize| -> Option<usize> {
            let to = at as i64 + by;
            let n = self.size[k] as i64;
            if self.wraps[k] {
                Some(to.rem_euclid(n) as usize)
            } else {
                (0..n).contains(&to).then_some(to as usize)
            }
        };
        Some(go(j, dj, 1)? * self.size[0] + go(i, di, 0)?)
    }

    /// Blurs over three cells each way and subtracts half of what is inside.
    fn level(&mut self) -> Option<()> {
        let [w, h] = self.size;
        let mut blurred = vec![0.0; w * h];
        let (mut inner, mut any) = (Vec::new(), Vec::new());
        for j in 0..h {
            for i in 0..w {
                let (mut sum, mut full) = (0.0, true);
                for (dj, b) in [(-1, 1.0), (0, 2.0), (1, 1.0)] {
                    for (di, a) in [(-1, 1.0), (0, 2.0), (1, 1.0)] {
                        let n = self.beside(i, j, di, dj).map_or(0.0, |c| self.values[c]);
                        sum += a * b * n / 16.0;
                        full &= n > 0.0;
                    }
                }
                blurred[j * w + i] = sum;
                if full {
                    inner.push(sum);
                }
                if self.values[j * w + i] > 0.0 {
                    any.push(sum);
                }
            }
        }
        let mut told = if inner.len() > 3 { inner } else { any };
        if told.is_empty() {
            return None;
        }
        let middle = told.len() / 2;
        let inside = *told.select_nth_unstable_by(middle, f64::total_cmp).1;
        self.values = blurred.into_iter().map(|v| v.min(inside) - inside / 2.0).collect();
        Some(())
    }

    /// Area of the surface whose cells are within.
    fn area(&self, sheet: &Sheet) -> f64 {
        let within = self.values.iter().enumerate().filter(|(_, v)| **v >= 0.0);
        let of = |(i, _): (usize, &f64)| {
            let at = [i % self.size[0], i / self.size[0]];
            let c = std::array::from_fn(|k| self.low[k] + at[k] as f64 * self.cell[k]);
            self.cell[0] * self.cell[1] / sheet.stretch(&sheet.at(c))
        };
        within.map(of).sum()
    }

    fn value(&self, c: [i64; 2]) -> f64 {
        self.beside(0, 0, c[0], c[1]).map_or(-1.0, |i| self.values[i])
    }

    /// A corner of the grid within it.
    fn wrapped(&self, c: [i64; 2]) -> [i64; 2] {
        std::array::from_fn(
            |k| if self.wraps[k] { c[k].rem_euclid(self.size[k] as i64) } else { c[k] },
        )
    }

    /// Marching squares: the lines of level nought, higher values on the left.
    fn loops(&self) -> Vec<Loop> {
        // From the side where a line enters a square to the side where it leaves: a side is its first corner and whether it
        // goes up from there.
        type Side = ([i64; 2], bool);
        let mut next: BTreeMap<Side, (Side, [i64; 2])> = BTreeMap::new();
        let last = |k: usize| self.size[k] as i64 - i64::from(!self.wraps[k]);
        for j in 0..last(1) {
            for i in 0..last(0) {
                let corners =
                    [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]].map(|c| self.value(c));
                let side = |k: u8| match k {
                    0 => ([i, j], false),
                    1 => ([i + 1, j], true),
                    2 => ([i, j + 1], false),
                    _ => ([i, j], true),
                };
                for (a, b) in crossings(corners) {
                    let (from, to) = (side(a), side(b));
                    next.insert((self.wrapped(from.0), from.1), (to, from.0));
                }
            }
        }
        let mut out = Vec::new();
        while let Some((&first, _)) = next.first_key_value() {
            let (mut places, mut at, mut shift) = (Vec::new(), first, [0i64; 2]);
            while let Some((to, own)) = next.remove(&at) {
                // `own` is the entry as this square names it.
                for k in 0..2 {
                    shift[k] += at.0[k] - own[k];
                }
                let c = [own[0] + shift[0], own[1] + shift[1]];
                places.push(self.place(c, at.1));
                let moved = [to.0[0] + shift[0], to.0[1] + shift[1]];
                let wrapped = self.wrapped(to.0);
                shift = [moved[0] - wrapped[0], moved[1] - wrapped[1]];
                at = (wrapped, to.1);
            }
            let turns = std::array::from_fn(|k| (shift[k] / self.size[k].max(1) as i64) as i32);
            out.push(Loop { places, turns });
        }
        out
    }

    /// Where a line crosses the side that begins at a corner.
    fn place(&self, c: [i64; 2], up: bool) -> Uv {
        let (a, b) =
            (self.value(c), self.value(if up { [c[0], c[1] + 1] } else { [c[0] + 1, c[1]] }));
        let t = a / (a - b);
        let at = if up { [c[0] as f64, c[1] as f64 + t] } else { [c[0] as f64 + t, c[1] as f64] };
        std::array::from_fn(|k| self.low[k] + at[k] * self.cell[k])
    }
}

/// The sides (0 below, 1 right, 2 above, 3 left) from which to which lines go through a square, from the values at its
/// corners, counter-clockwise from the lower left.
fn crossings(corners: [f64; 4]) -> Vec<(u8, u8)> {
    let inside = corners.map(|v| v >= 0.0);
    let mean = corners.iter().sum::<f64>() >= 0.0;
    // A line enters through a side whose first end, going counter-clockwise, is inside and whose second is not.
    let enters: Vec<u8> =
        (0..4u8).filter(|&k| inside[k as usize] && !inside[(k as usize + 1) % 4]).collect();
    let leaves: Vec<u8> =
        (0..4u8).filter(|&k| !inside[k as usize] && inside[(k as usize + 1) % 4]).collect();
    match (enters.len(), mean) {
        (0, _) => Vec::new(),
        (1, _) => vec![(enters[0], leaves[0])],
        // Two corners inside, opposite: joined through the middle or not.
        (_, joined) => {
            let pick = |e: u8| {
                let want = if joined { (e + 1) % 4 } else { (e + 3) % 4 };
                leaves.iter().copied().find(|l| *l == want).unwrap_or(leaves[0])
            };
            enters.iter().map(|&e| (e, pick(e))).collect()
        }
    }
}

/// Twice the area that a line encloses in the chart, positive where it goes counter-clockwise.
pub fn twice_area(places: &[Uv]) -> f64 {
    let next = places.iter().cycle().skip(1);
    places.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum()
}

/// The lines around a region's points; none where they are too few to have one.
pub fn outline(sheet: &Sheet, points: &[Vec3], spacing: f64) -> Option<Outline> {
    let mut raster = Raster::count(sheet, points, spacing);
    raster.level()?;
    let cell = raster.cell;
    let mut loops = raster.loops();
    loops.retain(|l| {
        l.turns != [0, 0]
            || twice_area(&l.places).abs() > 2.0 * LEAST_CELLS.get() * cell[0] * cell[1]
    });
    let area = raster.area(sheet);
    Some(Outline { loops, cell, area })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Cylinder, Surface};

    #[test]
    fn a_pipe_with_a_window_has_two_ends_that_go_round_and_a_hole() {
        let c = Cylinder { axis_point: Vec3::zeros(), axis_direction: Vec3::z(), radius: 5.0 };
        let sheet = Sheet {
            scale: [5.0, 1.0],
            wraps: [true, false],
            ..Sheet::new(&Surface::Cylinder(c), &Vec3::zeros())
        };
        let mut points = Vec::new();
        for i in 0..200 {
            for j in 0..80 {
                let c = [std::f64::consts::PI * 10.0 * f64::from(i) / 200.0, 0.15 * f64::from(j)];
                // Across the place where the chart closes.
                let x = (c[0] + 3.0).rem_euclid(std::f64::consts::PI * 10.0);
                if !(x < 6.0 && (4.0..8.0).contains(&c[1])) {
                    points.push(sheet.at(c));
                }
            }
        }
        let found = outline(&sheet, &points, 0.18).unwrap();
        let mut loops = found.loops;
        loops.sort_by_key(|l| l.turns);
        assert_eq!(loops.iter().map(|l| l.turns).collect::<Vec<_>>(), [[-1, 0], [0, 0], [1, 0]]);
        let area = twice_area(&loops[1].places) / 2.0;
        assert!((area + 24.0).abs() < 2.5, "{area}");
        assert!(loops[2].places.iter().all(|p| p[1].abs() < 0.4));
        assert!(loops[0].places.iter().all(|p| (p[1] - 11.85).abs() < 0.4));
    }
}
