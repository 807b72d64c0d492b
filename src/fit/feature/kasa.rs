use super::kind::FeatureType;
use super::pose::Pose;
use crate::geometry::{Vec3, perpendicular_frame};

/// The cylinder about `w` from Kasa's circle.
pub fn cylinder(points: &[Vec3], w: &Vec3) -> Option<Pose> {
    let (u, v) = perpendicular_frame(w);
    let (c, r) = kasa(points.iter().map(|p| [p.dot(&u), p.dot(&v)]))?;
    Some(Pose::with_axis(FeatureType::Cylinder, u * c[0] + v * c[1], *w, [r, 0.0, 0.0]))
}

/// Centre and radius of Kasa's circle: the least sum of (q.q - 2 c.q - k)2.
pub fn kasa(points: impl Iterator<Item = [f64; 2]> + Clone) -> Option<([f64; 2], f64)> {
    let n = points.clone().count() as f64;
    let mean = points.clone().fold([0.0; 2], |m, q| [m[0] + q[0] / n, m[1] + q[1] / n]);
    let (mut xx, mut xy, mut yy, mut xr, mut yr, mut rr) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for q in points {
        let (x, y) = (q[0] - mean[0], q[1] - mean[1]);
        let sq = x * x + y * y;
        (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
        (xr, yr, rr) = (xr + x * sq, yr + y * sq, rr + sq);
    }
    let determinant = xx * yy - xy * xy;
    if determinant <= 1e-14 * rr * rr {
        return None;
    }
    let (a, b) = (0.5 * (xr * yy - yr * xy) / determinant, 0.5 * (yr * xx - xr * xy) / determinant);
    Some(([mean[0] + a, mean[1] + b], (a * a + b * b + rr / n).sqrt()))
}
