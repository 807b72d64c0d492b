//! Parts of one region that are surfaces of their own.

use crate::fit::constant::constants;
use crate::fit::{Family, Held, Ruler, Shape};
use crate::segment::family::Families;
use crate::segment::found::Found;
use crate::segment::hints::draft::Draft;
use crate::segment::hints::local::{families, points_of, refitted, rms, shapes, sigma, thinned};
use crate::segment::hints::place::{self, around, nearest};
use crate::segment::label::blocks::BLOCK;
use crate::segment::label::relabel::relabel;
use crate::segment::objective::{ACCEPT, ENOUGH, GOOD};
use crate::segment::outcome::Outcome;
use crate::segment::prepare::scene::Scene;
use crate::segment::{Cancelled, Hint, Monitor, Parameters};

constants! {
    /// Points of the region that its parts are told on.
    TOLD_ON: usize = 50_000, Effort("points of the sample");
    /// Rounds of labels and fits, each on patches twice as large as the one before.
    ROUNDS: usize = 24, Effort("rounds of labels and fits");
    /// Sweeps of one relabelling.
    SWEEPS: usize = 12, Effort("sweeps of one relabelling");
}

/// Does what a hint of the action `split` says; `labels` are those of the file.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn apply(
    found: &mut Found,
    number: usize,
    hint: &Hint,
    labels: Option<&[i32]>,
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<Draft, Cancelled> {
    let sets = seeds(found, hint, labels);
    if sets.iter().any(Vec::is_empty) {
        let message = "no point lies at one of the places".to_owned();
        return Ok(Draft::new(number, Outcome::NotFound, Vec::new(), message));
    }
    let mut all: Vec<u32> = if hint.at.is_empty() {
        sets.concat()
    } else {
        sets.iter().flat_map(|s| around(found, s[0])).collect()
    };
    all.sort_unstable();
    all.dedup();
    let regions = place::regions(found, &all);
    let about: Vec<usize> = regions.iter().map(|r| r.0).collect();
    if !hint.at.is_empty()
        && about.len() == sets.len()
        && all.iter().all(|&i| found.labels[i as usize] >= 0)
    {
        return Ok(Draft::new(
            number,
            Outcome::Applied,
            about,
            "they are apart already".to_owned(),
        ));
    }
    let sigma = sigma(found, &regions, parameters);
    let families = families(found, Family::ALL.to_vec(), sigma, parameters);
    let Some(parts) = parted(found, &all, &sets, &families, monitor)? else {
        let message = "the points tell no surface about one of the places".to_owned();
        return Ok(Draft::new(number, Outcome::Contradicted, about, message));
    };
    let few = parts.groups.iter().map(Vec::len).min().unwrap_or(0);
    if few < parameters.min_points {
        let message = format!(
            "one of the parts would have {few} points, and a region has at least {}: they stay together",
            parameters.min_points
        );
        return Ok(Draft::new(number, Outcome::Contradicted, about, message));
    }
    Ok(put_in(found, number, &parts, about, sigma))
}

/// Puts the parts in the place of the regions that they are of.
fn put_in(
    found: &mut Found,
    number: usize,
    parts: &Parts,
    mut places: Vec<usize>,
    sigma: f64,
) -> Draft {
    let (before, count) = (places.len().max(1), parts.groups.len());
    let (mut squares, mut points) = (0.0, 0);
    for (k, (group, shape)) in parts.groups.iter().zip(&parts.shapes).enumerate() {
        if k >= places.len() {
            places.push(found.shapes.len());
            found.shapes.push(*shape);
            found.reaches.push(0.0);
            found.told.push(None);
        }
        let place = places[k];
        found.shapes[place] = refitted(found, group, shape, &Held::default());
        found.reaches[place] = found.reaches[place].max(ACCEPT.get() * sigma);
        found.told[place] = Some(Held::default());
        group.iter().for_each(|&i| found.labels[i as usize] = place as i32);
        squares += rms(found, group, &found.shapes[place]).powi(2) * group.len() as f64;
        points += group.len();
    }
    places.truncate(count);
    let message = if parts.is_one {
        "the points tell no difference between the parts: they are parted halfway between the places".to_owned()
    } else {
        format!("{count} surfaces in the place of {before}")
    };
    let mut draft = Draft::new(number, Outcome::Applied, places, message);
    draft.outcome.scatter = Some((squares / points.max(1) as f64).sqrt() / sigma);
    draft
}

/// The points that each part begins with: the one that somebody points at, or all that carry a label.
fn seeds(found: &Found, hint: &Hint, labels: Option<&[i32]>) -> Vec<Vec<u32>> {
    if !hint.at.is_empty() {
        return hint.at.iter().map(|at| vec![nearest(found, at)]).collect();
    }
    let of = |label: &i32| match labels {
        Some(all) => (0..all.len() as u32).filter(|&i| all[i as usize] == *label).collect(),
        None => Vec::new(),
    };
    hint.labels.iter().map(of).collect()
}

/// Parts of a region.
struct Parts {
    shapes: Vec<Shape>,
    groups: Vec<Vec<u32>>,
    /// Whether one surface would do.
    is_one: bool,
}

