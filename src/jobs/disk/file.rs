use std::{
    fs::{self, File},
    io,
    os::unix::fs::MetadataExt,
    path::{Path, PathBuf},
    sync::{
        Arc, OnceLock,
        atomic::{AtomicBool, Ordering},
    },
};

use redb::{Builder, Database};

use super::{
    handle::{Source, Trouble, guarded},
    overlay::Overlay,
    salvage,
};
use crate::jobs::StoreError;

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

    fn builder(&self) -> Builder {
        let mut builder = Database::builder();
        builder.set_cache_size(self.cache);
        builder
    }

    /// Looks at a file that is there before anything is written to it: what is damaged is set aside,
    /// and what can be read of it is kept.
    fn examine(&self) -> Result<(), Trouble> {
        let file = match File::open(&self.path) {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
            Err(error) => return Err(Trouble::of(redb::Error::Io(error))),
        };
        if file.metadata().map_err(|e| Trouble::of(redb::Error::Io(e)))?.len() == 0 {
            return Ok(());
        }
        match self.is_sound() {
            Ok(true) => Ok(()),
            Ok(false) => salvage::salvage(&self.path, || self.look(&Arc::default()))
                .map_err(|trouble| self.unusable(trouble)),
            Err(trouble) => Err(trouble),
        }
    }

    /// The database as it is in the file; nothing is written there. `repaired` tells whether the
    /// library has looked at every page, as it does after a sudden end.
    fn look(&self, repaired: &Arc<AtomicBool>) -> Result<Database, Trouble> {
        let file = File::open(&self.path).map_err(|e| Trouble::of(redb::Error::Io(e)))?;
        let overlay = Overlay::new(file).map_err(Trouble::of)?;
        let told = Arc::clone(repaired);
        let mut builder = self.builder();
        builder.set_repair_callback(move |_| told.store(true, Ordering::Relaxed));
        builder.create_with_backend(overlay).map_err(Trouble::of)
    }

    /// Whether all pages in use are as they were written, and the database can be written to. One that
    /// can be opened and is not so is damaged.
    fn is_sound(&self) -> Result<bool, Trouble> {
        let repaired = Arc::default();
        let mut database =
            guarded(|| self.look(&repaired)).map_err(|trouble| self.unusable(trouble))?;
        // a panic of the library's tells of damage too
        let checked = guarded(|| {
            if repaired.load(Ordering::Relaxed) {
                return Ok(true);
            }
            database.check_integrity().map_err(Trouble::of)
        });
        let written = guarded(|| super::write_nothing(&database));
        let closed = guarded(|| Ok(drop(database)));
        Ok(checked.unwrap_or(false) && written.is_ok() && closed.is_ok())
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
        let database = self.builder().create(&self.path).map_err(Trouble::of)?;
        let identity = self.identity().map_err(|e| Trouble::of(redb::Error::Io(e)))?;
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
