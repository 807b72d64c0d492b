use std::{
    cell::Cell,
    fmt::Debug,
    io::ErrorKind,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Once, PoisonError, RwLock, RwLockReadGuard,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use redb::Database;

use crate::jobs::{StoreError, pool::message};

/// A database that cannot be opened is not tried again before this time has passed.
const OPENING_PAUSE: Duration = Duration::from_millis(if cfg!(test) { 20 } else { 1000 });

/// Where a database comes from.
pub trait Source: Debug + Send + Sync {
    /// Opens the database: at the start, and again whenever it has failed.
    ///
    /// # Errors
    /// It cannot be opened.
    fn open(&self) -> Result<Database, Trouble>;

    /// Makes sure that what is written to the open database will be found by the next process.
    ///
    /// # Errors
    /// Its file is not where it was.
    fn check(&self) -> Result<(), StoreError> {
        Ok(())
    }
}

/// An open database that is opened again after it has failed: the library refuses everything from the
/// first error of its file on.
#[derive(Debug)]
pub struct Handle {
    source: Box<dyn Source>,
    slot: RwLock<Slot>,
}

#[derive(Debug)]
struct Slot {
    database: Option<Database>,
    // it has failed, or its library has panicked
    spoilt: AtomicBool,
    // when it could not be opened, and why
    refused: Option<(Instant, StoreError)>,
}

/// A call that failed.
#[derive(Debug)]
pub struct Trouble {
    error: StoreError,
    // the database is to be opened again
    spoils: bool,
    // it may come of another call's failure: the library refuses what follows one, and panics beside one
    inherited: bool,
}

impl Trouble {
    /// The trouble behind an error of the library.
    pub fn of(error: impl Into<redb::Error>) -> Self {
        use redb::Error as E;
        let error = error.into();
        let inherited = matches!(error, E::PreviousIo | E::DatabaseClosed | E::LockPoisoned(_));
        let told = match &error {
            E::DatabaseAlreadyOpen => StoreError::InUse,
            E::Io(io) if is_full(io.kind()) => StoreError::Full(io.to_string()),
            _ => StoreError::Failed(error.to_string()),
        };
        Self { error: told, spoils: true, inherited }
    }

    /// An error that is none of the database's.
    pub fn apart(error: StoreError) -> Self {
        Self { error, spoils: false, inherited: false }
    }

    /// Whether it comes from this call: from the database, and not for what another call met.
    pub fn is_own(&self) -> bool {
        self.spoils && !self.inherited
    }

    /// What it is to those who called.
    pub fn told(&self) -> StoreError {
        self.error.clone()
    }

    /// What it is to those who called.
    pub fn error(self) -> StoreError {
        self.error
    }
}

fn is_full(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge)
}

impl Handle {
    /// Opens the database of `source`.
    ///
    /// # Errors
    /// It cannot be opened.
    pub fn open(source: impl Source + 'static) -> Result<Self, StoreError> {
        let database = guarded(|| source.open()).map_err(Trouble::error)?;
        let slot = Slot { database: Some(database), spoilt: AtomicBool::new(false), refused: None };
        Ok(Self { source: Box::new(source), slot: RwLock::new(slot) })
    }

    /// Makes sure that what is written will be found by the next process.
    ///
    /// # Errors
    /// The database's file is not where it was.
    pub fn check(&self) -> Result<(), StoreError> {
        self.source.check()
    }

    /// Does `work` on the open database; it is done twice where another call had spoilt the database
    /// before it, so that it must have the same effect then.
    ///
    /// # Errors
    /// The database fails, or its library panics.
    pub fn call<T>(&self, work: impl Fn(&Database) -> Result<T, Trouble>) -> Result<T, StoreError> {
        let mut done = self.try_once(&work);
        if matches!(&done, Err(trouble) if trouble.inherited) {
            done = self.try_once(&work);
        }
        done.map_err(Trouble::error)
    }

    fn try_once<T>(&self, work: &impl Fn(&Database) -> Result<T, Trouble>) -> Result<T, Trouble> {
        let slot = self.sound().map_err(Trouble::apart)?;
        let Some(database) = &slot.database else {
            return Err(Trouble::apart(StoreError::Failed("it is closed".to_owned())));
        };
        let done = guarded(|| work(database));
        if matches!(&done, Err(trouble) if trouble.spoils) {
            slot.spoilt.store(true, Ordering::Relaxed);
        }
        done
    }

    /// The open database, opened again where it was spoilt and every call on it has ended.
    fn sound(&self) -> Result<RwLockReadGuard<'_, Slot>, StoreError> {
        let read = || self.slot.read().unwrap_or_else(PoisonError::into_inner);
        let slot = read();
        if slot.is_sound() {
            return Ok(slot);
        }
        drop(slot);
        self.reopen()?;
        Ok(read())
    }

    fn reopen(&self) -> Result<(), StoreError> {
        let mut slot = self.slot.write().unwrap_or_else(PoisonError::into_inner);
        if slot.is_sound() {
            return Ok(());
        }
        if let Some((when, error)) = &slot.refused
            && when.elapsed() < OPENING_PAUSE
        {
            return Err(error.clone());
        }
        // it is closed before it is opened; what that says of a spoilt one is of no use
        let old = slot.database.take();
        let _ = close(old);
        match guarded(|| self.source.open()).map_err(Trouble::error) {
            Ok(database) => {
                tracing::info!("the job database is open again");
                *slot = Slot {
                    database: Some(database),
                    spoilt: AtomicBool::new(false),
                    refused: None,
                };
                Ok(())
            }
            Err(error) => {
                slot.refused = Some((Instant::now(), error.clone()));
                Err(error)
            }
        }
    }
}

impl Drop for Handle {
    fn drop(&mut self) {
        let slot = self.slot.get_mut().unwrap_or_else(PoisonError::into_inner);
        let database = slot.database.take();
        // whatever the library says of it: what was written is on the disk
        let _ = close(database);
    }
}

impl Slot {
    fn is_sound(&self) -> bool {
        self.database.is_some() && !self.spoilt.load(Ordering::Relaxed)
    }
}

thread_local! {
    /// Whether a panic of this thread is caught and told as an error.
    static CAUGHT: Cell<bool> = const { Cell::new(false) };
}

/// Closes a database.
///
/// # Errors
/// The library panics.
pub fn close(database: Option<Database>) -> Result<(), Trouble> {
    guarded(|| {
        drop(database);
        Ok(())
    })
}

/// Runs calls of the library: its panics become errors, and are told as such alone.
pub fn guarded<T>(call: impl FnOnce() -> Result<T, Trouble>) -> Result<T, Trouble> {
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        let loud = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            if !CAUGHT.get() {
                loud(panic);
            }
        }));
    });
    let before = CAUGHT.replace(true);
    let done = catch_unwind(AssertUnwindSafe(call));
    CAUGHT.set(before);
    done.unwrap_or_else(|panic| {
        let error =
            StoreError::Failed(format!("its contents contradict each other: {}", message(&*panic)));
        // the library also panics where another call is just failing
        Err(Trouble { error, spoils: true, inherited: true })
    })
}
