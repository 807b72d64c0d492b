use serde::{Deserialize, Serialize, Serializer};

use super::{Mat3, Quadric, Vec3};

/// The kinds of surface a region can be reported as.
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
pub enum SurfaceType {
    /// A plane.
    Plane,
    /// A sphere.
    Sphere,
    /// A right circular cylinder.
    Cylinder,
    /// A cylinder over an ellipse.
    EllipticCylinder,
    /// A right circular cone.
    Cone,
    /// An ellipsoid with any three semi-axes.
    Ellipsoid,
    /// A torus with a circular section: the one type that is no quadric.
    Torus,
    /// z = x2/a + y2/b.
    EllipticParaboloid,
    /// z = x2/a - y2/b.
    HyperbolicParaboloid,
    /// A hyperboloid in one piece.
    HyperboloidOneSheet,
    /// A hyperboloid in two pieces.
    HyperboloidTwoSheets,
    /// A cylinder over a parabola.
    ParabolicCylinder,
    /// A cylinder over a hyperbola.
    HyperbolicCylinder,
    /// A cone over an ellipse.
    EllipticCone,
}

impl SurfaceType {
    /// The types looked for when the user names none.
    pub const DEFAULT: [Self; 7] = [
        Self::Plane,
        Self::Sphere,
        Self::Cylinder,
        Self::EllipticCylinder,
        Self::Cone,
        Self::Ellipsoid,
        Self::Torus,
    ];

    /// Every type, the default ones first.
    pub const ALL: [Self; 14] = [
        Self::Plane,
        Self::Sphere,
        Self::Cylinder,
        Self::EllipticCylinder,
        Self::Cone,
        Self::Ellipsoid,
        Self::Torus,
        Self::EllipticParaboloid,
        Self::HyperbolicParaboloid,
        Self::HyperboloidOneSheet,
        Self::HyperboloidTwoSheets,
        Self::ParabolicCylinder,
        Self::HyperbolicCylinder,
        Self::EllipticCone,
    ];

    /// The name used in every contract, for example `elliptic_cylinder`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Plane => "plane",
            Self::Sphere => "sphere",
            Self::Cylinder => "cylinder",
            Self::EllipticCylinder => "elliptic_cylinder",
            Self::Cone => "cone",
            Self::Ellipsoid => "ellipsoid",
            Self::Torus => "torus",
            Self::EllipticParaboloid => "elliptic_paraboloid",
            Self::HyperbolicParaboloid => "hyperbolic_paraboloid",
            Self::HyperboloidOneSheet => "hyperboloid_one_sheet",
            Self::HyperboloidTwoSheets => "hyperboloid_two_sheets",
            Self::ParabolicCylinder => "parabolic_cylinder",
            Self::HyperbolicCylinder => "hyperbolic_cylinder",
            Self::EllipticCone => "elliptic_cone",
        }
    }

    /// The type of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|t| t.name() == name)
    }
}

/// The plane through `point` with the unit vector `normal`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Plane {
    /// A point of the plane.
    #[schema(value_type = [f64; 3])]
    pub point: Vec3,
    /// Unit normal; which of the two ways it points means nothing.
    #[schema(value_type = [f64; 3])]
    pub normal: Vec3,
}

/// The sphere about `center`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Sphere {
    /// Centre.
    #[schema(value_type = [f64; 3])]
    pub center: Vec3,
    /// Radius > 0.
    pub radius: f64,
}

/// The right circular cylinder about an axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Cylinder {
    /// A point of the axis.
    #[schema(value_type = [f64; 3])]
    pub axis_point: Vec3,
    /// Unit direction of the axis; which of the two ways it points means nothing.
    #[schema(value_type = [f64; 3])]
    pub axis_direction: Vec3,
    /// Radius > 0.
    pub radius: f64,
}

/// The cylinder over an ellipse.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct EllipticCylinder {
    /// A point of the axis.
    #[schema(value_type = [f64; 3])]
    pub axis_point: Vec3,
    /// Unit direction of the axis; which of the two ways it points means nothing.
    #[schema(value_type = [f64; 3])]
    pub axis_direction: Vec3,
    /// Semi-axes of the section, the larger first.
    pub semi_axes: [f64; 2],
    /// Unit directions of the semi-axes, right-handed with the axis; their signs mean nothing else.
    #[schema(value_type = [[f64; 3]; 2])]
    pub semi_axis_directions: [Vec3; 2],
}

/// The right circular cone; points of it lie on the side of `axis_direction` from the apex.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Cone {
    /// The apex.
    #[schema(value_type = [f64; 3])]
    pub apex: Vec3,
    /// Unit direction from the apex into the cone.
    #[schema(value_type = [f64; 3])]
    pub axis_direction: Vec3,
    /// Angle between the axis and the surface, in radians, in (0, pi/2).
    pub half_angle: f64,
}

/// The ellipsoid about `center`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Ellipsoid {
    /// Centre.
    #[schema(value_type = [f64; 3])]
    pub center: Vec3,
    /// Semi-axes, the largest first.
    pub semi_axes: [f64; 3],
    /// Unit directions of the semi-axes, right-handed; their signs mean nothing else.
    #[schema(value_type = [[f64; 3]; 3])]
    pub semi_axis_directions: [Vec3; 3],
}

