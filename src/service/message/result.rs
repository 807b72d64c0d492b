use super::{count, parameters::format_to_message, v1};
use crate::{
    model::datum::{Datum, DatumSystem},
    segment::{Counters, Sampling, SamplingKind, Warning},
    service::{Document, Input, MeshInput, MeshPoints, ThinInput, Timing, UnassignedPoints},
};

impl From<Document> for v1::Segmentation {
    fn from(document: Document) -> Self {
        Self {
            conicoid: document.conicoid,
            build: document.build,
            input: Some((&document.input).into()),
            parameters: Some((&document.parameters).into()),
            regions: document.regions.iter().map(Into::into).collect(),
            labels: document.labels.unwrap_or_default(),
            face_labels: document.face_labels.unwrap_or_default(),
            unassigned: Some(document.unassigned.into()),
            sampling: document.sampling.map(Into::into),
            warnings: document.warnings.into_iter().map(Into::into).collect(),
            relations: document.relations.iter().map(Into::into).collect(),
            relation_scatter: document.relation_scatter,
            measures: document.measures.iter().map(Into::into).collect(),
            snapping: document.snapping.map(Into::into),
            hints: document.hints.into_iter().map(Into::into).collect(),
            fits: document.fits.into_iter().map(Into::into).collect(),
            datum_system: document.datum_system.map(Into::into),
            counters: Some((&document.counters).into()),
            timing: Some(document.timing.into()),
        }
    }
}

impl From<DatumSystem> for v1::DatumSystem {
    fn from(system: DatumSystem) -> Self {
        let datum = |datum: Datum| v1::Datum {
            region: count(datum.region),
            features: datum.features,
            turned: datum.turned,
        };
        Self {
            datums: system.datums.into_iter().map(datum).collect(),
            transform: system.transform.map(|m| m.concat()).unwrap_or_default(),
            free: system.free,
            refused: system.refused,
        }
    }
}

impl From<&Input> for v1::Input {
    fn from(input: &Input) -> Self {
        let [x, y, z] = input.resolution;
        Self {
            points: count(input.points),
            sha256: input.sha256.clone(),
            format: format_to_message(&input.format).into(),
            skipped: count(input.skipped),
            mesh: input.mesh.as_ref().map(Into::into),
            thin: input.thin.as_ref().map(Into::into),
            unit: input.unit.map_or(v1::LengthUnit::Unspecified, v1::LengthUnit::from).into(),
            resolution: Some(v1::Vector { x, y, z }),
        }
    }
}

impl From<&ThinInput> for v1::ThinInput {
    fn from(thin: &ThinInput) -> Self {
        Self { length: thin.length, kept: count(thin.kept) }
    }
}

impl From<&MeshInput> for v1::MeshInput {
    fn from(mesh: &MeshInput) -> Self {
        let points = match mesh.points {
            MeshPoints::Vertices => v1::MeshPoints::Vertices,
            MeshPoints::Samples => v1::MeshPoints::Samples,
        };
        Self {
            points: points.into(),
            vertices: count(mesh.vertices),
            faces: count(mesh.faces),
            spacing: mesh.spacing,
            chord_error: mesh.chord_error,
        }
    }
}

impl From<Sampling> for v1::Sampling {
    fn from(sampling: Sampling) -> Self {
        let kind = match sampling.kind {
            SamplingKind::Scattered => v1::SamplingKind::Scattered,
            SamplingKind::ScanLines => v1::SamplingKind::ScanLines,
            SamplingKind::Grid => v1::SamplingKind::Grid,
            SamplingKind::Lattice => v1::SamplingKind::Lattice,
        };
        let Sampling { along, across, steps: [x, y, z], .. } = sampling;
        Self { kind: kind.into(), along, across, steps: Some(v1::Vector { x, y, z }) }
    }
}

impl From<Warning> for v1::Warning {
    fn from(warning: Warning) -> Self {
        Self { code: warning.code, message: warning.message }
    }
}

impl From<UnassignedPoints> for v1::Unassigned {
    fn from(unassigned: UnassignedPoints) -> Self {
        let reasons = unassigned.reasons.into_iter().map(|(why, n)| (why, count(n)));
        Self { count: count(unassigned.count), reasons: reasons.collect() }
    }
}

impl From<&Counters> for v1::Counters {
    fn from(counters: &Counters) -> Self {
        let cycles = counters.extraction_cycles.iter().map(|points| v1::ExtractionCycles {
            points: points.iter().map(|&n| count(n)).collect(),
        });
        Self {
            trials: count(counters.trials),
            failed_trials: count(counters.failed_trials),
            merges: count(counters.merges),
            extraction_cycles: cycles.collect(),
            strategies: counters.strategies.map(|s| s.map(count).into()).unwrap_or_default(),
        }
    }
}

impl From<Timing> for v1::Timing {
    fn from(timing: Timing) -> Self {
        let stages = timing.stages.into_iter().collect();
        Self { parse: timing.parse, stages, total: timing.total }
    }
}
