//! The study: hard cases, holds that chatter and random scenes, as units of work that can be interrupted.

use super::chatter::{ChatterRow, ChatterUnit, chatter_table};
use super::random::{JudgedScene, RandomReport};
use super::{ACCURACIES, CASES, Case, CaseAccuracy, CaseRow, Measurement, QUICK_ACCURACIES};
use crate::study::effects::Measuring;
use crate::study::result_file::{ResultFile, ResultFileError};
use palpate_sim::objects::ObjectError;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Amount of the study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct StabilityPlan {
    /// Every variant of the hard cases, at all accuracies.
    pub thorough: bool,
    /// Grasps of each preset at each accuracy.
    pub grasps: usize,
    /// Random scenes.
    pub scenes: u64,
    /// Seed of the random scenes.
    pub seed: u64,
}

impl StabilityPlan {
    /// The full form: hours of CPU time.
    pub const FULL: Self = Self { thorough: true, grasps: 1000, scenes: 2000, seed: 1 };
    /// The quick form: under a minute.
    pub const QUICK: Self = Self { thorough: false, grasps: 16, scenes: 5, seed: 1 };
}

/// Random scenes in a unit of work.
const SCENES_AT_ONCE: u64 = 5;

/// A piece of the work.
#[derive(Clone, Copy, Debug)]
enum Unit {
    Case(&'static Case, CaseAccuracy),
    Chatter(ChatterUnit),
    /// Scenes from a number on, below another.
    Random(u64, u64),
}

/// Results of a unit.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StabilityUnit {
    /// A hard case at one setting.
    Case(CaseRow),
    /// Grasps of one object in poses of one preset.
    Chatter(Vec<ChatterRow>),
    /// Random scenes.
    Random(Vec<JudgedScene>),
}

/// Error of the study.
#[derive(Debug, thiserror::Error)]
pub enum StabilityError {
    /// An object failed to load.
    #[error(transparent)]
    Object(#[from] ObjectError),
    /// The file of results.
    #[error(transparent)]
    Results(#[from] ResultFileError),
}

/// Results of the study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StabilityReport {
    /// Hard cases over all settings.
    pub cases: Vec<CaseSummary>,
    /// Holds that chatter, by preset and accuracy.
    pub chatter: Vec<ChatterRow>,
    /// Random scenes.
    pub random: RandomReport,
}

/// A hard case over all settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CaseSummary {
    /// The case.
    pub case: String,
    /// Claim.
    pub claim: String,
    /// Settings it was run at.
    pub settings: usize,
    /// Of these, settings at which all its limits hold.
    pub passed: usize,
    /// The value closest to its limit or farthest beyond it, and its setting; absent where all runs diverged.
    pub closest: Option<(String, Measurement)>,
}

impl StabilityPlan {
    /// Opens the results of the plan in a file, to go on where they stopped.
    pub fn results(&self, path: &Path) -> Result<ResultFile<StabilityUnit>, ResultFileError> {
        ResultFile::open(path, "stability", self)
    }

    /// Computes what is missing in the results; true when all is there.
    pub fn run(&self, results: &mut ResultFile<StabilityUnit>, how: &Measuring<'_>) -> Result<bool, StabilityError> {
        results.complete(&self.units(), how, |unit| {
            Ok(Some(match unit {
                Unit::Case(case, setting) => StabilityUnit::Case(case.run(*setting, self.thorough)),
                Unit::Chatter(unit) => StabilityUnit::Chatter(unit.run()?),
                Unit::Random(from, to) => {
                    StabilityUnit::Random((*from..*to).map(|number| JudgedScene::new(self.seed, number)).collect())
                }
            }))
        })
    }

    /// All rows of the hard cases, in the order of the table.
    pub fn case_rows(&self, results: &ResultFile<StabilityUnit>) -> Vec<CaseRow> {
        let row = |name: &String| match results.get(name) {
            Some(StabilityUnit::Case(row)) => Some(row.clone()),
            _ => None,
        };
        self.units().iter().filter_map(|(name, _)| row(name)).collect()
    }

