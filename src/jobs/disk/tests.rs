use std::{
    fs::{self, OpenOptions},
    io::{self, ErrorKind},
    os::unix::fs::FileExt,
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

use redb::StorageBackend;

use super::{room::PAUSE, *};
use crate::jobs::{Fault, JobState, Submission};

/// What a disk does with what is written to it.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Does {
    Works,
    Fails(ErrorKind),
    Panics,
}

/// A disk in memory that fails on demand.
#[derive(Clone, Debug)]
struct Disk(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    bytes: Mutex<Vec<u8>>,
    does: Mutex<Does>,
    opened: AtomicUsize,
}

impl Disk {
    fn new() -> Self {
        let (bytes, does) = (Mutex::default(), Mutex::new(Does::Works));
        Self(Arc::new(Inner { bytes, does, opened: AtomicUsize::new(0) }))
    }

    fn set(&self, does: Does) {
        *self.0.does.lock().unwrap() = does;
    }

    fn written_to(&self) -> io::Result<()> {
        let does = *self.0.does.lock().unwrap();
        match does {
            Does::Works => Ok(()),
            Does::Fails(kind) => Err(kind.into()),
            Does::Panics => panic!("the library gave up"),
        }
    }
}

impl StorageBackend for Disk {
    fn len(&self) -> io::Result<u64> {
        Ok(self.0.bytes.lock().unwrap().len() as u64)
    }

    fn read(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        let bytes = self.0.bytes.lock().unwrap();
        out.copy_from_slice(&bytes[offset as usize..][..out.len()]);
        Ok(())
    }

    fn set_len(&self, len: u64) -> io::Result<()> {
        self.0.bytes.lock().unwrap().resize(len as usize, 0);
        Ok(())
    }

    fn sync_data(&self) -> io::Result<()> {
        Ok(())
    }

    fn write(&self, offset: u64, data: &[u8]) -> io::Result<()> {
        // the header is overwritten in its place, which needs no room
        if offset > 0 {
            self.written_to()?;
        }
        self.0.bytes.lock().unwrap()[offset as usize..][..data.len()].copy_from_slice(data);
        Ok(())
    }
}

impl Source for Disk {
    fn open(&self) -> Result<Database, Trouble> {
        self.0.opened.fetch_add(1, Ordering::Relaxed);
        Database::builder().create_with_backend(self.clone()).map_err(Trouble::of)
    }
}

/// The store on `disk`, with notes that nobody else has.
fn opened(disk: &Disk) -> Result<DiskStore, StoreError> {
    DiskStore::new(disk.clone(), || Ok(Running::new(tempfile::tempfile().unwrap())))
}

fn record() -> JobRecord {
    JobRecord::new(Submission::default(), 3)
}

fn bytes(text: &'static str) -> Bytes {
    Bytes::from_static(text.as_bytes())
}

/// A job that has ended with `result`.
fn ended(store: &DiskStore, result: &'static str) -> Uuid {
    let mut record = record();
    store.insert(&record, bytes("abc")).unwrap();
    (record.state, record.finished_ms) = (JobState::Succeeded, Some(1));
    store.finish(&record, Some(bytes(result))).unwrap();
    record.id
}

#[test]
fn after_a_full_disk_all_is_well_again_without_a_restart() {
    let disk = Disk::new();
    let store = opened(&disk).unwrap();
    let old = ended(&store, "one");
    disk.set(Does::Fails(ErrorKind::StorageFull));
    let (lost, running) = (record(), record());
    assert!(matches!(store.insert(&lost, bytes("abc")), Err(StoreError::Full(_))));
    // what is there can be read meanwhile
    assert_eq!(store.result(old).unwrap(), Some(bytes("one")));
    thread::sleep(PAUSE);
    assert!(matches!(store.finish(&running, None), Err(StoreError::Full(_))));
    assert!(matches!(store.probe(), Err(StoreError::Full(_))));
    disk.set(Does::Works);
    thread::sleep(PAUSE);
    assert_eq!(store.probe(), Ok(()));
    store.finish(&running, None).unwrap();
    let kept: Vec<_> = store.records().unwrap().iter().map(|record| record.id).collect();
    assert_eq!(kept, [old, running.id]);
}

