use axum::{
    extract::{FromRequest, Request as HttpRequest},
    http::{HeaderMap, header},
};

use crate::{
    formats::Format,
    service::{ErrorKind, ServiceError, unknown_format},
};

/// The media type of forms.
const FORM: &str = "multipart/form-data";

/// A request whose body is a form, for the paths that take nothing else.
pub struct FormMessage(pub HttpRequest);

impl<S: Sync> FromRequest<S> for FormMessage {
    type Rejection = ServiceError;

    /// # Errors
    /// The body is none.
    async fn from_request(message: HttpRequest, _: &S) -> Result<Self, ServiceError> {
        if media_type(message.headers()).is_some_and(is_form) {
            return Ok(Self(message));
        }
        Err(malformed(
            "this path takes multipart/form-data, with the parts 'cloud' (a file) and 'parameters' (JSON): send the bare \
             cloud to the path without '/form'",
        ))
    }
}

/// Whether a media type is that of forms.
pub fn is_form(media_type: &str) -> bool {
    let begin = media_type.trim_start().get(..FORM.len());
    begin.is_some_and(|begin| begin.eq_ignore_ascii_case(FORM))
}

/// What the body is said to be.
pub fn media_type(headers: &HeaderMap) -> Option<&str> {
    headers.get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok())
}

/// The format a media type names; `None` for those that any format may travel under.
///
/// # Errors
/// It names something else.
pub fn format_of(media_type: &str) -> Result<Option<Format>, ServiceError> {
    let essence = media_type.split(';').next().unwrap_or_default().trim().to_ascii_lowercase();
    match essence.as_str() {
        // gzip and zstd hold a cloud of any; the one of forms is what curl sends where it is told nothing
        "application/gzip" | "application/x-gzip" | "application/zstd" | "application/x-zstd" => {
            Ok(None)
        }
        "" | "application/octet-stream" | "application/x-www-form-urlencoded" | "text/plain" => {
            Ok(None)
        }
        known => Format::from_media_type(known).map(Some).ok_or_else(|| unknown_format(known)),
    }
}

/// The error for a body that cannot be read.
pub fn malformed(detail: &str) -> ServiceError {
    ServiceError::new(ErrorKind::MalformedBody, detail)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_media_type_of_something_else_is_refused() {
        assert_eq!(format_of("application/octet-stream"), Ok(None));
        assert_eq!(format_of("model/ply; x=1"), Ok(Some(Format::Ply)));
        assert_eq!(format_of("application/x-gzip"), Ok(None));
        assert_eq!(format_of("image/png").unwrap_err().kind, ErrorKind::UnknownFormat);
    }
}
