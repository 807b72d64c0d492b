use nalgebra::DMatrix;

use super::descend::Freedoms;
use super::kind::FeatureType;
use super::pose::{Pose, SLOTS};
use super::small::Square;
use crate::geometry::Vec3;

/// How well points determine a feature.
#[derive(Clone, Debug, PartialEq)]
pub struct Condition {
    /// Condition number of the derivatives of the distances by the degrees of freedom, angles in radians and lengths in units of the
    /// points' size: by how much more the best told combination of them is told than the worst.
    pub number: f64,
    /// What the worst told combination is, in words.
    pub weakest: String,
}

/// Beyond this condition number rounding alone decides.
const SINGULAR: f64 = 1e7;

impl Condition {
    /// Whether the points leave a combination free.
    pub fn is_singular(&self) -> bool {
        self.number.is_nan() || self.number >= SINGULAR
    }
}

/// That of a pose with J'J.
pub fn condition(pose: &Pose, jj: &Square, free: &Freedoms) -> Condition {
    let p = free.count();
    if p == 0 {
        return Condition { number: 1.0, weakest: "nothing is left to fit".to_owned() };
    }
    let e = DMatrix::from_fn(p, p, |a, b| jj[a][b]).symmetric_eigen();
    let (least, most) = (e.eigenvalues.imin(), e.eigenvalues.max());
    let number = (most / e.eigenvalues[least].max(0.0)).sqrt();
    let mut step = [0.0; SLOTS];
    for (a, &slot) in free.slots().iter().enumerate() {
        step[slot] = e.eigenvectors[(a, least)];
    }
    Condition { number, weakest: in_words(pose, &step) }
}

/// Parts of a combination that are less than this of the whole are not told.
const TOLD: f64 = 0.3;

fn in_words(pose: &Pose, step: &[f64; SLOTS]) -> String {
    let vector = |at: usize| pose.frame * Vec3::new(step[at], step[at + 1], step[at + 2]);
    let along = |v: Vec3| {
        // Either way is meant: the one with the largest part positive is told.
        let d = v.normalize() * v[v.iamax()].signum();
        let d = d.map(|c| if c.abs() < 5e-4 { 0.0 } else { c });
        format!("[{:.3}, {:.3}, {:.3}]", d.x, d.y, d.z)
    };
    let mut parts: Vec<(f64, String)> = Vec::new();
    let (shift, turn) = (vector(0), vector(3));
    if shift.norm() > TOLD {
        parts.push((shift.norm(), format!("position along {}", along(shift))));
    }
    if turn.norm() > TOLD {
        parts.push((turn.norm(), format!("rotation about {}", along(turn))));
    }
    let names: [&str; 3] = match pose.kind {
        FeatureType::Cone => ["radius beside the points", "half angle", ""],
        FeatureType::Torus => ["major radius", "minor radius", ""],
        FeatureType::EllipticCylinder | FeatureType::Ellipsoid => {
            ["first semi-axis", "second semi-axis", "third semi-axis"]
        }
        _ => ["radius", "", ""],
    };
    for (k, name) in names.into_iter().enumerate() {
        if step[6 + k].abs() > TOLD {
            parts.push((step[6 + k].abs(), name.to_owned()));
        }
    }
    parts.sort_by(|a, b| b.0.total_cmp(&a.0));
    let words: Vec<_> = parts.into_iter().map(|p| p.1).collect();
    words.join(" together with ")
}
