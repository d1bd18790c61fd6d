//! The checks, each from what was seen to what it means.

use super::{ChannelTrace, CheckFinding, CheckStatus, Observations, SKETCH};
use crate::protocol::{AdcRange, Saturation};
use crate::serial::{LinkState, LinkStatus, MODEM_MANAGER_COMMAND, PortTrouble};
use palpate_geometry::units::three_digits;
use palpate_tactile::board::{Board, Sensor};

/// A clock that is farther off than this is worth a note (ppm): crystals are within 50, resonators within 5000.
const CRYSTAL_PPM: f64 = 100.0;

/// A clock that is farther off than this does not count microseconds (ppm).
const NO_CLOCK_PPM: f64 = 10_000.0;

/// A rate that is farther from what the board says than this share is another rate.
const RATE_SHARE: f64 = 0.02;

/// Share of readings that may be lost before it is more than a hiccup.
const LOST_SHARE: f64 = 1e-3;

/// Counts of 4095 that an idle pad may read: 10 MOhm over 4.7 kOhm is 2.
const IDLE_COUNTS: f64 = 20.0;

/// One check.
#[derive(Clone, Copy, Debug)]
pub struct Check {
    /// What it is called.
    pub name: &'static str,
    /// What it looks for, in a few words.
    pub about: &'static str,
    look: fn(&Observations) -> Told,
    next: Next,
}

/// What to run where a check finds something and knows no command of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Next {
    /// Only what the finding says.
    Nothing,
    /// See which ports there are.
    Ports,
    /// Put our firmware on the board.
    Upload,
    /// When it is mended, look again, for longer.
    Again,
    /// Move one sensor after the other.
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
                // Nothing is uploaded to another board by a command that somebody copies.
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

/// A path as shells take it.
fn quoted(path: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-".contains(c);
    if path.chars().all(plain) { path.to_owned() } else { format!("'{}'", path.replace('\'', "'\\''")) }
}

impl Check {
    /// Looks.
    pub fn look(&self, seen: &Observations) -> CheckFinding {
        let Told { verdict, seen: told, cause, fix, command } = (self.look)(seen);
        let worth_it = matches!(verdict, CheckStatus::Note | CheckStatus::Failed);
        let command = command.or_else(|| self.next.command(seen).filter(|_| worth_it));
        CheckFinding { check: self.name, verdict, seen: told, cause, fix, command }
    }
}

/// All of them.
pub const CHECKS: &[Check] = &[
    Check { name: "port", about: "there is a board", look: port, next: Next::Ports },
    Check { name: "permission", about: "you may open it", look: permission, next: Next::Nothing },
    Check { name: "busy", about: "nobody else has it", look: busy, next: Next::Ports },
    Check { name: "modem-manager", about: "nobody takes it for a modem", look: modem_manager, next: Next::Nothing },
    Check { name: "silence", about: "it says something", look: silence, next: Next::Upload },
    Check { name: "baud", about: "at a rate that can be read", look: baud, next: Next::Again },
    Check { name: "lines", about: "in lines that can be read", look: lines, next: Next::Again },
    Check { name: "firmware", about: "and says what it is", look: firmware, next: Next::Upload },
    Check { name: "bits", about: "the converter gives 12 bits", look: bits, next: Next::Upload },
    Check { name: "saturation", about: "no channel is at its upper end", look: saturation, next: Next::Again },
    Check { name: "open-circuit", about: "every sensor is connected", look: open_circuit, next: Next::Again },
    Check { name: "crosstalk", about: "no channel bleeds into the next", look: crosstalk, next: Next::Crosstalk },
    Check { name: "rate", about: "samples come as often as they should", look: rate, next: Next::Again },
    Check { name: "clock", about: "the board's clock can be relied on", look: clock, next: Next::Upload },
];

/// A finding without its name.
struct Told {
    verdict: CheckStatus,
    seen: String,
    cause: Option<String>,
    fix: Option<String>,
    command: Option<String>,
}

