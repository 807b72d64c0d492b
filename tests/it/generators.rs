//! The OpenAPI document as generators of clients need it, and its names beside those of the gRPC contract.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

use conicoid::{segment::PARAMETERS, service::OPTIONS};
use serde_json::Value;

use super::support::conicoid;

fn document() -> Value {
    serde_json::from_slice(&conicoid(&["openapi"], None).stdout).unwrap()
}

/// Calls `visit` with every value in `value` and its place.
fn walk(value: &Value, place: &str, visit: &mut impl FnMut(&str, &Value)) {
    visit(place, value);
    match value {
        Value::Object(map) => {
            map.iter().for_each(|(key, value)| walk(value, &format!("{place}/{key}"), visit));
        }
        Value::Array(items) => {
            items.iter().enumerate().for_each(|(k, v)| walk(v, &format!("{place}/{k}"), visit));
        }
        _ => {}
    }
}

/// Every operation: its name and what it is.
fn operations(document: &Value) -> Vec<(String, &Value)> {
    let paths = document["paths"].as_object().unwrap().values();
    let operations = paths.flat_map(|path| path.as_object().unwrap().values());
    operations.map(|op| (op["operationId"].as_str().unwrap().to_owned(), op)).collect()
}

#[test]
fn nothing_stands_beside_a_reference() {
    let mut references = 0;
    walk(&document(), "", &mut |place, value| {
        if value.get("$ref").is_some() {
            references += 1;
            assert_eq!(value.as_object().unwrap().len(), 1, "{place}: {value}");
        }
    });
    assert!(references > 50);
}

#[test]
fn every_operation_has_one_success_and_one_type_of_it() {
    let document = document();
    let operations = operations(&document);
    let names: BTreeSet<_> = operations.iter().map(|(name, _)| name).collect();
    assert_eq!(names.len(), operations.len(), "an operationId stands twice");
    for (name, operation) in &operations {
        let answers = operation["responses"].as_object().unwrap();
        let good: Vec<_> = answers.iter().filter(|(status, _)| status.starts_with('2')).collect();
        assert_eq!(good.len(), 1, "{name}");
        let content = good[0].1["content"].as_object().unwrap();
        // all forms but JSON are files
        let typed = content.values().filter(|c| c["schema"].get("$ref").is_some());
        assert!(typed.count() <= 1, "{name}");
        let first = content.keys().next().unwrap();
        assert!(content.len() == 1 || first == "application/json", "{name}: {first} comes first");
    }
    let accepted = &document["paths"]["/v1/jobs"]["post"]["responses"]["202"];
    assert!(accepted["headers"]["Location"].is_object());
}

#[test]
fn whatever_has_fields_has_a_name() {
    let document = document();
    walk(&document, "", &mut |place, value| {
        if value.get("properties").is_none() {
            return;
        }
        let mut parts = place.strip_prefix("/components/schemas/").unwrap_or(place).split('/');
        let _name = parts.next();
        // what a schema adds to another is a part of it
        let own = matches!(
            (parts.next(), parts.next(), parts.next()),
            (None, ..) | (Some("allOf"), Some(_), None)
        );
        assert!(place.starts_with("/components/schemas/") && own, "{place}");
    });
    for (name, operation) in operations(&document) {
        let content = operation["requestBody"]["content"].as_object();
        for (media_type, body) in content.into_iter().flatten() {
            let file = body["schema"]["format"] == "binary";
            assert!(file || body["schema"].get("$ref").is_some(), "{name} {media_type}");
        }
    }
}

#[test]
fn clients_send_no_defaults_and_take_numbers_of_every_size() {
    walk(&document(), "", &mut |place, value| {
        let Some(object) = value.as_object() else { return };
        assert!(!object.contains_key("default") || place.ends_with("responses"), "{place}");
        let kind = &value["type"];
        let whole = kind == "integer"
            || kind.as_array().is_some_and(|kinds| kinds.contains(&"integer".into()));
        if whole && place.starts_with("/components") {
            assert!(object.contains_key("format"), "{place}");
        }
    });
}

