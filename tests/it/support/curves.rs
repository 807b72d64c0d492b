//! Points along the curves of a STEP file.

use std::f64::consts::TAU;

use conicoid::geometry::Vec3;

use super::step::File;

/// Steps along an edge.
pub const STEPS: usize = 400;

/// Points of a curve from one place to another.
pub fn sample(file: &File, curve: usize, from: Vec3, to: Vec3) -> Vec<Vec3> {
    let (kind, p) = &file.all[&curve];
    let share = |k: usize| k as f64 / STEPS as f64;
    match kind.as_str() {
        "LINE" => (0..=STEPS).map(|k| from + (to - from) * share(k)).collect(),
        "CIRCLE" | "ELLIPSE" => {
            let (o, [x, y, _]) = file.placement(p[1].id());
            let (a, b) = (p[2].number(), p[p.len() - 1].number());
            let turn = |q: &Vec3| ((q - o).dot(&y) / b).atan2((q - o).dot(&x) / a);
            let (first, mut last) = (turn(&from), turn(&to));
            if last <= first + 1e-9 {
                last += TAU;
            }
            let at = |t: f64| o + x * (a * t.cos()) + y * (b * t.sin());
            (0..=STEPS).map(|k| at(first + (last - first) * share(k))).collect()
        }
        "B_SPLINE_CURVE_WITH_KNOTS" => {
            let poles: Vec<Vec3> = p[2].list().iter().map(|v| file.vector(v.id())).collect();
            let counts = p[6].list().iter().map(|v| v.number() as usize);
            let knots: Vec<f64> =
                p[7].list().iter().zip(counts).flat_map(|(v, n)| vec![v.number(); n]).collect();
            let (low, high) = (knots[0], knots[knots.len() - 1]);
            (0..=STEPS).map(|k| de_boor(3, &knots, &poles, low + (high - low) * share(k))).collect()
        }
        other => panic!("curve {other}"),
    }
}

fn de_boor(degree: usize, knots: &[f64], poles: &[Vec3], t: f64) -> Vec3 {
    let span = knots.partition_point(|k| *k <= t).clamp(degree + 1, poles.len()) - 1;
    let mut d: Vec<Vec3> = (0..=degree).map(|j| poles[span - degree + j]).collect();
    for r in 1..=degree {
        for j in (r..=degree).rev() {
            let (a, b) = (knots[span - degree + j], knots[span + 1 + j - r]);
            let s = if b > a { (t - a) / (b - a) } else { 0.0 };
            d[j] = d[j - 1] * (1.0 - s) + d[j] * s;
        }
    }
    d[degree]
}
