//! Label service: a thread "label" that owns the store, handles commands and publishes labels, plan and journal. The
//! window never waits for the disk.

use super::background_job::{BackgroundJob, Outlet};
use super::messages::Wake;
use crate::labelling::{Disagreement, disagreements};
use palpate_store::labels::{LabelPlan, LabelledTrial, NextTrial, PlanError, Progress};
use palpate_store::{ExportError, Exported, JournalEntry, LabelRevision, Store, StoreError, export_labelled};
use palpate_tactile::trial::TrialId;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// Command to the label service.
#[derive(Clone, Debug, PartialEq)]
pub enum LabelCommand {
    /// Read the store again.
    Refresh,
    /// Label a trial.
    Label(TrialId, String),
    /// Discard a trial; can be undone.
    Discard(TrialId),
    /// Set the note of a trial.
    Note(TrialId, String),
    /// Set the tags of a trial.
    Tags(TrialId, Vec<String>),
    /// Mark the label as unsure.
    Unsure(TrialId, bool),
    /// Mark the label as reviewed.
    Reviewed(TrialId),
    /// Undo the last change.
    Undo,
    /// Redo the change undone last.
    Redo,
    /// Set the number of trials planned for an object.
    Want(String, u32),
    /// Remove an object from the plan; its trials stay.
    Unplan(String),
    /// Write all labelled trials into a folder that does not exist or is empty.
    Export(PathBuf),
}

/// Error of a label command.
#[derive(Debug, thiserror::Error)]
pub enum LabelError {
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The export failed.
    #[error(transparent)]
    Export(#[from] ExportError),
}

/// Outcome of a label command, for a notice.
#[derive(Clone, Debug)]
pub enum LabelOutcome {
    /// It is done, in a sentence.
    Done(String),
    /// Warning from opening the store.
    Warning(String),
    /// It failed.
    Failed(Arc<LabelError>),
}

/// Contents of the store, for display.
#[derive(Clone, Debug, Default)]
pub struct LabelView {
    /// All trials of the real gripper, newest first; discarded ones too.
    pub trials: Vec<LabelledTrial>,
    /// Progress of the plan.
    pub progress: Progress,
    /// Next object to record; none when the plan is complete.
    pub next: Option<NextTrial>,
    /// Trials whose label differs from the prediction, most certain first.
    pub disagreements: Vec<Disagreement>,
    /// Last changes, newest first.
    pub journal: Vec<JournalEntry>,
    /// Outcomes of commands, oldest first, numbered.
    pub outcomes: Vec<(u64, LabelOutcome)>,
}

impl LabelView {
    /// The newest trial that has no label yet.
    pub fn unlabelled(&self) -> Option<&LabelledTrial> {
        self.trials.iter().find(|trial| trial.complete && !trial.discarded && trial.object.is_none())
    }

    /// A trial by its number.
    pub fn trial(&self, id: TrialId) -> Option<&LabelledTrial> {
        self.trials.iter().find(|trial| trial.id == id)
    }
}

/// Time between two glances at changes by other programs.
pub(super) const GLANCE: Duration = Duration::from_millis(250);
/// Number of journal entries shown.
const ENTRIES: usize = 60;
/// Outcomes kept for a slow window.
const OUTCOMES: usize = 16;

/// The handle.
pub type Labeller = BackgroundJob<LabelCommand, LabelView>;

/// Starts the thread on a store, which is opened when it is first needed.
pub fn start_labeller(path: PathBuf, wake: Wake) -> std::io::Result<Labeller> {
    let mut service = LabelService { path, store: None, seen: None, outcomes: VecDeque::new(), number: 0 };
    BackgroundJob::spawn_idling("label", wake, move |command, _stop, outlet: &Outlet<LabelView>| {
        match command.map(|command| service.handle(&command)) {
            None if !service.has_changed() => return Some(GLANCE),
            None => {}
            Some(Ok(text)) => text.into_iter().for_each(|text| service.report(LabelOutcome::Done(text))),
            Some(Err(cause)) => service.report(LabelOutcome::Failed(Arc::new(cause))),
        }
        let view = service.view().unwrap_or_else(|cause| {
            service.report(LabelOutcome::Failed(Arc::new(cause.into())));
            LabelView { outcomes: service.outcomes.iter().cloned().collect(), ..LabelView::default() }
        });
        outlet.publish(view);
        Some(GLANCE)
    })
}

/// State of the thread.
struct LabelService {
    path: PathBuf,
    store: Option<Store>,
    /// What the view shows, as [`palpate_store::LabelRepository::revision`] counts.
    seen: Option<LabelRevision>,
    outcomes: VecDeque<(u64, LabelOutcome)>,
    number: u64,
}

impl LabelService {
    fn store(&mut self) -> Result<&mut Store, StoreError> {
        let store = match self.store.take() {
            Some(store) => store,
            None => {
                let store = Store::open(&self.path)?;
                store.warnings().iter().for_each(|warning| self.report(LabelOutcome::Warning(warning.clone())));
                store
            }
        };
        Ok(self.store.insert(store))
    }

