//! Surfaces as STEP entities.

use crate::fit::constant::constants;
use crate::geometry::{Mat3, Surface, Vec3, perpendicular_frame};
use crate::model::brep::sheet::Sheet;

use super::file::{Entities, Id, list, real, reals};

constants! {
    /// Cosine of the angle from the middle of a sphere's face up to which its border keeps away from poles at a right angle.
    SMALL: f64 = 0.25, Trial(0.25, 0.25);
}

/// A region's surface, with the parameters of the result; `sheet` tells where the points are, so that the place where the
/// surface closes is away from them. `lines` are the points around the face,
/// which lies on their left.
pub fn surface(
    out: &mut Entities,
    exact: &Surface,
    sheet: &Sheet,
    centre: &Vec3,
    lines: &[Vec<Vec3>],
) -> Id {
    let (u, v) = (sheet.frame.column(0).into_owned(), sheet.frame.column(1).into_owned());
    let (sin, cos) = sheet.start[0].sin_cos();
    let seam = u * cos + v * sin;
    match exact {
        Surface::Plane(s) => {
            let at = out.placement(&s.point, &s.normal, &u);
            out.add(&format!("PLANE('',{at})"))
        }
        Surface::Cylinder(s) => {
            let at = out.placement(&s.axis_point, &s.axis_direction, &seam);
            out.add(&format!("CYLINDRICAL_SURFACE('',{at},{})", real(s.radius)))
        }
        Surface::Cone(s) => {
            // Where its points are, so that the radius is of their size.
            let radius = sheet.scale[0];
            let at = s.apex + s.axis_direction * (radius / s.half_angle.tan());
            let at = out.placement(&at, &s.axis_direction, &seam);
            out.add(&format!("CONICAL_SURFACE('',{at},{},{})", real(radius), real(s.half_angle)))
        }
        Surface::Sphere(s) => {
            let (axis, x) = ball_axes(sheet, s.radius, lines);
            let at = out.placement(&s.center, &axis, &x);
            out.add(&format!("SPHERICAL_SURFACE('',{at},{})", real(s.radius)))
        }
        Surface::Torus(s) => {
            let at = out.placement(&s.center, &s.axis_direction, &seam);
            out.add(&format!(
                "TOROIDAL_SURFACE('',{at},{},{})",
                real(s.major_radius),
                real(s.minor_radius)
            ))
        }
        Surface::EllipticCylinder(s) => {
            let first = s.semi_axis_directions[0];
            let x = if first.dot(&seam) < 0.0 { -first } else { first };
            let at = out.placement(&s.axis_point, &s.axis_direction, &x);
            let ellipse = out.add(&format!(
                "ELLIPSE('',{at},{},{})",
                real(s.semi_axes[0]),
                real(s.semi_axes[1])
            ));
            let axis = out.direction(&s.axis_direction);
            let vector = out.add(&format!("VECTOR('',{axis},1.0)"));
            out.add(&format!("SURFACE_OF_LINEAR_EXTRUSION('',{ellipse},{vector})"))
        }
        Surface::Ellipsoid(_) => ellipsoid(out, sheet, centre, lines),
    }
}

/// Axis of a sphere and direction of its seam: a small face has the poles and the seam away from it; a larger one a pole in its
/// middle, not on its border.
fn ball_axes(sheet: &Sheet, radius: f64, lines: &[Vec<Vec3>]) -> (Vec3, Vec3) {
    let (u, w) = (sheet.frame.column(0).into_owned(), sheet.frame.column(2).into_owned());
    let is_small = |p: &Vec3| (p - sheet.origin).dot(&w) > SMALL.get() * radius;
    let all = !lines.is_empty() && lines.iter().flatten().all(is_small);
    if all { (u, -w) } else { (w, u) }
}

