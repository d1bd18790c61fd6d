//! Checks of a board that sets the pressure of real fingers. The grasp ends and the fingers are vented unless the board
//! does the following:
//!
//! - acknowledge every pressure with its value, within 0.3 s. A reply also answers the commands before its own;
//! - send a readable line of values every 0.5 s;
//! - not restart, because its pressure would then be 0 and jump;
//! - keep any measured pressure that it reports within 0.1 bar of the range commanded during the last second.
//!
//! Times are those of the gripper's clock.

use palpate_device::protocol::{BoardEvent, BoardReply};
use std::collections::VecDeque;

/// Longest time to an acknowledgement (s): a converter of USB to serial adds 16 ms, a burst of lines a quarter of a second.
const ANSWER_S: f64 = 0.3;
/// Longest time between two readings (s): the firmware sends 50 a second.
const READING_S: f64 = 0.5;
/// Time within which the measured pressure follows a command (s): a proportional valve settles in some tenths of a
/// second and the fingers' volume slows it. With one second, a valve with a time constant of 0.4 s still passes after a
/// jump by 1 bar.
const SETTLED_S: f64 = 1.0;
/// Deviation of a measured pressure that is no fault (bar): two steps of the control box, or 2 % of a valve for 5 bar.
const OFF_BAR: f64 = 0.1;
/// How long it deviates before it is a fault (s): some readings, so that a disturbed one is none.
const OFF_S: f64 = 0.1;
/// Pressures are sent with two decimals (bar).
const SAME_BAR: f64 = 0.006;

/// What a board did wrong while it set a pressure, and what to try.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub(crate) enum PressureFault {
    /// No readings, or unreadable ones.
    #[error(
        "no readable line came from the board for {for_s:.1} s. Check its cable and supply; `palpate doctor` examines both"
    )]
    Silent {
        /// Time since the last reading (s).
        for_s: f64,
    },
    /// It restarted.
    #[error("the board restarted. Check its supply and its cable, then grasp again")]
    Restarted,
    /// A command without a reply.
    #[error(
        "the board did not acknowledge {bar:.2} bar within {ANSWER_S} s. Palpate's firmware does (`palpate doctor --sketch`); \
         drive other boards by hand"
    )]
    Unanswered {
        /// Commanded pressure (bar).
        bar: f64,
    },
    /// A reply that names another pressure.
    #[error(
        "the board acknowledged {said:.2} bar where {bar:.2} bar was asked. Upload Palpate's firmware again (`palpate doctor --sketch`)"
    )]
    Misanswered {
        /// Acknowledged pressure (bar).
        said: f64,
        /// Commanded pressure (bar).
        bar: f64,
    },
    /// Another pressure is measured.
    #[error(
        "the board reports {measured:.2} bar where {bar:.2} bar was commanded. Check the air supply, the valve and what the \
         board sends as p_bar"
    )]
    Off {
        /// Reported pressure (bar).
        measured: f64,
        /// Commanded pressure (bar).
        bar: f64,
    },
}

/// A command, and its time (s).
#[derive(Clone, Copy, Debug)]
struct Commanded {
    bar: f64,
    at_s: f64,
}

/// Checks during one grasp.
#[derive(Clone, Debug)]
pub(super) struct PressureWatch {
    began_s: f64,
    /// Arrival of the newest reading (s).
    heard_s: f64,
    /// Pressure that was acknowledged last (bar).
    on_bar: Option<f64>,
    unanswered: VecDeque<Commanded>,
    /// Commands that were in force during the last second, the newest last.
    recent: VecDeque<Commanded>,
    /// Since when the measured pressure deviates (s).
    off_since_s: Option<f64>,
}

impl PressureWatch {
    /// Begins when the fingers are told to vent, at this time (s).
    pub(super) fn new(now_s: f64) -> Self {
        let vent = VecDeque::from([Commanded { bar: 0.0, at_s: now_s }]);
        let (unanswered, recent) = (vent.clone(), vent);
        Self { began_s: now_s, heard_s: now_s, on_bar: None, unanswered, recent, off_since_s: None }
    }

