//! Where two surfaces run smoothly into each other: the surface across both in which their joint lies.
//!
//! Fitted surfaces that touch miss each other by their errors, or cut each other far from where they touch. The joint is
//! where their distance is least: the intersection of the first with a surface at right angles to both.

use super::sheet::Sheet;
use crate::fit::constant::constants;
use crate::geometry::{Cylinder, EllipticCylinder, Surface, Torus, Vec3};

constants! {
    /// Sine of the angle up to which axes count as parallel or perpendicular here: what touches is so to its errors.
    PARALLEL: f64 = 0.1, Trial(0.1, 0.1);
}

/// The sheet on which the joint lies, and the one across it; `near` is a place of the joint. None where two surfaces of
/// these kinds do not touch along a curve.
pub fn across(a: &Sheet, b: &Sheet, near: &Vec3) -> Option<[Sheet; 2]> {
    one_way(a, b, near).or_else(|| one_way(b, a, near))
}

fn plane(point: Vec3, normal: Vec3) -> Option<Sheet> {
    Some(Sheet::plane(point, normal.try_normalize(1e-9)?))
}

fn is_parallel(a: &Vec3, b: &Vec3) -> bool {
    a.cross(b).norm() < PARALLEL.get()
}

fn is_perpendicular(a: &Vec3, b: &Vec3) -> bool {
    a.dot(b).abs() < PARALLEL.get()
}

fn one_way(a: &Sheet, b: &Sheet, near: &Vec3) -> Option<[Sheet; 2]> {
    let over = match (&a.surface, &b.surface) {
        (Surface::Plane(p), Surface::Cylinder(c))
            if is_perpendicular(&p.normal, &c.axis_direction) =>
        {
            plane(c.axis_point, c.axis_direction.cross(&p.normal))?
        }
        (Surface::Plane(p), Surface::Cone(c)) => plane(c.apex, c.axis_direction.cross(&p.normal))?,
        (Surface::Plane(p), Surface::Torus(t)) if is_parallel(&p.normal, &t.axis_direction) => {
            around(t)
        }
        (Surface::Cylinder(c), Surface::Cylinder(d))
            if is_parallel(&c.axis_direction, &d.axis_direction) =>
        {
            let to = d.axis_point - c.axis_point;
            plane(c.axis_point, c.axis_direction.cross(&to))?
        }
        (_, Surface::EllipticCylinder(e)) if runs_along(a, &e.axis_direction) => {
            generator(a, e, near)?
        }
        (Surface::Cylinder(c), Surface::Sphere(s)) => plane(s.center, c.axis_direction)?,
        (Surface::EllipticCylinder(c), Surface::Ellipsoid(s)) => plane(s.center, c.axis_direction)?,
        (Surface::Cylinder(c), Surface::Ellipsoid(s)) => plane(s.center, c.axis_direction)?,
        (Surface::Cylinder(c), Surface::Torus(t))
            if is_parallel(&c.axis_direction, &t.axis_direction) =>
        {
            plane(t.center, t.axis_direction)?
        }
        (Surface::Cylinder(c), Surface::Torus(t))
            if is_perpendicular(&c.axis_direction, &t.axis_direction) =>
        {
            let along =
                c.axis_direction - t.axis_direction * c.axis_direction.dot(&t.axis_direction);
            plane(t.center, along)?
        }
        (Surface::Cone(c), Surface::Sphere(s)) => {
            let h = c.axis_direction.dot(&(s.center - c.apex)) * c.half_angle.cos().powi(2);
            plane(c.apex + c.axis_direction * h, c.axis_direction)?
        }
        (Surface::Cone(c), Surface::Torus(t))
            if is_parallel(&c.axis_direction, &t.axis_direction) =>
        {
            let (sin, cos) = c.half_angle.sin_cos();
            let slant = t.major_radius * sin + c.axis_direction.dot(&(t.center - c.apex)) * cos;
            plane(c.apex + c.axis_direction * (slant * cos), c.axis_direction)?
        }
        (Surface::Torus(t), Surface::Sphere(s)) => ball_on_ring(t, &s.center, s.radius, near)?,
        (Surface::Torus(t), Surface::Torus(other)) => {
            // One elbow after another, in one plane or in two.
            let w = t.axis_direction;
            let out = match is_parallel(&w, &other.axis_direction) {
                true => other.center - t.center,
                false => w.cross(&w.cross(&other.axis_direction)),
            };
            plane(t.center, w.cross(&out))?
        }
        _ => return None,
    };
    Some([*a, over])
}

