//! The noise of a cloud, from the scatter about local graph quadrics.

use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

use super::scene::{Around, K, Scene};
use crate::geometry::{Vec3, perpendicular_frame};

/// Most neighbourhoods looked at.
const SAMPLE: usize = 2000;
/// A coordinate that comes in steps has at least this many, with this many points each.
const LEAST_STEPS: usize = 50;
const POINTS_A_STEP: usize = 20;
/// Median roughness above which points fill a volume (1/3 in an even filling).
pub const VOLUME: f32 = 0.12;
/// One point in so many stays each time that a cloud is thinned, and how many must.
const THINNING: usize = 4;
const LEAST_THINNED: usize = 4 * 4 * K;
/// Growth of the estimate by thinning from which on neighbourhoods still lie within the noise. In a volume it is
/// that of the spacing, 1.6.
const GROWN: f64 = 1.2;
/// The 25 % quantile of chi2 with 10 degrees of freedom, over 10.
const CHI2_10_QUARTER: f64 = 0.6737;

/// Standard deviation of the points' noise along their normals.
///
/// At each of a sample of points a graph quadric is fitted to 16 points in two passes (the second in
/// the re-tilted frame); the lower quartile of the residual variances stands for the smooth part of
/// the cloud.
///
/// On thin sheets, where a neighbourhood mixes both sides, quadrics read the wall for noise: a robust
/// plane through part of the neighbourhood is tried as well, and believed when it is four times smaller. Not
/// where depths are whole steps of an instrument: a robust plane sees one step and nothing else.
///
/// Where the points lie so dense that 16 of them reach no further than the noise, they all lie in it: see
/// [`thinned_estimate`].
pub fn estimate(scene: &Scene) -> f64 {
    let sigma = own_estimate(scene);
    if is_thick(scene, sigma) { thinned_estimate(scene, sigma) } else { sigma }
}

/// Whether neighbourhoods are as thick as wide, and `sigma` a good part of the spacing.
fn is_thick(scene: &Scene, sigma: f64) -> bool {
    sigma >= 0.15 * scene.spacing && scene.median_roughness(0..scene.len() as u32) >= VOLUME
}

/// The noise of a scene whose neighbourhoods, `sigma` thick, are as thick as wide, from ever fewer of its points:
/// the estimate grows until neighbourhoods reach beyond the noise. In a volume it grows without end; then `sigma`.
fn thinned_estimate(scene: &Scene, sigma: f64) -> f64 {
    let mut last = sigma;
    let mut points = scene.points.clone();
    while points.len() >= THINNING * LEAST_THINNED {
        points = points.iter().step_by(THINNING).copied().collect();
        let thin = scene.part(points);
        let next = own_estimate(&thin);
        if next < GROWN * last {
            return next.max(last);
        }
        (last, points) = (next, thin.points);
    }
    sigma
}

/// [`estimate`] from the points as dense as they are.
fn own_estimate(scene: &Scene) -> f64 {
    let smooth = smooth_estimate(scene);
    let robust = robust_estimate(scene, smooth / 4.0);
    if robust * 4.0 < smooth && !comes_in_steps(scene, smooth) {
        // Where half of a neighbourhood is the other side's, the eighth is often its own side's last.
        quartile(least_distances(scene, 1, SEVENTH, smooth / 4.0))
    } else {
        smooth
    }
}

/// Whether one coordinate takes few values (many points for each of many), an even step apart that is about
/// what `scatter` comes to.
fn comes_in_steps(scene: &Scene, scatter: f64) -> bool {
    (0..3).any(|k| {
        let mut values: Vec<f64> = scene.points.iter().map(|p| p[k]).collect();
        values.sort_unstable_by(f64::total_cmp);
        let mut steps: Vec<f64> =
            values.windows(2).map(|w| w[1] - w[0]).filter(|d| *d > 1e-6 * scatter).collect();
        if steps.len() < LEAST_STEPS || steps.len() * POINTS_A_STEP > values.len() {
            return false;
        }
        let mid = steps.len() / 2;
        let step = *steps.select_nth_unstable_by(mid, f64::total_cmp).1;
        (0.05..2.0).contains(&(scatter / step))
    })
}