impl Told {
    fn new(verdict: CheckStatus, seen: impl Into<String>) -> Self {
        Self { verdict, seen: seen.into(), cause: None, fix: None, command: None }
    }

    fn good(seen: impl Into<String>) -> Self {
        Self::new(CheckStatus::Passed, seen)
    }

    fn not_seen(seen: impl Into<String>) -> Self {
        Self::new(CheckStatus::Skipped, seen)
    }

    fn note(seen: impl Into<String>) -> Self {
        Self::new(CheckStatus::Note, seen)
    }

    fn wrong(seen: impl Into<String>) -> Self {
        Self::new(CheckStatus::Failed, seen)
    }

    fn because(self, cause: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { cause: Some(cause.into()), fix: Some(fix.into()), ..self }
    }

    fn with(self, command: impl Into<String>) -> Self {
        Self { command: Some(command.into()), ..self }
    }
}

/// The trouble that kept the port from being opened, if it is one of these.
fn refusal(seen: &Observations, troubles: &[PortTrouble]) -> Option<Told> {
    let refused = seen.refused.as_ref().filter(|refused| troubles.contains(&refused.trouble))?;
    let told = Told::wrong(refused.what.clone()).because(refused.cause.clone(), refused.fix.clone());
    Some(Told { command: refused.command.clone(), ..told })
}

/// How the link stands, or that there is none.
fn link(seen: &Observations) -> Result<&LinkStatus, Told> {
    seen.link.as_ref().ok_or_else(|| Told::not_seen("the port could not be opened"))
}

/// The same where lines were read.
fn readings(seen: &Observations) -> Result<&LinkStatus, Told> {
    let link = link(seen)?;
    if link.cadence.samples > 0 { Ok(link) } else { Err(Told::not_seen("nothing could be read")) }
}

/// A check that may end early because there is nothing to see.
fn or_not_seen(told: Result<Told, Told>) -> Told {
    told.unwrap_or_else(|not_seen| not_seen)
}

fn port(seen: &Observations) -> Told {
    let troubles = [
        PortTrouble::NotFound,
        PortTrouble::NoBoard,
        PortTrouble::Several,
        PortTrouble::NotSerial,
        PortTrouble::Capture,
        PortTrouble::System,
    ];
    if let Some(told) = refusal(seen, &troubles) {
        return told;
    }
    match &seen.link {
        Some(link) => {
            let (path, title) = (link.port.path.display(), &link.port.title);
            match &link.state {
                LinkState::Lost { cause } => Told::wrong(format!("{path} went away")).because(
                    cause.clone(),
                    "Check cable and plug; a cable that charges a phone may have no wires for data",
                ),
                LinkState::Waiting
                | LinkState::Listening
                | LinkState::Silent { .. }
                | LinkState::Unreadable { .. }
                | LinkState::Ended { .. } => Told::good(format!("{path}: {title}")),
            }
        }
        None => Told::good("it is there"),
    }
}

fn permission(seen: &Observations) -> Told {
    refusal(seen, &[PortTrouble::Permission])
        .unwrap_or_else(|| or_not_seen(link(seen).map(|_| Told::good("it can be opened"))))
}

fn busy(seen: &Observations) -> Told {
    refusal(seen, &[PortTrouble::Busy])
        .unwrap_or_else(|| or_not_seen(link(seen).map(|_| Told::good("it is ours alone"))))
}

fn modem_manager(seen: &Observations) -> Told {
    let is_usb = |port: &crate::serial::PortInfo| port.usb.is_some();
    let concerns = seen.link.as_ref().map_or_else(|| seen.ports.iter().any(is_usb), |link| is_usb(&link.port));
    match (seen.modem_manager, concerns) {
        (false, _) => Told::good("it does not run"),
        (true, false) => Told::good("it runs, but this is no USB port"),
        (true, true) => Told::note("ModemManager runs")
            .because(
                "It asks every new port whether it is a modem: for half a minute after plugging in the port is busy, or \
                 the board hears nonsense",
                "Tell it to leave boards alone, then plug the board in again",
            )
            .with(MODEM_MANAGER_COMMAND),
    }
}

