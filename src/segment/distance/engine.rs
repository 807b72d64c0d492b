//! Discovery on a scene: hypotheses, selection, relabelling, merging, types, rejection.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::adopt::adopt;
use super::bridges::break_bridges;
use super::compounds::split_compounds;
use super::family::{Families, MOST_RADIUS, Policy};
use super::form;
use super::hypothesis::{Hypothesis, correlated, correlation, is_parabolic};
use super::label::{members, relabel};
use super::median::deviation;
use super::merge::{SOUND, merge};
use super::moves::{remove_needless, swap_families};
use super::scene::Scene;
use super::search::hypothesise;
use super::select::select;
use super::steps::split_steps;
use crate::fit::least_squares::{Options, fit};
use crate::fit::starts::Patch;
use crate::fit::{Family, Ruler, Shape};
use crate::geometry::Vec3;
use crate::segment::{Cancelled, Monitor, Parameters, Stage};

/// The surfaces found in a scene and the label of each of its points.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Surfaces; a label is an index here.
    pub shapes: Vec<Shape>,
    /// One label a point, -1 = none.
    pub labels: Vec<i32>,
    /// Which of the surfaces only compete for points; empty where none.
    pub spurious: Vec<bool>,
    /// Whether surfaces have a form error above the noise.
    pub form_error: bool,
    /// Scatter that labels were given with where there is a form error; else nought.
    pub allowed: f64,
    /// Seeds tried, and how many of them failed.
    pub trials: (usize, usize),
    /// Regions joined to another.
    pub merges: usize,
}

impl Model {
    /// Whether a label is a surface's that is reported as one.
    pub fn is_surface(&self, label: i32) -> bool {
        label >= 0 && !self.spurious.get(label as usize).is_some_and(|s| *s)
    }

    /// Share of the points that surfaces explain.
    pub fn explained(&self) -> f64 {
        let n = self.labels.iter().filter(|&&l| self.is_surface(l)).count();
        n as f64 / self.labels.len().max(1) as f64
    }
}

/// Points of `members`, at most about `limit` of them, evenly along the scene's order.
pub fn take(scene: &Scene, members: &[u32], limit: usize) -> Vec<Vec3> {
    let m = members.len().min(limit);
    (0..m).map(|k| scene.points[members[k * members.len() / m] as usize]).collect()
}

/// Points and normals of a region's core, where all neighbours carry its label, at most about `limit`; of the
/// whole region where the core is but a small part of it.
pub fn take_core(
    scene: &Scene,
    labels: &[i32],
    group: &[u32],
    label: i32,
    limit: usize,
) -> (Vec<Vec3>, Vec<Vec3>) {
    let inside =
        |i: &u32| scene.neighbours(*i as usize).iter().all(|&j| labels[j as usize] == label);
    let core: Vec<u32> = group.iter().copied().filter(inside).collect();
    let set = if core.len() >= 60 && core.len() * 3 > group.len() { &core } else { group };
    take_with_normals(scene, set, limit)
}

/// What [`take`] does, and the normals there.
pub fn take_with_normals(scene: &Scene, members: &[u32], limit: usize) -> (Vec<Vec3>, Vec<Vec3>) {
    let m = members.len().min(limit);
    let normals = (0..m).map(|k| scene.normals[members[k * members.len() / m] as usize]);
    (take(scene, members, limit), normals.collect())
}

fn refit(scene: &Scene, shapes: &mut [Shape], labels: &[i32], sigma: f64, limit: usize) {
    let groups = members(labels, shapes.len());
    shapes.par_iter_mut().zip(&groups).for_each(|(s, g)| {
        if scene.cancelled() {
            return;
        }
        let points = take(scene, g, limit);
        if let Some(f) =
            fit(s, &points, None, &Options { cauchy: Some(4.0 * sigma), steps: 8, tolerance: 1e-6 })
        {
            *s = f.shape;
        }
    });
}

/// Relabels and refits until few labels change.
pub fn settle(scene: &Scene, model: &mut Model, sigma: f64, rounds: usize) {
    for _ in 0..rounds {
        if scene.cancelled() {
            break;
        }
        let before = model.labels.clone();
        relabel(scene, &model.shapes, &mut model.labels, sigma, 12);
        refit(scene, &mut model.shapes, &model.labels, sigma, 4000);
        let changed = before.iter().zip(&model.labels).filter(|(a, b)| a != b).count();
        if changed * 2000 <= scene.len() {
            break;
        }
    }
}

/// Drops regions below `min_points`, or whose points are mostly explained by others.
pub fn prune(model: &mut Model, min_points: usize) -> bool {
    let mut count = vec![0usize; model.shapes.len()];
    for &l in &model.labels {
        if l >= 0 {
            count[l as usize] += 1;
        }
    }
    let keep: Vec<bool> = count.iter().map(|&c| c >= min_points).collect();
    retain(model, &keep)
}

