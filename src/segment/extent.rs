use serde::{Deserialize, Serialize};

/// Where a region lies.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Extent {
    /// Smallest coordinates of its points.
    pub min: [f64; 3],
    /// Largest coordinates of its points.
    pub max: [f64; 3],
}
