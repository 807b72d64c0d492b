//! Joining regions that are one surface.

use rayon::prelude::*;

use crate::fit::least_squares::{Options, fit};
use crate::fit::{Family, Ruler, Shape};
use crate::geometry::Vec3;
use crate::segment::family::Families;
use crate::segment::median::median;
use crate::segment::moves::directions::{Directions, asked};
use crate::segment::moves::retype::SOUND;
use crate::segment::objective::BORDER;
use crate::segment::partition::{Partition, borders, members, retain};
use crate::segment::prepare::scene::Scene;
use crate::segment::prepare::take::take;

/// Points of each region that a joint fit looks at: too few cannot tell apart two large planes a
/// sigma from each other.
const MERGE_SAMPLE: usize = 1500;

/// Joins pairs of regions whose joint fit costs less description length: pairs of one family
/// wherever they lie, and neighbours of unlike families under either one's.
pub fn merge(scene: &Scene, model: &mut Partition, families: &Families) -> usize {
    if !families.policy.merge {
        return 0;
    }
    let sigma = families.sigma;
    let inverse = 1.0 / (sigma * sigma);
    let mut merges = 0;
    loop {
        if scene.cancelled() {
            return merges;
        }
        let groups = members(&model.labels, model.shapes.len());
        let samples: Vec<Vec<Vec3>> = groups.iter().map(|g| take(scene, g, MERGE_SAMPLE)).collect();
        let m = model.shapes.len();
        let touching = borders(scene, &model.labels);
        let mut pairs = Vec::new();
        for a in 0..m {
            for b in a + 1..m {
                if samples[a].is_empty() || samples[b].is_empty() {
                    continue;
                }
                if model.shapes[a].family == model.shapes[b].family
                    || touching.contains_key(&(a, b))
                {
                    pairs.push((a, b));
                }
            }
        }
        let cost = |s: &Shape, p: &[Vec3]| -> f64 { Ruler::of(s).truncated(p, inverse, 16.0) };
        let sound = |s: &Shape, p: &[Vec3]| cost(s, p) <= SOUND * p.len() as f64;
        let directions = Directions::of(scene, &model.shapes, &groups);
        let mut found: Vec<(f64, usize, usize, Shape)> = pairs
            .par_iter()
            .filter_map(|&(a, b)| {
                if scene.cancelled() {
                    return None;
                }
                let (sa, sb) = (&model.shapes[a], &model.shapes[b]);
                if sa.family == sb.family && !could_be_one(sa, sb, &samples[a], &samples[b]) {
                    return None;
                }
                let points: Vec<Vec3> = samples[a].iter().chain(&samples[b]).copied().collect();
                let needed = asked(&points, groups[a].len() + groups[b].len());
                let length = |s: &Shape, p: &[Vec3]| match s.family {
                    Family::Plane => directions.length(s, p, needed, families),
                    family => family.description_length(points.len()),
                };
                let alone = |k: usize| {
                    let (s, p) = (&model.shapes[k], &samples[k]);
                    cost(s, p) + length(s, p)
                };
                let share = points.len() as f64 / (groups[a].len() + groups[b].len()) as f64;
                let edges = touching.get(&(a, b)).map_or(0.0, |n| *n as f64);
                let apart = alone(a) + alone(b) + BORDER * edges * share;
                let mut best: Option<(f64, Shape)> = None;
                if sa.family == Family::Plane && sb.family == Family::Plane {
                    best = directions
                        .plane(&points, &sa.w(), needed, families)
                        .filter(|(s, _)| sound(s, &samples[a]) && sound(s, &samples[b]))
                        .map(|(s, c)| (c, s));
                }
                for s in [sa, sb] {
                    // A surface that misses most of the other's points is no start for both.
                    let other = if std::ptr::eq(s, sa) { &samples[b] } else { &samples[a] };
                    if sa.family != sb.family && cost(s, other) > 8.0 * other.len() as f64 {
                        continue;
                    }
                    let o = Options { cauchy: Some(4.0 * sigma), steps: 20, tolerance: 1e-4 };
                    let Some(f) = fit(s, &points, None, &o) else { continue };
                    // Both halves must lie on it: a region whose own surface is poor saves nothing.
                    if !sound(&f.shape, &samples[a]) || !sound(&f.shape, &samples[b]) {
                        continue;
                    }
                    let c = cost(&f.shape, &points) + length(&f.shape, &points);
                    if best.is_none_or(|b| c < b.0) {
                        best = Some((c, f.shape));
                    }
                }
                let (joint, shape) = best?;
                (joint < apart).then_some((joint - apart, a, b, shape))
            })
            .collect();
        found.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
        let mut used = vec![false; m];
        let mut keep = vec![true; m];
        for (_, a, b, shape) in found {
            if used[a] || used[b] {
                continue;
            }
            used[a] = true;
            used[b] = true;
            keep[b] = false;
            model.shapes[a] = shape;
            for l in &mut model.labels {
                if *l == b as i32 {
                    *l = a as i32;
                }
            }
            merges += 1;
        }
        if !retain(model, &keep) {
            return merges;
        }
    }
}

