use axum::{
    http::header,
    response::{IntoResponse, Response},
};
use bytes::Bytes;

use crate::{jobs::BytesHeld, service::Representation};

/// A result in one of its forms.
pub fn answered(form: Representation, bytes: Bytes) -> Response {
    let headers = [(header::CONTENT_TYPE, form.media_type()), (header::VARY, "Accept")];
    (headers, bytes).into_response()
}

/// The bytes of an answer, which hold `held` until they are sent: callers that read slowly take their
/// part of the budget.
pub fn carried(bytes: Vec<u8>, held: &BytesHeld) -> Bytes {
    // the work is done, so an answer that the budget has no room for goes out all the same
    let _ = held.grow_to(bytes.len() as u64);
    held.carried_by(bytes)
}