/// The cylinder about a torus' axis through its tube's middle: it cuts a plane across the axis where the torus touches it.
fn around(t: &Torus) -> Sheet {
    let c =
        Cylinder { axis_point: t.center, axis_direction: t.axis_direction, radius: t.major_radius };
    Sheet::new(&Surface::Cylinder(c), &Vec3::zeros())
}

/// A ball in the end of a tube, or one whose centre is on the torus' axis.
fn ball_on_ring(t: &Torus, centre: &Vec3, radius: f64, near: &Vec3) -> Option<Sheet> {
    let w = t.axis_direction;
    let d = centre - t.center;
    let h = d.dot(&w);
    let out = d - w * h;
    if out.norm() > t.major_radius / 2.0 {
        return plane(t.center, w.cross(&out));
    }
    // In the half plane of `near`: from the ball's centre through the tube's, or away from it.
    let radial = (near - t.center - w * (near - t.center).dot(&w)).try_normalize(1e-9)?;
    let to = (t.center + radial * t.major_radius - centre).try_normalize(1e-9)?;
    let sides = [centre + to * radius, centre - to * radius];
    let at = if (sides[0] - near).norm() < (sides[1] - near).norm() { sides[0] } else { sides[1] };
    plane(at, w)
}

/// Whether a surface is made of straight lines along `w`.
fn runs_along(a: &Sheet, w: &Vec3) -> bool {
    match &a.surface {
        Surface::Plane(p) => is_perpendicular(&p.normal, w),
        Surface::Cylinder(c) => is_parallel(&c.axis_direction, w),
        Surface::EllipticCylinder(c) => is_parallel(&c.axis_direction, w),
        _ => false,
    }
}

