use bytes::Bytes;

use super::super::ServiceError;
use super::wire::{Asked, PartCame, PartTold};
use crate::{
    jobs::{Blob, Control, Parts, PartsError},
    segment::tiles::{Guide, Sums},
};

/// What has come of all parts.
pub(super) struct Came {
    /// The labels of all points, where they were asked for.
    pub labels: Vec<i32>,
    /// The sums of each surface.
    pub sums: Vec<Sums>,
    /// Points with three coordinates, and those of them that are no copies.
    pub finite: usize,
    pub distinct: usize,
}

/// The rounds in which every part is worked on.
pub(super) struct Rounds<'a> {
    pub parts: &'a dyn Parts,
    pub blobs: &'a [Blob],
    /// Points in all, and of each part but the last.
    pub len: usize,
    pub size: usize,
    pub control: &'a Control,
}

impl Rounds<'_> {
    /// Has all parts labelled by a guide.
    ///
    /// # Errors
    /// A part cannot be, or the job is to stop.
    pub fn run(&self, guide: &Guide, with_labels: bool) -> Result<Came, ServiceError> {
        let asked = serde_json::to_vec(&Asked { guide, with_labels })?;
        let mut told: Vec<Option<PartTold>> = self.blobs.iter().map(|_| None).collect();
        let mut labels = vec![-1; if with_labels { self.len } else { 0 }];
        let mut take = |part: usize, bytes: Bytes| {
            let failed = |why| PartsError::Failed { part, why };
            let came = PartCame::read(&bytes).map_err(failed)?;
            if with_labels {
                let from = part * self.size;
                let own = labels.get_mut(from..from + came.labels.len());
                let own = own.ok_or_else(|| failed("it has too many labels".to_owned()))?;
                own.copy_from_slice(&came.labels);
            }
            told[part] = Some(came.told);
            Ok(())
        };
        self.parts.each(asked.into(), self.blobs, self.control, &mut take)?;
        let mut all = Came { labels, sums: Vec::new(), finite: 0, distinct: 0 };
        // in the order of the parts, whoever came first
        for told in told.into_iter().flatten() {
            if all.sums.is_empty() {
                all.sums = told.sums;
            } else {
                all.sums.iter_mut().zip(&told.sums).for_each(|(a, b)| a.add(b));
            }
            all.finite += told.finite;
            all.distinct += told.distinct;
        }
        Ok(all)
    }
}
