//! Studies in the window: which is chosen, what of its results is shown, and which run.

use super::App;
use super::view::ViewSource;
use palpate_geometry::palette::{SERIES_COLOURS, Theme};
use palpate_lab::datasets::SensorView;
use palpate_lab::workers::{Job, JobFailure, RunningJob, Wake};
use palpate_render::figure_svg;
use palpate_store::TrialQuery;
use palpate_study::jobs::{
    StudyFiles, StudyFilesByKey, StudyOrigin, StudyRequest, StudyResult, StudyRunner, study_files_job, study_runner,
};
use palpate_study::paper::PAPER_STUDIES;
use palpate_study::{LinkedFigure, ListedStudy, StudyRow, StudySize, all_studies, listed_study};
use palpate_tactile::trial::TrialId;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// State of the studies in the window.
pub struct Studies {
    runner: StudyRunner,
    looks: Job<(), StudyFilesByKey>,
    /// Files of all studies; empty before the first look.
    files: Arc<StudyFilesByKey>,
    /// Studies whose last run has failed.
    failed: BTreeMap<String, (StudySize, JobFailure)>,
    store: PathBuf,
    chosen: &'static dyn ListedStudy,
    /// Origin of the result that is shown; the first one where it is missing.
    origin: Option<StudyOrigin>,
    figure: usize,
    row: Option<OpenRow>,
}

/// A row whose trials are looked at.
struct OpenRow {
    trials: BTreeSet<TrialId>,
    /// The list before it.
    before: TrialQuery,
    /// Its sensors, and those that were set before.
    sensors: Option<[SensorView; 2]>,
}

/// What is said of the result of a quick run.
pub(in crate::app) const QUICK: &str = "Quick run: do not quote.";

/// True for results of fewer grasps than the study needs.
pub(in crate::app) fn is_quick(origin: StudyOrigin) -> bool {
    matches!(origin, StudyOrigin::Run(StudySize::Quick | StudySize::Sample { .. }))
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
            row: None,
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
    pub fn chosen(&self) -> &'static dyn ListedStudy {
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
        let mut linked = result.figures.get(self.figure_of(&result))?.clone();
        let mut note = result.stored.plain_origin();
        if is_quick(result.origin) {
            note = format!("{QUICK} {note}");
            linked.name.push_str("-quick");
        }
        Some(linked.with_note(&note))
    }

    /// Reads the results again.
    pub(in crate::app) fn look(&self) {
        // A run looks at its end, and other panels may have asked already.
        if self.runner.is_settled() && self.looks.is_settled() {
            self.looks.start(());
        }
    }

    /// Chooses a study by its key.
    pub fn choose(&mut self, key: &str) {
        if let Some(study) = listed_study(key) {
            (self.chosen, self.figure) = (study, 0);
        }
    }

    /// Chooses the study this many places further.
    pub(in crate::app) fn step(&mut self, by: isize) {
        let keys: Vec<&str> = all_studies().map(|study| study.card().key).collect();
        let now = keys.iter().position(|key| *key == self.chosen.card().key).unwrap_or(0);
        let next = now.saturating_add_signed(by).min(keys.len() - 1);
        if next != now {
            self.choose(keys[next]);
        }
    }

    /// Shows the result of this origin.
    pub(in crate::app) fn show_result(&mut self, origin: StudyOrigin) {
        (self.origin, self.figure) = (Some(origin), 0);
    }

    /// Shows this figure of the result.
    pub(in crate::app) fn show_figure(&mut self, figure: usize) {
        self.figure = figure;
    }

    /// Stops the running study, and those that wait.
    pub(in crate::app) fn stop(&self) {
        self.runner.stop();
    }

    /// The sensors that were set before those of a row.
    pub(in crate::app) fn sensors_before(&self) -> Option<&SensorView> {
        let [_, before] = self.row.as_ref()?.sensors.as_ref()?;
        Some(before)
    }

    /// Takes a study back that waits.
    pub(in crate::app) fn withdraw(&self, key: &str) {
        self.runner.withdraw(|request| request.key == key);
    }
}

