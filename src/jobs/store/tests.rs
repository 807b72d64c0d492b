//! What every store does, whatever it keeps the jobs in.

use std::sync::Arc;

use super::*;
use crate::jobs::{
    DiskStore, Fault, JobState, Nats, NatsConfig, NatsStorage, Submission, nats::NatsServer,
};

/// A store, and what must live as long.
struct Kind {
    name: &'static str,
    store: Arc<dyn Store>,
    _beside: Box<dyn std::any::Any>,
}

/// Settings of a store on a server of its own.
pub fn nats_config(server: &NatsServer) -> NatsConfig {
    NatsConfig {
        servers: vec![server.url().parse().unwrap()],
        credentials: None,
        ca: None,
        certificate: None,
        prefix: "test".to_owned(),
        replicas: 1,
        storage: NatsStorage::File,
        bytes: 64 << 20,
        max_age: std::time::Duration::from_secs(3600),
        ack_wait: std::time::Duration::from_secs(1),
    }
}

/// One of each kind.
fn kinds() -> Vec<Kind> {
    let directory = tempfile::tempdir().unwrap();
    let disk = DiskStore::open(&directory.path().join("jobs.redb"), 1 << 20).unwrap();
    let server = NatsServer::start();
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let nats = runtime.block_on(Nats::connect(nats_config(&server))).unwrap();
    vec![
        Kind { name: "memory", store: Arc::new(MemoryStore::default()), _beside: Box::new(()) },
        Kind { name: "disk", store: Arc::new(disk), _beside: Box::new(directory) },
        Kind { name: "nats", store: nats, _beside: Box::new((runtime, server)) },
    ]
}

fn record(bytes: usize) -> JobRecord {
    JobRecord::new(Submission::default(), bytes as u64)
}

fn bytes(length: usize) -> Bytes {
    (0..length).map(|i| (i * i % 251) as u8).collect::<Vec<_>>().into()
}

#[test]
fn what_is_kept_comes_back_whatever_its_length() {
    for Kind { name, store, .. } in kinds() {
        // around the longest message of a NATS server, and what is put into one
        for length in [0, 1, 512 << 10, (512 << 10) + 1, 1 << 20, 3_000_001] {
            let mut record = record(length);
            store.insert(&record, bytes(length)).unwrap();
            assert_eq!(store.input(record.id).unwrap(), Some(bytes(length)), "{name} {length}");
            assert_eq!(store.result(record.id).unwrap(), None, "{name}");
            store.begin(&record).unwrap();
            (record.state, record.started_ms) = (JobState::Succeeded, Some(5));
            (record.finished_ms, record.result_bytes) = (Some(7), length as u64 + 1);
            store.finish(&record, Some(bytes(length + 1))).unwrap();
            assert_eq!(store.result(record.id).unwrap(), Some(bytes(length + 1)), "{name}");
            let kept = store.records().unwrap();
            let kept = kept.iter().find(|kept| kept.id == record.id).unwrap();
            assert_eq!(
                (kept.state, kept.finished_ms),
                (record.state, record.finished_ms),
                "{name}"
            );
        }
    }
}

#[test]
fn jobs_come_in_the_order_of_acceptance_and_go_when_they_are_forgotten() {
    for Kind { name, store, .. } in kinds() {
        let mut ids = Vec::new();
        for _ in 0..5 {
            let record = record(3);
            store.insert(&record, bytes(3)).unwrap();
            ids.push(record.id);
        }
        let told = |store: &dyn Store| -> Vec<_> {
            store.records().unwrap().iter().map(|record| record.id).collect()
        };
        assert_eq!(told(&*store), ids, "{name}");
        store.remove(ids[1]).unwrap();
        // twice is once
        store.remove(ids[1]).unwrap();
        assert_eq!(store.input(ids[1]).unwrap(), None, "{name}");
        ids.remove(1);
        assert_eq!(told(&*store), ids, "{name}");
        assert_eq!(store.input(Uuid::now_v7()).unwrap(), None, "{name}");
        store.probe().unwrap();
    }
}

#[test]
fn an_end_without_a_result_keeps_its_reason() {
    for Kind { name, store, .. } in kinds() {
        let mut record = record(3);
        store.insert(&record, bytes(3)).unwrap();
        store.begin(&record).unwrap();
        record.state = JobState::Failed;
        record.finished_ms = Some(9);
        record.fault = Some(Fault { code: "code".to_owned(), detail: "why".to_owned() });
        store.finish(&record, None).unwrap();
        let kept = store.records().unwrap();
        assert_eq!((kept[0].state, &kept[0].fault), (JobState::Failed, &record.fault), "{name}");
        assert_eq!(store.result(record.id).unwrap(), None, "{name}");
    }
}
