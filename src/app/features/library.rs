//! The trial library in the window: its query, the selection of trials, and edits of them.

use super::App;
use super::view::{Mode, ViewSource};
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

/// Query and selection.
#[derive(Clone, Debug)]
pub struct LibrarySelection {
    /// Query as it was asked last; the answer may be on its way.
    pub query: TrialQuery,
    /// The search field should get the cursor.
    pub focus_search: bool,
    pub selected: BTreeSet<TrialId>,
    /// Trial selected last.
    pub cursor: Option<TrialId>,
    /// The selected trials in the order of the list, as of the last look.
    pub trials: Vec<Arc<LibraryTrial>>,
    /// Trial that is open; it is selected where nothing else is.
    pub shown: Option<TrialId>,
    /// Trial from which a range reaches.
    anchor: Option<TrialId>,
}

impl Default for LibrarySelection {
    /// Trials of data sets are not shown at first: a study adds hundreds.
    fn default() -> Self {
        Self {
            query: TrialQuery { without_collected: true, ..TrialQuery::default() },
            focus_search: false,
            selected: BTreeSet::new(),
            cursor: None,
            trials: Vec::new(),
            shown: None,
            anchor: None,
        }
    }
}

impl LibrarySelection {
    /// Selected trials.
    pub(super) fn ids(&self) -> Vec<TrialId> {
        self.selected.iter().copied().collect()
    }

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

    /// Selects a trial that was opened, unless it is one of those selected.
    fn show(&mut self, found: &[Arc<LibraryTrial>], shown: Option<TrialId>) {
        self.shown = shown;
        if let Some(id) = shown.filter(|id| !self.selected.contains(id)) {
            self.select(found, id, Reach::Alone);
        }
        self.look(found);
    }

    /// Looks at the selected trials again, and forgets those that are not found any more.
    fn look(&mut self, found: &[Arc<LibraryTrial>]) {
        let is_found = |id: &TrialId| found.iter().any(|trial| trial.row.id == *id);
        if let Some(id) = self.shown.filter(|id| !self.selected.iter().any(is_found) && is_found(id)) {
            self.select(found, id, Reach::Alone);
        }
        let selected = |trial: &&Arc<LibraryTrial>| self.selected.contains(&trial.row.id);
        self.trials =
            if self.selected.is_empty() { Vec::new() } else { found.iter().filter(selected).cloned().collect() };
        self.selected = self.trials.iter().map(|trial| trial.row.id).collect();
        self.cursor = self.cursor.filter(is_found);
    }
}

/// State of the library in the window.
pub struct LibraryFeature {
    worker: LibraryWorker,
    /// Trials that were found, as of this frame; absent until they were asked for.
    pub(in crate::app) view: Option<Arc<LibraryView>>,
    pub(in crate::app) selection: LibrarySelection,
    /// Trials at the last look.
    seen: Arc<[Arc<LibraryTrial>]>,
    /// Trial that was moved from the demo log to the store last.
    pub(super) kept: Option<TrialId>,
}

impl LibraryFeature {
    pub(in crate::app) fn new(worker: LibraryWorker) -> Self {
        Self { worker, view: None, selection: LibrarySelection::default(), seen: Arc::default(), kept: None }
    }

    /// Shows the trials that match.
    pub fn find(&mut self, query: TrialQuery) {
        // The first answer may be on its way.
        if query != self.selection.query || self.worker.is_settled() {
            self.selection.query = query.clone();
            self.worker.send(LibraryCommand::Find(query));
        }
    }

    /// Selects a trial.
    pub fn select(&mut self, id: TrialId, reach: Reach) {
        self.selection.select(&self.seen, id, reach);
        self.selection.look(&self.seen);
    }

    /// Selects the trial this many rows further; with `range` also those between.
    pub(in crate::app) fn step(&mut self, by: isize, range: bool) {
        self.selection.step(&self.seen, by, range);
        self.selection.look(&self.seen);
    }

    /// Selects all trials that were found.
    pub fn select_all(&mut self) {
        self.selection.selected = self.seen.iter().map(|trial| trial.row.id).collect();
        self.selection.look(&self.seen);
    }

    /// Sends a command; the first answer is to the query as well.
    fn send(&self, command: LibraryCommand) {
        if self.view.is_none() {
            self.worker.send(LibraryCommand::Find(self.selection.query.clone()));
        }
        self.worker.send(command);
    }

    /// Makes sparklines of these trials, which are in sight.
    pub(in crate::app) fn draw(&self, ids: Vec<TrialId>) {
        self.send(LibraryCommand::Draw(ids));
    }

