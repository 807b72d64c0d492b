//! How far neighbourhoods scatter about smooth sheets through them.

use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

use crate::fit::constant::constants;
use crate::geometry::{Vec3, perpendicular_frame};
use crate::segment::prepare::around::Around;
use crate::segment::prepare::candidates::K;
use crate::segment::prepare::scene::Scene;

constants! {
    /// Most neighbourhoods looked at.
    pub SAMPLE: usize = 2000, Effort("neighbourhoods looked at");
    /// Which of 16 distances from the best plane, in their order, tells a thin sheet from noise.
    EIGHTH: usize = 8, Derived("half of them lie on one side of the sheet");
    /// Which of 16 distances from the best plane, in their order, tells the noise on a thin sheet.
    pub SEVENTH: usize = 7, Derived("the last of half of them is often the other side's");
    /// Such a distance is taken for so many sigmas. The seventh of 16 half-normal ones lies near 0.56 sigma; that from the
    /// best of all planes lower.
    UNIT: f64 = 0.35, Trial(0.35, 0.35);
    /// One neighbourhood in so many must have a robust plane.
    FEW: usize = 10, Derived("five deviations below a quarter, for a thousand points and more");
}

/// Neighbourhoods looked at between two looks at whether the work was cancelled.
pub const WATCHED: usize = 64;

pub fn quartile(mut v: Vec<f64>) -> f64 {
    let k = v.len() / 4;
    *v.select_nth_unstable_by(k, f64::total_cmp).1
}

/// Lower quartile over the cloud of the eighth-smallest distance of 16 neighbours from the best plane
/// through two of them and the point, as a standard deviation; infinite where that is not below `limit`.
pub fn robust_estimate(scene: &Scene, limit: f64) -> f64 {
    // Where so few are below the limit the quartile is not: five deviations for a thousand points and more.
    let few = least_distances(scene, 4, EIGHTH.get(), limit);
    if few.iter().filter(|d| d.is_finite()).count() * FEW.get() < few.len() {
        return f64::INFINITY;
    }
    quartile(least_distances(scene, 1, EIGHTH.get(), limit))
}

/// The `nth` smallest distance of 16 neighbours from the best plane, as a standard deviation, at every `thinned`-th
/// point of a sample; infinite where it is not below `limit`.
pub fn least_distances(scene: &Scene, thinned: usize, nth: usize, limit: f64) -> Vec<f64> {
    let n = scene.len();
    let stride = thinned * n.div_ceil(SAMPLE.get() / 2);
    (0..n)
        .into_par_iter()
        .step_by(stride)
        .map(|i| {
            if (i / stride).is_multiple_of(WATCHED) && scene.cancelled() {
                return f64::INFINITY;
            }
            let origin = scene.points[i];
            let mut q = [Vec3::zeros(); K];
            for (q, &j) in q.iter_mut().zip(scene.neighbours(i)) {
                *q = scene.points[j as usize] - origin;
            }
            least_distance(&q, nth, limit * UNIT.get()) / UNIT.get()
        })
        .collect()
}

/// The `nth` smallest distance of neighbours from a plane through two of them and the point, least over all such
/// planes.
#[multiversion::multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn least_distance(q: &[Vec3; K], nth: usize, limit: f64) -> f64 {
    let around = Around::of(q);
    let norms = q.map(|p| p.norm());
    // Distances beyond the limit are all the same.
    let mut best = f64::INFINITY;
    let mut d = [0.0; K];
    for a in 0..K {
        for b in a + 1..K {
            let normal = q[a].cross(&q[b]);
            let length = normal.norm();
            if length <= 0.3 * norms[a] * norms[b] {
                continue;
            }
            // Planes with fewer neighbours nearer than the best so far are no better: most.
            if around.near(&normal, best.min(limit) * length * (1.0 + 1e-9)) < nth as u32 {
                continue;
            }
            for (d, p) in d.iter_mut().zip(q) {
                *d = p.dot(&normal).abs() / length;
            }
            best = best.min(*d.select_nth_unstable_by(nth - 1, f64::total_cmp).1);
        }
    }
    best
}

/// Variance of 16 points about a graph quadric (10 degrees of freedom).
pub fn residual_variance(scene: &Scene, i: usize) -> Option<f64> {
    let origin = scene.points[i];
    let mut q = [Vec3::zeros(); K];
    for (slot, &j) in q[1..].iter_mut().zip(scene.neighbours(i)) {
        *slot = scene.points[j as usize] - origin;
    }
    let scale = q.iter().map(Vec3::norm_squared).fold(0.0, f64::max).sqrt().max(1e-300);
    for p in &mut q {
        *p /= scale;
    }
    let mut w = scene.normals[i];
    let mut rss = f64::NAN;
    for _ in 0..2 {
        let (u, v) = perpendicular_frame(&w);
        let columns = columns(&q, &[u, v, w]);
        let (a, b) = moments(&columns);
        let c = a.cholesky()?.solve(&b);
        // Residuals are summed again rather than taken from the moments, which cancels on exact data.
        rss = residuals(&columns, &c.into());
        w = (w - u * c[1] - v * c[2]).normalize();
        if !(rss.is_finite() && w.x.is_finite()) {
            return None;
        }
    }
    Some(rss / 10.0 * scale * scale)
}

/// Values at each point of 1, x, y, x2, xy, y2 and the height, in the frame (u, v, w).
type Features = [[f64; K]; 7];

#[inline(always)]
fn columns(q: &[Vec3; K], frame: &[Vec3; 3]) -> Features {
    let [x, y, h] = frame.map(|e| q.map(|p| p.dot(&e)));
    let products = |a: &[f64; K], b: &[f64; K]| std::array::from_fn(|k| a[k] * b[k]);
    [[1.0; K], x, y, products(&x, &x), products(&x, &y), products(&y, &y), h]
}

/// Sums of products of the features, and of each with the height.
fn moments(columns: &Features) -> (SMatrix<f64, 6, 6>, SVector<f64, 6>) {
    let mut a = SMatrix::<f64, 6, 6>::zeros();
    for r in 0..6 {
        for c in 0..=r {
            a[(r, c)] = dot(&columns[r], &columns[c]);
            a[(c, r)] = a[(r, c)];
        }
    }
    (a, SVector::from_fn(|r, _| dot(&columns[r], &columns[6])))
}

/// The scalar product, in four parts whatever the machine.
#[inline(always)]
fn dot(a: &[f64; K], b: &[f64; K]) -> f64 {
    let mut parts = [0.0; 4];
    for (a, b) in a.chunks_exact(4).zip(b.chunks_exact(4)) {
        for l in 0..4 {
            parts[l] += a[l] * b[l];
        }
    }
    (parts[0] + parts[2]) + (parts[1] + parts[3])
}

/// Squares of the heights' residuals about the quadric with coefficients `c`.
fn residuals(columns: &Features, c: &[f64; 6]) -> f64 {
    let mut left = columns[6];
    for (c, column) in c.iter().zip(columns) {
        for (l, v) in left.iter_mut().zip(column) {
            *l -= c * v;
        }
    }
    dot(&left, &left)
}
