//! Engineering parameters of a quadric: centre, axes, radii, apex.

use super::classify::{CanonicalForm, QuadricType};
use super::{
    Cone, Cylinder, Ellipsoid, EllipticCylinder, Frame, Plane, Quadric, Sphere, Surface,
    SurfaceType, Torus, Vec3,
};

/// How far coefficients may be from their ideal values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Eigenvalues, slopes and constants below this share of the largest eigenvalue of e, in the
    /// points' own frame, are zero. So no ellipse is longer than the root of its inverse times its width.
    pub rank: f64,
    /// Semi-axes (of a cone: slopes) that differ by less than this share are equal.
    pub equal: f64,
}

impl Default for Tolerance {
    /// 1 % each: above the scatter of a fit to clean scans, below what differs by design.
    fn default() -> Self {
        Self { rank: 0.01, equal: 0.01 }
    }
}

/// A quadric's type, and its engineering parameters where it is one of the explicit surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recovered {
    /// The type among those that results name.
    pub surface_type: SurfaceType,
    /// The parameters; the quadric's points nearest to the frame's origin choose the sheet of
    /// parallel planes and the nappe of a cone.
    pub surface: Option<Surface>,
}

/// Names `quadric` (in world coordinates) and recovers its parameters.
///
/// `frame` must be centred on the quadric's points and about their size. `None` for quadrics without
/// a real surface and for two intersecting planes.
pub fn recover(quadric: &Quadric, frame: &Frame, tolerance: Tolerance) -> Option<Recovered> {
    recover_local(&frame.local_quadric(quadric), frame, tolerance)
}

/// The same of the quadric that is `local` in `frame`, for clouds so far from the origin that world coefficients
/// cancel.
pub fn recover_local(local: &Quadric, frame: &Frame, tolerance: Tolerance) -> Option<Recovered> {
    let Some(form) = CanonicalForm::of(local, tolerance.rank) else {
        return plane(&Vec3::zeros(), &local.linear(), local.0[9]).map(|p| named(p, frame));
    };
    let only_type = |surface_type| Some(Recovered { surface_type, surface: None });
    match form.quadric_type() {
        QuadricType::RealEllipsoid => Some(named(ellipsoid(&form, tolerance.equal), frame)),
        QuadricType::RealEllipticCylinder => Some(named(cylinder(&form, tolerance.equal), frame)),
        QuadricType::RealCone => match cone(&form, tolerance.equal) {
            Some(surface) => Some(named(surface, frame)),
            None => only_type(SurfaceType::EllipticCone),
        },
        QuadricType::RealParallelPlanes | QuadricType::CoincidentPlanes => {
            nearest_sheet(&form).map(|p| named(p, frame))
        }
        QuadricType::EllipticParaboloid => only_type(SurfaceType::EllipticParaboloid),
        QuadricType::HyperbolicParaboloid => only_type(SurfaceType::HyperbolicParaboloid),
        QuadricType::HyperboloidOneSheet => only_type(SurfaceType::HyperboloidOneSheet),
        QuadricType::HyperboloidTwoSheets => only_type(SurfaceType::HyperboloidTwoSheets),
        QuadricType::ParabolicCylinder => only_type(SurfaceType::ParabolicCylinder),
        QuadricType::HyperbolicCylinder => only_type(SurfaceType::HyperbolicCylinder),
        QuadricType::ImaginaryEllipsoid
        | QuadricType::ImaginaryCone
        | QuadricType::ImaginaryEllipticCylinder
        | QuadricType::RealIntersectingPlanes
        | QuadricType::ImaginaryIntersectingPlanes
        | QuadricType::ImaginaryParallelPlanes => None,
    }
}

/// The local surface in world coordinates, under its name.
fn named(local: Surface, frame: &Frame) -> Recovered {
    let (at, s) = (|x: &Vec3| frame.world_from_local(x), frame.scale);
    let surface = match local {
        Surface::Plane(p) => Surface::Plane(Plane { point: at(&p.point), ..p }),
        Surface::Sphere(p) => {
            Surface::Sphere(Sphere { center: at(&p.center), radius: p.radius * s })
        }
        Surface::Cylinder(p) => {
            Surface::Cylinder(Cylinder { axis_point: at(&p.axis_point), radius: p.radius * s, ..p })
        }
        Surface::EllipticCylinder(p) => Surface::EllipticCylinder(EllipticCylinder {
            axis_point: at(&p.axis_point),
            semi_axes: p.semi_axes.map(|a| a * s),
            ..p
        }),
        Surface::Cone(p) => Surface::Cone(Cone { apex: at(&p.apex), ..p }),
        Surface::Ellipsoid(p) => Surface::Ellipsoid(Ellipsoid {
            center: at(&p.center),
            semi_axes: p.semi_axes.map(|a| a * s),
            ..p
        }),
        Surface::Torus(p) => Surface::Torus(Torus {
            center: at(&p.center),
            major_radius: p.major_radius * s,
            minor_radius: p.minor_radius * s,
            ..p
        }),
    };
    Recovered { surface_type: surface.surface_type(), surface: Some(surface) }
}

