//! Decoded data of a sensor board: counts of its converter, stamped. Angle, force and pressure
//! are derived from them later by a calibration, so that a better one serves old trials too.

use serde::{Deserialize, Serialize};

/// Sensor of the gripper, which a channel of the board is wired to (paper, section IV-B).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sensor {
    /// Flex strip on the back of the left finger.
    FlexLeft,
    /// Flex strip on the back of the right finger.
    FlexRight,
    /// Force sensor on the pad of the left finger.
    PadLeft,
    /// Force sensor on the pad of the right finger.
    PadRight,
}

impl Sensor {
    /// All four, in the order in which the firmware prints them.
    pub const ALL: [Self; 4] = [Self::FlexLeft, Self::FlexRight, Self::PadLeft, Self::PadRight];

    /// The name of its channel in the firmware's lines.
    pub fn channel(self) -> &'static str {
        match self {
            Self::FlexLeft => "flexL",
            Self::FlexRight => "flexR",
            Self::PadLeft => "fsrL",
            Self::PadRight => "fsrR",
        }
    }

    /// The sensor whose channel has such a name; see [`Sensor::is_called`].
    pub fn called(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|sensor| sensor.is_called(name))
    }

    /// True for the names that boards may give its channel: case, blanks, hyphens and underscores are ignored.
    pub fn is_called(self, name: &str) -> bool {
        let letters = name.chars().filter(|c| !" -_".contains(*c)).map(|c| c.to_ascii_lowercase());
        letters.eq(self.channel().chars().map(|c| c.to_ascii_lowercase()))
    }

    /// Display name.
    pub fn label(self) -> &'static str {
        match self {
            Self::FlexLeft => "left flex strip",
            Self::FlexRight => "right flex strip",
            Self::PadLeft => "left pad",
            Self::PadRight => "right pad",
        }
    }

    /// True for the strips, which read curvature; the others read force.
    pub fn is_flex(self) -> bool {
        matches!(self, Self::FlexLeft | Self::FlexRight)
    }
}

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
}

impl Default for Board {
    /// The Due as our firmware sets it up.
    fn default() -> Self {
        Self {
            channels: Sensor::ALL.iter().map(|sensor| sensor.channel().to_owned()).collect(),
            full_scale: 4095,
            reference_volt: 3.3,
            rate_hz: None,
            divider_ohm: Vec::new(),
            firmware: None,
        }
    }
}

impl Board {
    /// Channel that a sensor is read on; see [`Sensor::is_called`].
    pub fn channel_of(&self, sensor: Sensor) -> Option<usize> {
        self.channels.iter().position(|name| sensor.is_called(name))
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
        assert_eq!(board.channel_of(Sensor::PadLeft), Some(0));
        assert_eq!(board.channel_of(Sensor::FlexRight), Some(1));
        assert_eq!(board.channel_of(Sensor::FlexLeft), None);
        let places = Sensor::ALL.map(|sensor| Board::default().channel_of(sensor));
        assert_eq!(places, [Some(0), Some(1), Some(2), Some(3)]);
    }
}
