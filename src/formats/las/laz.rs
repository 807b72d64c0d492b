//! Compressed files: what is checked and left out before the library sees them.
//!
//! The library reserves what the chunk table and the layers announce, up to gigabytes from a few bytes.
//! So the announcements are held against the bytes first; layouts after the LAZ specification 1.4 R4.
//! It reads times by a recursion that bytes can make as deep as they like. So layers that hold no
//! coordinates are left out, and where times stand among the coordinates the stack is watched.

use std::io::{self, Cursor, Read, Seek, SeekFrom};
use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering},
};

use super::super::FormatError;
use super::header::{damaged, point_offset, u16_at, u32_at, u64_at};

/// The compressor, by its number in the LAZ record, of points in layers.
const LAYERED: usize = 3;

/// Longest point record; the decoder keeps some kilobytes for each byte of it.
pub(super) const MAX_RECORD: usize = 1024;

/// Checks the chunk table's size and, in the layered form, every layer's. Gives where points end, and how
/// layers stand if there are some.
pub(super) fn check(bytes: &[u8], vlr: &[u8]) -> Result<(u64, Option<Layers>), FormatError> {
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
        let layered = layers.sizes > 0;
        return if layered { Err(damaged("it has no chunk table")) } else { Ok((end, None)) };
    };
    if layers.sizes == 0 {
        return Ok((table as u64, None));
    }
    if layers.point.is_none() {
        return Err(damaged("its compressed records have no coordinates"));
    }
    layers.check_chunks(&bytes[..table], start + 8)?;
    Ok((table as u64, Some(layers)))
}

/// What stands at the start of each chunk.
#[derive(Clone, Copy)]
pub(super) struct Layers {
    /// Bytes of the first point.
    record: usize,
    /// How many layer sizes follow it; none in the older forms.
    sizes: usize,
    /// Which of them is the first of the point's own.
    point: Option<usize>,
}

/// Layers of a point that hold its coordinates: those of x, y and returns, and of z, its first.
const COORDINATES: usize = 2;

impl Layers {
    /// Reads the items of the LAZ record: type, size and version of each.
    fn of(vlr: &[u8]) -> Option<Self> {
        let mut layers = Self { record: 0, sizes: 0, point: None };
        for item in 0..u16_at(vlr, 32)? {
            let at = 34 + 6 * item;
            let (kind, size) = (u16_at(vlr, at)?, u16_at(vlr, at + 2)?);
            layers.record += size;
            if kind == 10 {
                layers.point = Some(layers.sizes);
            }
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

    /// The file without the layers that hold no coordinates, and where its points end; `table` is where they
    /// end in `file`, which was checked.
    pub(super) fn of_coordinates(self, file: &[u8], table: u64) -> (Vec<u8>, u64) {
        let start = point_offset(file).unwrap_or_default();
        let (points, rest) = file.split_at(usize::try_from(table).unwrap_or_default());
        let kept = self.point.map_or(0..0, |first| first..first + COORDINATES);
        let mut slim = points[..start + 8].to_vec();
        let mut at = start + 8;
        while at < points.len() {
            let sizes_at = at + self.record + 4;
            slim.extend_from_slice(&points[at..sizes_at]);
            at = sizes_at + 4 * self.sizes;
            let mut layers = Vec::new();
            for layer in 0..self.sizes {
                let size = u32_at(points, sizes_at + 4 * layer).unwrap_or_default();
                let told = if kept.contains(&layer) { size } else { 0 };
                slim.extend_from_slice(&(told as u32).to_le_bytes());
                layers.extend_from_slice(&points[at..at + told]);
                at += size;
            }
            slim.append(&mut layers);
        }
        let end = slim.len() as u64;
        slim[start..start + 8].copy_from_slice(&end.to_le_bytes());
        slim.extend_from_slice(rest);
        (slim, end)
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

/// Stack that a thread needs which reads compressed points: below [`DEEP`] the library asks for a byte, and
/// at most 37,000 calls later for the next, for each takes 5 of 32768 parts of an interval that is renewed
/// at 1 of 256. A call takes some hundred bytes.
pub(super) const STACK: usize = 64 << 20;
/// Stack between the reader and the file that no sound record takes.
const DEEP: usize = 1 << 20;

/// A file whose end can be drawn in while it is read, and which is not read from deep recursions.
pub(super) struct Window {
    file: Cursor<Vec<u8>>,
    end: Arc<AtomicU64>,
    /// Where the stack was when it was made.
    stack: usize,
}

impl Window {
    /// The whole of `file`, and the handle that moves its end.
    pub(super) fn new(file: Vec<u8>) -> (Self, Arc<AtomicU64>) {
        let end = Arc::new(AtomicU64::new(file.len() as u64));
        (Self { file: Cursor::new(file), end: Arc::clone(&end), stack: stack() }, end)
    }
}

/// About where the stack is.
#[inline(never)]
fn stack() -> usize {
    let here = 0u8;
    std::ptr::from_ref(std::hint::black_box(&here)).addr()
}

impl Read for Window {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.stack.abs_diff(stack()) > DEEP {
            return Err(io::Error::other("a record goes on without end"));
        }
        let left = self.end.load(Ordering::Relaxed).saturating_sub(self.file.position());
        (&mut self.file).take(left).read(buffer)
    }
}

impl Seek for Window {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reads a byte that many frames of 4 KiB further down.
    fn read_below(frames: usize, window: &mut Window) -> io::Result<usize> {
        let frame = std::hint::black_box([0u8; 4096]);
        let read = match frames {
            0 => window.read(&mut [0]),
            _ => read_below(frames - 1, window),
        };
        std::hint::black_box(&frame);
        read
    }

    #[test]
    fn a_file_is_not_read_from_a_deep_recursion() {
        let run = || {
            let (mut window, _) = Window::new(vec![7; 9]);
            assert_eq!(read_below(10, &mut window).unwrap(), 1);
            assert!(read_below(2 * DEEP / 4096, &mut window).is_err());
            assert_eq!(read_below(0, &mut window).unwrap(), 1);
        };
        std::thread::Builder::new().stack_size(STACK).spawn(run).unwrap().join().unwrap();
    }
}
