use serde::{Deserialize, Serialize};

use super::kind::FeatureType;

/// How a feature is associated with points (ISO 14405-1, ISO 1101).
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, utoipa::ToSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Association {
    /// The least sum of squared distances of all points.
    #[default]
    Gaussian,
    /// The least largest distance (Chebyshev).
    MinimumZone,
    /// The smallest circle, sphere or cylinder that holds all points.
    MinimumCircumscribed,
    /// The largest circle, sphere or cylinder among the points that holds none.
    MaximumInscribed,
}

impl Association {
    /// Every association.
    pub const ALL: [Self; 4] =
        [Self::Gaussian, Self::MinimumZone, Self::MinimumCircumscribed, Self::MaximumInscribed];

    /// The name used in every contract.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gaussian => "gaussian",
            Self::MinimumZone => "minimum_zone",
            Self::MinimumCircumscribed => "minimum_circumscribed",
            Self::MaximumInscribed => "maximum_inscribed",
        }
    }

    /// The association of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|a| a.name() == name)
    }

    /// Whether features of a type can be associated so.
    pub fn is_for(self, kind: FeatureType) -> bool {
        use FeatureType::{Circle, Cylinder, Sphere};
        match self {
            Self::Gaussian | Self::MinimumZone => true,
            Self::MinimumCircumscribed | Self::MaximumInscribed => {
                matches!(kind, Circle | Sphere | Cylinder)
            }
        }
    }
}
