//! Tactile signals: frames of a simulation or counts of a board in, channels of curvature, pressure and force out.
//!
//! # Terms
//!
//! A **layout** (C1 .. C8) places curvature and pressure sensors on the fingers; each gives a **channel**, whose
//! **signal** is what a part of a real gripper measures, or a quantity that only simulations have
//! ([`SignalDefinition`]). Channels over time are [`Signals`]. A real **board** sends **readings**: counts of its
//! converter. A **calibration** of each part turns counts into angle, curvature, force and pressure; a **zero** (tare)
//! removes drift. Trials keep raw data, so that any layout and calibration can be applied later.
//!
//! # Modules, lowest layer first
//!
//! A module imports only from lower layers.
//!
//! | layer | module | holds |
//! |---|---|---|
//! | 0 | [`cadence`], [`capture`] | timing statistics of a stream, file format of captured bytes |
//! | 0 | [`electronics`] | strip, pad, divider and converter |
//! | 0 | `unit` | units of readings, and their factors |
//! | 0 | `signals` | channels over time |
//! | 1 | `sensor_list` | sensors of a gripper, and the file that describes them |
//! | 2 | [`board`] | readings and gaps of a board |
//! | 2 | `layout` | sensor layouts, their channels and the definition of their signals |
//! | 3 | `column` | names of channels with units |
//! | 3 | [`trial`] | recorded grasps: header, and simulated, recorded or imported data |
//! | 3 | `curvature`, `pressure` | bend under a strip, circle fit along a finger; load and contact patch of a pad |
//! | 3 | [`model`] | sensor models: clean signals to those of real sensors |
//! | 3 | [`calibration`] | counts to estimates: curves, intervals, zeros, guided procedure |
//!
//! # Example
//!
//! ```
//! use palpate_sim::{run::SimRun, scene::Scene};
//! use palpate_tactile::{SensorLayout, Sensors, SignalDefinition};
//!
//! let scene = Scene::default();
//! let frame = SimRun::new(&scene, None).0.first_look();
//! let sensors = Sensors::new(&SensorLayout::named("C6")?, &scene.gripper, SignalDefinition::Parts)?;
//! let values = sensors.read(&frame);
//! assert_eq!(sensors.channels()[0].name(), "curvature_left_proximal");
//! assert_eq!(values[0], Some(0.0)); // a straight finger
//! # Ok::<(), palpate_tactile::LayoutError>(())
//! ```

pub mod board;
pub mod cadence;
pub mod calibration;
pub mod capture;
mod column;
mod curvature;
pub mod electronics;
mod layout;
pub mod model;
mod pressure;
mod sensor_list;
mod signals;
pub mod trial;
mod unit;

pub use column::{channel_with_unit, unit_of_channel};
pub use curvature::{curvature, strip_curvature};
pub use layout::{
    CATALOGUE, Channel, CurvatureSplit, LayoutError, PressureSplit, Quantity, SensorLayout, SignalDefinition, Span,
    whole_fingers,
};
pub use pressure::ContactPatch;
pub use signals::{SignalGap, Signals};
pub use unit::{Dimension, KNOWN_UNITS, Unit};

use board::Measures;
use glam::DVec3;
use palpate_geometry::Pose;
use palpate_sim::frame::Frame;
use palpate_sim::gripper::{BentFinger, GripperModel, Side, TaxelGrid};

/// A layout on a gripper, ready to read frames.
#[derive(Clone, Debug)]
pub struct Sensors {
    channels: Vec<Channel>,
    finger: palpate_sim::gripper::Finger,
    /// Beginning and end of the strips, from the palm (m).
    strip: [f64; 2],
    grid: TaxelGrid,
    /// The palm, in the world (m).
    palm: DVec3,
}

impl Sensors {
    /// Places a layout on a gripper.
    pub fn new(layout: &SensorLayout, gripper: &GripperModel, signals: SignalDefinition) -> Result<Self, LayoutError> {
        Ok(Self::of(layout.channels(gripper, signals)?, gripper))
    }

    /// Reads these channels of a gripper.
    pub fn of(channels: Vec<Channel>, gripper: &GripperModel) -> Self {
        let (finger, strip) = (gripper.finger.clone(), gripper.strip.reach(&gripper.finger));
        Self { channels, finger, strip, grid: gripper.taxels(), palm: DVec3::ZERO }
    }

    /// With the palm at a place in the world (m), which the distance of the object is taken from.
    #[must_use]
    pub fn with_palm(self, palm: DVec3) -> Self {
        Self { palm, ..self }
    }

