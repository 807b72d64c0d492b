//! The bytes of a cloud's file.

use std::{
    fs::{self, File, Metadata},
    io::{self, Read},
    ops::Deref,
    path::{Path, PathBuf},
    time::SystemTime,
};

use memmap2::Mmap;

use super::{cut_short, error::AnyError};

/// Shorter files are read into memory: that costs next to nothing, and what happens to the file later does not matter.
const MAPPED_FROM: u64 = 64 << 20;

/// A file, or what came by standard input.
#[derive(Debug)]
pub enum Input {
    /// In memory.
    Bytes(Vec<u8>),
    /// In the file, and looked at there.
    Mapped(Mapped),
}

/// A long file, of which the system keeps in memory what there is room for.
#[derive(Debug)]
pub struct Mapped {
    map: Mmap,
    path: PathBuf,
    seen: (u64, Option<SystemTime>),
}

impl Deref for Input {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match self {
            Self::Bytes(bytes) => bytes,
            Self::Mapped(mapped) => &mapped.map,
        }
    }
}

impl Input {
    /// Opens a file; `-` is standard input.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn open(path: &Path) -> Result<Self, AnyError> {
        if path.as_os_str() == "-" {
            let mut bytes = Vec::new();
            io::stdin().lock().read_to_end(&mut bytes)?;
            return Ok(Self::Bytes(bytes));
        }
        let opened = File::open(path).and_then(|file| {
            let about = file.metadata()?;
            if about.is_file() && about.len() >= MAPPED_FROM {
                return Mapped::of(&file, path, &about).map(Self::Mapped);
            }
            fs::read(path).map(Self::Bytes)
        });
        opened.map_err(|e| format!("cannot read {}: {e}", path.display()).into())
    }

    /// Makes sure that the file is still as it was when it was opened.
    ///
    /// # Errors
    /// It changed: what was read of it may be partly the one, partly the other.
    pub fn check_unchanged(&self) -> Result<(), AnyError> {
        let Self::Mapped(mapped) = self else { return Ok(()) };
        let now = fs::metadata(&mapped.path).map(|about| seen(&about));
        if now.is_ok_and(|now| now == mapped.seen) {
            return Ok(());
        }
        let path = mapped.path.display();
        Err(format!("{path} changed while it was read: run it again once nothing writes to it")
            .into())
    }
}

fn seen(about: &Metadata) -> (u64, Option<SystemTime>) {
    (about.len(), about.modified().ok())
}

impl Mapped {
    fn of(file: &File, path: &Path, about: &Metadata) -> io::Result<Self> {
        #[expect(
            unsafe_code,
            reason = "a file larger than the memory can be read in place in no other way"
        )]
        // SAFETY: the bytes are those of a file, which another program may change meanwhile. Readers take any bytes and
        // check each place that they look at, so other bytes than before make another cloud or an error; the file is
        // compared at the end, and the result of one that changed is not written. A page behind a new end of the file is a
        // signal, which ends the process with the reason, see `cut_short`.
        let map = unsafe { Mmap::map(file)? };
        cut_short::watch(&map, path);
        // it is gone through from its beginning; where the system cannot be told, that costs time alone
        #[cfg(unix)]
        let _ = map.advise(memmap2::Advice::Sequential);
        Ok(Self { map, path: path.to_owned(), seen: seen(about) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_files_are_mapped_and_say_when_they_changed() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("cloud.xyz");
        for (length, mapped) in [(MAPPED_FROM - 1, false), (MAPPED_FROM, true)] {
            let file = File::create(&path).unwrap();
            file.set_len(length).unwrap();
            let input = Input::open(&path).unwrap();
            assert_eq!((input.len() as u64, matches!(input, Input::Mapped(_))), (length, mapped));
            assert!(input.iter().step_by(1 << 20).all(|b| *b == 0));
            assert!(input.check_unchanged().is_ok());
            file.set_len(length + 1).unwrap();
            assert_eq!(input.check_unchanged().is_err(), mapped);
        }
        let told = Input::open(&directory.path().join("none")).unwrap_err().to_string();
        assert!(told.contains("cannot read") && told.contains("none"), "{told}");
    }
}