fn silence(seen: &Observations) -> Told {
    let link = match link(seen) {
        Ok(link) => link,
        Err(not_seen) => return not_seen,
    };
    let silent = matches!(link.state, LinkState::Silent { .. } | LinkState::Waiting) && link.cadence.samples == 0;
    if !silent {
        return Told::good("it speaks");
    }
    let told = Told::wrong(format!("nothing came in {} s", three_digits(seen.listened_s)));
    if link.port.kind.native {
        told.because(
            "The native port sends only while the host holds DTR, which it does; so the sketch is not running, or prints on \
             the other port",
            "Press the board's reset button once; upload our firmware, or set HOST to the port in use",
        )
    } else {
        told.because(
            "The board is not running a sketch that prints, or prints on its other port",
            "Upload our firmware; on a Due, plug the cable into the native port (next to the reset button)",
        )
    }
}

fn baud(seen: &Observations) -> Told {
    let link = match link(seen) {
        Ok(link) => link,
        Err(not_seen) => return not_seen,
    };
    let printable = 100.0 * link.cadence.printable_share;
    match (&link.state, link.baud) {
        (LinkState::Unreadable { .. }, _) => {
            Told::wrong(format!("bytes come, but no lines: {printable:.0} % of them are text")).because(
                "The board sends at a rate that is none of the usual ones, or something else than text",
                "Set the sketch to Serial.begin(115200), or name its rate with --baud",
            )
        }
        _ if link.cadence.samples == 0 => Told::not_seen("nothing came"),
        (_, Some(rate)) if rate != 115_200 && !link.port.kind.native => Told::note(format!(
            "the board speaks at {rate} bit/s"
        ))
        .because(
            "Its sketch says so; it was found by trying",
            format!("Name the rate with --baud {rate} to save the trying, or set the sketch to Serial.begin(115200)"),
        ),
        _ => Told::good(format!("{printable:.0} % of the bytes are text")),
    }
}

fn lines(seen: &Observations) -> Told {
    let told = link(seen).and_then(|link| {
        let cadence = &link.cadence;
        let bad = cadence.bad_lines;
        let all = bad + cadence.samples;
        if all == 0 {
            return Err(Told::not_seen("no lines came"));
        }
        let share = bad as f64 / all as f64;
        let why = link.detected.as_ref().map_or_else(String::new, |detected| format!(": {}", detected.why));
        Ok(if share > 0.02 {
            Told::wrong(format!("{bad} of {all} lines could not be read")).because(
                "Bytes are lost or damaged on the way: a long or bad cable, a hub, a ground that floats, or two programs on one port",
                "Use a short cable straight into the computer; see the raw lines in the console",
            )
        } else if bad > 2 {
            Told::note(format!("{bad} of {all} lines could not be read")).because(
                "A few damaged lines; they are left out, and shown as gaps",
                "Nothing, unless there are more of them: then a short cable straight into the computer",
            )
        } else {
            Told::good(format!("{} lines were read{why}", cadence.samples))
        })
    });
    or_not_seen(told)
}

fn firmware(seen: &Observations) -> Told {
    or_not_seen(readings(seen).map(|link| match &link.board.firmware {
        Some(version) => Told::good(format!("tactile-gripper, version {version}")),
        None => Told::note("the board does not say what it is").because(
            "It runs a sketch of its own: bits, reference voltage and resistors are taken for granted",
            "Print a hello line as our firmware does, or upload that",
        ),
    }))
}

