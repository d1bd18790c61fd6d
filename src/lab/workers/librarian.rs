//! Library service: a thread "library" that reads all trials, finds those that match a query, edits and exports them. It
//! notices what other threads and programs change. The window never waits for the disk.

use super::background_job::{BackgroundJob, Outlet};
use super::labeller::{GLANCE, LabelError, LabelOutcome};
use super::labelling_session::new_export_folder;
use super::messages::Wake;
use crate::labelling::stored_sparkline;
use palpate_store::labels::{Sparkline, TrialEdit};
use palpate_store::{
    ExportError, Library, LibraryCounts, LibraryTrial, Store, StoreError, TrialQuality, TrialQuery, export_trial,
};
use palpate_tactile::trial::TrialId;
use palpate_tactile::{SensorLayout, SignalDefinition};
use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Command to the library service.
#[derive(Clone, Debug, PartialEq)]
pub enum LibraryCommand {
    /// Show the trials that match.
    Find(TrialQuery),
    /// Make sparklines of these trials, which are in sight.
    Draw(Vec<TrialId>),
    /// Change trials; one undo takes it back.
    Edit(Vec<TrialId>, TrialEdit),
    /// Export trials into a new folder beside the store, without unsound ones.
    Export(Vec<TrialId>),
}

/// Trials that were found, for display.
#[derive(Clone, Debug, Default)]
pub struct LibraryView {
    /// Query that found them.
    pub query: TrialQuery,
    /// Trials in the order of the query.
    pub found: Arc<[Arc<LibraryTrial>]>,
    /// Counts of the whole library.
    pub counts: Arc<LibraryCounts>,
    /// The whole store has been read.
    pub complete: bool,
    /// The local dates of today and yesterday.
    pub days: [String; 2],
    /// Sparklines made so far, of trials in sight.
    pub sparklines: Arc<BTreeMap<TrialId, Sparkline>>,
    /// Outcomes of commands, oldest first, numbered.
    pub outcomes: Vec<(u64, LabelOutcome)>,
}

/// Trials read at a time while the store is opened: a few milliseconds each time.
const PORTION: usize = 2000;
/// Sparklines kept, some 20 kB per hundred.
const SPARKLINES: usize = 2000;
/// Sparklines made between two pictures of the window.
const AT_ONCE: usize = 4;
/// Outcomes kept for a slow window.
const OUTCOMES: usize = 16;
/// Channels of exported simulated trials, as on the command line.
const EXPORT_LAYOUT: &str = "C1";

/// The handle.
pub type Librarian = BackgroundJob<LibraryCommand, LibraryView>;

/// Starts the thread on a store, which is opened with the first command.
pub fn start_librarian(path: PathBuf, wake: Wake) -> std::io::Result<Librarian> {
    let mut service = Service::new(path);
    BackgroundJob::spawn_idling("library", wake, move |command, stop, outlet| {
        let told = command.is_some();
        match service.work(command, stop) {
            Ok(changed) => {
                service.trouble = None;
                if told || changed {
                    service.publish(outlet);
                }
                service.patience()
            }
            Err(cause) => {
                // Trouble that lasts is reported once.
                let text = Some(cause.to_string());
                if told || service.trouble != text {
                    service.trouble = text;
                    service.report(LabelOutcome::Failed(Arc::new(cause)));
                    service.publish(outlet);
                }
                service.store.is_some().then_some(GLANCE)
            }
        }
    })
}

/// State of the thread.
struct Service {
    path: PathBuf,
    store: Option<Store>,
    library: Library,
    /// As [`Store::data_version`] counts.
    version: i64,
    view: LibraryView,
    /// Trials in sight without a sparkline, the last to be made first.
    undrawn: Vec<TrialId>,
    /// Trials that were still being recorded when their sparkline was made.
    growing: Vec<TrialId>,
    /// Why the last work failed.
    trouble: Option<String>,
    outcomes: VecDeque<(u64, LabelOutcome)>,
    number: u64,
}

