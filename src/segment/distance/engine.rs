//! Discovery on a scene: hypotheses, selection, relabelling, merging, types, rejection.

use rayon::prelude::*;

use super::family::{Families, Policy};
use super::hypothesis::{Hypothesis, Walk, correlated, correlation, grow};
use super::label::{members, relabel};
use super::scene::Scene;
use super::select::select;
use crate::fit::least_squares::{Options, fit};
use crate::fit::starts::Patch;
use crate::fit::{Family, Ruler, Shape};
use crate::geometry::Vec3;
use crate::segment::random::SplitMix64;
use crate::segment::{Cancelled, Monitor, Parameters, Stage};

/// Seeds grown at once; fixed, so that the result does not depend on the number of threads.
const BATCH: usize = 8;
/// Points a hypothesis needs to be kept.
const MIN_SUPPORT: usize = 30;

/// The surfaces found in a scene and the label of each of its points.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Surfaces; a label is an index here.
    pub shapes: Vec<Shape>,
    /// One label a point, -1 = none.
    pub labels: Vec<i32>,
    /// Seeds tried, and how many of them failed.
    pub trials: (usize, usize),
    /// Regions joined to another.
    pub merges: usize,
}

/// When to stop growing hypotheses.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Most seeds tried.
    pub seeds: usize,
    /// Stop as soon as most of what was grown is no surface but a piece of some other form.
    pub stop_at_form: bool,
}

/// Hypotheses after which the form of a scene is first judged.
const FORM_SAMPLE: usize = 16;
impl Effort {
    /// Until every point is covered or has been tried.
    pub const FULL: Self = Self { seeds: usize::MAX, stop_at_form: false };
}

/// A hypothesis whose residuals are correlated beyond this is a piece of some other form.
const CORRELATED: f64 = 0.1;

/// What growing gave.
pub struct Grown {
    /// The hypotheses in the order of their seeds.
    pub hypotheses: Vec<Hypothesis>,
    /// Whether most of what was grown is a piece of some other form.
    pub form: bool,
}

/// Share of the grown points that lie in hypotheses with correlated residuals.
fn correlated_share(hypotheses: &[Hypothesis]) -> f64 {
    let all: usize = hypotheses.iter().map(|h| h.support.len()).sum();
    let bad: usize =
        hypotheses.iter().filter(|h| h.correlation > CORRELATED).map(|h| h.support.len()).sum();
    bad as f64 / all.max(1) as f64
}

/// Grows hypotheses until every point is covered or has been tried.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn hypothesise(
    scene: &Scene,
    families: &Families,
    effort: Effort,
    seed: u64,
    trials: &mut (usize, usize),
    monitor: &dyn Monitor,
) -> Result<Grown, Cancelled> {
    let before = trials.0;
    let mut form = false;
    let n = scene.len();
    let mut covered = vec![false; n];
    let mut random = SplitMix64::new(seed);
    let mut out: Vec<Hypothesis> = Vec::new();
    let mut failures_in_a_row = 0;
    let mut walks: Vec<Walk> = (0..BATCH).map(|_| Walk::new(n)).collect();
    let mut tried = vec![false; n];
    while failures_in_a_row < families.policy.failures * BATCH && trials.0 - before < effort.seeds {
        monitor.check()?;
        let mut pool: Vec<u32> = (0..n as u32)
            .filter(|&i| {
                let i = i as usize;
                !covered[i] && !tried[i] && {
                    let free =
                        scene.neighbours(i).iter().filter(|&&j| !covered[j as usize]).count();
                    free * 2 >= super::scene::K
                }
            })
            .collect();
        if pool.len() < 8 {
            break;
        }
        let mut seeds = Vec::new();
        for _ in 0..BATCH.min(1 + pool.len() / 40) {
            // The smoothest of a few: interiors before edges, yet a tight arc has its turn.
            let pick = (0..8)
                .map(|_| random.below(pool.len()))
                .min_by(|&a, &b| {
                    scene.roughness[pool[a] as usize].total_cmp(&scene.roughness[pool[b] as usize])
                })
                .unwrap_or(0);
            seeds.push(pool.swap_remove(pick) as usize);
        }
        let grown: Vec<Option<Hypothesis>> = seeds
            .par_iter()
            .zip(walks.par_iter_mut())
            .map(|(&s, walk)| grow(scene, walk, families, s, MIN_SUPPORT))
            .collect();
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
            for &j in &h.support {
                if h.shape.distance(&scene.points[j as usize]).abs() < limit {
                    covered[j as usize] = true;
                }
            }
            out.push(h);
        }
        if effort.stop_at_form && out.len() >= FORM_SAMPLE {
            form = correlated_share(&out) > 0.5;
            if form {
                break;
            }
        }
    }
    form |= !out.is_empty() && correlated_share(&out) > 0.5;
    Ok(Grown { hypotheses: out, form })
}

