//! What a study reports: tables, findings beside the paper's claims, and figures whose points lead to trials.

use super::groups::unique;
use super::stored_study::markdown_table;
use palpate_geometry::drawing::Figure;
use palpate_geometry::units::{fixed, three_digits, true_minus};
use palpate_lab::datasets::SensorView;
use palpate_learn::metrics::Interval;
use palpate_tactile::trial::TrialId;
use serde::{Deserialize, Serialize};

/// Result of a study, as stored.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StudyReport {
    /// Fingerprint of the plan and of the recognisers.
    #[serde(default)]
    pub fingerprint: String,
    /// Data that it rests on, a line for each kind.
    pub data: Vec<String>,
    pub tables: Vec<StudyTable>,
    /// The paper's claims beside our numbers.
    pub findings: Vec<Finding>,
}

/// A table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyTable {
    /// Name in files.
    pub name: String,
    pub title: String,
    pub columns: Vec<StudyColumn>,
    pub rows: Vec<StudyRow>,
}

/// A column of a table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StudyColumn {
    /// Heading.
    pub name: String,
    /// Unit; empty for text and plain numbers.
    pub unit: String,
}

/// A row of a table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyRow {
    /// One cell for each column.
    pub cells: Vec<Cell>,
    /// Some trials behind the row, to look at.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub trials: Vec<TrialId>,
    /// Sensors through which the row was measured, where trials stand behind it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensors: Option<SensorView>,
}

/// A cell of a table. In JSON: a text, a number, an interval as an object, or null.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Cell {
    Text(String),
    /// Number in the unit of its column.
    Number(f64),
    /// Estimate with its 95 % interval.
    Interval(Interval),
    /// Not measured, or undefined.
    Missing,
}

/// A claim of the paper, and what we find.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// Section of the paper.
    pub section: String,
    /// Its claim, in short.
    pub claim: String,
    /// Our result in a sentence.
    pub found: String,
    /// The numbers behind it; of many, those that are most against the claim come first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub measured: Vec<ClaimNumber>,
    pub verdict: Agreement,
    /// Rule of the verdict, or reason of a difference.
    pub why: String,
}

/// A number behind a finding, beside the line that decides.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClaimNumber {
    /// What is measured.
    pub what: String,
    /// Its value, mostly an interval.
    pub value: Cell,
    /// Unit of the value and of the line.
    pub unit: String,
    /// Value on whose sides the verdict differs.
    pub line: f64,
}

impl ClaimNumber {
    /// A number or an interval.
    pub fn new(what: impl Into<String>, value: impl Into<Cell>, unit: &str, line: f64) -> Self {
        Self { what: what.into(), value: value.into(), unit: unit.to_owned(), line }
    }

    /// The value with its unit, for reading.
    pub fn shown(&self) -> String {
        format!("{} {}", self.value.shown(&self.unit), self.unit).trim_end().to_owned()
    }

    /// Low end, estimate, high end and line.
    pub(super) fn places(&self) -> [f64; 4] {
        let value = self.value.value().unwrap_or(f64::NAN);
        let [low, high] = self.value.spread().unwrap_or([value; 2]);
        [low, value, high, self.line]
    }
}

/// Places of low end, estimate, high end and line of a number from left to right, from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntervalStrip(pub [f64; 4]);

/// Width of a strip in text (characters).
const STRIP: usize = 24;

impl std::fmt::Display for IntervalStrip {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [low, estimate, high, line] = self.0.map(|place| (place * (STRIP - 1) as f64).round() as usize);
        let sign = |k: usize| match k {
            _ if k == estimate => '●',
            _ if k == line => '│',
            _ if (low..=high).contains(&k) => '─',
            _ => '·',
        };
        f.write_str(&(0..STRIP).map(sign).collect::<String>())
    }
}

impl Finding {
    /// Most numbers that are shown.
    pub const SHOWN: usize = 10;

