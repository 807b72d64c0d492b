//! The order of points along a Morton curve.

use rayon::prelude::*;

use crate::geometry::Vec3;
use crate::segment::{Cancelled, Monitor};

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
    order_by(points, &Codes::of(points), monitor)
}

/// The same by codes of another box.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn order_by(
    points: &[Vec3],
    codes: &Codes,
    monitor: &dyn Monitor,
) -> Result<Vec<u32>, Cancelled> {
    let place_bits = (points.len() as u64).next_power_of_two().trailing_zeros().max(1);
    let first = |part: usize| part * points.len() / PARTS;
    let parts: Vec<Bucketed> = (0..PARTS)
        .into_par_iter()
        .map(|part| {
            let range = first(part)..first(part + 1);
            let leading = |i: usize| codes.of_point(&points[i]) >> (place_bits - 1);
            Bucketed::of(range.map(|i| leading(i) << place_bits | i as u64).collect())
        })
        .collect();
    monitor.check()?;
    let buckets = 1 << BUCKET_BITS;
    let length = |b: usize| parts.iter().map(|p| p.bucket(b).len()).sum::<usize>();
    let mut sum = 0;
    let ends: Vec<usize> = (0..buckets).map(|b| (sum += length(b), sum).1).collect();
    let mut order = vec![0; points.len()];
    slices(&mut order, &ends).into_par_iter().enumerate().with_min_len(16).for_each_init(
        Vec::new,
        |keys, (b, order)| {
            if !monitor.cancelled() {
                keys.clear();
                parts.iter().for_each(|p| keys.extend_from_slice(p.bucket(b)));
                sort_bucket(points, codes, place_bits, keys, order);
            }
        },
    );
    monitor.check()?;
    Ok(order)
}

/// The order of the points of a bucket, whose `keys` end with `place_bits` of each one's place.
fn sort_bucket(
    points: &[Vec3],
    codes: &Codes,
    place_bits: u32,
    keys: &mut [u64],
    order: &mut [u32],
) {
    if keys.len() > LARGE_BUCKET {
        keys.par_sort_unstable();
    } else {
        keys.sort_unstable();
    }
    let place_of = |key: u64| (key & ((1 << place_bits) - 1)) as u32;
    order.iter_mut().zip(&*keys).for_each(|(i, key)| *i = place_of(*key));
    let full = |i: u32| {
        let p = &points[i as usize];
        (codes.of_point(p), p)
    };
    let compare = |a: &u32, b: &u32| {
        let ((a, p), (b, q)) = (full(*a), full(*b));
        a.cmp(&b).then(p.x.total_cmp(&q.x)).then(p.y.total_cmp(&q.y)).then(p.z.total_cmp(&q.z))
    };
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
}

/// Steps of a coordinate's code.
const STEPS: u64 = (1 << 21) - 1;

/// Codes of points in a box: 21 bits of each coordinate, interleaved. Points outside have that of a place on its
/// sides.
#[derive(Clone, Copy, Debug)]
pub struct Codes {
    /// The smallest corner of the box.
    pub lo: Vec3,
    /// Steps of a length.
    pub scale: f64,
}

impl Codes {
    /// In the box of the points.
    pub fn of(points: &[Vec3]) -> Self {
        let (lo, hi) = bounds(points);
        // points that coincide have one code whatever the scale
        Self { lo, scale: STEPS as f64 / (hi - lo).max().max(1e-300) }
    }

    /// The code of a point.
    pub fn of_point(&self, p: &Vec3) -> u64 {
        let q = (p - self.lo) * self.scale;
        // what lies below the box is cut off by the cast
        let step = |x: f64| spread((x as u64).min(STEPS));
        step(q.x) | step(q.y) << 1 | step(q.z) << 2
    }
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
    fn points_of_one_code_are_ordered_by_their_coordinates() {
        let far = Vec3::repeat(1e9);
        let near: Vec<Vec3> =
            (0..50).map(|k| Vec3::new(1e-3 * f64::from(k * 37 % 50), 0.0, 0.0)).collect();
        let points: Vec<Vec3> = near.into_iter().chain([far]).collect();
        let order = morton_order(&points, &Silent).unwrap();
        assert!(order.windows(2).all(|w| points[w[0] as usize].x < points[w[1] as usize].x));
    }
}
