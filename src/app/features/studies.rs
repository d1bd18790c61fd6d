//! Studies of the paper in the window: which is chosen, and what of its results is shown; hands runs to the [`StudyRunner`].

use crate::app::features::inspect::InspectAction;
use crate::app::notices::Notices;
use palpate_geometry::palette::Theme;
use palpate_lab::study::paper::{LinkedFigure, PAPER_STUDIES, PaperStudy, StudySize, paper_study};
use palpate_lab::workers::{
    Job, JobFailure, RunningJob, StudyFiles, StudyFilesByKey, StudyOrigin, StudyRequest, StudyResult, StudyRunner,
    Wake, study_files_job, study_runner,
};
use palpate_render::figure_svg;
use palpate_tactile::trial::TrialId;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Action on the studies.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StudyAction {
    /// Read the results again.
    Look,
    /// Choose a study by its key.
    Choose(String),
    /// Choose the study this many places further.
    Step(isize),
    /// Show the result of this origin.
    ShowResult(StudyOrigin),
    /// Show this figure of the result.
    ShowFigure(usize),
    /// Run a study after those that were asked for before.
    Run(StudyRequest),
    /// Stop the running study, and those that wait.
    Stop,
    /// Open the first of these trials, and compare the others with it.
    OpenTrials(Vec<TrialId>),
}

/// State of the studies in the window.
pub struct Studies {
    runner: StudyRunner,
    looks: Job<(), StudyFilesByKey>,
    /// Files of all studies; empty before the first look.
    files: Arc<StudyFilesByKey>,
    /// Studies whose last run has failed.
    failed: BTreeMap<String, (StudySize, JobFailure)>,
    store: PathBuf,
    chosen: &'static dyn PaperStudy,
    /// Origin of the result that is shown; the first one where it is missing.
    origin: Option<StudyOrigin>,
    figure: usize,
}

impl Studies {
    /// Studies on the store at `store`.
    pub(in crate::app) fn new(store: &Path, wake: &Wake) -> Self {
        let draw = |linked: &LinkedFigure| {
            figure_svg(&linked.figure, Theme::Light, linked.size).map_err(std::io::Error::other)
        };
        Self {
            runner: study_runner(store.to_owned(), Arc::new(draw), Arc::clone(wake)),
            looks: study_files_job(store.to_owned(), Arc::clone(wake)),
            files: Arc::default(),
            failed: BTreeMap::new(),
            store: store.to_owned(),
            chosen: PAPER_STUDIES[0],
            origin: None,
            figure: 0,
        }
    }

    /// Files of a study; none before the first look.
    pub fn files(&self, key: &str) -> Option<&StudyFiles> {
        self.files.get(key)
    }

    /// The running study.
    pub fn running(&self) -> Option<RunningJob<StudyRequest>> {
        self.runner.running()
    }

    /// Size and failure of the last run of a study, where it has failed.
    pub fn failed(&self, key: &str) -> Option<&(StudySize, JobFailure)> {
        self.failed.get(key)
    }

    /// The chosen study.
    pub fn chosen(&self) -> &'static dyn PaperStudy {
        self.chosen
    }

    /// The store of the studies.
    pub fn store(&self) -> &Path {
        &self.store
    }

    /// Result that is shown; none where the study has none.
    pub fn result(&self) -> Option<Arc<StudyResult>> {
        let results = &self.files(self.chosen.card().key)?.results;
        let wanted = |result: &&Arc<StudyResult>| self.origin.is_some_and(|origin| origin.is_like(result.origin));
        results.iter().find(wanted).or(results.first()).cloned()
    }

    /// Number of the figure of a result that is shown.
    pub fn figure_of(&self, result: &StudyResult) -> usize {
        self.figure.min(result.figures.len().saturating_sub(1))
    }

    /// True where a study is asked for and has not begun.
    pub fn waits(&self, key: &str) -> bool {
        self.runner.waiting().iter().any(|request| request.key == key)
    }

    /// The figure that is shown with its origin in the note, and its size (points).
    pub(in crate::app) fn exported(&self) -> Option<LinkedFigure> {
        let result = self.result()?;
        let linked = result.figures.get(self.figure_of(&result))?.clone();
        Some(linked.with_note(&result.stored.plain_origin()))
    }

    fn choose(&mut self, study: &'static dyn PaperStudy) {
        (self.chosen, self.figure) = (study, 0);
    }

    /// Takes in files that were read, and reports runs that have ended.
    pub(in crate::app) fn gather(&mut self, notices: &mut Notices) {
        for files in self.looks.take().into_iter().filter_map(|ended| ended.outcome.ok()) {
            self.files = files;
        }
        for ended in self.runner.take() {
            let StudyRequest { key, size, .. } = &*ended.command;
            let title = paper_study(key).map_or(key.as_str(), |study| study.card().title);
            self.failed.remove(key);
            match ended.outcome {
                Ok(end) => {
                    self.files = Arc::new(end.files.clone());
                    if !end.finished {
                        notices.info(format!("Study stopped: {title}. Run it again to resume."));
                        continue;
                    }
                    notices.info(format!("Study finished: {title}."));
                    if key == self.chosen.card().key {
                        (self.origin, self.figure) = (Some(StudyOrigin::Run(*size)), 0);
                    }
                }
                Err(cause) => {
                    notices.error(format!("Study {title} failed: {cause}"));
                    self.failed.insert(key.clone(), (*size, cause));
                    self.looks.start(());
                }
            }
        }
    }

    /// Applies an action; what follows for the inspection.
    pub(in crate::app) fn apply(&mut self, action: StudyAction, notices: &mut Notices) -> Vec<InspectAction> {
        match action {
            // A run looks at its end, and other panels may have asked already.
            StudyAction::Look if self.runner.is_settled() && self.looks.is_settled() => _ = self.looks.start(()),
            StudyAction::Look => {}
            StudyAction::Choose(key) => {
                if let Some(study) = paper_study(&key) {
                    self.choose(study);
                }
            }
            StudyAction::Step(by) => {
                let key = self.chosen.card().key;
                let now = PAPER_STUDIES.iter().position(|study| study.card().key == key).unwrap_or(0);
                let next = now.saturating_add_signed(by).min(PAPER_STUDIES.len() - 1);
                if next != now {
                    self.choose(PAPER_STUDIES[next]);
                }
            }
            StudyAction::ShowResult(origin) => (self.origin, self.figure) = (Some(origin), 0),
            StudyAction::ShowFigure(figure) => self.figure = figure,
            StudyAction::Run(request) => {
                let is_running = self.running().is_some_and(|running| running.command.key == request.key);
                if is_running || self.waits(&request.key) {
                    notices.info("This study is running or waits already.".to_owned());
                } else {
                    self.runner.start(request);
                }
            }
            StudyAction::Stop => self.runner.stop(),
            StudyAction::OpenTrials(trials) => {
                let mut trials = trials.into_iter();
                let Some(first) = trials.next() else { return Vec::new() };
                let others = trials.map(InspectAction::Pin);
                return [InspectAction::UnpinAll, InspectAction::Open(first)].into_iter().chain(others).collect();
            }
        }
        Vec::new()
    }
}
