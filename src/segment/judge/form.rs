//! Residuals of neighbours that go together: noise that is smooth, a form error, or no surfaces at all.
//!
//! Noise that is not independent from point to point leaves surfaces what they are: growth from anywhere on one ends
//! with the same points once it reckons with all of it. On freeform each slides to where its seed lay, at any scatter.

use crate::fit::constant::constants;
use crate::segment::family::Families;
use crate::segment::grow::hypothesis::Hypothesis;
use crate::segment::grow::search::Search;
use crate::segment::judge::parabola::is_parabolic;
use crate::segment::judge::scatter::{LEVEL, ROUGH, far_less, in_common, most, scatter, typical};
use crate::segment::judge::stability::{judged, rescued};
use crate::segment::judge::whiteness::{correlated, correlation};
use crate::segment::objective::{CORRELATED, HALF, PART};
use crate::segment::partition::{Partition, members};
use crate::segment::prepare::scene::Scene;
use crate::segment::{Cancelled, Monitor};

constants! {
    /// Hypotheses after which the form of a scene is first judged.
    FORM_SAMPLE: usize = 16, Effort("hypotheses after which the form is judged");
    /// Mean correlation of settled surfaces' residuals beyond which these go together: else hardly any is left.
    SEEN: f64 = 0.035, Trial(0.035, 0.035);
    /// Scatter over that of finer surfaces from which on these are found by themselves first.
    FAR: f64 = 3.0, Trial(3.0, 3.0);
}

/// What a look at a scene's hypotheses gave.
pub enum Looked {
    /// Hypotheses, at the scatter and with the correlation that `families` now hold, and whether surfaces are all
    /// there is.
    Found(Vec<Hypothesis>, bool),
    /// Hypotheses whose residuals go together, but not so clearly that it may not be due to some that bridge: labels
    /// that settle tell.
    Suspected(Vec<Hypothesis>),
    /// Residuals go together: a denser sample may tell why.
    Doubtful,
}

/// The hypotheses of a scene. Where neighbours' residuals go together, or a good part of the points fits nothing at the
/// noise in `families`, those at the least scatter at which they are the same wherever they start; `families` then hold
/// that scatter and what residuals have in common. None where there is no such scatter.
///
/// `dense`: no denser sample can tell; `seen`: residuals of settled surfaces go together, see [`is_seen`].
///
/// # Errors
/// `monitor` cancelled the work.
pub fn hypotheses(
    scene: &Scene,
    families: &mut Families,
    seed: u64,
    (dense, seen): (bool, bool),
    trials: &mut (usize, usize),
    monitor: &dyn Monitor,
) -> Result<Looked, Cancelled> {
    let clear = |found: &[Hypothesis]| {
        found.len() >= FORM_SAMPLE.get() && typical(found) > 2.0 * CORRELATED.get()
    };
    let mut found = Search::new(scene, families, seed).run(trials, clear, monitor)?;
    // Whoever gives the noise or a tolerance means it, unless next to nothing fits.
    let is_given = families.floor >= families.sigma;
    while let Some(sigma) = far_less(scene, families, &found).filter(|_| !is_given) {
        families.sigma = sigma;
        found = Search::new(scene, families, seed).run(trials, clear, monitor)?;
    }
    let common = typical(&found) > CORRELATED.get();
    let taken = taken(&found, scene.len());
    let open = taken.iter().filter(|t| !**t).count() as f64 / scene.len() as f64;
    // Where hardly any are taken, labels tell nothing.
    if common && !seen && !clear(&found) && open < HALF.get() {
        return Ok(Looked::Suspected(found));
    }
    if common && let Some(finer) = finer(scene, families, &found) {
        return Ok(Looked::Found(finer, false));
    }
    let little = if is_given && !families.rougher { HALF.get() } else { ROUGH.get() };
    if !common && open < little {
        return Ok(Looked::Found(found, true));
    }
    // Where residuals go together, or next to nothing fits, what is found is not yet any surface's.
    let others: &[bool] = if common || open > HALF.get() { &[] } else { &taken };
    // Among surfaces that others are looked for beside, a share is easily won by chance.
    let only = dense && others.is_empty();
    let at = scatter(scene, families, seed, (others, only), trials, monitor)?;
    if !common && at.share <= most(families, only) {
        return Ok(Looked::Found(found, true));
    }
    if at.share <= most(families, only) && !dense {
        return Ok(Looked::Doubtful);
    }
    // Far rougher ones are for later: what lies beside each other on the finer would be one to them.
    let far = |sigma: f64| sigma > FAR.get() * families.sigma;
    if !common && open < HALF.get() && at.sigma.is_some_and(far) {
        return Ok(Looked::Found(judged(scene, families, found), false));
    }
    let Some(sigma) = at.sigma else { return Ok(Looked::Found(Vec::new(), false)) };
    families.sigma = LEVEL * sigma;
    families.floor = families.floor.max(sigma);
    families.common = at.common;
    let mut found = Search::new(scene, families, seed).run(trials, |_| false, monitor)?;
    families.common = families.common.max(in_common(&found));
    let is_stable = at.share > most(families, only);
    found = if is_stable { sound(scene, families, found) } else { judged(scene, families, found) };
    // Too little may be grown at the noise to tell what shows at the scatter.
    Ok(Looked::Found(found, !common && families.common == 0.0))
}