/// Keeps the regions that `keep` says and renumbers labels. Returns whether any went.
pub fn retain(model: &mut Model, keep: &[bool]) -> bool {
    if keep.iter().all(|k| *k) {
        return false;
    }
    let mut to = vec![-1i32; keep.len()];
    let mut next = 0;
    for (t, k) in to.iter_mut().zip(keep) {
        if *k {
            *t = next;
            next += 1;
        }
    }
    let mut it = keep.iter();
    model.shapes.retain(|_| *it.next().unwrap_or(&false));
    for l in &mut model.labels {
        if *l >= 0 {
            *l = to[*l as usize];
        }
    }
    true
}

/// Labelled points that tell the noise, unless they are most of a small scene's.
const ENOUGH: usize = 100;

/// Robust sigma of all labelled points about their surfaces.
pub fn residual_sigma(scene: &Scene, model: &Model) -> Option<f64> {
    let labelled = model.labels.iter().zip(&scene.points).filter(|(l, _)| **l >= 0);
    let n = labelled.clone().count();
    if n < ENOUGH.min(scene.len() * 3 / 4) {
        return None;
    }
    let rulers: Vec<Ruler> = model.shapes.iter().map(Ruler::of).collect();
    let sigma = deviation(labelled.map(|(&l, p)| rulers[l as usize].distance(p)))?;
    if n >= ENOUGH {
        return Some(sigma);
    }
    // Of few points surfaces take up a good part of the noise.
    let taken: usize = model.shapes.iter().map(|s| s.family.dof()).sum();
    Some(sigma * (n as f64 / n.saturating_sub(taken).max(1) as f64).sqrt())
}

/// Puts each region's best family in, judged on its core.
pub fn retype(scene: &Scene, model: &mut Model, families: &Families) -> usize {
    let groups = members(&model.labels, model.shapes.len());
    let labels = &model.labels;
    let next: Vec<Option<Shape>> = model
        .shapes
        .par_iter()
        .zip(&groups)
        .enumerate()
        .map(|(l, (s, g))| {
            if scene.cancelled() {
                return None;
            }
            let (points, normals) = take_core(scene, labels, g, l as i32, 2000);
            let worth = worth_trying(families, s, &points)?;
            let all = worth.each(&Patch { points: &points, normals: &normals }, &[*s]);
            let best = all.into_iter().min_by(|a, b| a.bic.total_cmp(&b.bic))?;
            let whole = take(scene, g, 600);
            let sound = families.score(best.shape, &whole).chi2 < SOUND * whole.len() as f64;
            (best.shape.family != s.family && sound).then_some(best.shape)
        })
        .collect();
    put_in(&mut model.shapes, next)
}

/// Puts the new shapes in the place of the old ones. Returns how many there are.
pub fn put_in(shapes: &mut [Shape], next: Vec<Option<Shape>>) -> usize {
    let changed = next.iter().flatten().count();
    for (s, n) in shapes.iter_mut().zip(next) {
        *s = n.unwrap_or(*s);
    }
    changed
}

/// The families to try for points that `shape` may explain already: then only those that cost less, if any.
fn worth_trying(families: &Families, shape: &Shape, points: &[Vec3]) -> Option<Families> {
    let mut worth = families.clone();
    if families.explains(&families.score(*shape, points), points.len()) {
        let length = |family: Family| family.description_length(points.len());
        let own = length(shape.family);
        worth.allowed.retain(|f| *f == shape.family || length(*f) < own);
        if worth.allowed.iter().all(|f| *f == shape.family) {
            return None;
        }
    }
    Some(worth)
}

/// Pairs of labels that meet along a border, each with how many graph edges cross it.
pub fn borders(scene: &Scene, labels: &[i32]) -> BTreeMap<(usize, usize), usize> {
    let crossing = |mut out: BTreeMap<_, _>, i: usize| {
        let l = labels[i];
        if l >= 0 {
            for &j in scene.neighbours(i) {
                let m = labels[j as usize];
                if m >= 0 && m != l {
                    *out.entry((l.min(m) as usize, l.max(m) as usize)).or_insert(0) += 1;
                }
            }
        }
        out
    };
    let sum = |mut all: BTreeMap<_, _>, part: BTreeMap<_, _>| {
        part.into_iter().for_each(|(pair, n)| *all.entry(pair).or_insert(0) += n);
        all
    };
    (0..labels.len())
        .into_par_iter()
        .with_min_len(2048)
        .fold(BTreeMap::new, crossing)
        .reduce(BTreeMap::new, sum)
}

