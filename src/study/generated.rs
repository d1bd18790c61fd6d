//! Sections of the manual and the README that are written from stored results of studies.

use super::frame::{GeneratedSection, ListedStudy, ShownStudy, grouped};
use super::shipped::shipped_text;
use super::{accuracy, added_sensors, answers, effects, paper, promises, public, stability};
use palpate_learn::{METHODS, Method};

/// All generated sections; a test checks that the documents hold them, and
/// `cargo run -p palpate-workshop -- tables` writes them.
pub fn generated_sections() -> Result<Vec<GeneratedSection>, serde_json::Error> {
    let accuracy = section("assets/help/accuracy.md", "accuracy study", &accuracy::LISTED)?;
    let effects = section("assets/help/effects.md", "effects", &effects::LISTED)?;
    let added = section("assets/help/sensors.md", "added sensors", &added_sensors::LISTED)?;
    let answers = section("assets/help/recognition.md", "answers", &answers::LISTED)?;
    let shipped =
        GeneratedSection { document: "assets/help/recognition.md", name: "shipped model", text: shipped_text() };
    let deviations =
        GeneratedSection { document: "assets/help/recognition.md", name: "deviations", text: deviations_text() };
    Ok([
        accuracy
            .into_iter()
            .chain(effects)
            .chain(added)
            .chain(answers)
            .chain([promises::section()?, shipped, deviations])
            .collect(),
        stability::sections()?,
        paper::sections()?,
        paper::sections_in_short()?,
        public::sections()?,
    ]
    .concat())
}

/// Differences of the tuned networks from the paper, each with the methods that have it.
fn deviations_text() -> String {
    let keys = |method: &'static Method| {
        method.deviations().into_iter().map(|deviation| (deviation, format!("`{}`", method.key)))
    };
    let lines = grouped(METHODS.iter().flat_map(keys));
    let line = |(deviation, keys): &(String, Vec<String>)| format!("- {}: {deviation}.", keys.join(", "));
    lines.iter().map(line).collect::<Vec<_>>().join("\n")
}

/// A section with all tables of a study; none where it has not been run in full.
fn section(
    document: &'static str,
    name: &'static str,
    study: &dyn ListedStudy,
) -> Result<Option<GeneratedSection>, serde_json::Error> {
    let section = |ShownStudy { stored, .. }: ShownStudy| {
        let text = format!("{}\n\n{}", stored.result.data.join(" "), stored.result.markdown(&stored.origin()));
        GeneratedSection { document, name, text }
    };
    Ok(study.shipped()?.map(section))
}
