//! The layer table in the documentation of `src/app/mod.rs` holds: files of the window import only from rows above their
//! own, and no two files import each other, except a module and its children.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

fn app() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src/app")
}

/// All sources, by their path below `src/app`, without comments and test modules.
fn sources() -> BTreeMap<String, String> {
    fn gather(folder: &Path, found: &mut BTreeMap<String, String>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                gather(&path, found);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let text = std::fs::read_to_string(&path).unwrap();
                let text = text.split("mod tests {").next().unwrap();
                let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
                let below = path.strip_prefix(app()).unwrap().to_str().unwrap().replace('\\', "/");
                found.insert(below, code.collect::<Vec<_>>().join("\n"));
            }
        }
    }
    let mut found = BTreeMap::new();
    gather(&app(), &mut found);
    found
}

/// Rows of the table, lowest first: the files and folders of each.
fn layers() -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(app().join("mod.rs")).unwrap();
    let rows = text.lines().skip_while(|line| !line.starts_with("//! | layer |")).skip(2);
    let rows = rows.map_while(|line| line.strip_prefix("//! |"));
    rows.map(|row| row.split('|').nth(1).unwrap().split('`').skip(1).step_by(2).map(str::to_owned).collect()).collect()
}

/// Row of a file: that of its own name, or of the closest folder above it.
fn layer_of(file: &str, layers: &[Vec<String>]) -> Option<usize> {
    let above = file.match_indices('/').rev().map(|(at, _)| &file[..=at]);
    std::iter::once(file).chain(above).find_map(|name| layers.iter().position(|row| row.iter().any(|own| own == name)))
}

/// Module path of a file, as names below `crate::app`.
fn module_of(file: &str) -> Vec<&str> {
    let mut names: Vec<&str> = file.trim_end_matches(".rs").split('/').collect();
    if names.last() == Some(&"mod") {
        names.pop();
    }
    names
}

/// Every path that a source names below `crate::app`, with `self` and `super` resolved and braces opened.
fn paths(file: &str, text: &str) -> Vec<Vec<String>> {
    let own: Vec<String> = module_of(file).iter().map(|name| (*name).to_owned()).collect();
    let mut found = Vec::new();
    for (start, _) in text.match_indices("crate::app").chain(text.match_indices("super::")) {
        let before = text[..start].chars().next_back();
        if before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':') {
            continue;
        }
        let mut rest = &text[start..];
        let mut base = if let Some(below) = rest.strip_prefix("crate::app") {
            rest = below.strip_prefix("::").unwrap_or("");
            Vec::new()
        } else {
            own.clone()
        };
        while let Some(below) = rest.strip_prefix("super::") {
            base.pop();
            rest = below;
        }
        open(&base, rest, &mut found);
    }
    // Modules of the file's own children.
    for line in text.lines().filter_map(|line| line.trim_start().strip_prefix("use ")) {
        let first = line.split("::").next().unwrap_or_default();
        if text.contains(&format!("mod {first};")) {
            let mut path = own.clone();
            path.push(first.to_owned());
            found.push(path);
        }
    }
    found
}

/// Opens `a::{b, c::d}` into single paths.
fn open(base: &[String], rest: &str, found: &mut Vec<Vec<String>>) {
    let mut path = base.to_vec();
    let mut rest = rest;
    loop {
        if let Some(inside) = rest.strip_prefix('{') {
            let (mut depth, mut from) = (0, 0);
            for (at, letter) in inside.char_indices() {
                match letter {
                    '{' => depth += 1,
                    ',' if depth == 0 => {
                        open(&path, inside[from..at].trim(), found);
                        from = at + 1;
                    }
                    '}' if depth == 0 => return open(&path, inside[from..at].trim(), found),
                    '}' => depth -= 1,
                    _ => {}
                }
            }
            return;
        }
        let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
        if end > 0 && &rest[..end] != "self" {
            path.push(rest[..end].to_owned());
        }
        match rest[end..].strip_prefix("::") {
            Some(below) => rest = below,
            None => return found.push(path),
        }
    }
}

/// File that a path leads into: the deepest module on it.
fn file_of(path: &[String], files: &BTreeMap<String, String>) -> Option<String> {
    (0..=path.len()).rev().find_map(|length| {
        let stem = path[..length].join("/");
        let candidates = [format!("{stem}.rs"), format!("{stem}/mod.rs").trim_start_matches('/').to_owned()];
        candidates.into_iter().find(|name| files.contains_key(name))
    })
}

/// Files that each file imports from, except itself.
fn imports(files: &BTreeMap<String, String>) -> BTreeMap<&str, BTreeSet<String>> {
    let of = |file: &str, text: &str| {
        let found = paths(file, text).into_iter().filter_map(|path| file_of(&path, files));
        found.filter(|other| other != file).collect()
    };
    files.iter().map(|(file, text)| (file.as_str(), of(file, text))).collect()
}

/// True where one of two files is the parent module of the other.
fn related(a: &str, b: &str) -> bool {
    let (a, b) = (module_of(a), module_of(b));
    a.starts_with(&b) || b.starts_with(&a)
}

#[test]
fn files_of_the_window_import_only_downward() {
    let (files, layers) = (sources(), layers());
    assert!(layers.len() > 8, "no table was found: {layers:?}");
    for name in layers.iter().flatten() {
        let exists = files.keys().any(|file| file == name || (name.ends_with('/') && file.starts_with(name.as_str())));
        assert!(exists, "the table names {name}, which does not exist");
    }
    for (file, others) in imports(&files) {
        let own = layer_of(file, &layers).unwrap_or_else(|| panic!("src/app/{file} is in no row of the table"));
        for other in others.iter().filter(|other| !related(file, other)) {
            let below = layer_of(other, &layers).unwrap_or_else(|| panic!("src/app/{other} is in no row of the table"));
            // Files of one folder share a row.
            let (folder, beside) = (file.rsplit_once('/'), other.rsplit_once('/'));
            let siblings = below == own && folder.zip(beside).is_some_and(|(a, b)| a.0 == b.0 && a.0.contains('/'));
            assert!(below < own || siblings, "src/app/{file} must not import from {other}");
        }
    }
}

#[test]
fn files_of_the_window_do_not_import_each_other() {
    let files = sources();
    let imports = imports(&files);
    assert!(imports.values().map(BTreeSet::len).sum::<usize>() > 100, "too few imports were found: {imports:?}");
    for file in imports.keys() {
        let mut reached: BTreeSet<&str> = BTreeSet::new();
        let mut next = vec![*file];
        while let Some(from) = next.pop() {
            for other in imports[from].iter().filter(|other| !related(from, other)) {
                assert!(other != file, "src/app/{file} imports itself, by way of {from}");
                if reached.insert(other) {
                    next.push(other);
                }
            }
        }
    }
}

#[test]
fn paths_are_read_as_the_compiler_reads_them() {
    let text =
        "use crate::app::theme::{self, colour};\nuse super::super::widgets::wrapped;\nuse super::{Part, words::title};";
    let found: BTreeSet<String> =
        paths("panels/recognition/strip.rs", text).iter().map(|path| path.join("::")).collect();
    let wanted = ["panels::recognition::Part", "panels::recognition::words::title", "panels::widgets::wrapped"];
    let wanted = wanted.iter().chain(&["theme", "theme::colour"]).map(|path| (*path).to_owned()).collect();
    assert_eq!(found, wanted);
}
