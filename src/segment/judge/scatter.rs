//! The scatter about surfaces, where it is more than the noise between neighbours.

use crate::fit::Ruler;
use crate::fit::constant::constants;
use crate::segment::family::Families;
use crate::segment::grow::hypothesis::Hypothesis;
use crate::segment::grow::search::{Search, allowance};
use crate::segment::judge::stability::judged;
use crate::segment::median::deviation;
use crate::segment::objective::{CORRELATED, HALF, LITTLE, MOST, PART};
use crate::segment::prepare::scene::Scene;
use crate::segment::{Cancelled, Monitor};

constants! {
    /// Scatters at which surfaces are looked for, in steps of a factor of the square root of two from the noise
    /// between neighbours up.
    LEVELS: usize = 7, Effort("scatters tried");
    /// Scatter, in spacings, up to which those beyond are tried as well, twice as large each: of noise that is all smooth
    /// the nearest neighbours show next to nothing, and of freeform so little leaves no surface whole.
    SMALL: f64 = 0.06, Trial(0.06, 0.06);
    /// Share of the points that fit nothing at the noise, and do at a larger scatter, from which on that is the scene's:
    /// so many save by it, from the price of a point without surface to that of one on it, what the others lose.
    pub ROUGH: f64 = 0.02, Trial(0.02, 0.05);
    /// Seeds that tell whether a level is worth trying.
    LOOK: usize = 16, Effort("seeds tried");
    /// Scatter of a surface over the noise below which the noise is not its own.
    FAR_LESS: f64 = 0.2, Trial(0.2, 0.2);
    /// Points that tell how much of a surface's scatter is rounding.
    ROUNDED: usize = 64, Effort("points looked at");
}

/// From one scatter to the next.
pub const LEVEL: f64 = std::f64::consts::SQRT_2;

/// The correlation of residuals that half of the grown points lie below.
pub fn typical(hypotheses: &[Hypothesis]) -> f64 {
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

/// What residuals of neighbours have in common at hypotheses of one scatter.
pub fn in_common(found: &[Hypothesis]) -> f64 {
    Some(typical(found)).filter(|c| *c > CORRELATED.get()).unwrap_or(0.0)
}

/// The scatter at which most of what is grown is the same wherever it starts.
pub struct Scatter {
    /// It, or that at which the most is; none where next to nothing is at any.
    pub sigma: Option<f64>,
    /// Share of the grown points that is.
    pub share: f64,
    /// What residuals have in common there.
    pub common: f64,
}

/// Share of the grown points that must be the same wherever growth starts: nearly all, or else a denser sample may tell
/// more; the better part where there is none (`dense`) or finer surfaces have been taken out.
pub fn most(families: &Families, dense: bool) -> f64 {
    if dense || families.rougher { HALF.get() } else { MOST.get() }
}

/// The scatter of a surface that has a good part of the points, where it is far less than the noise: that was estimated from
/// patches in which outliers, or another surface, lie among the neighbours.
pub fn far_less(scene: &Scene, families: &Families, found: &[Hypothesis]) -> Option<f64> {
    let scatter = |h: &Hypothesis| {
        let is_large = h.sound && h.support.len() as f64 > PART.get() * scene.len() as f64;
        let ruler = Ruler::of(&h.shape);
        let points = h.support.iter().map(|&i| &scene.points[i as usize]);
        let few = points.clone().step_by(h.support.len().div_ceil(ROUNDED.get()).max(1));
        let distances = points.map(|p| ruler.distance(p));
        let own = is_large.then(|| deviation(distances)).flatten()?;
        // On a level of steps next to nothing is left.
        Some(own.max(scene.rounding(few.map(|p| (&h.shape, p)))))
    };
    let least = found.iter().filter_map(scatter).reduce(f64::min)?;
    let sigma = least.max(families.floor);
    (sigma < FAR_LESS.get() * families.sigma).then_some(sigma)
}

/// Looks for surfaces at rising scatters among the points that are not `taken`; these must then be a good part of the
/// scene's. Among all where `taken` is empty.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn scatter(
    scene: &Scene,
    families: &Families,
    seed: u64,
    (taken, dense): (&[bool], bool),
    trials: &mut (usize, usize),
    monitor: &dyn Monitor,
) -> Result<Scatter, Cancelled> {
    let mut best = Scatter { sigma: None, share: LITTLE.get(), common: 0.0 };
    // Whether there are surfaces, and others rougher than they are looked for.
    let rough = !taken.is_empty();
    let allowed = scene.work.done() + worth(scene, families, taken);
    // Some surfaces are rougher than others, but not beyond measure.
    let small = if rough { 0.0 } else { SMALL.get() * scene.spacing };
    for (level, sigma) in scatters(families.sigma, small).enumerate().skip(usize::from(rough)) {
        if scene.work.done() > allowed {
            if !rough {
                scene.work.leave();
            }
            break;
        }
        let looser = Families { sigma, ..families.clone() };
        let search = Search { vain: taken, ..Search::new(scene, &looser, seed ^ level as u64) };
        let search = Search { most: LOOK.get(), ..search };
        let few = search.run(trials, |_| false, monitor)?;
        let enough = newly(&few, taken) as f64 >= ROUGH.get() * scene.len() as f64;
        let common = in_common(&few);
        let share = if enough || !rough { stable_share(scene, &looser, few) } else { 0.0 };
        if share > best.share {
            best = Scatter { sigma: Some(sigma), share, common };
        }
        if share > most(families, dense) {
            break;
        }
    }
    Ok(best)
}

