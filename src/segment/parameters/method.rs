use serde::{Deserialize, Serialize};

/// Which policies the pipeline runs with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Orthogonal distance: hypotheses, selection by description length, relabelling.
    Distance,
    /// The seed's: growth on the scatter matrix's reciprocal condition number, algebraic extraction.
    Rcond,
}
