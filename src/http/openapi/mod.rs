use serde_json::{Value, json};
use utoipa::openapi::{
    Components, Content, Header, HeaderBuilder, Info, OpenApi, OpenApiBuilder, Ref, RefOr,
    Required,
    link::Link,
    path::{Operation, Parameter},
    request_body::{RequestBody, RequestBodyBuilder},
    schema::{ObjectBuilder, Type},
    security::{HttpAuthScheme, HttpBuilder, SecurityRequirement, SecurityScheme},
    tag::TagBuilder,
};
use utoipa::{PartialSchema, ToSchema};

use super::problem::Problem;
use crate::service::{FitDocument, Representation, fit_specs, specs};
use form::{CloudForm, FIT_FORM, SEGMENTATION_FORM, binary};
use parameters::{header_parameter, listing, query_parameter, wait};

mod errors;
mod form;
mod parameters;
mod schemas;

const DESCRIPTION: &str = "Point cloud in, quadric surfaces out. Lengths are in the cloud's own \
unit, angles in radians, coefficients in the order of a1 x² + a2 y² + a3 z² + a4 xy + a5 yz + a6 xz \
+ a7 x + a8 y + a9 z + a10 = 0. The same cloud and parameters give the same answer, `timing` apart. \
Every error is a problem document (RFC 9457) with a stable code; `x-error-codes` lists them.";

/// The document before its routes.
pub fn base() -> OpenApi {
    let mut info = Info::new("conicoid", env!("CARGO_PKG_VERSION"));
    info.description = Some(DESCRIPTION.to_owned());
    let mut schemas = vec![(Problem::name().into_owned(), Problem::schema())];
    Problem::schemas(&mut schemas);
    let bearer = HttpBuilder::new()
        .scheme(HttpAuthScheme::Bearer)
        .description(Some("An API key, where the service asks for one"));
    let components = Components::builder()
        .schemas_from_iter(schemas)
        .security_scheme("apiKey", SecurityScheme::Http(bearer.build()))
        .build();
    let tags =
        TAGS.map(|(name, help)| TagBuilder::new().name(name).description(Some(help)).build());
    OpenApiBuilder::new().info(info).components(Some(components)).tags(Some(tags)).build()
}

/// The groups of operations, in the order in which they are read.
const TAGS: [(&str, &str); 4] = [
    ("segmentations", "From a cloud to its surfaces"),
    ("fits", "One feature through all points, with its uncertainty"),
    ("jobs", "Segmentations that outlive their request"),
    ("contract", "This reference and the viewer"),
];

/// The document with what the tables know: parameters, forms of the result, and errors.
pub fn complete(mut openapi: OpenApi) -> OpenApi {
    for item in openapi.paths.paths.values_mut() {
        let operations = [&mut item.get, &mut item.post, &mut item.delete];
        for operation in operations.into_iter().flatten() {
            let id = operation.operation_id.clone().unwrap_or_default();
            describe(operation, &id);
            errors::add_errors(operation, &id);
            add_headers(operation);
            if !errors::OPEN.contains(&id.as_str()) {
                operation.security = Some(vec![
                    SecurityRequirement::default(),
                    SecurityRequirement::new::<_, _, String>("apiKey", []),
                ]);
            }
        }
    }
    if let Some(components) = &mut openapi.components {
        let forms =
            SEGMENTATION_FORM.schemas(specs()).into_iter().chain(FIT_FORM.schemas(fit_specs()));
        components.schemas.extend(forms.map(|(name, schema)| (name.to_owned(), schema.into())));
        schemas::complete(components);
    }
    openapi
        .extensions
        .get_or_insert_default()
        .insert(errors::ERROR_CODES.to_owned(), errors::error_codes());
    openapi
}

/// What the tables know of an operation.
fn describe(operation: &mut Operation, id: &str) {
    let takes_cloud = id.starts_with("createSegmentation") || id.starts_with("createJob");
    let fits = id.starts_with("createFit");
    let form = id.ends_with("FromForm");
    let mut parameters: Vec<Parameter> = Vec::new();
    if takes_cloud && !form {
        parameters.extend(specs().map(query_parameter));
    }
    if fits {
        if !form {
            parameters.extend(fit_specs().map(query_parameter));
        }
        describe_fit_forms(operation);
    }
    if id.starts_with("createJob") {
        parameters.extend([wait(), idempotency_key()]);
        describe_links(operation);
    }
    match id {
        "listJobs" => parameters.extend(listing()),
        "getJob" => parameters.push(wait()),
        "getJobResult" => {
            parameters.extend(specs().filter(|spec| spec.name == "labels").map(query_parameter));
            parameters.push(wait());
        }
        _ => {}
    }
    if takes_cloud || fits {
        let forms = if fits { FIT_FORM } else { SEGMENTATION_FORM };
        operation.request_body = Some(RefOr::T(cloud_body(form.then_some(forms))));
    }
    if id.starts_with("createSegmentation") || id == "getJobResult" {
        describe_forms(operation);
    }
    if !parameters.is_empty() {
        let parameters = parameters.into_iter().map(RefOr::T);
        operation.parameters.get_or_insert_default().extend(parameters);
    }
}

