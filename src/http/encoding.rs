use axum::{
    extract::Request,
    http::{HeaderValue, header},
};

/// Marks a request whose body is unpacked by zstd, which keeps a window of what it has unpacked.
#[derive(Clone, Copy, Debug)]
pub struct Unpacks;

/// Writes the request's Content-Encoding as the layer that unpacks bodies compares it: names of codings
/// know no case, and `x-gzip` is `gzip` (RFC 9110, 8.4.1).
pub async fn in_lower_case(mut request: Request) -> Request {
    if let Some(value) = request.headers_mut().get_mut(header::CONTENT_ENCODING) {
        let lower = value.as_bytes().trim_ascii().to_ascii_lowercase();
        let zstd = lower == b"zstd";
        let lower = if lower == b"x-gzip" { b"gzip".to_vec() } else { lower };
        if let Ok(lower) = HeaderValue::from_bytes(&lower) {
            *value = lower;
        }
        if zstd {
            request.extensions_mut().insert(Unpacks);
        }
    }
    request
}
