//! Plots that several studies draw from their tables.

use super::report::StudyTable;
use palpate_geometry::drawing::{DataPoint, PlotAxis};

/// Heading of columns of shares in plots.
pub(super) const F1_PERCENT: &str = "macro F1 (%)";

/// A point of a row: x, and the cell of a column in percent with its interval.
pub(super) fn percent_point(table: &StudyTable, row: usize, column: &str, x: f64) -> DataPoint {
    let cell = table.cell(row, column);
    let spread = cell.spread().map(|ends| ends.map(|end| 100.0 * end));
    DataPoint { spread, ..DataPoint::new(x, 100.0 * cell.value().unwrap_or(f64::NAN)) }
}

/// The same on its side: the cell is x, the row stands at y.
pub(super) fn percent_row(table: &StudyTable, row: usize, column: &str, y: f64) -> DataPoint {
    let DataPoint { at: [_, x], spread, .. } = percent_point(table, row, column, y);
    DataPoint { spread, ..DataPoint::new(x, y) }
}

/// Axis of named rows, the first at the top: places 0, -1, -2 and so on.
pub(super) fn named_rows(names: &[&str]) -> PlotAxis {
    let ticks = names.iter().enumerate().map(|(k, name)| (-(k as f64), (*name).to_owned())).collect();
    PlotAxis { ticks, range: Some([0.6 - names.len() as f64, 0.6]), ..PlotAxis::default() }
}