    /// The numbers that are shown, each with its strip on the scale of its unit.
    pub fn strips(&self) -> impl Iterator<Item = (&ClaimNumber, IntervalStrip)> {
        let shown = &self.measured[..self.measured.len().min(Self::SHOWN)];
        shown.iter().map(|own| {
            let of_unit = shown.iter().filter(|other| other.unit == own.unit).flat_map(ClaimNumber::places);
            let (low, high) = of_unit.fold((f64::MAX, f64::MIN), |(low, high), at| (low.min(at), high.max(at)));
            (own, IntervalStrip(own.places().map(|at| (at - low) / (high - low).max(f64::MIN_POSITIVE))))
        })
    }

    /// A line on numbers that are not shown; none where all are.
    pub fn left_out(&self) -> Option<String> {
        let more = self.measured.len().checked_sub(Self::SHOWN).filter(|more| *more > 0)?;
        Some(format!("and {more} more"))
    }
}

/// Agreement of a finding with the paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Agreement {
    /// Our numbers support the claim.
    Agrees,
    /// Our numbers contradict the claim.
    Disagrees,
    /// Our numbers support a part of it, or do not decide.
    Partly,
    NotMeasured,
}

impl Agreement {
    /// Word for tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Agrees => "agrees",
            Self::Disagrees => "disagrees",
            Self::Partly => "partly",
            Self::NotMeasured => "not measured",
        }
    }

    /// Agreement with a claim that a difference is positive: settled only where its interval leaves out zero.
    pub fn of_gain(difference: Option<Interval>) -> Self {
        match difference {
            None => Self::NotMeasured,
            Some(gain) if gain.low > 0.0 => Self::Agrees,
            Some(gain) if gain.high < 0.0 => Self::Disagrees,
            Some(_) => Self::Partly,
        }
    }

    /// Agreement with several claims at once: all agree, all disagree, or something between.
    pub fn of_all(parts: impl IntoIterator<Item = Self>) -> Self {
        let measured: Vec<Self> = parts.into_iter().filter(|part| *part != Self::NotMeasured).collect();
        match measured.as_slice() {
            [] => Self::NotMeasured,
            [first, rest @ ..] if rest.iter().all(|part| part == first) => *first,
            _ => Self::Partly,
        }
    }
}

/// A figure whose marks lead to rows of tables.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkedFigure {
    /// Name in files.
    pub name: String,
    pub figure: Figure,
    /// Width and height of its files (points).
    pub size: [u32; 2],
    /// Rows behind its marks.
    pub links: Vec<FigureLink>,
}

impl LinkedFigure {
    /// A figure without links, in the width of a README.
    pub(crate) fn plain(name: &str, figure: Figure) -> Self {
        Self { name: name.to_owned(), figure, size: [960, 860], links: Vec::new() }
    }

    /// The figure with another line in its note.
    #[must_use]
    pub fn with_note(mut self, line: &str) -> Self {
        self.figure.note += &format!("\n{line}");
        self
    }
}

/// A mark of a figure, and the row of a table behind it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FigureLink {
    /// Number of the plot.
    pub plot: usize,
    pub mark: FigureMark,
    /// Number of the table.
    pub table: usize,
    /// Number of its row.
    pub row: usize,
}

/// Mark of a plot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FigureMark {
    /// Point of a series, by their numbers.
    Point(usize, usize),
    /// Row and column of a cell of a heat map.
    Cell(usize, usize),
}

impl Cell {
    /// Text of a cell.
    pub fn text(text: impl Into<String>) -> Self {
        Self::Text(text.into())
    }

    /// Estimate or number.
    pub fn value(&self) -> Option<f64> {
        match self {
            Self::Number(value) => Some(*value),
            Self::Interval(interval) => Some(interval.estimate),
            Self::Text(_) | Self::Missing => None,
        }
    }

    /// Ends of the interval.
    pub fn spread(&self) -> Option<[f64; 2]> {
        match self {
            Self::Interval(interval) => Some([interval.low, interval.high]),
            Self::Number(_) | Self::Text(_) | Self::Missing => None,
        }
    }

