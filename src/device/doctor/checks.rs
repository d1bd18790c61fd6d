//! The checks: each is a function from observations to an outcome.

use super::{ChannelTrace, CheckFinding, CheckStatus, Observations, SKETCH};
use crate::protocol::{AdcRange, Saturation};
use crate::serial::{LinkState, LinkStatus, MODEM_MANAGER_COMMAND, PortTrouble};
use palpate_geometry::units::three_digits;
use palpate_tactile::board::{Board, Sensor};

/// Clock error from which on a note is given (ppm): crystals are within 50, resonators within 5000.
const CRYSTAL_PPM: f64 = 100.0;

/// Clock error from which on a counter does not count microseconds (ppm).
const NO_CLOCK_PPM: f64 = 10_000.0;

/// Relative difference from the stated rate that passes.
const RATE_SHARE: f64 = 0.02;

/// Share of readings that may be lost.
const LOST_SHARE: f64 = 1e-3;

/// Counts of 4095 that an idle pad may read: 10 MOhm over 4.7 kOhm is 2.
const IDLE_COUNTS: f64 = 20.0;

/// One check.
#[derive(Clone, Copy, Debug)]
pub struct Check {
    /// Its name.
    pub name: &'static str,
    /// What holds when it passes.
    pub about: &'static str,
    look: fn(&Observations) -> Outcome,
    next: Next,
}

/// Command to run next when a check finds something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Next {
    /// None.
    Nothing,
    /// List the ports.
    Ports,
    /// Upload the firmware.
    Upload,
    /// Run the doctor again, for longer.
    Again,
    /// Run the guided crosstalk test.
    Crosstalk,
}

impl Next {
    fn command(self, seen: &Observations) -> Option<String> {
        let port = seen.link.as_ref().map(|link| &link.port);
        let path = port.map(|port| quoted(&port.path.to_string_lossy()));
        match self {
            Self::Nothing => None,
            Self::Ports => Some("palpate record --list".to_owned()),
            Self::Upload => {
                // The two ports of a Due are two boards to the tools of Arduino.
                let write = format!("palpate doctor --sketch {SKETCH}");
                let due = port.filter(|port| port.usb.as_ref().is_some_and(|usb| matches!(usb.pid, 0x003d | 0x003e)));
                // A copied command must not upload to another board.
                let Some(due) = due else { return Some(write) };
                let (board, host) = match due.kind.native {
                    true => ("arduino_due_x", ""),
                    false => ("arduino_due_x_dbg", " --build-property compiler.cpp.extra_flags=-DHOST=Serial"),
                };
                let upload = format!("arduino-cli compile --upload --fqbn arduino:sam:{board}{host} --port {}", path?);
                Some(format!("{write} && {upload} {SKETCH}"))
            }
            Self::Crosstalk => Some(format!("palpate doctor {} --crosstalk", path?)),
            Self::Again => Some(format!("palpate doctor {} --seconds 20", path?)),
        }
    }
}

/// A path quoted for a shell.
fn quoted(path: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-".contains(c);
    if path.chars().all(plain) { path.to_owned() } else { format!("'{}'", path.replace('\'', "'\\''")) }
}

impl Check {
    /// Runs the check.
    pub fn look(&self, seen: &Observations) -> CheckFinding {
        let Outcome { verdict, seen: found, cause, fix, command } = (self.look)(seen);
        let worth_it = matches!(verdict, CheckStatus::Note | CheckStatus::Failed);
        let command = command.or_else(|| self.next.command(seen).filter(|_| worth_it));
        CheckFinding { check: self.name, verdict, seen: found, cause, fix, command }
    }
}

/// All checks, in the order in which they are shown.
pub const CHECKS: &[Check] = &[
    Check { name: "port", about: "a board is connected", look: port, next: Next::Ports },
    Check { name: "permission", about: "you may open the port", look: permission, next: Next::Nothing },
    Check { name: "busy", about: "no other program has the port", look: busy, next: Next::Ports },
    Check {
        name: "modem-manager",
        about: "ModemManager leaves the port alone",
        look: modem_manager,
        next: Next::Nothing,
    },
    Check { name: "silence", about: "the board sends data", look: silence, next: Next::Upload },
    Check { name: "baud", about: "the baud rate is right", look: baud, next: Next::Again },
    Check { name: "lines", about: "lines are readable", look: lines, next: Next::Again },
    Check { name: "firmware", about: "the board identifies itself", look: firmware, next: Next::Upload },
    Check { name: "bits", about: "the converter has 12 bits", look: bits, next: Next::Upload },
    Check { name: "saturation", about: "no channel is saturated", look: saturation, next: Next::Again },
    Check { name: "open-circuit", about: "every sensor is connected", look: open_circuit, next: Next::Again },
    Check { name: "crosstalk", about: "no channel bleeds into the next", look: crosstalk, next: Next::Crosstalk },
    Check { name: "rate", about: "samples arrive at the stated rate", look: rate, next: Next::Again },
    Check { name: "clock", about: "the board's clock is accurate", look: clock, next: Next::Upload },
];