/// The plane normal . x + constant = 0 by its point nearest to `from`.
fn plane(from: &Vec3, normal: &Vec3, constant: f64) -> Option<Surface> {
    let length = normal.norm();
    (length > 0.0).then(|| {
        let unit = normal / length;
        let point = from - unit * ((normal.dot(from) + constant) / length);
        Surface::Plane(Plane { point, normal: unit })
    })
}

/// Of the planes curvature t^2 + constant = 0, the one nearer to the frame's origin.
fn nearest_sheet(form: &CanonicalForm) -> Option<Surface> {
    let normal = form.directions[0];
    let half_gap = (-form.constant / form.curvatures[0]).max(0.0).sqrt();
    let middle = normal.dot(&form.center);
    let offset = if middle > 0.0 { middle - half_gap } else { middle + half_gap };
    plane(&Vec3::zeros(), &normal, -offset)
}

fn nearly_equal(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * a.max(b)
}

fn ellipsoid(form: &CanonicalForm, equal: f64) -> Surface {
    // Curvatures fall, so semi-axes rise; results list the largest first.
    let [c, b, a] = form.curvatures.map(|k| (-form.constant / k).sqrt());
    if nearly_equal(a, c, equal) {
        return Surface::Sphere(Sphere { center: form.center, radius: (a * b * c).cbrt() });
    }
    let [_, v, u] = form.directions;
    Surface::Ellipsoid(Ellipsoid {
        center: form.center,
        semi_axes: [a, b, c],
        semi_axis_directions: [u, v, u.cross(&v)],
    })
}

fn cylinder(form: &CanonicalForm, equal: f64) -> Surface {
    let semi_axis = |k: f64| (-form.constant / k).sqrt();
    let (b, a) = (semi_axis(form.curvatures[0]), semi_axis(form.curvatures[1]));
    let [v, u, _] = form.directions;
    let w = u.cross(&v);
    if nearly_equal(a, b, equal) {
        let radius = (a * b).sqrt();
        return Surface::Cylinder(Cylinder { axis_point: form.center, axis_direction: w, radius });
    }
    Surface::EllipticCylinder(EllipticCylinder {
        axis_point: form.center,
        axis_direction: w,
        semi_axes: [a, b],
        semi_axis_directions: [u, v],
    })
}

