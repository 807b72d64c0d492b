//! Where the fits of a family begin.

use super::Families;
use crate::fit::constant::constants;
use crate::fit::local_quadric::{LocalQuadric, LocalQuadrics};
use crate::fit::starts::Patch;
use crate::fit::{Family, Shape, starts};

constants! {
    /// How far off a simpler shape a start of a richer family lies: a share of its size, or a half angle.
    BESIDE: f64 = 0.05, Effort("steps of a fit from there");
}

impl Families {
    /// Starts of one family: shapes of it (or one step simpler) already seen, then cold ones.
    pub(super) fn starts(
        &self,
        family: Family,
        patch: &Patch<'_>,
        seen: &[Shape],
        quadrics: &LocalQuadrics<'_>,
    ) -> Vec<Shape> {
        let p = patch.points;
        let mut out: Vec<Shape> =
            seen.iter().rev().filter(|s| s.family == family).copied().collect();
        match family {
            Family::Plane => out.extend(starts::plane(p)),
            Family::Sphere => out.extend(starts::sphere(p)),
            Family::Cylinder => out.extend(
                starts::cylinder_axes(patch, quadrics.taubin())
                    .iter()
                    .filter_map(|w| starts::cylinder(p, w)),
            ),
            Family::Cone => {
                out.extend(starts::cone(patch));
                for s in seen.iter().filter(|s| s.family == Family::Cylinder) {
                    for half in [BESIDE.get(), -BESIDE.get()] {
                        out.push(Shape { family, size: [s.size[0], half, 0.0], ..*s });
                    }
                }
            }
            Family::EllipticCylinder => {
                out.extend(
                    starts::cylinder_axes(patch, quadrics.taubin())
                        .iter()
                        .filter_map(|w| starts::elliptic_cylinder(p, w)),
                );
                for s in seen.iter().filter(|s| s.family == Family::Cylinder) {
                    out.push(Shape {
                        family,
                        size: [s.size[0] * (1.0 + BESIDE.get()), s.size[0], 0.0],
                        ..*s
                    });
                }
            }
            Family::Torus => out.extend(starts::torus(patch)),
            Family::Ellipsoid => {
                out.extend(quadrics.taubin().and_then(LocalQuadric::ellipsoid));
                out.extend(quadrics.specific().as_ref().and_then(LocalQuadric::ellipsoid));
                for s in seen.iter().filter(|s| s.family == Family::Sphere) {
                    out.push(Shape {
                        family,
                        size: [
                            s.size[0] * (1.0 + BESIDE.get()),
                            s.size[0],
                            s.size[0] * (1.0 - BESIDE.get()),
                        ],
                        ..*s
                    });
                }
            }
        }
        out
    }
}
