//! Modes of the window, as stored between runs.

use serde::{Deserialize, Serialize};

/// Mode of the window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// Grasp and recognise, live.
    #[default]
    Demo,
    /// Look back: open, replay, compare and explain stored trials.
    Inspect,
    /// Record and label trials of the real gripper.
    Label,
    /// Run the studies of the paper and look at their figures.
    Study,
}
