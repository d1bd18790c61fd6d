//! A figure: plots beside each other, as plain data. Drawn to files by `palpate-render`, and by the window.
//!
//! Colours are numbers into [`series_colour`](crate::palette::series_colour), so that a series has the same colour in
//! every theme.

use super::axis::PlotAxis;
use super::heat_map::HeatMap;
use crate::palette::SERIES_COLOURS;
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
    /// One legend above all plots, in place of each plot's own; these series have no points.
    pub legend: Vec<DataSeries>,
    /// Remark below all plots, such as the command that repeats the measurement.
    pub note: String,
}

/// Axes with series of points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plot {
    pub title: String,
    /// Horizontal axis.
    pub x: PlotAxis,
    /// Vertical axis.
    pub y: PlotAxis,
    /// Reference lines, below all series.
    pub references: Vec<ReferenceLine>,
    /// Cells of colour, which give the axes; below everything else.
    pub heat: Option<HeatMap>,
    /// Filled bands, below all series.
    pub bands: Vec<SpreadBand>,
    /// Series; later ones are drawn over earlier ones.
    pub series: Vec<DataSeries>,
    /// True where spreads are those of x: plots with a named row for each point.
    pub sideways: bool,
}

/// A filled band, such as a mean with its spread.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SpreadBand {
    /// Number of its colour.
    pub colour: usize,
    /// Points in the order of x: x, lower edge, upper edge.
    pub points: Vec<[f64; 3]>,
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
    pub points: Vec<DataPoint>,
}

/// A point of a series.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DataPoint {
    /// Its place: x, y.
    pub at: [f64; 2],
    /// Spread of y, or of x where the plot is sideways, drawn as a thin bar.
    pub spread: Option<[f64; 2]>,
    /// Text beside it; none where empty.
    pub label: String,
}

/// Line of a series.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LineStyle {
    #[default]
    None,
    Thin,
    Bold,
    /// Thin and dashed.
    Dashed,
}

/// Sign at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Marker {
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

impl Marker {
    /// Sign of a series by its number, filled. It changes where the colours begin again.
    pub fn of_series(number: usize) -> Self {
        if (number / SERIES_COLOURS).is_multiple_of(2) { Self::Dot } else { Self::Square }
    }
}

impl DataPoint {
    /// A point without spread and label.
    pub fn new(x: f64, y: f64) -> Self {
        Self { at: [x, y], ..Self::default() }
    }
}

impl Plot {
    /// A heat map as a plot. Its vertical axis points down, as its rows do.
    pub fn of_heat_map(heat: HeatMap) -> Self {
        let title = heat.title.clone();
        Self { title, x: heat.x.plot_axis(), y: heat.y.plot_axis(), heat: Some(heat), ..Self::default() }
    }

    /// Shown ranges of both axes in coordinates ([`PlotAxis::coordinate`]). Cells of colour fill the axes; their rows
    /// count down.
    pub fn bounds(&self) -> [RangeInclusive<f64>; 2] {
        if let Some(heat) = &self.heat {
            let ([left, right], [top, bottom]) = (heat.x.range, heat.y.range);
            return [left..=right, -bottom..=-top];
        }
        let points = self.series.iter().flat_map(|series| &series.points);
        let places: Vec<[f64; 2]> =
            points.flat_map(|point| self.spread(point).into_iter().flatten().chain([point.at])).collect();
        let lines =
            |horizontal| self.references.iter().filter(move |line| line.horizontal == horizontal).map(|line| line.at);
        let bands = || self.bands.iter().flat_map(|band| &band.points);
        let edges = bands().flat_map(|[_, low, high]| [*low, *high]);
        let x = places.iter().map(|at| at[0]).chain(bands().map(|at| at[0]));
        let y = places.iter().map(|at| at[1]).chain(edges);
        [self.x.bounds(x.chain(lines(false))), self.y.bounds(y.chain(lines(true)))]
    }

    /// Ends of a point's spread, as values of x and y.
    pub fn spread(&self, point: &DataPoint) -> Option<[[f64; 2]; 2]> {
        let [x, y] = point.at;
        point.spread.map(|ends| ends.map(|end| if self.sideways { [end, y] } else { [x, end] }))
    }

    /// Marks of the vertical axis, with their texts.
    pub fn y_marks(&self, bounds: &RangeInclusive<f64>) -> Vec<(f64, String)> {
        if self.heat.is_none() {
            return self.y.marks(bounds);
        }
        let down = self.y.marks(&(-bounds.end()..=-bounds.start()));
        down.into_iter().map(|(at, text)| (-at, text)).collect()
    }

    /// Place of a point in coordinates; `None` where an axis cannot show it.
    pub fn place(&self, at: [f64; 2]) -> Option<[f64; 2]> {
        let sign = if self.heat.is_some() { -1.0 } else { 1.0 };
        Some([self.x.coordinate(at[0])?, sign * self.y.coordinate(at[1])?])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let row = DataPoint { spread: Some([20.0, 60.0]), ..DataPoint::new(40.0, 3.0) };
        let series = vec![DataSeries { points: vec![row.clone()], ..DataSeries::default() }];
        let plot = Plot { sideways: true, series, ..Plot::default() };
        assert!(plot.bounds()[0].contains(&20.0) && !plot.bounds()[1].contains(&20.0), "{:?}", plot.bounds());
        assert_eq!(plot.spread(&row), Some([[20.0, 3.0], [60.0, 3.0]]));
    }
}
