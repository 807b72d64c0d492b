use serde_json::{Value, json};
use utoipa::{
    ToSchema,
    openapi::{
        Ref, Required, Schema,
        extensions::Extensions,
        path::{Parameter, ParameterBuilder, ParameterIn},
        schema::{ArrayBuilder, KnownFormat, ObjectBuilder, SchemaFormat, Type},
    },
};

use crate::{
    segment::{HINT_EXAMPLE, Hint, MAX_HINT_BYTES, ParameterKind, ParameterSpec},
    service::{Listing, MAX_WAIT, is_list},
};

pub fn header_parameter(name: &str, help: &str, schema: ObjectBuilder) -> Parameter {
    ParameterBuilder::new()
        .name(name)
        .parameter_in(ParameterIn::Header)
        .required(Required::False)
        .description(Some(help))
        .schema(Some(schema))
        .build()
}

/// One row of the parameter table as a query parameter.
pub fn query_parameter(spec: &ParameterSpec) -> Parameter {
    let unit = spec.unit.map(|unit| format!(" Unit: {unit}.")).unwrap_or_default();
    let list = if is_list(spec) { " Repeat it, or write a,b,c." } else { "" };
    ParameterBuilder::new()
        .name(spec.name)
        .parameter_in(ParameterIn::Query)
        .required(Required::False)
        .description(Some(format!("{}.{unit}{list}{}", spec.help, in_words(spec))))
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
pub fn schema(spec: &ParameterSpec) -> Schema {
    let object = |t| ObjectBuilder::new().schema_type(t).extensions(said(spec));
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
            .extensions(said(spec))
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
        // Items are distinct, but `uniqueItems` makes a Set in Java, which its clients then read by index in forms.
        ParameterKind::Columns { max } => ArrayBuilder::new()
            .items(integer(ObjectBuilder::new().schema_type(Type::Integer), 1, max))
            .min_items(Some(3))
            .max_items(Some(3))
            .into(),
        ParameterKind::Regions { most } => ArrayBuilder::new()
            .items(integer(ObjectBuilder::new().schema_type(Type::Integer), 0, u32::MAX.into()))
            .min_items(Some(1))
            .max_items(Some(most))
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

/// Whole numbers from `min` to `max`.
fn integer(object: ObjectBuilder, min: u64, max: u64) -> ObjectBuilder {
    // not as floating-point numbers: the largest one would be rounded up
    let object = object.format(Some(SchemaFormat::KnownFormat(KnownFormat::Int64)));
    object.minimum(Some(min)).maximum(Some(max))
}

/// What a parameter is where it is absent, as an extension: clients made from the document send every `default` of it,
/// in the query and in the form, where it stands beside what their user says.
const DEFAULT: &str = "x-default";

fn said(spec: &ParameterSpec) -> Option<Extensions> {
    default(spec).map(|value| Extensions::from_iter([(DEFAULT, value)]))
}

/// The default for readers of the clients made from the document.
fn in_words(spec: &ParameterSpec) -> String {
    spec.default.map(|text| format!(" Default: {}.", text.replace(',', ", "))).unwrap_or_default()
}

/// A parameter of the query that is none of the table's.
pub fn other_parameter(name: &str, help: &str, schema: impl Into<Schema>) -> Parameter {
    ParameterBuilder::new()
        .name(name)
        .parameter_in(ParameterIn::Query)
        .required(Required::False)
        .description(Some(help))
        .schema(Some(schema.into()))
        .build()
}

/// How long to wait for a job's end.
pub fn wait() -> Parameter {
    let seconds = double(ObjectBuilder::new().schema_type(Type::Number));
    let seconds = seconds.minimum(Some(0)).maximum(Some(MAX_WAIT.as_secs()));
    let help = "Answer when the job has ended, or after so many seconds; at once when absent. `Prefer: wait=10` asks for \
                the same.";
    other_parameter("wait", help, seconds)
}

/// Which jobs to list.
pub fn listing() -> [Parameter; 3] {
    let text = || ObjectBuilder::new().schema_type(Type::String);
    let states = ArrayBuilder::new().items(Ref::from_schema_name("JobState")).min_items(Some(1));
    let size = integer(ObjectBuilder::new().schema_type(Type::Integer), 1, Listing::MAX_PAGE_SIZE);
    let sizes = format!("Most jobs of the answer; {} when absent.", Listing::PAGE_SIZE);
    let token = text().pattern(Some("^([0-9A-Fa-f]{8}(-[0-9A-Fa-f]{4}){3}-[0-9A-Fa-f]{12})?$"));
    [
        other_parameter(
            "state",
            "Only jobs in one of these states. Repeat it, or write a,b.",
            states,
        ),
        other_parameter("page_size", &sizes, size),
        other_parameter(
            "page_token",
            "`next_page_token` of the page before; the first page when absent.",
            token,
        ),
    ]
}

/// The schema of a parameter with its meaning.
pub fn with_help(spec: &ParameterSpec) -> Schema {
    let unit = spec.unit.map(|unit| format!(" Unit: {unit}.")).unwrap_or_default();
    let help = Some(format!("{}.{unit}{}", spec.help, in_words(spec)));
    match schema(spec) {
        Schema::Object(mut object) => {
            object.description = help;
            object.into()
        }
        Schema::Array(mut array) => {
            array.description = help;
            array.into()
        }
        other => other,
    }
}

fn default(spec: &ParameterSpec) -> Option<Value> {
    let text = spec.default?;
    Some(match spec.kind {
        ParameterKind::List(_) => json!(text.split(',').collect::<Vec<_>>()),
        ParameterKind::Choice(_) | ParameterKind::Direction => json!(text),
        _ => serde_json::from_str(text).unwrap_or_else(|_| json!(text)),
    })
}
