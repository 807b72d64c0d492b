//! The points that a hint is about.

use rayon::prelude::*;

use crate::fit::constant::constants;
use crate::geometry::Vec3;
use crate::segment::Hint;
use crate::segment::found::Found;
use crate::segment::hints::crop::is_within;

constants! {
    /// Points about one of a person's that lies on no region, which tell the surface there.
    AROUND: usize = 500, Effort("points of a first fit; what follows finds the rest");
}

/// The point nearest to a place of the file.
pub fn nearest(found: &Found, at: &[f64; 3]) -> u32 {
    let at = Vec3::from(*at) - found.centre;
    let far = |i: usize| (found.points[i] - at).norm_squared();
    let nearest = (0..found.points.len()).into_par_iter().with_min_len(4096);
    // of equal ones the first, whatever the threads do
    let nearest = nearest.min_by(|&a, &b| far(a).total_cmp(&far(b)).then(a.cmp(&b)));
    nearest.unwrap_or(0) as u32
}

/// The points of a region, ascending.
pub fn of_region(found: &Found, label: i32) -> Vec<u32> {
    (0..found.labels.len() as u32).filter(|&i| found.labels[i as usize] == label).collect()
}

/// The points that `i` stands for: those of its region or, where it has none, those around it that have none either.
pub fn around(found: &Found, i: u32) -> Vec<u32> {
    let label = found.labels[i as usize];
    if label >= 0 {
        return of_region(found, label);
    }
    let centre = found.points[i as usize];
    let mut free = of_region(found, -1);
    let far = |i: &u32| (found.points[*i as usize] - centre).norm_squared();
    free.par_sort_by(|a, b| far(a).total_cmp(&far(b)).then(a.cmp(b)));
    free.truncate(AROUND.get());
    free.sort_unstable();
    free
}

/// The points that a hint is about, ascending; `labels` are those of the file.
pub fn of_hint(found: &Found, hint: &Hint, labels: Option<&[i32]>) -> Vec<u32> {
    let mut members: Vec<u32> =
        hint.at.iter().flat_map(|at| around(found, nearest(found, at))).collect();
    if let Some(extent) = &hint.extent {
        let within = |i: &u32| is_within(extent, &(found.points[*i as usize] + found.centre));
        members.extend((0..found.points.len() as u32).filter(within));
    }
    if let Some(labels) = labels.filter(|_| !hint.labels.is_empty()) {
        members.extend(
            (0..labels.len() as u32).filter(|&i| hint.labels.contains(&labels[i as usize])),
        );
    }
    members.sort_unstable();
    members.dedup();
    members
}

/// The regions of some points and how many of them each has, the one with the most first.
pub fn regions(found: &Found, members: &[u32]) -> Vec<(usize, usize)> {
    let mut counts = vec![0; found.shapes.len()];
    for &i in members {
        if let Ok(l) = usize::try_from(found.labels[i as usize]) {
            counts[l] += 1;
        }
    }
    let mut all: Vec<(usize, usize)> = counts.into_iter().enumerate().filter(|c| c.1 > 0).collect();
    all.sort_by_key(|&(l, n)| (std::cmp::Reverse(n), l));
    all
}
