//! The sensor chain of one trial, channel by channel.

use super::flex::ReadStrip;
use super::force_pad::{PadRange, ReadPad};
use super::physical_like::PhysicalLike;
use super::sampling::{Trace, instants};
use super::stepping::stepped;
use super::streams::Streams;
use crate::Signals;

impl PhysicalLike {
    /// Readings of a grasp from its clean signals, at 50 Hz and always finite. `seed` identifies the
    /// grasp. Channels are identified by their names; one that is neither curvature, pressure nor force is read
    /// without a sensor.
    pub fn apply(&self, clean: &Signals, seed: u64) -> Signals {
        let instants = instants(clean, self.jitter, seed);
        let width = clean.channels.len();
        let mut values = vec![0.0; instants.len() * width];
        for (column, channel) in clean.channels.iter().enumerate() {
            let trace = Trace::new(clean, column);
            let mut sensor = Sensor::new(self, Streams { gripper: self.gripper, trial: seed, channel });
            for (instant, row) in instants.iter().zip(values.chunks_exact_mut(width)) {
                let stimulus =
                    if self.stepping { stepped(trace, instants[0].t, instant.taken) } else { trace.at(instant.taken) };
                row[column] = finite(sensor.read(stimulus));
            }
        }
        Signals { channels: clean.channels.clone(), t_s: instants.iter().map(|i| i.t).collect(), values }
    }
}

/// A sensor of either kind, or none.
enum Sensor {
    Strip(ReadStrip),
    Pad(ReadPad),
    None,
}

impl Sensor {
    /// The sensor for a channel's name, as in `curvature_left_distal`.
    fn new(settings: &PhysicalLike, streams: Streams<'_>) -> Self {
        let mut words = streams.channel.split('_');
        let quantity = words.next();
        let side = usize::from(words.next() == Some("right"));
        match quantity {
            Some("curvature") => Self::Strip(ReadStrip::new(settings, side, streams)),
            Some("force") => Self::Pad(ReadPad::new(settings, PadRange::force(settings), side, streams)),
            Some("pressure") => Self::Pad(ReadPad::new(settings, PadRange::pressure(settings), side, streams)),
            _ => Self::None,
        }
    }

    fn read(&mut self, stimulus: f64) -> f64 {
        match self {
            Self::Strip(strip) => strip.read(stimulus),
            Self::Pad(pad) => pad.read(stimulus),
            Self::None => stimulus,
        }
    }
}

/// The nearest number a file can hold; none becomes 0.
fn finite(value: f64) -> f32 {
    if value.is_nan() { 0.0 } else { value.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32 }
}
