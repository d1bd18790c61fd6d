//! The paper's claims beside our numbers, from the stored results of its studies.

use super::{PAPER_STUDIES, PaperStudy};
use crate::frame::{
    Cell, ClaimNumber, Finding, GeneratedSection, IntervalStrip, StoredStudy, StudyReport, markdown_table,
};

/// Results of full runs by the key of their study: files of `assets/studies/paper`.
const STORED: &[(&str, &str)] = &[
    ("signatures", include_str!("../../../assets/studies/paper/signatures.json")),
    ("layouts", include_str!("../../../assets/studies/paper/layouts.json")),
    ("modality", include_str!("../../../assets/studies/paper/modality.json")),
    ("stages", include_str!("../../../assets/studies/paper/stages.json")),
    ("training-size", include_str!("../../../assets/studies/paper/training-size.json")),
    ("models", include_str!("../../../assets/studies/paper/models.json")),
    ("grasps", include_str!("../../../assets/studies/paper/grasps.json")),
    ("drift", include_str!("../../../assets/studies/paper/drift.json")),
    ("shaking", include_str!("../../../assets/studies/paper/shaking.json")),
    ("recognition", include_str!("../../../assets/studies/paper/recognition.json")),
];

/// Descriptions of grasps below the claims of a study: the others differ in layout or signals.
const DATA_LINES: usize = 6;

/// Stored report of a study; none where it has not been run in full.
pub fn stored_report(study: &dyn PaperStudy) -> Result<Option<StoredStudy<StudyReport>>, serde_json::Error> {
    let stored = STORED.iter().find(|(key, _)| *key == study.card().key);
    stored.map(|(_, json)| StoredStudy::parse(json)).transpose()
}

/// Sections of the manual that are written from the stored reports.
pub(crate) fn sections() -> Result<Vec<GeneratedSection>, serde_json::Error> {
    let (mut parts, mut missing) = (Vec::new(), Vec::new());
    for study in PAPER_STUDIES.iter().filter(|study| study.card().is_of_the_paper()) {
        let card = study.card();
        match stored_report(*study)? {
            Some(stored) => {
                let lines = &stored.result.data;
                let mut data = lines.iter().take(DATA_LINES).map(|line| format!("- {line}\n")).collect::<String>();
                if let Some(more @ 1..) = lines.len().checked_sub(DATA_LINES) {
                    data += &format!("- and {more} more, above the tables of `palpate study {}`\n", card.key);
                }
                let table = claims(&stored.result.findings);
                parts.push(format!("## {} ({})\n\n{table}\n\n{data}\n{}.", card.title, card.paper, stored.origin()));
            }
            None => missing.push(format!("`{}`", card.key)),
        }
    }
    if !missing.is_empty() {
        parts.push(format!("Not run in full with this version: {}.", missing.join(", ")));
    }
    let claims = GeneratedSection { document: "assets/help/paper.md", name: "claims", text: parts.join("\n\n") };
    let studies = GeneratedSection { document: "assets/help/studies.md", name: "studies", text: overview() };
    Ok(vec![claims, studies])
}

/// Table of the studies and of what they cost.
fn overview() -> String {
    let rows = PAPER_STUDIES.iter().map(|study| {
        let card = study.card();
        [format!("`{}`", card.key).as_str(), card.about, card.paper, card.budget].map(str::to_owned).to_vec()
    });
    markdown_table(&["study", "shows", "paper", "cost of the full form"], &rows.collect::<Vec<_>>())
}

/// Claims one after the other: the claim, the verdict, and the numbers around the line that decides.
fn claims(findings: &[Finding]) -> String {
    let claim = |finding: &Finding| {
        let Finding { section, claim, found, verdict, why, .. } = finding;
        let row = |(own, strip): (&ClaimNumber, IntervalStrip)| {
            vec![own.what.clone(), own.shown(), Cell::Number(own.line).shown(&own.unit), format!("`{strip}`")]
        };
        let rows: Vec<Vec<String>> = finding.strips().map(row).collect();
        let table =
            (!rows.is_empty()).then(|| markdown_table(&["measured", "value", "line", "around the line"], &rows));
        let said = format!("**{}** ({section}) {claim}. {found}", verdict.name());
        let parts = [Some(said), table, finding.left_out(), Some(format!("{why}."))];
        parts.into_iter().flatten().collect::<Vec<_>>().join("\n\n")
    };
    findings.iter().map(claim).collect::<Vec<_>>().join("\n\n")
}
