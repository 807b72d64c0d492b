//! Corners of faces where they are written once for each face, or with few digits.

use std::collections::HashMap;

use crate::geometry::Vec3;

/// The cosine of the angle between two faces of a sharp edge, 45 degrees: round parts are finer.
pub(super) const SHARP: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Share of the vertices on sharp edges of a mesh that has no others: all but a few.
const ALL: f64 = 0.9;
/// Most digits behind the point that are looked for.
const MOST_DECIMALS: i32 = 6;

/// For each point the number of the first one at its place.
pub(super) fn places(points: &[Vec3]) -> Vec<u32> {
    let mut first = HashMap::with_capacity(points.len());
    let place = |(i, p): (usize, &Vec3)| {
        // 0 and -0 are one place
        let bits: [u64; 3] = std::array::from_fn(|axis| (p[axis] + 0.0).to_bits());
        *first.entry(bits).or_insert(i as u32)
    };
    points.iter().enumerate().map(place).collect()
}

/// The power of ten up to 1 that all coordinates are multiples of, as those written with few decimals are;
/// 0 where there is none.
pub(super) fn step(points: &[Vec3]) -> f64 {
    let whole = |decimals: &i32| {
        let scale = 10f64.powi(*decimals);
        let mut scaled = points.iter().flat_map(|p| p.iter()).map(|x| x * scale);
        // up to the rounding of doubles
        scaled.all(|x| (x - x.round()).abs() <= 1e-9 * x.abs().max(1.0))
    };
    (0..=MOST_DECIMALS).find(whole).map_or(0.0, |decimals| 10f64.powi(-decimals))
}

/// Whether nearly all vertices are on edges where two faces meet at an angle. `triangles` have the places
/// of their corners and their unit normals.
pub(super) fn are_all(triangles: impl Iterator<Item = ([u32; 3], Vec3)>) -> bool {
    let mut first: HashMap<[u32; 2], Vec3> = HashMap::new();
    let mut is_sharp: HashMap<u32, bool> = HashMap::new();
    for ([a, b, c], normal) in triangles {
        for (i, j) in [(a, b), (b, c), (c, a)] {
            let other = *first.entry([i.min(j), i.max(j)]).or_insert(normal);
            // whichever way round the faces are
            let sharp = normal.dot(&other).abs() < SHARP;
            for end in [i, j] {
                *is_sharp.entry(end).or_default() |= sharp;
            }
        }
    }
    let sharp = is_sharp.values().filter(|sharp| **sharp).count();
    !is_sharp.is_empty() && sharp as f64 >= ALL * is_sharp.len() as f64
}

#[cfg(test)]
mod tests {
    use super::{super::tests::*, *};

    /// The same, turned and moved, with that many decimals.
    fn rounded((points, faces): &Corners, decimals: i32) -> Corners {
        let turn = nalgebra::Rotation3::from_euler_angles(0.3, -0.7, 1.1);
        let scale = 10f64.powi(decimals);
        let round =
            |p: &Vec3| (turn * p + Vec3::new(3.0, 41.0, 7.0)).map(|x| (x * scale).round() / scale);
        (points.iter().map(round).collect(), faces.clone())
    }

    /// The same with corners of its own for each face.
    fn unshared((points, faces): &Corners) -> Corners {
        let corners: Vec<_> = faces.iter().flatten().map(|&i| points[i as usize]).collect();
        let faces = (0..corners.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
        (corners, faces.collect())
    }

    fn boxes(n: usize) -> Corners {
        let (mut points, mut faces) = (Vec::new(), Vec::new());
        for k in 0..n {
            let begin = points.len() as u32;
            let corner = |i: usize| Vec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
            points.extend((0..8).map(|i| 2.0 * corner(i) + Vec3::new(9.0 * k as f64, 0.0, 0.0)));
            for [a, b, c, d] in
                [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
            {
                faces.extend([[a, b, c], [a, c, d]].map(|face| face.map(|i| i + begin)));
            }
        }
        (points, faces)
    }

    #[test]
    fn cad_meshes_are_sampled_with_few_digits_and_with_unshared_corners() {
        for sides in [24, 64, 360] {
            for top in [15.0, 4.0] {
                let mesh = turned(sides, 15.0, 40.0, top);
                for mesh in [rounded(&mesh, 3), unshared(&mesh), unshared(&rounded(&mesh, 3))] {
                    assert!(is_sampled(&mesh), "{sides} sides, {top}");
                }
            }
        }
    }

    #[test]
    fn boxes_are_sampled_however_many_they_are() {
        for n in [2, 25, 100] {
            for mesh in [boxes(n), rounded(&boxes(n), 3), unshared(&boxes(n))] {
                assert!(is_sampled(&mesh), "{n} boxes");
            }
        }
    }

    #[test]
    fn small_scans_are_taken_with_few_digits_and_with_unshared_corners() {
        for (rows, columns) in [(8, 10), (20, 30), (60, 60)] {
            for noise in [0.01, 0.1, 0.5] {
                for uneven in [1.0, 1.1] {
                    let along = |i: u32| f64::from(i) * 0.5 * f64::powf(uneven, f64::from(i) / 3.0);
                    let mesh = scan(rows, columns, 1.0, along, noise);
                    for mesh in [rounded(&mesh, 3), unshared(&mesh), unshared(&rounded(&mesh, 2))] {
                        assert!(!is_sampled(&mesh), "{rows} x {columns}, {noise}, {uneven}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_step_is_found_as_text_leaves_it() {
        let points = |digits: usize| -> Vec<Vec3> {
            let value = |i: u32| format!("{:.digits$}", 1234.0 * f64::from(i).sin());
            let value = |i: u32| value(i).parse::<f64>().unwrap();
            (0..30).map(|i| Vec3::new(value(i), value(i + 30), value(i + 60))).collect()
        };
        for (digits, step_there) in [(0, 1.0), (3, 1e-3), (6, 1e-6), (9, 0.0)] {
            assert_eq!(step(&points(digits)), step_there);
        }
        let single = points(9).iter().map(|p| p.map(|x| f64::from(x as f32))).collect::<Vec<_>>();
        assert_eq!(step(&single), 0.0);
    }
}
