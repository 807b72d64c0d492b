use maud::{Markup, html};
use serde_json::Value;

use crate::{
    answer::{
        Answer, Document,
        sheet::{count, number},
    },
    segment::{Outcome, Parameters, SamplingKind},
};

/// What was found, in a few numbers, and what limits it.
pub fn summary(document: &Document) -> Markup {
    let Document { parameters, unassigned, .. } = document;
    let points = document.input.points.max(1);
    let share = 100.0 * unassigned.count as f64 / points as f64;
    let length = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), number);
    html! {
        dl.tiles {
            div { dt { "Surfaces" } dd { (count(document.regions.len())) } }
            div { dt { "Noise (standard deviation)" } dd { (length(parameters.noise_sigma)) } }
            div { dt { "Tolerance" } dd { (length(parameters.tolerance)) } }
            div { dt { "Points on no surface" } dd { (count(unassigned.count)) small { " (" (format!("{share:.1}")) " %)" } } }
        }
        @for told in &document.hints {
            p.warning[told.outcome != Outcome::Applied].hint {
                strong { "Hint " (told.hint) ", " (outcome(told.outcome)) ". " } (told.message)
            }
        }
        @for warning in &document.warnings {
            p.warning { strong { "Note. " } (warning.message) }
        }
    }
}

/// What became of a hint, in a word or two.
fn outcome(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Applied => "applied",
        Outcome::Contradicted => "contradicted by the points",
        Outcome::NotFound => "without points",
    }
}

/// Every parameter as it was used, what was found of the cloud, and what was left over.
pub fn parameters(document: &Document) -> Markup {
    let defaults = serde_json::to_value(Parameters::default()).unwrap_or_default();
    let used = serde_json::to_value(&document.parameters).unwrap_or_default();
    let rows = used.as_object().into_iter().flatten();
    html! {
        section.columns {
            div {
                h2 { "Parameters" }
                table.facts {
                    @for (name, value) in rows.filter(|(_, value)| !value.is_null()) {
                        tr {
                            th { (name.replace('_', " ")) }
                            td { (text(value)) @if defaults.get(name) != Some(value) { small { (origin_of(name)) } } }
                        }
                    }
                }
            }
            div {
                h2 { "The cloud" }
                (cloud(document))
            }
        }
    }
}

/// How a value that is not the default came about.
fn origin_of(name: &str) -> &'static str {
    match name {
        // the same field holds what was given and what was found
        "tolerance" | "noise_sigma" => " as used",
        _ => " given",
    }
}

fn text(value: &Value) -> String {
    match value {
        Value::Array(items) => items.iter().map(text).collect::<Vec<_>>().join(", "),
        Value::String(word) => word.replace('_', " "),
        Value::Number(n) if n.is_f64() => n.as_f64().map(number).unwrap_or_default(),
        other => other.to_string(),
    }
}

fn cloud(document: &Document) -> Markup {
    let reasons = document.unassigned.reasons.iter();
    html! {
        table.facts {
            tr { th { "points" } td { (count(document.input.points)) } }
            @if let Some(mesh) = &document.input.mesh {
                tr { th { "mesh" } td { (count(mesh.faces)) " faces, " (count(mesh.vertices)) " vertices" } }
                @if let (Some(spacing), Some(error)) = (mesh.spacing, mesh.chord_error) {
                    tr { th { "spacing of the points on its faces" } td { (number(spacing)) } }
                    tr { th { "chord error of its faces" } td { (number(error)) } }
                }
            }
            @if document.input.skipped > 0 {
                tr { th { "holes, or not finite" } td { (count(document.input.skipped)) } }
            }
            tr { th { "unit" } td { (document.input.unit.map_or_else(|| "not known".to_owned(), |unit| unit.to_string())) } }
            @if document.input.resolution.iter().any(|step| *step > 0.0) {
                tr { th { "steps of coordinates" } td { (document.input.resolution.map(number).join(", ")) } }
            }
            @if let Some(sampling) = &document.sampling {
                tr { th { "sampling" } td { (kind(sampling.kind)) } }
                @if sampling.along > 0.0 {
                    tr { th { "spacing along" } td { (number(sampling.along)) } }
                }
                @if sampling.across > 0.0 {
                    tr { th { "spacing across" } td { (number(sampling.across)) } }
                }
            }
            @for (reason, n) in reasons {
                tr { th { "on no surface: " (reason.replace('_', " ")) } td { (count(*n)) } }
            }
        }
    }
}

fn kind(kind: SamplingKind) -> &'static str {
    match kind {
        SamplingKind::Scattered => "scattered",
        SamplingKind::ScanLines => "scan lines",
        SamplingKind::Grid => "grid",
        SamplingKind::Lattice => "lattice",
    }
}

/// What the report was made from and by.
pub fn origin(answer: &Answer) -> Markup {
    let document = &answer.document;
    html! {
        footer {
            @if let Some(name) = &answer.name { div { span { "File" } " " (name) } }
            div { span { "Format" } " " (document.input.format) }
            div { span { "SHA-256" } " " code { (document.input.sha256) } }
            div { span { "Made by" } " conicoid " (document.conicoid) }
        }
    }
}
