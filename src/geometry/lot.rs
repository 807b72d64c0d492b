//! The lot that decides between points.

use super::Vec3;

/// A point's lot, worked out from its coordinates: like chance beside where the point is, and the same whatever its place in
/// the file.
#[inline]
pub fn lot(p: &Vec3) -> u64 {
    // -0 is 0
    mixed([p.x + 0.0, p.y + 0.0, p.z + 0.0].map(f64::to_bits))
}

/// Three numbers to one, after SplitMix64 (Steele, Lea, Flood 2014), whose last steps spread every bit over all.
#[inline]
fn mixed(numbers: [u64; 3]) -> u64 {
    let step = |state: u64, x: u64| {
        let mut z = (state ^ x).wrapping_add(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    };
    numbers.into_iter().fold(0, step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lots_of_points_side_by_side_are_spread_evenly() {
        let lots: Vec<u64> = (0..40_000)
            .map(|k| lot(&Vec3::new(f64::from(k % 200) * 0.01, f64::from(k / 200), 0.0)))
            .collect();
        for bit in 0..64 {
            let ones = lots.iter().filter(|l| *l >> bit & 1 == 1).count() as f64;
            // five standard deviations
            assert!((ones - 20_000.0).abs() < 500.0, "bit {bit}: {ones}");
        }
        assert_eq!(lot(&Vec3::zeros()), lot(&Vec3::new(-0.0, 0.0, -0.0)));
    }
}