impl Service {
    fn new(path: PathBuf) -> Self {
        Self {
            path,
            store: None,
            library: Library::default(),
            version: 0,
            view: LibraryView::default(),
            undrawn: Vec::new(),
            growing: Vec::new(),
            trouble: None,
            outcomes: VecDeque::new(),
            number: 0,
        }
    }

    /// How long to wait for a command: not at all while something is left to do.
    fn patience(&self) -> Option<Duration> {
        let busy = self.store.is_some() && (!self.library.is_complete() || !self.undrawn.is_empty());
        self.store.is_some().then_some(if busy { Duration::ZERO } else { GLANCE })
    }

    fn report(&mut self, outcome: LabelOutcome) {
        self.number += 1;
        self.outcomes.push_back((self.number, outcome));
        if self.outcomes.len() > OUTCOMES {
            self.outcomes.pop_front();
        }
    }

    fn publish(&mut self, outlet: &Outlet<LibraryView>) {
        self.view.outcomes = self.outcomes.iter().cloned().collect();
        outlet.publish(self.view.clone());
    }

    /// Handles a command, or does what is left to do; true where the view has changed.
    fn work(&mut self, command: Option<LibraryCommand>, stop: &AtomicBool) -> Result<bool, LabelError> {
        let store = match self.store.take() {
            Some(store) => store,
            None => {
                let store = Store::open(&self.path)?;
                store.warnings().iter().for_each(|warning| self.report(LabelOutcome::Warning(warning.clone())));
                store
            }
        };
        let worked = self.work_on(&store, command, stop);
        self.store = Some(store);
        worked
    }

    fn work_on(
        &mut self,
        store: &Store,
        command: Option<LibraryCommand>,
        stop: &AtomicBool,
    ) -> Result<bool, LabelError> {
        match command {
            Some(LibraryCommand::Find(query)) => {
                self.view.query = query;
                self.read(store)?;
                self.find(store)?;
            }
            Some(LibraryCommand::Draw(ids)) => {
                self.undrawn = ids.into_iter().rev().filter(|id| !self.view.sparklines.contains_key(id)).collect();
                self.draw(store);
            }
            Some(LibraryCommand::Edit(ids, edit)) => {
                let edited = store.labels().edit(&ids, &edit);
                if self.library.catch_up(store)? {
                    self.view.counts = Arc::new(self.library.counts());
                    self.find(store)?;
                }
                let undo = if edit == TrialEdit::Discard { "; Ctrl+Z brings them back" } else { "" };
                let done = format!("{}{undo}", edited?.sentence(&edit));
                self.report(LabelOutcome::Done(done));
            }
            Some(LibraryCommand::Export(ids)) => {
                let done = self.exported(store, &ids, stop)?;
                self.report(LabelOutcome::Done(done));
            }
            None => {
                let drawn = self.draw(store);
                let read = self.read(store)?;
                if read {
                    self.find(store)?;
                }
                return Ok(drawn || read);
            }
        }
        Ok(true)
    }

    /// Reads the next portion, and what has changed meanwhile; true where something was new.
    fn read(&mut self, store: &Store) -> Result<bool, StoreError> {
        let version = store.data_version()?;
        let mut changed = !self.library.is_complete();
        self.library.read_on(store, PORTION)?;
        if version != self.version {
            changed |= self.library.catch_up(store)?;
            self.version = version;
        }
        if changed {
            self.view.counts = Arc::new(self.library.counts());
            self.undrawn.append(&mut self.growing);
        }
        Ok(changed)
    }

    fn find(&mut self, store: &Store) -> Result<(), StoreError> {
        self.view.days = [store.local_day(0)?, store.local_day(1)?];
        self.view.found = self.library.find(store, &self.view.query)?.into();
        self.view.complete = self.library.is_complete();
        Ok(())
    }

