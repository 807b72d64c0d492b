use std::collections::BTreeMap;

use crate::geometry::{PointCloud, Vec3};
use crate::segment::finish::finish_by;
use crate::segment::finish::others::asked_for;
use crate::segment::found::Found;
use crate::segment::label::shares::Labelled;
use crate::segment::prepare::distinct::distinct_points;
use crate::segment::prepare::sampling::{Sampled, sampled};
use crate::segment::prepare::steps::resolution;
use crate::segment::report::reasons::Reason;
use crate::segment::report::tally::Tally;
use crate::segment::report::{self, Judged};
use crate::segment::tiles::guide::Guide;
use crate::segment::tiles::sums::Sums;
use crate::segment::{
    Cancelled, Method, Monitor, Parameters, SegmentError, Segmentation, Unassigned, distance,
    pipeline,
};

/// What was found on some of a cloud's points.
pub struct Survey<'a> {
    found: Found<'a>,
    parameters: Parameters,
    sampled: Sampled,
    monitor: &'a dyn Monitor,
}

impl<'a> Survey<'a> {
    /// Whether a cloud can be worked on in tiles with these parameters: not where a person tells of places in it, other
    /// quadrics than the default ones are looked for, or the seed's method is asked for.
    pub fn can(parameters: &Parameters) -> bool {
        parameters.method == Method::Distance
            && parameters.hints.is_empty()
            && !asked_for(parameters)
            && parameters.connectivity.is_none()
    }

    /// Looks for surfaces on `some` points of a cloud, taken evenly; `beside` are all points of one place, which tell how
    /// they were sampled.
    ///
    /// # Errors
    /// As those of [`crate::segment::segment`].
    pub fn of(
        some: &PointCloud,
        beside: &[Vec3],
        parameters: &Parameters,
        monitor: &'a dyn Monitor,
    ) -> Result<Self, SegmentError> {
        pipeline::check(some, parameters)?;
        let known = resolution(some);
        let found = distance::find(some, &known, parameters, monitor)?;
        let (beside, ..) = distinct_points(beside, monitor)?;
        let sampled = sampled(&beside, &known);
        Ok(Self { found, parameters: parameters.clone(), sampled, monitor })
    }

    /// What tiles are labelled by in the first round.
    pub fn guide(&self) -> Guide {
        let Found { scene, centre, shapes, labels, sigmas, reaches, .. } = &self.found;
        let labels: Vec<i32> = scene.places.iter().map(|&i| labels[i as usize]).collect();
        let surfaces = shapes.iter().zip(sigmas).zip(reaches);
        Guide::of(scene, centre, &labels, surfaces.map(|((s, sigma), reach)| (*s, *sigma, *reach)))
    }

    /// Fits the surfaces to all points, by the first round's sums over these, and judges them.
    ///
    /// # Errors
    /// The work was cancelled.
    pub fn judged(mut self, sums: &[Sums]) -> Result<Judgement<'a>, Cancelled> {
        let found = &mut self.found;
        if self.parameters.refine {
            let labelled = Labelled { labels: found.labels.clone(), shares: Vec::new() };
            let normals: Vec<_> = sums.iter().map(Sums::normal).collect();
            finish_by(&found.points, &labelled, &mut found.shapes, &normals, &found.sigmas);
        }
        let judged = report::judged(&self.parameters, &self.found, self.monitor)?;
        Ok(Judgement { survey: self, judged })
    }
}

/// What was found, and which of it may be reported.
pub struct Judgement<'a> {
    survey: Survey<'a>,
    judged: Judged,
}

impl Judgement<'_> {
    /// What tiles are labelled by in the second round; labels are then those of the regions.
    pub fn guide(&self) -> Guide {
        let Found { scene, centre, sigmas, .. } = &self.survey.found;
        let labels: Vec<i32> =
            scene.places.iter().map(|&i| self.judged.labels[i as usize]).collect();
        let surfaces = self.judged.kept.iter().map(|c| (c.shape, sigmas[c.source], c.reach));
        Guide::of(scene, centre, &labels, surfaces)
    }

    /// The result without labels, by the second round's sums over a cloud of so many points, `distinct` ones.
    ///
    /// # Errors
    /// The work was cancelled.
    pub fn report(
        mut self,
        sums: &[Sums],
        points: usize,
        distinct: usize,
    ) -> Result<Segmentation, Cancelled> {
        let tallies: Vec<Tally> = sums.iter().map(Sums::tally).collect();
        let mut reasons = self.judged.reasons.clone();
        for (candidate, sums) in self.judged.kept.iter_mut().zip(sums) {
            // those among the points looked at are counted with the others
            let outliers = reasons.entry(Reason::Outlier).or_default();
            *outliers = outliers.saturating_sub(candidate.rejected);
            candidate.rejected = sums.rejected;
        }
        let Survey { found, sampled, .. } = &self.survey;
        let mut out = report::told(self.judged, found, Vec::new(), (&tallies, distinct), sampled)?;
        for (region, sums) in out.regions.iter_mut().zip(sums) {
            region.point_count = sums.count;
        }
        let labelled: usize = sums.iter().map(|s| s.count).sum();
        let rejected: usize = sums.iter().map(|s| s.rejected_count).sum();
        out.unassigned = unassigned(points - labelled, rejected, &reasons);
        Ok(out)
    }
}

/// The reasons of `count` points without a region, of which `rejected` lie too far from theirs: those of the points that
/// surfaces were looked for on stand for the rest.
fn unassigned(count: usize, rejected: usize, of_some: &BTreeMap<Reason, usize>) -> Unassigned {
    let mut reasons = BTreeMap::new();
    let rejected = rejected.min(count);
    let (mut left, mut seen) = (count - rejected, of_some.values().sum::<usize>());
    for (reason, n) in of_some {
        // the last one takes what is left
        let own = if seen == 0 { 0 } else { (left as u128 * *n as u128 / seen as u128) as usize };
        (left, seen) = (left - own, seen - n);
        *reasons.entry(reason.name()).or_insert(0) += own;
    }
    *reasons.entry(Reason::Outlier.name()).or_insert(0) += rejected + left;
    reasons.retain(|_, n| *n > 0);
    Unassigned { count, reasons }
}
