use crate::fit::Shape;
use crate::geometry::Vec3;
use crate::segment::fixtures::{SIGMA, families, plane, roof};
use crate::segment::grow::hypothesis::{Hypothesis, grow};
use crate::segment::grow::select::select;
use crate::segment::grow::start::{Start, start_set};
use crate::segment::grow::walk::Walk;
use crate::segment::prepare::scene::Scene;

fn hypothesis(scene: &Scene, shape: Shape, sound: bool, own: impl Fn(&Vec3) -> bool) -> Hypothesis {
    let inside = |i: &u32| own(&scene.points[*i as usize]);
    let support = (0..scene.len() as u32).filter(inside).collect();
    Hypothesis { shape, support, correlation: 0.0, sound }
}

#[test]
fn of_overlapping_hypotheses_those_are_chosen_that_describe_the_points_for_least() {
    let (scene, shapes, truth) = roof(3000, 1.0);
    let all = vec![
        // Half of a surface, one that bridges both, the two themselves, one of them again, and one too small.
        hypothesis(&scene, shapes[0], true, |p| p.x < -5.0),
        hypothesis(&scene, plane(Vec3::zeros(), Vec3::z()), false, |p| p.x < 0.02),
        hypothesis(&scene, shapes[0], true, |p| p.x <= 0.0),
        hypothesis(&scene, shapes[1], true, |p| p.x > 0.0),
        hypothesis(&scene, shapes[1], true, |p| p.x > 0.0 && p.y < 9.9),
        hypothesis(&scene, shapes[1], true, |p| p.x > 0.0 && p.y < 0.05),
    ];
    let (chosen, labels) = select(&scene, all, SIGMA, 0, 40);
    let supports: Vec<usize> = chosen.iter().map(|h| h.support.len()).collect();
    let count = |l: i32| truth.iter().filter(|t| **t == l).count();
    let mut expected = [count(0), count(1)];
    expected.sort_unstable_by(|a, b| b.cmp(a));
    assert_eq!(supports, expected);
    let first = if count(0) >= count(1) { 0 } else { 1 };
    assert!(labels.iter().zip(&truth).all(|(l, t)| *l == (t ^ first)));
}

#[test]
fn a_start_set_goes_round_no_edge_and_has_the_size_asked() {
    let (scene, ..) = roof(4000, 3.0);
    let mut walk = Walk::new(scene.len());
    let inner = |i: &usize| {
        let p = &scene.points[*i];
        p.x < -0.6 && p.x > -3.0 && (2.0..8.0).contains(&p.y)
    };
    // Rising points beyond the few whose neighbourhoods lie across the edge.
    let beyond = |set: &[u32]| set.iter().filter(|&&i| scene.points[i as usize].z > 0.6).count();
    let (mut tangent, mut any) = (0, 0);
    for seed in (0..scene.len()).filter(inner).step_by(7) {
        let set = start_set(&scene, &mut walk, seed, Start::Tangent, 160, SIGMA);
        assert_eq!(set.len(), 160);
        tangent += beyond(&set);
        let all = start_set(&scene, &mut walk, seed, Start::Any, 160, SIGMA);
        assert_eq!(all.len(), 160);
        any += beyond(&all);
        let flat = start_set(&scene, &mut walk, seed, Start::Flat, 24, SIGMA);
        let off =
            |i: &u32| (scene.points[*i as usize] - scene.points[seed]).dot(&scene.normals[seed]);
        assert!(flat.len() <= 24 && flat.iter().all(|i| off(i).abs() < 3.0 * SIGMA));
    }
    // A third, with a margin.
    assert!(tangent * 5 < any * 2, "{tangent} {any}");
}

#[test]
fn a_hypothesis_grows_over_its_whole_face_and_stops_at_the_edge() {
    let (scene, shapes, truth) = roof(4000, 1.0);
    let mut walk = Walk::new(scene.len());
    for seed in (0..scene.len()).step_by(397) {
        if scene.points[seed].x.abs() < 0.5 {
            continue;
        }
        let own = truth[seed];
        let grown = grow(&scene, &mut walk, &families(), seed, 40).unwrap();
        let right = grown.support.iter().filter(|&&i| truth[i as usize] == own).count();
        let whole = truth.iter().filter(|t| **t == own).count();
        // Three sigmas hold 99.7 %; beyond the edge they reach 4 sigmas far.
        assert!(right as f64 > 0.99 * whole as f64, "{right} of {whole}");
        assert!(grown.support.len() - right < 16, "{}", grown.support.len() - right);
        assert!(grown.sound);
        // Either side may be a plane's outer one.
        let truth = &shapes[own as usize];
        let off = |p: &Vec3| (grown.shape.distance(p).abs() - truth.distance(p).abs()).abs();
        let most = grown.support.iter().map(|&i| off(&scene.points[i as usize]));
        let most = most.fold(0.0, f64::max) / SIGMA;
        // A plane of 400 points is known to 0.2 sigma at its rim.
        assert!(most < 0.5, "{most}");
    }
}

#[test]
fn walls_nearer_to_each_other_than_their_points_are_each_a_plane() {
    let gap = 6.0 * SIGMA;
    let mut random = crate::fit::fits::Random::new(3);
    // Within a gap a point has as many neighbours on the other wall as on its own, and an ellipse runs along both.
    let mut at = |k: usize| {
        let height = if k.is_multiple_of(2) { 0.0 } else { gap };
        let (x, y) = (random.uniform(0.0, 1.0), random.uniform(0.0, 1.0));
        Vec3::new(80.0 * gap * x, 80.0 * gap * y, height + SIGMA * random.normal())
    };
    let points: Vec<Vec3> = (0..4000).map(&mut at).collect();
    let scene = Scene::new(crate::segment::fixtures::ordered(&points));
    let mut walk = Walk::new(scene.len());
    let grown = (0..scene.len()).step_by(37);
    let grown = grown.filter_map(|seed| grow(&scene, &mut walk, &families(), seed, 40));
    let (mut sound, mut all) = (0, 0);
    for h in grown.filter(|h| h.support.len() > 1000) {
        let upper = h.support.iter().filter(|&&i| scene.points[i as usize].z > 0.5 * gap);
        let share = upper.count() as f64 / h.support.len() as f64;
        assert!(!h.sound || !(0.01..=0.99).contains(&share), "{share} of {}", h.support.len());
        sound += usize::from(h.sound);
        all += 1;
    }
    assert!(sound * 10 > all * 9 && all > 50, "{sound} of {all}");
}

#[test]
fn points_in_a_volume_grow_into_nothing() {
    let mut random = crate::fit::fits::Random::new(5);
    let mut side = || random.uniform(0.0, 10.0);
    let points: Vec<Vec3> = (0..3000).map(|_| Vec3::new(side(), side(), side())).collect();
    let scene = Scene::new(crate::segment::fixtures::ordered(&points));
    let mut walk = Walk::new(scene.len());
    let grown = (0..scene.len()).step_by(150);
    let grown = grown.filter_map(|seed| grow(&scene, &mut walk, &families(), seed, 40)).count();
    assert_eq!(grown, 0);
}
