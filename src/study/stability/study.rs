//! The study: hard cases, holds that chatter and random scenes, as units of work that can be interrupted.

use super::chatter::{ChatterRow, ChatterUnit, chatter_table};
use super::random::{JudgedScene, RandomReport};
use super::report::{CaseSummary, StabilityReport};
use super::{ACCURACIES, CASES, Case, CaseAccuracy, CaseRow, QUICK_ACCURACIES};
use crate::frame::{
    Experiment, LinkedFigure, OWN_PHYSICS, PlainStudy, StudyCard, StudyCell, StudyCommand, StudyError, StudyReport,
    StudySize,
};
use serde::{Deserialize, Serialize};
use std::sync::atomic::AtomicBool;

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
    pub const FULL: Self = Self { thorough: true, grasps: 1000, scenes: 4000, seed: 2 };
    /// The quick form: under a minute.
    pub const QUICK: Self = Self { thorough: false, grasps: 16, scenes: 5, seed: 1 };
}

/// The study in the list.
pub(crate) const LISTED: PlainStudy<StabilityPlan> = PlainStudy {
    card: StudyCard {
        key: "stability",
        title: "Stability",
        about: "hard cases of the simulation with their limits, holds that chatter, and how many random scenes end wrongly without a flag",
        paper: OWN_PHYSICS,
    },
    of_size: |size| {
        Ok(match size {
            StudySize::Full => StabilityPlan::FULL,
            StudySize::Quick | StudySize::Sample { .. } => StabilityPlan::QUICK,
        })
    },
};

/// Random scenes in a unit of work.
const SCENES_AT_ONCE: u64 = 5;

/// A piece of the work.
#[derive(Clone, Copy, Debug)]
pub enum StabilityCell {
    /// A hard case at one setting.
    Case(&'static Case, CaseAccuracy),
    /// Grasps of one object in poses of one preset.
    Chatter(ChatterUnit),
    /// Random scenes from a number on, below another.
    Random(u64, u64),
}

impl StudyCell for StabilityCell {
    fn name(&self) -> String {
        match self {
            Self::Case(case, setting) => format!("{} at {}", case.name, setting.name()),
            Self::Chatter(unit) => unit.name(),
            Self::Random(from, to) => format!("scenes {from} to {}", to - 1),
        }
    }
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

impl Experiment for StabilityPlan {
    type Cell = StabilityCell;
    type Found = StabilityUnit;
    type Report = StabilityReport;

    fn key(&self) -> &'static str {
        LISTED.card.key
    }

    fn header(&self) -> serde_json::Value {
        serde_json::json!(self)
    }

    fn command(&self) -> StudyCommand {
        let usual = if self.thorough { Self::FULL } else { Self::QUICK };
        StudyCommand::new(self.key())
            .flag("quick", !self.thorough)
            .option("scenes", (self.scenes != usual.scenes).then_some(self.scenes))
            .option("grasps", (self.grasps != usual.grasps).then_some(self.grasps))
            .option("seed", (self.seed != usual.seed).then_some(self.seed))
    }

    fn grid(&self) -> Vec<StabilityCell> {
        let accuracies = if self.thorough { &ACCURACIES[..] } else { QUICK_ACCURACIES };
        let cases = CASES.iter().flat_map(|case| {
            let settings = case.settings(accuracies, self.thorough).into_iter();
            settings.map(move |setting| StabilityCell::Case(case, setting))
        });
        let chatter = ChatterUnit::all(self.grasps).into_iter().map(StabilityCell::Chatter);
        let random = (0..self.scenes).step_by(SCENES_AT_ONCE as usize);
        let random = random.map(|from| StabilityCell::Random(from, (from + SCENES_AT_ONCE).min(self.scenes)));
        cases.chain(chatter).chain(random).collect()
    }

    fn measure(&self, cell: &StabilityCell, _stop: &AtomicBool) -> Result<StabilityUnit, StudyError> {
        Ok(match cell {
            StabilityCell::Case(case, setting) => StabilityUnit::Case(case.run(*setting, self.thorough)),
            StabilityCell::Chatter(unit) => StabilityUnit::Chatter(unit.run()?),
            StabilityCell::Random(from, to) => {
                StabilityUnit::Random((*from..*to).map(|number| JudgedScene::new(self.seed, number)).collect())
            }
        })
    }

    fn report(&self, found: Vec<(StabilityCell, StabilityUnit)>) -> StabilityReport {
        let (mut table, mut chatter, mut scenes) = (Vec::new(), Vec::new(), Vec::new());
        for (_, found) in found {
            match found {
                StabilityUnit::Case(row) => table.push(row),
                StabilityUnit::Chatter(rows) => chatter.extend(rows),
                StabilityUnit::Random(judged) => scenes.extend(judged),
            }
        }
        StabilityReport {
            cases: CASES.iter().map(|case| CaseSummary::new(case, &table)).collect(),
            chatter: chatter_table(chatter),
            random: RandomReport::new(self.seed, &scenes),
            table,
        }
    }

    fn shown(report: &StabilityReport) -> StudyReport {
        report.shown()
    }

    fn figures(report: &StabilityReport) -> Vec<LinkedFigure> {
        vec![report.figure()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{Measuring, StudyOutcome, StudyProgress, run_experiment};
    use palpate_lab::grasping::Shard;
    use std::collections::BTreeSet;
    use std::sync::atomic::Ordering;

    #[test]
    fn units_have_names_of_their_own_and_cover_the_plan() {
        for plan in [StabilityPlan::QUICK, StabilityPlan::FULL] {
            let cells = plan.grid();
            let names: BTreeSet<String> = cells.iter().map(StudyCell::name).collect();
            assert_eq!(names.len(), cells.len());
            let scenes = |cell: &StabilityCell| if let StabilityCell::Random(from, to) = cell { to - from } else { 0 };
            assert_eq!(cells.iter().map(scenes).sum::<u64>(), plan.scenes);
        }
    }

    #[test]
    fn a_study_that_was_stopped_comes_to_the_same_report() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("stability.jsonl");
        let plan = StabilityPlan { thorough: false, grasps: 1, scenes: 3, seed: 2 };
        let run = |stop_after: usize, threads: usize| {
            let cancelled = AtomicBool::new(false);
            let progress = |own: StudyProgress| {
                cancelled.fetch_or(own.done >= stop_after, Ordering::Relaxed);
            };
            let how = Measuring { threads, cancelled: &cancelled, progress: &progress };
            run_experiment(&plan, &how, Some(&path), Shard::WHOLE).map(StudyOutcome::whole)
        };
        assert!(run(plan.grid().len() - 1, 1)?.is_none());
        let resumed = run(usize::MAX, 2)?.ok_or("stopped")?.result;
        assert_eq!(resumed.random.scenes, 3);
        std::fs::remove_file(&path)?;
        let mut at_once = run(usize::MAX, 2)?.ok_or("stopped")?.result;
        // Only CPU times differ.
        at_once.random.cpu_s = resumed.random.cpu_s;
        for (row, other) in at_once.chatter.iter_mut().zip(&resumed.chatter) {
            row.cpu_s = other.cpu_s;
        }
        assert_eq!(at_once, resumed);
        assert!(resumed.cases.iter().all(|case| case.settings > 0 && case.passed <= case.settings));
        assert_eq!(resumed.chatter.iter().map(|row| row.grasps).collect::<Vec<_>>(), [1; 8]);
        let shown = StabilityPlan::shown(&resumed);
        assert!(shown.tables.iter().all(|table| !table.rows.is_empty()), "{shown:?}");
        Ok(())
    }
}