/// Share of the hypotheses that overlap another one in part: neither almost wholly nor hardly at all.
///
/// Grown from two seeds of one surface, hypotheses end up the same; grown on freeform, each slides to
/// where its seed lay.
fn sliding_share(scene: &Scene, hypotheses: &[Hypothesis]) -> f64 {
    let m = hypotheses.len();
    let mut at = vec![Vec::new(); scene.len()];
    for (k, h) in hypotheses.iter().enumerate() {
        for &i in &h.support {
            at[i as usize].push(k);
        }
    }
    let mut shared = vec![0usize; m * m];
    for here in &at {
        for (n, &a) in here.iter().enumerate() {
            for &b in &here[n + 1..] {
                shared[a * m + b] += 1;
                shared[b * m + a] += 1;
            }
        }
    }
    let slides = |a: usize| {
        (0..m).any(|b| {
            let least = hypotheses[a].support.len().min(hypotheses[b].support.len()) as f64;
            let overlap = shared[a * m + b] as f64 / least;
            (0.25..0.75).contains(&overlap)
        })
    };
    (0..m).filter(|&a| slides(a)).count() as f64 / m.max(1) as f64
}

/// What to do with a scene whose hypotheses leave form errors.
enum Form {
    /// Surfaces with a form error, of which this sigma takes account.
    Surfaces(f64),
    /// No quadrics.
    Free,
}

