//! Residuals of neighbours that go together: noise that is smooth, a form error, or no surfaces at all.
//!
//! Noise that is not independent from point to point leaves surfaces what they are: growth from anywhere on one ends
//! with the same points once it reckons with all of it. On freeform each slides to where its seed lay, at any scatter.

use crate::fit::constant::constants;
use crate::segment::family::Families;
use crate::segment::grow::hypothesis::Hypothesis;
use crate::segment::grow::search::{Search, allowance};
use crate::segment::judge::parabola::is_parabolic;
use crate::segment::judge::stability::{judged, rescued};
use crate::segment::judge::whiteness::{correlated, correlation};
use crate::segment::objective::{CORRELATED, HALF, LITTLE, MOST};
use crate::segment::partition::{Partition, members};
use crate::segment::prepare::scene::Scene;
use crate::segment::{Cancelled, Monitor};

constants! {
    /// Hypotheses after which the form of a scene is first judged.
    FORM_SAMPLE: usize = 16, Effort("hypotheses after which the form is judged");
    /// Scatters at which surfaces are looked for, in steps of a factor of the square root of two from the noise
    /// between neighbours up.
    LEVELS: usize = 7, Effort("scatters tried");
    /// Scatter, in spacings, up to which those beyond are tried as well, twice as large each: of noise that is all smooth
    /// the nearest neighbours show next to nothing, and of freeform so little leaves no surface whole.
    SMALL: f64 = 0.06, Trial(0.06, 0.06);
    /// Share of the points that fit nothing at the noise, and do at a larger scatter, from which on that is the scene's:
    /// so many save by it, from the price of a point without surface to that of one on it, what the others lose.
    ROUGH: f64 = 0.02, Trial(0.02, 0.05);
    /// Mean correlation of settled surfaces' residuals beyond which these go together: else hardly any is left.
    SEEN: f64 = 0.035, Trial(0.035, 0.035);
    /// Seeds that tell whether a level is worth trying.
    LOOK: usize = 16, Effort("seeds tried");
}

/// From one to the next.
const LEVEL: f64 = std::f64::consts::SQRT_2;