/// The work that all levels together may be: as much as two searches, or four of what finer surfaces leave, which is less;
/// where most of the points are `taken`, twice what it took to find what is there.
fn worth(scene: &Scene, families: &Families, taken: &[bool]) -> u64 {
    let open = taken.iter().filter(|t| !**t).count();
    match (families.rougher, !taken.is_empty() && 2 * open < scene.len()) {
        (_, true) => 2 * scene.work.done(),
        (true, false) => 4 * allowance(scene.len()),
        (false, false) => 2 * allowance(scene.len()),
    }
}

/// Scatters at which surfaces are looked for where there is `noise` between neighbours: several, and more of them while
/// they are `small`.
fn scatters(noise: f64, small: f64) -> impl Iterator<Item = f64> {
    let near = (0..LEVELS.get()).map(move |k| noise * LEVEL.powi(k as i32));
    let last = roughest(noise);
    let beyond = std::iter::successors(Some(2.0 * last), |s| Some(2.0 * s));
    near.chain(beyond.take_while(move |s| *s < small))
}

/// The largest scatter at which surfaces are looked for where there is `noise` between neighbours.
pub fn roughest(noise: f64) -> f64 {
    noise * LEVEL.powi(LEVELS.get() as i32 - 1)
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
    use super::*;
    use crate::geometry::Vec3;
    use crate::segment::fixtures::plane;

    fn hypothesis(correlation: f64, support: std::ops::Range<u32>) -> Hypothesis {
        let shape = plane(Vec3::zeros(), Vec3::z());
        Hypothesis { shape, support: support.collect(), correlation, sound: true }
    }

    #[test]
    fn scatters_rise_by_the_root_of_two_and_double_beyond_while_they_are_small() {
        let rising: Vec<f64> = scatters(1.0, 0.0).collect();
        assert_eq!(rising.len(), LEVELS.get());
        assert!(rising.windows(2).all(|w| (w[1] / w[0] - LEVEL).abs() < 1e-12));
        let more: Vec<f64> = scatters(1.0, 40.0).collect();
        assert_eq!(more[..rising.len()], rising[..]);
        assert!(more[rising.len()..].iter().zip([16.0, 32.0]).all(|(a, b)| (a - b).abs() < 1e-9));
        assert_eq!(more.len(), rising.len() + 2);
    }

    #[test]
    fn what_most_points_have_in_common_is_common_and_chance_is_not() {
        let bridge = hypothesis(0.9, 0..100);
        let found = [hypothesis(0.01, 100..400), bridge.clone()];
        assert_eq!((typical(&found), in_common(&found)), (0.01, 0.0));
        let found = [hypothesis(0.5, 100..400), bridge];
        assert_eq!(in_common(&found), 0.5);
        assert_eq!(typical(&[]), 0.0);
    }

    #[test]
    fn points_are_won_once_and_not_where_they_were_taken() {
        let found = [hypothesis(0.0, 2..6), hypothesis(0.0, 4..8)];
        let taken: Vec<bool> = (0..10).map(|i| i < 3).collect();
        assert_eq!(newly(&found, &taken), 5);
    }
}
