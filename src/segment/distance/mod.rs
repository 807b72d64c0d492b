//! The default method: hypotheses grown from local starts, chosen by description length, relabelled
//! together, typed and fitted by orthogonal distance.

mod engine;
mod family;
mod finish;
mod hypothesis;
mod label;
mod moves;
mod noise;
mod scene;
mod select;

mod report;

use engine::Model;
use family::Families;
use scene::{Scene, morton_order};

use super::{Counters, Monitor, Parameters, SegmentError, Segmentation, Stage};
use crate::fit::{Family, Shape};
use crate::geometry::{PointCloud, Vec3};

/// What the default method found.
pub struct Found {
    /// Each region's surface, relative to `centre`.
    pub shapes: Vec<Shape>,
    /// The cloud's centre.
    pub centre: Vec3,
    /// Each point's region, -1 = none.
    pub labels: Vec<i32>,
    /// The noise's standard deviation, as estimated or given.
    pub sigma: f64,
    /// How much work it was.
    pub counters: Counters,
}

/// Finds the surfaces of a cloud by orthogonal distance.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn segment(
    cloud: &PointCloud,
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<Segmentation, SegmentError> {
    let found = find(&cloud.points, parameters, monitor)?;
    monitor.progress(Stage::Report, 0.95);
    Ok(report::report(cloud, parameters, found))
}

fn find(
    cloud: &[Vec3],
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<Found, SegmentError> {
    monitor.progress(Stage::Prepare, 0.0);
    let n = cloud.len();
    let centre = cloud.iter().sum::<Vec3>() / n as f64;
    let order = morton_order(cloud);
    let points: Vec<Vec3> = order.iter().map(|&i| cloud[i as usize] - centre).collect();
    let mut scene = Scene::new(points);
    let extent = scene.points.iter().map(|p| p.norm()).fold(0.0, f64::max);
    let floor = 5e-8 * extent;
    let sigma = parameters.noise_sigma.unwrap_or_else(|| noise::estimate(&scene)).max(floor);
    scene.sharpen_normals(sigma);
    let mut families =
        Families { allowed: Family::ALL.to_vec(), sigma, max_radius: 20.0 * extent, floor };
    monitor.progress(Stage::Grow, 0.1);
    let mut model = if parameters.noise_sigma.is_none() && noise::fills_volume(&scene, sigma) {
        Model { labels: vec![-1; n], ..Model::default() }
    } else {
        engine::discover(&scene, &mut families, parameters, monitor)?
    };
    monitor.progress(Stage::Refine, 0.85);
    finish::finish(&scene, &mut model, families.sigma);
    drop_tori(&mut model);
    let mut labels = vec![-1; n];
    for (&i, &l) in order.iter().zip(&model.labels) {
        labels[i as usize] = l;
    }
    let counters = Counters {
        trials: model.trials.0,
        failed_trials: model.trials.1,
        merges: model.merges,
        ..Counters::default()
    };
    Ok(Found { shapes: model.shapes, centre, labels, sigma: families.sigma, counters })
}

/// Tori competed for their points; they are not reported.
fn drop_tori(model: &mut Model) {
    let keep: Vec<bool> = model.shapes.iter().map(|s| s.family != Family::Torus).collect();
    for l in &mut model.labels {
        if *l >= 0 && !keep[*l as usize] {
            *l = -1;
        }
    }
    engine::retain(model, &keep);
}
