//! Choosing among overlapping hypotheses by description length.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use crate::segment::grow::hypothesis::Hypothesis;
use crate::segment::objective::{POINT_GAIN, surface_cost};
use crate::segment::prepare::scene::Scene;

/// Greedy selection: the hypothesis with the largest gain over the points not yet explained, again
/// and again, while it gains anything and explains at least `min_new` new points.
///
/// The gain is the sum of 6 - r2 / 2 sigma2 over new support, less dof ln n and a constant.
/// Returns the chosen hypotheses and a first label for each point of the scene, from `first_label` on.
pub fn select(
    scene: &Scene,
    hypotheses: Vec<Hypothesis>,
    sigma: f64,
    first_label: usize,
    min_new: usize,
) -> (Vec<Hypothesis>, Vec<i32>) {
    let mut labels = vec![-1; scene.len()];
    let worth: Vec<Vec<f32>> = hypotheses.iter().map(|h| worth(scene, h, sigma)).collect();
    let gain = |k: usize, labels: &[i32]| gain(&hypotheses[k], &worth[k], labels, min_new);
    let bound = |k: usize| Bound { sound: hypotheses[k].sound, gain: gain(k, &labels), k };
    // Gains only fall as points are taken, so an old gain is an upper bound.
    let mut bounds: BinaryHeap<Bound> =
        (0..hypotheses.len()).map(bound).filter(|b| b.gain > 0.0).collect();
    let mut chosen = Vec::new();
    while let Some(best) = bounds.pop().filter(|_| !scene.cancelled()) {
        let now = gain(best.k, &labels);
        if now < best.gain {
            if now > 0.0 {
                bounds.push(Bound { gain: now, ..best });
            }
            continue;
        }
        let label = (first_label + chosen.len()) as i32;
        for &i in &hypotheses[best.k].support {
            if labels[i as usize] < 0 {
                labels[i as usize] = label;
            }
        }
        chosen.push(best.k);
    }
    (chosen.into_iter().map(|k| hypotheses[k].clone()).collect(), labels)
}

/// What each point of a hypothesis is worth to it.
fn worth(scene: &Scene, h: &Hypothesis, sigma: f64) -> Vec<f32> {
    if scene.cancelled() {
        return Vec::new();
    }
    let inverse = 0.5 / (sigma * sigma);
    let sq = |i: u32| h.shape.distance(&scene.points[i as usize]).powi(2);
    h.support.iter().map(|&i| (POINT_GAIN.get() - sq(i) * inverse) as f32).collect()
}

/// What a hypothesis gains over the points without a label; nothing where these are fewer than `least`.
fn gain(h: &Hypothesis, worth: &[f32], labels: &[i32], least: usize) -> f64 {
    let (mut sum, mut new) = (0.0, 0usize);
    for (&i, &w) in h.support.iter().zip(worth) {
        if labels[i as usize] < 0 {
            sum += f64::from(w);
            new += 1;
        }
    }
    let cost = h.shape.family.description_length(new) + surface_cost();
    if new >= least { sum - cost } else { f64::NEG_INFINITY }
}

/// What a hypothesis gains at most. Unsound ones bridge several surfaces: they come after all others.
#[derive(Clone, Copy)]
struct Bound {
    sound: bool,
    gain: f64,
    k: usize,
}

impl Ord for Bound {
    fn cmp(&self, other: &Self) -> Ordering {
        let gains = self.gain.total_cmp(&other.gain);
        let sound = self.sound.cmp(&other.sound);
        sound.then(gains).then(Reverse(self.k).cmp(&Reverse(other.k)))
    }
}

impl PartialOrd for Bound {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Bound {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Bound {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::{Family, Shape};
    use crate::geometry::Vec3;

    /// A hypothesis of some points on the plane z = 0.
    fn hypothesis(support: std::ops::Range<u32>, sound: bool) -> Hypothesis {
        let shape = Shape::with_axis(Family::Plane, Vec3::zeros(), Vec3::z(), [0.0; 3]);
        Hypothesis { shape, support: support.collect(), correlation: 0.0, sound }
    }

    #[test]
    fn the_largest_gain_comes_first_and_what_it_leaves_must_still_gain() {
        let scene = Scene::new((0..400).map(|k| Vec3::new(f64::from(k), 0.0, 0.0)).collect());
        let found = vec![
            hypothesis(0..150, true),
            hypothesis(100..300, true),
            // leaves too few points
            hypothesis(290..310, true),
            // bridges, so comes last
            hypothesis(0..400, false),
        ];
        let (chosen, labels) = select(&scene, found, 1.0, 5, 20);
        let supports: Vec<usize> = chosen.iter().map(|h| h.support.len()).collect();
        assert_eq!(supports, [200, 150, 400]);
        assert!(
            (0..400).all(|i| labels[i] == [6, 5, 7][usize::from(i >= 100) + usize::from(i >= 300)])
        );
    }

    #[test]
    fn points_off_the_surface_are_worth_nothing() {
        let scene = Scene::new((0..100).map(|k| Vec3::new(f64::from(k), 0.0, 3.9)).collect());
        let (chosen, labels) = select(&scene, vec![hypothesis(0..100, true)], 1.0, 0, 20);
        assert!(chosen.is_empty() && labels.iter().all(|l| *l < 0));
    }
}
