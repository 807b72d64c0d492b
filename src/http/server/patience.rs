use std::time::Duration;

/// How long the service waits for what its callers have to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patience {
    /// For the first whole head of a request, from the moment a connection is accepted.
    pub head: Duration,
    /// For the next request on a connection that has none under way, and for the next byte of a body.
    pub idle: Duration,
    /// For any part of an answer to be taken.
    pub write: Duration,
}
