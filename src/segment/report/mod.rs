//! Writing down what was found.

pub mod allowed;
pub mod constraints;
pub mod dimensions;
pub mod evidence;
pub mod joints;
pub mod known;
pub mod motion;
pub mod pieces;
pub mod reasons;
pub mod sampling;
pub mod tally;
pub mod uncertainty;
use crate::segment::report::tally::CHUNK;
use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::fit::constant::constants;
use crate::fit::{Family, Shape};
use crate::geometry::{SurfaceType, Vec3};
use crate::segment::equation::Equations;
use crate::segment::finish::others;
use crate::segment::finish::others::{Other, asked_for};
use crate::segment::found::Found;
use crate::segment::hints::Draft;
use crate::segment::judge::one_quadric::one_quadric;
use crate::segment::median::deviation;
use crate::segment::partition::members;
use crate::segment::prepare::sampling::{Sampled, sampled};
use crate::segment::report::constraints::{Candidate, enforce, most_rms};
use crate::segment::report::joints::{Scale, joints};
use crate::segment::report::known::{Known, Told};
use crate::segment::report::reasons::{Reason, explain};
use crate::segment::report::tally::{Scatter, Tally, extent_of, sample, tallies};
use crate::segment::{
    Cancelled, Dimensions, Fit, HintOutcome, Monitor, Parameters, Region, Segmentation, Unassigned,
};

/// The regions that meet the parameters' constraints, in the contract's terms and world coordinates. `steps` are those
/// that coordinates are known to come in.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn report(
    parameters: &Parameters,
    found: Found,
    drafts: Vec<Draft>,
    steps: &[f64; 3],
    monitor: &dyn Monitor,
) -> Result<Segmentation, Cancelled> {
    let judged = judged(parameters, &found, monitor)?;
    let shapes: Vec<Shape> = judged.kept.iter().map(|c| c.shape).collect();
    let tallies = tallies(&found.points, &judged.labels, &shapes, monitor);
    let sampled = sampled(&found.points, steps);
    monitor.check()?;
    let whole = found.points.len();
    let labels = in_cloud_order(&judged.labels, &found.places);
    let reasons = judged.reasons.clone();
    let mut segmentation = told(judged, &found, drafts, (&tallies, whole), &sampled)?;
    count_points(&mut segmentation.regions, &labels);
    Ok(Segmentation { unassigned: unassigned(&labels, reasons), labels, ..segmentation })
}

/// What was found and may be reported.
pub struct Judged {
    /// The regions.
    pub kept: Vec<Candidate>,
    /// Quadrics of other types, which come after them.
    others: Vec<Other>,
    /// Each point's region, -1 = none.
    pub labels: Vec<i32>,
    /// How many have none for which reason.
    pub reasons: BTreeMap<Reason, usize>,
    /// The parameters as used.
    resolved: Parameters,
}

/// Judges what was found.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn judged(
    parameters: &Parameters,
    found: &Found,
    monitor: &dyn Monitor,
) -> Result<Judged, Cancelled> {
    let points = &found.points;
    let density = points.len() as f64 / found.scene.len() as f64;
    let spacing = found.scene.spacing / density.sqrt();
    let free_tori = asked_for(parameters) && !parameters.surfaces.contains(&SurfaceType::Torus);
    let (candidates, mut free) = candidates(found, parameters.tolerance, free_tori);
    let resolved = resolved(parameters, found);
    let most_rms = most_rms(parameters, found.rounding);
    let (kept, mut reasons) = enforce(points, candidates, &resolved, most_rms, monitor);
    let mut labels = labels(&kept, points.len());
    monitor.check()?;
    let mut others = Vec::new();
    if asked_for(parameters) {
        others = others::others(points, &free, spacing, found.noise, parameters, monitor);
        others.retain(|o| o.rms(points) <= most_rms);
        others.truncate(parameters.max_regions.saturating_sub(kept.len()));
        for (k, other) in others.iter().enumerate() {
            other.members.iter().for_each(|&i| labels[i as usize] = (kept.len() + k) as i32);
        }
        free.retain(|&i| labels[i as usize] < 0);
    }
    say_why(&mut reasons, found, &free, spacing, parameters.min_points, monitor);
    monitor.check()?;
    Ok(Judged { kept, others, labels, reasons, resolved })
}

