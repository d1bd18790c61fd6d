//! Label worker: a thread "label" that owns the store, handles commands and publishes labels, plan and journal. The
//! window never waits for the disk.

use super::job::JobError;
use super::messages::{Notice, Wake};
use super::own_store::OwnStore;
use super::worker::Worker;
use crate::labelling::{Disagreement, disagreements};
use palpate_store::labels::{LabelError, LabelPlan, LabelledTrial, NextTrial, Progress, TrialEdit};
use palpate_store::{JournalEntry, LabelRevision, Store, StoreError};
use palpate_tactile::trial::TrialId;
use std::path::PathBuf;
use std::time::Duration;

/// Command to the label worker.
#[derive(Clone, Debug, PartialEq)]
pub enum LabelCommand {
    /// Read the store again.
    Refresh,
    /// Change a trial; can be undone.
    Edit(TrialId, TrialEdit),
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
    /// Remove all objects from the plan.
    ClearPlan,
    /// Record this trial of the plan next.
    Next(NextTrial),
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

/// Time between two checks for changes by other programs.
pub(super) const GLANCE: Duration = Duration::from_millis(250);
/// Number of journal entries shown.
const ENTRIES: usize = 60;
/// Handle of the thread.
pub type LabelWorker = Worker<LabelCommand, LabelView>;

impl LabelWorker {
    /// Starts the thread on a store, which is opened when it is first needed.
    pub fn start(path: PathBuf, wake: Wake) -> std::io::Result<Self> {
        Self::spawn("label", "the label service", wake, move |inbox, publisher| {
            let mut service = LabelService { store: OwnStore::new(path), seen: None, chosen: None };
            let mut patience = None;
            while let Ok(command) = inbox.next(patience) {
                patience = Some(GLANCE);
                let mut notices = Vec::new();
                match command.map(|command| service.handle(&command)) {
                    None if !service.has_changed() => continue,
                    None => {}
                    Some(Ok(text)) => notices.extend(text.map(Notice::Info)),
                    Some(Err(cause)) => notices.push(Notice::Failed(cause.to_string())),
                }
                let view = service.view().unwrap_or_else(|cause| {
                    notices.push(Notice::Failed(cause.to_string()));
                    LabelView::default()
                });
                publisher.publish_with(view, service.store.warnings.drain(..).map(Notice::Warning).chain(notices));
            }
        })
    }
}

/// State of the thread.
struct LabelService {
    store: OwnStore,
    /// What the view shows, as [`palpate_store::LabelRepository::revision`] counts.
    seen: Option<LabelRevision>,
    /// The next trial that was chosen, until it is recorded.
    chosen: Option<NextTrial>,
}

impl LabelService {
    /// True when another program or thread has changed what the view shows.
    fn has_changed(&mut self) -> bool {
        let revision = self.store.opened().map(|store| store.labels().revision());
        // A store that cannot be read just now can be read at the next glance.
        revision.and_then(Result::ok).is_some_and(|revision| self.seen.as_ref() != Some(&revision))
    }

    /// Handles a command; returns its outcome where it is worth a notice.
    fn handle(&mut self, command: &LabelCommand) -> Result<Option<String>, JobError> {
        let store = self.store.open()?;
        let undone = |entry: JournalEntry| format!("Undone: {}", entry.sentence());
        let redone = |entry: JournalEntry| format!("Redone: {}", entry.restored());
        let outcome = |text: Option<String>, none: &str| Some(text.unwrap_or_else(|| none.to_owned()));
        let done = match command {
            LabelCommand::Refresh => Ok(None),
            LabelCommand::Edit(id, edit) => {
                let discarded = || format!("trial {id} discarded; Ctrl+Z brings it back");
                store.labels().edit(&[*id], edit).map(|_edited| (*edit == TrialEdit::Discard).then(discarded))
            }
            LabelCommand::Reviewed(id) => store.labels().mark_reviewed(*id).map(|()| None),
            LabelCommand::Undo => store.journal().undo().map(|entry| outcome(entry.map(undone), "Nothing to undo")),
            LabelCommand::Redo => store.journal().redo().map(|entry| outcome(entry.map(redone), "Nothing to redo")),
            LabelCommand::Want(name, wanted) => change_plan(store, |plan| plan.set(name, *wanted)).map(|()| None),
            LabelCommand::Unplan(name) => change_plan(store, |plan| plan.remove(name)).map(|()| None),
            LabelCommand::ClearPlan => {
                let clear = |plan: &mut LabelPlan| {
                    plan.objects.clear();
                    Ok(())
                };
                change_plan(store, clear).map(|()| None)
            }
            LabelCommand::Next(next) => {
                self.chosen = Some(next.clone());
                Ok(None)
            }
        };
        Ok(done?)
    }

