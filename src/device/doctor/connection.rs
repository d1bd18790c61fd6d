//! Checks of the connection: port, line, firmware and clock of the board.

use super::CheckStatus::{Failed, NotChecked, Note, Passed, Skipped};
use super::evidence::Evidence;
use super::{CheckFinding, Observations};
use crate::protocol::LineKind;
use crate::serial::{LinkState, LinkStatus, MODEM_MANAGER_COMMAND, PortInfo, PortTrouble};
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
pub(super) const RATE_S: f64 = 1.0;

/// Share of readings that may be lost.
const LOST_SHARE: f64 = 1e-3;

/// Delay of readings from which on a note is given (ms): a tenth of the longest that a driven grasp accepts.
const LATE_MS: f64 = 100.0;

/// Least share of printable bytes in text; at half the rate about half of the bytes are printable.
const TEXT: f64 = 0.9;

/// Share of lines that may be unreadable, and a number that always may.
const BAD_SHARE: f64 = 0.02;
const BAD_LINES: u64 = 2;

/// Letters of a word that is no remainder of a damaged one.
const SHORTEST_WORD: usize = 4;

/// Characters of a line that are shown.
const SHOWN: usize = 60;

/// The error that kept the port from opening, if it is one of these.
fn refusal(all: &Observations, troubles: &[PortTrouble]) -> Option<CheckFinding> {
    let refused = all.refused.as_ref().filter(|refused| troubles.contains(&refused.trouble))?;
    let finding = Failed.seen(&refused.what).because(&refused.cause, &refused.fix);
    Some(CheckFinding { command: refused.command.clone(), ..finding })
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

pub(super) fn port(all: &Observations) -> CheckFinding {
    let troubles = [
        PortTrouble::NotFound,
        PortTrouble::NoBoard,
        PortTrouble::Several,
        PortTrouble::NotSerial,
        PortTrouble::Capture,
        PortTrouble::System,
    ];
    if let Some(finding) = refusal(all, &troubles) {
        return finding;
    }
    let Some(link) = &all.link else { return Passed.seen("port found") };
    let (path, fix) = (link.port.path.display(), "Check cable and plug; some charging cables have no data wires");
    match (&link.state, link.reconnects) {
        (LinkState::Lost { cause }, _) => Failed.seen(format!("{path} disconnected")).because(cause, fix),
        (_, 0) => Passed.seen(format!("{path}: {}", link.port.title)),
        (_, times) => Failed
            .seen(format!("{path} disconnected and came back, {times} time(s)"))
            .because("The plug or the cable is loose, or the board loses its supply", fix),
    }
}

/// Passes where the port opened; a file says nothing of ports.
fn opened(all: &Observations, trouble: PortTrouble, how: &str) -> CheckFinding {
    refusal(all, &[trouble]).unwrap_or_else(|| match &all.link {
        None => NotChecked.seen("the port did not open"),
        Some(link) if is_file(link) => Skipped.seen("a file"),
        Some(_) => Passed.seen(how),
    })
}

pub(super) fn permission(all: &Observations) -> CheckFinding {
    opened(all, PortTrouble::Permission, "the port opens")
}

pub(super) fn busy(all: &Observations) -> CheckFinding {
    opened(all, PortTrouble::Busy, "no other program has it")
}

pub(super) fn modem_manager(all: &Observations) -> CheckFinding {
    let is_usb = |port: &PortInfo| port.usb.is_some();
    let concerns = all.link.as_ref().map_or_else(|| all.ports.iter().any(is_usb), |link| is_usb(&link.port));
    if !all.modem_manager {
        return Passed.seen("ModemManager is not running");
    }
    if !concerns {
        return Passed.seen("ModemManager is running, but this is not a USB port");
    }
    let finding = Note.seen("ModemManager is running").because(
        "It probes every new port for a modem: for half a minute after plugging in, the port is busy or the board receives \
         garbage",
        "Make it ignore the board, then plug the board in again",
    );
    CheckFinding { command: Some(MODEM_MANAGER_COMMAND.to_owned()), ..finding }
}

pub(super) fn silence(seen: &Evidence<'_>) -> CheckFinding {
    let link = seen.link;
    let (bytes, listened) = (link.cadence.bytes, three_digits(seen.all.listened_s));
    if bytes > 0 && !matches!(link.state, LinkState::Silent { .. }) {
        return Passed.seen(format!("{bytes} bytes in {listened} s"));
    }
    if is_file(link) {
        return Failed
            .seen("the file is empty")
            .because("Nothing was captured", "Capture the board's bytes again, or name its port");
    }
    let (cause, fix) = match link.port.kind.native {
        true => (
            "The native port sends only while the host sets DTR, which it does: the sketch is not running, or prints to the \
             other port",
            "Press the board's reset button; then upload the firmware, or set HOST to the port in use",
        ),
        false => (
            "No sketch prints to this port",
            "Upload the firmware; on a Due, use the native port (next to the reset button)",
        ),
    };
    let silent = match bytes {
        0 => format!("no data in {listened} s"),
        _ => format!("the board fell silent after {bytes} bytes"),
    };
    Failed.seen(silent).because(cause, fix)
}

pub(super) fn restarts(seen: &Evidence<'_>) -> CheckFinding {
    let (times, samples) = (seen.link.cadence.restarts, seen.link.cadence.samples);
    let lasted = three_digits(seen.all.traces.seconds());
    if times > 0 {
        let times = if times == 1 { "once".to_owned() } else { format!("{times} times") };
        return Failed.seen(format!("the board restarted {times} in {lasted} s")).because(
            "Its supply breaks down, such as when a valve or a pump switches; its cable is loose; or the sketch crashes",
            "Feed valves and pumps from a supply of their own, and use a short cable; do not press reset during the check",
        );
    }
    if !counts(seen.link) {
        return Skipped.seen("the board sends neither t_us nor seq, which would show it");
    }
    Passed.seen(format!("its counter ran on through {samples} readings, {lasted} s"))
}

pub(super) fn baud(seen: &Evidence<'_>) -> CheckFinding {
    let (link, cadence) = (seen.link, &seen.link.cadence);
    if cadence.bytes == 0 {
        return NotChecked.seen("no data");
    }
    let printable = format!("{:.0} % of the bytes are text", 100.0 * cadence.printable_share);
    if cadence.samples == 0 && cadence.printable_share < TEXT {
        return Failed.seen(format!("unreadable data: {printable}")).because(
            "The board sends at an unusual baud rate, or not text",
            "Use Serial.begin(115200) in the sketch, or give its rate with --baud",
        );
    }
    match link.baud.filter(|rate| *rate != 115_200 && !link.port.kind.native) {
        None => Passed.seen(printable),
        Some(rate) => Note.seen(format!("the board sends at {rate} baud")).because(
            "The sketch sets it; found by scanning",
            format!("Give --baud {rate} to skip the scan, or use Serial.begin(115200) in the sketch"),
        ),
    }
}

/// A line that could not be read, and why, to be shown behind a number of such lines.
fn example(all: &Observations) -> String {
    let Some(line) = &all.example else { return String::new() };
    let shown = beginning(&line.text);
    match line.kind {
        LineKind::Bad(why) => format!(", such as `{shown}` ({why})"),
        LineKind::Values | LineKind::Remark => format!(", such as `{shown}`"),
    }
}

/// As much of a line as is shown.
fn beginning(text: &str) -> String {
    let cut = if text.chars().count() > SHOWN { ".." } else { "" };
    text.chars().take(SHOWN).chain(cut.chars()).collect()
}

/// The beginning of an unreadable line that is whole words, none of them a channel's name: no damage makes such a line.
fn words(seen: &Evidence<'_>) -> Option<String> {
    let line = seen.all.example.as_ref().filter(|line| matches!(line.kind, LineKind::Bad(_)))?;
    let of_channel = |name: &String| line.text.contains(name.as_str());
    let is_text = line.text.chars().all(|c| c.is_alphanumeric() || c.is_ascii_graphic() || c == ' ' || c == '\t');
    let mut words = line.text.split(|c: char| !c.is_alphabetic());
    let has_word = words.any(|word| word.chars().count() >= SHORTEST_WORD);
    (has_word && is_text && !seen.link.board.channels.iter().any(of_channel)).then(|| beginning(&line.text))
}

/// Finding where no line was understood.
fn no_line(seen: &Evidence<'_>) -> CheckFinding {
    let (bad, bytes) = (seen.link.cadence.bad_lines, seen.link.cadence.bytes);
    let finding = Failed.seen(match bad {
        0 => format!("no line understood in {bytes} byte(s)"),
        _ => format!("none of {bad} line(s) understood{}", example(seen.all)),
    });
    if seen.link.board.firmware.is_some() && bad == 0 {
        return finding.because(
            "The board has said who it is, but sent no samples",
            "Look whether the sketch waits for something before it prints its first sample",
        );
    }
    match seen.all.example.as_ref().map(|line| line.kind) {
        Some(LineKind::Bad(why)) if why.contains("checksum") => finding.because(
            "The checksums are computed otherwise than the protocol says",
            "Compute them as `palpate doctor --wiring` shows, or leave `ck` out",
        ),
        Some(LineKind::Values) => finding.because(
            "No two lines in a row have the same fields: two devices or two sketches share the port",
            "Give each device a port of its own, and print the values of a sample in one line",
        ),
        Some(LineKind::Bad(_) | LineKind::Remark) | None => finding.because(
            "They are not lines of numbers that Palpate knows",
            "Print one line for each sample, such as flexL:512,flexR:498,fsrL:30,fsrR:28",
        ),
    }
}

pub(super) fn lines(seen: &Evidence<'_>) -> CheckFinding {
    let (cadence, bad) = (&seen.link.cadence, seen.link.cadence.bad_lines);
    if cadence.bytes == 0 {
        return NotChecked.seen("no data");
    }
    if cadence.samples == 0 {
        return no_line(seen);
    }
    let all = bad + cadence.samples;
    let found = format!("{bad} of {all} lines unreadable");
    if let Some(text) = words(seen).filter(|_| bad > BAD_LINES) {
        return Note.seen(format!("{bad} of {all} lines are no samples, such as `{text}`")).because(
            "Something else is printed between the samples: the messages of a board that starts, or of a library",
            "Take those prints out of the sketch, or begin their lines with #; if the board starts again and again, look at its \
             supply",
        );
    }
    if bad as f64 > BAD_SHARE * all as f64 {
        return Failed.seen(found + &example(seen.all)).because(
            "Bytes are lost or damaged: a long or bad cable, a hub, a floating ground, or two programs on one port",
            "Use a short cable directly into the computer; the console shows the raw lines",
        );
    }
    if bad > BAD_LINES {
        return Note.seen(found).because(
            "A few damaged lines; they are skipped and shown as gaps",
            "None needed. If there are more: a short cable directly into the computer",
        );
    }
    let why = seen.link.detected.as_ref().map_or_else(String::new, |detected| format!(": {}", detected.why));
    Passed.seen(format!("{} lines read{why}", cadence.samples))
}

pub(super) fn firmware(seen: &Evidence<'_>) -> CheckFinding {
    match &seen.link.board.firmware {
        Some(version) => Passed.seen(format!("tactile-gripper, version {version}")),
        None if !is_file(seen.link) && seen.all.traces.seconds() < KNOWN_AFTER_S => {
            NotChecked.seen("too early: the board is asked who it is, and answers within a second")
        }
        None => Note.seen("the board sends no handshake").because(
            "It runs another sketch: 12 bits, 3.3 V and the usual resistors are assumed",
            "Print the handshake line of our firmware, or upload our firmware",
        ),
    }
}

pub(super) fn rate(seen: &Evidence<'_>) -> CheckFinding {
    let cadence = &seen.link.cadence;
    if !counts(seen.link) && is_untimed(seen.link) {
        return Skipped.seen("neither the board nor the file says when a reading was taken");
    }
    if let Some(wrong) = lost(seen.link).or_else(|| off_rate(seen)) {
        return wrong;
    }
    let (measured, jitter) = (three_digits(cadence.rate_hz), three_digits(cadence.jitter_p95_ms));
    if cadence.delay_p95_ms < LATE_MS {
        return Passed.seen(format!("{measured} samples per second, jitter {jitter} ms (95 %)"));
    }
    Note.seen(format!("readings arrive up to {:.0} ms late (95 %)", cadence.delay_p95_ms)).because(
        "They come in bunches: a hub, the port's latency timer, or a busy computer",
        "Connect the board directly, and close other programs",
    )
}

/// Finding for lost samples.
fn lost(link: &LinkStatus) -> Option<CheckFinding> {
    let cadence = &link.cadence;
    let all = cadence.samples + cadence.lost;
    if cadence.lost as f64 <= LOST_SHARE * all as f64 {
        return None;
    }
    let lower = "Lower the sample rate in the sketch, close other programs, use a short cable";
    // What another check reports is missing here.
    let (status, cause, fix) = match (link.reconnects, cadence.bad_lines, link.dropped) {
        (1.., _, _) => (Note, "The board was disconnected meanwhile", "See the check of the port"),
        (_, 1.., _) => (Note, "Some lines were unreadable", "See the check of lines"),
        (_, _, [0, 0]) => (Failed, "The board skips samples, or the connection loses them", lower),
        _ => (Failed, "This computer was too slow", lower),
    };
    Some(status.seen(format!("{} of {all} samples lost", cadence.lost)).because(cause, fix))
}

/// Finding for a rate other than the stated one.
fn off_rate(seen: &Evidence<'_>) -> Option<CheckFinding> {
    let link = seen.link;
    let (said, measured) = (link.board.rate_hz?, link.cadence.rate_hz);
    // Without the board's own clock the rate is that of arrival, which is off by what the last reading is late.
    let by_board = link.detected.as_ref().is_some_and(|detected| detected.time == TimeSource::Device);
    let late = if by_board { 0.0 } else { 1e-3 * link.cadence.delay_p95_ms / seen.all.traces.seconds() };
    let off = (measured / said - 1.0).abs() > RATE_SHARE + late;
    let found = format!("{} samples per second; the board states {said}", three_digits(measured));
    off.then(|| {
        Failed.seen(found).because(
            "The sketch needs longer than its period, or uses delay()",
            "Schedule samples by micros(), as our firmware does, or lower the rate",
        )
    })
}

pub(super) fn clock(seen: &Evidence<'_>) -> CheckFinding {
    let Some(ppm) = seen.link.cadence.drift_ppm else {
        return Note.seen("the board sends no timestamps").because(
            "Its lines have no t_us: times of arrival are used, which lag by some milliseconds",
            "Print t_us, as our firmware does",
        );
    };
    if is_untimed(seen.link) {
        return Skipped.seen("the file has no times of arrival to compare with");
    }
    let [lasted, arrived] = [seen.all.traces.seconds(), seen.all.traces.arrived_within_s()];
    let drift = format!("{ppm:+.0} ppm against this computer's clock");
    let stands = arrived > RATE_S && lasted < NO_CLOCK_SHARE * arrived;
    let no_clock =
        |found: String| Failed.seen(found).because("t_us does not count microseconds", "Print micros() as t_us");
    match ppm.abs() {
        _ if stands => no_clock(format!("it counted {} s in {} s", three_digits(lasted), three_digits(arrived))),
        NO_CLOCK_PPM.. => no_clock(drift),
        CRYSTAL_PPM.. => Note.seen(drift).because(
            "The board's clock is a resonator, or it was measured for a few seconds only",
            "None needed: the drift is corrected",
        ),
        // A gain that was not fitted yet is the nominal one.
        0.0 => NotChecked.seen(format!("its drift is not known after {} s", three_digits(lasted))),
        _ => Passed.seen(drift),
    }
}
