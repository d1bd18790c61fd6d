//! The frame of a study: a grid of cells, what is found in each, and the report on all of it.
//!
//! A [`Study`] names its cells, measures one, and turns what was found into rows of tables, claims and figures. The frame runs
//! the cells in parallel, keeps what is finished, resumes, and counts the time.

use super::bench::{StudyBench, StudyError, StudyProgress, StudyStep};
use super::report::{LinkedFigure, StudyReport};
use super::{StudyCard, StudyPlan};
use crate::study::effects::Measuring;
use crate::study::result_file::ResultFile;
use crate::study::stored_study::StoredStudy;
use palpate_learn::Method;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;

/// Cell of the grid of a study: the unit of work that is computed at once and kept.
pub(super) trait StudyCell: Sync {
    /// Name of its result, different for each cell of a plan.
    fn name(&self) -> String;

    /// Method that is fitted, on whose version the result depends.
    fn method(&self) -> Option<&'static Method>;

    /// Name of its result in files: results of another version of the method are others.
    fn stored_name(&self) -> String {
        let version = self.method().map(|method| format!(" ({})", method.fingerprint()));
        self.name() + &version.unwrap_or_default()
    }
}

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
    fn measure(cell: &Self::Cell, bench: &StudyBench<'_>) -> Result<Self::Found, StudyError>;

    /// Tables and findings from all cells, in the order of the grid.
    fn report(plan: &StudyPlan, found: Vec<(Self::Cell, Self::Found)>) -> StudyReport;

    /// Figures, drawn from the tables; none of a table that the report lacks.
    fn figures(report: &StudyReport) -> Vec<Option<LinkedFigure>>;
}

/// A study, whatever its cells are.
pub trait PaperStudy: Sync {
    /// Name and purpose.
    fn card(&self) -> StudyCard;

    /// Names of the results of all cells.
    fn units(&self, plan: &StudyPlan) -> Vec<String>;

    /// Computes the cells that a file of results lacks, then CPU time (h) and report; none where it was stopped.
    fn run(&self, bench: &StudyBench<'_>, results: Option<&Path>) -> Result<Option<(f64, StudyReport)>, StudyError>;

    /// Figures, drawn from the tables.
    fn figures(&self, report: &StudyReport) -> Vec<LinkedFigure>;
}

impl<S: Study> PaperStudy for S {
    fn card(&self) -> StudyCard {
        S::CARD
    }

    fn units(&self, plan: &StudyPlan) -> Vec<String> {
        S::grid(plan).iter().map(StudyCell::stored_name).collect()
    }

    fn run(&self, bench: &StudyBench<'_>, results: Option<&Path>) -> Result<Option<(f64, StudyReport)>, StudyError> {
        let (plan, work) = (bench.plan(), bench.work());
        let mut file = match results {
            Some(path) => ResultFile::<S::Found>::open(path, S::CARD.key, &plan.header())?,
            None => ResultFile::in_memory(),
        };
        let progress = |done, of| (work.progress)(StudyProgress { step: StudyStep::Measuring, done, of });
        let how = Measuring { threads: work.threads, cancelled: work.cancelled, progress: &progress };
        let cells: Vec<(String, S::Cell)> = S::grid(plan).into_iter().map(|cell| (cell.stored_name(), cell)).collect();
        file.retain(|unit| cells.iter().any(|(name, _)| name == unit));
        let measured = |cell: &S::Cell| match S::measure(cell, bench) {
            Err(StudyError::Stopped) => Ok(None),
            found => found.map(Some),
        };
        if !file.complete(&cells, &how, measured)? {
            return Ok(None);
        }
        let found = cells.into_iter().filter_map(|(name, cell)| Some((cell, file.get(&name)?.clone())));
        Ok(Some((file.cpu_hours(), S::report(plan, found.collect()))))
    }

    fn figures(&self, report: &StudyReport) -> Vec<LinkedFigure> {
        S::figures(report).into_iter().flatten().collect()
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

/// Runs a study on a bench; none where it was stopped. A file keeps finished cells: the same plan continues there.
pub fn run_study(
    study: &dyn PaperStudy,
    bench: &StudyBench<'_>,
    results: Option<&Path>,
) -> Result<Option<StoredStudy<StudyReport>>, StudyError> {
    let Some((cpu_hours, report)) = study.run(bench, results)? else { return Ok(None) };
    let report = StudyReport { fingerprint: study_fingerprint(study, bench.plan()), ..report };
    let command = bench.plan().command(study.card().key);
    Ok(Some(StoredStudy::new(command.text(), cpu_hours, report)))
}
