use std::sync::Arc;

use super::fits::{RegionFit, region_fits};
use super::{
    AnswerError, BUILD, Document, ErrorKind, Input, MeshInput, MeshPoints, Request, ThinInput,
    Timing, UnassignedPoints,
};
use crate::{
    fit::feature::Element,
    formats::Fields,
    geometry::{LengthUnit, Mesh, PointCloud},
    model::datum::{DatumSystem, datum_system},
    model::relations::Relations,
    segment::{Region, SegmentError, Segmentation, Unassigned, Warning, resolution},
};

/// A result, and the cloud it is about.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// The result, with its labels.
    pub document: Document,
    /// The points; those kept, where they were thinned.
    pub cloud: Arc<PointCloud>,
    /// All points of a cloud that was thinned, for the forms that tell of each.
    pub whole: Option<Arc<PointCloud>>,
    /// The file's own columns, where the form of the result has room for them.
    pub fields: Fields,
    /// What the cloud is called, where that is known.
    pub name: Option<String>,
}

impl Answer {
    /// What `found` in `cloud` tells, with the relations between its regions; `sha256` and `format` are those of the
    /// bytes the cloud came in.
    pub fn new(
        cloud: Arc<PointCloud>,
        mut found: Segmentation,
        request: &Request,
        (sha256, format): (String, &str),
        timing: Timing,
    ) -> Self {
        let input = Input {
            points: cloud.input_len,
            sha256,
            format: format.to_owned(),
            skipped: cloud.skipped(),
            unit: request.unit.or(cloud.unit),
            resolution: resolution_of(&cloud, &found),
            mesh: cloud.mesh.as_deref().map(mesh_told),
            thin: thin_told(&cloud),
        };
        found.warnings.extend(warnings(&cloud, request.unit));
        let document = document(&cloud, found, request, input, timing);
        let name = request.name.clone();
        Self { document, cloud, whole: None, fields: Fields::default(), name }
    }

    /// The cloud with all points, as far as they are at hand.
    pub fn all_points(&self) -> &PointCloud {
        self.whole.as_deref().unwrap_or(&self.cloud)
    }

    /// The label of each stored point of the cloud; -1 = unassigned, or labels that were left out.
    pub fn stored_labels(&self) -> Vec<i32> {
        let labels = self.document.labels();
        match &self.cloud.input_index {
            Some(index) => {
                index.iter().map(|at| labels.get(*at as usize).copied().unwrap_or(-1)).collect()
            }
            None => labels.to_vec(),
        }
    }
}

/// What is told of a mesh.
pub fn mesh_told(mesh: &Mesh) -> MeshInput {
    let samples = mesh.samples.as_ref();
    MeshInput {
        points: samples.map_or(MeshPoints::Vertices, |_| MeshPoints::Samples),
        vertices: mesh.vertices,
        faces: mesh.faces,
        spacing: samples.map(|samples| samples.spacing),
        chord_error: samples.map(|samples| samples.chord_error),
    }
}

/// What is told of a cloud that was thinned.
pub fn thin_told(cloud: &PointCloud) -> Option<ThinInput> {
    let thinned = cloud.thinned.as_ref()?;
    Some(ThinInput { length: thinned.length, kept: cloud.points.len() })
}

/// The step of each coordinate, as it was seen or is known.
fn resolution_of(cloud: &PointCloud, found: &Segmentation) -> [f64; 3] {
    found.sampling.map_or_else(|| resolution(cloud), |sampling| sampling.steps)
}

/// What of the file limits the answer, or was decided about it.
fn warnings(cloud: &PointCloud, unit: Option<LengthUnit>) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let mut warn = |code: &str, message| warnings.push(Warning { code: code.to_owned(), message });
    if cloud.holes_at_origin > 0 {
        let n = cloud.holes_at_origin;
        warn("holes_at_origin", format!("{n} points at exactly 0, 0, 0 are taken for holes"));
    }
    if let (Some(given), Some(stated)) = (unit, cloud.unit)
        && given != stated
    {
        warn(
            "unit_differs",
            format!(
                "the file states its lengths in {stated}; they are labelled {given}, as asked, and not converted"
            ),
        );
    }
    warnings
}

/// Why the fit of a region has no surface.
fn unfitted(of: &RegionFit) -> Option<String> {
    let why = match (&of.refused, &of.fit) {
        (Some(why), _) => why.clone(),
        (None, Some(fit)) => format!("the points do not tell {}", fit.not_identifiable.join(", ")),
        (None, None) => return None,
    };
    Some(format!(
        "region {} has no fit: {why}. Name another region, or ask for another association",
        of.region
    ))
}

