//! Labels, notes and deletions in the store: every change is in the journal and can be undone.

use super::*;
use crate::labels::{Edited, LabelPlan, LabelledTrial, TrialEdit};
use crate::test_trials::{header, without_frames};
use palpate_tactile::trial::TrialId;
use proptest::prelude::*;
use std::path::Path;

type Outcome = Result<(), Box<dyn std::error::Error>>;

/// Adds a finished trial of the real gripper.
fn add(store: &mut Store, object: &str) -> Result<TrialId, StoreError> {
    let about = BoardInfo::default();
    let id = store.begin_board(&header(object), &about)?;
    store.finish_board(id, &about, &[])?;
    Ok(id)
}

fn store_with(path: &Path, objects: &[&str]) -> Result<Store, StoreError> {
    let mut store = Store::open(path)?;
    for object in objects {
        add(&mut store, object)?;
    }
    Ok(store)
}

fn labels(store: &Store) -> Result<Vec<Option<String>>, StoreError> {
    Ok(store.labels().trials()?.into_iter().map(|row| row.object).collect())
}

#[test]
fn a_label_is_given_changed_undone_and_done_again_across_restarts() -> Outcome {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("trials.sqlite");
    let store = store_with(&path, &[""])?;
    assert_eq!(labels(&store)?, [None]);
    store.labels().set_label(1, " lemon ")?;
    store.labels().set_label(1, "cube")?;
    drop(store);
    let store = Store::open(&path)?;
    let undone = store.journal().undo()?.ok_or("something was done")?;
    assert_eq!(undone.sentence(), "trial 1: label Lemon → Puzzle cube");
    assert_eq!(labels(&store)?, [Some("lemon".to_owned())]);
    drop(store);
    let store = Store::open(&path)?;
    store.journal().undo()?.ok_or("one more")?;
    assert_eq!((labels(&store)?, store.journal().undo()?), (vec![None], None));
    store.journal().redo()?.ok_or("it can be done again")?;
    drop(store);
    let store = Store::open(&path)?;
    store.journal().redo()?.ok_or("and the other too")?;
    assert_eq!((labels(&store)?, store.journal().redo()?), (vec![Some("cube".to_owned())], None));
    let entries: Vec<String> = store.journal().entries(100)?.iter().map(JournalEntry::sentence).collect();
    assert_eq!(entries.len(), 6);
    assert_eq!(entries[5], "trial 1: labelled Lemon");
    assert_eq!(entries[3], "trial 1: label Puzzle cube → Lemon (undoes 2)");
    assert_eq!(store.journal().entries(2)?.len(), 2);
    Ok(())
}

#[test]
fn something_new_leaves_nothing_to_be_done_again() -> Outcome {
    let folder = tempfile::tempdir()?;
    let store = store_with(&folder.path().join("trials.sqlite"), &["lemon"])?;
    store.labels().set_note(1, "slipped")?;
    store.journal().undo()?.ok_or("the note")?;
    // What a model says, and looking at a trial, is nothing to undo and in nobody's way.
    store.labels().set_guess(1, "m", &[("lemon".to_owned(), 0.75), ("ball".to_owned(), 0.25)])?;
    store.labels().mark_reviewed(1)?;
    assert!(store.journal().redo()?.is_some() && store.journal().undo()?.is_some());
    store.labels().set_unsure(1, true)?;
    assert_eq!(store.journal().redo()?, None);
    Ok(())
}

#[test]
fn a_label_that_comes_back_is_to_be_reviewed_again() -> Outcome {
    let folder = tempfile::tempdir()?;
    let store = store_with(&folder.path().join("trials.sqlite"), &["lemon"])?;
    store.labels().set_guess(1, "m", &[("lemon".to_owned(), 0.25), ("ball".to_owned(), 0.75)])?;
    store.labels().set_label(1, "cube")?;
    store.labels().mark_reviewed(1)?;
    assert!(store.labels().trials()?[0].reviewed);
    store.journal().undo()?.ok_or("the label")?;
    let row = &store.labels().trials()?[0];
    assert_eq!((row.object.as_deref(), row.reviewed), (Some("lemon"), false));
    Ok(())
}

#[test]
fn the_journal_is_only_added_to() -> Outcome {
    let folder = tempfile::tempdir()?;
    let mut store = store_with(&folder.path().join("trials.sqlite"), &[""])?;
    store.labels().set_label(1, "lemon")?;
    for sql in ["UPDATE journal SET entry = '{}'", "DELETE FROM journal", "UPDATE journal SET number = 7"] {
        let refused = store.connection.execute(sql, []).expect_err("triggers refuse it").to_string();
        assert!(refused.contains("only added to"), "{refused}");
    }
    // Purging a trial leaves its entries.
    store.delete(&[1])?;
    assert_eq!(store.purge()?, 1);
    let entries = store.journal().entries(9)?;
    assert_eq!((entries.len(), entries[1].trial), (2, None));
    assert!(entries[1].sentence().ends_with("(purged): labelled Lemon"), "{}", entries[1].sentence());
    assert_eq!(store.journal().undo()?, None, "there is nothing left to put it back on");
    Ok(())
}

