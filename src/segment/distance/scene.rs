//! The points a discovery works on, with their neighbours, normals and noise.

use nalgebra::SymmetricEigen;
use rayon::prelude::*;

pub use super::nearest::K;
use super::nearest::{Runs, Search};
use crate::geometry::{Mat3, Vec3};
use crate::segment::{Cancelled, Monitor};

/// Points worked on at once; fixed, so that the result does not depend on the number of threads.
const CHUNK: usize = 512;

/// Distinct points in Morton order with the graph of their nearest neighbours.
pub struct Scene<'a> {
    /// The points, relative to the cloud's centre.
    pub points: Vec<Vec3>,
    /// A unit normal of each point's neighbourhood; its sign means nothing.
    pub normals: Vec<Vec3>,
    /// How rough each neighbourhood is: the smallest eigenvalue's share of the scatter.
    pub roughness: Vec<f32>,
    /// `K` neighbours of each point, nearest first.
    neighbours: Vec<u32>,
    /// Median distance to the fourth neighbour.
    pub spacing: f64,
    /// Who may cancel the work on it.
    monitor: &'a dyn Monitor,
}

impl<'a> Scene<'a> {
    /// The scene that nobody cancels.
    #[cfg(test)]
    pub fn new(points: Vec<Vec3>) -> Self {
        Self::built(points, &crate::segment::Silent)
    }

    /// Builds the graph and the normals of points in Morton order. At least one point.
    ///
    /// # Errors
    /// `monitor` cancelled the work.
    pub fn watched(points: Vec<Vec3>, monitor: &'a dyn Monitor) -> Result<Self, Cancelled> {
        let scene = Self::built(points, monitor);
        monitor.check().map(|()| scene)
    }

    /// The scene; half of one where `monitor` cancels meanwhile.
    fn built(points: Vec<Vec3>, monitor: &'a dyn Monitor) -> Self {
        let n = points.len();
        let mut neighbours = vec![0u32; n * K];
        let mut normals = vec![Vec3::z(); n];
        let mut roughness = vec![0f32; n];
        let mut fourth = vec![0f64; n];
        let runs = Runs::of(&points);
        neighbours
            .par_chunks_mut(K * CHUNK)
            .zip(normals.par_chunks_mut(CHUNK))
            .zip(roughness.par_chunks_mut(CHUNK))
            .zip(fourth.par_chunks_mut(CHUNK))
            .enumerate()
            .for_each(|(c, (((neighbours, normals), roughness), fourth))| {
                if monitor.cancelled() {
                    return;
                }
                let mut search = Search::default();
                for (k, out) in neighbours.chunks_mut(K).enumerate() {
                    let i = c * CHUNK + k;
                    let (near, sq) = runs.nearest(i, &mut search);
                    // Where there are too few points, a point stands for its missing neighbours.
                    for (out, j) in out.iter_mut().zip(near) {
                        *out = if j == u32::MAX { i as u32 } else { j };
                    }
                    fourth[k] = if sq.is_finite() { sq.sqrt() } else { 0.0 };
                    (normals[k], roughness[k]) = normal_of(&points, i, out);
                }
            });
        let mid = n / 2;
        let spacing = *fourth.select_nth_unstable_by(mid, f64::total_cmp).1;
        Self { points, normals, roughness, neighbours, spacing, monitor }
    }

    /// The scene of some other points, watched by the same monitor; half of one where it cancels.
    pub fn part(&self, points: Vec<Vec3>) -> Self {
        Self::built(points, self.monitor)
    }

    /// Whether the work on the scene is to stop. Loops over points, regions or pairs of them ask it every few
    /// milliseconds and then leave off: what they return is worth nothing, and whoever has the monitor asks next.
    #[inline]
    pub fn cancelled(&self) -> bool {
        self.monitor.cancelled()
    }