#[test]
fn a_full_disk_is_not_tried_by_everybody_at_once() {
    let disk = Disk::new();
    let store = opened(&disk).unwrap();
    disk.set(Does::Fails(ErrorKind::StorageFull));
    let before = disk.0.opened.load(Ordering::Relaxed);
    thread::scope(|scope| {
        for _ in 0..20 {
            scope.spawn(|| {
                let full = store.insert(&record(), bytes("abc"));
                assert!(matches!(full, Err(StoreError::Full(_))), "{full:?}");
            });
        }
    });
    // one that finds out, and those that had begun by then
    let opened = disk.0.opened.load(Ordering::Relaxed) - before;
    assert!(opened < 10, "opened {opened} times");
}

#[test]
fn a_disk_that_fails_and_a_library_that_panics_are_errors_and_are_got_over() {
    let disk = Disk::new();
    let store = opened(&disk).unwrap();
    let old = ended(&store, "one");
    for does in [Does::Fails(ErrorKind::Other), Does::Panics] {
        disk.set(does);
        let failed = store.insert(&record(), bytes("abc"));
        assert!(matches!(failed, Err(StoreError::Failed(_))), "{failed:?}");
        assert!(store.probe().is_err());
        disk.set(Does::Works);
        thread::sleep(PAUSE);
        assert_eq!(store.probe(), Ok(()));
        ended(&store, "two");
        assert_eq!(store.result(old).unwrap(), Some(bytes("one")));
    }
    assert_eq!(store.records().unwrap().len(), 3);
}

#[test]
fn a_damaged_row_is_an_error_and_a_damaged_record_is_left_out() {
    let disk = Disk::new();
    let store = opened(&disk).unwrap();
    let [good, bad] = ["one", "two"].map(|result| ended(&store, result));
    store
        .change(0, |tables| {
            let row = tables.results.get(good.as_u128())?.unwrap().value().to_vec();
            // of another job, and whole
            tables.results.insert(bad.as_u128(), row.as_slice())?;
            tables.records.insert(bad.as_u128(), b"{}".as_slice())?;
            Ok(())
        })
        .unwrap();
    let damaged = StoreError::Damaged { part: "result", id: bad };
    assert_eq!(store.result(bad), Err(damaged));
    assert_eq!(store.result(good).unwrap(), Some(bytes("one")));
    assert_eq!(store.records().unwrap().iter().map(|r| r.id).collect::<Vec<_>>(), [good]);
}

/// A database file of twenty ended jobs.
fn written() -> (tempfile::TempDir, std::path::PathBuf, Vec<(Uuid, String)>) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("jobs.redb");
    let store = DiskStore::open(&path, 1 << 20).unwrap();
    let mut jobs = Vec::new();
    for i in 0..20 {
        let mut record = record();
        let result = format!("result {i} ").repeat(20 * i);
        record.fault = Some(Fault { code: "c".repeat(100), detail: "d".repeat(100) });
        store.insert(&record, "abc".repeat(40 * i).into()).unwrap();
        (record.state, record.finished_ms) = (JobState::Succeeded, Some(1));
        store.finish(&record, Some(result.clone().into())).unwrap();
        jobs.push((record.id, result));
    }
    (directory, path, jobs)
}

#[test]
fn a_damaged_file_gives_right_results_or_errors_and_never_a_panic() {
    let (_directory, path, jobs) = written();
    let good = fs::read(&path).unwrap();
    let used: Vec<_> =
        good.chunks(512).enumerate().filter(|(_, c)| c.iter().any(|b| *b != 0)).collect();
    let (mut refused, mut lost, mut all) = (0, 0, 0);
    // noise in every part of the file that is in use, and single bits of its header
    for (place, i) in
        used.iter().map(|(i, _)| 512 * i).step_by(3).chain((0..512).step_by(5)).zip(0..)
    {
        let mut bytes = good.clone();
        if i < used.len().div_ceil(3) {
            bytes[place + 100..place + 160].iter_mut().for_each(|b| *b ^= 0xa5);
        } else {
            bytes[place] ^= 1 << (i % 8);
        }
        fs::write(&path, &bytes).unwrap();
        let store = match DiskStore::open(&path, 1 << 20) {
            Ok(store) => store,
            Err(error) => {
                let text = error.to_string();
                assert!(text.contains("jobs.redb") && text.contains("move it away"), "{text}");
                refused += 1;
                continue;
            }
        };
        let (mut right, before) = (0, lost);
        for (id, result) in &jobs {
            match store.result(*id) {
                Ok(Some(found)) => {
                    assert!(found == result, "{place}: another result");
                    right += 1;
                }
                Ok(None) | Err(StoreError::Damaged { .. }) => lost += 1,
                Err(other) => panic!("{place}: {other}"),
            }
        }
        all += usize::from(right == jobs.len());
        assert_eq!(right + lost - before, jobs.len());
        // and it goes on
        store.insert(&record(), Bytes::from_static(b"abc")).unwrap();
        store.records().unwrap();
    }
    // a page at the root of everything is seldom hit
    assert!(refused < 40 && lost > 0 && all > 0, "{refused} refused, {lost} lost, {all} whole");
}

