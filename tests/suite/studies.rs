//! Stored results of studies, and the tables and pictures that are made from them.

use palpate_lab::study::generated_sections;
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
