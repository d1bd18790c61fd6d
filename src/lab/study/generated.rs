//! Sections of the manual and the README that are written from stored results of studies.

use super::accuracy::{accuracy_tables, stored_accuracy};
use super::effect_audit::{AuditReport, audit_table, stored_effects};
use super::shipped::shipped_text;
use super::stored_study::{GeneratedSection, StoredStudy};
use super::{paper, peer_costs, stability};
use palpate_learn::METHODS;

/// All generated sections; a test checks that the documents hold them, and
/// `cargo run -p palpate-workshop -- tables` writes them.
pub fn generated_sections() -> Result<Vec<GeneratedSection>, serde_json::Error> {
    let accuracy = GeneratedSection {
        document: "assets/help/accuracy.md",
        name: "accuracy study",
        text: accuracy_tables(&stored_accuracy()?),
    };
    let effects = GeneratedSection {
        document: "assets/help/effects.md",
        name: "effects",
        text: effects_text(&stored_effects()?),
    };
    let shipped =
        GeneratedSection { document: "assets/help/recognition.md", name: "shipped model", text: shipped_text() };
    let deviations =
        GeneratedSection { document: "assets/help/recognition.md", name: "deviations", text: deviations_text() };
    Ok([
        vec![accuracy, effects, shipped, deviations],
        stability::sections()?,
        paper::sections()?,
        paper::sections_in_short()?,
        peer_costs::sections()?,
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

fn effects_text(stored: &StoredStudy<AuditReport>) -> String {
    let AuditReport { scenes, missed, within_noise, .. } = stored.result;
    format!(
        "{}\n\nWith all effects on at once the change is seen in {missed} of {scenes} scenes; in {within_noise} more it is as \
         large, but within the noise. CPU time: with the effect over that without it, median. {}.",
        audit_table(&stored.result),
        stored.origin()
    )
}
