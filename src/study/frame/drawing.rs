//! Figures that studies draw from their tables: plots by a facet, series, and points that lead to rows and their trials.

use super::groups::{grouped, unique};
use super::report::{FigureLink, FigureMark, LinkedFigure, StudyReport, StudyTable};
use palpate_geometry::drawing::{
    CellAxis, ColourScale, DataPoint, DataSeries, Figure, HeatMap, LineStyle, Marker, Plot, PlotAxis, ReferenceLine,
};
use palpate_geometry::palette::SERIES_COLOURS;
use palpate_sim::objects::object_title;

/// Heading of columns of shares in plots.
pub(crate) const F1_PERCENT: &str = "macro F1 (%)";

/// Row of a table.
#[derive(Clone, Copy)]
pub(crate) struct TableLine<'a> {
    pub(crate) table: &'a StudyTable,
    pub(crate) row: usize,
}

impl<'a> TableLine<'a> {
    /// Text in a column.
    pub(crate) fn text(self, column: &str) -> &'a str {
        self.table.text(self.row, column)
    }

    /// Number in a column; not a number where there is none.
    pub(crate) fn value(self, column: &str) -> f64 {
        self.table.cell(self.row, column).value().unwrap_or(f64::NAN)
    }

    /// Its point at x: a column in percent with its interval.
    pub(crate) fn percent(self, column: &str, x: f64) -> DataPoint {
        let spread = self.table.cell(self.row, column).spread().map(|ends| ends.map(|end| 100.0 * end));
        DataPoint { spread, ..DataPoint::new(x, 100.0 * self.value(column)) }
    }

    /// The same on its side: the column is x, the row stands at y.
    pub(crate) fn percent_row(self, column: &str, y: f64) -> DataPoint {
        let DataPoint { at: [_, x], spread, .. } = self.percent(column, y);
        DataPoint { spread, ..DataPoint::new(x, y) }
    }
}

/// Axis of named rows, the first at the top: places 0, -1, -2 and so on.
pub(crate) fn named_rows(names: &[String]) -> PlotAxis {
    let ticks = names.iter().enumerate().map(|(k, name)| (-(k as f64), name.clone())).collect();
    PlotAxis { ticks, range: Some([0.6 - names.len() as f64, 0.6]), ..PlotAxis::default() }
}

/// Axis of named columns at 0, 1, 2 and so on.
fn named_columns(title: &str, names: &[String]) -> PlotAxis {
    let ticks = names.iter().enumerate().map(|(k, name)| (k as f64, name.clone())).collect();
    PlotAxis { ticks, range: Some([-0.5, names.len() as f64 - 0.5]), ..PlotAxis::linear(title) }
}

/// Series of a colour with a dot at each point.
pub(crate) fn dots(colour: usize) -> DataSeries {
    DataSeries { colour, marker: Marker::Dot, ..DataSeries::default() }
}

/// Series of a colour with a line, bold or thin; dashed where the colours begin again.
pub(crate) fn lines(colour: usize, bold: bool) -> DataSeries {
    let line = match bold {
        true => LineStyle::Bold,
        false if colour < SERIES_COLOURS => LineStyle::Thin,
        false => LineStyle::Dashed,
    };
    DataSeries { colour, line, marker: Marker::of_series(colour), ..DataSeries::default() }
}

/// Places of rows along an axis.
pub(crate) enum Along<'a> {
    /// Named rows from top to bottom.
    Rows(&'a dyn Fn(TableLine<'_>) -> String),
    /// Named columns below a title.
    Columns(&'a str, &'a dyn Fn(TableLine<'_>) -> String),
    /// Numbers.
    Axis(&'a dyn Fn(&[TableLine<'_>]) -> PlotAxis, &'a dyn Fn(TableLine<'_>) -> f64),
}

/// Figure of shares, mostly the macro F1, of the rows of a table, by facets.
pub(crate) struct Facets<'a> {
    /// Title of the plot of a row.
    pub(crate) plot: &'a dyn Fn(TableLine<'_>) -> String,
    /// Name of the series of a row.
    pub(crate) series: &'a dyn Fn(TableLine<'_>) -> String,
    /// Column of shares, and the heading of its axis.
    pub(crate) value: (&'a str, &'a str),
    /// Its place.
    pub(crate) along: Along<'a>,
    /// Shift from one series to the next, where several have a point at the same place.
    pub(crate) shift: f64,
    /// Look of a series by its name and number.
    pub(crate) look: &'a dyn Fn(&str, usize) -> DataSeries,
    /// True where a series is named in its first plot alone.
    pub(crate) named_once: bool,
    /// Plots in a row.
    pub(crate) columns: usize,
    /// Width and height of files (points).
    pub(crate) size: [u32; 2],
    pub(crate) note: &'a str,
    /// Line across the plot with a title.
    pub(crate) reference: &'a dyn Fn(&str) -> Option<ReferenceLine>,
}