/// Hypotheses that are sound where their residuals have no more in common than all have.
fn sound(scene: &Scene, families: &Families, mut found: Vec<Hypothesis>) -> Vec<Hypothesis> {
    let more = |h: &Hypothesis| correlated(h.correlation, families.common, h.support.len());
    found.iter_mut().for_each(|h| h.sound = !more(h) && !is_parabolic(&h.shape));
    rescued(scene, families, found)
}

/// Whether what settled surfaces leave of their points goes together.
pub fn is_seen(scene: &Scene, model: &Partition, sigma: f64) -> bool {
    let groups = members(&model.labels, model.shapes.len());
    let (mut sum, mut points) = (0.0, 0.0);
    for (l, (shape, group)) in model.shapes.iter().zip(&groups).enumerate() {
        let inside = |j: u32| model.labels[j as usize] == l as i32;
        let n = group.len() as f64;
        sum += n * correlation(scene, shape, group, sigma, inside);
        points += n;
    }
    sum > SEEN.get() * points
}

/// The hypotheses, judged, where sound ones explain a good part of the scene: residuals go together on what is rougher than the
/// surfaces that these are.
fn finer(scene: &Scene, families: &Families, found: &[Hypothesis]) -> Option<Vec<Hypothesis>> {
    let is_good = |found: &[Hypothesis]| explained(found, scene.len()) > PART.get();
    let found = is_good(found).then(|| judged(scene, families, found.to_vec()))?;
    is_good(&found).then_some(found)
}

/// Share of `n` points that lie in sound hypotheses.
fn explained(found: &[Hypothesis], n: usize) -> f64 {
    let sound = found.iter().filter(|h| h.sound);
    taken(sound, n).iter().filter(|t| **t).count() as f64 / n as f64
}

