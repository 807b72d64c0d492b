//! Points of a cloud no two of which are close together.

use std::collections::HashMap;

use crate::fit::constant::constants;
use crate::geometry::Vec3;

constants! {
    /// Points kept last that the next is held against before all near it are: those of its own row.
    LAST: usize = 8, Effort("points looked at in turn");
}

/// Places, rising, of some of the points, none nearer to another than `radius`, and none left out that is nearer than
/// that to none of them: points on rows come to lie as far from each other along these.
///
/// `points` should be in Morton order. All of them where the radius is not positive.
pub fn even(points: &[Vec3], radius: f64) -> Vec<u32> {
    let sq = radius * radius;
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let mut kept: Vec<u32> = Vec::new();
    let near = |a: u32, p: &Vec3| (points[a as usize] - p).norm_squared() < sq;
    let cell = |p: &Vec3| [p.x, p.y, p.z].map(|x| (x / radius).floor() as i64);
    for (i, p) in points.iter().enumerate() {
        if kept.iter().rev().take(LAST.get()).any(|&k| near(k, p)) {
            continue;
        }
        let at = cell(p);
        let beside = (0..27).map(|k| [at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1]);
        let free = beside.filter_map(|c| cells.get(&c)).flatten().all(|&k| !near(k, p));
        if free {
            kept.push(i as u32);
            cells.entry(at).or_default().push(i as u32);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fits::Random;

    #[test]
    fn points_kept_lie_apart_and_every_other_is_near_one() {
        let random = &mut Random::new(4);
        let mut at = || {
            Vec3::new(random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0), 0.01 * random.normal())
        };
        let points: Vec<Vec3> = (0..3000).map(|_| at()).collect();
        let kept = even(&points, 0.5);
        let nearest = |p: &Vec3, but: u32| {
            let others = kept.iter().filter(|k| **k != but);
            others.map(|&k| (points[k as usize] - p).norm()).fold(f64::INFINITY, f64::min)
        };
        assert!(kept.iter().all(|&k| nearest(&points[k as usize], k) >= 0.5));
        assert!(points.iter().all(|p| nearest(p, u32::MAX) < 0.5));
        assert!((150..400).contains(&kept.len()), "{}", kept.len());
        assert_eq!(even(&points[..10], 0.0).len(), 10);
    }
}
