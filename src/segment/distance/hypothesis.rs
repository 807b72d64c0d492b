//! Growing one hypothesis from a seed: start set, fits at doubling sizes, support.

use super::family::{Families, Scored};
use super::scene::Scene;
use crate::fit::starts::Patch;
use crate::fit::{Ruler, Shape};
use crate::geometry::Vec3;

/// Points a fit during growth looks at.
const FIT_SAMPLE: usize = 400;
/// Points that a fit looks at where growth ends although residuals are correlated, and how often it may.
const THOROUGH_SAMPLE: usize = 1200;
const THOROUGH: usize = 3;
/// Support reaches this many sigmas from the surface.
const REACH: f64 = 3.0;

/// A surface grown from one seed and the connected points near it.
#[derive(Clone, Debug)]
pub struct Hypothesis {
    /// The surface.
    pub shape: Shape,
    /// Connected points within three sigmas, in order of discovery.
    pub support: Vec<u32>,
    /// How far its residuals are from independent noise, see [`correlation`].
    pub correlation: f64,
    /// Whether it may be a surface: its residuals are not correlated beyond chance, or it is the same
    /// wherever growth starts. Others compete for points only.
    pub sound: bool,
}

/// Correlation times the root of the number of points that chance seldom exceeds.
const CHANCE: f64 = 1.5;

/// Whether a correlation of residuals is more than chance gives for `n` points.
pub fn correlated(correlation: f64, n: usize) -> bool {
    correlation > 0.15 + CHANCE / (n.max(1) as f64).sqrt()
}

/// Semi-axes further apart than this many times are those of no ellipse.
const PARABOLIC: f64 = 25.0;

/// Whether an elliptic shape is so long that it is a parabola where its points lie: what growth makes of an edge
/// with both its faces, or of a fillet beside its own.
pub fn is_parabolic(shape: &Shape) -> bool {
    shape.elongation() > PARABOLIC
}

/// The mean product of neighbouring residuals over their mean square, on a sample of `support`: near 0
/// for a surface that explains its points, towards 1 where a form error is left. 0 where residuals
/// are far below `sigma`, so that rounding does not count as form.
///
/// Only neighbours that are `inside` the support count: those beyond a joint lie on one side.
pub fn correlation(
    scene: &Scene,
    shape: &Shape,
    support: &[u32],
    sigma: f64,
    inside: impl Fn(u32) -> bool,
) -> f64 {
    let ruler = Ruler::of(shape);
    let m = support.len().min(600);
    // Strips of other faces that lie within reach along an edge say nothing about this one: its
    // interior does, where it has one.
    let (mut all, mut interior) = (Products::default(), Products::default());
    for k in 0..m {
        let i = support[k * support.len() / m] as usize;
        let r = ruler.distance(&scene.points[i]);
        let around = &scene.neighbours(i)[..AROUND];
        let (mut sum, mut near) = (0.0, 0);
        for &j in around {
            if inside(j) {
                sum += ruler.distance(&scene.points[j as usize]);
                near += 1;
            }
        }
        let sq_reach = (scene.points[around[AROUND - 1] as usize] - scene.points[i]).norm_squared();
        if near > 0 {
            all.add(r, sum / near as f64, sq_reach);
        }
        if near == AROUND {
            interior.add(r, sum / near as f64, sq_reach);
        }
    }
    if interior.count * 4 > all.count { interior } else { all }.correlation(sigma)
}

/// Neighbours whose residuals are compared with a point's.
const AROUND: usize = 6;

/// Sums of products of residuals.
#[derive(Clone, Copy, Default)]
struct Products {
    product: f64,
    square: f64,
    /// Inverse squares of the neighbourhoods' radii.
    inverse_sq: f64,
    count: u32,
}

impl Products {
    fn add(&mut self, r: f64, around: f64, sq_reach: f64) {
        self.product += r * around;
        self.square += r * r;
        self.inverse_sq += 1.0 / sq_reach.max(f64::MIN_POSITIVE);
        self.count += 1;
    }

    /// What of the products is not due to how neighbours are chosen.
    ///
    /// Of points whose noise comes to a good part of their spacing the nearest are those with like residuals: a
    /// point at height z over the surface finds those at z' within a circle of area pi (R2 - (z - z')2), so
    /// E[z' | z] = 2 z s2 / R2 to first order in s2 / R2.
    fn correlation(&self, sigma: f64) -> f64 {
        let count = f64::from(self.count.max(1));
        let mean_sq = self.square / count;
        if mean_sq.sqrt() < 0.3 * sigma {
            return 0.0;
        }
        let chosen = 2.0 * mean_sq * self.inverse_sq / count;
        // Written so that points all but on top of each other give 1.
        self.product / self.square - 1.0 / (1.0 + 1.0 / chosen)
    }
}

