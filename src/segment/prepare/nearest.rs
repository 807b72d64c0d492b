//! The nearest neighbours of points in Morton order.
//!
//! Runs of the order are compact, so runs of 32 points with their bounding boxes take the place of a tree's
//! leaves. For all points of a run the boxes that may hold neighbours are looked up once; each point then looks
//! into those that are nearer than the neighbours it has, 32 points at a time.

#![expect(clippy::needless_range_loop, reason = "lanes read best by index")]

use multiversion::multiversion;

use crate::geometry::Vec3;
use crate::segment::prepare::candidates::ROOM;
use crate::segment::prepare::candidates::{Candidates, K};
use crate::segment::prepare::closest::Closest;

/// Points of a run.
const RUN: usize = 32;

/// Runs of a group: groups are looked at before their runs.
const GROUP: usize = 16;

/// Points in Morton order, in runs.
pub struct Runs {
    n: usize,
    runs: Vec<Run>,
    boxes: Vec<Box>,
    groups: Vec<Box>,
}

/// The coordinates of a run. The last run is filled up with NaN, which is near nothing.
struct Run {
    x: [f64; RUN],
    y: [f64; RUN],
    z: [f64; RUN],
}

/// A box with sides along the axes.
#[derive(Clone, Copy)]
struct Box {
    low: Vec3,
    high: Vec3,
}

impl Box {
    fn of(points: &[Vec3]) -> Self {
        let (first, rest) = (points[0], &points[1..]);
        rest.iter()
            .fold(Self { low: first, high: first }, |b, p| b.with(&Self { low: *p, high: *p }))
    }

    fn with(&self, other: &Self) -> Self {
        Self { low: self.low.inf(&other.low), high: self.high.sup(&other.high) }
    }

    /// Squared distance between two boxes, 0 where they meet.
    #[inline(always)]
    fn sq_gap(&self, other: &Self) -> f64 {
        let mut sq = 0.0;
        for k in 0..3 {
            let gap = (self.low[k] - other.high[k]).max(other.low[k] - self.high[k]).max(0.0);
            sq += gap * gap;
        }
        sq
    }
}

/// Runs that may hold neighbours of the points of one run, those with the nearest boxes first.
#[derive(Default)]
pub struct Search {
    /// The run, and one more than it, so that 0 is none.
    of: usize,
    near: Vec<(f64, u32)>,
    /// The point last asked for and how far its neighbours are.
    last: Option<(Vec3, f64)>,
}

impl Runs {
    /// The runs of points in Morton order.
    pub fn of(points: &[Vec3]) -> Self {
        let run = |p: &[Vec3]| {
            let column = |k: usize| std::array::from_fn(|i| p.get(i).map_or(f64::NAN, |p| p[k]));
            Run { x: column(0), y: column(1), z: column(2) }
        };
        let runs = points.chunks(RUN).map(run).collect();
        let boxes: Vec<Box> = points.chunks(RUN).map(Box::of).collect();
        let union = |b: &[Box]| b[1..].iter().fold(b[0], |all, b| all.with(b));
        let groups = boxes.chunks(GROUP).map(union).collect();
        Self { n: points.len(), runs, boxes, groups }
    }

    /// The places of the `K` nearest other points to point `i`, nearest first, and the squared distance to
    /// the fourth. `search` is kept from call to call: points of one run share it.
    ///
    /// Of equally near points those of lower place come first. Fewer than `K` other points leave `u32::MAX`.
    pub fn nearest(&self, i: usize, search: &mut Search) -> ([u32; K], f64) {
        nearest(self, i, search)
    }

    /// The points nearest to `p`, which comes `after` so many of them in their order. Of equally near ones those of
    /// lower place come first.
    pub fn closest(&self, p: &Vec3, after: usize) -> Closest {
        let mut found = Closest::none();
        let here = Box { low: *p, high: *p };
        let own = (after.min(self.n.saturating_sub(1)) / RUN) / GROUP;
        let others = (0..self.groups.len()).filter(|g| *g != own);
        for g in std::iter::once(own).chain(others) {
            if self.groups[g].sq_gap(&here) > found.limit() {
                continue;
            }
            for r in g * GROUP..self.boxes.len().min((g + 1) * GROUP) {
                if self.boxes[r].sq_gap(&here) > found.limit() {
                    continue;
                }
                let Run { x, y, z } = &self.runs[r];
                for k in 0..RUN.min(self.n - r * RUN) {
                    let (dx, dy, dz) = (x[k] - p.x, y[k] - p.y, z[k] - p.z);
                    let sq = dx * dx + dy * dy + dz * dz;
                    if sq <= found.limit() {
                        found.take(sq, (r * RUN + k) as u32);
                    }
                }
            }
        }
        found
    }

    fn point(&self, i: usize) -> Vec3 {
        let (run, k) = (&self.runs[i / RUN], i % RUN);
        Vec3::new(run.x[k], run.y[k], run.z[k])
    }

