//! The pieces a region falls into when gaps wider than a given length part it.

use crate::geometry::Vec3;
use crate::segment::union::Union;

/// Groups of `points` whose members are chained by steps of at most `gap`, larger ones first.
///
/// Points are binned into cubes whose diagonal is `gap`, so those of one cube hang together; two cubes
/// join at the first pair of points near enough.
pub fn pieces(points: &[Vec3], gap: f64) -> Vec<Vec<u32>> {
    let low = points.iter().fold(Vec3::repeat(f64::INFINITY), |m, p| m.inf(p));
    let side = gap / 3f64.sqrt();
    let cube = |p: &Vec3| -> [i64; 3] { ((p - low) / side).map(|x| x as i64).into() };
    let mut binned: Vec<([i64; 3], u32)> =
        points.iter().enumerate().map(|(i, p)| (cube(p), i as u32)).collect();
    binned.sort_unstable();
    let cubes: Vec<&[([i64; 3], u32)]> = binned.chunk_by(|a, b| a.0 == b.0).collect();
    let mut union = Union::new(points.len());
    for members in &cubes {
        members.iter().for_each(|m| union.join(members[0].1, m.1));
    }
    let near =
        |a: u32, b: u32| (points[a as usize] - points[b as usize]).norm_squared() <= gap * gap;
    for members in &cubes {
        for step in forward_steps() {
            let at: [i64; 3] = std::array::from_fn(|k| members[0].0[k] + step[k]);
            let Ok(other) = cubes.binary_search_by_key(&at, |c| c[0].0) else { continue };
            let other = cubes[other];
            if union.root(members[0].1) != union.root(other[0].1)
                && members.iter().any(|a| other.iter().any(|b| near(a.1, b.1)))
            {
                union.join(members[0].1, other[0].1);
            }
        }
    }
    union.sets()
}

/// Half of the cubes that may hold a point within the diagonal; the other half look back.
fn forward_steps() -> impl Iterator<Item = [i64; 3]> {
    (-2..=2)
        .flat_map(|x| (-2..=2).flat_map(move |y| (-2..=2).map(move |z| [x, y, z])))
        .filter(|s| *s > [0, 0, 0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::random::SplitMix64;

    /// The same by comparing every pair.
    fn slow(points: &[Vec3], gap: f64) -> Vec<Vec<u32>> {
        let mut union = Union::new(points.len());
        for (i, a) in points.iter().enumerate() {
            for (j, b) in points[..i].iter().enumerate() {
                if (a - b).norm() <= gap {
                    union.join(i as u32, j as u32);
                }
            }
        }
        union.sets()
    }

    #[test]
    fn the_pieces_are_those_of_all_pairs() {
        let mut random = SplitMix64::new(4);
        let mut uniform = || random.below(1 << 30) as f64 / (1 << 30) as f64;
        let points: Vec<Vec3> =
            (0..300).map(|_| Vec3::new(uniform() - 0.5, uniform(), 0.3 * uniform())).collect();
        for gap in [0.02, 0.06, 0.1, 0.2, 5.0] {
            assert_eq!(pieces(&points, gap), slow(&points, gap), "{gap}");
        }
    }

    #[test]
    fn a_gap_as_wide_as_asked_for_is_bridged_and_a_wider_one_is_not() {
        let row = |x: f64| (0..5).map(move |i| Vec3::new(x + f64::from(i) * 0.25, 0.0, 0.0));
        let points: Vec<Vec3> = row(0.0).chain(row(3.0)).collect();
        assert_eq!(pieces(&points, 2.0).len(), 1);
        assert_eq!(pieces(&points, 1.99).len(), 2);
    }
}