/// Rounds over what is still without a surface.
const PASSES: usize = 3;
/// The same of what other surfaces leave: it gets the rest of its points back from them as labels settle.
const LEFT: usize = 24;
/// Rounds of moves on the total energy after each pass.
const MOVES: usize = 3;

/// Finds the surfaces of a scene.
///
/// Passes over what is still without a surface: grow hypotheses on it, choose among them, then settle
/// labels, families and surfaces of the whole scene.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn discover(
    scene: &Scene,
    families: &mut Families,
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<Model, Cancelled> {
    let mut model = Model { labels: vec![-1; scene.len()], ..Model::default() };
    let mut doubtful = false;
    for pass in 0..PASSES {
        let open: Vec<u32> =
            (0..scene.len() as u32).filter(|&i| model.labels[i as usize] < 0).collect();
        // What surfaces leave of their own is more than what a whole cloud must have.
        let least = families.policy.least;
        if open.len() < if pass == 0 { least } else { least * 3 / 2 } {
            break;
        }
        let seed = parameters.seed ^ pass as u64;
        let (chosen, labels) = if pass == 0 {
            let found = form::hypotheses(scene, families, seed, &mut model.trials, monitor)?;
            let Some((found, suspected)) = found else {
                model.form_error = true;
                break;
            };
            doubtful = suspected;
            choose(scene, found, families, 0, monitor)?
        } else {
            // What is left has a graph of its own: strips a point or two wide hold together in it.
            let open = open.iter().map(|&i| scene.points[i as usize]).collect();
            let mut rest = Scene::watched(open, monitor)?;
            rest.sharpen_normals(families.sigma);
            let few = families.with_least(LEFT);
            let found =
                hypothesise(&rest, &few, usize::MAX, seed, &mut model.trials, |_| false, monitor)?;
            let found = found.into_iter().filter(|h| h.sound).collect();
            choose(&rest, found, &few, model.shapes.len(), monitor)?
        };
        if chosen.is_empty() {
            break;
        }
        for (&i, l) in open.iter().zip(labels) {
            model.labels[i as usize] = l;
        }
        model.shapes.extend(chosen.iter().map(|h| h.shape));
        monitor.progress(Stage::Merge, 0.3 + 0.2 * pass as f64);
        converge(scene, &mut model, families, monitor)?;
        if std::mem::take(&mut doubtful) && form::is_seen(scene, &model, families.sigma) {
            model.form_error = true;
            break;
        }
        let last = pass + 1 == PASSES;
        drop_unsound(scene, &mut model, families.sigma, last);
        if families.policy.merge {
            adopt(scene, &mut model, families.sigma);
        }
        monitor.check()?;
        if parameters.noise_sigma.is_none() {
            tighten(scene, &model, families);
        }
    }
    Ok(model)
}

/// Takes the noise to be what is left at the surfaces found.
fn tighten(scene: &Scene, model: &Model, families: &mut Families) {
    if let Some(s) = residual_sigma(scene, model) {
        families.sigma = s.max(families.sigma * 0.2).min(families.sigma * 1.05).max(families.floor);
    }
}

/// Share of the points that surfaces with a form error explain at least.
const LEAST: f64 = 0.1;
/// Share that counts as all, and how much more of them another level must explain to be preferred.
const ALL: f64 = 0.95;
const MORE: f64 = 0.05;

/// Finds the surfaces of a scene that have a form error: at the first multiple of the noise at which they
/// explain nearly all, or else most. `scatter` is that of the scene's own neighbourhoods.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn discover_with_form_error(
    scene: &Scene,
    families: &mut Families,
    scatter: f64,
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<Model, Cancelled> {
    let seed = parameters.seed;
    let mut trials = (0, 0);
    let mut best: Option<(Model, Families)> = None;
    let explained =
        |best: &Option<(Model, Families)>| best.as_ref().map_or(0.0, |b| b.0.explained());
    let between = form::between(families.sigma);
    for sigma in form::levels(families.sigma, scatter).into_iter().chain(between) {
        // What no level finds, none between them does.
        if explained(&best) > ALL || between.contains(&sigma) && explained(&best) < LEAST {
            break;
        }
        let mut looser = Families { sigma, ..families.clone() };
        let hypotheses = form::loose_hypotheses(scene, &looser, seed, &mut trials, monitor)?;
        let Some(hypotheses) = hypotheses else { continue };
        let model = settled(scene, hypotheses, &mut looser, monitor)?;
        if model.explained() > explained(&best) + MORE {
            best = Some((model, looser));
        }
    }
    if let Some((model, looser)) = best.filter(|b| b.0.explained() > LEAST) {
        *families = looser;
        return Ok(Model { trials, ..model });
    }
    let few = form::outstanding_hypotheses(scene, families, seed, &mut trials, monitor)?;
    let model = settled(scene, few, families, monitor)?;
    Ok(Model { trials, ..model })
}

