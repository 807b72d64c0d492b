use crate::fit::Ruler;
use crate::geometry::Vec3;
use crate::segment::Silent;
use crate::segment::fixtures::{SIGMA, partition, plane, ramp, roof, sheet};
use crate::segment::label::around::{Around, CHUNK};
use crate::segment::label::asked::Asked;
use crate::segment::label::energy::Energies;
use crate::segment::label::labelling::Labelling;
use crate::segment::label::relabel::{SceneLabels, best_label, relabel};
use crate::segment::label::shares::{posterior, shares};
use crate::segment::label::spread::spread;
use crate::segment::prepare::place::place;
use crate::segment::prepare::scene::Scene;

const INVERSE: f64 = 1.0 / (SIGMA * SIGMA);

fn blocks(scene: &Scene) -> Vec<usize> {
    (0..scene.len().div_ceil(super::blocks::BLOCK)).collect()
}

fn wrong(labels: &[i32], truth: &[i32]) -> usize {
    labels.iter().zip(truth).filter(|(a, b)| a != b).count()
}

/// The nearest surface's label, by the point alone.
fn nearest(scene: &Scene, rulers: &[Ruler]) -> Vec<i32> {
    let of = |p: &Vec3| {
        let by = |a: &usize, b: &usize| {
            rulers[*a].distance(p).abs().total_cmp(&rulers[*b].distance(p).abs())
        };
        (0..rulers.len()).min_by(by).map_or(-1, |l| l as i32)
    };
    scene.points.iter().map(of).collect()
}

/// Label, evidence and cost of others around, by the definition: neighbours say at most `cut` each.
fn slow(of: &SceneLabels, i: u32, cut: f64) -> Vec<(i32, f64, f64)> {
    let near = of.neighbours(i);
    let mut met = vec![of.label(i)];
    met.extend(near.iter().map(|&j| of.label(j)));
    let mut seen = Vec::new();
    met.retain(|l| *l >= 0 && !seen.contains(l) && (seen.push(*l), true).1);
    let least = |j: u32| met.iter().map(|&l| of.sq(l, j)).fold(f64::INFINITY, f64::min);
    let evidence = |l: i32| near.iter().map(|&j| (of.sq(l, j) - least(j)).min(cut)).sum::<f64>();
    let others = |l: i32| near.iter().filter(|&&j| of.label(j) != l).count() as f64;
    let within = met.iter().filter(|&&l| of.sq(l, i) <= 16.0);
    within.map(|&l| (l, of.sq(l, i) + evidence(l), 0.3 * others(l))).collect()
}

#[test]
fn the_energy_of_a_label_is_its_own_residual_what_neighbours_say_and_a_little_for_each_other_label()
{
    // A neighbour says at most 16 where surfaces join smoothly, and 1 where they meet at an edge.
    for ((scene, shapes, labels), cut) in [(ramp(4000, 40.0), 16.0), (roof(4000, 1.0), 1.0)] {
        let rulers: Vec<Ruler> = shapes.iter().map(Ruler::of).collect();
        let of = SceneLabels { scene: &scene, rulers: &rulers, labels: &labels, inverse: INVERSE };
        let beside = |i: &u32| {
            let p = &scene.points[*i as usize];
            p.x.abs() < 0.3 && (1.0..9.0).contains(&p.y)
        };
        let mut several = 0;
        for i in (0..scene.len() as u32).filter(beside) {
            let expected = slow(&of, i, cut);
            let found = Energies::near(&of, i);
            assert_eq!(found.iter().count(), expected.len());
            for (e, (label, evidence, against)) in found.iter().zip(&expected) {
                assert_eq!(e.label, *label);
                assert!((e.evidence - evidence).abs() < 1e-6 * (1.0 + evidence), "{i}: {e:?}");
                assert!((e.against - against).abs() < 1e-12);
            }
            several += usize::from(expected.len() > 1);
        }
        assert!(several >= 10, "{several}");
    }
}

