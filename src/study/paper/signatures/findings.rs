//! The sentences of section V-A beside our numbers.

use super::super::prelude::*;
use super::bodies::Summary;
use super::{DEFAULT, Found, PAPER};
use palpate_lab::datasets::SensorView;

/// Sentences in numbers for one kind of grasps with one gripper.
pub(super) struct Measured {
    pub(super) gripper: &'static str,
    pub(super) kind: String,
    pub(super) summary: Summary,
    pub(super) found: Found,
    /// Sensors that read the grasps; none of grasps that no data set holds.
    pub(super) view: Option<SensorView>,
}

/// A sentence of the paper in numbers.
pub(super) struct Sentence {
    claim: &'static str,
    rule: &'static str,
    numbers: Vec<SentenceNumber>,
}

/// A number of a sentence.
struct SentenceNumber {
    what: &'static str,
    value: Option<f64>,
    unit: &'static str,
    /// Least value where the sentence holds, or the largest.
    line: Limit,
}

/// Limit of a number.
#[derive(Clone, Copy)]
enum Limit {
    AtLeast(f64),
    AtMost(f64),
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

impl SentenceNumber {
    fn holds(&self) -> Option<bool> {
        self.value.map(|value| match self.line {
            Limit::AtLeast(line) => value >= line,
            Limit::AtMost(line) => value <= line,
        })
    }

    /// The number for a kind of grasps; none where it was not measured.
    fn evidence(&self, kind: &str) -> Option<ClaimNumber> {
        let (Limit::AtLeast(line) | Limit::AtMost(line)) = self.line;
        Some(ClaimNumber::new(format!("{kind}: {}", self.what), Some(self.value?), self.unit, line))
    }
}

impl Sentence {
    /// Agreement of a sentence with its rule, all parts of which must hold.
    pub(super) fn verdict(&self) -> Agreement {
        let holds = |wanted: Option<bool>| self.numbers.iter().all(|number| number.holds() == wanted);
        match [None, Some(true), Some(false)].map(holds) {
            [true, ..] => Agreement::NotMeasured,
            [_, true, _] => Agreement::Agrees,
            [.., true] => Agreement::Disagrees,
            [false, false, false] => Agreement::Partly,
        }
    }
}

/// All sentences for one summary.
pub(super) fn sentences(own: &Summary) -> [Sentence; 5] {
    let number = |what, value, unit, line| SentenceNumber { what, value, unit, line };
    [
        Sentence {
            claim: "Bending rises from the beginning of closing to contact, while the contact signal stays low",
            rule: "Rank correlation of bending with time before contact at least 0.9, mean pressure then at most 5 % of the hold's; \
                   contact is where pressure stays above 5 %",
            numbers: vec![
                number("rank correlation", own.rises, "", Limit::AtLeast(CLOSE)),
                number("pressure", own.before, PERCENT, Limit::AtMost(LOW)),
            ],
        },
        Sentence {
            claim: "On rounded objects bending reaches a steady state, correlated with their curvature",
            rule: "Median rate of bending from 0.4 to 0.75 s after contact at most 20 % of that before; rank correlation of the hold's \
                   bending with one over the width at least 0.9",
            numbers: vec![
                number("rate", own.round_rate, PERCENT, Limit::AtMost(STEADY)),
                number("correlation with curvature", own.curvature, "", Limit::AtLeast(CLOSE)),
            ],
        },
        Sentence {
            claim: "On flat objects bending goes on increasing linearly after contact",
            rule: "The same rate at least 25 %, and a line explains 95 % of the variance of bending after contact",
            numbers: vec![
                number("rate", own.flat_rate, PERCENT, Limit::AtLeast(INCREASE)),
                number("R²", own.flat_line, "", Limit::AtLeast(LINEAR)),
            ],
        },
        Sentence {
            claim: "Pressure saturates a few samples after contact and stays steady",
            rule: "Median time from contact to 90 % of the hold's pressure at most 0.2 s, which is 15 samples or two actuation ticks",
            numbers: vec![number("time", own.rise_s, "s", Limit::AtMost(SOON_S))],
        },
        Sentence {
            claim: "Larger objects are touched earlier",
            rule: "Rank correlation of onset with the width across the fingers at most -0.9",
            numbers: vec![number("rank correlation", own.size, "", Limit::AtMost(-CLOSE))],
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
    let said = [
        "It holds for all kinds of grasps.",
        "It holds for some kinds of grasps, or in a part of its numbers.",
        "It holds for no kind of grasps.",
    ];
    for (gripper, about) in abouts {
        let own = measured.iter().filter(|own| own.gripper == gripper);
        let judged: Vec<_> = own.map(|own| (own.kind.as_str(), sentences(&own.summary))).collect();
        let Some((_, first)) = judged.first() else { continue };
        for (at, Sentence { claim, rule, .. }) in first.iter().enumerate() {
            let of_kind = judged.iter().map(|(kind, all)| (*kind, &all[at]));
            let verdict = Agreement::of_all(of_kind.clone().map(|(_, sentence)| sentence.verdict()));
            let numbers =
                of_kind.flat_map(|(kind, own)| own.numbers.iter().filter_map(move |number| number.evidence(kind)));
            findings.push(Claim("V-A", &format!("{claim}{about}"), rule).finding(numbers.collect(), verdict, said));
        }
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sentence_holds_where_all_its_numbers_do() {
        let verdicts = |own: &Summary| sentences(own).map(|sentence| sentence.verdict());
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