fn bits(seen: &Observations) -> Told {
    or_not_seen(readings(seen).map(|link| {
        let full = link.board.full_scale;
        let stated = link.board.firmware.is_some();
        match link.adc_range {
            AdcRange::Exceeded => {
                return Told::wrong(format!("counts exceed {full}")).because(
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
                return Told::wrong(format!("no count above {most:.0}; {assumed} a range of {full}")).because(
                    "analogRead gives 10 bits by default",
                    "Call analogReadResolution(12) in setup(), or state adc=10 in the handshake",
                );
            }
            AdcRange::Fits => {}
        }
        if full < 4095 {
            return Told::note(format!("the converter goes to {full}")).because(
                "The board says so, or has sent nothing beyond",
                "A Due has 12 bits: call analogReadResolution(12), and say adc=12 in the hello line",
            );
        }
        Told::good(format!("counts up to {full}"))
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

fn rail(link: &LinkStatus, channel: usize) -> Option<Saturation> {
    link.saturation.get(channel).copied().flatten()
}

fn is_high(link: &LinkStatus, channel: usize) -> bool {
    rail(link, channel) == Some(Saturation::High)
}

fn saturation(seen: &Observations) -> Told {
    or_not_seen(readings(seen).map(|link| {
        // A strip at the upper end has come off, which is another check's.
        let high = named(link, |channel, sensor| {
            is_high(link, channel) && !sensor.is_some_and(Sensor::is_flex)
        });
        if high.is_empty() {
            return Told::good("none");
        }
        Told::wrong(format!("{} at the upper end for more than half a second", high.join(", "))).because(
            "The divider is fed from 5 V, which the pins of a Due do not bear; or the pad is shorted; or its resistor to ground is \
             missing or far too large",
            "Pull the plug and measure: the divider belongs to 3.3 V, with 4.7 kOhm from the pin to ground",
        )
    }))
}

fn open_circuit(seen: &Observations) -> Told {
    or_not_seen(readings(seen).map(|link| {
        let trace = |channel: usize| seen.traces.channels.get(channel).cloned().unwrap_or_default();
        let without = named(link, |channel, _| trace(channel).without > trace(channel).numbers);
        let off = named(link, |channel, sensor| sensor.is_some_and(Sensor::is_flex) && is_high(link, channel));
        let shorted = named(link, |channel, sensor| {
            sensor.is_some_and(Sensor::is_flex) && rail(link, channel) == Some(Saturation::Low)
        });
        if !off.is_empty() {
            return Told::wrong(format!("{} at the upper end", off.join(", "))).because(
                "The strip has come off: nothing pulls the pin to ground",
                "Look at the crimp of the strip, which is brittle, and at the wire from it to ground",
            );
        }
        if !without.is_empty() {
            return Told::wrong(format!("{} without a number in most lines", without.join(", "))).because(
                "The sketch has nothing to print: the sensor is not connected",
                "Look at the plug and the wires of that sensor; the other channels go on",
            );
        }
        if !shorted.is_empty() {
            return Told::wrong(format!("{} at zero", shorted.join(", "))).because(
                "The pin is shorted to ground, or the resistor to 3.3 V is missing",
                "Measure 47 kOhm from 3.3 V to the pin, and 17 to 70 kOhm from the pin to ground",
            );
        }
        let idle = named(link, |channel, sensor| {
            sensor.is_some_and(|sensor| !sensor.is_flex()) && trace(channel).most <= IDLE_COUNTS
        });
        if idle.is_empty() {
            return Told::good("every channel gives numbers");
        }
        Told::note(format!("{} never pressed", idle.join(", "))).because(
            "A pad that is not touched reads nothing, and so does one that has come off",
            "Press each pad while the doctor listens",
        )
    }))
}

fn crosstalk(seen: &Observations) -> Told {
    let told = readings(seen).map(|link| {
        let scale = f64::from(link.board.full_scale) / 4095.0;
        let pads = (1..link.board.channels.len()).filter(|channel| {
            // A channel at the rail says nothing of its neighbour, nor does its neighbour.
            let railed = |channel: usize| is_high(link, channel);
            sensor(&link.board, *channel).is_some_and(|sensor| !sensor.is_flex())
                && !railed(*channel)
                && !railed(channel - 1)
        });
        let found = pads.filter_map(|channel| bleeding(link, channel, seen.traces.channels.get(channel)?, scale));
        let found: Vec<Told> = found.collect();
        found.into_iter().max_by_key(|told| told.verdict).unwrap_or_else(|| Told::good("idle pads read nothing"))
    });
    or_not_seen(told)
}

/// What a pad shows that should read nothing at times: it never does, and goes with the channel before it.
fn bleeding(link: &LinkStatus, channel: usize, trace: &ChannelTrace, scale: f64) -> Option<Told> {
    if trace.numbers == 0 || trace.least <= IDLE_COUNTS * scale {
        return None;
    }
    let (name, before) = (&link.board.channels[channel], &link.board.channels[channel - 1]);
    let least = trace.least;
    if let Some(share) = trace.takes().filter(|share| (0.01..1.0).contains(share)) {
        let percent = 100.0 * share;
        let seen = format!("{name} takes {percent:.0} % of {before}, and is never below {least:.0} counts");
        return Some(Told::wrong(seen).because(
            "The converter's multiplexer does not settle behind the high resistance of the divider",
            "Solder 100 nF from each pin to ground, and throw away the first conversion of each channel, as our firmware does",
        ));
    }
    Some(Told::note(format!("{name} is never below {least:.0} counts")).because(
        format!("Something presses the pad all the time, or {before} bleeds into it"),
        "Move one sensor after the other: that says which",
    ))
}

fn rate(seen: &Observations) -> Told {
    or_not_seen(readings(seen).map(|link| {
        let cadence = &link.cadence;
        let (measured, jitter) = (cadence.rate_hz, cadence.jitter_p95_ms);
        let lost = cadence.lost as f64 / (cadence.samples + cadence.lost).max(1) as f64;
        let [bytes, rows] = link.dropped;
        if lost > LOST_SHARE {
            let seen = format!("{} of {} samples did not arrive", cadence.lost, cadence.samples + cadence.lost);
            if cadence.bad_lines > 0 {
                // Another check's: what is unreadable is missing.
                return Told::note(seen)
                    .because("Some lines could not be read", "See what the check of lines says first");
            }
            let cause = if bytes + rows > 0 {
                "This computer was too slow to take them"
            } else {
                "The board skips samples, or the line between loses them"
            };
            return Told::wrong(seen)
                .because(cause, "Lower the rate in the sketch, close other programs, use a short cable");
        }
        match link.board.rate_hz {
            Some(said) if (measured / said - 1.0).abs() > RATE_SHARE => {
                Told::wrong(format!("{} samples a second; the board says {said}", three_digits(measured))).because(
                    "The sketch does more in a period than fits, or waits by delay()",
                    "Keep its schedule from micros(), as our firmware does, or lower the rate",
                )
            }
            _ => Told::good(format!(
                "{} samples a second, jitter {} ms (95 %)",
                three_digits(measured),
                three_digits(jitter)
            )),
        }
    }))
}

fn clock(seen: &Observations) -> Told {
    or_not_seen(readings(seen).map(|link| {
        let Some(ppm) = link.cadence.drift_ppm else {
            return Told::note("the board sends no time").because(
                "Its lines have no t_us: times are taken from when bytes arrive, which is later by some milliseconds now and then",
                "Print t_us:, as our firmware does",
            );
        };
        let told = format!("{ppm:+.0} ppm against this computer's");
        if ppm.abs() > NO_CLOCK_PPM {
            Told::wrong(told).because("t_us does not count microseconds", "Print micros() as t_us")
        } else if ppm.abs() > CRYSTAL_PPM {
            Told::note(told).because(
                "The board's clock comes from a resonator, or it was measured for a few seconds only",
                "Nothing: it is taken into account",
            )
        } else {
            Told::good(told)
        }
    }))
}
