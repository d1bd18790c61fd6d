//! Class signatures: mean and spread of each channel over time, for each class of a model. They are computed from the
//! training grasps and stored in the model file; no recogniser reads them. They show what a class feels like, stand in
//! for a channel that is left out, and scale the distance between two grasps.
//!
//! All grasps are resampled linearly to the same times, from the start of the closing to the median end of the training
//! grasps. At a time that some grasps of a class do not reach, the others count; where none reaches it, the class keeps
//! its last value.

use crate::arrays::{Array, Arrays, ModelError, check_each};
use crate::data::{Dataset, Sequence};

/// Number of times.
pub const SIGNATURE_STEPS: usize = 64;

/// Names of the arrays in a model file.
const TIMES: &str = "signatures/t_s";
const MEAN: &str = "signatures/mean";
const SPREAD: &str = "signatures/spread";

/// Least spread of a channel in distances, as a share of the range of its means: perfect sensors before contact hardly
/// differ at all.
const LEAST_SPREAD: f32 = 0.01;

/// Mean and spread of each channel over time, for each class of a model.
#[derive(Clone, Debug)]
pub struct Signatures {
    channels: Vec<String>,
    /// Training grasps of each class.
    grasps: Vec<usize>,
    /// Times since the start of the grasp, ascending (s).
    t_s: Vec<f32>,
    /// Means, `[classes][channels][times]`, in the units of the channels.
    mean: Vec<f32>,
    /// Standard deviations over the grasps of a class, of the same shape.
    spread: Vec<f32>,
    /// Mean of the means of all classes, `[channels][times]`.
    average: Vec<f32>,
    /// Spread within a class, root mean square over classes and times, for each channel.
    scales: Vec<f32>,
}

impl PartialEq for Signatures {
    /// Views of a running recognition are compared with each sample and share their signatures.
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self, other)
            || ((&self.channels, &self.grasps) == (&other.channels, &other.grasps)
                && (&self.t_s, &self.mean, &self.spread) == (&other.t_s, &other.mean, &other.spread))
    }
}

impl Signatures {
    /// Computes the signatures of all classes; `None` without readings.
    pub fn of(data: &Dataset) -> Option<Self> {
        Some(Self::at(common_times(data)?, data))
    }

    /// These signatures, and those of further classes of a data set, whose labels begin with these classes.
    pub(crate) fn with_new_classes(&self, data: &Dataset) -> Self {
        let mut all = Self::at(self.t_s.clone(), data);
        all.grasps[..self.grasps.len()].copy_from_slice(&self.grasps);
        all.mean[..self.mean.len()].copy_from_slice(&self.mean);
        all.spread[..self.spread.len()].copy_from_slice(&self.spread);
        Self::with(all.channels, all.grasps, all.t_s, all.mean, all.spread)
    }

    /// These signatures without those of a class; later classes move up.
    pub(crate) fn without(&self, class: usize) -> Self {
        let Self { channels, grasps, t_s, .. } = self;
        let width = channels.len() * t_s.len();
        let rest = |values: &[f32]| -> Vec<f32> {
            let of_class = values.chunks_exact(width.max(1)).enumerate().filter(|(k, _)| *k != class);
            of_class.flat_map(|(_, own)| own.to_vec()).collect()
        };
        let grasps = grasps.iter().enumerate().filter(|(k, _)| *k != class).map(|(_, count)| *count).collect();
        Self::with(channels.clone(), grasps, t_s.clone(), rest(&self.mean), rest(&self.spread))
    }

    /// Computes the signatures of all classes at these times.
    fn at(t_s: Vec<f32>, data: &Dataset) -> Self {
        let (classes, channels, times) = (data.labels.classes.len(), data.channels.len(), t_s.len());
        let mut grasps = vec![0; classes];
        // Count, sum and sum of squares, in double precision: the spread is a small difference of large sums.
        let mut sums = vec![[0.0_f64; 3]; classes * channels * times];
        for example in data.examples.iter().filter(|example| !example.grasp.is_empty()) {
            grasps[example.class] += 1;
            let end = example.grasp.t_s.last().copied().unwrap_or_default();
            let values = resampled(&example.grasp, channels, &t_s);
            let own = &mut sums[example.class * channels * times..][..channels * times];
            for (place, (sum, x)) in own.iter_mut().zip(values).enumerate() {
                let k = place % times;
                if k == 0 || t_s[k] <= end {
                    let x = f64::from(x);
                    *sum = [sum[0] + 1.0, sum[1] + x, sum[2] + x * x];
                }
            }
        }
        let (mut mean, mut spread) = (Vec::with_capacity(sums.len()), Vec::with_capacity(sums.len()));
        for (place, [count, sum, squares]) in sums.into_iter().enumerate() {
            if count > 0.0 {
                let middle = sum / count;
                mean.push(middle as f32);
                spread.push((squares / count - middle * middle).max(0.0).sqrt() as f32);
            } else {
                let before = place.checked_sub(1).filter(|_| place % times > 0);
                let (m, s) = before.map_or((0.0, 0.0), |k| (mean[k], spread[k]));
                mean.push(m);
                spread.push(s);
            }
        }
        Self::with(data.channels.clone(), grasps, t_s, mean, spread)
    }

