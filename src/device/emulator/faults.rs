//! Faults of the emulator, on request: `NAME[=VALUE]@SECONDS[/DURATION]`, separated by commas, as in
//! `vanish@5,garbage@7/2,stuck=2@10`; a gain has a factor, `gain=2*0.5@3`.

use super::event::EmulatorError;
use std::fmt;

/// Kinds of fault, from the sensor to the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FaultKind {
    /// A channel keeps its reading.
    Stuck,
    /// A channel is at full scale.
    Saturated,
    /// A sensor is disconnected.
    Open,
    /// A channel is printed as `nan`.
    Nan,
    /// The voltage of a channel is multiplied by a factor.
    Gain,
    /// Each channel takes a share of the one read before it.
    Crosstalk,
    /// The converter is left at its default of 10 bits.
    TenBit,
    /// The board's clock is fast.
    Clock,
    /// The board restarts: a second of silence, then the handshake; its clock and counter restart.
    Reset,
    /// Lines are lost.
    Loss,
    /// Lines are truncated.
    Partial,
    /// Lines lose a byte.
    Byte,
    /// Random bytes replace lines.
    Garbage,
    /// The baud rates of board and host differ.
    Baud,
    /// Lines come in bunches.
    Burst,
    /// Nothing is sent.
    Silent,
    /// The port disappears and comes back.
    Vanish,
    /// The board hears nothing.
    Deaf,
    /// Commands are not answered.
    NoAnswer,
    /// Commands are answered with another pressure.
    WrongAnswer,
    /// Another pressure is reported.
    WrongPressure,
}

/// Name, default value, default duration (s) and description of a kind.
struct Row {
    kind: FaultKind,
    name: &'static str,
    value: f64,
    duration_s: f64,
    words: &'static str,
}

const FOR_EVER: f64 = f64::INFINITY;
/// Usual factor of a gain.
const HALF: f64 = 0.5;

const fn row(kind: FaultKind, name: &'static str, value: f64, duration_s: f64, words: &'static str) -> Row {
    Row { kind, name, value, duration_s, words }
}

const TABLE: [Row; 21] = [
    row(FaultKind::Stuck, "stuck", 0.0, FOR_EVER, "channel VALUE is stuck at its reading"),
    row(FaultKind::Saturated, "saturation", 0.0, FOR_EVER, "channel VALUE is saturated at full scale"),
    row(FaultKind::Open, "open", 0.0, FOR_EVER, "the sensor of channel VALUE is disconnected"),
    row(FaultKind::Nan, "nan", 0.0, FOR_EVER, "channel VALUE is printed as nan"),
    row(FaultKind::Gain, "gain", 0.0, FOR_EVER, "channel VALUE reads a half, or with VALUE*FACTOR another share"),
    row(FaultKind::Crosstalk, "crosstalk", 0.2, FOR_EVER, "each channel picks up a share VALUE of the one before"),
    row(FaultKind::TenBit, "tenbit", 0.0, FOR_EVER, "the converter gives 10 bits"),
    row(FaultKind::Clock, "clock", 200.0, FOR_EVER, "the board's clock is fast by VALUE ppm"),
    row(FaultKind::Reset, "reset", 0.0, 1.0, "the board restarts"),
    row(FaultKind::Loss, "loss", 0.1, 1.0, "a share VALUE of the lines is lost"),
    row(FaultKind::Partial, "partial", 0.5, 1.0, "a share VALUE of the lines is truncated"),
    row(FaultKind::Byte, "byte", 0.5, 1.0, "a share VALUE of the lines loses a byte"),
    row(FaultKind::Garbage, "garbage", 0.0, 0.5, "random bytes instead of lines"),
    row(FaultKind::Baud, "baud", 2.0, 2.0, "the board sends VALUE times faster than the host reads"),
    row(FaultKind::Burst, "burst", 0.25, 2.0, "lines arrive in bunches, every VALUE s"),
    row(FaultKind::Silent, "silent", 0.0, 2.0, "nothing is sent"),
    row(FaultKind::Vanish, "vanish", 0.0, 1.0, "the port disappears and comes back"),
    row(FaultKind::Deaf, "deaf", 0.0, FOR_EVER, "the board hears no command"),
    row(FaultKind::NoAnswer, "noanswer", 0.0, FOR_EVER, "the board answers no command"),
    row(FaultKind::WrongAnswer, "wronganswer", 1.5, FOR_EVER, "the board acknowledges VALUE bar, whatever was asked"),
    row(FaultKind::WrongPressure, "wrongpressure", 0.0, FOR_EVER, "the board reports VALUE bar as its pressure"),
];

impl FaultKind {
    /// The name used on the command line.
    pub fn name(self) -> &'static str {
        TABLE.iter().find(|row| row.kind == self).map_or("", |row| row.name)
    }
}

/// A fault and its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmulatedFault {
    pub kind: FaultKind,
    /// Its parameter; see [`fault_help`].
    pub value: f64,
    /// Factor of a gain; 1 for others.
    pub factor: f64,
    /// Start (s since the first host).
    pub from_s: f64,
    /// End (s).
    pub until_s: f64,
}

