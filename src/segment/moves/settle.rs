//! Labels and surfaces in turn.

use rayon::prelude::*;

use crate::fit::Shape;
use crate::fit::least_squares::{Options, fit};
use crate::segment::label::relabel::relabel;
use crate::segment::partition::{Partition, members};
use crate::segment::prepare::scene::Scene;
use crate::segment::prepare::take::take;

fn refit(scene: &Scene, shapes: &mut [Shape], labels: &[i32], sigma: f64, limit: usize) {
    let groups = members(labels, shapes.len());
    shapes.par_iter_mut().zip(&groups).for_each(|(s, g)| {
        if scene.cancelled() {
            return;
        }
        let points = take(scene, g, limit);
        if let Some(f) =
            fit(s, &points, None, &Options { cauchy: Some(4.0 * sigma), steps: 8, tolerance: 1e-6 })
        {
            *s = f.shape;
        }
    });
}

/// Relabels and refits until few labels change.
pub fn settle(scene: &Scene, model: &mut Partition, sigma: f64, rounds: usize) {
    for _ in 0..rounds {
        if scene.cancelled() {
            break;
        }
        let before = model.labels.clone();
        relabel(scene, &model.shapes, &mut model.labels, sigma, 12);
        refit(scene, &mut model.shapes, &model.labels, sigma, 4000);
        let changed = before.iter().zip(&model.labels).filter(|(a, b)| a != b).count();
        if changed * 2000 <= scene.len() {
            break;
        }
    }
}
