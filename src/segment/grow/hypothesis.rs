//! Growing one hypothesis from a seed: start set, fits at doubling sizes, support.

use crate::fit::starts::Patch;
use crate::fit::{Ruler, Shape};
use crate::geometry::Vec3;
use crate::segment::family::{Families, Scored};
use crate::segment::grow::start::{NEAREST, STARTS, Start, start_set};
use crate::segment::grow::walk::Walk;
use crate::segment::judge::parabola::is_parabolic;
use crate::segment::judge::whiteness::{CHANCE, correlated, correlation};
use crate::segment::prepare::scene::Scene;

/// Points a fit during growth looks at.
const FIT_SAMPLE: usize = 400;

/// Points that a fit looks at where growth ends although residuals are correlated, and how often it may.
const THOROUGH_SAMPLE: usize = 1200;

const THOROUGH: usize = 3;

/// Support reaches this many sigmas from the surface.
const REACH: f64 = 3.0;

/// A surface grown from one seed and the connected points near it.
#[derive(Clone, Debug)]
pub struct Hypothesis {
    /// The surface.
    pub shape: Shape,
    /// Connected points within three sigmas, in order of discovery.
    pub support: Vec<u32>,
    /// How far its residuals are from independent noise, see [`correlation`].
    pub correlation: f64,
    /// Whether it may be a surface: its residuals are not correlated beyond chance, or it is the same
    /// wherever growth starts. Others compete for points only.
    pub sound: bool,
}

/// Collects every `step`-th of `support` as points and normals, at most about `limit`.
fn sample(
    scene: &Scene,
    support: &[u32],
    limit: usize,
    points: &mut Vec<Vec3>,
    normals: &mut Vec<Vec3>,
) {
    points.clear();
    normals.clear();
    let m = support.len().min(limit);
    for k in 0..m {
        let i = support[k * support.len() / m] as usize;
        points.push(scene.points[i]);
        normals.push(scene.normals[i]);
    }
}

/// Grows a hypothesis from `seed`; `None` where nothing fits from any start size, or where what fits
/// does not reach `min_points`.
pub fn grow(
    scene: &Scene,
    walk: &mut Walk,
    families: &Families,
    seed: usize,
    min_points: usize,
) -> Option<Hypothesis> {
    let mut starts = STARTS.iter().filter(|s| families.strips || !matches!(s.0, Start::Flat));
    // What does not explain the nearest points explains no more of them.
    let mut hopeful = None;
    starts.find_map(|&(start, most, least)| {
        if matches!(start, Start::Tangent)
            && !*hopeful.get_or_insert_with(|| fits_nearest(scene, walk, families, seed))
        {
            return None;
        }
        let set = start_set(scene, walk, seed, start, most, families.sigma);
        if set.len() < least.min(min_points) || scene.cancelled() {
            return None;
        }
        let grown = grow_from(scene, walk, families, set, min_points);
        grown.filter(|h| h.support.len() >= min_points)
    })
}

/// Whether any family explains the nearest points of a seed that lie in each other's tangent planes.
fn fits_nearest(scene: &Scene, walk: &mut Walk, families: &Families, seed: usize) -> bool {
    let (start, most, _) = NEAREST;
    let set = start_set(scene, walk, seed, start, most, families.sigma);
    let (mut points, mut normals) = (Vec::new(), Vec::new());
    sample(scene, &set, FIT_SAMPLE, &mut points, &mut normals);
    let patch = Patch { points: &points, normals: &normals };
    families.best(&patch, &[], &mut Vec::new()).is_some_and(|b| b.reduced <= FITS)
}

/// Reduced chi2 up to which a surface may be the points'.
const FITS: f64 = 2.0;

fn grow_from(
    scene: &Scene,
    walk: &mut Walk,
    families: &Families,
    start: Vec<u32>,
    min_points: usize,
) -> Option<Hypothesis> {
    let sigma = families.sigma;
    let (mut points, mut normals) = (Vec::new(), Vec::new());
    let mut support = start;
    sample(scene, &support, FIT_SAMPLE, &mut points, &mut normals);
    let mut hopeless = Vec::new();
    let patch = Patch { points: &points, normals: &normals };
    let mut best: Scored = families.best(&patch, &[], &mut hopeless)?;
    if best.reduced > FITS {
        return None;
    }
    let mut good: Option<(Shape, Vec<u32>)> = None;
    let mut fresh = true;
    let mut thorough = THOROUGH;
    for _ in 0..40 {
        if scene.cancelled() {
            return None;
        }
        let shape = best.shape;
        let ruler = Ruler::of(&shape);
        let limit = (support.len() * 2).max(40);
        let next = walk.near(scene, &support, limit, &ruler, REACH * sigma).to_vec();
        if next.len() < min_points.min(20) {
            break;
        }
        let stalled = next.len() * 20 < support.len() * 21;
        if stalled && fresh {
            support = next;
            // A fit caught halfway along its valley looks like this: small residuals that go together.
            let among = |j| walk.contains(j);
            let left = correlation(scene, &shape, &support, sigma, among);
            if thorough == 0 || left < 0.08 + CHANCE / (support.len() as f64).sqrt() {
                break;
            }
            thorough -= 1;
            sample(scene, &support, THOROUGH_SAMPLE, &mut points, &mut normals);
            let patch = Patch { points: &points, normals: &normals };
            let Some(found) = families.thorough(&patch, &shape, &hopeless) else { break };
            best = found;
            continue;
        }
        support = next;
        sample(scene, &support, FIT_SAMPLE, &mut points, &mut normals);
        let patch = Patch { points: &points, normals: &normals };
        let warm = families
            .polish(&shape, &points, 12)
            .map(|f| families.score(f.shape, &points))
            .filter(|s| !families.degenerate(&s.shape));
        match warm {
            Some(w) if !stalled && families.explains(&w, points.len()) => {
                best = w;
                fresh = false;
            }
            _ => {
                let start = warm.map_or(shape, |w| w.shape);
                if stalled {
                    hopeless.clear();
                }
                let Some(next) = families.best(&patch, &[start], &mut hopeless) else { break };
                best = next;
                fresh = true;
            }
        }
        if best.reduced < 1.35 {
            good = Some((best.shape, support.clone()));
        } else if best.reduced > FITS {
            break;
        }
    }
    let shape = best.shape;
    let ruler = Ruler::of(&shape);
    if best.reduced < 1.35 {
        let support = walk.near(scene, &support, usize::MAX, &ruler, REACH * sigma).to_vec();
        good = Some((shape, support));
    }
    good.map(|(shape, support)| {
        walk.run(scene, &support, support.len(), |from, _| from.is_none());
        let correlation = correlation(scene, &shape, &support, sigma, |j| walk.contains(j));
        let sound = !correlated(correlation, support.len()) && !is_parabolic(&shape);
        Hypothesis { shape, support, correlation, sound }
    })
}
