//! Thinning as a cloud is read.
//!
//! Points come up in the order of a lot that is drawn from their coordinates. In cells whose diagonal is the length, the
//! first of each comes up; it is kept where no point kept before is closer than the length. So kept points are no closer
//! to each other than the length, no input point is further than twice that from a kept one, and which are kept
//! depends neither on the order of the points nor on the number of threads. Every kept point is one of the input's: means
//! of several would lie inside curved surfaces and have less noise. The lot does not know where a point lies about its
//! surface: the points nearest to the middle of cells, or of cells that lie along a plane, would be those whose noise leans
//! one way.
//!
//! The input is gone through twice, and never held whole: the first time for the points that come up, then for the
//! kept point nearest to each.

mod blocks;
mod cells;
mod firsts;
mod near;

use std::sync::Arc;

use rayon::prelude::*;

use super::{
    Bounds, FormatError,
    memory::room_for,
    origin,
    sink::{About, Sink},
};
use crate::geometry::{PointCloud, Thinned, Vec3};
use blocks::Blocks;
use cells::Cells;
use firsts::{First, Firsts};
use near::Near;

/// Goes through the input from its beginning.
pub(super) type Pass<'a> = dyn FnMut(&mut dyn Sink) -> Result<About, FormatError> + 'a;

/// How often the memory of the tables is there at most: twice while what comes up is put in order, and once for what the
/// method makes of as many points.
const TIMES: u64 = 3;

/// A cell's edge for its diagonal; rounding makes no two points at the length from each other share one.
const EDGE: f64 = 0.577_350;

/// A length in few digits, with an exponent where it is odd.
fn short(length: f64) -> String {
    let is_usual = (1e-6..1e9).contains(&length);
    if is_usual { length.to_string() } else { format!("{length:e}") }
}

/// Thins a cloud: its points are no closer to each other than `length` then, which is above 0 and finite.
///
/// # Errors
/// `length` is too small beside the coordinates, there is no memory, or `limits` say that nobody waits.
pub fn thinned(
    cloud: &PointCloud,
    length: f64,
    limits: &dyn Bounds,
) -> Result<PointCloud, FormatError> {
    let mut pass = |sink: &mut dyn Sink| {
        cloud.each_block(|points| sink.take(points))?;
        Ok(About { grid: cloud.grid, unit: cloud.unit, resolution: cloud.resolution })
    };
    let kept = thin(&mut pass, length, false, limits)?;
    let own = |k: &u32| match &cloud.input_index {
        Some(index) => index.binary_search(k).unwrap_or_default(),
        None => *k as usize,
    };
    let places: Vec<usize> = match &kept.input_index {
        Some(index) => index.iter().map(own).collect(),
        None => (0..kept.points.len()).collect(),
    };
    fn taken<T: Copy>(all: Option<&Vec<T>>, places: &[usize]) -> Option<Vec<T>> {
        places.iter().map(|&k| all.map(|all| all[k])).collect::<Option<_>>()
    }
    Ok(PointCloud {
        mesh: cloud.mesh.clone(),
        holes_at_origin: cloud.holes_at_origin,
        labels: taken(cloud.labels.as_ref(), &places),
        normals: taken(cloud.normals.as_ref(), &places),
        ..kept
    })
}

/// Thins the cloud that `pass` goes through; with `may_have_holes` many points at exactly 0, 0, 0 are holes.
///
/// # Errors
/// As [`thinned`], and those of `pass`.
pub(super) fn thin(
    pass: &mut Pass,
    length: f64,
    may_have_holes: bool,
    limits: &dyn Bounds,
) -> Result<PointCloud, FormatError> {
    let cells = Cells::of(EDGE * length);
    let mut chosen = Chosen { firsts: Firsts::of(cells), finite: 0, zeros: 0, first_zero: None };
    let mut all =
        Blocks::of(|begin, points: &[Vec3]| chosen.take(points, begin, (cells, length), limits));
    let about = pass(&mut all)?;
    let input_len = all.end()?;
    let Chosen { mut firsts, mut finite, zeros, first_zero } = chosen;
    let are_holes = may_have_holes
        && origin::may_be_holes(zeros)
        && origin::are_holes(zeros, most_copies(&firsts.some(origin::COMPARED), pass)?);
    if are_holes {
        finite -= zeros;
    } else if let Some(index) = first_zero {
        firsts.take(&[Vec3::zeros()], index as usize, |_| false)?;
    }
    let come_up = firsts.in_order()?;
    let mut kept = spaced(&come_up, length, limits)?;
    drop(come_up);
    kept.par_sort_unstable_by_key(|first| first.index);
    let points: Vec<Vec3> = kept.iter().map(|first| first.point).collect();
    let nearest = nearest(pass, &points, (length, input_len), are_holes, limits)?;
    let index = kept.iter().map(|first| first.index).collect();
    Ok(PointCloud {
        input_index: (points.len() < input_len).then_some(index),
        points,
        input_len,
        grid: about.grid,
        unit: about.unit,
        resolution: about.resolution,
        holes_at_origin: if are_holes { zeros } else { 0 },
        thinned: Some(Arc::new(Thinned { length, finite, nearest })),
        ..PointCloud::default()
    })
}

