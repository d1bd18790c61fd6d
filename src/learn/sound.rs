//! What the channels of a sound gripper tell of each other, learned from sound grasps: what each should read beside the others,
//! which stands in for a sensor that failed; and how far a finger is held back while its pad feels nothing, which a dead pad
//! exceeds.
//!
//! ```text
//!   u = asinh(x / scale)                  linear below the scale of a channel, logarithmic above
//!   u_k = w_k . (1, v, v v)               v: u of the other channels, and the line pressure; all products of two (ridge regression)
//!   held back = f . (1, p, p p) - kappa   f: curvature of fingers that touch nothing, by line pressure
//! ```
//!
//! Only grasps in which another pad is loaded count for the second: an object that one finger alone touches leaves the other
//! free to bend.

use crate::arrays::{Arrays, ModelError};
use crate::data::Sequence;
use crate::tensor_file::{self, TensorFile};
use serde::{Deserialize, Serialize};

/// Time for which a finger must be held back (s).
pub const SOUND_WINDOW_S: f32 = 0.3;
/// Share of sound grasps in which a finger is held back further than the limit.
const OUTSIDE: f64 = 0.0005;
/// Margin of the limit beyond the grasps that it was found from.
const MARGIN: f32 = 1.05;
/// Reading of a pad, over its scale, below which it feels nothing: 0.2 N of a pad of the paper, its threshold.
const IDLE: f32 = 0.6;
/// Beginnings of the names of pads and strips; the same finger follows.
const PAD: &str = "pressure_";
const STRIP: &str = "curvature_";
/// Ridge: weight of the squared weights per reading.
const RIDGE: f64 = 1e-4;

const WEIGHTS: &str = "weights";
const SCALES: &str = "scales";
const RANGES: &str = "ranges";
const FREE: &str = "free";
const LIMIT: &str = "limit";

/// Predictors of the channels from each other.
#[derive(Clone, Debug, PartialEq)]
pub struct SoundChannels {
    card: SoundCard,
    /// Reading of each channel from which it is logarithmic.
    scales: Vec<f32>,
    /// `[channels][terms]`.
    weights: Vec<f32>,
    /// Least and largest sound reading, `[channels][2]`.
    ranges: Vec<f32>,
    /// Coefficients of the curvature of free fingers.
    free: Vec<f32>,
    /// How far a finger is held back at most while its pad feels nothing (1/m).
    limit: f32,
}

/// Card of the file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct SoundCard {
    channels: Vec<String>,
    /// Where the grasps come from.
    about: String,
}

/// Number of terms for so many variables.
fn terms(variables: usize) -> usize {
    1 + variables + variables * (variables + 1) / 2
}

impl SoundChannels {
    /// The shipped ones: curvature and pressure of whole fingers.
    pub fn shipped() -> Result<Self, ModelError> {
        Self::from_bytes("models/sound.safetensors", include_bytes!("../../models/sound.safetensors"))
    }

    /// Fits them to sound grasps, whose rows hold the channels and then the line pressure (bar). `scales` has the reading of
    /// each channel from which it is logarithmic.
    pub fn fit(channels: &[String], scales: &[f32], grasps: &[Sequence], about: String) -> Self {
        let count = channels.len();
        let mut own = Self {
            card: SoundCard { channels: channels.to_vec(), about },
            scales: scales.to_vec(),
            weights: Vec::new(),
            ranges: Vec::new(),
            free: Vec::new(),
            limit: f32::INFINITY,
        };
        let rows = || grasps.iter().flat_map(|grasp| grasp.rows().map(|(_, row)| (&row[..count], row[count])));
        for channel in 0..count {
            let readings = || rows().map(|(row, _)| row[channel]);
            own.ranges.extend([readings().fold(f32::INFINITY, f32::min), readings().fold(f32::NEG_INFINITY, f32::max)]);
            let mut normal = NormalEquations::new(terms(count));
            rows().for_each(|(row, line)| normal.add(&own.variables(channel, row, line), own.level(channel, row)));
            own.weights.extend(normal.solved());
        }
        let fingers: Vec<[usize; 2]> = (0..count).filter_map(|pad| Some([pad, own.strip_of(pad)?])).collect();
        let mut normal = NormalEquations::new(3);
        for (row, line) in rows().filter(|(row, _)| fingers.iter().all(|[pad, _]| own.is_idle(*pad, row))) {
            fingers.iter().for_each(|[_, strip]| normal.add(&[1.0, line, line * line], row[*strip]));
        }
        own.free = normal.solved();
        let most = |grasp: &Sequence| {
            let held = |pad: usize| {
                let back =
                    |(t, row): (f32, &[f32])| (t, own.held_back(pad, &row[..count], row[count]).unwrap_or(f32::MIN));
                lasting(&grasp.rows().map(back).collect::<Vec<_>>(), SOUND_WINDOW_S)
            };
            fingers.iter().map(|[pad, _]| held(*pad)).fold(f32::MIN, f32::max)
        };
        let mut all: Vec<f32> = grasps.iter().map(most).collect();
        all.sort_by(f32::total_cmp);
        let place = ((1.0 - OUTSIDE) * all.len() as f64) as usize;
        own.limit = MARGIN * all.get(place.min(all.len().saturating_sub(1))).copied().unwrap_or(0.0).max(0.0);
        own
    }

