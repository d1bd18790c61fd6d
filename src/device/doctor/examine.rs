//! Observations of a port: open it, ask the board for its handshake, listen.

use super::{ChannelTraces, Observations};
use crate::protocol::{ConsoleLine, LineKind};
use crate::serial::{LinkOptions, LinkStatus, SerialLink, is_capture, is_running, list_ports};
use palpate_tactile::board::Reading;
use std::time::{Duration, Instant};

/// Longest wait for events.
const PATIENCE: Duration = Duration::from_millis(50);

/// Times of the query `?`: the board may restart when the port is opened.
const ASKED_AT: [Duration; 2] = [Duration::from_millis(300), Duration::from_millis(4500)];

/// Largest delay of readings that is waited for (s): a board boots, a computer is busy.
const LATE_S: f64 = 5.0;

/// A look at a port while it lasts.
#[derive(Clone, Debug)]
pub struct Examination {
    began: Instant,
    /// The link by then: what came before is no part of it.
    before: Option<LinkStatus>,
    traces: ChannelTraces,
}

impl Examination {
    /// Begins to look at a link that is open already, or at one that is about to be opened.
    pub fn begin(before: Option<LinkStatus>) -> Self {
        Self { began: Instant::now(), before, traces: ChannelTraces::default() }
    }

    /// Takes in a reading.
    pub fn add(&mut self, reading: &Reading) {
        self.traces.add(reading);
    }

    /// True if `seconds` of readings have come, or no more are expected.
    pub fn is_enough(&self, seconds: f64) -> bool {
        let waited_s = self.began.elapsed().as_secs_f64();
        let come = self.traces.channels.is_empty() || self.traces.seconds() >= seconds;
        waited_s >= seconds && (come || waited_s >= seconds + LATE_S)
    }

    /// What was seen, with the newest lines of the board.
    pub fn observed(self, mut link: LinkStatus, console: &[ConsoleLine]) -> Observations {
        if let Some(before) = &self.before {
            link.cadence = link.cadence.since(&before.cadence);
            link.reconnects = link.reconnects.saturating_sub(before.reconnects);
        }
        // The newest unreadable line or, without one, the newest line.
        let bad = console.iter().rev().find(|line| matches!(line.kind, LineKind::Bad(_)));
        let (example, listened_s) = (bad.or(console.last()).cloned(), self.began.elapsed().as_secs_f64());
        Observations { link: Some(link), listened_s, traces: self.traces, example, ..Observations::of_system() }
    }
}

impl Observations {
    /// What is seen before any port is opened.
    fn of_system() -> Self {
        Self {
            ports: list_ports(),
            refused: None,
            modem_manager: is_running("ModemManager"),
            link: None,
            listened_s: 0.0,
            traces: ChannelTraces::default(),
            example: None,
        }
    }
}

/// Opens a port and listens for a time, or reads a file of captured bytes whole. `goes_on` is called repeatedly with the
/// time so far (s); false ends it early.
pub fn examine(options: &LinkOptions, listen: Duration, goes_on: &mut dyn FnMut(f64) -> bool) -> Observations {
    // Captured bytes need no real time.
    let link = match SerialLink::open(&LinkOptions { replay_speed: f64::INFINITY, ..options.clone() }) {
        Ok(link) => link,
        Err(refused) => return Observations { refused: Some(refused), ..Observations::of_system() },
    };
    let is_file = options.path.as_deref().is_some_and(is_capture);
    let (mut look, mut asked) = (Examination::begin(None), 0);
    while !link.is_over()
        && goes_on(look.began.elapsed().as_secs_f64())
        && (is_file || !look.is_enough(listen.as_secs_f64()))
    {
        if ASKED_AT.get(asked).is_some_and(|at| look.began.elapsed() >= *at) {
            asked += 1;
            // The checks report a board that does not answer.
            let _sent = link.send("?");
        }
        for event in link.take(PATIENCE) {
            event.reading().into_iter().for_each(|reading| look.add(reading));
        }
    }
    let seen = look.observed(link.status(), &link.console());
    let listened_s = if is_file { seen.traces.seconds() } else { seen.listened_s };
    Observations { listened_s, ..seen }
}
