//! One rate for all trials: x(t) = x_k + (x_k+1 - x_k) (t - t_k) / (t_k+1 - t_k) between neighbouring samples.
//!
//! A trial that already runs at the common rate is not touched: its samples count as even while none is further from
//! its place than [`EVEN`] of a step, which forgives times rounded to milliseconds at 100 Hz. Reducing a rate drops
//! what lies above half of the new one without a filter; grasps are slow enough for that.

use crate::series::LONGEST_PAUSE;

/// Largest distance of a sample from its even place, in steps. Tuned: at a tenth, interpolation would change a reading
/// by less than a tenth of its step to the next.
const EVEN: f64 = 0.1;

/// Rates this close are one rate, as part of the larger. Wide enough for clocks and for [`sensible`].
const SAME_RATE: f64 = 0.02;

/// A rate may be moved by this part to get a round number.
const ROUNDING: f64 = 0.01;

/// Highest rate (Hz).
pub(super) const FASTEST_HZ: f64 = 1000.0;

/// Typical rate of rising times (Hz): the median interval, made precise by the mean of all intervals within half of it,
/// so that neither pauses nor times rounded to milliseconds bend it. Needs two times.
pub(super) fn rate(t_s: &[f64]) -> f64 {
    /// Above any sensor's, so that the smallest intervals of all still give a number (Hz).
    const CEILING_HZ: f64 = 1e9;
    let mut intervals: Vec<f64> = t_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = intervals.len() / 2;
    let median = *intervals.select_nth_unstable_by(middle, f64::total_cmp).1;
    let usual = || intervals.iter().filter(|d| (*d - median).abs() <= 0.5 * median);
    let mean = usual().sum::<f64>() / usual().count() as f64;
    mean.recip().min(CEILING_HZ)
}

/// The rate for all trials (Hz), given one rate or more: their median, rounded, within bounds.
pub(super) fn common_rate(rates: &mut [f64]) -> f64 {
    // Of two middle ones the lower, so that one trial has the common rate.
    let middle = (rates.len() - 1) / 2;
    sensible(*rates.select_nth_unstable_by(middle, f64::total_cmp).1).min(FASTEST_HZ)
}

/// A multiple of five or a whole number where that is near, or else three digits.
fn sensible(hz: f64) -> f64 {
    let near = |step: f64| Some((hz / step).round() * step).filter(|r| *r > 0.0 && (r - hz).abs() <= ROUNDING * hz);
    near(5.0).or_else(|| near(1.0)).unwrap_or_else(|| three_digits(hz))
}

/// Rounds to three digits.
pub(super) fn three_digits(x: f64) -> f64 {
    format!("{x:.2e}").parse().unwrap_or(x)
}

/// True when times are even steps at `rate_hz`, or nearly so at nearly that rate.
pub(super) fn runs_at(t_s: &[f64], rate_hz: f64) -> bool {
    let own_hz = (t_s.len() - 1) as f64 / span(t_s);
    let on_grid = |hz: f64| t_s.iter().enumerate().all(|(k, t)| ((t - t_s[0]) * hz - k as f64).abs() <= EVEN);
    on_grid(rate_hz) || ((own_hz - rate_hz).abs() <= SAME_RATE * rate_hz && on_grid(own_hz))
}

/// From the first to the last time (s).
pub(super) fn span(t_s: &[f64]) -> f64 {
    t_s[t_s.len() - 1] - t_s[0]
}

/// How many even samples fit in; as a float, because one wild time makes it larger than any memory.
pub(super) fn even_samples(t_s: &[f64], rate_hz: f64) -> f64 {
    /// A last sample that is late by rounding only still counts, in steps.
    const ROUNDED: f64 = 1e-6;
    (span(t_s) * rate_hz + ROUNDED).floor() + 1.0
}

/// Readings of `width` channels interpolated at `samples` even times from the first on.
pub(super) fn resample(t_s: &[f64], values: &[f32], samples: usize, rate_hz: f64) -> (Vec<f64>, Vec<f32>) {
    let width = values.len() / t_s.len();
    let mut times: Vec<f64> = (0..samples).map(|k| t_s[0] + k as f64 / rate_hz).collect();
    let mut even = Vec::with_capacity(samples * width);
    let mut left = 0;
    // Where nothing was read for long, nothing is known.
    let longest = LONGEST_PAUSE / rate(t_s);
    for t in &mut times {
        while left + 2 < t_s.len() && t_s[left + 1] <= *t {
            left += 1;
        }
        let (before, after) = (t_s[left], t_s[left + 1]);
        let mut part = ((*t - before) / (after - before)).clamp(0.0, 1.0);
        // A sample that is there already stays as it is.
        if let Some(own) = [before, after].into_iter().find(|own| (*t - own).abs() * rate_hz < SAME_TIME) {
            (*t, part) = (own, if own == before { 0.0 } else { 1.0 });
        }
        let rows = &values[left * width..(left + 2) * width];
        let is_known = after - before <= longest || part <= 0.0 || part >= 1.0;
        even.extend((0..width).map(|c| if is_known { mix(rows[c], rows[c + width], part) } else { f32::NAN }));
    }
    (times, even)
}

/// Times this close are one, in steps.
const SAME_TIME: f64 = 1e-6;

fn mix(before: f32, after: f32, part: f64) -> f32 {
    if part <= 0.0 {
        return before;
    }
    if part >= 1.0 {
        return after;
    }
    let (before, after) = (f64::from(before), f64::from(after));
    (before + (after - before) * part) as f32
}

