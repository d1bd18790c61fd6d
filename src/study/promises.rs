//! The program's three promises in numbers, beside those of the version before: what accuracy costs, hard cases that stay
//! stable, and effects that a scene needs. They come from the results of three studies, `accuracy`, `stability` and
//! `effects`, so that nothing is measured here.

use crate::accuracy::{AccuracyStudy, SceneGroup, SettingFamily, Spread};
use crate::effects::AuditReport;
use crate::frame::{
    Cell, Column, GeneratedSection, PERCENT, StoredStudy, StudyError, StudyFolder, StudyTable, TableRows, unique,
};
use crate::stability::{Policy, StabilityReport};
use palpate_learn::metrics::Interval;
use palpate_sim::scene::Accuracy;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// Numbers of the version before, as `palpate study promises --json` of that version prints them.
const BEFORE: &str = include_str!("../../assets/studies/promises_before.json");

/// Numbers of a version.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Promises {
    /// Versions of the program and of its physics that measured them.
    pub program: String,
    pub numbers: Vec<PromiseNumber>,
}

/// A number behind a promise; less is better.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PromiseNumber {
    pub promise: Promise,
    /// What is measured.
    pub what: String,
    pub unit: String,
    /// A number, or a share with its 95 % interval.
    pub value: Cell,
}

/// A promise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Promise {
    /// What accuracy costs in time.
    Cost,
    /// Hard cases stay numerically stable.
    Stability,
    /// Only the effects that a scene needs.
    Effects,
}

impl Promise {
    /// Name in tables.
    fn title(self) -> &'static str {
        match self {
            Self::Cost => "cost of accuracy",
            Self::Stability => "stability",
            Self::Effects => "effects",
        }
    }
}

/// Unit of CPU time: those of two versions may come from two machines.
const CPU_MS: &str = "CPU ms";
/// Most that a number without an interval may grow: CPU time, other measured values, and counts.
const GROWTH: [f64; 3] = [1.5, 1.25, 1.0];
/// Accuracies that are compared.
const ACCURACIES: [Accuracy; 3] = [Accuracy::Draft, Accuracy::Standard, Accuracy::Tolerance(1e-5)];

/// Numbers that became worse on purpose since the version before, each with the reason.
const ACCEPTED: &[(&str, &str)] = &[(
    "error of force at `draft`, fixed object",
    "since physics 2 contact forces come from one energy, which made all hard cases pass and costs accuracy at `draft`",
)];

impl PromiseNumber {
    fn new(promise: Promise, what: impl Into<String>, unit: &str, value: impl Into<Cell>) -> Self {
        Self { promise, what: what.into(), unit: unit.to_owned(), value: value.into() }
    }

    /// Why it is accepted that it became worse.
    fn reason(&self) -> Option<&'static str> {
        ACCEPTED.iter().find(|(what, _)| *what == self.what).map(|(_, reason)| *reason)
    }

    /// True where it is surely larger than before: a share beyond both intervals, another number by more than it may grow.
    fn is_worse_than(&self, before: &Cell) -> bool {
        if let (Some([low, _]), Some([_, high])) = (self.value.spread(), before.spread()) {
            return low > high;
        }
        let growth = match self.unit.as_str() {
            CPU_MS => GROWTH[0],
            "" => GROWTH[2],
            _ => GROWTH[1],
        };
        matches!((self.value.value(), before.value()), (Some(now), Some(before)) if now > growth * before)
    }
}

impl Promises {
    /// The version before this one.
    pub fn before() -> Result<Self, serde_json::Error> {
        serde_json::from_str(BEFORE)
    }

    /// This version: from the results of full runs in a folder, or from those that come with the program.
    pub fn now(folder: Option<&StudyFolder>) -> Result<Self, StudyError> {
        let accuracy: StoredStudy<AccuracyStudy> = result(folder, "accuracy")?;
        let stability: StoredStudy<StabilityReport> = result(folder, "stability")?;
        let effects: StoredStudy<AuditReport> = result(folder, "effects")?;
        let programs = unique([accuracy.program, stability.program, effects.program]);
        let mut numbers = costs(&accuracy.result);
        numbers.extend(stable(&stability.result));
        numbers.extend(needed(&effects.result));
        Ok(Self { program: programs.join(" and "), numbers })
    }