/// Whether form errors sit on true surfaces or on freeform. With a looser sigma, hypotheses on true surfaces
/// become the same wherever they start; on freeform they slide.
fn judge_form(
    scene: &Scene,
    families: &Families,
    seed: u64,
    trials: &mut (usize, usize),
    monitor: &dyn Monitor,
) -> Result<Form, Cancelled> {
    let effort = Effort { seeds: 32, stop_at_form: false };
    for k in [4.0, 8.0] {
        let looser = Families { sigma: families.sigma * k, ..families.clone() };
        let grown = hypothesise(scene, &looser, effort, seed, trials, monitor)?;
        let sliding = sliding_share(scene, &grown.hypotheses);
        // Few seeds cover a scene of surfaces; freeform takes all there are and is not covered yet.
        let covered = grown.hypotheses.len() * 4 < effort.seeds * 3;
        if sliding < 0.3 || (covered && sliding < 0.45) {
            return Ok(Form::Surfaces(looser.sigma));
        }
        if sliding > 0.45 {
            break;
        }
    }
    Ok(Form::Free)
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

/// Points of `members`, at most about `limit` of them, evenly along the scene's order.
pub fn take(scene: &Scene, members: &[u32], limit: usize) -> Vec<Vec3> {
    let m = members.len().min(limit);
    (0..m).map(|k| scene.points[members[k * members.len() / m] as usize]).collect()
}

fn refit(scene: &Scene, shapes: &mut [Shape], labels: &[i32], sigma: f64, limit: usize) {
    let groups = members(labels, shapes.len());
    shapes.par_iter_mut().zip(&groups).for_each(|(s, g)| {
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

/// Robust sigma of all labelled points about their surfaces.
pub fn residual_sigma(scene: &Scene, model: &Model) -> Option<f64> {
    let mut r: Vec<f64> = model
        .labels
        .iter()
        .zip(&scene.points)
        .filter(|(l, _)| **l >= 0)
        .map(|(&l, p)| model.shapes[l as usize].distance(p).abs())
        .collect();
    if r.len() < 100 {
        return None;
    }
    let k = r.len() / 2;
    Some(1.4826 * *r.select_nth_unstable_by(k, f64::total_cmp).1)
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
            let core: Vec<u32> = g
                .iter()
                .copied()
                .filter(|&i| {
                    scene.neighbours(i as usize).iter().all(|&j| labels[j as usize] == l as i32)
                })
                .collect();
            let set = if core.len() >= 60 && core.len() * 3 > g.len() { &core } else { g };
            let points = take(scene, set, 2000);
            let normals: Vec<Vec3> = {
                let m = set.len().min(2000);
                (0..m).map(|k| scene.normals[set[k * set.len() / m] as usize]).collect()
            };
            let best = families.best(&Patch { points: &points, normals: &normals }, &[*s], true)?;
            let whole = take(scene, g, 600);
            let sound = families.score(best.shape, &whole).chi2 < SOUND * whole.len() as f64;
            (best.shape.family != s.family && sound).then_some(best.shape)
        })
        .collect();
    let mut changed = 0;
    for (s, n) in model.shapes.iter_mut().zip(next) {
        if let Some(n) = n {
            *s = n;
            changed += 1;
        }
    }
    changed
}

/// Pairs of labels that meet along a border, each with how many graph edges cross it.
pub fn borders(scene: &Scene, labels: &[i32]) -> std::collections::BTreeMap<(usize, usize), usize> {
    let mut out = std::collections::BTreeMap::new();
    for (i, &l) in labels.iter().enumerate() {
        if l < 0 {
            continue;
        }
        for &j in scene.neighbours(i) {
            let m = labels[j as usize];
            if m >= 0 && m != l {
                *out.entry((l.min(m) as usize, l.max(m) as usize)).or_insert(0) += 1;
            }
        }
    }
    out
}

/// Points of each region that a joint fit looks at: too few cannot tell apart two large planes a
/// sigma from each other.
const MERGE_SAMPLE: usize = 1500;
/// Mean truncated chi2 above which a surface does not describe a set of points.
const SOUND: f64 = 3.0;

/// Joins pairs of regions whose joint fit costs less description length: pairs of one family
/// wherever they lie, and neighbours of unlike families under either one's.
pub fn merge(scene: &Scene, model: &mut Model, families: &Families) -> usize {
    if !families.policy.merge {
        return 0;
    }
    let sigma = families.sigma;
    let inverse = 1.0 / (sigma * sigma);
    let mut merges = 0;
    loop {
        let groups = members(&model.labels, model.shapes.len());
        let samples: Vec<Vec<Vec3>> = groups.iter().map(|g| take(scene, g, MERGE_SAMPLE)).collect();
        let m = model.shapes.len();
        let touching = borders(scene, &model.labels);
        let mut pairs = Vec::new();
        for a in 0..m {
            for b in a + 1..m {
                if samples[a].is_empty() || samples[b].is_empty() {
                    continue;
                }
                if model.shapes[a].family == model.shapes[b].family
                    || touching.contains_key(&(a, b))
                {
                    pairs.push((a, b));
                }
            }
        }
        let cost = |s: &Shape, p: &[Vec3]| -> f64 { Ruler::of(s).truncated(p, inverse, 16.0) };
        let mut found: Vec<(f64, usize, usize, Shape)> = pairs
            .par_iter()
            .filter_map(|&(a, b)| {
                let (sa, sb) = (&model.shapes[a], &model.shapes[b]);
                if sa.family == sb.family && !could_be_one(sa, sb, &samples[a], &samples[b]) {
                    return None;
                }
                let points: Vec<Vec3> = samples[a].iter().chain(&samples[b]).copied().collect();
                let length = |s: &Shape| s.family.description_length(points.len());
                let apart = cost(sa, &samples[a]) + cost(sb, &samples[b]) + length(sa) + length(sb);
                let mut best: Option<(f64, Shape)> = None;
                for s in [sa, sb] {
                    // A surface that misses most of the other's points is no start for both.
                    let other = if std::ptr::eq(s, sa) { &samples[b] } else { &samples[a] };
                    if sa.family != sb.family && cost(s, other) > 8.0 * other.len() as f64 {
                        continue;
                    }
                    let o = Options { cauchy: Some(4.0 * sigma), steps: 20, tolerance: 1e-4 };
                    let Some(f) = fit(s, &points, None, &o) else { continue };
                    // Both halves must lie on it: a region whose own surface is poor saves nothing.
                    let (ca, cb) = (cost(&f.shape, &samples[a]), cost(&f.shape, &samples[b]));
                    if ca > SOUND * samples[a].len() as f64 || cb > SOUND * samples[b].len() as f64
                    {
                        continue;
                    }
                    let c = ca + cb + length(s);
                    if best.is_none_or(|b| c < b.0) {
                        best = Some((c, f.shape));
                    }
                }
                let (joint, shape) = best?;
                (joint < apart).then_some((joint - apart, a, b, shape))
            })
            .collect();
        found.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
        let mut used = vec![false; m];
        let mut keep = vec![true; m];
        for (_, a, b, shape) in found {
            if used[a] || used[b] {
                continue;
            }
            used[a] = true;
            used[b] = true;
            keep[b] = false;
            model.shapes[a] = shape;
            for l in &mut model.labels {
                if *l == b as i32 {
                    *l = a as i32;
                }
            }
            merges += 1;
        }
        if !retain(model, &keep) {
            return merges;
        }
    }
}

/// A cheap look before the joint fit: whether sizes and directions are near enough to try.
fn could_be_one(a: &Shape, b: &Shape, pa: &[Vec3], pb: &[Vec3]) -> bool {
    let reach = |p: &[Vec3]| {
        let c = p.iter().sum::<Vec3>() / p.len().max(1) as f64;
        p.iter().map(|x| (x - c).norm()).fold(0.0, f64::max)
    };
    let size = reach(pa).max(reach(pb));
    let worst = |s: &Shape, p: &[Vec3]| {
        let mut d: Vec<f64> = p.iter().map(|x| s.distance(x).abs()).collect();
        let k = d.len() / 2;
        if d.is_empty() {
            // a region may have lost its last points to its neighbours
            return f64::INFINITY;
        }
        *d.select_nth_unstable_by(k, f64::total_cmp).1
    };
    worst(a, pb).min(worst(b, pa)) < 0.1 * size && {
        let axial = a.family != Family::Sphere && a.family != Family::Ellipsoid;
        !axial || a.w().dot(&b.w()).abs() > 0.9
    }
}

/// Rounds over what is still without a surface.
const PASSES: usize = 3;
/// New points a hypothesis must explain.
const MIN_NEW: usize = 40;
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
    let mut form = false;
    for pass in 0..PASSES {
        let open: Vec<u32> =
            (0..scene.len() as u32).filter(|&i| model.labels[i as usize] < 0).collect();
        if open.len() < 60 {
            break;
        }
        let seed = parameters.seed ^ pass as u64;
        let (chosen, labels) = if pass == 0 {
            let found = first_hypotheses(scene, families, seed, &mut form, &mut model, monitor)?;
            choose(scene, found, families, 0)
        } else {
            // What is left has a graph of its own: strips a point or two wide hold together in it.
            let mut rest = Scene::new(open.iter().map(|&i| scene.points[i as usize]).collect());
            rest.sharpen_normals(families.sigma);
            let found =
                hypothesise(&rest, families, Effort::FULL, seed, &mut model.trials, monitor)?;
            let found = found.hypotheses.into_iter().filter(|h| !h.is_correlated()).collect();
            choose(&rest, found, families, model.shapes.len())
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
        if pass + 1 < PASSES && !form {
            drop_correlated(scene, &mut model, families.sigma);
        }
        if let Some(s) = residual_sigma(scene, &model) {
            families.sigma =
                s.max(families.sigma * 0.2).min(families.sigma * 1.05).max(families.floor);
        }
    }
    Ok(model)
}

fn choose(
    part: &Scene,
    found: Vec<Hypothesis>,
    families: &Families,
    first_label: usize,
) -> (Vec<Hypothesis>, Vec<i32>) {
    let none = vec![-1; part.len()];
    select(part, found, families.sigma, &none, first_label, MIN_NEW)
}

/// The hypotheses of the whole scene, at a looser sigma where its surfaces have a form error.
fn first_hypotheses(
    scene: &Scene,
    families: &mut Families,
    seed: u64,
    form: &mut bool,
    model: &mut Model,
    monitor: &dyn Monitor,
) -> Result<Vec<Hypothesis>, Cancelled> {
    let watchful = Effort { stop_at_form: true, ..Effort::FULL };
    let grown = hypothesise(scene, families, watchful, seed, &mut model.trials, monitor)?;
    *form = grown.form;
    if !grown.form {
        return Ok(grown.hypotheses);
    }
    match judge_form(scene, families, seed, &mut model.trials, monitor)? {
        Form::Surfaces(sigma) => {
            families.sigma = sigma;
            let all = hypothesise(scene, families, Effort::FULL, seed, &mut model.trials, monitor)?;
            Ok(all.hypotheses)
        }
        Form::Free => Ok(standing_out(grown.hypotheses)),
    }
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
        retype(scene, model, families);
        model.merges += merge(scene, model, families);
        prune(model, MIN_NEW);
    }
    settle(scene, model, families.sigma, 8);
    for _ in 0..MOVES {
        if !families.policy.refine {
            break;
        }
        monitor.check()?;
        let gone = super::moves::remove_needless(scene, model, families);
        let swapped = super::moves::swap_families(scene, model, families);
        let broken = super::bridges::break_bridges(scene, model, families, MIN_NEW);
        model.merges += merge(scene, model, families);
        settle(scene, model, families.sigma, 8);
        if gone + swapped + broken == 0 {
            break;
        }
    }
    prune(model, MIN_NEW);
    Ok(())
}

/// Takes out regions whose residuals are correlated: they bridge several surfaces, which the next pass
/// finds one by one.
fn drop_correlated(scene: &Scene, model: &mut Model, sigma: f64) {
    let groups = members(&model.labels, model.shapes.len());
    let keep: Vec<bool> = model
        .shapes
        .iter()
        .zip(&groups)
        .enumerate()
        .map(|(l, (s, g))| {
            let inside = |j: u32| model.labels[j as usize] == l as i32;
            !correlated(correlation(scene, s, g, sigma, inside), g.len())
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
    let mut scene = Scene::new((0..m).map(|k| left[k * left.len() / m]).collect());
    scene.sharpen_normals(sigma);
    let extent = scene.points.iter().map(|p| p.norm()).fold(0.0, f64::max);
    let families = Families {
        allowed: Family::ALL.to_vec(),
        sigma,
        max_radius: 20.0 * extent,
        floor: sigma,
        policy: Policy::of(parameters),
    };
    let effort = Effort { seeds: 64, stop_at_form: false };
    let grown = hypothesise(&scene, &families, effort, parameters.seed, &mut (0, 0), monitor)?;
    let none = vec![-1; m];
    Ok(!select(&scene, grown.hypotheses, sigma, &none, 0, 40).0.is_empty())
}