/// Interpolates the NaNs of one channel over time where at most three of its readings are missing; before the first and
/// after the last reading it holds that one as long. Returns how many there were, or `None` if nothing else was there.
pub(super) fn fill_short_gaps(t_s: &[f64], values: &mut [f32], channel: usize) -> Option<usize> {
    let width = values.len() / t_s.len();
    let at = |sample: usize| sample * width + channel;
    let known: Vec<usize> = (0..t_s.len()).filter(|sample| !values[at(*sample)].is_nan()).collect();
    let (first, last) = (*known.first()?, *known.last()?);
    if known.len() == t_s.len() {
        return Some(0);
    }
    let own: Vec<f64> = known.iter().map(|sample| t_s[*sample]).collect();
    let usual = if own.len() > 1 { rate(&own) } else { rate(t_s) };
    let longest = LONGEST_PAUSE / usual;
    let mut filled = 0;
    let mut fill = |from: usize, to: usize, gap: std::ops::Range<usize>| {
        if t_s[to.max(gap.end - 1)] - t_s[from.min(gap.start)] > longest {
            return;
        }
        for sample in gap {
            let part = if from == to { 0.0 } else { (t_s[sample] - t_s[from]) / (t_s[to] - t_s[from]) };
            values[at(sample)] = mix(values[at(from)], values[at(to)], part);
            filled += 1;
        }
    };
    if first > 0 {
        fill(first, first, 0..first);
    }
    for pair in known.windows(2).filter(|pair| pair[1] > pair[0] + 1) {
        fill(pair[0], pair[1], pair[0] + 1..pair[1]);
    }
    if last + 1 < t_s.len() {
        fill(last, last, last + 1..t_s.len());
    }
    Some(filled)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps(count: usize, hz: f64) -> Vec<f64> {
        (0..count).map(|k| k as f64 / hz).collect()
    }

    #[test]
    fn a_rate_survives_rounding_and_pauses() {
        let mut times: Vec<f64> = steps(300, 30.0).iter().map(|t| (t * 1000.0).round() / 1000.0).collect();
        times.extend(steps(300, 30.0).iter().map(|t| 60.0 + t));
        assert!((rate(&times) - 30.0).abs() < 0.02, "{}", rate(&times));
        assert!(rate(&[0.0, f64::from_bits(1)]).is_finite());
    }

    #[test]
    fn common_rates_are_round() {
        let common = |rates: &[f64]| common_rate(&mut rates.to_vec());
        assert_eq!(common(&[74.98]), 75.0);
        assert_eq!(common(&[50.0, 99.6, 100.2]), 100.0);
        assert_eq!(common(&[50.0, 100.0]), 50.0);
        assert_eq!(common(&[7.512345]), 7.51);
        assert_eq!(common(&[48_000.0]), 1000.0);
        assert_eq!(common(&[5.12345e-12]), 5.12e-12);
    }

    #[test]
    fn even_times_are_known_as_such() {
        assert!(runs_at(&steps(100_000, 74.98), 75.0));
        let rounded: Vec<f64> = steps(500, 75.0).iter().map(|t| (t * 1000.0).round() / 1000.0).collect();
        assert!(runs_at(&rounded, 75.0));
        assert!(!runs_at(&steps(50, 50.0), 75.0));
        assert!(!runs_at(&[0.0, 0.01, 0.025, 0.03], 100.0));
    }

    #[test]
    fn a_straight_line_stays_one() {
        let times = [1.0, 1.13, 1.2, 1.55, 2.0];
        let values: Vec<f32> = times.iter().flat_map(|t| [*t as f32, -2.0 * *t as f32]).collect();
        assert_eq!(even_samples(&times, 10.0), 11.0);
        let (even, read) = resample(&times, &values, 11, 10.0);
        for (k, t) in even.iter().enumerate() {
            assert!((t - 1.0 - 0.1 * k as f64).abs() < 1e-12);
            assert!((f64::from(read[2 * k]) - t).abs() < 1e-6 && (f64::from(read[2 * k + 1]) + 2.0 * t).abs() < 1e-6);
        }
    }

    #[test]
    fn short_gaps_are_filled_over_time_and_long_ones_stay() {
        const GAP: f32 = f32::NAN;
        let times = [0.0, 1.0, 2.0, 5.0, 6.0];
        let mut values = [GAP, 9.0, 1.0, 8.0, GAP, GAP, 5.0, GAP, GAP, GAP];
        assert_eq!(fill_short_gaps(&times, &mut values, 0), Some(3));
        assert_eq!(fill_short_gaps(&times, &mut values, 1), Some(0), "six seconds at one a second");
        let gaps: Vec<usize> = (0..values.len()).filter(|k| values[*k].is_nan()).collect();
        assert_eq!((gaps, [0, 2, 4, 6, 8].map(|k| values[k])), (vec![5, 7, 9], [1.0, 1.0, 2.0, 5.0, 5.0]));
        assert_eq!(fill_short_gaps(&times[..1], &mut [GAP], 0), None);
    }

    #[test]
    fn nothing_is_read_into_a_pause() {
        let times: Vec<f64> = (0..10).chain(60..70).map(|k| 0.02 * f64::from(k)).collect();
        let values: Vec<f32> = times.iter().map(|t| *t as f32).collect();
        let (even, read) = resample(&times, &values, 70, 50.0);
        for (t, value) in even.iter().zip(read) {
            let known = *t < 0.19 || *t > 1.19;
            assert!(if known { (f64::from(value) - t).abs() < 1e-6 } else { value.is_nan() }, "{t}: {value}");
        }
    }
}
