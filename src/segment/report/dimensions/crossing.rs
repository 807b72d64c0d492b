//! Where along its axis a surface ends at a neighbour.

use crate::fit::constant::constants;
use crate::fit::{Family, Shape};
use crate::geometry::Vec3;
use crate::segment::Continuity;

constants! {
    /// Sine of the angle up to which two axes count as parallel, or as perpendicular.
    PARALLEL: f64 = 0.1, Trial(0.1, 0.1);
    /// Distance between two axes, or of a centre from one, up to which surfaces count as coaxial, in radii.
    COAXIAL: f64 = 0.15, Trial(0.15, 0.15);
    /// Least cosine between a plane's normal and an axis that it bounds: beyond 60 degrees the end is a side.
    LEAST_COSINE: f64 = 0.5, Derived("60 degrees: beyond, the points spread further along the axis than across");
}

/// Height over its origin at which the axis of `own` (a cylinder, elliptic cylinder or cone) ends at `other`, the one
/// next to `near`; `None` where these two surfaces have no common end.
///
/// Surfaces that are coaxial meet where their sections do; where they run into each other smoothly, a section through
/// the axis touches: at the foot of the circle's centre on the line. A pipe runs into an elbow in the plane through the
/// elbow's axis.
pub fn height(own: &Shape, other: &Shape, continuity: Continuity, near: f64) -> Option<f64> {
    let w = own.w();
    let to = other.origin - own.origin;
    if other.family == Family::Plane {
        let cosine = w.dot(&other.w());
        return (cosine.abs() > LEAST_COSINE.get()).then(|| to.dot(&other.w()) / cosine);
    }
    let along = to.dot(&w);
    let aside = (to - along * w).norm();
    if is_elbow(own, other, aside) {
        return Some(along);
    }
    if aside > COAXIAL.get() * own.max_radius().min(other.max_radius()) {
        return None;
    }
    let circle = |centre: [f64; 2], radius| at_circle(own, centre, radius, continuity, near);
    match other.family {
        Family::Sphere => circle([0.0, along], other.size[0]),
        Family::Ellipsoid => (continuity == Continuity::G1).then_some(along),
        _ if w.cross(&other.w()).norm() > PARALLEL.get() => None,
        Family::Torus => circle([other.size[0], along], other.size[1]),
        Family::Cylinder | Family::Cone => at_line(own, other, along),
        Family::EllipticCylinder | Family::Plane => None,
    }
}

/// Whether `other` is a torus into whose tube the cylinder `own` runs, its axis `aside` from the torus' centre.
fn is_elbow(own: &Shape, other: &Shape, aside: f64) -> bool {
    own.family == Family::Cylinder
        && other.family == Family::Torus
        && own.w().dot(&other.w()).abs() < PARALLEL.get()
        && (aside - other.size[0]).abs() < COAXIAL.get() * other.size[1]
        && (own.size[0] - other.size[1]).abs() < COAXIAL.get() * other.size[1]
}

/// Radius at the origin and its growth with height.
fn line(shape: &Shape) -> Option<[f64; 2]> {
    match shape.family {
        Family::Cylinder => Some([shape.size[0], 0.0]),
        Family::Cone => Some([shape.size[0], shape.size[1].tan()]),
        _ => None,
    }
}

/// Where the section of `own` meets that of a coaxial cylinder or cone whose origin is `along` further up.
fn at_line(own: &Shape, other: &Shape, along: f64) -> Option<f64> {
    let ([r, k], [s, l]) = (line(own)?, line(other)?);
    let l = l * own.w().dot(&other.w()).signum();
    ((k - l).abs() > PARALLEL.get()).then(|| (s - l * along - r) / (k - l))
}

/// Where the section of `own` meets a circle; radius and height of its `centre`.
fn at_circle(
    own: &Shape,
    centre: [f64; 2],
    radius: f64,
    continuity: Continuity,
    near: f64,
) -> Option<f64> {
    let [r, k] = line(own)?;
    // Along the line (r + k t, t) by its unit direction.
    let norm = (1.0 + k * k).sqrt();
    let foot = (k * (centre[0] - r) + centre[1]) / (norm * norm);
    if continuity == Continuity::G1 {
        return Some(foot);
    }
    let aside = (centre[0] - r - k * centre[1]) / norm;
    let half = (radius * radius - aside * aside).max(0.0).sqrt() / norm;
    let nearer = if (foot + half - near).abs() < (foot - half - near).abs() { half } else { -half };
    Some(foot + nearer)
}

/// Direction, from a torus' centre, of the place on the tube's middle line where it ends at `other`, next to the
/// direction `near`; `None` where these two surfaces have no common end.
pub fn direction(torus: &Shape, other: &Shape, near: &Vec3) -> Option<Vec3> {
    let w = torus.w();
    let to = other.origin - torus.origin;
    let across = match other.family {
        Family::Plane => return at_plane(torus, other, near),
        Family::Cylinder | Family::Cone if other.w().dot(&w).abs() < PARALLEL.get() => {
            w.cross(&other.w())
        }
        Family::Torus if other.w().cross(&w).norm() > PARALLEL.get() => {
            w.cross(&w.cross(&other.w()))
        }
        Family::Torus => to - w * to.dot(&w),
        _ => return None,
    };
    let across = across.try_normalize(1e-9)?;
    Some(if across.dot(near) < 0.0 { -across } else { across })
}

