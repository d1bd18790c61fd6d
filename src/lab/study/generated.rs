//! Sections of the manual and the README that are written from stored results of studies.

use super::accuracy::{accuracy_tables, stored_accuracy};
use super::effect_audit::{AuditReport, audit_table, stored_effects};
use super::stored_study::{GeneratedSection, StoredStudy};
use super::{paper, peer_costs, recognition_scores, stability};

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
    Ok([
        vec![accuracy, effects],
        stability::sections()?,
        recognition_scores::sections()?,
        paper::sections()?,
        peer_costs::sections()?,
    ]
    .concat())
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
