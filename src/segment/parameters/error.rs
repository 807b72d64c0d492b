use super::table::PARAMETERS;

/// A parameter that is unknown or out of its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ParameterError {
    /// No parameter has this name.
    #[error("unknown parameter '{0}'; known ones: {known}", known = names())]
    Unknown(String),
    /// The value is not what the parameter takes.
    #[error("parameter '{name}': '{value}' is not {expected}")]
    Invalid {
        /// The parameter.
        name: &'static str,
        /// What was given.
        value: String,
        /// What it takes, with its range.
        expected: String,
    },
    /// The hints cannot be read, or say what cannot be.
    #[error("parameter 'hints': {0}")]
    Hints(String),
    /// No radius is in the range.
    #[error("parameter 'min_radius': {min} is above 'max_radius': {max}")]
    EmptyRange {
        /// The smallest radius.
        min: f64,
        /// The largest radius.
        max: f64,
    },
}

fn names() -> String {
    PARAMETERS.iter().map(|p| p.name).collect::<Vec<_>>().join(", ")
}
