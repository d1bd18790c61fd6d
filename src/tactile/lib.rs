//! Tactile signals: frames of a simulation or counts of a board in, channels of curvature, pressure and force out.
//!
//! # Terms
//!
//! A **layout** (C1 .. C8) places curvature and pressure sensors on the fingers; each gives a **channel**. Channels
//! over time are [`Signals`]. A real **board** sends **readings**: counts of its converter. A **calibration** of each
//! part turns counts into angle, curvature, force and pressure; a **zero** (tare) removes drift. Trials keep raw data,
//! so that any layout and calibration can be applied later.
//!
//! # Modules, lowest layer first
//!
//! A module imports only from lower layers.
//!
//! | layer | module | holds |
//! |---|---|---|
//! | 0 | [`board`] | sensors, readings and gaps of a board |
//! | 0 | [`cadence`], [`capture`] | timing statistics of a stream, file format of captured bytes |
//! | 0 | [`electronics`] | strip, pad, divider and converter |
//! | 0 | `layout` | sensor layouts and their channels |
//! | 0 | `signals` | channels over time |
//! | 1 | [`trial`] | recorded grasps: header, and simulated, recorded or imported data |
//! | 1 | `curvature`, `pressure` | circle fit along a finger, contact patch of a pad |
//! | 1 | [`model`] | sensor models: clean signals to those of real sensors |
//! | 1 | [`calibration`] | counts to estimates: curves, intervals, zeros, guided procedure |
//!
//! # Example
//!
//! ```
//! use palpate_sim::{run::SimRun, scene::Scene};
//! use palpate_tactile::{PressureArea, SensorLayout, Sensors};
//!
//! let scene = Scene::default();
//! let frame = SimRun::new(&scene, None).0.first_look();
//! let sensors = Sensors::new(&SensorLayout::named("C6+F")?, &scene.gripper, PressureArea::Participation)?;
//! let values = sensors.read(&frame);
//! assert_eq!(sensors.channels()[0].name(), "curvature_left_proximal");
//! assert_eq!(values[0], Some(0.0)); // a straight finger
//! # Ok::<(), palpate_tactile::LayoutError>(())
//! ```

pub mod board;
pub mod cadence;
pub mod calibration;
pub mod capture;
mod curvature;
pub mod electronics;
mod layout;
pub mod model;
mod pressure;
mod signals;
pub mod trial;

pub use curvature::curvature;
pub use layout::{
    CATALOGUE, Channel, CurvatureSplit, LayoutError, PressureSplit, Quantity, SensorLayout, Span, whole_fingers,
};
pub use pressure::{ContactPatch, PressureArea};
pub use signals::Signals;

use palpate_sim::frame::Frame;
use palpate_sim::gripper::{BentFinger, GripperModel, Side, TaxelGrid};

/// A layout on a gripper, ready to read frames.
#[derive(Clone, Debug)]
pub struct Sensors {
    channels: Vec<Channel>,
    finger: palpate_sim::gripper::Finger,
    grid: TaxelGrid,
    area: PressureArea,
}

impl Sensors {
    /// Places a layout on a gripper. `area` selects the area of pressure.
    pub fn new(layout: &SensorLayout, gripper: &GripperModel, area: PressureArea) -> Result<Self, LayoutError> {
        Ok(Self::of(layout.channels(gripper)?, gripper, area))
    }

    /// Reads these channels of a gripper.
    pub fn of(channels: Vec<Channel>, gripper: &GripperModel, area: PressureArea) -> Self {
        Self { channels, finger: gripper.finger.clone(), grid: gripper.taxels(), area }
    }

    /// Layout C1+F, which suits any gripper.
    pub fn whole_fingers(gripper: &GripperModel) -> Self {
        let (finger, grid) = (gripper.finger.clone(), gripper.taxels());
        Self { channels: whole_fingers(), finger, grid, area: PressureArea::Participation }
    }

    /// Adds channels that it lacks, after those it has.
    pub fn add(&mut self, channels: &[Channel]) {
        for channel in channels {
            if !self.channels.contains(channel) {
                self.channels.push(channel.clone());
            }
        }
    }

    /// The channels, in the order in which [`Sensors::read`] gives values.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// One value per channel, in the channel's unit; `None` where a pressure is undefined because the contact spans
    /// no area (only with [`PressureArea::Hull`]).
    pub fn read(&self, frame: &Frame) -> Vec<Option<f64>> {
        let bent = Side::BOTH.map(|side| BentFinger::new(&self.finger, frame.joints(side)));
        self.channels
            .iter()
            .map(|channel| match channel.quantity {
                Quantity::Curvature => {
                    Some(curvature(&bent[channel.side.index()], frame.joints(channel.side), &channel.span))
                }
                Quantity::Pressure => self.patch(frame, channel).pressure(self.area),
                Quantity::Force => Some(self.patch(frame, channel).force()),
            })
            .collect()
    }

    /// Reads the frames of a trial. Where a pressure is undefined it counts as none.
    pub fn signals(&self, frames: &[Frame]) -> Signals {
        let channels = self.channels.iter().map(Channel::name).collect();
        let mut signals = Signals { channels, ..Signals::default() };
        for frame in frames {
            let row: Vec<f32> = self.read(frame).into_iter().map(|v| v.unwrap_or_default() as f32).collect();
            signals.push(frame.t, &row);
        }
        signals
    }

    fn patch(&self, frame: &Frame, channel: &Channel) -> ContactPatch {
        ContactPatch::new(frame, channel.side, &self.grid, &channel.span)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_sim::frame::TaxelLoad;
    use palpate_sim::gripper::Phase;

    #[test]
    fn a_frame_is_read_channel_by_channel() {
        let gripper = GripperModel::default();
        let layout = SensorLayout::named("C6+F").expect("in the catalogue");
        let sensors = Sensors::new(&layout, &gripper, PressureArea::Participation).expect("fits");
        let frame = Frame {
            sample: 0,
            t: 0.0,
            line_bar: 0.5,
            phase: Phase::Close,
            q: [vec![0.05; 10], vec![0.0; 10]].concat(),
            sways: [palpate_sim::gripper::Sway::NONE; 2],
            hand: glam::DVec3::ZERO,
            world_from_object: None,
            // One taxel on the distal half of the right pad.
            taxels: vec![TaxelLoad { taxel: 160 + 150, normal: 0.2, along: 0.0, across: 0.0 }],
        };
        let values = sensors.read(&frame);
        let value = |name: &str| {
            let at = sensors.channels().iter().position(|c| c.name() == name).expect(name);
            values[at].expect("defined")
        };
        assert!((value("curvature_left_proximal") - 5.0).abs() < 1e-2);
        assert_eq!(value("curvature_right_distal"), 0.0);
        assert_eq!(value("pressure_right_proximal"), 0.0);
        let area = gripper.taxels().area();
        assert!((value("pressure_right_distal") - f64::from(0.2f32) / area).abs() < 1e-6);
        assert!((value("force_right_distal") - 0.2).abs() < 1e-6);
        assert_eq!(value("force_left_distal"), 0.0);
    }
}
