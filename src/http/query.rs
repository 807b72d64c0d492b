use axum::extract::{Query, rejection::QueryRejection};

use crate::segment::ParameterSpec;
use crate::service::{self, ErrorKind, Request, ServiceError, specs, unknown_parameter};

/// Name and value pairs of a query, in its order, as they come.
pub type Pairs = Result<Query<Given>, QueryRejection>;
/// Name and value pairs that could be read.
pub type Given = Vec<(String, String)>;

/// The pairs of a query.
///
/// # Errors
/// It cannot be read.
pub fn pairs(query: Pairs) -> Result<Given, ServiceError> {
    let Query(pairs) = query.map_err(|error| {
        let detail = format!("the query cannot be read: {error}");
        ServiceError::new(ErrorKind::InvalidParameter, detail)
    })?;
    Ok(pairs)
}

/// The request in a query. Lists may be written `a,b,c` or by repeating their name; nothing else may
/// stand twice with two values.
///
/// # Errors
/// The query cannot be read, or a parameter in it is unknown, wrong or there twice.
pub fn from_query(query: Pairs) -> Result<Request, ServiceError> {
    from_pairs(pairs(query)?)
}

/// The request in the pairs of a query, as [`from_query`] reads it.
///
/// # Errors
/// A parameter is unknown, wrong or there twice.
pub fn from_pairs(query: Given) -> Result<Request, ServiceError> {
    let given = joined(query, |name| {
        specs().find(|spec| spec.name == name).ok_or_else(|| unknown_parameter(name))
    })?;
    Request::from_pairs(given.iter().map(|(name, value)| (name.as_str(), value.as_str())))
}

/// The pairs of a query, each name once, that of a list with all its values; `find` knows the names.
///
/// # Errors
/// A name is unknown, or there with two values.
pub fn joined(
    query: Given,
    find: impl Fn(&str) -> Result<&'static ParameterSpec, ServiceError>,
) -> Result<Given, ServiceError> {
    let invalid = |detail| ServiceError::new(ErrorKind::InvalidParameter, detail);
    let mut given: Given = Vec::new();
    for (name, value) in query {
        // at once: so there are never more names than those there are
        let spec = find(&name)?;
        match given.iter_mut().find(|(known, _)| *known == name) {
            None => given.push((name, value)),
            Some((_, first)) => {
                *first = service::joined(spec, first, &value).ok_or_else(|| {
                    invalid(format!(
                        "parameter '{name}' stands more than once, as '{first}' and as '{value}'"
                    ))
                })?;
            }
        }
    }
    Ok(given)
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
        let twice = query(&[("seed", "1"), ("seed", "2")]);
        assert_eq!(twice, Err(ErrorKind::InvalidParameter));
        assert_eq!(query(&[("seed", "1"), ("seed", "1")]), query(&[("seed", "1")]));
    }

    #[test]
    fn hints_are_repeated_or_written_as_one_list() {
        let [a, b] =
            ["cylinder", "cone"].map(|kind| format!(r#"{{"at": [[1, 2, 3]], "type": "{kind}"}}"#));
        let one = query(&[("hints", &format!("[{a}, {b}]"))]);
        assert_eq!(one.as_ref().map(|request| request.parameters.hints.len()), Ok(2));
        for texts in [[&*a, &b], [&format!("[{a}]"), &b], [&format!("[{a},{b}]"), "[]"]] {
            let told = query(&texts.map(|text| ("hints", text)));
            assert_eq!(told.map(|r| r.parameters.hints), one.clone().map(|r| r.parameters.hints));
        }
        assert_eq!(query(&[("hints", &a), ("hints", "x")]), Err(ErrorKind::InvalidParameter));
    }

    #[test]
    fn a_name_that_is_unknown_is_refused_when_it_is_met() {
        // and not looked for among thousands of others
        let unknown = query(&[("a", "1"), ("a", "1"), ("seed", "x")]);
        assert_eq!(unknown, Err(ErrorKind::UnknownParameter));
    }
}
