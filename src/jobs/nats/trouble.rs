use std::error::Error;

use async_nats::jetstream::{self, ErrorCode};

use crate::jobs::StoreError;

/// What servers say when a stream, an account or a disk is full: "insufficient resources", "account
/// resources exceeded", "insufficient storage", "stream store failed" with its limits.
const FULL: [u64; 6] = [10002, 10023, 10028, 10047, 10077, 10122];

/// The failure of a call. Whatever is neither full nor damaged may pass: the connection, the server that
/// leads, a stream that an operator is about to restore.
pub fn trouble(error: impl Error + 'static) -> StoreError {
    let text = told(&error);
    let full = |code: ErrorCode| FULL.contains(&code.0);
    let mut cause: Option<&(dyn Error + 'static)> = Some(&error);
    while let Some(now) = cause {
        if now.downcast_ref::<jetstream::Error>().is_some_and(|error| full(error.error_code())) {
            return StoreError::Full(text);
        }
        cause = now.source();
    }
    // not every error keeps its cause
    if ["maximum messages exceeded", "maximum bytes exceeded", "insufficient"]
        .iter()
        .any(|sign| text.contains(sign))
    {
        return StoreError::Full(text);
    }
    StoreError::Away(text)
}

/// An error with its causes.
pub fn told(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(now) = cause {
        let more = now.to_string();
        if !text.contains(&more) {
            text = format!("{text}: {more}");
        }
        cause = now.source();
    }
    text
}
