use axum::{
    Extension,
    extract::{Query, Request as HttpRequest, State, rejection::QueryRejection},
    http::{HeaderMap, header},
    response::{IntoResponse, Response},
};

use bytes::Bytes;

use super::{App, accept, body, jobs};
use crate::{
    jobs::BytesHeld,
    service::{
        Caller, Document, ErrorKind, Representation, Request, ServiceError, is_list, specs,
        unknown_parameter,
    },
};

/// Name and value pairs of a query, in its order.
pub type Pairs = Result<Query<Vec<(String, String)>>, QueryRejection>;

/// Find the quadric surfaces in a cloud
///
/// The cloud is the body, its format named by `format` or `Content-Type` (such as `model/ply`) or told
/// from its bytes; or it is the part `cloud` of a multipart body, whose part `parameters` is a JSON
/// object. A parameter stands once: in the query, or in that object. The body may be compressed
/// (`Content-Encoding: gzip` or `zstd`). A caller that goes away cancels the work.
/// Coordinates may be up to 1e50 in size, and must extend over at least 1e-50.
///
/// With `Prefer: respond-async` the cloud becomes a job that outlives the request. A retried
/// submission with the same `Idempotency-Key` and the same content is the same job; without
/// `respond-async` the key has no effect, for the same request has the same answer.
#[utoipa::path(
    post,
    path = "/v1/segmentations",
    operation_id = "createSegmentation",
    tag = "segmentations",
    responses(
        (status = 200, description = "The surfaces found, in the form that `Accept` asks for", body = Document),
        (status = 202, description = "The job", body = jobs::JobDocument),
    ),
)]
pub async fn create(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    query: Pairs,
    message: HttpRequest,
) -> Result<Response, ServiceError> {
    let mut request = from_query(query)?;
    let (later, key) = (respond_async(message.headers()), idempotency_key(message.headers())?);
    let form = accept::negotiate(message.headers(), Representation::ALL);
    // a job's result is negotiated when it is fetched
    let form = if later { form.unwrap_or(Representation::Json) } else { form? };
    let upload = body::read(&app.service, message, &mut request).await?;
    if later {
        let (job, _) = app.service.submit(caller, key, upload, request).await?;
        return Ok(jobs::accepted(job.view()));
    }
    let held = upload.held().clone();
    let write = move |answer, labels| form.render(answer, labels);
    let bytes = app.service.segment(upload, request, write).await?;
    Ok(answered(form, carried(bytes, &held)))
}

/// The bytes of an answer, which hold `held` until they are sent: callers that read slowly take their
/// part of the budget.
pub fn carried(bytes: Vec<u8>, held: &BytesHeld) -> Bytes {
    // the work is done, so an answer that the budget has no room for goes out all the same
    let _ = held.grow_to(bytes.len() as u64);
    held.carried_by(bytes)
}

/// Whether the caller prefers a job (RFC 7240).
fn respond_async(headers: &HeaderMap) -> bool {
    let values = headers.get_all("prefer").iter().filter_map(|value| value.to_str().ok());
    let mut preferences = values.flat_map(|value| value.split([',', ';'])).map(str::trim);
    preferences.any(|preference| preference.eq_ignore_ascii_case("respond-async"))
}

fn idempotency_key(headers: &HeaderMap) -> Result<Option<String>, ServiceError> {
    let Some(value) = headers.get("idempotency-key") else { return Ok(None) };
    let text = value.to_str().map_err(|_| {
        ServiceError::new(ErrorKind::InvalidParameter, "Idempotency-Key is not visible ASCII")
    })?;
    Ok(Some(text.to_owned()))
}

/// A result in one of its forms.
pub fn answered(form: Representation, bytes: Bytes) -> Response {
    let headers = [(header::CONTENT_TYPE, form.media_type()), (header::VARY, "Accept")];
    (headers, bytes).into_response()
}

/// The request in a query. Lists may be written `a,b,c` or by repeating their name; nothing else may
/// stand twice.
///
/// # Errors
/// The query cannot be read, or a parameter in it is unknown, wrong or there twice.
pub fn from_query(query: Pairs) -> Result<Request, ServiceError> {
    let invalid = |detail| ServiceError::new(ErrorKind::InvalidParameter, detail);
    let Query(pairs) = query.map_err(|e| invalid(format!("the query cannot be read: {e}")))?;
    let mut given: Vec<(String, String)> = Vec::new();
    for (name, value) in pairs {
        // at once: so there are never more names than those there are
        let Some(spec) = specs().find(|spec| spec.name == name) else {
            return Err(unknown_parameter(&name));
        };
        let is_list = || is_list(spec);
        match given.iter_mut().find(|(known, _)| *known == name) {
            None => given.push((name, value)),
            Some((_, list)) if is_list() => *list = format!("{list},{value}"),
            Some(_) => return Err(invalid(format!("parameter '{name}' stands more than once"))),
        }
    }
    Request::from_pairs(given.iter().map(|(name, value)| (name.as_str(), value.as_str())))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn query(pairs: &[(&str, &str)]) -> Result<Request, ErrorKind> {
        let pairs = pairs.iter().map(|(n, v)| ((*n).to_owned(), (*v).to_owned())).collect();
        from_query(Ok(Query(pairs))).map_err(|error| error.kind)
    }

    #[test]
    fn lists_are_repeated_or_written_with_commas() {
        let repeated = query(&[("surfaces", "plane"), ("seed", "1"), ("surfaces", "cone")]);
        assert_eq!(repeated, query(&[("surfaces", "plane,cone"), ("seed", "1")]));
        let direction = [("axis_direction", "0"), ("axis_direction", "0"), ("axis_direction", "1")];
        assert_eq!(query(&direction).unwrap().parameters.axis_direction, Some([0.0, 0.0, 1.0]));
        let twice = query(&[("seed", "1"), ("seed", "1")]);
        assert_eq!(twice, Err(ErrorKind::InvalidParameter));
    }

    #[test]
    fn a_name_that_is_unknown_is_refused_when_it_is_met() {
        // and not looked for among thousands of others
        let unknown = query(&[("a", "1"), ("a", "1"), ("seed", "x")]);
        assert_eq!(unknown, Err(ErrorKind::UnknownParameter));
    }
}
