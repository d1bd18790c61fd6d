//! An experiment: a grid of cells, what is found in each, and the report on all of it.
//!
//! It names its cells, measures one, and turns what was found into a report. The frame runs the cells in parallel, keeps what is
//! finished, resumes, and counts the time.

use super::report::{LinkedFigure, StudyReport};
use super::result_file::{Measuring, ResultFile, ResultFileError, TrialNumbers};
use super::stored_study::{StoredStudy, StudyCommand};
use palpate_lab::datasets::DatasetError;
use palpate_lab::grasping::{CollectionError, Shard};
use palpate_learn::{LearnError, Method, SplitError};
use palpate_sim::objects::ObjectError;
use palpate_sim::physics::SimulationError;
use palpate_sim::scene::SceneError;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fmt::Display;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// Cell of the grid of a study: the unit of work that is computed at once and kept.
pub trait StudyCell: Sync {
    /// Name of its result, different for each cell of a plan.
    fn name(&self) -> String;

    /// Method that is fitted, on whose version the result depends.
    fn method(&self) -> Option<&'static Method> {
        None
    }

    /// Name of its result in files, with the version of its method: a new version is measured anew.
    fn stored_name(&self) -> String {
        let version = self.method().map(|method| format!(" ({})", method.fingerprint()));
        self.name() + &version.unwrap_or_default()
    }
}

/// A study with its plan and what it needs to measure.
pub trait Experiment: Sync {
    /// Cell of the grid.
    type Cell: StudyCell;
    /// What is found in a cell, as stored.
    type Found: Clone + Serialize + DeserializeOwned + Send + Sync;
    /// Report on all cells, as stored.
    type Report: Serialize + DeserializeOwned;

    /// Key on the command line and in files.
    fn key(&self) -> &'static str;

    /// Everything that results depend on, but the program: those of another header are not continued.
    fn header(&self) -> serde_json::Value;

    /// The command that repeats it.
    fn command(&self) -> StudyCommand;

    /// The grid, in the order of work.
    fn grid(&self) -> Vec<Self::Cell>;

    /// Computes a cell, or fails with [`StudyError::Stopped`].
    fn measure(&self, cell: &Self::Cell, stop: &AtomicBool) -> Result<Self::Found, StudyError>;

    /// Numbers of the trials that have been read so far.
    fn trials(&self) -> TrialNumbers {
        TrialNumbers::new()
    }

    /// Report on all cells, in the order of the grid.
    fn report(&self, found: Vec<(Self::Cell, Self::Found)>) -> Self::Report;

    /// Tables of a report.
    fn shown(report: &Self::Report) -> StudyReport;

    /// Figures of a report.
    fn figures(report: &Self::Report) -> Vec<LinkedFigure>;
}

/// End of a run of a study.
#[derive(Clone, Debug, PartialEq)]
pub enum StudyOutcome<R> {
    /// It was stopped; the same study continues its file.
    Stopped,
    /// So many cells, which are a part of it, are in its file; [`merged_units`](super::merged_units) joins the parts.
    Part(usize),
    /// The whole study.
    Whole(StoredStudy<R>),
}

impl<R> StudyOutcome<R> {
    /// The result; none of a study that was stopped, or of a part.
    pub fn whole(self) -> Option<StoredStudy<R>> {
        if let Self::Whole(stored) = self { Some(stored) } else { None }
    }
}

/// Computes the cells of a part of a study that a file of results lacks, then the result of the whole.
pub fn run_experiment<E: Experiment>(
    experiment: &E,
    how: &Measuring<'_>,
    results: Option<&Path>,
    shard: Shard,
) -> Result<StudyOutcome<E::Report>, StudyError> {
    let mut file = match results {
        Some(path) => ResultFile::open(path, experiment.key(), &experiment.header())?,
        None => ResultFile::in_memory(),
    };
    let own = experiment.grid().into_iter().enumerate().filter(|(place, _)| shard.has(*place));
    let cells: Vec<(String, E::Cell)> = own.map(|(_, cell)| (cell.stored_name(), cell)).collect();
    file.retain(|unit| cells.iter().any(|(name, _)| name == unit));
    let measured = |cell: &E::Cell| match experiment.measure(cell, how.cancelled) {
        Err(StudyError::Stopped) => Ok(None),
        found => found.map(Some),
    };
    if !file.complete(&cells, how, measured)? {
        return Ok(StudyOutcome::Stopped);
    }
    if shard != Shard::WHOLE {
        file.end_part(experiment.trials())?;
        return Ok(StudyOutcome::Part(cells.len()));
    }
    let found = cells.into_iter().filter_map(|(name, cell)| Some((cell, file.get(&name)?.clone())));
    let report = experiment.report(found.collect());
    Ok(StudyOutcome::Whole(StoredStudy::new(experiment.command().text(), file.cpu_hours(), report)))
}

/// Error of a study.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    #[error(transparent)]
    Collect(#[from] CollectionError),
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    #[error(transparent)]
    Results(#[from] ResultFileError),
    #[error(transparent)]
    Object(#[from] ObjectError),
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error("{method}: {cause}")]
    Fit {
        /// Key of the method.
        method: String,
        cause: LearnError,
    },
    #[error(transparent)]
    Split(#[from] SplitError),
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    #[error("there is no {0}")]
    Unknown(String),
    #[error("the study needs {0}")]
    Missing(String),
    #[error("stopped")]
    Stopped,
}

impl StudyError {
    /// Error of something that the study needs.
    pub(crate) fn missing(what: impl Display) -> Self {
        Self::Missing(what.to_string())
    }

    /// Error of a fit of a method.
    pub(crate) fn of_fit(method: &str, cause: LearnError) -> Self {
        match cause {
            LearnError::Stopped => Self::Stopped,
            cause @ LearnError::Refused(_) => Self::Fit { method: method.to_owned(), cause },
        }
    }
}