    /// Replaces normals of rough neighbourhoods (edges, thin walls), where a plane through the point and two
    /// neighbours holds at least seven neighbours within three sigmas, by that plane's.
    pub fn sharpen_normals(&mut self, sigma: f64) {
        let sq_limit = 9.0 * sigma * sigma;
        let next: Vec<(Vec3, f32)> = (0..self.len())
            .into_par_iter()
            .with_min_len(256)
            .map(|i| {
                let old = (self.normals[i], self.roughness[i]);
                if i % CHUNK == 0 && self.cancelled() {
                    return old;
                }
                let p = self.points[i];
                let mut q = [Vec3::zeros(); K];
                let mut sum = 0.0;
                for (q, &j) in q.iter_mut().zip(self.neighbours(i)) {
                    *q = self.points[j as usize] - p;
                    sum += q.norm_squared();
                }
                if f64::from(old.1) * sum < 4.0 * sq_limit {
                    return old;
                }
                if self.has_even_chords(i, &q, sq_limit) {
                    return old;
                }
                consensus_normal(&q, 3.0 * sigma).map_or(old, |v| (v, 0.0))
            })
            .collect();
        for (i, (v, r)) in next.into_iter().enumerate() {
            self.normals[i] = v;
            self.roughness[i] = r;
        }
    }

    /// Whether a neighbourhood is smooth, curved as it may be: on a quadratic surface the chord to each neighbour,
    /// here `q`, is at right angles to the mean of both normals.
    fn has_even_chords(&self, i: usize, q: &[Vec3; K], sq_limit: f64) -> bool {
        let normal = self.normals[i];
        let mut sum = 0.0;
        for (q, &j) in q.iter().zip(self.neighbours(i)) {
            let other = self.normals[j as usize];
            let mean = 0.5 * (normal + other * normal.dot(&other).signum());
            sum += mean.dot(q).powi(2);
        }
        sum < K as f64 * sq_limit
    }

    /// The neighbours of point `i`, nearest first.
    #[inline]
    pub fn neighbours(&self, i: usize) -> &[u32] {
        &self.neighbours[i * K..(i + 1) * K]
    }

    /// Median roughness of the neighbourhoods of some points, at least one.
    pub fn median_roughness(&self, points: impl Iterator<Item = u32>) -> f32 {
        let mut rough: Vec<f32> = points.map(|i| self.roughness[i as usize]).collect();
        let mid = rough.len() / 2;
        *rough.select_nth_unstable_by(mid, f32::total_cmp).1
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }
}

/// Normal and roughness of a neighbourhood, from the scatter of its points.
fn normal_of(points: &[Vec3], i: usize, neighbours: &[u32]) -> (Vec3, f32) {
    let mut sum = Vec3::zeros();
    let [mut xx, mut xy, mut xz, mut yy, mut yz, mut zz] = [0.0; 6];
    for &j in neighbours {
        let d = points[j as usize] - points[i];
        sum += d;
        xx += d.x * d.x;
        xy += d.x * d.y;
        xz += d.x * d.z;
        yy += d.y * d.y;
        yz += d.y * d.z;
        zz += d.z * d.z;
    }
    let scatter = Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
        - sum * sum.transpose() / (neighbours.len() as f64 + 1.0);
    let total = scatter.trace().max(1e-300);
    let (share, normal) = least_direction(&(scatter / total));
    (normal, share.max(0.0) as f32)
}

/// Steps of Newton's method for the least eigenvalue: it is far from the others wherever a normal means
/// anything, and found in three or four.
const NEWTON: usize = 12;
/// Product of the differences between eigenvalues below which cross products are mostly rounding.
const NEARLY_EQUAL: f64 = 1e-9;