fn idempotency_key() -> Parameter {
    let text = ObjectBuilder::new().schema_type(Type::String);
    let key = text.min_length(Some(1)).max_length(Some(255)).pattern(Some("^[!-~]+$"));
    header_parameter(
        "Idempotency-Key",
        "Names a submission, so that a retried one is the same",
        key,
    )
}

/// Where an accepted job leads.
fn describe_links(operation: &mut Operation) {
    let Some(RefOr::T(accepted)) = operation.responses.responses.get_mut("202") else { return };
    for (name, id, help) in [
        ("job", "getJob", "The job's state"),
        ("events", "getJobEvents", "The job's progress"),
        ("result", "getJobResult", "The job's result"),
        ("cancel", "deleteJob", "Cancels the job"),
    ] {
        let link = Link::builder().operation_id(id).description(help);
        let link = link.parameter("id", "$response.body#/id").build();
        accepted.links.insert(name.to_owned(), link.into());
    }
}

/// Every form of a fit but the usual one.
fn describe_fit_forms(operation: &mut Operation) {
    for form in FitDocument::OFFERED.into_iter().filter(|form| *form != Representation::Json) {
        let help = match form {
            Representation::Protobuf => "The message `conicoid.v1.FitResult`",
            form => form.help(),
        };
        add_form(operation, form, help);
    }
}

/// The cloud, raw or in a form: one kind a path, for generators take the first alone and trip over the second. The
/// paths of raw clouds take forms as well.
fn cloud_body(form: Option<CloudForm>) -> RequestBody {
    let body = RequestBodyBuilder::new()
        .description(Some("The point cloud"))
        .required(Some(Required::True));
    if let Some(form) = form {
        let form = Content::new(Some(Ref::from_schema_name(form.name)));
        return body.content("multipart/form-data", form).build();
    }
    let mut file = Content::new(Some(binary("The file's bytes")));
    file.example = Some(example());
    body.content("application/octet-stream", file).build()
}

/// A small cloud as text: points of a plane.
fn example() -> Value {
    let row = |i: usize| format!("{},{},{}", i % 4, i / 4, 2 * (i % 4));
    json!((0..16).map(row).collect::<Vec<_>>().join("\n"))
}

/// Every form of the result, and what the usual one looks like.
fn describe_forms(operation: &mut Operation) {
    let Some(RefOr::T(answer)) = operation.responses.responses.get_mut("200") else { return };
    if let Some(RefOr::T(json)) = answer.content.get_mut("application/json") {
        json.example = serde_json::from_str(include_str!("../pages/answer.json")).ok();
    }
    for form in Representation::ALL.iter().filter(|form| **form != Representation::Json) {
        add_form(operation, *form, form.help());
    }
}

/// Another form of an answer.
fn add_form(operation: &mut Operation, form: Representation, help: &str) {
    let Some(RefOr::T(answer)) = operation.responses.responses.get_mut("200") else { return };
    // a media type itself has no description in OpenAPI 3.1
    let content = Content::new(Some(binary(help)));
    answer.content.insert(form.media_type().to_owned(), RefOr::T(content));
}

/// What each answer says in its headers.
fn add_headers(operation: &mut Operation) {
    let header = |help: &str, schema_type| {
        HeaderBuilder::new()
            .schema(Some(ObjectBuilder::new().schema_type(schema_type)))
            .description(Some(help))
            .build()
    };
    for (status, response) in &mut operation.responses.responses {
        let RefOr::T(response) = response else { continue };
        let mut add = |name: &str, header: Header| {
            response.headers.insert(name.to_owned(), header.into());
        };
        add("X-Request-Id", header("The request's id, as in the log", Type::String));
        match status.as_str() {
            "202" => add("Location", header("Where the job is", Type::String)),
            "401" => add("WWW-Authenticate", header("`Bearer`", Type::String)),
            "429" | "503" | "507" => {
                add("Retry-After", header("Seconds to wait before a new try", Type::Integer))
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_example_answer_is_one() {
        let text = include_str!("../pages/answer.json");
        let document: crate::service::Document = serde_json::from_str(text).unwrap();
        assert_eq!(document.labels().len(), document.input.points);
        assert_eq!(
            serde_json::to_value(&document).unwrap(),
            serde_json::from_str::<Value>(text).unwrap()
        );
    }

    #[test]
    fn every_parameter_stands_in_the_document_with_its_default_and_range() {
        let document = serde_json::to_value(super::super::openapi()).unwrap();
        let parameters = &document["paths"]["/v1/segmentations"]["post"]["parameters"];
        let parameters = parameters.as_array().unwrap();
        assert!(specs().all(|spec| parameters.iter().any(|p| p["name"] == spec.name)));
        let of = |name: &str| parameters.iter().find(|p| p["name"] == name).unwrap();
        assert_eq!(of("axis_tolerance")["schema"]["x-default"], 0.05);
        assert_eq!(of("axis_tolerance")["schema"]["exclusiveMinimum"], 0);
        assert_eq!(of("min_points")["schema"]["minimum"], 10);
        assert_eq!(of("seed")["schema"]["maximum"], u64::MAX);
        assert_eq!(of("surfaces")["schema"]["x-default"][1], "sphere");
    }
}
