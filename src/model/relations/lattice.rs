//! Spots that stand in even rows.

use nalgebra::Vector2;

use super::circle::NEAR;
use super::spot::Spot;
use crate::fit::constant::constants;

constants! {
    /// Nearest spots of each that a row may lead to.
    NEIGHBOURS: usize = 6, Effort("rows tried from each spot");
}

/// Spots in one row, or in several at right angles that are all full.
#[derive(Clone, Debug)]
pub struct Lattice {
    /// Spots and their places: the first at (0, 0), the second at the end of its row, and in several rows the third at the
    /// end of its column.
    pub at: Vec<(usize, [i32; 2])>,
    /// How many places each way.
    pub counts: [usize; 2],
    /// How many rows it was chosen from.
    pub trials: f64,
}

/// The rows with the most spots: at least three in one row, or two in each of two.
pub fn largest(spots: &[Spot]) -> Option<Lattice> {
    let mut best: Option<Lattice> = None;
    let mut trials = 0.0_f64;
    for p in 0..spots.len() {
        let mut others: Vec<usize> = (0..spots.len()).filter(|&k| k != p).collect();
        let away = |k: &usize| (spots[*k].z - spots[p].z).norm();
        others.sort_by(|a, b| away(a).total_cmp(&away(b)));
        others.truncate(NEIGHBOURS.get());
        for &q in &others {
            let a = spots[q].z - spots[p].z;
            let sides = others.iter().filter(|&&r| is_across(spots, [p, q, r]));
            for b in sides.map(|&r| Some(spots[r].z - spots[p].z)).chain([None]) {
                trials += 1.0;
                let found = from(spots, p, &a, b.as_ref());
                let more = |l: &Lattice| best.as_ref().is_none_or(|b| l.at.len() > b.at.len());
                best = found.filter(more).or(best);
            }
        }
    }
    best.map(|l| Lattice { trials: trials.max(1.0), ..l })
}

/// Whether q and r may stand at right angles about p.
fn is_across(spots: &[Spot], [p, q, r]: [usize; 3]) -> bool {
    let (a, b) = (spots[q].z - spots[p].z, spots[r].z - spots[p].z);
    let deviation = spots[p].deviation + spots[q].deviation + spots[r].deviation;
    q != r && a.dot(&b).abs() <= NEAR.get() * deviation * (a.norm() + b.norm())
}

/// The rows along `a`, and along `b` where there are several, that hold the spot `p`.
fn from(spots: &[Spot], p: usize, a: &Vector2<f64>, b: Option<&Vector2<f64>>) -> Option<Lattice> {
    let zero = Vector2::zeros();
    let at = |i: i32, j: i32| {
        let place = spots[p].z + a * f64::from(i) + b.unwrap_or(&zero) * f64::from(j);
        // the steps are as uncertain as two spots, and add up
        let steps = f64::from(i.abs() + j.abs() + 1);
        let near = |k: &usize| {
            (spots[*k].z - place).norm()
                < NEAR.get() * (spots[*k].deviation + 2.0 * steps * spots[p].deviation)
        };
        (0..spots.len()).find(near)
    };
    let far = spots.len() as i32;
    let last = |sign: i32, has: &dyn Fn(i32) -> bool| {
        (1..=far).take_while(|&i| has(sign * i)).count() as i32
    };
    let in_row = |i: i32| at(i, 0).is_some();
    let (low, high) = (-last(-1, &in_row), last(1, &in_row));
    let whole = |j: i32| (low..=high).all(|i| at(i, j).is_some());
    let (under, over) = if b.is_some() { (-last(-1, &whole), last(1, &whole)) } else { (0, 0) };
    let counts = [(high - low + 1) as usize, (over - under + 1) as usize];
    let enough = if b.is_some() { counts[0] > 1 && counts[1] > 1 } else { counts[0] > 2 };
    if !enough {
        return None;
    }
    let mut places: Vec<[i32; 2]> =
        (0..counts[1] as i32).flat_map(|j| (0..counts[0] as i32).map(move |i| [i, j])).collect();
    let corner = |place: &[i32; 2]| match place {
        [0, 0] => 0,
        [i, 0] if *i == counts[0] as i32 - 1 => 1,
        [0, j] if *j == counts[1] as i32 - 1 => 2,
        _ => 3,
    };
    places.sort_by_key(corner);
    let spot = |place: &[i32; 2]| Some((at(place[0] + low, place[1] + under)?, *place));
    let at: Vec<(usize, [i32; 2])> = places.iter().map(spot).collect::<Option<_>>()?;
    let mut distinct: Vec<usize> = at.iter().map(|a| a.0).collect();
    distinct.sort_unstable();
    distinct.dedup();
    (distinct.len() == at.len()).then_some(Lattice { at, counts, trials: 1.0 })
}

impl Lattice {
    /// The first place and the two steps, by least squares.
    pub fn fitted(&self, spots: &[Spot]) -> [Vector2<f64>; 3] {
        let n = self.at.len() as f64;
        let mean = self.at.iter().map(|a| spots[a.0].z).sum::<Vector2<f64>>() / n;
        let middle = self.counts.map(|c| (c as f64 - 1.0) / 2.0);
        let step = |way: usize| {
            let (mut sum, mut square) = (Vector2::zeros(), 0.0);
            for (spot, place) in &self.at {
                let off = f64::from(place[way]) - middle[way];
                sum += spots[*spot].z * off;
                square += off * off;
            }
            if square > 0.0 { sum / square } else { Vector2::zeros() }
        };
        let (a, b) = (step(0), step(1));
        [mean - a * middle[0] - b * middle[1], a, b]
    }
}