    fn report(&mut self, outcome: LabelOutcome) {
        self.number += 1;
        self.outcomes.push_back((self.number, outcome));
        if self.outcomes.len() > OUTCOMES {
            self.outcomes.pop_front();
        }
    }

    /// True when another program or thread has changed what the view shows.
    fn has_changed(&mut self) -> bool {
        let revision = self.store.as_ref().map(|store| store.labels().revision());
        // A store that cannot be read just now can be read at the next glance.
        revision.and_then(Result::ok).is_some_and(|revision| self.seen.as_ref() != Some(&revision))
    }

    /// Handles a command; returns its outcome where it is worth a notice.
    fn handle(&mut self, command: &LabelCommand) -> Result<Option<String>, LabelError> {
        let store = self.store()?;
        let undone = |entry: JournalEntry| format!("undone: {}", entry.sentence());
        let redone = |entry: JournalEntry| format!("redone: {}", entry.restored());
        let outcome = |text: Option<String>, none: &str| Some(text.unwrap_or_else(|| none.to_owned()));
        let done = match command {
            LabelCommand::Refresh => Ok(None),
            LabelCommand::Label(id, object) => store.labels().set_label(*id, object).map(|()| None),
            LabelCommand::Discard(id) => {
                let text = format!("trial {id} discarded; Ctrl+Z brings it back");
                store.delete(&[*id]).map(|()| Some(text))
            }
            LabelCommand::Note(id, note) => store.labels().set_note(*id, note).map(|()| None),
            LabelCommand::Tags(id, tags) => store.labels().set_tags(*id, tags).map(|()| None),
            LabelCommand::Unsure(id, unsure) => store.labels().set_unsure(*id, *unsure).map(|()| None),
            LabelCommand::Reviewed(id) => store.labels().mark_reviewed(*id).map(|()| None),
            LabelCommand::Undo => store.journal().undo().map(|entry| outcome(entry.map(undone), "nothing to undo")),
            LabelCommand::Redo => store.journal().redo().map(|entry| outcome(entry.map(redone), "nothing to redo")),
            LabelCommand::Want(name, wanted) => change_plan(store, |plan| plan.set(name, *wanted)).map(|()| None),
            LabelCommand::Unplan(name) => change_plan(store, |plan| plan.remove(name)).map(|()| None),
            LabelCommand::Export(folder) => return Ok(Some(exported(store, folder)?)),
        };
        Ok(done?)
    }

    fn view(&mut self) -> Result<LabelView, StoreError> {
        let outcomes = self.outcomes.iter().cloned().collect();
        let store = self.store()?;
        let seen = store.labels().revision()?;
        let mut trials = store.labels().trials()?;
        let progress = store.labels().plan()?.progress(&trials);
        trials.sort_by_key(|trial| std::cmp::Reverse(trial.id));
        let last = trials.iter().find(|trial| trial.counts()).and_then(|trial| trial.object.as_deref());
        let next = progress.next(last);
        let journal = store.journal().entries(ENTRIES)?;
        self.seen = Some(seen);
        Ok(LabelView { disagreements: disagreements(&trials), trials, progress, next, journal, outcomes })
    }
}

fn exported(store: &Store, folder: &Path) -> Result<String, ExportError> {
    let Exported { folder, trials, derived, left_out } = export_labelled(store, folder)?;
    let missing = match left_out.first() {
        Some((id, why)) => format!("; {} without signals, such as trial {id}: {why}", left_out.len()),
        None => String::new(),
    };
    Ok(format!("{trials} labelled trials exported into {}, {derived} with signals{missing}", folder.display()))
}

fn change_plan(
    store: &mut Store,
    change: impl FnOnce(&mut LabelPlan) -> Result<(), PlanError>,
) -> Result<(), StoreError> {
    let mut plan = store.labels().plan()?;
    change(&mut plan)?;
    store.labels().set_plan(&plan)
}

#[cfg(test)]
mod tests {
    use super::super::background_job::watch::{until, waker};
    use super::*;
    use palpate_sim::scene::Scene;
    use palpate_store::BoardInfo;
    use palpate_store::labels::shown_title;
    use palpate_tactile::trial::TrialHeader;