#[test]
fn a_change_and_its_entry_are_one() -> Outcome {
    let folder = tempfile::tempdir()?;
    let mut store = store_with(&folder.path().join("trials.sqlite"), &["lemon", "cube"])?;
    // As if the disk were full at the worst moment: after the change, before its entry.
    store
        .connection
        .execute_batch("CREATE TRIGGER full BEFORE INSERT ON journal BEGIN SELECT raise(ABORT, 'no room'); END;")?;
    assert!(store.labels().set_label(1, "ball").is_err() && store.delete(&[2]).is_err());
    assert!(store.labels().set_plan(&LabelPlan { objects: Vec::new() }).is_err());
    store.connection.execute_batch("DROP TRIGGER full")?;
    let rows = store.labels().trials()?;
    assert_eq!((rows[0].object.as_deref(), rows[1].discarded), (Some("lemon"), false));
    assert_eq!((store.labels().plan()?, store.journal().entries(9)?.len()), (LabelPlan::default(), 0));
    Ok(())
}

#[test]
fn programs_share_one_history() -> Outcome {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("trials.sqlite");
    let mut ours = store_with(&path, &["lemon", "cube"])?;
    let theirs = Store::open(&path)?;
    ours.labels().set_note(2, "first")?;
    ours.labels().set_label(1, "ball")?;
    theirs.labels().set_label(1, "bigball")?;
    assert_eq!(ours.journal().undo()?.ok_or("theirs")?.sentence(), "trial 1: label Rubber ball → Tennis ball");
    assert_eq!(labels(&theirs)?[0].as_deref(), Some("ball"));
    theirs.journal().redo()?.ok_or("the same")?;
    assert_eq!(labels(&ours)?[0].as_deref(), Some("bigball"));
    // A change past the journal is not overwritten.
    ours.connection.execute("UPDATE trials SET object = 'case' WHERE id = 1", [])?;
    let refused = ours.journal().undo().expect_err("it has changed").to_string();
    assert!(refused.contains("label Rubber ball → Tennis ball") && refused.contains("changed since"), "{refused}");
    assert_eq!(labels(&ours)?[0].as_deref(), Some("case"));
    ours.delete(&[2])?;
    assert_eq!(theirs.journal().undo()?.ok_or("the deletion")?.sentence(), "trial 2: discarded");
    Ok(())
}

#[test]
fn changes_of_many_trials_are_one_step_of_undo() -> Outcome {
    let folder = tempfile::tempdir()?;
    let mut store = store_with(&folder.path().join("trials.sqlite"), &["lemon", "cube", ""])?;
    let simulated = store.insert(&without_frames("cube"))?.id();
    store.labels().set_note(2, "before")?;
    // A label leaves the simulated one alone, and says so.
    let label = TrialEdit::Label("mug".to_owned());
    let edited = store.labels().edit(&[1, 2, 3, simulated], &label)?;
    assert_eq!(edited, Edited { changed: 3, known: 1 });
    assert_eq!(edited.sentence(&label), "3 trials labelled mug; 1 is simulated or imported and keeps its object");
    let mug = || vec![Some("mug".to_owned()); 3];
    let before = [Some("lemon"), Some("cube"), None].map(|label| label.map(str::to_owned));
    assert_eq!(labels(&store)?, mug());
    let entries = store.journal().entries(99)?;
    assert_eq!((entries.len(), entries[0].others.len()), (2, 2));
    assert_eq!(entries[0].sentence(), "trials 1, 2, 3: labelled mug");
    for _ in 0..2 {
        let undone = store.journal().undo()?.ok_or("all three")?;
        assert!(undone.sentence().starts_with("trials 1, 2, 3: labelled mug"), "{}", undone.sentence());
        assert_eq!(labels(&store)?, before);
        let redone = store.journal().redo()?.ok_or("all three again")?;
        assert_eq!((redone.restored().as_str(), labels(&store)?), ("trials 1, 2, 3: labelled mug", mug()));
    }
    // Tags are added and removed one by one; a trial that has one already is no change.
    let tags = |store: &Store| -> Result<Vec<Vec<String>>, StoreError> {
        Ok(store.list(true)?.into_iter().map(|row| row.tags).collect())
    };
    store.labels().set_tags(1, &["wet".to_owned(), "late".to_owned()])?;
    let wet = TrialEdit::Tag(vec![" wet ".to_owned()]);
    assert_eq!(store.labels().edit(&[1, 2, simulated], &wet)?, Edited { changed: 2, known: 0 });
    assert_eq!(tags(&store)?, [vec!["wet", "late"], vec!["wet"], vec![], vec!["wet"]]);
    store.labels().edit(&[1, 2, 3], &TrialEdit::Untag(vec!["wet".to_owned()]))?;
    assert_eq!(tags(&store)?, [vec!["late"], vec![], vec![], vec!["wet"]]);
    assert_eq!(store.journal().undo()?.ok_or("tags")?.sentence(), "trials 1, 2: tag \"wet\" removed");
    assert_eq!(store.journal().undo()?.ok_or("tags")?.sentence(), format!("trials 2, {simulated}: tag \"wet\" added"));
    assert_eq!(tags(&store)?, [vec!["wet", "late"], vec![], vec![], vec![]]);
    // Deleting is one step, and one that cannot be undone whole changes nothing.
    store.delete(&[1, 2, 3])?;
    assert_eq!(store.journal().entries(1)?[0].sentence(), "trials 1, 2, 3: discarded");
    store.connection.execute("UPDATE trials SET deleted = NULL WHERE id = 2", [])?;
    assert!(store.journal().undo().is_err_and(|error| error.to_string().contains("of trial 2: the trial has changed")));
    assert_eq!(store.list(false)?.len(), 2, "none came back");
    // All or none: a trial that does not exist stops the rest.
    assert!(store.labels().edit(&[2, 99], &TrialEdit::Note("x".to_owned())).is_err());
    assert_eq!(store.list(false)?[0].note, "before");
    // Only simulated ones are left to label: that is an error.
    assert!(matches!(store.labels().edit(&[simulated], &label), Err(StoreError::NotOfBoard(_))));
    Ok(())
}