/// An ellipsoid as a rational spline of degree two.
fn ellipsoid(out: &mut Entities, sheet: &Sheet, centre: &Vec3, lines: &[Vec<Vec3>]) -> Id {
    /// The map reaches this much further than the borders.
    const MARGIN: f64 = 1.1;
    let sheet = &toward_face(sheet, lines);
    let reach = |p: &Vec3| {
        let d = sheet.frame.tr_mul(&sheet.on_unit(p)).normalize();
        (d.x.abs().max(d.y.abs())) / (1.0 + d.z).max(1e-6)
    };
    let a = MARGIN * lines.iter().flatten().map(reach).fold(1.0, f64::max);
    let (poles, weights) = patch(sheet, a);
    let rows = poles.map(|row| list(row.map(|p| out.point(&(centre + p))))).join(",");
    let weights = weights.map(reals).join(",");
    let knots = reals([-a, 0.0, a]);
    out.add(&format!(
        "(BOUNDED_SURFACE() B_SPLINE_SURFACE(2,2,({rows}),.UNSPECIFIED.,.F.,.F.,.F.) \
         B_SPLINE_SURFACE_WITH_KNOTS((3,2,3),(3,2,3),{knots},{knots},.UNSPECIFIED.) \
         GEOMETRIC_REPRESENTATION_ITEM() RATIONAL_B_SPLINE_SURFACE(({weights})) REPRESENTATION_ITEM('') SURFACE())"
    ))
}

/// The same sheet with its frame's last direction toward the face that lies on the left of `lines`: the vector area of these on
/// the unit sphere. The place opposite of it lies beyond them.
fn toward_face(sheet: &Sheet, lines: &[Vec<Vec3>]) -> Sheet {
    let mut vector = Vec3::zeros();
    for line in lines {
        for (a, b) in line.iter().zip(line.iter().cycle().skip(1)) {
            vector += sheet.on_unit(a).cross(&sheet.on_unit(b));
        }
    }
    let Some(w) = vector.try_normalize(1e-6) else { return *sheet };
    let (u, v) = perpendicular_frame(&w);
    Sheet { frame: Mat3::from_columns(&[u, v, w]), ..*sheet }
}

/// Poles and weights of an ellipsoid: the unit sphere's stereographic map from the place opposite of the points' middle, over the
/// square of half side `a`, stretched to the semi-axes. It has neither pole nor seam.
///
/// x = 2s/w, y = 2t/w, z = (1 - s2 - t2)/w with w = 1 + s2 + t2; with a knot at nought all weights are at least one.
fn patch(sheet: &Sheet, a: f64) -> ([[Vec3; 5]; 5], [[f64; 5]; 5]) {
    let linear = [-a, -a / 2.0, 0.0, a / 2.0, a];
    let square = [a * a, 0.0, 0.0, 0.0, a * a];
    let weight = |i: usize, j: usize| 1.0 + square[i] + square[j];
    let pole = |i: usize, j: usize| {
        let d = Vec3::new(2.0 * linear[i], 2.0 * linear[j], 1.0 - square[i] - square[j]);
        sheet.from_unit(&(sheet.frame * (d / weight(i, j))))
    };
    (
        std::array::from_fn(|i| std::array::from_fn(|j| pole(i, j))),
        std::array::from_fn(|i| std::array::from_fn(|j| weight(i, j))),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Ellipsoid;

    #[test]
    fn every_place_of_the_rational_patch_lies_on_the_ellipsoid() {
        let (u, v, w) = (Vec3::y(), Vec3::z(), Vec3::x());
        let e = Ellipsoid {
            center: Vec3::new(1.0, 2.0, 3.0),
            semi_axes: [7.0, 5.0, 2.0],
            semi_axis_directions: [u, v, w],
        };
        let sheet = Sheet::new(&Surface::Ellipsoid(e), &Vec3::zeros());
        let a = 3.0;
        let (poles, weights) = patch(&sheet, a);
        // The two pieces on either side of the knot, by Bernstein's polynomials.
        let basis = |t: f64| {
            let (first, s) = if t < 0.0 { (0, t / a + 1.0) } else { (2, t / a) };
            (first, [(1.0 - s) * (1.0 - s), 2.0 * s * (1.0 - s), s * s])
        };
        let mut seen: f64 = 0.0;
        for i in -10..=10 {
            for j in -10..=10 {
                let ((k, b), (l, c)) =
                    (basis(a * f64::from(i) / 10.0), basis(a * f64::from(j) / 10.0));
                let (mut sum, mut weight) = (Vec3::zeros(), 0.0);
                for m in 0..3 {
                    for n in 0..3 {
                        let share = b[m] * c[n] * weights[k + m][l + n];
                        sum += poles[k + m][l + n] * share;
                        weight += share;
                    }
                }
                let x = sum / weight;
                assert!(sheet.value(&x).abs() < 1e-13, "{i} {j}");
                seen = seen.max((x - sheet.at([0.0, 0.0])).norm());
            }
        }
        // It goes well beyond half of it.
        assert!(seen > 3.5);
    }
}
