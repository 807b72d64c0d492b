//! What a run found, for the terminal.

use crate::{
    segment::{Outcome, Region},
    service::{
        Document,
        sheet::{self, Quantity, count, number},
    },
};

/// Most surfaces that are listed: more are read in the result, not on a terminal.
const MOST_ROWS: usize = 100;

/// The lines that tell what `document` holds; `name` is what the cloud is called.
pub fn table(document: &Document, name: &str) -> String {
    let mut text = head(document, name);
    let shown = &document.regions[..document.regions.len().min(MOST_ROWS)];
    if !shown.is_empty() {
        text.push('\n');
        let names = ["#", "surface", "points", "rms", "dimensions"].map(str::to_owned);
        let rows: Vec<_> = std::iter::once(names).chain(shown.iter().map(row)).collect();
        text += &aligned(&rows);
    }
    let more = document.regions.len() - shown.len();
    if more > 0 {
        text += &format!("… and {more} more\n");
    }
    for told in &document.hints {
        let outcome = match told.outcome {
            Outcome::Applied => "applied",
            Outcome::Contradicted => "contradicted",
            Outcome::NotFound => "not found",
        };
        text += &format!("hint {}: {outcome}: {}\n", told.hint, told.message);
    }
    for warning in &document.warnings {
        text += &format!("\nwarning: {}\n", warning.message);
    }
    text
}

fn head(document: &Document, name: &str) -> String {
    let Document { input, regions, unassigned, parameters, timing, .. } = document;
    let reasons = unassigned.reasons.iter();
    let reasons: Vec<_> =
        reasons.map(|(why, n)| format!("{} {}", count(*n), why.replace('_', " "))).collect();
    let reasons =
        if reasons.is_empty() { String::new() } else { format!(" ({})", reasons.join(", ")) };
    let length = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), number);
    format!(
        "{name}: {} surface{} in {} points, {} on no surface{reasons}, {:.2} s\nnoise {}, tolerance {}, {}\n",
        count(regions.len()),
        if regions.len() == 1 { "" } else { "s" },
        count(input.points),
        count(unassigned.count),
        timing.total,
        length(parameters.noise_sigma),
        length(parameters.tolerance),
        sheet::unit(input.unit),
    )
}

fn row(region: &Region) -> [String; 5] {
    let sizes = sheet::dimensions(region);
    let sizes: Vec<_> =
        sizes.iter().map(|Quantity { name, text }| format!("{name} {text}")).collect();
    [
        region.id.to_string(),
        sheet::kind(region),
        count(region.point_count),
        number(region.fit.rms),
        sizes.join(", "),
    ]
}

/// Rows with their cells below each other: numbers end together, words begin together.
fn aligned(rows: &[[String; 5]]) -> String {
    const ENDS: [bool; 5] = [true, false, true, false, false];
    let width = |k: usize| rows.iter().map(|row| row[k].chars().count()).max().unwrap_or(0);
    let widths = [0, 1, 2, 3, 4].map(width);
    let line = |row: &[String; 5]| {
        let cells = row.iter().zip(widths).zip(ENDS).map(|((cell, width), ends)| match ends {
            true => format!("{cell:>width$}"),
            false => format!("{cell:<width$}"),
        });
        cells.collect::<Vec<_>>().join("  ").trim_end().to_owned() + "\n"
    };
    rows.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        formats::Limits,
        jobs::Control,
        service::{Request, compute},
    };

    /// A tube of radius 5 and length 20.
    fn tube() -> Document {
        let mut text = String::new();
        for k in 0..3000 {
            let place = |step: f64| (k as f64 * step).fract();
            let turn = std::f64::consts::TAU * place(0.618_033_988_7);
            let r = 5.0 + 0.02 * (place(0.732_050_807_6) - 0.5);
            text += &format!(
                "{} {} {}\n",
                r * turn.cos(),
                r * turn.sin(),
                20.0 * place(0.414_213_562_3)
            );
        }
        let request = Request::default();
        compute(text.as_bytes(), &request, &Limits::default(), &Control::new(None))
            .unwrap()
            .document
    }

    #[test]
    fn a_tube_is_told_in_one_row_under_its_names() {
        let mut document = tube();
        document.warnings = vec![crate::segment::Warning {
            code: "rows_apart".into(),
            message: "rows lie wide apart".into(),
        }];
        let text = table(&document, "tube.xyz");
        let lines: Vec<_> = text.lines().collect();
        assert!(lines[0].starts_with("tube.xyz: 1 surface in 3,000 points, "), "{text}");
        assert!(
            lines[1].starts_with("noise 0.00") && lines[1].contains(", tolerance 0.0"),
            "{text}"
        );
        assert!(lines[3].starts_with("#  surface"), "{text}");
        assert!(
            lines[4].starts_with("0  cylinder") && lines[4].contains("diameter 10.00"),
            "{text}"
        );
        // cells stand below their names
        assert_eq!(lines[3].find("dimensions"), lines[4].find("diameter"), "{text}");
        assert!(text.ends_with("warning: rows lie wide apart\n"));
    }

    #[test]
    fn very_many_surfaces_are_not_all_listed() {
        let mut document = tube();
        document.regions = vec![document.regions[0].clone(); MOST_ROWS + 7];
        let text = table(&document, "many");
        assert!(text.contains("107 surfaces") && text.contains("… and 7 more"), "{text}");
        document.regions.clear();
        document.warnings.clear();
        assert_eq!(table(&document, "none").lines().count(), 2);
    }
}
