use rayon::prelude::*;

use super::Document;

/// Labels whose text is written at once.
const BLOCK: usize = 1 << 15;

/// The document as JSON, with its labels last: they are most of the text, and written by all threads.
///
/// # Errors
/// The document has no place in JSON.
pub(super) fn json(mut document: Document) -> Result<Vec<u8>, serde_json::Error> {
    let Some(labels) = document.labels.take() else { return serde_json::to_vec(&document) };
    let blocks: Vec<Vec<u8>> =
        labels.par_chunks(BLOCK).map(serde_json::to_vec).collect::<Result<_, _>>()?;
    let mut bytes = serde_json::to_vec(&document)?;
    // the object is opened again
    bytes.pop();
    bytes.reserve(blocks.iter().map(Vec::len).sum::<usize>() + 16);
    bytes.extend_from_slice(b",\"labels\":[");
    for (k, block) in blocks.iter().enumerate() {
        if k > 0 {
            bytes.push(b',');
        }
        // without its own brackets
        bytes.extend_from_slice(&block[1..block.len() - 1]);
    }
    bytes.extend_from_slice(b"]}");
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::super::{Input, Timing, UnassignedPoints};
    use super::*;
    use crate::segment::{Counters, Parameters};

    #[test]
    fn labels_written_by_all_threads_are_those_of_the_document() {
        for n in [0, 1, BLOCK, BLOCK + 1, 3 * BLOCK - 5] {
            let labels: Vec<i32> = (0..n as i32).map(|k| k % 1013 - 1).collect();
            let document = Document {
                conicoid: "1".into(),
                input: Input {
                    points: n,
                    sha256: "0".into(),
                    format: "ply".into(),
                    skipped: 0,
                    unit: (n > 0).then_some(crate::geometry::LengthUnit::Mm),
                    resolution: [0.0, 0.5, n as f64],
                    mesh: None,
                },
                parameters: Parameters::default(),
                regions: Vec::new(),
                labels: Some(labels),
                face_labels: None,
                unassigned: UnassignedPoints::default(),
                sampling: None,
                warnings: Vec::new(),
                relations: Vec::new(),
                relation_scatter: 0.0,
                measures: Vec::new(),
                snapping: None,
                hints: Vec::new(),
                fits: Vec::new(),
                counters: Counters::default(),
                timing: Timing::default(),
            };
            let told: Document = serde_json::from_slice(&json(document.clone()).unwrap()).unwrap();
            assert_eq!(told, document);
            assert_eq!(json(document.clone().shown(false)).unwrap(), {
                serde_json::to_vec(&document.shown(false)).unwrap()
            });
        }
    }
}