/// The datum system of regions by their ids: of their fits where there are such, or else of their surfaces.
fn datums(ids: &[usize], regions: &[Region], fits: Option<&[RegionFit]>) -> DatumSystem {
    let fitted = |fits: &[RegionFit], id: usize| match fits.get(id)?.fit.as_ref()?.surface? {
        Element::Surface(surface) => Some(surface),
        _ => None,
    };
    let surface = |id: usize| match fits {
        Some(fits) => fitted(fits, id),
        None => regions.get(id)?.surface,
    };
    let all: Vec<_> = ids.iter().map(|&id| (id, surface(id))).collect();
    let mut system = datum_system(&all);
    let missing = all.iter().find(|(_, surface)| surface.is_none());
    if let Some(why) = missing.and_then(|(id, _)| unfitted(fits?.get(*id)?)) {
        system.refused = Some(why);
    }
    system
}

fn document(
    cloud: &PointCloud,
    found: Segmentation,
    request: &Request,
    input: Input,
    timing: Timing,
) -> Document {
    let kept_unassigned = found.unassigned;
    let mut regions = found.regions;
    let mut relations = Relations::of(&regions);
    let snapping = if request.snap { relations.snap(&mut regions) } else { None };
    let fits = request
        .association
        .map(|association| region_fits(cloud, &found.labels, &regions, association, &input));
    let datum_system =
        (!request.datums.is_empty()).then(|| datums(&request.datums, &regions, fits.as_deref()));
    let relation_scatter = relations.scatter;
    let (relations, measures) = relations.told();
    let labels = cloud.labels_in_input_order(found.labels);
    let unassigned = if cloud.thinned.is_some() {
        count_all(&mut regions, kept_unassigned, &labels, input.skipped)
    } else {
        kept_unassigned
    };
    // every point of a mesh is a sample, with a face
    let face_labels = cloud.samples().map(|samples| samples.face_labels(&labels));
    let reasons = unassigned.reasons.into_iter().map(|(why, n)| (why.to_owned(), n));
    let skipped = (input.skipped > 0).then(|| ("not_finite".to_owned(), input.skipped));
    Document {
        conicoid: env!("CARGO_PKG_VERSION").to_owned(),
        build: BUILD.to_owned(),
        unassigned: UnassignedPoints {
            count: unassigned.count + input.skipped,
            reasons: reasons.chain(skipped).collect(),
        },
        input,
        parameters: found.parameters,
        regions,
        labels: Some(labels),
        face_labels,
        sampling: found.sampling,
        warnings: found.warnings,
        relations,
        relation_scatter,
        measures,
        snapping,
        hints: found.hints,
        fits: fits.unwrap_or_default(),
        datum_system,
        counters: found.counters,
        timing,
    }
}

/// Counts all points of a cloud that was thinned: those of each region, and those without one, whose reasons are shared out
/// as among the points that were kept.
fn count_all(
    regions: &mut [Region],
    kept: Unassigned,
    labels: &[i32],
    skipped: usize,
) -> Unassigned {
    let mut counts = vec![0; regions.iter().map(|r| r.id + 1).max().unwrap_or(0)];
    let mut unassigned = 0;
    for &label in labels {
        match usize::try_from(label).ok().and_then(|label| counts.get_mut(label)) {
            Some(count) => *count += 1,
            None => unassigned += 1,
        }
    }
    regions.iter_mut().for_each(|region| region.point_count = counts[region.id]);
    let count = unassigned - skipped;
    let sum: usize = kept.reasons.values().sum();
    // rounded sums differ by no more than the points there are
    let share = |n: usize| (n as f64 / sum as f64 * count as f64).round() as usize;
    let (mut before, mut told) = (0, 0);
    let reasons = kept.reasons.into_iter().map(|(why, n)| {
        before += n;
        let up_to = share(before);
        let own = up_to - told;
        told = up_to;
        (why, own)
    });
    Unassigned { count, reasons: reasons.filter(|(_, n)| *n > 0).collect() }
}

/// The error of a segmentation, which says so where it is about what thinning left.
pub fn error_of_thinned(error: SegmentError, cloud: &PointCloud) -> AnswerError {
    let few =
        matches!(error, SegmentError::TooFewPoints { .. } | SegmentError::CroppedToFew { .. });
    match &cloud.thinned {
        Some(thinned) if few => AnswerError::new(
            ErrorKind::TooFewPoints,
            format!(
                "thin={} keeps {} of {} points: {error}: take a smaller thin, or leave it out",
                thinned.length,
                cloud.points.len(),
                cloud.input_len
            ),
        ),
        _ => error.into(),
    }
}
