//! Sections of the manual and the README that are written from stored results of studies.

use super::accuracy::{accuracy_tables, stored_accuracy};
use super::stability;
use super::stored_study::GeneratedSection;

/// All generated sections; a test checks that the documents hold them, and
/// `cargo run -p palpate-workshop -- tables` writes them.
pub fn generated_sections() -> Result<Vec<GeneratedSection>, serde_json::Error> {
    let accuracy = GeneratedSection {
        document: "assets/help/accuracy.md",
        name: "accuracy study",
        text: accuracy_tables(&stored_accuracy()?),
    };
    Ok([vec![accuracy], stability::sections()?].concat())
}