impl Facets<'_> {
    /// A plot for each sensor model, a row for each method, a colour for each model.
    pub(crate) const USUAL: Facets<'static> = Facets {
        plot: &|line| format!("{} sensors", line.text("sensors")),
        series: &|line| line.text("model").to_owned(),
        value: ("F1", F1_PERCENT),
        along: Along::Rows(&|line| line.text("model").to_owned()),
        shift: 0.0,
        look: &|_, colour| dots(colour),
        named_once: false,
        columns: 2,
        size: [1080, 720],
        note: "Macro F1 after one grasp with 95 % intervals, by bootstrap over test grasps.",
        reference: &|_| None,
    };

    /// The figure of a table, by the same name; none where the report lacks it.
    pub(crate) fn figure(&self, report: &StudyReport, name: &str) -> Option<LinkedFigure> {
        Some(self.plots(report, name)?.figure(name, self.columns, self.size, self.note))
    }

    /// Its plots, to add to.
    pub(crate) fn plots<'a>(&self, report: &'a StudyReport, name: &str) -> Option<LinkedPlots<'a>> {
        let mut figure = LinkedPlots::of(report, name)?;
        figure.named_once = self.named_once;
        figure.add_facets(self);
        Some(figure)
    }
}

/// A series for each look, of the points with it.
pub(crate) fn series_of(marks: impl IntoIterator<Item = (DataSeries, DataPoint)>) -> Vec<DataSeries> {
    let series = |(look, points): (DataSeries, Vec<DataPoint>)| DataSeries { points, ..look };
    grouped(marks).into_iter().map(series).collect()
}

/// Plots by their titles, each with a series for each look: title, look and point of each mark.
pub(crate) fn plots_of(axes: &Plot, marks: impl IntoIterator<Item = (String, DataSeries, DataPoint)>) -> Vec<Plot> {
    let marks = marks.into_iter().map(|(title, look, point)| (title, (look, point)));
    let plot = |(title, marks): (String, Vec<_>)| Plot { title, series: series_of(marks), ..axes.clone() };
    grouped(marks).into_iter().map(plot).collect()
}

/// A figure in the making, whose points lead to the rows of a table.
pub(crate) struct LinkedPlots<'a> {
    pub(crate) plots: Vec<Plot>,
    /// Title, at first that of the table.
    pub(crate) title: String,
    /// True where a series is named in its first plot alone.
    pub(crate) named_once: bool,
    at: usize,
    table: &'a StudyTable,
    links: Vec<FigureLink>,
}

impl<'a> LinkedPlots<'a> {
    /// A figure of a table; none where the report lacks it.
    pub(crate) fn of(report: &'a StudyReport, table: &str) -> Option<Self> {
        let (at, table) = report.table(table)?;
        Some(Self { plots: Vec::new(), title: table.title.clone(), named_once: false, at, table, links: Vec::new() })
    }

    /// All rows.
    pub(crate) fn lines(&self) -> impl Iterator<Item = TableLine<'a>> + use<'a> {
        let table = self.table;
        (0..table.rows.len()).map(move |row| TableLine { table, row })
    }

