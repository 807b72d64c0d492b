use axum::{
    body::BodyDataStream,
    extract::{FromRequest, Multipart, Request as HttpRequest, multipart::Field},
    http::{HeaderMap, header},
};
use futures::StreamExt;
use serde_json::Value;

use super::{
    encoding::Unpacks,
    form::Pairs,
    meter::{Meter, metered},
};

use crate::{
    formats::Format,
    jobs::BytesHeld,
    service::{Caller, ErrorKind, Request, Service, ServiceError, Upload, unknown_format},
};

/// Longest `parameters` part of a multipart request.
const MAX_PARAMETERS_BYTES: usize = 64 * 1024;

/// Reads the cloud of a request, raw or multipart, and what the body says of the request.
///
/// # Errors
/// There is no room, or the body is too long, too slow, broken or of no known kind, or a parameter in
/// it is wrong.
pub async fn read(
    service: &Service,
    message: HttpRequest,
    request: &mut Request,
) -> Result<Upload, ServiceError> {
    let caller = message.extensions().get::<Caller>().cloned().flatten();
    service.check_room(&caller)?;
    let mut upload = service.upload(service.share());
    upload.held().charge(caller.as_deref())?;
    let window = message.extensions().get::<Unpacks>().map(|_| service.share());
    let reading = async {
        if media_type(message.headers()).is_some_and(|t| t.starts_with("multipart/form-data")) {
            multipart(message, request, &mut upload, window).await
        } else {
            raw(message, request, &mut upload, window).await
        }
    };
    let limit = service.config().upload_timeout;
    let done = tokio::time::timeout(limit, reading).await;
    done.map_err(|_| ServiceError::upload_timeout(limit))?.map(|()| upload)
}

fn media_type(headers: &HeaderMap) -> Option<&str> {
    headers.get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok())
}

