//! Sections of the manual and the README that are written from stored results of studies.

use super::accuracy::{AccuracyExperiment, stored_accuracy};
use super::effects::{EffectAudit, stored_effects};
use super::frame::{Experiment, GeneratedSection, StoredStudy};
use super::shipped::shipped_text;
use super::{paper, stability};
use palpate_learn::METHODS;

/// All generated sections; a test checks that the documents hold them, and
/// `cargo run -p palpate-workshop -- tables` writes them.
pub fn generated_sections() -> Result<Vec<GeneratedSection>, serde_json::Error> {
    let accuracy = section::<AccuracyExperiment>("assets/help/accuracy.md", "accuracy study", &stored_accuracy()?);
    let effects = section::<EffectAudit>("assets/help/effects.md", "effects", &stored_effects()?);
    let shipped =
        GeneratedSection { document: "assets/help/recognition.md", name: "shipped model", text: shipped_text() };
    let deviations =
        GeneratedSection { document: "assets/help/recognition.md", name: "deviations", text: deviations_text() };
    Ok([
        vec![accuracy, effects, shipped, deviations],
        stability::sections()?,
        paper::sections()?,
        paper::sections_in_short()?,
    ]
    .concat())
}

/// Differences of the tuned networks from the paper, each with the methods that have it.
fn deviations_text() -> String {
    let mut lines: Vec<(String, Vec<String>)> = Vec::new();
    for method in &METHODS {
        for deviation in method.deviations() {
            let key = format!("`{}`", method.key);
            match lines.iter_mut().find(|(known, _)| *known == deviation) {
                Some((_, keys)) => keys.push(key),
                None => lines.push((deviation, vec![key])),
            }
        }
    }
    let line = |(deviation, keys): &(String, Vec<String>)| format!("- {}: {deviation}.", keys.join(", "));
    lines.iter().map(line).collect::<Vec<_>>().join("\n")
}

/// A section with all tables of a study.
fn section<E: Experiment>(
    document: &'static str,
    name: &'static str,
    stored: &StoredStudy<E::Report>,
) -> GeneratedSection {
    let shown = E::shown(&stored.result);
    let text = format!("{}\n\n{}", shown.data.join(" "), shown.markdown(&stored.origin()));
    GeneratedSection { document, name, text }
}
