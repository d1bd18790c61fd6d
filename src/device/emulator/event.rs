//! Events of the emulated gripper, and what is wrong with how it was asked for.

use serde::Serialize;

/// Kind of an event.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum EmulatorEventKind {
    /// The fingers close.
    Grasp {
        /// Number of the grasp, from 1.
        number: u32,
        object: String,
    },
    /// A bend and a load are held on the bench.
    Hold {
        /// Bend of the strips (degrees).
        bend_deg: [f64; 2],
        /// Load on the pads (N).
        load_n: [f64; 2],
        /// Duration (s).
        seconds: f64,
    },
    /// The script ended.
    ScriptDone,
    /// A fault begins.
    Fault {
        /// The fault, as on the command line.
        fault: String,
    },
    /// The board vented because the host was silent.
    Watchdog,
    /// The simulation stopped.
    Failed {
        /// Why.
        reason: String,
    },
    /// A host opened the port.
    HostCame,
    /// It closed the port.
    HostLeft,
    /// The port is open under this name.
    Port {
        /// Path of the terminal.
        path: String,
    },
    /// Bytes were dropped because the host does not read.
    Overrun {
        /// Number of bytes.
        bytes: u64,
    },
}

/// Event of the emulator, and its time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EmulatorEvent {
    /// Time since the first host (s).
    pub t_s: f64,
    #[serde(flatten)]
    pub what: EmulatorEventKind,
}

/// What is wrong with a script, a fault, hidden parts or a port, as a sentence.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct EmulatorError(pub(super) String);
