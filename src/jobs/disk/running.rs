use std::{
    collections::BTreeMap,
    fs::{File, OpenOptions},
    io::{self, Read},
    os::unix::fs::FileExt,
    path::Path,
    sync::{Mutex, MutexGuard, PoisonError},
};

use uuid::Uuid;

/// Bytes of a line: a job's name, a blank, the digits of a `u32`, the line's end.
const LINE: usize = 36 + 1 + 10 + 1;
/// Lines that are in the file from the start, so that a full disk has room for notes: more than most
/// machines have processors. More are added where they are needed.
const LINES: usize = 64;
/// What is read of a file that may be anything: ten thousand lines and more.
const LONGEST: u64 = 1 << 19;

/// The jobs at work, each with its number of crashes should the process end now, as lines of a file.
///
/// The system keeps what was written when the process ends, however that comes, so that nothing need
/// wait for the disk; a loss of power may take it.
#[derive(Debug)]
pub struct Running {
    file: File,
    notes: Mutex<Notes>,
}

#[derive(Debug, Default)]
struct Notes {
    // whose each line is
    lines: Vec<Option<Uuid>>,
    closed: bool,
}

fn line(id: Uuid, crashes: u32) -> String {
    format!("{id} {crashes:>10}\n")
}

fn blank() -> String {
    format!("{:>width$}", "\n", width = LINE)
}

impl Running {
    /// The notes in the file at `path`, or a new one.
    ///
    /// # Errors
    /// The file cannot be used.
    pub fn open(path: &Path) -> io::Result<Self> {
        let file =
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path);
        Ok(Self::new(file?))
    }

    /// The notes in `file`.
    pub fn new(file: File) -> Self {
        Self { file, notes: Mutex::default() }
    }

    fn notes(&self) -> MutexGuard<'_, Notes> {
        self.notes.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn write(&self, at: usize, line: &str) -> io::Result<()> {
        self.file.write_all_at(line.as_bytes(), (at * LINE) as u64)
    }

    /// What the process before has left: jobs at work when it ended, and their crashes with that. What is
    /// no note is passed over.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn left(&self) -> io::Result<BTreeMap<Uuid, u32>> {
        let mut bytes = Vec::new();
        (&self.file).take(LONGEST).read_to_end(&mut bytes)?;
        let text = String::from_utf8_lossy(&bytes);
        let note = |line: &str| {
            let (id, crashes) = line.split_once(' ')?;
            Some((Uuid::parse_str(id).ok()?, crashes.trim().parse().ok()?))
        };
        Ok(text.lines().filter_map(note).collect())
    }

    /// Takes out all notes.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn clear(&self) -> io::Result<()> {
        self.write(0, &blank().repeat(LINES))?;
        self.file.set_len((LINES * LINE) as u64)
    }

    /// Notes that a job is at work, which has had `crashes` should the process end now.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn add(&self, id: Uuid, crashes: u32) -> io::Result<()> {
        let mut notes = self.notes();
        if notes.closed {
            return Ok(());
        }
        let free = notes.lines.iter().position(Option::is_none).unwrap_or(notes.lines.len());
        self.write(free, &line(id, crashes))?;
        let more = notes.lines.len().max(free + 1);
        notes.lines.resize(more, None);
        notes.lines[free] = Some(id);
        Ok(())
    }

    /// Takes out the note of a job.
    pub fn remove(&self, id: Uuid) {
        let mut notes = self.notes();
        if let Some(at) = notes.lines.iter().position(|line| *line == Some(id)) {
            notes.lines[at] = None;
            // one that stays counts for nothing once the job has ended
            let _ = self.write(at, &blank());
        }
    }

    /// Takes out all notes and makes no more.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn close(&self) -> io::Result<()> {
        let mut notes = self.notes();
        *notes = Notes { lines: Vec::new(), closed: true };
        self.clear()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(running: &Running) -> String {
        let mut bytes = vec![0; running.file.metadata().unwrap().len() as usize];
        running.file.read_exact_at(&mut bytes, 0).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    /// The notes that another process finds in the file.
    fn found(path: &Path) -> Vec<(Uuid, u32)> {
        Running::open(path).unwrap().left().unwrap().into_iter().collect()
    }

    #[test]
    fn the_next_process_finds_the_jobs_at_work_and_no_others() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("jobs.running");
        let running = Running::open(&path).unwrap();
        running.clear().unwrap();
        assert!(running.left().unwrap().is_empty());
        let ids = [1, 2, 3].map(Uuid::from_u128);
        ids.iter().zip(1..).for_each(|(id, crashes)| running.add(*id, crashes).unwrap());
        running.remove(ids[1]);
        assert_eq!(found(&path), [(ids[0], 1), (ids[2], 3)]);
        let many: Vec<_> = (10..110).map(Uuid::from_u128).collect();
        many.iter().for_each(|id| running.add(*id, u32::MAX).unwrap());
        assert_eq!(found(&path).len(), 102);
        many.iter().for_each(|id| running.remove(*id));
        running.add(ids[1], 1).unwrap();
        assert_eq!(found(&path).len(), 3);
        running.close().unwrap();
        running.add(ids[1], 1).unwrap();
        assert!(found(&path).is_empty());
        assert_eq!(text(&running), blank().repeat(LINES));
    }

    #[test]
    fn a_file_of_anything_else_holds_no_notes() {
        let path = tempfile::NamedTempFile::new().unwrap();
        let half = &line(Uuid::from_u128(1), 2)[..30];
        for bytes in [vec![0; 5000], vec![0xff; 5000], half.into(), b" \n\n 7\nx 7\n".repeat(9)] {
            std::fs::write(&path, bytes).unwrap();
            let running = Running::open(path.path()).unwrap();
            assert!(running.left().unwrap().is_empty());
            running.clear().unwrap();
            assert_eq!(text(&running), blank().repeat(LINES));
        }
    }
}
