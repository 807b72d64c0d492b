use std::sync::Arc;

use bytes::Bytes;

use crate::service::Service;

/// What every handler can reach.
#[derive(Clone, Debug)]
pub struct App {
    /// The use cases.
    pub(super) service: Arc<Service>,
    /// The OpenAPI document, as it is sent: every answer shares these bytes.
    pub(super) openapi: Bytes,
}
