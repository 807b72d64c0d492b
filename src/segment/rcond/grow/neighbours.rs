use super::Pool;
use crate::fit::constant::constants;
use crate::geometry::Vec3;

constants! {
    /// Points in the first shell.
    FIRST_SHELL: usize = 64, Effort("points sorted at once; the order is the same");
}
/// Each shell's radius over the last one's: on a surface a shell doubles the points.
const SHELL_RATIO: f64 = std::f64::consts::SQRT_2;

/// The points of a pool by rising Euclidean distance (8) from a centre, ties by index.
///
/// Lazy: shells of growing radius come from the tree one at a time and are sorted alone, so the
/// first n points cost O(n log n) whatever the cloud's size.
pub struct Neighbours<'a> {
    pool: &'a Pool,
    center: Vec3,
    /// The ball passed on so far; negative before the first shell.
    radius: f64,
    shell: std::vec::IntoIter<(f64, u32)>,
}

impl<'a> Neighbours<'a> {
    /// Around `center`.
    pub fn new(pool: &'a Pool, center: Vec3) -> Self {
        Self { pool, center, radius: -1.0, shell: Vec::new().into_iter() }
    }

    /// The next point; points for which `wanted` fails when their shell is fetched are left out.
    pub fn next_where(&mut self, wanted: impl Fn(u32) -> bool) -> Option<u32> {
        loop {
            if let Some((_, index)) = self.shell.next() {
                return Some(index);
            }
            if !self.next_shell(&wanted) {
                return None;
            }
        }
    }

    /// Fetches the next shell; false where the pool is exhausted.
    fn next_shell(&mut self, wanted: impl Fn(u32) -> bool) -> bool {
        let (inner, farthest) = (self.radius, self.pool.farthest(&self.center));
        if inner >= farthest {
            return false;
        }
        self.radius = if inner < 0.0 {
            self.pool.distance_to_nth(&self.center, FIRST_SHELL.get()).max(1e-9 * farthest)
        } else {
            inner * SHELL_RATIO
        };
        // The same product on both sides of a shell's boundary, so no point falls between.
        let sq_inner = if inner < 0.0 { -1.0 } else { inner * inner };
        let mut shell: Vec<_> = self
            .pool
            .within(&self.center, self.radius)
            .filter(|&(sq_dist, i)| sq_dist > sq_inner && wanted(i))
            .collect();
        shell.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        self.shell = shell.into_iter();
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(mut neighbours: Neighbours<'_>, wanted: fn(u32) -> bool) -> Vec<u32> {
        std::iter::from_fn(|| neighbours.next_where(wanted)).collect()
    }

    #[test]
    fn points_come_by_rising_distance_each_once_and_only_the_wanted() {
        let points: Vec<_> = (0..5000)
            .map(f64::from)
            .map(|i| Vec3::new((i * 0.618).fract(), (i * 0.414).fract(), (i * 0.732).fract()))
            .collect();
        let pool = Pool::new(&points).unwrap();
        let center = Vec3::new(0.1, 0.9, 0.5);
        let order = all(Neighbours::new(&pool, center), |i| i % 3 == 0);
        let mut expected: Vec<u32> = (0..5000).step_by(3).collect();
        expected.sort_by(|&a, &b| {
            let sq_dist = |i: u32| (points[i as usize] - center).norm_squared();
            sq_dist(a).total_cmp(&sq_dist(b))
        });
        assert_eq!(order, expected);
    }

    #[test]
    fn coinciding_points_come_by_index() {
        let pool = Pool::new(&[Vec3::new(7.0, 0.0, 0.0); 100]).unwrap();
        let order = all(Neighbours::new(&pool, *pool.point(3)), |_| true);
        assert!(order.into_iter().eq(0..100));
    }
}
