//! Surfaces that stand for two.
//!
//! Two seats of a shaft whose radii differ by a sigma or so touch each other: growth passes the step, for no
//! point there lies off the surface, and one surface between the two, mostly a cone, explains nearly all. What gives
//! it away is that residuals go together far beyond neighbours, above on one side of the step and below on the other.

use crate::fit::constant::constants;
use crate::fit::least_squares::{Options, fit};
use crate::fit::starts::Patch;
use crate::fit::{Ruler, Shape};
use crate::segment::family::Families;
use crate::segment::moves::pieces::Piece;
use crate::segment::moves::site::Site;
use crate::segment::objective::{ACCEPT, DOUBT, FEW, GOOD, HALF, LITTLE, ONE_OF_TWO, SURE};
use crate::segment::prepare::scene::Scene;
use crate::segment::prepare::take::take_with_normals;
use crate::segment::union::Union;

constants! {
    /// A patch lies off its surface where the mean of a neighbourhood does, by so many sigmas.
    PATCH: f64 = 1.0, Trial(1.0, 1.0);
    /// Points of each side that fits look at.
    SAMPLE: usize = 1500, Effort("points of one fit");
    /// Points of a block: enough that its mean shows a fraction of a sigma.
    BLOCK: usize = 32, Trial(32.0, 32.0);
    /// Rounds in which residuals are averaged with those of their neighbours.
    SMOOTHING: usize = 2, Trial(2.0, 2.0);
    /// Rounds in which the middle of heights is found.
    ROUNDS: usize = 10, Effort("rounds of a method that settles in a few");
    /// Steps of a fit.
    STEPS: usize = 20, Effort("steps of one fit");
}

/// Two surfaces instead of one whose residuals are of one sign on one side of a step and of the other beyond it.
pub fn sides(site: &Site<'_>) -> Option<Vec<Piece>> {
    let Site { scene, families, group, .. } = *site;
    let shape = site.shape();
    let uneven =
        group.len() >= 2 * ONE_OF_TWO.get() && is_uneven(scene, shape, group, families.sigma);
    uneven.then(|| two_sides(scene, shape, group, families)).flatten().map(Vec::from)
}

/// Whether the mean residuals of blocks of points that lie together spread more than the noise makes them.
fn is_uneven(scene: &Scene, shape: &Shape, group: &[u32], sigma: f64) -> bool {
    let ruler = Ruler::of(shape);
    let limit = SURE.get() * sigma;
    let blocks = group.len() / BLOCK.get();
    let sq_mean = |block: &[u32]| {
        let distance = |i: &u32| ruler.distance(&scene.points[*i as usize]).clamp(-limit, limit);
        (block.iter().map(distance).sum::<f64>() / block.len() as f64).powi(2)
    };
    let sum: f64 = group.chunks_exact(BLOCK.get()).map(sq_mean).sum();
    let spread = sum / blocks as f64 * BLOCK.get() as f64 / (sigma * sigma);
    spread > GOOD.get() + ACCEPT.get() * (2.0 / blocks as f64).sqrt()
}

/// The two sides of the step in a region, where there is one that is worth two surfaces.
fn two_sides(
    scene: &Scene,
    shape: &Shape,
    group: &[u32],
    families: &Families,
) -> Option<[Piece; 2]> {
    let n = group.len();
    let beside: Vec<Vec<u32>> = group
        .iter()
        .map(|&i| {
            let place = |j: &u32| group.binary_search(j).ok().map(|k| k as u32);
            scene.neighbours(i as usize).iter().filter_map(place).collect()
        })
        .collect();
    let ruler = Ruler::of(shape);
    let mut height: Vec<f64> =
        group.iter().map(|&i| ruler.distance(&scene.points[i as usize])).collect();
    for _ in 0..SMOOTHING.get() {
        height = (0..n)
            .map(|k| {
                let sum: f64 = beside[k].iter().map(|&o| height[o as usize]).sum();
                (height[k] + sum) / (beside[k].len() + 1) as f64
            })
            .collect();
    }
    let members =
        |side: Vec<u32>| -> Vec<u32> { side.into_iter().map(|k| group[k as usize]).collect() };
    let halves = halves(&height, &beside);
    let patches = [1.0, -1.0]
        .into_iter()
        .filter_map(|sign| patch(&height, &beside, |h| sign * h > PATCH.get() * families.sigma));
    halves
        .into_iter()
        .chain(patches)
        .find_map(|sides| judged(scene, shape, sides.map(&members), families))
}

