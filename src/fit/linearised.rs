//! Distances, costs and normal equations of a shape over points in columns.
//!
//! The family is looked at once; inside, one loop for each family does several points at a time. The widest
//! vector units of the machine are chosen at run time. Sums are always kept in [`LANES`] parts
//! and nothing is fused or reordered by the compiler, so every machine gives the same bits.

#![expect(clippy::needless_range_loop, reason = "triangles and lanes read best by index")]

use multiversion::multiversion;

use super::columns::{Columns, LANES};
use super::kernels::Kernel;
use super::loss::{CHUNK, Loss, Robust, sum};
use super::normal::Normal;
use super::ruler::{Placed, Prepared, Ruler, with_kernel};
use super::shape::{MAX_DOF, Shape};

/// A shape's cost over some points and, where asked for, its linearisation.
#[derive(Clone, Copy, Debug)]
pub struct Evaluated {
    /// Sum of the losses by weight.
    pub cost: f64,
    /// Sum of the squares by weight, of points that a robust loss counts as outliers no more than a limit each.
    pub truncated: f64,
    /// The normal equations.
    pub normal: Normal,
}

/// Cost and normal equations of `shape` over `points`, it being relative to their origin.
pub fn linearise(shape: &Shape, points: &Columns, loss: Loss) -> Evaluated {
    evaluate(shape, points, loss, true)
}

/// Cost of `shape` over `points`.
pub fn cost(shape: &Shape, points: &Columns, loss: Loss) -> f64 {
    evaluate(shape, points, loss, false).cost
}

