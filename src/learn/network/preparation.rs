//! From readings to a network's inputs: equal time steps, compressed and standardised channels. Scales are fitted to
//! training data and stored with the network; live readings are processed sample by sample in the same way.
//!
//! Each channel becomes two inputs: its scaled value, and its deviation from the mean course of all training grasps at
//! that step, in standard deviations at that step. The closing motion common to all grasps is much larger than the
//! differences between objects. Strict networks read the standardised channels only.

use crate::data::{Dataset, Sequence};
use crate::gaps;
use crate::mirror::mirror;
use serde::{Deserialize, Serialize};

/// Mapping from readings to inputs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Preparation {
    /// Rate of time steps (Hz).
    pub(crate) rate_hz: f32,
    /// Scale of each channel.
    pub(crate) scales: Vec<Scale>,
    /// Mean scaled value, `[steps][channels]`; the last step applies to later ones. Empty for channels that are only
    /// standardised.
    pub(crate) course: Vec<Vec<f32>>,
    /// One over the standard deviation from it, `[steps][channels]`.
    pub(crate) factors: Vec<Vec<f32>>,
}

/// Scale of one channel: asinh(x / knee), then mean and standard deviation. Linear below the knee, logarithmic above,
/// because pressures span decades.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Scale {
    /// Start of the logarithmic range, in the channel's unit; zero for a linear scale.
    pub(crate) knee: f32,
    /// Mean of the compressed values.
    pub(crate) mean: f32,
    /// One over their standard deviation.
    pub(crate) factor: f32,
}

impl Scale {
    fn compressed(self, x: f32) -> f32 {
        if self.knee > 0.0 { (x / self.knee).asinh() } else { x }
    }

    fn apply(self, x: f32) -> f32 {
        ((self.compressed(x) - self.mean) * self.factor).clamp(-MOST_DEVIATIONS, MOST_DEVIATIONS)
    }
}

/// A channel is compressed if its largest value is more than this many times its median.
const WIDE: f32 = 4.0;
/// Bound of scaled values (standard deviations).
const MOST_DEVIATIONS: f32 = 20.0;

impl Preparation {
    /// Fits scales to training data; `rate_hz` is the rate of time steps (Hz).
    pub(crate) fn fit(data: &Dataset, rate_hz: f32) -> Self {
        let scales: Vec<Scale> = columns(data, rate_hz).iter_mut().map(|column| fitted(column)).collect();
        let (course, factors) = mean_course(data, rate_hz, &scales);
        Self { rate_hz, scales, course, factors }
    }

    /// Fits mean and standard deviation of each channel only.
    pub(super) fn standardising(data: &Dataset, rate_hz: f32) -> Self {
        let scales = columns(data, rate_hz).iter_mut().map(|column| standardised(column, 0.0)).collect();
        Self { rate_hz, scales, course: Vec::new(), factors: Vec::new() }
    }

    /// Counterpart of each input on the other finger; `None` if grasps cannot be mirrored.
    pub(crate) fn mirror(&self, channels: &[String]) -> Option<Vec<usize>> {
        let own = mirror(channels)?;
        let counterpart = |input: usize| input / own.len() * own.len() + own[input % own.len()];
        Some((0..self.width()).map(counterpart).collect())
    }

    /// Number of inputs per step.
    pub(crate) fn width(&self) -> usize {
        if self.course.is_empty() { self.scales.len() } else { 2 * self.scales.len() }
    }

    /// True if a mapping from a file is valid for this number of channels.
    pub(crate) fn is_sound(&self, channels: usize) -> bool {
        let finite = |rows: &[Vec<f32>]| rows.iter().flatten().all(|x| x.is_finite());
        let fits = |rows: &[Vec<f32>]| !rows.is_empty() && rows.iter().all(|row| row.len() == self.scales.len());
        let parts = [&self.course, &self.factors];
        self.has_sound_scales(channels)
            && parts.iter().all(|rows| fits(rows) && finite(rows))
            && self.course.len() == self.factors.len()
    }

