//! Planes parallel to a better known one.
//!
//! Faces of machined parts are mostly parallel to others. A narrow strip hardly tells its tilt, so that a tilted
//! plane lies within noise of several strips of unlike heights, and costs fewer parameters than a plane for
//! each. A plane that has the direction of another one costs its height alone.

use crate::fit::constant::constants;
use crate::fit::{Family, Shape};
use crate::geometry::{Mat3, Vec3};
use crate::segment::family::Families;
use crate::segment::median::median;
use crate::segment::objective::ACCEPT;
use crate::segment::prepare::scene::Scene;
use crate::segment::prepare::take::take;

constants! {
    /// How many times better a plane must tell its tilt than it is asked for.
    BETTER: f64 = 4.0, Trial(4.0, 4.0);
    /// Description length of a face of its own beside that of its height.
    HEIGHT: f64 = 4.0, Trial(4.0, 4.0);
    /// Largest angle (sine) by which its direction may miss a strip's own.
    TILT: f64 = 0.1, Trial(0.1, 0.1);
    /// Directions that are tried, the best known ones.
    TRIED: usize = 6, Effort("directions tried");
    /// Points of a plane that tell how far it reaches.
    SAMPLE: usize = 400, Effort("points of one look");
}

/// Normals of a model's planes, the best known ones first.
pub struct Directions(Vec<Direction>);

/// The normal of a plane and what its points tell of it: their number times their variance along the plane's
/// narrow side.
struct Direction {
    normal: Vec3,
    known: f64,
}

impl Directions {
    /// Those of the planes among `shapes`, whose regions are `groups`.
    pub fn of(scene: &Scene, shapes: &[Shape], groups: &[Vec<u32>]) -> Self {
        let direction = |(s, group): (&Shape, &Vec<u32>)| {
            let known = group.len() as f64 * extents(&take(scene, group, SAMPLE.get()))[1];
            Direction { normal: s.w(), known }
        };
        let planes = shapes.iter().zip(groups).filter(|(s, _)| s.family == Family::Plane);
        let mut all: Vec<Direction> = planes.map(direction).collect();
        all.sort_by(|a, b| b.known.total_cmp(&a.known));
        Self(all)
    }

    /// What a plane costs beside its truncated chi2 on some points: its description length, or what the cheapest
    /// plane through them costs that is parallel to one known as well as [`asked`], which it nearly is.
    pub fn length(&self, plane: &Shape, points: &[Vec3], asked: f64, families: &Families) -> f64 {
        let free = plane.family.description_length(families.worth(points.len()));
        self.plane(points, &plane.w(), asked, families).map_or(free, |(_, cost)| {
            (free + 2.0 * HEIGHT.get()).min(cost - families.misfit(plane, points))
        })
    }

