use std::{
    collections::BTreeMap,
    fs::File,
    io,
    os::unix::fs::FileExt,
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
};

use redb::StorageBackend;

const BLOCK: usize = 4096;

/// A database file to look at: what is written to it stays in memory.
#[derive(Debug)]
pub struct Overlay {
    file: File,
    file_len: u64,
    len: AtomicU64,
    written: Mutex<BTreeMap<u64, Box<[u8]>>>,
}

impl Overlay {
    /// Looks at `file`, which nobody may write to meanwhile.
    ///
    /// # Errors
    /// The system does not tell its length.
    pub fn new(file: File) -> io::Result<Self> {
        let len = file.metadata()?.len();
        Ok(Self { file, file_len: len, len: AtomicU64::new(len), written: Mutex::default() })
    }

    fn written(&self) -> MutexGuard<'_, BTreeMap<u64, Box<[u8]>>> {
        self.written.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What the file itself has there; zeros behind its end.
    fn read_file(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        let there = self.file_len.saturating_sub(offset).min(out.len() as u64) as usize;
        let (known, beyond) = out.split_at_mut(there);
        beyond.fill(0);
        if known.is_empty() { Ok(()) } else { self.file.read_exact_at(known, offset) }
    }
}

impl StorageBackend for Overlay {
    fn len(&self) -> io::Result<u64> {
        Ok(self.len.load(Ordering::Relaxed))
    }

    fn read(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        let end = offset + out.len() as u64;
        if end > self.len.load(Ordering::Relaxed) {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        self.read_file(offset, out)?;
        let first = offset / BLOCK as u64;
        for (block, bytes) in self.written().range(first..end.div_ceil(BLOCK as u64)) {
            let start = block * BLOCK as u64;
            let (from, to) = (start.max(offset), (start + BLOCK as u64).min(end));
            let at = |place: u64, base: u64| (place - base) as usize;
            out[at(from, offset)..at(to, offset)]
                .copy_from_slice(&bytes[at(from, start)..at(to, start)]);
        }
        Ok(())
    }

    fn set_len(&self, len: u64) -> io::Result<()> {
        self.len.store(len, Ordering::Relaxed);
        Ok(())
    }

    fn sync_data(&self) -> io::Result<()> {
        Ok(())
    }

    fn write(&self, offset: u64, data: &[u8]) -> io::Result<()> {
        let mut written = self.written();
        let (mut offset, mut data) = (offset, data);
        while !data.is_empty() {
            let (block, at) = (offset / BLOCK as u64, (offset % BLOCK as u64) as usize);
            let (now, rest) = data.split_at(data.len().min(BLOCK - at));
            let bytes = match written.entry(block) {
                std::collections::btree_map::Entry::Occupied(known) => known.into_mut(),
                std::collections::btree_map::Entry::Vacant(new) => {
                    let mut bytes = vec![0; BLOCK];
                    self.read_file(block * BLOCK as u64, &mut bytes)?;
                    new.insert(bytes.into())
                }
            };
            bytes[at..at + now.len()].copy_from_slice(now);
            (offset, data) = (offset + now.len() as u64, rest);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again_and_the_file_stays_as_it_was() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("file");
        let before: Vec<u8> = (0..10_000_u32).map(|i| i as u8).collect();
        std::fs::write(&path, &before).unwrap();
        let overlay = Overlay::new(File::open(&path).unwrap()).unwrap();
        overlay.set_len(20_000).unwrap();
        overlay.write(4000, &[7; 5000]).unwrap();
        overlay.write(9_990, &[8; 100]).unwrap();
        let mut want = before.clone();
        want.resize(20_000, 0);
        want[4000..9000].fill(7);
        want[9_990..10_090].fill(8);
        for (from, to) in [(0, 20_000), (4001, 4002), (8_999, 10_091), (9_999, 10_001)] {
            let mut out = vec![1; to - from];
            overlay.read(from as u64, &mut out).unwrap();
            assert!(out == want[from..to], "{from}..{to}");
        }
        assert!(overlay.read(19_999, &mut [0; 2]).is_err());
        assert_eq!(std::fs::read(&path).unwrap(), before);
    }
}
