//! Surfaces that stand for two rings.
//!
//! The chamfers at both ends of a hole or around both faces of a disc are narrow cones. A torus or an oblate
//! ellipsoid touches each along a circle, lies within noise of both and costs fewer parameters than two cones do,
//! although between them there is nothing of it. One that is there shows its curvature in the rings.

use crate::fit::constant::constants;
use crate::fit::least_squares::{Options, fit};
use crate::fit::{Family, Ruler, Shape};
use crate::geometry::Vec3;
use crate::segment::family::Families;
use crate::segment::moves::pieces::Piece;
use crate::segment::moves::planes::STEPS;
use crate::segment::moves::site::Site;
use crate::segment::objective::{ACCEPT, DOUBT, FEW};
use crate::segment::prepare::scene::Scene;
use crate::segment::prepare::take::take;

constants! {
    /// Points of a ring that fits look at.
    SAMPLE: usize = 1000, Effort("points of one fit");
    /// Length of the mean of unit spokes from an axis below which the points go around it.
    AROUND: f64 = 0.5, Trial(0.5, 0.5);
}

/// Two cones in the place of a region's torus or ellipsoid, each with its points, where these are two rings around an
/// axis of it and cones explain them about as well: where the points hardly tell, two chamfers are likelier than a
/// surface of which just these rings are seen.
///
/// The surface has drawn points beside the rings' edges, which it runs through: they cost what the surfaces of other
/// regions ask for them.
pub fn instead(site: &Site<'_>) -> Option<Vec<Piece>> {
    let Site { scene, model, families, region, group, .. } = *site;
    let shape = site.shape();
    let mut axes = match shape.family {
        Family::Torus => 2..3,
        Family::Ellipsoid => 0..3,
        _ => return None,
    };
    axes.find_map(|k| {
        let axis = shape.frame.column(k).into_owned();
        let rings = parted(scene, shape, &axis, group)?;
        let points = rings.each_ref().map(|r| take(scene, r, SAMPLE.get()));
        let [a, b] = points.each_ref().map(|p| cone_instead(shape, &axis, p, families));
        let (a, b) = (a?, b?);
        let mut others: Vec<Ruler> = model.shapes.iter().map(Ruler::of).collect();
        others.remove(region);
        let cost = |s: &Shape, points: &[Vec3]| cost(&others, s, points, families.sigma);
        let gain = cost(shape, &points[0]) + cost(shape, &points[1])
            - cost(&a, &points[0])
            - cost(&b, &points[1]);
        let [first, second] = rings;
        (gain > -DOUBT.get()).then(|| vec![(a, first), (b, second)])
    })
}

/// What points cost beside a shape or any of some others, whichever is nearest.
fn cost(others: &[Ruler], shape: &Shape, points: &[Vec3], sigma: f64) -> f64 {
    let own = Ruler::of(shape);
    let nearest = |p: &Vec3| {
        others
            .iter()
            .chain([&own])
            .map(|r| r.distance(p).abs())
            .fold(ACCEPT.get() * sigma, f64::min)
    };
    points.iter().map(|p| (nearest(p) / sigma).powi(2)).sum()
}

/// The points on either side of a gap in height or radius that is wider than what they span there themselves.
fn parted(scene: &Scene, shape: &Shape, axis: &Vec3, group: &[u32]) -> Option<[Vec<u32>; 2]> {
    let places = group.iter().map(|&i| {
        let q = scene.points[i as usize] - shape.origin;
        let height = q.dot(axis);
        (height, (q.norm_squared() - height * height).max(0.0).sqrt())
    });
    let (heights, radii): (Vec<f64>, Vec<f64>) = places.unzip();
    let sides = |values: &[f64]| {
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
        let step = |k: usize| values[order[k]] - values[order[k - 1]];
        let k = (1..order.len()).max_by(|&a, &b| step(a).total_cmp(&step(b)))?;
        let span = |part: &[usize]| values[part[part.len() - 1]] - values[part[0]];
        let (low, high) = order.split_at(k);
        (span(low).max(span(high)) < step(k)).then(|| {
            [low, high].map(|part| {
                let mut part: Vec<u32> = part.iter().map(|&k| group[k]).collect();
                part.sort_unstable();
                part
            })
        })
    };
    let rings = sides(&heights).or_else(|| sides(&radii))?;
    rings.iter().all(|r| r.len() >= FEW.get()).then_some(rings)
}

