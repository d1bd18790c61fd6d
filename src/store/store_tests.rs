//! The store itself: what goes in comes out, together with other programs, from old versions, and not from foreign files.

use super::identity::Stored;
use super::store::*;
use super::store_error::StoreError;
use crate::test_trials::grasp;
use palpate_geometry::Primitive;
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::Scene;
use palpate_tactile::trial::{GraspOrigin, SimulatedTrial};
use rusqlite::Connection;

fn trial(seed: u64) -> SimulatedTrial {
    let mut scene = Scene::default();
    scene.timing.duration_s = 1.2;
    let ball = ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.02 }, 400.0, 0.6);
    grasp(&scene, Some(&ball), seed)
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

#[test]
fn a_trial_survives_storing() -> Result<(), StoreError> {
    let folder = folder();
    let mut store = Store::open(&folder.path().join("new/trials.sqlite"))?;
    let trial = trial(u64::MAX);
    let id = store.insert(&trial)?.id();
    assert!(store.load(id)? == trial.clone().into());
    let rows = store.list(false)?;
    assert_eq!((rows.len(), rows[0].samples, rows[0].state.as_str()), (1, 90, "complete"));
    Ok(())
}

#[test]
fn a_grasp_is_stored_once_and_copies_are_told() -> Result<(), StoreError> {
    let folder = folder();
    let mut store = Store::open(&folder.path().join("trials.sqlite"))?;
    let mut trial = trial(1);
    trial.header.origin = Some(GraspOrigin::default());
    let first = store.insert(&trial)?.id();
    assert_eq!(store.insert(&trial)?, Stored::Known(first));
    store.delete(&[first])?;
    let second = store.insert(&trial)?.id();
    store.restore(&[first])?;
    let rows = store.list(false)?;
    let told: Vec<_> = rows.iter().map(|row| (row.id, row.duplicate_of)).collect();
    assert_eq!(told, [(first, None), (second, Some(first))]);
    Ok(())
}

#[test]
fn a_renamed_object_does_not_bring_a_trial_into_its_own_collection_again() -> Result<(), Box<dyn std::error::Error>> {
    let folder = folder();
    let mut store = Store::open(&folder.path().join("trials.sqlite"))?;
    let mut trial = trial(1);
    trial.header.origin = Some(GraspOrigin::default());
    trial.header.collection = Some("set".to_owned());
    assert_eq!(store.insert_collected([&trial].into_iter())?, 1);
    store.connection.execute("UPDATE trials SET object = 'mug'", [])?;
    assert_eq!(store.insert_collected([&trial].into_iter())?, 0);
    assert_eq!(store.list(false)?[0].collections().collect::<Vec<_>>(), ["set"]);
    // Nor is it made again where it was deleted.
    store.delete(&[1])?;
    assert_eq!(store.insert_collected([&trial].into_iter())?, 0);
    Ok(())
}

#[test]
fn two_programs_share_a_store() -> Result<(), StoreError> {
    let folder = folder();
    let path = folder.path().join("trials.sqlite");
    let mut first = Store::open(&path)?;
    let mut second = Store::open(&path)?;
    let trial = trial(2);
    std::thread::scope(|scope| {
        for store in [&mut first, &mut second] {
            scope.spawn(|| {
                for _ in 0..20 {
                    store.insert(&trial).expect("waits for its turn");
                }
            });
        }
    });
    assert_eq!(first.list(false)?.len(), 40);
    assert!(second.load(40)? == trial.into());
    Ok(())
}

