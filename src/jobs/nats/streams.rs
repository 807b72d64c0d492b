//! The streams and buckets.

use std::time::{Duration, Instant};

use async_nats::jetstream::{
    self, kv,
    stream::{Config, Stream},
};

use super::{config::NatsConfig, trouble::told};

/// A server that starts at the same time is waited for.
pub const LONGEST_START: Duration = Duration::from_secs(30);
/// Pause before it is asked again.
pub const PAUSE: Duration = Duration::from_millis(500);

/// Why jobs cannot be shared over NATS.
#[derive(Debug, thiserror::Error)]
pub enum NatsError {
    /// A file of the settings cannot be read.
    #[error("cannot read {setting} = {path}: {error}")]
    File {
        /// Which one.
        setting: &'static str,
        /// The file.
        path: String,
        /// Why.
        error: std::io::Error,
    },
    /// The settings name two users.
    #[error("{0}: name one alone")]
    TwoLogins(&'static str),
    /// No server lets this process in.
    #[error("cannot connect to NATS at {servers}: {error}; {advice}")]
    Connect {
        /// Their addresses.
        servers: String,
        /// Why.
        error: String,
        /// What to do.
        advice: &'static str,
    },
    /// A stream cannot be made or opened.
    #[error(
        "cannot make or open the NATS stream {stream}: {error}; JetStream must be on, and have room for \
         nats_bytes"
    )]
    Stream {
        /// The stream.
        stream: String,
        /// Why.
        error: String,
    },
    /// A stream is not as the settings say.
    #[error(
        "the NATS stream {stream} has {field} {has} and the settings say {wanted}: give all processes \
         the same settings, take another nats_prefix, or delete the stream when no job is in it"
    )]
    Differs {
        /// The stream.
        stream: String,
        /// Which of its settings.
        field: &'static str,
        /// As it is.
        has: String,
        /// As it is to be.
        wanted: String,
    },
}

/// What jobs are kept in.
pub struct Places {
    pub records: kv::Store,
    pub blobs: Stream,
    pub queue: Stream,
}

/// Makes what is missing, and compares what is there with the settings.
///
/// # Errors
/// A stream cannot be made, or is not as it is to be.
pub async fn make(context: &jetstream::Context, config: &NatsConfig) -> Result<Places, NatsError> {
    let begin = Instant::now();
    for wanted in config.streams() {
        // a cluster that has just started has no leader for a moment
        while let Err(error) = make_stream(context, &wanted).await {
            let may_pass = matches!(error, NatsError::Stream { .. });
            if !may_pass || begin.elapsed() > LONGEST_START {
                return Err(error);
            }
            tokio::time::sleep(PAUSE).await;
        }
    }
    let failed = |stream: String| {
        move |error: &dyn std::error::Error| NatsError::Stream { stream, error: told(error) }
    };
    let records = config.records_bucket();
    let stream = async |name: String| {
        let opened = context.get_stream(&name).await;
        opened.map_err(|error| failed(name)(&error))
    };
    Ok(Places {
        records: context.get_key_value(&records).await.map_err(|error| failed(records)(&error))?,
        blobs: stream(config.blob_stream()).await?,
        queue: stream(config.queue_stream()).await?,
    })
}

async fn make_stream(context: &jetstream::Context, wanted: &Config) -> Result<(), NatsError> {
    let failed = |error: &dyn std::error::Error| NatsError::Stream {
        stream: wanted.name.clone(),
        error: told(error),
    };
    let made = context.get_or_create_stream(wanted.clone()).await;
    let has = made.map_err(|error| failed(&error))?.cached_info().config.clone();
    if difference(wanted, &has).is_none() {
        return Ok(());
    }
    // limits may be changed while the stream is in use
    let changed = Config {
        max_bytes: wanted.max_bytes,
        max_age: wanted.max_age,
        num_replicas: wanted.num_replicas,
        ..has
    };
    let has = context.update_stream(changed).await.map_err(|error| failed(&error))?.config;
    match difference(wanted, &has) {
        None => {
            tracing::info!(stream = wanted.name, "the limits of a NATS stream are changed");
            Ok(())
        }
        Some((field, wanted_is, has)) => {
            Err(NatsError::Differs { stream: wanted.name.clone(), field, has, wanted: wanted_is })
        }
    }
}

/// The first setting in which a stream is not as it is wanted: servers leave out what they do not know,
/// and streams may have been made by others.
fn difference(wanted: &Config, has: &Config) -> Option<(&'static str, String, String)> {
    let texts = |config: &Config| {
        [
            ("subjects", format!("{:?}", config.subjects)),
            ("retention", format!("{:?}", config.retention)),
            ("storage", format!("{:?}", config.storage)),
            ("discard", format!("{:?}", config.discard)),
            ("max_bytes", config.max_bytes.to_string()),
            ("max_age", format!("{} s", config.max_age.as_secs_f64())),
            ("max_msgs_per_subject", config.max_messages_per_subject.to_string()),
            ("num_replicas", config.num_replicas.to_string()),
            ("allow_rollup_hdrs", config.allow_rollup.to_string()),
            ("allow_direct", config.allow_direct.to_string()),
        ]
    };
    let mut pairs = texts(wanted).into_iter().zip(texts(has));
    let (first, second) = pairs.find(|(wanted, has)| wanted != has)?;
    Some((first.0, first.1, second.1))
}
