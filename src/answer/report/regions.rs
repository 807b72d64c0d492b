use maud::{Markup, html};

use super::histogram::Histogram;
use crate::{
    answer::{
        Document,
        sheet::{self, Quantity, count, number},
    },
    formats::region_color,
    segment::Region,
};

/// One row a surface.
pub fn table(document: &Document) -> Markup {
    html! {
        section {
            h2 { "Surfaces" }
            @if document.regions.is_empty() {
                p { "None was found." }
            } @else {
                p.note {
                    "All " (sheet::unit(document.input.unit)) ". Behind ± stands one standard deviation; values without one "
                    "are measured from the outermost points."
                }
                table {
                    thead {
                        tr {
                            th.number { "#" } th { "Surface" } th { "Dimensions" } th { "Place" }
                            th.number { "Points" } th.number { "RMS" }
                        }
                    }
                    tbody { @for region in &document.regions { (row(region)) } }
                }
            }
        }
    }
}

fn row(region: &Region) -> Markup {
    let unknown = sheet::unknown(region);
    html! {
        tr id=(format!("region-{}", region.id)) {
            td.number { (region.id) }
            td.kind {
                (swatch(region.id)) (sheet::kind(region))
                @if !unknown.is_empty() { small { "not told by the points: " (unknown.join(", ")) } }
            }
            td { (quantities(&sheet::dimensions(region))) }
            td { (quantities(&sheet::position(region))) }
            td.number { (count(region.point_count)) }
            td.number { (number(region.fit.rms)) }
        }
    }
}

fn quantities(all: &[Quantity]) -> Markup {
    html! {
        @for Quantity { name, text } in all { div.quantity { span { (name) } " " (text) } }
    }
}

/// A histogram a surface.
pub fn deviations(document: &Document, histograms: &[Histogram]) -> Markup {
    html! {
        @if !document.regions.is_empty() {
            section {
                h2 { "Deviations of the points" }
                p.note {
                    "Signed distance of each point from its own surface: positive outside, on a plane on the side of "
                    "its normal. Points beyond the scale count in the outermost bars. The line is normal noise of the size "
                    "of the surface's own."
                }
                div.histograms {
                    @for (region, histogram) in document.regions.iter().zip(histograms) {
                        (card(region, histogram))
                    }
                }
            }
        }
    }
}

fn card(region: &Region, histogram: &Histogram) -> Markup {
    let label = format!("Deviations of surface {}", region.id);
    html! {
        div.card {
            h3 { (swatch(region.id)) (region.id) " " (sheet::kind(region)) }
            (histogram.svg(region.fit.noise, &label))
            p {
                "mean " (number(histogram.mean())) ", RMS " (number(region.fit.rms))
                ", noise " (number(region.fit.noise)) ", largest " (number(region.fit.max))
            }
        }
    }
}

/// A square in the colour of a region.
fn swatch(id: usize) -> Markup {
    let [r, g, b] = region_color(i32::try_from(id).unwrap_or(i32::MAX));
    html! { i class="swatch" style=(format!("background:rgb({r},{g},{b})")) {} }
}
