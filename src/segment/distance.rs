//! The default method: hypotheses grown from local starts, chosen by description length, relabelled
//! together, typed and fitted by orthogonal distance.

use crate::geometry::{PointCloud, Vec3};
use crate::segment::found::Found;
use crate::segment::layers::{self, Layer};
use crate::segment::prepare::distinct::distinct_points;
use crate::segment::prepare::noise;
use crate::segment::prepare::steps::resolution;
use crate::segment::sample::discovery::rounding;
use crate::segment::{Monitor, Parameters, SegmentError, Segmentation, Stage, report};

/// Finds the surfaces of a cloud by orthogonal distance.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn segment(
    cloud: &PointCloud,
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<Segmentation, SegmentError> {
    let known = resolution(cloud);
    let found = find(&cloud.points, &known, parameters, monitor)?;
    monitor.progress(Stage::Report, 0.95);
    Ok(report::report(parameters, found, &known, monitor)?)
}

fn find<'a>(
    cloud: &[Vec3],
    known: &[f64; 3],
    parameters: &Parameters,
    monitor: &'a dyn Monitor,
) -> Result<Found<'a>, SegmentError> {
    monitor.progress(Stage::Prepare, 0.0);
    let (points, centre, places) = distinct_points(cloud, monitor)?;
    let noise = noise::estimate(&points, known, monitor);
    monitor.check()?;
    let first = Layer::of(&points, &noise, parameters, monitor)?;
    let rounding = rounding(&first.scene.points);
    let noise = first.noise;
    let Layer { scene, shapes, labels, reaches, counters, .. } =
        layers::with_rougher(first, &points, parameters, monitor)?;
    Ok(Found { points, centre, places, shapes, labels, noise, reaches, rounding, scene, counters })
}
