//! The noise of a cloud, from the scatter about local graph quadrics.

use crate::fit::constant::constants;
use crate::segment::objective::FEW;
use crate::segment::prepare::residuals::{SAMPLE, WATCHED, quartile};
use rayon::prelude::*;

use crate::segment::prepare::candidates::K;
use crate::segment::prepare::residuals::{
    SEVENTH, least_distances, residual_variance, robust_estimate,
};
use crate::segment::prepare::scene::Scene;

constants! {
    /// Median roughness above which points fill a volume (1/3 in an even filling).
    pub VOLUME: f64 = 0.12, Trial(0.12, 0.12);
    /// Steps that a coordinate that comes in steps has at least.
    LEAST_STEPS: usize = 50, Trial(50.0, 50.0);
    /// One point in so many stays each time that a cloud is thinned.
    THINNING: usize = 4, Effort("rounds of thinning");
    /// Points that must stay.
    LEAST_THINNED: usize = 256, Derived("16 neighbourhoods of 16 points");
    /// The 25 % quantile of chi2 with 10 degrees of freedom, over 10.
    CHI2_10_QUARTER: f64 = 0.6737, Derived("the quantile 6.737 of chi2 with 10 degrees of freedom, over 10");
    /// One point in so many tells whether the noise grows with the spacing.
    SPARSE: usize = 8, Derived("twice the spacing in a volume");
    /// Noise over the spacing from which on it is a good part of that.
    THICK: f64 = 0.15, Trial(0.15, 0.15);
    /// How many times smaller an estimate about robust planes is believed.
    THIN_WALL: f64 = 4.0, Trial(4.0, 4.0);
    /// Scatter over the step of a coordinate that comes in steps, at least.
    FINE_STEP: f64 = 0.05, Trial(0.05, 0.05);
    /// The same at most.
    COARSE_STEP: f64 = 2.0, Trial(2.0, 2.0);
    /// Share of the scatter below which a difference of coordinates is rounding.
    NO_STEP: f64 = 1e-6, Trial(1e-06, 1e-06);
}

/// Whether the points fill a volume: neighbourhoods are as thick as wide, and the noise, a good part of the
/// spacing, grows with it when the cloud is thinned, as no noise of a surface does.
pub fn fills_volume(scene: &Scene, sigma: f64) -> bool {
    if scene.len() < SPARSE.get() * 4 * K || !is_thick(scene, sigma) {
        return false;
    }
    let thin = scene.part(scene.points.iter().step_by(SPARSE.get()).copied().collect());
    own_estimate(&thin) > half_grown(SPARSE.get()) * sigma
}

/// Half, in logs, of what the spacing grows by in a volume of which one point in so many stays: the noise grows as much
/// there, and not at all on a surface.
fn half_grown(thinning: usize) -> f64 {
    (thinning as f64).powf(1.0 / 6.0)
}

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
pub fn is_thick(scene: &Scene, sigma: f64) -> bool {
    sigma >= THICK.get() * scene.spacing
        && scene.median_roughness(0..scene.len() as u32) >= VOLUME.get() as f32
}

/// The noise of a scene whose neighbourhoods, `sigma` thick, are as thick as wide, from ever fewer of its points:
/// the estimate grows until neighbourhoods reach beyond the noise. In a volume it grows without end; then `sigma`.
fn thinned_estimate(scene: &Scene, sigma: f64) -> f64 {
    let mut last = sigma;
    let mut points = scene.points.clone();
    while points.len() >= THINNING.get() * LEAST_THINNED.get() {
        points = points.iter().step_by(THINNING.get()).copied().collect();
        let thin = scene.part(points);
        let next = own_estimate(&thin);
        if next < half_grown(THINNING.get()) * last {
            return next.max(last);
        }
        (last, points) = (next, thin.points);
    }
    sigma
}

/// [`estimate`] from the points as dense as they are.
pub fn own_estimate(scene: &Scene) -> f64 {
    let smooth = smooth_estimate(scene);
    let robust = robust_estimate(scene, smooth / THIN_WALL.get());
    if robust * THIN_WALL.get() < smooth && !comes_in_steps(scene, smooth) {
        // Where half of a neighbourhood is the other side's, the eighth is often its own side's last.
        quartile(least_distances(scene, 1, SEVENTH.get(), smooth / THIN_WALL.get()))
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
        let mut steps: Vec<f64> = values
            .windows(2)
            .map(|w| w[1] - w[0])
            .filter(|d| *d > NO_STEP.get() * scatter)
            .collect();
        if steps.len() < LEAST_STEPS.get() || steps.len() * FEW.get() > values.len() {
            return false;
        }
        let mid = steps.len() / 2;
        let step = *steps.select_nth_unstable_by(mid, f64::total_cmp).1;
        (FINE_STEP.get()..COARSE_STEP.get()).contains(&(scatter / step))
    })
}

fn smooth_estimate(scene: &Scene) -> f64 {
    let n = scene.len();
    let stride = n.div_ceil(SAMPLE.get());
    let v: Vec<f64> = (0..n)
        .into_par_iter()
        .step_by(stride)
        .filter(|i| !(i / stride).is_multiple_of(WATCHED) || !scene.cancelled())
        .filter_map(|i| residual_variance(scene, i))
        .collect();
    if v.is_empty() {
        return 0.0;
    }
    (quartile(v) / CHI2_10_QUARTER.get()).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;
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
        assert!((0.2..0.3).contains(&sigma), "{sigma}");
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
            // Above the noise, as the eighth of the neighbours is often the other side's: twice with these points.
            assert!(sigma <= 2.4 * noise + 1e-9 && sigma >= noise, "{noise}: {sigma}");
        }
    }
}
