use nalgebra::DMatrix;

use super::super::constraint::{Section, Slot};
use super::*;
use crate::fit::Family;
use crate::geometry::Vec3;

fn face(region: usize, shape: Shape, deviation: f64) -> Face {
    let dof = shape.family.dof();
    // correlated, and unlike in all degrees of freedom
    let root = DMatrix::from_fn(dof, dof, |i, j| match i.cmp(&j) {
        std::cmp::Ordering::Equal => 1.0 + 0.3 * i as f64,
        std::cmp::Ordering::Greater => 0.2,
        std::cmp::Ordering::Less => 0.0,
    });
    let covariance = &root * root.transpose() * (deviation * deviation);
    Face { region, shape, covariance, is_round: true, patch: None, reach: 0.1 }
}

fn scene() -> Vec<Face> {
    let tube = |at: Vec3, w: Vec3, r: f64| Shape::with_axis(Family::Cylinder, at, w, [r, 0.0, 0.0]);
    let plane = |at: Vec3, w: Vec3| Shape::with_axis(Family::Plane, at, w, [0.0; 3]);
    vec![
        face(0, tube(Vec3::new(0.1, 0.2, 0.0), Vec3::new(0.001, 0.0, 1.0), 0.1), 1e-3),
        face(1, tube(Vec3::new(0.101, 0.199, 0.3), Vec3::new(0.0, -0.001, -1.0), 0.101), 2e-3),
        face(2, plane(Vec3::new(0.2, 0.3, 0.1), Vec3::new(1.0, 0.001, 0.001)), 1e-3),
        face(3, plane(Vec3::new(0.3, -0.2, 0.2), Vec3::new(0.002, 1.0, 0.0)), 3e-3),
    ]
}

fn constraints() -> Vec<Constraint> {
    let radius = |face: usize| Slot { face, size: 0 };
    vec![
        Constraint::Parallel([0, 1]),
        Constraint::Perpendicular([0, 2]),
        Constraint::Perpendicular([2, 3]),
        Constraint::OnAxis([0, 1]),
        Constraint::Equal([radius(0), radius(1)]),
        Constraint::Tangent { faces: [0, 2], section: Section::Across, outside: false },
    ]
}

fn add(joint: &mut Joint, all: &[Constraint]) -> Vec<Innovation> {
    all.iter().map(|c| joint.add(c)).collect()
}

/// Steps of least chi-squared that meet all rows at once, from the pseudo-inverse of the whole matrix.
fn dense(faces: &[Face], constraints: &[Constraint]) -> (Vec<f64>, f64) {
    let first: Vec<usize> = faces
        .iter()
        .scan(0, |at, f| {
            *at += f.shape.family.dof();
            Some(*at - f.shape.family.dof())
        })
        .collect();
    let n = first[faces.len() - 1] + faces[faces.len() - 1].shape.family.dof();
    let mut c = DMatrix::zeros(n, n);
    for (face, &at) in faces.iter().zip(&first) {
        let dof = face.shape.family.dof();
        c.view_mut((at, at), (dof, dof)).copy_from(&face.covariance);
    }
    let all = |x: &[f64]| -> Vec<f64> {
        let shape = |k: usize| {
            let dof = faces[k].shape.family.dof();
            faces[k].shape.stepped(&x[first[k]..first[k] + dof]).unwrap()
        };
        constraints.iter().flat_map(|c| c.residuals(&shape)).collect()
    };
    let r = all(&vec![0.0; n]);
    let column = |d: usize| {
        let at = |h: f64| {
            let mut x = vec![0.0; n];
            x[d] = h;
            all(&x)
        };
        let (after, before) = (at(1e-5), at(-1e-5));
        after.iter().zip(&before).map(|(a, b)| (a - b) / 2e-5).collect::<Vec<_>>()
    };
    let a =
        DMatrix::from_columns(&(0..n).map(|d| DVector::from_vec(column(d))).collect::<Vec<_>>());
    let r = DVector::from_vec(r);
    let square = &a * &c * a.transpose();
    let inverse = square.clone().pseudo_inverse(1e-12 * square.norm()).unwrap();
    let steps = -(&c * a.transpose() * &inverse * &r);
    (steps.iter().copied().collect(), r.dot(&(&inverse * &r)))
}

#[test]
fn equations_one_by_one_lead_to_the_solution_of_all_at_once() {
    let (faces, constraints) = (scene(), constraints());
    let mut joint = Joint::new(&faces);
    let told: Vec<Innovation> = constraints.iter().map(|c| joint.add(c)).collect();
    assert_eq!(told.iter().map(|t| t.rank).collect::<Vec<_>>(), [2, 1, 1, 2, 1, 1]);
    let (steps, chi2) = joint.solved();
    let (expected, total) = dense(&faces, &constraints);
    let steps: Vec<f64> = steps.iter().flat_map(|s| s.iter().copied()).collect();
    for (a, b) in steps.iter().zip(&expected) {
        assert!((a - b).abs() < 1e-8, "{steps:?} {expected:?}");
    }
    assert!((joint.chi2() - total).abs() < 1e-6 * total);
    assert!((told.iter().map(|t| t.chi2).sum::<f64>() - total).abs() < 1e-6 * total);
    assert!((chi2.iter().sum::<f64>() - total).abs() < 1e-6 * total);
}

#[test]
fn an_equation_that_follows_adds_nothing_and_one_that_contradicts_is_seen() {
    let faces = scene();
    let mut joint = Joint::new(&faces);
    add(&mut joint, &constraints());
    // settled, the second tube is perpendicular to the plane's normal and tangent to the plane by itself
    let steps = joint.solved().0;
    let off = farthest(&faces, &steps, constraints().iter());
    assert!(off < 1e-4, "{off}");
    let mut joint = Joint::beside(&faces, steps, Some(off));
    add(&mut joint, &constraints());
    let rank = joint.rank();
    let tangent = Constraint::Tangent { faces: [1, 2], section: Section::Across, outside: false };
    let told = add(&mut joint, &[Constraint::Perpendicular([1, 2]), tangent]);
    assert!(told.iter().all(|t| t.rank == 0 && t.contradiction < 0.1), "{told:?}");
    // touching from the other side would take the tube a diameter away
    let told = joint.add(&Constraint::InPlane([2, 0]));
    assert!(told.rank == 0 && told.contradiction > 10.0 || told.chi2 > 100.0, "{told:?}");
    joint.truncate(rank);
    assert_eq!(joint.rank(), rank);
}

#[test]
fn what_is_taken_away_leaves_no_trace() {
    let faces = scene();
    let all = constraints();
    let mut once = Joint::new(&faces);
    add(&mut once, &all);
    let mut twice = Joint::new(&faces);
    add(&mut twice, &all[..2]);
    let rank = twice.rank();
    add(&mut twice, &all[3..]);
    twice.truncate(rank);
    add(&mut twice, &all[2..]);
    assert_eq!(once.solved().0, twice.solved().0);
}
