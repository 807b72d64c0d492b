//! Clouds and results, each written once under a name that says what is in it.
//!
//! They are messages of a stream, one a part, and not an object store: its readers hang on consumers, which
//! servers of the 2.9 line leave standing while others write.

use std::fmt;

use async_nats::{
    HeaderMap,
    jetstream::{
        self,
        context::PublishErrorKind,
        stream::{DirectGetErrorKind, LastRawMessageErrorKind, Stream},
    },
};
use bytes::Bytes;
use futures::{StreamExt, TryStreamExt, stream};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use uuid::Uuid;

use super::trouble::trouble;
use crate::jobs::StoreError;

/// Longest part: half of the servers' usual limit of a message, 1 MiB.
const PART_BYTES: usize = 512 << 10;
/// Parts on their way at one time.
const PARTS_AT_ONCE: usize = 4;

/// Where a blob is, and what is in it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Blob {
    /// Its name: the job, the part, and the start of its digest.
    pub name: String,
    /// Its SHA-256, as hexadecimal digits.
    pub digest: String,
    /// Its length.
    pub bytes: u64,
}

impl Blob {
    /// How `bytes` are kept as a part of a job.
    pub fn of(id: Uuid, part: &str, bytes: &[u8]) -> Self {
        let digest: String =
            Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        Self { name: format!("{id}.{part}.{}", &digest[..16]), digest, bytes: bytes.len() as u64 }
    }

    /// How many messages it takes; one where it is empty.
    fn parts(&self) -> u64 {
        self.bytes.div_ceil(PART_BYTES as u64).max(1)
    }

    fn holds(&self, bytes: &[u8]) -> bool {
        bytes.len() as u64 == self.bytes && Self::of(Uuid::nil(), "", bytes).digest == self.digest
    }
}

/// The stream of blobs.
#[derive(Clone)]
pub struct Blobs {
    context: jetstream::Context,
    stream: Stream,
    // what their subjects begin with
    prefix: String,
}

impl fmt::Debug for Blobs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Blobs").field("prefix", &self.prefix).finish_non_exhaustive()
    }
}

impl Blobs {
    /// The blobs in a stream, under subjects that begin so.
    pub fn new(context: jetstream::Context, stream: Stream, prefix: String) -> Self {
        Self { context, stream, prefix }
    }

    fn subject(&self, blob: &Blob, part: &str) -> String {
        format!("{}.{}.{part}", self.prefix, blob.name)
    }

    /// Keeps a part of a job. One that is there already has the same content, by its name.
    ///
    /// # Errors
    /// The servers are away or full.
    pub async fn put(&self, id: Uuid, part: &str, bytes: &Bytes) -> Result<Blob, StoreError> {
        let blob = Blob::of(id, part, bytes);
        let puts = (0..blob.parts()).map(|i| {
            let from = i as usize * PART_BYTES;
            let part = bytes.slice(from..bytes.len().min(from + PART_BYTES));
            self.put_part(self.subject(&blob, &i.to_string()), part)
        });
        let put = stream::iter(puts).buffer_unordered(PARTS_AT_ONCE).try_collect::<()>().await;
        if let Err(StoreError::Full(_)) = &put {
            // its first parts would take the room until they expire
            self.delete(&blob).await?;
        }
        put.map(|()| blob)
    }

    async fn put_part(&self, subject: String, part: Bytes) -> Result<(), StoreError> {
        let mut headers = HeaderMap::new();
        // written once, never over
        headers.insert("Nats-Expected-Last-Subject-Sequence", "0");
        let put = self.context.publish_with_headers(subject, headers, part).await;
        match put.map_err(trouble)?.await {
            Ok(_) => Ok(()),
            Err(error) if error.kind() == PublishErrorKind::WrongLastSequence => Ok(()),
            Err(error) => Err(trouble(error)),
        }
    }

    /// What a blob holds; nothing where it is not there, or not whole.
    ///
    /// # Errors
    /// The servers are away, or what is kept is not what was written.
    pub async fn get(
        &self,
        id: Uuid,
        part: &'static str,
        blob: &Blob,
    ) -> Result<Option<Bytes>, StoreError> {
        let gets = (0..blob.parts()).map(|i| self.get_part(self.subject(blob, &i.to_string())));
        let mut parts = stream::iter(gets).buffered(PARTS_AT_ONCE);
        let mut bytes = Vec::new();
        while let Some(found) = parts.next().await {
            let Some(found) = found? else { return Ok(None) };
            if blob.parts() == 1 {
                bytes = found.into();
            } else {
                let whole = usize::try_from(blob.bytes).unwrap_or_default();
                bytes.reserve_exact(whole.saturating_sub(bytes.len()));
                bytes.extend_from_slice(&found);
            }
        }
        let bytes = Bytes::from(bytes);
        if blob.holds(&bytes) { Ok(Some(bytes)) } else { Err(StoreError::Damaged { part, id }) }
    }

    /// Whether a blob is there.
    ///
    /// # Errors
    /// The servers are away.
    pub async fn has(&self, blob: &Blob) -> Result<bool, StoreError> {
        Ok(self.get_part(self.subject(blob, "0")).await?.is_some())
    }

    async fn get_part(&self, subject: String) -> Result<Option<Bytes>, StoreError> {
        match self.stream.direct_get_last_for_subject(&subject).await {
            Ok(message) => return Ok(Some(message.payload)),
            Err(error) if error.kind() == DirectGetErrorKind::NotFound => {}
            Err(error) => return Err(trouble(error)),
        }
        // a copy may be behind: the leader knows
        match self.stream.get_last_raw_message_by_subject(&subject).await {
            Ok(message) => Ok(Some(message.payload)),
            Err(error) if error.kind() == LastRawMessageErrorKind::NoMessageFound => Ok(None),
            Err(error) => Err(trouble(error)),
        }
    }

    /// Forgets all blobs of a job.
    ///
    /// # Errors
    /// The servers are away.
    pub async fn delete_all(&self, id: Uuid) -> Result<(), StoreError> {
        let subjects = format!("{}.{id}.>", self.prefix);
        self.stream.purge().filter(subjects).await.map(drop).map_err(trouble)
    }

    /// Forgets a blob, if it is there.
    ///
    /// # Errors
    /// The servers are away.
    pub async fn delete(&self, blob: &Blob) -> Result<(), StoreError> {
        self.stream.purge().filter(self.subject(blob, "*")).await.map(drop).map_err(trouble)
    }
}
