//! The sentences of section V-A beside our numbers.

use super::super::judging::Claim;
use super::super::report::{Agreement, Finding};
use super::bodies::Summary;
use super::{DEFAULT, Found, PAPER};

/// Sentences in numbers for one kind of grasps with one gripper.
pub(super) struct Measured {
    pub(super) gripper: &'static str,
    pub(super) kind: String,
    pub(super) summary: Summary,
    pub(super) found: Found,
}

/// A sentence judged.
pub(super) struct Sentence {
    claim: &'static str,
    rule: &'static str,
    found: String,
    pub(super) verdict: Agreement,
}

/// Least rank correlation of what is said to go together.
const CLOSE: f64 = 0.9;
/// Largest rate of bending after contact, as a share of that before, that counts as steady; least one that counts as a
/// further increase.
const STEADY: f64 = 0.20;
const INCREASE: f64 = 0.25;
/// Least share of the variance of a linear increase that a line explains.
const LINEAR: f64 = 0.95;
/// Longest rise of pressure that is a few samples (s): fifteen at the paper's 75 Hz, two of its actuation ticks.
const SOON_S: f64 = 0.20;
/// Most pressure before contact, as a share of the hold's, that is low.
const LOW: f64 = 0.05;

/// Agreement of a sentence with its rule, all parts of which must hold.
fn judged(parts: &[Option<bool>]) -> Agreement {
    let all = |wanted: Option<bool>| parts.iter().all(|part| *part == wanted);
    if all(None) {
        Agreement::NotMeasured
    } else if all(Some(true)) {
        Agreement::Agrees
    } else if all(Some(false)) {
        Agreement::Disagrees
    } else {
        Agreement::Partly
    }
}

fn number(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), |value| format!("{value:.2}"))
}

fn percent(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), |value| format!("{:.0} %", 100.0 * value))
}

/// All sentences for one summary.
pub(super) fn sentences(own: &Summary) -> [Sentence; 5] {
    [
        Sentence {
            claim: "Bending rises from the beginning of closing to contact, while the contact signal stays low",
            rule: "Rank correlation of bending with time before contact at least 0.9, mean pressure then at most 5 % of the hold's; \
                   contact is where pressure stays above 5 %",
            found: format!("rank correlation {}, pressure {}", number(own.rises), percent(own.before)),
            verdict: judged(&[own.rises.map(|r| r >= CLOSE), own.before.map(|before| before <= LOW)]),
        },
        Sentence {
            claim: "On rounded objects bending reaches a steady state, correlated with their curvature",
            rule: "Median rate of bending from 0.4 to 0.75 s after contact at most 20 % of that before; rank correlation of the hold's \
                   bending with one over the width at least 0.9",
            found: format!(
                "rate {}, {} of the bending after contact, correlation with curvature {}",
                percent(own.round_rate),
                percent(own.round_share),
                number(own.curvature)
            ),
            verdict: judged(&[own.round_rate.map(|rate| rate <= STEADY), own.curvature.map(|r| r >= CLOSE)]),
        },
        Sentence {
            claim: "On flat objects bending goes on increasing linearly after contact",
            rule: "The same rate at least 25 %, and a line explains 95 % of the variance of bending after contact",
            found: format!(
                "rate {}, {} of the bending after contact, R² {}",
                percent(own.flat_rate),
                percent(own.flat_share),
                number(own.flat_line)
            ),
            verdict: judged(&[own.flat_rate.map(|rate| rate >= INCREASE), own.flat_line.map(|r2| r2 >= LINEAR)]),
        },
        Sentence {
            claim: "Pressure saturates a few samples after contact and stays steady",
            rule: "Median time from contact to 90 % of the hold's pressure at most 0.2 s, which is 15 samples or two actuation ticks",
            found: format!("{} s", number(own.rise_s)),
            verdict: judged(&[own.rise_s.map(|rise| rise <= SOON_S)]),
        },
        Sentence {
            claim: "Larger objects are touched earlier",
            rule: "Rank correlation of onset with the width across the fingers at most -0.9",
            found: format!("rank correlation {}", number(own.size)),
            verdict: judged(&[own.size.map(|r| r <= -CLOSE)]),
        },
    ]
}

/// Each sentence for the default gripper and for the paper's scene, or for stored trials.
pub(super) fn findings(measured: &[Measured]) -> Vec<Finding> {
    let mut findings = Vec::new();
    let abouts = [
        (DEFAULT, " (default gripper, free objects)"),
        (PAPER, " (scene paper, fixed objects)"),
        ("stored", " (stored trials)"),
    ];
    for (gripper, about) in abouts {
        let own = measured.iter().filter(|own| own.gripper == gripper);
        let judged: Vec<_> = own.map(|own| (own.kind.as_str(), sentences(&own.summary))).collect();
        let Some((_, first)) = judged.first() else { continue };
        for (at, Sentence { claim, rule, .. }) in first.iter().enumerate() {
            let found = judged.iter().map(|(kind, all)| (format!("{kind}: {}", all[at].found), all[at].verdict));
            findings.push(Claim("V-A", &format!("{claim}{about}"), rule).of_each("", found));
        }
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sentence_holds_where_all_its_numbers_do() {
        let verdicts = |own: &Summary| sentences(own).map(|sentence| sentence.verdict);
        let good = Summary {
            rises: Some(1.0),
            before: Some(0.01),
            round_rate: Some(0.1),
            flat_rate: Some(0.3),
            flat_line: Some(0.99),
            curvature: Some(0.95),
            rise_s: Some(0.1),
            size: Some(-0.95),
            ..Summary::default()
        };
        assert_eq!(verdicts(&good), [Agreement::Agrees; 5]);
        let bad = Summary { round_rate: Some(0.4), rise_s: Some(1.0), flat_line: None, ..good };
        // Half of the rule about flat objects is not measured.
        let wanted = [Agreement::Agrees, Agreement::Partly, Agreement::Partly, Agreement::Disagrees, Agreement::Agrees];
        assert_eq!(verdicts(&bad), wanted);
        assert_eq!(verdicts(&Summary::default()), [Agreement::NotMeasured; 5]);
    }
}