/// A finding without its name.
struct Outcome {
    verdict: CheckStatus,
    seen: String,
    cause: Option<String>,
    fix: Option<String>,
    command: Option<String>,
}

impl Outcome {
    fn new(verdict: CheckStatus, seen: impl Into<String>) -> Self {
        Self { verdict, seen: seen.into(), cause: None, fix: None, command: None }
    }

    fn passed(seen: impl Into<String>) -> Self {
        Self::new(CheckStatus::Passed, seen)
    }

    fn skipped(seen: impl Into<String>) -> Self {
        Self::new(CheckStatus::Skipped, seen)
    }

    fn note(seen: impl Into<String>) -> Self {
        Self::new(CheckStatus::Note, seen)
    }

    fn failed(seen: impl Into<String>) -> Self {
        Self::new(CheckStatus::Failed, seen)
    }

    fn because(self, cause: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { cause: Some(cause.into()), fix: Some(fix.into()), ..self }
    }

    fn with(self, command: impl Into<String>) -> Self {
        Self { command: Some(command.into()), ..self }
    }
}

/// The error that kept the port from opening, if it is one of these.
fn refusal(seen: &Observations, troubles: &[PortTrouble]) -> Option<Outcome> {
    let refused = seen.refused.as_ref().filter(|refused| troubles.contains(&refused.trouble))?;
    let outcome = Outcome::failed(refused.what.clone()).because(refused.cause.clone(), refused.fix.clone());
    Some(Outcome { command: refused.command.clone(), ..outcome })
}

/// Status of the link, if it was opened.
fn link(seen: &Observations) -> Result<&LinkStatus, Outcome> {
    seen.link.as_ref().ok_or_else(|| Outcome::skipped("the port did not open"))
}

/// Status of the link, if readings came.
fn readings(seen: &Observations) -> Result<&LinkStatus, Outcome> {
    let link = link(seen)?;
    if link.cadence.samples > 0 { Ok(link) } else { Err(Outcome::skipped("no readings")) }
}

/// Either outcome.
fn or_skipped(outcome: Result<Outcome, Outcome>) -> Outcome {
    outcome.unwrap_or_else(|skipped| skipped)
}

fn port(seen: &Observations) -> Outcome {
    let troubles = [
        PortTrouble::NotFound,
        PortTrouble::NoBoard,
        PortTrouble::Several,
        PortTrouble::NotSerial,
        PortTrouble::Capture,
        PortTrouble::System,
    ];
    if let Some(outcome) = refusal(seen, &troubles) {
        return outcome;
    }
    match &seen.link {
        Some(link) => {
            let (path, title) = (link.port.path.display(), &link.port.title);
            match &link.state {
                LinkState::Lost { cause } => Outcome::failed(format!("{path} disconnected"))
                    .because(cause.clone(), "Check cable and plug; some charging cables have no data wires"),
                LinkState::Waiting
                | LinkState::Listening
                | LinkState::Silent { .. }
                | LinkState::Unreadable { .. }
                | LinkState::Ended { .. } => Outcome::passed(format!("{path}: {title}")),
            }
        }
        None => Outcome::passed("port found"),
    }
}

fn permission(seen: &Observations) -> Outcome {
    refusal(seen, &[PortTrouble::Permission])
        .unwrap_or_else(|| or_skipped(link(seen).map(|_| Outcome::passed("the port opens"))))
}

fn busy(seen: &Observations) -> Outcome {
    refusal(seen, &[PortTrouble::Busy])
        .unwrap_or_else(|| or_skipped(link(seen).map(|_| Outcome::passed("no other program has it"))))
}

