//! Which file of a package imports from which, read from the sources.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Sources of one package, or of one folder of it.
pub(crate) struct Sources {
    folder: PathBuf,
    /// Path of the folder's own module, such as `crate` or `crate::app`.
    module: &'static str,
    /// Code by path below the folder, without comments and tests.
    pub(crate) files: BTreeMap<String, String>,
}

impl Sources {
    /// Reads a folder of the repository. `skipped` names folders below it that belong to other packages.
    pub(crate) fn read(folder: &str, module: &'static str, skipped: &[&str]) -> Self {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
        let mut files = BTreeMap::new();
        gather(&folder, &folder, skipped, &mut files);
        let tests: BTreeSet<String> = files.iter().flat_map(|(file, text)| test_files(file, text)).collect();
        files.retain(|file, _| !tests.contains(file) && !file.starts_with("examples/"));
        files.values_mut().for_each(|text| *text = code(text));
        Self { folder, module, files }
    }

    /// Text of a file, with comments.
    pub(crate) fn text(&self, file: &str) -> String {
        std::fs::read_to_string(self.folder.join(file)).unwrap()
    }

    /// Rows of the table with the header `| layer |` in the documentation of a file, lowest first: the names in each.
    pub(crate) fn layers(&self, file: &str) -> Vec<Vec<String>> {
        let rows = rows(&self.text(file), "| layer |");
        rows.iter().map(|row| names_in(&row[1])).collect()
    }

    /// Files that each file imports from, except itself. Re-exported items count for the file that defines them.
    pub(crate) fn imports(&self) -> BTreeMap<&str, BTreeSet<String>> {
        let of = |file: &str, text: &str| {
            let found = self.paths(file, text).into_iter().filter_map(|path| self.file_of(&path, 0));
            found.filter(|other| other != file).collect()
        };
        self.files.iter().map(|(file, text)| (file.as_str(), of(file, text))).collect()
    }

    /// Fails where files import each other, directly or by way of others. A module and its children may.
    pub(crate) fn assert_no_cycles(&self) {
        let imports = self.imports();
        let mut cycles = Vec::new();
        for file in imports.keys() {
            let mut reached: BTreeMap<&str, &str> = BTreeMap::new();
            let mut next = vec![*file];
            'search: while let Some(from) = next.pop() {
                for other in imports[from].iter().filter(|other| !related(from, other)) {
                    if other == file {
                        cycles.push(way(&reached, file, from));
                        break 'search;
                    }
                    if !reached.contains_key(other.as_str()) {
                        reached.insert(other, from);
                        next.push(other);
                    }
                }
            }
        }
        assert!(cycles.is_empty(), "files of {} import each other:\n{}", self.folder.display(), cycles.join("\n"));
    }

    /// Every path below the folder's module that a source names, with `self` and `super` resolved and braces opened.
    pub(crate) fn paths(&self, file: &str, text: &str) -> Vec<Vec<String>> {
        let own: Vec<String> = module_of(file).iter().map(|name| (*name).to_owned()).collect();
        let mut found = Vec::new();
        for (start, _) in text.match_indices(self.module).chain(text.match_indices("super::")) {
            let before = text[..start].chars().next_back();
            if before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':' || c == '$') {
                continue;
            }
            let mut rest = &text[start..];
            let mut base = if let Some(below) = rest.strip_prefix(self.module) {
                let Some(below) = below.strip_prefix("::") else { continue };
                rest = below;
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
        found.extend(self.child_imports(file, text));
        found
    }

    /// Paths of `use` statements that begin with a module of the file itself.
    fn child_imports(&self, file: &str, text: &str) -> Vec<Vec<String>> {
        let own: Vec<String> = module_of(file).iter().map(|name| (*name).to_owned()).collect();
        let mut found = Vec::new();
        for statement in uses(text) {
            let first = statement.split("::").next().unwrap_or_default();
            let rest = if first == "self" { statement.strip_prefix("self::").unwrap_or_default() } else { statement };
            if first == "self" || text.contains(&format!("mod {first};")) {
                open(&own, rest, &mut found);
            }
        }
        found
    }

    /// File that defines what a path names: the deepest module on it, or the one that this module re-exports it from.
    fn file_of(&self, path: &[String], depth: usize) -> Option<String> {
        let (length, file) = (0..=path.len()).rev().find_map(|length| {
            let stem = path[..length].join("/");
            let candidates = match length {
                0 => ["lib.rs".to_owned(), "mod.rs".to_owned(), "main.rs".to_owned()],
                _ => [format!("{stem}.rs"), format!("{stem}/mod.rs"), String::new()],
            };
            candidates.into_iter().find(|name| self.files.contains_key(name)).map(|name| (length, name))
        })?;
        let Some(item) = path.get(length) else { return Some(file) };
        let text = &self.files[&file];
        let mut named = self.child_imports(&file, text);
        named.extend(self.paths(&file, text));
        let origin = named.into_iter().find(|other| other.len() > 1 && other.last() == Some(item) && other != path);
        let elsewhere = origin.filter(|_| depth < 4).and_then(|origin| self.file_of(&origin, depth + 1));
        Some(elsewhere.unwrap_or(file))
    }
}