/// Scratch memory for walks over the graph, reused between them.
pub struct Walk {
    /// `now` where the last walk entered a point, one less where it did not let it in.
    stamp: Vec<u32>,
    now: u32,
    queue: Vec<u32>,
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
        Self { stamp: vec![0; n], now: 0, queue: Vec::new(), beside: Beside::default() }
    }

    /// Whether the last walk entered point `i`.
    pub fn contains(&self, i: u32) -> bool {
        self.stamp[i as usize] == self.now
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
        &self.queue
    }

    /// [`run`](Self::run) over points nearer than `reach` to a surface, many of them measured at once.
    pub fn near(
        &mut self,
        scene: &Scene,
        from: &[u32],
        limit: usize,
        ruler: &Ruler,
        reach: f64,
    ) -> &[u32] {
        self.begin();
        self.look(scene, from.iter().copied());
        self.beside.ends.push(self.beside.places.len());
        self.enter(usize::MAX, ruler, reach);
        let mut head = 0;
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

/// Collects every `step`-th of `support` as points and normals, at most about `limit`.
fn sample(
    scene: &Scene,
    support: &[u32],
    limit: usize,
    points: &mut Vec<Vec3>,
    normals: &mut Vec<Vec3>,
) {
    points.clear();
    normals.clear();
    let m = support.len().min(limit);
    for k in 0..m {
        let i = support[k * support.len() / m] as usize;
        points.push(scene.points[i]);
        normals.push(scene.normals[i]);
    }
}

/// Which connected points a start set takes.
#[derive(Clone, Copy)]
enum Start {
    /// Those whose chords lie in the tangent planes.
    Tangent,
    /// Those near the seed's own tangent plane: of narrow strips side by side, whose other normals are
    /// those of both together, one.
    Flat,
    /// Any: strips a point or two wide have no tangent planes.
    Any,
}

/// The start set of a seed at noise `sigma`.
fn start_set(
    scene: &Scene,
    walk: &mut Walk,
    seed: usize,
    start: Start,
    size: usize,
    sigma: f64,
) -> Vec<u32> {
    let slack = 3.0 * sigma;
    let set = walk.run(scene, &[seed as u32], size, |from, to| {
        let Some(from) = from else { return true };
        let d = scene.points[to] - scene.points[from];
        match start {
            Start::Tangent => {
                let length = d.norm();
                scene.normals[from].dot(&d).abs() < 0.3 * length + slack
                    && scene.normals[to].dot(&d).abs() < 0.3 * length + slack
                    && (scene.normals[from].dot(&scene.normals[to]).abs() > 0.7
                        || length < 4.0 * sigma)
            }
            Start::Flat => {
                let d = scene.points[to] - scene.points[seed];
                scene.normals[seed].dot(&d).abs() < slack
            }
            Start::Any => true,
        }
    });
    set[..set.len().min(size)].to_vec()
}

/// Start sets, tried in turn at each seed, with the most and the least points of each: a large one sees curvature
/// through the noise, a small one fits into a small face or beside a joint.
const STARTS: [(Start, usize, usize); 5] = [
    (Start::Tangent, 160, 24),
    (Start::Tangent, 60, 24),
    (Start::Tangent, 30, 24),
    (Start::Any, 30, 24),
    (Start::Flat, 24, 12),
];

/// Grows a hypothesis from `seed`; `None` where nothing fits from any start size, or where what fits
/// does not reach `min_points`.
pub fn grow(
    scene: &Scene,
    walk: &mut Walk,
    families: &Families,
    seed: usize,
    min_points: usize,
) -> Option<Hypothesis> {
    let mut starts = STARTS.iter().filter(|s| families.strips || !matches!(s.0, Start::Flat));
    starts.find_map(|&(start, most, least)| {
        let set = start_set(scene, walk, seed, start, most, families.sigma);
        if set.len() < least.min(min_points) || scene.cancelled() {
            return None;
        }
        let grown = grow_from(scene, walk, families, set, min_points);
        grown.filter(|h| h.support.len() >= min_points)
    })
}

fn grow_from(
    scene: &Scene,
    walk: &mut Walk,
    families: &Families,
    start: Vec<u32>,
    min_points: usize,
) -> Option<Hypothesis> {
    let sigma = families.sigma;
    let (mut points, mut normals) = (Vec::new(), Vec::new());
    let mut support = start;
    sample(scene, &support, FIT_SAMPLE, &mut points, &mut normals);
    let mut hopeless = Vec::new();
    let patch = Patch { points: &points, normals: &normals };
    let mut best: Scored = families.best(&patch, &[], &mut hopeless)?;
    if best.reduced > 2.0 {
        return None;
    }
    let mut good: Option<(Shape, Vec<u32>)> = None;
    let mut fresh = true;
    let mut thorough = THOROUGH;
    for _ in 0..40 {
        if scene.cancelled() {
            return None;
        }
        let shape = best.shape;
        let ruler = Ruler::of(&shape);
        let limit = (support.len() * 2).max(40);
        let next = walk.near(scene, &support, limit, &ruler, REACH * sigma).to_vec();
        if next.len() < min_points.min(20) {
            break;
        }
        let stalled = next.len() * 20 < support.len() * 21;
        if stalled && fresh {
            support = next;
            // A fit caught halfway along its valley looks like this: small residuals that go together.
            let among = |j| walk.contains(j);
            let left = correlation(scene, &shape, &support, sigma, among);
            if thorough == 0 || left < 0.08 + CHANCE / (support.len() as f64).sqrt() {
                break;
            }
            thorough -= 1;
            sample(scene, &support, THOROUGH_SAMPLE, &mut points, &mut normals);
            let patch = Patch { points: &points, normals: &normals };
            let Some(found) = families.thorough(&patch, &shape, &hopeless) else { break };
            best = found;
            continue;
        }
        support = next;
        sample(scene, &support, FIT_SAMPLE, &mut points, &mut normals);
        let patch = Patch { points: &points, normals: &normals };
        let warm = families
            .polish(&shape, &points, 12)
            .map(|f| families.score(f.shape, &points))
            .filter(|s| !families.degenerate(&s.shape));
        match warm {
            Some(w) if !stalled && families.explains(&w, points.len()) => {
                best = w;
                fresh = false;
            }
            _ => {
                let start = warm.map_or(shape, |w| w.shape);
                if stalled {
                    hopeless.clear();
                }
                let Some(next) = families.best(&patch, &[start], &mut hopeless) else { break };
                best = next;
                fresh = true;
            }
        }
        if best.reduced < 1.35 {
            good = Some((best.shape, support.clone()));
        } else if best.reduced > 2.0 {
            break;
        }
    }
    let shape = best.shape;
    let ruler = Ruler::of(&shape);
    if best.reduced < 1.35 {
        let support = walk.near(scene, &support, usize::MAX, &ruler, REACH * sigma).to_vec();
        good = Some((shape, support));
    }
    good.map(|(shape, support)| {
        walk.run(scene, &support, support.len(), |from, _| from.is_none());
        let correlation = correlation(scene, &shape, &support, sigma, |j| walk.contains(j));
        let sound = !correlated(correlation, support.len()) && !is_parabolic(&shape);
        Hypothesis { shape, support, correlation, sound }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Family;
    use crate::fit::fits::Random;
    use crate::segment::random::SplitMix64;

    #[test]
    fn noise_of_a_thick_sheet_is_not_correlated_and_a_wave_is() {
        let mut random = Random::new(8);
        let plane = Shape::with_axis(Family::Plane, Vec3::zeros(), Vec3::z(), [0.0; 3]);
        let (n, side) = (4000, 63.0);
        for sigma in [0.05, 0.3, 0.6] {
            let mut points = |wave: f64| -> Vec<Vec3> {
                let mut at = |_| {
                    let (x, y) = (random.uniform(0.0, side), random.uniform(0.0, side));
                    Vec3::new(x, y, sigma * random.normal() + wave * sigma * (x / 6.0).sin())
                };
                (0..n).map(&mut at).collect()
            };
            let mut measured = |wave| {
                let scene = Scene::new(points(wave));
                let all: Vec<u32> = (0..n as u32).collect();
                correlation(&scene, &plane, &all, sigma, |_| true)
            };
            assert!(measured(0.0).abs() < 0.06, "{sigma}: {}", measured(0.0));
            assert!(measured(1.0) > 0.15, "{sigma}: {}", measured(1.0));
        }
    }

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
            assert_eq!(walk.near(&scene, &from, limit, &ruler, reach), one_by_one);
            assert!((0..3000).all(|i| walk.contains(i) == inside[i as usize]));
            assert_eq!(inside.iter().filter(|b| **b).count(), one_by_one.len());
            from = one_by_one;
        }
        assert!(from.len() > 1000 && from.len() < 2000, "{}", from.len());
    }
}
