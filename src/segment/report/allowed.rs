//! Which surfaces the caller wants reported.

use crate::fit::{Family, Shape};
use crate::geometry::Vec3;
use crate::segment::Parameters;
use crate::segment::judge::parabola::is_parabolic;

/// Whether type, radii and axis are among those asked for, and no ellipse is longer than one can be told from a
/// parabola: fits after the search can stretch it.
///
/// `min_radius` and `max_radius` bind spheres, cylinders, both radii of a torus and each semi-axis; a plane and a
/// cone have no radius. The axis binds cylinders, elliptic cylinders, cones, tori and plane normals, whichever way they
/// point; a sphere and an ellipsoid have none.
pub fn may_be_reported(shape: &Shape, parameters: &Parameters) -> bool {
    parameters.surfaces.contains(&shape.family.surface_type())
        && !is_parabolic(shape)
        && radii(shape).iter().all(|&r| {
            parameters.min_radius.is_none_or(|min| r >= min)
                && parameters.max_radius.is_none_or(|max| r <= max)
        })
        && parameters
            .axis_direction
            .zip(axis(shape))
            .is_none_or(|(d, w)| angle_between(&w, &Vec3::from(d)) <= parameters.axis_tolerance)
}

/// The radii or semi-axes of a shape; none for planes and cones.
fn radii(shape: &Shape) -> &[f64] {
    match shape.family {
        Family::Plane | Family::Cone => &[],
        Family::Sphere | Family::Cylinder => &shape.size[..1],
        Family::EllipticCylinder | Family::Torus => &shape.size[..2],
        Family::Ellipsoid => &shape.size,
    }
}

fn axis(shape: &Shape) -> Option<Vec3> {
    match shape.family {
        Family::Sphere | Family::Ellipsoid => None,
        _ => Some(shape.w()),
    }
}

/// Angle between two lines, in 0..=pi/2.
fn angle_between(a: &Vec3, b: &Vec3) -> f64 {
    a.cross(b).norm().atan2(a.dot(b).abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::SurfaceType;

    fn reported(family: Family, size: [f64; 3], change: impl Fn(&mut Parameters)) -> bool {
        let shape = Shape::with_axis(family, Vec3::zeros(), Vec3::new(0.0, 0.1, 1.0), size);
        let mut parameters = Parameters::default();
        change(&mut parameters);
        may_be_reported(&shape, &parameters)
    }

    #[test]
    fn only_the_types_asked_for_are_reported() {
        let only = |t| move |p: &mut Parameters| p.surfaces = vec![t];
        assert!(reported(Family::Sphere, [1.0, 0.0, 0.0], only(SurfaceType::Sphere)));
        assert!(!reported(Family::Sphere, [1.0, 0.0, 0.0], only(SurfaceType::Ellipsoid)));
        assert!(reported(Family::Torus, [5.0, 1.0, 0.0], |_| ()));
        let quadrics = SurfaceType::DEFAULT.into_iter().filter(|t| *t != SurfaceType::Torus);
        let without = |p: &mut Parameters| p.surfaces = quadrics.clone().collect();
        assert!(!reported(Family::Torus, [5.0, 1.0, 0.0], without));
    }

    #[test]
    fn every_radius_must_lie_in_the_range() {
        let range = |p: &mut Parameters| (p.min_radius, p.max_radius) = (Some(2.0), Some(5.0));
        assert!(reported(Family::Cylinder, [3.0, 0.0, 0.0], range));
        assert!(!reported(Family::Sphere, [5.1, 0.0, 0.0], range));
        assert!(!reported(Family::EllipticCylinder, [4.0, 1.9, 0.0], range));
        assert!(!reported(Family::Ellipsoid, [4.0, 3.0, 1.0], range));
        assert!(reported(Family::Plane, [0.0; 3], range));
        assert!(reported(Family::Cone, [1.0, 0.3, 0.0], range));
    }

    #[test]
    fn axes_and_normals_must_point_along_the_direction_either_way() {
        let along = |tolerance| {
            move |p: &mut Parameters| {
                p.axis_direction = Some([0.0, 0.0, -2.0]);
                p.axis_tolerance = tolerance;
            }
        };
        assert!(reported(Family::Cylinder, [3.0, 0.0, 0.0], along(0.1)));
        assert!(!reported(Family::Cylinder, [3.0, 0.0, 0.0], along(0.099)));
        assert!(!reported(Family::Plane, [0.0; 3], along(0.05)));
        assert!(reported(Family::Sphere, [3.0, 0.0, 0.0], along(0.05)));
    }

    #[test]
    fn an_ellipse_longer_than_25_times_its_width_is_none() {
        for (ratio, kept) in [(24.9, true), (25.1, false)] {
            assert_eq!(reported(Family::EllipticCylinder, [ratio, 1.0, 0.0], |_| ()), kept);
            assert_eq!(reported(Family::Ellipsoid, [1.0, 3.0, ratio], |_| ()), kept);
        }
    }
}