/// The right circular cone, or `None` where the section is an ellipse.
fn cone(form: &CanonicalForm, equal: f64) -> Option<Surface> {
    let positive = form.curvatures.iter().filter(|k| **k > 0.0).count();
    let odd_sign = if positive == 1 { 1.0 } else { -1.0 };
    let odd = form.curvatures.iter().position(|k| k * odd_sign > 0.0)?;
    let slope = |i: usize| (-form.curvatures[odd] / form.curvatures[i]).sqrt();
    let (s, t) = (slope((odd + 1) % 3), slope((odd + 2) % 3));
    let axis = form.directions[odd];
    let toward_points = if axis.dot(&form.center) > 0.0 { -axis } else { axis };
    nearly_equal(s, t, equal).then(|| {
        let half_angle = (s * t).sqrt().atan();
        Surface::Cone(Cone { apex: form.center, axis_direction: toward_points, half_angle })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Frame = Frame { origin: Vec3::new(100.0, 50.0, -30.0), scale: 12.0 };

    fn round_trip(surface: Surface) -> Surface {
        let found = recover(&surface.quadric().unwrap(), &FRAME, Tolerance::default());
        let found = found.expect("a real surface");
        assert_eq!(found.surface_type, surface.surface_type());
        found.surface.expect("an explicit surface")
    }

    fn near(a: Vec3, b: Vec3) -> bool {
        (a - b).norm() < 1e-6
    }

    #[test]
    fn a_plane_comes_back() {
        let normal = Vec3::new(1.0, 2.0, -2.0) / 3.0;
        let point = FRAME.origin + Vec3::new(2.0, 1.0, 0.5);
        let Surface::Plane(p) = round_trip(Surface::Plane(Plane { point, normal })) else {
            panic!()
        };
        assert!(near(p.normal, normal) && normal.dot(&(p.point - point)).abs() < 1e-9);
    }

    #[test]
    fn the_nearer_of_two_parallel_planes_is_taken() {
        let e = super::super::Mat3::from_diagonal(&Vec3::new(1.0, 0.0, 0.0));
        let local = Quadric::from_parts(&e, &Vec3::new(-0.2, 0.0, 0.0), -0.99);
        let found = recover(&FRAME.world_quadric(&local), &FRAME, Tolerance::default());
        let Some(Surface::Plane(p)) = found.and_then(|f| f.surface) else { panic!("{found:?}") };
        assert!((p.point.x - (100.0 - 0.9 * 12.0)).abs() < 1e-9);
    }

    #[test]
    fn a_sphere_and_an_ellipsoid_come_back() {
        let center = FRAME.origin + Vec3::new(3.0, -4.0, 5.0);
        let sphere = Sphere { center, radius: 9.0 };
        let Surface::Sphere(s) = round_trip(Surface::Sphere(sphere)) else { panic!() };
        assert!(near(s.center, center) && (s.radius - 9.0).abs() < 1e-9);
        let (u, v) = super::super::perpendicular_frame(&Vec3::new(0.6, 0.0, 0.8));
        let directions = [u, v, u.cross(&v)];
        let semi_axes = [20.0, 12.0, 7.0];
        let given = Ellipsoid { center, semi_axes, semi_axis_directions: directions };
        let Surface::Ellipsoid(s) = round_trip(Surface::Ellipsoid(given)) else { panic!() };
        assert!(near(s.center, center) && near(Vec3::from(s.semi_axes), Vec3::from(semi_axes)));
        for (a, b) in s.semi_axis_directions.iter().zip(&directions) {
            assert!((a.dot(b).abs() - 1.0).abs() < 1e-9);
        }
        let [a, b, c] = s.semi_axis_directions;
        assert!(near(a.cross(&b), c));
    }

    #[test]
    fn cylinders_come_back() {
        let axis = Vec3::new(2.0, -1.0, 2.0) / 3.0;
        let (u, v) = super::super::perpendicular_frame(&axis);
        let axis_point = FRAME.origin + Vec3::new(1.0, 2.0, 3.0);
        let given = Cylinder { axis_point, axis_direction: axis, radius: 8.0 };
        let Surface::Cylinder(c) = round_trip(Surface::Cylinder(given)) else { panic!() };
        assert!((c.axis_direction.dot(&axis).abs() - 1.0).abs() < 1e-9);
        assert!((c.axis_point - axis_point).cross(&axis).norm() < 1e-6);
        assert!((c.radius - 8.0).abs() < 1e-9);
        let given = EllipticCylinder {
            axis_point,
            axis_direction: axis,
            semi_axes: [11.0, 6.0],
            semi_axis_directions: [u, v],
        };
        let Surface::EllipticCylinder(c) = round_trip(Surface::EllipticCylinder(given)) else {
            panic!()
        };
        assert!((c.semi_axes[0] - 11.0).abs() < 1e-9 && (c.semi_axes[1] - 6.0).abs() < 1e-9);
        assert!((c.semi_axis_directions[0].dot(&u).abs() - 1.0).abs() < 1e-9);
        let [a, b] = c.semi_axis_directions;
        assert!(near(a.cross(&b), c.axis_direction));
    }

    #[test]
    fn a_cone_opens_towards_the_points() {
        let axis = Vec3::new(0.0, 0.6, 0.8);
        let apex = FRAME.origin - axis * 10.0;
        let given = Cone { apex, axis_direction: axis, half_angle: 0.4 };
        let Surface::Cone(c) = round_trip(Surface::Cone(given)) else { panic!() };
        assert!(near(c.apex, apex) && near(c.axis_direction, axis));
        assert!((c.half_angle - 0.4).abs() < 1e-9);
    }

    #[test]
    fn intersecting_planes_are_no_surface() {
        let local = Quadric([1.0, -0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let world = FRAME.world_quadric(&local);
        assert_eq!(recover(&world, &FRAME, Tolerance::default()), None);
    }
}
