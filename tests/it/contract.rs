//! The contracts are files, and the files are what the service does.

use std::{fs, path::Path};

use serde_json::Value;

use super::support::{conicoid, start};

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
