use axum::{
    extract::{Request as HttpRequest, State},
    response::Response,
};

use super::{
    accept,
    answer::answered,
    app::App,
    body,
    media_type::FormMessage,
    query::{Pairs, joined, pairs},
};
use crate::service::{
    FitDocument, FitRequest, ServiceError, fit_specs, render_fit, unknown_fit_parameter,
};

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
    let given = joined(pairs(query)?, |name| {
        fit_specs().find(|spec| spec.name == name).ok_or_else(|| unknown_fit_parameter(name))
    })?;
    let given = given.iter().map(|(name, value)| (name.as_str(), value.as_str()));
    let mut request = FitRequest::from_pairs(given)?;
    let form = accept::negotiate(message.headers(), &FitDocument::OFFERED)?;
    let upload = body::read(&app.service, message, &mut request).await?;
    let held = upload.held().clone();
    let document = app.service.fit(upload, request).await?;
    Ok(answered(form, held.carrying(render_fit(form, document)?)))
}

/// Fit one feature to all points of a cloud of a form
///
/// `POST /v1/fits` for clients that know one kind of body for each path: a multipart body with the part `cloud` and a
/// part for each parameter, or all of them as a JSON object in the part `parameters`.
#[utoipa::path(
    post,
    path = "/v1/fits/form",
    operation_id = "createFitFromForm",
    tag = "fits",
    responses((status = 200, description = "The feature", body = FitDocument)),
)]
pub async fn create_from_form(
    app: State<App>,
    query: Pairs,
    FormMessage(message): FormMessage,
) -> Result<Response, ServiceError> {
    create(app, query, message).await
}
