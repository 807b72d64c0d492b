//! The shape of the crate: imports point one way, and the method is silent.

use std::{fs, path::Path};

/// What each module may import, from the innermost outwards.
const ALLOWED: &[(&str, &[&str])] = &[
    ("geometry", &[]),
    ("formats", &["geometry"]),
    ("fit", &["geometry"]),
    ("segment", &["geometry", "fit"]),
    ("model", &["geometry", "fit", "segment"]),
    ("answer", &["geometry", "formats", "fit", "segment", "model"]),
    ("jobs", &["geometry", "fit", "segment", "model", "answer"]),
    ("service", &["geometry", "formats", "fit", "segment", "model", "answer", "jobs"]),
    ("http", &["geometry", "formats", "fit", "segment", "model", "answer", "jobs", "service"]),
    ("grpc", &["geometry", "formats", "fit", "segment", "model", "answer", "jobs", "service"]),
    (
        "cli",
        &[
            "geometry", "formats", "fit", "segment", "model", "answer", "jobs", "service", "http",
            "grpc",
        ],
    ),
];

/// What the synchronous, silent modules must not touch.
const SILENT: &[&str] = &["geometry", "formats", "fit", "segment", "model"];
const NOISE: &[&str] = &[
    "std::time",
    "std::env",
    "Instant::now",
    "SystemTime",
    "println!",
    "eprintln!",
    "thread::spawn",
    "ThreadPoolBuilder",
];

/// Every source file below `directory` with its text, tests left out.
fn sources(directory: &Path) -> Vec<(String, String)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(directory).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            let text = fs::read_to_string(&path).unwrap();
            let code = text.split("#[cfg(test)]").next().unwrap_or_default();
            let code = code.lines().filter(|line| !line.trim_start().starts_with("//"));
            found.push((path.display().to_string(), code.collect::<Vec<_>>().join("\n")));
        }
    }
    found
}

fn module(name: &str) -> Vec<(String, String)> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let found = sources(&src.join(name));
    assert!(!found.is_empty(), "no source in src/{name}");
    found
}

#[test]
fn every_source_file_belongs_to_the_crate() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for (path, _) in sources(&src) {
        let path = Path::new(&path);
        let (name, folder) = (path.file_stem().unwrap(), path.parent().unwrap());
        if ["lib", "main"].iter().any(|root| name == *root) {
            continue;
        }
        // a folder's module stands in it as mod.rs, or beside it
        let (name, folder) = match name == "mod" {
            true => (folder.file_name().unwrap(), folder.parent().unwrap()),
            false => (name, folder),
        };
        let parents = [folder.join("mod.rs"), folder.join("lib.rs"), folder.with_extension("rs")];
        let declared = format!("mod {};", name.to_str().unwrap());
        let told = |parent: &std::path::PathBuf| {
            fs::read_to_string(parent).is_ok_and(|text| text.contains(&declared))
        };
        assert!(parents.iter().any(told), "{} is in no module", path.display());
    }
}

#[test]
fn imports_point_one_way() {
    for (name, allowed) in ALLOWED {
        for (path, code) in module(name) {
            // `use crate::{a::..., b::...}` names its modules one brace deep
            let direct = ALLOWED.iter().map(|(other, _)| *other).filter(|other| {
                code.contains(&format!("crate::{other}::"))
                    || braces(&code).any(|item| item.split("::").next() == Some(other))
            });
            for other in direct.filter(|other| other != name) {
                assert!(allowed.contains(&other), "{path} imports {other}");
            }
        }
    }
}

/// The items of each `crate::{...}`.
fn braces(code: &str) -> impl Iterator<Item = &str> {
    code.split("crate::{").skip(1).flat_map(|rest| {
        let mut depth = 0_i32;
        let ends = move |c: char| {
            depth += i32::from(c == '{') - i32::from(c == '}');
            depth < 0
        };
        let inside = rest.split_once(ends).map_or("", |(inside, _)| inside);
        let mut depth = 0_i32;
        inside
            .split(move |c: char| {
                depth += i32::from(c == '{') - i32::from(c == '}');
                depth == 0 && c == ','
            })
            .map(str::trim)
    })
}