fn modem_manager(seen: &Observations) -> Outcome {
    let is_usb = |port: &crate::serial::PortInfo| port.usb.is_some();
    let concerns = seen.link.as_ref().map_or_else(|| seen.ports.iter().any(is_usb), |link| is_usb(&link.port));
    match (seen.modem_manager, concerns) {
        (false, _) => Outcome::passed("ModemManager is not running"),
        (true, false) => Outcome::passed("ModemManager is running, but this is not a USB port"),
        (true, true) => Outcome::note("ModemManager is running")
            .because(
                "It probes every new port for a modem: for half a minute after plugging in, the port is busy or the board \
                 receives garbage",
                "Make it ignore the board, then plug the board in again",
            )
            .with(MODEM_MANAGER_COMMAND),
    }
}

fn silence(seen: &Observations) -> Outcome {
    let link = match link(seen) {
        Ok(link) => link,
        Err(skipped) => return skipped,
    };
    let silent = matches!(link.state, LinkState::Silent { .. } | LinkState::Waiting) && link.cadence.samples == 0;
    if !silent {
        return Outcome::passed("data arrives");
    }
    let outcome = Outcome::failed(format!("no data in {} s", three_digits(seen.listened_s)));
    if link.port.kind.native {
        outcome.because(
            "The native port sends only while the host sets DTR, which it does: the sketch is not running, or prints to the \
             other port",
            "Press the board's reset button; then upload the firmware, or set HOST to the port in use",
        )
    } else {
        outcome.because(
            "No sketch prints to this port",
            "Upload the firmware; on a Due, use the native port (next to the reset button)",
        )
    }
}

fn baud(seen: &Observations) -> Outcome {
    let link = match link(seen) {
        Ok(link) => link,
        Err(skipped) => return skipped,
    };
    let printable = 100.0 * link.cadence.printable_share;
    match (&link.state, link.baud) {
        (LinkState::Unreadable { .. }, _) => {
            Outcome::failed(format!("unreadable data: {printable:.0} % of the bytes are text")).because(
                "The board sends at an unusual baud rate, or not text",
                "Use Serial.begin(115200) in the sketch, or give its rate with --baud",
            )
        }
        _ if link.cadence.samples == 0 => Outcome::skipped("no readings"),
        (_, Some(rate)) if rate != 115_200 && !link.port.kind.native => {
            Outcome::note(format!("the board sends at {rate} baud")).because(
                "The sketch sets it; found by scanning",
                format!("Give --baud {rate} to skip the scan, or use Serial.begin(115200) in the sketch"),
            )
        }
        _ => Outcome::passed(format!("{printable:.0} % of the bytes are text")),
    }
}

fn lines(seen: &Observations) -> Outcome {
    let outcome = link(seen).and_then(|link| {
        let cadence = &link.cadence;
        let bad = cadence.bad_lines;
        let all = bad + cadence.samples;
        if all == 0 {
            return Err(Outcome::skipped("no lines"));
        }
        let share = bad as f64 / all as f64;
        let why = link.detected.as_ref().map_or_else(String::new, |detected| format!(": {}", detected.why));
        Ok(if share > 0.02 {
            Outcome::failed(format!("{bad} of {all} lines unreadable")).because(
                "Bytes are lost or damaged: a long or bad cable, a hub, a floating ground, or two programs on one port",
                "Use a short cable directly into the computer; the console shows the raw lines",
            )
        } else if bad > 2 {
            Outcome::note(format!("{bad} of {all} lines unreadable")).because(
                "A few damaged lines; they are skipped and shown as gaps",
                "None needed. If there are more: a short cable directly into the computer",
            )
        } else {
            Outcome::passed(format!("{} lines read{why}", cadence.samples))
        })
    });
    or_skipped(outcome)
}

fn firmware(seen: &Observations) -> Outcome {
    or_skipped(readings(seen).map(|link| match &link.board.firmware {
        Some(version) => Outcome::passed(format!("tactile-gripper, version {version}")),
        None => Outcome::note("the board sends no handshake").because(
            "It runs another sketch: 12 bits, 3.3 V and the usual resistors are assumed",
            "Print the handshake line of our firmware, or upload our firmware",
        ),
    }))
}