    /// A pressure is commanded.
    pub(super) fn command(&mut self, bar: f64, now_s: f64) {
        let commanded = Commanded { bar, at_s: now_s };
        self.unanswered.push_back(commanded);
        self.recent.push_back(commanded);
    }

    /// Fails if a reply or reading is overdue at a time (s) up to which every event was observed.
    pub(super) fn check(&self, now_s: f64) -> Result<(), PressureFault> {
        let for_s = now_s - self.heard_s;
        match self.unanswered.front() {
            Some(Commanded { bar, at_s }) if now_s - at_s > ANSWER_S && for_s < ANSWER_S => {
                Err(PressureFault::Unanswered { bar: *bar })
            }
            Some(Commanded { at_s, .. }) if now_s - at_s > ANSWER_S => Err(PressureFault::Silent { for_s }),
            _ if for_s > READING_S => Err(PressureFault::Silent { for_s }),
            _ => Ok(()),
        }
    }

    /// Checks an event of the board.
    pub(super) fn observe(&mut self, event: &BoardEvent) -> Result<(), PressureFault> {
        match event {
            BoardEvent::Reply(BoardReply::Acknowledged { line_bar }) => self.answer(*line_bar),
            BoardEvent::Reply(reply) if reply.is_handshake() => Err(PressureFault::Restarted),
            BoardEvent::Gap(gap) if gap.is_restart() => Err(PressureFault::Restarted),
            BoardEvent::Reading(reading) => {
                self.heard_s = reading.arrived_s;
                reading.line_bar.map_or(Ok(()), |bar| self.measure(bar, reading.arrived_s))
            }
            _ => Ok(()),
        }
    }

    fn answer(&mut self, said: f64) -> Result<(), PressureFault> {
        let same = |bar: f64| (bar - said).abs() < SAME_BAR;
        if let Some(answered) = self.unanswered.iter().position(|commanded| same(commanded.bar)) {
            self.unanswered.drain(..=answered);
            self.on_bar = Some(said);
            return Ok(());
        }
        // A keep-alive is answered by what was on before; before the vent is, anything may be.
        match (self.on_bar, self.recent.back()) {
            (Some(on_bar), Some(newest)) if !same(on_bar) => {
                Err(PressureFault::Misanswered { said, bar: self.unanswered.front().unwrap_or(newest).bar })
            }
            _ => Ok(()),
        }
    }

