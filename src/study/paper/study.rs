//! A study of the paper: an experiment on grasps of a store.

use super::bench::StudyData;
use super::plan::StudyPlan;
use crate::frame::{
    Draw, Experiment, LinkedFigure, ListedStudy, Measuring, ResultFileError, ShownStudy, StoredStudy, StudyCard,
    StudyCell, StudyCommand, StudyError, StudyFolder, StudyOutcome, StudyReport, StudySize, TrialNumbers, finish,
    run_experiment,
};
use palpate_lab::datasets::DatasetError;
use palpate_lab::grasping::Shard;
use palpate_store::Store;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// A study as data.
pub(super) trait Study: Sync {
    /// Cell of the grid.
    type Cell: StudyCell;
    /// What is found in a cell, as stored.
    type Found: Clone + Serialize + DeserializeOwned + Send + Sync;

    /// Name and purpose.
    const CARD: StudyCard;

    /// The grid, in the order of work: cells of the same data set follow each other.
    fn grid(plan: &StudyPlan) -> Vec<Self::Cell>;

    /// Computes a cell.
    fn measure(cell: &Self::Cell, bench: &StudyData<'_>) -> Result<Self::Found, StudyError>;

    /// Tables and findings from all cells, in the order of the grid.
    fn report(plan: &StudyPlan, found: Vec<(Self::Cell, Self::Found)>) -> StudyReport;

    /// Figures, drawn from the tables; none of a table that the report lacks.
    fn figures(report: &StudyReport) -> Vec<Option<LinkedFigure>>;
}

/// A study on a bench.
struct OnBench<'a, S> {
    study: &'a S,
    bench: &'a StudyData<'a>,
}

impl<S: Study> Experiment for OnBench<'_, S> {
    type Cell = S::Cell;
    type Found = S::Found;
    type Report = StudyReport;

    fn key(&self) -> &'static str {
        S::CARD.key
    }

    fn header(&self) -> serde_json::Value {
        self.bench.plan().header()
    }

    fn command(&self) -> StudyCommand {
        self.bench.plan().command(self.key())
    }

    fn grid(&self) -> Vec<S::Cell> {
        S::grid(self.bench.plan())
    }

    fn measure(&self, cell: &S::Cell, _stop: &AtomicBool) -> Result<S::Found, StudyError> {
        S::measure(cell, self.bench)
    }

    fn trials(&self) -> TrialNumbers {
        self.bench.trials()
    }

    fn report(&self, found: Vec<(S::Cell, S::Found)>) -> StudyReport {
        let plan = self.bench.plan();
        let mut report = StudyReport { fingerprint: study_fingerprint(self.study, plan), ..S::report(plan, found) };
        report.data.extend(self.bench.leaks());
        report
    }

    fn shown(report: &StudyReport) -> StudyReport {
        report.clone()
    }

    fn figures(report: &StudyReport) -> Vec<LinkedFigure> {
        S::figures(report).into_iter().flatten().collect()
    }
}

/// A study of the paper, whatever its cells are.
pub trait PaperStudy: ListedStudy {
    /// Names of the results of all cells.
    fn units(&self, plan: &StudyPlan) -> Vec<String>;

    /// Computes the cells of a part that a file of results lacks, then the result of the whole.
    fn run(
        &self,
        bench: &StudyData<'_>,
        file: Option<&Path>,
        shard: Shard,
    ) -> Result<StudyOutcome<StudyReport>, StudyError>;

    /// Figures, drawn from the tables.
    fn figures(&self, report: &StudyReport) -> Vec<LinkedFigure>;
}

impl<S: Study> ListedStudy for S {
    fn card(&self) -> StudyCard {
        S::CARD
    }

    fn shipped(&self) -> Result<Option<ShownStudy>, serde_json::Error> {
        Ok(StoredStudy::shipped(S::CARD.key)?.map(ShownStudy::new::<OnBench<'_, S>>))
    }

    fn read(&self, folder: &StudyFolder) -> Result<Option<ShownStudy>, ResultFileError> {
        Ok(folder.read(S::CARD.key)?.map(ShownStudy::new::<OnBench<'_, S>>))
    }

    fn is_current(&self, result: &StudyReport, size: StudySize) -> bool {
        is_current(result, self, &StudyPlan::of_size(size))
    }

    fn finish(&self, store: &Path, size: StudySize, how: Measuring<'_>, draw: Draw<'_>) -> Result<bool, StudyError> {
        let (store, folder, plan) =
            (Store::open(store).map_err(DatasetError::Store)?, size.folder(store), StudyPlan::of_size(size));
        let bench = StudyData::new(store, &plan, how);
        finish(&OnBench { study: self, bench: &bench }, &folder, &how, draw)
    }
}

impl<S: Study> PaperStudy for S {
    fn units(&self, plan: &StudyPlan) -> Vec<String> {
        S::grid(plan).iter().map(StudyCell::stored_name).collect()
    }

    fn run(
        &self,
        bench: &StudyData<'_>,
        file: Option<&Path>,
        shard: Shard,
    ) -> Result<StudyOutcome<StudyReport>, StudyError> {
        run_experiment(&OnBench { study: self, bench }, &bench.work(), file, shard)
    }

    fn figures(&self, report: &StudyReport) -> Vec<LinkedFigure> {
        OnBench::<S>::figures(report)
    }
}

/// Fingerprint of a plan and of all methods that a study fits with it: results with another one are out of date.
pub fn study_fingerprint(study: &dyn PaperStudy, plan: &StudyPlan) -> String {
    let units = study.units(plan).join("\n");
    format!("{:016x}", palpate_sim::fingerprint([plan.header().to_string().as_bytes(), units.as_bytes()]))
}

/// Fingerprints of the full comparison of methods in 0.1.0, which had four methods more, and today. The others are as they
/// were, so its stored result is current.
const WITH_REMOVED_METHODS: [&str; 2] = ["87c5eb4c37e9b2eb", "48d80c573cbd5b14"];

/// True if all methods of a result are as they were when it was computed.
pub fn is_current(report: &StudyReport, study: &dyn PaperStudy, plan: &StudyPlan) -> bool {
    let today = study_fingerprint(study, plan);
    report.fingerprint == today || [report.fingerprint.as_str(), &today] == WITH_REMOVED_METHODS
}