    /// True if a mapping from a file only standardises this number of channels.
    pub(super) fn is_sound_and_standardising(&self, channels: usize) -> bool {
        self.has_sound_scales(channels) && self.course.is_empty() && self.factors.is_empty()
    }

    fn has_sound_scales(&self, channels: usize) -> bool {
        let is_sound = |s: &Scale| s.knee.is_finite() && s.mean.is_finite() && s.factor.is_finite();
        self.rate_hz > 0.0
            && self.rate_hz <= 1000.0
            && channels > 0
            && self.scales.len() == channels
            && self.scales.iter().all(is_sound)
    }

    /// Inputs of a sequence, `[steps][width]`.
    pub(crate) fn inputs(&self, sequence: &Sequence) -> Vec<f32> {
        Binner::new(self).whole(sequence)
    }
}

/// Smallest standard deviation at a step, as a share of the channel's overall one; it bounds the amplification.
const LEAST_DEPARTURE: f64 = 0.02;

/// Mean and one over the standard deviation of scaled values at each step, over all sequences that reach it.
fn mean_course(data: &Dataset, rate_hz: f32, scales: &[Scale]) -> (Vec<Vec<f32>>, Vec<Vec<f32>>) {
    let channels = scales.len();
    let mut sums: Vec<(f64, Vec<[f64; 2]>)> = Vec::new();
    for example in &data.examples {
        let binner = Binner { scales: Some(scales.to_vec()), ..Binner::plain(rate_hz, channels) };
        for (step, row) in binner.whole(&example.grasp).chunks_exact(channels.max(1)).enumerate() {
            if step >= sums.len() {
                sums.push((0.0, vec![[0.0; 2]; channels]));
            }
            let (count, of_step) = &mut sums[step];
            *count += 1.0;
            for (sum, x) in of_step.iter_mut().zip(row) {
                sum[0] += f64::from(*x);
                sum[1] += f64::from(*x) * f64::from(*x);
            }
        }
    }
    // Drop steps that fewer than a quarter of the sequences reach.
    let most = sums.first().map_or(0.0, |(count, _)| *count);
    sums.retain(|(count, _)| *count >= 0.25 * most);
    let mean = |(count, of_step): &(f64, Vec<[f64; 2]>)| of_step.iter().map(|s| (s[0] / count) as f32).collect();
    let factor = |(count, of_step): &(f64, Vec<[f64; 2]>)| {
        let deviation = |s: &[f64; 2]| (s[1] / count - (s[0] / count).powi(2)).max(0.0).sqrt();
        of_step.iter().map(|s| (1.0 / deviation(s).max(LEAST_DEPARTURE)) as f32).collect()
    };
    (sums.iter().map(mean).collect(), sums.iter().map(factor).collect())
}

/// Values of each channel at all steps of all grasps.
fn columns(data: &Dataset, rate_hz: f32) -> Vec<Vec<f32>> {
    let channels = data.channels.len();
    let mut columns: Vec<Vec<f32>> = vec![Vec::new(); channels];
    for example in &data.examples {
        let plain = Binner::plain(rate_hz, channels).whole(&example.grasp);
        for row in plain.chunks_exact(channels.max(1)) {
            columns.iter_mut().zip(row).for_each(|(column, x)| column.push(*x));
        }
    }
    columns
}

fn fitted(column: &mut [f32]) -> Scale {
    let mut sizes: Vec<f32> = column.iter().map(|x| x.abs()).filter(|x| *x > 0.0).collect();
    sizes.sort_by(f32::total_cmp);
    let at = |share: f64| sizes.get(((sizes.len() as f64 - 1.0).max(0.0) * share) as usize).copied().unwrap_or(0.0);
    let typical = at(0.5);
    standardised(column, if typical > 0.0 && at(0.995) > WIDE * typical { typical } else { 0.0 })
}

