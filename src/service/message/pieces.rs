use std::{iter::Peekable, vec::IntoIter};

use prost::Message;

use super::{count, v1};
use crate::{
    model::relations::{Measure, Relation},
    segment::{HintOutcome, Region},
    service::{Document, RegionFit},
};

/// A piece takes no further entry of a list once it has so many bytes: large enough that its head does not count,
/// small beside the 4 194 304 bytes that most clients take. The longest entry is a region whose outline has all the
/// points that outlines are told by, 1.3 MB.
const PIECE_BYTES: usize = 256 << 10;
/// Labels of one piece, of at most five bytes each.
const PIECE_LABELS: usize = 1 << 16;

/// A result in pieces that each fit into a message of any client: first all but the lists that may be long, then
/// regions, relations, measures, hints, fits and extraction cycles, the labels last, those of faces behind those of points. Merged in their order they are the whole
/// message. An entry of a list is written when its piece is asked for.
#[derive(Debug)]
pub struct Pieces {
    head: Option<v1::Segmentation>,
    regions: Peekable<IntoIter<Region>>,
    relations: Peekable<IntoIter<Relation>>,
    measures: Peekable<IntoIter<Measure>>,
    hints: Peekable<IntoIter<HintOutcome>>,
    fits: Peekable<IntoIter<RegionFit>>,
    cycles: Peekable<IntoIter<Vec<usize>>>,
    labels: Labels,
    face_labels: Labels,
}

impl Pieces {
    /// The pieces of `document`.
    pub fn of(mut document: Document) -> Self {
        let labels = Labels::of(document.labels.take());
        let face_labels = Labels::of(document.face_labels.take());
        let regions = std::mem::take(&mut document.regions).into_iter().peekable();
        let relations = std::mem::take(&mut document.relations).into_iter().peekable();
        let measures = std::mem::take(&mut document.measures).into_iter().peekable();
        let hints = std::mem::take(&mut document.hints).into_iter().peekable();
        let fits = std::mem::take(&mut document.fits).into_iter().peekable();
        let cycles = std::mem::take(&mut document.counters.extraction_cycles);
        let cycles = cycles.into_iter().peekable();
        let head = Some(document.into());
        Self { head, regions, relations, measures, hints, fits, cycles, labels, face_labels }
    }

    /// The next labels; none where all are sent.
    fn labels(&mut self) -> Option<v1::Segmentation> {
        if let Some(labels) = self.labels.piece() {
            return Some(v1::Segmentation { labels, ..Default::default() });
        }
        let face_labels = self.face_labels.piece()?;
        Some(v1::Segmentation { face_labels, ..Default::default() })
    }
}

/// The labels of points or faces, and how many of them are sent.
#[derive(Debug)]
struct Labels {
    all: Vec<i32>,
    sent: usize,
}

impl Labels {
    fn of(labels: Option<Vec<i32>>) -> Self {
        Self { all: labels.unwrap_or_default(), sent: 0 }
    }

    /// The next of them; none where all are sent.
    fn piece(&mut self) -> Option<Vec<i32>> {
        let end = self.all.len().min(self.sent + PIECE_LABELS);
        let labels = self.all[self.sent..end].to_vec();
        self.sent = end;
        (!labels.is_empty()).then_some(labels)
    }
}

impl Iterator for Pieces {
    type Item = v1::Segmentation;

    fn next(&mut self) -> Option<v1::Segmentation> {
        let first = self.head.take();
        let is_first = first.is_some();
        let mut piece = first.unwrap_or_default();
        let mut room = PIECE_BYTES.saturating_sub(piece.encoded_len());
        fill(&mut room, &mut self.regions, &mut piece.regions, |region| (&region).into());
        fill(&mut room, &mut self.relations, &mut piece.relations, |relation| (&relation).into());
        fill(&mut room, &mut self.measures, &mut piece.measures, |measure| (&measure).into());
        fill(&mut room, &mut self.hints, &mut piece.hints, Into::into);
        fill(&mut room, &mut self.fits, &mut piece.fits, Into::into);
        if self.cycles.peek().is_some() {
            let counters = piece.counters.get_or_insert_default();
            fill(&mut room, &mut self.cycles, &mut counters.extraction_cycles, |points| {
                v1::ExtractionCycles { points: points.into_iter().map(count).collect() }
            });
        }
        if is_first || room < PIECE_BYTES { Some(piece) } else { self.labels() }
    }
}

