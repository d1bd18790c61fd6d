//! Studies beside the window, on its store. Their files lie in folders beside the store; the command line
//! continues them there, and is continued.

use crate::all::{all_studies, listed_study};
use crate::frame::{
    LinkedFigure, ListedStudy, Measuring, ResultFileError, ShownStudy, StoredStudy, StudyError, StudyProgress,
    StudyReport, StudySize, StudyStep, program,
};
use palpate_lab::workers::{Job, JobError, JobFailure, JobRun, Newer, Wake, spare_threads};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// A run of a study.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StudyRequest {
    /// Key of the study.
    pub key: String,
    /// Amount of work.
    pub size: StudySize,
    /// Forget what is finished so far.
    pub anew: bool,
}

/// Where a result comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StudyOrigin {
    /// A run here.
    Run(StudySize),
    /// The full run that comes with the program; its trials are not in the store.
    Shipped,
}

/// Result of a study with its figures.
#[derive(Clone, Debug)]
pub struct StudyResult {
    /// Where it comes from.
    pub origin: StudyOrigin,
    /// The result.
    pub stored: StoredStudy<StudyReport>,
    /// Figures, drawn from its tables.
    pub figures: Vec<LinkedFigure>,
    /// True where physics, methods and settings are those of a run today.
    pub current: bool,
}

/// Files of a study.
#[derive(Clone, Debug, Default)]
pub struct StudyFiles {
    /// Results: full, quick, sample, shipped.
    pub results: Vec<Arc<StudyResult>>,
    /// Sizes with finished units, but without a result.
    pub begun: Vec<StudySize>,
    /// Files that cannot be read.
    pub unreadable: Vec<String>,
}

/// Files of all studies, by their keys.
pub type StudyFilesByKey = BTreeMap<&'static str, StudyFiles>;

/// End of a run.
#[derive(Clone, Debug)]
pub struct StudyEnd {
    /// False where it was stopped; the next run resumes it.
    pub finished: bool,
    /// Files of all studies after it.
    pub files: StudyFilesByKey,
}

/// Draws a figure as SVG.
pub type DrawFigure = Arc<dyn Fn(&LinkedFigure) -> std::io::Result<String> + Send + Sync>;

/// Runs studies, one after the other, and resumes them.
pub type StudyRunner = Job<StudyRequest, StudyEnd>;

/// The runner. Grasps are read from the store and collected there; figures are written as `draw` draws them.
pub fn study_runner(store: PathBuf, draw: DrawFigure, wake: Wake) -> StudyRunner {
    Job::new("study", Newer::Waits, wake, move |request: &StudyRequest, run| {
        let finished = finish(&store, request, &draw, run)?;
        Ok(Some(StudyEnd { finished, files: study_files(&store) }))
    })
}

/// The job that reads the files of all studies.
pub fn study_files_job(store: PathBuf, wake: Wake) -> Job<(), StudyFilesByKey> {
    Job::new("study-files", Newer::Replaces, wake, move |(), _run| Ok(Some(study_files(&store))))
}

/// Runs a study to its end; false where it was stopped.
fn finish(store: &Path, request: &StudyRequest, draw: &DrawFigure, run: &JobRun<'_>) -> Result<bool, JobError> {
    let study = listed_study(&request.key).ok_or_else(|| format!("there is no study \"{}\"", request.key))?;
    if request.anew {
        request.size.folder(store).forget_units(study.card().key)?;
    }
    // Grasps are simulated between the parts, before the next one: done, all of them, and the largest share so far.
    let parts = Mutex::new((0, 1, 0.0_f64));
    let progress = |StudyProgress { step, done, of }: StudyProgress| {
        let mut parts = parts.lock().unwrap_or_else(PoisonError::into_inner);
        let (words, within) = match step {
            StudyStep::Measuring => {
                (parts.0, parts.1) = (done, of.max(1));
                (format!("measuring, {done} of {of} parts"), 0.0)
            }
            StudyStep::Collecting => {
                let words = format!("{} of {} parts; simulating grasps, {done} of {of}", parts.0, parts.1);
                (words, done as f64 / of.max(1) as f64)
            }
        };
        parts.2 = parts.2.max((parts.0 as f64 + within).min(parts.1 as f64) / parts.1 as f64);
        run.progress(parts.2, words);
    };
    let work = Measuring { threads: spare_threads(), cancelled: run.stop(), progress: &progress };
    Ok(study.finish(store, request.size, work, draw.as_ref())?)
}

/// True where the finished units of a study are of another version or plan: it has to begin anew.
pub fn has_other_units(failure: &JobFailure) -> bool {
    let results = match failure.downcast_ref() {
        Some(StudyError::Results(results)) => Some(results),
        _ => failure.downcast_ref(),
    };
    matches!(results, Some(ResultFileError::Other { .. }))
}

