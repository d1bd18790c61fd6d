//! Labels, plan and journal for a window: a thread "label" that holds the store, does what is asked, and publishes what
//! there is. The window never waits for the disk.

use super::background_job::{BackgroundJob, Outlet};
use super::messages::Wake;
use crate::labelling::{Disagreement, disagreements};
use palpate_store::labels::{LabelledTrial, NextTrial, Progress};
use palpate_store::{Exported, JournalEntry, Store, StoreError, export_labelled};
use palpate_tactile::trial::TrialId;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};

/// What can be asked for.
#[derive(Clone, Debug, PartialEq)]
pub enum LabelCommand {
    /// Look at the store anew.
    Refresh,
    /// Say what a trial is of.
    Label(TrialId, String),
    /// Throw a trial away; it can be taken back.
    Discard(TrialId),
    /// Say something about a trial.
    Note(TrialId, String),
    /// Give a trial these tags.
    Tags(TrialId, Vec<String>),
    /// Whether its label is a guess.
    Unsure(TrialId, bool),
    /// Its label has been looked at again and stays.
    Reviewed(TrialId),
    /// Take the last change back.
    Undo,
    /// Make the change again that was taken back last.
    Redo,
    /// So many trials of an object are wanted.
    Want(String, u32),
    /// An object leaves the plan; its trials stay.
    Unplan(String),
    /// Write all labelled trials into a folder that does not exist or is empty.
    Export(PathBuf),
}

/// What there is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LabelView {
    /// All trials of the real gripper, newest first; discarded ones too.
    pub trials: Vec<LabelledTrial>,
    /// How far the plan is.
    pub progress: Progress,
    /// What to take next; none when all is done.
    pub next: Option<NextTrial>,
    /// Trials whose label is not what the model saw, surest first.
    pub disagreements: Vec<Disagreement>,
    /// What was changed last, newest first.
    pub journal: Vec<JournalEntry>,
    /// What came of commands, oldest first, numbered: a sentence, or why it was not done.
    pub told: Vec<(u64, Result<String, String>)>,
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

/// Entries of the journal that are shown.
const ENTRIES: usize = 60;
/// Outcomes that are kept for a window that looks seldom.
const OUTCOMES: usize = 16;

/// The handle.
pub type Labeller = BackgroundJob<LabelCommand, LabelView>;

/// Starts the thread on a store, which is opened when it is first needed.
pub fn start_labeller(path: PathBuf, wake: Wake) -> std::io::Result<Labeller> {
    let mut clerk = Clerk { path, store: None, told: VecDeque::new(), number: 0 };
    BackgroundJob::spawn("label", wake, move |command: LabelCommand, _stop, outlet: &Outlet<LabelView>| {
        let outcome = clerk.grant(&command);
        clerk.tell(outcome);
        let view = clerk.view().unwrap_or_else(|cause| {
            clerk.tell(Some(Err(cause)));
            LabelView { told: clerk.told.iter().cloned().collect(), ..LabelView::default() }
        });
        outlet.publish(view);
    })
}

/// Whoever keeps the labels.
struct Clerk {
    path: PathBuf,
    store: Option<Store>,
    told: VecDeque<(u64, Result<String, String>)>,
    number: u64,
}

impl Clerk {
    fn store(&mut self) -> Result<&mut Store, String> {
        match &mut self.store {
            Some(store) => Ok(store),
            empty @ None => Ok(empty.insert(Store::open(&self.path).map_err(|error| error.to_string())?)),
        }
    }

    fn tell(&mut self, outcome: Option<Result<String, String>>) {
        let Some(outcome) = outcome else { return };
        self.number += 1;
        self.told.push_back((self.number, outcome));
        if self.told.len() > OUTCOMES {
            self.told.pop_front();
        }
    }

    /// Does what is asked; what is worth saying of it.
    fn grant(&mut self, command: &LabelCommand) -> Option<Result<String, String>> {
        let store = match self.store() {
            Ok(store) => store,
            Err(cause) => return Some(Err(cause)),
        };
        let undone = |entry: JournalEntry| format!("taken back: {}", entry.sentence());
        let redone = |entry: JournalEntry| format!("made again: {}", entry.restored());
        let told = |text: Option<String>, none: &str| Some(text.unwrap_or_else(|| none.to_owned()));
        let done: Result<Option<String>, StoreError> = match command {
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
            LabelCommand::Undo => store.journal().undo().map(|entry| told(entry.map(undone), "nothing to take back")),
            LabelCommand::Redo => store.journal().redo().map(|entry| told(entry.map(redone), "nothing to make again")),
            LabelCommand::Want(name, wanted) => {
                return change_plan(store, |plan| plan.set(name, *wanted)).err().map(Err);
            }
            LabelCommand::Unplan(name) => return change_plan(store, |plan| plan.remove(name)).err().map(Err),
            LabelCommand::Export(folder) => return Some(exported(store, folder)),
        };
        done.map_err(|error| error.to_string()).transpose()
    }

