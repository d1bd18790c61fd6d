//! Checks of the connection: port, line, firmware and clock of the board.

use super::Observations;
use super::outcome::{Outcome, either, link, readings};
use crate::protocol::LineKind;
use crate::serial::{LinkState, LinkStatus, MODEM_MANAGER_COMMAND, PortTrouble};
use palpate_geometry::units::three_digits;
use palpate_tactile::board::{KNOWN_AFTER_S, TimeSource};

/// Clock error from which on a note is given (ppm): crystals are within 50, resonators within 5000.
const CRYSTAL_PPM: f64 = 100.0;

/// Clock error from which on a counter does not count microseconds (ppm).
const NO_CLOCK_PPM: f64 = 10_000.0;

/// Such a clock error as a share of the time in which the readings arrived, while the error is not known.
const NO_CLOCK_SHARE: f64 = 0.5;

/// Relative difference from the stated rate that passes.
const RATE_SHARE: f64 = 0.02;

/// Least time of readings to measure their rate (s).
const RATE_S: f64 = 1.0;

/// Share of readings that may be lost.
const LOST_SHARE: f64 = 1e-3;

/// Delay of readings from which on a note is given (ms): a tenth of the longest that a driven grasp accepts.
const LATE_MS: f64 = 100.0;

/// Least share of printable bytes in text; at half the rate about half of the bytes are printable.
const TEXT: f64 = 0.9;

/// Share of lines that may be unreadable, and a number that always may.
const BAD_SHARE: f64 = 0.02;
const BAD_LINES: u64 = 2;

/// Characters of a line that are shown.
const SHOWN: usize = 60;

/// The error that kept the port from opening, if it is one of these.
fn refusal(seen: &Observations, troubles: &[PortTrouble]) -> Option<Outcome> {
    let refused = seen.refused.as_ref().filter(|refused| troubles.contains(&refused.trouble))?;
    let outcome = Outcome::failed(refused.what.clone()).because(refused.cause.clone(), refused.fix.clone());
    Some(Outcome { command: refused.command.clone(), ..outcome })
}

/// True for a file of captured bytes.
fn is_file(link: &LinkStatus) -> bool {
    link.baud.is_none()
}

/// True for a file without times of arrival: they are derived from the board's times, or assumed.
fn is_untimed(link: &LinkStatus) -> bool {
    is_file(link) && link.cadence.delay_p95_ms < 1e-3
}

/// True if the board sends its time or the number of each reading.
fn counts(link: &LinkStatus) -> bool {
    link.detected.as_ref().is_some_and(|detected| detected.time != TimeSource::Arrival)
}

pub(super) fn port(seen: &Observations) -> Outcome {
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
    let Some(link) = &seen.link else { return Outcome::passed("port found") };
    let (path, fix) = (link.port.path.display(), "Check cable and plug; some charging cables have no data wires");
    match (&link.state, link.reconnects) {
        (LinkState::Lost { cause }, _) => Outcome::failed(format!("{path} disconnected")).because(cause.clone(), fix),
        (_, 0) => Outcome::passed(format!("{path}: {}", link.port.title)),
        (_, times) => Outcome::failed(format!("{path} disconnected and came back, {times} time(s)"))
            .because("The plug or the cable is loose, or the board loses its supply", fix),
    }
}

/// Passes where the port opened; a file says nothing of ports.
fn opened(seen: &Observations, how: &str) -> Outcome {
    either(link(seen).map(|link| if is_file(link) { Outcome::skipped("a file") } else { Outcome::passed(how) }))
}

pub(super) fn permission(seen: &Observations) -> Outcome {
    refusal(seen, &[PortTrouble::Permission]).unwrap_or_else(|| opened(seen, "the port opens"))
}

pub(super) fn busy(seen: &Observations) -> Outcome {
    refusal(seen, &[PortTrouble::Busy]).unwrap_or_else(|| opened(seen, "no other program has it"))
}

