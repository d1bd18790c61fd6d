//! Is there room for a trial? Asked before it begins, so that a full disk spoils none.

use super::store_error::StoreError;
use std::path::Path;

/// Room that is left to others, and to the store's own log (bytes).
const RESERVE: f64 = 32e6;
/// With less than this a disk is full (bytes): SQLite's index of its log is 32 KiB.
const FULL: u64 = 64 << 10;

/// Refuses to begin what needs more bytes than are free where the store lies. A system that does not say is believed to
/// have room.
pub fn check_space(store: &Path, needed: f64) -> Result<(), StoreError> {
    match fs4::available_space(folder_of(store)) {
        Ok(free) => judge(store, free, needed),
        Err(error) => {
            tracing::debug!("free space is not known: {error}");
            Ok(())
        }
    }
}

/// True where the disk has no room for another page of a store.
pub(super) fn is_full(store: &Path) -> bool {
    fs4::available_space(folder_of(store)).is_ok_and(|free| free < FULL)
}

fn folder_of(store: &Path) -> &Path {
    store.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn judge(store: &Path, free: u64, needed: f64) -> Result<(), StoreError> {
    if free as f64 >= needed + RESERVE {
        return Ok(());
    }
    let mega = |bytes: f64| (bytes * 1e-6).ceil() as u64;
    Err(StoreError::NoRoom { path: store.to_owned(), free_mb: mega(free as f64), needed_mb: mega(needed + RESERVE) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trial_that_would_not_fit_is_refused_with_numbers() {
        let path = Path::new("/data/trials.sqlite");
        assert!(judge(path, 1_000_000_000, 240e6).is_ok());
        let text = judge(path, 5_000_000, 240e6).map_err(|error| error.to_string());
        assert!(text.is_err_and(|text| text.contains("5 MB") && text.contains("272 MB") && text.contains("/data")));
        let folder = std::env::temp_dir().join("store.sqlite");
        assert!(!is_full(&folder) && check_space(&folder, 1.0).is_ok() && check_space(&folder, 1e18).is_err());
    }
}