/// Least eigenvalue and its direction for a positive semidefinite matrix of trace 1.
///
/// Newton's method on the characteristic polynomial comes from zero, left of all roots, and never passes the
/// first. The direction is the cross product of two rows of what is left, those most at right angles.
fn least_direction(m: &Mat3) -> (f64, Vec3) {
    let minors = (m[(0, 0)] * m[(1, 1)] - m[(0, 1)] * m[(0, 1)])
        + (m[(0, 0)] * m[(2, 2)] - m[(0, 2)] * m[(0, 2)])
        + (m[(1, 1)] * m[(2, 2)] - m[(1, 2)] * m[(1, 2)]);
    let (trace, det) = (m.trace(), m.determinant());
    let mut least = 0.0;
    for _ in 0..NEWTON {
        let value = det - least * (minors - least * (trace - least));
        let slope = minors - least * (2.0 * trace - 3.0 * least);
        let step = value / slope;
        // not finite where three eigenvalues are nought
        if step.is_nan() || step.abs() <= 1e-16 {
            break;
        }
        least += step;
    }
    let row = |k: usize| {
        let mut row = m.column(k).into_owned();
        row[k] -= least;
        row
    };
    let (a, b, c) = (row(0), row(1), row(2));
    let mut best = (0.0, Vec3::zeros());
    for normal in [a.cross(&b), b.cross(&c), c.cross(&a)] {
        let sq = normal.norm_squared();
        if sq > best.0 {
            best = (sq, normal);
        }
    }
    if best.0 < NEARLY_EQUAL * NEARLY_EQUAL {
        let e = SymmetricEigen::new(*m);
        let k = e.eigenvalues.imin();
        return (e.eigenvalues[k], e.eigenvectors.column(k).into_owned());
    }
    (least, best.1 / best.0.sqrt())
}

/// The neighbours of a point relative to it, coordinate by coordinate.
pub struct Around {
    x: [f64; K],
    y: [f64; K],
    z: [f64; K],
}

impl Around {
    /// `q` relative to the point.
    pub fn of(q: &[Vec3; K]) -> Self {
        Self { x: q.map(|p| p.x), y: q.map(|p| p.y), z: q.map(|p| p.z) }
    }

    /// How many lie nearer than `reach` times the length of `normal` to the plane through the point.
    #[inline(always)]
    pub fn near(&self, normal: &Vec3, reach: f64) -> u32 {
        let mut count = 0;
        for i in 0..K {
            let d = self.x[i] * normal.x + self.y[i] * normal.y + self.z[i] * normal.z;
            count += u32::from(d.abs() < reach);
        }
        count
    }
}

/// How many of the next neighbours each is paired with.
const PAIRED: usize = 5;

/// Normal of the plane through the point and two of its neighbours that most neighbours lie near.
///
/// All pairs of neighbours so many places apart are measured at once.
#[multiversion::multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn consensus_normal(q: &[Vec3; K], limit: f64) -> Option<Vec3> {
    let sq_limit = limit * limit;
    // Beyond the last there are zeros, which span no plane.
    let [mut x, mut y, mut z, mut sq] = [[0.0; K + PAIRED]; 4];
    for (k, p) in q.iter().enumerate() {
        (x[k], y[k], z[k], sq[k]) = (p.x, p.y, p.z, p.norm_squared());
    }
    let mut near = [[0.0; K]; PAIRED];
    for (apart, near) in near.iter_mut().enumerate() {
        let other = apart + 1..apart + 1 + K;
        let (bx, by, bz) = (&x[other.clone()], &y[other.clone()], &z[other.clone()]);
        let b_sq = &sq[other];
        let [mut nx, mut ny, mut nz, mut reach] = [[0.0; K]; 4];
        for a in 0..K {
            nx[a] = y[a] * bz[a] - z[a] * by[a];
            ny[a] = z[a] * bx[a] - x[a] * bz[a];
            nz[a] = x[a] * by[a] - y[a] * bx[a];
            let length = nx[a] * nx[a] + ny[a] * ny[a] + nz[a] * nz[a];
            // Nothing is near a plane that the two hardly span.
            reach[a] = if length > 0.09 * sq[a] * b_sq[a] { sq_limit * length } else { -1.0 };
        }
        for p in q {
            for a in 0..K {
                let d = nx[a] * p.x + ny[a] * p.y + nz[a] * p.z;
                near[a] += if d * d < reach[a] { 1.0 } else { 0.0 };
            }
        }
    }
    let mut best = (6.0, 0, 0);
    for a in 0..K {
        for (apart, near) in near.iter().enumerate() {
            if near[a] > best.0 {
                best = (near[a], a, a + apart + 1);
            }
        }
    }
    let (count, a, b) = best;
    (count > 6.0).then(|| q[a].cross(&q[b]).normalize())
}