    fn recorded(store: &mut Store) -> TrialId {
        let header = TrialHeader::new("", Scene::default());
        let id = store.begin_board(&header, &BoardInfo::default()).expect("begins");
        store.finish_board(id, &BoardInfo::default(), &[]).expect("ends");
        id
    }

    #[test]
    fn labels_are_set_undone_and_counted() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("s.sqlite");
        let mut store = Store::open(&path).expect("opens");
        let ids = [recorded(&mut store), recorded(&mut store)];
        let (wake, woken) = waker();
        let labeller = start_labeller(path, wake).expect("starts");
        labeller.ask(LabelCommand::Refresh);
        let first = until(&labeller, &woken, |view| view.trials.len() == 2);
        assert_eq!((first.unlabelled().map(|trial| trial.id), first.progress.done()), (Some(ids[1]), 0));
        let next = first.next.clone().expect("all is to be done").object;
        labeller.ask(LabelCommand::Label(ids[1], next.clone()));
        let labelled = until(&labeller, &woken, |view| view.progress.done() == 1);
        assert_eq!(labelled.unlabelled().map(|trial| trial.id), Some(ids[0]));
        assert_ne!(labelled.next.as_ref().map(|n| n.object.clone()), Some(next.clone()), "never twice in a row");
        labeller.ask(LabelCommand::Discard(ids[0]));
        until(&labeller, &woken, |view| view.unlabelled().is_none());
        for _ in 0..2 {
            labeller.ask(LabelCommand::Undo);
        }
        labeller.ask(LabelCommand::Redo);
        let is_done = |view: &LabelView, begin: &str, end: &str| {
            let is = |outcome: &LabelOutcome| matches!(outcome, LabelOutcome::Done(text) if text.starts_with(begin) && text.ends_with(end));
            view.outcomes.iter().any(|(_, outcome)| is(outcome))
        };
        until(&labeller, &woken, |view| {
            is_done(view, "redone: ", &format!("label unlabelled -> {}", shown_title(&next)))
        });
        labeller.ask(LabelCommand::Undo);
        let back = until(&labeller, &woken, |view| view.progress.done() == 0 && view.unlabelled().is_some());
        assert!(is_done(&back, "undone: ", ""));
        labeller.ask(LabelCommand::Want("mug".to_owned(), 3));
        until(&labeller, &woken, |view| view.progress.objects.iter().any(|o| o.name == "mug" && o.wanted == 3));
        labeller.ask(LabelCommand::Want("mug".to_owned(), 0));
        let failures = |view: &LabelView| {
            view.outcomes.iter().filter(|(_, outcome)| matches!(outcome, LabelOutcome::Failed(_))).count()
        };
        until(&labeller, &woken, |view| failures(view) == 1);
        labeller.ask(LabelCommand::Label(99, "mug".to_owned()));
        let refused = until(&labeller, &woken, |view| failures(view) == 2);
        assert!(format!("{:?}", refused.outcomes).contains("99"), "{:?}", refused.outcomes);
    }

    #[test]
    fn changes_by_others_are_shown_without_a_command() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("s.sqlite");
        let mut theirs = Store::open(&path).expect("opens");
        let (wake, woken) = waker();
        let labeller = start_labeller(path, wake).expect("starts");
        labeller.ask(LabelCommand::Refresh);
        until(&labeller, &woken, |view| view.trials.is_empty());
        let id = recorded(&mut theirs);
        until(&labeller, &woken, |view| view.unlabelled().is_some_and(|trial| trial.id == id));
        theirs.labels().set_label(id, "mug").expect("labels");
        let labelled = until(&labeller, &woken, |view| view.unlabelled().is_none());
        assert_eq!(labelled.journal[0].sentence(), format!("trial {id}: label unlabelled -> mug"));
        theirs.delete(&[id]).expect("discards");
        until(&labeller, &woken, |view| view.trials.iter().all(|trial| trial.discarded));
        theirs.purge().expect("purges");
        until(&labeller, &woken, |view| view.trials.is_empty());
    }
}
