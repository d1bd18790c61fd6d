//! Stored results of studies, and the tables and pictures that are made from them.

use palpate_geometry::palette::Theme;
use palpate_lab::study::accuracy::{accuracy_figure, stored_accuracy};
use palpate_lab::study::generated_sections;
use palpate_render::figure_svg;
use std::path::Path;

type TestResult = Result<(), Box<dyn std::error::Error>>;

#[test]
fn tables_in_manual_and_readme_are_those_of_the_stored_results() -> TestResult {
    for section in generated_sections()? {
        let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(section.document))?;
        let written = section.put_into(&text).ok_or_else(|| format!("{} has no {}", section.document, section.name))?;
        assert!(written == text, "{}: run `cargo run -p palpate-workshop -- tables`", section.document);
    }
    Ok(())
}

#[test]
fn the_stored_picture_is_that_of_the_stored_result() -> TestResult {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/studies/accuracy.svg");
    let drawn = figure_svg(&accuracy_figure(&stored_accuracy()?), Theme::Light, [960, 860])?;
    assert!(std::fs::read_to_string(path)? == drawn, "run `palpate study accuracy --out assets/studies` again");
    Ok(())
}