    /// Adds what follows from means and spreads.
    fn with(channels: Vec<String>, grasps: Vec<usize>, t_s: Vec<f32>, mean: Vec<f32>, spread: Vec<f32>) -> Self {
        let (width, times) = (channels.len(), t_s.len());
        let known: Vec<usize> = (0..grasps.len()).filter(|class| grasps[*class] > 0).collect();
        let count = known.len().max(1) as f64;
        let of_known = |values: &[f32], place: usize| -> Vec<f64> {
            known.iter().map(|class| f64::from(values[class * width * times + place])).collect()
        };
        let average: Vec<f32> =
            (0..width * times).map(|place| (of_known(&mean, place).iter().sum::<f64>() / count) as f32).collect();
        let scale = |channel: usize| {
            let places = || channel * times..(channel + 1) * times;
            let squares: f64 = places().flat_map(|place| of_known(&spread, place)).map(|s| s * s).sum();
            let all = || places().flat_map(|place| of_known(&mean, place));
            let range = all().fold(f64::NEG_INFINITY, f64::max) - all().fold(f64::INFINITY, f64::min);
            let least = if range.is_finite() { LEAST_SPREAD * range as f32 } else { 0.0 };
            ((squares / (count * times.max(1) as f64)).sqrt() as f32).max(least)
        };
        let scales = (0..width).map(scale).collect();
        Self { channels, grasps, t_s, mean, spread, average, scales }
    }

    /// Names of the channels.
    pub fn channels(&self) -> &[String] {
        &self.channels
    }

    /// Training grasps of each class.
    pub fn grasps(&self) -> &[usize] {
        &self.grasps
    }

    /// Times since the start of the grasp, ascending (s).
    pub fn t_s(&self) -> &[f32] {
        &self.t_s
    }

    /// Mean and standard deviation of a channel over time in the grasps of a class; `None` for a class without grasps.
    pub fn of_class(&self, class: usize, channel: usize) -> Option<(&[f32], &[f32])> {
        let known = *self.grasps.get(class)? > 0 && channel < self.channels.len();
        let from = (class * self.channels.len() + channel) * self.t_s.len();
        known.then(|| (&self.mean[from..][..self.t_s.len()], &self.spread[from..][..self.t_s.len()]))
    }

    /// Mean of a channel over all classes, each counted once, over time.
    pub fn average(&self, channel: usize) -> &[f32] {
        &self.average[channel * self.t_s.len()..][..self.t_s.len()]
    }

    /// Mean of a channel over all classes at a time (s); the first and last value apply outside.
    pub fn average_at(&self, channel: usize, t: f32) -> f32 {
        interpolated(&self.t_s, |k| self.average(channel)[k], t)
    }

    /// A grasp at the times of the signatures, `[channels][times]`; it keeps its last values after its end.
    pub fn resampled(&self, grasp: &Sequence) -> Vec<f32> {
        resampled(grasp, self.channels.len(), &self.t_s)
    }

    /// Distance between two resampled grasps: root mean square difference over channels and times, each channel divided
    /// by its spread within a class. Two grasps of one class are about 1.4 apart.
    pub fn distance(&self, a: &[f32], b: &[f32]) -> f64 {
        let times = self.t_s.len();
        let own = self.scales.iter().enumerate().filter(|(_, scale)| **scale > 0.0);
        let (mut squares, mut count) = (0.0, 0);
        for (channel, scale) in own {
            let part = channel * times..(channel + 1) * times;
            let differences = a[part.clone()].iter().zip(&b[part]);
            squares += differences.map(|(a, b)| f64::from((a - b) / scale).powi(2)).sum::<f64>();
            count += times;
        }
        (squares / f64::from(u32::try_from(count.max(1)).unwrap_or(u32::MAX))).sqrt()
    }