    /// Looks at all points of a run.
    #[inline(always)]
    fn look(&self, run: usize, i: usize, p: &Vec3, found: &mut Candidates) {
        let Run { x, y, z } = &self.runs[run];
        let mut sq = [0.0; RUN];
        for k in 0..RUN {
            let (dx, dy, dz) = (x[k] - p.x, y[k] - p.y, z[k] - p.z);
            sq[k] = dx * dx + dy * dy + dz * dz;
        }
        if found.len + RUN > ROOM {
            found.reduce();
        }
        let mut hits = 0_u32;
        for k in 0..RUN {
            hits |= u32::from(sq[k] <= found.limit) << k;
        }
        if i / RUN == run {
            hits &= !(1 << (i % RUN));
        }
        while hits != 0 {
            let k = hits.trailing_zeros() as usize;
            hits &= hits - 1;
            found.sq[found.len] = sq[k];
            found.place[found.len] = (run * RUN + k) as u32;
            found.len += 1;
        }
    }

    /// Finds the runs that may hold neighbours of any point of run `r`.
    #[inline(always)]
    fn prepare(&self, r: usize, search: &mut Search) {
        search.of = r + 1;
        search.near.clear();
        let own = &self.boxes[r];
        // The sixteenth neighbour of any point of the run is no further than that of its first point within
        // the run and the box's diagonal together.
        let first = self.point(r * RUN);
        let mut found = Candidates::within(f64::INFINITY);
        self.look(r, r * RUN, &first, &mut found);
        found.reduce();
        let reach = found.limit.sqrt() + (own.high - own.low).norm();
        let limit = reach * reach * (1.0 + 1e-9);
        for (g, group) in self.groups.iter().enumerate() {
            if group.sq_gap(own) > limit {
                continue;
            }
            let runs = g * GROUP..self.boxes.len().min((g + 1) * GROUP);
            for k in runs.filter(|k| *k != r) {
                let sq = self.boxes[k].sq_gap(own);
                if sq <= limit {
                    search.near.push((sq, k as u32));
                }
            }
        }
        search.near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn nearest(all: &Runs, i: usize, search: &mut Search) -> ([u32; K], f64) {
    debug_assert!(i < all.n);
    let r = i / RUN;
    if search.of != r + 1 {
        all.prepare(r, search);
    }
    let p = all.point(i);
    let here = Box { low: p, high: p };
    // The last point and its neighbours are near enough to begin with.
    let limit =
        search.last.map_or(f64::INFINITY, |(q, far)| ((p - q).norm() + far).powi(2) * (1.0 + 1e-9));
    let mut found = Candidates::within(limit);
    all.look(r, i, &p, &mut found);
    if found.limit.is_infinite() {
        found.reduce();
    }
    for &(gap, k) in &search.near {
        if gap > found.limit {
            break;
        }
        if all.boxes[k as usize].sq_gap(&here) <= found.limit {
            all.look(k as usize, i, &p, &mut found);
        }
    }
    found.reduce();
    search.last = Some((p, found.limit.sqrt()));
    let mut places = [u32::MAX; K];
    places[..found.len].copy_from_slice(&found.place[..found.len]);
    (places, found.sq[3])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::Silent;
    use crate::segment::prepare::morton::morton_order;
    use crate::segment::random::SplitMix64;

    /// The same by comparing with every point.
    fn slow(points: &[Vec3], i: usize) -> ([u32; K], f64) {
        let sq = |j: &u32| (points[*j as usize] - points[i]).norm_squared();
        let mut all: Vec<u32> = (0..points.len() as u32).filter(|j| *j as usize != i).collect();
        all.sort_by(|a, b| sq(a).total_cmp(&sq(b)).then(a.cmp(b)));
        let places = std::array::from_fn(|k| all.get(k).copied().unwrap_or(u32::MAX));
        (places, all.get(3).map_or(f64::INFINITY, sq))
    }

    fn check(points: Vec<Vec3>) {
        let points: Vec<Vec3> = morton_order(&points, &Silent)
            .unwrap()
            .into_iter()
            .map(|i| points[i as usize])
            .collect();
        let runs = Runs::of(&points);
        let (mut search, mut back) = (Search::default(), Search::default());
        for i in 0..points.len() {
            let expected = slow(&points, i);
            assert_eq!(runs.nearest(i, &mut search), expected, "{i}");
            let j = points.len() - 1 - i;
            assert_eq!(runs.nearest(j, &mut back).0, slow(&points, j).0, "{j}");
        }
    }

    #[test]
    fn they_are_those_of_all_pairs() {
        let mut random = SplitMix64::new(9);
        let mut u = || random.below(1 << 30) as f64 / f64::from(1 << 30);
        check((0..900).map(|_| Vec3::new(u(), u(), 0.1 * u())).collect());
        // Crowded in one place and sparse elsewhere, with far strays.
        let crowded = |v: f64| v.powi(6);
        check((0..700).map(|_| Vec3::new(crowded(u()), crowded(u()), 0.0)).collect());
        let strays: Vec<Vec3> =
            (0..40).map(|_| Vec3::new(1e4 * u(), 1e4 * u(), 1e4 * u())).collect();
        check((0..500).map(|_| Vec3::new(u(), u(), u())).chain(strays).collect());
    }

    #[test]
    fn of_equally_near_points_those_of_lower_place_come_first() {
        let at = |k: usize| Vec3::new((k % 10) as f64, (k / 10 % 10) as f64, (k / 100) as f64);
        check((0..600).map(at).collect());
        check((0..300).map(|k| at(k % 7)).collect());
    }

    #[test]
    fn few_points_have_few_neighbours() {
        for n in [1, 2, 5, 16, 17, 18, 33] {
            check((0..n).map(|k| Vec3::new(f64::from(k * k), 0.0, 1.0)).collect());
        }
    }
}
