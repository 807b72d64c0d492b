use std::{
    error::Error,
    fs,
    os::unix::fs::MetadataExt,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
    time::{Duration, SystemTime},
};

/// A file that changed less than this ago may change again within the same tick of its clock.
const TICK: Duration = Duration::from_secs(1);

type Reader<T, E> = Box<dyn Fn() -> Result<T, E> + Send + Sync>;

/// What some files say together, read again when one of them changes.
///
/// Files that have become unusable leave what they said last in force, and that is told once a change.
pub struct Reread<T, E> {
    name: &'static str,
    paths: Vec<PathBuf>,
    read: Reader<T, E>,
    last: Mutex<Last<T>>,
}

struct Last<T> {
    value: T,
    files: Vec<Option<Stamp>>,
    settled: bool,
}

/// What differs when a file is another, or says something else. The time of its last change comes from
/// the system alone, so it tells of contents whose length and age are those of the ones before; of a link
/// it is the file it leads to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Stamp {
    device: u64,
    inode: u64,
    length: u64,
    modified: (i64, i64),
    changed: (i64, i64),
}

impl Stamp {
    fn of(path: &Path) -> Option<Self> {
        let file = fs::metadata(path).ok()?;
        Some(Self {
            device: file.dev(),
            inode: file.ino(),
            length: file.len(),
            modified: (file.mtime(), file.mtime_nsec()),
            changed: (file.ctime(), file.ctime_nsec()),
        })
    }

    /// Whether a change that comes now would show.
    fn is_settled(self) -> bool {
        let seconds = u64::try_from(self.changed.0).unwrap_or_default();
        let changed = SystemTime::UNIX_EPOCH + Duration::from_secs(seconds + 1);
        changed + TICK < SystemTime::now()
    }
}

impl<T: Clone, E: Error> Reread<T, E> {
    /// Reads `paths` by `read`, here and when they have changed; `name` is what the log calls them.
    ///
    /// # Errors
    /// `read` fails.
    pub fn open(
        name: &'static str,
        paths: Vec<PathBuf>,
        read: impl Fn() -> Result<T, E> + Send + Sync + 'static,
    ) -> Result<Self, E> {
        // a change while they are read is one that comes after
        let (files, settled) = look(&paths);
        let last = Mutex::new(Last { value: read()?, files, settled });
        Ok(Self { name, paths, read: Box::new(read), last })
    }

    /// What the files say now, or said when they last could be used.
    pub fn latest(&self) -> T {
        let (files, settled) = look(&self.paths);
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        let changed = files != last.files;
        if changed || !last.settled {
            match (self.read)() {
                Ok(value) => {
                    if changed {
                        tracing::info!("{} changed and is read again", self.name);
                    }
                    last.value = value;
                }
                Err(error) if changed => {
                    let name = self.name;
                    tracing::error!(%error, "{name} changed and is not used; what it said before holds");
                }
                Err(_) => {}
            }
            (last.files, last.settled) = (files, settled);
        }
        last.value.clone()
    }
}

/// The files as they are, and whether the next change will show.
fn look(paths: &[PathBuf]) -> (Vec<Option<Stamp>>, bool) {
    let files: Vec<_> = paths.iter().map(|path| Stamp::of(path)).collect();
    let settled = files.iter().flatten().all(|stamp| stamp.is_settled());
    (files, settled)
}

#[cfg(test)]
mod tests {
    use std::io;

    use super::*;

    fn open(path: &Path) -> Reread<String, io::Error> {
        let read = path.to_owned();
        Reread::open("the file", vec![path.to_owned()], move || fs::read_to_string(&read)).unwrap()
    }

    #[test]
    fn a_change_in_place_shows_although_length_and_time_stay() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("file");
        fs::write(&path, "one").unwrap();
        let file = open(&path);
        for text in ["two", "six", "ten"] {
            let modified = fs::metadata(&path).unwrap().modified().unwrap();
            fs::write(&path, text).unwrap();
            fs::File::options().write(true).open(&path).unwrap().set_modified(modified).unwrap();
            assert_eq!(file.latest(), text);
        }
    }

    #[test]
    fn a_link_that_leads_elsewhere_is_a_change() {
        let directory = tempfile::tempdir().unwrap();
        let place = |name: &str| directory.path().join(name);
        // as a cluster mounts its secrets
        for text in ["one", "two"] {
            fs::create_dir(place(text)).unwrap();
            fs::write(place(text).join("file"), text).unwrap();
        }
        let link = |to: &str| {
            std::os::unix::fs::symlink(place(to), place("next")).unwrap();
            fs::rename(place("next"), place("data")).unwrap();
        };
        link("one");
        let file = open(&place("data").join("file"));
        assert_eq!(file.latest(), "one");
        link("two");
        assert_eq!(file.latest(), "two");
    }

    #[test]
    fn a_file_that_is_gone_says_what_it_said_until_it_is_back() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("file");
        fs::write(&path, "one").unwrap();
        let file = open(&path);
        fs::remove_file(&path).unwrap();
        assert_eq!((file.latest(), file.latest()), ("one".to_owned(), "one".to_owned()));
        fs::write(&path, "two").unwrap();
        assert_eq!(file.latest(), "two");
    }
}