fn bits(seen: &Observations) -> Outcome {
    or_skipped(readings(seen).map(|link| {
        let full = link.board.full_scale;
        let stated = link.board.firmware.is_some();
        match link.adc_range {
            AdcRange::Exceeded => {
                return Outcome::failed(format!("counts exceed {full}")).because(
                    if stated {
                        "The converter has more bits than the handshake states"
                    } else {
                        "The converter has more than the assumed 12 bits"
                    },
                    "State its bits in the handshake, as in adc=16",
                );
            }
            AdcRange::LooksTenBit => {
                let most = seen.traces.channels.iter().map(|trace| trace.most).fold(0.0, f64::max);
                let assumed = if stated { "the handshake states" } else { "assumed:" };
                return Outcome::failed(format!("no count above {most:.0}; {assumed} a range of {full}")).because(
                    "analogRead gives 10 bits by default",
                    "Call analogReadResolution(12) in setup(), or state adc=10 in the handshake",
                );
            }
            AdcRange::Fits => {}
        }
        if full < 4095 {
            return Outcome::note(format!("the converter's range is {full}")).because(
                "The handshake states it",
                "A Due has 12 bits: call analogReadResolution(12), and state adc=12 in the handshake",
            );
        }
        Outcome::passed(format!("counts up to {full}"))
    }))
}

/// The sensor on a channel.
fn sensor(board: &Board, channel: usize) -> Option<Sensor> {
    Sensor::ALL.into_iter().find(|sensor| board.channel_of(*sensor) == Some(channel))
}

/// Names of the channels for which something holds.
fn named(link: &LinkStatus, holds: impl Fn(usize, Option<Sensor>) -> bool) -> Vec<String> {
    let channels = link.board.channels.iter().enumerate();
    let held = channels.filter(|(channel, _)| holds(*channel, sensor(&link.board, *channel)));
    held.map(|(_, name)| name.clone()).collect()
}

fn saturation_of(link: &LinkStatus, channel: usize) -> Option<Saturation> {
    link.saturation.get(channel).copied().flatten()
}

fn is_high(link: &LinkStatus, channel: usize) -> bool {
    saturation_of(link, channel) == Some(Saturation::High)
}

fn saturation(seen: &Observations) -> Outcome {
    or_skipped(readings(seen).map(|link| {
        // A strip at the upper end has come off, which is the next check's finding.
        let high = named(link, |channel, sensor| {
            is_high(link, channel) && !sensor.is_some_and(Sensor::is_flex)
        });
        if high.is_empty() {
            return Outcome::passed("no channel saturated");
        }
        Outcome::failed(format!("{} saturated for more than half a second", high.join(", "))).because(
            "The divider is on 5 V, which damages a Due; or the pad is shorted; or its resistor to ground is missing or far too \
             large",
            "Unplug and measure: the divider belongs on 3.3 V, with 4.7 kOhm from the pin to ground",
        )
    }))
}

fn open_circuit(seen: &Observations) -> Outcome {
    or_skipped(readings(seen).map(|link| {
        let trace = |channel: usize| seen.traces.channels.get(channel).cloned().unwrap_or_default();
        let without = named(link, |channel, _| trace(channel).without > trace(channel).numbers);
        let off = named(link, |channel, sensor| sensor.is_some_and(Sensor::is_flex) && is_high(link, channel));
        let shorted = named(link, |channel, sensor| {
            sensor.is_some_and(Sensor::is_flex) && saturation_of(link, channel) == Some(Saturation::Low)
        });
        if !off.is_empty() {
            return Outcome::failed(format!("{} at full scale", off.join(", "))).because(
                "The strip is disconnected: nothing pulls the pin to ground",
                "Check the strip's crimp, which is brittle, and its wire to ground",
            );
        }
        if !without.is_empty() {
            return Outcome::failed(format!("{} without a number in most lines", without.join(", "))).because(
                "The sketch has no value to print: the sensor is disconnected",
                "Check the plug and the wires of that sensor; the other channels keep working",
            );
        }
        if !shorted.is_empty() {
            return Outcome::failed(format!("{} at zero", shorted.join(", "))).because(
                "The pin is shorted to ground, or the resistor to 3.3 V is missing",
                "Measure 47 kOhm from 3.3 V to the pin, and 17 to 70 kOhm from the pin to ground",
            );
        }
        let idle = named(link, |channel, sensor| {
            sensor.is_some_and(|sensor| !sensor.is_flex()) && trace(channel).most <= IDLE_COUNTS
        });
        if idle.is_empty() {
            return Outcome::passed("every sensor responds");
        }
        Outcome::note(format!("{} never pressed", idle.join(", ")))
            .because("An untouched pad reads zero, and so does a disconnected one", "Press each pad during the check")
    }))
}

