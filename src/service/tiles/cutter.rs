use super::wire::{is_finite, written};
use crate::{
    formats::{FormatError, Sink},
    geometry::{Vec3, lot},
    jobs::{Blob, Parts, PartsError},
};

/// Points at exactly 0, 0, 0 from which on they may be holes.
const ZEROS: usize = 10;
/// Share of copies among the points, in hundredths, from which on a cloud is not cut.
const MOST_COPIES: usize = 1;

/// Cuts points as they come.
pub(super) struct Cutter<'a> {
    parts: &'a dyn Parts,
    /// Points of each part but the last.
    size: usize,
    open: Vec<Vec3>,
    /// The parts.
    pub blobs: Vec<Blob>,
    /// Points so far.
    pub len: usize,
    /// Those that surfaces are looked for on: the ones whose lot, drawn from their coordinates, is the lowest.
    pub some: Vec<Vec3>,
    highest: u64,
    /// The first part.
    pub beside: Vec<Vec3>,
    /// Why a part could not be kept.
    pub failed: Option<PartsError>,
    zeros: usize,
}

impl<'a> Cutter<'a> {
    /// Keeps parts of so many points.
    pub fn new(parts: &'a dyn Parts, size: usize) -> Self {
        Self {
            parts,
            size,
            open: Vec::new(),
            blobs: Vec::new(),
            len: 0,
            some: Vec::new(),
            highest: u64::MAX,
            beside: Vec::new(),
            failed: None,
            zeros: 0,
        }
    }

    /// Takes points into account for the survey.
    fn draw(&mut self, points: &[Vec3]) {
        let highest = self.highest;
        self.some.extend(points.iter().filter(|p| lot(p) <= highest && is_finite(p)));
        while self.some.len() > self.size && self.highest > 0 {
            self.highest /= 2;
            let highest = self.highest;
            self.some.retain(|p| lot(p) <= highest);
        }
    }

    /// Keeps the part that is open.
    fn keep(&mut self) -> Result<(), PartsError> {
        let kept = self.parts.keep(written(&self.open))?;
        self.blobs.push(kept);
        if self.beside.is_empty() {
            self.beside = std::mem::take(&mut self.open);
            self.beside.retain(is_finite);
        }
        self.open.clear();
        Ok(())
    }

    /// Keeps the last part.
    pub fn end(&mut self) -> Result<(), PartsError> {
        if !self.open.is_empty() {
            self.keep()?;
        }
        Ok(())
    }

    /// Whether so many points stand at the origin that they may be holes.
    pub fn has_zeros(&self) -> bool {
        self.zeros >= ZEROS
    }

    /// Whether so many points stand where others do that they would come to be in several parts, and be taken for distinct
    /// ones. Of a point all copies are drawn for the survey, or none.
    pub fn has_copies(&self) -> bool {
        // halving what is drawn leaves about half a part, unless many go at once
        if self.highest < u64::MAX && self.some.len() < self.size / 4 {
            return true;
        }
        let mut sorted: Vec<[u64; 3]> =
            self.some.iter().map(|p| [p.x, p.y, p.z].map(f64::to_bits)).collect();
        sorted.sort_unstable();
        let copies = sorted.windows(2).filter(|w| w[0] == w[1]).count();
        copies * 100 > sorted.len() * MOST_COPIES
    }
}

impl Sink for Cutter<'_> {
    fn expect(&mut self, _: u64) -> Result<(), FormatError> {
        Ok(())
    }

    fn take(&mut self, mut points: &[Vec3]) -> Result<(), FormatError> {
        self.draw(points);
        self.zeros += points.iter().filter(|p| **p == Vec3::zeros()).count();
        self.len += points.len();
        while !points.is_empty() {
            let (now, later) = points.split_at(points.len().min(self.size - self.open.len()));
            self.open.extend_from_slice(now);
            points = later;
            if self.open.len() == self.size
                && let Err(error) = self.keep()
            {
                self.failed = Some(error);
                return Err(FormatError::Stopped);
            }
        }
        Ok(())
    }
}