impl EmulatedFault {
    /// True while it is active (s).
    pub fn is_on(&self, t: f64) -> bool {
        (self.from_s..self.until_s).contains(&t)
    }
}

impl fmt::Display for EmulatedFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let factor = if self.kind == FaultKind::Gain { format!("*{}", self.factor) } else { String::new() };
        write!(f, "{}={}{factor}@{}", self.kind.name(), self.value, self.from_s)?;
        if self.until_s.is_finite() { write!(f, "/{}", self.until_s - self.from_s) } else { Ok(()) }
    }
}

/// Help text: all faults.
pub fn fault_help() -> String {
    let line = |row: &Row| {
        let lasts =
            if row.duration_s.is_finite() { format!("{} s", row.duration_s) } else { "until the end".to_owned() };
        format!("  {:<13} {} (VALUE {}, duration {lasts})", row.name, row.words, row.value)
    };
    TABLE.iter().map(line).collect::<Vec<_>>().join("\n")
}

/// Parses a list of faults.
pub fn parse_faults(text: &str) -> Result<Vec<EmulatedFault>, EmulatorError> {
    let wrong = |text: &str, problem| {
        let form = "write NAME[=VALUE]@SECONDS[/DURATION], as in garbage@7/2";
        EmulatorError(format!("the fault \"{text}\" {problem}; {form}"))
    };
    let parse = |text| parse_fault(text).map_err(|problem: String| wrong(text, problem));
    text.split(',').map(str::trim).filter(|part| !part.is_empty()).map(parse).collect()
}

fn parse_fault(text: &str) -> Result<EmulatedFault, String> {
    let (named, times) = text.split_once('@').ok_or("has no time")?;
    let (name, value) = named.split_once('=').map_or((named, None), |(name, value)| (name, Some(value)));
    // Its name in version 0.1.0.
    let name = if name == "rail" { FaultKind::Saturated.name() } else { name };
    let unknown = || format!("is not one of {}", TABLE.map(|row| row.name).join(", "));
    let row = TABLE.iter().find(|row| row.name == name).ok_or_else(unknown)?;
    let (from, duration) = times.split_once('/').map_or((times, None), |(from, lasts)| (from, Some(lasts)));
    let (value, factor) = match value.filter(|_| row.kind == FaultKind::Gain).and_then(|value| value.split_once('*')) {
        Some((channel, factor)) => (Some(channel), Some(factor)),
        None => (value, None),
    };
    let number = |text: Option<&str>, usual: f64| match text {
        Some(text) => text.parse().ok().filter(|n: &f64| n.is_finite() && *n >= 0.0).ok_or("has an invalid number"),
        None => Ok(usual),
    };
    let from_s = number(Some(from), 0.0)?;
    let until_s = from_s + number(duration, row.duration_s)?;
    let factor = number(factor, if row.kind == FaultKind::Gain { HALF } else { 1.0 })?;
    Ok(EmulatedFault { kind: row.kind, value: number(value, row.value)?, factor, from_s, until_s })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_of_faults_is_read() {
        let faults = parse_faults("vanish@5, garbage@7/2,stuck=2@10").expect("sound");
        let garbage = EmulatedFault { kind: FaultKind::Garbage, value: 0.0, factor: 1.0, from_s: 7.0, until_s: 9.0 };
        assert_eq!((faults.len(), faults[1]), (3, garbage));
        assert_eq!((faults[0].kind, faults[0].until_s), (FaultKind::Vanish, 6.0));
        assert!(faults[2].value == 2.0 && faults[2].until_s.is_infinite() && faults[2].is_on(1e9));
        assert!(garbage.is_on(7.0) && !garbage.is_on(9.0) && !garbage.is_on(6.9));
        assert_eq!(parse_faults("rail=2@1"), parse_faults("saturation=2@1"));
        let gains = parse_faults("gain=3*0.7@1,gain=1@2").expect("sound");
        assert_eq!(gains.iter().map(|gain| (gain.value, gain.factor)).collect::<Vec<_>>(), [(3.0, 0.7), (1.0, HALF)]);
        for fault in faults.into_iter().chain(gains) {
            assert_eq!(parse_faults(&fault.to_string()), Ok(vec![fault]));
        }
    }

    #[test]
    fn every_kind_has_one_row_and_a_line_of_help() {
        for row in &TABLE {
            assert_eq!(TABLE.iter().filter(|other| other.name == row.name || other.kind == row.kind).count(), 1);
            assert!(fault_help().contains(row.words));
        }
    }

    #[test]
    fn what_is_wrong_with_a_fault_is_said() {
        for (text, word) in [
            ("vanish", "time"),
            ("vnish@3", "vanish"),
            ("loss=x@3", "number"),
            ("loss@-1", "number"),
            ("gain=2*x@1", "number"),
        ] {
            let found = parse_faults(text).expect_err(text).to_string();
            assert!(found.contains(word) && found.contains(text), "{found}");
        }
    }
}
