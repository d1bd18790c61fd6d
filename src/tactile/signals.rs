//! Signals of a whole trial: named channels over time, the form in which recognisers and files know a
//! grasp, whatever rig it came from.

/// Readings of several channels at the same instants.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Signals {
    /// Names of the channels, as in `curvature_left`.
    pub channels: Vec<String>,
    /// Times of the samples, rising (s).
    pub t_s: Vec<f64>,
    /// One row of channel values per sample, in the channels' units; never NaN.
    pub values: Vec<f32>,
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

    /// Adds a sample.
    pub fn push(&mut self, t: f64, row: &[f32]) {
        debug_assert_eq!(row.len(), self.channels.len());
        self.t_s.push(t);
        self.values.extend_from_slice(row);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
