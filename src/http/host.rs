use axum::{
    extract::Request,
    http::{Version, header},
    middleware::Next,
    response::{IntoResponse, Response},
};

use crate::service::{ErrorKind, ServiceError};

/// Refuses a request that does not say once which host it is for (RFC 9112, 3.2; RFC 9113, 8.3.1).
pub async fn check(request: Request, next: Next) -> Response {
    match fault(&request) {
        None => next.run(request).await,
        Some(detail) => ServiceError::new(ErrorKind::MalformedRequest, detail).into_response(),
    }
}

fn fault<B>(request: &axum::http::Request<B>) -> Option<&'static str> {
    let hosts = request.headers().get_all(header::HOST).iter().count();
    let named = match request.version() {
        // these know no such header
        Version::HTTP_09 | Version::HTTP_10 => true,
        Version::HTTP_11 => hosts > 0,
        _ => hosts > 0 || request.uri().authority().is_some(),
    };
    match (named, hosts) {
        (_, 2..) => Some("the request has more than one Host header: send one"),
        (false, _) => Some("the request names no host: send the Host header, or :authority"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_names_its_host_once() {
        let told = |version, uri: &str, hosts: &[&str]| {
            let mut request = axum::http::Request::builder().version(version).uri(uri);
            for host in hosts {
                request = request.header("host", *host);
            }
            fault(&request.body(()).unwrap()).is_none()
        };
        assert!(told(Version::HTTP_11, "/docs", &["a"]));
        assert!(!told(Version::HTTP_11, "/docs", &[]));
        assert!(!told(Version::HTTP_11, "/docs", &["a", "a"]));
        // also where the target has one (RFC 9112, 3.2.2)
        assert!(!told(Version::HTTP_11, "http://a/docs", &[]));
        assert!(told(Version::HTTP_10, "/docs", &[]));
        assert!(!told(Version::HTTP_10, "/docs", &["a", "b"]));
        assert!(told(Version::HTTP_2, "http://a/docs", &[]));
        assert!(told(Version::HTTP_2, "/docs", &["a"]));
        assert!(!told(Version::HTTP_2, "/docs", &[]));
    }
}