/// The model with a form error that hypotheses lead to.
fn settled(
    scene: &Scene,
    hypotheses: Vec<Hypothesis>,
    families: &mut Families,
    monitor: &dyn Monitor,
) -> Result<Model, Cancelled> {
    let (chosen, labels) = choose(scene, hypotheses, families, 0, monitor)?;
    let shapes = chosen.iter().map(|h| h.shape).collect();
    let allowed = families.sigma;
    let mut model = Model { shapes, labels, form_error: true, allowed, ..Model::default() };
    if model.shapes.is_empty() {
        return Ok(model);
    }
    converge(scene, &mut model, families, monitor)?;
    model.spurious = form::spurious(scene, families, &model.labels, model.shapes.len());
    monitor.check()?;
    tighten(scene, &model, families);
    Ok(model)
}

fn choose(
    part: &Scene,
    found: Vec<Hypothesis>,
    families: &Families,
    first_label: usize,
    monitor: &dyn Monitor,
) -> Result<(Vec<Hypothesis>, Vec<i32>), Cancelled> {
    let none = vec![-1; part.len()];
    let chosen = select(part, found, families.sigma, &none, first_label, families.policy.least);
    monitor.check().map(|()| chosen)
}

/// Settles labels, families and surfaces: relabelling with refits, types, merging, then moves on the
/// total energy.
fn converge(
    scene: &Scene,
    model: &mut Model,
    families: &Families,
    monitor: &dyn Monitor,
) -> Result<(), Cancelled> {
    for _ in 0..2 {
        monitor.check()?;
        settle(scene, model, families.sigma, 8);
        monitor.check()?;
        let retyped = retype(scene, model, families);
        monitor.check()?;
        let merged = merge(scene, model, families);
        model.merges += merged;
        let pruned = prune(model, families.policy.least);
        if retyped + merged == 0 && !pruned {
            break;
        }
    }
    settle(scene, model, families.sigma, 8);
    for _ in 0..MOVES {
        if !families.policy.refine {
            break;
        }
        monitor.check()?;
        let gone = remove_needless(scene, model, families);
        monitor.check()?;
        let swapped = swap_families(scene, model, families);
        monitor.check()?;
        let broken = break_bridges(scene, model, families)
            + split_steps(scene, model, families)
            + split_compounds(scene, model, families);
        monitor.check()?;
        model.merges += merge(scene, model, families);
        monitor.check()?;
        settle(scene, model, families.sigma, 8);
        if gone + swapped + broken == 0 {
            break;
        }
    }
    monitor.check()?;
    prune(model, families.policy.least);
    Ok(())
}

/// Takes out regions that are parabolas, and, unless this is the `last` pass, those whose residuals are correlated:
/// they bridge several surfaces, which the next pass finds one by one.
fn drop_unsound(scene: &Scene, model: &mut Model, sigma: f64, last: bool) {
    let groups = members(&model.labels, model.shapes.len());
    let keep: Vec<bool> = model
        .shapes
        .iter()
        .zip(&groups)
        .enumerate()
        .map(|(l, (s, g))| {
            let inside = |j: u32| model.labels[j as usize] == l as i32;
            !scene.cancelled()
                && !is_parabolic(s)
                && (last || !correlated(correlation(scene, s, g, sigma, inside), g.len()))
        })
        .collect();
    for l in &mut model.labels {
        if *l >= 0 && !keep[*l as usize] {
            *l = -1;
        }
    }
    retain(model, &keep);
}

/// Whether what a model leaves of a cloud holds a surface worth a region.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn holds_surface(
    left: &[Vec3],
    sigma: f64,
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<bool, crate::segment::SegmentError> {
    const LIMIT: usize = 60_000;
    let m = left.len().min(LIMIT);
    let taken = (0..m).map(|k| left[k * left.len() / m]).collect();
    let mut scene = Scene::watched(taken, monitor)?;
    scene.sharpen_normals(sigma);
    let extent = scene.points.iter().map(|p| p.norm()).fold(0.0, f64::max);
    let families = Families {
        allowed: Family::ALL.to_vec(),
        sigma,
        max_radius: MOST_RADIUS * extent,
        floor: sigma,
        strips: false,
        policy: Policy::of(parameters),
    };
    let trials = &mut (0, 0);
    let found = hypothesise(&scene, &families, 64, parameters.seed, trials, |_| false, monitor)?;
    let none = vec![-1; m];
    let chosen = select(&scene, found, sigma, &none, 0, 40).0;
    monitor.check()?;
    Ok(!chosen.is_empty())
}
