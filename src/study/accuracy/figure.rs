//! The picture: error against CPU time for free and fixed objects, by kind of object, and recognition beside it.

use super::plan::{AccuracySetting, SettingFamily};
use super::report::{AccuracyStudy, FAILED_SHARE, GroupCost, SceneGroup};
use crate::frame::{LinkedFigure, lines, series_of};
use palpate_geometry::drawing::{DataPoint, DataSeries, Figure, LineStyle, Marker, Plot, PlotAxis, ReferenceLine};
use palpate_geometry::palette::NO_SERIES;
use palpate_learn::method;

/// Number of the colour of the front.
const FRONT: usize = 6;

impl AccuracyStudy {
    /// The figure.
    pub fn figure(&self) -> LinkedFigure {
        let mut plots = vec![
            Plot { title: "Free objects".to_owned(), ..accuracy_plot(self, SceneGroup::Free) },
            Plot { title: "Fixed objects".to_owned(), ..accuracy_plot(self, SceneGroup::Fixed) },
            by_kind(self),
        ];
        plots.extend((!self.recognition.is_empty()).then(|| worth(self)));
        let note = format!(
            "Medians over {} shapes in {} poses, with quartiles. Errors of motion: against a tolerance of 1e-7; of joints and \
             taxels: against 40 joints and 120 × 12 taxels.",
            self.objects.len(),
            self.poses
        );
        let title = "What accuracy costs, and what it is worth".to_owned();
        LinkedFigure::plain("accuracy", Figure { title, plots, columns: 2, note, ..Figure::default() })
    }
}

/// Axes of error against time.
fn axes() -> Plot {
    Plot {
        x: PlotAxis::logarithmic("CPU time of a grasp of 4 s (ms)"),
        y: PlotAxis::logarithmic("error of curvature (1/m)"),
        ..Plot::default()
    }
}

fn point(cost: &GroupCost, label: String) -> DataPoint {
    DataPoint { label, ..DataPoint::new(cost.cpu_ms.median, cost.curvature_per_m.median) }
}

/// The same with quartiles.
fn spread(cost: &GroupCost, label: String) -> DataPoint {
    DataPoint { spread: Some([cost.curvature_per_m.low, cost.curvature_per_m.high]), ..point(cost, label) }
}

/// Error of curvature against CPU time for a kind of scene: a line per family, the front in bold, failed settings as
/// crosses. The label of each point is the name of its setting.
pub fn accuracy_plot(study: &AccuracyStudy, group: SceneGroup) -> Plot {
    let crosses = |colour| DataSeries { colour, marker: Marker::Cross, ..DataSeries::default() };
    let look = |name: &str, line, marker, colour| DataSeries {
        name: name.to_owned(),
        line,
        marker,
        colour,
        ..DataSeries::default()
    };
    let front = look("front", LineStyle::Bold, Marker::None, FRONT);
    let front = study.front(group).into_iter().map(|(_, cost)| (front.clone(), spread(cost, String::new())));
    let settings = SettingFamily::ALL.into_iter().flat_map(|family| study.family(family, group));
    let settings = settings.map(|(setting, cost)| {
        let AccuracySetting { family, name, .. } = setting;
        let line = look(family.title(), LineStyle::Thin, Marker::Dot, family.colour());
        let default = if setting.is_default() { " (default)" } else { "" };
        let look = match cost.has_failed() {
            true if study.family(*family, group).any(|(_, own)| !own.has_failed()) => crosses(family.colour()),
            // None of them has a line.
            true => DataSeries { name: family.title().to_owned(), ..crosses(family.colour()) },
            false => line,
        };
        (look, point(cost, format!("{name}{default}")))
    });
    let mut series = series_of(front.chain(settings));
    if series.iter().any(|series| series.marker == Marker::Cross) {
        let name = format!("more than {:.0} % end elsewhere", 100.0 * FAILED_SHARE);
        series.push(DataSeries { name, ..crosses(NO_SERIES) });
    }
    let floor = study.floor(group).map(|at| ReferenceLine { horizontal: true, at, text: "floor of SDIRK2".to_owned() });
    Plot { references: floor.into_iter().collect(), series, ..axes() }
}