/// Leading bits of the codes by which points are put into buckets before each bucket is sorted: enough that
/// a bucket fits in the cache.
const BUCKET_BITS: u32 = 12;
/// Parts of the points that are put into buckets side by side.
const PARTS: usize = 16;
/// A bucket of more points than this is sorted by all threads.
const LARGE_BUCKET: usize = 1 << 15;

/// Order of `points` along a Morton curve; equal codes by coordinates, so that the order of the
/// input does not matter.
///
/// Sorted by the code's leading bits and the place in the input, which fit into one word together; points whose
/// leading bits are the same, few in any cloud of a surface, are then sorted by what else there is.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn morton_order(points: &[Vec3], monitor: &dyn Monitor) -> Result<Vec<u32>, Cancelled> {
    let (lo, hi) = bounds(points);
    let scale = 2_097_151.0 / (hi - lo).max().max(1e-300);
    let code = |p: &Vec3| {
        let q = (p - lo) * scale;
        spread(q.x as u64) | spread(q.y as u64) << 1 | spread(q.z as u64) << 2
    };
    let place_bits = (points.len() as u64).next_power_of_two().trailing_zeros().max(1);
    let place_of = |key: u64| (key & ((1 << place_bits) - 1)) as u32;
    let first = |part: usize| part * points.len() / PARTS;
    let parts: Vec<Bucketed> = (0..PARTS)
        .into_par_iter()
        .map(|part| {
            let range = first(part)..first(part + 1);
            let key = |i: usize| (code(&points[i]) >> (place_bits - 1)) << place_bits | i as u64;
            Bucketed::of(range.map(key).collect())
        })
        .collect();
    monitor.check()?;
    let buckets = 1 << BUCKET_BITS;
    let length = |b: usize| parts.iter().map(|p| p.bucket(b).len()).sum::<usize>();
    let mut sum = 0;
    let ends: Vec<usize> = (0..buckets).map(|b| (sum += length(b), sum).1).collect();
    let full = |i: u32| {
        let p = &points[i as usize];
        (code(p), p)
    };
    let compare = |a: &u32, b: &u32| {
        let ((a, p), (b, q)) = (full(*a), full(*b));
        a.cmp(&b).then(p.x.total_cmp(&q.x)).then(p.y.total_cmp(&q.y)).then(p.z.total_cmp(&q.z))
    };
    let mut order = vec![0; points.len()];
    slices(&mut order, &ends).into_par_iter().enumerate().with_min_len(16).for_each_init(
        Vec::new,
        |keys, (b, order)| {
            if monitor.cancelled() {
                return;
            }
            keys.clear();
            parts.iter().for_each(|p| keys.extend_from_slice(p.bucket(b)));
            if keys.len() > LARGE_BUCKET {
                keys.par_sort_unstable();
            } else {
                keys.sort_unstable();
            }
            order.iter_mut().zip(&*keys).for_each(|(i, key)| *i = place_of(*key));
            let mut from = 0;
            for run in keys.chunk_by(|a, b| a >> place_bits == b >> place_bits) {
                let run = from..from + run.len();
                from = run.end;
                if run.len() > LARGE_BUCKET {
                    order[run].par_sort_unstable_by(compare);
                } else if run.len() > 1 {
                    order[run].sort_unstable_by(compare);
                }
            }
        },
    );
    monitor.check()?;
    Ok(order)
}

