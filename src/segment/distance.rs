//! The default method: hypotheses grown from local starts, chosen by description length, relabelled
//! together, typed and fitted by orthogonal distance.

use crate::geometry::{PointCloud, Vec3};
use crate::segment::found::Found;
use crate::segment::hints::apply::apply;
use crate::segment::layers::{self, Layer};
use crate::segment::prepare::distinct::distinct_points;
use crate::segment::prepare::noise;
use crate::segment::prepare::steps::resolution;
use crate::segment::sample::discovery::rounding;
use crate::segment::whole::{Whole, one_surface};
use crate::segment::{Monitor, Parameters, SegmentError, Segmentation, Stage, objective, report};

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
    let mut found = find(cloud, &known, parameters, monitor)?;
    let drafts = if parameters.hints.is_empty() {
        Vec::new()
    } else {
        let labels = cloud.labels.as_ref().map(|labels| of_distinct(labels, &found));
        apply(&mut found, labels.as_deref(), parameters, monitor)?
    };
    monitor.progress(Stage::Report, 0.95);
    Ok(report::report(parameters, found, drafts, &known, monitor)?)
}

/// What the cloud's points have, of the distinct points: of copies the first one's.
fn of_distinct<T: Copy + Default>(values: &[T], found: &Found) -> Vec<T> {
    let mut out = vec![T::default(); found.points.len()];
    for (value, &place) in values.iter().zip(&found.places).rev() {
        out[place as usize] = *value;
    }
    out
}

/// What is found in a cloud whose coordinates are known to come in steps of `known`.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn find<'a>(
    cloud: &PointCloud,
    known: &[f64; 3],
    parameters: &Parameters,
    monitor: &'a dyn Monitor,
) -> Result<Found<'a>, SegmentError> {
    monitor.progress(Stage::Prepare, 0.0);
    let (points, centre, places) = distinct_points(&cloud.points, monitor)?;
    let noise = noise::estimate(&points, known, monitor);
    monitor.check()?;
    let first = Layer::of(&points, &noise, parameters, monitor)?;
    let rounding = rounding(&first.scene.points);
    let mut noise = first.noise;
    let Layer { scene, mut shapes, mut labels, mut reaches, mut sigmas, counters, .. } =
        layers::with_rougher(first, &points, parameters, monitor)?;
    if labels.iter().all(|l| *l < 0)
        && let Some(Whole { shape, sigma, labels: all }) =
            one_surface(&points, parameters.noise_sigma, monitor)
    {
        (shapes, labels, noise) = (vec![shape], all, sigma);
        (reaches, sigmas) = (vec![objective::ACCEPT.get() * sigma], vec![sigma]);
    }
    let told = vec![None; shapes.len()];
    let mut found = Found {
        points,
        centre,
        places,
        shapes,
        labels,
        noise,
        reaches,
        sigmas,
        rounding,
        scene,
        told,
        normals: None,
        counters,
    };
    found.normals = cloud.normals.as_ref().map(|normals| {
        let normals: Vec<Vec3> = normals.iter().map(|n| Vec3::from(n.map(f64::from))).collect();
        of_distinct(&normals, &found)
    });
    Ok(found)
}
