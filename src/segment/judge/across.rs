//! How broad points in a plane are across the curve that they may lie on.

use nalgebra::Vector3;

use crate::geometry::Mat3;

/// Cosine and sine of the direction in which points in a plane scatter most.
pub fn main_direction(flat: &[[f64; 2]]) -> (f64, f64) {
    let n = flat.len() as f64;
    let [mx, my] = [0, 1].map(|k| flat.iter().map(|p| p[k]).sum::<f64>() / n);
    let [mut xx, mut xy, mut yy] = [0.0; 3];
    for [x, y] in flat {
        xx += (x - mx) * (x - mx);
        xy += (x - mx) * (y - my);
        yy += (y - my) * (y - my);
    }
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    (angle.cos(), angle.sin())
}

/// Standard deviation of points in a plane about the parabola along their main direction.
pub fn breadth(flat: &[[f64; 2]], cos: f64, sin: f64, scale: f64) -> f64 {
    let turned =
        |p: &[f64; 2]| ((p[0] * cos + p[1] * sin) / scale, (p[1] * cos - p[0] * sin) / scale);
    let (mut a, mut b) = (Mat3::zeros(), Vector3::zeros());
    for (t, s) in flat.iter().map(turned) {
        let f = Vector3::new(1.0, t, t * t);
        a += f * f.transpose();
        b += f * s;
    }
    // Points of few different places along have no parabola: their mean stands for it.
    let fitted = a.cholesky().map(|c| c.solve(&b)).filter(|c| c.iter().all(|x| x.is_finite()));
    let curve = fitted.unwrap_or(Vector3::new(b[0] / a[(0, 0)], 0.0, 0.0));
    let left = |(t, s): (f64, f64)| (s - curve.dot(&Vector3::new(1.0, t, t * t))).powi(2);
    let sum: f64 = flat.iter().map(turned).map(left).sum();
    (sum / (flat.len() - 3) as f64).sqrt() * scale
}
