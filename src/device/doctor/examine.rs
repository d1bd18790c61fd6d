//! Observations of a port: open it, ask the board for its handshake, listen.

use super::{ChannelTraces, Observations};
use crate::protocol::DecodedEvent;
use crate::serial::{LinkEvent, LinkOptions, SerialLink, is_running, list_ports};
use std::time::{Duration, Instant};

/// Longest wait for events.
const PATIENCE: Duration = Duration::from_millis(50);

/// Times of the query `?`: the board may restart when the port is opened.
const ASKED_AT: [Duration; 2] = [Duration::from_millis(300), Duration::from_millis(4500)];

/// Opens a port and listens for a time. `goes_on` is called repeatedly with the time so far (s); false ends it
/// early.
pub fn examine(options: &LinkOptions, listen: Duration, goes_on: &mut dyn FnMut(f64) -> bool) -> Observations {
    let mut seen = Observations {
        ports: list_ports(),
        refused: None,
        modem_manager: is_running("ModemManager"),
        link: None,
        listened_s: 0.0,
        traces: ChannelTraces::default(),
    };
    let link = match SerialLink::open(options) {
        Ok(link) => link,
        Err(refused) => return Observations { refused: Some(refused), ..seen },
    };
    let began = Instant::now();
    let mut asked = 0;
    while began.elapsed() < listen && goes_on(began.elapsed().as_secs_f64()) && !link.is_over() {
        if ASKED_AT.get(asked).is_some_and(|at| began.elapsed() >= *at) {
            asked += 1;
            // The checks report a board that does not answer.
            let _sent = link.send("?");
        }
        for event in link.take(PATIENCE) {
            if let LinkEvent::Decoded(DecodedEvent::Reading(reading)) = event {
                seen.traces.add(&reading);
            }
        }
    }
    seen.listened_s = began.elapsed().as_secs_f64();
    seen.link = Some(link.status());
    seen
}
