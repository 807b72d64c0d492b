use nalgebra::{Matrix4, Rotation3, Vector4};

use super::*;
use crate::geometry::{Cone, Cylinder, Plane, Sphere};

/// Where the part lies in the input.
fn pose() -> (Rotation3<f64>, Vec3) {
    (Rotation3::new(Vec3::new(0.7, -1.1, 0.4)), Vec3::new(120.0, -35.0, 60.0))
}

fn at(x: f64, y: f64, z: f64) -> Vec3 {
    let (turn, shift) = pose();
    turn * Vec3::new(x, y, z) + shift
}

fn along(x: f64, y: f64, z: f64) -> Vec3 {
    pose().0 * Vec3::new(x, y, z).normalize()
}

fn plane(point: Vec3, normal: Vec3) -> Surface {
    Surface::Plane(Plane { point, normal })
}

fn tube(axis_point: Vec3, axis_direction: Vec3) -> Surface {
    Surface::Cylinder(Cylinder { axis_point, axis_direction, radius: 4.0 })
}

fn ball(center: Vec3) -> Surface {
    Surface::Sphere(Sphere { center, radius: 4.0 })
}

fn system(surfaces: &[Surface]) -> DatumSystem {
    let datums: Vec<_> = surfaces.iter().enumerate().map(|(k, s)| (k, Some(*s))).collect();
    datum_system(&datums)
}

fn matrix(system: &DatumSystem) -> Matrix4<f64> {
    let rows = system.transform.unwrap_or_else(|| panic!("{system:?}"));
    Matrix4::from_fn(|i, j| rows[i][j])
}

/// The matrix turns and shifts, and gives the part's own coordinates, up to the shift of its origin.
fn check(system: &DatumSystem, origin: Vec3, label: &str) {
    let m = matrix(system);
    let turn = m.fixed_view::<3, 3>(0, 0);
    assert!((turn * turn.transpose() - Mat3::identity()).norm() < 1e-12, "{label}");
    assert!((turn.determinant() - 1.0).abs() < 1e-12, "{label}");
    assert_eq!(m.row(3), Matrix4::identity().row(3));
    for part in [Vec3::zeros(), Vec3::new(10.0, 0.0, 0.0), Vec3::new(3.0, -7.0, 12.0)] {
        let input = at(part.x, part.y, part.z);
        let found = m * Vector4::new(input.x, input.y, input.z, 1.0);
        assert!((found.xyz() - (part - origin)).norm() < 1e-9, "{label}: {found} for {part}");
    }
}

#[test]
fn three_square_planes_make_the_system_wherever_their_points_lie() {
    let a = plane(at(40.0, 30.0, 5.0), along(0.0, 0.0, 1.0));
    let b = plane(at(2.0, 17.0, 33.0), along(1.0, 0.0, 0.0));
    let c = plane(at(25.0, -3.0, 11.0), along(0.0, 1.0, 0.0));
    check(&system(&[a, b, c]), Vec3::new(2.0, -3.0, 5.0), "planes");
}

#[test]
fn what_is_off_square_is_turned_to_what_comes_before_about_its_own_place() {
    let tilt = 0.01_f64;
    let a = plane(at(40.0, 30.0, 5.0), along(0.0, 0.0, 1.0));
    // leans by `tilt` about y, so its place at its own point counts
    let b = plane(at(2.0, 17.0, 33.0), along(tilt.cos(), 0.0, tilt.sin()));
    let c = plane(at(25.0, -3.0, 11.0), along(-tilt.sin(), tilt.cos(), 0.0));
    let found = system(&[a, b, c]);
    check(&found, Vec3::new(2.0, -3.0, 5.0), "tilted");
    assert_eq!(found.datums[0].turned, None);
    for datum in &found.datums[1..] {
        assert!((datum.turned.unwrap() - tilt).abs() < 1e-12, "{datum:?}");
    }
}

#[test]
fn a_plane_with_two_bores_makes_the_system() {
    let a = plane(at(0.0, 0.0, 0.0), along(0.0, 0.0, 1.0));
    let b = tube(at(10.0, 5.0, -8.0), along(0.001, 0.0, 1.0));
    let c = tube(at(60.0, 5.0, -3.0), along(0.0, 0.002, 1.0));
    check(&system(&[a, b, c]), Vec3::new(10.0, 5.0, 0.0), "bores");
    // and a bore with a plane across and one along
    let flat = plane(at(30.0, 9.0, 1.0), along(0.0, -1.0, 0.0));
    let found = system(&[tube(at(10.0, 5.0, -8.0), along(0.0, 0.0, 1.0)), a, flat]);
    let m = matrix(&found);
    let there = at(10.0, 5.0, 0.0);
    assert!((m * Vector4::new(there.x, there.y, there.z, 1.0)).xyz().norm() < 1e-9);
    let x = m.fixed_view::<3, 3>(0, 0) * along(0.0, -1.0, 0.0);
    assert!((x - Vec3::x()).norm() < 1e-12);
}

#[test]
fn three_balls_make_the_system() {
    let all = [ball(at(0.0, 0.0, 0.0)), ball(at(0.0, 0.0, 50.0)), ball(at(30.0, 0.0, 20.0))];
    check(&system(&all), Vec3::zeros(), "balls");
}

#[test]
fn a_cone_tells_its_apex_and_an_oblique_axis_where_it_meets_the_plane() {
    let cone = Surface::Cone(Cone {
        apex: at(1.0, 2.0, 3.0),
        axis_direction: along(0.0, 0.0, 1.0),
        half_angle: 0.4,
    });
    let side = plane(at(20.0, 0.0, 0.0), along(1.0, 0.0, 0.0));
    check(&system(&[cone, side]), Vec3::new(1.0, 2.0, 3.0), "cone");
    let a = plane(at(40.0, 30.0, 5.0), along(0.0, 0.0, 1.0));
    let slanting = tube(at(10.0, 0.0, 15.0), along(1.0, 0.0, 1.0));
    check(&system(&[a, slanting]), Vec3::new(0.0, 0.0, 5.0), "slanting");
}

#[test]
fn what_is_left_free_is_told_and_no_transform_given() {
    let a = plane(at(0.0, 0.0, 0.0), along(0.0, 0.0, 1.0));
    let bore = tube(at(10.0, 5.0, -8.0), along(0.0, 0.0, 1.0));
    let wall = plane(at(0.0, 0.0, 0.0), along(1.0, 0.0, 0.0));
    let cases: [(&[Surface], usize, &str); 7] = [
        (&[a], 3, "rotation about"),
        (&[bore], 2, "shift along"),
        (&[a, bore], 1, "rotation about"),
        (&[a, wall], 1, "shift along"),
        (&[ball(at(0.0, 0.0, 0.0))], 1, "every rotation"),
        // one axis twice, as exactly as parts are
        (&[a, bore, tube(at(10.001, 5.002, 9.0), along(0.0, 0.0, 1.0))], 1, "rotation about"),
        (&[a, plane(at(0.0, 0.0, 9.0), along(0.0, 0.01, 1.0))], 3, "rotation about"),
    ];
    for (surfaces, count, words) in cases {
        let found = system(surfaces);
        assert!(found.transform.is_none() && found.free.len() == count, "{found:?}");
        assert!(found.free.iter().any(|f| f.contains(words)), "{found:?}");
        let refused = found.refused.unwrap();
        assert!(found.free.iter().all(|f| refused.contains(f.as_str())), "{refused}");
    }
    let absent = datum_system(&[(0, Some(a)), (7, None)]);
    assert!(absent.refused.unwrap().contains("region 7"));
}
