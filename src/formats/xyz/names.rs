//! Which of the names of columns are those of coordinates.

use std::collections::BTreeMap;

use super::super::text;
use crate::geometry::LengthUnit;

/// What may stand beside the letter of an axis: units, and words for a place.
const BESIDE: &[&str] = &[
    "m",
    "mm",
    "cm",
    "dm",
    "km",
    "um",
    "ft",
    "in",
    "inch",
    "coord",
    "coords",
    "coordinate",
    "coordinates",
    "pos",
    "position",
    "point",
    "points",
    "loc",
    "location",
    "p",
    "axis",
    "value",
    "world",
    "global",
    "local",
    "cartesian",
];
/// What programs call points whose coordinates they number.
const NUMBERED: &[&str] = &["point", "points", "coordinate", "coordinates", "pos", "position"];

const EAST: &[&str] =
    &["e", "east", "easting", "eastings", "rechts", "rechtswert", "ostwert", "est", "este"];
const NORTH: &[&str] =
    &["n", "north", "northing", "northings", "hoch", "hochwert", "nordwert", "nord", "norte"];
const UP: &[&str] = &[
    "z",
    "h",
    "u",
    "up",
    "height",
    "elev",
    "elevation",
    "alt",
    "altitude",
    "level",
    "rl",
    "cota",
    "quota",
    "hoehe",
    "höhe",
];

/// One way to name coordinates: the axis that the words of a name stand for, and what stands beside it.
type Way = fn(&[String]) -> Option<(usize, String)>;

/// The ways coordinates are named; what the first finds is meant, whatever others would find.
const WAYS: [Way; 4] = [plain, qualified, surveyed, numbered];

/// The first column that is named for an axis, and whether another is too.
type Named = (usize, bool);

/// Why names do not tell the columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ambiguous;

/// The columns named for x, y and z; `None` where there are none.
pub(super) fn coordinates(fields: &[&[u8]]) -> Result<Option<[usize; 3]>, Ambiguous> {
    let words: Vec<_> = fields.iter().map(|field| words(field)).collect();
    for way in WAYS {
        let mut found = BTreeMap::<String, [Option<Named>; 3]>::new();
        for (column, words) in words.iter().enumerate() {
            if let Some((axis, beside)) = way(words) {
                let named = &mut found.entry(beside).or_default()[axis];
                *named = Some(named.map_or((column, false), |(first, _)| (first, true)));
            }
        }
        let whole = |named: &[Option<Named>; 3]| Some([named[0]?, named[1]?, named[2]?]);
        let triples: Vec<_> = found.values().filter_map(whole).collect();
        match triples.as_slice() {
            [] => {}
            [only] if only.iter().all(|(_, again)| !again) => {
                return Ok(Some(only.map(|(column, _)| column)));
            }
            _ => return Err(Ambiguous),
        }
    }
    Ok(None)
}

/// The unit that stands in or behind a name, as in `x [mm]`, `y_m`, `Easting (ft)`; alone too.
pub(super) fn unit(name: &[u8]) -> Option<LengthUnit> {
    let name = String::from_utf8_lossy(text::unquoted(name)).to_lowercase();
    let bracketed = name.split_once(['[', '(']).map(|(_, behind)| behind);
    match bracketed {
        Some(behind) => LengthUnit::from_word(behind.trim_end_matches([']', ')', '"']).trim()),
        None => {
            let words = words(name.as_bytes());
            let whole = LengthUnit::from_word(name.trim());
            whole.or_else(|| LengthUnit::from_word(words.last()?))
        }
    }
}

/// The words of a name in lower case: its unit in brackets is left out, anything else parts words.
fn words(name: &[u8]) -> Vec<String> {
    let name = String::from_utf8_lossy(text::unquoted(name)).to_lowercase();
    let name = name.split(['[', '(']).next().unwrap_or_default();
    let words = name.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
    words.map(str::to_owned).collect()
}

fn axis(word: &str) -> Option<usize> {
    ["x", "y", "z"].iter().position(|axis| *axis == word)
}

/// `x`, `"X"`, `x [mm]`.
fn plain(words: &[String]) -> Option<(usize, String)> {
    let [word] = words else { return None };
    Some((axis(word)?, String::new()))
}

