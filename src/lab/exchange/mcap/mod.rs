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
//! Trials follow each other in time, each at the time of its recording where that is later than the one before. A metadata
//! record `palpate:trial` for each says where it lies and what is known of it; scene and calibrations are attachments. An
//! import of such a file gives channels and times back bit by bit.

mod cdr;
mod container;
mod export;
mod import;
mod messages;
mod reader;

pub(super) use export::write;
pub use import::{McapImportError, read_mcap};

/// Topic of all channels.
const CHANNELS: &str = "/palpate/channels";
/// Name of the metadata record of a trial.
const TRIAL: &str = "palpate:trial";