/// The plane across an elliptic cylinder along its line next to `near` where its normal is that of `a`.
fn generator(a: &Sheet, e: &EllipticCylinder, near: &Vec3) -> Option<Sheet> {
    const STEPS: i32 = 400;
    let [u, v] = e.semi_axis_directions;
    let w = e.axis_direction;
    let d = near - e.axis_point;
    let h = w * d.dot(&w);
    let turn = (d.dot(&v) / e.semi_axes[1]).atan2(d.dot(&u) / e.semi_axes[0]);
    let place =
        |t: f64| e.axis_point + h + u * (e.semi_axes[0] * t.cos()) + v * (e.semi_axes[1] * t.sin());
    let normal =
        |t: f64| (u * (t.cos() / e.semi_axes[0]) + v * (t.sin() / e.semi_axes[1])).normalize();
    let off = |t: f64| normal(t).cross(&a.normal(&place(t))).dot(&w);
    let step = 1.0 / f64::from(STEPS);
    // The nearest change of sign on either side, within one radian.
    for k in 0..STEPS {
        for sign in [1.0, -1.0] {
            let (mut from, mut to) =
                (turn + sign * step * f64::from(k), turn + sign * step * f64::from(k + 1));
            let low = off(from);
            if low * off(to) > 0.0 {
                continue;
            }
            for _ in 0..60 {
                let middle = (from + to) / 2.0;
                if off(middle) * low > 0.0 { from = middle } else { to = middle }
            }
            return plane(place(from), w.cross(&normal(from)));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::super::curve::{Curve, meet};
    use super::*;
    use crate::geometry::{Cone, Ellipsoid, Plane, Sphere};

    fn sheet(s: Surface) -> Sheet {
        Sheet::new(&s, &Vec3::zeros())
    }

    /// Two surfaces that touch, and a place near their joint.
    fn touching() -> Vec<(Surface, Surface, Vec3)> {
        let (x, y, z, o) = (Vec3::x(), Vec3::y(), Vec3::z(), Vec3::zeros());
        let tube = |axis_point: Vec3, radius: f64| {
            Surface::Cylinder(Cylinder { axis_point, axis_direction: z, radius })
        };
        let pipe = tube(o, 3.0);
        let elliptic = |p: Vec3, a: [f64; 2]| {
            Surface::EllipticCylinder(EllipticCylinder {
                axis_point: p,
                axis_direction: z,
                semi_axes: a,
                semi_axis_directions: [x, y],
            })
        };
        let ring = |c: Vec3, w: Vec3, major_radius: f64| {
            Surface::Torus(Torus { center: c, axis_direction: w, major_radius, minor_radius: 3.0 })
        };
        let flat = |point: Vec3, normal: Vec3| Surface::Plane(Plane { point, normal });
        let (sin, cos) = 0.5f64.sin_cos();
        let cone = Surface::Cone(Cone { apex: o, axis_direction: z, half_angle: 0.5 });
        vec![
            (flat(3.0 * x, x), pipe, Vec3::new(3.0, 0.1, 1.0)),
            (pipe, Surface::Sphere(Sphere { center: z, radius: 3.0 }), Vec3::new(3.0, 0.1, 1.2)),
            (pipe, ring(9.0 * x, y, 9.0), Vec3::new(3.0, 0.0, 0.1)),
            (pipe, ring(z, z, 6.0), Vec3::new(3.0, 0.0, 1.1)),
            (flat(3.0 * z, z), ring(o, z, 8.0), Vec3::new(8.1, 0.0, 3.0)),
            (pipe, tube(8.0 * x, 5.0), 3.0 * x),
            (pipe, elliptic(8.0 * x, [5.0, 2.0]), Vec3::new(3.1, 0.2, 0.5)),
            (
                elliptic(-2.0 * x, [2.0, 1.0]),
                elliptic(5.0 * x, [5.0, 2.0]),
                Vec3::new(0.0, 0.1, 0.5),
            ),
            (
                cone,
                Surface::Sphere(Sphere { center: 6.0 * z, radius: 6.0 * sin }),
                Vec3::new(6.0 * cos * sin, 0.1, 6.0 * cos * cos),
            ),
            (
                cone,
                ring(Vec3::new(0.0, 0.0, 9.0), z, 9.0 * sin / cos - 3.0 / cos),
                Vec3::new(3.0, 0.0, 6.0),
            ),
            (
                ring(o, z, 8.0),
                Surface::Sphere(Sphere { center: 8.0 * x, radius: 3.0 }),
                Vec3::new(10.9, 0.2, 0.1),
            ),
            (ring(o, z, 8.0), ring(16.0 * x, z, 8.0), Vec3::new(8.0, 0.1, 3.0)),
            (
                elliptic(o, [4.0, 2.0]),
                Surface::Ellipsoid(Ellipsoid {
                    center: z,
                    semi_axes: [6.0, 4.0, 2.0],
                    semi_axis_directions: [z, x, y],
                }),
                Vec3::new(4.0, 0.1, 1.1),
            ),
        ]
    }

    #[test]
    fn joints_of_surfaces_that_touch_lie_on_both() {
        let cases = touching();
        for (k, (a, b, near)) in cases.into_iter().enumerate() {
            let (a, b) = (sheet(a), sheet(b));
            let [f, g] = across(&a, &b, &near).unwrap_or_else(|| panic!("case {k}"));
            let start = meet(&f, &g, &near).unwrap();
            let curve = Curve::through(&f, &g, start, 0.5, |p| (p - near).norm() < 4.0).unwrap();
            for p in &curve.points {
                assert!(a.value(p).abs() < 1e-9 && b.value(p).abs() < 1e-9, "case {k}: {p}");
                let sine = a.normal(p).cross(&b.normal(p)).norm();
                assert!(sine < 1e-6, "case {k}: {sine}");
            }
        }
    }
}