    /// The cell for reading, rounded. Shares are shown in percent.
    pub fn shown(&self, unit: &str) -> String {
        let scale = if [PERCENT, POINTS].contains(&unit) { 100.0 } else { 1.0 };
        let number = |value: f64| match unit {
            PERCENT => fixed(scale * value, 1),
            POINTS => true_minus(&format!("{:+.1}", scale * value)),
            "" | GRASPS if value.fract() == 0.0 => format!("{value:.0}"),
            _ => true_minus(&three_digits(value)),
        };
        match self {
            Self::Text(text) => text.clone(),
            // Smaller than what is printed, but not zero: a p-value, mostly.
            Self::Number(value) if unit.is_empty() && (f64::MIN_POSITIVE..5e-7).contains(value) => {
                "< 0.000001".to_owned()
            }
            Self::Number(value) => number(*value),
            Self::Interval(Interval { estimate, low, high }) => {
                format!("{} ({} to {})", number(*estimate), number(*low), number(*high))
            }
            Self::Missing => "-".to_owned(),
        }
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::text(text)
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<usize> for Cell {
    fn from(count: usize) -> Self {
        Self::Number(count as f64)
    }
}

impl From<Option<usize>> for Cell {
    fn from(count: Option<usize>) -> Self {
        count.map_or(Self::Missing, Self::from)
    }
}

impl From<Option<f64>> for Cell {
    fn from(value: Option<f64>) -> Self {
        value.filter(|value| value.is_finite()).map_or(Self::Missing, Self::Number)
    }
}

impl From<Option<Interval>> for Cell {
    fn from(interval: Option<Interval>) -> Self {
        interval.map_or(Self::Missing, Self::Interval)
    }
}

/// A column of rows of a study: heading, unit, and value of a row.
pub(crate) struct Column<'a, R>(pub(crate) &'static str, pub(crate) &'static str, pub(crate) &'a dyn Fn(&R) -> Cell);

impl<R> Clone for Column<'_, R> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<R> Copy for Column<'_, R> {}

/// Typed rows of a table: its name, its title, and the trials behind a row.
pub(crate) struct TableRows<'a, R> {
    name: &'a str,
    title: String,
    rows: &'a [R],
    trials: &'a dyn Fn(&R) -> Vec<TrialId>,
    sensors: &'a dyn Fn(&R) -> Option<SensorView>,
}

impl<'a, R> TableRows<'a, R> {
    /// Rows without trials behind them.
    pub(crate) fn new(name: &'a str, title: impl Into<String>, rows: &'a [R]) -> Self {
        Self { name, title: title.into(), rows, trials: &|_| Vec::new(), sensors: &|_| None }
    }

    /// The same with trials behind each row.
    pub(crate) fn with_trials(self, trials: &'a dyn Fn(&R) -> Vec<TrialId>) -> Self {
        Self { trials, ..self }
    }

    /// The same with the sensors through which each row was measured.
    pub(crate) fn read_through(self, sensors: &'a dyn Fn(&R) -> Option<SensorView>) -> Self {
        Self { sensors, ..self }
    }

    /// The table with these columns.
    pub(crate) fn columns(self, columns: &[Column<'_, R>]) -> StudyTable {
        let headings: Vec<(&str, &str)> = columns.iter().map(|Column(name, unit, _)| (*name, *unit)).collect();
        let mut table = StudyTable::new(self.name, self.title, &headings);
        for row in self.rows {
            let (cells, trials) = (columns.iter().map(|Column(.., cell)| cell(row)).collect(), (self.trials)(row));
            let sensors = (self.sensors)(row).filter(|_| !trials.is_empty());
            table.rows.push(StudyRow { cells, trials, sensors });
        }
        table
    }
}

/// Unit of columns of shares: stored from 0 to 1, shown in percent.
pub const PERCENT: &str = "%";

/// Unit of differences of shares: stored from -1 to 1, shown in percentage points.
pub const POINTS: &str = "points";
/// Unit of columns of numbers of grasps.
const GRASPS: &str = "grasps";

impl StudyColumn {
    /// Heading with its unit.
    pub fn titled(&self) -> String {
        if self.unit.is_empty() { self.name.clone() } else { format!("{} ({})", self.name, self.unit) }
    }
}

impl StudyTable {
    /// An empty table; columns are pairs of heading and unit.
    pub fn new(name: &str, title: impl Into<String>, columns: &[(&str, &str)]) -> Self {
        let column = |(name, unit): &(&str, &str)| StudyColumn { name: (*name).to_owned(), unit: (*unit).to_owned() };
        Self {
            name: name.to_owned(),
            title: title.into(),
            columns: columns.iter().map(column).collect(),
            rows: Vec::new(),
        }
    }

