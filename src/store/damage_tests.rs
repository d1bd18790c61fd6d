//! Damaged blobs: whichever byte of a stored trial is flipped, loading the trial names it.

use super::*;
use crate::test_trials::{grasp, header};
use palpate_sim::scene::Scene;
use palpate_tactile::Signals;
use palpate_tactile::board::{Gap, Reading};
use palpate_tactile::capture::Captured;
use palpate_tactile::trial::TrialId;
use rusqlite::params;

type Outcome = Result<(), Box<dyn std::error::Error>>;

/// Flips one bit in each of many bytes of a column's first blob, and demands that reading fails with the trial's number.
fn every_flip_is_found<T>(
    store: &Store,
    [table, column]: [&str; 2],
    id: TrialId,
    read: impl Fn(&Store) -> Result<T, StoreError>,
) -> Outcome {
    let select = format!("SELECT CAST({column} AS BLOB) FROM {table} WHERE trial = ?1");
    let whole: Vec<u8> = store.connection.query_row(&select, [id], |row| row.get(0))?;
    assert!(read(store).is_ok());
    // A prime step visits all fields of all records.
    for at in (0..whole.len()).step_by(if whole.len() > 2000 { 37 } else { 1 }) {
        let mut flipped = whole.clone();
        flipped[at] ^= 1 << (at % 8);
        let update = format!("UPDATE {table} SET {column} = ?2 WHERE trial = ?1");
        store.connection.execute(&update, params![id, flipped])?;
        let Err(error) = read(store) else { panic!("byte {at} of {column} in {table}: not found") };
        let text = error.to_string();
        assert!(
            matches!(error, StoreError::Checksum { .. }) && text.contains(&format!("trial {id} is damaged")),
            "{text}"
        );
        assert!(text.contains("backup"), "{text}");
    }
    let update = format!("UPDATE {table} SET {column} = ?2 WHERE trial = ?1");
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
    store.insert_imported("mine", &[ImportedTrial { name, label, size: None, shape: None, signals }])?;
    let imported = board + 1;
    every_flip_is_found(&store, ["readings", "samples"], imported, |store| store.readings(imported))?;
    every_flip_is_found(&store, ["readings", "channels"], imported, |store| store.readings(imported))?;

    // Merging keeps the checksums.
    let mut other = Store::open(&folder.path().join("other.sqlite"))?;
    other.merge_from(store.path())?;
    other.connection.execute("UPDATE chunks SET frames = zeroblob(length(frames))", [])?;
    assert!(matches!(other.load(1), Err(StoreError::Checksum { id: 1, what: "frames", chunk: 0 })));
    Ok(())
}
