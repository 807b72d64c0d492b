//! Form error: surfaces that are not quite what they should be, and scenes that hold none.
//!
//! Residuals of neighbours that go together say that a hypothesis is a piece of some other form: a freeform,
//! or a true surface with a form error above the noise. What tells them apart is where growth ends: on a true
//! surface hypotheses become the same wherever they start; on freeform each slides to where its
//! seed lay.

use rayon::prelude::*;

use super::engine::Model;
use super::family::Families;
use super::hypothesis::{Hypothesis, Walk, correlation, grow};
use super::label::members;
use super::scene::Scene;
use super::search::{MIN_SUPPORT, hypothesise};
use crate::segment::{Cancelled, Monitor};

/// Hypotheses after which the form of a scene is first judged.
const FORM_SAMPLE: usize = 16;
/// A hypothesis whose residuals are correlated beyond this is a piece of some other form.
const CORRELATED: f64 = 0.07;
/// Share of the points of hypotheses in correlated ones beyond which a form error is suspected, and clear.
const DOUBTFUL: f64 = 0.25;
const CLEAR: f64 = 0.6;
/// Mean correlation of settled surfaces' residuals beyond which it is seen: without form errors hardly any is left.
const SEEN: f64 = 0.035;
/// Multiples of sigma at which surfaces with a form error are looked for.
const LEVELS: [f64; 4] = [1.0, 2.0, 4.0, 8.0];
/// Those tried last, for what the others see only in part.
const BETWEEN: [f64; 2] = [2.8, 5.6];
/// How much more the thinner sample must scatter for a level of its own.
const CLEARLY: f64 = 1.25;
/// Seeds that tell whether a level is worth trying.
const LOOK: usize = 16;
/// Growths from elsewhere in a set of points that tell whether it is a surface's.
const REGROWN: usize = 5;
/// How many of them must end up the same.
const ALIKE: usize = 3;
/// Common share of two supports that are the same.
const SAME: f64 = 0.75;

/// Share of the grown points that lie in hypotheses with correlated residuals.
fn correlated_share(hypotheses: &[Hypothesis]) -> f64 {
    let all: usize = hypotheses.iter().map(|h| h.support.len()).sum();
    let bad = hypotheses.iter().filter(|h| h.correlation > CORRELATED);
    bad.map(|h| h.support.len()).sum::<usize>() as f64 / all.max(1) as f64
}

/// The scatter about surfaces at which these are looked for, rising: multiples of the points' noise, and of what
/// the neighbourhoods of the thinner sample scatter by where that is clearly more.
pub fn levels(noise: f64, thinner: f64) -> Vec<f64> {
    let mut levels: Vec<f64> = LEVELS.iter().map(|l| l * noise).collect();
    let most = LEVELS[LEVELS.len() - 1];
    levels.extend(Some(most * thinner).filter(|l| *l > CLEARLY * most * noise));
    levels
}

/// Levels between those of [`levels`].
pub fn between(noise: f64) -> [f64; 2] {
    BETWEEN.map(|l| l * noise)
}

/// The hypotheses of a scene, and whether a good part of what they cover goes together as with a form error; none where
/// that is clear.
///
/// Hypotheses that bridge smooth joints look like that too, until labels and surfaces have settled. Then
/// [`is_seen`] tells.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn hypotheses(
    scene: &Scene,
    families: &Families,
    seed: u64,
    trials: &mut (usize, usize),
    monitor: &dyn Monitor,
) -> Result<Option<(Vec<Hypothesis>, bool)>, Cancelled> {
    let clear =
        |found: &[Hypothesis]| found.len() >= FORM_SAMPLE && correlated_share(found) > CLEAR;
    let found = hypothesise(scene, families, usize::MAX, seed, trials, clear, monitor)?;
    let doubtful = correlated_share(&found) > DOUBTFUL;
    Ok((!clear(&found)).then_some((found, doubtful)))
}

/// Whether what settled surfaces leave of their points goes together as with a form error.
pub fn is_seen(scene: &Scene, model: &Model, sigma: f64) -> bool {
    let groups = members(&model.labels, model.shapes.len());
    let (mut sum, mut points) = (0.0, 0.0);
    for (l, (shape, group)) in model.shapes.iter().zip(&groups).enumerate() {
        let inside = |j: u32| model.labels[j as usize] == l as i32;
        let n = group.len() as f64;
        sum += n * correlation(scene, shape, group, sigma, inside);
        points += n;
    }
    sum > SEEN * points
}

/// The hypotheses of a scene whose surfaces have a form error that `families` take account of; none where most of
/// the first ones slide.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn loose_hypotheses(
    scene: &Scene,
    families: &Families,
    seed: u64,
    trials: &mut (usize, usize),
    monitor: &dyn Monitor,
) -> Result<Option<Vec<Hypothesis>>, Cancelled> {
    let few = hypothesise(scene, families, LOOK, seed, trials, |_| false, monitor)?;
    if stable_share(scene, families, few) <= 0.5 {
        return Ok(None);
    }
    let all = hypothesise(scene, families, usize::MAX, seed, trials, |_| false, monitor)?;
    Ok(Some(judged(scene, families, all)))
}

/// Share of the points that hypotheses cover which sound ones do.
fn stable_share(scene: &Scene, families: &Families, found: Vec<Hypothesis>) -> f64 {
    let points = |found: &[Hypothesis]| {
        let mut all: Vec<u32> = found.iter().flat_map(|h| h.support.iter().copied()).collect();
        all.sort_unstable();
        all.dedup();
        all.len()
    };
    let all = points(&found);
    let mut good = judged(scene, families, found);
    good.retain(|h| h.sound);
    points(&good) as f64 / all.max(1) as f64
}

