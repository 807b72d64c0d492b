//! Form error: surfaces that are not quite what they should be, and scenes that hold none.
//!
//! Residuals of neighbours that go together say that a hypothesis is a piece of some other form: a freeform,
//! or a true surface with a form error above the noise. What tells them apart is where growth ends: on a true
//! surface hypotheses become the same wherever they start; on freeform each slides to where its
//! seed lay.

use crate::fit::constant::constants;
use crate::segment::family::Families;
use crate::segment::grow::hypothesis::Hypothesis;
use crate::segment::grow::search::Search;
use crate::segment::judge::stability::judged;
use crate::segment::judge::whiteness::correlation;
use crate::segment::partition::{Partition, members};
use crate::segment::prepare::scene::Scene;
use crate::segment::{Cancelled, Monitor};

constants! {
    /// Hypotheses after which the form of a scene is first judged.
    FORM_SAMPLE: usize = 16, Effort("hypotheses after which the form is judged");
    /// A hypothesis whose residuals are correlated beyond this is a piece of some other form.
    CORRELATED: f64 = 0.07, Trial(0.07, 0.07);
    /// Share of the points of hypotheses in correlated ones beyond which a form error is suspected.
    DOUBTFUL: f64 = 0.25, Trial(0.25, 0.25);
    /// Share of the points of hypotheses in correlated ones beyond which a form error is clear.
    CLEAR: f64 = 0.6, Trial(0.6, 0.6);
    /// Mean correlation of settled surfaces' residuals beyond which it is seen: without form errors hardly any is left.
    SEEN: f64 = 0.035, Trial(0.035, 0.035);
    /// How much more the thinner sample must scatter for a level of its own.
    CLEARLY: f64 = 1.25, Trial(1.25, 1.25);
    /// Seeds that tell whether a level is worth trying.
    LOOK: usize = 16, Effort("seeds tried");
    /// Share of [`CORRELATED`] below which residuals are like noise.
    LIKE_NOISE: f64 = 0.5, Trial(0.5, 0.5);
    /// How many times larger than the patches of a freeform is what stands out of it.
    LARGER: usize = 3, Trial(3.0, 3.0);
}

/// Multiples of sigma at which surfaces with a form error are looked for.
const LEVELS: [f64; 4] = [1.0, 2.0, 4.0, 8.0];

/// Those tried last, for what the others see only in part.
const BETWEEN: [f64; 2] = [2.8, 5.6];

/// Share of the grown points that lie in hypotheses with correlated residuals.
fn correlated_share(hypotheses: &[Hypothesis]) -> f64 {
    let all: usize = hypotheses.iter().map(|h| h.support.len()).sum();
    let bad = hypotheses.iter().filter(|h| h.correlation > CORRELATED.get());
    bad.map(|h| h.support.len()).sum::<usize>() as f64 / all.max(1) as f64
}

/// The scatter about surfaces at which these are looked for, rising: multiples of the points' noise, and of what
/// the neighbourhoods of the thinner sample scatter by where that is clearly more.
pub fn levels(noise: f64, thinner: f64) -> Vec<f64> {
    let mut levels: Vec<f64> = LEVELS.iter().map(|l| l * noise).collect();
    let most = LEVELS[LEVELS.len() - 1];
    levels.extend(Some(most * thinner).filter(|l| *l > CLEARLY.get() * most * noise));
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
    let clear = |found: &[Hypothesis]| {
        found.len() >= FORM_SAMPLE.get() && correlated_share(found) > CLEAR.get()
    };
    let found = Search::new(scene, families, seed).run(trials, clear, monitor)?;
    let doubtful = correlated_share(&found) > DOUBTFUL.get();
    Ok((!clear(&found)).then_some((found, doubtful)))
}

/// Whether what settled surfaces leave of their points goes together as with a form error.
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
    let all = Search::new(scene, families, seed);
    let few = Search { most: LOOK.get(), ..all }.run(trials, |_| false, monitor)?;
    if !are_mostly_stable(scene, families, few) {
        return Ok(None);
    }
    Ok(Some(judged(scene, families, all.run(trials, |_| false, monitor)?)))
}

/// Hypotheses judged at once.
const AT_ONCE: usize = 4;

/// Whether sound hypotheses cover more than half of the points that all cover. As many are judged as it takes to tell.
fn are_mostly_stable(scene: &Scene, families: &Families, found: Vec<Hypothesis>) -> bool {
    let points = |found: &[Hypothesis]| {
        let mut all: Vec<u32> = found.iter().flat_map(|h| h.support.iter().copied()).collect();
        all.sort_unstable();
        all.dedup();
        all.len()
    };
    let all = points(&found);
    let (mut open, mut sound) = (found, Vec::new());
    while 2 * points(&sound) <= all {
        let most = [&sound[..], &open[..]].concat();
        if open.is_empty() || 2 * points(&most) <= all {
            return false;
        }
        let few = open.drain(..open.len().min(AT_ONCE)).collect();
        sound.extend(judged(scene, families, few).into_iter().filter(|h| h.sound));
    }
    true
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
    let early = |found: &[Hypothesis]| found.len() >= FORM_SAMPLE.get();
    Ok(standing_out(Search::new(scene, families, seed).run(trials, early, monitor)?))
}

/// Of a freeform scene's hypotheses, those that stand out: residuals like noise, and several times larger
/// than the patches that the form breaks into.
fn standing_out(hypotheses: Vec<Hypothesis>) -> Vec<Hypothesis> {
    let mut patches: Vec<usize> = hypotheses
        .iter()
        .filter(|h| h.correlation > CORRELATED.get())
        .map(|h| h.support.len())
        .collect();
    patches.sort_unstable();
    let typical = patches.get(patches.len() / 2).copied().unwrap_or(0);
    hypotheses
        .into_iter()
        .filter(|h| {
            h.correlation <= LIKE_NOISE.get() * CORRELATED.get()
                && h.support.len() > LARGER.get() * typical
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thinner_sample_has_a_level_of_its_own_where_it_scatters_clearly_more() {
        assert_eq!(levels(0.5, 0.5), [0.5, 1.0, 2.0, 4.0]);
        assert_eq!(levels(0.5, 0.6), [0.5, 1.0, 2.0, 4.0]);
        assert_eq!(levels(0.5, 1.0), [0.5, 1.0, 2.0, 4.0, 8.0]);
    }
}
