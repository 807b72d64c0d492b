use std::io::{self, Write};

use rayon::prelude::*;

use super::Document;

/// Labels whose text is written at once.
const BLOCK: usize = 1 << 15;

/// Blocks whose text is held at a time: some tens of megabytes.
const HELD: usize = 256;

/// Writes the document as JSON, with its labels last: they are most of the text, and written by all threads.
///
/// # Errors
/// The document has no place in JSON, or `out` fails.
pub(super) fn json(out: &mut impl Write, mut document: Document) -> io::Result<()> {
    let Some(labels) = document.labels.take() else {
        return Ok(serde_json::to_writer(out, &document)?);
    };
    let mut bytes = serde_json::to_vec(&document)?;
    // the object is opened again
    bytes.pop();
    out.write_all(&bytes)?;
    out.write_all(b",\"labels\":[")?;
    for (round, labels) in labels.chunks(BLOCK * HELD).enumerate() {
        let blocks: Vec<Vec<u8>> =
            labels.par_chunks(BLOCK).map(serde_json::to_vec).collect::<Result<_, _>>()?;
        for (k, block) in blocks.iter().enumerate() {
            if round + k > 0 {
                out.write_all(b",")?;
            }
            // without its own brackets
            out.write_all(&block[1..block.len() - 1])?;
        }
    }
    out.write_all(b"]}")
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
                build: "2".into(),
                input: Input {
                    points: n,
                    sha256: "0".into(),
                    format: "ply".into(),
                    skipped: 0,
                    unit: (n > 0).then_some(crate::geometry::LengthUnit::Mm),
                    resolution: [0.0, 0.5, n as f64],
                    mesh: None,
                    thin: None,
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
                datum_system: None,
                counters: Counters::default(),
                timing: Timing::default(),
            };
            let json = |document| {
                let mut bytes = Vec::new();
                super::json(&mut bytes, document).map(|()| bytes)
            };
            let told: Document = serde_json::from_slice(&json(document.clone()).unwrap()).unwrap();
            assert_eq!(told, document);
            assert_eq!(json(document.clone().shown(false)).unwrap(), {
                serde_json::to_vec(&document.shown(false)).unwrap()
            });
        }
    }
}