#[test]
fn what_is_no_database_is_refused_with_its_path() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("jobs.redb");
    let (_kept, written, _) = written();
    let mut cut = fs::read(written).unwrap();
    cut.truncate(5000);
    for text in [vec![b'x'; 5000], vec![0; 5000], b"redb".to_vec(), cut] {
        fs::write(&path, text).unwrap();
        let error = DiskStore::open(&path, 1 << 20).unwrap_err().to_string();
        assert!(error.contains("jobs.redb") && error.contains("move it away"), "{error}");
    }
}

#[test]
fn a_file_that_is_taken_away_is_an_error_until_it_is_back() {
    let (directory, path, jobs) = written();
    let store = DiskStore::open(&path, 1 << 20).unwrap();
    let aside = directory.path().join("aside");
    fs::rename(&path, &aside).unwrap();
    for _ in 0..2 {
        assert!(matches!(store.insert(&record(), bytes("abc")), Err(StoreError::Failed(_))));
        assert!(matches!(store.probe(), Err(StoreError::Failed(_))));
        assert_eq!(store.result(jobs[3].0).unwrap().unwrap(), jobs[3].1);
        // another one in its place is none of ours
        fs::write(&path, "").unwrap();
    }
    fs::rename(&aside, &path).unwrap();
    assert_eq!(store.probe(), Ok(()));
    store.insert(&record(), bytes("abc")).unwrap();
}

#[test]
fn damage_while_it_runs_is_an_error_too() {
    let (_directory, path, jobs) = written();
    // nothing of the file is kept in memory
    let store = DiskStore::open(&path, 0).unwrap();
    let file = OpenOptions::new().write(true).open(&path).unwrap();
    for at in (4096..file.metadata().unwrap().len()).step_by(512) {
        file.write_all_at(&[0xa5; 100], at).unwrap();
    }
    for (id, result) in &jobs {
        if let Ok(Some(found)) = store.result(*id) {
            assert!(found == result);
        }
    }
    drop(store);
}

/// A store in `directory`, and the crashes of the jobs in it.
fn crashes(directory: &Path) -> (DiskStore, Vec<u32>) {
    let store = DiskStore::open(&directory.join("jobs.redb"), 1 << 20).unwrap();
    let crashes = store.records().unwrap().iter().map(|record| record.crashes).collect();
    (store, crashes)
}

#[test]
fn a_job_at_work_when_the_process_ends_has_crashed_and_no_other_has() {
    let directory = tempfile::tempdir().unwrap();
    let [at_work, done, waiting, left] = [(); 4].map(|()| record());
    let mut ended = done.clone();
    for crashed in 0..3 {
        let (store, before) = crashes(directory.path());
        if crashed == 0 {
            assert!(before.is_empty());
            for record in [&at_work, &done, &waiting, &left] {
                store.insert(record, bytes("abc")).unwrap();
            }
        } else {
            assert_eq!(before, [crashed, 0, 0, 0]);
        }
        for record in [&done, &left, &JobRecord { crashes: crashed, ..at_work.clone() }] {
            store.begin(record).unwrap();
        }
        // its end is written down, and then the process ends
        ended.state = JobState::Succeeded;
        store.finish(&ended, None).unwrap();
        store.leave(left.id);
        drop(store);
    }
    // one that was counted is not counted again, nor is what a stop cuts short
    let notes = fs::read(directory.path().join("jobs.running")).unwrap();
    for _ in 0..2 {
        let (store, found) = crashes(directory.path());
        assert_eq!(found, [3, 0, 0, 0]);
        store.begin(&waiting).unwrap();
        store.close();
        store.begin(&left).unwrap();
        drop(store);
        fs::write(directory.path().join("jobs.running"), &notes).unwrap();
    }
}

#[test]
fn a_note_that_cannot_be_made_is_an_error_of_the_store() {
    let none = OpenOptions::new().write(true).open("/dev/full").unwrap();
    let store = DiskStore::new(Disk::new(), || Ok(Running::new(none))).unwrap();
    assert!(matches!(store.begin(&record()), Err(StoreError::Full(_))));
    store.leave(record().id);
    store.close();
}
