//! The library finds what is in the store, in the wanted order, and keeps up with every change.

use super::*;
use crate::labels::TrialEdit;
use crate::test_trials::{header, without_frames};
use palpate_sim::scene::PosePreset;
use palpate_tactile::Signals;
use palpate_tactile::trial::{GraspOrigin, SimulatedTrial, TrialId, TrialSource};
use proptest::prelude::*;

type Outcome = Result<(), Box<dyn std::error::Error>>;

fn open(folder: &tempfile::TempDir) -> Result<Store, StoreError> {
    Store::open(&folder.path().join("trials.sqlite"))
}

fn record(store: &mut Store, object: &str) -> Result<TrialId, StoreError> {
    let id = store.begin_board(&header(object), &BoardInfo::default())?;
    store.finish_board(id, &BoardInfo::default(), &[])?;
    Ok(id)
}

fn simulate(store: &mut Store, object: &str, preset: &str) -> Result<TrialId, StoreError> {
    let mut trial = without_frames(object);
    trial.header.scene.pose = PosePreset::named(preset).expect("a preset").poses();
    store.insert(&trial).map(Stored::id)
}

/// A simulated grasp of a collection, whose identity is known.
fn known_grasp() -> SimulatedTrial {
    let mut trial = without_frames("ball");
    trial.header.origin = Some(GraspOrigin::default());
    trial.header.collection = Some("set".to_owned());
    trial
}

/// Stores that grasp alone and once more, while the trials that hold it are discarded.
fn copy(store: &mut Store) -> Result<TrialId, StoreError> {
    let mut trial = known_grasp();
    trial.header.collection = None;
    let rows = store.list(false)?;
    let others: Vec<TrialId> = rows.iter().filter(|row| row.identity.is_some()).map(|row| row.id).collect();
    store.delete(&others)?;
    let id = store.insert(&trial)?.id();
    store.restore(&others)?;
    Ok(id)
}

fn import(store: &mut Store, label: &str) -> Result<u32, StoreError> {
    let signals = Signals { channels: vec!["grip".to_owned()], t_s: vec![0.0], values: vec![1.0] };
    let (name, label) = ("first".to_owned(), label.to_owned());
    store.insert_imported("mine", &[ImportedTrial { name, label, size: None, shape: None, session: None, signals }])
}

fn ids(library: &Library, store: &Store, query: &TrialQuery) -> Result<Vec<TrialId>, StoreError> {
    Ok(library.find(store, query)?.iter().map(|trial| trial.row.id).collect())
}

/// Order by number: what a test says first is first.
fn by_number() -> TrialQuery {
    let order = TrialOrder { column: TrialColumn::Id, descending: false };
    TrialQuery { order, ..TrialQuery::default() }
}

/// A lemon and a tennis ball simulated, two recorded trials of which one has no label, an imported mug.
fn filled(folder: &tempfile::TempDir) -> Result<Store, StoreError> {
    let mut store = open(folder)?;
    simulate(&mut store, "lemon", "M")?;
    simulate(&mut store, "bigball", "B")?;
    record(&mut store, "lemon")?;
    record(&mut store, "")?;
    import(&mut store, "mug")?;
    store.labels().edit(&[2, 4], &TrialEdit::Tag(vec!["wet".to_owned()]))?;
    store.labels().set_note(3, "slipped at the end")?;
    Ok(store)
}

#[test]
fn words_and_filters_find_trials() -> Outcome {
    let folder = tempfile::tempdir()?;
    let mut store = filled(&folder)?;
    let mut unsound = without_frames("cube");
    unsound.data.quality.finite = false;
    store.insert(&unsound)?;
    let library = Library::read(&store)?;
    let found = |change: &dyn Fn(&mut TrialQuery)| {
        let mut query = by_number();
        change(&mut query);
        ids(&library, &store, &query).expect("finds")
    };
    let search = |text: &str| found(&|query| query.search = text.to_owned());
    let title = library.trial(2).ok_or("the ball")?.title.to_string();
    assert_ne!(title, "bigball", "its title is another one");
    assert_eq!((search(""), search(&title), search("BIGball")), (vec![1, 2, 3, 4, 5, 6], vec![2], vec![2]));
    assert_eq!((search("lemon slipped"), search("mine"), search("grip")), (vec![3], vec![5], vec![5]));
    assert_eq!((search("wet"), search("unlabelled"), search("lemon wet")), (vec![2, 4], vec![4], vec![]));
    assert_eq!(found(&|query| query.object = Some(title.to_uppercase())), [2]);
    assert_eq!(found(&|query| query.object = Some("lemon".to_owned())), [1, 3]);
    assert_eq!(found(&|query| query.source = Some(TrialSource::Recorded)), [3, 4]);
    assert_eq!(found(&|query| query.unlabelled = true), [4]);
    assert_eq!(found(&|query| query.tag = Some("wet".to_owned())), [2, 4]);
    assert_eq!(found(&|query| query.preset = Some("b".to_owned())), [2]);
    assert_eq!(found(&|query| query.quality = Some(TrialQuality::Unsound)), [6]);
    assert_eq!(found(&|query| query.collection = Some("mine".to_owned())), [5]);
    assert_eq!(found(&|query| query.sensors = Some("Grip".to_owned())), [5]);
    assert_eq!(found(&|query| query.since = Some(Day::Ago(0))), [1, 2, 3, 4, 5, 6]);
    assert_eq!(found(&|query| query.until = Some(Day::Ago(1))), [0; 0]);
    let counts = library.counts();
    assert_eq!((counts.kept, counts.unlabelled, counts.discarded), (6, 1, 0));
    assert_eq!((&counts.objects[0], &counts.tags[0]), (&("lemon".to_owned(), 2), &("wet".to_owned(), 2)));
    Ok(())
}

