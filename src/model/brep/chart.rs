//! Flat charts of surfaces.

use std::f64::consts::TAU;

use super::sheet::{Sheet, Uv};
use crate::geometry::{Surface, Vec3};

impl Sheet {
    /// The surface's two parameters at `x` before they are shifted and scaled: angles in -pi..=pi, lengths.
    pub fn parameters(&self, x: &Vec3) -> Uv {
        let q = self.local(x);
        match &self.surface {
            Surface::Plane(_) => [q.x, q.y],
            Surface::Cylinder(_) => [q.y.atan2(q.x), q.z],
            Surface::EllipticCylinder(s) => {
                [(q.y / s.semi_axes[1]).atan2(q.x / s.semi_axes[0]), q.z]
            }
            Surface::Cone(s) => {
                let (sin, cos) = s.half_angle.sin_cos();
                [q.y.atan2(q.x), q.x.hypot(q.y) * sin + q.z * cos]
            }
            Surface::Torus(s) => [q.y.atan2(q.x), q.z.atan2(q.x.hypot(q.y) - s.major_radius)],
            Surface::Sphere(s) => lambert(&(q / s.radius)),
            Surface::Ellipsoid(_) => lambert(&self.frame.tr_mul(&self.on_unit(x))),
        }
    }

    /// Of an ellipsoid: the place in the space where it is the unit sphere, its directions kept.
    pub fn on_unit(&self, x: &Vec3) -> Vec3 {
        let Surface::Ellipsoid(s) = &self.surface else { return x - self.origin };
        let d = x - s.center;
        let along = |k: usize| {
            s.semi_axis_directions[k] * (d.dot(&s.semi_axis_directions[k]) / s.semi_axes[k])
        };
        along(0) + along(1) + along(2)
    }

    /// The place that [`Self::on_unit`] takes there.
    pub fn from_unit(&self, y: &Vec3) -> Vec3 {
        let Surface::Ellipsoid(s) = &self.surface else { return y + self.origin };
        let along = |k: usize| {
            s.semi_axis_directions[k] * (y.dot(&s.semi_axis_directions[k]) * s.semi_axes[k])
        };
        s.center + along(0) + along(1) + along(2)
    }

    /// The place in the chart of a place near the surface.
    pub fn chart(&self, x: &Vec3) -> Uv {
        let p = self.parameters(x);
        let angular = self.angular();
        std::array::from_fn(|k| {
            let t = if angular[k] {
                (p[k] - self.start[k]).rem_euclid(TAU)
            } else {
                p[k] - self.start[k]
            };
            t * self.scale[k]
        })
    }

    /// Which parameters are angles about an axis or a tube.
    pub fn angular(&self) -> [bool; 2] {
        match &self.surface {
            Surface::Plane(_) | Surface::Sphere(_) | Surface::Ellipsoid(_) => [false, false],
            Surface::Cylinder(_) | Surface::EllipticCylinder(_) | Surface::Cone(_) => [true, false],
            Surface::Torus(_) => [true, true],
        }
    }

    /// Area of the chart for each of the surface near a place, at most four: where a cone or a torus is narrow its chart is wide.
    pub fn stretch(&self, x: &Vec3) -> f64 {
        let stretch = match &self.surface {
            Surface::Cone(_) | Surface::Torus(_) => {
                let q = self.local(x);
                self.scale[0] / q.x.hypot(q.y)
            }
            Surface::EllipticCylinder(s) => {
                let (sin, cos) = self.parameters(x)[0].sin_cos();
                self.scale[0] / (s.semi_axes[0] * sin).hypot(s.semi_axes[1] * cos)
            }
            Surface::Ellipsoid(s) => {
                // The unit sphere's area for each of the ellipsoid's: 1 / (abc |A^-1 n|).
                let unit = self.on_unit(x);
                let along =
                    |k: usize| (unit.dot(&s.semi_axis_directions[k]) / s.semi_axes[k]).powi(2);
                let area =
                    (along(0) + along(1) + along(2)).sqrt() * s.semi_axes.iter().product::<f64>();
                self.scale[0] * self.scale[1] / area
            }
            _ => 1.0,
        };
        stretch.clamp(0.05, 4.0)
    }

    /// Length of the chart around each parameter; none where it does not close.
    pub fn period(&self, k: usize) -> Option<f64> {
        self.wraps[k].then_some(TAU * self.scale[k])
    }