    fn value_of(&self, number: &PromiseNumber) -> Option<&Cell> {
        let same = |own: &&PromiseNumber| own.promise == number.promise && own.what == number.what;
        self.numbers.iter().find(same).map(|own| &own.value)
    }

    /// Numbers that are worse than before.
    fn worse_than<'a>(&'a self, before: &Self) -> impl Iterator<Item = &'a PromiseNumber> {
        self.numbers.iter().filter(|own| before.value_of(own).is_some_and(|value| own.is_worse_than(value)))
    }

    /// Names of the numbers that are worse than before without a stated reason.
    pub fn broken(&self, before: &Self) -> Vec<&str> {
        self.worse_than(before).filter(|own| own.reason().is_none()).map(|own| own.what.as_str()).collect()
    }

    /// Why numbers became worse: a line for each that is accepted.
    pub fn reasons(&self, before: &Self) -> Vec<String> {
        self.worse_than(before).filter_map(|own| Some(format!("Accepted: {}: {}.", own.what, own.reason()?))).collect()
    }

    /// The numbers beside those of before.
    pub fn table(&self, before: &Self) -> StudyTable {
        let shown = |value: &Cell, unit: &str| Cell::from(value.shown(unit));
        TableRows::new("promises", "Three promises in numbers; less is better", &self.numbers).columns(&[
            Column("promise", "", &|own| own.promise.title().into()),
            Column("measured", "", &|own| own.what.as_str().into()),
            Column("unit", "", &|own| own.unit.as_str().into()),
            Column("before", "", &|own| before.value_of(own).map_or(Cell::Missing, |value| shown(value, &own.unit))),
            Column("now", "", &|own| shown(&own.value, &own.unit)),
            Column("verdict", "", &|own| match before.value_of(own) {
                None => "new".into(),
                Some(value) if own.is_worse_than(value) => own.reason().map_or("worse", |_| "accepted").into(),
                Some(_) => "kept".into(),
            }),
        ])
    }
}

/// A study's result in a folder, or the one that comes with the program.
fn result<R: Serialize + DeserializeOwned>(
    folder: Option<&StudyFolder>,
    key: &str,
) -> Result<StoredStudy<R>, StudyError> {
    let Some(folder) = folder else {
        let shipped = StoredStudy::shipped(key).map_err(StudyError::missing)?;
        return shipped.ok_or_else(|| StudyError::missing(key));
    };
    let path = folder.path().display();
    folder.read(key)?.ok_or_else(|| {
        StudyError::missing(format!("\"{path}/{key}.json\"; `palpate study {key} --out {path}` writes it"))
    })
}

/// The page of the manual that is written from the results that come with the program.
pub(crate) fn section() -> Result<GeneratedSection, serde_json::Error> {
    let (now, before) = (Promises::now(None).map_err(serde::ser::Error::custom)?, Promises::before()?);
    let table = now.table(&before).markdown();
    let reasons = now.reasons(&before).join("\n");
    let text = format!("Before: {}. Now: {}.\n\n{table}\n\n{reasons}", before.program, now.program);
    Ok(GeneratedSection { document: "assets/help/promises.md", name: "promises", text })
}

fn costs(study: &AccuracyStudy) -> Vec<PromiseNumber> {
    let mut numbers = Vec::new();
    for group in [SceneGroup::Free, SceneGroup::Fixed] {
        for accuracy in ACCURACIES.map(|own| own.to_string()) {
            let row = study
                .rows
                .iter()
                .find(|row| row.setting.family == SettingFamily::Tolerance && row.setting.name == accuracy);
            let cost = row.and_then(|row| row.groups.iter().find(|own| own.group == group));
            let Some(cost) = cost else { continue };
            let mut add = |what: &str, unit: &str, spread: Spread| {
                let what = format!("{what} at `{accuracy}`, {} object", group.title());
                numbers.push(PromiseNumber::new(Promise::Cost, what, unit, Some(spread.median)));
            };
            add("time of a grasp", CPU_MS, cost.cpu_ms);
            add("error of curvature", "1/m", cost.curvature_per_m);
            add("error of force", "N", cost.force_n);
        }
    }
    numbers
}