#[test]
fn days_are_local_and_written_in_four_ways() {
    let read = |text: &str| text.parse::<Day>();
    assert_eq!((read("Today"), read("yesterday")), (Ok(Day::Ago(0)), Ok(Day::Ago(1))));
    assert_eq!((read("7d"), read("2026-11-21")), (Ok(Day::Ago(7)), Ok(Day::Date("2026-11-21".to_owned()))));
    for nonsense in ["2026-13-01", "2026-1-1", "soon", "d", "2026-11-21T10:00", "-1d"] {
        let refused = read(nonsense).expect_err(nonsense).to_string();
        assert!(refused.contains(nonsense) && refused.contains("yesterday"), "{refused}");
    }
}

#[test]
fn every_column_orders_both_ways() -> Outcome {
    let folder = tempfile::tempdir()?;
    let store = filled(&folder)?;
    let sql = "UPDATE trials SET created = ?2, samples = ?3 WHERE id = ?1";
    for (id, created, samples) in [(1, "2026-11-21T09:00:00.000Z", 5), (2, "2026-11-19T09:00:00.000Z", 900)] {
        store.connection.execute(sql, rusqlite::params![id, created, samples])?;
    }
    let library = Library::read(&store)?;
    for (column, expected) in [
        (TrialColumn::Id, [1, 2, 3, 4, 5]),
        (TrialColumn::Object, [1, 3, 5, 2, 4]),
        (TrialColumn::Date, [2, 1, 3, 4, 5]),
        (TrialColumn::Source, [5, 3, 4, 1, 2]),
        (TrialColumn::Preset, [3, 4, 5, 2, 1]),
        (TrialColumn::Quality, [1, 2, 3, 4, 5]),
        (TrialColumn::Tags, [1, 3, 5, 2, 4]),
        (TrialColumn::Note, [1, 2, 4, 5, 3]),
        (TrialColumn::Samples, [3, 4, 5, 1, 2]),
    ] {
        let order = |descending: bool| TrialQuery { order: TrialOrder { column, descending }, ..by_number() };
        assert_eq!(ids(&library, &store, &order(false))?, expected, "{}", column.name());
        let reversed: Vec<TrialId> = expected.into_iter().rev().collect();
        assert_eq!(ids(&library, &store, &order(true))?, reversed, "{}", column.name());
    }
    Ok(())
}

#[test]
fn it_is_read_in_portions_the_newest_first() -> Outcome {
    let folder = tempfile::tempdir()?;
    let mut store = filled(&folder)?;
    let mut library = Library::default();
    assert!(!library.read_on(&store, 2)?);
    assert_eq!(ids(&library, &store, &by_number())?, [4, 5]);
    // Changes of trials that are not read yet wait for their turn; new ones come at once.
    store.labels().set_note(1, "early")?;
    record(&mut store, "key")?;
    assert!(library.catch_up(&store)?);
    assert_eq!(ids(&library, &store, &by_number())?, [4, 5, 6]);
    while !library.read_on(&store, 2)? {}
    let early = TrialQuery { search: "early".to_owned(), ..by_number() };
    assert_eq!(ids(&library, &store, &early)?, [1]);
    assert!(!library.catch_up(&store)?, "nothing is left to be read");
    Ok(())
}

#[test]
fn trials_of_data_sets_are_left_out_until_they_are_asked_for() -> Outcome {
    let folder = tempfile::tempdir()?;
    let mut store = filled(&folder)?;
    let collected = store.insert(&known_grasp())?.id();
    let library = Library::read(&store)?;
    assert_eq!((library.counts().collected, library.counts().kept), (1, 6));
    let without = TrialQuery { without_collected: true, ..by_number() };
    assert_eq!(ids(&library, &store, &without)?, [1, 2, 3, 4, 5], "imported ones stay");
    assert!(!without.is_filtered() && without.cleared().hides_collected());
    let set = TrialQuery { collection: Some("set".to_owned()), ..without };
    assert_eq!(ids(&library, &store, &set)?, [collected]);
    assert_eq!(ids(&library, &store, &by_number())?.len(), 6, "the terminal lists all");
    Ok(())
}

