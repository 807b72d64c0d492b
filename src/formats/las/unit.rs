//! The unit of a LAS file's coordinates, as its coordinate system states it.

use crate::geometry::LengthUnit;

/// The record of GeoTIFF keys, and that of a text (OGC 01-009 and ISO 19162).
const KEYS: u16 = 34735;
const TEXT: u16 = 2112;

/// The unit of all three coordinates; `None` where the file states none, more than one, or degrees.
pub(super) fn unit(header: &las::Header) -> Option<LengthUnit> {
    let records = || header.vlrs().iter().filter(|vlr| vlr.user_id.starts_with("LASF_Projection"));
    let text = records().find(|vlr| vlr.record_id == TEXT);
    match text {
        Some(text) => of_text(&String::from_utf8_lossy(&text.data)),
        None => of_keys(&records().find(|vlr| vlr.record_id == KEYS)?.data),
    }
}

/// That of GeoTIFF keys: four numbers of two bytes before them, and in each.
fn of_keys(data: &[u8]) -> Option<LengthUnit> {
    const MODEL: u16 = 1024;
    const GEOGRAPHIC: u16 = 2;
    const SYSTEM: u16 = 3072;
    const UNITS: u16 = 3076;
    const VERTICAL_UNITS: u16 = 4099;
    let numbers = data.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
    let numbers: Vec<u16> = numbers.collect();
    let key = |id: u16| {
        let keys = numbers.chunks_exact(4).skip(1);
        // a value that stands elsewhere is none of these
        keys.filter(|key| key[0] == id && key[1] == 0).map(|key| key[3]).next()
    };
    if key(MODEL) == Some(GEOGRAPHIC) {
        return None;
    }
    let plan = match key(UNITS) {
        Some(code) => of_code(code)?,
        None => key(SYSTEM).filter(|code| is_metric(*code)).map(|_| LengthUnit::M)?,
    };
    match key(VERTICAL_UNITS) {
        Some(code) => of_code(code).filter(|height| *height == plan),
        None => Some(plan),
    }
}

/// The unit of an EPSG code.
fn of_code(code: u16) -> Option<LengthUnit> {
    match code {
        9001 => Some(LengthUnit::M),
        9002 => Some(LengthUnit::Ft),
        9003 => Some(LengthUnit::UsFt),
        _ => None,
    }
}

/// Whether an EPSG code is that of a UTM zone (WGS 84, ETRS89, NAD83), which are all in metres.
fn is_metric(system: u16) -> bool {
    matches!(system, 32601..=32660 | 32701..=32760 | 25828..=25838 | 26901..=26923)
}

/// That of a text: all lengths of its axes.
fn of_text(text: &str) -> Option<LengthUnit> {
    let upper = text.to_ascii_uppercase();
    if !upper.contains("PROJC") {
        return None;
    }
    let axes = ["ELLIPSOID", "SPHEROID", "CONVERSION", "PARAMETER", "BASEGEOGCRS", "GEOGCS"];
    let kept = axes.into_iter().fold(upper, |text, word| without(&text, word));
    let factors = kept.split("UNIT[").skip(1).map(|unit| {
        let factor = unit.split([',', ']']).nth(1);
        factor.and_then(|factor| factor.trim().parse::<f64>().ok()).and_then(of_factor)
    });
    let units: Vec<Option<LengthUnit>> = factors.collect();
    units.first().copied().flatten().filter(|first| units.iter().all(|u| *u == Some(*first)))
}

/// The unit of so many metres.
fn of_factor(metres: f64) -> Option<LengthUnit> {
    /// Relative: a foot and a survey foot differ by 2e-6.
    const EQUAL: f64 = 1e-7;
    let is = |unit: &LengthUnit| (metres * 1e3 / unit.millimetres() - 1.0).abs() < EQUAL;
    [LengthUnit::M, LengthUnit::Ft, LengthUnit::UsFt].into_iter().find(is)
}