/// Rows of a table in the documentation of a file, as texts of cells.
pub(crate) fn rows(text: &str, header: &str) -> Vec<Vec<String>> {
    let header = format!("//! {header}");
    let rows = text.lines().skip_while(|line| !line.starts_with(&header)).skip(2);
    let rows = rows.map_while(|line| line.strip_prefix("//! |"));
    rows.map(|row| row.split('|').map(|cell| cell.trim().to_owned()).collect()).collect()
}

/// Names between backticks.
pub(crate) fn names_in(cell: &str) -> Vec<String> {
    cell.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// True where one of two files is the parent module of the other.
pub(crate) fn related(a: &str, b: &str) -> bool {
    let (a, b) = (module_of(a), module_of(b));
    a.starts_with(&b) || b.starts_with(&a)
}

/// Sources below a folder: text by path below `top`.
pub(crate) fn gather(folder: &Path, top: &Path, skipped: &[&str], found: &mut BTreeMap<String, String>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let below = path.strip_prefix(top).unwrap().to_str().unwrap().replace('\\', "/");
        if path.is_dir() && !skipped.contains(&below.as_str()) {
            gather(&path, top, skipped, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.insert(below, std::fs::read_to_string(&path).unwrap());
        }
    }
}

/// Files below `file` that are built for tests only.
fn test_files(file: &str, text: &str) -> Vec<String> {
    let folder = module_of(file).join("/");
    let declared = text.match_indices("#[cfg(test)]\nmod ").map(|(at, start)| &text[at + start.len()..]);
    let names = declared.filter_map(|rest| rest.split_once(';')).map(|(name, _)| name);
    names.map(|name| format!("{folder}/{name}.rs").trim_start_matches('/').to_owned()).collect()
}

/// Code that ships: without comments, and without test modules, which stand at the end of a file.
fn code(text: &str) -> String {
    let text = text.split("mod tests {").next().unwrap();
    text.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

/// `use` statements, without the word and the semicolon.
fn uses(text: &str) -> Vec<&str> {
    let starts = text.match_indices("use ").filter(|(at, _)| {
        let line = text[..*at].rsplit('\n').next().unwrap_or_default().trim();
        line.is_empty() || line.starts_with("pub")
    });
    starts.filter_map(|(at, word)| text[at + word.len()..].split_once(';')).map(|(statement, _)| statement).collect()
}

/// Module path of a file, as names below the folder.
fn module_of(file: &str) -> Vec<&str> {
    let mut names: Vec<&str> = file.trim_end_matches(".rs").split('/').collect();
    if names.last() == Some(&"mod") || names == ["lib"] || names == ["main"] {
        names.pop();
    }
    names
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

/// A cycle in words: from a file by way of others to itself.
fn way(reached: &BTreeMap<&str, &str>, file: &str, last: &str) -> String {
    let mut names = vec![file, last];
    while let Some(before) = reached.get(names[names.len() - 1]).filter(|_| names[names.len() - 1] != file) {
        names.push(before);
    }
    names.reverse();
    names.join(" -> ")
}
