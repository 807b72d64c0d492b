//! The noise that surfaces leave.

use crate::fit::Ruler;
use crate::fit::constant::constants;
use crate::segment::family::Families;
use crate::segment::median::deviation;
use crate::segment::objective::MOST;
use crate::segment::partition::Partition;
use crate::segment::prepare::scene::Scene;
use crate::segment::random::SplitMix64;

constants! {
    /// Labelled points that tell the noise, unless they are most of a small scene's.
    ENOUGH: usize = 100, Derived("the noise from so many is off by 1 / sqrt(2 n) = 7 %");
    /// Factor by which the noise may fall at once.
    LOWER: f64 = 0.2, Trial(0.2, 0.2);
}

/// Robust sigma of all labelled points about their surfaces, no less than rounding makes it.
///
/// On a level of steps most points leave nothing: spread over the step they lie as they did before they were rounded. What comes
/// out is 0.9 to 1.28 of the whole scatter, the latter where that is rounding alone.
pub fn residual_sigma(scene: &Scene, model: &Partition) -> Option<f64> {
    let labelled = model.labels.iter().zip(&scene.points).filter(|(l, _)| **l >= 0);
    let n = labelled.clone().count();
    if n < ENOUGH.get().min((MOST.get() * scene.len() as f64) as usize) {
        return None;
    }
    let on = |l: &i32| &model.shapes[*l as usize];
    let sigma = if scene.steps == [0.0; 3] {
        let rulers: Vec<Ruler> = model.shapes.iter().map(Ruler::of).collect();
        deviation(labelled.map(|(&l, p)| rulers[l as usize].distance(p)))?
    } else {
        let rounding = scene.rounding(labelled.clone().map(|(l, p)| (on(l), p)));
        let random = &mut SplitMix64::new(1);
        let mut unit = || random.next_u64() as f64 / u64::MAX as f64;
        let spread = labelled.map(|(l, p)| {
            let own = scene.rounding(std::iter::once((on(l), p)));
            on(l).distance(p) + own * 12_f64.sqrt() * (unit() - 0.5)
        });
        deviation(spread)?.max(rounding)
    };
    if n >= ENOUGH.get() {
        return Some(sigma);
    }
    // Of few points surfaces take up a good part of the noise.
    let taken: usize = model.shapes.iter().map(|s| s.family.dof()).sum();
    Some(sigma * (n as f64 / n.saturating_sub(taken).max(1) as f64).sqrt())
}

/// Takes the noise to be what is left at the surfaces found.
pub fn tighten(scene: &Scene, model: &Partition, families: &mut Families) {
    if let Some(s) = residual_sigma(scene, model) {
        families.sigma =
            s.max(families.sigma * LOWER.get()).min(families.sigma).max(families.floor);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fits::Random;
    use crate::geometry::Vec3;
    use crate::segment::fixtures::{SIGMA, ordered, partition, plane};

    #[test]
    fn the_noise_of_a_floor_is_told_whether_or_not_it_lies_on_one_level_of_steps() {
        for step in [0.0, 1e-6 * SIGMA, 1.8 * SIGMA, 6.0 * SIGMA] {
            let random = &mut Random::new(2);
            let mut at = || {
                let (x, y) = (random.uniform(0.0, 10.0), random.uniform(0.0, 10.0));
                let p = Vec3::new(x, y, SIGMA * random.normal());
                if step > 0.0 { p.map(|x| (x / step).round() * step) } else { p }
            };
            let points: Vec<Vec3> = (0..4000).map(|_| at()).collect();
            let scene = Scene::new(ordered(&points)).stepped([step; 3]);
            let model = partition(vec![plane(Vec3::zeros(), Vec3::z())], vec![0; scene.len()]);
            let whole = SIGMA.hypot(step / 12_f64.sqrt());
            let found = residual_sigma(&scene, &model).unwrap();
            assert!((0.9..1.3).contains(&(found / whole)), "{step}: {found} {whole}");
        }
    }
}
