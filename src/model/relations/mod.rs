//! Relations between regions: what a designer meant to be parallel, coaxial, equal.
//!
//! Every region is a surface known to a covariance. A relation is accepted where its deviation is compatible with none,
//! and where a deviation so small would be a surprise if it were chance: a Bayesian choice between "exactly" and
//! "anything", in which how common such relations are is learned from the regions themselves. What was accepted before is
//! reckoned with: all relations are equations on all surfaces at once, and one that contradicts the others is none.
//!
//! The steps: common directions and right angles (`directions`), common axes, planes and centres (`positions`), equal sizes
//! (`sizes`), smooth joints (`tangents`), circles and rows of axes (`patterns`), mirrors (`symmetry`),
//! distances and angles (`measures`); `snap`
//! makes all accepted ones hold exactly.

mod chi2;
mod circle;
mod cluster;
mod constraint;
mod directions;
mod estimate;
mod face;
mod frame;
mod joint;
mod lattice;
mod measures;
mod patterns;
mod positions;
mod scatter;
mod search;
mod sizes;
mod snap;
mod spot;
mod symmetry;
mod tangents;
mod told;

pub use told::{Measure, MeasureKind, Relation, RelationKind, Snapping};

use crate::fit::constant::{Table, constants};
use crate::segment::Region;
use chi2::survival;
use face::Face;
use frame::Frame;
use search::{Accepted, Search};
use symmetry::Scene;
use tangents::Known;

constants! {
    /// Regions that relations are looked for between; of more, those with the most points.
    LARGEST: usize = 400, Effort("regions, whose equations are solved together");
}

/// The numbers that are decided with, by file.
pub(super) static TABLES: &[Table] = &[
    CONSTANTS,
    circle::CONSTANTS,
    cluster::CONSTANTS,
    face::CONSTANTS,
    lattice::CONSTANTS,
    scatter::CONSTANTS,
    search::CONSTANTS,
    sizes::CONSTANTS,
    snap::CONSTANTS,
    symmetry::CONSTANTS,
];

/// The relations between the regions of a result.
#[derive(Default)]
pub struct Relations {
    faces: Vec<Face>,
    frame: Option<Frame>,
    found: Vec<Accepted>,
    measures: Vec<Measure>,
    /// By how much, in the input's unit, the surfaces stand off from where the relations would have them beyond what their
    /// uncertainties explain.
    pub scatter: f64,
}

impl Relations {
    /// Those between `regions`; none between regions whose uncertainty is not known.
    pub fn of(regions: &[Region]) -> Self {
        let Some(frame) = Frame::of(regions.iter().filter_map(|r| r.extent)) else {
            return Self::default();
        };
        let mut faces = faces(regions, &frame);
        let scatter = scatter::scatter(&faces, frame.size);
        if scatter > 0.0 {
            faces.iter_mut().for_each(|f| *f = f.scattered(scatter));
        }
        let (found, measures) = between(&faces, frame, regions);
        Self { faces, frame: Some(frame), found, measures, scatter: scatter * frame.unit }
    }

    /// Gives each of `regions` a second surface, so that all accepted relations hold between these. `regions` are those that
    /// the relations are of.
    ///
    /// A surface that they would move by more than its uncertainty allows stays as it is, and no relation of it is accepted
    /// any more; nor is one that contradicts others.
    pub fn snap(&mut self, regions: &mut [Region]) -> Option<Snapping> {
        let frame = self.frame?;
        let snap = loop {
            match snap::snap(&self.faces, &self.found) {
                Ok(snap) => break snap,
                Err(moved) => {
                    let stays =
                        |(k, face): (usize, &Face)| (!moved.contains(&k)).then(|| face.clone());
                    self.faces = self.faces.iter().enumerate().filter_map(stays).collect();
                    // distances and angles need no relation
                    self.found = between(&self.faces, frame, regions).0;
                }
            }
        };
        for region in regions {
            let place = self.faces.binary_search_by_key(&region.id, |f| f.region).ok();
            region.snapped = match place {
                Some(k) => Some(snap.region(k, &self.faces[k], &frame, region)),
                None => snap::unmoved(region),
            };
        }
        for &k in &snap.left_out {
            self.found[k].relations.iter_mut().for_each(|r| r.accepted = false);
        }
        Some(Snapping {
            chi2: snap.total,
            freedom: snap.rank,
            p_value: survival(snap.total, snap.rank),
        })
    }

    /// The relations, and the distances and angles, as they are told: those of one kind together.
    pub fn told(self) -> (Vec<Relation>, Vec<Measure>) {
        let mut relations: Vec<Relation> =
            self.found.into_iter().flat_map(|a| a.relations).collect();
        relations.sort_by_key(|r| r.kind);
        let mut measures = self.measures;
        measures.sort_by(|a, b| a.kind.cmp(&b.kind).then(a.regions.cmp(&b.regions)));
        (relations, measures)
    }
}

/// What holds between faces, and the distances and angles of those that are parallel or touch.
fn between(faces: &[Face], frame: Frame, regions: &[Region]) -> (Vec<Accepted>, Vec<Measure>) {
    let touching = touching(regions, faces);
    let mut search = Search::new(faces, frame);
    let bundles = directions::parallel(&mut search);
    let square = directions::perpendicular(&mut search, &bundles);
    search.settle();
    let (mut lines, mut planes, mut measures) = (Vec::new(), Vec::new(), Vec::new());
    for bundle in &bundles {
        lines.push(positions::coaxial(&mut search, bundle));
        let along = positions::coplanar(&mut search, bundle);
        measures.extend(measures::of_planes(&search, &along));
        planes.push(along);
    }
    measures.extend(lines.iter().flat_map(|l| measures::of_lines(&search, l)));
    measures.extend(measures::angles(&search, &bundles, &square, &touching));
    positions::concentric(&mut search);
    let radii = sizes::equal(&mut search);
    let known = Known { bundles: &bundles, square: &square, lines: &lines };
    search.settle();
    tangents::tangent(&mut search, &known, &touching);
    for (bundle, lines) in bundles.iter().zip(&lines) {
        patterns::patterns(&mut search, bundle, lines, &radii);
    }
    let scene = Scene { bundles: &bundles, planes: &planes, lines: &lines, radii: &radii };
    (0..bundles.len()).for_each(|k| symmetry::symmetric(&mut search, &scene, k));
    (search.found, measures)
}

/// The regions as faces, in their order.
fn faces(regions: &[Region], frame: &Frame) -> Vec<Face> {
    let mut largest: Vec<&Region> = regions.iter().collect();
    largest.sort_by(|a, b| b.point_count.cmp(&a.point_count).then(a.id.cmp(&b.id)));
    largest.truncate(LARGEST.get());
    largest.sort_by_key(|r| r.id);
    largest.into_iter().filter_map(|r| Face::of(r, frame)).collect()
}

/// The pairs of faces whose regions touch.
fn touching(regions: &[Region], faces: &[Face]) -> Vec<[usize; 2]> {
    let place = |region: usize| faces.binary_search_by_key(&region, |f| f.region).ok();
    let mut pairs: Vec<[usize; 2]> = regions
        .iter()
        .flat_map(|r| r.neighbours.iter().map(|n| [r.id, n.region]))
        .filter(|[a, b]| a < b)
        .filter_map(|[a, b]| Some([place(a)?, place(b)?]))
        .collect();
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}
