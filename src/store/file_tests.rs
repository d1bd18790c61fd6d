//! The file of a store: gone, replaced or cut short while it is open, and names that SQLite takes for something else.

use super::*;
use crate::test_trials::{header, without_frames};
use std::path::Path;

type Outcome = Result<(), Box<dyn std::error::Error>>;

/// What somebody does to a file, and how the message calls it.
type Event = (&'static str, fn(&Path) -> std::io::Result<()>);

const EVENTS: [Event; 5] = [
    ("deleted or moved", |path| std::fs::remove_file(path)),
    ("deleted or moved", |path| std::fs::rename(path, path.with_extension("moved"))),
    ("deleted or moved", |path| std::fs::remove_dir_all(path.parent().unwrap_or(path))),
    ("replaced by another file", |path| {
        let other = path.with_extension("other");
        drop(Store::open(&other));
        std::fs::rename(other, path)
    }),
    ("cut short", |path| std::fs::OpenOptions::new().write(true).open(path)?.set_len(100)),
];

#[cfg(unix)]
#[test]
fn a_store_that_is_lost_while_open_takes_nothing_in() -> Outcome {
    for (name, event) in EVENTS {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("in").join("trials.sqlite");
        let mut store = Store::open(&path)?;
        let id = store.begin_board(&header("lemon"), &BoardInfo::default())?;
        event(&path)?;
        let outcomes = [
            store.insert(&without_frames("lemon")).map(drop),
            store.finish_board(id, &BoardInfo::default(), &[]),
            store.labels().set_note(id, "slipped"),
            store.delete(&[id]),
        ];
        for outcome in outcomes {
            let text = outcome.expect_err(name).to_string();
            assert!(text.contains(name) && text.contains("while it was open") && text.contains("--store"), "{text}");
        }
    }
    Ok(())
}

#[cfg(unix)]
#[test]
fn a_loss_in_the_middle_of_a_transaction_is_noticed_before_it_counts_as_stored() -> Outcome {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("trials.sqlite");
    let store = Store::open(&path)?;
    let transaction = store.write()?;
    std::fs::remove_file(&path)?;
    assert!(matches!(store.commit(transaction), Err(StoreError::FileLost { .. })));
    Ok(())
}

#[cfg(unix)]
#[test]
fn a_store_is_merged_by_its_name_as_it_is_spelt() -> Outcome {
    use std::os::unix::ffi::OsStrExt as _;
    let folder = tempfile::tempdir()?;
    for (name, count) in [(&b"file:x?mode=memory"[..], 2), (b"bad\xff.sqlite", 3), (b"a b%20c.sqlite", 4)] {
        let path = folder.path().join(std::ffi::OsStr::from_bytes(name));
        Store::open(&path)?.insert(&without_frames("lemon"))?;
        let mut all = Store::open(&folder.path().join("all.sqlite"))?;
        assert_eq!(all.merge_from(&path)?.added, 1, "{name:?}");
        drop(all);
        assert_eq!(std::fs::read_dir(folder.path())?.count(), count, "no stray file");
    }
    assert!(Store::open(Path::new("")).is_err_and(|error| error.to_string().starts_with("cannot open the store")));
    Ok(())
}
