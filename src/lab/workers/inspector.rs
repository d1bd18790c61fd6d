//! Thread "inspect": opens stored trials for looking at, one after the other.

use super::background_job::BackgroundJob;
use super::messages::Wake;
use crate::inspection::{Keep, OpenOptions, OpenTrial, OpenTrialError};
use palpate_store::{Store, StoreError};
use palpate_tactile::trial::TrialId;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, channel};

/// A trial to open.
#[derive(Clone, Debug)]
pub struct OpenRequest {
    /// The trial.
    pub id: TrialId,
    /// How.
    pub options: OpenOptions,
}

/// Outcome of a request.
#[derive(Debug)]
pub struct Opened {
    /// The trial.
    pub id: TrialId,
    /// With the 3-D view, or for comparison only.
    pub scenery: bool,
    /// The trial, or why it cannot be opened.
    pub trial: Result<Arc<OpenTrial>, OpenTrialError>,
}

/// Handle of the thread. Dropping it ends the thread.
#[derive(Debug)]
pub struct Inspector {
    job: BackgroundJob<OpenRequest, ()>,
    opened: Receiver<Opened>,
}

impl Inspector {
    /// Starts the thread. The store is opened with the first trial, and never created.
    pub fn start(store: PathBuf, wake: Wake) -> std::io::Result<Self> {
        let (sender, opened) = channel();
        let mut reader: Option<Store> = None;
        let job = BackgroundJob::spawn("inspect", wake, move |request: OpenRequest, stop, _outlet| {
            if stop.load(Ordering::Relaxed) {
                return;
            }
            let OpenRequest { id, options } = request;
            let trial = open(&mut reader, &store, id, &options).map(Arc::new);
            // The window may have been closed.
            let _heard = sender.send(Opened { id, scenery: options.keep == Keep::Scenery, trial });
        })?;
        Ok(Self { job, opened })
    }

    /// Opens a trial; the outcome follows in the order of the requests.
    pub fn open(&self, id: TrialId, options: OpenOptions) {
        self.job.ask(OpenRequest { id, options });
    }

    /// Gives up all requests that have not begun.
    pub fn give_up(&mut self) {
        self.job.give_up();
    }

    /// Outcomes since the last call.
    pub fn opened(&self) -> impl Iterator<Item = Opened> + '_ {
        self.opened.try_iter()
    }

    /// True when all requests are answered.
    pub fn is_settled(&self) -> bool {
        self.job.is_settled()
    }
}

fn open(
    reader: &mut Option<Store>,
    path: &Path,
    id: TrialId,
    options: &OpenOptions,
) -> Result<OpenTrial, OpenTrialError> {
    let store = match reader {
        Some(store) => store,
        None if !path.exists() => return Err(StoreError::NoTrial { id, hint: ": the store is empty" }.into()),
        None => reader.insert(Store::open(path)?),
    };
    OpenTrial::open(store, id, options)
}
