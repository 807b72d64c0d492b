//! The points asked about a point's label.

use crate::segment::label::labelling::Labelling;

/// Most points asked: three rings of a surface's.
const ASKED: usize = 256;
/// Slots of the table of those met, a power of two: at most one in four is taken.
const SLOTS: usize = 4 * ASKED;

/// The points asked about a point's label, ring after ring.
pub struct Asked {
    points: [u32; ASKED],
    len: usize,
    /// Where the last ring begins.
    last: usize,
    met: Met,
}

impl Asked {
    /// The points `near` point `i`, which is asked itself.
    pub fn of(i: u32, near: &[u32]) -> Self {
        let mut points = [0; ASKED];
        points[..near.len()].copy_from_slice(near);
        let mut met = Met([NONE; SLOTS]);
        near.iter().chain([&i]).for_each(|&j| {
            met.insert(j);
        });
        Self { points, len: near.len(), last: 0, met }
    }

    /// Adds the neighbours of the last ring that are not yet among them, and returns these.
    pub fn widen(&mut self, of: &impl Labelling) -> &[u32] {
        let from = std::mem::replace(&mut self.last, self.len);
        'ring: for k in from..self.last {
            for &j in of.neighbours(self.points[k]) {
                if self.len == ASKED {
                    break 'ring;
                }
                if self.met.insert(j) {
                    self.points[self.len] = j;
                    self.len += 1;
                }
            }
        }
        &self.points[self.last..self.len]
    }
}

/// No point.
const NONE: u32 = u32::MAX;

/// A set of points in an open-addressed table.
struct Met([u32; SLOTS]);

impl Met {
    /// Adds a point; whether it was not there.
    fn insert(&mut self, i: u32) -> bool {
        // Knuth's multiplicative hash: points near each other in space have places near each other.
        let mut slot = (i.wrapping_mul(2_654_435_769) >> 22) as usize;
        loop {
            let there = self.0[slot];
            if there == NONE {
                self.0[slot] = i;
                return true;
            }
            if there == i {
                return false;
            }
            slot = (slot + 1) % SLOTS;
        }
    }
}