impl App {
    /// Takes in files that were read, and reports runs that have ended.
    pub(super) fn poll_studies(&mut self) {
        let shown = self.inspect.wanted.filter(|_| self.view.source == ViewSource::Trial);
        self.leave_row(|trials| shown.is_none_or(|id| !trials.contains(&id)));
        let Self { studies, notices, .. } = self;
        for files in studies.looks.take().into_iter().filter_map(|ended| ended.outcome.ok()) {
            studies.files = files;
        }
        for ended in studies.runner.take() {
            let StudyRequest { key, size, .. } = &*ended.command;
            let title = listed_study(key).map_or(key.as_str(), |study| study.card().title);
            studies.failed.remove(key);
            match ended.outcome {
                Ok(end) => {
                    notices.done("study");
                    studies.files = Arc::new(end.files.clone());
                    if !end.finished {
                        notices.info(format!("Study stopped: {title}. Run it again to resume."));
                        notices.until("study");
                        continue;
                    }
                    notices.info(format!("Study finished: {title}."));
                    if key == studies.chosen.card().key {
                        studies.show_result(StudyOrigin::Run(*size));
                    }
                }
                Err(cause) => {
                    notices.failed("study", format!("Study {title} failed: {cause}"));
                    studies.failed.insert(key.clone(), (*size, cause));
                    studies.looks.start(());
                }
            }
        }
    }

    /// Runs a study after those that were asked for before.
    pub fn run_study(&mut self, request: StudyRequest) {
        let is_running = self.studies.running().is_some_and(|running| running.command.key == request.key);
        if is_running || self.studies.waits(&request.key) {
            self.notices.info("This study is running or waits already.");
        } else {
            self.notices.done("study");
            self.studies.runner.start(request);
        }
    }

    /// The sensors of a row go with its trials, and so does the list of these, unless others were chosen since.
    fn leave_row(&mut self, is_left: impl Fn(&BTreeSet<TrialId>) -> bool) {
        let Some(row) = self.studies.row.take_if(|row| is_left(&row.trials)) else { return };
        if self.library.selection.query.only == Some(row.trials) {
            self.library.find(row.before);
        }
        if let Some([_, before]) = row.sensors.filter(|[own, _]| self.view.sensors == *own) {
            self.view.sensors = before;
        }
    }

    /// Opens the first of these trials, and compares the next with it, each in a colour of its own.
    pub(in crate::app) fn open_trials(&mut self, row: &StudyRow) {
        let Some((first, others)) = row.trials.split_first() else { return };
        self.inspect.unpin_all();
        self.leave_row(|_| true);
        let trials: BTreeSet<TrialId> = row.trials.iter().copied().collect();
        let before = self.library.selection.query.clone();
        self.library.find(TrialQuery { only: Some(trials.clone()), ..before.cleared() });
        // What the row was measured by, not what curves were shown through before.
        let sensors = row.sensors.clone().map(|SensorView { layout, gripper, sensors, signals, .. }| {
            let before = self.view.sensors.clone();
            [SensorView { layout, gripper, sensors, signals, ..before.clone() }, before]
        });
        let mut through = String::new();
        if let Some([own, _]) = &sensors {
            through = format!(", through {} sensors as in the study", own.sensors.name());
            self.view.sensors = own.clone();
        }
        self.studies.row = Some(OpenRow { trials, before, sensors });
        self.open_trial(*first);
        others.iter().take(SERIES_COLOURS).for_each(|id| self.pin(*id));
        let (all, beside) = (others.len(), others.len().min(SERIES_COLOURS));
        self.notices.info(format!(
            "Trial {first} of the row is open, {beside} of the {all} others that are kept of it are compared{through}."
        ));
    }
}
