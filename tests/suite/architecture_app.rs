//! The layer table in the documentation of `src/app/mod.rs` holds: files of the window import only from rows above their
//! own, and no two files import each other, except a module and its children.

use crate::imports::{Sources, related};
use std::collections::BTreeSet;

fn app() -> Sources {
    Sources::read("src/app", "crate::app", &[])
}

/// Row of a file: that of its own name, or of the closest folder above it.
fn layer_of(file: &str, layers: &[Vec<String>]) -> Option<usize> {
    let above = file.match_indices('/').rev().map(|(at, _)| &file[..=at]);
    std::iter::once(file).chain(above).find_map(|name| layers.iter().position(|row| row.iter().any(|own| own == name)))
}

#[test]
fn files_of_the_window_import_only_downward() {
    let app = app();
    let (files, layers) = (&app.files, app.layers("mod.rs"));
    assert!(layers.len() > 8, "no table was found: {layers:?}");
    for name in layers.iter().flatten() {
        let exists = files.keys().any(|file| file == name || (name.ends_with('/') && file.starts_with(name.as_str())));
        assert!(exists, "the table names {name}, which does not exist");
    }
    for (file, others) in app.imports() {
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
    let app = app();
    let imports = app.imports();
    assert!(imports.values().map(BTreeSet::len).sum::<usize>() > 100, "too few imports were found: {imports:?}");
    app.assert_no_cycles();
}

#[test]
fn fields_that_are_typed_into_have_fixed_ids() {
    for (file, text) in &app().files {
        let made = ["TextEdit::singleline", "TextEdit::multiline", "text_edit_singleline"]
            .iter()
            .any(|call| text.contains(call));
        assert!(!made || file == "widgets.rs", "src/app/{file} makes a text field without widgets::text_field");
        let added = ["ui.add(drag)", "ui.add(DragValue", "ui.add(slider)"].iter().any(|call| text.contains(call));
        assert!(!added, "src/app/{file} adds a number without widgets::number_field");
    }
}

#[test]
fn paths_are_read_as_the_compiler_reads_them() {
    let text =
        "use crate::app::theme::{self, colour};\nuse super::super::widgets::wrapped;\nuse super::{Part, words::title};";
    let found: BTreeSet<String> =
        app().paths("panels/recognition/strip.rs", text).iter().map(|path| path.join("::")).collect();
    let wanted = ["panels::recognition::Part", "panels::recognition::words::title", "panels::widgets::wrapped"];
    let wanted = wanted.iter().chain(&["theme", "theme::colour"]).map(|path| (*path).to_owned()).collect();
    assert_eq!(found, wanted);
}