    /// The place of the surface at a place of the chart.
    pub fn at(&self, c: Uv) -> Vec3 {
        let [u, v]: Uv = std::array::from_fn(|k| c[k] / self.scale[k] + self.start[k]);
        let (sin, cos) = u.sin_cos();
        let q = match &self.surface {
            Surface::Plane(_) => Vec3::new(u, v, 0.0),
            Surface::Cylinder(s) => Vec3::new(s.radius * cos, s.radius * sin, v),
            Surface::EllipticCylinder(s) => {
                Vec3::new(s.semi_axes[0] * cos, s.semi_axes[1] * sin, v)
            }
            Surface::Cone(s) => {
                let (a, b) = s.half_angle.sin_cos();
                Vec3::new(v * a * cos, v * a * sin, v * b)
            }
            Surface::Torus(s) => {
                let r = s.major_radius + s.minor_radius * v.cos();
                Vec3::new(r * cos, r * sin, s.minor_radius * v.sin())
            }
            Surface::Sphere(s) => unlambert([u, v]) * s.radius,
            Surface::Ellipsoid(_) => return self.from_unit(&(self.frame * unlambert([u, v]))),
        };
        self.origin + self.frame * q
    }

    /// `c` moved by whole periods so that it is near to `near`.
    pub fn beside(&self, mut c: Uv, near: &Uv) -> Uv {
        for k in 0..2 {
            if self.angular()[k] {
                let p = TAU * self.scale[k];
                c[k] -= ((c[k] - near[k]) / p).round() * p;
            }
        }
        c
    }
}

/// Lambert's azimuthal map of the unit sphere, which keeps areas; its middle is +z, its rim of radius 2 is -z.
fn lambert(d: &Vec3) -> Uv {
    let d = d.normalize();
    let f = (2.0 / (1.0 + d.z).max(1e-300)).sqrt();
    let r = d.x.hypot(d.y);
    if r == 0.0 { [if d.z < 0.0 { 2.0 } else { 0.0 }, 0.0] } else { [f * d.x, f * d.y] }
}

fn unlambert([x, y]: Uv) -> Vec3 {
    let sq = (x * x + y * y).min(4.0);
    let f = (1.0 - sq / 4.0).max(0.0).sqrt();
    Vec3::new(f * x, f * y, 1.0 - sq / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Cone, Cylinder, Ellipsoid, EllipticCylinder, Sphere, Torus};
    use crate::geometry::{Plane, perpendicular_frame};

    #[test]
    fn every_chart_is_turned_back_and_runs_with_the_outward_normal() {
        let w = Vec3::new(1.0, 2.0, 2.0) / 3.0;
        let (u, v) = perpendicular_frame(&w);
        let c = Vec3::new(5.0, -3.0, 2.0);
        let surfaces = [
            Surface::Plane(Plane { point: c, normal: w }),
            Surface::Sphere(Sphere { center: c, radius: 4.0 }),
            Surface::Cylinder(Cylinder { axis_point: c, axis_direction: w, radius: 4.0 }),
            Surface::EllipticCylinder(EllipticCylinder {
                axis_point: c,
                axis_direction: w,
                semi_axes: [5.0, 3.0],
                semi_axis_directions: [u, v],
            }),
            Surface::Cone(Cone { apex: c, axis_direction: w, half_angle: 0.4 }),
            Surface::Ellipsoid(Ellipsoid {
                center: c,
                semi_axes: [5.0, 4.0, 3.0],
                semi_axis_directions: [u, v, w],
            }),
            Surface::Torus(Torus {
                center: c,
                axis_direction: w,
                major_radius: 6.0,
                minor_radius: 2.0,
            }),
        ];
        for surface in surfaces {
            let sheet = Sheet {
                scale: [1.5, 0.7],
                start: [0.3, 0.2],
                ..Sheet::new(&surface, &Vec3::new(1.0, 1.0, 1.0))
            };
            let p = [0.9, 0.4];
            let x = sheet.at(p);
            assert!(sheet.value(&x).abs() < 1e-12, "{surface:?}");
            let back = sheet.chart(&x);
            assert!(
                (back[0] - p[0]).abs() + (back[1] - p[1]).abs() < 1e-12,
                "{surface:?} {back:?}"
            );
            let h = 1e-6;
            let (du, dv) = (sheet.at([p[0] + h, p[1]]) - x, sheet.at([p[0], p[1] + h]) - x);
            let normal = du.cross(&dv).normalize();
            assert!((normal - sheet.normal(&x)).norm() < 1e-4, "{surface:?}");
            let off = x + normal * 0.01;
            assert!(
                (sheet.value(&off) - 0.01).abs() < 1e-4
                    && sheet.value(&sheet.foot(&off)).abs() < 1e-13
            );
        }
    }
}
