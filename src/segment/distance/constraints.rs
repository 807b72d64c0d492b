//! What a surface must be to be reported.
//!
//! Surfaces that may not be reported still compete for points while surfaces are found, so that no
//! other surface grows over them; here they are taken out and their points stay unassigned.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::pieces::pieces;
use super::reasons::Reason;
use crate::fit::least_squares::{Options, fit};
use crate::fit::{Family, Ruler, Shape};
use crate::geometry::Vec3;
use crate::segment::Parameters;

/// A surface and its points.
pub struct Candidate {
    /// The surface, relative to the cloud's centre.
    pub shape: Shape,
    /// The places of its points, rising.
    pub members: Vec<u32>,
    /// Points taken from it because they lie beyond the tolerance.
    pub rejected: usize,
}

/// Surfaces that meet every constraint, in the given order (pieces of one surface at its place), and
/// how many points lost theirs for each reason.
pub fn enforce(
    points: &[Vec3],
    mut found: Vec<Candidate>,
    parameters: &Parameters,
) -> (Vec<Candidate>, BTreeMap<Reason, usize>) {
    let mut lost = BTreeMap::new();
    let mut lose = |reason, n: usize| *lost.entry(reason).or_insert(0) += n;
    let mut kept = Vec::new();
    if let Some(tolerance) = parameters.tolerance {
        let trimmed = found.par_iter_mut().map(|c| trim(points, c, tolerance));
        lose(Reason::Outlier, trimmed.sum());
    }
    for candidate in found {
        for piece in split(points, candidate, parameters) {
            if piece.members.len() < parameters.min_points {
                lose(Reason::TooSmall, piece.members.len());
            } else if !may_be_reported(&piece.shape, parameters) {
                lose(Reason::NoQuadric, piece.members.len());
            } else {
                kept.push(piece);
            }
        }
    }
    for candidate in drop_smallest(&mut kept, parameters.max_regions) {
        lose(Reason::OverMaxRegions, candidate.members.len());
    }
    lost.retain(|_, n| *n > 0);
    (kept, lost)
}

/// Points measured at once.
const CHUNK: usize = 512;

/// Takes the points beyond `tolerance` from a candidate. Returns how many.
fn trim(points: &[Vec3], candidate: &mut Candidate, tolerance: f64) -> usize {
    let ruler = Ruler::of(&candidate.shape);
    let mut kept = Vec::with_capacity(candidate.members.len());
    let (mut at, mut distances) = (Vec::with_capacity(CHUNK), [0.0; CHUNK]);
    for members in candidate.members.chunks(CHUNK) {
        at.clear();
        at.extend(members.iter().map(|&i| points[i as usize]));
        ruler.distances(&at, &mut distances);
        let near = members.iter().zip(&distances).filter(|(_, d)| d.abs() <= tolerance);
        kept.extend(near.map(|(i, _)| *i));
    }
    candidate.rejected = candidate.members.len() - kept.len();
    candidate.members = kept;
    candidate.rejected
}

/// The pieces of a candidate that gaps wider than `connectivity` part, each fitted anew to its own
/// points; the candidate itself where no such length was given or it is in one piece.
fn split(points: &[Vec3], candidate: Candidate, parameters: &Parameters) -> Vec<Candidate> {
    let Some(gap) = parameters.connectivity else { return vec![candidate] };
    let own: Vec<Vec3> = candidate.members.iter().map(|&i| points[i as usize]).collect();
    let sets = pieces(&own, gap);
    if sets.len() < 2 {
        return vec![candidate];
    }
    let options = Options { cauchy: None, steps: 15, tolerance: 1e-7 };
    let piece = |set: &Vec<u32>| {
        let part: Vec<Vec3> = set.iter().map(|&k| own[k as usize]).collect();
        let shape = fit(&candidate.shape, &part, None, &options).map(|f| f.shape);
        Candidate {
            shape: shape.unwrap_or(candidate.shape),
            members: set.iter().map(|&k| candidate.members[k as usize]).collect(),
            rejected: 0,
        }
    };
    sets.iter().map(piece).collect()
}

/// Takes the smallest candidates out until `most` are left; of equal ones the later. Returns them.
fn drop_smallest(kept: &mut Vec<Candidate>, most: usize) -> Vec<Candidate> {
    let mut order: Vec<usize> = (0..kept.len()).collect();
    order.sort_by_key(|&k| std::cmp::Reverse(kept[k].members.len()));
    let mut dropped = order.split_off(most.min(order.len()));
    dropped.sort_unstable_by(|a, b| b.cmp(a));
    dropped.into_iter().map(|k| kept.remove(k)).collect()
}

