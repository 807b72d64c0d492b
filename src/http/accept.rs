use axum::http::{HeaderMap, header};

use crate::service::{ErrorKind, Representation, ServiceError};

/// The representation a caller accepts most; the first of `offered` where it does not say.
///
/// # Errors
/// None of `offered` is acceptable.
pub fn negotiate(
    headers: &HeaderMap,
    offered: &[Representation],
) -> Result<Representation, ServiceError> {
    let values = headers.get_all(header::ACCEPT).iter().filter_map(|value| value.to_str().ok());
    let ranges: Vec<_> = values.flat_map(|value| value.split(',')).filter_map(range).collect();
    let quality = |r: &Representation| if ranges.is_empty() { 1.0 } else { quality(r, &ranges) };
    let best = offered.iter().map(|r| (r, quality(r))).filter(|(_, q)| *q > 0.0);
    // among equals the first offered wins
    let best = best.reduce(|best, next| if next.1 > best.1 { next } else { best });
    best.map(|(r, _)| *r).ok_or_else(|| {
        let names: Vec<_> = offered.iter().map(|r| r.media_type()).collect();
        ServiceError::new(
            ErrorKind::NotAcceptable,
            format!("Accept allows none of {}", names.join(", ")),
        )
    })
}

/// A media range in lower case, and its weight.
fn range(text: &str) -> Option<(String, f64)> {
    let mut parts = text.split(';').map(str::trim);
    let range = parts.next().filter(|range| !range.is_empty())?.to_ascii_lowercase();
    let weight = parts.find_map(|part| part.strip_prefix("q=")?.parse().ok()).unwrap_or(1.0);
    Some((range, weight))
}

/// The weight of the most specific range that covers `representation`.
fn quality(representation: &Representation, ranges: &[(String, f64)]) -> f64 {
    let names = representation.media_types();
    let rank = |range: &str| match range.strip_suffix("/*") {
        Some("*") => Some(1),
        Some(kind) => names.iter().any(|n| n.split('/').next() == Some(kind)).then_some(2),
        None => names.contains(&range).then_some(3),
    };
    let covering = ranges.iter().filter_map(|(range, weight)| Some((rank(range)?, *weight)));
    covering.max_by_key(|(rank, _)| *rank).map_or(0.0, |(_, weight)| weight)
}

#[cfg(test)]
mod tests {
    use super::*;

    const OFFERED: &[Representation] = &[Representation::Json, Representation::Protobuf];

    fn choose(accept: &str) -> Option<Representation> {
        let mut headers = HeaderMap::new();
        headers.insert(header::ACCEPT, accept.parse().unwrap());
        negotiate(&headers, OFFERED).ok()
    }

    #[test]
    fn the_caller_gets_what_it_accepts_most() {
        use Representation::{Json, Protobuf};
        assert_eq!(negotiate(&HeaderMap::new(), OFFERED).unwrap(), Json);
        for (accept, chosen) in [
            ("*/*", Some(Json)),
            ("application/*", Some(Json)),
            ("application/x-protobuf", Some(Protobuf)),
            ("Application/Protobuf", Some(Protobuf)),
            ("application/json;q=0.5, application/x-protobuf", Some(Protobuf)),
            ("application/json;q=0, */*", Some(Protobuf)),
            ("text/html, */*;q=0.1", Some(Json)),
            ("text/html", None),
            ("application/json;q=0", None),
        ] {
            assert_eq!(choose(accept), chosen, "{accept}");
        }
    }
}
