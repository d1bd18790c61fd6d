//! The demo log: its trials are listed as such, the oldest go, and what somebody keeps or works on stays.

use super::demo_log::{DEMO_LOG_TRIALS, TrialPlace};
use super::*;
use crate::labels::TrialEdit;
use crate::test_trials::without_frames;
use palpate_tactile::trial::{GraspOrigin, SimulatedTrial, TrialId};

type Outcome = Result<(), Box<dyn std::error::Error>>;

fn open(folder: &tempfile::TempDir, name: &str) -> Result<Store, StoreError> {
    Store::open(&folder.path().join(name))
}

/// A grasp whose identity is known.
fn trial(seed: u64) -> SimulatedTrial {
    let mut trial = without_frames("ball");
    trial.header.seed = seed;
    trial.header.origin = Some(GraspOrigin::default());
    trial
}

fn logged(store: &mut Store, seed: u64) -> Result<Stored, StoreError> {
    store.insert_in(TrialPlace::DemoLog, &trial(seed))
}

/// Numbers in the demo log.
fn log(store: &Store) -> Result<Vec<TrialId>, StoreError> {
    let rows = store.list(true)?.into_iter().filter(|row| row.place == TrialPlace::DemoLog);
    Ok(rows.map(|row| row.id).collect())
}

#[test]
fn the_oldest_grasps_leave_the_log_and_kept_ones_stay() -> Outcome {
    let folder = tempfile::tempdir()?;
    let mut store = open(&folder, "trials.sqlite")?;
    let kept = logged(&mut store, 0)?.id();
    let own = store.insert(&trial(1))?.id();
    store.labels().edit(&[kept], &TrialEdit::Keep)?;
    let most = u64::from(DEMO_LOG_TRIALS);
    let mut library = Library::read(&store)?;
    for seed in 2..=most + 3 {
        logged(&mut store, seed)?;
    }
    let ids = log(&store)?;
    assert_eq!((ids.len(), ids[0]), (DEMO_LOG_TRIALS as usize, 5), "the first two of the log are gone");
    assert!(store.load(kept).is_ok() && store.load(own).is_ok());
    let begun = logged(&mut store, most + 9)?.id();
    assert_eq!((log(&store)?[0], log(&store)?.len()), (6, DEMO_LOG_TRIALS as usize));
    // One that is given up leaves nothing, not even an entry of the journal.
    let entries = store.journal().entries(9)?.len();
    store.give_up(begun)?;
    assert_eq!((log(&store)?.len(), store.journal().entries(9)?.len()), (DEMO_LOG_TRIALS as usize - 1, entries));
    // The library keeps up.
    library.catch_up(&store)?;
    assert_eq!(library.counts(), Library::read(&store)?.counts());
    logged(&mut store, most + 10)?;
    logged(&mut store, most + 11)?;
    assert!(library.catch_up(&store)? && library.trial(6).is_none());
    assert_eq!(library.counts(), Library::read(&store)?.counts());
    Ok(())
}

#[test]
fn pushing_out_reads_the_index_of_the_log_alone() -> Outcome {
    let folder = tempfile::tempdir()?;
    let store = open(&folder, "trials.sqlite")?;
    let sql = "EXPLAIN QUERY PLAN DELETE FROM trials WHERE demo = 1 AND id <=
        (SELECT id FROM trials WHERE demo = 1 ORDER BY id DESC LIMIT 1 OFFSET 1000)";
    let mut statement = store.connection.prepare(sql)?;
    let steps: Vec<String> = statement.query_map([], |row| row.get(3))?.collect::<Result<_, _>>()?;
    let searches = steps.iter().filter(|step| step.contains("trials_of_demo_log")).count();
    assert!(
        searches == 2 && !steps.iter().any(|step| step.contains("SCAN trials") || step.contains("B-TREE")),
        "{steps:?}"
    );
    Ok(())
}