    fn view(&mut self) -> Result<LabelView, String> {
        let told = self.told.iter().cloned().collect();
        let store = self.store()?;
        let read = |store: &Store| -> Result<LabelView, StoreError> {
            let mut trials = store.labels().trials()?;
            let progress = store.labels().plan()?.progress(&trials);
            trials.sort_by_key(|trial| std::cmp::Reverse(trial.id));
            let last = trials.iter().find(|trial| trial.counts()).and_then(|trial| trial.object.as_deref());
            let next = progress.next(last);
            let journal = store.journal().entries(ENTRIES)?;
            Ok(LabelView { disagreements: disagreements(&trials), trials, progress, next, journal, told })
        };
        read(store).map_err(|error| error.to_string())
    }
}

fn exported(store: &Store, folder: &Path) -> Result<String, String> {
    let exported = export_labelled(store, folder).map_err(|error| error.to_string())?;
    let Exported { folder, trials, derived, left_out } = exported;
    let missing = match left_out.first() {
        Some((id, why)) => format!("; {} without signals, such as trial {id}: {why}", left_out.len()),
        None => String::new(),
    };
    Ok(format!("{trials} labelled trials exported into {}, {derived} with signals{missing}", folder.display()))
}

fn change_plan<E: std::fmt::Display>(
    store: &mut Store,
    change: impl FnOnce(&mut palpate_store::labels::LabelPlan) -> Result<(), E>,
) -> Result<(), String> {
    let mut plan = store.labels().plan().map_err(|error| error.to_string())?;
    change(&mut plan).map_err(|error| error.to_string())?;
    store.labels().set_plan(&plan).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::super::background_job::watch::{until, waker};
    use super::*;
    use palpate_sim::scene::Scene;
    use palpate_store::BoardInfo;
    use palpate_tactile::trial::TrialHeader;

    fn recorded(store: &mut Store) -> TrialId {
        let header = TrialHeader::new("", Scene::default());
        let id = store.begin_board(&header, &BoardInfo::default()).expect("begins");
        store.finish_board(id, &BoardInfo::default(), &[]).expect("ends");
        id
    }

    #[test]
    fn labels_are_given_taken_back_and_counted() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("s.sqlite");
        let mut store = Store::open(&path).expect("opens");
        let ids = [recorded(&mut store), recorded(&mut store)];
        let (wake, woken) = waker();
        let desk = start_labeller(path, wake).expect("starts");
        desk.ask(LabelCommand::Refresh);
        let first = until(&desk, &woken, |view| view.trials.len() == 2);
        assert_eq!((first.unlabelled().map(|trial| trial.id), first.progress.done()), (Some(ids[1]), 0));
        let next = first.next.clone().expect("all is to be done").object;
        desk.ask(LabelCommand::Label(ids[1], next.clone()));
        let labelled = until(&desk, &woken, |view| view.progress.done() == 1);
        assert_eq!(labelled.unlabelled().map(|trial| trial.id), Some(ids[0]));
        assert_ne!(labelled.next.as_ref().map(|n| n.object.clone()), Some(next.clone()), "never twice in a row");
        desk.ask(LabelCommand::Discard(ids[0]));
        until(&desk, &woken, |view| view.unlabelled().is_none());
        for _ in 0..2 {
            desk.ask(LabelCommand::Undo);
        }
        desk.ask(LabelCommand::Redo);
        until(&desk, &woken, |view| {
            view.told.iter().any(|(_, told)| {
                told.as_ref().is_ok_and(|text| {
                    text.starts_with("made again: ") && text.ends_with(&format!("label unlabelled -> {next}"))
                })
            })
        });
        desk.ask(LabelCommand::Undo);
        let back = until(&desk, &woken, |view| view.progress.done() == 0 && view.unlabelled().is_some());
        assert!(back.told.iter().any(|(_, told)| told.as_ref().is_ok_and(|text| text.starts_with("taken back: "))));
        desk.ask(LabelCommand::Want("mug".to_owned(), 3));
        until(&desk, &woken, |view| view.progress.objects.iter().any(|o| o.name == "mug" && o.wanted == 3));
        desk.ask(LabelCommand::Want("mug".to_owned(), 0));
        until(&desk, &woken, |view| view.told.iter().any(|(_, told)| told.is_err()));
        desk.ask(LabelCommand::Label(99, "mug".to_owned()));
        let refused = until(&desk, &woken, |view| view.told.iter().filter(|(_, told)| told.is_err()).count() == 2);
        assert!(format!("{:?}", refused.told).contains("99"), "{:?}", refused.told);
    }
}
