//! Pools of several kinds of models by name, and the findings that compare them.

use super::UnitResult;
use super::answers::{Judged, PairedDifference, Pool};
use super::bench::StudyError;
use super::report::{Agreement, Finding};
use palpate_learn::metrics::{Interval, holm};
use std::collections::BTreeMap;

/// Answers of several kinds of models, in the order in which they came.
#[derive(Default)]
pub(super) struct Pools<K> {
    kinds: Vec<(K, Vec<Judged>)>,
    /// Descriptions of the data, each once.
    pub(super) data: Vec<String>,
}

impl<K: PartialEq> Pools<K> {
    /// Adds the answers of a unit to its kind, where the unit is finished.
    pub(super) fn add(&mut self, kind: K, units: &BTreeMap<String, UnitResult>, unit: &str) -> Result<(), StudyError> {
        let Some(result) = units.get(unit) else { return Ok(()) };
        let judged: Judged = result.read()?;
        self.push(kind, judged);
        Ok(())
    }

    /// Adds answers to their kind.
    pub(super) fn push(&mut self, kind: K, judged: Judged) {
        if let Some(answers) = judged.answers() {
            add_new(&mut self.data, &answers.data);
        }
        match self.kinds.iter_mut().find(|(own, _)| *own == kind) {
            Some((_, parts)) => parts.push(judged),
            None => self.kinds.push((kind, vec![judged])),
        }
    }

    /// The kinds with their pooled answers.
    pub(super) fn pooled(&self) -> Vec<(&K, Pool)> {
        let pool = |parts: &[Judged]| Pool::of(parts.iter().filter_map(Judged::answers));
        self.kinds.iter().map(|(kind, parts)| (kind, pool(parts))).collect()
    }

    /// The kinds with the answers of each part.
    pub(super) fn parts(&self) -> impl Iterator<Item = (&K, &[Judged])> {
        self.kinds.iter().map(|(kind, parts)| (kind, parts.as_slice()))
    }
}

/// Adds a text once.
pub(super) fn add_new(known: &mut Vec<String>, text: &str) {
    if !known.iter().any(|own| own == text) {
        known.push(text.to_owned());
    }
}

/// p-values of paired differences with Holm's correction, in their places.
pub(super) fn adjusted(differences: &[Option<PairedDifference>]) -> Vec<Option<f64>> {
    let known: Vec<f64> = differences.iter().flatten().map(|difference| difference.p).collect();
    let mut corrected = holm(&known).into_iter();
    differences.iter().map(|difference| difference.and_then(|_| corrected.next())).collect()
}

/// Gains over others, by name.
pub(super) type Gains = Vec<(String, Interval)>;

/// Agreement with a claim to be better than all others: an interval below zero refutes it.
pub(super) fn better_than_each(gains: &[(String, Interval)]) -> Agreement {
    match gains {
        [] => Agreement::NotMeasured,
        _ if gains.iter().any(|(_, gain)| gain.high < 0.0) => Agreement::Disagrees,
        _ if gains.iter().all(|(_, gain)| gain.low > 0.0) => Agreement::Agrees,
        _ => Agreement::Partly,
    }
}

/// Agreement with a claim to be as good as all others: an interval below zero refutes it.
pub(super) fn no_worse_than_any(gains: &[(String, Interval)]) -> Agreement {
    match gains {
        [] => Agreement::NotMeasured,
        _ if gains.iter().any(|(_, gain)| gain.high < 0.0) => Agreement::Disagrees,
        _ => Agreement::Agrees,
    }
}

/// The same interval from the other side.
pub(super) fn negated(Interval { estimate, low, high }: Interval) -> Interval {
    Interval { estimate: -estimate, low: -high, high: -low }
}

/// An interval in percent.
pub(super) fn percent(Interval { estimate, low, high }: Interval) -> String {
    let [estimate, low, high] = [estimate, low, high].map(|share| format!("{:.1}", 100.0 * share));
    format!("{estimate} % ({low} to {high})")
}

/// A difference in points.
pub(super) fn points(Interval { estimate, low, high }: Interval) -> String {
    let [estimate, low, high] = [estimate, low, high].map(|share| format!("{:+.1}", 100.0 * share));
    format!("{estimate} ({low} to {high})")
}

/// Finding on gains in several kinds of data, each judged by a rule.
pub(super) fn finding_on_gains(
    (section, claim, why): (&str, &str, &str),
    kinds: &[(String, Gains)],
    rule: fn(&[(String, Interval)]) -> Agreement,
) -> Finding {
    let measured: Vec<&(String, Gains)> = kinds.iter().filter(|(_, gains)| !gains.is_empty()).collect();
    let described = measured.iter().map(|(kind, gains)| {
        let listed: Vec<String> = gains.iter().map(|(name, gain)| format!("{name} {}", points(*gain))).collect();
        format!("{kind}: {}", listed.join(", "))
    });
    let found = match measured.is_empty() {
        true => "not measured".to_owned(),
        false => format!("points of macro F1; {}", described.collect::<Vec<_>>().join("; ")),
    };
    finding((section, claim, why), found, Agreement::of_all(measured.iter().map(|(_, gains)| rule(gains))))
}

/// A finding.
pub(super) fn finding((section, claim, why): (&str, &str, &str), found: String, verdict: Agreement) -> Finding {
    Finding { section: section.to_owned(), claim: claim.to_owned(), found, verdict, why: why.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn claims_are_refuted_by_one_interval_and_supported_by_all() {
        let gain = |low: f64, high: f64| (String::new(), Interval { estimate: 0.5 * (low + high), low, high });
        let (up, down, open) = (gain(0.1, 0.2), gain(-0.2, -0.1), gain(-0.1, 0.1));
        let judged = |gains: &[(String, Interval)]| [better_than_each(gains), no_worse_than_any(gains)];
        assert_eq!(judged(&[up.clone(), up.clone()]), [Agreement::Agrees, Agreement::Agrees]);
        assert_eq!(judged(&[up.clone(), open]), [Agreement::Partly, Agreement::Agrees]);
        assert_eq!(judged(&[up.clone(), down]), [Agreement::Disagrees, Agreement::Disagrees]);
        let rule = ("V-D", "better", "rule");
        let found = finding_on_gains(rule, &[("virtual".to_owned(), vec![up])], better_than_each);
        assert!(found.found.contains("virtual:  +15.0 (+10.0 to +20.0)"), "{}", found.found);
        assert_eq!(finding_on_gains(rule, &[], better_than_each).verdict, Agreement::NotMeasured);
    }
}