async fn raw(
    message: HttpRequest,
    request: &mut Request,
    upload: &mut Upload,
    window: Option<BytesHeld>,
) -> Result<(), ServiceError> {
    if request.format.is_none() {
        request.set_format(media_type(message.headers()).map_or(Ok(None), format_of)?);
    }
    let sent_as = media_type(message.headers()).map(str::to_owned);
    let announced = message.headers().get(header::CONTENT_LENGTH);
    let announced = announced.and_then(|length| length.to_str().ok()?.parse().ok());
    upload.announce(announced.unwrap_or(0))?;
    let mut meter = Meter::new(upload.allowance(), window);
    let mut chunks: BodyDataStream = message.into_body().into_data_stream();
    while let Some(chunk) = chunks.next().await {
        let chunk = chunk.map_err(|e| malformed(&format!("the body broke off: {e}")))?;
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

/// The format a media type names; `None` for those that any format may travel under.
fn format_of(media_type: &str) -> Result<Option<Format>, ServiceError> {
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

async fn multipart(
    message: HttpRequest,
    request: &mut Request,
    upload: &mut Upload,
    window: Option<BytesHeld>,
) -> Result<(), ServiceError> {
    let announced = message.headers().get(header::CONTENT_LENGTH);
    let announced = announced.and_then(|length| length.to_str().ok()?.parse().ok());
    upload.allowance().check(announced.unwrap_or(0))?;
    let (message, gauge) = metered(message, Meter::new(upload.allowance(), window));
    let broken = |e: &dyn std::fmt::Display| {
        gauge.refused().unwrap_or_else(|| malformed(&format!("the multipart body is broken: {e}")))
    };
    let mut parts = Multipart::from_request(message, &()).await.map_err(|e| broken(&e))?;
    // a parameter stands once, here or in the query
    let mut given: Vec<String> = request.given.iter().map(|(name, _)| name.clone()).collect();
    let mut clouds = 0;
    while let Some(mut part) = parts.next_field().await.map_err(|e| broken(&e))? {
        gauge.used();
        match part.name() {
            Some("cloud") => {
                clouds += 1;
                if request.format.is_none() {
                    request.set_format(format_of_part(&part)?);
                }
                while let Some(chunk) = part.chunk().await.map_err(|e| broken(&e))? {
                    gauge.used();
                    upload.push(&chunk)?;
                }
            }
            Some("parameters") => {
                let mut text = Vec::new();
                while let Some(chunk) = part.chunk().await.map_err(|e| broken(&e))? {
                    gauge.used();
                    text.extend_from_slice(&chunk);
                    if text.len() > MAX_PARAMETERS_BYTES {
                        return Err(malformed("'parameters' has more than 64 KiB"));
                    }
                }
                parameters(&text, &mut given, request)?;
            }
            other => {
                let name = other.unwrap_or_default();
                return Err(malformed(&format!(
                    "unknown part '{name}': send 'cloud' (a file) and 'parameters' (JSON)"
                )));
            }
        }
    }
    match clouds {
        1 => Ok(()),
        0 => Err(ServiceError::new(ErrorKind::EmptyBody, "the part 'cloud' is missing")),
        _ => Err(malformed("there is more than one part 'cloud'")),
    }
}

/// The format by the part's file name, or by its media type.
fn format_of_part(part: &Field<'_>) -> Result<Option<Format>, ServiceError> {
    let by_name =
        part.file_name().and_then(|name| Format::from_extension(name.rsplit_once('.')?.1));
    by_name.map_or_else(|| part.content_type().map_or(Ok(None), format_of), |f| Ok(Some(f)))
}

/// Sets the parameters of a JSON object; lists are given as arrays or as in a query. None may be among
/// those `given` already.
fn parameters(
    text: &[u8],
    given: &mut Vec<String>,
    request: &mut Request,
) -> Result<(), ServiceError> {
    let Pairs(pairs) = serde_json::from_slice(text)
        .map_err(|e| malformed(&format!("'parameters' is not a JSON object: {e}")))?;
    for (name, value) in pairs {
        let Some(text) = as_text(&value) else { continue };
        if given.contains(&name) {
            return Err(ServiceError::new(
                ErrorKind::InvalidParameter,
                format!(
                    "parameter '{name}' stands more than once, in the query or in 'parameters'"
                ),
            ));
        }
        request.set(&name, &text)?;
        given.push(name);
    }
    Ok(())
}

fn as_text(value: &Value) -> Option<String> {
    match value {
        Value::Null => None,
        Value::String(text) => Some(text.clone()),
        // 5.0 is the whole number 5 to JSON; above 2^53 that is no longer exact
        Value::Number(number) => match number.as_f64() {
            Some(x) if number.is_f64() && x.fract() == 0.0 && x.abs() < 9e15 => {
                Some(format!("{x:.0}"))
            }
            _ => Some(number.to_string()),
        },
        Value::Array(items) => Some(items.iter().filter_map(as_text).collect::<Vec<_>>().join(",")),
        other => Some(other.to_string()),
    }
}

fn malformed(detail: &str) -> ServiceError {
    ServiceError::new(ErrorKind::MalformedBody, detail)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_parameters_are_set_like_those_of_a_query() {
        let mut request = Request::default();
        let json =
            br#"{"surfaces": ["plane", "cone"], "seed": 7.0, "merge": false, "tolerance": null,
            "axis_direction": [0, 0.5, 1e-3]}"#;
        parameters(json, &mut Vec::new(), &mut request).unwrap();
        let query = [
            ("surfaces", "plane,cone"),
            ("seed", "7"),
            ("merge", "false"),
            ("axis_direction", "0,0.5,0.001"),
        ];
        assert_eq!(request.parameters, Request::from_pairs(query).unwrap().parameters);
    }

    #[test]
    fn a_parameter_that_stands_twice_is_refused() {
        let set = |given: &[&str], json: &str| {
            let mut given = given.iter().map(|name| (*name).to_owned()).collect();
            parameters(json.as_bytes(), &mut given, &mut Request::default()).map_err(|e| e.kind)
        };
        let refused = Err(ErrorKind::InvalidParameter);
        assert_eq!(set(&["seed"], r#"{"seed": 1}"#), refused);
        assert_eq!(set(&[], r#"{"seed": 1, "seed": 1}"#), refused);
        assert_eq!(set(&["seed"], r#"{"seed": null, "min_points": 60}"#), Ok(()));
    }

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

    #[test]
    fn a_media_type_of_something_else_is_refused() {
        assert_eq!(format_of("application/octet-stream"), Ok(None));
        assert_eq!(format_of("model/ply; x=1"), Ok(Some(Format::Ply)));
        assert_eq!(format_of("application/x-gzip"), Ok(None));
        assert_eq!(format_of("image/png").unwrap_err().kind, ErrorKind::UnknownFormat);
    }
}
