use std::f64::consts::TAU;

use crate::fit::fits::Random;
use crate::fit::{Family, Ruler, Shape};
use crate::geometry::Vec3;
use crate::segment::Silent;
use crate::segment::fixtures::{SIGMA, families, ordered, partition, plane, roof, sheet};
use crate::segment::moves::memo::{Memo, Move};
use crate::segment::moves::pieces::large_pieces;
use crate::segment::moves::remove::remove_needless;
use crate::segment::moves::retype::retype;
use crate::segment::moves::settle::settle;
use crate::segment::moves::trial::{Place, Trial};
use crate::segment::moves::{SETTLED, improve};
use crate::segment::objective::DOUBT;
use crate::segment::partition::{Partition, members};
use crate::segment::prepare::scene::Scene;

/// Largest distance between two surfaces at the places of a label's points, in sigmas.
fn apart(scene: &Scene, labels: &[i32], label: i32, a: &Shape, b: &Shape) -> f64 {
    let own = scene.points.iter().zip(labels).filter(|(_, l)| **l == label);
    own.map(|(p, _)| (a.distance(p) - b.distance(p)).abs()).fold(0.0, f64::max) / SIGMA
}

/// `n` points of half a cylinder, radius 5 and 20 long, with noise.
fn half_cylinder(n: usize) -> Scene<'static> {
    let mut random = Random::new(3);
    let mut point = || {
        let (turn, r) = (random.uniform(0.0, TAU / 2.0), 5.0 + SIGMA * random.normal());
        Vec3::new(r * turn.cos(), random.uniform(-10.0, 10.0), r * turn.sin())
    };
    Scene::new(ordered(&(0..n).map(|_| point()).collect::<Vec<_>>()))
}

fn cylinder(family: Family, size: [f64; 3]) -> Shape {
    Shape::with_axis(family, Vec3::zeros(), Vec3::y(), size)
}

#[test]
fn settling_brings_a_wrong_border_and_tilted_surfaces_to_where_they_belong() {
    let (scene, truth, labels) = roof(6000, 1.0);
    let wrong = scene.points.iter().map(|p| i32::from(p.x > 0.8)).collect();
    let tilted = [Vec3::new(0.004, 0.002, 1.0), Vec3::new(-1.0, 0.004, 1.004)];
    let shapes = tilted.map(|w| plane(Vec3::new(0.0, 0.0, 0.02), w)).to_vec();
    let mut model = partition(shapes, wrong);
    settle(&scene, &mut model, SIGMA, 8);
    let other = labels.iter().zip(&model.labels).filter(|(a, b)| a != b).count();
    assert!(other <= 12, "{other}");
    for l in 0..2 {
        // The mean of 3000 points is known to 0.02 sigma, the rim of their plane to 0.04.
        let off = apart(&scene, &labels, l, &truth[l as usize], &model.shapes[l as usize]);
        assert!(off < 0.1, "{l}: {off}");
    }
    // At rest nothing is open and nothing is left to fit.
    let before = (model.labels.clone(), model.shapes.clone());
    settle(&scene, &mut model, SIGMA, 8);
    assert!(before == (model.labels, model.shapes));
}

#[test]
fn a_surface_becomes_the_family_that_explains_its_points_for_least() {
    let scene = half_cylinder(3000);
    for (family, size, retyped) in [
        (Family::Cylinder, [5.0, 0.0, 0.0], 0),
        (Family::EllipticCylinder, [5.003, 4.998, 0.0], 1),
        (Family::Cone, [5.0, 0.0005, 0.0], 1),
    ] {
        let mut model = partition(vec![cylinder(family, size)], vec![0; scene.len()]);
        settle(&scene, &mut model, SIGMA, 2);
        assert_eq!(retype(&scene, &mut model, &families()), retyped, "{family:?}");
        let found = model.shapes[0];
        assert_eq!(found.family, Family::Cylinder);
        // Known to 0.04 sigma.
        assert!((found.size[0] - 5.0).abs() < 0.15 * SIGMA, "{}", found.size[0]);
        assert_eq!(retype(&scene, &mut model, &families()), 0);
    }
}

#[test]
fn a_family_that_is_not_allowed_is_not_put_in() {
    let scene = half_cylinder(3000);
    let start = cylinder(Family::EllipticCylinder, [5.003, 4.998, 0.0]);
    let mut families = families();
    families.allowed.retain(|f| *f != Family::Cylinder);
    let mut model = partition(vec![start], vec![0; scene.len()]);
    settle(&scene, &mut model, SIGMA, 2);
    retype(&scene, &mut model, &families);
    assert_ne!(model.shapes[0].family, Family::Cylinder);
}

