//! Claims of the paper beside our intervals: the rules that decide, and the findings that they give.

use super::report::{Agreement, ClaimNumber, Finding, POINTS};
use palpate_learn::metrics::Interval;
use std::cmp::Ordering;

/// Gains over others, by name.
pub(crate) type Gains = Vec<(String, Interval)>;

/// Rule of a claim over intervals. One interval on the wrong side refutes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Rule {
    /// All above a limit.
    AllAbove(f64),
    /// All below a limit.
    AllBelow(f64),
    /// None below a limit.
    NoneBelow(f64),
    /// All reach into a range.
    Within(f64, f64),
}

impl Rule {
    /// Agreement of intervals with it.
    pub(crate) fn judge(self, all: &[Interval]) -> Agreement {
        let (any, every) =
            (|is: &dyn Fn(&Interval) -> bool| all.iter().any(is), |is: &dyn Fn(&Interval) -> bool| all.iter().all(is));
        let (refuted, supported) = match self {
            Self::AllAbove(limit) => (any(&|own| own.high < limit), every(&|own| own.low > limit)),
            Self::AllBelow(limit) => (any(&|own| own.low > limit), every(&|own| own.high < limit)),
            Self::NoneBelow(limit) => (any(&|own| own.high < limit), true),
            Self::Within(low, high) => (any(&|own| own.low > high || own.high < low), true),
        };
        match (all.is_empty(), refuted, supported) {
            (true, ..) => Agreement::NotMeasured,
            (_, true, _) => Agreement::Disagrees,
            (_, _, true) => Agreement::Agrees,
            _ => Agreement::Partly,
        }
    }

    /// The line on whose sides the verdict differs.
    fn line(self) -> f64 {
        match self {
            Self::AllAbove(limit) | Self::AllBelow(limit) | Self::NoneBelow(limit) => limit,
            Self::Within(low, high) => 0.5 * (low + high),
        }
    }

    /// Orders intervals from those that are most against the claim.
    fn most_against(self, own: &Interval, other: &Interval) -> Ordering {
        match self {
            Self::AllAbove(_) | Self::NoneBelow(_) => own.high.total_cmp(&other.high),
            Self::AllBelow(_) => other.low.total_cmp(&own.low),
            Self::Within(..) => Ordering::Equal,
        }
    }
}

/// Words of a claim: section of the paper, the claim, and the rule.
#[derive(Clone, Copy)]
pub(crate) struct Claim<'a>(pub(crate) &'a str, pub(crate) &'a str, pub(crate) &'a str);

/// The usual rule on gains in words.
pub(crate) const ALL_GAIN: &str = "Agrees where every paired 95 % interval is above zero, disagrees where one is below";

impl Claim<'_> {
    /// Finding of a verdict on numbers, with the sentences of the verdicts: agrees, partly, disagrees.
    pub(crate) fn finding(self, measured: Vec<ClaimNumber>, verdict: Agreement, sentences: [&str; 3]) -> Finding {
        let found = match verdict {
            Agreement::Agrees => sentences[0],
            Agreement::Partly => sentences[1],
            Agreement::Disagrees => sentences[2],
            Agreement::NotMeasured => "Not measured.",
        };
        let [section, claim, found, why] = [self.0, self.1, found, self.2].map(str::to_owned);
        Finding { section, claim, found, measured, verdict, why }
    }

    /// Finding on groups of intervals, each judged by a rule.
    pub(crate) fn on_groups(self, unit: &str, groups: impl IntoIterator<Item = (Rule, Gains)>) -> Finding {
        let (mut measured, mut verdicts) = (Vec::new(), Vec::new());
        for (rule, group) in groups {
            verdicts.push(rule.judge(&group.iter().map(|(_, interval)| *interval).collect::<Vec<_>>()));
            measured.extend(group.into_iter().map(|(what, interval)| (rule, what, interval)));
        }
        if measured.len() > Finding::SHOWN {
            measured.sort_by(|(rule, _, own), (_, _, other)| rule.most_against(own, other));
        }
        let evidence = |(rule, what, interval): (Rule, String, Interval)| {
            ClaimNumber::new(what, Some(interval), unit, rule.line())
        };
        let reaches = matches!(measured.first(), Some((Rule::Within(..), ..)));
        let measured: Vec<ClaimNumber> = measured.into_iter().map(evidence).collect();
        let (sides, verdict) = (sides(&measured), Agreement::of_all(verdicts));
        self.finding(measured, verdict, if reaches { REACHES } else { [&sides; 3] })
    }

    /// Finding on intervals, each judged by a rule.
    pub(crate) fn on_each(self, unit: &str, rule: Rule, all: impl IntoIterator<Item = (String, Interval)>) -> Finding {
        let all: Vec<(String, Interval)> = all.into_iter().collect();
        let apart = if all.len() > 1 { "Each interval is judged by itself: partly where they differ" } else { "" };
        self.apart(apart, |claim| claim.on_groups(unit, all.into_iter().map(|one| (rule, vec![one]))))
    }

    /// Finding on gains of macro F1, all judged together by a rule.
    pub(crate) fn on_all_gains(self, rule: Rule, groups: Vec<(String, Gains)>) -> Finding {
        self.on_groups(POINTS, [(rule, groups.into_iter().flat_map(named_gains).collect())])
    }

    /// Finding on gains of macro F1, each group judged by a rule.
    pub(crate) fn on_gains(self, rule: Rule, groups: Vec<(String, Gains)>) -> Finding {
        let each = "Each kind of grasps and model is judged by itself: partly where they differ";
        let apart = if groups.len() > 1 { each } else { "" };
        self.apart(apart, |claim| claim.on_groups(POINTS, groups.into_iter().map(|group| (rule, named_gains(group)))))
    }

    /// A finding with this beside the rule.
    fn apart(self, how: &str, found: impl FnOnce(Claim<'_>) -> Finding) -> Finding {
        let rule = if how.is_empty() { self.2.to_owned() } else { format!("{}. {how}", self.2) };
        found(Claim(self.0, self.1, &rule))
    }
}

