//! Rows: one sample of any gripper as values of channels, the form in which plots and recognisers take it. Which column a
//! recogniser reads is found once per grasp.

use palpate_sim::frame::Frame;
use palpate_sim::gripper::{GripperModel, Phase};
use palpate_tactile::board::Reading;
use palpate_tactile::calibration::SensorEstimate;
use palpate_tactile::{Channel, LayoutError, SensorLayout, Sensors, SignalDefinition};

/// One sample: a value per channel, in the channel's unit; NaN where it is undefined.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Time on the gripper's clock (s).
    pub t_s: f64,
    /// Line pressure (bar); NaN where it is unknown.
    pub line_bar: f64,
    /// Phase of the programme, where the gripper reports it.
    pub phase: Option<Phase>,
    /// A value per channel.
    pub values: Box<[f32]>,
}

impl Row {
    /// The row of a board's reading: these derived channels, then so many counts of the board.
    pub fn of_reading(reading: &Reading, estimate: &SensorEstimate, channels: &[Channel], counts: usize) -> Self {
        let derived = channels.iter().map(|channel| estimate.of(channel).map_or(f32::NAN, |value| value as f32));
        let count = |place: usize| reading.counts.get(place).copied().flatten().unwrap_or(f32::NAN);
        let values = derived.chain((0..counts).map(count)).collect();
        Self { t_s: reading.t_s, line_bar: reading.line_bar.unwrap_or(f64::NAN), phase: None, values }
    }
}

/// Reads frames of a simulated gripper as rows.
#[derive(Clone, Debug)]
pub struct FrameReader {
    sensors: Sensors,
}

impl FrameReader {
    /// Reads the channels of a layout, followed by those of `more` that it lacks.
    pub fn new(
        layout: &SensorLayout,
        gripper: &GripperModel,
        signals: SignalDefinition,
        more: &[Channel],
    ) -> Result<Self, LayoutError> {
        let mut sensors = Sensors::new(layout, gripper, signals)?;
        sensors.add(more);
        Ok(Self { sensors })
    }

    /// Reads these channels.
    pub fn of(channels: Vec<Channel>, gripper: &GripperModel) -> Self {
        Self { sensors: Sensors::of(channels, gripper) }
    }

    /// The channels of its rows.
    pub fn channels(&self) -> &[Channel] {
        self.sensors.channels()
    }

    /// The sensors.
    pub fn sensors(&self) -> &Sensors {
        &self.sensors
    }

    /// The row of a frame, of which `values` were read.
    pub fn row_of(frame: &Frame, values: &[Option<f64>]) -> Row {
        let values = values.iter().map(|value| value.map_or(f32::NAN, |value| value as f32)).collect();
        Row { t_s: frame.t, line_bar: frame.line_bar, phase: Some(frame.phase), values }
    }

    /// The row of a frame.
    pub fn row(&self, frame: &Frame) -> Row {
        Self::row_of(frame, &self.sensors.read(frame))
    }
}