impl Normal {
    /// Those of `shape` over `points`, by squares.
    pub fn of(shape: &Shape, points: &Columns) -> Self {
        linearise(&shape.translated(&-points.origin), points, Loss::Squares).normal
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn evaluate(shape: &Shape, points: &Columns, loss: Loss, rows: bool) -> Evaluated {
    let ruler = Ruler::of(shape);
    with_kernel!(ruler, |kernel| run(kernel, &ruler.placed, points, loss, rows))
}

#[inline(always)]
fn run<const P: usize>(
    kernel: &impl Kernel<P>,
    placed: &Placed,
    points: &Columns,
    loss: Loss,
    rows: bool,
) -> Evaluated {
    let mut robust = Robust::new(loss, points.uneven);
    let mut columns = [[0.0; CHUNK]; COLUMNS];
    let mut parts = [[[0.0; LANES]; COLUMNS]; P];
    let n = points.x.len();
    let mut from = 0;
    while from < n {
        let to = n.min(from + CHUNK);
        let (x, y, z) = (&points.x[from..to], &points.y[from..to], &points.z[from..to]);
        let given = &points.weight[from..to];
        if rows {
            fill_rows(kernel, placed, x, y, z, &mut columns);
            let weight = robust.add(&columns[0][..to - from], given);
            add_products::<P>(&columns, weight, &mut parts);
        } else {
            let d = &mut columns[0][..x.len()];
            for (((d, x), y), z) in d.iter_mut().zip(x).zip(y).zip(z) {
                *d = kernel.distance(placed.local(*x, *y, *z));
            }
            robust.add(d, given);
        }
        from = to;
    }
    let truncated = robust.truncated();
    Evaluated { truncated, cost: robust.total(), normal: normal::<P>(&parts, points.total) }
}

/// Distances and derivatives of a chunk of points.
#[inline(always)]
fn fill_rows<const P: usize>(
    kernel: &impl Kernel<P>,
    placed: &Placed,
    x: &[f64],
    y: &[f64],
    z: &[f64],
    columns: &mut [[f64; CHUNK]; COLUMNS],
) {
    let n = x.len().min(CHUNK);
    let (x, y, z) = (&x[..n], &y[..n], &z[..n]);
    for i in 0..n {
        let (distance, row) = kernel.row(placed.local(x[i], y[i], z[i]));
        columns[0][i] = distance;
        for a in 0..P {
            columns[a + 1][i] = row[a];
        }
    }
}

/// Products of one column with several others, whose sums stay in registers meanwhile.
const TILE: usize = 4;
/// The distance and the derivatives, filled up to whole tiles.
const COLUMNS: usize = (MAX_DOF + 1).next_multiple_of(TILE);
/// Sums of products of two columns, in parts.
type Parts = [[f64; LANES]; COLUMNS];

/// Adds a chunk's products of weight, column a and column b <= a; column 0 is the distance, whose row has
/// no place of its own.
#[inline(always)]
fn add_products<const P: usize>(
    columns: &[[f64; CHUNK]; COLUMNS],
    weight: &[f64],
    parts: &mut [Parts; P],
) {
    let n = weight.len().min(CHUNK);
    let mut weighed = [0.0; CHUNK];
    for a in 1..=P {
        for i in 0..n {
            weighed[i] = weight[i] * columns[a][i];
        }
        // Tiles reach beyond the triangle: what they add there is never looked at.
        for b in (0..=a).step_by(TILE) {
            let tile: [&[f64; CHUNK]; TILE] = std::array::from_fn(|k| &columns[b + k]);
            add_tile(&weighed[..n], tile, &mut parts[a - 1][b..b + TILE]);
        }
    }
}

#[inline(always)]
fn add_tile(weighed: &[f64], tile: [&[f64; CHUNK]; TILE], parts: &mut [[f64; LANES]]) {
    let mut s = [[0.0; LANES]; TILE];
    s.copy_from_slice(parts);
    for (block, w) in weighed.chunks_exact(LANES).enumerate() {
        let from = block * LANES;
        for k in 0..TILE {
            let column = &tile[k][from..from + LANES];
            for l in 0..LANES {
                s[k][l] += w[l] * column[l];
            }
        }
    }
    parts.copy_from_slice(&s);
}

/// The normal equations from the sums of products.
fn normal<const P: usize>(parts: &[Parts; P], weight: f64) -> Normal {
    let mut out = Normal { weight, ..Normal::default() };
    for a in 0..P {
        out.jr[a] = sum(&parts[a][0]);
        for b in 0..=a {
            out.jj[a][b] = sum(&parts[a][b + 1]);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::fits::{self, Random};
    use super::super::shape::Family;
    use super::*;
    use crate::geometry::Vec3;

    /// A shape of each family, and those whose points lie beyond their axes.
    fn shapes() -> Vec<Shape> {
        let more = [(Family::Cone, [1.0, -1.2, 0.0]), (Family::Torus, [2.0, 3.0, 0.0])];
        let mut all = fits::shapes();
        let at = all[0];
        all.extend(more.map(|(family, size)| Shape { family, size, ..at }));
        all
    }

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-9 * (1.0 + a.abs().max(b.abs()))
    }

    #[test]
    fn all_points_at_once_give_what_one_after_the_other_give() {
        let mut random = Random::new(2);
        for (shape, n) in shapes().iter().flat_map(|s| [1, 7, 8, 64, 333].map(|n| (s, n))) {
            let mut side = || random.uniform(-8.0, 8.0);
            let points: Vec<Vec3> = (0..n).map(|_| Vec3::new(side(), side(), side())).collect();
            let weights: Vec<f64> = (0..n).map(|_| random.uniform(0.0, 2.0)).collect();
            let cut: f64 = 0.7;
            for (given, cauchy) in
                [(None, false), (None, true), (Some(&weights[..]), false), (Some(&weights), true)]
            {
                let loss = if cauchy { Loss::Cauchy(1.0 / (cut * cut)) } else { Loss::Squares };
                let columns = Columns::of(&points, given);
                let moved = shape.translated(&-columns.origin);
                let found = linearise(&moved, &columns, loss);
                let (mut expected, mut sum) = (Normal::default(), 0.0);
                for (i, x) in points.iter().enumerate() {
                    let w = given.map_or(1.0, |w| w[i]);
                    let t = (shape.distance(x) / cut).powi(2);
                    sum += w * if cauchy { cut * cut * t.ln_1p() } else { t * cut * cut };
                    expected.add(shape, x, if cauchy { w / (1.0 + t) } else { w });
                }
                assert!(close(found.cost, sum), "{shape:?} {n}: {} {sum}", found.cost);
                assert!(close(cost(&moved, &columns, loss), sum));
                assert!(close(found.normal.weight, given.map_or(n as f64, |w| w.iter().sum())));
                for a in 0..shape.family.dof() {
                    assert!(close(found.normal.jr[a], expected.jr[a]), "{shape:?} {n} {a}");
                    for b in 0..=a {
                        let (x, y) = (found.normal.jj[a][b], expected.jj[a][b]);
                        assert!(close(x, y), "{shape:?} {n} {a} {b}: {x} {y}");
                    }
                }
            }
        }
    }

    #[test]
    fn distances_far_beyond_the_cut_neither_overflow_nor_vanish() {
        let points: Vec<Vec3> = (0..200).map(|k| Vec3::new(0.0, 0.0, 1e9 + f64::from(k))).collect();
        let shape = Shape::with_axis(Family::Plane, Vec3::zeros(), Vec3::z(), [0.0; 3]);
        let columns = Columns::of(&points, None);
        let found = cost(&shape.translated(&-columns.origin), &columns, Loss::Cauchy(1e18));
        let expected: f64 = points.iter().map(|p| (p.z * p.z * 1e18).ln_1p() / 1e18).sum();
        assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
    }
}