#[test]
fn surfaces_are_told_apart_by_their_type() {
    let document = document();
    let schemas = &document["components"]["schemas"];
    let surface = &schemas["Surface"];
    assert_eq!(surface["discriminator"]["propertyName"], "type");
    let mapping = surface["discriminator"]["mapping"].as_object().unwrap();
    let one_of: BTreeSet<_> =
        surface["oneOf"].as_array().unwrap().iter().map(|s| s["$ref"].as_str().unwrap()).collect();
    let mapped: BTreeSet<_> = mapping.values().map(|place| place.as_str().unwrap()).collect();
    assert_eq!(one_of, mapped);
    for (name, place) in mapping {
        let schema = document.pointer(place.as_str().unwrap().strip_prefix('#').unwrap()).unwrap();
        assert_eq!(schema["properties"]["type"]["enum"], serde_json::json!([name]));
        assert!(schema["required"].as_array().unwrap().contains(&"type".into()), "{name}");
    }
}

#[test]
fn no_choice_is_of_another_choice() {
    let document = document();
    let mut choices = 0;
    walk(&document["components"]["schemas"], "", &mut |place, value| {
        let items = value["oneOf"].as_array().map(Vec::as_slice).unwrap_or_default();
        // one that may be null is no choice
        for item in items.iter().filter(|_| !items.iter().any(|item| item["type"] == "null")) {
            choices += 1;
            let Some(named) = item["$ref"].as_str() else { continue };
            let of = document.pointer(named.trim_start_matches('#')).unwrap();
            assert!(of.get("oneOf").is_none(), "{place}: {named}");
        }
    });
    assert!(choices > 10);
}

/// The fields of every message of the gRPC contract; a choice is one field.
fn messages() -> BTreeMap<String, BTreeSet<String>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("proto/conicoid/v1/conicoid.proto");
    let text = fs::read_to_string(path).unwrap();
    let (mut messages, mut message, mut choice) = (BTreeMap::new(), None, false);
    for line in text.lines().map(str::trim).filter(|line| !line.starts_with("//")) {
        let words: Vec<_> = line.split_whitespace().collect();
        match words.as_slice() {
            ["message", name, "{"] => {
                message = Some((*name).to_owned());
                messages.insert((*name).to_owned(), BTreeSet::new());
            }
            ["oneof", name, "{"] => {
                choice = true;
                let fields = message.as_ref().and_then(|message| messages.get_mut(message));
                fields.unwrap().insert((*name).to_owned());
            }
            ["}"] if choice => choice = false,
            ["}"] => message = None,
            [.., name, "=", _number] if !choice => {
                let fields = message.as_ref().and_then(|message| messages.get_mut(message));
                if let Some(fields) = fields {
                    fields.insert((*name).to_owned());
                }
            }
            _ => {}
        }
    }
    messages
}

/// The fields of a schema, those that it takes over among them.
fn fields(document: &Value, schema: &Value) -> BTreeSet<String> {
    if let Some(place) = schema["$ref"].as_str() {
        return fields(document, document.pointer(place.strip_prefix('#').unwrap()).unwrap());
    }
    let own = schema["properties"].as_object().into_iter().flatten().map(|(name, _)| name.clone());
    let parts = schema["allOf"].as_array().into_iter().flatten();
    own.chain(parts.flat_map(|part| fields(document, part))).collect()
}

