//! A figure: plots beside each other, as plain data. Drawn to files by `palpate-render`, and by the window.
//!
//! Colours are numbers into [`series_colour`](crate::palette::series_colour), so that a series has the same colour in
//! every theme.

use std::ops::RangeInclusive;

/// A figure: plots beside each other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figure {
    /// Title, above all plots.
    pub title: String,
    /// The plots, from left to right, row by row.
    pub plots: Vec<Plot>,
    /// Plots in a row; all of them where zero.
    pub columns: usize,
    /// Remark below all plots, such as the command that repeats the measurement.
    pub note: String,
}

/// Axes with series of points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plot {
    /// Title.
    pub title: String,
    /// Horizontal axis.
    pub x: PlotAxis,
    /// Vertical axis.
    pub y: PlotAxis,
    /// Reference lines, below all series.
    pub references: Vec<ReferenceLine>,
    /// Series; later ones are drawn over earlier ones.
    pub series: Vec<DataSeries>,
}

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

/// A straight line across a plot.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceLine {
    /// True for a horizontal line at a value of y, false for a vertical one at a value of x.
    pub horizontal: bool,
    /// Value on its axis.
    pub at: f64,
    /// Text on the line.
    pub text: String,
}

/// Points that belong together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DataSeries {
    /// Name in the legend; none where empty.
    pub name: String,
    /// Number of its colour.
    pub colour: usize,
    /// Line through the points, in their order.
    pub line: LineStyle,
    /// Sign at each point.
    pub marker: Marker,
    /// The points.
    pub points: Vec<DataPoint>,
}

/// A point of a series.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DataPoint {
    /// Its place: x, y.
    pub at: [f64; 2],
    /// Spread of y, drawn as a thin bar.
    pub spread: Option<[f64; 2]>,
    /// Text beside it; none where empty.
    pub label: String,
}

/// Line of a series.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LineStyle {
    /// None.
    #[default]
    None,
    /// Thin.
    Thin,
    /// Bold.
    Bold,
}

/// Sign at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Marker {
    /// None.
    #[default]
    None,
    /// Filled circle.
    Dot,
    /// Open circle.
    Ring,
    /// Filled square.
    Square,
    /// Cross: something failed.
    Cross,
}

impl DataPoint {
    /// A point without spread and label.
    pub fn new(x: f64, y: f64) -> Self {
        Self { at: [x, y], ..Self::default() }
    }
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

    /// Coordinate along the axis in which it is linear; `None` for values that it cannot show.
    pub fn coordinate(&self, value: f64) -> Option<f64> {
        let coordinate = if self.logarithmic { (value > 0.0).then(|| value.log10()) } else { Some(value) };
        coordinate.filter(|c| c.is_finite())
    }

    /// Shown range in coordinates: its own, or that of the values with a margin.
    fn bounds(&self, values: impl Iterator<Item = f64>) -> RangeInclusive<f64> {
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

/// Decades, with their multiples; a narrow range has numbers at 2 and 5 too.
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
                _ => false,
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
    (first..=last).map(|n| (n as f64 * step, format!("{:.decimals$}", n as f64 * step))).collect()
}

/// Number at a mark of a logarithmic axis.
fn number(value: f64) -> String {
    let exponent = value.log10().round() as i32;
    match exponent {
        -3..0 => format!("{value:.*}", exponent.unsigned_abs() as usize + 1).trim_end_matches('0').to_owned(),
        0..5 => format!("{value:.0}"),
        _ => format!("{value:.0e}"),
    }
}

impl Plot {
    /// Shown ranges of both axes in coordinates ([`PlotAxis::coordinate`]).
    pub fn bounds(&self) -> [RangeInclusive<f64>; 2] {
        let points = || self.series.iter().flat_map(|series| &series.points);
        let lines =
            |horizontal| self.references.iter().filter(move |line| line.horizontal == horizontal).map(|line| line.at);
        let spreads = points().flat_map(|point| point.spread.into_iter().flatten());
        [
            self.x.bounds(points().map(|point| point.at[0]).chain(lines(false))),
            self.y.bounds(points().map(|point| point.at[1]).chain(spreads).chain(lines(true))),
        ]
    }

    /// Place of a point in coordinates; `None` where an axis cannot show it.
    pub fn place(&self, at: [f64; 2]) -> Option<[f64; 2]> {
        Some([self.x.coordinate(at[0])?, self.y.coordinate(at[1])?])
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
        assert_eq!(texts(&logarithmic, -6.0..=5.0), ["1e-6", "1e-4", "0.01", "1", "100", "10000"][..].to_vec());
        let named = PlotAxis { ticks: vec![(0.0, "ball".to_owned()), (9.0, "box".to_owned())], ..linear };
        assert_eq!(texts(&named, -0.5..=1.5), ["ball"]);
    }

    #[test]
    fn ranges_hold_all_that_can_be_shown() {
        let mut plot = Plot { x: PlotAxis::logarithmic(""), y: PlotAxis::linear(""), ..Plot::default() };
        assert_eq!(plot.bounds(), [0.0..=1.0, 0.0..=1.0]);
        let spread = DataPoint { spread: Some([-1.0, 4.0]), ..DataPoint::new(100.0, 3.0) };
        let points = vec![DataPoint::new(1.0, 2.0), spread, DataPoint::new(0.0, f64::NAN)];
        plot.series.push(DataSeries { points, ..DataSeries::default() });
        let [x, y] = plot.bounds();
        assert!(x.contains(&0.0) && x.contains(&2.0) && !x.contains(&-0.2) && !x.contains(&2.2), "{x:?}");
        assert!(y.contains(&-1.0) && y.contains(&4.0) && *y.end() < 5.0, "{y:?}");
        assert_eq!((plot.place([10.0, 5.0]), plot.place([0.0, 5.0])), (Some([1.0, 5.0]), None));
        plot.x.range = Some([1.0, 10.0]);
        assert_eq!(plot.bounds()[0], 0.0..=1.0);
    }
}