#[test]
fn the_method_is_silent_and_synchronous() {
    for name in SILENT {
        for (path, code) in module(name) {
            for word in NOISE {
                assert!(!code.contains(word), "{path} uses {word}");
            }
        }
    }
}

/// What is built without the feature `service`, and the crates that it must not need.
const LIBRARY: &[&str] = &["geometry", "formats", "fit", "segment", "model", "answer"];
const SERVICE: &[&str] =
    &["tokio", "axum", "tonic", "prost", "clap", "tracing", "metrics::", "libc"];

#[test]
fn the_library_needs_nothing_of_the_service() {
    let lib = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("src/lib.rs")).unwrap();
    for (name, _) in ALLOWED {
        let is_gated = lib.contains(&format!("#[cfg(feature = \"service\")]\npub mod {name};"));
        assert_eq!(is_gated, !LIBRARY.contains(name), "{name}");
    }
    for name in LIBRARY {
        for (path, code) in module(name) {
            for word in SERVICE {
                assert!(!code.contains(word), "{path} uses {word}");
            }
        }
    }
    let manifest = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml"));
    let manifest: toml::Table = manifest.unwrap().parse().unwrap();
    let is_optional = |name: &str| manifest["dependencies"][name].get("optional").is_some();
    for name in ["tokio", "axum", "tonic", "prost", "clap", "tracing", "metrics", "libc"] {
        assert!(is_optional(name), "{name} is built with the library");
    }
}

#[test]
fn every_module_of_the_crate_has_its_place_in_the_order() {
    let lib = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("src/lib.rs")).unwrap();
    let modules = lib.lines().filter_map(|line| line.strip_prefix("pub mod ")?.strip_suffix(';'));
    for name in modules {
        assert!(ALLOWED.iter().any(|(known, _)| *known == name), "{name} has no place");
    }
}

/// Most lines of a file of the method, tests and all, and of one function.
const MOST_LINES: (usize, usize) = (300, 60);

#[test]
fn files_and_functions_of_the_method_are_short() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut functions = 0;
    for (path, code) in ["segment", "model"].iter().flat_map(|m| sources(&src.join(m))) {
        let lines = fs::read_to_string(&path).unwrap().lines().count();
        assert!(lines <= MOST_LINES.0, "{path} has {lines} lines");
        let text = fs::read_to_string(&path).unwrap();
        for (name, lines) in lengths(&text.lines().collect::<Vec<_>>()) {
            let is_code = code.contains(&format!("fn {name}"));
            assert!(!is_code || lines <= MOST_LINES.1, "{name} in {path} has {lines} lines");
            functions += 1;
        }
    }
    assert!(functions > 500, "functions are not seen");
}

/// Name and number of lines of each function, of text as rustfmt leaves it: its end has the indent of its
/// beginning.
fn lengths<'a>(lines: &[&'a str]) -> Vec<(&'a str, usize)> {
    let mut found = Vec::new();
    for (at, line) in lines.iter().enumerate() {
        let start = line.trim_start();
        let indent = &line[..line.len() - start.len()];
        let Some((before, after)) = start.split_once("fn ") else { continue };
        let is_head = before.split_whitespace().all(|word| {
            word.starts_with("pub") || ["const", "in", "super)", "crate)"].contains(&word)
        });
        let name = after.split(['(', '<']).next().unwrap_or_default();
        let end = lines[at..].iter().position(|l| l.strip_prefix(indent) == Some("}"));
        if is_head && !line.ends_with(['}', ';']) {
            found.extend(end.map(|n| (name, n + 1)));
        }
    }
    found
}

#[test]
fn the_length_of_a_function_is_that_from_its_head_to_its_brace() {
    let text =
        ["pub(super) fn a<T>(", "    x: T,", ") {", "    fn b() {", "        x", "    }", "}"];
    let one = ["    fn c() {}", "    fn d(f: impl Fn()) {", "    }", "let f = 1;"];
    assert_eq!(lengths(&text), [("a", 7), ("b", 3)]);
    assert_eq!(lengths(&one), [("d", 2)]);
}
