//! The engineering parameters of a pose and how they change with it.

use nalgebra::DMatrix;

use super::kind::FeatureType;
use super::pose::{Pose, SLOTS};
use crate::geometry::Vec3;

/// One parameter: its name as in the surface, its components, and what they are.
#[derive(Clone, Debug, PartialEq)]
pub struct Term {
    /// Name.
    pub name: &'static str,
    /// Components.
    pub values: Vec<f64>,
    /// What it is.
    pub nature: Nature,
}

/// What a parameter is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Nature {
    /// A place.
    Point,
    /// Unit directions, three components each.
    Direction,
    /// Lengths that are sizes of the feature.
    Size,
    /// An angle.
    Angle,
}

/// The parameters, in the order of the surface's fields.
pub fn terms(pose: &Pose) -> Vec<Term> {
    use FeatureType as T;
    let order = order(pose);
    let sizes = |count: usize| order[..count].iter().map(|&i| pose.size[i]).collect::<Vec<_>>();
    let point = |name, at: &Vec3| Term {
        name,
        values: at.iter().copied().collect(),
        nature: Nature::Point,
    };
    let direction =
        |name| Term { name, values: pose.w().iter().copied().collect(), nature: Nature::Direction };
    let size = |name, values: Vec<f64>| Term { name, values, nature: Nature::Size };
    let axes = |count: usize| Term {
        name: "semi_axis_directions",
        values: (0..count)
            .flat_map(|k| semi_axis(pose, &order, k).iter().copied().collect::<Vec<_>>())
            .collect(),
        nature: Nature::Direction,
    };
    let o = &pose.origin;
    match pose.kind {
        T::Plane => vec![point("point", o), direction("normal")],
        T::Line => vec![point("point", o), direction("direction")],
        T::Circle => vec![point("center", o), direction("normal"), size("radius", sizes(1))],
        T::Sphere => vec![point("center", o), size("radius", sizes(1))],
        T::Cylinder => {
            vec![point("axis_point", o), direction("axis_direction"), size("radius", sizes(1))]
        }
        T::Cone => {
            let sign = pose.size[1].signum();
            let apex = o - pose.w() * (pose.size[0] / pose.size[1].tan());
            let mut along = direction("axis_direction");
            along.values.iter_mut().for_each(|v| *v *= sign);
            let angle = Term {
                name: "half_angle",
                values: vec![pose.size[1].abs()],
                nature: Nature::Angle,
            };
            vec![point("apex", &apex), along, angle]
        }
        T::EllipticCylinder => vec![
            point("axis_point", o),
            direction("axis_direction"),
            size("semi_axes", sizes(2)),
            axes(2),
        ],
        T::Ellipsoid => vec![point("center", o), size("semi_axes", sizes(3)), axes(3)],
        T::Torus => vec![
            point("center", o),
            direction("axis_direction"),
            size("major_radius", vec![pose.size[0]]),
            size("minor_radius", vec![pose.size[1]]),
        ],
    }
}

/// Places of the sizes in the order they are told: semi-axes from the largest on.
fn order(pose: &Pose) -> [usize; 3] {
    let mut order = [0, 1, 2];
    let count = match pose.kind {
        FeatureType::EllipticCylinder => 2,
        FeatureType::Ellipsoid => 3,
        _ => 0,
    };
    order[..count].sort_by(|&a, &b| pose.size[b].total_cmp(&pose.size[a]));
    order
}

/// The direction of the k-th semi-axis, the frame kept right-handed as the surface has it.
fn semi_axis(pose: &Pose, order: &[usize; 3], k: usize) -> Vec3 {
    let d = |i: usize| pose.frame.column(i).into_owned();
    match (pose.kind, k) {
        (FeatureType::EllipticCylinder, 1) if order[0] == 1 => -d(0),
        (FeatureType::Ellipsoid, 2) => d(order[0]).cross(&d(order[1])),
        _ => d(order[k]),
    }
}

/// Derivatives of all components of the parameters (rows) by the nine places of a step (columns), by central differences of the
/// parameters alone: they are smooth, of about unit size, and right to ten digits so.
pub fn changes(pose: &Pose) -> DMatrix<f64> {
    const STEP: f64 = 1e-5;
    let components =
        |pose: &Pose| -> Vec<f64> { terms(pose).into_iter().flat_map(|t| t.values).collect() };
    let rows = components(pose).len();
    let mut out = DMatrix::zeros(rows, SLOTS);
    for &slot in pose.kind.slots() {
        let at = |side: f64| {
            let mut step = [0.0; SLOTS];
            // No semi-axis may pass another, or what is first and second would change.
            step[slot] = side * STEP * room(pose, slot);
            pose.stepped(&step).map(|p| components(&p))
        };
        let (Some(ahead), Some(behind)) = (at(1.0), at(-1.0)) else { continue };
        for row in 0..rows {
            out[(row, slot)] = (ahead[row] - behind[row]) / (2.0 * STEP * room(pose, slot));
        }
    }
    out
}

/// What of a whole step a size may take.
fn room(pose: &Pose, slot: usize) -> f64 {
    if slot < 6 {
        return 1.0;
    }
    let own = pose.size[slot - 6];
    let apart = |i: usize| (pose.size[i] - own).abs();
    let others = (0..3).filter(|&i| i != slot - 6 && pose.size[i] > 0.0).map(apart);
    match pose.kind {
        FeatureType::EllipticCylinder | FeatureType::Ellipsoid => {
            others.fold(1.0, f64::min).max(1e-6)
        }
        _ => 1.0_f64.min(own.abs()).max(1e-6),
    }
}