/// The cone through a ring of points around the axis of a surface that touches it there.
fn cone_instead(shape: &Shape, axis: &Vec3, points: &[Vec3], families: &Families) -> Option<Shape> {
    let share = 1.0 / points.len().max(1) as f64;
    let (mut middle, mut radius, mut height) = (Vec3::zeros(), 0.0, 0.0);
    let (mut outwards, mut upwards) = (0.0, 0.0);
    for p in points {
        let q = p - shape.origin;
        let h = q.dot(axis);
        let spoke = q - axis * h;
        let length = spoke.norm().max(f64::MIN_POSITIVE);
        let normal = shape.offset(p).normal;
        middle += spoke * (share / length);
        radius += length * share;
        height += h * share;
        outwards += normal.dot(&spoke) / length;
        upwards += normal.dot(axis);
    }
    if middle.norm() > AROUND.get() {
        return None;
    }
    let size = [radius, -(upwards / outwards).atan(), 0.0];
    let start = Shape::with_axis(Family::Cone, shape.origin + axis * height, *axis, size);
    let options = Options {
        cauchy: Some(ACCEPT.get() * families.sigma),
        steps: STEPS.get(),
        tolerance: 1e-5,
    };
    let cone = fit(&start, points, None, &options)?.shape;
    (!families.degenerate(&cone, points)).then_some(cone)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fits::Random;
    use crate::geometry::Mat3;
    use crate::segment::fixtures;
    use crate::segment::moves::directions::Directions;
    use crate::segment::partition::Partition;

    const SIGMA: f64 = 0.01;

    /// Points of two rings, where `at` says how far out and how high the place `s` across a ring lies, in [-1, 1].
    fn rings(at: impl Fn(f64) -> [f64; 2], turn: f64) -> Scene<'static> {
        let random = &mut Random::new(9);
        let n = 400;
        let points = (0..2 * n)
            .map(|k| {
                let (t, sign) = (random.uniform(0.0, turn), if k < n { 1.0 } else { -1.0 });
                let [out, height] = at(random.uniform(-1.0, 1.0));
                let noise = Vec3::new(random.normal(), random.normal(), random.normal());
                Vec3::new(out * t.cos(), out * t.sin(), sign * height) + noise * SIGMA
            })
            .collect();
        Scene::new(points)
    }

    fn cones(shape: &Shape, rings: &Scene) -> Option<Vec<Shape>> {
        let families =
            Families { sigma: SIGMA, floor: SIGMA, max_radius: 1000.0, ..fixtures::families() };
        let group: Vec<u32> = (0..rings.len() as u32).collect();
        let model = Partition {
            shapes: vec![*shape],
            labels: vec![0; rings.len()],
            ..Partition::default()
        };
        let directions = Directions::of(rings, &model.shapes, std::slice::from_ref(&group));
        let site = Site {
            scene: rings,
            model: &model,
            families: &families,
            directions: &directions,
            region: 0,
            group: &group,
        };
        let found = instead(&site)?;
        assert!(found.iter().all(|c| c.1.len() == group.len() / 2));
        Some(found.into_iter().map(|c| c.0).collect())
    }

    #[test]
    fn two_chamfers_are_no_torus_and_the_rings_of_one_are_no_chamfers() {
        let tube = 6.0;
        let torus = Shape::with_axis(Family::Torus, Vec3::zeros(), Vec3::z(), [40.5, tube, 0.0]);
        let touching = tube * 0.5_f64.sqrt();
        let chamfer = |s: f64| [40.5 + touching + 0.25 * s, touching - 0.25 * s];
        let full = std::f64::consts::TAU;
        let found = cones(&torus, &rings(chamfer, full)).unwrap_or_default();
        assert_eq!(found.len(), 2);
        for cone in &found {
            assert!((cone.size[1].abs() - std::f64::consts::FRAC_PI_4).abs() < 0.02, "{cone:?}");
        }
        // What is short of a ring may be a piece of anything.
        assert!(cones(&torus, &rings(chamfer, 1.0)).is_none());
        let round = |s: f64| {
            let angle = std::f64::consts::FRAC_PI_4 + 0.3 * s;
            [40.5 + tube * angle.cos(), tube * angle.sin()]
        };
        assert!(cones(&torus, &rings(round, full)).is_none());
    }

    #[test]
    fn chamfers_of_a_hole_are_no_ellipsoid() {
        let ellipsoid = Shape {
            family: Family::Ellipsoid,
            origin: Vec3::zeros(),
            // The short axis is the rings'.
            frame: Mat3::from_columns(&[Vec3::z(), Vec3::x(), Vec3::y()]),
            size: [14.5, 46.8, 46.8],
        };
        let height = 14.5 * (1.0 - (45.0_f64 / 46.8).powi(2)).sqrt();
        let slope = (45.0 / 46.8_f64.powi(2)) / (height / 14.5_f64.powi(2));
        let chamfer = |s: f64| [45.0 + 0.3 * s, height - 0.3 * s * slope];
        let full = std::f64::consts::TAU;
        let found = cones(&ellipsoid, &rings(chamfer, full));
        assert_eq!(found.map(|c| c.len()), Some(2));
    }
}