/// Sentences of claims on a number of the paper: agrees, partly, disagrees.
const REACHES: [&str; 3] = [
    "Every interval reaches the paper's number.",
    "Some intervals reach the paper's number, others do not.",
    "No interval reaches the paper's number.",
];

/// On which sides of their lines intervals lie: `3 of 4 intervals lie above the line, 1 on both sides.`
fn sides(measured: &[ClaimNumber]) -> String {
    let side = |own: &ClaimNumber| match own.places() {
        [low, _, _, line] if low > line => 0,
        [.., high, line] if high < line => 1,
        _ => 2,
    };
    let mut counts = [0; 3];
    measured.iter().for_each(|own| counts[side(own)] += 1);
    let places = ["above the line", "below the line", "on both sides of the line"];
    let found: Vec<(usize, &str)> = counts.into_iter().zip(places).filter(|(count, _)| *count > 0).collect();
    match found.as_slice() {
        [(1, place)] => format!("The interval lies {place}."),
        [(all, place)] => format!("All {all} intervals lie {place}."),
        [(count, place), others @ ..] => {
            let lie = if *count == 1 { "lies" } else { "lie" };
            let others =
                others.iter().map(|(count, place)| format!(", {count} {}", place.trim_end_matches(" of the line")));
            let others: String = others.map(|other| other.trim_end_matches(" the line").to_owned()).collect();
            format!("{count} of {} intervals {lie} {place}{others}.", measured.len())
        }
        [] => String::new(),
    }
}

/// Gains of a group, each named with it.
fn named_gains((group, gains): (String, Gains)) -> Gains {
    gains.into_iter().map(|(name, gain)| (format!("{group}: {name}"), gain)).collect()
}

/// The same interval from the other side.
pub(crate) fn negated(Interval { estimate, low, high }: Interval) -> Interval {
    Interval { estimate: -estimate, low: -high, high: -low }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn claims_are_refuted_by_one_interval_and_supported_by_all() {
        let of = |low: f64, high: f64| Interval { estimate: 0.5 * (low + high), low, high };
        let (up, down, open) = (of(0.1, 0.2), of(-0.2, -0.1), of(-0.1, 0.1));
        let rules = [Rule::AllAbove(0.0), Rule::AllBelow(0.0), Rule::NoneBelow(0.0), Rule::Within(0.15, 0.3)];
        let judged = |all: &[Interval]| rules.map(|rule| rule.judge(all));
        use Agreement::{Agrees, Disagrees, NotMeasured, Partly};
        assert_eq!(judged(&[up, up]), [Agrees, Disagrees, Agrees, Agrees]);
        assert_eq!(judged(&[up, open]), [Partly, Disagrees, Agrees, Disagrees]);
        assert_eq!(judged(&[up, down]), [Disagrees, Disagrees, Disagrees, Disagrees]);
        assert_eq!(judged(&[down, open]), [Disagrees, Partly, Disagrees, Disagrees]);
        assert_eq!(judged(&[]), [NotMeasured; 4]);
        let gains = |gains: Vec<Interval>| {
            vec![("virtual".to_owned(), gains.into_iter().map(|own| ("a".to_owned(), own)).collect())]
        };
        let found = Claim("V-D", "better", "rule").on_gains(Rule::AllAbove(0.0), gains(vec![up]));
        assert_eq!((found.measured[0].what.as_str(), found.verdict), ("virtual: a", Agrees));
        assert_eq!(Claim("V-D", "better", "rule").on_gains(Rule::AllAbove(0.0), Vec::new()).verdict, NotMeasured);
        // The sentence counts the intervals, whatever the verdict.
        let said = |gains: &[Interval]| {
            let gains: Gains = gains.iter().map(|own| ("a".to_owned(), *own)).collect();
            let found = Claim("V-B", "enough", "rule").on_each(POINTS, Rule::AllBelow(0.0), gains);
            (found.verdict, found.found, found.why)
        };
        let each = "rule. Each interval is judged by itself: partly where they differ".to_owned();
        let two = "1 of 2 intervals lies above the line, 1 on both sides.".to_owned();
        assert_eq!(said(&[up, open]), (Partly, two, each.clone()));
        let three = "2 of 3 intervals lie above the line, 1 below.".to_owned();
        assert_eq!(said(&[up, down, up]), (Partly, three, each));
        let one = "The interval lies on both sides of the line.".to_owned();
        assert_eq!(said(&[open]), (Partly, one, "rule".to_owned()));
        // Of many the worst come first.
        let many =
            Claim("V-D", "better", "rule").on_gains(Rule::AllAbove(0.0), gains([vec![up; 10], vec![down]].concat()));
        assert_eq!((many.measured[0].value.value(), many.verdict), (Some(down.estimate), Disagrees));
    }

    #[test]
    fn shipped_findings_say_what_their_intervals_show() {
        let mut checked = 0;
        for study in crate::all_studies() {
            let Some(shipped) = study.shipped().expect("it is readable") else { continue };
            for finding in &shipped.stored.result.findings {
                if finding.found.contains("the line") {
                    assert_eq!(finding.found, sides(&finding.measured), "{}", finding.claim);
                    checked += 1;
                }
            }
        }
        assert!(checked > 20, "{checked} checked");
    }
}