#[test]
fn both_contracts_have_the_same_fields() {
    /// Messages whose schema has another name.
    const OTHERWISE: &[(&str, &str)] = &[
        ("Segmentation", "Document"),
        ("FitResult", "FitDocument"),
        ("Unassigned", "UnassignedPoints"),
        ("Job", "JobDocument"),
        ("Progress", "JobProgress"),
        ("ListJobsResponse", "JobList"),
        ("Problem", "JobProblem"),
    ];
    /// Messages that HTTP has in another form: requests, chunks of files, and what JSON writes as lists, maps and
    /// choices.
    const ALONE: &[&str] = &[
        "Bounds",
        "CancelJobRequest",
        "Deviation",
        "ExtractionCycles",
        "Feature",
        "FileChunk",
        "FitRequest",
        "GetJobFileRequest",
        "GetJobRequest",
        "GetJobResultRequest",
        "ListJobsRequest",
        "Polygon",
        "SegmentRequest",
        "Upload",
        "UploadStart",
        "Vector",
    ];
    let document = document();
    let schemas = document["components"]["schemas"].as_object().unwrap();
    let mut seen = BTreeSet::from([
        "FitForm",
        "FitFormParameters",
        "Dimensions",
        "Problem",
        "SegmentationForm",
        "SegmentationParameters",
        "Uncertainty",
    ]);
    for (message, expected) in messages() {
        if ALONE.contains(&message.as_str()) {
            continue;
        }
        let renamed =
            OTHERWISE.iter().find(|(name, _)| *name == message).map(|(_, schema)| *schema);
        let name = renamed.unwrap_or(&message);
        let (name, schema) =
            schemas.get_key_value(name).unwrap_or_else(|| panic!("no schema for {message}"));
        seen.insert(name);
        let mut told = fields(&document, schema);
        if schemas["Surface"]["discriminator"]["mapping"]
            .as_object()
            .unwrap()
            .values()
            .any(|place| place.as_str().unwrap().rsplit('/').next() == Some(name))
        {
            // the choice of the message says it
            assert!(told.remove("type"), "{name}");
        }
        assert_eq!(told, expected, "{message} and {name}");
    }
    let left: Vec<_> = schemas
        .iter()
        .filter(|(name, schema)| {
            !seen.contains(name.as_str()) && !fields(&document, schema).is_empty()
        })
        .map(|(name, _)| name)
        .collect();
    assert!(left.is_empty(), "no message for {left:?}");
}

#[test]
fn both_contracts_have_the_same_parameters() {
    let messages = messages();
    let names: BTreeSet<_> = PARAMETERS.iter().map(|spec| spec.name.to_owned()).collect();
    assert_eq!(messages["Parameters"], names);
    let options = OPTIONS.iter().map(|spec| match spec.name {
        // a truth in the message
        "labels" => "omit_labels",
        name => name,
    });
    // and what is a query's elsewhere, or no matter there
    let others = ["cloud", "parameters", "max_answer_bytes"];
    let all: BTreeSet<_> = options.chain(others).map(str::to_owned).collect();
    assert_eq!(messages["SegmentRequest"], all);
    let document = document();
    let form = fields(&document, &document["components"]["schemas"]["SegmentationParameters"]);
    let all: BTreeSet<_> = PARAMETERS.iter().chain(OPTIONS).map(|s| s.name.to_owned()).collect();
    assert_eq!(form, all);
    for path in ["/v1/segmentations", "/v1/jobs"] {
        let query = document["paths"][path]["post"]["parameters"].as_array().unwrap();
        let query = query.iter().filter(|p| p["in"] == "query" && p["name"] != "wait");
        let query: BTreeSet<_> = query.map(|p| p["name"].as_str().unwrap().to_owned()).collect();
        assert_eq!(query, all, "{path}");
    }
}

#[test]
fn every_list_of_an_answer_is_sent_in_pieces() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("proto/conicoid/v1/conicoid.proto");
    let text = fs::read_to_string(path).unwrap();
    let message =
        text.split("\nmessage Segmentation {").nth(1).unwrap().split("\n}").next().unwrap();
    let lists = message.lines().filter_map(|line| line.trim().strip_prefix("repeated "));
    let lists: Vec<_> = lists.map(|line| line.split_whitespace().nth(1).unwrap()).collect();
    // a new one needs its place in `Pieces`, unless it is always short, as that of the warnings is
    assert_eq!(
        lists,
        ["regions", "labels", "warnings", "relations", "measures", "hints", "fits", "face_labels"]
    );
}
