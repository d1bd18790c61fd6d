//! MCAP files with ROS 2 messages: read by Foxglove, Lichtblick, PlotJuggler, Rerun and ROS 2 itself.
//!
//! | topic | message | content |
//! |---|---|---|
//! | `/palpate/channels` | Float64MultiArray | `t_s`, then all channels; names and units in the channel's metadata |
//! | `/joint_states` | JointState | joint angles (rad); of a real gripper the curvature of its strips (1/m) |
//! | `/line_pressure` | FluidPressure | line pressure (Pa) |
//! | `/recognition/probabilities` | Float64MultiArray | belief in each class; classes in the channel's metadata |
//! | `/recognition/verdict`, `/label`, `/phase` | String | JSON of verdict and label; beginning of each phase |
//! | `/robot_description` | String | URDF of the gripper |
//! | `/tf` | TFMessage | palm, segments of the fingers and object, in the world |
//!
//! With taxels the object is a link of the URDF, with its mesh, and there are two topics more:
//!
//! | topic | message | content |
//! |---|---|---|
//! | `/palpate/taxels` | Float32MultiArray | force on every taxel (N); places in the channel's metadata |
//! | `/palpate/forces` | MarkerArray | a line for each loaded taxel, in the world |
//!
//! Trials follow each other in time, each at the time of its recording where that is later than the one before. A metadata
//! record `palpate:trial` for each says where it lies and what is known of it; scene and calibrations are attachments. An
//! import of such a file gives channels and times back bit by bit.

mod cdr;
mod container;
mod export;
mod import;
mod messages;
mod reader;

use crate::format::{ExchangeError, Import, ImportError, TrialExport, TrialFormat, Written};
use crate::mapping::Mapping;
use palpate_store::FileKind;
use std::path::Path;

/// Topic of all channels.
const CHANNELS: &str = "/palpate/channels";
/// Topic of the forces on taxels.
const TAXELS: &str = "/palpate/taxels";
/// Name of the metadata record of a trial.
const TRIAL: &str = "palpate:trial";

/// Messages of ROS 2 over time.
pub(crate) struct Mcap;

impl TrialFormat for Mcap {
    fn kind(&self) -> FileKind {
        FileKind::Other { title: "MCAP file", endings: &["mcap"], begin: b"\x89MCAP0\r\n" }
    }

    fn write(&self, export: &TrialExport<'_>, path: &Path) -> Result<Written, ExchangeError> {
        export::write(export, path, self.kind())?;
        Ok(Written::whole(path))
    }

    fn read(&self, path: &Path, mapping: &Mapping) -> Result<Import, ImportError> {
        import::read_mcap(path, mapping)
    }
}
