use nalgebra::Rotation3;

use super::*;
use crate::segment::Extent;

fn shapes() -> Vec<Shape> {
    let frame = Rotation3::new(Vec3::new(0.3, -0.5, 0.7)).into_inner();
    let origin = Vec3::new(0.2, -0.1, 0.3);
    let of = |family, size| Shape { family, origin, frame, size };
    vec![
        of(Family::Plane, [0.0; 3]),
        of(Family::Sphere, [0.2, 0.0, 0.0]),
        of(Family::Cylinder, [0.1, 0.0, 0.0]),
        of(Family::Cone, [0.1, 0.4, 0.0]),
        of(Family::EllipticCylinder, [0.3, 0.2, 0.0]),
        of(Family::Torus, [0.3, 0.1, 0.0]),
        of(Family::Ellipsoid, [0.4, 0.3, 0.2]),
    ]
}

/// The components that `covariance_of` names.
fn components(shape: &Shape) -> Vec<f64> {
    let join = |parts: &[&[f64]]| parts.concat();
    match shape.surface() {
        Surface::Plane(s) => join(&[s.point.as_slice(), s.normal.as_slice()]),
        Surface::Sphere(s) => join(&[s.center.as_slice(), &[s.radius]]),
        Surface::Cylinder(s) => {
            join(&[s.axis_point.as_slice(), s.axis_direction.as_slice(), &[s.radius]])
        }
        Surface::Cone(s) => {
            join(&[s.apex.as_slice(), s.axis_direction.as_slice(), &[s.half_angle]])
        }
        Surface::EllipticCylinder(s) => join(&[
            s.axis_point.as_slice(),
            s.axis_direction.as_slice(),
            &s.semi_axes,
            s.semi_axis_directions[0].as_slice(),
            s.semi_axis_directions[1].as_slice(),
        ]),
        Surface::Ellipsoid(s) => join(&[
            s.center.as_slice(),
            &s.semi_axes,
            s.semi_axis_directions[0].as_slice(),
            s.semi_axis_directions[1].as_slice(),
            s.semi_axis_directions[2].as_slice(),
        ]),
        Surface::Torus(s) => join(&[
            s.center.as_slice(),
            s.axis_direction.as_slice(),
            &[s.major_radius, s.minor_radius],
        ]),
    }
}

#[test]
fn the_freedoms_by_the_components_undo_the_components_by_the_freedoms() {
    for shape in shapes() {
        let dof = shape.family.dof();
        let by_components = freedoms(&shape);
        for d in 0..dof {
            let at = |h: f64| {
                let mut step = vec![0.0; dof];
                step[d] = h;
                components(&shape.stepped(&step).unwrap())
            };
            let (after, before) = (at(1e-6), at(-1e-6));
            let slope = after.iter().zip(&before).map(|(a, b)| (a - b) / 2e-6);
            let back = &by_components * DVector::from_iterator(after.len(), slope);
            for k in 0..dof {
                let expected = f64::from(u8::from(k == d));
                assert!((back[k] - expected).abs() < 1e-6, "{:?} {d}: {back}", shape.family);
            }
        }
    }
}

#[test]
fn a_shape_goes_to_the_scenes_frame_and_back() {
    let extent = |low: f64, high: f64| Extent { min: [low; 3], max: [high, high, 2.0 * high] };
    let frame = Frame::of([extent(-30.0, 5.0), extent(1.0, 40.0)].into_iter()).unwrap();
    assert_eq!((frame.unit, frame.size), (128.0, 110.0 / 128.0));
    for shape in shapes() {
        let (there, back) = (frame.local(&shape), frame.world(&frame.local(&shape)));
        assert!((back.origin - shape.origin).norm() < 1e-13 && back.size == shape.size);
        let x = Vec3::new(3.0, -2.0, 1.0);
        let local = (x - frame.origin) / frame.unit;
        assert!((there.distance(&local) * frame.unit - shape.distance(&x)).abs() < 1e-11);
    }
    assert!(Frame::of(std::iter::empty()).is_none());
    assert!(Frame::of([extent(0.0, 0.0)].into_iter()).is_none());
}

#[test]
fn a_direction_that_another_is_given_moves_the_position_as_the_covariance_says() {
    let shape = shapes()[2];
    // u of the position and the turn about v move together, as in a fit to points off the origin
    let mut covariance = DMatrix::from_diagonal_element(5, 5, 1e-6);
    covariance[(0, 3)] = 5e-7;
    covariance[(3, 0)] = 5e-7;
    let face = Face { region: 0, shape, covariance, is_round: true, patch: None, reach: 0.1 };
    let [u, w] = [0, 2].map(|k| Vec3::from(shape.frame.column(k).into_owned()));
    let turned = Rotation3::new(1e-3 * Vec3::from(shape.frame.column(1).into_owned())) * w;
    let (known, across) = (Matrix2::zeros(), face.across());
    for (w, sign) in [(turned, 1.0), (-turned, 1.0)] {
        let (shift, left) = face.placed(&w, &across, &known).unwrap();
        assert!((shift[0] - sign * 5e-4).abs() < 1e-9 && shift[1].abs() < 1e-9, "{shift}");
        assert!((left[(0, 0)] - 0.75e-6).abs() < 1e-12 && (left[(1, 1)] - 1e-6).abs() < 1e-12);
    }
    assert!(u.dot(&w).abs() < 1e-15);
}