    /// Rows with certain texts in some columns.
    pub(crate) fn lines_with(&self, wanted: &[(&str, &str)]) -> Vec<TableLine<'a>> {
        self.lines().filter(|line| wanted.iter().all(|(column, text)| line.text(column) == *text)).collect()
    }

    /// Adds a series to the last plot, unless it has no point.
    pub(crate) fn series(
        &mut self,
        mut series: DataSeries,
        points: impl IntoIterator<Item = (TableLine<'a>, DataPoint)>,
    ) {
        let Some((plot, before)) = self.plots.split_last_mut() else { return };
        if self.named_once && before.iter().flat_map(|plot| &plot.series).any(|own| own.name == series.name) {
            series.name.clear();
        }
        for (line, point) in points {
            let mark = FigureMark::Point(plot.series.len(), series.points.len());
            self.links.push(FigureLink { plot: before.len(), mark, table: self.at, row: line.row });
            series.points.push(point);
        }
        if !series.points.is_empty() {
            plot.series.push(series);
        }
    }

    /// Adds a plot for each facet.
    fn add_facets(&mut self, facets: &Facets<'_>) {
        let all = unique(self.lines().map(facets.series));
        for (title, lines) in grouped(self.lines().map(|line| ((facets.plot)(line), line))) {
            let names = match facets.along {
                Along::Rows(name) | Along::Columns(_, name) => unique(lines.iter().map(|line| name(*line))),
                Along::Axis(..) => Vec::new(),
            };
            let (column, heading) = facets.value;
            let share = PlotAxis::linear(heading);
            let (x, y, sideways) = match facets.along {
                Along::Rows(_) => (share, named_rows(&names), true),
                Along::Columns(title, _) => (named_columns(title, &names), share, false),
                Along::Axis(axis, _) => (axis(&lines), share, false),
            };
            let references = (facets.reference)(&title).into_iter().collect();
            self.plots.push(Plot { title, x, y, sideways, references, ..Plot::default() });
            let place = |name: String| names.iter().position(|own| *own == name).unwrap_or(0) as f64;
            let along = |line: TableLine<'_>| match facets.along {
                Along::Rows(name) => -place(name(line)),
                Along::Columns(_, name) => place(name(line)),
                Along::Axis(_, value) => value(line),
            };
            for (number, name) in all.iter().enumerate() {
                let own = lines.iter().filter(|line| (facets.series)(**line) == *name);
                let points = own.map(|line| {
                    // Series beside each other, around the place.
                    let here = |own: &&String| {
                        lines.iter().any(|other| along(*other) == along(*line) && (facets.series)(*other) == **own)
                    };
                    let (before, after) =
                        (all[..number].iter().filter(here).count(), all[number + 1..].iter().filter(here).count());
                    let at = along(*line) + 0.5 * facets.shift * (before as f64 - after as f64);
                    let point = if sideways { line.percent_row(column, at) } else { line.percent(column, at) };
                    (*line, point)
                });
                self.series(DataSeries { name: name.clone(), ..(facets.look)(name, number) }, points);
            }
        }
    }

    /// The figure.
    pub(crate) fn figure(self, name: &str, columns: usize, size: [u32; 2], note: impl Into<String>) -> LinkedFigure {
        let figure = Figure { title: self.title, plots: self.plots, columns, note: note.into(), ..Figure::default() };
        LinkedFigure { name: name.to_owned(), figure, size, links: self.links }
    }
}

/// Figure of the confusion matrices of a table, those of kinds of grasps that `title` names.
pub(crate) fn confusion_figure(
    report: &StudyReport,
    name: &str,
    title: impl Fn(&str) -> Option<String>,
    size: [u32; 2],
    note: &str,
) -> Option<LinkedFigure> {
    let mut figure = LinkedPlots::of(report, name)?;
    let (table, at) = (figure.table, figure.at);
    for (kind, title) in table.texts("grasps").into_iter().filter_map(|kind| Some((kind, title(kind)?))) {
        let rows = table.rows_with(&[("grasps", kind)]);
        let (plot, links) = confusion_plot((table, at), &rows, &title, figure.plots.len());
        figure.plots.push(plot);
        figure.links.extend(links);
    }
    Some(figure.figure(name, 2, size, note))
}

/// Most classes whose names fit below the columns.
const FEW: usize = 4;

/// Confusion matrix of some rows of a table with the columns "true", "predicted" and "share": a share of each true class
/// for every cell. Of many classes rows are numbered, so that columns need no names. `plot` is its number in the figure.
fn confusion_plot(
    (table, at): (&StudyTable, usize),
    rows: &[usize],
    title: &str,
    plot: usize,
) -> (Plot, Vec<FigureLink>) {
    let names = |column: &'static str| rows.iter().map(move |row| table.text(*row, column));
    let classes: Vec<&str> = unique(names("true").chain(names("predicted")));
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
        quantity: "share of the true class".to_owned(),
        unit: "%".to_owned(),
        x: axis("predicted"),
        y: axis("true"),
        values,
        scale: ColourScale::Share(100.0),
    };
    let mut plot = Plot::of_heat_map(heat);
    let numbered = |text: &dyn Fn(usize) -> String| (0..classes.len()).map(|k| (k as f64 + 1.0, text(k))).collect();
    if classes.len() > FEW {
        plot.x.ticks = numbered(&|k| (k + 1).to_string());
        plot.y.ticks = numbered(&|k| format!("{} {}", object_title(classes[k]), k + 1));
    } else {
        plot.x.ticks = numbered(&|k| object_title(classes[k]));
        plot.y.ticks = plot.x.ticks.clone();
    }
    (plot, links)
}
