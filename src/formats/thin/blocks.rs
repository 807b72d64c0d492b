use super::super::{FormatError, sink::Sink};
use crate::geometry::Vec3;

/// Points of a block: all threads have something to do, and a cancelled run ends soon.
pub(super) const BLOCK: usize = 1 << 20;

/// Hands points on in blocks that are worth sharing out, with the place of the first.
pub(super) struct Blocks<F> {
    work: F,
    block: Vec<Vec3>,
    before: usize,
}

impl<F: FnMut(usize, &[Vec3]) -> Result<(), FormatError>> Blocks<F> {
    /// Hands blocks on to `work`.
    pub(super) fn of(work: F) -> Self {
        Self { work, block: Vec::new(), before: 0 }
    }

    /// Hands on the last ones; gives how many there were in all.
    pub(super) fn end(&mut self) -> Result<usize, FormatError> {
        if !self.block.is_empty() {
            (self.work)(self.before, &self.block)?;
            self.before += self.block.len();
            self.block.clear();
        }
        Ok(self.before)
    }
}

impl<F: FnMut(usize, &[Vec3]) -> Result<(), FormatError> + Send> Sink for Blocks<F> {
    fn expect(&mut self, _: u64) -> Result<(), FormatError> {
        Ok(())
    }

    fn take(&mut self, mut points: &[Vec3]) -> Result<(), FormatError> {
        while !points.is_empty() {
            if self.block.is_empty() && points.len() >= BLOCK {
                (self.work)(self.before, &points[..BLOCK])?;
                self.before += BLOCK;
                points = &points[BLOCK..];
                continue;
            }
            let (now, later) = points.split_at(points.len().min(BLOCK - self.block.len()));
            self.block.extend_from_slice(now);
            points = later;
            if self.block.len() == BLOCK {
                self.end()?;
            }
        }
        Ok(())
    }
}
