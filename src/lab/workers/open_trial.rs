//! Stored trials, opened in the background.

use super::job::{Job, Newer};
use super::messages::Wake;
use crate::inspection::{OpenOptions, OpenTrial};
use palpate_store::{Store, StoreError};
use palpate_tactile::trial::TrialId;
use std::path::PathBuf;

/// A trial to open.
#[derive(Clone, Debug)]
pub struct OpenRequest {
    /// The trial.
    pub id: TrialId,
    /// How.
    pub options: OpenOptions,
}

/// The job. The store is opened with the first trial, and never created.
pub fn open_trial_job(store: PathBuf, wake: Wake) -> Job<OpenRequest, OpenTrial> {
    let mut reader: Option<Store> = None;
    Job::new("inspect", Newer::Waits, wake, move |OpenRequest { id, options }: &OpenRequest, _run| {
        let reader = match &mut reader {
            Some(reader) => reader,
            None if !store.exists() => {
                return Err(StoreError::no_trial(*id, ": the store is empty").into());
            }
            empty @ None => empty.insert(Store::open(&store)?),
        };
        Ok(Some(OpenTrial::open(reader, *id, options)?))
    })
}
