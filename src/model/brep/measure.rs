//! Areas of faces and volumes of shells, by integrals along their edges.
//!
//! With the divergence theorem a face adds a third of the integral of x.n over it. About an origin c on the surface's axis or
//! in its centre that is an integral over the parameters alone; what the origin adds is c times the vector area, half the sum of
//! x times dx along the edges. By Green's theorem both are integrals along the edges.

use super::edge::{Edges, Use};
use super::face::Face;
use super::sheet::Sheet;
use crate::fit::constant::constants;
use crate::geometry::{Surface, Vec3};

constants! {
    /// Pieces into which the step between two points of an edge is cut: a circle's 0.1 radians become 0.0125.
    FINER: usize = 8, Effort("work of the boundary representation");
    /// Cells along an ellipsoid's chart.
    CELLS: usize = 300, Effort("work of the boundary representation");
}

/// An area and the volume of the cone from the model's centre to it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measure {
    /// Area.
    pub area: f64,
    /// A third of the integral of x.n; the sum over a closed shell is its volume.
    pub volume: f64,
}

/// The area of a face, and its part of the volume with the surface's own normal.
pub fn measure(sheet: &Sheet, edges: &Edges, face: &Face) -> Measure {
    let lines: Vec<Vec<Vec3>> = face.bounds.iter().map(|b| line(edges, &b.uses)).collect();
    let mut vector = Vec3::zeros();
    for points in &lines {
        for (a, b) in points.iter().zip(points.iter().cycle().skip(1)) {
            vector += (a - sheet.origin).cross(&(b - sheet.origin)) / 2.0;
        }
    }
    let around_tube = face.bounds.iter().any(|b| b.turns[1] != 0);
    let (area, own) = match &sheet.surface {
        Surface::Plane(_) => {
            let n = sheet.frame.column(2).into_owned();
            (vector.dot(&n), 0.0)
        }
        Surface::Cylinder(s) => {
            let area = integral(sheet, &lines, false, |_, h| s.radius * h);
            (area, area * s.radius)
        }
        Surface::Cone(s) => {
            (integral(sheet, &lines, false, |_, v| 0.5 * v * v * s.half_angle.sin()), 0.0)
        }
        Surface::EllipticCylinder(s) => {
            let [a, b] = s.semi_axes;
            let area = integral(sheet, &lines, false, |u, h| h * (a * u.sin()).hypot(b * u.cos()));
            (area, integral(sheet, &lines, false, |_, h| a * b * h))
        }
        Surface::Sphere(s) => {
            let solid = solid_angle(sheet, &lines, face);
            (solid * s.radius.powi(2), solid * s.radius.powi(3))
        }
        Surface::Ellipsoid(s) => {
            let [a, b, c] = s.semi_axes;
            (ellipsoid_area(sheet, face), solid_angle(sheet, &lines, face) * a * b * c)
        }
        Surface::Torus(s) => {
            let (r, t) = (s.major_radius, s.minor_radius);
            let whole = std::f64::consts::TAU.powi(2);
            if face.bounds.is_empty() {
                (whole * r * t, whole * r * t * t * 1.5)
            } else if around_tube {
                let area = integral(sheet, &lines, true, |u, v| u * t * (r + t * v.cos()));
                (
                    area,
                    integral(sheet, &lines, true, |u, v| {
                        u * t * (r + t * v.cos()) * (r * v.cos() + t)
                    }),
                )
            } else {
                let area = integral(sheet, &lines, false, |_, v| t * (r * v + t * v.sin()));
                let own = |v: f64| {
                    r * t * v
                        + (r * r + t * t) * v.sin()
                        + r * t * (v / 2.0 + (2.0 * v).sin() / 4.0)
                };
                (area, integral(sheet, &lines, false, |_, v| t * own(v)))
            }
        }
    };
    Measure { area, volume: (own + sheet.origin.dot(&vector)) / 3.0 }
}

/// The points of a line, closely.
pub fn line(edges: &Edges, uses: &[Use]) -> Vec<Vec3> {
    let mut out = Vec::new();
    for u in uses {
        let edge = edges.get(u.edge);
        let mut points = edge.points();
        if !u.forward {
            points.reverse();
        }
        let [f, g] = &edge.curve.sheets;
        for pair in points.windows(2) {
            for k in 0..FINER.get() {
                let x = pair[0] + (pair[1] - pair[0]) * (k as f64 / FINER.get() as f64);
                out.push(super::curve::meet(f, g, &x).unwrap_or(x));
            }
        }
    }
    out
}

/// Sum over lines of f(u, v) dv, or of -f(u, v) du; angles in radians and unrolled.
fn integral(sheet: &Sheet, lines: &[Vec<Vec3>], dv: bool, f: impl Fn(f64, f64) -> f64) -> f64 {
    let mut sum = 0.0;
    for points in lines {
        let Some(first) = points.first() else { continue };
        let start = sheet.chart(first);
        let mut last = start;
        for p in points.iter().skip(1).chain([first]) {
            let c = sheet.beside(sheet.chart(p), &last);
            let at = |k: usize| (c[k] + last[k]) / 2.0 / sheet.scale[k] + sheet.start[k];
            let step = |k: usize| (c[k] - last[k]) / sheet.scale[k];
            let value = f(at(0), at(1));
            sum += if dv { value * step(1) } else { -value * step(0) };
            last = c;
        }
    }
    sum
}

/// The area on the unit sphere that belongs to a face of a ball: Lambert's map keeps it.
fn solid_angle(sheet: &Sheet, lines: &[Vec<Vec3>], face: &Face) -> f64 {
    let inner: f64 = lines
        .iter()
        .map(|points| {
            let places: Vec<_> = points.iter().map(|p| sheet.chart(p)).collect();
            super::outline::twice_area(&places) / 2.0
        })
        .sum();
    let scaled = inner / (sheet.scale[0] * sheet.scale[1]);
    if face.has_outer { scaled } else { 4.0 * std::f64::consts::PI + scaled }
}

/// By cells of the chart.
fn ellipsoid_area(sheet: &Sheet, face: &Face) -> f64 {
    let Surface::Ellipsoid(s) = &sheet.surface else { return 0.0 };
    let cell = 4.0 * sheet.scale[0] / CELLS.get() as f64;
    let mut sum = 0.0;
    for i in 0..CELLS.get() {
        for j in 0..CELLS.get() {
            let c = [i, j].map(|k| (k as f64 + 0.5) * cell - 2.0 * sheet.scale[0]);
            if c[0].hypot(c[1]) >= 2.0 * sheet.scale[0] || !face.holds(sheet, &c) {
                continue;
            }
            let x = sheet.at(c);
            // The area of the surface for each of the unit sphere's: abc |A^-1 n|.
            let unit = sheet.on_unit(&x);
            let stretch: f64 = (0..3)
                .map(|k| (unit.dot(&s.semi_axis_directions[k]) / s.semi_axes[k]).powi(2))
                .sum();
            sum += stretch.sqrt() * s.semi_axes.iter().product::<f64>();
        }
    }
    sum * (cell / sheet.scale[0]).powi(2)
}
