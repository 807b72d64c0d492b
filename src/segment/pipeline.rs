use super::region::describe;
use super::{
    Cancelled, Method, Monitor, Parameters, Segmentation, Stage, Unassigned, distance, rcond,
};
use crate::geometry::PointCloud;
use crate::grow::PoolError;

/// Why a segmentation could not be done.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SegmentError {
    /// The caller cancelled it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The cloud has fewer finite points than one region needs.
    #[error("the cloud has {points} finite points; a region needs at least {needed}")]
    TooFewPoints {
        /// Finite points in the cloud.
        points: usize,
        /// The smallest number that can make a region.
        needed: usize,
    },
    /// The cloud has more points than the neighbour search can index.
    #[error(transparent)]
    TooManyPoints(#[from] PoolError),
}

/// Finds the quadric surfaces in `cloud`.
///
/// # Errors
/// The cloud is too small for any region, or `monitor` cancelled the work.
pub fn segment(
    cloud: &PointCloud,
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<Segmentation, SegmentError> {
    monitor.check()?;
    let n = cloud.points.len();
    if n < parameters.min_points {
        return Err(SegmentError::TooFewPoints { points: n, needed: parameters.min_points });
    }
    let found = match parameters.method {
        Method::Rcond => rcond::find(&cloud.points, parameters, monitor)?,
        Method::Distance => return distance::segment(cloud, parameters, monitor),
    };
    monitor.progress(Stage::Report, 0.95);
    Ok(report(cloud, parameters, found))
}

fn report(cloud: &PointCloud, parameters: &Parameters, found: rcond::Found) -> Segmentation {
    let mut points = vec![Vec::new(); found.surfaces.len()];
    for (point, &label) in cloud.points.iter().zip(&found.labels) {
        if let Some(of_region) = usize::try_from(label).ok().and_then(|l| points.get_mut(l)) {
            of_region.push(*point);
        }
    }
    let regions = found
        .surfaces
        .iter()
        .zip(&points)
        .enumerate()
        .filter_map(|(id, (surface, points))| describe(id, &surface.quadric, points))
        .collect();
    let count = found.labels.iter().filter(|l| **l < 0).count();
    Segmentation {
        parameters: parameters.clone(),
        regions,
        labels: found.labels,
        unassigned: Unassigned { count, reasons: [("no_quadric", count)].into() },
        counters: found.counters,
    }
}
