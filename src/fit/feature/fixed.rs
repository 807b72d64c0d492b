use super::descend::Freedoms;
use super::kind::FeatureType;
use super::pose::Pose;
use crate::geometry::Vec3;

/// Values of a feature that are not fitted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fixed {
    /// Radius of a sphere, cylinder or circle, > 0.
    pub radius: Option<f64>,
    /// Direction of the axis, of the line, or of the normal of a plane or circle; of any length above 0.
    pub axis: Option<Vec3>,
    /// Half angle of a cone, in radians, above 0 and below pi/2.
    pub half_angle: Option<f64>,
}

impl Fixed {
    /// The first that a type does not have, by name.
    pub fn refused_by(&self, kind: FeatureType) -> Option<&'static str> {
        use FeatureType::{Circle, Cone, Cylinder, Ellipsoid, Sphere};
        if self.radius.is_some() && !matches!(kind, Sphere | Cylinder | Circle) {
            return Some("radius");
        }
        if self.axis.is_some() && matches!(kind, Sphere | Ellipsoid) {
            return Some("axis");
        }
        (self.half_angle.is_some() && kind != Cone).then_some("half_angle")
    }

    /// What is fixed, by name.
    pub fn names(&self) -> Vec<&'static str> {
        let all = [
            ("radius", self.radius.is_some()),
            ("axis", self.axis.is_some()),
            ("half_angle", self.half_angle.is_some()),
        ];
        all.into_iter().filter_map(|(name, is_fixed)| is_fixed.then_some(name)).collect()
    }

    /// Whether nothing is fixed.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// The degrees of freedom of `kind` that are left.
    pub fn freedoms(&self, kind: FeatureType) -> Freedoms {
        let held = |slot: usize| {
            matches!(slot, 3 | 4) && self.axis.is_some()
                || slot == 6 && self.radius.is_some()
                || slot == 7 && self.half_angle.is_some()
        };
        Freedoms::of(kind.slots().iter().copied().filter(|&slot| !held(slot)))
    }

    /// A start with the fixed values.
    ///
    /// A radius that is another than the start's moves the centre, so that the surface stays at the points, whose middle
    /// is zero.
    pub fn applied(&self, pose: &Pose) -> Pose {
        let mut pose = *pose;
        if let Some(radius) = self.radius {
            let out = -pose.origin;
            let is_one_sided = out.norm() > ONE_SIDE * pose.size[0];
            if is_one_sided && pose.kind != FeatureType::Circle {
                let w = pose.w();
                let out =
                    if pose.kind == FeatureType::Cylinder { out - w * out.dot(&w) } else { out };
                pose.origin += out.normalize() * (pose.size[0] - radius);
            }
            pose.size[0] = radius;
        }
        if let Some(angle) = self.half_angle {
            pose.size[1] = angle.copysign(pose.size[1]);
        }
        pose
    }

    /// The same where lengths are `scale` times as long.
    pub fn scaled(&self, scale: f64) -> Self {
        Self {
            radius: self.radius.map(|r| r * scale),
            axis: self.axis.map(|a| a.normalize()),
            ..*self
        }
    }
}

/// Distance of the points' middle from the centre, in radii, from which on they lie to one side of it.
const ONE_SIDE: f64 = 0.3;