pub(super) fn modem_manager(seen: &Observations) -> Outcome {
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

pub(super) fn silence(seen: &Observations) -> Outcome {
    let link = match link(seen) {
        Ok(link) => link,
        Err(unseen) => return unseen,
    };
    let (bytes, listened) = (link.cadence.bytes, three_digits(seen.listened_s));
    let fell_silent = matches!(link.state, LinkState::Silent { .. });
    if bytes > 0 && !fell_silent {
        return Outcome::passed(format!("{bytes} bytes in {listened} s"));
    }
    if is_file(link) {
        return Outcome::failed("the file is empty")
            .because("Nothing was captured", "Capture the board's bytes again, or name its port");
    }
    let seen = match bytes {
        0 => format!("no data in {listened} s"),
        _ => format!("the board fell silent after {bytes} bytes"),
    };
    if link.port.kind.native {
        Outcome::failed(seen).because(
            "The native port sends only while the host sets DTR, which it does: the sketch is not running, or prints to the \
             other port",
            "Press the board's reset button; then upload the firmware, or set HOST to the port in use",
        )
    } else {
        Outcome::failed(seen).because(
            "No sketch prints to this port",
            "Upload the firmware; on a Due, use the native port (next to the reset button)",
        )
    }
}

pub(super) fn restarts(seen: &Observations) -> Outcome {
    either(readings(seen, 0.0).map(|link| {
        let (times, samples) = (link.cadence.restarts, link.cadence.samples);
        let lasted = three_digits(seen.traces.seconds());
        if times > 0 {
            let times = if times == 1 { "once".to_owned() } else { format!("{times} times") };
            return Outcome::failed(format!("the board restarted {times} in {lasted} s")).because(
                "Its supply breaks down, such as when a valve or a pump switches; its cable is loose; or the sketch crashes",
                "Feed valves and pumps from a supply of their own, and use a short cable; do not press reset during the check",
            );
        }
        if !counts(link) {
            return Outcome::skipped("the board sends neither t_us nor seq, which would show it");
        }
        Outcome::passed(format!("its counter ran on through {samples} readings, {lasted} s"))
    }))
}

pub(super) fn baud(seen: &Observations) -> Outcome {
    let link = match link(seen) {
        Ok(link) if link.cadence.bytes > 0 => link,
        Ok(_) => return Outcome::not_checked("no data"),
        Err(unseen) => return unseen,
    };
    let share = link.cadence.printable_share;
    let printable = format!("{:.0} % of the bytes are text", 100.0 * share);
    if link.cadence.samples == 0 && share < TEXT {
        return Outcome::failed(format!("unreadable data: {printable}")).because(
            "The board sends at an unusual baud rate, or not text",
            "Use Serial.begin(115200) in the sketch, or give its rate with --baud",
        );
    }
    match link.baud {
        Some(rate) if rate != 115_200 && !link.port.kind.native => {
            Outcome::note(format!("the board sends at {rate} baud")).because(
                "The sketch sets it; found by scanning",
                format!("Give --baud {rate} to skip the scan, or use Serial.begin(115200) in the sketch"),
            )
        }
        _ => Outcome::passed(printable),
    }
}

/// A line that could not be read, and why, to be shown behind a number of such lines.
fn example(seen: &Observations) -> String {
    let Some(line) = &seen.example else { return String::new() };
    let cut = if line.text.chars().count() > SHOWN { ".." } else { "" };
    let shown: String = line.text.chars().take(SHOWN).collect();
    match line.kind {
        LineKind::Bad(why) => format!(", such as `{shown}{cut}` ({why})"),
        LineKind::Values | LineKind::Remark => format!(", such as `{shown}{cut}`"),
    }
}

/// Finding where no line was understood.
fn no_line(seen: &Observations, link: &LinkStatus) -> Outcome {
    let (bad, bytes) = (link.cadence.bad_lines, link.cadence.bytes);
    let outcome = Outcome::failed(match bad {
        0 => format!("no line understood in {bytes} byte(s)"),
        _ => format!("none of {bad} line(s) understood{}", example(seen)),
    });
    match seen.example.as_ref().map(|line| line.kind) {
        Some(LineKind::Values) => outcome.because(
            "No two lines in a row have the same fields: two devices or two sketches share the port",
            "Give each device a port of its own, and print the values of a sample in one line",
        ),
        Some(LineKind::Bad(_) | LineKind::Remark) | None => outcome.because(
            "They are not lines of numbers that Palpate knows",
            "Print one line for each sample, such as flexL:512,flexR:498,fsrL:30,fsrR:28",
        ),
    }
}

pub(super) fn lines(seen: &Observations) -> Outcome {
    let outcome = link(seen).and_then(|link| {
        let cadence = &link.cadence;
        let bad = cadence.bad_lines;
        let all = bad + cadence.samples;
        if cadence.bytes == 0 {
            return Err(Outcome::not_checked("no data"));
        }
        if cadence.samples == 0 {
            return Ok(no_line(seen, link));
        }
        let why = link.detected.as_ref().map_or_else(String::new, |detected| format!(": {}", detected.why));
        let found = format!("{bad} of {all} lines unreadable");
        Ok(if bad as f64 > BAD_SHARE * all as f64 {
            Outcome::failed(found + &example(seen)).because(
                "Bytes are lost or damaged: a long or bad cable, a hub, a floating ground, or two programs on one port",
                "Use a short cable directly into the computer; the console shows the raw lines",
            )
        } else if bad > BAD_LINES {
            Outcome::note(found).because(
                "A few damaged lines; they are skipped and shown as gaps",
                "None needed. If there are more: a short cable directly into the computer",
            )
        } else {
            Outcome::passed(format!("{} lines read{why}", cadence.samples))
        })
    });
    either(outcome)
}

pub(super) fn firmware(seen: &Observations) -> Outcome {
    either(readings(seen, 0.0).map(|link| match &link.board.firmware {
        Some(version) => Outcome::passed(format!("tactile-gripper, version {version}")),
        None if !is_file(link) && seen.traces.seconds() < KNOWN_AFTER_S => {
            Outcome::not_checked("too early: the board is asked who it is, and answers within a second")
        }
        None => Outcome::note("the board sends no handshake").because(
            "It runs another sketch: 12 bits, 3.3 V and the usual resistors are assumed",
            "Print the handshake line of our firmware, or upload our firmware",
        ),
    }))
}

pub(super) fn rate(seen: &Observations) -> Outcome {
    either(readings(seen, RATE_S).map(|link| {
        if !counts(link) && is_untimed(link) {
            return Outcome::skipped("neither the board nor the file says when a reading was taken");
        }
        lost(link).or_else(|| off_rate(seen, link)).unwrap_or_else(|| {
            let (measured, jitter) = (three_digits(link.cadence.rate_hz), three_digits(link.cadence.jitter_p95_ms));
            let delay = link.cadence.delay_p95_ms;
            if delay < LATE_MS {
                return Outcome::passed(format!("{measured} samples per second, jitter {jitter} ms (95 %)"));
            }
            Outcome::note(format!("readings arrive up to {delay:.0} ms late (95 %)")).because(
                "They come in bunches: a hub, the port's latency timer, or a busy computer",
                "Connect the board directly, and close other programs",
            )
        })
    }))
}

/// Finding for lost samples.
fn lost(link: &LinkStatus) -> Option<Outcome> {
    let cadence = &link.cadence;
    let all = cadence.samples + cadence.lost;
    if cadence.lost as f64 <= LOST_SHARE * all as f64 {
        return None;
    }
    let seen = format!("{} of {all} samples lost", cadence.lost);
    // What another check reports is missing here.
    for (is_why, cause, fix) in [
        (link.reconnects > 0, "The board was disconnected meanwhile", "See the check of the port"),
        (cadence.bad_lines > 0, "Some lines were unreadable", "See the check of lines"),
    ] {
        if is_why {
            return Some(Outcome::note(seen).because(cause, fix));
        }
    }
    let cause = match link.dropped {
        [0, 0] => "The board skips samples, or the connection loses them",
        _ => "This computer was too slow",
    };
    let fix = "Lower the sample rate in the sketch, close other programs, use a short cable";
    Some(Outcome::failed(seen).because(cause, fix))
}

/// Finding for a rate other than the stated one.
fn off_rate(seen: &Observations, link: &LinkStatus) -> Option<Outcome> {
    let (said, measured) = (link.board.rate_hz?, link.cadence.rate_hz);
    // Without the board's own clock the rate is that of arrival, which is off by what the last reading is late.
    let by_board = link.detected.as_ref().is_some_and(|detected| detected.time == TimeSource::Device);
    let late = if by_board { 0.0 } else { 1e-3 * link.cadence.delay_p95_ms / seen.traces.seconds() };
    let off = (measured / said - 1.0).abs() > RATE_SHARE + late;
    let seen = format!("{} samples per second; the board states {said}", three_digits(measured));
    off.then(|| {
        Outcome::failed(seen).because(
            "The sketch needs longer than its period, or uses delay()",
            "Schedule samples by micros(), as our firmware does, or lower the rate",
        )
    })
}

pub(super) fn clock(seen: &Observations) -> Outcome {
    either(readings(seen, 0.0).map(|link| {
        let Some(ppm) = link.cadence.drift_ppm else {
            return Outcome::note("the board sends no timestamps").because(
                "Its lines have no t_us: times of arrival are used, which lag by some milliseconds",
                "Print t_us, as our firmware does",
            );
        };
        if is_untimed(link) {
            return Outcome::skipped("the file has no times of arrival to compare with");
        }
        let [lasted, arrived] = [seen.traces.seconds(), seen.traces.arrived_within_s()];
        let drift = format!("{ppm:+.0} ppm against this computer's clock");
        let stands = arrived > RATE_S && lasted < NO_CLOCK_SHARE * arrived;
        match ppm.abs() {
            _ if stands => no_clock(format!("it counted {} s in {} s", three_digits(lasted), three_digits(arrived))),
            NO_CLOCK_PPM.. => no_clock(drift),
            CRYSTAL_PPM.. => Outcome::note(drift).because(
                "The board's clock is a resonator, or it was measured for a few seconds only",
                "None needed: the drift is corrected",
            ),
            // A gain that was not fitted yet is the nominal one.
            0.0 => Outcome::not_checked(format!("its drift is not known after {} s", three_digits(lasted))),
            _ => Outcome::passed(drift),
        }
    }))
}

fn no_clock(seen: String) -> Outcome {
    Outcome::failed(seen).because("t_us does not count microseconds", "Print micros() as t_us")
}
