//! Choosing among overlapping hypotheses by description length.

use crate::segment::grow::hypothesis::Hypothesis;
use crate::segment::objective::{POINT_GAIN, SURFACE_COST};
use crate::segment::prepare::scene::Scene;

/// Greedy selection: the hypothesis with the largest gain over the points not yet explained, again
/// and again, while it gains anything and explains at least `min_new` new points.
///
/// The gain is the sum of 6 - r2 / 2 sigma2 over new support, less dof ln n and a constant.
/// Returns the chosen hypotheses and a first label for each point of the scene.
pub fn select(
    scene: &Scene,
    hypotheses: Vec<Hypothesis>,
    sigma: f64,
    taken: &[i32],
    first_label: usize,
    min_new: usize,
) -> (Vec<Hypothesis>, Vec<i32>) {
    let mut labels = taken.to_vec();
    let inverse = 0.5 / (sigma * sigma);
    let worth: Vec<Vec<f32>> = hypotheses
        .iter()
        .map(|h| {
            if scene.cancelled() {
                return Vec::new();
            }
            let gain = |&i: &u32| {
                (POINT_GAIN - h.shape.distance(&scene.points[i as usize]).powi(2) * inverse) as f32
            };
            h.support.iter().map(gain).collect()
        })
        .collect();
    let gain = |k: usize, labels: &[i32]| {
        let (mut sum, mut new) = (0.0, 0usize);
        for (&i, &w) in hypotheses[k].support.iter().zip(&worth[k]) {
            if labels[i as usize] < 0 {
                sum += f64::from(w);
                new += 1;
            }
        }
        let cost = hypotheses[k].shape.family.description_length(new) + SURFACE_COST;
        if new >= min_new { sum - cost } else { f64::NEG_INFINITY }
    };
    // Gains only fall as points are taken, so an old gain is an upper bound.
    // Unsound hypotheses bridge several surfaces: they come after all others.
    let mut bound: Vec<(bool, f64, usize)> = (0..hypotheses.len())
        .map(|k| (!hypotheses[k].sound, gain(k, &labels), k))
        .filter(|g| g.1 > 0.0)
        .collect();
    let mut chosen = Vec::new();
    loop {
        if scene.cancelled() {
            break;
        }
        bound.sort_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)).then(a.2.cmp(&b.2)));
        let Some(&(_, old, k)) = bound.first() else { break };
        let now = gain(k, &labels);
        if now < old {
            if now <= 0.0 {
                bound.remove(0);
            } else {
                bound[0].1 = now;
            }
            continue;
        }
        bound.remove(0);
        let label = (first_label + chosen.len()) as i32;
        for &i in &hypotheses[k].support {
            if labels[i as usize] < 0 {
                labels[i as usize] = label;
            }
        }
        chosen.push(k);
    }
    (chosen.into_iter().map(|k| hypotheses[k].clone()).collect(), labels)
}
