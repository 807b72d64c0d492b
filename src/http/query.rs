use axum::extract::{Query, rejection::QueryRejection};

use crate::segment::ParameterSpec;
use crate::service::{ErrorKind, Request, ServiceError, is_list, specs, unknown_parameter};

/// Name and value pairs of a query, in its order.
pub type Pairs = Result<Query<Vec<(String, String)>>, QueryRejection>;

/// The request in a query. Lists may be written `a,b,c` or by repeating their name; nothing else may
/// stand twice.
///
/// # Errors
/// The query cannot be read, or a parameter in it is unknown, wrong or there twice.
pub fn from_query(query: Pairs) -> Result<Request, ServiceError> {
    let given = pairs(query, |name| {
        specs().find(|spec| spec.name == name).ok_or_else(|| unknown_parameter(name))
    })?;
    Request::from_pairs(given.iter().map(|(name, value)| (name.as_str(), value.as_str())))
}

/// The pairs of a query, each name once, that of a list with all its values; `find` knows the names.
///
/// # Errors
/// The query cannot be read, or a name in it is unknown or there twice.
pub fn pairs(
    query: Pairs,
    find: impl Fn(&str) -> Result<&'static ParameterSpec, ServiceError>,
) -> Result<Vec<(String, String)>, ServiceError> {
    let invalid = |detail| ServiceError::new(ErrorKind::InvalidParameter, detail);
    let Query(pairs) = query.map_err(|e| invalid(format!("the query cannot be read: {e}")))?;
    let mut given: Vec<(String, String)> = Vec::new();
    for (name, value) in pairs {
        // at once: so there are never more names than those there are
        let spec = find(&name)?;
        let is_list = || is_list(spec);
        match given.iter_mut().find(|(known, _)| *known == name) {
            None => given.push((name, value)),
            Some((_, list)) if is_list() => *list = format!("{list},{value}"),
            Some(_) => return Err(invalid(format!("parameter '{name}' stands more than once"))),
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
