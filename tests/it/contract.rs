//! The contracts are files, and the files are what the service does.

use std::{fs, path::Path};

use conicoid::segment::{Parameters, Silent, Uncertainty, segment};
use serde_json::Value;

use super::support::{conicoid, start, truth::smooth};

/// Compares a contract with its file; `UPDATE_CONTRACTS=1 cargo test --release` rewrites it.
fn compare(file: &str, contract: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    if std::env::var_os("UPDATE_CONTRACTS").is_some() {
        fs::write(&path, contract).unwrap();
    }
    let kept = fs::read_to_string(&path).unwrap_or_default();
    assert!(kept == contract, "{file} differs: run UPDATE_CONTRACTS=1 cargo test --release");
}

#[test]
fn the_openapi_file_is_what_the_command_prints() {
    let printed = conicoid(&["openapi"], None);
    compare("proto/openapi.json", &String::from_utf8(printed.stdout).unwrap());
}

#[tokio::test]
async fn the_openapi_document_and_its_page_are_served() {
    let running = start(&[]).await;
    let served: Value =
        reqwest::get(running.url("/openapi.json")).await.unwrap().json().await.unwrap();
    assert_eq!(served["openapi"], "3.1.0");
    let kept: Value = serde_json::from_slice(&conicoid(&["openapi"], None).stdout).unwrap();
    assert_eq!(served, kept);
    let page = reqwest::get(running.url("/docs")).await.unwrap().text().await.unwrap();
    assert!(page.contains("/openapi.json"));
    // works offline: nothing is loaded from elsewhere
    assert!(!page.contains("http://") && !page.contains("https://"));
}

/// Calls `visit` with every media type object in the document, its name and whether it is an answer's.
fn each_media_type(value: &Value, visit: &mut impl FnMut(&str, &Value)) {
    let Some(map) = value.as_object() else {
        return value.as_array().into_iter().flatten().for_each(|v| each_media_type(v, visit));
    };
    for (key, value) in map {
        match value.as_object() {
            Some(content) if key == "content" => {
                content.iter().for_each(|(name, media_type)| visit(name, media_type));
            }
            _ => each_media_type(value, visit),
        }
    }
}

#[test]
fn media_types_have_the_keys_of_openapi_3_1_alone_and_files_say_what_they_hold() {
    let document: Value = serde_json::from_slice(&conicoid(&["openapi"], None).stdout).unwrap();
    let mut seen = 0;
    each_media_type(&document["paths"], &mut |name, media_type| {
        seen += 1;
        for key in media_type.as_object().unwrap().keys() {
            let known = ["schema", "example", "examples", "encoding"].contains(&key.as_str());
            assert!(known || key.starts_with("x-"), "{name} has {key}");
        }
        let schema = &media_type["schema"];
        let described = schema["format"] != "binary" || schema["description"].is_string();
        assert!(described, "{name}: {schema}");
    });
    assert!(seen > 20);
}

#[test]
fn a_stream_of_events_is_text_to_the_contract() {
    let document: Value = serde_json::from_slice(&conicoid(&["openapi"], None).stdout).unwrap();
    let answer = &document["paths"]["/v1/jobs/{id}/events"]["get"]["responses"]["200"];
    assert_eq!(answer["content"]["text/event-stream"]["schema"]["type"], "string");
}

#[test]
fn the_uncertainty_of_every_type_is_as_the_contract_describes_it() {
    let mut types = std::collections::BTreeSet::new();
    for name in ["scene_10k", "chain3", "part"] {
        let cloud = smooth::make(name, 1).unwrap();
        let found = segment(&cloud.input(), &Parameters::default(), &Silent).unwrap();
        for region in found.regions {
            let Some(told) = region.uncertainty else { continue };
            let described: Uncertainty = serde_json::from_value(told.clone()).unwrap();
            assert_eq!(serde_json::to_value(described).unwrap(), told);
            types.insert(region.surface_type.name());
        }
    }
    let all = ["cone", "cylinder", "ellipsoid", "elliptic_cylinder", "plane", "sphere", "torus"];
    assert_eq!(types.into_iter().collect::<Vec<_>>(), all);
}

#[test]
fn every_reference_in_the_openapi_document_leads_somewhere() {
    let document: Value = serde_json::from_slice(&conicoid(&["openapi"], None).stdout).unwrap();
    let mut references = Vec::new();
    collect(&document, &mut references);
    assert!(!references.is_empty());
    for reference in references {
        let pointer = reference.strip_prefix('#').unwrap();
        assert!(document.pointer(pointer).is_some(), "{reference} leads nowhere");
    }
}

fn collect(value: &Value, into: &mut Vec<String>) {
    match value {
        Value::Object(map) => map.iter().for_each(|(key, value)| match value {
            Value::String(text) if key == "$ref" => into.push(text.clone()),
            other => collect(other, into),
        }),
        Value::Array(items) => items.iter().for_each(|item| collect(item, into)),
        _ => {}
    }
}