/// The hypotheses of a scene without surfaces at any level that stand out of its form.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn outstanding_hypotheses(
    scene: &Scene,
    families: &Families,
    seed: u64,
    trials: &mut (usize, usize),
    monitor: &dyn Monitor,
) -> Result<Vec<Hypothesis>, Cancelled> {
    let early = |found: &[Hypothesis]| found.len() >= FORM_SAMPLE;
    Ok(standing_out(hypothesise(scene, families, usize::MAX, seed, trials, early, monitor)?))
}

/// The hypotheses, those sound that are the same wherever they start.
fn judged(scene: &Scene, families: &Families, mut found: Vec<Hypothesis>) -> Vec<Hypothesis> {
    found.par_iter_mut().for_each_init(
        || Walk::new(scene.len()),
        |walk, h| h.sound = is_stable(scene, walk, families, &h.support),
    );
    found
}

/// The regions of a scene with form errors that are no surfaces: growth from elsewhere in them ends
/// elsewhere. They keep their points from flowing to their neighbours, and are not reported.
pub fn spurious(scene: &Scene, families: &Families, labels: &[i32], regions: usize) -> Vec<bool> {
    members(labels, regions)
        .par_iter()
        .map_init(
            || Walk::new(scene.len()),
            |walk, region| !is_stable(scene, walk, families, region),
        )
        .collect()
}

/// Whether most growths from elsewhere in a set of points end up with the same points.
fn is_stable(scene: &Scene, walk: &mut Walk, families: &Families, points: &[u32]) -> bool {
    if points.len() < REGROWN || scene.cancelled() {
        return false;
    }
    let mut own = points.to_vec();
    own.sort_unstable();
    let (mut alike, mut other) = (0, 0);
    for k in 0..REGROWN {
        let seed = points[(2 * k + 1) * points.len() / (2 * REGROWN)] as usize;
        let grown = grow(scene, walk, families, seed, MIN_SUPPORT);
        if grown.is_some_and(|h| common_share(&own, &h.support) > SAME) {
            alike += 1;
        } else {
            other += 1;
        }
        if alike == ALIKE || other > REGROWN - ALIKE {
            break;
        }
    }
    alike == ALIKE
}

/// Points in both of two sets over those in either; `sorted` rises.
fn common_share(sorted: &[u32], other: &[u32]) -> f64 {
    let common = other.iter().filter(|i| sorted.binary_search(i).is_ok()).count();
    common as f64 / (sorted.len() + other.len() - common) as f64
}

/// Of a freeform scene's hypotheses, those that stand out: residuals like noise, and several times larger
/// than the patches that the form breaks into.
fn standing_out(hypotheses: Vec<Hypothesis>) -> Vec<Hypothesis> {
    let mut patches: Vec<usize> =
        hypotheses.iter().filter(|h| h.correlation > CORRELATED).map(|h| h.support.len()).collect();
    patches.sort_unstable();
    let typical = patches.get(patches.len() / 2).copied().unwrap_or(0);
    hypotheses
        .into_iter()
        .filter(|h| h.correlation <= 0.5 * CORRELATED && h.support.len() > 3 * typical)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Family;
    use crate::geometry::Vec3;
    use crate::segment::Parameters;
    use crate::segment::distance::family::Policy;
    use crate::segment::random::SplitMix64;

    #[test]
    fn a_whole_face_is_a_surface_and_half_of_one_is_not() {
        let random = &mut SplitMix64::new(3);
        let mut unit = || random.below(1 << 30) as f64 / f64::from(1 << 30);
        // two faces with a gap between them; of the second only one half has a region
        let mut points: Vec<Vec3> =
            (0..1200).map(|_| Vec3::new(10.0 * unit(), 10.0 * unit(), 0.01 * unit())).collect();
        points.extend(
            (0..1200).map(|_| Vec3::new(30.0 + 10.0 * unit(), 10.0 * unit(), 0.01 * unit())),
        );
        let side = |p: &Vec3| match p.x {
            x if x < 20.0 => 0,
            x if x < 35.0 => 1,
            _ => -1,
        };
        let labels: Vec<i32> = points.iter().map(side).collect();
        let sigma = 0.003;
        let families = Families {
            allowed: Family::ALL.to_vec(),
            sigma,
            floor: sigma,
            max_radius: 1e3,
            strips: true,
            policy: Policy::of(&Parameters::default()),
        };
        assert_eq!(spurious(&Scene::new(points), &families, &labels, 2), [false, true]);
    }

    #[test]
    fn a_thinner_sample_has_a_level_of_its_own_where_it_scatters_clearly_more() {
        assert_eq!(levels(0.5, 0.5), [0.5, 1.0, 2.0, 4.0]);
        assert_eq!(levels(0.5, 0.6), [0.5, 1.0, 2.0, 4.0]);
        assert_eq!(levels(0.5, 1.0), [0.5, 1.0, 2.0, 4.0, 8.0]);
    }

    #[test]
    fn the_common_share_is_that_of_both_in_either() {
        assert_eq!(common_share(&[1, 2, 3, 4], &[4, 3, 9, 8]), 2.0 / 6.0);
        assert_eq!(common_share(&[1, 2], &[2, 1]), 1.0);
    }
}
