//! What two equations of one surface say of the same points.

use multiversion::multiversion;

/// One surface about both origins.
pub(super) struct Pair {
    pub(super) far: [f64; 10],
    pub(super) local: [f64; 10],
    pub(super) origin: [f64; 3],
}

/// Points measured at once.
pub(super) const LANES: usize = 64;

/// Some points and what both equations say of them.
pub(super) struct Lanes {
    pub(super) points: [[f64; LANES]; 3],
    /// Distance by the local equation.
    pub(super) distance: [f64; LANES],
    /// By how much that by the far one differs.
    pub(super) off: [f64; LANES],
    /// Square of the local gradient.
    pub(super) sq_slope: [f64; LANES],
}

/// The left-hand side of (1), term by term in its order as callers reckon it, and its gradient.
#[inline(always)]
fn at(a: &[f64; 10], x: f64, y: f64, z: f64) -> (f64, [f64; 3]) {
    let value = a[0] * (x * x)
        + a[1] * (y * y)
        + a[2] * (z * z)
        + a[3] * (x * y)
        + a[4] * (y * z)
        + a[5] * (x * z)
        + a[6] * x
        + a[7] * y
        + a[8] * z
        + a[9];
    let slope = [
        2.0 * a[0] * x + a[3] * y + a[5] * z + a[6],
        2.0 * a[1] * y + a[3] * x + a[4] * z + a[7],
        2.0 * a[2] * z + a[4] * y + a[5] * x + a[8],
    ];
    (value, slope)
}

#[inline(always)]
fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Fills in what both equations say of the points.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn measure(pair: &Pair, lanes: &mut Lanes) {
    let (far, local, o) = (pair.far, pair.local, pair.origin);
    for k in 0..LANES {
        let [x, y, z] = [lanes.points[0][k], lanes.points[1][k], lanes.points[2][k]];
        let (far_value, far_slope) = at(&far, x, y, z);
        let (value, slope) = at(&local, x - o[0], y - o[1], z - o[2]);
        let sq_slope = dot(&slope, &slope);
        let distance = value / sq_slope.sqrt();
        let far_distance = far_value / dot(&far_slope, &far_slope).sqrt();
        // The two factors may differ in sign.
        let turned = if dot(&far_slope, &slope) < 0.0 { -far_distance } else { far_distance };
        lanes.distance[k] = distance;
        lanes.off[k] = (turned - distance).abs();
        lanes.sq_slope[k] = sq_slope;
    }
}