    /// Names of the channels.
    pub fn channels(&self) -> &[String] {
        &self.card.channels
    }

    /// What a channel should read beside the others of a row, at a line pressure (bar); its own reading is not looked at.
    pub fn foretold(&self, channel: usize, row: &[f32], line_bar: f32) -> f32 {
        let reading = self.scales[channel] * self.foretold_level(channel, row, line_bar).sinh();
        reading.clamp(self.ranges[2 * channel], self.ranges[2 * channel + 1])
    }

    /// True where a pad feels nothing, though its finger is held back further than in sound grasps while another pad is loaded.
    pub fn is_silent(&self, channel: usize, row: &[f32], line_bar: f32) -> bool {
        self.held_back(channel, row, line_bar).is_some_and(|back| back > self.limit)
    }

    /// How much less the finger of an idle pad is bent than a free one (1/m), while another pad is loaded.
    fn held_back(&self, pad: usize, row: &[f32], line_bar: f32) -> Option<f32> {
        let strip = self.strip_of(pad).filter(|_| self.is_idle(pad, row))?;
        let is_loaded = |other: usize| self.strip_of(other).is_some() && !self.is_idle(other, row);
        let free: f32 = self.free.iter().zip([1.0, line_bar, line_bar * line_bar]).map(|(f, p)| f * p).sum();
        (0..row.len()).any(is_loaded).then(|| free - row[strip])
    }

    /// The strip on the finger of a pad.
    fn strip_of(&self, pad: usize) -> Option<usize> {
        let finger = self.card.channels.get(pad)?.strip_prefix(PAD)?;
        self.card.channels.iter().position(|own| own.strip_prefix(STRIP) == Some(finger))
    }

    fn is_idle(&self, pad: usize, row: &[f32]) -> bool {
        row[pad] < IDLE * self.scales[pad]
    }

    fn level(&self, channel: usize, row: &[f32]) -> f32 {
        (row[channel] / self.scales[channel]).asinh()
    }

    fn foretold_level(&self, channel: usize, row: &[f32], line_bar: f32) -> f32 {
        let count = terms(self.card.channels.len());
        let weights = &self.weights[channel * count..][..count];
        weights.iter().zip(self.variables(channel, row, line_bar)).map(|(weight, term)| weight * term).sum()
    }

    /// Terms of the regression of a channel.
    fn variables(&self, channel: usize, row: &[f32], line_bar: f32) -> Vec<f32> {
        let others = (0..self.card.channels.len()).filter(|other| *other != channel);
        let v: Vec<f32> = others.map(|other| self.level(other, row)).chain([line_bar]).collect();
        let products = (0..v.len()).flat_map(|a| (a..v.len()).map(move |b| (a, b))).map(|(a, b)| v[a] * v[b]);
        [1.0].into_iter().chain(v.iter().copied()).chain(products).collect()
    }

    /// Encodes them as a safetensors file.
    pub fn to_bytes(&self) -> Result<Vec<u8>, ModelError> {
        let mut arrays = Arrays::default();
        let count = self.card.channels.len();
        arrays.put(SCALES, &[count], self.scales.clone());
        arrays.put(WEIGHTS, &[count, terms(count)], self.weights.clone());
        arrays.put(RANGES, &[count, 2], self.ranges.clone());
        arrays.put(FREE, &[3], self.free.clone());
        arrays.put(LIMIT, &[1], vec![self.limit]);
        let card = serde_json::to_string(&self.card).map_err(ModelError::failed)?;
        tensor_file::encode(card, &arrays).map_err(ModelError)
    }

    /// Decodes them. `name` is the file name in errors.
    pub fn from_bytes(name: &str, bytes: &[u8]) -> Result<Self, ModelError> {
        let malformed = |cause: String| ModelError::malformed(name, cause);
        let file = TensorFile::decode(bytes).map_err(malformed)?;
        let card: SoundCard = serde_json::from_str(&file.card).map_err(|cause| malformed(cause.to_string()))?;
        let (arrays, count) = (file.arrays()?, card.channels.len());
        let of = |array: &str, shape: &[usize]| arrays.f32s(array, shape).map(<[f32]>::to_vec);
        let own = Self {
            scales: of(SCALES, &[count])?,
            weights: of(WEIGHTS, &[count, terms(count)])?,
            ranges: of(RANGES, &[count, 2])?,
            free: of(FREE, &[3])?,
            limit: arrays.f32s(LIMIT, &[1])?[0],
            card,
        };
        let is_sound =
            own.scales.iter().all(|scale| *scale > 0.0) && own.ranges.as_chunks::<2>().0.iter().all(|[a, b]| a <= b);
        if is_sound { Ok(own) } else { Err(ModelError::card("the range of its channels")) }
    }
}