/// The regions in the contract's terms, without labels, of a cloud of `whole` distinct points of which those found are
/// all or taken evenly: `tallies` are over all.
///
/// # Errors
/// The work was cancelled.
pub fn told(
    judged: Judged,
    found: &Found,
    drafts: Vec<Draft>,
    (tallies, whole): (&[Tally], usize),
    sampled: &Sampled,
) -> Result<Segmentation, Cancelled> {
    let Judged { kept, others, labels, resolved, .. } = judged;
    let density = whole as f64 / found.scene.len() as f64;
    let check = || if found.scene.cancelled() { Err(Cancelled) } else { Ok(()) };
    let known: Vec<Known> =
        kept.par_iter().zip(tallies).filter_map(|(c, t)| Known::of(c, t, found)).collect();
    check()?;
    let of_scene: Vec<i32> = found.scene.places.iter().map(|&i| labels[i as usize]).collect();
    let joints = joints(&found.scene, &of_scene, &known, &Scale { sigma: found.noise, density });
    check()?;
    let told = dimensions::all(&known, &kept, &joints, &of_scene, found, density);
    check()?;
    let region =
        |(id, (k, told)): (usize, (&Known, Told))| k.region(id, &found.centre, &joints, told);
    let first = known.iter().zip(told).enumerate().filter_map(region);
    let further =
        others.iter().enumerate().filter_map(|(k, o)| of_other_type(known.len() + k, o, found));
    let regions: Vec<Region> = first.chain(further).collect();
    check()?;
    Ok(Segmentation {
        sampling: Some(sampling::told(sampled)),
        warnings: sampling::warnings(sampled, found.noise),
        hints: outcomes(drafts, &kept),
        regions,
        unassigned: Unassigned::default(),
        labels: Vec::new(),
        parameters: resolved,
        counters: found.counters.clone(),
    })
}

/// What became of the hints, by the ids of the regions that are reported.
fn outcomes(drafts: Vec<Draft>, kept: &[Candidate]) -> Vec<HintOutcome> {
    let sources: Vec<usize> = kept.iter().map(|c| c.source).collect();
    drafts.into_iter().map(|draft| draft.told(&sources)).collect()
}

/// Adds the reasons of the points that are `free` of any region.
fn say_why(
    reasons: &mut BTreeMap<Reason, usize>,
    found: &Found,
    free: &[u32],
    spacing: f64,
    min_points: usize,
    monitor: &dyn Monitor,
) {
    // Tori, which are not reported, were found nevertheless.
    let found_out = |i: &u32| !found.scene.work.is_left() || found.labels[*i as usize] >= 0;
    let (seen, unseen): (Vec<u32>, Vec<u32>) = free.iter().partition(|i| found_out(i));
    for (free, examined) in [(seen, true), (unseen, false)] {
        let left: Vec<Vec3> = free.iter().map(|&i| found.points[i as usize]).collect();
        for (reason, n) in explain(&left, spacing, min_points, examined, monitor) {
            *reasons.entry(reason).or_insert(0) += n;
        }
    }
}

fn in_cloud_order(labels: &[i32], places: &[u32]) -> Vec<i32> {
    places.par_iter().with_min_len(CHUNK).map(|&k| labels[k as usize]).collect()
}

/// Copies of a point count as points of its region, though the fit saw it once.
fn count_points(regions: &mut [Region], labels: &[i32]) {
    let mut counts = vec![0; regions.iter().map(|r| r.id + 1).max().unwrap_or(0)];
    for &l in labels {
        if let Some(c) = usize::try_from(l).ok().and_then(|l| counts.get_mut(l)) {
            *c += 1;
        }
    }
    for r in regions {
        r.point_count = counts[r.id];
    }
}

