//! The paper's claims beside our numbers, from the stored results of its studies.

use super::report::{Finding, StudyReport};
use super::{PAPER_STUDIES, PaperStudy};
use crate::study::stored_study::{GeneratedSection, StoredStudy, markdown_table};
use include_dir::{Dir, include_dir};

/// Results of full runs, one file for each study.
static STORED: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/../../assets/studies/paper");

/// Stored report of a study; none where it has not been run in full.
pub fn stored_report(study: &dyn PaperStudy) -> Result<Option<StoredStudy<StudyReport>>, serde_json::Error> {
    let file = STORED.get_file(format!("{}.json", study.card().key));
    file.and_then(|file| file.contents_utf8()).map(StoredStudy::parse).transpose()
}

/// Sections of the manual that are written from the stored reports.
pub(in crate::study) fn sections() -> Result<Vec<GeneratedSection>, serde_json::Error> {
    let (mut parts, mut missing) = (Vec::new(), Vec::new());
    for study in PAPER_STUDIES {
        let card = study.card();
        match stored_report(*study)? {
            Some(stored) => {
                let data = stored.result.data.iter().map(|line| format!("- {line}\n")).collect::<String>();
                let table = claims(&stored.result.findings);
                parts.push(format!("## {} ({})\n\n{table}\n\n{data}\n{}.", card.title, card.paper, stored.origin()));
            }
            None => missing.push(format!("`{}`", card.key)),
        }
    }
    if !missing.is_empty() {
        parts.push(format!("Not run in full with this version: {}.", missing.join(", ")));
    }
    Ok(vec![GeneratedSection { document: "assets/help/paper.md", name: "claims", text: parts.join("\n\n") }])
}

fn claims(findings: &[Finding]) -> String {
    let rows = findings.iter().map(|finding| {
        let Finding { section, claim, found, verdict, why } = finding;
        vec![section.clone(), claim.clone(), found.clone(), format!("**{}**", verdict.name()), why.clone()]
    });
    markdown_table(&["section", "the paper", "here", "", "rule or reason"], &rows.collect::<Vec<_>>())
}
