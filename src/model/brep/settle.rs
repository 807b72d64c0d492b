//! Stretches are switched on and off until the lines around every face close.

use std::collections::BTreeMap;

use super::arc::Arc;
use super::joint::Joint;

use crate::fit::constant::constants;

constants! {
    /// What one corner with an odd number of a face's edges costs, in spacings of stretch with or without points.
    ODD: f64 = 2.0, Trial(2.0, 2.0);
    /// Rounds over all stretches at open corners, at most: nearly all that is found is found in the first.
    ROUNDS: usize = 20, Effort("work of the boundary representation");
    /// Less than this is no gain.
    GAIN: f64 = 1e-9, Trial(1e-9, 1e-9);
}

/// Switches stretches at the least cost that changes of up to three stretches in a row find; every change that saves is made.
/// `is_free` are the corners at which lines may end. Returns the corners, each with a region, at which one still does.
pub fn settle(
    joints: &[Joint],
    arcs: &mut [Arc],
    is_free: impl Fn(usize) -> bool,
) -> Vec<(usize, usize)> {
    let mut at: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (k, arc) in arcs.iter().enumerate() {
        for c in arc.corners {
            let list = at.entry(c).or_default();
            if !list.contains(&k) {
                list.push(k);
            }
        }
    }
    let mut state = State { joints, arcs, at, odd: BTreeMap::new(), is_free };
    for k in 0..state.arcs.len() {
        if state.arcs[k].on {
            state.toggle(k);
        }
    }
    for _ in 0..ROUNDS.get() {
        let mut changed = false;
        for k in state.beside_open_corners() {
            if let Some(best) = state.best_from(k) {
                best.into_iter().for_each(|k| _ = state.flip(k));
                changed = true;
            }
        }
        if !changed {
            break;
        }
    }
    state.open().collect()
}

struct State<'a, F> {
    joints: &'a [Joint],
    arcs: &'a mut [Arc],
    /// The stretches at each corner.
    at: BTreeMap<usize, Vec<usize>>,
    /// Whether the number of a region's edges in a corner is odd.
    odd: BTreeMap<(usize, usize), bool>,
    is_free: F,
}

impl<F: Fn(usize) -> bool> State<'_, F> {
    fn open(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.odd.iter().filter(|(_, odd)| **odd).map(|(at, _)| *at)
    }

    fn beside_open_corners(&self) -> Vec<usize> {
        let mut out: Vec<usize> =
            self.open().flat_map(|(c, _)| self.at[&c].iter().copied()).collect();
        out.sort_unstable();
        out.dedup();
        out
    }

    /// Counts a stretch's ends once more; what that costs.
    fn toggle(&mut self, k: usize) -> f64 {
        let mut change = 0.0;
        for r in self.arcs[k].bounded(self.joints) {
            for c in self.arcs[k].corners {
                if !(self.is_free)(c) {
                    let odd = self.odd.entry((c, r)).or_insert(false);
                    *odd = !*odd;
                    change += if *odd { ODD.get() } else { -ODD.get() };
                }
            }
        }
        change
    }

    /// Switches a stretch; what that costs.
    fn flip(&mut self, k: usize) -> f64 {
        let arc = &mut self.arcs[k];
        let price = if arc.on { arc.score } else { -arc.score };
        arc.on = !arc.on;
        price + self.toggle(k)
    }

    /// The stretches that share a corner with one.
    fn beside(&self, k: usize) -> Vec<usize> {
        let all = self.arcs[k].corners.iter().flat_map(|c| &self.at[c]);
        let mut out: Vec<usize> = all.copied().filter(|j| *j != k).collect();
        out.sort_unstable();
        out.dedup();
        out
    }

    /// The change of one, two or three stretches in a row, from stretch `i` on, that saves most; none where none saves.
    fn best_from(&mut self, i: usize) -> Option<Vec<usize>> {
        let mut best: (f64, Option<Vec<usize>>) = (-GAIN.get(), None);
        let mut take = |cost: f64, all: &[usize]| {
            if cost < best.0 - GAIN.get() {
                best = (cost, Some(all.to_vec()));
            }
        };
        let one = self.flip(i);
        take(one, &[i]);
        for j in self.beside(i) {
            let two = one + self.flip(j);
            take(two, &[i, j]);
            for k in self.beside(j) {
                if k != i {
                    let three = two + self.flip(k);
                    take(three, &[i, j, k]);
                    self.flip(k);
                }
            }
            self.flip(j);
        }
        self.flip(i);
        best.1
    }
}
