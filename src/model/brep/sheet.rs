//! A region's whole surface: signed distances, and a flat chart of it.

use crate::geometry::{Mat3, Plane, Surface, Vec3, perpendicular_frame};

/// A place in a chart; lengths in the input's unit.
pub type Uv = [f64; 2];

/// A surface without borders, in coordinates about the model's centre.
#[derive(Clone, Copy, Debug)]
pub struct Sheet {
    /// The surface.
    pub surface: Surface,
    /// Origin of its own coordinates: a point of the plane or axis, a centre, the apex.
    pub origin: Vec3,
    /// Its own directions as columns; the last is the plane's normal, the axis, or the middle of a ball's points.
    pub frame: Mat3,
    /// Length of one unit of either parameter of the chart.
    pub scale: Uv,
    /// Where the parameters begin: angles in the widest gap between the points.
    pub start: Uv,
    /// Whether the points go all round, so that the chart closes.
    pub wraps: [bool; 2],
}

fn columns(u: Vec3, v: Vec3, w: Vec3) -> Mat3 {
    Mat3::from_columns(&[u, v, w])
}

fn with_axis(w: &Vec3) -> Mat3 {
    let (u, v) = perpendicular_frame(w);
    columns(u, v, *w)
}

impl Sheet {
    /// The sheet of a surface moved by `-centre`.
    pub fn new(surface: &Surface, centre: &Vec3) -> Self {
        let mut surface = *surface;
        let (origin, frame) = match &mut surface {
            Surface::Plane(s) => {
                s.point -= centre;
                (s.point, with_axis(&s.normal))
            }
            Surface::Sphere(s) => {
                s.center -= centre;
                (s.center, Mat3::identity())
            }
            Surface::Cylinder(s) => {
                // The point of the axis nearest to the centre: far ones lose digits.
                let d = s.axis_direction;
                s.axis_point -= centre;
                s.axis_point -= d * d.dot(&s.axis_point);
                (s.axis_point, with_axis(&d))
            }
            Surface::EllipticCylinder(s) => {
                let d = s.axis_direction;
                s.axis_point -= centre;
                s.axis_point -= d * d.dot(&s.axis_point);
                let u = s.semi_axis_directions[0];
                (s.axis_point, columns(u, d.cross(&u), d))
            }
            Surface::Cone(s) => {
                s.apex -= centre;
                (s.apex, with_axis(&s.axis_direction))
            }
            Surface::Ellipsoid(s) => {
                s.center -= centre;
                (s.center, Mat3::identity())
            }
            Surface::Torus(s) => {
                s.center -= centre;
                (s.center, with_axis(&s.axis_direction))
            }
        };
        Self { surface, origin, frame, scale: [1.0; 2], start: [0.0; 2], wraps: [false; 2] }
    }

    /// The plane through `point` with that unit normal, in coordinates about the centre.
    pub fn plane(point: Vec3, normal: Vec3) -> Self {
        Self::new(&Surface::Plane(Plane { point, normal }), &Vec3::zeros())
    }

    /// A place in the surface's own coordinates.
    pub fn local(&self, x: &Vec3) -> Vec3 {
        self.frame.tr_mul(&(x - self.origin))
    }

    /// Signed distance from the surface and the unit normal at the foot; of ellipses and ellipsoids to first order.
    pub fn offset(&self, x: &Vec3) -> (f64, Vec3) {
        let away = |from: &Vec3, axis: &Vec3| {
            let d = x - from;
            let h = d.dot(axis);
            let out = d - axis * h;
            let r = out.norm();
            (h, r, if r > 0.0 { out / r } else { perpendicular_frame(axis).0 })
        };
        match &self.surface {
            Surface::Plane(s) => (s.normal.dot(&(x - s.point)), s.normal),
            Surface::Sphere(s) => {
                let d = x - s.center;
                let r = d.norm();
                (r - s.radius, if r > 0.0 { d / r } else { Vec3::z() })
            }
            Surface::Cylinder(s) => {
                let (_, r, out) = away(&s.axis_point, &s.axis_direction);
                (r - s.radius, out)
            }
            Surface::Cone(s) => {
                let (h, r, out) = away(&s.apex, &s.axis_direction);
                let (sin, cos) = s.half_angle.sin_cos();
                (r * cos - h * sin, out * cos - s.axis_direction * sin)
            }
            Surface::Torus(s) => {
                let (h, r, out) = away(&s.center, &s.axis_direction);
                let d = out * (r - s.major_radius) + s.axis_direction * h;
                let t = d.norm();
                (t - s.minor_radius, if t > 0.0 { d / t } else { out })
            }
            Surface::EllipticCylinder(s) => {
                let d = x - s.axis_point;
                algebraic(&d, &s.semi_axis_directions, &s.semi_axes)
            }
            Surface::Ellipsoid(s) => {
                let d = x - s.center;
                algebraic(&d, &s.semi_axis_directions, &s.semi_axes)
            }
        }
    }

    /// Signed distance from the surface.
    pub fn value(&self, x: &Vec3) -> f64 {
        self.offset(x).0
    }

    /// The unit normal at `x`, outward of the curved ones.
    pub fn normal(&self, x: &Vec3) -> Vec3 {
        self.offset(x).1
    }

    /// The place of the surface near `x`.
    pub fn foot(&self, x: &Vec3) -> Vec3 {
        let mut x = *x;
        for _ in 0..8 {
            let (d, n) = self.offset(&x);
            x -= n * d;
        }
        x
    }

    /// The largest radius of curvature that the chart may have, infinite for a plane.
    pub fn radius(&self) -> f64 {
        match &self.surface {
            Surface::Plane(_) => f64::INFINITY,
            Surface::Sphere(s) => s.radius,
            Surface::Cylinder(s) => s.radius,
            Surface::EllipticCylinder(s) => s.semi_axes[0],
            Surface::Cone(_) => f64::INFINITY,
            Surface::Ellipsoid(s) => s.semi_axes[0],
            Surface::Torus(s) => s.major_radius + s.minor_radius,
        }
    }
}

/// Q / |grad Q| and its direction for Q = sum of (d.u_k / a_k)^2 - 1.
fn algebraic(d: &Vec3, directions: &[Vec3], semi_axes: &[f64]) -> (f64, Vec3) {
    let (mut q, mut gradient) = (-1.0, Vec3::zeros());
    for (u, a) in directions.iter().zip(semi_axes) {
        let t = d.dot(u) / a;
        q += t * t;
        gradient += u * (2.0 * t / a);
    }
    let g = gradient.norm();
    if g > 0.0 { (q / g, gradient / g) } else { (-semi_axes[0], directions[0]) }
}
