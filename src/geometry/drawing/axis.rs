//! An axis of a plot: its scale, range and marks.

use crate::units::fixed;
use std::ops::RangeInclusive;

/// An axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlotAxis {
    /// Quantity and unit.
    pub title: String,
    /// True for a logarithmic axis, which leaves out values that are not positive.
    pub logarithmic: bool,
    /// Shown range; from the points where there is none.
    pub range: Option<[f64; 2]>,
    /// Ticks with their texts, in place of numbers: for categories.
    pub ticks: Vec<(f64, String)>,
}

impl PlotAxis {
    /// Linear axis.
    pub fn linear(title: impl Into<String>) -> Self {
        Self { title: title.into(), ..Self::default() }
    }

    /// Logarithmic axis.
    pub fn logarithmic(title: impl Into<String>) -> Self {
        Self { title: title.into(), logarithmic: true, ..Self::default() }
    }

    /// Linear axis of a count, with marks at whole numbers only.
    pub fn count(title: impl Into<String>, most: usize) -> Self {
        let every = most.div_ceil(10).max(1);
        let ticks = (0..=most).step_by(every).map(|n| (n as f64, n.to_string())).collect();
        Self { ticks, ..Self::linear(title) }
    }

    /// Coordinate along the axis in which it is linear; `None` for values that it cannot show.
    pub fn coordinate(&self, value: f64) -> Option<f64> {
        let coordinate = if self.logarithmic { (value > 0.0).then(|| value.log10()) } else { Some(value) };
        coordinate.filter(|c| c.is_finite())
    }

    /// Shown range in coordinates: its own, or that of the values with a margin.
    pub(super) fn bounds(&self, values: impl Iterator<Item = f64>) -> RangeInclusive<f64> {
        if let Some([low, high]) = self.range.map(|ends| ends.map(|end| self.coordinate(end)))
            && let (Some(low), Some(high)) = (low, high)
        {
            return low..=high;
        }
        let values = values.filter_map(|value| self.coordinate(value));
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), c| (low.min(c), high.max(c)));
        if low > high {
            return 0.0..=1.0;
        }
        let margin = if high > low { MARGIN * (high - low) } else { 0.5 };
        low - margin..=high + margin
    }

    /// Marks of a range of coordinates, with their texts. Empty texts are marks between those with numbers.
    pub fn marks(&self, bounds: &RangeInclusive<f64>) -> Vec<(f64, String)> {
        let marks = if !self.ticks.is_empty() {
            self.ticks.iter().filter_map(|(at, text)| Some((self.coordinate(*at)?, text.clone()))).collect()
        } else if self.logarithmic {
            logarithmic_marks(bounds)
        } else {
            linear_marks(bounds)
        };
        marks.into_iter().filter(|(at, _)| bounds.contains(at)).collect()
    }
}

/// Room beyond the outermost points, as a share of their range.
const MARGIN: f64 = 0.07;

/// Decades, with their multiples; narrow ranges have numbers at some multiples too.
fn logarithmic_marks(bounds: &RangeInclusive<f64>) -> Vec<(f64, String)> {
    let (first, last) = (bounds.start().floor() as i32, bounds.end().ceil() as i32);
    let decades = bounds.end() - bounds.start();
    let every = (decades / 7.0).ceil().max(1.0) as i32;
    let marks = (first..=last).flat_map(|decade| {
        (1..10).filter_map(move |factor| {
            let value = f64::from(factor) * 10f64.powi(decade);
            let numbered = match factor {
                1 => decade.rem_euclid(every) == 0,
                2 | 5 => decades < 1.7,
                3 => decades < 0.7,
                _ => decades < 0.5,
            };
            let text = if numbered { number(value) } else { String::new() };
            (decades < 7.0 || numbered).then_some((value.log10(), text))
        })
    });
    marks.collect()
}

/// Round numbers: multiples of 1, 2 or 5 times a power of ten.
fn linear_marks(bounds: &RangeInclusive<f64>) -> Vec<(f64, String)> {
    const MOST: f64 = 6.0;
    let least = (bounds.end() - bounds.start()).max(f64::MIN_POSITIVE) / MOST;
    let power = 10f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|f| f * power).find(|step| *step >= least).unwrap_or(least);
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    let (first, last) = ((bounds.start() / step).ceil() as i64, (bounds.end() / step).floor() as i64);
    (first..=last).map(|n| (n as f64 * step, fixed(n as f64 * step, decimals))).collect()
}

/// Number at a mark of a logarithmic axis.
fn number(value: f64) -> String {
    // The product of a factor and a power of ten may lie just below a power of ten.
    let exponent = (value.log10() + 1e-9).floor() as i32;
    match exponent {
        -3..0 => format!("{value:.*}", exponent.unsigned_abs() as usize),
        0..5 => format!("{value:.0}"),
        _ => format!("{value:.0e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(axis: &PlotAxis, bounds: RangeInclusive<f64>) -> Vec<String> {
        axis.marks(&bounds).into_iter().map(|(_, text)| text).filter(|text| !text.is_empty()).collect()
    }

    #[test]
    fn marks_are_round_numbers() {
        let linear = PlotAxis::linear("F1");
        assert_eq!(texts(&linear, 0.78..=1.0), ["0.80", "0.85", "0.90", "0.95", "1.00"]);
        assert_eq!(texts(&linear, -3.0..=12.0), ["0", "5", "10"]);
        let logarithmic = PlotAxis::logarithmic("ms");
        assert_eq!(texts(&logarithmic, -2.2..=1.1), ["0.01", "0.1", "1", "10"]);
        assert_eq!(texts(&logarithmic, 0.2..=1.1), ["2", "5", "10"]);
        assert_eq!(texts(&logarithmic, -0.8..=0.35), ["0.2", "0.5", "1", "2"]);
        assert_eq!(texts(&logarithmic, 1.6..=1.97), ["40", "50", "60", "70", "80", "90"]);
        assert_eq!(texts(&logarithmic, -6.0..=5.0), ["1e-6", "1e-4", "0.01", "1", "100", "10000"][..].to_vec());
        let named = PlotAxis { ticks: vec![(0.0, "ball".to_owned()), (9.0, "box".to_owned())], ..linear };
        assert_eq!(texts(&named, -0.5..=1.5), ["ball"]);
    }
}
