//! The nearest neighbours of points in Morton order.
//!
//! Runs of the order are compact, so runs of 32 points with their bounding boxes take the place of a tree's
//! leaves. For all points of a run the boxes that may hold neighbours are looked up once; each point then looks
//! into those that are nearer than the neighbours it has, 32 points at a time.

#![expect(clippy::needless_range_loop, reason = "lanes read best by index")]

use multiversion::multiversion;

use crate::geometry::Vec3;
use crate::segment::prepare::boxes::{Box, LANES, Lanes};
use crate::segment::prepare::candidates::{Candidates, K, ROOM};
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
    lanes: Vec<Lanes>,
    groups: Vec<Lanes>,
}

/// The coordinates of a run. The last run is filled up with NaN, which is near nothing.
struct Run {
    x: [f64; RUN],
    y: [f64; RUN],
    z: [f64; RUN],
}

/// Runs that may hold neighbours of the points of one run, those with the nearest boxes first.
#[derive(Default)]
pub struct Search {
    /// The run, and one more than it, so that 0 is none.
    of: usize,
    near: Vec<(f64, u32)>,
    /// Their boxes.
    lanes: Vec<Lanes>,
    /// Squared diagonal of the run's box.
    sq_size: f64,
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
        let groups: Vec<Box> = boxes.chunks(GROUP).map(union).collect();
        let side_by_side = |b: &[Box]| b.chunks(LANES).map(Lanes::of).collect();
        let (lanes, groups) = (side_by_side(&boxes), side_by_side(&groups));
        Self { n: points.len(), runs, boxes, lanes, groups }
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
        self.look_into(own, &here, &mut found);
        for (first, lanes) in self.groups.iter().enumerate() {
            for (g, gap) in (first * LANES..).zip(lanes.sq_gaps(&here)) {
                if g != own && gap <= found.limit() {
                    self.look_into(g, &here, &mut found);
                }
            }
        }
        found
    }

    /// Looks at the runs of a group that may be near enough.
    fn look_into(&self, group: usize, here: &Box, found: &mut Closest) {
        let lanes = group * GROUP / LANES..self.lanes.len().min((group + 1) * GROUP / LANES);
        for lane in lanes {
            for (run, gap) in (lane * LANES..self.runs.len()).zip(self.lanes[lane].sq_gaps(here)) {
                if gap > found.limit() {
                    continue;
                }
                for (k, sq) in self.sq_distances(run, &here.low).into_iter().enumerate() {
                    // not the NaN of a point that is missing
                    if sq <= found.limit() {
                        found.take(sq, (run * RUN + k) as u32);
                    }
                }
            }
        }
    }

    fn point(&self, i: usize) -> Vec3 {
        let (run, k) = (&self.runs[i / RUN], i % RUN);
        Vec3::new(run.x[k], run.y[k], run.z[k])
    }

    /// Squared distances of all points of a run.
    #[inline(always)]
    fn sq_distances(&self, run: usize, p: &Vec3) -> [f64; RUN] {
        let Run { x, y, z } = &self.runs[run];
        let mut sq = [0.0; RUN];
        for k in 0..RUN {
            let (dx, dy, dz) = (x[k] - p.x, y[k] - p.y, z[k] - p.z);
            sq[k] = dx * dx + dy * dy + dz * dz;
        }
        sq
    }

    /// Looks at all points of another run than the point's own.
    #[inline(always)]
    fn look(&self, run: usize, p: &Vec3, found: &mut Candidates) {
        let sq = self.sq_distances(run, p);
        if found.len + RUN > ROOM {
            found.reduce();
        }
        let mut hits = 0_u32;
        for k in 0..RUN {
            hits |= u32::from(sq[k] <= found.limit) << k;
        }
        while hits != 0 {
            let k = hits.trailing_zeros() as usize;
            hits &= hits - 1;
            found.sq[found.len] = sq[k];
            found.place[found.len] = (run * RUN + k) as u32;
            found.len += 1;
        }
    }

    /// Takes all other points of point `i`'s own run.
    #[inline(always)]
    fn look_around(&self, i: usize, p: &Vec3, found: &mut Candidates) {
        let (run, own) = (i / RUN, i % RUN);
        let sq = self.sq_distances(run, p);
        found.sq[..RUN].copy_from_slice(&sq);
        for k in 0..RUN {
            found.place[k] = (run * RUN + k) as u32;
        }
        // The last point takes its place.
        let last = RUN.min(self.n - run * RUN) - 1;
        (found.sq[own], found.place[own]) = (found.sq[last], found.place[last]);
        found.len = last;
    }

    /// Finds the runs that may hold neighbours of any point of run `r`.
    #[inline(always)]
    fn prepare(&self, r: usize, search: &mut Search) {
        search.of = r + 1;
        search.near.clear();
        let own = &self.boxes[r];
        search.sq_size = (own.high - own.low).norm_squared();
        // As many points as are asked for are no further than the box's diagonal, if the run has more than that.
        let full = self.n - r * RUN > K;
        let limit = if full { search.sq_size * (1.0 + 1e-9) } else { f64::INFINITY };
        for (g, groups) in self.groups.iter().enumerate() {
            let gaps = groups.sq_gaps(own);
            if gaps.iter().all(|gap| *gap > limit) {
                continue;
            }
            for (l, _) in gaps.iter().enumerate().filter(|(_, gap)| **gap <= limit) {
                let from = (g * LANES + l) * GROUP;
                for k in (from..self.boxes.len().min(from + GROUP)).step_by(LANES) {
                    let gaps = self.lanes[k / LANES].sq_gaps(own);
                    for (l, gap) in gaps.into_iter().enumerate() {
                        if gap <= limit && k + l != r && k + l < self.boxes.len() {
                            search.near.push((gap, (k + l) as u32));
                        }
                    }
                }
            }
        }
        search.near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        search.lanes.clear();
        for near in search.near.chunks(LANES) {
            let mut few = [*own; LANES];
            near.iter().zip(&mut few).for_each(|(n, b)| *b = self.boxes[n.1 as usize]);
            search.lanes.push(Lanes::of(&few[..near.len()]));
        }
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
    let mut found = Candidates::within(limit, search.sq_size);
    all.look_around(i, &p, &mut found);
    found.reduce();
    for (near, lanes) in search.near.chunks(LANES).zip(&search.lanes) {
        if near[0].0 > found.limit {
            break;
        }
        let gaps = lanes.sq_gaps(&here);
        for (&(_, k), gap) in near.iter().zip(gaps) {
            if gap <= found.limit {
                all.look(k as usize, &p, &mut found);
            }
        }
    }
    // In a run of few points what was added may be all there is.
    if found.len > K || all.n - r * RUN <= K {
        found.reduce();
    }
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