#[test]
fn deleting_can_be_undone_until_purged() -> Result<(), StoreError> {
    let folder = folder();
    let mut store = Store::open(&folder.path().join("trials.sqlite"))?;
    let (a, b) = (store.insert(&trial(3))?.id(), store.insert(&trial(4))?.id());
    assert!(store.delete(&[a, 99]).is_err_and(|error| error.to_string().contains("no trial 99")));
    assert_eq!(store.list(false)?.len(), 2, "all or none");
    store.delete(&[a])?;
    assert_eq!(store.list(false)?.len(), 1);
    let message = store.load(a).expect_err("deleted").to_string();
    assert!(message.contains("restore"), "{message}");
    store.restore(&[a])?;
    assert_eq!(store.load(a)?.header.seed, 3);
    store.delete(&[b])?;
    assert_eq!(store.purge()?, 1);
    assert_eq!(store.list(true)?.len(), 1);
    Ok(())
}

#[test]
fn foreign_newer_older_and_damaged_files_are_refused() -> Result<(), Box<dyn std::error::Error>> {
    let folder = folder();
    let text = folder.path().join("notes.txt");
    std::fs::write(&text, "no database at all, but long enough to be looked at as one would be".repeat(20))?;
    let refused =
        |path: &std::path::Path, why: &str| Store::open(path).is_err_and(|error| error.to_string().contains(why));
    assert!(refused(&text, "is not a store of Palpate"));

    let other = folder.path().join("other.sqlite");
    Connection::open(&other)?.execute_batch("CREATE TABLE mine (x)")?;
    assert!(refused(&other, "is not a store of Palpate"));

    let newer = folder.path().join("newer.sqlite");
    Store::open(&newer)?;
    Connection::open(&newer)?.pragma_update(None, "user_version", 99)?;
    assert!(refused(&newer, "newer Palpate (store version 99,"));
    Connection::open(&newer)?.pragma_update(None, "user_version", 14)?;
    assert!(refused(&newer, "earlier development version of Palpate (store version 14,"));

    let damaged = folder.path().join("damaged.sqlite");
    let id = Store::open(&damaged)?.insert(&trial(5))?.id();
    Connection::open(&damaged)?.execute("UPDATE chunks SET frames = x'00', checksum = NULL WHERE number = 1", [])?;
    let error = Store::open(&damaged)?.load(id).expect_err("damaged");
    assert!(error.to_string().contains("part 1, do not match"), "also in a row without a checksum");
    Ok(())
}

#[test]
fn sources_and_scenes_of_newer_programs_are_named_only_when_they_are_needed() -> Result<(), StoreError> {
    let folder = folder();
    let path = folder.path().join("trials.sqlite");
    let mut store = Store::open(&path)?;
    let scene = store.insert(&trial(6))?.id();
    let source = store.insert(&trial(7))?.id();
    let write = |sql: &str| Connection::open(&path).and_then(|connection| connection.execute(sql, [])).expect("writes");
    write("UPDATE trials SET scene = '[gripper]\ntentacles = 8\n' WHERE id = 1");
    assert_eq!(store.list(false)?.len(), 2, "a list needs no scene");
    let message = store.load(scene).expect_err("newer").to_string();
    assert!(message.contains("trial 1") && message.contains("tentacles"), "{message}");
    write("UPDATE trials SET rig = 'octopus' WHERE id = 2");
    let message = store.load(source).expect_err("newer").to_string();
    assert!(message.contains("trial 2") && message.contains("\"octopus\""), "{message}");
    let damaged: Vec<bool> = store.list(false)?.iter().map(|row| row.damaged).collect();
    assert_eq!(damaged, [true, true], "written past the program");
    Ok(())
}

#[test]
fn what_stands_in_the_place_of_a_log_is_refused() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("a.sqlite");
    drop(Store::open(&path)?);
    for ending in ["-wal", "-shm", "-journal"] {
        let part = folder.path().join(format!("a.sqlite{ending}"));
        std::fs::create_dir(&part)?;
        for outcome in [Store::open(&path), Store::open_to_read(&path)] {
            let said = outcome.map(drop).expect_err(ending).to_string();
            assert!(said.contains(ending) && said.contains("is not a regular file"), "{said}");
        }
        std::fs::remove_dir(&part)?;
    }
    Store::open(&path)?;
    Ok(())
}