#[test]
fn whatever_a_person_changes_is_kept_and_keeping_can_be_undone() -> Outcome {
    let folder = tempfile::tempdir()?;
    let mut store = open(&folder, "trials.sqlite")?;
    let ids: Vec<TrialId> = (0..4).map(|seed| logged(&mut store, seed).map(Stored::id)).collect::<Result<_, _>>()?;
    store.labels().set_note(ids[0], "slipped")?;
    store.labels().set_tags(ids[1], &["wet".to_owned()])?;
    assert_eq!(log(&store)?, ids[2..]);
    // The note goes, the trial stays.
    store.journal().undo()?;
    store.journal().undo()?;
    assert_eq!(log(&store)?, ids[2..]);
    let kept = store.labels().edit(&ids, &TrialEdit::Keep)?;
    assert_eq!((kept.changed, kept.sentence(&TrialEdit::Keep)), (2, "2 trials kept in the store".to_owned()));
    assert_eq!(store.labels().edit(&ids, &TrialEdit::Keep)?.sentence(&TrialEdit::Keep), "In the store already");
    let undone = store.journal().undo()?.ok_or("something to undo")?;
    assert_eq!(undone.sentence(), "trials 3, 4: kept in the store");
    assert_eq!(log(&store)?, ids[2..]);
    store.journal().redo()?.ok_or("something to redo")?;
    assert_eq!(log(&store)?, [0; 0]);
    // A discarded one is not worked on.
    let discarded = logged(&mut store, 9)?.id();
    store.delete(&[discarded])?;
    assert_eq!(log(&store)?, [discarded]);
    Ok(())
}

#[test]
fn a_grasp_is_in_one_place_only() -> Outcome {
    let folder = tempfile::tempdir()?;
    let mut store = open(&folder, "trials.sqlite")?;
    let own = store.insert(&trial(0))?.id();
    assert_eq!(logged(&mut store, 0)?, Stored::Known(own), "the store has it");
    let first = logged(&mut store, 1)?.id();
    assert_eq!(logged(&mut store, 1)?, Stored::Known(first), "so has the log");
    let mut library = Library::read(&store)?;
    assert_eq!(store.insert(&trial(1))?, Stored::Kept(first), "recorded into the store");
    assert!(library.catch_up(&store)? && library.counts().demo_log == 0);

    let second = logged(&mut store, 2)?.id();
    assert_eq!(store.insert(&trial(2))?, Stored::Kept(second));
    let third = logged(&mut store, 3)?.id();
    assert_eq!(logged(&mut store, 3)?, Stored::Known(third));
    let mut collected = trial(3);
    collected.header.collection = Some("set".to_owned());
    assert_eq!(store.insert_collected([&collected].into_iter())?, 0);
    assert_eq!((log(&store)?, store.list(false)?.len()), (vec![], 4));
    Ok(())
}

#[test]
fn a_kept_trial_that_joins_a_collection_does_not_return_to_the_log() -> Outcome {
    let folder = tempfile::tempdir()?;
    let mut store = open(&folder, "trials.sqlite")?;
    let id = logged(&mut store, 0)?.id();
    store.labels().edit(&[id], &TrialEdit::Keep)?;
    let mut collected = trial(0);
    collected.header.collection = Some("set".to_owned());
    store.insert_collected([&collected].into_iter())?;
    store.journal().undo()?.ok_or("something to undo")?;
    assert_eq!((log(&store)?, store.place(id)?), (vec![], TrialPlace::Store));
    Ok(())
}

#[test]
fn merging_leaves_the_demo_log_of_the_other_store_there() -> Outcome {
    let folder = tempfile::tempdir()?;
    let (mut ours, mut theirs) = (open(&folder, "ours.sqlite")?, open(&folder, "theirs.sqlite")?);
    logged(&mut theirs, 0)?;
    theirs.insert(&trial(1))?;
    logged(&mut ours, 1)?;
    assert_eq!(ours.merge_from(theirs.path())?, Merged { known: 1, ..Merged::default() });
    assert_eq!((log(&ours)?, ours.list(true)?.len()), (vec![], 1), "what they keep is kept here");
    Ok(())
}

#[test]
fn the_library_finds_the_log_by_a_filter_and_by_words() -> Outcome {
    let folder = tempfile::tempdir()?;
    let mut store = open(&folder, "trials.sqlite")?;
    let (own, demo) = (store.insert(&trial(0))?.id(), logged(&mut store, 1)?.id());
    let library = Library::read(&store)?;
    let found = |query: TrialQuery| -> Result<Vec<TrialId>, StoreError> {
        Ok(library.find(&store, &query)?.iter().map(|trial| trial.row.id).collect())
    };
    assert_eq!(found(TrialQuery::default())?, [demo, own], "both are there by default");
    for (place, only) in [(TrialPlace::Store, own), (TrialPlace::DemoLog, demo)] {
        assert_eq!(found(TrialQuery { place: Some(place), ..TrialQuery::default() })?, [only]);
        assert_eq!(place.name().parse(), Ok(place));
    }
    assert_eq!(found(TrialQuery { search: "demo log".to_owned(), ..TrialQuery::default() })?, [demo]);
    Ok(())
}