    /// Makes the next few sparklines; true where there were any to make.
    fn draw(&mut self, store: &Store) -> bool {
        let from = self.undrawn.len().saturating_sub(AT_ONCE);
        let next = self.undrawn.split_off(from);
        if next.is_empty() {
            return false;
        }
        let mut made = BTreeMap::clone(&self.view.sparklines);
        if made.len() > SPARKLINES {
            made.clear();
        }
        let grows = |id: &&TrialId| self.library.trial(**id).is_some_and(|trial| trial.row.state == "recording");
        self.growing.extend(next.iter().filter(grows));
        // Opening a damaged trial says what is wrong with it; the list only leaves its place empty.
        made.extend(next.into_iter().map(|id| (id, stored_sparkline(store, id).unwrap_or_default())));
        self.view.sparklines = Arc::new(made);
        true
    }

    fn exported(&self, store: &Store, ids: &[TrialId], stop: &AtomicBool) -> Result<String, ExportError> {
        let signals = SignalDefinition::Parts;
        let layout = SensorLayout::named(EXPORT_LAYOUT)?.shown(signals);
        let folder = new_export_folder(store.path());
        let is_sound = |id: &&TrialId| self.library.trial(**id).is_none_or(|t| t.quality() < TrialQuality::Unsound);
        let sound: Vec<TrialId> = ids.iter().filter(is_sound).copied().collect();
        let (mut written, mut damaged) = (0, 0);
        for id in &sound {
            if stop.load(Ordering::Relaxed) {
                break;
            }
            match export_trial(store, *id, &folder, (&layout, signals)) {
                Err(ExportError::Store(error)) if error.is_damage() && ids.len() > 1 => damaged += 1,
                outcome => written += outcome.map(|_path| 1)?,
            }
        }
        let unsound = match ids.len() - sound.len() + damaged {
            0 => String::new(),
            count => format!("; {count} unsound or damaged left out"),
        };
        Ok(format!("{written} of {} trials exported into {}{unsound}", ids.len(), folder.display()))
    }
}

#[cfg(test)]
mod tests {
    use super::super::background_job::watch::{until, waker};
    use super::*;
    use palpate_sim::scene::Scene;
    use palpate_store::{BoardInfo, Shown};
    use palpate_tactile::trial::TrialHeader;

    fn record(store: &mut Store, object: &str) -> TrialId {
        let id = store.begin_board(&TrialHeader::new(object, Scene::default()), &BoardInfo::default()).expect("begins");
        store.finish_board(id, &BoardInfo::default(), &[]).expect("ends");
        id
    }