fn crosstalk(seen: &Observations) -> Outcome {
    let outcome = readings(seen).map(|link| {
        let scale = f64::from(link.board.full_scale) / 4095.0;
        let pads = (1..link.board.channels.len()).filter(|channel| {
            // A saturated channel hides crosstalk in both directions.
            let saturated = |channel: usize| is_high(link, channel);
            sensor(&link.board, *channel).is_some_and(|sensor| !sensor.is_flex())
                && !saturated(*channel)
                && !saturated(channel - 1)
        });
        let found = pads.filter_map(|channel| bleeding(link, channel, seen.traces.channels.get(channel)?, scale));
        let found: Vec<Outcome> = found.collect();
        found
            .into_iter()
            .max_by_key(|outcome| outcome.verdict)
            .unwrap_or_else(|| Outcome::passed("idle pads read zero"))
    });
    or_skipped(outcome)
}

/// Finding for a pad that never reads zero, and may follow the channel before it.
fn bleeding(link: &LinkStatus, channel: usize, trace: &ChannelTrace, scale: f64) -> Option<Outcome> {
    if trace.numbers == 0 || trace.least <= IDLE_COUNTS * scale {
        return None;
    }
    let (name, before) = (&link.board.channels[channel], &link.board.channels[channel - 1]);
    let least = trace.least;
    if let Some(share) = trace.takes().filter(|share| (0.01..1.0).contains(share)) {
        let percent = 100.0 * share;
        let seen = format!("{name} follows {before} by {percent:.0} %, and is never below {least:.0} counts");
        return Some(Outcome::failed(seen).because(
            "The converter's multiplexer does not settle behind the high resistance of the divider",
            "Solder 100 nF from each pin to ground, and discard the first conversion of each channel, as our firmware does",
        ));
    }
    Some(Outcome::note(format!("{name} is never below {least:.0} counts")).because(
        format!("Something presses the pad all the time, or {before} bleeds into it"),
        "Move one sensor after the other: that says which",
    ))
}

fn rate(seen: &Observations) -> Outcome {
    or_skipped(readings(seen).map(|link| {
        let cadence = &link.cadence;
        let (measured, jitter) = (cadence.rate_hz, cadence.jitter_p95_ms);
        let lost = cadence.lost as f64 / (cadence.samples + cadence.lost).max(1) as f64;
        let [bytes, rows] = link.dropped;
        if lost > LOST_SHARE {
            let seen = format!("{} of {} samples lost", cadence.lost, cadence.samples + cadence.lost);
            if cadence.bad_lines > 0 {
                // Unreadable lines are missing readings; another check reports them.
                return Outcome::note(seen).because("Some lines were unreadable", "See the check of lines");
            }
            let cause = if bytes + rows > 0 {
                "This computer was too slow"
            } else {
                "The board skips samples, or the connection loses them"
            };
            return Outcome::failed(seen)
                .because(cause, "Lower the sample rate in the sketch, close other programs, use a short cable");
        }
        match link.board.rate_hz {
            Some(said) if (measured / said - 1.0).abs() > RATE_SHARE => {
                Outcome::failed(format!("{} samples per second; the board states {said}", three_digits(measured)))
                    .because(
                        "The sketch needs longer than its period, or uses delay()",
                        "Schedule samples by micros(), as our firmware does, or lower the rate",
                    )
            }
            _ => Outcome::passed(format!(
                "{} samples per second, jitter {} ms (95 %)",
                three_digits(measured),
                three_digits(jitter)
            )),
        }
    }))
}

fn clock(seen: &Observations) -> Outcome {
    or_skipped(readings(seen).map(|link| {
        let Some(ppm) = link.cadence.drift_ppm else {
            return Outcome::note("the board sends no timestamps").because(
                "Its lines have no t_us: times of arrival are used, which lag by some milliseconds",
                "Print t_us, as our firmware does",
            );
        };
        let drift = format!("{ppm:+.0} ppm against this computer's clock");
        if ppm.abs() > NO_CLOCK_PPM {
            Outcome::failed(drift).because("t_us does not count microseconds", "Print micros() as t_us")
        } else if ppm.abs() > CRYSTAL_PPM {
            Outcome::note(drift).because(
                "The board's clock is a resonator, or it was measured for a few seconds only",
                "None needed: the drift is corrected",
            )
        } else {
            Outcome::passed(drift)
        }
    }))
}