/// Surfaces with their points, and the points without one; those of tori are free too where these are not asked
/// for and other quadrics than the default ones may lie there, and where one quadric explains them better.
fn candidates(
    found: &Found,
    tolerance: Option<f64>,
    free_tori: bool,
) -> (Vec<Candidate>, Vec<u32>) {
    let groups = members(&found.labels, found.shapes.len());
    let (mut out, mut free) = (Vec::new(), Vec::new());
    let all = found.shapes.iter().zip(&found.reaches).zip(&found.told).zip(groups);
    for (source, (((&shape, &reach), &told), members)) in all.enumerate() {
        let is_torus = shape.family == Family::Torus && told.is_none();
        if is_torus && (free_tori || is_other_quadric(&shape, &members, found)) {
            free.extend(members);
        } else {
            let reach = tolerance.unwrap_or(reach);
            out.push(Candidate { shape, members, rejected: 0, reach, source, told });
        }
    }
    free.extend((0..found.labels.len() as u32).filter(|&i| found.labels[i as usize] < 0));
    free.sort_unstable();
    (out, free)
}

constants! {
    /// Points of a torus that are worth asking whether another quadric explains them.
    ASKED: usize = 2_000, Effort("points looked at");
}

/// Whether one quadric of any type explains a torus's points within the noise and saves more than its two
/// parameters more cost: the waist of a hyperboloid is like the inner half of a torus.
fn is_other_quadric(torus: &Shape, members: &[u32], found: &Found) -> bool {
    let points = sample(&found.points, members, ASKED.get());
    let Some(quadric) = one_quadric(&points, found.noise) else { return false };
    let chi2 = |distance: &dyn Fn(&Vec3) -> f64| -> f64 {
        let inverse = 1.0 / found.noise.powi(2);
        points.iter().map(|p| (distance(p).powi(2) * inverse).min(16.0)).sum()
    };
    let saved = chi2(&|p| torus.distance(p)) - chi2(&|p| quadric.distance(p));
    saved
        > Family::Ellipsoid.description_length(points.len())
            - torus.family.description_length(points.len())
}

/// The region of a quadric that has no engineering parameters here.
fn of_other_type(id: usize, other: &Other, found: &Found) -> Option<Region> {
    let points: Vec<Vec3> = other.members.iter().map(|&i| found.points[i as usize]).collect();
    let mut scatter = Scatter::default();
    points.iter().for_each(|p| scatter.add(other.quadric.distance(p)));
    let noise = deviation(points.iter().map(|p| other.quadric.distance(p))).unwrap_or(0.0);
    let (centre, extent) = (found.centre, extent_of(&points, &found.centre)?);
    let far = other.quadric.moved_to(&-centre);
    let local = |o: &Vec3| other.quadric.moved_to(&(o - centre));
    let equations = Equations::of(&far, local, &extent, points.len(), |k| points[k] + centre);
    Some(Region {
        id,
        surface_type: other.surface_type,
        point_count: points.len(),
        coefficients: Some(equations.coefficients),
        coefficients_scale: Some(equations.coefficients_scale),
        coefficients_error: equations.coefficients_error,
        local_origin: equations.local_origin,
        local_coefficients: Some(equations.local_coefficients),
        surface: None,
        dimensions: Dimensions::default(),
        uncertainty: None,
        fit: Fit { noise, ..scatter.fit(points.len(), 0) },
        evidence: None,
        extent: Some(extent),
        neighbours: Vec::new(),
        snapped: None,
    })
}

fn labels(kept: &[Candidate], n: usize) -> Vec<i32> {
    let mut labels = vec![-1; n];
    for (id, candidate) in kept.iter().enumerate() {
        candidate.members.iter().for_each(|&i| labels[i as usize] = id as i32);
    }
    labels
}

fn unassigned(labels: &[i32], reasons: BTreeMap<Reason, usize>) -> Unassigned {
    let count = labels.iter().filter(|l| **l < 0).count();
    let distinct: usize = reasons.values().sum();
    let mut reasons = reasons;
    if count > distinct {
        reasons.insert(Reason::Duplicate, count - distinct);
    }
    let named = reasons.into_iter().filter(|(_, n)| *n > 0).map(|(r, n)| (r.name(), n));
    Unassigned { count, reasons: named.collect() }
}

/// The parameters as used; the tolerance allows for a form error that was found.
fn resolved(parameters: &Parameters, found: &Found) -> Parameters {
    Parameters {
        noise_sigma: Some(parameters.noise_sigma.unwrap_or(found.noise)),
        tolerance: Some(parameters.tolerance.unwrap_or(found.reach())),
        ..parameters.clone()
    }
}
