//! The unit of a file's lengths.

use super::file::{Entities, Id, real};
use crate::geometry::LengthUnit;

/// The entity of a unit. A reader that works in millimetres converts what is in another.
pub fn length_unit(out: &mut Entities, unit: LengthUnit) -> Id {
    let prefix = match unit {
        LengthUnit::Um => ".MICRO.",
        LengthUnit::Mm => ".MILLI.",
        LengthUnit::Cm => ".CENTI.",
        LengthUnit::M => "$",
        LengthUnit::Km => ".KILO.",
        LengthUnit::In => return converted(out, unit, "INCH"),
        LengthUnit::Ft => return converted(out, unit, "FOOT"),
        LengthUnit::UsFt => return converted(out, unit, "US SURVEY FOOT"),
    };
    out.add(&format!("(LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT({prefix},.METRE.))"))
}

/// A unit told in millimetres.
fn converted(out: &mut Entities, unit: LengthUnit, name: &str) -> Id {
    let millimetre = length_unit(out, LengthUnit::Mm);
    let factor = real(unit.millimetres());
    let measure =
        out.add(&format!("LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE({factor}),{millimetre})"));
    let dimensions = out.add("DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)");
    out.add(&format!(
        "(CONVERSION_BASED_UNIT('{name}',{measure}) LENGTH_UNIT() NAMED_UNIT({dimensions}))"
    ))
}

/// What the file's head says of its unit.
pub fn said(unit: Option<LengthUnit>) -> String {
    match unit {
        None => "lengths in millimetres (the cloud's unit is not known)".into(),
        Some(LengthUnit::Mm) => "lengths in millimetres".into(),
        Some(LengthUnit::Um) => "lengths in micrometres".into(),
        Some(unit) => format!("lengths in {unit}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_unit_is_told_as_readers_know_it() {
        let text = |unit| {
            let mut out = Entities::default();
            length_unit(&mut out, unit);
            out.text().to_owned()
        };
        for (unit, prefix) in [
            (LengthUnit::Um, ".MICRO."),
            (LengthUnit::Mm, ".MILLI."),
            (LengthUnit::Cm, ".CENTI."),
            (LengthUnit::M, "$"),
            (LengthUnit::Km, ".KILO."),
        ] {
            let entity = format!("#1=(LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT({prefix},.METRE.));\n");
            assert_eq!(text(unit), entity);
        }
        for (unit, name, factor) in
            [(LengthUnit::In, "'INCH'", "(25.4)"), (LengthUnit::Ft, "'FOOT'", "(304.8)")]
        {
            let text = text(unit);
            assert!(text.contains(name) && text.contains(factor) && text.contains(".MILLI."));
        }
        assert!(text(LengthUnit::UsFt).contains("LENGTH_MEASURE(304.8006096"));
        assert_eq!(said(Some(LengthUnit::M)), "lengths in m");
    }
}
