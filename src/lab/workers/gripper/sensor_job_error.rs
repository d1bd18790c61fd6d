//! Errors of the jobs that share the link with the live view: calibration and crosstalk test.

use crate::gripper::NotOpened;
use palpate_device::doctor::CrosstalkError;
use palpate_store::StoreError;
use palpate_tactile::calibration::CalibrationFault;
use std::sync::Arc;

/// Error of a calibration or crosstalk test.
#[derive(Clone, Debug, thiserror::Error)]
pub enum SensorJobError {
    /// The fingers are in use.
    #[error("{0}")]
    Occupied(&'static str),
    /// The port could not be opened.
    #[error(transparent)]
    Port(#[from] NotOpened),
    /// The store failed.
    #[error(transparent)]
    Store(#[from] Arc<StoreError>),
    /// The points do not make a calibration.
    #[error(transparent)]
    Calibration(#[from] CalibrationFault),
    /// The board has too few sensors for a crosstalk test.
    #[error(transparent)]
    Crosstalk(#[from] CrosstalkError),
    /// The board has no channel for the sensor.
    #[error(
        "the board has no channel \"{wanted}\"; it has {has}. Name its channels in the sketch, or in a header line"
    )]
    NoChannel {
        /// Name of the channel.
        wanted: &'static str,
        /// Channels of the board.
        has: String,
    },
    /// The board sent nothing.
    #[error("no readings from the board")]
    NoReadings,
    /// The link ended before a calibration was stored.
    #[error("nothing was stored: {0}")]
    Disconnected(String),
}
