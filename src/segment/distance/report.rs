//! Writing down what was found.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::constraints::{Candidate, enforce, most_rms};
use super::evidence::{self, evidence};
use super::joints::{Joint, Known, Scale, joints};
use super::label::members;
use super::others::{Other, asked_for};
use super::reasons::{Reason, explain};
use super::uncertainty::{self, Uncertainty};
use super::{Found, place};
use crate::fit::{Family, Ruler, Shape};
use crate::geometry::Vec3;
use crate::segment::equation::Equations;
use crate::segment::{
    Cancelled, Extent, Fit, Monitor, Neighbour, Parameters, Region, Segmentation, Unassigned,
};

/// Points worked on at once; fixed, so that the result does not depend on the number of threads.
const CHUNK: usize = 4096;

/// The regions that meet the parameters' constraints, in the contract's terms and world coordinates.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn report(
    parameters: &Parameters,
    found: Found,
    monitor: &dyn Monitor,
) -> Result<Segmentation, Cancelled> {
    let points = &found.points;
    let density = points.len() as f64 / found.scene.len() as f64;
    let spacing = found.scene.spacing / density.sqrt();
    let (candidates, mut free) = candidates(&found, asked_for(parameters));
    let resolved = resolved(parameters, &found);
    let most_rms = most_rms(parameters, found.rounding);
    let (kept, mut reasons) = enforce(points, candidates, &resolved, most_rms, monitor);
    let mut labels = labels(&kept, points.len());
    monitor.check()?;
    let mut others = Vec::new();
    if asked_for(parameters) {
        others = super::others::others(points, &free, spacing, found.noise, parameters, monitor);
        others.retain(|o| o.rms(points) <= most_rms);
        others.truncate(parameters.max_regions.saturating_sub(kept.len()));
        for (k, other) in others.iter().enumerate() {
            other.members.iter().for_each(|&i| labels[i as usize] = (kept.len() + k) as i32);
        }
        free.retain(|&i| labels[i as usize] < 0);
    }
    let left: Vec<Vec3> = free.iter().map(|&i| points[i as usize]).collect();
    for (reason, n) in explain(&left, spacing, parameters.min_points, monitor) {
        *reasons.entry(reason).or_insert(0) += n;
    }
    monitor.check()?;
    let tallies = tallies(points, &labels, &kept, monitor);
    monitor.check()?;
    let known: Vec<Known> =
        kept.par_iter().zip(&tallies).filter_map(|(c, t)| Known::of(c, t, &found)).collect();
    monitor.check()?;
    let joints = touching(&known, &labels, &found, density);
    monitor.check()?;
    let first = known.iter().enumerate().filter_map(|(id, k)| k.region(id, &found.centre, &joints));
    let further =
        others.iter().enumerate().filter_map(|(k, o)| of_other_type(known.len() + k, o, &found));
    let mut regions: Vec<Region> = first.chain(further).collect();
    let labels = in_cloud_order(&labels, &found.places);
    count_points(&mut regions, &labels);
    Ok(Segmentation {
        regions,
        unassigned: unassigned(&labels, reasons),
        labels,
        parameters: resolved,
        counters: found.counters,
    })
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

/// Surfaces with their points, and the points without one; those of tori are free too where other
/// quadrics than the default ones may lie there.
fn candidates(found: &Found, free_tori: bool) -> (Vec<Candidate>, Vec<u32>) {
    let groups = members(&found.labels, found.shapes.len());
    let (mut out, mut free) = (Vec::new(), Vec::new());
    for (&shape, members) in found.shapes.iter().zip(groups) {
        if free_tori && shape.family == Family::Torus {
            free.extend(members);
        } else {
            out.push(Candidate { shape, members, rejected: 0 });
        }
    }
    free.extend((0..found.labels.len() as u32).filter(|&i| found.labels[i as usize] < 0));
    free.sort_unstable();
    (out, free)
}

/// The region of a quadric that has no engineering parameters here.
fn of_other_type(id: usize, other: &Other, found: &Found) -> Option<Region> {
    let points: Vec<Vec3> = other.members.iter().map(|&i| found.points[i as usize]).collect();
    let mut scatter = Scatter::default();
    points.iter().for_each(|p| scatter.add(other.quadric.distance(p)));
    let (centre, extent) = (found.centre, extent_of(&points, &found.centre)?);
    let far = other.quadric.moved_to(&-centre);
    let local = |o: &Vec3| other.quadric.moved_to(&(o - centre));
    let equations = Equations::of(&far, local, &extent, points.len(), |k| points[k] + centre);
    Some(Region {
        id,
        surface_type: other.surface_type,
        point_count: points.len(),
        coefficients: equations.coefficients,
        coefficients_scale: equations.coefficients_scale,
        coefficients_error: equations.coefficients_error,
        local_origin: equations.local_origin,
        local_coefficients: equations.local_coefficients,
        surface: None,
        uncertainty: None,
        fit: scatter.fit(points.len(), 0),
        evidence: None,
        extent: Some(extent),
        neighbours: Vec::new(),
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
        tolerance: Some(parameters.tolerance.unwrap_or(found.reach)),
        ..parameters.clone()
    }
}

fn touching(known: &[Known], labels: &[i32], found: &Found, density: f64) -> Vec<Joint> {
    let (m, n) = (found.scene.len(), labels.len());
    let of_scene: Vec<i32> = (0..m).map(|k| labels[place(k, m, n)]).collect();
    joints(&found.scene, &of_scene, known, &Scale { sigma: found.noise, density })
}

/// Sums over the points of one region.
struct Tally {
    n: usize,
    sum: Vec3,
    low: Vec3,
    high: Vec3,
    scatter: Scatter,
}

impl Default for Tally {
    fn default() -> Self {
        let (low, high) = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        Self { n: 0, sum: Vec3::zeros(), low, high, scatter: Scatter::default() }
    }
}

impl Tally {
    fn add(&mut self, points: &[Vec3], ruler: &Ruler) {
        self.n += points.len();
        for p in points {
            self.sum += p;
            self.low = self.low.inf(p);
            self.high = self.high.sup(p);
        }
        ruler.for_each(points, |d| self.scatter.add(d));
    }

    fn merge(&mut self, other: &Self) {
        self.n += other.n;
        self.sum += other.sum;
        self.low = self.low.inf(&other.low);
        self.high = self.high.sup(&other.high);
        self.scatter.merge(&other.scatter);
    }

    fn extent(&self, centre: &Vec3) -> Option<Extent> {
        let corner = |p: Vec3| (p + centre).into();
        (self.n > 0).then(|| Extent { min: corner(self.low), max: corner(self.high) })
    }
}

/// Sums over the points of every region, in one pass.
fn tallies(
    points: &[Vec3],
    labels: &[i32],
    kept: &[Candidate],
    monitor: &dyn Monitor,
) -> Vec<Tally> {
    let rulers: Vec<Ruler> = kept.iter().map(|c| Ruler::of(&c.shape)).collect();
    let parts: Vec<Vec<(usize, Tally)>> = labels
        .par_chunks(CHUNK)
        .zip(points.par_chunks(CHUNK))
        .map(|(labels, points)| {
            let mut sums: Vec<(usize, Tally)> = Vec::new();
            if monitor.cancelled() {
                return sums;
            }
            let mut from = 0;
            for run in labels.chunk_by(|a, b| a == b) {
                let own = &points[from..from + run.len()];
                from += run.len();
                let Ok(l) = usize::try_from(run[0]) else { continue };
                // Labels beyond these are of quadrics that have no shape here.
                let Some(ruler) = rulers.get(l) else { continue };
                let k = sums.iter().position(|s| s.0 == l).unwrap_or(sums.len());
                if k == sums.len() {
                    sums.push((l, Tally::default()));
                }
                sums[k].1.add(own, ruler);
            }
            sums
        })
        .collect();
    let mut out: Vec<Tally> = kept.iter().map(|_| Tally::default()).collect();
    for (l, tally) in parts.into_iter().flatten() {
        out[l].merge(&tally);
    }
    out
}

/// At most `limit` of a region's points, evenly.
fn sample(points: &[Vec3], members: &[u32], limit: usize) -> Vec<Vec3> {
    let m = members.len().min(limit);
    (0..m).map(|k| points[members[place(k, m, members.len())] as usize]).collect()
}

impl Known {
    /// `None` where the work was cancelled.
    fn of(candidate: &Candidate, tally: &Tally, found: &Found) -> Option<Self> {
        if found.scene.cancelled() {
            return None;
        }
        let members = &candidate.members;
        let centroid = tally.sum / members.len().max(1) as f64;
        let shape = candidate.shape.recentred(&centroid);
        let fit = tally.scatter.fit(members.len(), candidate.rejected);
        // The points' scatter about their surface tells its form error too.
        let freedom = members.len().saturating_sub(shape.family.dof()).max(1) as f64;
        let sigma = found.noise.max(fit.rms * (members.len() as f64 / freedom).sqrt());
        let stride = members.len().div_ceil(uncertainty::SAMPLE).max(1);
        let some: Vec<Vec3> =
            members.iter().step_by(stride).map(|&i| found.points[i as usize]).collect();
        let share = members.len() as f64 / some.len() as f64;
        let few = sample(&found.points, members, evidence::SAMPLE);
        let extent = tally.extent(&found.centre);
        Some(Self {
            uncertainty: Uncertainty::of(&shape, &some, share, sigma),
            evidence: evidence(&shape, &few, sigma),
            equations: extent.and_then(|extent| equations(&shape, members, &extent, found)),
            extent,
            shape,
            fit,
        })
    }

    fn region(&self, id: usize, centre: &Vec3, joints: &[Joint]) -> Option<Region> {
        let surface = self.shape.translated(centre).surface()?;
        let equations = self.equations?;
        Some(Region {
            id,
            surface_type: surface.surface_type(),
            point_count: self.fit.used,
            coefficients: equations.coefficients,
            coefficients_scale: equations.coefficients_scale,
            coefficients_error: equations.coefficients_error,
            local_origin: equations.local_origin,
            local_coefficients: equations.local_coefficients,
            surface: Some(surface),
            uncertainty: self.uncertainty.as_ref().map(Uncertainty::to_json),
            fit: self.fit,
            evidence: self.evidence,
            extent: self.extent,
            neighbours: joints.iter().filter_map(|j| neighbour(j, id)).collect(),
        })
    }
}

/// The equations of a shape relative to the cloud's centre. The one about an origin near the points comes from the
/// shape itself: what the file's origin has cancelled is not to be had back.
fn equations(shape: &Shape, members: &[u32], extent: &Extent, found: &Found) -> Option<Equations> {
    let far = shape.translated(&found.centre).surface()?.quadric();
    let local = |o: &Vec3| shape.translated(&(found.centre - o)).quadric().unwrap_or(far);
    let point = |k: usize| found.points[members[k] as usize] + found.centre;
    Some(Equations::of(&far, local, extent, members.len(), point))
}

fn neighbour(joint: &Joint, id: usize) -> Option<Neighbour> {
    let [a, b] = joint.regions;
    let region = if a == id {
        b
    } else if b == id {
        a
    } else {
        return None;
    };
    Some(Neighbour { region, continuity: joint.continuity, resolution: joint.resolution })
}

/// Sums over distances.
#[derive(Default)]
struct Scatter {
    sum_sq: f64,
    max: f64,
}

impl Scatter {
    fn add(&mut self, d: f64) {
        self.sum_sq += d * d;
        self.max = self.max.max(d.abs());
    }

    fn merge(&mut self, other: &Self) {
        self.sum_sq += other.sum_sq;
        self.max = self.max.max(other.max);
    }

    fn fit(&self, used: usize, rejected: usize) -> Fit {
        let rms = (self.sum_sq / used.max(1) as f64).sqrt();
        Fit { rms, max: self.max, used, rejected }
    }
}

fn extent_of(points: &[Vec3], centre: &Vec3) -> Option<Extent> {
    let min = points.iter().copied().reduce(|a, b| a.inf(&b))? + centre;
    let max = points.iter().copied().reduce(|a, b| a.sup(&b))? + centre;
    Some(Extent { min: min.into(), max: max.into() })
}
