//! Which curve two surfaces share: a straight line, an ellipse, or one without a name.

use crate::fit::constant::constants;
use crate::geometry::{Mat3, Surface, Vec3};

use super::sheet::Sheet;

constants! {
    /// Relative difference of an ellipse's axes below which it is written as a circle.
    ROUND: f64 = 1e-10, Trial(1e-10, 1e-10);
    /// Axes of an ellipse up to this many times each other are written as one: beyond, it is a line for all purposes, and its
    /// centre far away.
    LONG: f64 = 1e3, Trial(1e3, 1e3);
}

/// The kind of a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    /// A straight line.
    Line,
    /// An ellipse: its centre, unit directions of its axes and their half lengths, the larger first.
    Ellipse {
        /// Centre.
        center: Vec3,
        /// Directions of the axes.
        axes: [Vec3; 2],
        /// Half lengths.
        semi_axes: [f64; 2],
    },
    /// Any other; it is written as a spline.
    Free,
}

/// The form of the curve of two surfaces, some of whose points are given.
pub fn form(f: &Sheet, g: &Sheet, points: &[Vec3]) -> Form {
    let found = match (&f.surface, &g.surface) {
        (Surface::Plane(_), Surface::Plane(_)) => Form::Line,
        (Surface::Plane(p), _) => section(p.point, p.normal, g),
        (_, Surface::Plane(p)) => section(p.point, p.normal, f),
        _ => Form::Free,
    };
    // What a curve is must be true of its points.
    let size = points.iter().map(|p| p.norm()).fold(1.0, f64::max);
    let fits = match &found {
        Form::Line => {
            let (a, b) = (points[0], points[points.len() - 1]);
            let d = (b - a).normalize();
            points.iter().all(|p| (p - a).cross(&d).norm() < 1e-10 * size)
        }
        Form::Ellipse { center, axes, semi_axes } => points.iter().all(|p| {
            let d = p - center;
            let (x, y) = (d.dot(&axes[0]) / semi_axes[0], d.dot(&axes[1]) / semi_axes[1]);
            (x.hypot(y) - 1.0).abs() * semi_axes[1] < 1e-9 * size
        }),
        Form::Free => true,
    };
    if fits { found } else { Form::Free }
}

/// The section of a quadric with the plane through `point`.
fn section(point: Vec3, normal: Vec3, of: &Sheet) -> Form {
    if let Surface::Cylinder(c) = &of.surface {
        // A plane along the axis, exactly.
        if normal.dot(&c.axis_direction).abs() < 1e-14 {
            return Form::Line;
        }
    }
    let Some(quadric) = matrix(of) else { return Form::Free };
    let (q, c, rhs) = quadric;
    let (u, v) = crate::geometry::perpendicular_frame(&normal);
    // (x0 + s u + t v - c)' Q (...) = rhs about the foot of c on the plane.
    let x0 = c - normal * normal.dot(&(c - point));
    let d = x0 - c;
    let (uu, uv, vv) = ((q * u).dot(&u), (q * u).dot(&v), (q * v).dot(&v));
    let (lu, lv, k) = ((q * d).dot(&u), (q * d).dot(&v), (q * d).dot(&d) - rhs);
    let determinant = uu * vv - uv * uv;
    if determinant <= 0.0 {
        return Form::Free;
    }
    let (s, t) = ((uv * lv - vv * lu) / determinant, (uv * lu - uu * lv) / determinant);
    let level = -(k + lu * s + lv * t);
    let turn = 0.5 * (2.0 * uv).atan2(uu - vv);
    let (sin, cos) = turn.sin_cos();
    let first = uu * cos * cos + 2.0 * uv * sin * cos + vv * sin * sin;
    let second = uu + vv - first;
    let (a, b) = ((level / first).sqrt(), (level / second).sqrt());
    if !(a.is_finite() && b.is_finite() && a > 0.0 && b > 0.0 && a.max(b) < LONG.get() * a.min(b)) {
        return Form::Free;
    }
    let center = x0 + u * s + v * t;
    let (e, f) = (u * cos + v * sin, v * cos - u * sin);
    let (axes, semi_axes) = if a >= b { ([e, f], [a, b]) } else { ([f, -e], [b, a]) };
    let round = semi_axes[0] - semi_axes[1] < ROUND.get() * semi_axes[0];
    let semi_axes = if round { [(a + b) / 2.0; 2] } else { semi_axes };
    Form::Ellipse { center, axes, semi_axes }
}