/// Moves entries of a list into a piece while there is room.
fn fill<T, M: Message>(
    room: &mut usize,
    from: &mut Peekable<IntoIter<T>>,
    into: &mut Vec<M>,
    write: impl Fn(T) -> M,
) {
    /// An entry's tag, and the longest length before it.
    const FRAME: usize = 6;
    while *room > 0 {
        let Some(entry) = from.next().map(&write) else { return };
        *room = room.saturating_sub(entry.encoded_len() + FRAME);
        into.push(entry);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::Outcome;

    /// What most clients take.
    const MOST: usize = 4_194_304;

    fn example() -> Document {
        serde_json::from_str(include_str!("../../http/pages/answer.json")).unwrap()
    }

    /// Every list as long as it may be, or longer: the most regions by default, among them some with the longest outline.
    fn large() -> Document {
        let mut document = example();
        let region = document.regions[0].clone();
        let outlined = |id: usize| {
            let mut region = Region { id, ..region.clone() };
            if id.is_multiple_of(2000) {
                region.dimensions.outline = Some(vec![vec![[0.1, 0.2, 0.3]; 20_000]; 2]);
            }
            region
        };
        document.regions = (0..10_000).map(outlined).collect();
        let measure =
            r#"{"kind": "angle", "regions": [300, 301], "value": 0.5, "uncertainty": 0.1}"#;
        document.measures = vec![serde_json::from_str(measure).unwrap(); 100_000];
        let hint = HintOutcome {
            hint: 0,
            outcome: Outcome::Contradicted,
            regions: (0..10_000).collect(),
            scatter: Some(1.5),
            misfit: None,
            message: "the points speak against it".to_owned(),
        };
        document.hints = (0..64).map(|k| HintOutcome { hint: k, ..hint.clone() }).collect();
        let why = || Some("the points lie on one line".to_owned());
        document.fits =
            (0..10_000).map(|region| RegionFit { region, fit: None, refused: why() }).collect();
        document.counters.extraction_cycles = vec![(0..100).collect(); 10_000];
        document.labels = Some((0..3_000_000).map(|k| k % 10_001 - 1).collect());
        document.face_labels = Some((0..2_000_000).map(|k| k % 10_001 - 1).collect());
        document
    }

    #[test]
    fn pieces_of_the_largest_answers_fit_into_a_message_and_are_the_whole_when_merged() {
        for document in [example(), example().shown(false), large()] {
            let whole = v1::Segmentation::from(document.clone());
            let mut merged = v1::Segmentation::default();
            for piece in Pieces::of(document) {
                assert!(piece.encoded_len() < MOST, "{}", piece.encoded_len());
                merged.merge(piece.encode_to_vec().as_slice()).unwrap();
            }
            assert!(merged == whole);
        }
    }

    #[test]
    fn regions_come_first_and_labels_last() {
        let pieces: Vec<_> = Pieces::of(large()).collect();
        let begin = pieces.iter().position(|piece| !piece.labels.is_empty()).unwrap();
        assert!(pieces[0].input.is_some() && !pieces[0].regions.is_empty());
        for piece in &pieces[begin..] {
            let (labels, face_labels) = (piece.labels.clone(), piece.face_labels.clone());
            assert!((1..=PIECE_LABELS).contains(&labels.len().max(face_labels.len())));
            assert!(labels.is_empty() || face_labels.is_empty());
            assert_eq!(*piece, v1::Segmentation { labels, face_labels, ..Default::default() });
        }
    }
}
