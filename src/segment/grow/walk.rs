//! Walks over the graph of neighbours.

use crate::fit::Ruler;
use crate::geometry::Vec3;
use crate::segment::prepare::scene::Scene;

/// Scratch memory for walks over the graph, reused between them.
pub struct Walk {
    /// `now` where the last walk entered a point, one less where it did not let it in.
    stamp: Vec<u32>,
    now: u32,
    queue: Vec<u32>,
    /// Points of the last walk whose neighbours it looked at: the first ones.
    expanded: usize,
    /// Points that all walks visited.
    visited: u64,
    beside: Beside,
}

/// Points beside those of a walk, to be measured at once.
#[derive(Default)]
struct Beside {
    places: Vec<u32>,
    points: Vec<Vec3>,
    distances: Vec<f64>,
    /// How many there are up to each point of the walk.
    ends: Vec<usize>,
}

/// Points of a walk whose neighbours are measured at once.
const STRIDE: usize = 32;

impl Walk {
    /// Scratch for a scene of `n` points.
    pub fn new(n: usize) -> Self {
        Self {
            stamp: vec![0; n],
            now: 0,
            queue: Vec::new(),
            expanded: 0,
            visited: 0,
            beside: Beside::default(),
        }
    }

    /// Whether the last walk entered point `i`.
    pub fn contains(&self, i: u32) -> bool {
        self.stamp[i as usize] == self.now
    }

    /// How many points, the first of the last walk, it looked at the neighbours of.
    pub fn expanded(&self) -> usize {
        self.expanded
    }

    /// How many points were visited since this was last asked.
    pub fn take_visited(&mut self) -> u64 {
        std::mem::take(&mut self.visited)
    }

    /// Breadth-first walk from `from`, entering the points that `enter(from, to)` lets in, up to
    /// `limit` points.
    pub fn run(
        &mut self,
        scene: &Scene,
        from: &[u32],
        limit: usize,
        mut enter: impl FnMut(Option<usize>, usize) -> bool,
    ) -> &[u32] {
        self.begin();
        for &i in from {
            if self.stamp[i as usize] != self.now && enter(None, i as usize) {
                self.stamp[i as usize] = self.now;
                self.queue.push(i);
            }
        }
        let mut head = 0;
        while head < self.queue.len() && self.queue.len() < limit {
            let i = self.queue[head] as usize;
            head += 1;
            for &j in scene.neighbours(i) {
                if self.stamp[j as usize] != self.now && enter(Some(i), j as usize) {
                    self.stamp[j as usize] = self.now;
                    self.queue.push(j);
                }
            }
        }
        self.ended(head)
    }

    /// [`run`](Self::run) over points nearer than `reach` to a surface, many of them measured at once. The
    /// neighbours of the first `expanded` of `from` are not looked at again.
    pub fn near(
        &mut self,
        scene: &Scene,
        (from, expanded): (&[u32], usize),
        limit: usize,
        ruler: &Ruler,
        reach: f64,
    ) -> &[u32] {
        self.begin();
        let mut head = 0;
        for (k, part) in [&from[..expanded], &from[expanded..]].into_iter().enumerate() {
            self.look(scene, part.iter().copied());
            self.beside.ends.push(self.beside.places.len());
            self.enter(usize::MAX, ruler, reach);
            head = if k == 0 { self.queue.len() } else { head };
        }
        while head < self.queue.len() && self.queue.len() < limit {
            let tail = self.queue.len().min(head + STRIDE);
            for k in head..tail {
                let i = self.queue[k] as usize;
                self.look(scene, scene.neighbours(i).iter().copied());
                self.beside.ends.push(self.beside.places.len());
            }
            self.enter(limit, ruler, reach);
            head = tail;
        }
        self.ended(head)
    }

    /// The points of a walk that looked at the neighbours of the first `expanded`.
    fn ended(&mut self, expanded: usize) -> &[u32] {
        self.expanded = expanded;
        self.visited += self.queue.len() as u64;
        &self.queue
    }

    fn begin(&mut self) {
        self.now += 2;
        self.queue.clear();
    }

    /// Puts down those of some points that the walk has not met.
    fn look(&mut self, scene: &Scene, some: impl Iterator<Item = u32>) {
        for i in some {
            let stamp = &mut self.stamp[i as usize];
            if *stamp + 1 < self.now {
                *stamp = self.now - 1;
                self.beside.places.push(i);
                self.beside.points.push(scene.points[i as usize]);
            }
        }
    }

    /// Enters those of the points put down that are near the surface, up to `limit` points.
    fn enter(&mut self, limit: usize, ruler: &Ruler, reach: f64) {
        let Beside { places, points, distances, ends } = &mut self.beside;
        distances.resize(points.len(), 0.0);
        ruler.distances(points, distances);
        let mut from = 0;
        for &end in &*ends {
            if self.queue.len() >= limit {
                break;
            }
            for k in from..end {
                if distances[k].abs() < reach {
                    self.stamp[places[k] as usize] = self.now;
                    self.queue.push(places[k]);
                }
            }
            from = end;
        }
        places.clear();
        points.clear();
        ends.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::{Family, Shape};
    use crate::segment::random::SplitMix64;

    #[test]
    fn a_walk_that_measures_many_points_at_once_goes_the_same_way() {
        let mut random = SplitMix64::new(3);
        let mut side = || random.below(1000) as f64 / 100.0;
        let points: Vec<Vec3> = (0..3000).map(|_| Vec3::new(side(), side(), 0.0)).collect();
        let lifted = |p: &Vec3| Vec3::new(p.x, p.y, 0.02 * p.x * p.x);
        let scene = Scene::new(points.iter().map(lifted).collect());
        let shape = Shape::with_axis(Family::Plane, Vec3::zeros(), Vec3::z(), [0.0; 3]);
        let (ruler, reach) = (Ruler::of(&shape), 0.5);
        let mut walk = Walk::new(scene.len());
        let middle = (0..scene.len() as u32).find(|&i| scene.points[i as usize].x < 1.0);
        let mut from = vec![middle.unwrap_or(0)];
        for limit in [1, 10, 100, 101, 700, usize::MAX] {
            let near = |_: Option<usize>, j: usize| ruler.distance(&scene.points[j]).abs() < reach;
            let one_by_one = walk.run(&scene, &from, limit, near).to_vec();
            let inside: Vec<bool> = (0..3000).map(|i| walk.contains(i)).collect();
            assert_eq!(walk.near(&scene, (&from, 0), limit, &ruler, reach), one_by_one);
            assert!((0..3000).all(|i| walk.contains(i) == inside[i as usize]));
            assert_eq!(inside.iter().filter(|b| **b).count(), one_by_one.len());
            from = one_by_one;
        }
        assert!(from.len() > 1000 && from.len() < 2000, "{}", from.len());
        // One that goes on where another stopped comes to the same points.
        let mut some = walk.near(&scene, (&from[..1], 0), 300, &ruler, reach).to_vec();
        let expanded = walk.expanded();
        assert!((1..some.len()).contains(&expanded), "{expanded}");
        let mut whole = walk.near(&scene, (&some, expanded), usize::MAX, &ruler, reach).to_vec();
        assert_eq!(walk.expanded(), whole.len());
        assert_eq!(&whole[..some.len()], &some[..]);
        some.clone_from(&from);
        some.sort_unstable();
        whole.sort_unstable();
        assert_eq!(whole, some);
    }
}
