use rayon::prelude::*;

use super::{Cancelled, Method, Monitor, Parameters, Segmentation, distance, rcond};
use crate::geometry::{PointCloud, Vec3};
use crate::segment::hints::crop;
use crate::segment::rcond::grow::PoolError;

/// Largest size of a coordinate. Products of up to six coordinates are summed over all points: with this
/// size those of a hundred million points are still finite.
pub const LARGEST_COORDINATE: f64 = 1e50;
/// Smallest extent of a cloud, along the axis where it is largest: with this one the same products do not
/// vanish yet.
pub const SMALLEST_EXTENT: f64 = 1e-50;

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
    /// What the hints that crop leave is less than one region needs.
    #[error(
        "{points} of the cloud's points lie where the hints crop it; a region needs at least {needed}: \
         crop it to more (labels are those of the file's column label, as the PLY file of a result has it)"
    )]
    CroppedToFew {
        /// Points left.
        points: usize,
        /// The smallest number that can make a region.
        needed: usize,
    },
    /// A coordinate is too large to reckon with.
    #[error(
        "the largest coordinate is {0:e} in size; at most {LARGEST_COORDINATE:e} can be worked with"
    )]
    CoordinateTooLarge(f64),
    /// The points are too close together to reckon with, or all the same.
    #[error(
        "the cloud's extent is {0:e}; at least {SMALLEST_EXTENT:e} is needed (0 means that all points \
         are the same)"
    )]
    ExtentTooSmall(f64),
    /// The cloud has more points than the neighbour search can index.
    #[error(transparent)]
    TooManyPoints(#[from] PoolError),
}

/// Finds the quadric surfaces in `cloud`.
///
/// # Errors
/// The cloud has too few points for any region, its coordinates cannot be worked with, or `monitor`
/// cancelled the work.
pub fn segment(
    cloud: &PointCloud,
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<Segmentation, SegmentError> {
    monitor.check()?;
    check_count(cloud, parameters)?;
    let Some(keep) = crop::kept(cloud, &parameters.hints) else {
        return segment_all(cloud, parameters, monitor);
    };
    let part = cloud.part(&keep);
    let (points, needed) = (part.points.len(), parameters.min_points);
    if points < needed {
        return Err(SegmentError::CroppedToFew { points, needed });
    }
    let mut found = segment_all(&part, parameters, monitor)?;
    found.labels = part.labels_in_input_order(found.labels);
    let outside = cloud.points.len() - points;
    found.unassigned.count += outside;
    if outside > 0 {
        found.unassigned.reasons.insert("outside", outside);
    }
    found.hints.extend(crop::outcomes(cloud, &parameters.hints));
    found.hints.sort_by_key(|told| told.hint);
    Ok(found)
}

/// Whether a cloud can be worked with at all.
///
/// # Errors
/// It has too few points for any region, or its coordinates cannot be worked with.
pub fn check(cloud: &PointCloud, parameters: &Parameters) -> Result<(), SegmentError> {
    check_count(cloud, parameters)?;
    check_extent(&cloud.points)
}

fn check_count(cloud: &PointCloud, parameters: &Parameters) -> Result<(), SegmentError> {
    let (points, needed) = (cloud.points.len(), parameters.min_points);
    if points < needed { Err(SegmentError::TooFewPoints { points, needed }) } else { Ok(()) }
}

/// Finds the surfaces in all of `cloud`.
fn segment_all(
    cloud: &PointCloud,
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<Segmentation, SegmentError> {
    check_extent(&cloud.points)?;
    // Hundreds of short steps are shared out: from outside the pool each would wait for a thread to wake.
    rayon::scope(|_| match parameters.method {
        Method::Rcond => rcond::segment(cloud, parameters, monitor),
        Method::Distance => distance::segment(cloud, parameters, monitor),
    })
}

fn check_extent(points: &[Vec3]) -> Result<(), SegmentError> {
    let none = || (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    let bounds = points.par_iter().with_min_len(4096).map(|p| (*p, *p));
    let (low, high) = bounds.reduce(none, |a, b| (a.0.inf(&b.0), a.1.sup(&b.1)));
    let largest = low.abs().sup(&high.abs()).max();
    if largest > LARGEST_COORDINATE {
        return Err(SegmentError::CoordinateTooLarge(largest));
    }
    let extent = (high - low).max();
    if extent < SMALLEST_EXTENT {
        return Err(SegmentError::ExtentTooSmall(extent));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::Silent;

    /// A square sheet of 20 x 20 points, bent to a cylinder of radius 2.
    fn sheet(scale: f64) -> PointCloud {
        let at = |k: usize| {
            let (angle, height) = (0.1 * (k / 20) as f64, 0.2 * (k % 20) as f64);
            scale * Vec3::new(2.0 * angle.cos(), 2.0 * angle.sin(), height)
        };
        PointCloud::from_points((0..400).map(at).collect())
    }

    #[test]
    fn a_cloud_is_worked_with_at_both_ends_of_the_range() {
        for scale in [1.0, LARGEST_COORDINATE / 4.0, SMALLEST_EXTENT / 3.8] {
            let found = segment(&sheet(scale), &Parameters::default(), &Silent).unwrap();
            assert_eq!(found.regions.len(), 1, "{scale:e}");
            let radius = found.regions[0].uncertainty.as_ref().unwrap()["radius"].as_f64();
            assert!(radius.unwrap().is_finite() && found.regions[0].fit.rms.is_finite());
        }
    }

    #[test]
    fn a_cloud_out_of_the_range_is_refused() {
        let refused = |cloud| segment(&cloud, &Parameters::default(), &Silent).unwrap_err();
        assert_eq!(refused(sheet(1e60)), SegmentError::CoordinateTooLarge(3.8e60));
        assert!(matches!(refused(sheet(1e-51)), SegmentError::ExtentTooSmall(_)));
        let same = PointCloud::from_points(vec![Vec3::new(1.5, 2.5, 3.5); 500]);
        assert_eq!(refused(same), SegmentError::ExtentTooSmall(0.0));
    }
}
