//! Meshes of CAD programs and of scans.

use std::f64::consts::TAU;

use super::*;
use crate::formats::Limits;

pub(in crate::formats) type Corners = (Vec<Vec3>, Vec<[u32; 3]>);

/// The cloud of a mesh.
pub(in crate::formats) fn cloud_of((points, faces): &Corners, how: &Meshes) -> PointCloud {
    let mut all = Faces::default();
    faces.iter().for_each(|face| all.push(face));
    cloud(points.clone(), &all, how, &Limits::default()).unwrap()
}

pub(in crate::formats) fn is_sampled(mesh: &Corners) -> bool {
    let told = cloud_of(mesh, &Meshes::default()).mesh;
    told.is_some_and(|mesh| mesh.samples.is_some())
}

/// A closed cylinder or cone as CAD programs mesh it: vertices on the rims and axis alone.
pub(in crate::formats) fn turned(sides: u32, radius: f64, height: f64, top: f64) -> Corners {
    let mut points = vec![Vec3::zeros(), Vec3::new(0.0, 0.0, height)];
    for i in 0..sides {
        let (sin, cos) = (TAU * f64::from(i) / f64::from(sides)).sin_cos();
        points.push(Vec3::new(radius * cos, radius * sin, 0.0));
        points.push(Vec3::new(top * cos, top * sin, height));
    }
    let mut faces = Vec::new();
    for i in 0..sides {
        let (low, next) = (2 + 2 * i, 2 + 2 * ((i + 1) % sides));
        faces.extend([[0, next, low], [low, next, next + 1], [low, next + 1, low + 1]]);
        faces.push([1, low + 1, next + 1]);
    }
    (points, faces)
}

/// A measured plane: rows of points `across` apart, `along` within a row, with noise.
pub(in crate::formats) fn scan(
    rows: u32,
    columns: u32,
    across: f64,
    along: impl Fn(u32) -> f64,
    noise: f64,
) -> Corners {
    let mut state = 1u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    let points = (0..rows * columns).map(|i| {
        let (row, column) = (i / columns, i % columns);
        Vec3::new(along(column), f64::from(row) * across, noise * random())
    });
    let points = points.collect();
    let mut faces = Vec::new();
    for i in (0..(rows - 1) * columns).filter(|i| (i + 1) % columns != 0) {
        faces.extend([[i, i + 1, i + columns], [i + 1, i + columns + 1, i + columns]]);
    }
    (points, faces)
}

#[test]
fn cad_meshes_of_any_fineness_are_sampled() {
    for sides in [24, 32, 64, 360, 2000] {
        assert!(is_sampled(&turned(sides, 15.0, 40.0, 15.0)), "cylinder of {sides} sides");
        assert!(is_sampled(&turned(sides, 10.0, 25.0, 0.001)), "cone of {sides} sides");
        assert!(is_sampled(&turned(sides, 10.0, 25.0, 4.0)), "frustum of {sides} sides");
    }
    // a plate with many bores: its faces are flat, its triangles small beside it
    let (mut points, mut faces) = (Vec::new(), Vec::new());
    for bore in 0..100 {
        let (place, begin) = (f64::from(bore) * 20.0, points.len() as u32);
        let (corners, corner_faces) = turned(64, 5.0, 30.0, 5.0);
        points.extend(corners.iter().map(|p| p + Vec3::new(place, 0.0, 0.0)));
        faces.extend(corner_faces.iter().map(|f| f.map(|i| i + begin)));
    }
    assert!(is_sampled(&(points, faces)));
}

#[test]
fn meshes_of_scans_are_taken_however_uneven() {
    let even = |step: f64| move |i: u32| f64::from(i) * step;
    for noise in [0.0, 0.01, 0.5] {
        assert!(!is_sampled(&scan(60, 60, 1.0, even(1.0), noise)));
    }
    // lines far apart, and points that thin out with the distance from the scanner
    assert!(!is_sampled(&scan(20, 600, 1.0, even(0.02), 0.002)));
    assert!(!is_sampled(&scan(40, 200, 0.5, |i| 1.03f64.powi(i as i32), 0.002)));
    assert!(!is_sampled(&scan(3, 20, 0.1, even(0.1), 0.001)));
}

#[test]
fn scans_with_large_triangles_over_gaps_and_flat_floors_are_taken() {
    // two patches far apart, and the strip between them
    let (mut points, mut faces) = scan(50, 50, 1.0, f64::from, 0.01);
    let (other, others) = scan(50, 50, 1.0, |i| f64::from(i) + 200.0, 0.01);
    let begin = points.len() as u32;
    points.extend(other);
    faces.extend(others.iter().map(|face| face.map(|i| i + begin)));
    for row in 0..49 {
        let (low, far) = (row * 50 + 49, begin + row * 50);
        faces.extend([[low, far, low + 50], [far, far + 50, low + 50]]);
    }
    assert!(!is_sampled(&(points, faces)));
    // a floor that is exact, thinning out with the distance
    assert!(!is_sampled(&scan(60, 120, 0.5, |i| 1.04f64.powi(i as i32), 0.0)));
}

#[test]
fn a_cloud_with_a_few_large_faces_is_a_cloud() {
    let (points, _) = scan(60, 60, 1.0, f64::from, 0.01);
    assert!(!is_sampled(&(points, vec![[0, 59, 3599], [0, 3599, 3540]])));
}

#[test]
fn a_fine_mesh_of_a_sphere_samples_it() {
    let (rings, sides) = (30u32, 60u32);
    let points = (0..rings * sides).map(|i| {
        let (theta, phi) = (
            TAU / 2.0 * (f64::from(i / sides) + 0.5) / f64::from(rings),
            TAU * f64::from(i % sides) / f64::from(sides),
        );
        Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
    });
    let next = |i: u32| i - i % sides + (i + 1) % sides;
    let faces = (0..(rings - 1) * sides)
        .flat_map(|i| [[i, i + sides, next(i)], [next(i), i + sides, next(i) + sides]]);
    assert!(!is_sampled(&(points.collect(), faces.collect())));
}

#[test]
fn faces_that_are_none_are_passed_over() {
    let (points, _) = turned(64, 15.0, 40.0, 15.0);
    for faces in [vec![], vec![[0, 0, 0]], vec![[0, 1, u32::MAX]]] {
        assert!(!is_sampled(&(points.clone(), faces)));
    }
    assert!(!is_sampled(&(vec![Vec3::repeat(f64::NAN); 3], vec![[0, 1, 2]])));
    assert!(!is_sampled(&(vec![], vec![[0, 1, 2]])));
}
