//! What a face is in a designer's terms.

use serde::{Deserialize, Serialize};

/// On which side of a curved face the material is: by the file's normals where it has some that agree (PLY nx, ny, nz, which
/// point out of the material), else by the shape of what hangs together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// Outside: a concave face, as a bore's wall.
    Hole,
    /// Inside: a convex face, as a shaft's.
    Boss,
    /// The cloud does not tell: the region touches no others, or what hangs together with it does not enclose a body.
    #[default]
    Unknown,
}

impl Side {
    /// The word for it in every contract.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hole => "hole",
            Self::Boss => "boss",
            Self::Unknown => "unknown",
        }
    }
}

/// Ends, lengths, diameters and outlines of a region, where its type has them. Lengths are in the input's unit, angles in
/// radians.
///
/// An end that a neighbour bounds lies where the two surfaces meet; one that is free lies beyond the last point by half
/// of the largest gap between the points there. `uncertainty` holds the standard deviations of `ends` (along the axis),
/// `length`, `arc_angle`, `diameter` and `diameters`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Dimensions {
    /// Cylinder, elliptic cylinder, cone: the two end points on the axis, in the direction of `axis_direction`.
    /// Torus: those on the tube's middle line, counter-clockwise about `axis_direction`; absent where the ring closes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ends: Option<[[f64; 3]; 2]>,
    /// The neighbour that bounds each end; null where the end is free.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bounded_by: Option<[Option<usize>; 2]>,
    /// Distance between the ends along the axis; of a torus along the tube's middle line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length: Option<f64>,
    /// Of a sphere, a cylinder, or a torus' tube.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub diameter: Option<f64>,
    /// Elliptic cylinder: two; ellipsoid: three; the largest first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub diameters: Option<Vec<f64>>,
    /// Cone: the radius at each of `ends`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end_radii: Option<[f64; 2]>,
    /// Cone: twice its half angle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub full_angle: Option<f64>,
    /// The smallest angle about the axis (of a torus: about the tube's middle line) within which all points lie; 2 pi
    /// where they go all round.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub swept_angle: Option<f64>,
    /// Torus: the angle about its axis between its ends; 2 pi where the ring closes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arc_angle: Option<f64>,
    /// On which side of a curved face the material is, where the cloud is that of a body seen from outside.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub side: Option<Side>,
    /// Sphere, ellipsoid: share of the whole surface on which there are points, 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub share_seen: Option<f64>,
    /// Plane: closed polygons in space around the points, the last corner joined to the first: outer ones
    /// counter-clockwise about `normal`, those of holes clockwise, the largest first. They follow the edge to about a
    /// spacing of the points.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outline: Option<Vec<Vec<[f64; 3]>>>,
    /// Plane: area within `outline`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area: Option<f64>,
    /// Plane: sides of the smallest rectangle around `outline`, the longer first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<[f64; 2]>,
    /// Plane: unit directions of these sides.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size_directions: Option<[[f64; 3]; 2]>,
}