/// Scale with this knee that gives no mean and unit standard deviation.
fn standardised(column: &mut [f32], knee: f32) -> Scale {
    let scale = Scale { knee, mean: 0.0, factor: 1.0 };
    column.iter_mut().for_each(|x| *x = scale.compressed(*x));
    let count = column.len().max(1) as f64;
    let mean = column.iter().map(|x| f64::from(*x)).sum::<f64>() / count;
    let variance = column.iter().map(|x| (f64::from(*x) - mean).powi(2)).sum::<f64>() / count;
    // A constant channel is ignored; its rounding errors must not be amplified.
    let deviation = variance.sqrt();
    let factor = if deviation > 1e-6 * mean.abs().max(1e-30) { 1.0 / deviation } else { 0.0 };
    Scale { knee, mean: mean as f32, factor: factor as f32 }
}

/// Averages readings over equal time steps as they arrive, and scales them.
#[derive(Clone, Debug)]
pub(crate) struct Binner {
    rate_hz: f32,
    /// `None` for unscaled means.
    scales: Option<Vec<Scale>>,
    /// Means and factors per step; empty for scaled values only.
    course: Vec<(Vec<f32>, Vec<f32>)>,
    /// Number of steps completed.
    completed: usize,
    step: u32,
    sums: Vec<f32>,
    /// The last readings, which stay in gaps.
    last: Vec<f32>,
    count: u32,
    out: Vec<f32>,
}

impl Binner {
    /// Creates a binner at the start of a sequence.
    pub(crate) fn new(preparation: &Preparation) -> Self {
        let scales = Some(preparation.scales.clone());
        let course = preparation.course.iter().cloned().zip(preparation.factors.iter().cloned()).collect();
        let out = vec![0.0; preparation.width()];
        Self { scales, course, out, ..Self::plain(preparation.rate_hz, preparation.scales.len()) }
    }

    /// Returns to the start of a sequence.
    pub(crate) fn reset(&mut self) {
        (self.step, self.count, self.completed) = (0, 0, 0);
        self.sums.fill(0.0);
        self.last.fill(0.0);
    }

    fn plain(rate_hz: f32, channels: usize) -> Self {
        Self {
            rate_hz,
            scales: None,
            course: Vec::new(),
            completed: 0,
            step: 0,
            sums: vec![0.0; channels],
            last: vec![0.0; channels],
            count: 0,
            out: vec![0.0; channels],
        }
    }

    fn whole(mut self, sequence: &Sequence) -> Vec<f32> {
        let mut inputs = Vec::new();
        for (t, row) in sequence.rows() {
            if let Some(step) = self.push(t, row) {
                inputs.extend_from_slice(step);
            }
        }
        if let Some(step) = self.finish() {
            inputs.extend_from_slice(step);
        }
        inputs
    }

    /// Takes a reading at a time (s); returns the inputs of the step before if this is the first reading of a new step.
    pub(crate) fn push(&mut self, t: f32, row: &[f32]) -> Option<&[f32]> {
        // A reading on the border belongs to the step before: at 25 Hz the sample at 0.04 s ends the first step.
        let step = ((t * self.rate_hz - 1e-3).floor().clamp(0.0, 1e9)) as u32;
        let complete = step != self.step && self.count > 0;
        if complete {
            self.close();
        }
        self.step = step;
        gaps::keep(row, &mut self.last);
        self.sums.iter_mut().zip(&self.last).for_each(|(sum, x)| *sum += x);
        self.count += 1;
        complete.then_some(&self.out[..])
    }

    /// Returns the inputs of the last step; `None` if it has no reading.
    pub(crate) fn finish(&mut self) -> Option<&[f32]> {
        let complete = self.count > 0;
        if complete {
            self.close();
        }
        complete.then_some(&self.out[..])
    }

