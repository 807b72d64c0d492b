//! The error of a fit beside its uncertainty.

use conicoid::fit::feature::{Feature, FeatureType, Parameter, Pose};
use conicoid::geometry::Vec3;

/// What parameters are.
pub const GROUPS: [&str; 3] = ["size", "position", "direction"];

/// One component: its group, a number of its own within the feature, error, standard and expanded uncertainty.
#[derive(Clone, Copy, Debug)]
pub struct Component {
    pub group: usize,
    pub own: usize,
    pub error: f64,
    pub standard: f64,
    pub expanded: f64,
}

/// Of one fit: what it told.
#[derive(Clone, Debug, Default)]
pub struct Score(pub Vec<Component>);

/// The truth of each parameter that a type has, its group, and how many components it has.
pub fn parameters(kind: FeatureType) -> &'static [(&'static str, usize, usize)] {
    use FeatureType as T;
    match kind {
        T::Plane => &[("point", 1, 3), ("normal", 2, 1)],
        T::Line => &[("point", 1, 3), ("direction", 2, 1)],
        T::Circle => &[("center", 1, 3), ("normal", 2, 1), ("radius", 0, 1)],
        T::Sphere => &[("center", 1, 3), ("radius", 0, 1)],
        T::Cylinder => &[("axis_point", 1, 3), ("axis_direction", 2, 1), ("radius", 0, 1)],
        T::Cone => &[("apex", 1, 3), ("axis_direction", 2, 1), ("half_angle", 0, 1)],
        T::EllipticCylinder => &[
            ("axis_point", 1, 3),
            ("axis_direction", 2, 1),
            ("semi_axes", 0, 2),
            ("semi_axis_directions", 2, 2),
        ],
        T::Ellipsoid => &[("center", 1, 3), ("semi_axes", 0, 3), ("semi_axis_directions", 2, 3)],
        T::Torus => &[
            ("center", 1, 3),
            ("axis_direction", 2, 1),
            ("major_radius", 0, 1),
            ("minor_radius", 0, 1),
        ],
    }
}

impl Score {
    /// Of a feature beside the truth.
    pub fn of(found: &Feature, truth: &Pose) -> Self {
        let mut out = Vec::new();
        let Some(exactness) = &found.exactness else { return Self(out) };
        let mut own = 0;
        for &(name, group, count) in parameters(truth.kind) {
            if let Some(told) = exactness.parameters.iter().find(|p| p.name == name) {
                let errors = match group {
                    1 => position(found, truth, told),
                    2 => directions(told, truth),
                    _ => sizes(told, truth),
                };
                for (k, error) in errors.into_iter().enumerate() {
                    let (standard, expanded) = (told.standard[k], told.expanded[k]);
                    out.push(Component { group, own: own + k, error, standard, expanded });
                }
            }
            own += count;
        }
        Self(out)
    }
}

/// A point's components from the truth; a point of an axis or a plane from the one beside it.
fn position(found: &Feature, truth: &Pose, told: &Parameter) -> Vec<f64> {
    use FeatureType as T;
    let at = Vec3::from_column_slice(&told.values) + found.origin;
    let w = truth.w();
    let off = at - truth.origin;
    let error = match truth.kind {
        T::Plane => w * off.dot(&w),
        T::Line | T::Cylinder | T::EllipticCylinder => off - w * off.dot(&w),
        T::Cone => off + w * (truth.size[0] / truth.size[1].tan()),
        _ => off,
    };
    error.iter().copied().collect()
}

/// Angles to the truth; which way a direction points means nothing.
fn directions(told: &Parameter, truth: &Pose) -> Vec<f64> {
    let is_semi_axes = told.name == "semi_axis_directions";
    let angle = |(k, values): (usize, &[f64])| {
        let column = if is_semi_axes { k } else { 2 };
        let off = Vec3::from_column_slice(values).cross(&truth.frame.column(column)).norm();
        off.min(1.0).asin()
    };
    told.values.chunks(3).enumerate().map(angle).collect()
}

fn sizes(told: &Parameter, truth: &Pose) -> Vec<f64> {
    let at = match told.name {
        "half_angle" | "minor_radius" => 1,
        _ => 0,
    };
    told.values.iter().zip(&truth.size[at..]).map(|(v, t)| v - t).collect()
}
