//! The trial library in the window: its query and the selection of trials; hands edits to the [`LibraryWorker`].

use crate::app::features::inspect::InspectAction;
use crate::app::notices::Notices;
use palpate_lab::workers::{LibraryCommand, LibraryView, LibraryWorker};
use palpate_store::labels::TrialEdit;
use palpate_store::{LibraryTrial, TrialQuery};
use palpate_tactile::trial::TrialId;
use std::collections::BTreeSet;
use std::sync::Arc;

/// How a click or key changes the selection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reach {
    /// This trial alone.
    Alone,
    /// This trial is added or taken out.
    Toggle,
    /// All from the last trial selected alone.
    Range,
}

/// Action on the library.
#[derive(Clone, Debug, PartialEq)]
pub enum LibraryAction {
    /// Show the trials that match.
    Find(TrialQuery),
    /// Move the keyboard to the search field, and add text typed ahead.
    FocusSearch(String),
    /// The search field has the keyboard.
    SearchFocused,
    /// Select a trial.
    Select(TrialId, Reach),
    /// Select the trial this many rows further; with true also those between.
    Step(isize, bool),
    /// Select all trials that were found.
    SelectAll,
    /// Make sparklines of these trials, which are in sight.
    Draw(Vec<TrialId>),
    /// Change the selected trials.
    Edit(TrialEdit),
    /// Move this trial from the demo log to the store.
    Keep(TrialId),
    /// Export the selected trials as CSV, into a folder beside the store.
    Export,
    /// Open the trial selected last.
    Open,
    /// Pin the selected trials for comparison.
    Pin,
}

/// Query and selection.
#[derive(Clone, Debug, Default)]
pub struct LibrarySelection {
    /// Query as it was asked last; the answer may be on its way.
    pub query: TrialQuery,
    /// The search field should get the cursor.
    pub focus_search: bool,
    /// Selected trials.
    pub selected: BTreeSet<TrialId>,
    /// Trial selected last.
    pub cursor: Option<TrialId>,
    /// The selected trials in the order of the list, as of the last look.
    pub trials: Vec<Arc<LibraryTrial>>,
    /// Trial from which a range reaches.
    anchor: Option<TrialId>,
}

impl LibrarySelection {
    fn select(&mut self, found: &[Arc<LibraryTrial>], id: TrialId, reach: Reach) {
        let place = |wanted: TrialId| found.iter().position(|trial| trial.row.id == wanted);
        match reach {
            Reach::Alone => {
                self.selected = BTreeSet::from([id]);
                self.anchor = Some(id);
            }
            Reach::Toggle => {
                if !self.selected.remove(&id) {
                    self.selected.insert(id);
                }
                self.anchor = Some(id);
            }
            Reach::Range => {
                let from = self.anchor.and_then(place).or_else(|| place(id));
                if let (Some(from), Some(to)) = (from, place(id)) {
                    let range = &found[from.min(to)..=from.max(to)];
                    self.selected = range.iter().map(|trial| trial.row.id).collect();
                }
            }
        }
        self.cursor = Some(id);
    }

    fn step(&mut self, found: &[Arc<LibraryTrial>], by: isize, range: bool) {
        let now = self.cursor.and_then(|id| found.iter().position(|trial| trial.row.id == id));
        let place = now.map_or(0, |place| place.saturating_add_signed(by).min(found.len().saturating_sub(1)));
        if let Some(trial) = found.get(place) {
            self.select(found, trial.row.id, if range { Reach::Range } else { Reach::Alone });
        }
    }

    /// Looks at the selected trials again, and forgets those that are not found any more.
    fn look(&mut self, found: &[Arc<LibraryTrial>]) {
        let selected = |trial: &&Arc<LibraryTrial>| self.selected.contains(&trial.row.id);
        self.trials =
            if self.selected.is_empty() { Vec::new() } else { found.iter().filter(selected).cloned().collect() };
        self.selected = self.trials.iter().map(|trial| trial.row.id).collect();
        self.cursor = self.cursor.filter(|id| found.iter().any(|trial| trial.row.id == *id));
    }
}

/// State of the library in the window.
pub(in crate::app) struct LibraryFeature {
    worker: LibraryWorker,
    selection: LibrarySelection,
    /// Trials at the last look.
    seen: Option<Arc<[Arc<LibraryTrial>]>>,
    /// Trial kept last.
    kept: Option<TrialId>,
}

impl LibraryFeature {
    pub(in crate::app) fn new(worker: LibraryWorker) -> Self {
        Self { worker, selection: LibrarySelection::default(), seen: None, kept: None }
    }

    pub(in crate::app) fn view(&self) -> Option<Arc<LibraryView>> {
        self.worker.view()
    }

    /// Changes a trial.
    pub(in crate::app) fn edit(&self, id: TrialId, edit: TrialEdit) {
        self.worker.send(LibraryCommand::Edit(vec![id], edit));
    }

