//! The queue of the jobs that wait for a worker.

use std::{fmt, sync::Arc, time::Duration};

use async_nats::jetstream::{
    self, AckKind,
    consumer::{Consumer, pull},
    message::Acker,
    stream::{LastRawMessageErrorKind, Stream},
};
use bytes::Bytes;
use futures::StreamExt;
use tokio_util::task::AbortOnDropHandle;
use uuid::Uuid;

use super::{config::NatsConfig, task::Task, trouble::trouble};
use crate::jobs::{Lane, StoreError};

/// A worker asks anew for a job after this time, so that it can end meanwhile.
const ASKING_TIME: Duration = Duration::from_secs(1);

/// The queue.
#[derive(Clone, Debug)]
pub struct Queue {
    config: NatsConfig,
    context: jetstream::Context,
    stream: Stream,
}

/// A job, or a part of one, that was handed to this worker.
pub struct Delivery {
    what: Bytes,
    /// How often it was handed out, this time counted.
    pub times: u64,
    acker: Arc<Acker>,
    ack_wait: Duration,
}

impl fmt::Debug for Delivery {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, times, .. } = self;
        f.debug_struct("Delivery").field("what", what).field("times", times).finish_non_exhaustive()
    }
}

impl Queue {
    /// The queue in its stream.
    pub fn new(config: NatsConfig, context: jetstream::Context, stream: Stream) -> Self {
        Self { config, context, stream }
    }

    /// The stream.
    pub fn stream(&self) -> &Stream {
        &self.stream
    }

    /// Puts a job into the queue, for the `attempt`-th time.
    ///
    /// # Errors
    /// The servers are away or full.
    pub async fn put(&self, lane: Lane, id: Uuid, attempt: u64) -> Result<(), StoreError> {
        let id = id.to_string();
        self.put_named(lane.name(), &id, id.clone().into(), attempt).await
    }

    /// Puts what has that `name` into the queue of a lane, for the `attempt`-th time.
    ///
    /// # Errors
    /// As [`Self::put`].
    pub async fn put_named(
        &self,
        lane: &str,
        name: &str,
        what: Bytes,
        attempt: u64,
    ) -> Result<(), StoreError> {
        let (subject, headers) =
            (self.config.queue_subject(lane, name), NatsConfig::attempt(name, attempt));
        let put = self.context.publish_with_headers(subject, headers, what).await;
        put.map_err(trouble)?.await.map(drop).map_err(trouble)
    }

    /// Whether a job is in the queue, or in the hands of a worker.
    ///
    /// # Errors
    /// The servers are away.
    pub async fn has(&self, lane: Lane, id: Uuid) -> Result<bool, StoreError> {
        self.has_named(lane.name(), &id.to_string()).await
    }

    /// The same of what has that `name`.
    ///
    /// # Errors
    /// The servers are away.
    pub async fn has_named(&self, lane: &str, name: &str) -> Result<bool, StoreError> {
        let subject = self.config.queue_subject(lane, name);
        match self.stream.get_last_raw_message_by_subject(&subject).await {
            Ok(_) => Ok(true),
            Err(error) if error.kind() == LastRawMessageErrorKind::NoMessageFound => Ok(false),
            Err(error) => Err(trouble(error)),
        }
    }

    /// What hands out the jobs of a lane.
    ///
    /// # Errors
    /// The servers are away.
    pub async fn consumer(&self, lane: &str) -> Result<Consumer<pull::Config>, StoreError> {
        let wanted = self.config.consumer(lane);
        let made = self.stream.get_or_create_consumer(lane, wanted.clone()).await;
        let made = made.map_err(trouble)?;
        if made.cached_info().config.ack_wait != wanted.ack_wait {
            return self.stream.create_consumer(wanted).await.map_err(trouble);
        }
        Ok(made)
    }

    /// Takes away what hands out the jobs of a lane, so that it is made anew. A job that is handed out twice
    /// by this is told by its record.
    ///
    /// # Errors
    /// The servers are away.
    pub async fn drop_consumer(&self, lane: &str) -> Result<(), StoreError> {
        self.stream.delete_consumer(lane).await.map(drop).map_err(trouble)
    }

    /// The next message that `consumer` hands out; nothing where none comes within a second.
    ///
    /// # Errors
    /// The servers are away.
    pub async fn next(
        &self,
        consumer: &Consumer<pull::Config>,
    ) -> Result<Option<Delivery>, StoreError> {
        let asked = consumer.batch().max_messages(1).expires(ASKING_TIME).messages().await;
        let mut messages = asked.map_err(trouble)?;
        let Some(message) = messages.next().await else { return Ok(None) };
        let message = message.map_err(|error| StoreError::Away(error.to_string()))?;
        let times = message.info().map_or(1, |info| u64::try_from(info.delivered).unwrap_or(1));
        let (message, acker) = message.split();
        let (acker, ack_wait) = (Arc::new(acker), self.config.ack_wait);
        Ok(Some(Delivery { what: message.payload, times, acker, ack_wait }))
    }
}

impl Delivery {
    /// The job; nothing where it is no message of ours.
    pub fn job(&self) -> Option<Uuid> {
        std::str::from_utf8(&self.what).ok()?.parse().ok()
    }

    /// The part of a job; nothing where it is no message of ours.
    pub fn task(&self) -> Option<Task> {
        serde_json::from_slice(&self.what).ok()
    }

    /// Nobody can do anything with it.
    pub async fn refuse(self) {
        // one that is lost brings it to another worker, which says the same
        let _ = self.acker.ack_with(AckKind::Term).await;
    }

    /// Says that the job is worked on, again and again until what is returned is dropped.
    pub fn keep(&self) -> AbortOnDropHandle<()> {
        let (acker, pause) = (Arc::clone(&self.acker), self.ack_wait / 3);
        AbortOnDropHandle::new(tokio::spawn(async move {
            loop {
                // where the servers are away the next one may reach them
                let _ = acker.ack_with(AckKind::Progress).await;
                tokio::time::sleep(pause).await;
            }
        }))
    }

    /// The job has ended and is to be handed to nobody else.
    pub async fn done(self) {
        // one that is lost brings the job to a worker once more, which sees that it has ended
        let _ = self.acker.ack().await;
    }

    /// The job is to be handed out again, after `pause`.
    pub async fn later(self, pause: Duration) {
        // one that is lost does the same after ack_wait
        let _ = self.acker.ack_with(AckKind::Nak(Some(pause))).await;
    }
}
