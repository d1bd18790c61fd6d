//! A slot that holds the newest value: writing replaces, reading never waits for a writer's work.

use std::sync::{Arc, Mutex, PoisonError};

/// The newest value of something, shared between threads.
#[derive(Debug)]
pub(super) struct Latest<T> {
    slot: Mutex<Option<Arc<T>>>,
}

impl<T> Default for Latest<T> {
    fn default() -> Self {
        Self { slot: Mutex::new(None) }
    }
}

impl<T> Latest<T> {
    /// Replaces the value.
    pub(super) fn publish(&self, value: Arc<T>) {
        // A pointer is swapped under the lock, nothing that could panic; a poisoned lock still holds a whole value.
        *self.slot.lock().unwrap_or_else(PoisonError::into_inner) = Some(value);
    }

    /// The newest value, if there has been one.
    pub(super) fn get(&self) -> Option<Arc<T>> {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn newer_replaces_older() {
        let slot = Latest::default();
        assert!(slot.get().is_none());
        slot.publish(Arc::new(1));
        slot.publish(Arc::new(2));
        assert_eq!(slot.get().as_deref(), Some(&2));
    }
}
