//! Free space for a trial, checked before it begins so that a full disk cannot cut it short.

use super::store_error::{StoreError, folder_of};
use std::path::Path;

/// Space kept free for other programs and the store's own log (bytes).
const RESERVE: f64 = 32e6;

/// Refuses a trial that needs more bytes than are free on the store's disk. Where the system does not report free
/// space, the trial may begin.
pub fn check_space(store: &Path, needed: f64) -> Result<(), StoreError> {
    match fs4::available_space(folder_of(store)) {
        Ok(free) => judge(store, free, needed),
        Err(error) => {
            tracing::debug!("free space is not known: {error}");
            Ok(())
        }
    }
}

fn judge(store: &Path, free: u64, needed: f64) -> Result<(), StoreError> {
    if free as f64 >= needed + RESERVE {
        return Ok(());
    }
    let mega = |bytes: f64| (bytes * 1e-6).ceil() as u64;
    Err(StoreError::Refused(format!(
        "the disk with the store \"{}\" has {} MB free; the trial may need {} MB and was not begun. Free some space, or \
         choose another disk with --store",
        store.display(),
        mega(free as f64),
        mega(needed + RESERVE)
    )))
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
        assert!(check_space(&folder, 1.0).is_ok() && check_space(&folder, 1e18).is_err());
    }
}