#[test]
fn neighbours_place_a_smooth_joint_better_than_each_point_alone() {
    let (scene, shapes, truth) = ramp(4000, 40.0);
    let rulers: Vec<Ruler> = shapes.iter().map(Ruler::of).collect();
    let alone = nearest(&scene, &rulers);
    let mut labels = alone.clone();
    assert_eq!(relabel(&scene, &shapes, &mut labels, SIGMA, 50, &blocks(&scene)), 0);
    let (before, after) = (wrong(&alone, &truth), wrong(&labels, &truth));
    // A tenth, with a margin.
    assert!(after * 8 < before, "{after} of {before}");
}

#[test]
fn an_edge_is_placed_by_the_points_themselves() {
    let (scene, shapes, truth) = roof(4000, 1.0);
    let mut labels: Vec<i32> = scene.points.iter().map(|p| i32::from(p.x > 1.0)).collect();
    relabel(&scene, &shapes, &mut labels, SIGMA, 50, &blocks(&scene));
    // Only points on both surfaces, nearer to the edge than the noise, may be either's.
    let far = |(k, l): (usize, &i32)| *l != truth[k] && scene.points[k].x.abs() > 3.0 * SIGMA;
    // Noise beyond four sigmas, 6e-5 of the points, has no label.
    assert!(labels.iter().enumerate().filter(|(k, l)| far((*k, *l))).count() <= 1);
}

#[test]
fn labels_at_rest_are_the_best_and_blocks_that_are_not_open_are_left_alone() {
    let (scene, shapes, truth) = ramp(4000, 40.0);
    let moved: Vec<i32> = scene.points.iter().map(|p| i32::from(p.x > 2.0)).collect();
    let mut labels = moved.clone();
    assert_eq!(relabel(&scene, &shapes, &mut labels, SIGMA, 50, &[]), 0);
    assert_eq!(labels, moved);
    assert!(relabel(&scene, &shapes, &mut labels, SIGMA, 1, &blocks(&scene)) > 0);
    relabel(&scene, &shapes, &mut labels, SIGMA, 50, &blocks(&scene));
    let rulers: Vec<Ruler> = shapes.iter().map(Ruler::of).collect();
    let of = SceneLabels { scene: &scene, rulers: &rulers, labels: &labels, inverse: INVERSE };
    assert!((0..scene.len() as u32).all(|i| best_label(&of, i) == labels[i as usize]));
    assert!(wrong(&labels, &truth) * 15 < wrong(&moved, &truth));
}

#[test]
fn a_point_beyond_four_sigmas_has_no_label() {
    let off = |x: f64, far: f64| if x.abs() < 0.5 { far * SIGMA } else { 0.0 };
    for (far, labelled) in [(0.0, true), (9.0, false)] {
        let scene = sheet(2000, |x| off(x, far));
        let mut labels = vec![0; scene.len()];
        let shapes = [plane(Vec3::zeros(), Vec3::z())];
        relabel(&scene, &shapes, &mut labels, SIGMA, 50, &blocks(&scene));
        let middle = |p: &Vec3| p.x.abs() < 0.5;
        let none = |k: usize| labels[k] < 0 && scene.points[k].z.abs() > 4.0 * SIGMA;
        let inside = (0..scene.len()).filter(|&k| middle(&scene.points[k]));
        let share = inside.clone().filter(|&k| none(k)).count() as f64 / inside.count() as f64;
        assert!(if labelled { share < 0.01 } else { share > 0.999 }, "{far}: {share}");
    }
}