/// The correlation of residuals that half of the grown points lie below.
fn typical(hypotheses: &[Hypothesis]) -> f64 {
    let mut all: Vec<(f64, usize)> =
        hypotheses.iter().map(|h| (h.correlation, h.support.len())).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = all.iter().map(|h| h.1).sum::<usize>() / 2;
    let mut points = 0;
    let reached = |h: &&(f64, usize)| {
        points += h.1;
        points > half
    };
    all.iter().find(reached).map_or(0.0, |h| h.0)
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
    let found = Search::new(scene, families, seed).run(trials, clear, monitor)?;
    let common = typical(&found) > CORRELATED.get();
    let covered = taken(&found, scene.len()).iter().filter(|t| **t).count() as f64;
    // Where hardly any are taken, labels tell nothing.
    if common && !seen && !clear(&found) && covered > HALF.get() * scene.len() as f64 {
        return Ok(Looked::Suspected(found));
    }
    let taken = if common { Vec::new() } else { taken(&found, scene.len()) };
    let open = taken.iter().filter(|t| !**t).count();
    if !common && (open as f64) < ROUGH.get() * scene.len() as f64 {
        return Ok(Looked::Found(found, true));
    }
    let at = scatter(scene, families, seed, &taken, trials, monitor)?;
    if !common && at.share <= MOST.get() {
        return Ok(Looked::Found(found, true));
    }
    if at.share <= MOST.get() && !dense {
        return Ok(Looked::Doubtful);
    }
    let Some(sigma) = at.sigma else { return Ok(Looked::Found(Vec::new(), false)) };
    families.sigma = LEVEL * sigma;
    families.floor = families.floor.max(sigma);
    families.common = at.common;
    let mut found = Search::new(scene, families, seed).run(trials, |_| false, monitor)?;
    families.common = in_common(&found);
    if at.share <= MOST.get() {
        found = judged(scene, families, found);
    } else {
        let more = |h: &Hypothesis| correlated(h.correlation, families.common, h.support.len());
        found.iter_mut().for_each(|h| h.sound = !more(h) && !is_parabolic(&h.shape));
        found = rescued(scene, families, found);
    }
    Ok(Looked::Found(found, at.share > MOST.get()))
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

/// Which of `n` points lie in a hypothesis.
fn taken(found: &[Hypothesis], n: usize) -> Vec<bool> {
    let mut taken = vec![false; n];
    found.iter().flat_map(|h| &h.support).for_each(|&i| taken[i as usize] = true);
    taken
}

/// What residuals of neighbours have in common at hypotheses of one scatter.
fn in_common(found: &[Hypothesis]) -> f64 {
    Some(typical(found)).filter(|c| *c > CORRELATED.get()).unwrap_or(0.0)
}

/// The scatter at which most of what is grown is the same wherever it starts.
struct Scatter {
    /// It, or that at which the most is; none where next to nothing is at any.
    sigma: Option<f64>,
    /// Share of the grown points that is.
    share: f64,
    /// What residuals have in common there.
    common: f64,
}

/// Looks for surfaces at rising scatters among the points that are not `taken`; these must then be a good part of the
/// scene's.
fn scatter(
    scene: &Scene,
    families: &Families,
    seed: u64,
    taken: &[bool],
    trials: &mut (usize, usize),
    monitor: &dyn Monitor,
) -> Result<Scatter, Cancelled> {
    let mut best = Scatter { sigma: None, share: LITTLE.get(), common: 0.0 };
    let first = usize::from(!taken.is_empty());
    // All levels together may be as much work as two searches, or twice what it took to find what is there.
    let done = scene.work.done();
    let rough = !taken.is_empty();
    let allowed = done + if rough { 2 * done } else { 2 * allowance(scene.len()) };
    // Some surfaces are rougher than others, but not beyond measure.
    let small = if taken.is_empty() { SMALL.get() * scene.spacing } else { 0.0 };
    for (level, sigma) in scatters(families.sigma, small).enumerate().skip(first) {
        if scene.work.done() > allowed {
            if !rough {
                scene.work.leave();
            }
            break;
        }
        let looser = Families { sigma, ..families.clone() };
        let search = Search { vain: taken, ..Search::new(scene, &looser, seed ^ level as u64) };
        let mut look = |most: usize| -> Result<(f64, f64), Cancelled> {
            let few = Search { most, ..search }.run(trials, |_| false, monitor)?;
            let part = most as f64 / LOOK.get() as f64;
            let enough = newly(&few, taken) as f64 >= part * ROUGH.get() * scene.len() as f64;
            let common = in_common(&few);
            let share = if enough || !rough { stable_share(scene, &looser, few) } else { 0.0 };
            Ok((share, common))
        };
        // Of freeform none is, and by outliers few points are won: the first few seeds tell.
        if look(AT_ONCE)?.0 == 0.0 {
            continue;
        }
        let (share, common) = look(LOOK.get())?;
        if share > best.share {
            best = Scatter { sigma: Some(sigma), share, common };
        }
        if share > MOST.get() {
            break;
        }
    }
    Ok(best)
}

/// Scatters at which surfaces are looked for where there is `noise` between neighbours: several, and more of them while
/// they are `small`.
fn scatters(noise: f64, small: f64) -> impl Iterator<Item = f64> {
    let near = (0..LEVELS.get()).map(move |k| noise * LEVEL.powi(k as i32));
    let last = noise * LEVEL.powi(LEVELS.get() as i32 - 1);
    let beyond = std::iter::successors(Some(2.0 * last), |s| Some(2.0 * s));
    near.chain(beyond.take_while(move |s| *s < small))
}

/// Hypotheses judged at once.
const AT_ONCE: usize = 4;

/// Points in hypotheses that were not `taken` before.
fn newly(found: &[Hypothesis], taken: &[bool]) -> usize {
    let mut all = taken.to_vec();
    let of = found.iter().flat_map(|h| &h.support).map(|&i| i as usize);
    of.filter(|&i| all.get_mut(i).is_some_and(|t| !std::mem::replace(t, true))).count()
}

/// Share of the points in hypotheses that is in those which are the same wherever they start. As many are judged as it
/// takes to tell that it is not [`MOST`].
fn stable_share(scene: &Scene, families: &Families, mut found: Vec<Hypothesis>) -> f64 {
    let points = |found: &[Hypothesis]| found.iter().map(|h| h.support.len()).sum::<usize>() as f64;
    let all = points(&found);
    let (mut looked, mut stable) = (0.0, 0.0);
    while !found.is_empty() && looked - stable < (1.0 - MOST.get()) * all {
        let few: Vec<Hypothesis> = found.drain(..found.len().min(AT_ONCE)).collect();
        looked += points(&few);
        let sound = judged(scene, families, few).into_iter().filter(|h| h.sound);
        stable += points(&sound.collect::<Vec<_>>());
    }
    stable / looked.max(1.0)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::fit::fits::Random;
    use crate::geometry::Vec3;
    use crate::segment::Silent;
    use crate::segment::fixtures::{self, SIGMA, ordered};

    /// A smooth field of variance one, with a correlation length of one.
    fn smooth(random: &mut Random) -> impl Fn(&Vec3) -> f64 + use<> {
        let waves: Vec<(Vec3, f64)> = (0..200)
            .map(|_| {
                let k = Vec3::new(random.normal(), random.normal(), random.normal());
                (k, random.uniform(0.0, TAU))
            })
            .collect();
        move |p| waves.iter().map(|(k, at)| (k.dot(p) + at).cos()).sum::<f64>() / 10.0
    }

    /// A roof of two faces, its noise `white` and `smooth` in sigmas, on a floor that bends by `bent`.
    fn looked(white: f64, form: f64, bent: f64, sigma: f64) -> (usize, Families) {
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
        let Looked::Found(found, _) = found else { panic!("a denser sample was asked for") };
        (found.len(), families)
    }

    #[test]
    fn independent_noise_has_nothing_in_common() {
        let (found, families) = looked(1.0, 0.0, 0.0, SIGMA);
        assert!(found >= 2);
        assert_eq!((families.common, families.sigma), (0.0, SIGMA));
    }

    #[test]
    fn smooth_noise_is_reckoned_with_as_a_whole() {
        let (found, families) = looked(0.7, 1.5, 0.0, SIGMA);
        assert!((2..12).contains(&found), "{found}");
        // Nearly all of a residual is its neighbours' too, and sigma is the whole of it or a level or two more.
        assert!((0.5..0.95).contains(&families.common), "{}", families.common);
        let across = 1.0 / 0.8_f64.hypot(1.0);
        let whole = SIGMA * 0.7_f64.hypot(1.5) * across;
        assert!((whole..2.1 * whole).contains(&families.sigma), "{}", families.sigma);
    }

    #[test]
    fn freeform_is_no_noise_of_any_size() {
        assert_eq!(looked(1.0, 0.0, 3.0, SIGMA).0, 0);
    }
}
