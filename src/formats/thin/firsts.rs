//! Of each cell the point with the lowest lot.

use std::cmp::Ordering;

use rayon::prelude::*;

use super::super::FormatError;
use super::cells::{Cells, hash};
use crate::geometry::{Thinned, Vec3, lot};

/// A point of the input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct First {
    pub(super) point: Vec3,
    /// Its place in the input.
    pub(super) index: u32,
    /// The upper half of its lot: few points have it in common.
    lot: u32,
}

const EMPTY: First = First { point: Vec3::new(0.0, 0.0, 0.0), index: Thinned::NONE, lot: 0 };

impl First {
    pub(super) fn new(point: Vec3, index: u32) -> Self {
        Self { point, index, lot: (lot(&point) >> 32) as u32 }
    }

    /// By lot; of copies the one that comes first in the input.
    pub(super) fn order(&self, other: &Self) -> Ordering {
        self.lot.cmp(&other.lot).then_with(|| {
            let by = |f: &Self| (lot(&f.point), f.point.x, f.point.y, f.point.z);
            let (a, b) = (by(self), by(other));
            let coordinates =
                a.1.total_cmp(&b.1).then(a.2.total_cmp(&b.2)).then(a.3.total_cmp(&b.3));
            a.0.cmp(&b.0).then(coordinates).then(self.index.cmp(&other.index))
        })
    }
}

/// Tables that are filled side by side, in powers of two.
const TABLES: u32 = 6;
/// Points that one thread looks at in a row.
const CHUNK: usize = 1 << 14;

/// The first point of each cell.
pub(super) struct Firsts {
    cells: Cells,
    tables: Vec<Table>,
}

impl Firsts {
    pub(super) fn of(cells: Cells) -> Self {
        let table = || Table { slots: Vec::new(), filled: 0 };
        Self { cells, tables: (0..1 << TABLES).map(|_| table()).collect() }
    }

    /// Takes `points` into account, the first of which is the input's point `begin`; those that `are_left_out` are not.
    ///
    /// # Errors
    /// There is no memory for more cells.
    pub(super) fn take(
        &mut self,
        points: &[Vec3],
        begin: usize,
        are_left_out: impl Fn(&Vec3) -> bool + Sync,
    ) -> Result<(), FormatError> {
        let cells = self.cells;
        let sorted = |(k, chunk): (usize, &[Vec3])| {
            Sorted::of(cells, chunk, begin + k * CHUNK, &are_left_out)
        };
        let chunks: Vec<Sorted> = points.par_chunks(CHUNK).enumerate().map(sorted).collect();
        self.tables.par_iter_mut().enumerate().try_for_each(|(which, table)| {
            let of_table = chunks.iter().flat_map(|chunk| chunk.of_table(which));
            of_table.into_iter().try_for_each(|(hash, first)| table.take(cells, *hash, *first))
        })
    }

    /// As many of them, the same in whatever order the input came.
    pub(super) fn some(&self, most: usize) -> Vec<Vec3> {
        let lowest = |table: &Table| {
            let taken = table.slots.iter().filter(|first| first.index != Thinned::NONE);
            taken.min_by(|a, b| a.order(b)).map(|first| first.point)
        };
        self.tables.iter().filter_map(lowest).take(most).collect()
    }

    /// Bytes that the tables take.
    pub(super) fn bytes(&self) -> u64 {
        let slots: usize = self.tables.iter().map(|table| table.slots.len()).sum();
        (slots * size_of::<First>()) as u64
    }

    /// All of them, in the order of their lots.
    ///
    /// # Errors
    /// There is no memory for them.
    pub(super) fn in_order(self) -> Result<Vec<First>, FormatError> {
        let points = self.tables.iter().map(|table| table.filled as u64).sum();
        let mut all = super::super::memory::room_for(points)?;
        // a table is given up before the next one is looked at
        for table in self.tables {
            all.extend(table.slots.iter().filter(|first| first.index != Thinned::NONE));
        }
        all.par_sort_unstable_by(First::order);
        Ok(all)
    }
}

/// Some points with their cells' hashes, those of one table side by side.
struct Sorted {
    points: Vec<(u64, First)>,
    ends: Vec<usize>,
}

impl Sorted {
    fn of(
        cells: Cells,
        points: &[Vec3],
        begin: usize,
        are_left_out: impl Fn(&Vec3) -> bool,
    ) -> Self {
        let mut ends = vec![0; 1 << TABLES];
        let mut all = Vec::with_capacity(points.len());
        for (k, p) in points.iter().enumerate().filter(|(_, p)| !are_left_out(p)) {
            let hash = hash(cells.cell(p));
            ends[table_of(hash)] += 1;
            all.push((hash, k as u32));
        }
        let mut sum = 0;
        for end in &mut ends {
            sum += *end;
            *end = sum - *end;
        }
        let mut sorted = vec![(0, EMPTY); all.len()];
        for (hash, k) in all {
            let place = &mut ends[table_of(hash)];
            sorted[*place] = (hash, First::new(points[k as usize], (begin + k as usize) as u32));
            *place += 1;
        }
        Self { points: sorted, ends }
    }

    fn begin_of(&self, which: usize) -> usize {
        which.checked_sub(1).map_or(0, |before| self.ends[before])
    }

    /// Those of a table.
    fn of_table(&self, which: usize) -> &[(u64, First)] {
        &self.points[self.begin_of(which)..self.ends[which]]
    }
}

fn table_of(hash: u64) -> usize {
    (hash >> (64 - TABLES)) as usize
}

/// A hash table with open addresses, for a part of the cells.
struct Table {
    slots: Vec<First>,
    filled: usize,
}

impl Table {
    fn take(&mut self, cells: Cells, hash: u64, first: First) -> Result<(), FormatError> {
        // an eighth stays free, so that chains stay short
        if 8 * (self.filled + 1) > 7 * self.slots.len() {
            self.grow(cells)?;
        }
        let slot = self.slot(cells, hash, &first.point);
        let slot = &mut self.slots[slot];
        if slot.index == Thinned::NONE {
            *slot = first;
            self.filled += 1;
        } else if first.order(slot).is_lt() {
            *slot = first;
        }
        Ok(())
    }

    /// The slot of a point's cell, or the free one where it would be.
    fn slot(&self, cells: Cells, hash: u64, point: &Vec3) -> usize {
        let cell = cells.cell(point);
        // the upper bits chose the table
        let spread = u128::from(hash << TABLES) * self.slots.len() as u128;
        let mut at = (spread >> 64) as usize;
        loop {
            let slot = &self.slots[at];
            if slot.index == Thinned::NONE || cells.cell(&slot.point) == cell {
                return at;
            }
            at = if at + 1 == self.slots.len() { 0 } else { at + 1 };
        }
    }

    fn grow(&mut self, cells: Cells) -> Result<(), FormatError> {
        const LEAST: usize = 64;
        let room = LEAST.max(self.slots.len() / 2 * 3);
        let mut slots = super::super::memory::room_for(room as u64)?;
        slots.resize(room, EMPTY);
        let before = std::mem::replace(&mut self.slots, slots);
        for first in before.iter().filter(|first| first.index != Thinned::NONE) {
            let at = self.slot(cells, hash(cells.cell(&first.point)), &first.point);
            self.slots[at] = *first;
        }
        Ok(())
    }
}
