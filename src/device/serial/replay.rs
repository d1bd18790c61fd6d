//! Replay of a file of captured bytes in place of a port.

use super::port_error::PortError;
use super::shared::{LinkState, Shared};
use crate::protocol::CaptureReader;
use palpate_tactile::capture::Captured;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::time::Duration;

/// Replay of a captured stream.
#[derive(Debug)]
pub(super) struct Replay {
    pieces: CaptureReader<BufReader<File>>,
    speed: f64,
}

impl Replay {
    pub(super) fn open(path: &Path, speed: f64) -> Result<Self, PortError> {
        let file = palpate_geometry::open_regular(path).map_err(|error| PortError::capture(path, error.to_string()))?;
        let pieces = CaptureReader::new(BufReader::new(file));
        let pieces = pieces.map_err(|error| PortError::capture(path, error.to_string()))?;
        Ok(Self { pieces, speed })
    }

    /// Plays it to its end, each piece at its time.
    pub(super) fn run(self, shared: &Shared) {
        let mut first_s = None;
        for piece in self.pieces {
            let piece = match piece {
                Ok(piece) => piece,
                Err(error) => {
                    return shared.set_state(LinkState::Ended { cause: Some(error.to_string()), cut_short: true });
                }
            };
            let since = piece.arrived_s() - *first_s.get_or_insert(piece.arrived_s());
            let due = Duration::try_from_secs_f64(since / self.speed).unwrap_or_default();
            shared.sleep(due.saturating_sub(shared.began.elapsed()));
            if shared.is_stopped() {
                return shared.set_state(LinkState::Ended { cause: None, cut_short: false });
            }
            if matches!(piece, Captured::Bytes { .. }) {
                shared.set_state(LinkState::Listening);
            }
            shared.bytes.push(piece);
        }
        let cause = Some("end of the captured bytes".to_owned());
        shared.set_state(LinkState::Ended { cause, cut_short: false });
    }
}