    fn measure(&mut self, measured: f64, now_s: f64) -> Result<(), PressureFault> {
        while self.recent.get(1).is_some_and(|next| next.at_s <= now_s - SETTLED_S) {
            self.recent.pop_front();
        }
        let bars = || self.recent.iter().map(|commanded| commanded.bar);
        let [least, most] = [bars().fold(f64::INFINITY, f64::min), bars().fold(0.0, f64::max)];
        let follows = (least - OFF_BAR..=most + OFF_BAR).contains(&measured);
        if follows || now_s - self.began_s < SETTLED_S {
            self.off_since_s = None;
            return Ok(());
        }
        let since_s = *self.off_since_s.get_or_insert(now_s);
        let bar = if measured < least { least } else { most };
        if now_s - since_s < OFF_S { Ok(()) } else { Err(PressureFault::Off { measured, bar }) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_tactile::board::{Gap, Reading};

    fn said(line_bar: f64) -> BoardEvent {
        BoardEvent::Reply(BoardReply::Acknowledged { line_bar })
    }

    fn reading(t_s: f64, line_bar: Option<f64>) -> BoardEvent {
        let reading = Reading { t_s, arrived_s: t_s, seq: None, counts: vec![], line_bar };
        BoardEvent::Reading(reading)
    }

    /// A watch over a vented hand.
    fn vented() -> PressureWatch {
        let mut watch = PressureWatch::new(0.0);
        assert_eq!(watch.observe(&said(0.0)), Ok(()));
        watch
    }

    #[test]
    fn every_pressure_is_acknowledged_with_its_value_in_time() {
        let mut watch = vented();
        watch.command(0.05, 0.2);
        assert_eq!((watch.observe(&reading(0.5, None)), watch.check(0.5)), (Ok(()), Ok(())));
        assert_eq!(watch.check(0.51), Err(PressureFault::Unanswered { bar: 0.05 }));
        // A keep-alive from before, then the reply; the reply to 0.15 bar also answers 0.10 bar.
        for bar in [0.0, 0.05] {
            assert_eq!(watch.observe(&said(bar)), Ok(()));
        }
        watch.command(0.1, 0.3);
        watch.command(0.15, 0.4);
        assert_eq!((watch.observe(&said(0.15)), watch.check(0.45)), (Ok(()), Ok(())));
        assert!(matches!(watch.check(1.01), Err(PressureFault::Silent { .. })));
        let other = watch.observe(&said(1.5));
        assert_eq!(other, Err(PressureFault::Misanswered { said: 1.5, bar: 0.15 }));
        // Nobody answers the vent, though an earlier grasp's reply still comes.
        let mut mute = PressureWatch::new(7.0);
        assert_eq!((mute.observe(&said(0.55)), mute.check(7.2)), (Ok(()), Ok(())));
        assert!(matches!(mute.check(7.31), Err(PressureFault::Silent { .. })), "not even a reading comes");
        assert_eq!(mute.observe(&reading(7.3, None)), Ok(()));
        assert_eq!(mute.check(7.31), Err(PressureFault::Unanswered { bar: 0.0 }));
    }

    #[test]
    fn readings_come_and_come_from_a_board_that_did_not_restart() {
        let mut watch = vented();
        for k in 0..100 {
            assert_eq!(watch.check(0.02 * f64::from(k) + 0.4), Ok(()));
            assert_eq!(watch.observe(&reading(0.02 * f64::from(k), None)), Ok(()));
        }
        assert!(matches!(watch.check(2.5), Err(PressureFault::Silent { for_s }) if for_s > 0.5));
        let gap = |cause: &str| {
            let gap = Gap { from_s: 1.0, to_s: 1.1, lost: None, cause: cause.to_owned() };
            BoardEvent::Gap(gap)
        };
        assert_eq!(watch.observe(&gap("lost in transit")), Ok(()));
        assert_eq!(watch.observe(&gap(Gap::RESTARTED)), Err(PressureFault::Restarted));
        let hello = BoardReply::Other("tactile-gripper fw=2 adc=12".to_owned());
        let hello = BoardEvent::Reply(hello);
        assert_eq!(watch.observe(&hello), Err(PressureFault::Restarted));
    }

    /// A valve with a lag (s) that reaches a share of what is commanded: the usual programme, then a leap to 1 bar.
    fn follow(lag_s: f64, share: f64) -> Result<(), PressureFault> {
        let (mut watch, mut bar, mut measured) = (vented(), 0.0, 0.0);
        for k in 0..500u32 {
            let t_s = 0.02 * f64::from(k);
            let due = match k {
                0..50 => 0.0,
                50..150 => 0.05 * f64::from((k - 45) / 5),
                150..200 | 350.. => 1.0,
                200..250 => 1.0 - 0.1 * f64::from((k - 195) / 5),
                250..350 => 0.0,
            };
            if due != bar {
                watch.command(due, t_s);
                bar = due;
            }
            measured += (share * bar - measured) * (0.02 / lag_s).min(1.0);
            watch.observe(&reading(t_s, Some(measured)))?;
        }
        Ok(())
    }

    #[test]
    fn a_slow_valve_passes_and_one_without_air_or_without_end_does_not() {
        for (lag_s, share) in [(0.02, 0.92), (0.2, 0.96), (0.2, 1.05), (0.4, 1.0)] {
            assert_eq!(follow(lag_s, share), Ok(()), "{lag_s} {share}");
        }
        assert!(matches!(follow(0.1, 0.0), Err(PressureFault::Off { measured: 0.0, bar }) if bar < 0.25));
        assert!(matches!(follow(0.1, 1.5), Err(PressureFault::Off { .. })));
        // Far too much at once is found at once, but for a disturbed reading.
        let mut watch = vented();
        watch.command(0.05, 1.5);
        let readings = [1.5, 0.05, 1.5, 1.5, 1.5, 1.5, 1.5, 1.5].into_iter().zip(0u32..);
        let found = readings.map(|(bar, k)| watch.observe(&reading(1.52 + 0.02 * f64::from(k), Some(bar))));
        assert_eq!(found.take_while(Result::is_ok).count(), 7);
    }
}