/// The parts of `all` that begin at the seeds: surfaces and labels in turn, on patches that grow from there.
fn parted(
    found: &Found,
    all: &[u32],
    seeds: &[Vec<u32>],
    families: &Families,
    monitor: &dyn Monitor,
) -> Result<Option<Parts>, Cancelled> {
    let taken = thinned(all, TOLD_ON.get());
    let scene = Scene::watched(points_of(found, &taken), monitor)?;
    let halves = halves(found, &scene, seeds);
    let mut labels = halves.clone();
    let mut surfaces: Vec<Shape> = Vec::new();
    let mut size = 2 * ENOUGH.get();
    for _ in 0..ROUNDS.get() {
        let mut next = Vec::new();
        for (k, seed) in seeds.iter().enumerate() {
            let patch = patch(found, &taken, &labels, k as i32, seed, size);
            let warm: Vec<Shape> = surfaces.get(k).copied().into_iter().collect();
            let Some(shape) = shapes(found, &patch, &warm, families, monitor)?.first().copied()
            else {
                return Ok(None);
            };
            next.push(shape);
        }
        let whole = size >= taken.len();
        let before = labels.clone();
        surfaces = next;
        if is_one(found, &taken, &halves, &surfaces, families) {
            labels = halves.clone();
        } else {
            nearest_of(&scene, &surfaces, &mut labels);
            let blocks: Vec<usize> = (0..scene.len().div_ceil(BLOCK)).collect();
            relabel(&scene, &surfaces, &mut labels, families.sigma, SWEEPS.get(), &blocks);
            // what lies beyond reach of all goes with the nearest: it was the region's before
            let rulers: Vec<Ruler> = surfaces.iter().map(Ruler::of).collect();
            for (l, p) in labels.iter_mut().zip(&scene.points).filter(|(l, _)| **l < 0) {
                let far = |k: &usize| rulers[*k].distance(p).abs();
                let near = (0..rulers.len()).min_by(|a, b| far(a).total_cmp(&far(b)));
                *l = near.unwrap_or(0) as i32;
            }
        }
        monitor.check()?;
        if whole && labels == before {
            break;
        }
        size = size.saturating_mul(2);
    }
    let is_one = is_one(found, &taken, &halves, &surfaces, families);
    let mut groups = vec![Vec::new(); seeds.len()];
    let (m, n) = (taken.len(), all.len());
    for (k, &i) in all.iter().enumerate() {
        groups[labels[k * m / n] as usize].push(i);
    }
    Ok(Some(Parts { shapes: surfaces, groups, is_one }))
}

/// Labels by the nearest surface.
fn nearest_of(scene: &Scene, shapes: &[Shape], labels: &mut [i32]) {
    let rulers: Vec<Ruler> = shapes.iter().map(Ruler::of).collect();
    for (l, p) in labels.iter_mut().zip(&scene.points) {
        let far = |k: &usize| rulers[*k].distance(p).abs();
        // of equal ones the label that it has
        let best = (0..rulers.len()).min_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(0);
        let own = usize::try_from(*l).unwrap_or(best);
        if far(&best) < far(&own) {
            *l = best as i32;
        }
    }
}

/// Whether any one of the surfaces explains the points of all parts.
fn is_one(
    found: &Found,
    taken: &[u32],
    labels: &[i32],
    shapes: &[Shape],
    families: &Families,
) -> bool {
    let sound = |shape: &Shape, part: usize| {
        let own: Vec<u32> =
            taken.iter().zip(labels).filter(|(_, l)| **l == part as i32).map(|(i, _)| *i).collect();
        let points = points_of(found, &own);
        families.score(*shape, &points).chi2 <= GOOD.get() * points.len() as f64
    };
    shapes.iter().any(|s| (0..shapes.len()).all(|part| sound(s, part)))
}

/// Each point of a scene goes with the seed that is nearest along its graph; what no seed reaches, with the nearest in
/// space.
fn halves(found: &Found, scene: &Scene, seeds: &[Vec<u32>]) -> Vec<i32> {
    let centres: Vec<_> = seeds
        .iter()
        .map(|s| {
            let points = points_of(found, s);
            points.iter().sum::<crate::geometry::Vec3>() / points.len() as f64
        })
        .collect();
    let far = |i: usize, k: usize| (scene.points[i] - centres[k]).norm_squared();
    let mut labels = vec![-1; scene.len()];
    let mut front: Vec<u32> = Vec::new();
    for k in 0..seeds.len() {
        let first = (0..scene.len()).min_by(|&a, &b| far(a, k).total_cmp(&far(b, k)));
        if let Some(first) = first {
            labels[first] = k as i32;
            front.push(first as u32);
        }
    }
    while !front.is_empty() {
        let mut next = Vec::new();
        for &i in &front {
            for &j in scene.neighbours(i as usize) {
                if labels[j as usize] < 0 {
                    labels[j as usize] = labels[i as usize];
                    next.push(j);
                }
            }
        }
        front = next;
    }
    for (i, l) in labels.iter_mut().enumerate().filter(|(_, l)| **l < 0) {
        let near = (0..seeds.len()).min_by(|&a, &b| far(i, a).total_cmp(&far(i, b)));
        *l = near.unwrap_or(0) as i32;
    }
    labels
}

/// The `size` points of a part nearest to its seed, ascending; all of a seed of more.
fn patch(
    found: &Found,
    taken: &[u32],
    labels: &[i32],
    part: i32,
    seed: &[u32],
    size: usize,
) -> Vec<u32> {
    let mut own: Vec<u32> =
        taken.iter().zip(labels).filter(|(_, l)| **l == part).map(|(i, _)| *i).collect();
    if seed.len() > size {
        return seed.to_vec();
    }
    let points = points_of(found, seed);
    let centre = points.iter().sum::<crate::geometry::Vec3>() / points.len().max(1) as f64;
    let far = |i: &u32| (found.points[*i as usize] - centre).norm_squared();
    own.sort_by(|a, b| far(a).total_cmp(&far(b)).then(a.cmp(b)));
    own.truncate(size);
    own.sort_unstable();
    own
}
