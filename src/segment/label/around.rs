//! The labels that points of a sample meet.

use rayon::prelude::*;

use crate::segment::prepare::scene::Scene;

/// Points worked on at once; fixed, so that the result does not depend on the number of threads.
pub const CHUNK: usize = 4096;

/// The distinct labels of each sample point and its neighbours.
pub struct Around {
    /// Where each point's labels end.
    ends: Vec<u32>,
    labels: Vec<i32>,
}

impl Around {
    pub fn of(scene: &Scene, labels: &[i32]) -> Self {
        let starts: Vec<usize> = (0..scene.len()).step_by(CHUNK).collect();
        let parts: Vec<Self> = starts
            .into_par_iter()
            .map(|from| {
                if scene.cancelled() {
                    return Self { ends: Vec::new(), labels: Vec::new() };
                }
                let mut part = Self { ends: Vec::new(), labels: Vec::new() };
                for i in from..scene.len().min(from + CHUNK) {
                    let start = part.labels.len();
                    let near = scene.neighbours(i).iter().map(|&j| labels[j as usize]);
                    near.chain([labels[i]]).for_each(|l| add_label(&mut part.labels, start, l));
                    part.ends.push(part.labels.len() as u32);
                }
                part
            })
            .collect();
        let mut out = Self { ends: Vec::with_capacity(scene.len()), labels: Vec::new() };
        for part in parts {
            let before = out.labels.len() as u32;
            out.ends.extend(part.ends.into_iter().map(|e| e + before));
            out.labels.extend(part.labels);
        }
        out
    }

    /// Where the labels of each end, and all of them.
    pub fn into_parts(self) -> (Vec<u32>, Vec<i32>) {
        (self.ends, self.labels)
    }

    /// From those.
    pub fn from_parts(ends: Vec<u32>, labels: Vec<i32>) -> Self {
        Self { ends, labels }
    }

    /// Of the labels those that are wanted.
    pub fn only(&self, wanted: impl Fn(i32) -> bool) -> Self {
        let mut out = Self { ends: Vec::with_capacity(self.len()), labels: Vec::new() };
        for i in 0..self.len() {
            out.labels.extend(self.at(i).iter().filter(|l| wanted(**l)));
            out.ends.push(out.labels.len() as u32);
        }
        out
    }

    pub fn len(&self) -> usize {
        self.ends.len()
    }

    pub fn at(&self, i: usize) -> &[i32] {
        let start = if i == 0 { 0 } else { self.ends[i - 1] };
        &self.labels[start as usize..self.ends[i] as usize]
    }

    /// The labels around point `q` of the sample and the two beside it in the order.
    pub fn beside(&self, q: usize, into: &mut Vec<i32>) {
        into.clear();
        for i in q.saturating_sub(1)..(q + 2).min(self.len()) {
            self.at(i).iter().for_each(|&l| add_label(into, 0, l));
        }
    }
}

/// Adds a label that is not yet among those from `start` on.
fn add_label(labels: &mut Vec<i32>, start: usize, l: i32) {
    if l >= 0 && !labels[start..].contains(&l) {
        labels.push(l);
    }
}
