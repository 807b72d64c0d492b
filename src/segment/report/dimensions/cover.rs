//! Which part of a sphere or an ellipsoid points cover.

use std::f64::consts::TAU;

use crate::fit::Shape;
use crate::fit::constant::constants;
use crate::geometry::Vec3;

constants! {
    /// Points that a cell of the surface should have on average: so many leave one in 3000 empty.
    EXPECTED: usize = 8, Derived("exp(-8): one cell in 3000 is empty by chance");
    /// Bands of height, at least; each has twice as many cells around it.
    FEWEST_BANDS: usize = 4, Trial(4.0, 4.0);
    /// The same, at most.
    MOST_BANDS: usize = 40, Effort("cells of a surface");
}

/// Share of the area of a sphere or an ellipsoid on which there are points, from an even sample of them.
///
/// Cells of equal area on the unit sphere: those whose neighbours all have points count whole, those at the border by
/// their points over the median of the former's.
pub fn share(shape: &Shape, points: &[Vec3]) -> f64 {
    let bands = (((points.len() / EXPECTED.get() / 2) as f64).sqrt() as usize)
        .clamp(FEWEST_BANDS.get(), MOST_BANDS.get());
    let around = 2 * bands;
    let axes = if shape.size[1] > 0.0 { shape.size } else { [shape.size[0]; 3] };
    let axes = Vec3::from(axes);
    let mut counts = vec![0usize; bands * around];
    for p in points {
        let unit = shape.frame.tr_mul(&(p - shape.origin)).component_div(&axes).normalize();
        let band = (((unit.z + 1.0) / 2.0 * bands as f64) as usize).min(bands - 1);
        let turn = (unit.y.atan2(unit.x) / TAU).rem_euclid(1.0);
        counts[band * around + ((turn * around as f64) as usize).min(around - 1)] += 1;
    }
    let has = |band: usize, k: usize| counts[band * around + k % around] > 0;
    let is_inner = |i: usize| {
        let (band, k) = (i / around, i % around);
        let rows = band.saturating_sub(1)..=(band + 1).min(bands - 1);
        rows.into_iter().all(|b| (0..3).all(|s| has(b, k + around + s - 1)))
    };
    let inner: Vec<bool> = (0..counts.len()).map(is_inner).collect();
    let mut full: Vec<usize> =
        counts.iter().zip(&inner).filter(|(_, inner)| **inner).map(|(c, _)| *c).collect();
    let middle = full.len() / 2;
    let median = if full.is_empty() { EXPECTED.get() } else { *full.select_nth_unstable(middle).1 };
    let part = |i: usize| if inner[i] { 1.0 } else { (counts[i] as f64 / median as f64).min(1.0) };
    // Area of the surface for each of the unit sphere's, at the cell's middle.
    let stretch = |i: usize| {
        let z = 2.0 * ((i / around) as f64 + 0.5) / bands as f64 - 1.0;
        let turn = TAU * ((i % around) as f64 + 0.5) / around as f64;
        let s = (1.0 - z * z).sqrt();
        Vec3::new(s * turn.cos(), s * turn.sin(), z).component_div(&axes).norm()
    };
    let (mut seen, mut whole) = (0.0, 0.0);
    for i in 0..counts.len() {
        seen += part(i) * stretch(i);
        whole += stretch(i);
    }
    seen / whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Family;
    use crate::fit::fits::Random;

    #[test]
    fn the_share_is_that_of_the_area_with_points() {
        let mut random = Random::new(5);
        for (axes, from, expected) in [
            ([3.0, 0.0, 0.0], -1.0, 1.0),
            ([3.0, 0.0, 0.0], 0.0, 0.5),
            ([3.0, 0.0, 0.0], 0.8, 0.1),
            ([5.0, 4.0, 2.0], 0.0, 0.5),
        ] {
            let family = if axes[1] > 0.0 { Family::Ellipsoid } else { Family::Sphere };
            let shape = Shape::with_axis(family, Vec3::new(1.0, 2.0, 3.0), Vec3::z(), axes);
            let axes = if axes[1] > 0.0 { Vec3::from(axes) } else { Vec3::repeat(axes[0]) };
            let mut points = Vec::new();
            while points.len() < 6000 {
                let z: f64 = random.uniform(from, 1.0);
                let (turn, s) = (random.uniform(0.0, TAU), (1.0 - z * z).sqrt());
                let unit = Vec3::new(s * turn.cos(), s * turn.sin(), z);
                // Evenly over the ellipsoid's area.
                if random.uniform(0.0, 1.0) < unit.component_div(&axes).norm() * axes.min() {
                    points.push(shape.origin + shape.frame * unit.component_mul(&axes));
                }
            }
            let found = share(&shape, &points);
            assert!((found - expected).abs() < 0.02, "{axes} {from}: {found}");
        }
    }
}