    /// Headings and cells for reading.
    pub fn shown(&self) -> (Vec<String>, Vec<Vec<String>>) {
        let cells =
            |row: &StudyRow| row.cells.iter().zip(&self.columns).map(|(cell, own)| cell.shown(&own.unit)).collect();
        (self.columns.iter().map(StudyColumn::titled).collect(), self.rows.iter().map(cells).collect())
    }

    /// The table in Markdown.
    pub fn markdown(&self) -> String {
        let (header, rows) = self.shown();
        markdown_table(&header.iter().map(String::as_str).collect::<Vec<_>>(), &rows)
    }

    /// Adds a row.
    pub fn push(&mut self, cells: Vec<Cell>, trials: Vec<TrialId>) {
        self.rows.push(StudyRow { cells, trials, sensors: None });
    }

    /// Cell of a row in the column with a heading.
    pub fn cell(&self, row: usize, column: &str) -> &Cell {
        let at = self.columns.iter().position(|own| own.name == column);
        at.and_then(|at| self.rows.get(row)?.cells.get(at)).unwrap_or(&Cell::Missing)
    }

    /// Text of a row in a column; empty for numbers.
    pub fn text(&self, row: usize, column: &str) -> &str {
        match self.cell(row, column) {
            Cell::Text(text) => text,
            Cell::Number(_) | Cell::Interval(_) | Cell::Missing => "",
        }
    }

    /// Different texts of a column, in the order of the rows.
    pub fn texts(&self, column: &str) -> Vec<&str> {
        unique((0..self.rows.len()).map(|row| self.text(row, column)))
    }

    /// Numbers of the rows with certain texts in some columns.
    pub fn rows_with(&self, wanted: &[(&str, &str)]) -> Vec<usize> {
        let fits = |row: &usize| wanted.iter().all(|(column, text)| self.text(*row, column) == *text);
        (0..self.rows.len()).filter(fits).collect()
    }

