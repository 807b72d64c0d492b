//! Surfaces that bridge planes.
//!
//! The chamfers of a plate are narrow, so a cone or a cylinder that touches each along a line lies within
//! noise of all of them and costs fewer parameters than the planes do. A surface that is curved shows it in
//! some connected piece of it. A tilted plane holds level strips of unlike heights in the same way: see
//! [`directions`](super::directions).

use crate::fit::constant::constants;
use crate::fit::least_squares::{Options, fit};
use crate::fit::{Shape, starts};
use crate::geometry::Vec3;
use crate::segment::family::Families;
use crate::segment::grow::walk::Walk;
use crate::segment::moves::pieces::{Piece, SAMPLE, SMOOTH, large_pieces};
use crate::segment::moves::site::Site;
use crate::segment::objective::{ACCEPT, DOUBT, FEW, HALF};
use crate::segment::prepare::scene::Scene;
use crate::segment::prepare::take::take;

constants! {
    /// Points around its middle that tell whether a surface is curved there.
    LOOK: usize = 250, Effort("points of one look");
    /// Steps of a fit.
    pub STEPS: usize = 10, Effort("steps of one fit");
}

/// Planes instead of a curved surface that is curved in no large connected piece of its region.
pub fn instead(site: &Site<'_>, walk: &mut Walk) -> Option<Vec<Piece>> {
    let Site { scene, model, families, group, .. } = *site;
    let shape = site.shape();
    let suspect = group.len() >= 2 * FEW.get()
        && !is_curved(scene, walk, shape, group, &model.labels, families);
    suspect.then(|| planes_instead(scene, shape, group, families)).flatten()
}

/// Whether a region's surface is curved over the piece around its middle member: a look that saves going
/// through all pieces of most.
fn is_curved(
    scene: &Scene,
    walk: &mut Walk,
    shape: &Shape,
    group: &[u32],
    labels: &[i32],
    families: &Families,
) -> bool {
    let middle = group[group.len() / 2];
    let own = labels[middle as usize];
    let normal = |i: usize| shape.offset(&scene.points[i]).normal;
    let near = walk.run(scene, &[middle], LOOK.get(), |from, to| {
        from.is_none_or(|from| labels[to] == own && normal(from).dot(&normal(to)) > SMOOTH.get())
    });
    near.len() >= FEW.get()
        && gain_of_plane(shape, &take(scene, near, LOOK.get()), families)
            .is_some_and(|g| g.1 < -DOUBT.get())
}

/// The plane through some of a surface's points, and how much less it costs there in BIC.
fn gain_of_plane(shape: &Shape, points: &[Vec3], families: &Families) -> Option<(Shape, f64)> {
    let options = Options {
        cauchy: Some(ACCEPT.get() * families.sigma),
        steps: STEPS.get(),
        tolerance: 1e-5,
    };
    let plane = fit(&starts::plane(points)?, points, None, &options)?.shape;
    if families.line(points) {
        return None;
    }
    let own = fit(shape, points, None, &options).map_or(*shape, |f| f.shape);
    Some((plane, families.score(own, points).bic - families.score(plane, points).bic))
}

