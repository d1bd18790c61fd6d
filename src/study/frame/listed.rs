//! The list of studies: name and purpose of each, and how its result is read, shown and computed.

use super::experiment::{Experiment, StudyError, run_experiment};
use super::folder::StudyFolder;
use super::report::{LinkedFigure, StudyReport};
use super::result_file::{Measuring, ResultFileError};
use super::shipped::shipped_json;
use super::stored_study::{StoredStudy, cpu_cost};
use palpate_lab::grasping::Shard;
use serde::{Deserialize, Serialize};
use std::io;
use std::path::Path;

/// Amount of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StudySize {
    /// The full form, whose results are quoted.
    Full,
    /// Less than a minute: fewer grasps, small networks, few epochs.
    Quick,
    /// A few objects and grasps, to test the program.
    Sample {
        /// Number of objects.
        objects: usize,
        /// Grasps of each.
        trials: usize,
    },
}

impl StudySize {
    /// Folder beside a store for studies of this size.
    pub fn folder(self, store: &Path) -> StudyFolder {
        StudyFolder::new(store.with_file_name(match self {
            Self::Full => "studies",
            Self::Quick => "studies-quick",
            Self::Sample { .. } => "studies-sample",
        }))
    }
}

/// Name and purpose of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StudyCard {
    /// Key on the command line and in files.
    pub key: &'static str,
    /// Display name.
    pub title: &'static str,
    /// What it shows, in a sentence without full stop.
    pub about: &'static str,
    /// Figure or section of the paper.
    pub paper: &'static str,
}

impl StudyCard {
    /// CPU time of the full run that comes with the program (h); none where there is none.
    pub fn cpu_hours(&self) -> Option<f64> {
        /// What stands before the result.
        #[derive(Deserialize)]
        struct Head {
            cpu_hours: f64,
        }
        let (head, _result) = shipped_json(self.key)?.split_once(",\"result\":")?;
        serde_json::from_str(&format!("{head}}}")).ok().map(|head: Head| head.cpu_hours)
    }

    /// The same in words.
    pub fn cost(&self) -> String {
        self.cpu_hours().map_or_else(|| "not measured".to_owned(), |hours| format!("about {}", cpu_cost(hours)))
    }

    /// True for a study that the paper has, or calls future work.
    pub fn is_of_the_paper(&self) -> bool {
        ![OWN_METHODS, OWN_PHYSICS].contains(&self.paper)
    }

    /// Where it comes from: `Fig. 7 of the paper`.
    pub fn origin(&self) -> String {
        if self.is_of_the_paper() { format!("{} of the paper", self.paper) } else { format!("our {}", self.paper) }
    }
}

/// In place of a section of the paper: studies of our own methods, and of the simulation.
pub(crate) const OWN_METHODS: &str = "own methods";
pub(crate) const OWN_PHYSICS: &str = "own simulation";

/// Tables and figures of a study.
#[derive(Clone, Debug)]
pub struct ShownStudy {
    /// Tables and findings.
    pub stored: StoredStudy<StudyReport>,
    /// Figures.
    pub figures: Vec<LinkedFigure>,
}

impl ShownStudy {
    /// Shows a stored result.
    pub(crate) fn new<E: Experiment>(stored: StoredStudy<E::Report>) -> Self {
        let StoredStudy { command, program, cpu_hours, result } = stored;
        let (figures, result) = (E::figures(&result), E::shown(&result));
        Self { stored: StoredStudy { command, program, cpu_hours, result }, figures }
    }
}

/// Draws a figure as SVG.
pub type Draw<'a> = &'a dyn Fn(&LinkedFigure) -> io::Result<String>;

/// A study of the list.
pub trait ListedStudy: Sync {
    /// Name and purpose.
    fn card(&self) -> StudyCard;

    /// The full result that comes with the program.
    fn shipped(&self) -> Result<Option<ShownStudy>, serde_json::Error>;

    /// The result in a folder; none where the study is not finished.
    fn read(&self, folder: &StudyFolder) -> Result<Option<ShownStudy>, ResultFileError>;

    /// True if methods and settings of a result are those of a run of this size today.
    fn is_current(&self, result: &StudyReport, size: StudySize) -> bool;

    /// Runs it to its end in its folder beside a store; false where it was stopped.
    fn finish(&self, store: &Path, size: StudySize, how: Measuring<'_>, draw: Draw<'_>) -> Result<bool, StudyError>;
}

/// Runs a study to its end in a folder; false where it was stopped.
pub(crate) fn finish<E: Experiment>(
    experiment: &E,
    folder: &StudyFolder,
    how: &Measuring<'_>,
    draw: Draw<'_>,
) -> Result<bool, StudyError> {
    let key = experiment.key();
    let outcome = run_experiment(experiment, how, Some(&folder.units(key)), Shard::WHOLE)?;
    let Some(stored) = outcome.whole() else { return Ok(false) };
    folder.write(key, &stored, &E::shown(&stored.result).tables, E::figures(&stored.result), draw)?;
    Ok(true)
}

/// A study that needs no stored grasps.
pub(crate) struct PlainStudy<E> {
    pub(crate) card: StudyCard,
    /// The study in a size.
    pub(crate) of_size: fn(StudySize) -> Result<E, StudyError>,
}

impl<E: Experiment> ListedStudy for PlainStudy<E> {
    fn card(&self) -> StudyCard {
        self.card
    }

    fn shipped(&self) -> Result<Option<ShownStudy>, serde_json::Error> {
        Ok(StoredStudy::shipped(self.card.key)?.map(ShownStudy::new::<E>))
    }

    fn read(&self, folder: &StudyFolder) -> Result<Option<ShownStudy>, ResultFileError> {
        Ok(folder.read(self.card.key)?.map(ShownStudy::new::<E>))
    }

    fn is_current(&self, _result: &StudyReport, _size: StudySize) -> bool {
        true
    }

    fn finish(&self, store: &Path, size: StudySize, how: Measuring<'_>, draw: Draw<'_>) -> Result<bool, StudyError> {
        finish(&(self.of_size)(size)?, &size.folder(store), &how, draw)
    }
}
