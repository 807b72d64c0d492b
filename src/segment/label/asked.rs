//! The points asked about a point's label.

use crate::segment::label::labelling::Labelling;

/// Most points asked: three rings of a surface's.
const ASKED: usize = 256;

/// The points asked about a point's label, ring after ring.
pub struct Asked {
    points: [u32; ASKED],
    len: usize,
    /// Where the last ring begins.
    last: usize,
}

impl Asked {
    pub fn of(near: &[u32]) -> Self {
        let mut points = [0; ASKED];
        points[..near.len()].copy_from_slice(near);
        Self { points, len: near.len(), last: 0 }
    }

    /// Adds the neighbours of the last ring that are not yet among them, and returns these.
    pub fn widen(&mut self, of: &impl Labelling, i: u32) -> &[u32] {
        let from = std::mem::replace(&mut self.last, self.len);
        for k in from..self.last {
            for &j in of.neighbours(self.points[k]) {
                if self.len < ASKED && j != i && !self.points[..self.len].contains(&j) {
                    self.points[self.len] = j;
                    self.len += 1;
                }
            }
        }
        &self.points[self.last..self.len]
    }
}
