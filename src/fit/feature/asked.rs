use super::association::Association;
use super::fixed::Fixed;
use super::kind::FeatureType;

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Asked {
    /// The type; the one that tells the points in the fewest words when absent.
    pub kind: Option<FeatureType>,
    /// How it is associated with the points.
    pub association: Association,
    /// Values that are not fitted.
    pub fixed: Fixed,
    /// Points whose distance is more than this many standard deviations are left out, again and again until none is.
    pub outliers: Option<f64>,
    /// Standard uncertainty, a length, of what all points have in common; see [`Parameter::standard`](super::Parameter::standard).
    pub type_b: f64,
    /// Probability that expanded uncertainties are made for.
    pub coverage: f64,
}
