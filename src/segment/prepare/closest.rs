//! The points nearest to a place that need not be one of them.

/// Points of a patch: enough for a quadric and a wall (seven coefficients) to leave most of what they know of the
/// noise, few enough for a patch of 24 to lie on one face.
pub const MANY: usize = 24;

/// The points nearest to a place, nearest first.
pub struct Closest {
    sq: [f64; MANY],
    place: [u32; MANY],
    len: usize,
}

impl Closest {
    /// None so far.
    pub fn none() -> Self {
        Self { sq: [f64::INFINITY; MANY], place: [u32::MAX; MANY], len: 0 }
    }

    /// Squared distance that a point must not exceed to be among them.
    #[inline(always)]
    pub fn limit(&self) -> f64 {
        self.sq[MANY - 1]
    }

    /// Takes a point, `sq` away, among them if it is near enough.
    #[inline(always)]
    pub fn take(&mut self, sq: f64, place: u32) {
        let nearer = |k: usize| self.sq[k] < sq || (self.sq[k] == sq && self.place[k] < place);
        if nearer(MANY - 1) {
            return;
        }
        let mut k = (MANY - 1).min(self.len);
        while k > 0 && !nearer(k - 1) {
            k -= 1;
        }
        self.sq.copy_within(k..MANY - 1, k + 1);
        self.place.copy_within(k..MANY - 1, k + 1);
        (self.sq[k], self.place[k]) = (sq, place);
        self.len = (self.len + 1).min(MANY);
    }

    /// Their places in the order of the runs.
    pub fn places(&self) -> &[u32] {
        &self.place[..self.len]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;
    use crate::segment::fixtures::ordered;
    use crate::segment::prepare::nearest::Runs;
    use crate::segment::random::SplitMix64;

    #[test]
    fn they_are_those_that_a_look_at_all_points_finds() {
        let mut random = SplitMix64::new(3);
        let mut unit = || random.below(1 << 30) as f64 / f64::from(1 << 30);
        for n in [5, MANY, 100, 3000] {
            // crowded at one end
            let points: Vec<Vec3> =
                (0..n).map(|_| Vec3::new(unit().powi(4), unit(), 0.1 * unit())).collect();
            let points = ordered(&points);
            let runs = Runs::of(&points);
            for after in [0, n / 3, n - 1, n] {
                let p = points[after.min(n - 1)] + 0.01 * Vec3::new(unit(), unit(), unit());
                let mut all: Vec<u32> = (0..n as u32).collect();
                all.sort_by(|a, b| {
                    let sq = |i: &u32| (points[*i as usize] - p).norm_squared();
                    sq(a).total_cmp(&sq(b))
                });
                all.truncate(MANY);
                assert_eq!(runs.closest(&p, after).places(), all, "{n} {after}");
            }
        }
    }
}
