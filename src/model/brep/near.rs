//! Which regions' points lie near a place.

use std::collections::HashMap;

use crate::geometry::Vec3;

/// The points of the regions, sorted into cubes.
pub struct Near {
    side: f64,
    cubes: HashMap<[i32; 3], (u32, u32)>,
    /// Points and labels, those of one cube together.
    entries: Vec<(Vec3, u32)>,
}

impl Near {
    /// Points with their labels in cubes of that side.
    pub fn of(points: impl Iterator<Item = (Vec3, u32)>, side: f64) -> Self {
        let mut keyed: Vec<([i32; 3], Vec3, u32)> =
            points.map(|(p, l)| (key(&p, side), p, l)).collect();
        // Stable: points of one cube stay in their order.
        keyed.sort_by_key(|k| k.0);
        let mut cubes = HashMap::new();
        let mut from = 0;
        for run in keyed.chunk_by(|a, b| a.0 == b.0) {
            cubes.insert(run[0].0, (from, from + run.len() as u32));
            from += run.len() as u32;
        }
        Self { side, cubes, entries: keyed.into_iter().map(|(_, p, l)| (p, l)).collect() }
    }

    /// All points and labels, in the order of the cubes.
    pub fn entries(&self) -> &[(Vec3, u32)] {
        &self.entries
    }

    /// Calls `with` for every point within `radius` of `x`: squared distance, point, label. It stops where `with` says so.
    pub fn within(&self, x: &Vec3, radius: f64, mut with: impl FnMut(f64, &Vec3, u32) -> bool) {
        let (low, high) =
            (key(&x.add_scalar(-radius), self.side), key(&x.add_scalar(radius), self.side));
        for i in low[0]..=high[0] {
            for j in low[1]..=high[1] {
                for k in low[2]..=high[2] {
                    let Some(&(from, to)) = self.cubes.get(&[i, j, k]) else { continue };
                    for (p, l) in &self.entries[from as usize..to as usize] {
                        let sq = (p - x).norm_squared();
                        if sq <= radius * radius && !with(sq, p, *l) {
                            return;
                        }
                    }
                }
            }
        }
    }

    /// Whether a point of that label lies within `radius`.
    pub fn has(&self, x: &Vec3, radius: f64, label: u32) -> bool {
        let mut found = false;
        self.within(x, radius, |_, _, l| {
            found = l == label;
            !found
        });
        found
    }
}

fn key(p: &Vec3, side: f64) -> [i32; 3] {
    // Beyond the range the cast stays at its end.
    [0, 1, 2].map(|k| (p[k] / side).floor() as i32)
}
