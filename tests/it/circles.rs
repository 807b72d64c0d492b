//! No files of the crate import each other in a circle.
//!
//! A file is a module, a folder's `mod.rs` its folder. What counts is every path by which a file names
//! another, in a `use` or in the code; `pub use` does not, for it only passes on.

use std::{
    collections::{BTreeMap, BTreeSet, VecDeque},
    fs,
    path::Path,
};

/// The modules of the crate, by path (`segment::moves::step`), with their code: comments and tests left out.
type Modules = BTreeMap<String, String>;
/// What each module imports.
type Imports = BTreeMap<String, BTreeSet<String>>;

#[test]
fn no_files_import_each_other_in_a_circle() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Modules::new();
    collect(&src, "", &mut files);
    let imports = imports(&without_tests(files));
    assert!(imports.values().map(BTreeSet::len).sum::<usize>() > 500, "imports are not seen");
    let circles: Vec<String> = circles(&imports).iter().map(|c| c.join(" -> ")).collect();
    assert!(circles.is_empty(), "in a circle:\n{}", circles.join("\n"));
}

fn collect(directory: &Path, module: &str, files: &mut Modules) {
    for entry in fs::read_dir(directory).unwrap().flatten() {
        let path = entry.path();
        let stem = path.file_stem().unwrap().to_string_lossy().into_owned();
        let name = if module.is_empty() { stem.clone() } else { format!("{module}::{stem}") };
        if path.is_dir() {
            collect(&path, &name, files);
        } else if path.extension().is_some_and(|e| e == "rs") {
            let name = if stem == "mod" { module.to_owned() } else { name };
            files.insert(name, fs::read_to_string(&path).unwrap());
        }
    }
}

/// Without comments, test modules and files that are compiled for tests alone.
fn without_tests(mut files: Modules) -> Modules {
    let mut tests = Vec::new();
    for (module, text) in &files {
        for declared in text.split("#[cfg(test)]\n").skip(1) {
            let line = declared.lines().next().unwrap_or_default();
            let name = line.split("mod ").nth(1).and_then(|rest| rest.strip_suffix(';'));
            tests.extend(name.map(|name| format!("{module}::{name}")));
        }
    }
    files.retain(|name, _| !tests.contains(name));
    for text in files.values_mut() {
        let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
        *text = code
            .lines()
            .map(|l| l.split("//").next().unwrap_or_default())
            .fold(String::new(), |all, line| all + line + "\n");
    }
    files
}

fn imports(modules: &Modules) -> Imports {
    let of = |(name, code): (&String, &String)| {
        let own = name.as_str();
        let mut found = BTreeSet::new();
        for path in paths(code) {
            found.extend(named(&path, own, modules).filter(|other| other != own));
        }
        (name.clone(), found)
    };
    modules.iter().map(of).collect()
}

/// Every path in the code, the branches of a `use` each for itself.
fn paths(code: &str) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    let mut rest = code;
    while let Some(at) = rest.find(|c: char| c.is_alphanumeric() || c == '_' || c == ':') {
        rest = &rest[at..];
        if let Some(after) = ["pub use ", "pub(crate) use ", "pub(super) use "]
            .iter()
            .find_map(|passed_on| rest.strip_prefix(passed_on))
        {
            rest = after.split_once(';').map_or("", |(_, after)| after);
            continue;
        }
        let before = found.len();
        let after = tree(rest, &mut Vec::new(), &mut found);
        // A word alone is none.
        let words = found.split_off(before);
        found.extend(words.into_iter().filter(|path| path.len() > 1));
        rest = if after.len() < rest.len() { after } else { &rest[1..] };
    }
    found
}

