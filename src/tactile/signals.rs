//! Signals of a whole trial: named channels over time, the form in which recognisers and files know a
//! grasp, whatever rig it came from.

use std::ops::Range;

/// Readings of several channels at the same instants.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Signals {
    /// Names of the channels, as in `curvature_left`.
    pub channels: Vec<String>,
    /// Times of the samples, rising (s).
    pub t_s: Vec<f64>,
    /// One row of channel values per sample, in the channels' units; NaN only in a gap of an imported trial, see
    /// [`Self::filled`].
    pub values: Vec<f32>,
}

/// A time without readings.
#[derive(Clone, Debug, PartialEq)]
pub struct SignalGap {
    /// Channels that it concerns, by their numbers.
    pub channels: Vec<usize>,
    /// The samples without readings.
    pub samples: Range<usize>,
    /// From the last reading before it, or the first sample, to the next one, or the last sample (s).
    pub from_s: f64,
    pub to_s: f64,
}

impl Signals {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.t_s.len()
    }

    /// True when nothing was sampled.
    pub fn is_empty(&self) -> bool {
        self.t_s.is_empty()
    }

    /// Values of one sample, one per channel.
    pub fn row(&self, sample: usize) -> &[f32] {
        let width = self.channels.len();
        &self.values[sample * width..(sample + 1) * width]
    }

    /// Some of the channels, by their names and in that order; none where one is missing.
    pub fn chosen(&self, channels: &[String]) -> Option<Self> {
        let column = |name: &String| self.channels.iter().position(|own| own == name);
        let columns: Vec<usize> = channels.iter().map(column).collect::<Option<_>>()?;
        let mut chosen = Self { channels: channels.to_vec(), ..Self::default() };
        for (sample, t) in self.t_s.iter().enumerate() {
            let row = self.row(sample);
            chosen.push(*t, &columns.iter().map(|column| row[*column]).collect::<Vec<f32>>());
        }
        Some(chosen)
    }

    /// The first part of them, up to a time (s).
    pub fn until(mut self, t: f64) -> Self {
        let count = self.t_s.partition_point(|own| *own <= t);
        self.t_s.truncate(count);
        self.values.truncate(count * self.channels.len());
        self
    }

    /// The part from a time on (s), which becomes time zero.
    pub fn since(mut self, t: f64) -> Self {
        let first = self.t_s.partition_point(|own| *own < t);
        self.t_s.drain(..first);
        self.values.drain(..first * self.channels.len());
        self.t_s.iter_mut().for_each(|own| *own -= t);
        self
    }

    /// Times without readings (NaN), in order.
    pub fn gaps(&self) -> Vec<SignalGap> {
        let width = self.channels.len();
        let mut gaps: Vec<SignalGap> = Vec::new();
        for channel in 0..width {
            let is_missing = |sample: &usize| self.values[sample * width + channel].is_nan();
            let mut at = 0;
            while let Some(begin) = (at..self.len()).find(is_missing) {
                let end = (begin..self.len()).find(|sample| !is_missing(sample)).unwrap_or(self.len());
                at = end;
                match gaps.iter_mut().find(|gap| gap.samples == (begin..end)) {
                    Some(gap) => gap.channels.push(channel),
                    None => gaps.push(SignalGap {
                        channels: vec![channel],
                        samples: begin..end,
                        from_s: self.t_s[begin.saturating_sub(1)],
                        to_s: self.t_s[end.min(self.len() - 1)],
                    }),
                }
            }
        }
        gaps.sort_by_key(|gap| (gap.samples.start, gap.samples.end));
        gaps
    }

    /// The same with straight lines over gaps; before the first and after the last reading of a channel it holds that one.
    /// A channel without any reading is zero.
    pub fn filled(mut self) -> Self {
        let width = self.channels.len();
        for channel in 0..width {
            let known: Vec<usize> =
                (0..self.len()).filter(|sample| !self.values[sample * width + channel].is_nan()).collect();
            if known.len() == self.len() {
                continue;
            }
            let read: Vec<(f64, f32)> =
                known.iter().map(|k| (self.t_s[*k], self.values[k * width + channel])).collect();
            for sample in 0..self.len() {
                let value = &mut self.values[sample * width + channel];
                if value.is_nan() {
                    *value = on_line(&read, self.t_s[sample]);
                }
            }
        }
        self
    }

    /// Adds a sample.
    pub fn push(&mut self, t: f64, row: &[f32]) {
        debug_assert_eq!(row.len(), self.channels.len());
        self.t_s.push(t);
        self.values.extend_from_slice(row);
    }
}

/// Reading at a time, on the line between its neighbours or as the nearest end.
fn on_line(read: &[(f64, f32)], t_s: f64) -> f32 {
    let after = read.partition_point(|(t, _)| *t < t_s);
    match (after.checked_sub(1).and_then(|before| read.get(before)), read.get(after)) {
        (Some((t0, v0)), Some((t1, v1))) => {
            let part = (t_s - t0) / (t1 - t0);
            (f64::from(*v0) + (f64::from(*v1) - f64::from(*v0)) * part) as f32
        }
        (Some((_, value)), None) | (None, Some((_, value))) => *value,
        (None, None) => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_found_and_filled_over_time() {
        const GAP: f32 = f32::NAN;
        let signals = Signals {
            channels: vec!["a".to_owned(), "b".to_owned()],
            t_s: vec![0.0, 1.0, 2.0, 5.0, 6.0],
            values: vec![GAP, 9.0, 1.0, GAP, GAP, GAP, 5.0, GAP, GAP, GAP],
        };
        let gaps: Vec<_> =
            signals.gaps().into_iter().map(|gap| (gap.channels, gap.samples, gap.from_s, gap.to_s)).collect();
        let wanted = [
            (vec![0], 0..1, 0.0, 1.0),
            (vec![1], 1..5, 0.0, 6.0),
            (vec![0], 2..3, 1.0, 5.0),
            (vec![0], 4..5, 5.0, 6.0),
        ];
        assert_eq!(gaps, wanted);
        assert_eq!(signals.filled().values, [1.0, 9.0, 1.0, 9.0, 2.0, 9.0, 5.0, 9.0, 5.0, 9.0]);
        let whole = Signals { channels: vec!["a".to_owned()], t_s: vec![0.0, 1.0, 2.0], values: vec![GAP; 3] };
        assert_eq!((whole.gaps().len(), whole.filled().values), (1, vec![0.0; 3]));
    }

    #[test]
    fn a_stretch_of_time_is_cut_out_and_counted_from_its_beginning() {
        let mut signals = Signals { channels: vec!["a".to_owned(), "b".to_owned()], ..Signals::default() };
        for k in 0..10u8 {
            signals.push(0.5 * f64::from(k), &[f32::from(k), -f32::from(k)]);
        }
        let cut = signals.until(3.0).since(1.0);
        assert_eq!(cut.t_s, [0.0, 0.5, 1.0, 1.5, 2.0]);
        assert_eq!((cut.row(0), cut.row(4)), (&[2.0f32, -2.0][..], &[6.0f32, -6.0][..]));
    }
}