/// Tolerances of the second-order method by kind of object.
fn by_kind(study: &AccuracyStudy) -> Plot {
    let marks = SceneGroup::ALL[2..].iter().enumerate().flat_map(|(colour, group)| {
        study.family(SettingFamily::Tolerance, *group).map(move |(setting, cost)| {
            let named = ["draft", "standard", "reference"].contains(&&*setting.name);
            let label = if named { setting.name.clone() } else { String::new() };
            (
                DataSeries { name: group.title().to_owned(), marker: Marker::Dot, ..lines(colour, false) },
                spread(cost, label),
            )
        })
    });
    Plot { title: "Tolerances by kind of object".to_owned(), series: series_of(marks), ..axes() }
}

/// Recognition against the cost of a training grasp, a line per method over tolerances, the knee marked.
fn worth(study: &AccuracyStudy) -> Plot {
    let methods = study.recognition.iter().take(1).flat_map(|row| &row.scores).map(|score| &score.method);
    let mut marks = Vec::new();
    for (colour, key) in methods.enumerate() {
        for row in &study.recognition {
            let Some(score) = row.scores.iter().find(|score| score.method == *key) else { continue };
            let squares = DataSeries { colour, marker: Marker::Square, ..DataSeries::default() };
            let (family, name) = (row.setting.family, &row.setting.name);
            let is_tolerance = family == SettingFamily::Tolerance;
            // One label for all methods: beside the first.
            let label = match (colour, is_tolerance) {
                (0, true) => name.clone(),
                (0, false) => format!("{}, {name}", family.title()),
                _ => String::new(),
            };
            let look = if is_tolerance {
                let name = method(key).map_or(key.as_str(), |method| method.title).to_owned();
                DataSeries { name, line: LineStyle::Thin, marker: Marker::Dot, ..squares }
            } else {
                squares
            };
            let spread = is_tolerance.then_some([score.f1.low, score.f1.high]);
            marks.push((look, DataPoint { spread, label, ..DataPoint::new(row.cpu_ms, score.f1.estimate) }));
        }
    }
    let mut series = series_of(marks);
    if series.iter().any(|series| series.marker == Marker::Square) {
        let name = "other settings".to_owned();
        series.push(DataSeries { name, colour: NO_SERIES, marker: Marker::Square, ..DataSeries::default() });
    }
    let knee = study.knee().map(|row| {
        let text = format!("knee: {}", row.setting.name);
        ReferenceLine { horizontal: false, at: row.cpu_ms, text }
    });
    Plot {
        title: "Recognition: trained on grasps of each accuracy, tested on reference grasps".to_owned(),
        x: PlotAxis::logarithmic("CPU time of a training grasp (ms)"),
        y: PlotAxis::linear("macro F1 after one grasp"),
        references: knee.into_iter().collect(),
        series,
        ..Plot::default()
    }
}

#[cfg(test)]
mod tests {
    use super::super::stored_accuracy;
    use super::*;

    #[test]
    fn the_figure_shows_every_setting_the_default_and_the_knee() {
        let stored = stored_accuracy().expect("stored");
        let figure = stored.result.figure().with_note(&stored.plain_origin()).figure;
        assert_eq!(figure.plots.len(), 4);
        let free = &figure.plots[0];
        let labels: Vec<&str> =
            free.series.iter().flat_map(|s| &s.points).map(|p| p.label.as_str()).filter(|l| !l.is_empty()).collect();
        assert_eq!(labels.len(), stored.result.rows.len());
        assert!(labels.contains(&"standard (default)"));
        assert!(free.series.iter().any(|s| s.name == "front" && s.line == LineStyle::Bold && s.points.len() > 2));
        assert_eq!(free.references.len(), 1);
        assert_eq!(figure.plots[3].references.len(), usize::from(stored.result.knee().is_some()));
        assert!(figure.note.contains("palpate study accuracy"));
    }
}
