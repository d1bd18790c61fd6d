//! Library worker: a thread "library" that reads all trials, finds those that match a query, edits them. It
//! notices what other threads and programs change. The window never waits for the disk.

use super::job::JobError;
use super::label_worker::GLANCE;
use super::messages::{Notice, Wake};
use super::own_store::OwnStore;
use super::worker::Worker;
use crate::labelling::stored_sparkline;
use palpate_store::labels::{Sparkline, TrialEdit};
use palpate_store::{Library, LibraryCounts, LibraryTrial, Store, StoreError, TrialQuery};
use palpate_tactile::trial::TrialId;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Command to the library worker.
#[derive(Clone, Debug, PartialEq)]
pub enum LibraryCommand {
    /// Show the trials that match.
    Find(TrialQuery),
    /// Make sparklines of these trials, which are in sight.
    Draw(Vec<TrialId>),
    /// Change trials; one undo takes it back.
    Edit(Vec<TrialId>, TrialEdit),
    /// Show this trial too, whether it matches or not.
    Follow(TrialId),
}

/// Trials that were found, for display.
#[derive(Clone, Debug, Default)]
pub struct LibraryView {
    /// Query that found them.
    pub query: TrialQuery,
    /// Trials in the order of the query.
    pub found: Arc<[Arc<LibraryTrial>]>,
    /// The trial that is followed, once it has been read.
    pub followed: Option<Arc<LibraryTrial>>,
    /// Counts of the whole library.
    pub counts: Arc<LibraryCounts>,
    /// The whole store has been read.
    pub complete: bool,
    /// The local dates of today and yesterday.
    pub days: [String; 2],
    /// Sparklines made so far, of trials in sight.
    pub sparklines: Arc<BTreeMap<TrialId, Sparkline>>,
}

impl LibraryView {
    /// A local time of the store, short: `today 14:03`, `yesterday 09:12`, `2026-11-19 17:30`.
    pub fn date(&self, local: &str) -> String {
        let (day, time) = local.split_once('T').unwrap_or((local, ""));
        let [today, yesterday] = &self.days;
        let day = match day {
            day if day == today => "today",
            day if day == yesterday => "yesterday",
            day => day,
        };
        format!("{day} {time}")
    }
}

/// Trials read at a time while the store is opened: a few milliseconds each time.
const PORTION: usize = 2000;
/// Sparklines kept, some 20 kB per hundred.
const SPARKLINES: usize = 2000;
/// Sparklines made between two pictures of the window.
const AT_ONCE: usize = 4;

/// Handle of the thread.
pub type LibraryWorker = Worker<LibraryCommand, LibraryView>;

impl LibraryWorker {
    /// Starts the thread on a store, which is opened with the first command.
    pub fn start(path: PathBuf, wake: Wake) -> std::io::Result<Self> {
        Self::spawn("library", "the trial library", wake, move |inbox, publisher| {
            let (mut store, mut service) = (OwnStore::new(path), LibraryService::default());
            let (mut patience, mut trouble) = (None, None);
            while let Ok(command) = inbox.next(patience) {
                let (told, mut notices) = (command.is_some(), Vec::new());
                let opened = store.open().map_err(JobError::from);
                let worked = opened.and_then(|store| service.work(store, command, &mut notices));
                let cause = worked.as_ref().err().map(ToString::to_string);
                // Trouble that lasts is reported once.
                let is_new = cause.is_some() && (told || cause != trouble);
                notices.extend(cause.clone().filter(|_| is_new).map(Notice::Failed));
                trouble = cause;
                if is_new || worked.is_ok_and(|changed| told || changed) {
                    let warnings = store.warnings.drain(..).map(Notice::Warning);
                    publisher.publish_with(service.view.clone(), warnings.chain(notices));
                }
                patience = store.opened().map(|_store| if service.is_busy() { Duration::ZERO } else { GLANCE });
            }
        })
    }
}

/// State of the thread.
#[derive(Default)]
struct LibraryService {
    library: Library,
    /// As [`Store::data_version`] counts.
    version: i64,
    view: LibraryView,
    followed: Option<TrialId>,
    /// Trials in sight without a sparkline, the last to be made first.
    undrawn: Vec<TrialId>,
    /// Trials that were still being recorded when their sparkline was made.
    growing: Vec<TrialId>,
}

impl LibraryService {
    /// True while something is left to do.
    fn is_busy(&self) -> bool {
        !self.library.is_complete() || !self.undrawn.is_empty()
    }

