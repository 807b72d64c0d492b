//! The default method: hypotheses grown from local starts, chosen by description length, relabelled
//! together, typed and fitted by orthogonal distance.

mod engine;
mod family;
mod hypothesis;
mod label;
mod moves;
mod noise;
mod scene;
mod select;

pub use engine::Model;
use family::Families;
use scene::{Scene, morton_order};

use super::{Parameters, SegmentError};
use crate::fit::Family;
use crate::geometry::{PointCloud, Vec3};

/// Finds surfaces and labels.
pub fn run(cloud: &PointCloud, parameters: &Parameters) -> Result<(Vec<crate::fit::Shape>, Vec<i32>, f64), SegmentError> {
    let n = cloud.points.len();
    let centre = cloud.points.iter().sum::<Vec3>() / n as f64;
    let order = morton_order(&cloud.points);
    let points: Vec<Vec3> = order.iter().map(|&i| cloud.points[i as usize] - centre).collect();
    let mut scene = Scene::new(points);
    let extent = scene.points.iter().map(|p| p.norm()).fold(0.0, f64::max);
    let sigma = parameters.noise_sigma.unwrap_or_else(|| noise::estimate(&scene)).max(5e-8 * extent);
    scene.sharpen_normals(sigma);
    let mut families = Families { allowed: Family::ALL.to_vec(), sigma, max_radius: 20.0 * extent, floor: 5e-8 * extent };
    let mut model = engine::discover(&scene, &mut families, parameters.seed, parameters.min_points);
    let keep: Vec<bool> = model.shapes.iter().map(|s| s.family != Family::Torus).collect();
    for l in &mut model.labels {
        if *l >= 0 && !keep[*l as usize] {
            *l = -1;
        }
    }
    engine::retain(&mut model, &keep);
    let mut labels = vec![-1; n];
    for (&i, &l) in order.iter().zip(&model.labels) {
        labels[i as usize] = l;
    }
    let shapes = model.shapes.iter().map(|s| s.translated(&centre)).collect();
    Ok((shapes, labels, families.sigma))
}