/// Whether the points fill a volume: neighbourhoods are as thick as wide, and the noise, a good part of the
/// spacing, grows with it when the cloud is thinned, as no noise of a surface does.
pub fn fills_volume(scene: &Scene, sigma: f64) -> bool {
    if scene.len() < 8 * 4 * K || !is_thick(scene, sigma) {
        return false;
    }
    let thin = scene.part(scene.points.iter().step_by(8).copied().collect());
    own_estimate(&thin) > 1.5 * sigma
}

/// Lower quartile over the cloud of the eighth-smallest distance of 16 neighbours from the best plane
/// through two of them and the point, as a standard deviation; infinite where that is not below `limit`.
fn robust_estimate(scene: &Scene, limit: f64) -> f64 {
    // Where so few are below the limit the quartile is not: five deviations for a thousand points and more.
    let few = least_distances(scene, 4, EIGHTH, limit);
    if few.iter().filter(|d| d.is_finite()).count() * 10 < few.len() {
        return f64::INFINITY;
    }
    quartile(least_distances(scene, 1, EIGHTH, limit))
}

/// Which of 16 distances from the best plane, in their order, tells a thin sheet from noise, and which the noise on
/// it.
const EIGHTH: usize = 8;
const SEVENTH: usize = 7;
/// Such a distance is taken for so many sigmas. The seventh of 16 half-normal ones lies near 0.56 sigma; that from the
/// best of all planes lower.
const UNIT: f64 = 0.35;

/// The `nth` smallest distance of 16 neighbours from the best plane, as a standard deviation, at every `thinned`-th
/// point of a sample; infinite where it is not below `limit`.
fn least_distances(scene: &Scene, thinned: usize, nth: usize, limit: f64) -> Vec<f64> {
    let n = scene.len();
    let stride = thinned * n.div_ceil(SAMPLE / 2);
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
            least_distance(&q, nth, limit * UNIT) / UNIT
        })
        .collect()
}

/// Neighbourhoods looked at between two looks at whether the work was cancelled.
const WATCHED: usize = 64;

fn quartile(mut v: Vec<f64>) -> f64 {
    let k = v.len() / 4;
    *v.select_nth_unstable_by(k, f64::total_cmp).1
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

fn smooth_estimate(scene: &Scene) -> f64 {
    let n = scene.len();
    let stride = n.div_ceil(SAMPLE);
    let v: Vec<f64> = (0..n)
        .into_par_iter()
        .step_by(stride)
        .filter(|i| !(i / stride).is_multiple_of(WATCHED) || !scene.cancelled())
        .filter_map(|i| residual_variance(scene, i))
        .collect();
    if v.is_empty() {
        return 0.0;
    }
    (quartile(v) / CHI2_10_QUARTER).max(0.0).sqrt()
}

/// Variance of 16 points about a graph quadric (10 degrees of freedom).
fn residual_variance(scene: &Scene, i: usize) -> Option<f64> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::random::SplitMix64;

    #[test]
    fn depths_in_whole_steps_scatter_by_the_step() {
        let random = &mut SplitMix64::new(4);
        let mut unit = || random.below(1 << 30) as f64 / f64::from(1 << 30);
        // steep enough that a neighbourhood sees several steps, as of a depth camera
        let points = (0..20_000).map(|_| {
            let (x, y) = (150.0 * unit(), 150.0 * unit());
            Vec3::new(x, y, (0.6 * x + 0.2 * y).round())
        });
        let sigma = estimate(&Scene::new(points.collect()));
        // a step of 1 has a standard deviation of 0.29, less by the slope
        assert!((0.1..0.5).contains(&sigma), "{sigma}");
    }

    #[test]
    fn the_sides_of_a_thin_sheet_do_not_count_as_noise() {
        for exact in [true, false] {
            let noise = if exact { 0.0 } else { 0.03 };
            let random = &mut SplitMix64::new(5);
            let mut unit = || random.below(1 << 30) as f64 / f64::from(1 << 30);
            // Both sides are nearer to each other than the points of one: half of a neighbourhood is the other's.
            let points: Vec<Vec3> = (0..8000)
                .map(|k| {
                    let (x, y) = (180.0 * unit(), 180.0 * unit());
                    let scatter: f64 = (0..12).map(|_| unit()).sum::<f64>() - 6.0;
                    Vec3::new(x, y, f64::from(k % 2) * 2.0 + noise * scatter)
                })
                .collect();
            let sigma = estimate(&Scene::new(points));
            assert!(sigma <= 4.0 * noise + 1e-9 && sigma >= 0.5 * noise, "{noise}: {sigma}");
        }
    }
}
