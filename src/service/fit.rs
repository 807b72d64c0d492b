use super::{FitDocument, FitRequest, ServiceError, compute::read};
use crate::{answer::fits::fit_cloud, formats::Limits, jobs::Control};

/// Reads the points in `bytes` and fits one feature to all of them.
///
/// # Errors
/// The cloud cannot be read, its points do not determine the feature, or `control` stopped the run.
pub fn compute_fit(
    bytes: &[u8],
    request: &FitRequest,
    limits: &Limits,
    control: &Control,
) -> Result<FitDocument, ServiceError> {
    let (cloud, input) = read(bytes, &request.request, limits, control)?;
    fit_cloud(&cloud, input, request)
}
