use super::Answer;
use crate::formats::region_color;
use crate::model::{self, Source};

/// The STEP file of an answer.
pub fn step(answer: &Answer) -> String {
    let Answer { document, cloud, .. } = answer;
    let stored = answer.stored_labels();
    let source = Source {
        points: &cloud.points,
        labels: &stored,
        regions: &document.regions,
        noise: document.parameters.noise_sigma.unwrap_or(0.0),
    };
    model::step(&source, document.input.unit, &document.conicoid, region_color)
}