    /// Trial that was moved from the demo log to the store last.
    pub(in crate::app) fn kept(&self) -> Option<TrialId> {
        self.kept
    }

    pub(in crate::app) fn selection(&self) -> &LibrarySelection {
        &self.selection
    }

    /// Shows outcomes, and forgets trials that are gone.
    pub(in crate::app) fn gather(&mut self, notices: &mut Notices) {
        let Some(view) = self.worker.view() else { return };
        if self.seen.as_ref().is_none_or(|seen| !Arc::ptr_eq(seen, &view.found)) {
            self.selection.look(&view.found);
            self.seen = Some(Arc::clone(&view.found));
        }
        self.worker.notices().for_each(|notice| notices.show(notice));
    }

    /// Applies an action; what follows for the inspection.
    pub(in crate::app) fn apply(&mut self, action: LibraryAction) -> Vec<InspectAction> {
        let found = self.seen.clone().unwrap_or_default();
        let selects = matches!(action, LibraryAction::Select(..) | LibraryAction::Step(..) | LibraryAction::SelectAll);
        let selected: Vec<TrialId> = self.selection.selected.iter().copied().collect();
        match action {
            // The first answer is on its way.
            LibraryAction::Find(query) if query == self.selection.query && !self.worker.is_settled() => {}
            LibraryAction::Find(query) => {
                self.selection.query = query.clone();
                self.worker.send(LibraryCommand::Find(query));
            }
            LibraryAction::FocusSearch(typed) => {
                self.selection.focus_search = true;
                if !typed.is_empty() {
                    self.selection.query.search.push_str(&typed);
                    self.worker.send(LibraryCommand::Find(self.selection.query.clone()));
                }
            }
            LibraryAction::SearchFocused => self.selection.focus_search = false,
            LibraryAction::Select(id, reach) => self.selection.select(&found, id, reach),
            LibraryAction::Step(by, range) => self.selection.step(&found, by, range),
            LibraryAction::SelectAll => {
                self.selection.selected = found.iter().map(|trial| trial.row.id).collect();
            }
            LibraryAction::Draw(ids) => _ = self.worker.send(LibraryCommand::Draw(ids)),
            LibraryAction::Edit(edit) => {
                if !self.selection.selected.is_empty() {
                    self.worker.send(LibraryCommand::Edit(selected, edit));
                }
            }
            LibraryAction::Keep(id) => {
                self.edit(id, TrialEdit::Keep);
                self.kept = Some(id);
            }
            LibraryAction::Export => _ = self.worker.send(LibraryCommand::Export(selected)),
            LibraryAction::Open => return self.selection.cursor.map(InspectAction::Open).into_iter().collect(),
            LibraryAction::Pin => return selected.into_iter().map(InspectAction::Pin).collect(),
        }
        if selects {
            self.selection.look(&found);
        }
        Vec::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_sim::scene::Scene;
    use palpate_store::{BoardInfo, Library, Store};
    use palpate_tactile::trial::TrialHeader;

    fn found() -> Vec<Arc<LibraryTrial>> {
        let folder = tempfile::tempdir().expect("a folder");
        let mut store = Store::open(&folder.path().join("s.sqlite")).expect("opens");
        for _ in 0..6 {
            store.begin_board(&TrialHeader::new("", Scene::default()), &BoardInfo::default()).expect("begins");
        }
        // The newest first: 6, 5 .. 1.
        Library::read(&store).and_then(|library| library.find(&store, &TrialQuery::default())).expect("reads")
    }

    fn selected(selection: &LibrarySelection) -> Vec<TrialId> {
        selection.selected.iter().copied().collect()
    }

    #[test]
    fn clicks_and_keys_select_as_in_other_lists() {
        let found = found();
        let mut selection = LibrarySelection::default();
        selection.select(&found, 5, Reach::Alone);
        selection.select(&found, 2, Reach::Range);
        assert_eq!(selected(&selection), [2, 3, 4, 5]);
        // The range still reaches from the same trial.
        selection.select(&found, 6, Reach::Range);
        assert_eq!(selected(&selection), [5, 6]);
        selection.select(&found, 1, Reach::Toggle);
        selection.select(&found, 6, Reach::Toggle);
        assert_eq!((selected(&selection), selection.cursor), (vec![1, 5], Some(6)));
        selection.step(&found, 1, false);
        assert_eq!((selected(&selection), selection.cursor), (vec![5], Some(5)));
        selection.step(&found, 1, true);
        selection.step(&found, 1, true);
        assert_eq!(selected(&selection), [3, 4, 5]);
        selection.step(&found, -1, true);
        assert_eq!(selected(&selection), [4, 5]);
        selection.step(&found, 99, false);
        assert_eq!(selected(&selection), [1]);
        selection.look(&found[..3]);
        assert_eq!((selected(&selection), selection.cursor), (vec![], None));
        selection.step(&found, 1, false);
        assert_eq!(selected(&selection), [6], "without a cursor at the top");
    }
}
