use serde::{Deserialize, Serialize};

/// What became of a hint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct HintOutcome {
    /// Its place in the list of hints.
    pub hint: usize,
    /// Whether the answer follows it.
    pub outcome: Outcome,
    /// The regions that it made or, where nothing came of it, that lie where it is about.
    pub regions: Vec<usize>,
    /// How far the place's points lie from the surface that was told, root mean square, in standard deviations of the
    /// noise: about 1 where it is theirs. Absent where no surface was told or fitted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scatter: Option<f64>,
    /// By how many standard deviations the points deny a radius or direction that was told, beyond its tolerance; of
    /// several the largest. Absent where none was told.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub misfit: Option<f64>,
    /// The same in words, with what can be done about it.
    pub message: String,
}

/// Whether an answer follows a hint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// It does.
    Applied,
    /// The points speak against it: the answer is theirs, as far as it is about what was told.
    Contradicted,
    /// There are no points, or too few, where it is about.
    NotFound,
}
