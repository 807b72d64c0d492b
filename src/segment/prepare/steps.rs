//! Steps in which coordinates come: decimals, floating point numbers far from the origin, voxels.

use rayon::prelude::*;

use crate::fit::constant::constants;
use crate::geometry::{PointCloud, Vec3};

constants! {
    /// Points whose coordinates are compared.
    SAMPLE: usize = 2_000, Effort("points compared");
    /// What counts as rounding, in sizes of the cloud.
    ROUNDING: f64 = 1e-12, Derived("a few thousand roundings of a double");
    /// Steps shorter than this, in sizes of the cloud, are those of any double.
    LEAST: f64 = 1e-9, Derived("a thousand times what counts as rounding");
}

/// The even step in which each coordinate of the points comes; nought where in none.
pub fn steps(points: &[Vec3]) -> [f64; 3] {
    let size = points.par_iter().with_min_len(4096).map(|p| p.amax()).reduce(|| 0.0, f64::max);
    std::array::from_fn(|k| {
        let m = points.len().min(SAMPLE.get());
        let mut values: Vec<f64> = (0..m).map(|i| points[i * points.len() / m][k]).collect();
        values.sort_unstable_by(f64::total_cmp);
        let gaps = values.windows(2).map(|w| w[1] - w[0]).filter(|d| *d > ROUNDING.get() * size);
        common_divisor(gaps, ROUNDING.get() * size, LEAST.get() * size)
    })
}

/// The step that the numbers of a cloud came in, in each coordinate, as far as it is known without comparing them: that of
/// single precision at the largest, where all are such numbers, and that of the file before a pose was applied.
pub fn resolution(cloud: &PointCloud) -> [f64; 3] {
    std::array::from_fn(|k| single_precision(&cloud.points, k).max(cloud.resolution))
}

/// The step of single precision at the largest number of coordinate `k`; nought where one of them is none.
fn single_precision(points: &[Vec3], k: usize) -> f64 {
    let is_single = |p: &Vec3| f64::from(p[k] as f32) == p[k];
    if !points.par_iter().with_min_len(4096).all(is_single) {
        return 0.0;
    }
    let largest = points.par_iter().with_min_len(4096).map(|p| p[k].abs() as f32);
    let largest = largest.reduce(|| 0.0, f32::max);
    if largest == 0.0 { 0.0 } else { f64::from(largest.next_up() - largest) }
}

/// The larger one of two steps in each coordinate.
pub fn coarser(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k].max(b[k]))
}

/// The largest length of which all gaps are multiples but for `rounding`; nought where it is below `least`.
fn common_divisor(gaps: impl Iterator<Item = f64>, rounding: f64, least: f64) -> f64 {
    let mut step = 0.0_f64;
    for gap in gaps {
        let mut rest = gap;
        // Euclid's algorithm
        while rest > rounding {
            if step == 0.0 {
                step = rest;
                break;
            }
            let left = (rest - (rest / step).round() * step).abs();
            // A multiple of the step, counted in steps, has the rounding of both its ends and that many of the step's.
            if left <= rounding * (4.0 + rest / step) {
                break;
            }
            (rest, step) = (step, left);
            if step < least {
                return 0.0;
            }
        }
    }
    step
}

/// The standard deviation that rounding to the steps gives a point along a normal.
pub fn rounding(steps: &[f64; 3], normal: &Vec3) -> f64 {
    let sum: f64 = steps.iter().zip(normal.iter()).map(|(s, n)| (s * n).powi(2)).sum();
    (sum / 12.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fits::Random;

    #[test]
    fn decimals_and_single_precision_far_away_have_a_step_and_other_numbers_none() {
        let mut random = Random::new(1);
        let mut cloud = |round: &dyn Fn(f64) -> f64| -> Vec<Vec3> {
            let mut at = || random.uniform(-40.0, 60.0);
            (0..3000).map(|_| Vec3::new(round(at()), at(), round(3.0 * at()))).collect()
        };
        let shift = Vec3::new(3.1234, 2.7, 0.377);
        let of =
            |cloud: Vec<Vec3>| steps(&cloud.into_iter().map(|p| p - shift).collect::<Vec<_>>());
        let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-6;
        let [x, y, z] = of(cloud(&|x| (100.0 * x).round() / 100.0));
        assert!(near(x, 0.01) && y == 0.0 && near(z, 0.01), "{x} {y} {z}");
        let [x, _, z] = of(cloud(&|x| f64::from((x + 4e6) as f32) - 4e6));
        assert!(near(x, 0.25) && near(z, 0.25), "{x} {z}");
        assert_eq!(of(cloud(&|x| x)), [0.0; 3]);
        assert_eq!(steps(&[]), [0.0; 3]);
    }

    #[test]
    fn single_precision_has_the_step_of_its_largest_number() {
        let mut random = Random::new(2);
        // from 2^21 to 2^22 single numbers are 0.25 apart, from 64 to 128 they are 2^-17
        let mut at = |low: f64, high: f64| f64::from(random.uniform(low, high) as f32);
        let mut points: Vec<Vec3> =
            (0..500).map(|_| Vec3::new(at(3.9e6, 4.1e6), at(-100.0, 40.0), 0.0)).collect();
        points[7].y = -100.0;
        let of = |points: &[Vec3]| resolution(&PointCloud::from_points(points.to_vec()));
        assert_eq!(of(&points), [0.25, 2_f64.powi(-17), 0.0]);
        let file = PointCloud { resolution: 0.01, ..PointCloud::from_points(points.clone()) };
        assert_eq!(resolution(&file), [0.25, 0.01, 0.01]);
        points[3].x += 0.1;
        assert_eq!(of(&points)[0], 0.0);
        assert_eq!(of(&[]), [0.0; 3]);
    }

    #[test]
    fn rounding_to_a_step_scatters_by_its_twelfth() {
        let normal = Vec3::new(0.6, 0.0, 0.8);
        assert!((rounding(&[1.0, 5.0, 0.0], &normal) - 0.6 / 12_f64.sqrt()).abs() < 1e-12);
    }
}
