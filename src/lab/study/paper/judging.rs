//! Claims of the paper beside our intervals: the rules that decide, and the findings that they give.

use super::report::{Agreement, Finding};
use super::rows::Gains;
use palpate_learn::metrics::Interval;

/// Rule of a claim over intervals. One interval on the wrong side refutes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Rule {
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
    pub(super) fn judge(self, all: &[Interval]) -> Agreement {
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

    /// Agreement of one interval with it.
    pub(super) fn judge_one(self, one: Interval) -> Agreement {
        self.judge(&[one])
    }
}

/// Words of a claim: section of the paper, the claim, and the rule.
#[derive(Clone, Copy)]
pub(super) struct Claim<'a>(pub(super) &'a str, pub(super) &'a str, pub(super) &'a str);

/// The usual rule on gains in words.
pub(super) const ALL_GAIN: &str = "Agrees where every paired 95 % interval is above zero, disagrees where one is below";

impl Claim<'_> {
    /// Finding of a verdict.
    pub(super) fn finding(self, found: String, verdict: Agreement) -> Finding {
        let [section, claim, why] = [self.0, self.1, self.2].map(str::to_owned);
        Finding { section, claim, found, verdict, why }
    }

    /// Finding of several sentences, each with its verdict.
    pub(super) fn of_each(self, prefix: &str, parts: impl IntoIterator<Item = (String, Agreement)>) -> Finding {
        let (found, verdicts): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
        self.finding(format!("{prefix}{}", found.join("; ")), Agreement::of_all(verdicts))
    }

    /// Finding on gains of macro F1, each group judged by a rule.
    pub(super) fn on_gains(self, groups: &[(String, Gains)], rule: Rule) -> Finding {
        if groups.is_empty() {
            return self.finding("not measured".to_owned(), Agreement::NotMeasured);
        }
        let group = |(group, gains): &(String, Gains)| {
            let listed: Vec<String> = gains.iter().map(|(name, gain)| format!("{name} {}", points(*gain))).collect();
            let intervals: Vec<Interval> = gains.iter().map(|(_, gain)| *gain).collect();
            (format!("{group}: {}", listed.join(", ")), rule.judge(&intervals))
        };
        self.of_each("points of macro F1; ", groups.iter().map(group))
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
        let found = Claim("V-D", "better", "rule")
            .on_gains(&[("virtual".to_owned(), vec![(String::new(), up)])], Rule::AllAbove(0.0));
        assert!(found.found.contains("virtual:  +15.0 (+10.0 to +20.0)"), "{}", found.found);
        assert_eq!(Claim("V-D", "better", "rule").on_gains(&[], Rule::AllAbove(0.0)).verdict, NotMeasured);
    }
}
