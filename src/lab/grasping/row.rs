//! Rows: one sample of any gripper as values of channels, the form in which plots and recognisers take it. Which column a
//! recogniser reads is found once per grasp.

use palpate_sim::frame::Frame;
use palpate_sim::gripper::Phase;
use palpate_tactile::board::Reading;
use palpate_tactile::calibration::SensorEstimate;
use palpate_tactile::{Channel, Sensors};

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
    /// The row of a board's reading: these derived channels, then so many counts of the board. The line pressure (bar) is
    /// the reported one, which is more accurate, or else the commanded one.
    pub fn of_reading(
        reading: &Reading,
        commanded: Option<f64>,
        estimate: &SensorEstimate,
        channels: &[Channel],
        counts: usize,
    ) -> Self {
        let derived = channels.iter().map(|channel| estimate.of(channel).map_or(f32::NAN, |value| value as f32));
        let count = |place: usize| reading.counts.get(place).copied().flatten().unwrap_or(f32::NAN);
        let values = derived.chain((0..counts).map(count)).collect();
        let line_bar = reading.line_bar.or(commanded).unwrap_or(f64::NAN);
        Self { t_s: reading.t_s, line_bar, phase: None, values }
    }

    /// The row of a frame, as these sensors read it.
    pub fn of_frame(frame: &Frame, sensors: &Sensors) -> Self {
        Self::of_values(frame, &sensors.read(frame))
    }

    /// The row of a frame, of which `values` were read.
    pub fn of_values(frame: &Frame, values: &[Option<f64>]) -> Self {
        let values = values.iter().map(|value| value.map_or(f32::NAN, |value| value as f32)).collect();
        Self { t_s: frame.t, line_bar: frame.line_bar, phase: Some(frame.phase), values }
    }
}
