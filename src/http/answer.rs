use axum::{
    http::{HeaderValue, header},
    response::{IntoResponse, Response},
};
use bytes::Bytes;

use super::app::App;
use crate::{
    jobs::BytesHeld,
    service::{Caller, REPORT_POLICY, Representation, ServiceError},
};

/// A result in one of its forms.
pub fn answered(form: Representation, bytes: Bytes) -> Response {
    let headers = [(header::CONTENT_TYPE, form.media_type()), (header::VARY, "Accept")];
    let mut answer = (headers, bytes).into_response();
    if form == Representation::Html {
        let policy = HeaderValue::from_static(REPORT_POLICY);
        answer.headers_mut().insert(header::CONTENT_SECURITY_POLICY, policy);
    }
    answer
}

/// Takes room in the budget for writing a result in that form, until it is dropped.
///
/// # Errors
/// There is none.
pub fn room_for(
    form: Representation,
    app: &App,
    caller: &Caller,
) -> Result<BytesHeld, ServiceError> {
    let room = app.service.share();
    room.charge(caller.as_deref())?;
    room.grow_to(form.bytes_beside())?;
    Ok(room)
}

/// The bytes of an answer, which hold `held` until they are sent: callers that read slowly take their
/// part of the budget.
pub fn carried(bytes: Vec<u8>, held: &BytesHeld) -> Bytes {
    // the work is done, so an answer that the budget has no room for goes out all the same
    let _ = held.grow_to(bytes.len() as u64);
    held.carried_by(bytes)
}
