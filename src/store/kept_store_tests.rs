//! A store that was made earlier opens unchanged, with everything in it. It holds a simulated grasp, two imported trials, two
//! trials of the emulated board, calibrations, tares, labels, notes, a plan and their journal. Version 0.1.0 made it, and commit
//! 29b20e5 gave it today's tables.

use super::*;
use crate::labels::Flag;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

type Outcome = Result<(), Box<dyn std::error::Error>>;

/// A copy of the file.
fn copied(folder: &Path) -> std::io::Result<PathBuf> {
    let path = folder.join("trials.sqlite");
    std::fs::copy(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/suite/data/store.sqlite"), &path)?;
    Ok(path)
}

/// Name and definition of every table, index and trigger; of tables, the columns.
fn shape(store: &Store) -> rusqlite::Result<BTreeMap<String, Vec<String>>> {
    let list = |sql: &str, of: &[&str]| -> rusqlite::Result<Vec<String>> {
        let mut statement = store.connection.prepare(sql)?;
        let rows = statement.query_map(rusqlite::params_from_iter(of), |row| row.get(0))?;
        rows.collect()
    };
    let mut shape = BTreeMap::new();
    for name in list("SELECT name FROM sqlite_master", &[])? {
        let columns =
            "SELECT format('%s %s %d %s %d', name, type, \"notnull\", dflt_value, pk) FROM pragma_table_info(?1)";
        let others = "SELECT sql FROM sqlite_master WHERE name = ?1 AND type <> 'table' AND sql NOT NULL";
        let rest =
            list(others, &[&name])?.iter().map(|sql| sql.split_whitespace().collect::<Vec<_>>().join(" ")).collect();
        shape.insert(name.clone(), [list(columns, &[&name])?, rest].concat());
    }
    Ok(shape)
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-6 * b.abs()
}

#[test]
fn it_is_opened_unchanged_listed_and_loaded() -> Outcome {
    let folder = tempfile::tempdir()?;
    let path = copied(folder.path())?;
    let before = std::fs::read(&path)?;
    let store = Store::open(&path)?;
    assert!(store.warnings().is_empty() && std::fs::read(&path)? == before);
    assert_eq!(shape(&store)?, shape(&Store::open(&folder.path().join("new.sqlite"))?)?, "new stores have its tables");

    let rows = store.list(true)?;
    let listed: Vec<_> = rows.iter().map(|row| (row.object.as_str(), row.source.name(), row.samples)).collect();
    let expected = [
        ("lemon", "sim", 90),
        ("mug", "import", 3),
        ("key", "import", 2),
        ("lemon", "serial", 161),
        ("ball", "serial", 50),
    ];
    assert_eq!(listed, expected);
    assert!(rows.iter().all(|row| row.state == "complete"));
    assert_eq!((rows[0].seed, rows[0].note.as_str(), rows[0].warnings), (7, "simulated", 1));
    assert_eq!(rows[1].properties, Some(("large".to_owned(), "cylindrical".to_owned())));
    assert!(rows[2].deleted.is_some() && rows[4].unsure && rows[4].flags[0].flag == Flag::NoContact);
    assert_eq!((rows[3].note.as_str(), rows[3].tags.join(" ")), ("slipped a little", "wet late".to_owned()));

    let simulated = store.load(1)?;
    assert_eq!((simulated.frames().len(), simulated.header.version.as_str()), (90, "0.1.0"));
    let third_joint: f64 = simulated.frames().iter().map(|frame| frame.q[2]).sum();
    assert!(near(third_joint, 2.968_052_614_650_289), "{third_joint}");
    let stored: Vec<u8> = store.connection.query_row("SELECT frames FROM chunks", [], |row| row.get(0))?;
    assert_eq!(encode_frames(&simulated.frames()[..75]), stored, "to the bit");

    let imported = store.readings(2)?.ok_or("imported")?;
    assert_eq!(imported.channels, ["pressure_left", "pressure_right"]);
    assert_eq!(imported.values, [102.5, 99.1, 103.0, 99.4, 103.0, 100.25]);

    for (id, readings, bytes) in [(4, 161, 17_083), (5, 50, 4995)] {
        let trial = store.board_log(id)?.ok_or("of the board")?;
        assert_eq!((trial.readings.len(), trial.gaps.len(), trial.course.board.channels.len()), (readings, 0, 4));
        assert_eq!(store.board_bytes(id)?.map(|bytes| bytes.len()), Some(bytes));
    }
    let reading = &store.board_log(4)?.ok_or("of the board")?.readings[58];
    assert_eq!((reading.counts[0], reading.counts[3], reading.line_bar), (Some(1687.8), Some(946.1), Some(0.6)));
    Ok(())
}

#[test]
fn its_labels_journal_and_calibrations_are_kept() -> Outcome {
    let folder = tempfile::tempdir()?;
    let store = Store::open(&copied(folder.path())?)?;
    let entries = store.journal().entries(99)?;
    assert_eq!((entries.len(), entries[0].number), (10, 10));
    assert_eq!(entries[0].sentence(), "plan changed to 840 trials of 17 objects");
    assert_eq!(entries[2].sentence(), "trial 5: label marked as unsure (undoes 7)");
    assert_eq!(store.labels().plan()?.objects.len(), 17);
    // The history goes back to its beginning and forth again.
    let before = store.labels().trials()?;
    let mut undone = 0;
    while store.journal().undo()?.is_some() {
        undone += 1;
    }
    assert_eq!((undone, store.labels().trials()?[1].object.as_deref()), (7, None));
    while store.journal().redo()?.is_some() {}
    assert_eq!(store.labels().trials()?, before);

    let parts: Vec<String> = store.calibrations().list(None)?.into_iter().map(|stored| stored.record.part).collect();
    assert_eq!(parts, ["A7", "P3", "A8", "P4"]);
    let tare = store.calibrations().tare()?.ok_or("tared")?;
    assert_eq!(tare.parts.iter().map(|part| part.part.as_str()).collect::<Vec<_>>(), ["A7", "P3"]);
    assert_eq!(store.calibrations().serving(Some(4), &[])?.ids, [1, 3, 4, 2]);
    Ok(())
}
