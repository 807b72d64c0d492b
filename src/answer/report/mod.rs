//! A result as a document for people: one HTML file that holds everything it shows and asks nobody for more.
//!
//! It has no date and no times, so that the same cloud and parameters give the same file.

mod facts;
mod histogram;
mod regions;
mod relations;

use std::io;

use base64::{Engine, prelude::BASE64_STANDARD};
use maud::{DOCTYPE, PreEscaped, html};

use super::{Answer, sheet::count};
use crate::{
    formats::{Scene, write_picture},
    segment::{deviations, surface_normals},
};
use histogram::Histogram;

/// What a report may load: what it holds itself.
pub const REPORT_POLICY: &str = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'";

/// The report of an answer, around `picture`, a PNG file.
pub fn report(answer: &Answer, picture: &[u8]) -> String {
    let document = &answer.document;
    let histograms = histograms(answer);
    let title = answer.name.as_deref().unwrap_or("Point cloud");
    let picture = format!("data:image/png;base64,{}", BASE64_STANDARD.encode(picture));
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta http-equiv="Content-Security-Policy" content=(REPORT_POLICY);
                title { (title) ": surfaces found by conicoid" }
                style { (PreEscaped(include_str!("report.css"))) }
            }
            body {
                header {
                    h1 { (title) }
                    p { (headline(answer)) }
                }
                figure {
                    img src=(picture) width="1280" height="960" alt="The cloud, each surface in its own colour";
                    figcaption {
                        "Each surface in its own colour, with its number as in the table; points without a surface "
                        "in grey. No perspective: the scale bar holds everywhere."
                    }
                }
                (facts::summary(document))
                (regions::table(document))
                (relations::tables(document))
                (regions::deviations(document, &histograms))
                (facts::parameters(document))
                (facts::origin(answer))
            }
        }
    }
    .into_string()
}

/// How the points of each region deviate from it.
fn histograms(answer: &Answer) -> Vec<Histogram> {
    let Answer { document, cloud, .. } = answer;
    let labels = document.labels();
    let mut all: Vec<Histogram> =
        document.regions.iter().map(|region| Histogram::new(region.fit.rms)).collect();
    for (label, deviation) in labels.iter().zip(deviations(cloud, labels, &document.regions)) {
        let own = usize::try_from(*label).ok().and_then(|id| all.get_mut(id));
        own.into_iter().for_each(|histogram| histogram.add(deviation));
    }
    all
}

fn headline(answer: &Answer) -> String {
    let document = &answer.document;
    let surfaces = document.regions.len();
    format!(
        "{} surface{} in {} points",
        count(surfaces),
        if surfaces == 1 { "" } else { "s" },
        count(document.input.points)
    )
}

/// The picture of an answer, as a PNG file.
///
/// # Errors
/// It cannot be encoded.
pub fn picture(answer: &Answer) -> io::Result<Vec<u8>> {
    let Answer { document, cloud, .. } = answer;
    let labels = document.labels();
    let normals = surface_normals(cloud, labels, &document.regions);
    let stored = answer.stored_labels();
    let scene = Scene { points: &cloud.points, labels: &stored, normals: &normals };
    let mut bytes = Vec::new();
    write_picture(&mut bytes, &scene)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests;