/// The torus with a circular section, as pipe elbows and fillets of round edges have it. It is no quadric.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Torus {
    /// Centre.
    #[schema(value_type = [f64; 3])]
    pub center: Vec3,
    /// Unit direction of the axis of revolution; which of the two ways it points means nothing.
    #[schema(value_type = [f64; 3])]
    pub axis_direction: Vec3,
    /// Distance from the centre to the tube's middle line, > 0.
    pub major_radius: f64,
    /// Radius of the tube, > 0; larger than `major_radius` where the surface crosses itself.
    pub minor_radius: f64,
}

/// A reported surface in engineering terms; lengths in the input's unit. `type` tells which.
// read without its type as well, which results had not that were kept by earlier versions
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, utoipa::ToSchema)]
#[serde(untagged)]
pub enum Surface {
    /// A plane.
    Plane(Plane),
    /// A sphere.
    Sphere(Sphere),
    /// A right circular cylinder.
    Cylinder(Cylinder),
    /// A cylinder over an ellipse.
    EllipticCylinder(EllipticCylinder),
    /// A right circular cone.
    Cone(Cone),
    /// An ellipsoid.
    Ellipsoid(Ellipsoid),
    /// A torus.
    Torus(Torus),
}

impl Serialize for Surface {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        #[serde(tag = "type", rename_all = "snake_case")]
        enum Typed<'a> {
            Plane(&'a Plane),
            Sphere(&'a Sphere),
            Cylinder(&'a Cylinder),
            EllipticCylinder(&'a EllipticCylinder),
            Cone(&'a Cone),
            Ellipsoid(&'a Ellipsoid),
            Torus(&'a Torus),
        }
        match self {
            Self::Plane(s) => Typed::Plane(s),
            Self::Sphere(s) => Typed::Sphere(s),
            Self::Cylinder(s) => Typed::Cylinder(s),
            Self::EllipticCylinder(s) => Typed::EllipticCylinder(s),
            Self::Cone(s) => Typed::Cone(s),
            Self::Ellipsoid(s) => Typed::Ellipsoid(s),
            Self::Torus(s) => Typed::Torus(s),
        }
        .serialize(serializer)
    }
}

/// x'Qx - 2c'Qx + c'Qc = rhs for Q = sum of `curvatures[i] * directions[i] directions[i]'`.
fn central(center: &Vec3, directions: &[Vec3], curvatures: &[f64], rhs: f64) -> Quadric {
    let q = directions
        .iter()
        .zip(curvatures)
        .fold(Mat3::zeros(), |q, (d, &c)| q + c * d * d.transpose());
    Quadric::from_parts(&q, &(-2.0 * q * center), (q * center).dot(center) - rhs)
}

impl Surface {
    /// The surface's type.
    pub fn surface_type(&self) -> SurfaceType {
        match self {
            Self::Plane(_) => SurfaceType::Plane,
            Self::Sphere(_) => SurfaceType::Sphere,
            Self::Cylinder(_) => SurfaceType::Cylinder,
            Self::EllipticCylinder(_) => SurfaceType::EllipticCylinder,
            Self::Cone(_) => SurfaceType::Cone,
            Self::Ellipsoid(_) => SurfaceType::Ellipsoid,
            Self::Torus(_) => SurfaceType::Torus,
        }
    }

    /// The surface as ten coefficients, not scaled; `None` for the torus, which is no quadric.
    pub fn quadric(&self) -> Option<Quadric> {
        Some(match self {
            Self::Plane(s) => {
                Quadric::from_parts(&Mat3::zeros(), &s.normal, -s.normal.dot(&s.point))
            }
            Self::Sphere(s) => central(
                &s.center,
                &[Vec3::x(), Vec3::y(), Vec3::z()],
                &[1.0, 1.0, 1.0],
                s.radius * s.radius,
            ),
            Self::Cylinder(s) => {
                let q = Mat3::identity() - s.axis_direction * s.axis_direction.transpose();
                let c = &s.axis_point;
                Quadric::from_parts(&q, &(-2.0 * q * c), (q * c).dot(c) - s.radius * s.radius)
            }
            Self::EllipticCylinder(s) => central(
                &s.axis_point,
                &s.semi_axis_directions,
                &s.semi_axes.map(|a| 1.0 / (a * a)),
                1.0,
            ),
            Self::Cone(s) => {
                let sq_cos = s.half_angle.cos().powi(2);
                let q = Mat3::identity() - s.axis_direction * s.axis_direction.transpose() / sq_cos;
                Quadric::from_parts(&q, &(-2.0 * q * s.apex), (q * s.apex).dot(&s.apex))
            }
            Self::Ellipsoid(s) => central(
                &s.center,
                &s.semi_axis_directions,
                &s.semi_axes.map(|a| 1.0 / (a * a)),
                1.0,
            ),
            Self::Torus(_) => return None,
        })
    }
}
