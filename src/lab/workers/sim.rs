//! Handle of the simulation thread: commands in, snapshots, trace rows and notices out.

use super::messages::{Command, GhostGrasp, MeasuredAccuracy, SimWorkerSetup, Snapshot};
use super::simulation_session::Session;
use super::worker::Worker;
use std::sync::Arc;

/// Handle of the simulation thread. Dropping it ends the thread and waits for pending writes.
pub type SimWorker = Worker<Command, Snapshot>;

impl SimWorker {
    /// Starts the thread.
    pub fn start(setup: SimWorkerSetup) -> std::io::Result<Self> {
        let wake = Arc::clone(&setup.wake);
        Self::spawn("sim", "the simulation", wake, move |inbox, publisher| Session::run(setup, publisher, inbox))
    }

    /// The newest snapshot; absent until the first scene has been loaded.
    pub fn snapshot(&self) -> Option<Arc<Snapshot>> {
        self.view()
    }

    /// Cost and error of the accuracy of the last measured scene.
    pub fn accuracy(&self) -> Option<Arc<MeasuredAccuracy>> {
        self.view()?.accuracy.clone()
    }

    /// The newest grasp that the other engine has computed; compare its number with that of the snapshot.
    pub fn ghost(&self) -> Option<Arc<GhostGrasp>> {
        self.view()?.ghost.clone()
    }
}