/// Largest value that all readings of some window of this length (s) reach; without such a window, the least number.
fn lasting(readings: &[(f32, f32)], seconds: f32) -> f32 {
    let from = |first: usize| {
        let until = readings[first].0 + seconds;
        let end = readings[first..].iter().position(|(t, _)| *t >= until)?;
        readings[first..=first + end].iter().map(|(_, off)| *off).min_by(f32::total_cmp)
    };
    (0..readings.len()).filter_map(from).max_by(f32::total_cmp).unwrap_or(f32::NEG_INFINITY)
}

/// Normal equations of a ridge regression: (X'X + n r I) w = X'y.
struct NormalEquations {
    size: usize,
    /// X'X, row-major.
    matrix: Vec<f64>,
    right: Vec<f64>,
    count: f64,
}

impl NormalEquations {
    fn new(size: usize) -> Self {
        Self { size, matrix: vec![0.0; size * size], right: vec![0.0; size], count: 0.0 }
    }

    fn add(&mut self, terms: &[f32], value: f32) {
        self.count += 1.0;
        for (a, x) in terms.iter().enumerate() {
            self.right[a] += f64::from(*x) * f64::from(value);
            for (b, y) in terms.iter().enumerate() {
                self.matrix[a * self.size + b] += f64::from(*x) * f64::from(*y);
            }
        }
    }

    /// By Gaussian elimination, which needs no pivots in a positive definite matrix.
    fn solved(mut self) -> Vec<f32> {
        let n = self.size;
        (0..n).for_each(|a| self.matrix[a * n + a] += RIDGE * self.count.max(1.0));
        for a in 0..n {
            for b in a + 1..n {
                let share = self.matrix[b * n + a] / self.matrix[a * n + a];
                (a..n).for_each(|c| self.matrix[b * n + c] -= share * self.matrix[a * n + c]);
                self.right[b] -= share * self.right[a];
            }
        }
        for a in (0..n).rev() {
            let known: f64 = (a + 1..n).map(|c| self.matrix[a * n + c] * self.right[c]).sum();
            self.right[a] = (self.right[a] - known) / self.matrix[a * n + a];
        }
        self.right.into_iter().map(|weight| weight as f32).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two fingers that close until they touch at a curvature, after which pads are pressed by as much as fingers are held back.
    fn grasp(touch: f32) -> Sequence {
        let t_s: Vec<f32> = (0..120).map(|k| 0.02 * k as f32).collect();
        let row = |t: &f32| {
            let bar = (0.5 * t).min(1.0);
            let (kappa, wobble) = ((12.0 * bar).min(touch), 0.05 * (50.0 * t).sin());
            let pressure = 5e3 * (12.0 * bar - kappa);
            [kappa + wobble, kappa - wobble, pressure, 1.02 * pressure, bar]
        };
        Sequence { values: t_s.iter().flat_map(row).collect(), t_s }
    }

    #[test]
    fn a_dead_pad_is_told_from_a_free_finger_and_foretold_from_the_others() {
        let channels = ["curvature_left", "curvature_right", "pressure_left", "pressure_right"].map(str::to_owned);
        let grasps: Vec<Sequence> = (8..26).map(|k| grasp(0.5 * k as f32)).collect();
        let own = SoundChannels::fit(&channels, &[20.0, 20.0, 2e3, 2e3], &grasps, "made up".to_owned());
        let foretold = own.foretold(2, &[8.0, 8.0, f32::NAN, 2.04e4], 1.0);
        assert!((1.4e4..2.8e4).contains(&foretold), "{foretold}");
        let silent = |row: [f32; 4]| [2, 3].map(|pad| own.is_silent(pad, &row, 1.0));
        assert_eq!(silent([8.0, 8.0, 0.0, 2e4]), [true, false], "both fingers are held");
        assert_eq!(silent([12.5, 8.0, 0.0, 2e4]), [false; 2], "one finger alone touches something, the other is free");
        assert_eq!(silent([8.0, 8.0, 0.0, 0.0]), [false; 2], "both are slow, or too stiff");
        assert_eq!(silent([8.0, 8.0, 2e4, 2e4]), [false; 2]);
        let bytes = own.to_bytes().expect("finite");
        assert_eq!(SoundChannels::from_bytes("sound", &bytes), Ok(own));
        assert!(SoundChannels::from_bytes("sound", &bytes[..bytes.len() - 4]).is_err());
    }

    #[test]
    fn the_shipped_ones_are_whole() {
        assert!(SoundChannels::shipped().is_ok_and(|own| own.limit > 0.0 && own.channels().len() == 4));
    }

    #[test]
    fn what_lasts_is_the_least_of_a_window() {
        let readings = [(0.0, 1.0), (0.1, 5.0), (0.2, 4.0), (0.3, 6.0), (0.4, 0.0)];
        assert_eq!(lasting(&readings, 0.2), 4.0);
        assert_eq!(lasting(&readings, 0.0), 6.0);
        assert_eq!(lasting(&readings, 1.0), f32::NEG_INFINITY);
    }
}