fn study_files(store: &Path) -> StudyFilesByKey {
    let program = program();
    all_studies().map(|study| (study.card().key, files_of(store, study, &program))).collect()
}

fn files_of(store: &Path, study: &dyn ListedStudy, program: &str) -> StudyFiles {
    let key = study.card().key;
    let mut files = StudyFiles::default();
    for size in [StudySize::Full, StudySize::Quick, StudySize::Sample { objects: 0, trials: 0 }] {
        let folder = size.folder(store);
        match study.read(&folder) {
            Ok(Some(stored)) => files.results.push(shown(study, StudyOrigin::Run(size), stored, program)),
            Ok(None) if folder.has_begun(key) => files.begun.push(size),
            Ok(None) => {}
            Err(cause) => files.unreadable.push(cause.to_string()),
        }
    }
    match study.shipped() {
        Ok(Some(stored)) => files.results.push(shown(study, StudyOrigin::Shipped, stored, program)),
        Ok(None) => {}
        Err(cause) => files.unreadable.push(format!("the result that comes with the program: {cause}")),
    }
    files
}

/// Result of a study, its origin, and whether it is up to date.
fn shown(
    study: &dyn ListedStudy,
    origin: StudyOrigin,
    ShownStudy { stored, figures }: ShownStudy,
    program: &str,
) -> Arc<StudyResult> {
    let current = stored.program == program
        && match origin {
            // Samples are of many sizes.
            StudyOrigin::Run(StudySize::Sample { .. }) => true,
            StudyOrigin::Run(size) => study.is_current(&stored.result, size),
            StudyOrigin::Shipped => study.is_current(&stored.result, StudySize::Full),
        };
    Arc::new(StudyResult { origin, stored, figures, current })
}

impl StudyOrigin {
    /// Word on a button.
    pub fn title(self) -> &'static str {
        match self {
            Self::Run(StudySize::Full) => "full",
            Self::Run(StudySize::Quick) => "quick",
            Self::Run(StudySize::Sample { .. }) => "sample",
            Self::Shipped => "shipped",
        }
    }

    /// True for two results of the same kind.
    pub fn is_like(self, other: Self) -> bool {
        self.title() == other.title()
    }
}

#[cfg(test)]
mod tests {
    use super::super::watch::{settled, until, waker};
    use super::*;

    #[test]
    fn a_study_is_stopped_continued_and_refused_where_it_is_another() {
        let folder = tempfile::tempdir().expect("a folder");
        let store = folder.path().join("trials.sqlite");
        let (wake, woken) = waker();
        let draw: DrawFigure = Arc::new(|linked| Ok(linked.figure.title.clone()));
        let looks = study_files_job(store.clone(), Arc::clone(&wake));
        looks.start(());
        assert_eq!(settled(&looks, &woken).expect("looked").expect("read").len(), all_studies().count());
        let runner = study_runner(store.clone(), draw, wake);
        let size = StudySize::Sample { objects: 4, trials: 6 };
        let request = |anew| StudyRequest { key: "models".to_owned(), size, anew };
        runner.start(request(false));
        runner.start(request(false));
        until(&woken, || runner.running().filter(|running| !running.progress.words.is_empty()));
        runner.stop();
        assert!(settled(&runner, &woken).expect("ended").is_ok_and(|end| !end.finished));
        assert_eq!(runner.take().len(), 1, "the one that waited did not begin");
        runner.start(request(false));
        let end = settled(&runner, &woken).expect("ended").expect("runs");
        let result = &end.files["models"].results[0];
        assert!(end.finished && result.origin.is_like(StudyOrigin::Run(size)));
        assert!(!result.figures.is_empty() && result.current);
        let files = size.folder(&store);
        for name in ["models.json", "models.jsonl", "models.csv", "models.svg"] {
            assert!(files.path().join(name).is_file(), "{name}");
        }
        // One that is not of the paper, and takes no grasps of the store.
        runner.start(StudyRequest {
            key: "effects".to_owned(),
            size: StudySize::Sample { objects: 1, trials: 2 },
            anew: false,
        });
        let end = settled(&runner, &woken).expect("ended").expect("runs");
        let result = &end.files["effects"].results[0];
        assert!(end.finished && result.current && !result.stored.result.tables.is_empty());
        assert!(files.path().join("effects.svg").is_file());
        // Units of another plan are not continued, but can be forgotten.
        let other = StudySize::Sample { objects: 3, trials: 6 };
        runner.start(StudyRequest { size: other, ..request(false) });
        let cause = settled(&runner, &woken).expect("ended").expect_err("another plan");
        assert!(has_other_units(&cause), "{cause}");
        runner.start(StudyRequest { key: "none".to_owned(), ..request(true) });
        let cause = settled(&runner, &woken).expect("ended").expect_err("no such study");
        assert_eq!(cause.to_string(), "there is no study \"none\"");
    }
}