fn stable(study: &StabilityReport) -> Vec<PromiseNumber> {
    let count = |what: &str, count: usize| PromiseNumber::new(Promise::Stability, what, "", count);
    let random = &study.random;
    let mut numbers = vec![
        count(
            "hard cases at an accuracy that break their limit",
            study.cases.iter().map(|own| own.settings - own.passed).sum(),
        ),
        count(
            "stored holds of ordinary objects that chatter",
            study.chatter.iter().map(|own| own.chattering_stored).sum(),
        ),
        count("holds computed again because they were restless", study.chatter.iter().map(|own| own.recomputed).sum()),
        count("random scenes with a number that is not finite", random.non_finite),
        count("steps of random scenes that did not converge", random.unconverged_steps as usize),
    ];
    let policies = [
        (Policy::Flags, "a single run"),
        (Policy::Compared, "a green trust light"),
        (Policy::ThreeAgree, "refinement until three levels agree"),
    ];
    for (policy, what) in policies {
        let Some(row) = random.policy(&Accuracy::Standard.to_string(), policy) else { continue };
        let share = PromiseNumber::new(
            Promise::Stability,
            format!("random scenes wrong in silence after {what}"),
            PERCENT,
            Some(row.silent_share),
        );
        let cost = PromiseNumber::new(Promise::Stability, format!("cost of {what}"), "runs", Some(row.cost));
        numbers.extend([share, cost]);
    }
    numbers
}

fn needed(audit: &AuditReport) -> Vec<PromiseNumber> {
    let sum = |count: fn(&crate::effects::AuditRow) -> usize| audit.effects.iter().map(count).sum::<usize>();
    let share = |what: &str, count: usize, of: usize| {
        PromiseNumber::new(Promise::Effects, what, PERCENT, Some(Interval::of_share(count, of)))
    };
    vec![
        share("random scenes in which `auto` leaves out what is seen", audit.missed, audit.scenes),
        share("effects left out that are seen, each alone", sum(|own| own.missed), sum(|own| own.off)),
        share("effects that are on and not seen", sum(|own| own.needless), sum(|own| own.on)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_of_this_version_is_worse_than_before() -> Result<(), Box<dyn std::error::Error>> {
        let (now, before) = (Promises::now(None)?, Promises::before()?);
        assert_eq!(now.broken(&before), Vec::<&str>::new());
        assert_eq!(now.reasons(&before).len(), ACCEPTED.len(), "a reason that nothing needs");
        assert!(now.numbers.iter().filter(|own| before.value_of(own).is_some()).count() > 25);
        Ok(())
    }

    #[test]
    fn counts_may_not_grow_and_shares_not_beyond_their_intervals() {
        let number = |unit: &str, value: Cell| PromiseNumber::new(Promise::Cost, "x", unit, value);
        let share = |count| Cell::Interval(Interval::of_share(count, 500));
        for (unit, before, now, worse) in [
            ("", Cell::Number(0.0), Cell::Number(1.0), true),
            ("", Cell::Number(1.0), Cell::Number(1.0), false),
            ("N", Cell::Number(1.0), Cell::Number(1.2), false),
            ("N", Cell::Number(1.0), Cell::Number(1.3), true),
            (CPU_MS, Cell::Number(1.0), Cell::Number(1.3), false),
            (CPU_MS, Cell::Number(1.0), Cell::Number(1.6), true),
            (PERCENT, share(10), share(15), false),
            (PERCENT, share(10), share(40), true),
        ] {
            assert_eq!(number(unit, now.clone()).is_worse_than(&before), worse, "{unit} {before:?} {now:?}");
        }
    }
}