/// Whether type, radii and axis are among those asked for.
///
/// `min_radius` and `max_radius` bind spheres, cylinders and each semi-axis; a plane and a cone have no
/// radius. The axis binds cylinders, elliptic cylinders, cones and plane normals, whichever way they
/// point; a sphere and an ellipsoid have none.
fn may_be_reported(shape: &Shape, parameters: &Parameters) -> bool {
    let Some(surface_type) = shape.family.surface_type() else { return false };
    parameters.surfaces.contains(&surface_type)
        && radii(shape).iter().all(|&r| {
            parameters.min_radius.is_none_or(|min| r >= min)
                && parameters.max_radius.is_none_or(|max| r <= max)
        })
        && parameters
            .axis_direction
            .zip(axis(shape))
            .is_none_or(|(d, w)| angle_between(&w, &Vec3::from(d)) <= parameters.axis_tolerance)
}

/// The radius or semi-axes of a shape; none for planes and cones.
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

    /// Two strips of the plane z = 0, 30 and 20 points wide, two apart, and a far point off it.
    fn strips() -> (Vec<Vec3>, Candidate) {
        let strip = |x: f64, n: usize| {
            (0..n * 3).map(move |k| Vec3::new(x + (k / 3) as f64 * 0.5, (k % 3) as f64 * 0.5, 0.0))
        };
        let mut points: Vec<Vec3> = strip(0.0, 30).chain(strip(16.5, 20)).collect();
        points.push(Vec3::new(1.0, 1.0, 0.3));
        let members = (0..points.len() as u32).collect();
        let shape = Shape::with_axis(Family::Plane, Vec3::zeros(), Vec3::z(), [0.0; 3]);
        (points, Candidate { shape, members, rejected: 0 })
    }

    fn sizes(parameters: &Parameters) -> (Vec<usize>, BTreeMap<Reason, usize>) {
        let (points, candidate) = strips();
        let (kept, lost) = enforce(&points, vec![candidate], parameters);
        (kept.iter().map(|c| c.members.len()).collect(), lost)
    }

    #[test]
    fn pieces_further_apart_than_the_connectivity_are_regions_of_their_own() {
        let default = Parameters::default();
        assert_eq!(sizes(&default), (vec![151], [].into()));
        let near = Parameters { connectivity: Some(1.9), ..default.clone() };
        assert_eq!(sizes(&near), (vec![91, 60], [].into()));
        let far = Parameters { connectivity: Some(2.1), ..default.clone() };
        assert_eq!(sizes(&far), (vec![151], [].into()));
        let large = Parameters { min_points: 70, ..near };
        assert_eq!(sizes(&large), (vec![91], [(Reason::TooSmall, 60)].into()));
    }

    #[test]
    fn points_beyond_the_tolerance_are_taken_from_their_surface() {
        let parameters = Parameters { tolerance: Some(0.2), ..Parameters::default() };
        let (points, candidate) = strips();
        let (kept, lost) = enforce(&points, vec![candidate], &parameters);
        assert_eq!((kept[0].members.len(), kept[0].rejected), (150, 1));
        assert_eq!(lost, [(Reason::Outlier, 1)].into());
    }

    #[test]
    fn the_largest_regions_stay_in_their_order() {
        let parameters = Parameters {
            connectivity: Some(1.9),
            max_regions: 1,
            min_points: 10,
            ..Parameters::default()
        };
        assert_eq!(sizes(&parameters), (vec![91], [(Reason::OverMaxRegions, 60)].into()));
        let two = Parameters { max_regions: 2, ..parameters };
        assert_eq!(sizes(&two).0, [91, 60]);
    }

    fn reported(family: Family, size: [f64; 3], change: impl Fn(&mut Parameters)) -> bool {
        let shape = Shape::with_axis(family, Vec3::zeros(), Vec3::new(0.0, 0.1, 1.0), size);
        let mut parameters = Parameters::default();
        change(&mut parameters);
        may_be_reported(&shape, &parameters)
    }

    #[test]
    fn only_the_types_asked_for_are_reported_and_a_torus_never() {
        let only = |t| move |p: &mut Parameters| p.surfaces = vec![t];
        assert!(reported(Family::Sphere, [1.0, 0.0, 0.0], only(SurfaceType::Sphere)));
        assert!(!reported(Family::Sphere, [1.0, 0.0, 0.0], only(SurfaceType::Ellipsoid)));
        assert!(!reported(Family::Torus, [5.0, 1.0, 0.0], |_| ()));
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
}