/// A floor with a patch of 200 points or so, `height` sigmas above it, that has a label of its own.
fn patch(height: f64) -> (Scene<'static>, Vec<Shape>, Vec<i32>) {
    let inside = |x: f64| (2.0..3.0).contains(&x);
    let scene = sheet(4000, |x| if inside(x) { height * SIGMA } else { 0.0 });
    let own = |p: &Vec3| i32::from(inside(p.x));
    let labels = scene.points.iter().map(own).collect();
    let shapes = [0.0, height * SIGMA].map(|z| plane(Vec3::new(0.0, 0.0, z), Vec3::z()));
    (scene, shapes.to_vec(), labels)
}

#[test]
fn a_surface_goes_where_its_neighbour_explains_its_points_for_less_and_stays_where_not() {
    for (height, gone) in [(0.0, 1), (0.5, 1), (6.0, 0)] {
        let (scene, shapes, labels) = patch(height);
        let mut model = partition(shapes, labels.clone());
        assert_eq!(remove_needless(&scene, &mut model, &families()), gone, "{height}");
        assert_eq!(model.shapes.len(), 2 - gone);
        let expected = if gone > 0 { vec![0; scene.len()] } else { labels };
        let other = model.labels.iter().zip(&expected).filter(|(a, b)| a != b).count();
        // Noise beyond four sigmas belongs to nothing.
        assert!(other <= 1, "{height}: {other}");
        assert_eq!(remove_needless(&scene, &mut model, &families()), 0);
    }
}

#[test]
fn a_region_without_points_goes() {
    let (scene, shapes, labels) = patch(6.0);
    let mut model = partition([&shapes[..], &shapes[..1]].concat(), labels.clone());
    assert_eq!(remove_needless(&scene, &mut model, &families()), 1);
    assert_eq!((model.shapes, model.labels), (shapes, labels));
}

#[test]
fn what_was_tried_in_vain_is_known_until_a_region_that_it_was_tried_on_changes() {
    let (scene, shapes, labels) = roof(1000, 1.0);
    let mut model = partition([&shapes[..], &[plane(Vec3::x(), Vec3::y())]].concat(), labels);
    model.note(&scene, SIGMA);
    let key = |model: &crate::segment::partition::Partition, kind, others: &[usize]| {
        Memo::key(&model.changes, kind, 0, others.iter().copied())
    };
    let tried = key(&model, Move::Merge, &[1, 2]);
    model.vain.add(vec![tried.clone()], &[None::<()>]);
    for (kind, others, known) in [
        (Move::Merge, [1, 2], true),
        (Move::Merge, [2, 1], true),
        (Move::Swap, [1, 2], false),
        (Move::Merge, [1, 1], false),
    ] {
        assert_eq!(model.vain.is_vain(key(&model, kind, &others).as_ref()), known, "{others:?}");
    }
    assert!(!model.vain.is_vain(None));
    assert_eq!(key(&model, Move::Merge, &[7]), None);
    model.shapes[2].origin.z += 1.0;
    model.note(&scene, SIGMA);
    assert!(!model.vain.is_vain(key(&model, Move::Merge, &[1, 2]).as_ref()));
    assert!(model.vain.is_vain(tried.as_ref()));
    model.vain.clear();
    assert!(!model.vain.is_vain(tried.as_ref()));
}

#[test]
fn the_pieces_of_a_region_part_at_gaps_and_at_edges() {
    let (scene, shapes, labels) = roof(4000, 1.0);
    // One surface all over: neither gap nor edge.
    let all: Vec<u32> = (0..scene.len() as u32).collect();
    assert_eq!(large_pieces(&scene, &shapes[0], &all), None);
    let gap = |i: &u32| scene.points[*i as usize].x.abs() > 1.0;
    let two: Vec<u32> = all.iter().copied().filter(gap).collect();
    let pieces = large_pieces(&scene, &shapes[0], &two).unwrap();
    let sides = [1, 0].map(|l| {
        let own = |i: &u32| labels[*i as usize] == l;
        two.iter().copied().filter(own).collect::<Vec<_>>()
    });
    let mut expected = sides.to_vec();
    expected.sort_by_key(|s| std::cmp::Reverse(s.len()));
    assert_eq!(pieces, expected);
    // A surface that turns sharply: the normals of a narrow cylinder along the edge.
    let narrow = Shape::with_axis(Family::Cylinder, Vec3::zeros(), Vec3::y(), [0.1, 0.0, 0.0]);
    let pieces = large_pieces(&scene, &narrow, &all).unwrap();
    assert!(pieces.iter().take(2).all(|p| p.len() > 1000));
}

