//! Numerical stability: a table of hard cases with limits, run at every accuracy; a table of holds that chatter; and
//! random scenes over wide ranges, each held against the truth, to count silently wrong results.
//!
//! A case is one line in [`CASES`] and one function that measures. Its assertions are data, a measured value and its limit,
//! so that the table can be printed, stored and tested alike.

mod cases;
mod chatter;
mod random;
mod report;
mod study;

pub use cases::CASES;
pub use chatter::{CHATTER_ACCURACIES, ChatterRow, ChatterUnit, chatter_table};
pub use random::{
    ComparedResult, FlagRow, JudgedScene, LevelResult, Policy, PolicyRow, RandomReport, RandomScene, SceneVerdict,
    SilentShareRow,
};

pub(super) use report::sections;
pub use report::{CaseSummary, StabilityReport};
pub(crate) use study::LISTED;
pub use study::{StabilityCell, StabilityPlan, StabilityUnit};

use palpate_sim::physics::NotFinite;
use palpate_sim::scene::{Accuracy, Timing};
use serde::{Deserialize, Serialize};

/// Accuracy or step length of a case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CaseAccuracy {
    /// Accuracy of a scene.
    Accuracy(Accuracy),
    /// Fixed step (s).
    Step(f64),
}

impl CaseAccuracy {
    /// Its name in tables.
    pub fn name(self) -> String {
        match self {
            Self::Accuracy(accuracy) => accuracy.to_string(),
            Self::Step(h) => format!("{} ms", h * 1e3),
        }
    }

    /// Error tolerance of a step; zero for a fixed step.
    pub fn tolerance(self) -> f64 {
        match self {
            Self::Accuracy(accuracy) => accuracy.step_tolerance(),
            Self::Step(_) => 0.0,
        }
    }

    /// Length of a step (s).
    pub fn step(self) -> f64 {
        match self {
            Self::Accuracy(accuracy) => Timing::default().clock(accuracy).step(),
            Self::Step(h) => h,
        }
    }
}

/// Conditions of a measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditions {
    /// Accuracy or step length.
    pub setting: CaseAccuracy,
    /// Every variant and the whole duration; otherwise a few seconds of CPU time.
    pub thorough: bool,
}

/// Largest number of steps of a run, thorough or not: ten minutes at draft.
const MOST_STEPS: [f64; 2] = [9e4, 3e3];

impl Conditions {
    fn h(&self) -> f64 {
        self.setting.step()
    }

    /// Duration (s), shortened to the largest number of steps.
    fn span(&self, seconds: f64) -> f64 {
        seconds.min(MOST_STEPS[usize::from(!self.thorough)] * self.h())
    }

    /// All variants, or the first few.
    fn some_of<'a, T>(&self, all: &'a [T], quick: usize) -> &'a [T] {
        if self.thorough { all } else { &all[..quick.min(all.len())] }
    }
}

/// Accuracies of the table: the named ones, and tolerances between and beyond them. Coarsest first.
pub const ACCURACIES: [Accuracy; 6] = [
    Accuracy::Draft,
    Accuracy::Standard,
    Accuracy::Tolerance(1e-3),
    Accuracy::Tolerance(1e-5),
    Accuracy::Reference,
    Accuracy::Tolerance(1e-7),
];

/// Accuracies of a quick run.
pub const QUICK_ACCURACIES: &[Accuracy] = ACCURACIES.split_at(2).0;

/// Limit of a measured value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Limit {
    /// No larger than this.
    AtMost(f64),
    /// No smaller than this.
    AtLeast(f64),
}

impl Limit {
    /// True if the value is within the limit; NaN never is.
    pub fn holds(self, value: f64) -> bool {
        match self {
            Self::AtMost(limit) => value <= limit,
            Self::AtLeast(limit) => value >= limit,
        }
    }

    /// Used share of the limit; 1 at the limit.
    fn used(self, value: f64) -> f64 {
        match self {
            Self::AtMost(limit) if limit > 0.0 => value / limit,
            Self::AtLeast(limit) if value > 0.0 => limit / value,
            _ => f64::from(u8::from(!self.holds(value))) * 2.0,
        }
    }
}

/// Characters of a limit that is written without an exponent, at most.
const LONGEST_PLAIN: usize = "1.000000001".len();

