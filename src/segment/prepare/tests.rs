use crate::fit::fits::Random;
use crate::geometry::Vec3;
use crate::segment::Silent;
use crate::segment::fixtures::{SIGMA, roof};
use crate::segment::prepare::candidates::{Candidates, K, ROOM};
use crate::segment::prepare::distinct::distinct_points;
use crate::segment::prepare::normals::{consensus_normal, normal_of};
use crate::segment::prepare::take::{take, take_core, take_with_normals};

#[test]
fn of_the_candidates_the_nearest_stay_nearest_first_whether_or_not_some_are_equally_near() {
    let mut random = Random::new(1);
    for len in [0, 1, K - 1, K, K + 1, 50, ROOM] {
        for steps in [3.0, 1e12] {
            let mut found = Candidates::within(f64::INFINITY, 1.0);
            let sq: Vec<f64> = (0..len).map(|_| random.uniform(0.0, steps).floor()).collect();
            for (k, &d) in sq.iter().enumerate() {
                // Places in falling order: of equals the lowest is first.
                (found.sq[k], found.place[k]) = (d, 1000 - k as u32);
            }
            found.len = len;
            found.reduce();
            let mut expected: Vec<(f64, u32)> =
                sq.iter().enumerate().map(|(k, d)| (*d, 1000 - k as u32)).collect();
            expected.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            expected.truncate(K);
            let kept: Vec<(f64, u32)> =
                (0..found.len).map(|k| (found.sq[k], found.place[k])).collect();
            assert_eq!(kept, expected, "{len} {steps}");
            let limit = expected.get(K - 1).map_or(f64::INFINITY, |e| e.0);
            assert_eq!(found.limit, limit);
        }
    }
}

#[test]
fn copies_of_a_point_become_one_and_every_point_knows_its_place() {
    let mut random = Random::new(2);
    let mut step = || random.uniform(0.0, 12.0).floor();
    let cloud: Vec<Vec3> = (0..5000).map(|_| Vec3::new(step(), step(), step())).collect();
    let (points, centre, places) = distinct_points(&cloud, &Silent).unwrap();
    let mut kinds: Vec<[i64; 3]> =
        cloud.iter().map(|p| [p.x, p.y, p.z].map(|x| x as i64)).collect();
    kinds.sort_unstable();
    kinds.dedup();
    assert_eq!(points.len(), kinds.len());
    assert!((centre - cloud.iter().sum::<Vec3>() / 5000.0).norm() < 1e-12);
    for (p, &k) in cloud.iter().zip(&places) {
        assert!((points[k as usize] + centre - p).norm() < 1e-12);
    }
}

#[test]
fn a_normal_is_the_direction_of_least_scatter_and_roughness_its_share() {
    let mut random = Random::new(3);
    for _ in 0..200 {
        let mut side = |s: f64| random.uniform(-s, s);
        let w = Vec3::new(side(1.0), side(1.0), side(1.0)).normalize();
        let (u, v) = crate::geometry::perpendicular_frame(&w);
        let scatter = [2.0, 1.0, 0.05];
        let points: Vec<Vec3> = (0..=K)
            .map(|_| u * side(scatter[0]) + v * side(scatter[1]) + w * side(scatter[2]))
            .collect();
        let near: Vec<u32> = (1..=K as u32).collect();
        let (normal, rough) = normal_of(&points, 0, &near);
        let mean = points.iter().sum::<Vec3>() / points.len() as f64;
        let all: crate::geometry::Mat3 =
            points.iter().map(|p| (p - mean) * (p - mean).transpose()).sum();
        let eigen = nalgebra::SymmetricEigen::new(all);
        let least = eigen.eigenvalues.imin();
        assert!(normal.cross(&eigen.eigenvectors.column(least)).norm() < 1e-6);
        let share = eigen.eigenvalues[least] / all.trace();
        assert!((f64::from(rough) - share).abs() < 1e-6, "{rough} {share}");
    }
}

/// Sixteen places: `on` of them within a tenth of a sigma of the plane z = 0, the others far from it.
fn neighbourhood(on: usize, random: &mut Random) -> [Vec3; K] {
    std::array::from_fn(|k| {
        let (x, y) = (random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0));
        let z = if k < on { 0.1 * SIGMA * random.normal() } else { random.uniform(0.3, 1.0) };
        Vec3::new(x, y, z)
    })
}

#[test]
fn most_neighbours_agree_on_a_normal_that_the_others_do_not_turn() {
    let mut random = Random::new(4);
    for _ in 0..100 {
        let q = neighbourhood(10, &mut random);
        let normal = consensus_normal(&q, 3.0 * SIGMA).unwrap();
        let near = q.iter().filter(|p| p.dot(&normal).abs() < 3.0 * SIGMA).count();
        assert!(near >= 10, "{near}");
        assert!(normal.z.abs() > 0.99, "{normal}");
    }
    let alone = neighbourhood(0, &mut random);
    assert!(consensus_normal(&alone, 1e-6).is_none());
}

#[test]
fn points_are_taken_evenly_and_those_of_a_core_have_no_others_beside_them() {
    let (scene, _, labels) = roof(4000, 1.0);
    let group: Vec<u32> = (0..4000).filter(|i| labels[*i as usize] == 0).collect();
    let taken = take(&scene, &group, 100);
    assert_eq!(taken.len(), 100);
    assert_eq!(taken[37], scene.points[group[37 * group.len() / 100] as usize]);
    assert_eq!(take(&scene, &group, usize::MAX).len(), group.len());
    let (points, normals) = take_with_normals(&scene, &group, 100);
    assert_eq!(
        (points, normals[99]),
        (taken, scene.normals[group[99 * group.len() / 100] as usize])
    );
    let (core, _) = take_core(&scene, &labels, &group, 0, usize::MAX);
    let others = |i: &&u32| scene.neighbours(**i as usize).iter().any(|&j| labels[j as usize] != 0);
    assert_eq!(core.len(), group.len() - group.iter().filter(others).count());
    assert!(core.len() < group.len() && core.iter().all(|p| p.x < 0.0));
    // A strip without a core stands for itself.
    let strip: Vec<u32> =
        group.iter().copied().filter(|i| scene.points[*i as usize].x > -0.1).collect();
    assert_eq!(take_core(&scene, &labels, &strip, 0, usize::MAX).0.len(), strip.len());
}