/// (x - c)' Q (x - c) = rhs.
fn matrix(of: &Sheet) -> Option<(Mat3, Vec3, f64)> {
    let across = |w: &Vec3| Mat3::identity() - w * w.transpose();
    Some(match &of.surface {
        Surface::Sphere(s) => (Mat3::identity(), s.center, s.radius * s.radius),
        Surface::Cylinder(s) => (across(&s.axis_direction), s.axis_point, s.radius * s.radius),
        Surface::Cone(s) => {
            let w = &s.axis_direction;
            (Mat3::identity() - w * w.transpose() / s.half_angle.cos().powi(2), s.apex, 0.0)
        }
        Surface::EllipticCylinder(s) => {
            (central(&s.semi_axis_directions, &s.semi_axes), s.axis_point, 1.0)
        }
        Surface::Ellipsoid(s) => (central(&s.semi_axis_directions, &s.semi_axes), s.center, 1.0),
        Surface::Plane(_) | Surface::Torus(_) => return None,
    })
}

fn central(directions: &[Vec3], semi_axes: &[f64]) -> Mat3 {
    let one = |(d, a): (&Vec3, &f64)| d * d.transpose() / (a * a);
    directions.iter().zip(semi_axes).map(one).sum()
}

#[cfg(test)]
mod tests {
    use super::super::curve::{Curve, meet};
    use super::*;
    use crate::geometry::{Cone, Cylinder, Ellipsoid, Sphere, Torus};

    #[test]
    fn sections_with_planes_are_the_ellipses_that_their_points_lie_on() {
        let z = Vec3::z();
        let tilted = Vec3::new(0.0, 0.6, 0.8);
        let cases = [
            (Surface::Sphere(Sphere { center: Vec3::zeros(), radius: 5.0 }), [4.0, 4.0]),
            (
                Surface::Cylinder(Cylinder {
                    axis_point: Vec3::zeros(),
                    axis_direction: z,
                    radius: 4.0,
                }),
                [5.0, 4.0],
            ),
            (
                Surface::Cone(Cone {
                    apex: Vec3::new(0.0, 0.0, -9.0),
                    axis_direction: z,
                    half_angle: 0.3,
                }),
                [0.0, 0.0],
            ),
            (
                Surface::Ellipsoid(Ellipsoid {
                    center: Vec3::zeros(),
                    semi_axes: [9.0, 7.0, 5.0],
                    semi_axis_directions: [Vec3::y(), z, Vec3::x()],
                }),
                [0.0, 0.0],
            ),
        ];
        for (surface, expected) in cases {
            let (a, b) = (Sheet::new(&surface, &Vec3::zeros()), Sheet::plane(tilted * 3.0, tilted));
            let start = meet(&a, &b, &Vec3::new(4.0, 1.0, 3.0)).unwrap();
            let curve = Curve::through(&a, &b, start, 2.0, |_| true).unwrap();
            assert!(curve.closed);
            // `form` has compared it with every point.
            let Form::Ellipse { semi_axes, .. } = curve.form else { panic!("{surface:?}") };
            if expected[0] > 0.0 {
                assert!(
                    (semi_axes[0] - expected[0]).abs() < 1e-9
                        && (semi_axes[1] - expected[1]).abs() < 1e-9
                );
            }
        }
        let ring = Torus {
            center: Vec3::zeros(),
            axis_direction: z,
            major_radius: 6.0,
            minor_radius: 2.0,
        };
        let (a, b) = (Sheet::new(&Surface::Torus(ring), &Vec3::zeros()), Sheet::plane(z, z));
        let start = meet(&a, &b, &Vec3::new(7.0, 0.0, 1.0)).unwrap();
        assert_eq!(Curve::through(&a, &b, start, 1.0, |_| true).unwrap().form, Form::Free);
    }
}