    fn view(&mut self) -> Result<LabelView, StoreError> {
        let store = self.store.open()?;
        let seen = store.labels().revision()?;
        let mut trials = store.labels().trials()?;
        let progress = store.labels().plan()?.progress(&trials);
        trials.sort_by_key(|trial| std::cmp::Reverse(trial.id));
        let last = trials.iter().find(|trial| trial.counts()).and_then(|trial| trial.object.as_deref());
        self.chosen.take_if(|chosen| !progress.objects.iter().any(|object| object.next() == *chosen));
        let next = self.chosen.clone().or_else(|| progress.next(last));
        let journal = store.journal().entries(ENTRIES)?;
        self.seen = Some(seen);
        Ok(LabelView { disagreements: disagreements(&trials), trials, progress, next, journal })
    }
}

fn change_plan(
    store: &mut Store,
    change: impl FnOnce(&mut LabelPlan) -> Result<(), LabelError>,
) -> Result<(), StoreError> {
    let mut plan = store.labels().plan()?;
    change(&mut plan)?;
    store.labels().set_plan(&plan)
}

#[cfg(test)]
mod tests {
    use super::super::job::watch::waker;
    use super::super::worker::watch::{shown, told};
    use super::*;
    use palpate_sim::objects::{EMPTY, object_title};
    use palpate_sim::scene::Scene;
    use palpate_store::BoardInfo;
    use palpate_tactile::trial::TrialHeader;
    use std::sync::mpsc::Receiver;

    /// Waits for a notice that meets a condition.
    fn told_of(labels: &LabelWorker, woken: &Receiver<()>, wanted: impl Fn(&Notice) -> bool) {
        while !wanted(&told(labels, woken)) {}
    }

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
        let labels = LabelWorker::start(path, wake).expect("starts");
        labels.send(LabelCommand::Refresh);
        let first = shown(&labels, &woken, |view| view.trials.len() == 2);
        assert_eq!((first.unlabelled().map(|trial| trial.id), first.progress.done()), (Some(ids[1]), 0));
        let next = first.next.clone().expect("all is to be done").object;
        labels.send(LabelCommand::Edit(ids[1], TrialEdit::Label(next.clone())));
        let labelled = shown(&labels, &woken, |view| view.progress.done() == 1);
        assert_eq!(labelled.unlabelled().map(|trial| trial.id), Some(ids[0]));
        assert_ne!(labelled.next.as_ref().map(|n| n.object.clone()), Some(next.clone()), "never twice in a row");
        labels.send(LabelCommand::Edit(ids[0], TrialEdit::Discard));
        shown(&labels, &woken, |view| view.unlabelled().is_none());
        for _ in 0..2 {
            labels.send(LabelCommand::Undo);
        }
        labels.send(LabelCommand::Redo);
        let is_done = |begin: &'static str, end: String| {
            let is_it = move |text: &str| text.starts_with(begin) && text.ends_with(&end);
            move |notice: &Notice| matches!(notice, Notice::Info(text) if is_it(text))
        };
        told_of(&labels, &woken, is_done("Redone: ", format!("labelled {}", object_title(&next))));
        labels.send(LabelCommand::Undo);
        shown(&labels, &woken, |view| view.progress.done() == 0 && view.unlabelled().is_some());
        told_of(&labels, &woken, is_done("Undone: ", String::new()));
        labels.send(LabelCommand::Want("mug".to_owned(), 3));
        let planned =
            shown(&labels, &woken, |view| view.progress.objects.iter().any(|o| o.name == "mug" && o.wanted == 3));
        // One that is chosen is the next until it is recorded.
        let mug = planned.progress.objects.iter().find(|object| object.name == "mug").expect("planned");
        labels.send(LabelCommand::Next(mug.next()));
        let is_next =
            |view: &LabelView| view.next.as_ref().is_some_and(|next| next.object == "mug" && next.number == 1);
        shown(&labels, &woken, is_next);
        labels.send(LabelCommand::Edit(ids[1], TrialEdit::Label(EMPTY.to_owned())));
        shown(&labels, &woken, |view| is_next(view) && view.unlabelled().is_some_and(|trial| trial.id == ids[0]));
        labels.send(LabelCommand::Edit(ids[1], TrialEdit::Label("mug".to_owned())));
        shown(&labels, &woken, |view| !is_next(view) && view.next.as_ref().is_some_and(|next| next.object != "mug"));
        labels.send(LabelCommand::Want("mug".to_owned(), 0));
        told_of(&labels, &woken, |notice| matches!(notice, Notice::Failed(_)));
        labels.send(LabelCommand::Edit(99, TrialEdit::Label("mug".to_owned())));
        told_of(&labels, &woken, |notice| matches!(notice, Notice::Failed(text) if text.contains("99")));
    }

    #[test]
    fn changes_by_others_are_shown_without_a_command() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("s.sqlite");
        let mut theirs = Store::open(&path).expect("opens");
        let (wake, woken) = waker();
        let labels = LabelWorker::start(path, wake).expect("starts");
        labels.send(LabelCommand::Refresh);
        shown(&labels, &woken, |view| view.trials.is_empty());
        let id = recorded(&mut theirs);
        shown(&labels, &woken, |view| view.unlabelled().is_some_and(|trial| trial.id == id));
        theirs.labels().set_label(id, "mug").expect("labels");
        let labelled = shown(&labels, &woken, |view| view.unlabelled().is_none());
        assert_eq!(labelled.journal[0].sentence(), format!("trial {id}: labelled mug"));
        theirs.delete(&[id]).expect("discards");
        shown(&labels, &woken, |view| view.trials.iter().all(|trial| trial.discarded));
        theirs.purge().expect("purges");
        shown(&labels, &woken, |view| view.trials.is_empty());
    }
}
