use serde::{Deserialize, Serialize};

use crate::fit::Family;

/// The geometric features that are fitted to all of their points.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    Hash,
    PartialOrd,
    Ord,
    Serialize,
    Deserialize,
    utoipa::ToSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum FeatureType {
    /// A plane.
    Plane,
    /// A sphere.
    Sphere,
    /// A right circular cylinder.
    Cylinder,
    /// A right circular cone.
    Cone,
    /// A cylinder over an ellipse.
    EllipticCylinder,
    /// An ellipsoid.
    Ellipsoid,
    /// A torus.
    Torus,
    /// A circle in space: a curve, distances from it are taken in space.
    Circle,
    /// A straight line in space.
    Line,
}

impl FeatureType {
    /// Every type.
    pub const ALL: [Self; 9] = [
        Self::Plane,
        Self::Sphere,
        Self::Cylinder,
        Self::Cone,
        Self::EllipticCylinder,
        Self::Ellipsoid,
        Self::Torus,
        Self::Circle,
        Self::Line,
    ];

    /// The name used in every contract.
    pub fn name(self) -> &'static str {
        match self {
            Self::Plane => "plane",
            Self::Sphere => "sphere",
            Self::Cylinder => "cylinder",
            Self::Cone => "cone",
            Self::EllipticCylinder => "elliptic_cylinder",
            Self::Ellipsoid => "ellipsoid",
            Self::Torus => "torus",
            Self::Circle => "circle",
            Self::Line => "line",
        }
    }

    /// The name in a sentence.
    pub fn with_article(self) -> String {
        let article = if self.name().starts_with('e') { "an" } else { "a" };
        format!("{article} {}", self.name().replace('_', " "))
    }

    /// The type of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|t| t.name() == name)
    }

    /// The family of a surface; `None` for the two curves.
    pub fn family(self) -> Option<Family> {
        Some(match self {
            Self::Plane => Family::Plane,
            Self::Sphere => Family::Sphere,
            Self::Cylinder => Family::Cylinder,
            Self::Cone => Family::Cone,
            Self::EllipticCylinder => Family::EllipticCylinder,
            Self::Ellipsoid => Family::Ellipsoid,
            Self::Torus => Family::Torus,
            Self::Circle | Self::Line => return None,
        })
    }

    /// The type of a family.
    pub fn of(family: Family) -> Self {
        match family {
            Family::Plane => Self::Plane,
            Family::Sphere => Self::Sphere,
            Family::Cylinder => Self::Cylinder,
            Family::Cone => Self::Cone,
            Family::EllipticCylinder => Self::EllipticCylinder,
            Family::Torus => Self::Torus,
            Family::Ellipsoid => Self::Ellipsoid,
        }
    }

    /// The places, among the nine of [`Slot`](super::Pose::stepped), that are its degrees of freedom: three translations along the
    /// frame, three rotations about it, three sizes.
    pub fn slots(self) -> &'static [usize] {
        match self {
            Self::Plane => &[2, 3, 4],
            Self::Sphere => &[0, 1, 2, 6],
            Self::Cylinder => &[0, 1, 3, 4, 6],
            Self::Cone => &[0, 1, 3, 4, 6, 7],
            Self::EllipticCylinder => &[0, 1, 3, 4, 5, 6, 7],
            Self::Ellipsoid => &[0, 1, 2, 3, 4, 5, 6, 7, 8],
            Self::Torus => &[0, 1, 2, 3, 4, 6, 7],
            Self::Circle => &[0, 1, 2, 3, 4, 6],
            Self::Line => &[0, 1, 3, 4],
        }
    }

    /// How many independent distances a point gives: two from a curve in space.
    pub fn rows(self) -> usize {
        if self.family().is_some() { 1 } else { 2 }
    }

    /// The fewest points that determine it, `free` of its degrees of freedom being left open.
    ///
    /// Three for a circle and two for a line: what they have more equations than unknowns, they do not need.
    pub fn fewest(self, free: usize) -> usize {
        match self {
            Self::Circle => 3,
            Self::Line => 2,
            _ => free.max(1),
        }
    }

    /// What its form error is called by ISO 1101 and ISO 12180, 12181, 12780, 12781; those of surfaces that have no
    /// name there are profiles of a surface.
    pub fn form_name(self) -> &'static str {
        match self {
            Self::Plane => "flatness",
            Self::Sphere => "sphericity",
            Self::Cylinder => "cylindricity",
            Self::Cone => "conicity",
            Self::Circle => "roundness",
            Self::Line => "straightness",
            Self::EllipticCylinder | Self::Ellipsoid | Self::Torus => "profile_of_surface",
        }
    }
}
