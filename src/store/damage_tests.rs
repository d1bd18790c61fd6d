//! Damaged blobs: whichever byte of a stored trial is flipped, loading the trial names it.

use super::*;
use crate::test_trials::{grasp, header};
use palpate_sim::scene::Scene;
use palpate_tactile::Signals;
use palpate_tactile::board::{Gap, Reading};
use palpate_tactile::capture::Captured;
use palpate_tactile::trial::TrialId;
use rusqlite::{Connection, params};

type Outcome = Result<(), Box<dyn std::error::Error>>;

/// Flips one bit in each of many bytes of a column's first blob, and demands that reading fails with the trial's number.
fn every_flip_is_found<T>(
    store: &Store,
    [table, column]: [&str; 2],
    id: TrialId,
    read: impl Fn(&Store) -> Result<T, StoreError>,
) -> Outcome {
    let select = format!("SELECT CAST({column} AS BLOB), typeof({column}) FROM {table} WHERE trial = ?1");
    let (whole, kind): (Vec<u8>, String) =
        store.connection.query_row(&select, [id], |row| Ok((row.get(0)?, row.get(1)?)))?;
    let update = format!("UPDATE {table} SET {column} = CAST(?2 AS {kind}) WHERE trial = ?1");
    assert!(read(store).is_ok());
    // A prime step visits all fields of all records.
    for at in (0..whole.len()).step_by(if whole.len() > 2000 { 37 } else { 1 }) {
        let mut flipped = whole.clone();
        flipped[at] ^= 1 << (at % 8);
        store.connection.execute(&update, params![id, flipped])?;
        let Err(error) = read(store) else { panic!("byte {at} of {column} in {table}: not found") };
        let text = error.to_string();
        assert!(
            error.is_damage()
                && text.contains("do not match their checksum")
                && text.contains(&format!("trial {id} is damaged")),
            "{text}"
        );
        assert!(text.contains("backup"), "{text}");
    }
    store.connection.execute(&update, params![id, whole])?;
    assert!(read(store).is_ok());
    Ok(())
}

#[test]
fn a_flipped_byte_is_found_in_frames_readings_bytes_and_channels() -> Outcome {
    let folder = tempfile::tempdir()?;
    let mut store = Store::open(&folder.path().join("trials.sqlite"))?;
    let mut scene = Scene::default();
    scene.timing.duration_s = 0.5;
    let simulated = store.insert(&grasp(&scene, None, 0))?.id();
    every_flip_is_found(&store, ["chunks", "frames"], simulated, |store| store.load(simulated))?;

    let reading = |k: u32| {
        let t_s = f64::from(k) * 0.02;
        Reading { t_s, arrived_s: t_s, seq: Some(k.into()), counts: vec![Some(1200.0), None], line_bar: Some(0.5) }
    };
    let chunk = BoardChunk {
        readings: (0..5).map(reading).collect(),
        gaps: vec![Gap { from_s: 0.02, to_s: 0.06, lost: Some(1), cause: String::new() }],
        bytes: vec![Captured::Bytes { arrived_s: 0.0, bytes: b"0,1200,0.5\n".to_vec() }],
    };
    let board = store.begin_board(&header("lemon"), &BoardInfo::default())?;
    store.append_board(board, &BoardInfo::default(), &chunk)?;
    every_flip_is_found(&store, ["board_chunks", "readings"], board, |store| store.board_log(board))?;
    every_flip_is_found(&store, ["board_chunks", "bytes"], board, |store| store.board_bytes(board))?;
    every_flip_is_found(&store, ["board_chunks", "gaps"], board, |store| store.board_log(board))?;

    let signals = Signals { channels: vec!["p".to_owned()], t_s: vec![0.0, 0.1], values: vec![1.0, 2.0] };
    let (name, label) = ("1".to_owned(), "mug".to_owned());
    store.insert_imported("mine", &[ImportedTrial { name, label, size: None, shape: None, session: None, signals }])?;
    let imported = board + 1;
    every_flip_is_found(&store, ["readings", "samples"], imported, |store| store.readings(imported))?;
    every_flip_is_found(&store, ["readings", "channels"], imported, |store| store.readings(imported))?;

    // Merging keeps the checksums.
    let mut other = Store::open(&folder.path().join("other.sqlite"))?;
    assert!(other.merge_from(store.path())?.damaged.is_empty());
    assert_eq!((other.load(1)?, other.board_log(board)?), (store.load(1)?, store.board_log(board)?));
    other.connection.execute("UPDATE chunks SET frames = zeroblob(length(frames))", [])?;
    let text = other.load(1).expect_err("damaged").to_string();
    assert!(text.starts_with("trial 1 is damaged: its frames, part 0, do not match their checksum"), "{text}");
    Ok(())
}

/// A store with three trials, two chunks each: simulated, simulated, and of the real gripper.
fn three(path: &std::path::Path) -> Result<Store, Box<dyn std::error::Error>> {
    let mut store = Store::open(path)?;
    let mut scene = Scene::default();
    scene.timing.duration_s = 1.6;
    for seed in [1, 2] {
        store.insert(&grasp(&scene, None, seed))?;
    }
    let board = store.begin_board(&header("lemon"), &BoardInfo::default())?;
    for t_s in [0.0, 1.0] {
        let reading = Reading { t_s, arrived_s: t_s, seq: None, counts: vec![Some(1.0)], line_bar: None };
        let bytes = vec![Captured::Bytes { arrived_s: t_s, bytes: b"1\n".to_vec() }];
        let chunk = BoardChunk { readings: vec![reading], gaps: Vec::new(), bytes };
        store.append_board(board, &BoardInfo::default(), &chunk)?;
    }
    store.finish_board(board, &BoardInfo::default(), &[])?;
    Ok(store)
}

