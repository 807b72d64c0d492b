//! Checks of compressed files before the library sees them.
//!
//! The library reserves what the chunk table and the layers announce, up to gigabytes from a few bytes.
//! So the announcements are held against the bytes first; layouts after the LAZ specification 1.4 R4.

use std::io::{self, Cursor, Read, Seek, SeekFrom};
use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering},
};

use super::super::FormatError;
use super::{damaged, point_offset, u16_at, u32_at, u64_at};

/// The compressor, by its number in the LAZ record, of points in layers.
const LAYERED: usize = 3;

/// Longest point record; the decoder keeps some kilobytes for each byte of it.
pub(super) const MAX_RECORD: usize = 1024;

/// Checks the chunk table's size and, in the layered form, every layer's. Gives where points end.
pub(super) fn check(bytes: &[u8], vlr: &[u8]) -> Result<u64, FormatError> {
    let start = point_offset(bytes).unwrap_or_default();
    let offset = |at: usize| u64_at(bytes, at).filter(|&o| o > start && o < bytes.len());
    let table = offset(start).or_else(|| offset(bytes.len().saturating_sub(8)));
    let chunks = table.and_then(|at| u32_at(bytes, at + 4));
    if chunks.is_some_and(|n| n > bytes.len()) {
        return Err(damaged("its chunk table announces more chunks than the file has bytes"));
    }
    let layers = Layers::of(vlr).ok_or_else(|| damaged("its LAZ record is cut off"))?;
    if layers.record > MAX_RECORD {
        return Err(damaged("its compressed point records are too long"));
    }
    if layers.sizes > 0 && u16_at(vlr, 0) != Some(LAYERED) {
        // the library would take the layers' sizes from another place than they are checked at
        return Err(damaged("its compressor is not the one of its point records"));
    }
    let Some(table) = table else {
        // without a table a layered file shows no end of its points; other forms reserve nothing
        let end = bytes.len() as u64;
        return if layers.sizes == 0 { Ok(end) } else { Err(damaged("it has no chunk table")) };
    };
    if layers.sizes > 0 {
        layers.check_chunks(&bytes[..table], start + 8)?;
    }
    Ok(table as u64)
}

/// What stands at the start of each chunk.
struct Layers {
    /// Bytes of the first point.
    record: usize,
    /// How many layer sizes follow it; none in the older forms.
    sizes: usize,
}

impl Layers {
    /// Reads the items of the LAZ record: type, size and version of each.
    fn of(vlr: &[u8]) -> Option<Self> {
        let mut layers = Self { record: 0, sizes: 0 };
        for item in 0..u16_at(vlr, 32)? {
            let at = 34 + 6 * item;
            let (kind, size) = (u16_at(vlr, at)?, u16_at(vlr, at + 2)?);
            layers.record += size;
            layers.sizes += match kind {
                10 => 9,      // point
                11 | 13 => 1, // colour, wave packet
                12 => 2,      // colour and near infrared
                14 => size,   // extra bytes
                _ => 0,
            };
        }
        Some(layers)
    }

    /// Walks from chunk to chunk: no layer may reach beyond the end of `points`.
    fn check_chunks(&self, points: &[u8], mut at: usize) -> Result<(), FormatError> {
        while at < points.len() {
            let sizes_at = at + self.record + 4;
            at = sizes_at + 4 * self.sizes;
            for layer in 0..self.sizes {
                let size = u32_at(points, sizes_at + 4 * layer);
                at = at.saturating_add(size.unwrap_or(usize::MAX));
            }
            if at > points.len() {
                return Err(damaged("a chunk announces more bytes than the file has"));
            }
        }
        Ok(())
    }
}

/// A file whose end can be drawn in while it is read.
pub(super) struct Window {
    file: Cursor<Vec<u8>>,
    end: Arc<AtomicU64>,
}

impl Window {
    /// The whole of `file`, and the handle that moves its end.
    pub(super) fn new(file: Vec<u8>) -> (Self, Arc<AtomicU64>) {
        let end = Arc::new(AtomicU64::new(file.len() as u64));
        (Self { file: Cursor::new(file), end: Arc::clone(&end) }, end)
    }
}

impl Read for Window {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let left = self.end.load(Ordering::Relaxed).saturating_sub(self.file.position());
        (&mut self.file).take(left).read(buffer)
    }
}

impl Seek for Window {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}