    /// The cheapest plane through some points that is parallel to one known as well as [`asked`], and what it costs:
    /// its truncated chi2 and the description length of its height. `normal` is the points' own.
    pub fn plane(
        &self,
        points: &[Vec3],
        normal: &Vec3,
        asked: f64,
        families: &Families,
    ) -> Option<(Shape, f64)> {
        self.0
            .iter()
            .take_while(|d| d.known >= asked)
            .filter(|d| d.normal.cross(normal).norm() < TILT.get())
            .take(TRIED.get())
            .filter_map(|d| {
                let plane = through(points, &d.normal, families.sigma)?;
                let length = HEIGHT.get() + (families.worth(points.len()).max(2) as f64).ln();
                Some((plane, families.misfit(&plane, points) + length))
            })
            .min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// How well a direction must be known for `count` points, of which these are some, to say whether they lie along
/// it. Whether a plane is one or several is asked at the directions that the whole of it can judge.
pub fn asked(points: &[Vec3], count: usize) -> f64 {
    BETTER.get() * count as f64 * extents(points)[2]
}

/// Variances of points along their principal directions, rising.
fn extents(points: &[Vec3]) -> [f64; 3] {
    let n = points.len().max(1) as f64;
    let mean = points.iter().sum::<Vec3>() / n;
    let scatter = points.iter().fold(Mat3::zeros(), |m, p| m + (p - mean) * (p - mean).transpose());
    let mut variances: [f64; 3] = (scatter / n).symmetric_eigenvalues().into();
    variances.sort_by(f64::total_cmp);
    variances
}

/// The plane of a direction through some points, those far from their median left out.
fn through(points: &[Vec3], normal: &Vec3, sigma: f64) -> Option<Shape> {
    let mut heights: Vec<f64> = points.iter().map(|p| p.dot(normal)).collect();
    let median = median(&mut heights)?;
    heights.retain(|h| (h - median).abs() < ACCEPT.get() * sigma);
    let height = heights.iter().sum::<f64>() / heights.len() as f64;
    Some(Shape::with_axis(Family::Plane, normal * height, *normal, [0.0; 3]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::fixtures;
    use crate::segment::moves::merge::merge;
    use crate::segment::partition::Partition;
    use crate::segment::random::SplitMix64;

    const SIGMA: f64 = 0.02;

    fn uniform(random: &mut SplitMix64, from: f64, to: f64) -> f64 {
        from + (to - from) * random.below(1 << 30) as f64 / f64::from(1 << 30)
    }

    /// Points of a level rectangle around `x`, so wide, 40 long, at a height.
    fn face(random: &mut SplitMix64, n: usize, x: f64, width: f64, height: f64) -> Vec<Vec3> {
        let mut point = || {
            let noise = SIGMA * (0..12).map(|_| uniform(random, -0.5, 0.5)).sum::<f64>();
            let across = uniform(random, -width / 2.0, width / 2.0);
            Vec3::new(x + across, uniform(random, 0.0, 40.0), height + noise)
        };
        (0..n).map(|_| point()).collect()
    }

    /// How many planes are left of faces, each with a plane of its own, once they are merged.
    fn left(faces: &[Vec<Vec3>]) -> usize {
        let mut model = Partition::default();
        for (label, face) in faces.iter().enumerate() {
            let mean = face.iter().sum::<Vec3>() / face.len() as f64;
            model.shapes.push(Shape::with_axis(Family::Plane, mean, Vec3::z(), [0.0; 3]));
            model.labels.extend(vec![label as i32; face.len()]);
        }
        let families = Families { sigma: SIGMA, floor: SIGMA, ..fixtures::families() };
        merge(&Scene::new(faces.concat()), &mut model, &families);
        model.shapes.len()
    }

    #[test]
    fn strips_at_unlike_heights_over_a_base_stay_apart_and_those_at_one_height_join() {
        let random = &mut SplitMix64::new(4);
        let strip = |random: &mut SplitMix64, x, height| face(random, 200, x, 1.0, height);
        let base = face(random, 16_000, 30.0, 80.0, 0.0);
        let (a, b) = (strip(random, 0.0, 5.0), strip(random, 60.0, 5.06));
        // a plane tilted by a thousandth holds both: only the base tells that it is none of the part's
        assert_eq!(left(&[a.clone(), b.clone()]), 1);
        assert_eq!(left(&[base.clone(), a.clone(), b]), 3);
        assert_eq!(left(&[base, a, strip(random, 60.0, 5.0)]), 2);
    }

    #[test]
    fn a_direction_no_better_known_than_asked_is_none() {
        let random = &mut SplitMix64::new(5);
        let faces = [face(random, 400, 0.0, 1.0, 0.0), face(random, 200, 60.0, 1.0, 5.0)];
        let scene = Scene::new(faces.concat());
        let groups = [(0..400).collect(), (400..600).collect()];
        let plane = |height| {
            Shape::with_axis(Family::Plane, Vec3::new(0.0, 0.0, height), Vec3::z(), [0.0; 3])
        };
        let directions = Directions::of(&scene, &[plane(0.0), plane(5.0)], &groups);
        let families =
            Families { allowed: Vec::new(), sigma: SIGMA, floor: SIGMA, ..fixtures::families() };
        let (needed, normal) = (asked(&faces[1], 200), Vec3::z());
        assert!(directions.plane(&faces[1], &normal, needed, &families).is_none());
        assert!(directions.plane(&faces[1], &normal, needed / 1e4, &families).is_some());
    }
}