#[test]
fn nonsense_is_refused_and_changes_nothing() -> Outcome {
    let folder = tempfile::tempdir()?;
    let mut store = store_with(&folder.path().join("trials.sqlite"), &["lemon"])?;
    let simulated = store.insert(&without_frames("cube"))?.id();
    let message = |outcome: Result<(), StoreError>| outcome.expect_err("refused").to_string();
    assert!(message(store.labels().set_label(1, "  ")).contains("cannot be empty"));
    assert!(message(store.labels().set_label(simulated, "ball")).contains("only trials of the real gripper"));
    assert!(message(store.labels().set_label(9, "ball")).contains("no trial 9"));
    assert!(message(store.labels().set_note(1, &"x".repeat(4001))).contains("4000"));
    assert!(message(store.labels().set_tags(1, &["a\u{7}".to_owned()])).contains("control"));
    assert!(message(store.labels().set_guess(1, "m", &[("a".to_owned(), 0.4)])).contains("sum to 0.4"));
    assert!(message(store.labels().set_guess(1, "m", &[("a".to_owned(), f64::NAN)])).contains("not stored"));
    store.delete(&[1])?;
    assert!(message(store.labels().set_label(1, "ball")).contains("restore"));
    assert!(message(store.delete(&[1])).contains("restore"));
    store.restore(&[1])?;
    assert!(message(store.restore(&[1])).contains("not deleted"));
    assert_eq!(store.journal().entries(9)?.len(), 2, "refused changes have no entry");
    // A simulated trial takes notes all the same.
    store.labels().set_note(simulated, "odd")?;
    store.labels().set_label(1, "lemon")?;
    assert_eq!(store.journal().entries(9)?.len(), 3, "the same label again is no change");
    Ok(())
}

#[test]
fn the_plan_is_kept_and_in_the_journal() -> Outcome {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("trials.sqlite");
    let store = store_with(&path, &[])?;
    let mut plan = store.labels().plan()?;
    assert_eq!(plan, LabelPlan::default());
    plan.set("mug", 40)?;
    store.labels().set_plan(&plan)?;
    store.labels().set_plan(&plan)?;
    drop(store);
    let store = Store::open(&path)?;
    assert_eq!((store.labels().plan()?, store.journal().entries(9)?.len()), (plan, 1));
    assert_eq!(store.journal().entries(9)?[0].sentence(), "plan changed to 840 trials of 17 objects");
    Ok(())
}