/// Points of each region that the cheap look takes.
const GLANCE: usize = 100;

/// A cheap look before the joint fit: whether sizes and directions are near enough to try.
fn could_be_one(a: &Shape, b: &Shape, pa: &[Vec3], pb: &[Vec3]) -> bool {
    let axial = a.family != Family::Sphere && a.family != Family::Ellipsoid;
    if axial && a.w().dot(&b.w()).abs() <= 0.9 {
        return false;
    }
    let glance = |p: &[Vec3]| -> Vec<Vec3> {
        let m = p.len().min(GLANCE);
        (0..m).map(|k| p[k * p.len() / m]).collect()
    };
    let (pa, pb) = (glance(pa), glance(pb));
    let reach = |p: &[Vec3]| {
        let c = p.iter().sum::<Vec3>() / p.len().max(1) as f64;
        p.iter().map(|x| (x - c).norm()).fold(0.0, f64::max)
    };
    let size = reach(&pa).max(reach(&pb));
    let typical = |s: &Shape, p: &[Vec3]| {
        let mut d: Vec<f64> = p.iter().map(|x| s.distance(x).abs()).collect();
        // a region may have lost its last points to its neighbours
        median(&mut d).unwrap_or(f64::INFINITY)
    };
    typical(a, &pb).min(typical(b, &pa)) < 0.1 * size
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fits::Random;
    use crate::segment::Parameters;
    use crate::segment::family::Policy;

    #[test]
    fn two_halves_of_the_noise_of_one_sheet_are_one_region_and_a_step_of_its_size_is_two() {
        let random = &mut Random::new(4);
        let sheet = |step: f64, random: &mut Random| -> Vec<Vec3> {
            let mut at = || {
                let (x, y) = (random.uniform(0.0, 50.0), random.uniform(0.0, 50.0));
                Vec3::new(x, y, random.normal() + if x < 25.0 { 0.0 } else { step })
            };
            (0..2000).map(|_| at()).collect()
        };
        let families = Families {
            allowed: Family::ALL.to_vec(),
            sigma: 1.0,
            floor: 1.0,
            max_radius: 1e3,
            strips: true,
            policy: Policy::of(&Parameters::default()),
        };
        let plane =
            |z: f64| Shape::with_axis(Family::Plane, Vec3::new(25.0, 25.0, z), Vec3::z(), [0.0; 3]);
        // One sheet, whose points took the surface that their neighbours lie nearer to.
        let scene = Scene::new(sheet(0.0, random));
        let side = |i: usize| {
            let around = scene.neighbours(i).iter().map(|&j| scene.points[j as usize].z);
            i32::from(around.sum::<f64>() > 0.0)
        };
        let labels: Vec<i32> = (0..scene.len()).map(side).collect();
        let mut model =
            Partition { shapes: vec![plane(-0.1), plane(0.1)], labels, ..Partition::default() };
        assert_eq!(merge(&scene, &mut model, &families), 1);
        // Two sheets a sigma apart.
        let scene = Scene::new(sheet(1.0, random));
        let labels = scene.points.iter().map(|p| i32::from(p.x > 25.0)).collect();
        let mut model =
            Partition { shapes: vec![plane(0.0), plane(1.0)], labels, ..Partition::default() };
        assert_eq!(merge(&scene, &mut model, &families), 0);
    }
}
