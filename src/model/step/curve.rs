//! Curves as STEP entities.

use crate::geometry::Vec3;
use crate::model::brep::edge::Edge;
use crate::model::brep::form::Form;

use super::file::{Entities, Id, list, real, reals};

/// The curve of an edge, in its direction.
pub fn curve(out: &mut Entities, edge: &Edge, centre: &Vec3) -> Id {
    match edge.curve.form {
        Form::Line => {
            let (a, b) = (edge.curve.at(edge.span[0]), edge.curve.at(edge.span[1]));
            let (point, d) = (out.point(&(a + centre)), out.direction(&(b - a).normalize()));
            let vector = out.add(&format!("VECTOR('',{d},1.0)"));
            out.add(&format!("LINE('',{point},{vector})"))
        }
        Form::Ellipse { center, axes, semi_axes } => {
            let middle = (edge.span[0] + edge.span[1]) / 2.0;
            let (x, along) = (edge.curve.at(middle), edge.curve.tangent(middle));
            let normal = axes[0].cross(&axes[1]).normalize();
            let sign = (x - center).cross(&along).dot(&normal).signum();
            let at = out.placement(&(center + centre), &(normal * sign), &axes[0]);
            match semi_axes {
                [a, b] if a == b => out.add(&format!("CIRCLE('',{at},{})", real(a))),
                [a, b] => out.add(&format!("ELLIPSE('',{at},{},{})", real(a), real(b))),
            }
        }
        Form::Free => spline(out, edge, centre),
    }
}

/// A cubic spline through the edge's points with its tangents there: between two of them by Hermite, so it leaves the curve by
/// the fourth power of their distance.
fn spline(out: &mut Entities, edge: &Edge, centre: &Vec3) -> Id {
    let points = edge.points();
    let tangents = tangents(edge, &points);
    let n = points.len();
    let steps: Vec<f64> = points.windows(2).map(|p| (p[1] - p[0]).norm()).collect();
    let mut poles = vec![points[0]];
    for k in 0..n - 1 {
        let third = steps[k] / 3.0;
        poles.push(points[k] + tangents[k] * third);
        poles.push(points[k + 1] - tangents[k + 1] * third);
        // The points between two pieces follow from their neighbours where knots are double.
    }
    poles.push(points[n - 1]);
    let mut knots = vec![0.0];
    steps.iter().for_each(|s| knots.push(knots[knots.len() - 1] + s));
    let inner = |k: usize| if k == 0 || k == n - 1 { "4" } else { "2" };
    let multiplicities: Vec<&str> = (0..n).map(inner).collect();
    let closed = if edge.is_closed() { ".T." } else { ".F." };
    let poles: Vec<Id> = poles.iter().map(|p| out.point(&(p + centre))).collect();
    out.add(&format!(
        "B_SPLINE_CURVE_WITH_KNOTS('',3,{},.UNSPECIFIED.,{closed},.F.,({}),{},.UNSPECIFIED.)",
        list(poles),
        multiplicities.join(","),
        reals(knots)
    ))
}

/// Unit tangents at the points, across both normals.
fn tangents(edge: &Edge, points: &[Vec3]) -> Vec<Vec3> {
    let [f, g] = &edge.curve.sheets;
    let n = points.len();
    let at = |k: usize| {
        let along = points[(k + 1).min(n - 1)] - points[k.saturating_sub(1)];
        let t = f.normal(&points[k]).cross(&g.normal(&points[k]));
        let size = t.norm();
        let sign = t.dot(&along).signum();
        if size > 1e-6 { t * (sign / size) } else { along.normalize() }
    };
    (0..n).map(at).collect()
}
