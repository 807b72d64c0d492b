use maud::{Markup, html};

use crate::{
    answer::{
        Document,
        sheet::{in_common, measure, off, related, relation_name},
    },
    model::relations::Relation,
};

/// What holds between the surfaces, and what was measured between them.
pub fn tables(document: &Document) -> Markup {
    let accepted: Vec<&Relation> = document.relations.iter().filter(|r| r.accepted).collect();
    html! {
        @if !accepted.is_empty() {
            section {
                h2 { "Relations" }
                p.note {
                    "What holds between the surfaces as far as their uncertainties tell. The deviation is that of the "
                    "surfaces as fitted, with its standard uncertainty; of several surfaces that of the one furthest off."
                }
                table.relations {
                    thead { tr { th { "Relation" } th { "Surfaces" } th { "In common" } th { "Deviation" } } }
                    tbody {
                        @for relation in accepted {
                            tr {
                                td { (relation_name(relation.kind)) } td { (related(relation)) }
                                td { (in_common(relation)) } td { (off(relation)) }
                            }
                        }
                    }
                }
            }
        }
        @if !document.measures.is_empty() {
            section {
                h2 { "Distances and angles" }
                table.relations {
                    thead { tr { th { "Measure" } th { "Surfaces" } th { "Value" } } }
                    tbody {
                        @for told in &document.measures {
                            @let (name, value) = measure(told);
                            tr { td { (name) } td { (told.regions[0]) " and " (told.regions[1]) } td { (value) } }
                        }
                    }
                }
            }
        }
    }
}