    /// Keeps up with the row of the open trial.
    pub(super) fn follow(&self, id: TrialId) {
        self.send(LibraryCommand::Follow(id));
    }

    /// Changes the selected trials.
    pub fn edit(&self, edit: TrialEdit) {
        if !self.selection.selected.is_empty() {
            self.send(LibraryCommand::Edit(self.selection.ids(), edit));
        }
    }

    /// Changes one trial.
    pub(super) fn edit_one(&self, id: TrialId, edit: TrialEdit) {
        self.send(LibraryCommand::Edit(vec![id], edit));
    }

    /// Moves this trial from the demo log to the store.
    pub(in crate::app) fn keep(&mut self, id: TrialId) {
        self.edit_one(id, TrialEdit::Keep);
        self.kept = Some(id);
    }
}

impl App {
    /// Shows outcomes, and forgets trials that are gone.
    pub(super) fn poll_library(&mut self) {
        let shown = self.inspect.wanted();
        let Self { library: LibraryFeature { worker, view, selection, seen, .. }, notices, .. } = self;
        *view = worker.view();
        let Some(view) = view else { return };
        if !Arc::ptr_eq(seen, &view.found) {
            selection.look(&view.found);
            *seen = Arc::clone(&view.found);
        }
        if selection.shown != shown {
            selection.show(seen, shown);
        }
        worker.notices().for_each(|notice| notices.show(notice));
        let newest = self.newest_trial();
        if let Some(newest) = newest.filter(|_| self.view.mode == Mode::Inspect && self.inspect.takes_newest()) {
            self.show_trial(newest);
        }
    }

    /// Trial that holds the last grasp of the simulation, although it may have been stored long ago; without one, the first
    /// of the list.
    pub(super) fn newest_trial(&self) -> Option<TrialId> {
        let found = &self.library.view.as_ref()?.found;
        let simulated = self.view.source == ViewSource::Simulation;
        let last = self.simulation.last_trial.filter(|_| simulated).map(|(id, _)| id);
        let last = last.filter(|id| found.iter().any(|trial| trial.row.id == *id));
        last.or_else(|| found.first().map(|trial| trial.row.id))
    }

    /// Moves the keyboard to the search field, and adds text typed ahead.
    pub(in crate::app) fn search_library(&mut self, typed: &str) {
        self.show_panel("library");
        let LibraryFeature { selection, worker, .. } = &mut self.library;
        selection.focus_search = true;
        if !typed.is_empty() {
            selection.query.search.push_str(typed);
            worker.send(LibraryCommand::Find(selection.query.clone()));
        }
    }

    /// Opens the trial selected last.
    pub(in crate::app) fn open_selected(&mut self) {
        match self.library.selection.cursor {
            Some(id) => self.open_trial(id),
            None => self.notices.info("No trial is selected: use the arrow keys or click one."),
        }
    }

    /// Compares the selected trials with the one that is shown.
    pub(in crate::app) fn pin_selected(&mut self) {
        self.library.selection.ids().into_iter().for_each(|id| self.pin(id));
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

    #[test]
    fn the_trial_shown_is_selected_where_nothing_else_is() {
        let found = found();
        let mut selection = LibrarySelection::default();
        selection.show(&found, Some(3));
        assert_eq!((selected(&selection), selection.cursor), (vec![3], Some(3)));
        // What is selected beside it stays so; also where the shown one is one of them.
        selection.step(&found, 1, true);
        selection.show(&found, Some(2));
        assert_eq!(selected(&selection), [2, 3]);
        selection.select(&found, 5, Reach::Alone);
        selection.look(&found);
        assert_eq!(selected(&selection), [5]);
        // Found again after a search that found neither.
        selection.look(&[]);
        assert_eq!((selected(&selection), selection.cursor), (vec![], None));
        selection.look(&found);
        assert_eq!((selected(&selection), selection.cursor), (vec![2], Some(2)));
        selection.show(&found, None);
        selection.look(&found);
        assert_eq!(selected(&selection), [2]);
    }

    #[test]
    fn what_comes_before_the_first_look_finds_what_the_query_asks_for() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("s.sqlite");
        let mut store = Store::open(&path).expect("opens");
        let header = TrialHeader::new("", Scene::default());
        let id = store.begin_board(&header, &BoardInfo::default()).expect("begins");
        let mut library = LibraryFeature::new(LibraryWorker::start(path, Arc::new(|| {})).expect("starts"));
        library.follow(id);
        let end = std::time::Instant::now() + std::time::Duration::from_secs(60);
        while !library.worker.is_settled() && std::time::Instant::now() < end {
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
        library.view = library.worker.view();
        assert!(library.view.is_some_and(|view| view.query == library.selection.query && view.query.without_collected));
    }
}
