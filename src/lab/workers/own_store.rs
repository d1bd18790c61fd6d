//! Store of a thread.

use palpate_store::{Store, StoreError};
use std::path::PathBuf;

/// A store that is opened when it is first needed.
pub(super) struct OwnStore {
    path: PathBuf,
    store: Option<Store>,
    /// Warnings from opening it.
    pub(super) warnings: Vec<String>,
}

impl OwnStore {
    pub(super) fn new(path: PathBuf) -> Self {
        Self { path, store: None, warnings: Vec::new() }
    }

    pub(super) fn open(&mut self) -> Result<&mut Store, StoreError> {
        match &mut self.store {
            Some(store) => Ok(store),
            empty @ None => {
                let store = Store::open(&self.path)?;
                self.warnings.extend_from_slice(store.warnings());
                Ok(empty.insert(store))
            }
        }
    }

    /// The store, once it is open.
    pub(super) fn opened(&self) -> Option<&Store> {
        self.store.as_ref()
    }
}
