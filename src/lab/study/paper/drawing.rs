//! Plots that several studies draw from their tables.

use super::answers::Pool;
use super::report::{Cell, FigureLink, FigureMark, PERCENT, StudyTable};
use palpate_geometry::drawing::{CellAxis, ColourScale, DataPoint, HeatMap, Plot, PlotAxis};

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

/// Axis of named columns at 0, 1, 2 and so on.
pub(super) fn named_columns(title: &str, names: &[&str]) -> PlotAxis {
    let ticks = names.iter().enumerate().map(|(k, name)| (k as f64, (*name).to_owned())).collect();
    PlotAxis { ticks, range: Some([-0.5, names.len() as f64 - 0.5]), ..PlotAxis::linear(title) }
}

/// Table of confusions, one row for each kind of grasps and pair of classes that occurs.
pub(super) fn confusion_table(name: &str, title: &str, kinds: &[(&str, &Pool)]) -> StudyTable {
    let columns = [("grasps", ""), ("true", ""), ("predicted", ""), ("count", "grasps"), ("share", PERCENT)];
    let mut table = StudyTable::new(name, title, &columns);
    for (kind, pool) in kinds {
        let cells = pool.confusions();
        for ((truth, decided), (count, trials)) in &cells {
            let of_class: usize = cells.iter().filter(|(cell, _)| cell.0 == *truth).map(|(_, (count, _))| count).sum();
            let names = [*truth, *decided].map(|class| Cell::text(&pool.classes[class]));
            let numbers = [*count as f64, *count as f64 / of_class.max(1) as f64].map(Cell::Number);
            let cells = [vec![Cell::text(*kind)], names.to_vec(), numbers.to_vec()].concat();
            table.push(cells, trials.clone());
        }
    }
    table
}

/// Confusion matrix of some rows of a table with the columns "true", "predicted" and "share": a share of each true class
/// for every cell. Rows are numbered, so that columns need no names. `plot` is its number in the figure.
pub(super) fn confusion_plot(
    (table, at): (&StudyTable, usize),
    rows: &[usize],
    title: &str,
    plot: usize,
) -> (Plot, Vec<FigureLink>) {
    let mut classes: Vec<&str> = Vec::new();
    let names = |column: &'static str| rows.iter().map(move |row| table.text(*row, column));
    for name in names("true").chain(names("predicted")) {
        if !classes.contains(&name) {
            classes.push(name);
        }
    }
    // Zero where nothing was confused.
    let mut values = vec![0.0; classes.len() * classes.len()];
    let mut links = Vec::new();
    let place = |name: &str| classes.iter().position(|class| *class == name);
    for &row in rows {
        let found = [table.text(row, "true"), table.text(row, "predicted")].map(place);
        if let [Some(truth), Some(decided)] = found {
            values[truth * classes.len() + decided] = 100.0 * table.cell(row, "share").value().unwrap_or(0.0) as f32;
            links.push(FigureLink { plot, mark: FigureMark::Cell(truth, decided), table: at, row });
        }
    }
    let axis = |name: &str| CellAxis {
        name: name.to_owned(),
        unit: String::new(),
        count: classes.len(),
        range: [0.5, classes.len() as f64 + 0.5],
    };
    let heat = HeatMap {
        title: title.to_owned(),
        quantity: "share of its trials".to_owned(),
        unit: "%".to_owned(),
        x: axis("predicted"),
        y: axis("true"),
        values,
        scale: ColourScale::Load(100.0),
    };
    let mut plot = Plot::of_heat_map(heat);
    let numbered = |text: &dyn Fn(usize) -> String| (0..classes.len()).map(|k| (k as f64 + 1.0, text(k))).collect();
    plot.x.ticks = numbered(&|k| (k + 1).to_string());
    plot.y.ticks = numbered(&|k| format!("{} {}", classes[k], k + 1));
    (plot, links)
}
