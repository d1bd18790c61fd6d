//! Comparison of trials: aligned in time, and mean and spread of several.

use super::open_trial::{Column, OpenTrial};
use super::phases::{PhaseSpan, TouchPhase};

/// Common origin of time of compared trials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Alignment {
    /// The fingers begin to close.
    #[default]
    Closing,
    /// A finger touches the object; where none does, as [`Self::Closing`].
    Contact,
}

impl Alignment {
    /// All.
    pub const ALL: [Self; 2] = [Self::Closing, Self::Contact];

    /// Name on screen and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Closing => "start",
            Self::Contact => "contact",
        }
    }

    /// Origin of time of a trial (s).
    pub fn origin_s(self, trial: &OpenTrial) -> f64 {
        self.origin_of(&trial.phases).or(trial.t_s.first().copied()).unwrap_or(0.0)
    }

    /// Origin of time of a grasp with these phases (s); none without any.
    pub fn origin_of(self, phases: &[PhaseSpan]) -> Option<f64> {
        let contact = phases.iter().find(|span| span.phase == TouchPhase::Contact && self == Self::Contact);
        contact.or(phases.first()).map(|span| span.from_s)
    }
}

/// Mean and spread of one channel over several trials.
#[derive(Clone, Debug, PartialEq)]
pub struct MeanColumn {
    /// Name of the channel.
    pub name: String,
    /// Mean at each time; NaN where fewer than half of the trials have a value.
    pub mean: Vec<f32>,
    /// Standard deviation at each time, in the same unit; zero of a single trial.
    pub spread: Vec<f32>,
}

/// Mean and spread of several trials.
#[derive(Clone, Debug, PartialEq)]
pub struct MeanTrial {
    /// Number of trials.
    pub trials: usize,
    /// Times, from the common origin (s).
    pub t_s: Vec<f64>,
    /// Mean line pressure (bar); NaN where it is unknown.
    pub line_bar: Vec<f64>,
    /// The channels of the first trial.
    pub columns: Vec<MeanColumn>,
}

/// Time between two samples of a mean (s).
const STEP_S: f64 = 0.02;
/// Longest mean (samples): ten minutes.
const MOST_SAMPLES: usize = 30_000;

impl MeanTrial {
    /// Mean and spread of trials; none without samples.
    pub fn of(trials: &[&OpenTrial], alignment: Alignment) -> Option<Self> {
        let origins: Vec<f64> = trials.iter().map(|trial| alignment.origin_s(trial)).collect();
        let ends = |end: fn([f64; 2]) -> f64| trials.iter().zip(&origins).map(move |(t, o)| end(t.span_s()) - o);
        let first = ends(|span| span[0]).reduce(f64::min)?;
        let last = ends(|span| span[1]).reduce(f64::max)?;
        let samples = (((last - first) / STEP_S).floor().max(0.0) as usize + 1).min(MOST_SAMPLES);
        let t_s: Vec<f64> = (0..samples).map(|k| first + STEP_S * k as f64).collect();
        let statistics = |values: &dyn Fn(&OpenTrial, f64) -> Option<f64>| -> (Vec<f64>, Vec<f64>) {
            let at = |t: &f64| {
                let found: Vec<f64> =
                    trials.iter().zip(&origins).filter_map(|(trial, origin)| values(trial, t + origin)).collect();
                if 2 * found.len() < trials.len() || found.is_empty() {
                    return (f64::NAN, f64::NAN);
                }
                let mean = found.iter().sum::<f64>() / found.len() as f64;
                let square = found.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
                (mean, (square / (found.len().max(2) - 1) as f64).sqrt())
            };
            t_s.iter().map(at).unzip()
        };
        let narrow = |values: Vec<f64>| values.into_iter().map(|value| value as f32).collect::<Vec<f32>>();
        let column = |own: &Column| {
            let values = |trial: &OpenTrial, t: f64| trial.column(&own.name).and_then(|column| trial.value(column, t));
            let (mean, spread) = statistics(&values);
            MeanColumn { name: own.name.clone(), mean: narrow(mean), spread: narrow(spread) }
        };
        Some(Self {
            trials: trials.len(),
            line_bar: statistics(&|trial, t| trial.interpolated(t, |k| trial.line_bar[k])).0,
            columns: trials.first()?.columns.iter().map(column).collect(),
            t_s,
        })
    }
}