    /// Curvature, pressure and force of each finger, which suits any gripper.
    pub fn whole_fingers(gripper: &GripperModel, signals: SignalDefinition) -> Self {
        Self::of(whole_fingers(signals), gripper)
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
    /// no area (only with [`SignalDefinition::Hull`]).
    pub fn read(&self, frame: &Frame) -> Vec<Option<f64>> {
        let bent = Side::BOTH.map(|side| BentFinger::new(&self.finger, frame.joints(side)));
        let value = |channel: &Channel| {
            if let Quantity::Raw { measures, .. } = channel.quantity {
                return self.raw(frame, measures?);
            }
            let side = channel.side()?;
            match (channel.quantity, channel.signals) {
                (Quantity::Curvature, SignalDefinition::Parts) => {
                    Some(strip_curvature(frame.joints(side), self.finger.length, self.strip_over(&channel.span)))
                }
                (Quantity::Curvature, _) => Some(curvature(&bent[side.index()], frame.joints(side), &channel.span)),
                (Quantity::Pressure | Quantity::ContactPressure, signals) => {
                    self.patch(frame, side, channel).pressure(signals)
                }
                (Quantity::Force, _) => Some(self.patch(frame, side, channel).force()),
                (Quantity::Raw { .. }, _) => None,
            }
        };
        self.channels.iter().map(value).collect()
    }

    /// What a raw sensor measures: Pa, or m, at most the length of a finger.
    fn raw(&self, frame: &Frame, measures: Measures) -> Option<f64> {
        let palm = self.palm + frame.hand;
        Some(match measures {
            Measures::ChamberPressure => frame.line_bar * PASCAL_PER_BAR,
            Measures::PalmDistance => {
                let distance = |pose: Pose| (pose.position - palm).length();
                frame.world_from_object.map_or(self.finger.length, distance).min(self.finger.length)
            }
        })
    }

    /// Beginning and end of a channel's sensor, along the finger from the palm (m).
    pub fn stretch(&self, channel: &Channel) -> [f64; 2] {
        match channel.quantity {
            Quantity::Curvature => self.strip_over(&channel.span),
            Quantity::Pressure | Quantity::ContactPressure | Quantity::Force | Quantity::Raw { .. } => {
                let (from, to) = channel.span.ends();
                [from, to].map(|share| share * self.finger.length)
            }
        }
    }

    /// Reach of the strip of a stretch, from the palm (m): the gripper's own on a whole finger, else all of the stretch.
    fn strip_over(&self, span: &Span) -> [f64; 2] {
        let (from, to) = span.ends();
        if *span == Span::WHOLE { self.strip } else { [from, to].map(|share| share * self.finger.length) }
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

    fn patch(&self, frame: &Frame, side: Side, channel: &Channel) -> ContactPatch {
        ContactPatch::new(frame, side, &self.grid, &channel.span)
    }
}

/// Pascal in a bar.
const PASCAL_PER_BAR: f64 = 1e5;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::electronics::PadPart;
    use palpate_sim::frame::TaxelLoad;
    use palpate_sim::gripper::{Auto, Phase, Strip};

    fn frame(q: Vec<f64>, taxels: Vec<TaxelLoad>) -> Frame {
        Frame {
            sample: 0,
            t: 0.0,
            line_bar: 0.5,
            phase: Phase::Close,
            q,
            sways: [palpate_sim::gripper::Sway::NONE; 2],
            hand: glam::DVec3::ZERO,
            world_from_object: None,
            taxels,
        }
    }

    #[test]
    fn a_frame_is_read_channel_by_channel() {
        let gripper = GripperModel::default();
        let layout = SensorLayout::named("C6+F").expect("in the catalogue");
        let sensors = Sensors::new(&layout, &gripper, SignalDefinition::Contact).expect("fits");
        let parts = Sensors::new(&layout, &gripper, SignalDefinition::Parts).expect("fits");
        // One taxel on the distal half of the right pad.
        let load = TaxelLoad { taxel: 160 + 150, normal: 0.2, along: 0.0, across: 0.0 };
        let frame = frame([vec![0.05; 10], vec![0.0; 10]].concat(), vec![load]);
        let value = |sensors: &Sensors, name: &str| {
            let at = sensors.channels().iter().position(|c| c.name() == name).expect(name);
            sensors.read(&frame)[at].expect("defined")
        };
        let area = gripper.taxels().area();
        assert!((value(&sensors, "curvature_left_proximal") - 5.0).abs() < 1e-2);
        assert_eq!(value(&sensors, "contact_pressure_right_proximal"), 0.0);
        assert!((value(&sensors, "contact_pressure_right_distal") - f64::from(0.2f32) / area).abs() < 1e-6);
        assert!((value(&parts, "curvature_left_proximal") - 5.0).abs() < 1e-12);
        assert_eq!(value(&parts, "pressure_right_proximal"), 0.0);
        assert!((value(&parts, "pressure_right_distal") * PadPart::ACTIVE_AREA - f64::from(0.2f32)).abs() < 1e-12);
        for sensors in [&sensors, &parts] {
            assert_eq!(value(sensors, "curvature_right_distal"), 0.0);
            assert!((value(sensors, "force_right_distal") - 0.2).abs() < 1e-6);
            assert_eq!(value(sensors, "force_left_distal"), 0.0);
        }
    }

    #[test]
    fn a_strip_reads_where_the_scene_has_it() {
        let mut gripper = GripperModel::default();
        let q = [0.0, 0.0, 0.0, 0.0, 0.1, 0.1, 0.1, 0.2, 0.2, 0.2];
        let read = |gripper: &GripperModel| {
            let sensors = Sensors::whole_fingers(gripper, SignalDefinition::Parts);
            sensors.read(&frame([q; 2].concat(), Vec::new()))[0].expect("always defined")
        };
        // 22.23 to 77.6 mm: three segments of 0.1 rad and 7.6 mm of one of 0.2 rad.
        assert!((read(&gripper) - (0.3 + 0.2 * 0.76) / Strip::ACTIVE_LENGTH).abs() < 1e-9);
        gripper.strip.from_m = Auto::Value(0.04);
        assert!((read(&gripper) - (0.3 + 0.2 * 2.537) / Strip::ACTIVE_LENGTH).abs() < 1e-9);
        gripper.strip = Strip { from_m: Auto::Auto, length_m: Auto::Value(0.1) };
        assert!((read(&gripper) - 9.0).abs() < 1e-9);
    }
}
