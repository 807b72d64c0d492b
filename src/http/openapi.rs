use std::collections::BTreeMap;

use serde_json::{Value, json};
use utoipa::openapi::{
    Components, Content, Header, HeaderBuilder, Info, Object, OpenApi, OpenApiBuilder, Ref, RefOr,
    Required, ResponseBuilder, Schema,
    link::Link,
    path::{Operation, Parameter, ParameterBuilder, ParameterIn},
    request_body::{RequestBody, RequestBodyBuilder},
    schema::{AdditionalProperties, ArrayBuilder, KnownFormat, ObjectBuilder, SchemaFormat, Type},
    security::{HttpAuthScheme, HttpBuilder, SecurityRequirement, SecurityScheme},
    tag::TagBuilder,
};
use utoipa::{PartialSchema, ToSchema};

use super::problem::{self, Problem};
use crate::{
    segment::{HINT_EXAMPLE, Hint, MAX_HINT_BYTES, ParameterKind, ParameterSpec},
    service::{ERRORS, ErrorKind, ErrorRow, Representation, is_list, specs},
};

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
const TAGS: [(&str, &str); 3] = [
    ("segmentations", "From a cloud to its surfaces"),
    ("jobs", "Segmentations that outlive their request"),
    ("contract", "This reference and the viewer"),
];

/// The document with what the tables know: parameters, forms of the result, and errors.
pub fn complete(mut openapi: OpenApi) -> OpenApi {
    for item in openapi.paths.paths.values_mut() {
        let operations = [&mut item.get, &mut item.post, &mut item.delete];
        for operation in operations.into_iter().flatten() {
            let id = operation.operation_id.clone().unwrap_or_default();
            match id.as_str() {
                "createSegmentation" => describe_segmentation(operation),
                "getJobResult" => describe_result(operation),
                _ => {}
            }
            add_errors(operation, &id);
            add_headers(operation);
            if !OPEN.contains(&id.as_str()) {
                operation.security = Some(vec![
                    SecurityRequirement::default(),
                    SecurityRequirement::new::<_, _, String>("apiKey", []),
                ]);
            }
        }
    }
    openapi.extensions.get_or_insert_default().insert(ERROR_CODES.to_owned(), error_codes());
    openapi
}

/// Where the document lists the codes. An extension, for in a schema a list of words is a closed one:
/// clients made from it would fail at the first new code.
const ERROR_CODES: &str = "x-error-codes";

/// Every code a problem document may have, those of no described path and method among them.
fn error_codes() -> Value {
    let code = |row: &ErrorRow| json!({"code": row.code, "status": row.status, "title": row.title});
    ERRORS.iter().map(code).collect()
}

/// The operations that ask nobody for a key.
const OPEN: [&str; 3] = ["getOpenApi", "getDocs", "getViewer"];