#[test]
fn a_point_between_counts_for_both_by_the_evidence_and_one_far_from_the_joint_for_one() {
    let (scene, shapes, truth) = ramp(4000, 40.0);
    let all = shares(&scene, &partition(shapes.clone(), truth.clone()), SIGMA);
    let rulers: Vec<Ruler> = shapes.iter().map(Ruler::of).collect();
    let of = SceneLabels { scene: &scene, rulers: &rulers, labels: &truth, inverse: INVERSE };
    assert!(all.len() > 20, "{}", all.len());
    for (i, share) in &all {
        assert!((share.iter().map(|s| s.1).sum::<f64>() - 1.0).abs() < 0.011);
        assert!(scene.points[*i as usize].x.abs() < 2.0);
        let energies: Vec<_> = Energies::at(&of, *i).iter().map(|e| e.evidence).collect();
        if let ([a, b], [(_, p), (_, q)]) = (&energies[..], &share[..]) {
            assert!(((p / q).ln() + 0.5 * (a - b)).abs() < 1e-9);
        }
        assert_eq!(share, &posterior(&Energies::at(&of, *i)));
    }
}

#[test]
fn a_cloud_takes_its_labels_from_its_sample() {
    let (cloud, shapes, truth) = roof(20_000, 1.0);
    let mut points = cloud.points.clone();
    let outlier = points.len() / 3;
    points[outlier].z += 20.0 * SIGMA;
    let m = points.len() / 5;
    let places: Vec<u32> = (0..m).map(|k| place(k, m, points.len()) as u32).collect();
    let labels = places.iter().map(|&i| truth[i as usize]).collect();
    let taken = places.iter().map(|&i| points[i as usize]).collect();
    let sample = Scene::new(taken).taken_from(places);
    let model = partition(shapes, labels);
    let found = spread(&points, &sample, &model, SIGMA, &Silent).unwrap();
    assert_eq!(found.labels[outlier], -1);
    let far = |k: &usize| points[*k].x.abs() > 3.0 * SIGMA && *k != outlier;
    let other = (0..points.len()).filter(far).filter(|&k| found.labels[k] != truth[k]);
    // Noise beyond four sigmas: 6e-5 of the points.
    assert!(other.count() <= 5);
    assert!(found.shares.iter().all(|(i, _)| points[*i as usize].x.abs() < 20.0 * SIGMA));
    assert!(!found.shares.is_empty());
}

#[test]
fn the_points_asked_are_rings_of_the_graph_each_once() {
    let (scene, shapes, labels) = roof(4000, 1.0);
    let rulers: Vec<Ruler> = shapes.iter().map(Ruler::of).collect();
    let of = SceneLabels { scene: &scene, rulers: &rulers, labels: &labels, inverse: INVERSE };
    for i in (0..scene.len() as u32).step_by(97) {
        let mut asked = Asked::of(i, of.neighbours(i));
        let mut known: Vec<u32> = of.neighbours(i).iter().copied().chain([i]).collect();
        let mut ring = of.neighbours(i).to_vec();
        for _ in 0..2 {
            let mut next = Vec::new();
            for j in ring.iter().flat_map(|&k| of.neighbours(k).iter().copied()) {
                if !known.contains(&j) {
                    known.push(j);
                    next.push(j);
                }
            }
            assert_eq!(asked.widen(&of), next);
            ring = next;
        }
    }
}

#[test]
fn the_labels_around_a_point_are_its_own_and_its_neighbours_in_every_chunk() {
    let (scene, _, mut labels) = roof(CHUNK + 500, 1.0);
    labels.iter_mut().step_by(50).for_each(|l| *l = -1);
    let around = Around::of(&scene, &labels);
    assert_eq!(around.len(), scene.len());
    let sorted = |mut v: Vec<i32>| {
        v.sort_unstable();
        v.dedup();
        v.retain(|l| *l >= 0);
        v
    };
    let own = |i: usize| {
        let near = scene.neighbours(i).iter().map(|&j| labels[j as usize]);
        near.chain([labels[i]]).collect::<Vec<_>>()
    };
    let mut beside = Vec::new();
    for i in 0..scene.len() {
        assert_eq!(sorted(around.at(i).to_vec()), sorted(own(i)));
        assert_eq!(around.at(i).len(), sorted(own(i)).len());
        around.beside(i, &mut beside);
        let three = i.saturating_sub(1)..(i + 2).min(scene.len());
        assert_eq!(sorted(beside.clone()), sorted(three.flat_map(own).collect()));
    }
}
