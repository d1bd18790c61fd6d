//! Temperature that calibrates probabilities: the one that makes the true classes of held-out grasps most likely.

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
    let (low, high) = (tried.range.start(), tried.range.end());
    let candidate = |k: usize| low * (high / low).powf(k as f64 / (tried.count - 1) as f64);
    let judged = (0..tried.count).map(candidate).map(|temperature| (temperature, loss(temperature)));
    judged.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((1.0, 0.0))
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
}
