use std::time::Duration;

use axum::http::HeaderMap;

use super::query::{Given, Pairs};
use crate::service::{ErrorKind, MAX_WAIT, ServiceError};

/// What a caller prefers (RFC 7240).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Preferences {
    /// A job in place of an answer.
    pub respond_async: bool,
    /// How long the caller likes to wait for the job's end.
    pub wait: Option<Duration>,
}

impl Preferences {
    /// Those of a request. What is unknown or makes no sense is no preference, as the RFC has it.
    pub fn of(headers: &HeaderMap) -> Self {
        let values = headers.get_all("prefer").iter().filter_map(|value| value.to_str().ok());
        let mut preferences = Self::default();
        for preference in values.flat_map(|value| value.split([',', ';'])) {
            let (name, value) = preference.split_once('=').unwrap_or((preference, ""));
            let (name, value) = (name.trim(), value.trim().trim_matches('"'));
            if name.eq_ignore_ascii_case("respond-async") {
                preferences.respond_async = true;
            } else if name.eq_ignore_ascii_case("wait") && preferences.wait.is_none() {
                preferences.wait = value.parse().ok().map(Duration::from_secs);
            }
        }
        preferences
    }
}

/// Takes `wait` out of a query: how long to wait for a job's end. What is left is the rest of the query.
///
/// # Errors
/// The query cannot be read, or `wait` stands twice or is out of its range.
pub fn take_wait(query: Pairs) -> Result<(Given, Option<Duration>), ServiceError> {
    let invalid = |detail| ServiceError::new(ErrorKind::InvalidParameter, detail);
    let (waits, rest): (Vec<_>, Vec<_>) =
        super::query::pairs(query)?.into_iter().partition(|(name, _)| name == "wait");
    if waits.len() > 1 {
        return Err(invalid("parameter 'wait' stands more than once".to_owned()));
    }
    let Some((_, text)) = waits.first() else { return Ok((rest, None)) };
    let most = MAX_WAIT.as_secs_f64();
    let seconds = text.trim().parse::<f64>().ok().filter(|s| (0.0..=most).contains(s));
    let seconds = seconds.ok_or_else(|| {
        let told: String = text.escape_default().take(64).collect();
        invalid(format!("parameter 'wait': '{told}' is not a number of seconds from 0 to {most}"))
    })?;
    Ok((rest, Some(Duration::from_secs_f64(seconds))))
}

/// The wait that a query or a header asks for; the query's where both do.
///
/// # Errors
/// There is anything else in the query, or its `wait` is out of its range.
pub fn wait_alone(query: Pairs, headers: &HeaderMap) -> Result<Option<Duration>, ServiceError> {
    let (rest, wait) = take_wait(query)?;
    if let Some((name, _)) = rest.first() {
        return Err(ServiceError::new(
            ErrorKind::UnknownParameter,
            format!("unknown parameter '{name}' of a job; known ones: wait"),
        ));
    }
    Ok(wait.or(Preferences::of(headers).wait))
}

/// Refuses a query of which nothing is used; `what` it is of.
///
/// # Errors
/// The query cannot be read, or there is anything in it.
pub fn nothing(query: Pairs, what: &str) -> Result<(), ServiceError> {
    match super::query::pairs(query)?.first() {
        None => Ok(()),
        Some((name, _)) => Err(ServiceError::new(
            ErrorKind::UnknownParameter,
            format!("unknown parameter '{name}' of {what}: there are none"),
        )),
    }
}

#[cfg(test)]
mod tests {
    use axum::extract::Query;

    use super::*;

    #[test]
    fn preferences_are_read_in_any_order_and_case() {
        let of = |text: &str| {
            let mut headers = HeaderMap::new();
            headers.insert("prefer", text.parse().unwrap());
            let Preferences { respond_async, wait } = Preferences::of(&headers);
            (respond_async, wait.map(|wait| wait.as_secs()))
        };
        assert_eq!(of("respond-async"), (true, None));
        assert_eq!(of("Respond-Async, wait=10"), (true, Some(10)));
        assert_eq!(of("handling=lenient; x, wait=\"5\", wait=7"), (false, Some(5)));
        for none in ["wait", "wait=-1", "wait=soon", "respond-asynchronously"] {
            assert_eq!(of(none), (false, None), "{none}");
        }
    }

    #[test]
    fn a_wait_is_as_long_as_its_limit_and_no_longer() {
        let wait = |values: &[&str]| {
            let pairs = values.iter().map(|value| ("wait".to_owned(), (*value).to_owned()));
            take_wait(Ok(Query(pairs.collect()))).map(|(_, wait)| wait).map_err(|e| e.kind)
        };
        assert_eq!(wait(&["600"]), Ok(Some(MAX_WAIT)));
        assert_eq!(wait(&["0"]), Ok(Some(Duration::ZERO)));
        assert_eq!(wait(&["0.5"]), Ok(Some(Duration::from_millis(500))));
        assert_eq!(wait(&[]), Ok(None));
        for wrong in [&["600.1"][..], &["-1"], &["NaN"], &["inf"], &[""], &["1", "1"]] {
            assert_eq!(wait(wrong), Err(ErrorKind::InvalidParameter), "{wrong:?}");
        }
    }
}
