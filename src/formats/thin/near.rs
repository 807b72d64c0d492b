//! Points in cells, and which of them are near.

use rayon::prelude::*;

use super::cells::{Cells, floor, hash};
use crate::geometry::{Thinned, Vec3};

/// Points that are no closer to each other than a length, in cells of twice that.
pub(super) struct Near {
    cells: Cells,
    pub(super) points: Vec<Vec3>,
    /// The next point in the same cell, for each.
    next: Vec<u32>,
    /// The cells with points, in open addresses.
    table: Vec<Slot>,
    filled: usize,
}

/// A cell. Two cells with one hash share a slot, and nobody minds: distances tell which points are near.
#[derive(Clone, Copy)]
struct Slot {
    /// The upper half of the cell's hash; the lower one is where it stands.
    tag: u32,
    /// Its last point.
    last: u32,
}

const EMPTY: Slot = Slot { tag: 0, last: Thinned::NONE };

impl Near {
    /// None yet.
    pub(super) fn of(length: f64) -> Self {
        let cells = Cells::of(2.0 * length);
        Self { cells, points: Vec::new(), next: Vec::new(), table: vec![EMPTY; 64], filled: 0 }
    }

    /// These points, those of a cell side by side, and the place that each had.
    pub(super) fn sorted(points: &[Vec3], length: f64) -> (Self, Vec<u32>) {
        let mut near = Self::of(length);
        let mut places: Vec<([i64; 3], u32)> = points
            .par_iter()
            .zip(0..points.len() as u32)
            .map(|(p, k)| (near.cells.cell(p), k))
            .collect();
        places.par_sort_unstable();
        places.iter().for_each(|(_, k)| near.insert(points[*k as usize]));
        (near, places.into_iter().map(|(_, k)| k).collect())
    }

    /// What `tell` says of each of `points`, which it is asked of in an order of its own: those in one part of space
    /// together, so that what is near them is in the cache.
    pub(super) fn told(&self, points: &[Vec3], tell: impl Fn(&Vec3) -> u32) -> Vec<u32> {
        /// Groups of parts, in powers of two: a group's points fill a few lines of the cache at a time.
        const GROUPS: u32 = 10;
        /// Cells on an edge of a part, in powers of two: some hundred points of a surface lie in it.
        const PART: u32 = 3;
        let group =
            |p: &Vec3| (hash(self.cells.cell(p).map(|x| x >> PART)) >> (64 - GROUPS)) as usize;
        let groups: Vec<u16> = points.iter().map(|p| group(p) as u16).collect();
        let mut begins = vec![0; (1 << GROUPS) + 1];
        groups.iter().for_each(|&group| begins[usize::from(group) + 1] += 1);
        (0..1 << GROUPS).for_each(|k| begins[k + 1] += begins[k]);
        let mut sorted = vec![(Vec3::zeros(), 0u32); points.len()];
        for ((&p, k), group) in points.iter().zip(0..).zip(groups) {
            let place = &mut begins[usize::from(group)];
            sorted[*place] = (p, k);
            *place += 1;
        }
        let mut told = vec![0; points.len()];
        sorted.iter().for_each(|(p, k)| told[*k as usize] = tell(p));
        told
    }

    /// Adds a point.
    pub(super) fn insert(&mut self, point: Vec3) {
        if 2 * (self.filled + 1) > self.table.len() {
            self.grow();
        }
        let hash = hash(self.cells.cell(&point));
        let slot = self.slot(hash);
        let slot = &mut self.table[slot];
        self.filled += usize::from(slot.last == Thinned::NONE);
        self.next.push(slot.last);
        *slot = Slot { tag: (hash >> 32) as u32, last: self.points.len() as u32 };
        self.points.push(point);
    }

    /// Where the table has a cell, or would have it.
    #[inline]
    fn slot(&self, hash: u64) -> usize {
        let (mask, tag) = (self.table.len() - 1, (hash >> 32) as u32);
        let mut at = hash as usize & mask;
        loop {
            let slot = self.table[at];
            if slot.last == Thinned::NONE || slot.tag == tag {
                return at;
            }
            at = (at + 1) & mask;
        }
    }

    fn grow(&mut self) {
        let before = std::mem::take(&mut self.table);
        self.table = vec![EMPTY; 2 * before.len()];
        for slot in before {
            if let Some(point) = self.points.get(slot.last as usize) {
                let at = self.slot(hash(self.cells.cell(point)));
                self.table[at] = slot;
            }
        }
    }

    /// The points of a cell.
    #[inline]
    fn in_cell(&self, cell: [i64; 3]) -> impl Iterator<Item = (u32, &Vec3)> {
        let mut at = self.table[self.slot(hash(cell))].last;
        std::iter::from_fn(move || {
            let (this, point) = (at, self.points.get(at as usize)?);
            at = self.next[this as usize];
            Some((this, point))
        })
    }

    /// Whether a point is closer than `length` to `p`.
    pub(super) fn is_near(&self, p: &Vec3, length: f64) -> bool {
        let place = self.cells.place(p);
        let reach = self.cells.in_cells(length);
        let own = place.map(floor);
        let sq_length = length * length;
        let is_near = |cell| self.in_cell(cell).any(|(_, q)| (q - p).norm_squared() < sq_length);
        // most that are near are in the own cell
        is_near(own) || around(place, reach, |cell, _| cell != own && is_near(cell))
    }

    /// The point nearest to `p`, of those nearer than `most`; of several equally near ones the first by its coordinates.
    pub(super) fn nearest(&self, p: &Vec3, most: f64) -> u32 {
        let place = self.cells.place(p);
        let own = place.map(floor);
        let mut best = (most * most, Thinned::NONE);
        self.look(own, p, &mut best);
        let reach = self.cells.in_cells(best.0.sqrt());
        let sq_cells = self.cells.in_cells(1.0).powi(2);
        around(place, reach, |cell, sq_distance| {
            if cell != own && sq_distance <= best.0 * sq_cells {
                self.look(cell, p, &mut best);
            }
            false
        });
        best.1
    }

    #[inline]
    fn look(&self, cell: [i64; 3], p: &Vec3, best: &mut (f64, u32)) {
        for (k, q) in self.in_cell(cell) {
            let sq_distance = (q - p).norm_squared();
            if sq_distance < best.0 || (sq_distance == best.0 && self.comes_first(q, best.1)) {
                *best = (sq_distance, k);
            }
        }
    }

    fn comes_first(&self, q: &Vec3, other: u32) -> bool {
        let other = self.points.get(other as usize);
        other.is_some_and(|other| [q.x, q.y, q.z] < [other.x, other.y, other.z])
    }
}

/// Looks at the cells that a cube reaches from its centre, with the square of how far each is from there, in cells, until
/// `found`.
#[inline]
fn around(place: [f64; 3], reach: f64, mut found: impl FnMut([i64; 3], f64) -> bool) -> bool {
    let [(x0, x1), (y0, y1), (z0, z1)] = place.map(|x| (floor(x - reach), floor(x + reach)));
    let off = |place: f64, cell: i64| {
        let low = cell as f64;
        let off = (low - place).max(place - low - 1.0).max(0.0);
        off * off
    };
    for x in x0..=x1 {
        let dx = off(place[0], x);
        for y in y0..=y1 {
            let dxy = dx + off(place[1], y);
            for z in z0..=z1 {
                if found([x, y, z], dxy + off(place[2], z)) {
                    return true;
                }
            }
        }
    }
    false
}
