//! Points between several surfaces, placed by the neighbours of each.

use kiddo::ImmutableKdTree;
use rayon::prelude::*;

use crate::fit::Ruler;
use crate::geometry::Vec3;
use crate::segment::Monitor;
use crate::segment::label::energy::Energies;
use crate::segment::label::labelling::Labelling;
use crate::segment::label::shares::posterior;
use crate::segment::prepare::candidates::K;
use crate::segment::prepare::nearest::{Runs, Search};

/// Points between surfaces that are placed between two looks at whether the work was cancelled.
pub const WATCHED: usize = 1024;

/// Points by where they lie; `None` of none.
pub fn tree(points: &[Vec3]) -> Option<ImmutableKdTree<f64, 3>> {
    let raw: Vec<[f64; 3]> = points.iter().map(|p| (*p).into()).collect();
    ImmutableKdTree::new_from_slice(&raw).ok()
}

/// Points between surfaces, and the neighbours that they are placed by.
pub struct Between<'a> {
    pub points: &'a [Vec3],
    pub rulers: &'a [Ruler],
    /// The points' labels before.
    pub labels: &'a [i32],
    /// The points to place, ascending.
    pub several: &'a [u32],
    /// The neighbours of each.
    pub near: Vec<Near>,
    pub inverse: f64,
}

/// A point's nearest neighbours, nearest first.
#[derive(Clone, Copy, Default)]
pub struct Near {
    places: [u32; K],
    len: usize,
}

impl FromIterator<u32> for Near {
    fn from_iter<I: IntoIterator<Item = u32>>(places: I) -> Self {
        let mut out = Self::default();
        for (to, place) in out.places.iter_mut().zip(places) {
            *to = place;
            out.len += 1;
        }
        out
    }
}

impl Labelling for Between<'_> {
    fn point(&self, i: u32) -> &Vec3 {
        &self.points[i as usize]
    }

    /// None of a point that is near one surface alone: there is nothing to ask around it.
    fn neighbours(&self, i: u32) -> &[u32] {
        let near = self.several.binary_search(&i).ok().and_then(|k| self.near.get(k));
        near.map_or(&[], |near| &near.places[..near.len])
    }

    fn label(&self, i: u32) -> i32 {
        self.labels[i as usize]
    }

    fn ruler(&self, label: i32) -> &Ruler {
        &self.rulers[label as usize]
    }

    fn inverse(&self) -> f64 {
        self.inverse
    }
}

impl Between<'_> {
    /// Each point's best label and its shares of several.
    pub fn placed(&self, monitor: &dyn Monitor) -> Vec<(i32, Vec<(i32, f64)>)> {
        self.several
            .par_iter()
            .with_min_len(128)
            .with_max_len(WATCHED)
            .map_init(
                || monitor.cancelled(),
                |cancelled, &i| {
                    if *cancelled {
                        return (-1, Vec::new());
                    }
                    let energies = Energies::at(self, i);
                    (energies.best(), posterior(&energies))
                },
            )
            .collect()
    }
}

/// The neighbours of points between surfaces, among all points.
pub fn nearest(points: &[Vec3], several: &[u32], monitor: &dyn Monitor) -> Vec<Near> {
    // Neighbours are looked for among the stretches of the order that hold such points, and some beyond.
    let mut beside = vec![false; points.len().div_ceil(REACH)];
    for &i in several {
        let b = i as usize / REACH;
        for b in b.saturating_sub(1)..(b + 2).min(beside.len()) {
            beside[b] = true;
        }
    }
    let pool: Vec<u32> = (0..points.len() as u32).filter(|&i| beside[i as usize / REACH]).collect();
    let own: Vec<Vec3> = pool.iter().map(|&i| points[i as usize]).collect();
    let runs = Runs::of(&own);
    let watched = || (!monitor.cancelled()).then(Search::default);
    several
        .par_iter()
        .with_min_len(128)
        .with_max_len(WATCHED)
        .map_init(watched, |search, &i| {
            let Some(search) = search else { return Near::default() };
            let at = pool.partition_point(|&j| j < i);
            let near = runs.nearest(at, search).0;
            near.iter().filter_map(|&k| pool.get(k as usize).copied()).collect()
        })
        .collect()
}

/// Points of the order between two marks of where neighbours are looked for.
const REACH: usize = 64;