    /// Handles a command, or does what is left to do; true where the view has changed.
    fn work(
        &mut self,
        store: &Store,
        command: Option<LibraryCommand>,
        notices: &mut Vec<Notice>,
    ) -> Result<bool, JobError> {
        match command {
            Some(LibraryCommand::Find(query)) => {
                self.view.query = query;
                self.read(store)?;
                self.find(store)?;
            }
            Some(LibraryCommand::Follow(id)) => {
                self.followed = Some(id);
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
                notices.push(Notice::Info(done));
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
        self.view.followed = self.followed.and_then(|id| self.library.trial(id)).cloned();
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
}

#[cfg(test)]
mod tests {
    use super::super::job::watch::waker;
    use super::super::worker::watch::{shown, told};
    use super::*;
    use palpate_sim::scene::Scene;
    use palpate_store::{BoardChunk, BoardInfo, Shown};
    use palpate_tactile::board::Reading;
    use palpate_tactile::trial::TrialHeader;

    #[test]
    fn dates_of_these_days_are_words() {
        let view = LibraryView { days: ["2026-11-22", "2026-11-21"].map(str::to_owned), ..LibraryView::default() };
        let shown = ["2026-11-22T14:03", "2026-11-21T09:12", "2025-11-22T23:59"].map(|local| view.date(local));
        assert_eq!(shown, ["today 14:03", "yesterday 09:12", "2025-11-22 23:59"]);
    }

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
        let mut about = BoardInfo::default();
        about.course.board.channels = vec!["fsrL".to_owned(), "fsrR".to_owned()];
        let id = theirs.begin_board(&TrialHeader::new("lemon", Scene::default()), &about)?;
        let reading = |k: u32| {
            let (t_s, counts) = (0.02 * f64::from(k), vec![Some(k as f32); 2]);
            Reading { t_s, arrived_s: t_s, seq: None, counts, line_bar: None }
        };
        let chunk = |from: u32| BoardChunk { readings: (from..from + 50).map(reading).collect(), ..Default::default() };
        theirs.append_board(id, &about, &chunk(0))?;
        let (wake, woken) = waker();
        let library = LibraryWorker::start(path, wake)?;
        library.send(LibraryCommand::Find(TrialQuery::default()));
        library.send(LibraryCommand::Draw(vec![id]));
        let begun = shown(&library, &woken, |view| view.sparklines.contains_key(&id)).sparklines[&id].clone();
        theirs.append_board(id, &about, &chunk(50))?;
        theirs.finish_board(id, &about, &[])?;
        let whole = stored_sparkline(&theirs, id)?;
        assert_ne!(begun, whole);
        shown(&library, &woken, |view| view.sparklines[&id] == whole);
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
        let library = LibraryWorker::start(path, wake).expect("starts");
        library.send(LibraryCommand::Find(TrialQuery::default()));
        shown(&library, &woken, |view| ids(view) == [mug, lemon] && view.complete);
        let search = |text: &str| LibraryCommand::Find(TrialQuery { search: text.to_owned(), ..TrialQuery::default() });
        library.send(search("lemon"));
        shown(&library, &woken, |view| ids(view) == [lemon]);
        library.send(LibraryCommand::Follow(mug));
        let followed = |view: &LibraryView| view.followed.as_ref().map(|trial| trial.row.note.clone());
        shown(&library, &woken, |view| ids(view) == [lemon] && followed(view).is_some());
        theirs.labels().edit(&[mug], &TrialEdit::Note("chipped".to_owned())).expect("notes");
        shown(&library, &woken, |view| followed(view).as_deref() == Some("chipped"));
        // Another program records and discards: nobody asks.
        let third = record(&mut theirs, "lemon");
        shown(&library, &woken, |view| ids(view) == [third, lemon]);
        theirs.delete(&[lemon]).expect("discards");
        shown(&library, &woken, |view| ids(view) == [third] && view.counts.discarded == 1);
        theirs.journal().undo().expect("brings it back");
        shown(&library, &woken, |view| ids(view) == [third, lemon]);
        // Our own edits are there at once, and one undo elsewhere takes both back.
        library.send(LibraryCommand::Edit(vec![lemon, third], TrialEdit::Tag(vec!["wet".to_owned()])));
        let tagged = |view: &LibraryView| view.counts.tags == [("wet".to_owned(), 2)];
        shown(&library, &woken, tagged);
        assert_eq!(told(&library, &woken), Notice::Info("2 trials tagged wet".to_owned()));
        theirs.journal().undo().expect("takes both back");
        shown(&library, &woken, |view| view.counts.tags.is_empty());
        library.send(LibraryCommand::Edit(vec![lemon, 99], TrialEdit::Discard));
        assert!(matches!(told(&library, &woken), Notice::Failed(text) if text.contains("99")));
        let discarded = TrialQuery { shown: Shown::Discarded, ..TrialQuery::default() };
        library.send(LibraryCommand::Find(discarded));
        shown(&library, &woken, |view| view.query.shown == Shown::Discarded && view.found.is_empty());
    }

    #[test]
    fn sparklines_are_made_on_request() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("s.sqlite");
        let kept = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/suite/data/store.sqlite");
        std::fs::copy(kept, &path).expect("copies");
        let (wake, woken) = waker();
        let library = LibraryWorker::start(path, wake).expect("starts");
        library.send(LibraryCommand::Find(TrialQuery::default()));
        library.send(LibraryCommand::Draw((1..=99).collect()));
        // A trial that does not exist or cannot be read has an empty one.
        let view = shown(&library, &woken, |view| view.sparklines.len() == 99);
        let drawn = |id: TrialId| view.sparklines[&id].iter().all(|finger| finger.iter().any(Option::is_some));
        assert_eq!((1..=99).filter(|id| drawn(*id)).collect::<Vec<_>>(), [1, 2, 4, 5]);
    }
}