#[test]
fn all_that_goes_with_a_trial_is_merged_and_only_once() -> Outcome {
    let folder = tempfile::tempdir()?;
    let (here, there) = (folder.path().join("here.sqlite"), folder.path().join("there.sqlite"));
    let mut ours = store_with(&here, &["box"])?;
    ours.labels().set_label(1, "case")?;
    let theirs = store_with(&there, &["", "cube"])?;
    theirs.labels().set_label(1, "lemon")?;
    theirs.labels().set_note(1, "slipped")?;
    theirs.labels().set_tags(1, &["wet".to_owned(), "late".to_owned()])?;
    theirs.labels().set_unsure(1, true)?;
    theirs.labels().set_guess(1, "m", &[("lemon".to_owned(), 0.25), ("ball".to_owned(), 0.75)])?;
    theirs.labels().mark_reviewed(1)?;
    theirs.labels().set_note(2, "x")?;
    theirs.journal().undo()?.ok_or("the note")?;
    theirs.labels().set_plan(&LabelPlan { objects: Vec::new() })?;
    assert_eq!(ours.merge_from(&there)?.added, 2);
    let numbered = |id: TrialId, row: &LabelledTrial| LabelledTrial { id, ..row.clone() };
    let (all, before) = (ours.labels().trials()?, theirs.labels().trials()?);
    assert_eq!(all[1..], [numbered(2, &before[0]), numbered(3, &before[1])]);
    assert_eq!(ours.labels().guess(2)?, theirs.labels().guess(1)?);
    let entries = ours.journal().entries(99)?;
    assert_eq!((entries.len(), entries[0].merged, entries[0].undoes), (9, true, Some(entries[1].number)));
    assert_eq!(entries[1].sentence(), "trial 3: note \"x\"");
    assert_eq!(ours.labels().plan()?, LabelPlan::default(), "the plan is a matter of each store");
    assert_eq!((ours.merge_from(&there)?.added, ours.journal().entries(99)?.len()), (0, 9));
    assert_eq!(
        ours.journal().undo()?.ok_or("our own")?.sentence(),
        "trial 1: label Cardboard box → Earphone case",
        "theirs was done elsewhere"
    );
    assert_eq!(ours.journal().undo()?, None);
    Ok(())
}

/// What somebody does.
#[derive(Clone, Debug)]
enum Deed {
    Label(TrialId, u8),
    Note(TrialId, u8),
    Tags(TrialId, u8),
    Unsure(TrialId, bool),
    Discard(TrialId),
    Restore(TrialId),
    Undo,
    Redo,
    Reopen,
}

fn deed() -> impl Strategy<Value = Deed> {
    let (id, n) = (1..=3i64, 0..3u8);
    prop_oneof![
        (id.clone(), n.clone()).prop_map(|(id, n)| Deed::Label(id, n)),
        (id.clone(), n.clone()).prop_map(|(id, n)| Deed::Note(id, n)),
        (id.clone(), n).prop_map(|(id, n)| Deed::Tags(id, n)),
        (id.clone(), any::<bool>()).prop_map(|(id, unsure)| Deed::Unsure(id, unsure)),
        id.clone().prop_map(Deed::Discard),
        id.prop_map(Deed::Restore),
        Just(Deed::Undo),
        Just(Deed::Undo),
        Just(Deed::Redo),
        Just(Deed::Reopen),
    ]
}

/// What a list shows, in short.
fn seen(store: &Store) -> Result<Vec<LabelledTrial>, StoreError> {
    store.labels().trials()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn undoing_and_redoing_is_going_back_and_forth_in_a_list_of_states(deeds in prop::collection::vec(deed(), 1..25)) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("trials.sqlite");
        let mut store = store_with(&path, &["", "lemon", "cube"]).expect("made");
        // The model: all states, and which is now.
        let (mut states, mut now) = (vec![seen(&store).expect("read")], 0_usize);
        for deed in deeds {
            let before = seen(&store).expect("read");
            let outcome = match deed.clone() {
                Deed::Label(id, n) => store.labels().set_label(id, &format!("class {n}")),
                Deed::Note(id, n) => store.labels().set_note(id, &"!".repeat(n.into())),
                Deed::Tags(id, n) => store.labels().set_tags(id, &(0..n).map(|k| k.to_string()).collect::<Vec<_>>()),
                Deed::Unsure(id, unsure) => store.labels().set_unsure(id, unsure),
                Deed::Discard(id) => store.delete(&[id]),
                Deed::Restore(id) => store.restore(&[id]),
                Deed::Undo => {
                    prop_assert_eq!(store.journal().undo().expect("alone").is_some(), now > 0);
                    now = now.saturating_sub(1);
                    Ok(())
                }
                Deed::Redo => {
                    prop_assert_eq!(store.journal().redo().expect("alone").is_some(), now + 1 < states.len());
                    now = (now + 1).min(states.len() - 1);
                    Ok(())
                }
                Deed::Reopen => {
                    drop(store);
                    store = Store::open(&path).expect("opens");
                    Ok(())
                }
            };
            let after = seen(&store).expect("read");
            match deed {
                Deed::Undo | Deed::Redo | Deed::Reopen => {}
                // What was refused changes nothing; what changes nothing is no deed.
                _ if outcome.is_err() => prop_assert_eq!(&after, &before),
                _ if after == before => {}
                _ => {
                    states.truncate(now + 1);
                    states.push(after.clone());
                    now += 1;
                }
            }
            prop_assert_eq!(&after, &states[now]);
        }
    }
}