    /// The table as comma-separated values. An interval takes three columns.
    pub fn csv(&self) -> String {
        let is_interval =
            |column: usize| self.rows.iter().any(|row| matches!(row.cells.get(column), Some(Cell::Interval(_))));
        let intervals: Vec<bool> = (0..self.columns.len()).map(is_interval).collect();
        let mut lines = Vec::new();
        let is_share = |column: &StudyColumn| [PERCENT, POINTS].contains(&column.unit.as_str());
        let unit = |column: &StudyColumn| if is_share(column) { String::new() } else { column.unit.clone() };
        let headings = self.columns.iter().zip(&intervals).flat_map(|(column, interval)| {
            let plain = StudyColumn { name: column.name.clone(), unit: unit(column) }.titled();
            let ends = interval.then(|| [format!("{} low", column.name), format!("{} high", column.name)]);
            std::iter::once(plain).chain(ends.into_iter().flatten())
        });
        lines.push(headings.map(|text| quoted(&text)).collect::<Vec<_>>().join(","));
        for row in &self.rows {
            let cells = row.cells.iter().zip(&intervals).flat_map(|(cell, interval)| {
                let plain = match cell {
                    Cell::Text(text) => quoted(text),
                    Cell::Missing => String::new(),
                    Cell::Number(_) | Cell::Interval(_) => cell.value().map_or(String::new(), in_full),
                };
                let ends =
                    interval.then(|| cell.spread().map_or([const { String::new() }; 2], |ends| ends.map(in_full)));
                std::iter::once(plain).chain(ends.into_iter().flatten())
            });
            lines.push(cells.collect::<Vec<_>>().join(","));
        }
        lines.join("\n") + "\n"
    }
}

/// A number with all its digits; a tiny one as `1.5e-113`.
fn in_full(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-6 { format!("{value:e}") } else { value.to_string() }
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

impl StudyReport {
    /// A report of units; the runner adds the fingerprint.
    pub(crate) fn new(data: Vec<String>, tables: Vec<StudyTable>, findings: Vec<Finding>) -> Self {
        Self { fingerprint: String::new(), data, tables, findings }
    }

    /// The tables in Markdown, with the origin below.
    pub(crate) fn markdown(&self, origin: &str) -> String {
        let table = |table: &StudyTable| format!("{}:\n\n{}\n\n", table.title, table.markdown());
        format!("{}{origin}.", self.tables.iter().map(table).collect::<String>())
    }

    /// A table by its name.
    pub fn table(&self, name: &str) -> Option<(usize, &StudyTable)> {
        self.tables.iter().enumerate().find(|(_, table)| table.name == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interval(estimate: f64, low: f64, high: f64) -> Interval {
        Interval { estimate, low, high }
    }

    #[test]
    fn tables_are_read_by_people_and_programs() {
        let mut table = StudyTable::new("models", "Models", &[("model", ""), ("F1", PERCENT), ("time", "s")]);
        table.push(vec![Cell::text("a, \"b\""), Cell::Interval(interval(0.5, 0.25, 0.75)), Cell::Number(1.5)], vec![7]);
        table.push(vec![Cell::text("c"), Cell::Missing, Cell::Missing], Vec::new());
        assert_eq!(table.csv(), "model,F1,F1 low,F1 high,time (s)\n\"a, \"\"b\"\"\",0.5,0.25,0.75,1.5\nc,,,,\n");
        assert_eq!(table.cell(0, "F1").shown(PERCENT), "50.0 (25.0 to 75.0)");
        let gain = Cell::Interval(Interval { estimate: -0.0004, low: -0.012, high: 0.0 });
        assert_eq!(gain.shown(POINTS), "0.0 (−1.2 to 0.0)");
        assert_eq!([1e-9, 1e-3, 0.0].map(|p| Cell::Number(p).shown("")), ["< 0.000001", "0.00100", "0"]);
        assert_eq!((table.cell(1, "F1").shown(PERCENT), table.cell(0, "none")), ("-".to_owned(), &Cell::Missing));
        assert_eq!((table.texts("model"), table.rows_with(&[("model", "c")])), (vec!["a, \"b\"", "c"], vec![1]));
        let report = StudyReport { tables: vec![table], ..StudyReport::default() };
        let text = serde_json::to_string(&report).expect("writes");
        assert!(
            text.contains(r#"{"estimate":0.5,"low":0.25,"high":0.75},1.5]"#) && text.contains("null,null"),
            "{text}"
        );
        assert_eq!(serde_json::from_str::<StudyReport>(&text).expect("reads"), report);
    }

    #[test]
    fn numbers_of_a_finding_stand_around_the_line() {
        let of =
            |low: f64, high: f64| ClaimNumber::new("a", Some(interval(0.5 * (low + high), low, high)), POINTS, 0.0);
        let finding = |measured: Vec<ClaimNumber>| {
            let [section, claim, found, why] = ["V-B", "better", "Some are.", "rule"].map(str::to_owned);
            Finding { section, claim, found, measured, verdict: Agreement::Partly, why }
        };
        let two = finding(vec![of(0.0, 0.2), of(-0.1, 0.1)]);
        let strips: Vec<String> = two.strips().map(|(_, strip)| strip.to_string()).collect();
        assert_eq!(strips, ["········│──────●────────", "────────●───────········"]);
        assert_eq!((two.measured[0].shown(), two.left_out()), ("+10.0 (0.0 to +20.0) points".to_owned(), None));
        let many = finding(vec![of(0.0, 0.2); 13]);
        assert_eq!((many.strips().count(), many.left_out().as_deref()), (10, Some("and 3 more")));
    }

    #[test]
    fn a_verdict_needs_an_interval_without_zero() {
        let of = |low: f64, high: f64| Agreement::of_gain(Some(interval(0.5 * (low + high), low, high)));
        assert_eq!(
            [of(0.1, 0.2), of(-0.2, -0.1), of(-0.1, 0.2), Agreement::of_gain(None)],
            [Agreement::Agrees, Agreement::Disagrees, Agreement::Partly, Agreement::NotMeasured]
        );
        let all = |parts: &[Agreement]| Agreement::of_all(parts.iter().copied());
        assert_eq!(all(&[Agreement::Agrees, Agreement::Agrees, Agreement::NotMeasured]), Agreement::Agrees);
        assert_eq!(all(&[Agreement::Agrees, Agreement::Disagrees]), Agreement::Partly);
        assert_eq!(all(&[]), Agreement::NotMeasured);
    }
}
