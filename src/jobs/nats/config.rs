use std::{path::PathBuf, time::Duration};

use async_nats::{
    HeaderMap, ServerAddr,
    jetstream::{consumer::pull, stream},
};

/// Where the streams keep what they hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NatsStorage {
    /// On the servers' disks.
    File,
    /// In the servers' memory; a server that ends forgets its copy.
    Memory,
}

/// Which NATS servers the jobs are shared over, and how.
#[derive(Clone, Debug)]
pub struct NatsConfig {
    /// The servers, any of which tells of the others; the user that this process is, or a token, may stand in
    /// an address.
    pub servers: Vec<ServerAddr>,
    /// File with a JWT and its key, as `nsc` makes it.
    pub credentials: Option<PathBuf>,
    /// Authority of the servers' certificates, in PEM; the system's when absent.
    pub ca: Option<PathBuf>,
    /// Certificate and key shown to the servers, in PEM.
    pub certificate: Option<(PathBuf, PathBuf)>,
    /// What the names of streams and subjects begin with.
    pub prefix: String,
    /// Servers that keep a copy of everything.
    pub replicas: usize,
    /// Where they keep it.
    pub storage: NatsStorage,
    /// Most bytes of clouds and results kept.
    pub bytes: u64,
    /// Longest time anything is kept, whatever has become of it.
    pub max_age: Duration,
    /// A job whose worker says nothing for so long is given to another.
    pub ack_wait: Duration,
}

impl NatsConfig {
    /// The bucket of the records.
    pub(super) fn records_bucket(&self) -> String {
        format!("{}_jobs", self.prefix)
    }

    /// The stream of clouds and results.
    pub(super) fn blob_stream(&self) -> String {
        format!("{}_blobs", self.prefix)
    }

    /// What the subjects of clouds and results begin with.
    pub(super) fn blob_prefix(&self) -> String {
        format!("{}.blob", self.prefix)
    }

    /// The stream of the jobs that wait for a worker.
    pub(super) fn queue_stream(&self) -> String {
        format!("{}_queue", self.prefix)
    }

    /// The subject of a job, or of all (`*`), in the queue of a lane.
    pub(super) fn queue_subject(&self, lane: &str, id: &str) -> String {
        format!("{}.queue.{lane}.{id}", self.prefix)
    }

    /// The subject of a job's progress, or of all.
    pub(super) fn progress_subject(&self, id: &str) -> String {
        format!("{}.progress.{id}", self.prefix)
    }

    /// The subject by which a worker says what it runs.
    pub(super) fn runs_subject(&self, worker: &str) -> String {
        format!("{}.runs.{worker}", self.prefix)
    }

    /// The subject by which the process that runs a job is told what has come of its parts.
    pub(super) fn parts_subject(&self, job: &str) -> String {
        format!("{}.parts.{job}", self.prefix)
    }

    /// The streams: records, blobs and queue.
    pub(super) fn streams(&self) -> [stream::Config; 3] {
        let storage = match self.storage {
            NatsStorage::File => stream::StorageType::File,
            NatsStorage::Memory => stream::StorageType::Memory,
        };
        let common = stream::Config {
            num_replicas: self.replicas,
            storage,
            max_age: self.max_age,
            // unlimited is written so by the servers. Records and queue must never be full, or accepted jobs
            // could not go on: what waits is bounded by `queue`, what is kept by blobs and `result_bytes`
            max_bytes: -1,
            max_messages: -1,
            max_messages_per_subject: -1,
            max_consumers: -1,
            max_message_size: -1,
            discard: stream::DiscardPolicy::New,
            ..stream::Config::default()
        };
        let records = self.records_bucket();
        [
            // as the client's own buckets are, which it cannot make on servers before 2.10, but that the marks of
            // forgotten jobs can be taken away. It is read from the leader alone: a record that is behind is no
            // base for a change
            stream::Config {
                subjects: vec![format!("$KV.{records}.>")],
                name: format!("KV_{records}"),
                max_messages_per_subject: 1,
                allow_rollup: true,
                ..common.clone()
            },
            stream::Config {
                subjects: vec![format!("{}.>", self.blob_prefix())],
                name: self.blob_stream(),
                max_bytes: i64::try_from(self.bytes).unwrap_or(i64::MAX),
                max_messages_per_subject: 1,
                allow_direct: true,
                ..common.clone()
            },
            stream::Config {
                subjects: vec![self.queue_subject("*", "*")],
                name: self.queue_stream(),
                retention: stream::RetentionPolicy::WorkQueue,
                ..common
            },
        ]
    }

    /// What hands out the jobs of one lane; one filter each, since servers before 2.10 drop several
    /// without a word.
    pub(super) fn consumer(&self, lane: &str) -> pull::Config {
        pull::Config {
            durable_name: Some(lane.to_owned()),
            filter_subject: self.queue_subject(lane, "*"),
            ack_wait: self.ack_wait,
            // a job that ends its workers is told by its record
            max_deliver: -1,
            max_ack_pending: -1,
            ..pull::Config::default()
        }
    }

    /// The name of a message in the queue: a further attempt must not be taken for the first one.
    pub(super) fn attempt(id: &str, attempt: u64) -> HeaderMap {
        let mut headers = HeaderMap::new();
        headers.insert("Nats-Msg-Id", format!("{id}-{attempt}"));
        headers
    }
}