    fn close(&mut self) {
        let share = 1.0 / self.count as f32;
        for (channel, (out, sum)) in self.out.iter_mut().zip(&mut self.sums).enumerate() {
            let scale = self.scales.as_ref().map(|scales| scales[channel]);
            *out = scale.map_or(*sum * share, |scale| scale.apply(*sum * share));
            *sum = 0.0;
        }
        if let Some((means, factors)) = self.course.get(self.completed.min(self.course.len().saturating_sub(1))) {
            let (scaled, departures) = self.out.split_at_mut(self.sums.len());
            for (((departure, x), mean), factor) in departures.iter_mut().zip(scaled).zip(means).zip(factors) {
                *departure = ((*x - mean) * factor).clamp(-MOST_DEVIATIONS, MOST_DEVIATIONS);
            }
        }
        self.completed += 1;
        self.count = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformance_tests::made_up;

    #[test]
    fn inputs_have_no_mean_and_unit_deviation() {
        let data = made_up(10, 1);
        let preparation = Preparation::fit(&data, 10.0);
        assert!(preparation.is_sound(data.channels.len()));
        let rows: Vec<f32> = data.examples.iter().flat_map(|e| preparation.inputs(&e.grasp)).collect();
        let width = preparation.width();
        for input in 0..width {
            let values: Vec<f64> = rows.iter().skip(input).step_by(width).map(|x| f64::from(*x)).collect();
            let count = values.len() as f64;
            let mean = values.iter().sum::<f64>() / count;
            let deviation = (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count).sqrt();
            assert!(mean.abs() < 1e-3 && deviation < 1.001, "input {input}: {mean} {deviation}");
            assert!(input >= width / 2 || deviation > 0.999, "scaled values: {deviation}");
        }
    }

    #[test]
    fn strict_inputs_are_standardised_channels() {
        let data = made_up(10, 1);
        let preparation = Preparation::standardising(&data, 75.0);
        let channels = data.channels.len();
        assert!(preparation.is_sound_and_standardising(channels) && !preparation.is_sound(channels));
        assert_eq!(preparation.width(), channels);
        let grasp = &data.examples[0].grasp;
        let inputs = preparation.inputs(grasp);
        // At 20 Hz every sample is a step of its own.
        assert_eq!(inputs.len(), grasp.values.len());
        for ((input, x), scale) in inputs.iter().zip(&grasp.values).zip(preparation.scales.iter().cycle()) {
            assert!((input - (x - scale.mean) * scale.factor).abs() < 1e-5 && scale.knee == 0.0);
        }
    }

    #[test]
    fn step_means_do_not_depend_on_the_sampling_rate() {
        let ramp = |hz: f32| {
            let t_s: Vec<f32> = (1..=(2.0 * hz) as usize).map(|k| k as f32 / hz).collect();
            let values = t_s.iter().map(|t| t - 0.5 / hz).collect();
            Sequence { t_s, values }
        };
        let (fine, coarse) = (Binner::plain(5.0, 1).whole(&ramp(100.0)), Binner::plain(5.0, 1).whole(&ramp(50.0)));
        assert_eq!((fine.len(), coarse.len()), (10, 10));
        assert!(fine.iter().zip(&coarse).all(|(a, b)| (a - b).abs() < 1e-4), "{fine:?} {coarse:?}");
        assert!((fine[0] - 0.1).abs() < 1e-4, "the mean over the first fifth of a second: {}", fine[0]);
    }

    #[test]
    fn wide_channels_are_compressed_and_constant_ones_ignored() {
        let mut wide: Vec<f32> = (0..1000).map(|k| 10f32.powf(k as f32 / 250.0)).collect();
        let scale = fitted(&mut wide);
        assert!(scale.knee > 0.0, "four decades");
        let mut dead = vec![7.0; 100];
        let scale = fitted(&mut dead);
        assert_eq!((scale.knee, scale.apply(7.0), scale.apply(1e30)), (0.0, 0.0, 0.0));
        let mut even: Vec<f32> = (0..100).map(|k| k as f32).collect();
        assert_eq!(fitted(&mut even).knee, 0.0);
    }
}