/// Smallest and largest coordinates.
fn bounds(points: &[Vec3]) -> (Vec3, Vec3) {
    let none = || (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    points
        .par_iter()
        .with_min_len(4096)
        .fold(none, |(lo, hi), p| (lo.inf(p), hi.sup(p)))
        .reduce(none, |a, b| (a.0.inf(&b.0), a.1.sup(&b.1)))
}

/// Keys by bucket, in rising order of their leading bits.
struct Bucketed {
    keys: Vec<u64>,
    /// Where each bucket ends.
    ends: Vec<u32>,
}

impl Bucketed {
    fn of(keys: Vec<u64>) -> Self {
        let bucket = |key: u64| (key >> (64 - BUCKET_BITS)) as usize;
        let mut ends = vec![0u32; 1 << BUCKET_BITS];
        keys.iter().for_each(|k| ends[bucket(*k)] += 1);
        let mut sum = 0;
        for n in &mut ends {
            let from = sum;
            sum += *n;
            *n = from;
        }
        let mut out = vec![0; keys.len()];
        for k in keys {
            let place = &mut ends[bucket(k)];
            out[*place as usize] = k;
            *place += 1;
        }
        Self { keys: out, ends }
    }

    fn bucket(&self, b: usize) -> &[u64] {
        let from = if b == 0 { 0 } else { self.ends[b - 1] };
        &self.keys[from as usize..self.ends[b] as usize]
    }
}

/// The parts of a slice that end at `ends`.
fn slices<'a, T>(mut all: &'a mut [T], ends: &[usize]) -> Vec<&'a mut [T]> {
    let mut from = 0;
    let mut out = Vec::with_capacity(ends.len());
    for &end in ends {
        let (part, rest) = all.split_at_mut(end - from);
        out.push(part);
        (all, from) = (rest, end);
    }
    out
}

/// Spreads the low 21 bits to every third bit.
fn spread(v: u64) -> u64 {
    let mut x = v & 0x1f_ffff;
    x = (x | x << 32) & 0x1f00000000ffff;
    x = (x | x << 16) & 0x1f0000ff0000ff;
    x = (x | x << 8) & 0x100f00f00f00f00f;
    x = (x | x << 4) & 0x10c30c30c30c30c3;
    (x | x << 2) & 0x1249249249249249
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::Silent;
    use crate::segment::random::SplitMix64;

    /// `n` places in a cube of so many steps a side, some of them the same.
    fn lattice(n: usize, side: usize, random: &mut SplitMix64) -> Vec<Vec3> {
        let mut step = || random.below(side) as f64;
        (0..n).map(|_| Vec3::new(step(), step(), step())).collect()
    }

    #[test]
    fn the_order_is_that_of_interleaved_bits_whatever_the_order_of_the_input() {
        let mut random = SplitMix64::new(5);
        let side = 64;
        for n in [1, 2, 700, 30_000] {
            let mut points = lattice(n, side, &mut random);
            points.extend([Vec3::zeros(), Vec3::repeat(side as f64 - 1.0)]);
            let sorted = |points: &[Vec3]| -> Vec<Vec3> {
                morton_order(points, &Silent)
                    .unwrap()
                    .into_iter()
                    .map(|i| points[i as usize])
                    .collect()
            };
            let scale = 2_097_151.0 / (side as f64 - 1.0);
            let code = |p: &Vec3| {
                let q = p * scale;
                spread(q.x as u64) | spread(q.y as u64) << 1 | spread(q.z as u64) << 2
            };
            let found = sorted(&points);
            let mut expected = points.clone();
            expected.sort_by_key(code);
            assert_eq!(found, expected);
            points.reverse();
            assert_eq!(found, sorted(&points));
        }
    }

    #[test]
    fn a_few_points_stand_for_their_missing_neighbours() {
        for n in 1..20_u32 {
            let points = (0..n).map(|k| Vec3::new(f64::from(k), 0.0, 0.0)).collect();
            let scene = Scene::new(points);
            for i in 0..scene.len() {
                let near = scene.neighbours(i);
                let own = near.iter().filter(|j| **j as usize == i).count();
                assert_eq!(own, (K + 1).saturating_sub(scene.len()));
            }
            assert!(scene.spacing.is_finite());
        }
    }

    #[test]
    fn points_of_one_code_are_ordered_by_their_coordinates() {
        let far = Vec3::repeat(1e9);
        let near: Vec<Vec3> =
            (0..50).map(|k| Vec3::new(1e-3 * f64::from(k * 37 % 50), 0.0, 0.0)).collect();
        let points: Vec<Vec3> = near.into_iter().chain([far]).collect();
        let order = morton_order(&points, &Silent).unwrap();
        assert!(order.windows(2).all(|w| points[w[0] as usize].x < points[w[1] as usize].x));
    }
}