impl std::fmt::Display for Limit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (sign, limit) = match self {
            Self::AtMost(limit) => ("<=", limit),
            Self::AtLeast(limit) => (">=", limit),
        };
        let plain = limit.to_string();
        if plain.len() <= LONGEST_PLAIN { write!(f, "{sign} {plain}") } else { write!(f, "{sign} {limit:.2e}") }
    }
}

/// Measured value with its limit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measurement {
    /// Name, with its unit in parentheses.
    pub what: String,
    /// Value.
    pub measured: f64,
    pub limit: Limit,
}

impl Measurement {
    fn at_most(what: impl Into<String>, measured: f64, limit: f64) -> Self {
        Self { what: what.into(), measured, limit: Limit::AtMost(limit) }
    }

    fn at_least(what: impl Into<String>, measured: f64, limit: f64) -> Self {
        Self { what: what.into(), measured, limit: Limit::AtLeast(limit) }
    }

    /// True if the value is within its limit.
    pub fn holds(&self) -> bool {
        self.limit.holds(self.measured)
    }
}

/// Accuracies and steps that a case is run at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Settings {
    /// Every accuracy, and further fixed steps (s).
    EveryAccuracyAnd(&'static [f64]),
    /// Once: the result does not depend on the accuracy.
    Once,
}

/// Measurements of a case, or the body whose state is not finite.
pub type Findings = Result<Vec<Measurement>, NotFinite>;

/// A hard case.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Its name in tables.
    pub name: &'static str,
    /// Claim, in a sentence.
    pub claim: &'static str,
    /// Accuracies and steps.
    pub settings: Settings,
    /// Measures.
    pub measure: fn(&Conditions) -> Findings,
}

/// One row of the table: a case at one setting.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CaseRow {
    pub case: String,
    pub claim: String,
    pub setting: String,
    /// All measurements; the one closest to its limit, or beyond it, comes first.
    pub findings: Vec<Measurement>,
    /// Body whose state is not finite; none if all stayed finite.
    pub not_finite: Option<String>,
    /// True when all limits hold.
    pub holds: bool,
}

impl Case {
    /// Settings of the case for the chosen accuracies.
    pub fn settings(&self, accuracies: &[Accuracy], thorough: bool) -> Vec<CaseAccuracy> {
        /// Steps below this are for thorough runs (s).
        const FINE: f64 = 1e-3;
        match self.settings {
            Settings::EveryAccuracyAnd(further) => {
                let further = further.iter().filter(|h| thorough || **h >= FINE);
                let accuracies = accuracies.iter().map(|accuracy| CaseAccuracy::Accuracy(*accuracy));
                accuracies.chain(further.map(|h| CaseAccuracy::Step(*h))).collect()
            }
            Settings::Once => {
                accuracies.first().map(|accuracy| CaseAccuracy::Accuracy(*accuracy)).into_iter().collect()
            }
        }
    }

    /// Runs the case at one setting.
    pub fn run(&self, setting: CaseAccuracy, thorough: bool) -> CaseRow {
        let name = if self.settings == Settings::Once { "any".to_owned() } else { setting.name() };
        let outcome = (self.measure)(&Conditions { setting, thorough });
        let (mut findings, not_finite) = match outcome {
            Ok(findings) => (findings, None),
            Err(NotFinite { body }) => (Vec::new(), Some(body)),
        };
        findings.sort_by(|a, b| b.limit.used(b.measured).total_cmp(&a.limit.used(a.measured)));
        let holds = not_finite.is_none() && findings.iter().all(Measurement::holds);
        CaseRow { case: self.name.to_owned(), claim: self.claim.to_owned(), setting: name, findings, not_finite, holds }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_refuse_nan() {
        assert!(Limit::AtMost(1.0).holds(1.0) && !Limit::AtMost(1.0).holds(1.1) && !Limit::AtMost(1.0).holds(f64::NAN));
        assert!(Limit::AtLeast(1.0).holds(2.0) && !Limit::AtLeast(1.0).holds(f64::NAN));
    }

    #[test]
    fn every_hard_case_holds() {
        for case in CASES {
            for setting in case.settings(QUICK_ACCURACIES, false) {
                let row = case.run(setting, false);
                assert!(row.holds, "{row:#?}");
            }
        }
    }
}
