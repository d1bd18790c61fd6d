//! The paper's claims beside our numbers, from the stored results of its studies.

use super::PAPER_STUDIES;
use crate::frame::{Cell, ClaimNumber, Finding, GeneratedSection, IntervalStrip, ShownStudy, markdown_table};

/// Descriptions of grasps below the claims of a study: the others differ in layout or signals.
const DATA_LINES: usize = 6;

/// Sections of the manual that are written from the stored reports.
pub(crate) fn sections() -> Result<Vec<GeneratedSection>, serde_json::Error> {
    let (mut parts, mut missing) = (Vec::new(), Vec::new());
    for study in PAPER_STUDIES.iter().filter(|study| study.card().is_of_the_paper()) {
        let card = study.card();
        match study.shipped()? {
            Some(ShownStudy { stored, .. }) => {
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
    Ok([vec![claims, studies], super::region::sections()?].concat())
}

/// Table of the studies and of what they cost.
fn overview() -> String {
    let rows = PAPER_STUDIES.iter().map(|study| {
        let card = study.card();
        [format!("`{}`", card.key).as_str(), card.about, card.paper, &card.cost()].map(str::to_owned).to_vec()
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
