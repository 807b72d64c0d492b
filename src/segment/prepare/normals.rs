//! Normals of neighbourhoods.

use nalgebra::SymmetricEigen;

use crate::fit::constant::constants;
use crate::geometry::{Mat3, Vec3};
use crate::segment::prepare::candidates::K;

/// Normal and roughness of a neighbourhood, from the scatter of its points.
pub fn normal_of(points: &[Vec3], i: usize, neighbours: &[u32]) -> (Vec3, f32) {
    let mut sum = Vec3::zeros();
    let [mut xx, mut xy, mut xz, mut yy, mut yz, mut zz] = [0.0; 6];
    for &j in neighbours {
        let d = points[j as usize] - points[i];
        sum += d;
        xx += d.x * d.x;
        xy += d.x * d.y;
        xz += d.x * d.z;
        yy += d.y * d.y;
        yz += d.y * d.z;
        zz += d.z * d.z;
    }
    let scatter = Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
        - sum * sum.transpose() / (neighbours.len() as f64 + 1.0);
    let total = scatter.trace().max(1e-300);
    let (share, normal) = least_direction(&(scatter / total));
    (normal, share.max(0.0) as f32)
}

constants! {
    /// Steps of Newton's method for the least eigenvalue: it is far from the others wherever a normal means
    /// anything, and found in three or four.
    NEWTON: usize = 12, Effort("steps of a method that converges in four");
}

/// Product of the differences between eigenvalues below which cross products are mostly rounding.
const NEARLY_EQUAL: f64 = 1e-9;

/// Least eigenvalue and its direction for a positive semidefinite matrix of trace 1.
///
/// Newton's method on the characteristic polynomial comes from zero, left of all roots, and never passes the
/// first. The direction is the cross product of two rows of what is left, those most at right angles.
fn least_direction(m: &Mat3) -> (f64, Vec3) {
    let minors = (m[(0, 0)] * m[(1, 1)] - m[(0, 1)] * m[(0, 1)])
        + (m[(0, 0)] * m[(2, 2)] - m[(0, 2)] * m[(0, 2)])
        + (m[(1, 1)] * m[(2, 2)] - m[(1, 2)] * m[(1, 2)]);
    let (trace, det) = (m.trace(), m.determinant());
    let mut least = 0.0;
    for _ in 0..NEWTON.get() {
        let value = det - least * (minors - least * (trace - least));
        let slope = minors - least * (2.0 * trace - 3.0 * least);
        let step = value / slope;
        // not finite where three eigenvalues are nought
        if step.is_nan() || step.abs() <= 1e-16 {
            break;
        }
        least += step;
    }
    let row = |k: usize| {
        let mut row = m.column(k).into_owned();
        row[k] -= least;
        row
    };
    let (a, b, c) = (row(0), row(1), row(2));
    let mut best = (0.0, Vec3::zeros());
    for normal in [a.cross(&b), b.cross(&c), c.cross(&a)] {
        let sq = normal.norm_squared();
        if sq > best.0 {
            best = (sq, normal);
        }
    }
    if best.0 < NEARLY_EQUAL * NEARLY_EQUAL {
        let e = SymmetricEigen::new(*m);
        let k = e.eigenvalues.imin();
        return (e.eigenvalues[k], e.eigenvectors.column(k).into_owned());
    }
    (least, best.1 / best.0.sqrt())
}

/// How many of the next neighbours each is paired with.
const PAIRED: usize = 5;

/// Normal of the plane through the point and two of its neighbours that most neighbours lie near.
///
/// All pairs of neighbours so many places apart are measured at once.
#[multiversion::multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
pub fn consensus_normal(q: &[Vec3; K], limit: f64) -> Option<Vec3> {
    let sq_limit = limit * limit;
    // Beyond the last there are zeros, which span no plane.
    let [mut x, mut y, mut z, mut sq] = [[0.0; K + PAIRED]; 4];
    for (k, p) in q.iter().enumerate() {
        (x[k], y[k], z[k], sq[k]) = (p.x, p.y, p.z, p.norm_squared());
    }
    let mut near = [[0.0; K]; PAIRED];
    for (apart, near) in near.iter_mut().enumerate() {
        let other = apart + 1..apart + 1 + K;
        let (bx, by, bz) = (&x[other.clone()], &y[other.clone()], &z[other.clone()]);
        let b_sq = &sq[other];
        let [mut nx, mut ny, mut nz, mut reach] = [[0.0; K]; 4];
        for a in 0..K {
            nx[a] = y[a] * bz[a] - z[a] * by[a];
            ny[a] = z[a] * bx[a] - x[a] * bz[a];
            nz[a] = x[a] * by[a] - y[a] * bx[a];
            let length = nx[a] * nx[a] + ny[a] * ny[a] + nz[a] * nz[a];
            // Nothing is near a plane that the two hardly span.
            reach[a] = if length > 0.09 * sq[a] * b_sq[a] { sq_limit * length } else { -1.0 };
        }
        for p in q {
            for a in 0..K {
                let d = nx[a] * p.x + ny[a] * p.y + nz[a] * p.z;
                near[a] += if d * d < reach[a] { 1.0 } else { 0.0 };
            }
        }
    }
    let mut best = (6.0, 0, 0);
    for a in 0..K {
        for (apart, near) in near.iter().enumerate() {
            if near[a] > best.0 {
                best = (near[a], a, a + apart + 1);
            }
        }
    }
    let (count, a, b) = best;
    (count > 6.0).then(|| q[a].cross(&q[b]).normalize())
}
