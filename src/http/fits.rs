use axum::{
    extract::{Request as HttpRequest, State},
    response::Response,
};
use prost::Message;

use super::{
    accept,
    answer::{answered, carried},
    app::App,
    body,
    query::{Pairs, pairs},
};
use crate::service::{
    FitDocument, FitRequest, Representation, ServiceError, fit_specs, message::v1,
    unknown_fit_parameter,
};

/// The forms of a fit.
const FORMS: &[Representation] = &[Representation::Json, Representation::Protobuf];

/// Fit one feature to all points of a cloud
///
/// The points come as clouds do: as the body, or as the part `cloud` of a multipart body whose part `parameters` is a
/// JSON object. All of them are of one feature: none is left out unless `outliers` asks for it. Fewer points than
/// determine the feature, and points that leave a part of it free, are refused with what is missing.
#[utoipa::path(
    post,
    path = "/v1/fits",
    operation_id = "createFit",
    tag = "fits",
    responses((status = 200, description = "The feature", body = FitDocument)),
)]
pub async fn create(
    State(app): State<App>,
    query: Pairs,
    message: HttpRequest,
) -> Result<Response, ServiceError> {
    let given = pairs(query, |name| {
        fit_specs().find(|spec| spec.name == name).ok_or_else(|| unknown_fit_parameter(name))
    })?;
    let given = given.iter().map(|(name, value)| (name.as_str(), value.as_str()));
    let mut request = FitRequest::from_pairs(given)?;
    let form = accept::negotiate(message.headers(), FORMS)?;
    let upload = body::read(&app.service, message, &mut request).await?;
    let held = upload.held().clone();
    let document = app.service.fit(upload, request).await?;
    let bytes = match form {
        Representation::Protobuf => v1::FitResult::from(document).encode_to_vec(),
        _ => document.to_json()?,
    };
    Ok(answered(form, carried(bytes, &held)))
}