/// What another program does to a trial.
const DAMAGES: [(&str, TrialId); 13] = [
    ("UPDATE trials SET created = '2026-11-2X' WHERE id = 2", 2),
    ("UPDATE trials SET created = '2026-11-20T00:00:00.000Z' WHERE id = 2", 2),
    ("UPDATE trials SET object = CAST(x'ff6c' AS TEXT) WHERE id = 1", 1),
    ("UPDATE trials SET object = 'lime' WHERE id = 3", 3),
    ("UPDATE trials SET seed = 'three' WHERE id = 1", 1),
    ("UPDATE trials SET samples = 'many' WHERE id = 1", 1),
    ("UPDATE trials SET rig = 'octopus' WHERE id = 1", 1),
    ("UPDATE trials SET scene = replace(scene, '0', '1') WHERE id = 2", 2),
    ("UPDATE trials SET quality = '{}' WHERE id = 2", 2),
    ("UPDATE trials SET checksum = NULL WHERE id = 2", 2),
    ("UPDATE board_trials SET about = replace(about, '{', '{ ') WHERE trial = 3", 3),
    ("UPDATE board_trials SET about = 'x' WHERE trial = 3", 3),
    ("UPDATE trials SET note = 'nice', tags = 7 WHERE id = 3", 3),
];

#[test]
fn one_damaged_row_is_one_damaged_row() -> Outcome {
    for (sql, id) in DAMAGES {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("trials.sqlite");
        let mut store = three(&path)?;
        Connection::open(&path)?.execute(sql, [])?;
        let damaged = |rows: Vec<TrialRow>| -> Vec<TrialId> {
            assert!(rows.iter().all(|row| !(row.damaged && row.sound)), "{sql}");
            rows.iter().filter(|row| row.damaged).map(|row| row.id).collect()
        };
        let rows = store.list(true)?;
        assert_eq!((rows.len(), damaged(rows)), (3, vec![id]), "{sql}");
        for other in (1..=3).filter(|other| *other != id) {
            assert!(store.load(other).is_ok(), "{sql}: trial {other}");
        }
        let error = store.load(id).expect_err(sql);
        assert!(
            error.is_damage() && error.to_string().contains(&format!("palpate trials delete {id}")),
            "{sql}: {error}"
        );
        let labelled = store.labels().trials()?;
        assert_eq!(labelled.iter().any(|trial| trial.damaged), id == 3, "{sql}");
        // An edit is refused, and one that is not does not hide the damage.
        assert!(sql.contains("board_trials") || store.labels().set_note(id, "mine").is_err(), "{sql}");
        store.connection.execute("UPDATE trials SET note = 'mine', unsure = 1 WHERE id = ?1", [id])?;
        assert_eq!(damaged(store.list(true)?), [id], "{sql}");
        let mut other = Store::open(&folder.path().join("other.sqlite"))?;
        let merged = other.merge_from(&path)?;
        assert_eq!((merged.added, merged.known, merged.damaged), (2, 0, vec![id]), "{sql}");
        assert_eq!(damaged(other.list(true)?), [0; 0], "{sql}");
        // The remedy that the list names.
        store.delete(&[id])?;
        assert_eq!((damaged(store.list(false)?), store.purge()?), (vec![], 1), "{sql}");
    }
    Ok(())
}

#[test]
fn missing_and_exchanged_chunks_are_found() -> Outcome {
    let damages = [
        ("DELETE FROM chunks WHERE trial = 1 AND number = 0", 1, "1 of its 2 parts"),
        ("DELETE FROM chunks WHERE trial = 1 AND number = 1", 1, "1 of its 2 parts"),
        ("DELETE FROM chunks WHERE trial = 1", 1, "0 of its 2 parts"),
        ("DELETE FROM board_chunks WHERE trial = 3 AND number = 1", 3, "1 of its 2 parts"),
        ("DELETE FROM board_trials WHERE trial = 3", 3, "no board"),
        (
            "UPDATE chunks SET (frames, checksum) = (SELECT frames, checksum FROM chunks WHERE trial = 2 AND number = 0)
             WHERE trial = 1 AND number = 0",
            1,
            "do not match their checksum",
        ),
        (
            "UPDATE chunks SET number = 7 WHERE trial = 1 AND number = 0;
             UPDATE chunks SET number = 0 WHERE trial = 1 AND number = 1;
             UPDATE chunks SET number = 1 WHERE trial = 1 AND number = 7",
            1,
            "do not match their checksum",
        ),
    ];
    for (sql, id, text) in damages {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("trials.sqlite");
        let store = three(&path)?;
        Connection::open(&path)?.execute_batch(sql)?;
        let error = store.load(id).expect_err(sql);
        assert!(error.is_damage() && error.to_string().contains(text), "{sql}: {error}");
        let listed = store.list(false)?.iter().any(|row| row.id == id && row.damaged);
        assert_eq!(listed, !sql.starts_with("UPDATE"), "a list does not read the data: {sql}");
        let mut other = Store::open(&folder.path().join("other.sqlite"))?;
        let merged = other.merge_from(&path)?;
        assert_eq!((merged.added, merged.damaged), (2, vec![id]), "{sql}");
    }
    Ok(())
}
