//! Decoded data of a sensor board: counts of its converter, stamped. Angle, force and pressure
//! are derived from them later by a calibration, so that a better one serves old trials too.

pub use crate::sensor_list::{Measures, Sensor, SensorKind, SensorList, SensorRow};
use serde::{Deserialize, Serialize};

/// Board description from its handshake line, or inferred from its data lines.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Board {
    /// Names of its channels, in the order of [`Reading::counts`].
    pub channels: Vec<String>,
    /// The largest count of its converter: 4095 for 12 bits.
    pub full_scale: u32,
    /// Voltage at which the converter reaches it, and which feeds the dividers (V).
    pub reference_volt: f64,
    /// Reported sampling rate (1/s).
    pub rate_hz: Option<f64>,
    /// Fixed resistor of each channel's divider (ohm), where reported; else empty.
    pub divider_ohm: Vec<f64>,
    /// Version of its firmware, where reported.
    pub firmware: Option<String>,
    /// It is the emulator of `palpate emulate` or `palpate serve`, by its handshake.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub emulated: bool,
    /// The sensors that its channels are wired to, by name.
    #[serde(skip_serializing_if = "is_paper")]
    pub sensors: SensorList,
}

fn is_paper(sensors: &SensorList) -> bool {
    *sensors == SensorList::default()
}

impl Default for Board {
    /// The Due as our firmware sets it up.
    fn default() -> Self {
        Self {
            channels: SensorList::default().iter().map(|sensor| sensor.channel().to_owned()).collect(),
            full_scale: 4095,
            reference_volt: 3.3,
            rate_hz: None,
            divider_ohm: Vec::new(),
            firmware: None,
            emulated: false,
            sensors: SensorList::default(),
        }
    }
}

impl Board {
    /// Channel that a sensor is read on; see [`Sensor::is_called`].
    pub fn channel_of(&self, sensor: Sensor) -> Option<usize> {
        self.channels.iter().position(|name| sensor.is_called(name))
    }

    /// The sensor that a channel is wired to.
    pub fn sensor_of(&self, channel: usize) -> Option<Sensor> {
        self.sensors.called(self.channels.get(channel)?)
    }
}

/// Readings after which a board's channels are known.
pub const KNOWN_AFTER: u32 = 5;

/// Time of readings (s) after which a board is identified: it has sent its handshake, or its counts have shown the
/// range of its converter.
pub const KNOWN_AFTER_S: f64 = 1.2;

/// One line of a board.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// Time of the sample since the stream began, on this computer's clock (s): the board's own time mapped onto
    /// it, where it sends one.
    pub t_s: f64,
    /// Time of arrival of its bytes, on the same clock (s).
    pub arrived_s: f64,
    /// The board's counter, unwrapped.
    pub seq: Option<u64>,
    /// Counts per channel of the [`Board`]; none where the line had no number for it.
    pub counts: Vec<Option<f32>>,
    /// Line pressure that the board reports (bar).
    pub line_bar: Option<f64>,
}

/// A stretch of time without readings. Gaps are not filled.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gap {
    /// Time of the last reading before it (s).
    pub from_s: f64,
    /// Time of the first one after it (s).
    pub to_s: f64,
    /// Number of missing readings, where the board counts them.
    pub lost: Option<u64>,
    /// Reason.
    pub cause: String,
}

impl Gap {
    /// Reason of a gap after which the board's counters began anew.
    pub const RESTARTED: &str = "the board restarted";

    /// True where the board restarted.
    pub fn is_restart(&self) -> bool {
        self.cause.ends_with(Self::RESTARTED)
    }
}

/// Line format of a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Format {
    /// Names and numbers, as Arduino's plotter takes them. Trials that were recorded from Teleplot lines load as these.
    #[serde(alias = "teleplot")]
    Plotter,
    /// Numbers in columns.
    Csv,
    /// A flat JSON object to a line.
    JsonLines,
}

impl Format {
    /// Display name.
    pub fn label(self) -> &'static str {
        match self {
            Self::Plotter => "Arduino plotter lines",
            Self::Csv => "CSV",
            Self::JsonLines => "JSON lines",
        }
    }

    /// Feature that identifies the format.
    pub fn mark(self) -> &'static str {
        match self {
            Self::Plotter => "each number follows its name and a colon",
            Self::Csv => "the lines are numbers in columns",
            Self::JsonLines => "the lines begin with {",
        }
    }
}

/// Time base of the readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TimeSource {
    /// The board's clock.
    Device,
    /// The board's sequence numbers, at an even pace.
    Sequence,
    /// Lines counted on this side, at an even pace: lost and late ones cannot be distinguished at once.
    Arrival,
}

/// Line format of a board's stream, with the evidence for it.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Detected {
    /// Line format.
    pub format: Format,
    /// Evidence and assumptions, one sentence.
    pub why: String,
    /// Time base of the readings.
    pub time: TimeSource,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_knows_its_channels_by_name_and_not_by_place() {
        let board = Board { channels: vec!["FSRL".into(), "Flex_r".into(), "temperature".into()], ..Board::default() };
        assert_eq!(board.channel_of(Sensor::PAD_LEFT), Some(0));
        assert_eq!(board.channel_of(Sensor::FLEX_RIGHT), Some(1));
        assert_eq!(board.channel_of(Sensor::FLEX_LEFT), None);
        let places: Vec<_> = SensorList::default().iter().map(|sensor| Board::default().channel_of(sensor)).collect();
        assert_eq!(places, [Some(0), Some(1), Some(2), Some(3)]);
    }
}