    #[test]
    fn sparklines_follow_trials_that_are_recorded() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("s.sqlite");
        let mut theirs = Store::open(&path)?;
        let scene = Scene::default();
        let object = scene.load_object()?;
        let mut trial = crate::grasping::grasp(&scene, object.as_ref(), 1);
        let frames = std::mem::take(&mut trial.data.frames);
        let id = theirs.begin(&trial)?;
        theirs.append(id, &frames[..60])?;
        let (wake, woken) = waker();
        let librarian = start_librarian(path, wake)?;
        librarian.ask(LibraryCommand::Find(TrialQuery::default()));
        librarian.ask(LibraryCommand::Draw(vec![id]));
        let begun = until(&librarian, &woken, |view| view.sparklines.contains_key(&id)).sparklines[&id].clone();
        theirs.append(id, &frames[60..])?;
        theirs.finish(id, &trial.data.quality, &trial.header)?;
        let whole = stored_sparkline(&theirs, id)?;
        assert_ne!(begun, whole);
        until(&librarian, &woken, |view| view.sparklines[&id] == whole);
        Ok(())
    }

    fn ids(view: &LibraryView) -> Vec<TrialId> {
        view.found.iter().map(|trial| trial.row.id).collect()
    }

    #[test]
    fn trials_are_found_edited_and_shown_as_others_change_them() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("s.sqlite");
        let mut theirs = Store::open(&path).expect("opens");
        let (lemon, mug) = (record(&mut theirs, "lemon"), record(&mut theirs, "mug"));
        let (wake, woken) = waker();
        let librarian = start_librarian(path, wake).expect("starts");
        librarian.ask(LibraryCommand::Find(TrialQuery::default()));
        until(&librarian, &woken, |view| ids(view) == [mug, lemon] && view.complete);
        let search = |text: &str| LibraryCommand::Find(TrialQuery { search: text.to_owned(), ..TrialQuery::default() });
        librarian.ask(search("lemon"));
        until(&librarian, &woken, |view| ids(view) == [lemon]);
        // Another program records and discards: nobody asks.
        let third = record(&mut theirs, "lemon");
        until(&librarian, &woken, |view| ids(view) == [third, lemon]);
        theirs.delete(&[lemon]).expect("discards");
        until(&librarian, &woken, |view| ids(view) == [third] && view.counts.discarded == 1);
        theirs.journal().undo().expect("brings it back");
        until(&librarian, &woken, |view| ids(view) == [third, lemon]);
        // Our own edits are there at once, and one undo elsewhere takes both back.
        librarian.ask(LibraryCommand::Edit(vec![lemon, third], TrialEdit::Tag(vec!["wet".to_owned()])));
        let tagged = |view: &LibraryView| view.counts.tags == [("wet".to_owned(), 2)];
        let view = until(&librarian, &woken, tagged);
        assert!(matches!(&view.outcomes[..], [(1, LabelOutcome::Done(text))] if text == "2 trials tagged wet"));
        theirs.journal().undo().expect("takes both back");
        until(&librarian, &woken, |view| view.counts.tags.is_empty());
        librarian.ask(LibraryCommand::Edit(vec![lemon, 99], TrialEdit::Discard));
        let refused = until(&librarian, &woken, |view| view.outcomes.len() == 2);
        assert!(matches!(&refused.outcomes[1], (2, LabelOutcome::Failed(cause)) if cause.to_string().contains("99")));
        let discarded = TrialQuery { shown: Shown::Discarded, ..TrialQuery::default() };
        librarian.ask(LibraryCommand::Find(discarded));
        until(&librarian, &woken, |view| view.query.shown == Shown::Discarded && view.found.is_empty());
    }

    #[test]
    fn sparklines_and_files_are_made_on_request() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("s.sqlite");
        let kept = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/suite/data/store.sqlite");
        std::fs::copy(kept, &path).expect("copies");
        let (wake, woken) = waker();
        let librarian = start_librarian(path, wake).expect("starts");
        librarian.ask(LibraryCommand::Find(TrialQuery::default()));
        librarian.ask(LibraryCommand::Draw((1..=99).collect()));
        // A trial that does not exist or cannot be read has an empty one.
        let view = until(&librarian, &woken, |view| view.sparklines.len() == 99);
        let drawn = |id: TrialId| view.sparklines[&id].iter().all(|finger| finger.iter().any(Option::is_some));
        assert_eq!((1..=99).filter(|id| drawn(*id)).collect::<Vec<_>>(), [1, 2, 4, 5]);
        librarian.ask(LibraryCommand::Export(vec![1, 2, 4]));
        let view = until(&librarian, &woken, |view| view.outcomes.len() == 1);
        let done = |text: &str| text.starts_with("3 of 3 trials exported");
        assert!(matches!(&view.outcomes[0], (1, LabelOutcome::Done(text)) if done(text)), "{:?}", view.outcomes);
        for name in ["trial_1_lemon.csv", "trial_1_lemon.contacts.csv", "trial_2_mug.csv", "trial_4_lemon.bytes"] {
            assert!(folder.path().join("export").join(name).is_file(), "{name}");
        }
    }
}