fn is_finite(p: &Vec3) -> bool {
    p.x.is_finite() && p.y.is_finite() && p.z.is_finite()
}

/// What the first pass finds.
struct Chosen {
    firsts: Firsts,
    finite: usize,
    /// Points at exactly 0, 0, 0, which may be holes.
    zeros: usize,
    first_zero: Option<u32>,
}

impl Chosen {
    fn take(
        &mut self,
        points: &[Vec3],
        begin: usize,
        (cells, length): (Cells, f64),
        limits: &dyn Bounds,
    ) -> Result<(), FormatError> {
        limits.go_on()?;
        let counts = |p: &Vec3| {
            let finite = is_finite(p);
            (
                usize::from(finite),
                usize::from(*p == Vec3::zeros()),
                if finite { p.amax() } else { 0.0 },
            )
        };
        let sum =
            |a: (usize, usize, f64), b: (usize, usize, f64)| (a.0 + b.0, a.1 + b.1, a.2.max(b.2));
        let (finite, zeros, largest) =
            points.par_iter().with_min_len(4096).map(counts).reduce(|| (0, 0, 0.0), sum);
        if largest > cells.largest() {
            // cells are as many for every length; one that is nearly zero has no ratio to it
            let least = largest / Cells::of(EDGE).largest();
            return Err(FormatError::ThinTooSmall {
                length: short(length),
                least: format!("{least:.1e}"),
                coordinate: format!("{largest:e}"),
            });
        }
        if zeros > 0 && self.first_zero.is_none() {
            let at = points.iter().position(|p| *p == Vec3::zeros());
            self.first_zero = at.map(|at| (begin + at) as u32);
        }
        (self.finite, self.zeros) = (self.finite + finite, self.zeros + zeros);
        self.firsts.take(points, begin, |p| !is_finite(p) || *p == Vec3::zeros())?;
        let (taken, most) = (self.firsts.bytes(), limits.memory());
        if taken.saturating_mul(TIMES) > most {
            return Err(FormatError::ThinTakesMemory {
                length: short(length),
                read: (begin + points.len()) as u64,
                megabytes: most >> 20,
            });
        }
        Ok(())
    }
}

/// The most copies that some points have.
fn most_copies(some: &[Vec3], pass: &mut Pass) -> Result<usize, FormatError> {
    let mut copies = vec![0; some.len()];
    let mut all = Blocks::of(|_, points: &[Vec3]| {
        for (n, point) in copies.iter_mut().zip(some) {
            *n += points.par_iter().with_min_len(4096).filter(|p| *p == point).count();
        }
        Ok(())
    });
    pass(&mut all)?;
    all.end()?;
    Ok(copies.into_iter().max().unwrap_or(0))
}

/// Those of the points, in the order that they come up, that are no closer than `length` to one before.
fn spaced(come_up: &[First], length: f64, limits: &dyn Bounds) -> Result<Vec<First>, FormatError> {
    /// Points decided on by one thread before the others help.
    const BEGIN: usize = 4096;
    let (mut near, mut kept) = (Near::of(length), Vec::new());
    let mut done = 0;
    while done < come_up.len() {
        limits.go_on()?;
        // as many again as were looked at: most are near one kept before, which all threads find out
        let part = &come_up[done..come_up.len().min(2 * done + BEGIN)];
        let is_open = |first: &&First| !near.is_near(&first.point, length);
        let open: Vec<&First> = part.par_iter().with_min_len(512).filter(is_open).collect();
        for first in open {
            if !near.is_near(&first.point, length) {
                near.insert(first.point);
                kept.push(*first);
            }
        }
        done += part.len();
    }
    Ok(kept)
}

/// For each input point the place of the nearest of the kept `points`.
fn nearest(
    pass: &mut Pass,
    points: &[Vec3],
    (length, input_len): (f64, usize),
    are_holes: bool,
    limits: &dyn Bounds,
) -> Result<Vec<u32>, FormatError> {
    /// Points of which one thread finds the nearest at a time, at least.
    const LEAST: usize = 1 << 14;
    // twice the length is the bound; rounding may add to it
    let most = 2.01 * length;
    let (near, places) = Near::sorted(points, length);
    let mut nearest = room_for(input_len as u64)?;
    let one = |p: &Vec3| {
        if !is_finite(p) || (are_holes && *p == Vec3::zeros()) {
            return Thinned::NONE;
        }
        places.get(near.nearest(p, most) as usize).copied().unwrap_or(Thinned::NONE)
    };
    let mut all = Blocks::of(|_, points: &[Vec3]| {
        limits.go_on()?;
        let share = points.len() / (2 * rayon::current_num_threads());
        let found: Vec<Vec<u32>> =
            points.par_chunks(share.max(LEAST)).map(|points| near.told(points, one)).collect();
        found.iter().for_each(|found| nearest.extend_from_slice(found));
        Ok(())
    });
    pass(&mut all)?;
    all.end()?;
    Ok(nearest)
}

#[cfg(test)]
mod tests;
