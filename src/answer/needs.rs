use super::form::Form;

/// What of the cloud a result needs to be told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needs {
    /// Nothing.
    Nothing,
    /// The points that surfaces were found by, and the file's own columns.
    Cloud,
    /// All points, of a thinned cloud too, and the file's own columns.
    EachPoint,
}

impl Needs {
    /// Those of a form.
    pub fn of(form: Form) -> Self {
        match form {
            Form::Ply | Form::Points | Form::Deviations => Self::EachPoint,
            form if form.has_points() => Self::Cloud,
            _ => Self::Nothing,
        }
    }
}
