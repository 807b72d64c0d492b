use super::{Cancelled, Method, Monitor, Parameters, Segmentation, distance, rcond};
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
    // Hundreds of short steps are shared out: from outside the pool each would wait for a thread to wake.
    rayon::scope(|_| match parameters.method {
        Method::Rcond => rcond::segment(cloud, parameters, monitor),
        Method::Distance => distance::segment(cloud, parameters, monitor),
    })
}
