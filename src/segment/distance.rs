//! The default method: hypotheses grown from local starts, chosen by description length, relabelled
//! together, typed and fitted by orthogonal distance.

use crate::geometry::{PointCloud, Vec3};
use crate::segment::found::Found;
use crate::segment::prepare::distinct::distinct_points;
use crate::segment::sample::discover_on_samples;
use crate::segment::sample::discovery::{Discovery, rounding};
use crate::segment::{
    Counters, Monitor, Parameters, SegmentError, Segmentation, Stage, finish, objective, report,
};

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
    Ok(report::report(parameters, found, monitor)?)
}

fn find<'a>(
    cloud: &[Vec3],
    parameters: &Parameters,
    monitor: &'a dyn Monitor,
) -> Result<Found<'a>, SegmentError> {
    monitor.progress(Stage::Prepare, 0.0);
    let (points, centre, places) = distinct_points(cloud, monitor)?;
    let (discovery, labelled) = discover_on_samples(&points, parameters, monitor)?;
    monitor.progress(Stage::Refine, 0.85);
    let reach = objective::ACCEPT.get() * discovery.scatter(points.len());
    let rounding = rounding(&discovery.scene.points);
    let Discovery { scene, mut model, sigma, noise } = discovery;
    if parameters.refine {
        finish::finish(&points, &labelled, &mut model, sigma, monitor);
        monitor.check()?;
    }
    let (trials, merges) = (model.trials, model.merges);
    let counters =
        Counters { trials: trials.0, failed_trials: trials.1, merges, ..Counters::default() };
    let mut labels = labelled.labels;
    for l in labels.iter_mut().filter(|l| !model.is_surface(**l)) {
        *l = -1;
    }
    let shapes = model.shapes;
    Ok(Found { points, centre, places, shapes, labels, noise, reach, rounding, scene, counters })
}
