use super::{extract::Extracted, surface::FittedSurface};
use crate::geometry::Vec3;
use crate::segment::Counters;
use crate::segment::rcond::grow::Pool;

/// The regions found, in the order they were extracted.
#[derive(Default)]
pub(super) struct Found {
    /// Each region's surface.
    pub(super) surfaces: Vec<FittedSurface>,
    /// Each point's region, -1 = none.
    pub(super) labels: Vec<i32>,
    /// How much work it was.
    pub(super) counters: Counters,
}

impl Found {
    /// Adds a region, whose points lose their place in the pool next.
    pub(super) fn accept(&mut self, pool: &Pool, extracted: &Extracted) {
        let label = self.surfaces.len() as i32;
        for &i in &extracted.members {
            self.labels[pool.cloud_index(i) as usize] = label;
        }
        self.surfaces.push(extracted.surface);
        self.counters.extraction_cycles.push(extracted.cycles.clone());
        let total = self.counters.strategies.get_or_insert([0; 3]);
        total.iter_mut().zip(extracted.strategies).for_each(|(t, s)| *t += s);
    }

    /// Each region's points, in the cloud's order.
    pub(super) fn members(&self, points: &[Vec3]) -> Vec<Vec<Vec3>> {
        let mut members = vec![Vec::new(); self.surfaces.len()];
        for (point, &label) in points.iter().zip(&self.labels) {
            if let Some(of_region) = usize::try_from(label).ok().and_then(|l| members.get_mut(l)) {
                of_region.push(*point);
            }
        }
        members
    }

    /// Takes `fitted` as the surfaces; regions without one are dropped and the labels closed up.
    /// True where a region was dropped.
    pub(super) fn keep(&mut self, fitted: Vec<Option<FittedSurface>>) -> bool {
        let mut next = 0;
        let new_label: Vec<i32> = fitted
            .iter()
            .map(|s| {
                if s.is_some() {
                    next += 1;
                    next - 1
                } else {
                    -1
                }
            })
            .collect();
        let dropped = next < fitted.len() as i32;
        self.surfaces = fitted.into_iter().flatten().collect();
        self.map_labels(|label| new_label[label]);
        dropped
    }

    /// The labels after region `gone` has become part of `kept`; those above it close up.
    pub(super) fn relabel_merged(&mut self, kept: usize, gone: usize) {
        self.map_labels(|label| {
            let label = if label == gone { kept } else { label };
            (if label > gone { label - 1 } else { label }) as i32
        });
    }

    fn map_labels(&mut self, new_label: impl Fn(usize) -> i32) {
        for label in &mut self.labels {
            if let Ok(old) = usize::try_from(*label) {
                *label = new_label(old);
            }
        }
    }
}
