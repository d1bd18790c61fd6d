//! Studies of the paper in the window: which is chosen, and what of its results is shown; hands runs to the [`Student`].

use crate::app::features::inspect::InspectAction;
use crate::app::notices::Notices;
use crate::app::startup::ThreadError;
use palpate_geometry::palette::Theme;
use palpate_lab::study::paper::{LinkedFigure, PAPER_STUDIES, PaperStudy, paper_study};
use palpate_lab::workers::{
    Student, StudentCommand, StudentView, StudyOrigin, StudyOutcome, StudyRequest, StudyResult, Wake,
};
use palpate_render::figure_svg;
use palpate_tactile::trial::TrialId;
use std::collections::VecDeque;
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
    student: Student,
    store: PathBuf,
    chosen: &'static dyn PaperStudy,
    /// Origin of the result that is shown; the first one where it is missing.
    origin: Option<StudyOrigin>,
    figure: usize,
    /// Runs asked for, the running one first.
    asked: VecDeque<StudyRequest>,
    /// Runs up to this number have been reported.
    reported: u64,
}

impl Studies {
    /// Starts the thread on the store at `store`.
    pub(in crate::app) fn start(store: &Path, wake: &Wake) -> Result<Self, ThreadError> {
        let draw = |linked: &LinkedFigure| {
            figure_svg(&linked.figure, Theme::Light, linked.size).map_err(std::io::Error::other)
        };
        let student = Student::start(store.to_owned(), Arc::new(draw), Arc::clone(wake));
        Ok(Self {
            student: student.map_err(ThreadError::of("the studies"))?,
            store: store.to_owned(),
            chosen: PAPER_STUDIES[0],
            origin: None,
            figure: 0,
            asked: VecDeque::new(),
            reported: 0,
        })
    }

    /// Newest state of the thread.
    pub fn view(&self) -> Arc<StudentView> {
        self.student.view().unwrap_or_default()
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
        self.view().result(self.chosen.card().key, self.origin).cloned()
    }

    /// Number of the figure of a result that is shown.
    pub fn figure_of(&self, result: &StudyResult) -> usize {
        self.figure.min(result.figures.len().saturating_sub(1))
    }

    /// True where a study is asked for and has not begun.
    pub fn waits(&self, key: &str) -> bool {
        let running = usize::from(self.view().running.is_some());
        self.asked.iter().skip(running).any(|request| request.key == key)
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

    /// Reports runs that have ended.
    pub(in crate::app) fn gather(&mut self, notices: &mut Notices) {
        let (view, before) = (self.view(), self.reported);
        for (number, request, outcome) in view.outcomes.iter().filter(|(number, ..)| *number > before) {
            let title = paper_study(&request.key).map_or(request.key.as_str(), |study| study.card().title);
            match outcome {
                StudyOutcome::Finished => {
                    notices.info(format!("Study finished: {title}."));
                    if request.key == self.chosen.card().key {
                        (self.origin, self.figure) = (Some(StudyOrigin::Run(request.size)), 0);
                    }
                }
                StudyOutcome::Stopped => notices.info(format!("Study stopped: {title}. Run it again to resume.")),
                StudyOutcome::Withdrawn => {}
                StudyOutcome::Failed(cause) => notices.error(format!("Study {title} failed: {cause}")),
            }
            self.reported = *number;
            self.asked.pop_front();
        }
    }

    /// Applies an action; what follows for the inspection.
    pub(in crate::app) fn apply(&mut self, action: StudyAction, notices: &mut Notices) -> Vec<InspectAction> {
        match action {
            // A run looks at its end, and other panels may have asked already.
            StudyAction::Look if self.student.is_settled() => self.student.ask(StudentCommand::Look),
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
            StudyAction::Run(request) if self.asked.iter().any(|asked| asked.key == request.key) => {
                notices.info("This study is running or waits already.".to_owned());
            }
            StudyAction::Run(request) => {
                self.asked.push_back(request.clone());
                self.student.ask(StudentCommand::Run(request));
            }
            StudyAction::Stop => self.student.give_up(),
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
