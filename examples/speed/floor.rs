//! The least work of any method, and the neighbours that methods with normals need.

use std::num::NonZero;

use conicoid::geometry::{Mat3, Vec3};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

/// Points a cell.
const CELL: usize = 24;
/// Monomials of degree four and less.
const MOMENTS: usize = 35;

/// Sort, moments and labels: how many points lie within `limit` of their cell's plane.
pub fn floor(points: &[Vec3], limit: f64) -> usize {
    let sorted = sorted(points);
    let moments: Vec<[f64; MOMENTS]> = sorted.par_chunks(CELL).map(moments).collect();
    let mut labels = vec![-1i32; sorted.len()];
    labels.par_chunks_mut(CELL).zip(sorted.par_chunks(CELL)).zip(&moments).for_each(
        |((labels, cell), moments)| {
            let (origin, normal) = plane(&cell[0], moments);
            for (label, p) in labels.iter_mut().zip(cell) {
                *label = -i32::from((p - origin).dot(&normal).abs() > limit);
            }
        },
    );
    labels.par_iter().filter(|l| **l == 0).count()
}

/// The points along a Morton curve.
pub fn sorted(points: &[Vec3]) -> Vec<Vec3> {
    let low = points.iter().fold(Vec3::repeat(f64::INFINITY), |m, p| m.inf(p));
    let high = points.iter().fold(Vec3::repeat(f64::NEG_INFINITY), |m, p| m.sup(p));
    let scale = 2_097_151.0 / (high - low).max();
    let code = |p: &Vec3| {
        let q = (p - low) * scale;
        spread(q.x as u64) | spread(q.y as u64) << 1 | spread(q.z as u64) << 2
    };
    let mut keyed: Vec<(u64, u32)> =
        points.par_iter().zip(0..points.len() as u32).map(|(p, i)| (code(p), i)).collect();
    keyed.par_sort_unstable();
    keyed.par_iter().map(|&(_, i)| points[i as usize]).collect()
}

/// Spreads the low 21 bits to every third bit.
fn spread(bits: u64) -> u64 {
    let steps = [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ];
    steps.iter().fold(bits, |b, (shift, mask)| (b | b << shift) & mask)
}

/// Sums of x^a y^b z^c, a + b + c <= 4, relative to the cell's first point: 1, x, y, z, the six squares
/// and products, and on.
fn moments(cell: &[Vec3]) -> [f64; MOMENTS] {
    let mut sum = [0.0; MOMENTS];
    for p in cell {
        let [x, y, z]: [f64; 3] = (p - cell[0]).into();
        let (xx, xy, xz, yy, yz, zz) = (x * x, x * y, x * z, y * y, y * z, z * z);
        #[rustfmt::skip]
        let terms = [
            1.0, x, y, z, xx, xy, xz, yy, yz, zz,
            xx * x, xx * y, xx * z, xy * y, xy * z, xz * z, yy * y, yy * z, yz * z, zz * z,
            xx * xx, xx * xy, xx * xz, xx * yy, xx * yz, xx * zz, xy * yy, xy * yz, xy * zz,
            xz * zz, yy * yy, yy * yz, yy * zz, yz * zz, zz * zz,
        ];
        sum.iter_mut().zip(terms).for_each(|(s, t)| *s += t);
    }
    sum
}

/// Mean and normal of a cell. The adjugate's largest column is near the direction of least scatter.
fn plane(first: &Vec3, m: &[f64; MOMENTS]) -> (Vec3, Vec3) {
    let mean = Vec3::new(m[1], m[2], m[3]) / m[0];
    let second = Mat3::new(m[4], m[5], m[6], m[5], m[7], m[8], m[6], m[8], m[9]) / m[0];
    let scatter = second - mean * mean.transpose();
    let [a, b, c] = [0, 1, 2].map(|k| scatter.column(k).into_owned());
    let columns = [b.cross(&c), c.cross(&a), a.cross(&b)];
    let longest = columns.into_iter().max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()));
    let normal = longest.and_then(|n| n.try_normalize(0.0)).unwrap_or_else(Vec3::z);
    (first + mean, normal)
}

/// kiddo's tree of `points`.
pub fn tree(points: &[Vec3]) -> Option<ImmutableKdTree<f64, 3>> {
    let raw: Vec<[f64; 3]> = points.iter().map(|p| (*p).into()).collect();
    ImmutableKdTree::new_from_slice(&raw).ok()
}

/// The sum of the distances to the twelfth neighbour (itself the first), so that no query is left out.
pub fn neighbours(tree: &ImmutableKdTree<f64, 3>, points: &[Vec3]) -> f64 {
    let twelve = NonZero::new(12).unwrap_or(NonZero::<usize>::MIN);
    let last = |p: &Vec3| {
        let found = tree.query(&(*p).into()).nearest_n::<SquaredEuclidean<f64>>(twelve).execute();
        found.last().map_or(0.0, |f| f.distance.sqrt())
    };
    points.par_iter().with_min_len(256).map(last).sum()
}