    /// Channels that begin farther from every class than all means of the channel are apart, as where a zero is another one:
    /// the channel, its value, and the mean of all classes.
    pub fn far_at_start(&self, row: &[f32]) -> Vec<(&str, f32, f32)> {
        let far = |(channel, value): (usize, &f32)| {
            let classes = (0..self.grasps.len()).filter_map(|class| Some(self.of_class(class, channel)?.0));
            let (mut low, mut high, mut nearest) = (f32::INFINITY, f32::NEG_INFINITY, f32::INFINITY);
            for mean in classes {
                mean.iter().for_each(|mean| (low, high) = (low.min(*mean), high.max(*mean)));
                nearest = nearest.min((mean.first()? - value).abs());
            }
            let is_far = high > low && nearest > high - low;
            is_far.then(|| (self.channels[channel].as_str(), *value, self.average(channel)[0]))
        };
        row.iter().enumerate().take(self.channels.len()).filter_map(far).collect()
    }

    /// Adds the arrays of a model file.
    pub(crate) fn put_into(&self, arrays: &mut Arrays) {
        let shape = [self.grasps.len(), self.channels.len(), self.t_s.len()];
        arrays.put(TIMES, &shape[2..], self.t_s.clone());
        arrays.put(MEAN, &shape, self.mean.clone());
        arrays.put(SPREAD, &shape, self.spread.clone());
    }

    /// Takes the arrays of a model file with these channels and training grasps of each class.
    pub(crate) fn take_from(arrays: &mut Arrays, channels: &[String], grasps: &[usize]) -> Result<Self, ModelError> {
        let mut own = Arrays::default();
        let arrays_taken: Vec<(String, Array)> =
            [TIMES, MEAN, SPREAD].iter().filter_map(|name| arrays.0.remove_entry(*name)).collect();
        own.0.extend(arrays_taken);
        let t_s = own.f32_vector(TIMES)?.to_vec();
        let shape = [grasps.len(), channels.len(), t_s.len()];
        let (mean, spread) = (own.f32s(MEAN, &shape)?, own.f32s(SPREAD, &shape)?);
        check_each(SPREAD, spread, "at least zero", |spread| *spread >= 0.0)?;
        let falls = t_s.windows(2).position(|pair| pair[1] < pair[0]).or((t_s.is_empty()).then_some(0));
        match falls {
            Some(index) => Err(ModelError::value(TIMES, index, "in ascending order")),
            None => Ok(Self::with(channels.to_vec(), grasps.to_vec(), t_s, mean.to_vec(), spread.to_vec())),
        }
    }
}

/// Evenly spaced times from the first reading to the median end of the grasps.
fn common_times(data: &Dataset) -> Option<Vec<f32>> {
    let grasps = || data.examples.iter().map(|example| &example.grasp.t_s);
    let mut ends: Vec<f32> = grasps().filter_map(|t| t.last().copied()).collect();
    ends.sort_by(f32::total_cmp);
    let end = *ends.get(ends.len() / 2)?;
    let start = grasps().filter_map(|t| t.first().copied()).fold(f32::INFINITY, f32::min).min(end);
    let step = (end - start) / (SIGNATURE_STEPS - 1) as f32;
    Some((0..SIGNATURE_STEPS).map(|k| if k + 1 == SIGNATURE_STEPS { end } else { start + step * k as f32 }).collect())
}

/// Values at these times, `[channels][times]`; zero for a grasp without readings.
fn resampled(grasp: &Sequence, channels: usize, times: &[f32]) -> Vec<f32> {
    if grasp.is_empty() {
        return vec![0.0; channels * times.len()];
    }
    let value = |channel: usize, t: f32| interpolated(&grasp.t_s, |k| grasp.values[k * channels + channel], t);
    (0..channels).flat_map(|channel| times.iter().map(move |t| value(channel, *t))).collect()
}