/// A text without all of `word[...]`.
fn without(text: &str, word: &str) -> String {
    let open = format!("{word}[");
    let mut kept = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find(&open) {
        kept.push_str(&rest[..at]);
        let mut depth = 0_usize;
        let inner = &rest[at + word.len()..];
        let end = inner.char_indices().find(|(_, c)| {
            match c {
                '[' => depth += 1,
                ']' => depth = depth.saturating_sub(1),
                _ => {}
            }
            depth == 0
        });
        rest = end.map_or("", |(end, _)| &inner[end + 1..]);
    }
    kept + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(all: &[[u16; 4]]) -> Option<LengthUnit> {
        let count = u16::try_from(all.len()).unwrap();
        let head = [[1, 1, 0, count]];
        let numbers = head.iter().chain(all).flatten();
        of_keys(&numbers.flat_map(|n| n.to_le_bytes()).collect::<Vec<u8>>())
    }

    #[test]
    fn keys_tell_the_unit_of_plan_and_height() {
        let projected = [1024, 0, 1, 1];
        for (more, unit) in [
            (vec![[3076, 0, 1, 9001]], Some(LengthUnit::M)),
            (vec![[3076, 0, 1, 9003], [4099, 0, 1, 9003]], Some(LengthUnit::UsFt)),
            (vec![[3076, 0, 1, 9002], [4099, 0, 1, 9001]], None),
            (vec![[3072, 0, 1, 32632]], Some(LengthUnit::M)),
            (vec![[3072, 0, 1, 2263]], None),
            (vec![[3076, 0, 1, 9999]], None),
            (vec![], None),
        ] {
            assert_eq!(keys(&[vec![projected], more.clone()].concat()), unit, "{more:?}");
        }
        assert_eq!(keys(&[[1024, 0, 1, 2], [3076, 0, 1, 9001]]), None);
        assert_eq!(of_keys(&[1, 2, 3]), None);
    }

    #[test]
    fn texts_tell_the_unit_of_their_axes() {
        let old = |plan: &str, height: &str| {
            format!(
                "COMPD_CS[\"a\",PROJCS[\"b\",GEOGCS[\"c\",DATUM[\"d\",SPHEROID[\"e\",6378137,298.25]],\
                 PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]],PROJECTION[\"Transverse_Mercator\"],\
                 PARAMETER[\"false_easting\",500000],{plan},AXIS[\"E\",EAST]],VERT_CS[\"f\",\
                 VERT_DATUM[\"g\",2005],{height}]]"
            )
        };
        let (metre, foot) =
            ("UNIT[\"metre\",1,AUTHORITY[\"EPSG\",\"9001\"]]", "UNIT[\"foot\",0.3048]");
        let survey = "UNIT[\"US survey foot\",0.304800609601219]";
        assert_eq!(of_text(&old(metre, metre)), Some(LengthUnit::M));
        assert_eq!(of_text(&old(foot, foot)), Some(LengthUnit::Ft));
        assert_eq!(of_text(&old(survey, survey)), Some(LengthUnit::UsFt));
        assert_eq!(of_text(&old(survey, metre)), None);
        let new = "PROJCRS[\"a\",BASEGEOGCRS[\"b\",DATUM[\"c\",ELLIPSOID[\"d\",6378137,298.25,\
                   LENGTHUNIT[\"metre\",1]]]],CONVERSION[\"e\",PARAMETER[\"f\",0,LENGTHUNIT[\"metre\",1]]],\
                   CS[Cartesian,2],AXIS[\"x\",east],LENGTHUNIT[\"US survey foot\",0.304800609601219]]";
        assert_eq!(of_text(new), Some(LengthUnit::UsFt));
        let degrees = "GEOGCS[\"a\",DATUM[\"b\"],UNIT[\"degree\",0.0174532925199433]]";
        assert_eq!(of_text(degrees), None);
        for text in ["", "PROJCS[", "PROJCS[GEOGCS[", "PROJCS[\"é\",UNIT[\"x\""] {
            assert_eq!(of_text(text), None, "{text}");
        }
    }
}