#[test]
fn a_trial_costs_least_with_the_true_surface_and_leaves_no_trace() {
    let (scene, shapes, labels) = roof(4000, 1.0);
    let model = partition(shapes.clone(), labels);
    let rulers: Vec<Ruler> = model.shapes.iter().map(Ruler::of).collect();
    let group = &members(&model.labels, 2)[1];
    let mut slot = vec![0; scene.len()];
    let place = Place::new(&scene, &model, &rulers, 1, group, &mut slot, &families());
    let cost = |shape: &Shape, refit| Trial::new(&place).run(shape, SIGMA, refit);
    let (truth, _) = cost(&shapes[1], false);
    // The residuals of the region and of three rings around it, each by its own surface, as nothing moves but
    // a point or two at the edge.
    let mut around = group.clone();
    for _ in 0..3 {
        let beside = |&i: &u32| scene.neighbours(i as usize).iter().copied().chain([i]);
        around = around.iter().flat_map(beside).collect();
        around.sort_unstable();
        around.dedup();
    }
    let sq = |&i: &u32| {
        let own = model.labels[i as usize] as usize;
        (shapes[own].distance(&scene.points[i as usize]) / SIGMA).powi(2)
    };
    let expected =
        around.iter().map(sq).sum::<f64>() + Family::Plane.description_length(group.len());
    assert!((truth - expected).abs() < 5.0, "{truth} {expected}");
    let tilted = plane(Vec3::zeros(), Vec3::new(-1.0, 0.003, 1.002));
    let (worse, same) = cost(&tilted, false);
    assert!(worse > truth + 100.0 && same == tilted, "{worse} {truth}");
    let (fitted, shape) = cost(&tilted, true);
    assert!(fitted < truth + 1.0, "{fitted} {truth}");
    assert!(apart(&scene, &model.labels, 1, &shape, &shapes[1]) < 0.3);
    place.leave();
    assert!(slot.iter().all(|s| *s == 0));
}

/// Faces of a box with a bore, cut into random wrong regions.
fn muddled(seed: u64) -> (Scene<'static>, Partition) {
    let random = &mut Random::new(seed);
    let points: Vec<Vec3> = (0..6000)
        .map(|k| {
            let (u, v) = (random.uniform(0.0, 20.0), random.uniform(0.0, 10.0));
            let e = SIGMA * random.normal();
            let (sin, cos) = (0.3 * u).sin_cos();
            match k % 3 {
                0 => Vec3::new(u, v, e),
                1 => Vec3::new(u, e, v),
                _ => Vec3::new(30.0 + (4.0 + e) * cos, (4.0 + e) * sin, v),
            }
        })
        .collect();
    let points = ordered(&points);
    let mut plane = |normal: Vec3, x: f64| {
        let tilt = 0.01 * Vec3::new(random.normal(), random.normal(), random.normal());
        let at = Vec3::new(x, 5.0 * normal.z, 5.0 * normal.y);
        Shape::with_axis(Family::Plane, at, (normal + tilt).normalize(), [0.0; 3])
    };
    let mut shapes: Vec<Shape> = [5.0, 15.0].map(|x| plane(Vec3::z(), x)).to_vec();
    shapes.extend([5.0, 15.0].map(|x| plane(Vec3::y(), x)));
    let bore = Vec3::new(30.0, 0.0, 0.0);
    shapes.push(Shape::with_axis(Family::Cone, bore, Vec3::z(), [4.0, 0.001, 0.0]));
    let label = |p: &Vec3| match p.x {
        x if x > 25.0 => 4,
        x => i32::from(x > 10.0) + 2 * i32::from(p.y.abs() < p.z.abs()),
    };
    let labels = points.iter().map(label).collect();
    (Scene::new(points), partition(shapes, labels))
}

#[test]
fn no_round_of_moves_makes_the_description_longer() {
    for seed in 0..6 {
        let (families, (scene, mut model)) = (families(), muddled(seed));
        settle(&scene, &mut model, families.sigma, SETTLED.get());
        let mut before = model.energy(&scene, families.sigma);
        for _ in 0..3 {
            improve(&scene, &mut model, &families, &Silent).unwrap();
            let after = model.energy(&scene, families.sigma);
            assert!(after <= before + DOUBT.get(), "{seed}: {before} {after}");
            before = after;
        }
        let found: Vec<Family> = model.shapes.iter().map(|s| s.family).collect();
        assert_eq!(found.len(), 3, "{seed}: {found:?}");
        assert_eq!(found.iter().filter(|f| **f == Family::Cylinder).count(), 1, "{found:?}");
    }
}