/// `x_mm`, `X_coord`, `posX`, `Points:X`.
fn qualified(words: &[String]) -> Option<(usize, String)> {
    if let [word] = words {
        let (first, last) = (word.get(..1)?, word.get(word.len() - 1..)?);
        let split = [(first, &word[1..]), (last, &word[..word.len() - last.len()])];
        let found = split.into_iter().find(|(a, rest)| axis(a).is_some() && BESIDE.contains(rest));
        return found.and_then(|(a, rest)| Some((axis(a)?, rest.to_owned())));
    }
    let (axes, beside): (Vec<&str>, Vec<&str>) =
        words.iter().map(String::as_str).partition(|word| axis(word).is_some());
    let [name] = axes[..] else { return None };
    beside.iter().all(|word| BESIDE.contains(word)).then_some((axis(name)?, beside.join(" ")))
}

/// `E`, `Northing`, `Height [m]`, and `z` beside them; `x`, `y` with a height of another name.
fn surveyed(words: &[String]) -> Option<(usize, String)> {
    let name = words.first()?;
    let units = words[1..].iter().all(|word| BESIDE.contains(&word.as_str()));
    let axis = [EAST, NORTH, UP].iter().position(|names| names.contains(&name.as_str()));
    let axis = axis.or_else(|| axis_of_plan(name));
    axis.filter(|_| units).map(|axis| (axis, String::new()))
}

fn axis_of_plan(name: &str) -> Option<usize> {
    axis(name).filter(|axis| *axis < 2)
}

/// `Points:0`, `Points_1`.
fn numbered(words: &[String]) -> Option<(usize, String)> {
    let [name, number] = words else { return None };
    let axis = ["0", "1", "2"].iter().position(|n| n == number)?;
    NUMBERED.contains(&name.as_str()).then(|| (axis, name.clone()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(line: &str) -> Result<Option<[usize; 3]>, Ambiguous> {
        coordinates(&line.split(',').map(str::as_bytes).collect::<Vec<_>>())
    }

    #[test]
    fn coordinates_are_found_by_the_names_that_programs_and_surveyors_give() {
        for (line, columns) in [
            ("x,y,z", [0, 1, 2]),
            ("id,Z,Y [mm],\"X\"", [3, 2, 1]),
            ("nx,ny,nz,x,y,z", [3, 4, 5]),
            ("x_normal,y_normal,z_normal,X_mm,Y_mm,Z_mm", [3, 4, 5]),
            ("\"intensity\",\"Points:0\",\"Points:1\",\"Points:2\"", [1, 2, 3]),
            ("Normals_0,Normals_1,Normals_2,Points_0,Points_1,Points_2", [3, 4, 5]),
            ("Points:X,Points:Y,Points:Z", [0, 1, 2]),
            ("ID,E,N,H", [1, 2, 3]),
            ("ID,Northing,Easting,Elevation (m)", [2, 1, 3]),
            ("Easting,Northing,Z", [0, 1, 2]),
            ("x,y,height", [0, 1, 2]),
            ("id,XCoord,YCoord,ZCoord", [1, 2, 3]),
            ("posX,posY,posZ", [0, 1, 2]),
            ("pos_x,pos_y,pos_z", [0, 1, 2]),
        ] {
            assert_eq!(found(line), Ok(Some(columns)), "{line}");
        }
    }

    #[test]
    fn units_stand_in_names_or_alone() {
        for (name, unit) in [
            ("x [mm]", Some(LengthUnit::Mm)),
            ("Easting (m)", Some(LengthUnit::M)),
            ("\"Z (US survey foot)\"", Some(LengthUnit::UsFt)),
            ("y_cm", Some(LengthUnit::Cm)),
            ("[µm]", Some(LengthUnit::Um)),
            ("(Meter)", Some(LengthUnit::M)),
            ("mm", Some(LengthUnit::Mm)),
            ("x", None),
            ("x [px]", None),
            ("Points:0", None),
        ] {
            assert_eq!(super::unit(name.as_bytes()), unit, "{name}");
        }
    }

    #[test]
    fn other_names_are_none_and_doubled_ones_are_ambiguous() {
        for line in
            ["a,b,c", "x,y", "lon,lat,alt", "nx,ny,nz", "x velocity,y velocity,z velocity", "é,y,z"]
        {
            assert_eq!(found(line), Ok(None), "{line}");
        }
        for line in ["x,y,z,x,y,z", "x_local,y_local,z_local,x_global,y_global,z_global", "x,y,y,z"]
        {
            assert_eq!(found(line), Err(Ambiguous), "{line}");
        }
    }
}
