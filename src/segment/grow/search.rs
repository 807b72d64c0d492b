//! Growing hypotheses all over a scene.

use rayon::prelude::*;

use crate::fit::Ruler;
use crate::segment::family::Families;
use crate::segment::grow::hypothesis::{Hypothesis, grow};
use crate::segment::grow::walk::Walk;
use crate::segment::prepare::candidates::K;
use crate::segment::prepare::scene::Scene;
use crate::segment::random::SplitMix64;
use crate::segment::{Cancelled, Monitor};

/// Seeds grown at once; fixed, so that the result does not depend on the number of threads.
const BATCH: usize = 4;

/// Failed seeds that one draw of the policy stands for.
const DRAW: usize = 8;

/// Batches of seeds over which the search looks at what it still gains.
const LOOK_BACK: usize = 64;

/// New points a seed of those batches below which it ends: what is left is noise, freeform or clutter.
const LEAST_YIELD: usize = 2;

/// Points a hypothesis needs to be kept, unless surfaces may have fewer.
pub const MIN_SUPPORT: usize = 30;

/// Grows hypotheses until every point is covered or has been tried, `most` seeds were tried or what was found
/// so far is `enough`. In the order of their seeds.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn hypothesise(
    scene: &Scene,
    families: &Families,
    most: usize,
    seed: u64,
    trials: &mut (usize, usize),
    enough: impl Fn(&[Hypothesis]) -> bool,
    monitor: &dyn Monitor,
) -> Result<Vec<Hypothesis>, Cancelled> {
    let before = trials.0;
    let least = MIN_SUPPORT.min(families.policy.least);
    let n = scene.len();
    let mut covered = vec![false; n];
    let mut random = SplitMix64::new(seed);
    let mut out: Vec<Hypothesis> = Vec::new();
    let mut failures_in_a_row = 0;
    let mut walks: Vec<Walk> = (0..BATCH).map(|_| Walk::new(n)).collect();
    let mut tried = vec![false; n];
    let mut pool: Vec<u32> = (0..n as u32).collect();
    let mut yields = std::collections::VecDeque::new();
    while failures_in_a_row < families.policy.failures * DRAW && trials.0 - before < most {
        monitor.check()?;
        // Points are only ever covered and tried: what has left the pool stays out.
        pool.retain(|&i| {
            let i = i as usize;
            !covered[i] && !tried[i] && {
                let free = scene.neighbours(i).iter().filter(|&&j| !covered[j as usize]).count();
                free * 2 >= K
            }
        });
        if pool.len() < 8 {
            break;
        }
        let mut seeds = Vec::new();
        let mut left = pool.clone();
        for _ in 0..BATCH.min(2 + pool.len() / 12_000) {
            // The smoothest of a few: interiors before edges, yet a tight arc has its turn.
            let pick = (0..8)
                .map(|_| random.below(left.len()))
                .min_by(|&a, &b| {
                    scene.roughness[left[a] as usize].total_cmp(&scene.roughness[left[b] as usize])
                })
                .unwrap_or(0);
            seeds.push(left.swap_remove(pick) as usize);
        }
        let grown: Vec<Option<Hypothesis>> = seeds
            .par_iter()
            .zip(walks.par_iter_mut())
            .map(|(&s, walk)| grow(scene, walk, families, s, least))
            .collect();
        let mut newly = 0;
        for (&s, h) in seeds.iter().zip(grown) {
            trials.0 += 1;
            tried[s] = true;
            for &j in scene.neighbours(s) {
                tried[j as usize] = true;
            }
            let Some(h) = h else {
                trials.1 += 1;
                failures_in_a_row += 1;
                continue;
            };
            failures_in_a_row = 0;
            let limit = 2.5 * families.sigma;
            let ruler = Ruler::of(&h.shape);
            for &j in &h.support {
                if ruler.distance(&scene.points[j as usize]).abs() < limit {
                    newly += usize::from(!covered[j as usize]);
                    covered[j as usize] = true;
                }
            }
            out.push(h);
        }
        yields.push_back((seeds.len(), newly));
        if yields.len() > LOOK_BACK {
            yields.pop_front();
            let (tried, gained) = yields.iter().fold((0, 0), |s, y| (s.0 + y.0, s.1 + y.1));
            if gained < tried * LEAST_YIELD {
                break;
            }
        }
        if enough(&out) {
            break;
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Family;
    use crate::geometry::Vec3;
    use crate::segment::Parameters;
    use crate::segment::family::Policy;

    #[test]
    fn a_cone_without_noise_is_found_whole_from_any_seed() {
        let mut random = SplitMix64::new(5);
        let mut uniform = || random.below(1 << 30) as f64 / f64::from(1 << 30);
        let at = |_| {
            let (t, h) = (std::f64::consts::TAU * uniform(), uniform());
            let radius = 26.0 - 6.0 * h;
            Vec3::new(radius * t.cos(), radius * t.sin(), 14.0 * h)
        };
        let scene = Scene::new((0..6000).map(at).collect());
        let families = Families {
            allowed: Family::ALL.to_vec(),
            sigma: 2e-6,
            floor: 2e-6,
            max_radius: 600.0,
            strips: true,
            policy: Policy::of(&Parameters::default()),
        };
        let mut walk = Walk::new(scene.len());
        for seed in (0..scene.len()).step_by(600) {
            let found = grow(&scene, &mut walk, &families, seed, MIN_SUPPORT);
            let found = found.filter(|h| h.shape.family == Family::Cone && h.sound);
            assert!(found.is_some_and(|h| h.support.len() == scene.len()), "{seed}");
        }
    }
}
