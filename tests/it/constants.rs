//! Every number that the engine decides with is in its table.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use conicoid::fit::constant::Adjustable;
use conicoid::fit::constant::Origin;
use conicoid::{model, segment};

/// Numbers that decide nothing, or nothing but how work is parted: by their file and name, and why.
const STRUCTURAL: &[(&str, &str)] = &[
    ("CHUNK", "points worked on at once"),
    ("WATCHED", "points between two looks at whether the work was cancelled"),
    ("LANES", "width of vectors"),
    ("K", "columns of the table of neighbours"),
    ("ROOM", "room of an array"),
    ("RUN", "points of a box of the search for neighbours"),
    ("GROUP", "boxes of a group of them"),
    ("BLOCK", "points of a block whose changes are told together"),
    ("BUCKET_BITS", "buckets of the sort"),
    ("PARTS", "parts of the sort"),
    ("LARGE_BUCKET", "buckets that are sorted in parallel"),
    ("STRIDE", "points of a walk measured at once"),
    ("ASKED", "room of an array"),
    ("SLOTS", "room of an array"),
    ("NONE", "a mark"),
    ("MOST", "labels that a point and its neighbours can have"),
    ("PAIRED", "columns of an array"),
    ("REACH", "points between two marks of what lies beside surfaces"),
    ("AT_ONCE", "hypotheses judged before the next look at whether they tell enough"),
    ("LEVEL", "a grid of powers of the root of two"),
    ("NEARLY_EQUAL", "rounding"),
    ("LARGEST_COORDINATE", "range of double precision"),
    ("SMALLEST_EXTENT", "range of double precision"),
    ("UNTESTED", "coefficients of a quadric but one"),
    ("SHELL_RATIO", "a ratio of areas of two"),
    ("MANY", "size of arrays"),
    ("NEARER", "half of it"),
    ("TINY", "rounding"),
    ("ONE_SHEET", "degrees of freedom"),
    ("TWO_SHEETS", "degrees of freedom"),
    ("SPACING", "geometry of a disc"),
    ("FAR", "range of a tangent plane"),
    ("STEP", "rounding"),
    ("IMPLIED", "rounding"),
    ("CURVED", "rounding"),
    ("EXACT", "rounding"),
    ("OWN", "a mark"),
    ("STEPS", "points of a sum that stands for an integral"),
    ("MARGIN", "room around a patch's points"),
    ("MAX_DATUMS", "a limit of requests"),
    ("MAX_HINTS", "a limit of requests"),
    ("MAX_PLACES", "a limit of requests"),
    ("MAX_HINT_BYTES", "a limit of requests"),
    ("LARGEST_TOLD", "range of a value"),
];

fn constants() -> impl Iterator<Item = &'static dyn Adjustable> {
    segment::constants().chain(model::constants())
}

/// The sources below a directory, tests left out.
fn sources(directory: &Path) -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(directory).into_iter().flatten().flatten() {
        let path = entry.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if name.ends_with(".rs") && !["tests.rs", "fixtures.rs"].contains(&name.as_str()) {
            let text = fs::read_to_string(&path).unwrap();
            let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
            found.push((path, code.to_owned()));
        }
    }
    found
}

/// Name and type of a `const` of numbers.
fn number(line: &str) -> Option<(&str, &str)> {
    let start = line.trim_start();
    let start = ["pub(super) ", "pub(crate) ", "pub "]
        .iter()
        .find_map(|vis| start.strip_prefix(vis))
        .unwrap_or(start);
    let (name, rest) = start.strip_prefix("const ")?.split_once(": ")?;
    let kind = rest.split(" =").next()?;
    let kinds = ["usize", "f64", "f32", "u32", "u64", "i32", "u8"];
    kinds.iter().any(|k| kind.contains(k)).then_some((name, kind))
}

#[test]
fn no_number_that_decides_is_a_plain_const() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let files: Vec<_> = ["segment", "model"].iter().flat_map(|m| sources(&src.join(m))).collect();
    assert!(files.len() > 80, "sources are not seen");
    let mut structural = BTreeSet::new();
    for (path, code) in &files {
        for (name, _) in code.lines().filter_map(number) {
            let known = STRUCTURAL.iter().any(|(known, _)| *known == name);
            assert!(known, "{name} of {} is neither in the table nor structural", path.display());
            structural.insert(name);
        }
    }
    let gone: Vec<_> = STRUCTURAL.iter().filter(|(name, _)| !structural.contains(name)).collect();
    assert!(gone.is_empty(), "no longer there: {gone:?}");
}

#[test]
fn what_is_declared_is_in_the_table_with_its_meaning_and_its_origin() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let table: BTreeSet<String> = constants().map(|c| c.name().to_owned()).collect();
    let mut declared = BTreeSet::new();
    for (path, code) in ["segment", "fit", "model"].iter().flat_map(|m| sources(&src.join(m))) {
        if path.ends_with("fit/constant.rs") {
            continue;
        }
        let module = path.strip_prefix(&src).unwrap().with_extension("");
        let module = module.to_string_lossy().replace('/', "::");
        let module = module.strip_suffix("::mod").unwrap_or(&module).to_owned();
        for block in code.split("\nconstants! {\n").skip(1) {
            let block = block.split("\n}").next().unwrap_or_default();
            let lines = block.lines().map(str::trim).filter(|line| !line.starts_with("///"));
            for line in lines {
                let Some((name, _)) = line.split_once(':') else { continue };
                let name = name.rsplit(' ').next().unwrap_or_default();
                if name.chars().all(|c| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_') {
                    declared.insert(format!("conicoid::{module}::{name}"));
                }
            }
        }
    }
    assert_eq!(declared, table);
}

#[test]
fn what_was_found_by_trial_lies_in_its_range() {
    for constant in constants() {
        if let Origin::Trial(from, to) = constant.origin() {
            assert!(from <= constant.given() && constant.given() <= to, "{}", constant.name());
        }
    }
}
