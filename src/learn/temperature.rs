//! Calibration of probabilities: the temperature, alone or with a share of doubt, that makes the true classes of held-out
//! grasps most likely.

use crate::pmf::Pmf;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// Temperatures tried, on a logarithmic scale.
#[derive(Clone, Debug)]
pub(crate) struct Temperatures {
    /// Lowest and highest.
    pub(crate) range: RangeInclusive<f64>,
    /// Number, at least 2.
    pub(crate) count: usize,
}

impl Temperatures {
    fn candidates(&self) -> impl Iterator<Item = f64> {
        let (low, ratio) = (*self.range.start(), self.range.end() / self.range.start());
        let last = (self.count - 1) as f64;
        (0..self.count).map(move |k| low * ratio.powf(k as f64 / last))
    }

    /// True if a temperature from a file may have been found among these.
    pub(crate) fn allows(&self, temperature: f32) -> bool {
        // Files hold single precision.
        (0.99 * self.range.start()..=1.01 * self.range.end()).contains(&f64::from(temperature))
    }
}

/// Best temperature of scores (unnormalised logarithms of probabilities), each with its true class, and the mean negative
/// log-likelihood at it (nat). 1 without scores.
pub(crate) fn best_temperature(rows: &[(&[f32], usize)], tried: &Temperatures) -> (f64, f64) {
    let loss = |temperature: f64| -> f64 {
        let of_row = |(scores, target): &(&[f32], usize)| {
            let highest = scores.iter().copied().fold(f32::NEG_INFINITY, f32::max);
            let scaled = |s: f32| f64::from(s - highest) / temperature;
            scores.iter().map(|s| scaled(*s).exp()).sum::<f64>().ln() - scaled(scores[*target])
        };
        rows.iter().map(of_row).sum::<f64>() / rows.len() as f64
    };
    if rows.is_empty() {
        return (1.0, 0.0);
    }
    let judged = tried.candidates().map(|temperature| (temperature, loss(temperature)));
    judged.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((1.0, 0.0))
}

/// Share of a uniform PMF that is mixed into probabilities: what is left of doubt however sure a classifier is.
const DOUBTS: [f64; 9] = [0.0, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3];

/// Temperature and doubt that together make the true classes of held-out grasps most likely. Without doubt the few grasps on
/// which a classifier is surely wrong would decide the temperature, and all others would be answered with too little
/// confidence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Calibration {
    pub(crate) temperature: f32,
    pub(crate) doubt: f32,
}

impl Calibration {
    /// Fits to PMFs, each with its true class and the weight of that class; returns also the mean negative log-likelihood
    /// (nat).
    pub(crate) fn fit(answers: &[(Pmf, usize)], weight: impl Fn(usize) -> f64, tried: &Temperatures) -> (Self, f64) {
        let mut best = (Self { temperature: 1.0, doubt: 0.0 }, f64::INFINITY);
        if answers.is_empty() {
            return best;
        }
        let total: f64 = answers.iter().map(|(_, truth)| weight(*truth)).sum();
        for temperature in tried.candidates() {
            let sharpened = |(pmf, truth): &(Pmf, usize)| pmf.at_temperature(temperature).probabilities()[*truth];
            let probabilities: Vec<f64> = answers.iter().map(sharpened).collect();
            for doubt in DOUBTS {
                let of =
                    |(p, (pmf, truth)): (&f64, &(Pmf, usize))| -mixed(*p, doubt, pmf.classes()).ln() * weight(*truth);
                let loss = probabilities.iter().zip(answers).map(of).sum::<f64>() / total;
                if loss < best.1 {
                    best = (Self { temperature: temperature as f32, doubt: doubt as f32 }, loss);
                }
            }
        }
        best
    }

    /// True if a file may hold this calibration.
    pub(crate) fn is_sound(&self, tried: &Temperatures) -> bool {
        tried.allows(self.temperature) && (0.0..=1.0).contains(&self.doubt)
    }

    /// Applies it to a PMF.
    pub(crate) fn apply(&self, pmf: &Pmf) -> Pmf {
        let sharpened = pmf.at_temperature(f64::from(self.temperature));
        let classes = pmf.classes();
        Pmf::from_weights(sharpened.probabilities().iter().map(|p| mixed(*p, f64::from(self.doubt), classes)))
    }
}

fn mixed(p: f64, doubt: f64, classes: usize) -> f64 {
    (1.0 - doubt) * p.max(1e-12) + doubt / classes.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_temperature_is_recovered() {
        // Scores of a calibrated binary classifier, multiplied by three, and divided by twenty.
        for (factor, range) in [(3.0, 0.5..=8.0), (0.05, 0.005..=10.0)] {
            let mut rows = Vec::new();
            for k in 0..400 {
                let p = 0.5 + 0.49 * (k as f32 / 400.0);
                let score = factor * (p / (1.0 - p)).ln();
                rows.push(([score, 0.0], usize::from((k * 7919 % 1000) as f32 >= 1000.0 * p)));
            }
            let rows: Vec<(&[f32], usize)> = rows.iter().map(|(scores, target)| (&scores[..], *target)).collect();
            let (found, loss) = best_temperature(&rows, &Temperatures { range, count: 100 });
            assert!((found / f64::from(factor) - 1.0).abs() < 0.14, "{found}");
            assert!(loss > 0.1 && loss < std::f64::consts::LN_2, "{loss}");
        }
        assert_eq!(best_temperature(&[], &Temperatures { range: 0.5..=8.0, count: 60 }).0, 1.0);
    }

    #[test]
    fn a_few_surely_wrong_answers_are_doubt_and_not_temperature() {
        let tried = Temperatures { range: 0.05..=10.0, count: 100 };
        // Right with the probability that it says, but for every second, of which it is sure and one in twenty wrong.
        let answers: Vec<(Pmf, usize)> = (0..2000)
            .map(|k| {
                let p = 0.5 + 0.49 * (f64::from(k) / 2000.0);
                let wrong = f64::from((k * 7919) % 1000) >= 1000.0 * p;
                let sure = k % 2 == 0;
                let pmf = Pmf::from_weights(if sure { [1.0, 0.0] } else { [p, 1.0 - p] });
                (pmf, usize::from(if sure { k % 40 == 0 } else { wrong }))
            })
            .collect();
        let (found, loss) = Calibration::fit(&answers, |_| 1.0, &tried);
        assert!((0.75..1.3).contains(&found.temperature) && (0.04..0.25).contains(&found.doubt), "{found:?}");
        assert!(loss < 0.75 && found.is_sound(&tried), "{loss}");
        let sure = found.apply(&Pmf::from_weights([1.0, 0.0]));
        assert!((sure.probabilities()[1] - f64::from(found.doubt) / 2.0).abs() < 1e-6, "{sure:?}");
        assert_eq!(Calibration::fit(&[], |_| 1.0, &tried).0, Calibration { temperature: 1.0, doubt: 0.0 });
    }
}