/// The same where a plane cuts the middle line.
fn at_plane(torus: &Shape, plane: &Shape, near: &Vec3) -> Option<Vec3> {
    let (w, n) = (torus.w(), plane.w());
    let level = n - w * n.dot(&w);
    let size = level.norm();
    if size < LEAST_COSINE.get() {
        return None;
    }
    let level = level / size;
    let cosine = (plane.origin - torus.origin).dot(&n) / (size * torus.size[0]);
    if cosine.abs() > 1.0 {
        return None;
    }
    let side = w.cross(&level) * (1.0 - cosine * cosine).sqrt();
    let [a, b] = [level * cosine + side, level * cosine - side];
    Some(if a.dot(near) > b.dot(near) { a } else { b })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shape(family: Family, origin: [f64; 3], w: Vec3, size: [f64; 3]) -> Shape {
        Shape::with_axis(family, origin.into(), w, size)
    }

    #[test]
    fn a_bore_ends_where_each_kind_of_neighbour_meets_it() {
        let (z, g0, g1) = (Vec3::z(), Continuity::G0, Continuity::G1);
        let bore = shape(Family::Cylinder, [0.0, 0.0, 1.0], z, [5.0, 0.0, 0.0]);
        let inclined = Vec3::new(0.6, 0.0, 0.8);
        let cases = [
            (shape(Family::Plane, [3.0, 2.0, 11.0], z, [0.0; 3]), g0, Some(10.0)),
            (shape(Family::Plane, [0.0, 7.0, 11.0], inclined, [0.0; 3]), g0, Some(10.0)),
            (shape(Family::Plane, [5.0, 0.0, 0.0], Vec3::x(), [0.0; 3]), g0, None),
            // A countersink of 90 degrees, wide at the top, and the same upside down in the room.
            (
                shape(Family::Cone, [0.0, 0.0, 13.0], z, [7.0, 0.25 * std::f64::consts::PI, 0.0]),
                g0,
                Some(10.0),
            ),
            (
                shape(Family::Cone, [0.0, 0.0, 13.0], -z, [7.0, -0.25 * std::f64::consts::PI, 0.0]),
                g0,
                Some(10.0),
            ),
            (shape(Family::Sphere, [0.0, 0.0, 11.0], z, [5.0, 0.0, 0.0]), g1, Some(10.0)),
            (shape(Family::Sphere, [0.0, 0.0, 15.0], z, [41f64.sqrt(), 0.0, 0.0]), g0, Some(10.0)),
            // A fillet around the mouth, and an elbow.
            (shape(Family::Torus, [0.0, 0.0, 11.0], z, [7.0, 2.0, 0.0]), g1, Some(10.0)),
            (shape(Family::Torus, [12.0, 0.0, 11.0], Vec3::y(), [12.0, 5.0, 0.0]), g1, Some(10.0)),
            (shape(Family::Cylinder, [0.0, 0.0, 11.0], Vec3::x(), [5.0, 0.0, 0.0]), g0, None),
        ];
        for (other, continuity, expected) in cases {
            let found = height(&bore, &other, continuity, 9.5);
            let same = match (found, expected) {
                (Some(a), Some(b)) => (a - b).abs() < 1e-9,
                (a, b) => a == b,
            };
            assert!(same, "{other:?}: {found:?}");
        }
    }

    #[test]
    fn an_elbow_ends_where_each_kind_of_neighbour_meets_it() {
        let elbow = shape(Family::Torus, [0.0; 3], Vec3::z(), [12.0, 5.0, 0.0]);
        let near = Vec3::new(1.0, 0.2, 0.0);
        let (x, y) = (Vec3::x(), Vec3::y());
        let cases = [
            (shape(Family::Cylinder, [12.0, -9.0, 0.0], y, [5.0, 0.0, 0.0]), Some(x)),
            (shape(Family::Plane, [15.0, 0.0, 2.0], -y, [0.0; 3]), Some(x)),
            (
                shape(Family::Plane, [0.0, 6.0, 0.0], y, [0.0; 3]),
                Some(Vec3::new(0.75f64.sqrt(), 0.5, 0.0)),
            ),
            (shape(Family::Torus, [24.0, 0.0, 0.0], -Vec3::z(), [12.0, 5.0, 0.0]), Some(x)),
            (shape(Family::Torus, [12.0, 0.0, 12.0], x, [12.0, 5.0, 0.0]), Some(x)),
            (shape(Family::Sphere, [12.0, 0.0, 0.0], y, [5.0, 0.0, 0.0]), None),
        ];
        for (other, expected) in cases {
            match (direction(&elbow, &other, &near), expected) {
                (Some(a), Some(b)) => assert!((a - b).norm() < 1e-9, "{other:?}: {a}"),
                (a, b) => assert_eq!(a, b, "{other:?}"),
            }
        }
    }
}
