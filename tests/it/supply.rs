//! What the build takes from others: every crate is used, from the registry, under a licence that `deny.toml`
//! allows.

use std::{collections::BTreeSet, fs, path::Path, process::Command};

use serde_json::Value;

fn read(path: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap()
}

fn parsed(path: &str) -> toml::Table {
    read(path).parse().unwrap()
}

/// Every package that a build on Linux takes, those of the tests included.
fn packages() -> Vec<Value> {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.current_dir(env!("CARGO_MANIFEST_DIR"));
    let platform = "--filter-platform=x86_64-unknown-linux-gnu";
    let told = cargo.args(["metadata", "--format-version=1", "--locked", platform]);
    let told = told.output().unwrap();
    assert!(told.status.success(), "{}", String::from_utf8_lossy(&told.stderr));
    let told: Value = serde_json::from_slice(&told.stdout).unwrap();
    told["packages"].as_array().unwrap().clone()
}

/// Whether `allowed` has what the licence expression asks for: one of each `OR`, all of each `AND`.
fn is_allowed(expression: &str, allowed: &BTreeSet<String>) -> bool {
    let spaced = expression.replace('(', " ( ").replace(')', " ) ").replace('/', " OR ");
    let mut words: Vec<&str> = spaced.split_whitespace().rev().collect();
    let allows = any(&mut words, allowed);
    assert!(words.is_empty(), "{expression}");
    allows
}

fn any(words: &mut Vec<&str>, allowed: &BTreeSet<String>) -> bool {
    let mut found = all(words, allowed);
    while words.pop_if(|word| *word == "OR").is_some() {
        found |= all(words, allowed);
    }
    found
}

fn all(words: &mut Vec<&str>, allowed: &BTreeSet<String>) -> bool {
    let mut found = one(words, allowed);
    while words.pop_if(|word| *word == "AND").is_some() {
        found &= one(words, allowed);
    }
    found
}

fn one(words: &mut Vec<&str>, allowed: &BTreeSet<String>) -> bool {
    let word = words.pop().unwrap();
    if word == "(" {
        let found = any(words, allowed);
        assert_eq!(words.pop(), Some(")"));
        return found;
    }
    let exception = words.pop_if(|word| *word == "WITH").and_then(|_| words.pop());
    let name = exception.map_or(word.to_owned(), |exception| format!("{word} WITH {exception}"));
    allowed.contains(&name)
}

#[test]
fn every_crate_has_a_licence_that_is_allowed_and_comes_from_the_registry() {
    let deny = parsed("deny.toml");
    let allowed = deny["licenses"]["allow"].as_array().unwrap().iter();
    let allowed = allowed.map(|name| name.as_str().unwrap().to_owned()).collect();
    let packages = packages();
    assert!(packages.len() > 200);
    for package in packages {
        let (name, licence) = (&package["name"], package["license"].as_str().unwrap_or_default());
        assert!(is_allowed(licence, &allowed), "{name}: {licence}");
        let source = package["source"].as_str().unwrap_or("here");
        let known = source.starts_with("registry+") && source.contains("crates.io-index");
        let is_own = name == "conicoid" || name == "conicoid-python";
        assert!(known || is_own, "{name} comes from {source}");
    }
}

#[test]
fn licence_expressions_are_read_as_they_are_meant() {
    let allowed = ["MIT", "ISC", "Apache-2.0 WITH LLVM-exception"].map(str::to_owned).into();
    for (expression, is) in [
        ("MIT", true),
        ("GPL-3.0", false),
        ("GPL-3.0 OR MIT", true),
        ("GPL-3.0/MIT", true),
        ("MIT AND GPL-3.0", false),
        ("(GPL-3.0 OR ISC) AND MIT", true),
        ("GPL-3.0 OR ISC AND GPL-3.0", false),
        ("Apache-2.0", false),
        ("Apache-2.0 WITH LLVM-exception OR GPL-3.0", true),
    ] {
        assert_eq!(is_allowed(expression, &allowed), is, "{expression}");
    }
}

#[test]
fn every_dependency_is_named_in_the_code() {
    /// What generated code alone names.
    const GENERATED: [&str; 1] = ["tonic-prost"];
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let names_of = |manifest: &str, table: &str| {
        parsed(manifest)[table].as_table().unwrap().keys().cloned().collect::<Vec<_>>()
    };
    for (manifest, table, directories) in [
        ("Cargo.toml", "dependencies", &["src"][..]),
        ("Cargo.toml", "dev-dependencies", &["src", "tests", "examples"]),
        ("python/Cargo.toml", "dependencies", &["python/src"]),
    ] {
        let code: String =
            directories.iter().map(|directory| text(&root.join(directory))).collect();
        let names = names_of(manifest, table);
        for name in names.iter().filter(|name| !GENERATED.contains(&name.as_str())) {
            let path = format!("{}::", name.replace('-', "_"));
            let is_word =
                |at: usize| !code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_');
            let used = code.match_indices(&path).any(|(at, _)| is_word(at));
            assert!(used, "nothing in {directories:?} uses {name}");
        }
    }
}

/// All Rust code below `directory`.
fn text(directory: &Path) -> String {
    let entries = fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path());
    let of = |path: std::path::PathBuf| match path.extension() {
        Some(ending) if ending == "rs" => fs::read_to_string(path).unwrap(),
        _ if path.is_dir() => text(&path),
        _ => String::new(),
    };
    entries.map(of).collect()
}

#[test]
fn the_licence_is_there_in_full() {
    let licence = read("LICENSE");
    assert!(licence.contains("Version 2.0, January 2004") && licence.contains("END OF TERMS"));
    assert!(read("Cargo.toml").contains("license = \"Apache-2.0\""));
}

#[test]
fn the_python_package_has_the_version_of_the_crate() {
    let version = |manifest: &str| parsed(manifest)["package"]["version"].clone();
    assert_eq!(version("Cargo.toml"), version("python/Cargo.toml"));
}
