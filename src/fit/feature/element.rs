use serde::{Deserialize, Serialize};

use super::kind::FeatureType;
use super::pose::Pose;
use crate::geometry::{Surface, Vec3};

/// A circle in space.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Circle {
    /// Centre.
    #[schema(value_type = [f64; 3])]
    pub center: Vec3,
    /// Unit normal of its plane; which of the two ways it points means nothing.
    #[schema(value_type = [f64; 3])]
    pub normal: Vec3,
    /// Radius > 0.
    pub radius: f64,
}

/// A straight line.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Line {
    /// The point of the line beside the points' mean.
    #[schema(value_type = [f64; 3])]
    pub point: Vec3,
    /// Unit direction; which of the two ways it points means nothing.
    #[schema(value_type = [f64; 3])]
    pub direction: Vec3,
}

/// A feature in engineering terms; lengths in the input's unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(untagged)]
pub enum Element {
    /// A circle.
    Circle(Circle),
    /// A line.
    Line(Line),
    /// A surface.
    Surface(Surface),
}

impl Pose {
    /// The feature in engineering terms.
    pub fn element(&self) -> Element {
        match (self.kind, self.shape()) {
            (_, Some(shape)) => Element::Surface(shape.surface()),
            (FeatureType::Circle, _) => Element::Circle(Circle {
                center: self.origin,
                normal: self.w(),
                radius: self.size[0],
            }),
            _ => Element::Line(Line { point: self.origin, direction: self.w() }),
        }
    }
}
