use std::collections::BTreeMap;

use serde_json::{Value, json};
use utoipa::openapi::{
    Components, Content, Info, Object, OpenApi, OpenApiBuilder, Ref, RefOr, Required, Response,
    ResponseBuilder, Schema,
    path::{Operation, Parameter, ParameterBuilder, ParameterIn},
    request_body::{RequestBody, RequestBodyBuilder},
    schema::{ArrayBuilder, KnownFormat, ObjectBuilder, SchemaFormat, Type},
};
use utoipa::{PartialSchema, ToSchema};

use super::problem::{self, Problem};
use crate::{
    segment::{ParameterKind, ParameterSpec},
    service::{ERRORS, ErrorKind, ErrorRow, Representation, specs},
};

const DESCRIPTION: &str = "Point cloud in, quadric surfaces out. Lengths are in the cloud's own \
unit, angles in radians, coefficients in the order of a1 x2 + a2 y2 + a3 z2 + a4 xy + a5 yz + a6 xz \
+ a7 x + a8 y + a9 z + a10 = 0. Every error is a problem document (RFC 9457) with a stable code.";

/// The document before its routes.
pub fn base() -> OpenApi {
    let mut info = Info::new("conicoid", env!("CARGO_PKG_VERSION"));
    info.description = Some(DESCRIPTION.to_owned());
    let mut schemas = vec![(Problem::name().into_owned(), Problem::schema())];
    Problem::schemas(&mut schemas);
    let components = Components::builder().schemas_from_iter(schemas).build();
    OpenApiBuilder::new().info(info).components(Some(components)).build()
}

/// The document with what the tables know: parameters, forms of the result, and errors.
pub fn complete(mut openapi: OpenApi) -> OpenApi {
    for (path, item) in &mut openapi.paths.paths {
        let operations = [&mut item.get, &mut item.post, &mut item.delete];
        for operation in operations.into_iter().flatten() {
            if operation.operation_id.as_deref() == Some("createSegmentation") {
                describe_segmentation(operation);
            }
            add_errors(operation, path);
        }
    }
    openapi
}

fn describe_segmentation(operation: &mut Operation) {
    let parameters = specs().map(|spec| RefOr::T(query_parameter(spec)));
    operation.parameters.get_or_insert_default().extend(parameters);
    operation.request_body = Some(RefOr::T(cloud_body()));
    if let Some(RefOr::T(answer)) = operation.responses.responses.get_mut("200") {
        describe_forms(answer);
    }
}

/// One row of the parameter table as a query parameter.
fn query_parameter(spec: &ParameterSpec) -> Parameter {
    let unit = spec.unit.map(|unit| format!(" Unit: {unit}.")).unwrap_or_default();
    let parameter = ParameterBuilder::new()
        .name(spec.name)
        .parameter_in(ParameterIn::Query)
        .required(Required::False)
        .description(Some(format!("{}.{unit}", spec.help)))
        .schema(Some(schema(spec)));
    match spec.kind {
        // lists are written a,b,c
        ParameterKind::List(_) | ParameterKind::Direction => parameter.explode(Some(false)).build(),
        _ => parameter.build(),
    }
}

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
    }
}

fn double(object: ObjectBuilder) -> ObjectBuilder {
    object.format(Some(SchemaFormat::KnownFormat(KnownFormat::Double)))
}

fn integer(object: ObjectBuilder, min: u64, max: u64) -> ObjectBuilder {
    object.minimum(Some(min as f64)).maximum(Some(max as f64))
}

fn default(spec: &ParameterSpec) -> Option<Value> {
    let text = spec.default?;
    Some(match spec.kind {
        ParameterKind::List(_) => json!(text.split(',').collect::<Vec<_>>()),
        ParameterKind::Choice(_) | ParameterKind::Direction => json!(text),
        _ => serde_json::from_str(text).unwrap_or_else(|_| json!(text)),
    })
}

fn binary() -> Content {
    let bytes = ObjectBuilder::new()
        .schema_type(Type::String)
        .format(Some(SchemaFormat::KnownFormat(KnownFormat::Binary)));
    Content::new(Some(bytes))
}

/// The cloud, raw or in a form.
fn cloud_body() -> RequestBody {
    let file = ObjectBuilder::new()
        .schema_type(Type::String)
        .format(Some(SchemaFormat::KnownFormat(KnownFormat::Binary)))
        .description(Some("The file's bytes; its name may tell the format"));
    let parameters =
        specs().fold(Object::builder(), |object, spec| object.property(spec.name, schema(spec)));
    let form = ObjectBuilder::new()
        .property("cloud", file)
        .property("parameters", parameters.description(Some("The parameters of the query")))
        .required("cloud");
    let mut body = RequestBodyBuilder::new()
        .description(Some("The point cloud"))
        .required(Some(Required::True))
        .content("multipart/form-data", Content::new(Some(form)));
    for media_type in ["application/octet-stream", "model/ply", "text/csv"] {
        body = body.content(media_type, binary());
    }
    body.build()
}

/// Every form of the result beside JSON.
fn describe_forms(answer: &mut Response) {
    for form in Representation::ALL.iter().filter(|form| **form != Representation::Json) {
        answer.content.insert(form.media_type().to_owned(), RefOr::T(binary()));
    }
}

/// One response for each status an operation may answer with, listing the codes of that status.
fn add_errors(operation: &mut Operation, path: &str) {
    let mut by_status: BTreeMap<u16, Vec<&ErrorRow>> = BTreeMap::new();
    for row in ERRORS.iter().filter(|row| applies(row.kind, path)) {
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

/// Whether an operation on `path` can fail in this way.
fn applies(kind: ErrorKind, path: &str) -> bool {
    match kind {
        ErrorKind::Internal => true,
        ErrorKind::NotFound | ErrorKind::MethodNotAllowed => false,
        _ => path == "/v1/segmentations",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(of("surfaces")["schema"]["default"][1], "sphere");
    }
}