/// Reads one tree, `a::b` or `a::{b, c::{d, e}}`, into the paths of its leaves; what is behind it.
fn tree<'a>(mut rest: &'a str, above: &mut Vec<String>, found: &mut Vec<Vec<String>>) -> &'a str {
    let depth = above.len();
    loop {
        let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_' && c != '*');
        let (word, after) = rest.split_at(end.unwrap_or(rest.len()));
        if !word.is_empty() {
            above.push(word.to_owned());
        }
        let Some(deeper) = after.strip_prefix("::") else {
            found.push(above.clone());
            above.truncate(depth);
            return after;
        };
        let Some(branches) = deeper.strip_prefix('{') else {
            rest = deeper;
            continue;
        };
        rest = branches.trim_start();
        while !rest.is_empty() && !rest.starts_with('}') {
            rest = tree(rest, above, found);
            // An alias, a comma or the end.
            let next = rest.find([',', '}']).unwrap_or(rest.len());
            rest = rest[next..].trim_start_matches(',').trim_start();
        }
        above.truncate(depth);
        return rest.strip_prefix('}').unwrap_or(rest);
    }
}

/// The module that a path in `own` leads into.
fn named<'a>(
    path: &[String],
    own: &str,
    modules: &'a Modules,
) -> impl Iterator<Item = String> + use<'a> {
    let mut from: Vec<&str> = own.split("::").filter(|part| !part.is_empty()).collect();
    let mut path: Vec<&str> = path.iter().map(String::as_str).collect();
    match path[0] {
        "crate" => from.clear(),
        "self" => {}
        "super" => {
            while path.first() == Some(&"super") {
                from.pop();
                path.remove(0);
            }
            path.insert(0, "super");
        }
        child if modules.contains_key(&[own, child].join("::")) => path.insert(0, "self"),
        _ => path.clear(),
    }
    let is_path = !path.is_empty();
    from.extend(path.into_iter().skip(1));
    let longest = (1..=from.len()).rev().map(|n| from[..n].join("::"));
    let found = longest.filter(|_| is_path).find(|name| modules.contains_key(name));
    found.into_iter()
}

/// The shortest circle through each module that is in one, each once.
fn circles(imports: &Imports) -> Vec<Vec<&str>> {
    let mut seen = BTreeSet::new();
    let mut found = Vec::new();
    for start in imports.keys() {
        let mut from: BTreeMap<&str, &str> = BTreeMap::new();
        let mut queue = VecDeque::from([start.as_str()]);
        while let Some(at) = queue.pop_front() {
            for next in imports.get(at).into_iter().flatten() {
                if !from.contains_key(next.as_str()) {
                    from.insert(next, at);
                    queue.push_back(next);
                }
            }
        }
        let Some(mut at) = from.get(start.as_str()).copied() else { continue };
        let mut circle = vec![start.as_str()];
        while at != start {
            circle.push(at);
            at = from[at];
        }
        let members: BTreeSet<&str> = circle.iter().copied().collect();
        circle.push(start);
        circle.reverse();
        if seen.insert(members) {
            found.push(circle);
        }
    }
    found
}

fn modules(files: &[(&str, &str)]) -> Modules {
    without_tests(files.iter().map(|(m, text)| ((*m).to_owned(), (*text).to_owned())).collect())
}

#[test]
fn a_circle_is_found_however_its_paths_are_written() {
    let rest = [("a", "mod b;\nmod c;\npub use b::B;\n"), ("d", ""), ("d::e", "")];
    for code in [
        "use super::c::C;",
        "use crate::{d, a::{d as x, c::{C, self}}};",
        "use crate::d::e;\nfn f() -> Vec<crate::a::c::C> { todo() }",
        "fn f() { super::c::g() }",
    ] {
        let files = [&rest[..], &[("a::b", code), ("a::c", "use super::b::{B, F};")]].concat();
        let imports = imports(&modules(&files));
        assert_eq!(circles(&imports), [["a::b", "a::c", "a::b"]], "{code}");
    }
}

#[test]
fn what_is_passed_on_or_for_tests_alone_makes_no_circle() {
    for code in [
        "pub use super::c::C;\n",
        "// use super::c::C;\n",
        "#[cfg(test)]\nmod tests {\n    use super::super::c::C;\n}\n",
        "struct C;\nfn f(c: C) -> C { C::new(c::D) }\n",
    ] {
        let files = [("a", "#[cfg(test)]\nmod t;\n"), ("a::b", code), ("a::c", "use super::b::B;")];
        let files = [&files[..], &[("a::t", "use super::{b, c};")]].concat();
        assert!(circles(&imports(&modules(&files))).is_empty(), "{code}");
    }
}
