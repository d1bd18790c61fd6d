//! The picture: error against CPU time for free and fixed objects, by kind of object, and recognition beside it.

use super::plan::{AccuracySetting, SettingFamily};
use super::report::{AccuracyStudy, FAILED_SHARE, GroupCost, SceneGroup};
use crate::study::stored_study::StoredStudy;
use palpate_geometry::drawing::{DataPoint, DataSeries, Figure, LineStyle, Marker, Plot, PlotAxis, ReferenceLine};
use palpate_learn::method;

/// Number of the colour of what belongs to no family.
const GREY: usize = 6;

/// The figure of a stored study.
pub fn accuracy_figure(stored: &StoredStudy<AccuracyStudy>) -> Figure {
    let study = &stored.result;
    let mut plots = vec![
        Plot { title: "Free objects".to_owned(), ..accuracy_plot(study, SceneGroup::Free) },
        Plot { title: "Fixed objects".to_owned(), ..accuracy_plot(study, SceneGroup::Fixed) },
        by_kind(study),
    ];
    if !study.recognition.is_empty() {
        plots.push(worth(study));
    }
    let (objects, poses) = (study.objects.len(), study.poses);
    let note = format!(
        "Medians over {objects} shapes in {poses} poses, with quartiles. Errors of motion: against a tolerance of 1e-7; of \
         joints and taxels: against 40 joints and 120 × 12 taxels.\n{}",
        stored.plain_origin()
    );
    Figure { title: "What accuracy costs, and what it is worth".to_owned(), plots, columns: 2, note }
}

/// Error of curvature against CPU time for a kind of scene: a line per family, the front in bold, failed settings as
/// crosses. The label of each point is the name of its setting.
pub fn accuracy_plot(study: &AccuracyStudy, group: SceneGroup) -> Plot {
    let mut series = vec![front(study, group)];
    for family in SettingFamily::ALL {
        let (failed, usable): (Vec<_>, Vec<_>) = study.family(family, group).partition(|(_, cost)| cost.has_failed());
        let points: Vec<DataPoint> = usable.into_iter().map(|(setting, cost)| point(setting, cost)).collect();
        let (name, colour) = (family.title().to_owned(), family.colour());
        series.push(DataSeries { name, colour, line: LineStyle::Thin, marker: Marker::Dot, points });
        let points: Vec<DataPoint> = failed.into_iter().map(|(setting, cost)| point(setting, cost)).collect();
        series.push(DataSeries { name: String::new(), colour, line: LineStyle::None, marker: Marker::Cross, points });
    }
    series.retain(|series| !series.points.is_empty());
    if series.iter().any(|series| series.marker == Marker::Cross) {
        let name = format!("more than {:.0} % end elsewhere", 100.0 * FAILED_SHARE);
        series.push(DataSeries { name, colour: GREY, marker: Marker::Cross, ..DataSeries::default() });
    }
    let floor = study.floor(group).map(|at| ReferenceLine { horizontal: true, at, text: "floor of SDIRK2".to_owned() });
    Plot {
        title: String::new(),
        x: PlotAxis::logarithmic("CPU time of a grasp of 4 s (ms)"),
        y: PlotAxis::logarithmic("error of curvature (1/m)"),
        references: floor.into_iter().collect(),
        series,
        ..Plot::default()
    }
}

fn point(setting: &AccuracySetting, cost: &GroupCost) -> DataPoint {
    let default = if setting.is_default() { " (default)" } else { "" };
    DataPoint {
        at: [cost.cpu_ms.median, cost.curvature_per_m.median],
        spread: None,
        label: format!("{}{default}", setting.name),
    }
}

fn front(study: &AccuracyStudy, group: SceneGroup) -> DataSeries {
    let points = study.front(group).into_iter().map(|(setting, cost)| {
        let spread = Some([cost.curvature_per_m.low, cost.curvature_per_m.high]);
        DataPoint { spread, label: String::new(), ..point(setting, cost) }
    });
    let (name, points) = ("front".to_owned(), points.collect());
    DataSeries { name, colour: GREY, line: LineStyle::Bold, marker: Marker::None, points }
}

/// Tolerances of the second-order method by kind of object.
fn by_kind(study: &AccuracyStudy) -> Plot {
    let groups =
        [SceneGroup::FreePrimitives, SceneGroup::FreeMeshes, SceneGroup::FixedPrimitives, SceneGroup::FixedMeshes];
    let series = groups.into_iter().enumerate().map(|(colour, group)| {
        let points = study.family(SettingFamily::Tolerance, group).map(|(setting, cost)| {
            let spread = Some([cost.curvature_per_m.low, cost.curvature_per_m.high]);
            let named = ["draft", "standard", "reference"].contains(&&*setting.name);
            let label = if named { setting.name.clone() } else { String::new() };
            DataPoint { at: [cost.cpu_ms.median, cost.curvature_per_m.median], spread, label }
        });
        let (name, points) = (group.title().to_owned(), points.collect());
        DataSeries { name, colour, line: LineStyle::Thin, marker: Marker::Dot, points }
    });
    Plot {
        title: "Tolerances by kind of object".to_owned(),
        x: PlotAxis::logarithmic("CPU time of a grasp of 4 s (ms)"),
        y: PlotAxis::logarithmic("error of curvature (1/m)"),
        series: series.filter(|series| !series.points.is_empty()).collect(),
        ..Plot::default()
    }
}

/// Recognition against the cost of a training grasp, a line per method over tolerances, the knee marked.
fn worth(study: &AccuracyStudy) -> Plot {
    let methods: Vec<&str> =
        study.recognition.first().map(|row| row.scores.iter().map(|s| s.method.as_str()).collect()).unwrap_or_default();
    let mut series = Vec::new();
    for (colour, key) in methods.iter().enumerate() {
        let scored = |motion: bool| -> Vec<DataPoint> {
            let rows =
                study.recognition.iter().filter(|row| (row.setting.family == SettingFamily::Tolerance) == motion);
            rows.filter_map(|row| {
                let score = row.scores.iter().find(|score| score.method == *key)?;
                // One label for all methods: beside the first.
                let label = if colour > 0 {
                    String::new()
                } else if motion {
                    row.setting.name.clone()
                } else {
                    format!("{}, {}", row.setting.family.title(), row.setting.name)
                };
                let spread = motion.then_some([score.f1.low, score.f1.high]);
                Some(DataPoint { at: [row.cpu_ms, score.f1.estimate], spread, label })
            })
            .collect()
        };
        let title = method(key).map_or(*key, |method| method.title);
        let (line, marker) = (LineStyle::Thin, Marker::Dot);
        series.push(DataSeries { name: title.to_owned(), colour, line, marker, points: scored(true) });
        let (line, marker) = (LineStyle::None, Marker::Square);
        series.push(DataSeries { name: String::new(), colour, line, marker, points: scored(false) });
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
    fn the_figure_shows_every_setting_the_default_and_the_knee() -> Result<(), serde_json::Error> {
        let stored = stored_accuracy()?;
        let figure = accuracy_figure(&stored);
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
        Ok(())
    }
}