/// A plane for each large flat piece of a curved region, where most of it lies in such; the rest keeps the surface.
fn planes_instead(
    scene: &Scene,
    shape: &Shape,
    group: &[u32],
    families: &Families,
) -> Option<Vec<Piece>> {
    let pieces = large_pieces(scene, shape, group)?;
    let held: usize = pieces.iter().map(Vec::len).sum();
    let mut gain = 0.0;
    let mut planes = Vec::with_capacity(pieces.len());
    let mut curved = Vec::new();
    for piece in pieces {
        if scene.cancelled() {
            return None;
        }
        let (plane, saved) = gain_of_plane(shape, &take(scene, &piece, SAMPLE.get()), families)?;
        if saved < -DOUBT.get() {
            curved.extend(piece);
        } else {
            gain += saved;
            planes.push((plane, piece));
        }
    }
    if planes.len() < 2 || curved.len() as f64 > HALF.get() * held as f64 {
        return None;
    }
    if !curved.is_empty() {
        planes.push((*shape, curved));
    }
    (gain > 0.0).then_some(planes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Family;
    use crate::segment::fixtures;
    use crate::segment::moves::split::split;
    use crate::segment::partition::{Partition, members};
    use crate::segment::random::SplitMix64;

    const SIGMA: f64 = 0.02;

    fn families() -> Families {
        Families { sigma: SIGMA, floor: SIGMA, ..fixtures::families() }
    }

    fn uniform(random: &mut SplitMix64, from: f64, to: f64) -> f64 {
        from + (to - from) * random.below(1 << 30) as f64 / f64::from(1 << 30)
    }

    fn noise(random: &mut SplitMix64) -> f64 {
        SIGMA * (0..12).map(|_| uniform(random, -0.5, 0.5)).sum::<f64>()
    }

    fn broken(points: Vec<Vec3>, shape: Shape) -> (usize, Vec<Family>) {
        let labels = vec![0; points.len()];
        let scene = Scene::new(points);
        let mut model = Partition { shapes: vec![shape], labels, ..Partition::default() };
        let count = split(&scene, &mut model, &families());
        (count, model.shapes.iter().map(|s| s.family).collect())
    }

    #[test]
    fn a_cone_along_three_chamfers_gives_way_to_three_planes() {
        let random = &mut SplitMix64::new(1);
        let mut points = Vec::new();
        for k in 0..3 {
            let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 3.0).sin_cos();
            let (ruling, across) =
                (Vec3::new(cos, sin, 1.0).normalize(), Vec3::new(-sin, cos, 0.0));
            let normal = ruling.cross(&across);
            points.extend((0..150).map(|_| {
                let (t, w) = (uniform(random, 15.0, 40.0), uniform(random, -0.5, 0.5));
                t * ruling + w * across + noise(random) * normal
            }));
        }
        let cone = Shape::with_axis(
            Family::Cone,
            Vec3::new(0.0, 0.0, 20.0),
            Vec3::z(),
            [20.0, std::f64::consts::FRAC_PI_4, 0.0],
        );
        assert_eq!(broken(points, cone), (1, vec![Family::Plane; 3]));
    }

    #[test]
    fn two_pieces_of_a_cylinder_stay_one() {
        let random = &mut SplitMix64::new(2);
        let at = |k: usize, random: &mut SplitMix64| {
            let (sin, cos) = uniform(random, -1.0, 1.0).sin_cos();
            let (r, z) = (5.0 + noise(random), uniform(random, 0.0, 4.0) + 20.0 * (k % 2) as f64);
            Vec3::new(r * cos, r * sin, z)
        };
        let points = (0..600).map(|k| at(k, random)).collect();
        let shape = Shape::with_axis(Family::Cylinder, Vec3::zeros(), Vec3::z(), [5.0, 0.0, 0.0]);
        assert_eq!(broken(points, shape), (0, vec![Family::Cylinder]));
    }

    /// Columns of a scanner 200 away: the noise along its beams leaves every column in a plane through it.
    #[test]
    fn a_cylinder_seen_in_columns_stays_one() {
        let random = &mut SplitMix64::new(6);
        let (radius, away) = (5.0, 200.0);
        let at = |k: usize, random: &mut SplitMix64| {
            let angle = 0.0055 * ((k % 9) as f64 - 4.0);
            let (sin, cos) = f64::sin_cos(angle);
            let range = away * cos - (radius * radius - (away * sin).powi(2)).sqrt();
            let range = range + noise(random);
            Vec3::new(range * sin, range * cos - away, 0.2 * (k / 9) as f64)
        };
        let points = (0..1350).map(|k| at(k, random)).collect();
        let shape = Shape::with_axis(Family::Cylinder, Vec3::zeros(), Vec3::z(), [5.0, 0.0, 0.0]);
        assert_eq!(broken(points, shape), (0, vec![Family::Cylinder]));
    }

    /// Two strips of a height each, in three pieces by cuts across them, over a base: their common, tilted plane is
    /// no face.
    #[test]
    fn strips_with_cuts_across_are_two_planes() {
        let random = &mut SplitMix64::new(3);
        let mut base = || {
            let (x, y) = (uniform(random, -10.0, 70.0), uniform(random, 0.0, 40.0));
            Vec3::new(x, y, noise(random))
        };
        let mut points: Vec<Vec3> = (0..16_000).map(|_| base()).collect();
        let n = points.len();
        points.extend((0..480).map(|k| {
            let (x, height) = [(0.0, 5.0), (60.0, 5.06)][k % 2];
            let y = uniform(random, 0.0, 10.0) + 15.0 * (k / 2 % 3) as f64;
            Vec3::new(x + uniform(random, -0.5, 0.5), y, height + noise(random))
        }));
        let plane = |height, normal| {
            Shape::with_axis(Family::Plane, Vec3::new(0.0, 0.0, height), normal, [0.0; 3])
        };
        let mut model = Partition {
            shapes: vec![plane(0.0, Vec3::z()), plane(5.0, Vec3::new(-0.001, 0.0, 1.0))],
            labels: (0..points.len()).map(|k| i32::from(k >= n)).collect(),
            ..Partition::default()
        };
        let count = split(&Scene::new(points), &mut model, &families());
        assert_eq!((count, model.shapes.len()), (1, 3));
        assert_eq!(
            members(&model.labels, 3).iter().map(Vec::len).collect::<Vec<_>>(),
            [n, 240, 240]
        );
    }
}
