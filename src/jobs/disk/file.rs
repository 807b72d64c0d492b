use std::{
    fs::{self, File, OpenOptions},
    io,
    os::unix::fs::{FileExt, MetadataExt},
    path::{Path, PathBuf},
    sync::OnceLock,
};

use redb::{Database, StorageBackend, backends::FileBackend};

use super::{
    handle::{Source, Trouble, close, guarded},
    overlay::Overlay,
    salvage,
};
use crate::jobs::StoreError;

/// Bytes of a file that is only looked at that are kept in memory.
const LOOKING_CACHE: usize = 1 << 20;
/// Where the library's file format, version 3, has its flags.
const FLAGS_AT: u64 = 9;
/// The flag of a database that was not closed: the library looks at every page when it opens it.
const RECOVERY_REQUIRED: u8 = 2;
/// The flag of a last change that the library trusts without a look.
const TWO_PHASE_COMMIT: u8 = 4;

fn failed(error: io::Error) -> Trouble {
    Trouble::of(redb::Error::Io(error))
}

/// The flags with which a database is checked when it is opened, as after a sudden end.
fn checked_flags(read: impl Fn(&mut [u8]) -> io::Result<()>) -> io::Result<[u8; 1]> {
    let mut flags = [0];
    read(&mut flags)?;
    Ok([(flags[0] | RECOVERY_REQUIRED) & !TWO_PHASE_COMMIT])
}

/// The database in a file.
#[derive(Debug)]
pub struct DatabaseFile {
    path: PathBuf,
    cache: usize,
    // device and inode of the file that was opened first
    identity: OnceLock<(u64, u64)>,
}

impl DatabaseFile {
    /// The file at `path`, of which up to `cache` bytes are kept in memory.
    pub fn new(path: &Path, cache: usize) -> Self {
        Self { path: path.to_owned(), cache, identity: OnceLock::new() }
    }

    /// Looks at a file that is there before anything is written to it: what is damaged is set aside,
    /// and what can be read of it is kept.
    fn examine(&self) -> Result<(), Trouble> {
        let file = match File::open(&self.path) {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
            Err(error) => return Err(failed(error)),
        };
        if file.metadata().map_err(failed)?.len() == 0 {
            return Ok(());
        }
        // nobody else has it meanwhile
        let _locked = FileBackend::new(file).map_err(Trouble::of)?;
        if !self.is_sound() {
            let salvaged = guarded(|| salvage::salvage(&self.path, || self.look(false)));
            salvaged.map_err(|trouble| self.unusable(trouble))?;
        }
        let file = OpenOptions::new().read(true).write(true).open(&self.path).map_err(failed)?;
        let flags = checked_flags(|byte| file.read_exact_at(byte, FLAGS_AT)).map_err(failed)?;
        file.write_all_at(&flags, FLAGS_AT).map_err(failed)
    }

    /// The database as it is in the file; nothing is written there. Where it is `checked`, one whose
    /// pages in use are not all as they were written is not opened.
    fn look(&self, checked: bool) -> Result<Database, Trouble> {
        let overlay = Overlay::new(File::open(&self.path).map_err(failed)?).map_err(failed)?;
        if checked {
            let flags = checked_flags(|byte| overlay.read(FLAGS_AT, byte)).map_err(failed)?;
            overlay.write(FLAGS_AT, &flags).map_err(failed)?;
        }
        let mut builder = Database::builder();
        builder.set_cache_size(LOOKING_CACHE).create_with_backend(overlay).map_err(Trouble::of)
    }

    fn is_sound(&self) -> bool {
        // a panic of the library's tells of damage too
        let looked = guarded(|| self.look(true));
        looked.and_then(|database| close(Some(database))).is_ok()
    }

    fn unusable(&self, trouble: Trouble) -> Trouble {
        match trouble.error() {
            StoreError::Failed(why) => Trouble::apart(StoreError::Failed(format!(
                "{} cannot be read ({why}): put a good copy in its place, or move it away to begin \
                 without its jobs",
                self.path.display()
            ))),
            other => Trouble::apart(other),
        }
    }

    fn identity(&self) -> io::Result<(u64, u64)> {
        fs::metadata(&self.path).map(|metadata| (metadata.dev(), metadata.ino()))
    }
}

impl Source for DatabaseFile {
    fn open(&self) -> Result<Database, Trouble> {
        if self.identity.get().is_none() {
            self.examine()?;
        } else {
            self.check().map_err(Trouble::apart)?;
        }
        let mut builder = Database::builder();
        let database =
            builder.set_cache_size(self.cache).create(&self.path).map_err(Trouble::of)?;
        let identity = self.identity().map_err(failed)?;
        self.identity.get_or_init(|| identity);
        Ok(database)
    }

    fn check(&self) -> Result<(), StoreError> {
        if self.identity().ok().as_ref() == self.identity.get() {
            return Ok(());
        }
        Err(StoreError::Failed(format!(
            "{} was removed or replaced while it was in use: put it back, or start the service again",
            self.path.display()
        )))
    }
}