/// The largest connected sets of points above and below the middle of their heights, where these hold most of all.
fn halves(height: &[f64], beside: &[Vec<u32>]) -> Option<[Vec<u32>; 2]> {
    let n = height.len();
    let middle = middle_of(height);
    let (upper, lower): (Vec<_>, Vec<_>) = connected(beside, |k| height[k] > middle)
        .into_iter()
        .partition(|set| height[set[0] as usize] > middle);
    // the largest of each come first
    let (upper, lower) = (upper.into_iter().next()?, lower.into_iter().next()?);
    let least = ONE_OF_TWO.get().max((LITTLE.get() * n as f64) as usize);
    // A wavy surface falls into more pieces.
    let most = (upper.len() + lower.len()) as f64 >= HALF.get() * n as f64;
    (upper.len().min(lower.len()) >= least && most).then_some([upper, lower])
}

/// The largest connected patch of points that lie `off`, and all others.
fn patch(height: &[f64], beside: &[Vec<u32>], off: impl Fn(f64) -> bool) -> Option<[Vec<u32>; 2]> {
    let sets = connected(beside, |k| off(height[k]));
    let patch = sets.into_iter().find(|set| off(height[set[0] as usize]))?;
    if patch.len() < FEW.get() {
        return None;
    }
    let others = (0..height.len() as u32).filter(|k| !off(height[*k as usize])).collect();
    Some([patch, others])
}

/// Sets of neighbours on one side, larger ones first; members rise.
fn connected(beside: &[Vec<u32>], side: impl Fn(usize) -> bool) -> Vec<Vec<u32>> {
    let mut union = Union::new(beside.len());
    for (k, beside) in beside.iter().enumerate() {
        for &other in beside.iter().filter(|&&other| side(other as usize) == side(k)) {
            union.join(k as u32, other);
        }
    }
    union.sets()
}

/// The surface of each side, where two are worth it.
fn judged(
    scene: &Scene,
    shape: &Shape,
    [upper, lower]: [Vec<u32>; 2],
    families: &Families,
) -> Option<[Piece; 2]> {
    let best = |side: &[u32]| {
        let (points, normals) = take_with_normals(scene, side, SAMPLE.get());
        let all = families.each(&Patch { points: &points, normals: &normals }, &[*shape]);
        let best = all.into_iter().min_by(|a, b| a.bic.total_cmp(&b.bic))?;
        (!is_uneven(scene, &best.shape, side, families.sigma)).then_some((best, points))
    };
    let ((a, mut together), (b, others)) = (best(&upper)?, best(&lower)?);
    together.extend(others);
    let options = Options {
        cauchy: Some(ACCEPT.get() * families.sigma),
        steps: STEPS.get(),
        tolerance: 1e-5,
    };
    let one = families.score(fit(shape, &together, None, &options)?.shape, &together);
    (a.bic + b.bic + DOUBT.get() < one.bic).then_some([(a.shape, upper), (b.shape, lower)])
}

