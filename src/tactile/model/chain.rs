//! The sensor chain of one trial, part by part.

use super::flex::ReadStrip;
use super::force_pad::ReadPad;
use super::physical_like::PhysicalLike;
use super::sampling::{Trace, instants};
use super::stepping::stepped;
use super::streams::Streams;
use crate::electronics::PadPart;
use crate::{Quantity, Signals};

impl PhysicalLike {
    /// Readings of a grasp from its clean signals, at 50 Hz and always finite. `seed` identifies the
    /// grasp. Channels are identified by their names: force and pressure of one place are two units of one pad's reading;
    /// one that no part measures is read without a sensor.
    pub fn apply(&self, clean: &Signals, seed: u64) -> Signals {
        let instants = instants(clean, self.jitter, seed);
        let width = clean.channels.len();
        let mut values = vec![0.0; instants.len() * width];
        for mut part in self.parts_of(&clean.channels, seed) {
            let trace = Trace::new(clean, part.from);
            let bend = part.bend.map(|column| Trace::new(clean, column));
            for (instant, row) in instants.iter().zip(values.chunks_exact_mut(width)) {
                let at = |trace: Trace<'_>| {
                    if self.stepping { stepped(trace, instants[0].t, instant.taken) } else { trace.at(instant.taken) }
                };
                let reading = part.sensor.read(at(trace) * part.scale, bend.map_or(0.0, at));
                for (column, unit) in &part.into {
                    row[*column] = finite(reading / unit);
                }
            }
        }
        Signals { channels: clean.channels.clone(), t_s: instants.iter().map(|i| i.t).collect(), values }
    }

    fn streams<'a>(&self, trial: u64, channel: &'a str) -> Streams<'a> {
        Streams { gripper: self.gripper, trial, channel }
    }

    /// The parts that measure these channels, each once.
    fn parts_of(&self, channels: &[String], seed: u64) -> Vec<Part> {
        let alone = |column: usize, sensor: Sensor| Part {
            sensor,
            from: column,
            scale: 1.0,
            bend: None,
            into: vec![(column, 1.0)],
        };
        let mut parts = Vec::new();
        for (column, channel) in channels.iter().enumerate() {
            let side = |place: &str| usize::from(place.starts_with("right"));
            parts.push(match Quantity::of_name(channel) {
                Some((Quantity::Curvature, place)) => {
                    alone(column, Sensor::Strip(ReadStrip::new(self, side(place), self.streams(seed, channel))))
                }
                Some((quantity @ (Quantity::Force | Quantity::Pressure), place)) => {
                    let [force, pressure] =
                        [Quantity::Force, Quantity::Pressure].map(|own| format!("{}_{place}", own.name()));
                    let at = |name: &String| channels.iter().position(|own| own == name);
                    let (force_at, pressure_at) = (at(&force), at(&pressure));
                    if quantity == Quantity::Pressure && force_at.is_some() {
                        continue; // the pad of the force column
                    }
                    let units = [(force_at, 1.0), (pressure_at, PadPart::ACTIVE_AREA)];
                    Part {
                        sensor: Sensor::Pad(ReadPad::new(self, side(place), self.streams(seed, &force))),
                        from: column,
                        scale: if quantity == Quantity::Pressure { PadPart::ACTIVE_AREA } else { 1.0 },
                        bend: self.drawn.then(|| curvature_of(channels, side(place))).flatten(),
                        into: units.into_iter().filter_map(|(column, unit)| Some((column?, unit))).collect(),
                    }
                }
                Some((Quantity::ContactPressure | Quantity::Raw { .. }, _)) | None => alone(column, Sensor::None),
            });
        }
        parts
    }
}

/// Column of the first strip on a finger.
fn curvature_of(channels: &[String], side: usize) -> Option<usize> {
    let finger = ["left", "right"][side];
    channels.iter().position(|channel| {
        Quantity::of_name(channel).is_some_and(|(own, place)| own == Quantity::Curvature && place.starts_with(finger))
    })
}

/// A part at work: it reads one column and fills one or two.
struct Part {
    sensor: Sensor,
    /// Column of its stimulus.
    from: usize,
    /// Stimulus per value of that column.
    scale: f64,
    /// Column of the curvature that it answers to as well.
    bend: Option<usize>,
    /// Columns of its reading, each with the reading's size of one of its units.
    into: Vec<(usize, f64)>,
}

/// A sensor of either kind, or none.
enum Sensor {
    Strip(ReadStrip),
    Pad(ReadPad),
    None,
}

impl Sensor {
    /// Reading of a stimulus on a finger of this curvature (1/m).
    fn read(&mut self, stimulus: f64, kappa: f64) -> f64 {
        match self {
            Self::Strip(strip) => strip.read(stimulus),
            Self::Pad(pad) => pad.read(stimulus, kappa),
            Self::None => stimulus,
        }
    }
}

/// The nearest number a file can hold; none becomes 0.
fn finite(value: f64) -> f32 {
    if value.is_nan() { 0.0 } else { value.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32 }
}
