use std::error::Error;

use axum::{
    extract::{FromRequest, Multipart, Request as HttpRequest, multipart::Field},
    http::header,
};
use serde_json::Value;

use super::{
    form::Pairs,
    media_type::{format_of, malformed},
    meter::{Gauge, Meter, metered},
};
use crate::{
    formats::Format,
    jobs::BytesHeld,
    segment::ParameterSpec,
    service::{self, ErrorKind, ParameterForm, ServiceError, Upload},
};

/// Longest `parameters` part of a multipart request.
const MAX_PARAMETERS_BYTES: usize = 64 * 1024;

/// Reads the cloud of a form, and its parameters.
///
/// # Errors
/// The form is broken or has other parts, the cloud is too long, or a parameter is wrong.
pub async fn multipart(
    message: HttpRequest,
    request: &mut impl ParameterForm,
    upload: &mut Upload,
    window: Option<BytesHeld>,
) -> Result<(), ServiceError> {
    let announced = message.headers().get(header::CONTENT_LENGTH);
    let announced = announced.and_then(|length| length.to_str().ok()?.parse().ok());
    upload.allowance().check(announced.unwrap_or(0))?;
    let (message, gauge) = metered(message, Meter::new(upload.allowance(), window));
    let broken = |e: &dyn Error| {
        // what is wrong stands in the source, where there is one
        let why = e.source().map_or_else(|| e.to_string(), ToString::to_string);
        gauge.refused().unwrap_or_else(|| {
            malformed(&format!(
                "the multipart body is broken: {why}. Send it as 'curl -F cloud=@part.ply' does, each part behind a line \
                 with the boundary of Content-Type; a cloud alone is the body, with no such Content-Type"
            ))
        })
    };
    let mut parts = Multipart::from_request(message, &()).await.map_err(|e| broken(&e))?;
    // a parameter has one value, in the query, in a part of its own and in 'parameters'; the format that a file's name
    // tells is no such value
    let mut stated = request.request().given.clone();
    let (mut clouds, mut texts, mut flat) = (0, 0, Vec::new());
    while let Some(mut part) = parts.next_field().await.map_err(|e| broken(&e))? {
        gauge.used();
        let spec = part.name().and_then(|name| request.spec(name));
        match (part.name(), spec) {
            (Some("cloud"), _) => {
                clouds += 1;
                if request.request().format.is_none() {
                    request.request().set_format(format_of_part(&part)?);
                }
                while let Some(chunk) = part.chunk().await.map_err(|e| broken(&e))? {
                    gauge.used();
                    upload.push(&chunk)?;
                }
            }
            (Some("parameters"), _) => {
                let text = text_of(&mut part, &gauge, &mut texts, &broken).await?;
                parameters(&text, request, &mut stated)?;
            }
            (_, Some(spec)) => {
                let text = text_of(&mut part, &gauge, &mut texts, &broken).await?;
                join(&mut flat, spec, &text)?;
            }
            (other, None) => {
                let name = other.unwrap_or_default();
                return Err(malformed(&format!(
                    "unknown part '{name}': send 'cloud' (a file), and parameters as parts of their names or as \
                     'parameters' (a JSON object)"
                )));
            }
        }
    }
    for (spec, text) in flat {
        set_once(request, &mut stated, spec.name, &text)?;
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

/// The text of a part; `texts` counts the bytes of all.
async fn text_of(
    part: &mut Field<'_>,
    gauge: &Gauge,
    texts: &mut usize,
    broken: &impl Fn(&dyn Error) -> ServiceError,
) -> Result<Vec<u8>, ServiceError> {
    let mut text = Vec::new();
    while let Some(chunk) = part.chunk().await.map_err(|e| broken(&e))? {
        gauge.used();
        *texts += chunk.len();
        if *texts > MAX_PARAMETERS_BYTES {
            return Err(malformed("the parameters of the form have more than 64 KiB"));
        }
        text.extend_from_slice(&chunk);
    }
    Ok(text)
}

/// Adds the part of a parameter to those before it, one a parameter: parts of a list, or of hints, stand one behind the
/// other, and one that is empty, as web pages send what nobody filled in, says nothing.
fn join(
    flat: &mut Vec<(&'static ParameterSpec, String)>,
    spec: &'static ParameterSpec,
    text: &[u8],
) -> Result<(), ServiceError> {
    let name = spec.name;
    let text = str::from_utf8(text)
        .map_err(|_| malformed(&format!("the part '{name}' is no text in UTF-8")))?
        .trim();
    if text.is_empty() {
        return Ok(());
    }
    match flat.iter_mut().find(|(known, _)| known.name == name) {
        None => flat.push((spec, text.to_owned())),
        Some((_, before)) => {
            *before = service::joined(spec, before, text)
                .ok_or_else(|| more_than_once(name, before, text))?;
        }
    }
    Ok(())
}

fn more_than_once(name: &str, before: &str, value: &str) -> ServiceError {
    ServiceError::new(
        ErrorKind::InvalidParameter,
        format!(
            "parameter '{name}' stands more than once, in the query or in the form, as '{before}' and as '{value}'"
        ),
    )
}

/// Sets a parameter that has no other value among those `stated`, and states it.
fn set_once(
    request: &mut impl ParameterForm,
    stated: &mut Vec<(String, String)>,
    name: &str,
    text: &str,
) -> Result<(), ServiceError> {
    request.set(name, text)?;
    let Some((_, value)) = request.request().given.last().cloned() else { return Ok(()) };
    match stated.iter().find(|(known, _)| known == name) {
        None => stated.push((name.to_owned(), value)),
        // said twice, it is still one thing: some clients send the same in query and form
        Some((_, before)) if *before == value => drop(request.request().given.pop()),
        Some((_, before)) => return Err(more_than_once(name, before, &value)),
    }
    Ok(())
}

/// Sets the parameters of a JSON object; lists are given as arrays or as in a query. None may have another value among
/// those `stated`.
fn parameters(
    text: &[u8],
    request: &mut impl ParameterForm,
    stated: &mut Vec<(String, String)>,
) -> Result<(), ServiceError> {
    let Pairs(pairs) = serde_json::from_slice(text)
        .map_err(|e| malformed(&format!("'parameters' is not a JSON object: {e}")))?;
    for (name, value) in pairs {
        if let Some(text) = as_text(&value) {
            set_once(request, stated, &name, &text)?;
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::service::Request;

    #[test]
    fn json_parameters_are_set_like_those_of_a_query() {
        let mut request = Request::default();
        let json =
            br#"{"surfaces": ["plane", "cone"], "seed": 7.0, "merge": false, "tolerance": null,
            "axis_direction": [0, 0.5, 1e-3]}"#;
        parameters(json, &mut request, &mut Vec::new()).unwrap();
        let query = [
            ("surfaces", "plane,cone"),
            ("seed", "7"),
            ("merge", "false"),
            ("axis_direction", "0,0.5,0.001"),
        ];
        assert_eq!(request.parameters, Request::from_pairs(query).unwrap().parameters);
    }

    #[test]
    fn hints_in_parts_of_their_own_are_one_list() {
        let spec = service::specs().find(|spec| spec.name == "hints").unwrap();
        let told = |parts: &[&str]| {
            let mut flat = Vec::new();
            parts.iter().for_each(|part| join(&mut flat, spec, part.as_bytes()).unwrap());
            let mut request = Request::default();
            let set = request.set("hints", &flat[0].1);
            set.map(|()| request.parameters.hints).map_err(|e| e.kind)
        };
        let [a, b] = [
            r#"{"at": [[1, 2, 3]], "type": "cylinder"}"#,
            r#"{"at": [[4, 5, 6], [7, 8, 9]], "action": "merge"}"#,
        ];
        let both = told(&[&format!("[{a}, {b}]")]);
        assert_eq!(both.as_ref().map(Vec::len), Ok(2));
        for parts in [&[a, b][..], &[&format!("[{a}]"), b], &[a, "[]", &format!(" [{b} ] ")]] {
            assert_eq!(told(parts), both, "{parts:?}");
        }
        assert_eq!(
            told(&[a]).map(|hints| hints.len()),
            told(&[&format!("[{a}]")]).map(|h| h.len())
        );
        assert_eq!(told(&[a, "nonsense"]), Err(ErrorKind::InvalidParameter));
    }

    #[test]
    fn a_parameter_that_stands_twice_has_one_value() {
        let set = |query: &[(&str, &str)], json: &str| {
            let mut request = Request::from_pairs(query.iter().copied()).unwrap();
            let mut stated = request.given.clone();
            let set = parameters(json.as_bytes(), &mut request, &mut stated);
            set.map(|()| request).map_err(|e| e.kind)
        };
        let refused = Err(ErrorKind::InvalidParameter);
        assert_eq!(set(&[("seed", "2")], r#"{"seed": 1}"#), refused);
        assert_eq!(set(&[], r#"{"seed": 1, "seed": 2}"#), refused);
        let once = set(&[], r#"{"seed": 1, "merge": true}"#);
        let both = [("seed", "1"), ("merge", "True")];
        assert_eq!(set(&both, r#"{"seed": 1, "merge": true, "seed": 1}"#), once);
        assert!(set(&both, r#"{"seed": null, "min_points": 60}"#).is_ok());
    }
}