/// The value that parts the lower from the upper ones: half way between the means of the two.
fn middle_of(values: &[f64]) -> f64 {
    let mut middle = values.iter().sum::<f64>() / values.len().max(1) as f64;
    for _ in 0..ROUNDS.get() {
        let (mut sum, mut count) = ([0.0; 2], [0.0_f64; 2]);
        for v in values {
            let k = usize::from(*v > middle);
            sum[k] += v;
            count[k] += 1.0;
        }
        middle = (sum[0] / count[0].max(1.0) + sum[1] / count[1].max(1.0)) / 2.0;
    }
    middle
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Family;
    use crate::fit::fits::Random;
    use crate::geometry::Vec3;
    use crate::segment::fixtures::{SIGMA, families, ordered};
    use crate::segment::moves::split::split;
    use crate::segment::partition::{Partition, members};
    use crate::segment::prepare::take::take;

    /// A shaft whose radius grows by `step` halfway, taken for one cylinder.
    fn shaft(step: f64) -> (Scene<'static>, Partition, Families) {
        let mut random = Random::new(8);
        let mut points: Vec<Vec3> = (0..6000)
            .map(|_| {
                let turn = random.uniform(0.0, std::f64::consts::TAU);
                let z = random.uniform(0.0, 30.0);
                let r = 12.0 + if z > 15.0 { step } else { 0.0 } + SIGMA * random.normal();
                Vec3::new(r * turn.cos(), r * turn.sin(), z)
            })
            .collect();
        points = ordered(&points);
        let size = [12.0 + step / 2.0, 0.0, 0.0];
        let shape = Shape::with_axis(Family::Cylinder, Vec3::zeros(), Vec3::z(), size);
        let labels = vec![0; points.len()];
        let model = Partition { shapes: vec![shape], labels, ..Partition::default() };
        (Scene::new(points), model, families())
    }

    #[test]
    fn a_step_of_little_more_than_the_noise_parts_two_cylinders() {
        let (scene, mut model, families) = shaft(1.5 * SIGMA);
        assert_eq!(split(&scene, &mut model, &families), 1);
        let mut radii: Vec<f64> = model.shapes.iter().map(|s| s.size[0]).collect();
        radii.sort_by(f64::total_cmp);
        assert!((radii[0] - 12.0).abs() < 0.001 && (radii[1] - 12.015).abs() < 0.001, "{radii:?}");
        let right =
            |(p, l): (&Vec3, &i32)| (model.shapes[*l as usize].size[0] > 12.007) == (p.z > 15.0);
        let share = scene.points.iter().zip(&model.labels).filter(|p| right(*p)).count();
        assert!(share as f64 > 0.98 * scene.len() as f64, "{share}");
    }

    #[test]
    fn a_small_patch_a_few_sigmas_off_a_large_face_is_a_face_of_its_own() {
        let mut random = Random::new(3);
        let off = |x: f64, y: f64| (x - 40.0).abs() < 4.0 && (y - 20.0).abs() < 2.0;
        let points: Vec<Vec3> = (0..16_000)
            .map(|_| {
                let (x, y) = (random.uniform(0.0, 80.0), random.uniform(0.0, 40.0));
                let height = if off(x, y) { 3.0 * SIGMA } else { 0.0 };
                Vec3::new(x, y, height + SIGMA * random.normal())
            })
            .collect();
        let points = ordered(&points);
        let (_, _, families) = shaft(0.0);
        let shapes = vec![Shape::with_axis(Family::Plane, Vec3::zeros(), Vec3::z(), [0.0; 3])];
        let labels = vec![0; points.len()];
        let (scene, mut model) =
            (Scene::new(points), Partition { shapes, labels, ..Partition::default() });
        assert_eq!(split(&scene, &mut model, &families), 1);
        let least = members(&model.labels, 2).iter().map(Vec::len).min().unwrap();
        // Six to five of the points, as noise lifts some beside it.
        let own = scene.points.iter().filter(|p| off(p.x, p.y)).count();
        assert!(least * 10 > own * 9 && least * 10 < own * 13, "{least} of {own}");
    }

    #[test]
    fn a_cone_hides_no_step() {
        let (scene, mut model, families) = shaft(1.2 * SIGMA);
        let points = take(&scene, &members(&model.labels, 1)[0], 6000);
        let cone = Shape { family: Family::Cone, size: [12.006, 0.0006, 0.0], ..model.shapes[0] };
        let options = Options { cauchy: None, steps: 30, tolerance: 1e-9 };
        model.shapes[0] = fit(&cone, &points, None, &options).unwrap().shape;
        assert_eq!(split(&scene, &mut model, &families), 1);
        for (z, r) in [(8.0, 12.0), (12.0, 12.0), (18.0, 12.012), (22.0, 12.012)] {
            let off = model.shapes.iter().map(|s| s.distance(&Vec3::new(0.0, r, z)).abs());
            assert!(off.fold(f64::INFINITY, f64::min) < 0.25 * SIGMA, "{z}: {:?}", model.shapes);
        }
    }

    #[test]
    fn one_cylinder_stays_one() {
        let (scene, mut model, families) = shaft(0.0);
        assert_eq!(split(&scene, &mut model, &families), 0);
    }
}
