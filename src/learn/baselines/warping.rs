//! Nearest neighbours by dynamic time warping (Sakoe and Chiba 1978): sequences are compared after stretching time,
//! within a band, so that they match best.

use crate::arrays::{Arrays, ModelError, check_each};
use crate::data::{Dataset, Sequence};
use crate::fitting::{Fitting, LearnError, check_enough};
use crate::mirror::mirror;
use crate::model::ModelCard;
use crate::network::Preparation;
use crate::pmf::Pmf;
use crate::recogniser::{Recogniser, Verdict};
use serde::{Deserialize, Serialize};

/// Number of neighbours that vote.
const VOTERS: usize = 5;
/// Rate at which sequences are compared (Hz); the cost grows with its square.
const RATE_HZ: f32 = 8.0;
/// Largest shift between two sequences (steps).
const BAND: usize = 3;
/// Largest number of values of a sequence in a file; sums of it must not overflow.
const MOST_VALUES: usize = 1 << 30;

/// Training sequences, prepared and labelled.
#[derive(Clone, Debug)]
pub(crate) struct Warping {
    learned: Learned,
    classes: usize,
    /// `[steps][channels]` each.
    sequences: Vec<Vec<f32>>,
    labels: Vec<usize>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Learned {
    preparation: Preparation,
    mirror: Option<Vec<usize>>,
    voters: usize,
    band: usize,
}

impl Warping {
    /// Stores all grasps as neighbours.
    pub(crate) fn fit(data: &Dataset, fitting: &Fitting<'_>) -> Result<Self, LearnError> {
        check_enough(data, 1)?;
        fitting.refuse_settings()?;
        let preparation = Preparation::fit(data, RATE_HZ);
        let sequences = data.examples.iter().map(|e| scaled(&preparation, &e.grasp)).collect();
        let mirror = mirror(&data.channels);
        let learned = Learned { preparation, mirror, voters: VOTERS, band: BAND };
        (fitting.progress)(1.0);
        Ok(Self { learned, classes: data.labels.classes.len(), sequences, labels: data.truth() })
    }

    /// Everything that decides a fit.
    pub(crate) fn decided_by() -> serde_json::Value {
        serde_json::json!({ "voters": VOTERS, "rate_hz": RATE_HZ, "band": BAND, "revision": 1 })
    }

    /// Restores a recogniser from a model file.
    pub(crate) fn load(card: &ModelCard, arrays: &Arrays) -> Result<Self, ModelError> {
        let learned: Learned = card.settings_as()?;
        let (channels, classes) = (card.channels.len(), card.labels.classes.len());
        if !learned.preparation.is_sound(channels) {
            return Err(ModelError::card("the input scaling"));
        }
        let mirrored = learned.mirror.as_ref().is_none_or(|m| m.len() == channels && m.iter().all(|to| *to < channels));
        if !mirrored || !(1..=1000).contains(&learned.voters) || learned.band > 10_000 {
            return Err(ModelError::card("the definition of neighbours"));
        }
        let labels = arrays.indices("labels", classes, "a class")?;
        arrays.require("lengths", &[labels.len()], "labels")?;
        let values = arrays.f32_vector("values")?;
        let lengths = arrays.indices("lengths", MOST_VALUES, "a length")?;
        check_each("lengths", &lengths, "a multiple of the number of channels", |length| length % channels == 0)?;
        arrays.require("values", &[lengths.iter().sum()], "lengths")?;
        let mut rest = values;
        let sequence = |length: usize| {
            let (sequence, after) = rest.split_at(length);
            rest = after;
            sequence.to_vec()
        };
        let sequences = lengths.into_iter().map(sequence).collect();
        Ok(Self { learned, classes, sequences, labels })
    }

