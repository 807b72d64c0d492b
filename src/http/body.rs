use axum::{body::BodyDataStream, extract::Request as HttpRequest, http::header};
use futures::StreamExt;

use super::{
    encoding::{Unpacks, broken_off},
    media_type::{format_of, is_form, malformed, media_type},
    meter::Meter,
    multipart::multipart,
};
use crate::{
    jobs::BytesHeld,
    service::{Caller, ParameterForm, Service, ServiceError, Upload},
};

/// Reads the cloud of a request, raw or multipart, and what the body says of the request.
///
/// # Errors
/// There is no room, or the body is too long, too slow, broken or of no known kind, or a parameter in
/// it is wrong.
pub async fn read(
    service: &Service,
    message: HttpRequest,
    request: &mut impl ParameterForm,
) -> Result<Upload, ServiceError> {
    let caller = message.extensions().get::<Caller>().cloned().flatten();
    service.check_room(&caller)?;
    let mut upload = service.upload(service.share());
    upload.held().charge(caller.as_deref())?;
    let window = message.extensions().get::<Unpacks>().map(|_| service.share());
    let reading = async {
        if media_type(message.headers()).is_some_and(is_form) {
            multipart(message, request, &mut upload, window).await
        } else {
            raw(message, request, &mut upload, window).await
        }
    };
    let limit = service.config().upload_timeout;
    let done = tokio::time::timeout(limit, reading).await;
    done.map_err(|_| ServiceError::upload_timeout(limit))?.map(|()| upload)
}

async fn raw(
    message: HttpRequest,
    request: &mut impl ParameterForm,
    upload: &mut Upload,
    window: Option<BytesHeld>,
) -> Result<(), ServiceError> {
    if request.request().format.is_none() {
        request.request().set_format(media_type(message.headers()).map_or(Ok(None), format_of)?);
    }
    let sent_as = media_type(message.headers()).map(str::to_owned);
    let announced = message.headers().get(header::CONTENT_LENGTH);
    let announced = announced.and_then(|length| length.to_str().ok()?.parse().ok());
    upload.announce(announced.unwrap_or(0))?;
    let mut meter = Meter::new(upload.allowance(), window);
    let mut chunks: BodyDataStream = message.into_body().into_data_stream();
    while let Some(chunk) = chunks.next().await {
        let chunk = chunk.map_err(broken_off)?;
        meter.count(chunk.len())?;
        upload.push(&chunk)?;
    }
    if is_unbroken(sent_as.as_deref(), upload.bytes()) {
        return Err(malformed(
            "the body has no line breaks, as 'curl -d' leaves it: send it with --data-binary",
        ));
    }
    Ok(())
}

/// Whether a body is text without any line break, sent as curl sends what it is told nothing of. A cloud
/// of one line has too few points in any case.
fn is_unbroken(media_type: Option<&str>, bytes: &[u8]) -> bool {
    /// The formats with no line break of their own show other bytes by then.
    const HEAD: usize = 96;
    let form = media_type.is_some_and(|t| t.starts_with("application/x-www-form-urlencoded"));
    let printable = |b: &u8| (b' '..=b'~').contains(b) || *b == b'\t';
    form && !bytes.is_empty()
        && bytes.iter().take(HEAD).all(printable)
        && !bytes.iter().any(|b| matches!(b, b'\n' | b'\r'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_that_curl_has_taken_the_line_breaks_from_is_told() {
        let form = "application/x-www-form-urlencoded";
        assert!(is_unbroken(Some(form), b"1 2 34 5 67 8 9"));
        assert!(is_unbroken(Some(form), b"plyformat ascii 1.0element vertex 2"));
        assert!(!is_unbroken(Some(form), b"1 2 3\n4 5 6"));
        assert!(!is_unbroken(Some(form), b"LASF\0\0\0\0"));
        assert!(!is_unbroken(Some(form), b""));
        assert!(!is_unbroken(None, b"1 2 3"));
    }
}