fn describe_segmentation(operation: &mut Operation) {
    let parameters = specs().map(query_parameter);
    let text = || ObjectBuilder::new().schema_type(Type::String);
    let prefer = text().examples([json!("respond-async")]);
    let key = text().min_length(Some(1)).max_length(Some(255)).pattern(Some("^[!-~]+$"));
    let headers = [
        header_parameter("Prefer", "`respond-async` makes the request a job (RFC 7240)", prefer),
        header_parameter(
            "Idempotency-Key",
            "Names a submission, so that a retried one is the same",
            key,
        ),
    ];
    let parameters = parameters.chain(headers).map(RefOr::T);
    operation.parameters.get_or_insert_default().extend(parameters);
    operation.request_body = Some(RefOr::T(cloud_body()));
    describe_forms(operation);
    if let Some(RefOr::T(accepted)) = operation.responses.responses.get_mut("202") {
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
}

fn describe_result(operation: &mut Operation) {
    let labels = specs().filter(|spec| spec.name == "labels").map(query_parameter).map(RefOr::T);
    operation.parameters.get_or_insert_default().extend(labels);
    describe_forms(operation);
}

fn header_parameter(name: &str, help: &str, schema: ObjectBuilder) -> Parameter {
    ParameterBuilder::new()
        .name(name)
        .parameter_in(ParameterIn::Header)
        .required(Required::False)
        .description(Some(help))
        .schema(Some(schema))
        .build()
}

/// One row of the parameter table as a query parameter.
fn query_parameter(spec: &ParameterSpec) -> Parameter {
    let unit = spec.unit.map(|unit| format!(" Unit: {unit}.")).unwrap_or_default();
    let list = if is_list(spec) { " Repeat it, or write a,b,c." } else { "" };
    ParameterBuilder::new()
        .name(spec.name)
        .parameter_in(ParameterIn::Query)
        .required(Required::False)
        .description(Some(format!("{}.{unit}{list}", spec.help)))
        .schema(Some(query_schema(spec)))
        .build()
}

/// The schema of a parameter's value in a query: objects stand there as JSON text.
fn query_schema(spec: &ParameterSpec) -> Schema {
    match spec.kind {
        ParameterKind::Hints { .. } => {
            let text = ObjectBuilder::new().schema_type(Type::String);
            text.max_length(Some(MAX_HINT_BYTES)).examples([json!(HINT_EXAMPLE)]).into()
        }
        _ => schema(spec),
    }
}

/// A text without control characters.
const ONE_LINE: &str = r"^[^\x00-\x1f\x7f-\x9f]*$";

/// The schema of a parameter's value: its type, range, words and default.
fn schema(spec: &ParameterSpec) -> Schema {
    let object = |t| ObjectBuilder::new().schema_type(t).default(default(spec));
    match spec.kind {
        ParameterKind::Choice(words) => {
            object(Type::String).enum_values(Some(words.iter().copied())).into()
        }
        ParameterKind::List(words) => ArrayBuilder::new()
            .items(
                ObjectBuilder::new()
                    .schema_type(Type::String)
                    .enum_values(Some(words.iter().copied())),
            )
            .min_items(Some(1))
            .default(default(spec))
            .into(),
        ParameterKind::Number { min, max } if min == 0.0 => {
            double(object(Type::Number)).exclusive_minimum(Some(min)).maximum(Some(max)).into()
        }
        ParameterKind::Number { min, max } => {
            double(object(Type::Number)).minimum(Some(min)).maximum(Some(max)).into()
        }
        ParameterKind::Integer { min, max } => integer(object(Type::Integer), min, max).into(),
        ParameterKind::Boolean => object(Type::Boolean).into(),
        ParameterKind::Direction => ArrayBuilder::new()
            .items(double(ObjectBuilder::new().schema_type(Type::Number)))
            .min_items(Some(3))
            .max_items(Some(3))
            .into(),
        ParameterKind::Columns { max } => ArrayBuilder::new()
            .items(integer(ObjectBuilder::new().schema_type(Type::Integer), 1, max))
            .min_items(Some(3))
            .max_items(Some(3))
            .unique_items(true)
            .into(),
        ParameterKind::Hints { max } => ArrayBuilder::new()
            .items(Ref::from_schema_name(Hint::name()))
            .max_items(Some(max))
            .into(),
        ParameterKind::Text { max } => {
            object(Type::String).max_length(Some(max)).pattern(Some(ONE_LINE)).into()
        }
    }
}

fn double(object: ObjectBuilder) -> ObjectBuilder {
    object.format(Some(SchemaFormat::KnownFormat(KnownFormat::Double)))
}

fn integer(object: ObjectBuilder, min: u64, max: u64) -> ObjectBuilder {
    // not as floating-point numbers: the largest one would be rounded up
    object.minimum(Some(min)).maximum(Some(max))
}

fn default(spec: &ParameterSpec) -> Option<Value> {
    let text = spec.default?;
    Some(match spec.kind {
        ParameterKind::List(_) => json!(text.split(',').collect::<Vec<_>>()),
        ParameterKind::Choice(_) | ParameterKind::Direction => json!(text),
        _ => serde_json::from_str(text).unwrap_or_else(|_| json!(text)),
    })
}

/// The bytes of a file.
fn binary(help: &str) -> ObjectBuilder {
    ObjectBuilder::new()
        .schema_type(Type::String)
        .format(Some(SchemaFormat::KnownFormat(KnownFormat::Binary)))
        .description(Some(help))
}

/// The cloud, raw or in a form.
fn cloud_body() -> RequestBody {
    let file = binary("The file's bytes; its name may tell the format");
    let nothing_else = Some(AdditionalProperties::FreeForm(false));
    let parameters =
        specs().fold(Object::builder(), |object, spec| object.property(spec.name, schema(spec)));
    let parameters = parameters.additional_properties(nothing_else.clone());
    let form = ObjectBuilder::new()
        .additional_properties(nothing_else)
        .property("cloud", file)
        .property(
            "parameters",
            parameters
                .description(Some("The parameters of the query; each stands in one of the two")),
        )
        .required("cloud");
    let body = RequestBodyBuilder::new()
        .description(Some("The point cloud"))
        .required(Some(Required::True))
        .content("multipart/form-data", Content::new(Some(form)));
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
        json.example = serde_json::from_str(include_str!("pages/answer.json")).ok();
    }
    for form in Representation::ALL.iter().filter(|form| **form != Representation::Json) {
        // a media type itself has no description in OpenAPI 3.1
        let content = Content::new(Some(binary(form.help())));
        answer.content.insert(form.media_type().to_owned(), RefOr::T(content));
    }
}