#[test]
fn an_empty_store_fills_up() -> Outcome {
    let folder = tempfile::tempdir()?;
    let mut store = open(&folder)?;
    let mut library = Library::read(&store)?;
    assert!(library.is_complete() && library.find(&store, &by_number())?.is_empty());
    record(&mut store, "key")?;
    library.catch_up(&store)?;
    while !library.read_on(&store, 10)? {}
    assert_eq!(ids(&library, &store, &by_number())?, [1]);
    Ok(())
}

/// Something that happens to the store.
#[derive(Clone, Debug)]
enum Event {
    Record,
    Simulate,
    Begin,
    End,
    Edit(Vec<TrialId>, u8),
    Copy,
    Join,
    Undo,
    Redo,
    Purge,
}

#[test]
fn copies_and_members_of_collections_follow_changes_of_other_trials() -> Outcome {
    let folder = tempfile::tempdir()?;
    let mut store = open(&folder)?;
    let (first, second) = (copy(&mut store)?, copy(&mut store)?);
    let mut library = Library::read(&store)?;
    let mut read = |store: &Store| -> Result<(Option<TrialId>, Vec<String>), StoreError> {
        library.catch_up(store)?;
        Ok(library.trial(second).map(|trial| (trial.row.duplicate_of, trial.row.also_in.clone())).unwrap_or_default())
    };
    assert_eq!(read(&store)?, (Some(first), vec![]));
    store.delete(&[first])?;
    assert_eq!(read(&store)?, (None, vec![]));
    store.restore(&[first])?;
    assert_eq!(read(&store)?, (Some(first), vec![]));
    store.delete(&[first])?;
    store.purge()?;
    assert_eq!(read(&store)?, (None, vec![]), "deleted and purged between two looks");
    assert_eq!(store.insert_collected([&known_grasp()].into_iter())?, 0);
    assert_eq!(read(&store)?, (None, vec!["set".to_owned()]));
    Ok(())
}

fn event() -> impl Strategy<Value = Event> {
    let some = prop::collection::vec(1..8 as TrialId, 1..4);
    prop_oneof![
        Just(Event::Record),
        Just(Event::Simulate),
        Just(Event::Begin),
        Just(Event::End),
        (some, 0..6u8).prop_map(|(ids, what)| Event::Edit(ids, what)),
        Just(Event::Copy),
        Just(Event::Join),
        Just(Event::Undo),
        Just(Event::Redo),
        Just(Event::Purge),
    ]
}

fn apply(store: &mut Store, event: Event, begun: &mut Vec<TrialId>) -> Result<(), StoreError> {
    match event {
        Event::Record => drop(record(store, "")?),
        Event::Simulate => drop(simulate(store, "lemon", "C")?),
        Event::Begin => begun.push(store.begin_board(&header(""), &BoardInfo::default())?),
        Event::End => match begun.pop() {
            Some(id) => store.finish_board(id, &BoardInfo::default(), &["cut short".to_owned()])?,
            None => return Ok(()),
        },
        Event::Edit(ids, what) => {
            let edit = [
                TrialEdit::Label("mug".to_owned()),
                TrialEdit::Tag(vec!["wet".to_owned()]),
                TrialEdit::Untag(vec!["wet".to_owned()]),
                TrialEdit::Note("n".to_owned()),
                TrialEdit::Discard,
                TrialEdit::Restore,
            ];
            // Refused for trials that do not exist, or are deleted.
            let _refused = store.labels().edit(&ids, &edit[usize::from(what)]);
        }
        Event::Copy => drop(copy(store)?),
        Event::Join => drop(store.insert_collected([&known_grasp()].into_iter())?),
        Event::Undo => drop(store.journal().undo()?),
        Event::Redo => drop(store.journal().redo()?),
        Event::Purge => drop(store.purge()?),
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn catching_up_gives_what_reading_anew_gives(events in prop::collection::vec(event(), 1..30)) {
        let folder = tempfile::tempdir().expect("a folder");
        let (mut theirs, ours) = (open(&folder).expect("opens"), open(&folder).expect("opens"));
        let mut library = Library::read(&ours).expect("reads");
        let everything = TrialQuery { shown: Shown::All, ..by_number() };
        let mut begun = Vec::new();
        for event in events {
            let before = ours.data_version().expect("a number");
            let rows = theirs.list(true).expect("lists");
            apply(&mut theirs, event, &mut begun).expect("is done");
            let changed = theirs.list(true).expect("lists") != rows;
            prop_assert!(!changed || ours.data_version().expect("a number") != before, "every change is noticed");
            library.catch_up(&ours).expect("reads");
            while !library.read_on(&ours, 3).expect("reads") {}
            let seen: Vec<TrialRow> =
                library.find(&ours, &everything).expect("finds").iter().map(|trial| trial.row.clone()).collect();
            prop_assert_eq!(seen, theirs.list(true).expect("lists"));
        }
    }
}