    /// Sums up the results that there are.
    pub fn report(&self, results: &ResultFile<StabilityUnit>) -> StabilityReport {
        let (mut chatter, mut scenes) = (Vec::new(), Vec::new());
        for (name, _) in self.units() {
            match results.get(&name) {
                Some(StabilityUnit::Chatter(rows)) => chatter.extend(rows.iter().cloned()),
                Some(StabilityUnit::Random(judged)) => scenes.extend(judged.iter().cloned()),
                Some(StabilityUnit::Case(_)) | None => {}
            }
        }
        let rows = self.case_rows(results);
        StabilityReport {
            cases: CASES.iter().map(|case| CaseSummary::new(case, &rows)).collect(),
            chatter: chatter_table(chatter),
            random: RandomReport::new(self.seed, &scenes),
        }
    }

    /// Pieces of the work by name.
    fn units(&self) -> Vec<(String, Unit)> {
        let accuracies = if self.thorough { &ACCURACIES[..] } else { QUICK_ACCURACIES };
        let cases = CASES.iter().flat_map(|case| {
            let of = move |setting: CaseAccuracy| {
                (format!("{} at {}", case.name, setting.name()), Unit::Case(case, setting))
            };
            case.settings(accuracies, self.thorough).into_iter().map(of)
        });
        let chatter = ChatterUnit::all(self.grasps).into_iter().map(|unit| (unit.name(), Unit::Chatter(unit)));
        let random = (0..self.scenes).step_by(SCENES_AT_ONCE as usize).map(|from| {
            let to = (from + SCENES_AT_ONCE).min(self.scenes);
            (format!("scenes {from} to {}", to - 1), Unit::Random(from, to))
        });
        cases.chain(chatter).chain(random).collect()
    }
}

impl CaseSummary {
    fn new(case: &Case, rows: &[CaseRow]) -> Self {
        let own: Vec<&CaseRow> = rows.iter().filter(|row| row.case == case.name).collect();
        let closest = own.iter().filter_map(|row| Some((row.setting.clone(), row.findings.first()?.clone())));
        let used = |(_, found): &(String, Measurement)| found.limit.used(found.measured);
        Self {
            case: case.name.to_owned(),
            claim: case.claim.to_owned(),
            settings: own.len(),
            passed: own.iter().filter(|row| row.holds).count(),
            closest: closest.max_by(|a, b| used(a).total_cmp(&used(b))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::sync::atomic::AtomicBool;

    #[test]
    fn units_have_names_of_their_own_and_cover_the_plan() {
        for plan in [StabilityPlan::QUICK, StabilityPlan::FULL] {
            let units = plan.units();
            let names: BTreeSet<&String> = units.iter().map(|(name, _)| name).collect();
            assert_eq!(names.len(), units.len());
            let scenes: u64 =
                units.iter().map(|(_, unit)| if let Unit::Random(from, to) = unit { to - from } else { 0 }).sum();
            assert_eq!(scenes, plan.scenes);
        }
    }

    #[test]
    fn a_study_that_was_stopped_comes_to_the_same_report() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("stability.jsonl");
        let plan = StabilityPlan { thorough: false, grasps: 1, scenes: 3, seed: 2 };
        let run = |stop_after: usize, threads: usize| {
            let mut results = plan.results(&path)?;
            let cancelled = AtomicBool::new(false);
            let progress = |done: usize, _: usize| {
                cancelled.fetch_or(done >= stop_after, std::sync::atomic::Ordering::Relaxed);
            };
            let how = Measuring { threads, cancelled: &cancelled, progress: &progress };
            let whole = plan.run(&mut results, &how)?;
            Ok::<_, StabilityError>((whole, plan.report(&results)))
        };
        let units = plan.units().len();
        let (whole, partial) = run(units - 1, 1)?;
        assert!(!whole && partial.random.scenes == 0 && partial.chatter.len() == 8, "{partial:?}");
        let (whole, resumed) = run(usize::MAX, 2)?;
        assert!(whole && resumed.random.scenes == 3);
        std::fs::remove_file(&path)?;
        let (_, mut at_once) = run(usize::MAX, 2)?;
        // Only CPU times differ.
        at_once.random.cpu_s = resumed.random.cpu_s;
        for (row, other) in at_once.chatter.iter_mut().zip(&resumed.chatter) {
            row.cpu_s = other.cpu_s;
        }
        assert_eq!(at_once, resumed);
        assert!(resumed.cases.iter().all(|case| case.settings > 0 && case.passed <= case.settings));
        assert_eq!(resumed.chatter.iter().map(|row| row.grasps).collect::<Vec<_>>(), [1; 8]);
        Ok(())
    }
}