impl OpenTrial {
    /// Value of a column at a time (s), between its samples; none outside of the trial and where it is undefined.
    pub fn value(&self, column: &Column, t_s: f64) -> Option<f64> {
        self.interpolated(t_s, |k| f64::from(column.values[k]))
    }

    fn interpolated(&self, t_s: f64, at: impl Fn(usize) -> f64) -> Option<f64> {
        let after = self.t_s.partition_point(|t| *t <= t_s);
        let before = after.checked_sub(1)?;
        let value = match self.t_s.get(after) {
            Some(next) => {
                let share = (t_s - self.t_s[before]) / (next - self.t_s[before]);
                at(before) + share * (at(after) - at(before))
            }
            None if t_s <= self.t_s[before] + 1e-9 => at(before),
            None => return None,
        };
        value.is_finite().then_some(value)
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_trials::open_trial;
    use super::*;

    /// A ramp that begins at `contact` (s), with a slope of `slope`.
    fn ramp(contact: f64, slope: f64) -> OpenTrial {
        let t_s: Vec<f64> = (0..=200).map(|k| 0.02 * f64::from(k)).collect();
        let values = t_s.iter().map(|t| (slope * (t - contact).max(0.0)) as f32).collect();
        let mut trial = open_trial(t_s, vec![("force_left", values)]);
        let span = |phase, from_s, to_s| PhaseSpan { phase, from_s, to_s };
        trial.phases = vec![span(TouchPhase::PreShaping, 0.0, contact), span(TouchPhase::Contact, contact, 4.0)];
        trial
    }

    #[test]
    fn aligned_at_contact_equal_ramps_have_no_spread() {
        let trials = [ramp(1.0, 2.0), ramp(1.5, 2.0)];
        let trials: Vec<&OpenTrial> = trials.iter().collect();
        let mean = MeanTrial::of(&trials, Alignment::Contact).expect("samples");
        assert_eq!((mean.trials, mean.t_s[0]), (2, -1.5));
        for (k, t) in mean.t_s.iter().enumerate().filter(|(_, t)| (-1.0..2.4).contains(*t)) {
            let column = &mean.columns[0];
            assert!((f64::from(column.mean[k]) - 2.0 * t.max(0.0)).abs() < 1e-5, "{t}: {}", column.mean[k]);
            assert!(column.spread[k].abs() < 1e-5);
        }
        // Aligned at the start they differ by the delay: mean and spread of 2 and 1 at 2 s.
        let mean = MeanTrial::of(&trials, Alignment::Closing).expect("samples");
        let k = mean.t_s.iter().position(|t| (t - 2.0).abs() < 1e-9).expect("a sample");
        assert!((mean.columns[0].mean[k] - 1.5).abs() < 1e-5);
        assert!((mean.columns[0].spread[k] - 0.5f32.sqrt()).abs() < 1e-5);
        assert_eq!(MeanTrial::of(&[], Alignment::Closing), None);
    }

    #[test]
    fn values_lie_between_samples_and_nowhere_else() {
        let trial = ramp(1.0, 2.0);
        let column = &trial.columns[0];
        assert!(trial.value(column, 1.01).is_some_and(|value| (value - 0.02).abs() < 1e-6));
        assert_eq!((trial.value(column, -0.1), trial.value(column, 4.1)), (None, None));
        assert!(trial.value(column, 4.0).is_some());
        let gap = open_trial(vec![0.0, 1.0, 2.0], vec![("a", vec![0.0, f32::NAN, 2.0])]);
        assert_eq!(gap.value(&gap.columns[0], 0.5), None);
        assert_eq!(gap.value(&gap.columns[0], 2.0), Some(2.0));
    }
}
