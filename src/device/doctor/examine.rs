//! Observations of a port: open it, ask the board for its handshake, listen.

use super::{ChannelTraces, Observations};
use crate::protocol::{ConsoleLine, LineKind};
use crate::serial::{LinkOptions, SerialLink, is_capture, is_running, list_ports};
use std::time::{Duration, Instant};

/// Longest wait for events.
const PATIENCE: Duration = Duration::from_millis(50);

/// Times of the query `?`: the board may restart when the port is opened.
const ASKED_AT: [Duration; 2] = [Duration::from_millis(300), Duration::from_millis(4500)];

/// Largest delay of readings that is waited for (s): a board boots, a computer is busy.
const LATE_S: f64 = 5.0;

/// True if `seconds` of readings have come, or no more are expected, after `waited_s` (s) of this computer's clock.
pub fn is_enough(traces: &ChannelTraces, waited_s: f64, seconds: f64) -> bool {
    let come = traces.channels.is_empty() || traces.seconds() >= seconds;
    waited_s >= seconds && (come || waited_s >= seconds + LATE_S)
}

/// The newest unreadable line or, without one, the newest line.
pub fn example_of(console: &[ConsoleLine]) -> Option<ConsoleLine> {
    let bad = console.iter().rev().find(|line| matches!(line.kind, LineKind::Bad(_)));
    bad.or(console.last()).cloned()
}

/// Opens a port and listens for a time, or reads a file of captured bytes whole. `goes_on` is called repeatedly with the
/// time so far (s); false ends it early.
pub fn examine(options: &LinkOptions, listen: Duration, goes_on: &mut dyn FnMut(f64) -> bool) -> Observations {
    let mut seen = Observations {
        ports: list_ports(),
        refused: None,
        modem_manager: is_running("ModemManager"),
        link: None,
        listened_s: 0.0,
        traces: ChannelTraces::default(),
        example: None,
    };
    // Captured bytes need no real time.
    let link = match SerialLink::open(&LinkOptions { replay_speed: f64::INFINITY, ..options.clone() }) {
        Ok(link) => link,
        Err(refused) => return Observations { refused: Some(refused), ..seen },
    };
    let is_file = options.path.as_deref().is_some_and(is_capture);
    let began = Instant::now();
    let mut asked = 0;
    while !link.is_over() && goes_on(began.elapsed().as_secs_f64()) {
        let waited = began.elapsed();
        if !is_file && is_enough(&seen.traces, waited.as_secs_f64(), listen.as_secs_f64()) {
            break;
        }
        if ASKED_AT.get(asked).is_some_and(|at| waited >= *at) {
            asked += 1;
            // The checks report a board that does not answer.
            let _sent = link.send("?");
        }
        for event in link.take(PATIENCE) {
            event.reading().into_iter().for_each(|reading| seen.traces.add(reading));
        }
    }
    seen.listened_s = if is_file { seen.traces.seconds() } else { began.elapsed().as_secs_f64() };
    seen.example = example_of(&link.console());
    seen.link = Some(link.status());
    seen
}