    fn distances(&self, sequence: &[f32]) -> Vec<f32> {
        let channels = self.learned.preparation.scales.len();
        self.sequences.iter().map(|own| warped_distance(own, sequence, channels, self.learned.band)).collect()
    }
}

/// Scaled values at even steps, `[steps][channels]`, without the deviations from the mean course, which are tied to time.
fn scaled(preparation: &Preparation, grasp: &Sequence) -> Vec<f32> {
    let (width, channels) = (preparation.width(), preparation.scales.len());
    preparation.inputs(grasp).chunks_exact(width.max(1)).flat_map(|row| row[..channels].to_vec()).collect()
}

/// Smallest sum of squared distances along a warping path through two sequences, `[steps][channels]` each.
fn warped_distance(a: &[f32], b: &[f32], channels: usize, band: usize) -> f32 {
    let (rows, columns) = (a.len() / channels.max(1), b.len() / channels.max(1));
    if rows == 0 || columns == 0 {
        return f32::MAX;
    }
    // Sequences of different lengths need a band at least as wide as they differ.
    let band = band.max(rows.abs_diff(columns));
    let mut before = vec![f32::INFINITY; columns + 1];
    before[0] = 0.0;
    for i in 0..rows {
        let mut now = vec![f32::INFINITY; columns + 1];
        let x = &a[i * channels..(i + 1) * channels];
        for j in i.saturating_sub(band)..(i + band + 1).min(columns) {
            let y = &b[j * channels..(j + 1) * channels];
            let step: f32 = x.iter().zip(y).map(|(x, y)| (x - y) * (x - y)).sum();
            now[j + 1] = step + before[j].min(before[j + 1]).min(now[j]);
        }
        before = now;
    }
    before[columns]
}

impl Recogniser for Warping {
    fn recognise(&self, grasp: &Sequence, before: Option<&Pmf>) -> Verdict {
        let sequence = scaled(&self.learned.preparation, grasp);
        let mut distances = self.distances(&sequence);
        if let Some(mirror) = &self.learned.mirror {
            let exchanged: Vec<f32> =
                sequence.chunks_exact(mirror.len().max(1)).flat_map(|row| mirror.iter().map(|m| row[*m])).collect();
            let others = self.distances(&exchanged);
            distances.iter_mut().zip(others).for_each(|(d, other)| *d = d.min(other));
        }
        let mut order: Vec<usize> = (0..distances.len()).collect();
        order.sort_by(|a, b| distances[*a].total_cmp(&distances[*b]));
        let mut votes = vec![0.0; self.classes];
        for k in order.into_iter().take(self.learned.voters) {
            votes[self.labels[k]] += 1.0 / f64::from(distances[k]).sqrt().max(1e-6);
        }
        let pmf = Pmf::from_weights(votes);
        Verdict { pmf: before.map_or_else(|| pmf.clone(), |before| before.times(&pmf)), properties: None }
    }

    fn arrays(&self) -> Arrays {
        let mut arrays = Arrays::default();
        arrays.put_integers("labels", self.labels.iter().copied());
        arrays.put_integers("lengths", self.sequences.iter().map(Vec::len));
        let values: Vec<f32> = self.sequences.concat();
        arrays.put("values", &[values.len()], values);
        arrays
    }

    fn parameters(&self) -> usize {
        self.sequences.iter().map(Vec::len).sum()
    }

    fn settings(&self) -> serde_json::Value {
        serde_json::to_value(&self.learned).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn warping_ignores_a_delay_but_not_an_amplitude() {
        let bump = |at: usize, height: f32| -> Vec<f32> {
            (0..20).map(|i| if (at..at + 4).contains(&i) { height } else { 0.0 }).collect()
        };
        let of = |b: &[f32], band: usize| warped_distance(&bump(6, 1.0), b, 1, band);
        assert_eq!(of(&bump(6, 1.0), 3), 0.0);
        assert_eq!(of(&bump(8, 1.0), 3), 0.0);
        assert!(of(&bump(8, 1.0), 0) > 3.9, "without a band it is the plain distance");
        assert!(of(&bump(6, 2.0), 3) > 3.9);
        assert_eq!(of(&bump(6, 1.0)[..18], 0), 0.0, "different lengths");
    }
}
