//! Points in blocks of neighbours, and what each block's residuals say together.

use super::constant::constants;
use super::shape::{MAX_DOF, Shape};
use crate::geometry::Vec3;

constants! {
    /// Blocks of one surface, at most; a power of two.
    BLOCKS: usize = 64, Effort("eigenvectors of a matrix of as many rows");
    /// Points of a block, at least.
    LEAST: usize = 2, Derived("a block of one point has no neighbours in it");
    /// Points of a block whose derivatives stand for the others'.
    SLOPES: usize = 16, Effort("derivatives of one block");
}

/// Some neighbouring points about a surface.
pub struct Block {
    /// How many they are.
    pub count: f64,
    /// Their mean.
    pub centre: Vec3,
    /// The mean of their signed distances from the surface.
    pub residual: f64,
    /// The sum of their squares.
    pub squares: f64,
    /// The mean derivative of these by the degrees of freedom.
    pub slope: [f64; MAX_DOF],
}

/// A point of a surface, and how far from there a point was seen.
pub type Foot = (Vec3, f64);

/// `points` in blocks of nearly equal numbers, parted by where their feet are on the surface: by their own places, noise
/// would decide on which side of a cut points lie, and those of one side of the surface go together.
pub fn blocks(shape: &Shape, points: &[Vec3]) -> Vec<Block> {
    let feet = points.iter().map(|p| foot(shape, p)).collect();
    blocks_of(feet, |at| {
        let mut slope = [0.0; MAX_DOF];
        shape.distance_jacobian(at, &mut slope);
        slope
    })
}

/// The same of `feet` on anything whose distance has the derivatives `slope` by what is open of it.
pub fn blocks_of(mut feet: Vec<Foot>, slope: impl Fn(&Vec3) -> [f64; MAX_DOF]) -> Vec<Block> {
    let cuts = (feet.len() / LEAST.get()).min(BLOCKS.get()).checked_ilog2().unwrap_or(0);
    let mut pieces = vec![feet.as_mut_slice()];
    for _ in 0..cuts {
        pieces = pieces.into_iter().flat_map(halves).collect();
    }
    pieces.into_iter().filter(|p| !p.is_empty()).map(|p| Block::of(p, &slope)).collect()
}

fn foot(shape: &Shape, p: &Vec3) -> Foot {
    let offset = shape.offset(p);
    (p - offset.normal * offset.distance, offset.distance)
}

/// The feet on both sides of the median along their longest side.
fn halves(feet: &mut [Foot]) -> [&mut [Foot]; 2] {
    let side = |k: usize| {
        let both = (f64::INFINITY, f64::NEG_INFINITY);
        let (low, high) = feet.iter().fold(both, |(l, h), f| (l.min(f.0[k]), h.max(f.0[k])));
        high - low
    };
    let longest = [1, 2].into_iter().fold(0, |a, b| if side(b) > side(a) { b } else { a });
    let middle = feet.len() / 2;
    if middle < feet.len() {
        feet.select_nth_unstable_by(middle, |a, b| a.0[longest].total_cmp(&b.0[longest]));
    }
    feet.split_at_mut(middle).into()
}

impl Block {
    fn of(feet: &[Foot], slope_at: &impl Fn(&Vec3) -> [f64; MAX_DOF]) -> Self {
        let count = feet.len() as f64;
        let stride = feet.len().div_ceil(SLOPES.get()).max(1);
        let mut slope = [0.0; MAX_DOF];
        for foot in feet.iter().step_by(stride) {
            slope.iter_mut().zip(slope_at(&foot.0)).for_each(|(sum, j)| *sum += j);
        }
        let some = feet.len().div_ceil(stride) as f64;
        Self {
            count,
            centre: feet.iter().map(|f| f.0).sum::<Vec3>() / count,
            residual: feet.iter().map(|f| f.1).sum::<f64>() / count,
            squares: feet.iter().map(|f| f.1 * f.1).sum(),
            slope: slope.map(|s| s / some),
        }
    }
}
