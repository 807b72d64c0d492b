use super::{error::ParameterError, kind::ParameterKind, method::Method, table::ParameterSpec};
use crate::geometry::SurfaceType;

/// A value as text, and the parameter it is for.
#[derive(Clone, Copy)]
pub(super) struct Given<'a> {
    pub(super) spec: &'static ParameterSpec,
    pub(super) value: &'a str,
}

/// `true` or `false` in any case, as Python and spreadsheets write them.
pub fn truth(text: &str) -> Option<bool> {
    let is = |word: &str| text.eq_ignore_ascii_case(word);
    if is("true") { Some(true) } else { is("false").then_some(false) }
}

/// What it holds; an error where that is not what the parameter takes.
impl Given<'_> {
    pub(super) fn method(self) -> Result<Method, ParameterError> {
        match self.text() {
            "distance" => Ok(Method::Distance),
            "rcond" => Ok(Method::Rcond),
            _ => Err(self.invalid()),
        }
    }

    pub(super) fn number(self) -> Result<f64, ParameterError> {
        let ParameterKind::Number { min, max } = self.spec.kind else { return Err(self.invalid()) };
        let in_range = |v: &f64| *v <= max && if min == 0.0 { *v > 0.0 } else { *v >= min };
        self.text().parse().ok().filter(in_range).ok_or_else(|| self.invalid())
    }

    pub(super) fn integer(self) -> Result<u64, ParameterError> {
        let ParameterKind::Integer { min, max } = self.spec.kind else {
            return Err(self.invalid());
        };
        let number = self.text().parse().ok();
        number.filter(|v| (min..=max).contains(v)).ok_or_else(|| self.invalid())
    }

    pub(super) fn boolean(self) -> Result<bool, ParameterError> {
        truth(self.text()).ok_or_else(|| self.invalid())
    }

    /// Types in their order, each once.
    pub(super) fn types(self) -> Result<Vec<SurfaceType>, ParameterError> {
        let known = |t: &str| SurfaceType::from_name(t.trim()).ok_or_else(|| self.invalid());
        let mut types = self.text().split(',').map(known).collect::<Result<Vec<_>, _>>()?;
        types.sort();
        types.dedup();
        Ok(types)
    }

    pub(super) fn direction(self) -> Result<[f64; 3], ParameterError> {
        let number = |x: &str| x.trim().parse::<f64>().ok().filter(|x| x.is_finite());
        let numbers = self.text().split(',').map(number).collect::<Option<Vec<_>>>();
        let three = numbers.and_then(|v| <[f64; 3]>::try_from(v).ok());
        three.filter(|v| v.iter().any(|x| *x != 0.0)).ok_or_else(|| self.invalid())
    }

    fn text(&self) -> &str {
        self.value.trim()
    }

    fn invalid(&self) -> ParameterError {
        ParameterError::Invalid {
            name: self.spec.name,
            value: self.value.to_owned(),
            expected: self.spec.kind.to_string(),
        }
    }
}