/// Linear interpolation over ascending times; the first and last value apply outside.
fn interpolated(t_s: &[f32], value: impl Fn(usize) -> f32, t: f32) -> f32 {
    let after = t_s.partition_point(|own| *own <= t);
    if after == 0 || after == t_s.len() {
        return value(after.saturating_sub(1).min(t_s.len() - 1));
    }
    let (low, high) = (t_s[after - 1], t_s[after]);
    let (from, to) = (value(after - 1), value(after));
    from + (to - from) * (t - low) / (high - low)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::{Class, Example, Labels};
    use std::sync::Arc;

    /// Channel "a" rises at the given rate, "b" stays at its level.
    fn grasp(rate: f32, level: f32, end: f32) -> Sequence {
        let t_s: Vec<f32> = (0..=20).map(|k| end * k as f32 / 20.0).collect();
        let values = t_s.iter().flat_map(|t| [rate * t, level]).collect();
        Sequence { t_s, values }
    }

    fn data() -> Dataset {
        let class = |name: &str| Class { name: name.to_owned(), size: None, shape: None };
        let labels = Labels { classes: ["x", "y", "none"].map(class).to_vec(), ..Labels::default() };
        let grasps = [(0, grasp(1.0, 5.0, 2.0)), (0, grasp(3.0, 5.0, 2.0)), (1, grasp(6.0, 8.0, 2.0))];
        let examples = grasps.into_iter().enumerate();
        let examples = examples
            .map(|(k, (class, grasp))| Example { id: k as i64, class, grasp: Arc::new(grasp), ..Example::default() })
            .collect();
        let channels = vec!["a".to_owned(), "b".to_owned()];
        Dataset { channels, labels, examples, ..Dataset::default() }
    }

    #[test]
    fn mean_and_spread_are_those_of_the_grasps_of_a_class() {
        let signatures = Signatures::of(&data()).unwrap();
        assert_eq!((signatures.t_s().len(), signatures.t_s()[0], signatures.t_s()[63]), (64, 0.0, 2.0));
        assert_eq!(signatures.grasps(), [2, 1, 0]);
        let (mean, spread) = signatures.of_class(0, 0).unwrap();
        // Rates 1 and 3: mean 2 t, standard deviation t.
        for (k, t) in signatures.t_s().iter().enumerate() {
            assert!((mean[k] - 2.0 * t).abs() < 1e-5 && (spread[k] - t).abs() < 1e-5, "{t}");
        }
        assert!(signatures.of_class(2, 0).is_none() && signatures.of_class(3, 0).is_none());
        // Each class counts once, whatever its number of grasps; a class without grasps does not count.
        assert!((signatures.average_at(0, 1.0) - 4.0).abs() < 1e-5);
        assert_eq!((signatures.average_at(1, 0.7), signatures.average_at(0, 9.0)), (6.5, 8.0));
    }

    #[test]
    fn a_copy_is_at_distance_zero_and_one_spread_at_one() {
        let signatures = Signatures::of(&data()).unwrap();
        let of = |rate, level| signatures.resampled(&grasp(rate, level, 2.0));
        assert_eq!(signatures.distance(&of(2.0, 5.0), &of(2.0, 5.0)), 0.0);
        // Channel "b" does not vary within a class; its scale is a share of its range, 3.
        let by_b = signatures.distance(&of(2.0, 5.0), &of(2.0, 5.03));
        assert!((by_b - 0.5_f64.sqrt()).abs() < 1e-3, "{by_b}");
        // Channel "a": spread t in one class and 0 in the other, whose root mean square is that of t / sqrt(2).
        let by_a = signatures.distance(&of(2.0, 5.0), &of(3.0, 5.0));
        assert!((by_a - 1.0).abs() < 1e-3, "{by_a}");
    }

    #[test]
    fn grasps_that_end_early_do_not_bend_the_mean() {
        let mut data = data();
        data.examples[1].grasp = Arc::new(grasp(3.0, 5.0, 0.5));
        let signatures = Signatures::of(&data).unwrap();
        let (mean, spread) = signatures.of_class(0, 0).unwrap();
        assert!((mean[63] - 2.0).abs() < 1e-5 && spread[63] < 1e-3, "only the longer one is left");
        // A class whose grasps all end early keeps its last value.
        data.examples[2].grasp = Arc::new(grasp(6.0, 8.0, 1.0));
        data.examples.push(Example { id: 9, ..data.examples[0].clone() });
        let signatures = Signatures::of(&data).unwrap();
        let mean = signatures.of_class(1, 0).unwrap().0;
        assert!((mean[63] - 6.0).abs() < 0.2 && mean[63] == mean[40], "{}", mean[63]);
        assert!(Signatures::of(&data.part(&[])).is_none());
    }
}