/// Which of `n` points lie in a hypothesis.
fn taken<'a>(found: impl IntoIterator<Item = &'a Hypothesis>, n: usize) -> Vec<bool> {
    let mut taken = vec![false; n];
    found.into_iter().flat_map(|h| &h.support).for_each(|&i| taken[i as usize] = true);
    taken
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fits::Random;
    use crate::geometry::Vec3;
    use crate::segment::Silent;
    use crate::segment::fixtures::{self, SIGMA, ordered, partition, plane, sheet, smooth};

    /// A roof of two faces, its noise `white` and `smooth` in sigmas, on a floor that bends by `bent`.
    /// Hypotheses, whether surfaces are all there is, and what was reckoned with.
    fn looked(white: f64, form: f64, bent: f64, sigma: f64) -> (usize, bool, Families) {
        let random = &mut Random::new(5);
        let field = smooth(random);
        let mut at = || {
            let (x, y) = (random.uniform(-10.0, 10.0), random.uniform(0.0, 10.0));
            let flat = Vec3::new(x, y, 0.0);
            let off = SIGMA * (white * random.normal() + form * field(&flat));
            Vec3::new(x, y, 0.8 * x.abs() + off + bent * field(&(0.3 * flat)))
        };
        let scene = Scene::new(ordered(&(0..12_000).map(|_| at()).collect::<Vec<_>>()));
        let mut families = Families { sigma, floor: 0.0, max_radius: 1e4, ..fixtures::families() };
        let mut trials = (0, 0);
        let found =
            hypotheses(&scene, &mut families, 1, (true, true), &mut trials, &Silent).unwrap();
        let Looked::Found(found, all) = found else { panic!("a denser sample was asked for") };
        (found.len(), all, families)
    }

    #[test]
    fn independent_noise_has_nothing_in_common() {
        let (found, all, families) = looked(1.0, 0.0, 0.0, SIGMA);
        assert!(found >= 2 && all);
        assert_eq!((families.common, families.sigma), (0.0, SIGMA));
    }

    #[test]
    fn smooth_noise_is_reckoned_with_as_a_whole() {
        let (found, _, families) = looked(0.7, 1.5, 0.0, SIGMA);
        assert!((2..12).contains(&found), "{found}");
        // Nearly all of a residual is its neighbours' too, and sigma is the whole of it or a level or two more.
        assert!((0.5..0.95).contains(&families.common), "{}", families.common);
        let across = 1.0 / 0.8_f64.hypot(1.0);
        let whole = SIGMA * 0.7_f64.hypot(1.5) * across;
        assert!((whole..2.1 * whole).contains(&families.sigma), "{}", families.sigma);
    }

    #[test]
    fn a_noise_that_outliers_made_is_that_of_the_surface_among_them() {
        let random = &mut Random::new(11);
        let mut at = |k: usize| {
            let (x, y) = (random.uniform(0.0, 10.0), random.uniform(0.0, 10.0));
            let z = if k.is_multiple_of(2) {
                SIGMA * random.normal()
            } else {
                random.uniform(-5.0, 5.0)
            };
            Vec3::new(x, y, z)
        };
        let points: Vec<Vec3> = (0..6000).map(&mut at).collect();
        let scene = Scene::new(ordered(&points));
        let after = |sigma: f64, floor: f64| {
            let families = &mut Families { sigma, floor, max_radius: 1e4, ..fixtures::families() };
            hypotheses(&scene, families, 1, (true, false), &mut (0, 0), &Silent).unwrap();
            families.sigma / SIGMA
        };
        assert!((after(20.0 * SIGMA, 0.0) - 1.0).abs() < 0.3);
        assert!(after(20.0 * SIGMA, 20.0 * SIGMA) >= 20.0);
    }

    #[test]
    fn a_floor_on_one_level_of_steps_leaves_the_noise_that_rounding_makes() {
        let random = &mut Random::new(12);
        let step = 2.0 * SIGMA;
        let mut at = |k: usize| {
            let (u, v) = (random.uniform(0.0, 10.0), random.uniform(0.0, 10.0));
            let off = 0.5 * SIGMA * random.normal();
            let p = if k.is_multiple_of(2) {
                Vec3::new(u, v, off)
            } else {
                Vec3::new(u, 12.0 + off, v)
            };
            p.map(|x| (x / step).round() * step)
        };
        let points: Vec<Vec3> = (0..6000).map(&mut at).collect();
        let scene = Scene::new(ordered(&points)).stepped([step; 3]);
        let families =
            &mut Families { sigma: SIGMA, floor: 0.0, max_radius: 1e4, ..fixtures::families() };
        hypotheses(&scene, families, 1, (true, false), &mut (0, 0), &Silent).unwrap();
        assert!(families.sigma > 0.5 * SIGMA, "{}", families.sigma);
    }

    #[test]
    fn a_few_rough_points_leave_the_noise_that_is_given_what_it_is() {
        let random = &mut Random::new(9);
        let mut at = |k: usize| {
            let (x, y) = (random.uniform(0.0, 10.0), random.uniform(0.0, 10.0));
            let rough = if k < 1000 { 2.5 } else { 1.0 };
            let off = SIGMA * rough * random.normal();
            if k < 1000 { Vec3::new(0.2 * x, 0.2 * y, 5.0 + off) } else { Vec3::new(x, y, off) }
        };
        let points: Vec<Vec3> = (0..12_000).map(&mut at).collect();
        let scene = Scene::new(ordered(&points));
        let after = |floor: f64| {
            let families =
                &mut Families { sigma: SIGMA, floor, max_radius: 1e4, ..fixtures::families() };
            let dense = (true, false);
            hypotheses(&scene, families, 1, dense, &mut (0, 0), &Silent).unwrap();
            families.sigma
        };
        assert_eq!(after(SIGMA), SIGMA);
        assert!(after(0.0) > SIGMA);
    }

    #[test]
    fn smooth_noise_that_hides_at_a_sigma_too_small_for_growth_is_not_all_there_is() {
        for (part, form) in [(0.2, 1.0), (0.5, 0.5)] {
            let (found, all, families) = looked(1.0, form, 0.0, part * SIGMA);
            assert!(found > 0 && families.common > 0.1 && !all);
        }
    }

    #[test]
    fn residuals_of_a_surface_that_is_another_form_are_seen_and_those_of_noise_are_not() {
        let seen = |bend: f64| {
            let scene = sheet(6_000, |x| bend * SIGMA * (0.7 * x).sin());
            let labels = vec![0; scene.len()];
            is_seen(&scene, &partition(vec![plane(Vec3::zeros(), Vec3::z())], labels), SIGMA)
        };
        assert!(!seen(0.0) && seen(1.0));
    }

    #[test]
    fn freeform_is_no_noise_of_any_size() {
        assert_eq!(looked(1.0, 0.0, 3.0, SIGMA).0, 0);
    }
}