/// One response for each status an operation may answer with, listing the codes of that status.
fn add_errors(operation: &mut Operation, id: &str) {
    let mut by_status: BTreeMap<u16, Vec<&ErrorRow>> = BTreeMap::new();
    for row in ERRORS.iter().filter(|row| applies(row.kind, id)) {
        by_status.entry(row.status).or_default().push(row);
    }
    for (status, rows) in by_status {
        let codes: Vec<_> = rows.iter().map(|r| format!("`{}`: {}", r.code, r.title)).collect();
        let schema = Content::new(Some(Ref::from_schema_name(Problem::name())));
        let response = ResponseBuilder::new()
            .description(codes.join(". "))
            .content(problem::MEDIA_TYPE, schema)
            .build();
        operation.responses.responses.insert(status.to_string(), response.into());
    }
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

/// Whether an operation can fail in this way.
fn applies(kind: ErrorKind, id: &str) -> bool {
    use ErrorKind as K;
    let result = id == "getJobResult";
    let open = OPEN.contains(&id);
    match kind {
        K::Internal | K::MalformedRequest => true,
        // every path has these; they are the answer to another path or method than described
        K::NotFound | K::MethodNotAllowed => false,
        // what a job says of itself
        K::RunCrashed => false,
        K::Unauthenticated => !open,
        K::JobNotFound => !open && id != "createSegmentation",
        K::JobNotFinished | K::JobFailed | K::StorageDamaged => result,
        K::Overloaded | K::QuotaExceeded => result || id == "createSegmentation",
        K::StorageFull => id == "deleteJob" || id == "createSegmentation",
        K::StorageFailed => result || id == "deleteJob" || id == "createSegmentation",
        K::NotAcceptable | K::UnknownParameter | K::InvalidParameter => {
            result || id == "createSegmentation"
        }
        _ => id == "createSegmentation",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_example_answer_is_one() {
        let text = include_str!("pages/answer.json");
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
        assert_eq!(of("axis_tolerance")["schema"]["default"], 0.05);
        assert_eq!(of("axis_tolerance")["schema"]["exclusiveMinimum"], 0);
        assert_eq!(of("min_points")["schema"]["minimum"], 10);
        assert_eq!(of("seed")["schema"]["maximum"], u64::MAX);
        assert_eq!(of("surfaces")["schema"]["default"][1], "sphere");
    }

    #[test]
    fn every_code_stands_in_the_document() {
        let document = serde_json::to_value(super::super::openapi()).unwrap();
        let codes = document[ERROR_CODES].as_array().unwrap();
        assert!(ERRORS.iter().all(|row| codes.iter().any(|code| code["code"] == row.code)));
    }
}
