use axum::{
    http::{HeaderValue, header},
    response::{IntoResponse, Response},
};
use bytes::Bytes;

use crate::service::{REPORT_POLICY, Representation};

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
