//! Background studies of the paper: a thread "study" that runs them on the store of the window and reads their results. The
//! files lie in folders beside the store; the command line continues them there, and is continued.

use super::background_job::{BackgroundJob, Outlet};
use super::messages::Wake;
use crate::study::paper::{
    LinkedFigure, PAPER_STUDIES, PaperStudy, StudyBench, StudyError, StudyFolder, StudyPlan, StudyProgress,
    StudyReport, StudySize, StudyWork, paper_study, run_study, stored_report, study_fingerprint,
};
use crate::study::{ResultFileError, StoredStudy, program};
use palpate_store::{Store, StoreError};
use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Command to the thread.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StudentCommand {
    /// Read all results.
    Look,
    /// Run a study, or resume it.
    Run(StudyRequest),
}

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

/// End of a run.
#[derive(Clone, Debug)]
pub enum StudyOutcome {
    /// The result is there.
    Finished,
    /// Stopped; the next run resumes it.
    Stopped,
    /// Stopped before it began.
    Withdrawn,
    /// Not possible.
    Failed(Arc<StudentError>),
}

/// Error of a run.
#[derive(Debug, thiserror::Error)]
pub enum StudentError {
    /// The study failed.
    #[error(transparent)]
    Study(#[from] StudyError),
    /// The store cannot be opened.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Results cannot be read or written.
    #[error(transparent)]
    Results(#[from] ResultFileError),
    /// There is no such study.
    #[error("there is no study \"{0}\"")]
    Unknown(String),
}

impl StudentError {
    /// True where the finished units are of something else: the study has to begin anew.
    pub fn is_of_something_else(&self) -> bool {
        matches!(
            self,
            Self::Study(StudyError::Results(ResultFileError::Other { .. }))
                | Self::Results(ResultFileError::Other { .. })
        )
    }
}

/// State of the thread.
#[derive(Clone, Debug, Default)]
pub struct StudentView {
    /// Files of each study, by its key; empty before the first look.
    pub studies: BTreeMap<&'static str, StudyFiles>,
    /// Running study and its progress, once there is any.
    pub running: Option<(StudyRequest, Option<StudyProgress>)>,
    /// Number of runs that have ended.
    pub ended: u64,
    /// Last runs by their numbers, oldest first.
    pub outcomes: VecDeque<(u64, StudyRequest, StudyOutcome)>,
}

/// Draws a figure as SVG.
pub type DrawFigure = Arc<dyn Fn(&LinkedFigure) -> std::io::Result<String> + Send + Sync>;

/// Handle of the thread.
pub type Student = BackgroundJob<StudentCommand, StudentView>;

/// Outcomes kept.
const OUTCOMES: usize = 16;
/// Least time between two reports of progress.
const BETWEEN: Duration = Duration::from_millis(100);

impl Student {
    /// Starts the thread. Grasps are read from the store and collected there; figures are written as `draw` draws them.
    pub fn start(store: PathBuf, draw: DrawFigure, wake: Wake) -> std::io::Result<Self> {
        let mut service = Service { store, draw, program: None, view: StudentView::default() };
        Self::spawn("study", wake, move |command, stop, outlet| {
            match command {
                StudentCommand::Look => service.look(),
                StudentCommand::Run(request) => service.run(request, stop, outlet),
            }
            outlet.publish(service.view.clone());
        })
    }
}

/// State owned by the thread.
struct Service {
    store: PathBuf,
    draw: DrawFigure,
    /// Version of the program and its physics, once it was needed.
    program: Option<String>,
    view: StudentView,
}

impl Service {
    fn look(&mut self) {
        let program = self.program.get_or_insert_with(program).clone();
        let files = |study: &&'static dyn PaperStudy| (study.card().key, self.files(*study, &program));
        self.view.studies = PAPER_STUDIES.iter().map(files).collect();
    }

    fn files(&self, study: &dyn PaperStudy, program: &str) -> StudyFiles {
        let key = study.card().key;
        let mut files = StudyFiles::default();
        for size in [StudySize::Full, StudySize::Quick, StudySize::Sample { objects: 0, trials: 0 }] {
            let folder = StudyFolder::beside(&self.store, size);
            match folder.read(key) {
                Ok(Some(stored)) => files.results.push(shown(study, StudyOrigin::Run(size), stored, program)),
                Ok(None) if folder.has_begun(key) => files.begun.push(size),
                Ok(None) => {}
                Err(cause) => files.unreadable.push(cause.to_string()),
            }
        }
        match stored_report(study) {
            Ok(Some(stored)) => files.results.push(shown(study, StudyOrigin::Shipped, stored, program)),
            Ok(None) => {}
            Err(cause) => files.unreadable.push(format!("the result that comes with the program: {cause}")),
        }
        files
    }

    fn run(&mut self, request: StudyRequest, stop: &AtomicBool, outlet: &Outlet<StudentView>) {
        let withdrawn = stop.load(Ordering::Relaxed);
        let outcome = match self.finished(&request, stop, outlet) {
            _ if withdrawn => StudyOutcome::Withdrawn,
            Ok(true) => StudyOutcome::Finished,
            Ok(false) => StudyOutcome::Stopped,
            Err(cause) => StudyOutcome::Failed(Arc::new(cause)),
        };
        self.view.ended += 1;
        self.view.outcomes.push_back((self.view.ended, request, outcome));
        if self.view.outcomes.len() > OUTCOMES {
            self.view.outcomes.pop_front();
        }
        if !withdrawn {
            self.look();
        }
    }

    /// Runs a study to its end; false where it was stopped.
    fn finished(
        &self,
        request: &StudyRequest,
        stop: &AtomicBool,
        outlet: &Outlet<StudentView>,
    ) -> Result<bool, StudentError> {
        if stop.load(Ordering::Relaxed) {
            return Ok(false);
        }
        let publish = |progress| {
            outlet.publish(StudentView { running: Some((request.clone(), progress)), ..self.view.clone() });
        };
        publish(None);
        let study = paper_study(&request.key).ok_or_else(|| StudentError::Unknown(request.key.clone()))?;
        let (folder, key) = (StudyFolder::beside(&self.store, request.size), study.card().key);
        if request.anew {
            folder.forget_units(key)?;
        }
        let plan = StudyPlan::of_size(request.size);
        let reported = Mutex::new(None::<Instant>);
        let progress = |progress: StudyProgress| {
            let mut reported = reported.lock().unwrap_or_else(PoisonError::into_inner);
            if progress.done == progress.of || reported.is_none_or(|last| last.elapsed() >= BETWEEN) {
                *reported = Some(Instant::now());
                publish(Some(progress));
            }
        };
        // One core stays for the window.
        let threads = std::thread::available_parallelism().map_or(1, |cores| cores.get().saturating_sub(1).max(1));
        let work = StudyWork { threads, cancelled: stop, progress: &progress };
        let bench = StudyBench::new(Store::open(&self.store)?, &plan, work);
        let Some(stored) = run_study(study, &bench, Some(&folder.units(key)))? else { return Ok(false) };
        folder.write(study, &stored, self.draw.as_ref())?;
        Ok(true)
    }
}

/// A result with its figures.
fn shown(
    study: &dyn PaperStudy,
    origin: StudyOrigin,
    stored: StoredStudy<StudyReport>,
    program: &str,
) -> Arc<StudyResult> {
    let is_current = |size| stored.result.fingerprint == study_fingerprint(study, &StudyPlan::of_size(size));
    let current = match origin {
        // Samples are of many sizes.
        StudyOrigin::Run(StudySize::Sample { .. }) => true,
        StudyOrigin::Run(size) => is_current(size),
        StudyOrigin::Shipped => is_current(StudySize::Full),
    };
    let (current, figures) = (current && stored.program == program, study.figures(&stored.result));
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

impl StudentView {
    /// Result of a study from an origin; the first one where none is named or it is missing.
    pub fn result(&self, key: &str, origin: Option<StudyOrigin>) -> Option<&Arc<StudyResult>> {
        let results = &self.studies.get(key)?.results;
        let wanted = |result: &&Arc<StudyResult>| origin.is_some_and(|origin| origin.is_like(result.origin));
        results.iter().find(wanted).or(results.first())
    }

    /// End of the last run of a study.
    pub fn last(&self, key: &str) -> Option<(&StudyRequest, &StudyOutcome)> {
        let (_, request, outcome) = self.outcomes.iter().rev().find(|(_, request, _)| request.key == key)?;
        Some((request, outcome))
    }
}

#[cfg(test)]
mod tests {
    use super::super::background_job::watch::{until, waker};
    use super::*;

    #[test]
    fn a_study_is_stopped_continued_and_refused_where_it_is_another() {
        let folder = tempfile::tempdir().expect("a folder");
        let store = folder.path().join("trials.sqlite");
        let (wake, woken) = waker();
        let draw: DrawFigure = Arc::new(|linked| Ok(linked.figure.title.clone()));
        let mut student = Student::start(store.clone(), draw, wake).expect("starts");
        student.ask(StudentCommand::Look);
        let view = until(&student, &woken, |view| !view.studies.is_empty());
        assert_eq!(view.studies.len(), PAPER_STUDIES.len());
        let size = StudySize::Sample { objects: 4, trials: 6 };
        let request = |anew| StudyRequest { key: "models".to_owned(), size, anew };
        student.ask(StudentCommand::Run(request(false)));
        until(&student, &woken, |view| view.running.as_ref().is_some_and(|(_, progress)| progress.is_some()));
        student.give_up();
        let view = until(&student, &woken, |view| view.ended == 1);
        assert!(matches!(view.last("models"), Some((_, StudyOutcome::Stopped))), "{:?}", view.last("models"));
        student.ask(StudentCommand::Run(request(false)));
        let view = until(&student, &woken, |view| view.ended == 2);
        assert!(matches!(view.last("models"), Some((_, StudyOutcome::Finished))), "{:?}", view.last("models"));
        let result = view.result("models", None).expect("a result");
        assert!(result.origin.is_like(StudyOrigin::Run(size)) && !result.figures.is_empty() && result.current);
        let files = StudyFolder::beside(&store, size);
        for name in ["models.json", "models.jsonl", "models.csv", "models.svg"] {
            assert!(files.path().join(name).is_file(), "{name}");
        }
        // Units of another plan are not continued, but can be forgotten.
        let other = StudySize::Sample { objects: 3, trials: 6 };
        student.ask(StudentCommand::Run(StudyRequest { size: other, ..request(false) }));
        let view = until(&student, &woken, |view| view.ended == 3);
        let Some((_, StudyOutcome::Failed(cause))) = view.last("models") else { panic!("{view:?}") };
        assert!(cause.is_of_something_else(), "{cause}");
        student.ask(StudentCommand::Run(StudyRequest { key: "none".to_owned(), ..request(true) }));
        let view = until(&student, &woken, |view| view.ended == 4);
        let Some((_, StudyOutcome::Failed(cause))) = view.last("none") else { panic!("{view:?}") };
        assert_eq!(cause.to_string(), "there is no study \"none\"");
    }
}
