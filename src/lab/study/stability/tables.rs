//! Tables and the figure of the study, for the terminal, the manual and the README.

use super::chatter::ChatterRow;
use super::random::{Policy, PolicyRow, RandomReport};
use super::study::StabilityReport;
use crate::study::stored_study::{GeneratedSection, StoredStudy, markdown_table};
use palpate_geometry::drawing::{DataPoint, DataSeries, Figure, LineStyle, Marker, Plot, PlotAxis, ReferenceLine};
use palpate_learn::metrics::Interval;
use palpate_sim::scene::Accuracy;

/// The stored result of the full form.
const STORED: &str = include_str!("../../../../assets/studies/stability.json");
/// Share of silently wrong results that is aimed at.
const TARGET: f64 = 0.005;

/// The stored result of the full form.
pub fn stored_stability() -> Result<StoredStudy<StabilityReport>, serde_json::Error> {
    StoredStudy::parse(STORED)
}

fn percent(share: f64) -> String {
    format!("{:.2}", 100.0 * share)
}

fn interval(share: &Interval) -> String {
    format!("{} ({} to {})", percent(share.estimate), percent(share.low), percent(share.high))
}

/// What each policy comes to: header and rows.
pub fn policy_table(random: &RandomReport) -> ([&'static str; 6], Vec<Vec<String>>) {
    let row = |row: &PolicyRow| {
        vec![
            row.accuracy.clone(),
            row.policy.about().to_owned(),
            row.wrong.to_string(),
            interval(&row.silent_share),
            percent(row.false_alarms),
            format!("{:.2}", row.cost),
        ]
    };
    let header = ["accuracy", "policy", "wrong", "silently wrong % (95 %)", "false alarms %", "cost"];
    (header, random.by_policy.iter().map(row).collect())
}

/// Sections of manual and README that are written from the stored result.
pub(in crate::study) fn sections() -> Result<Vec<GeneratedSection>, serde_json::Error> {
    let stored = stored_stability()?;
    let StabilityReport { cases, chatter, random } = &stored.result;
    let (header, rows) = policy_table(random);
    let share = &random.no_answer_share;
    let policies = format!(
        "{}\n\n{} scenes. In {} ({} %) a push of a micrometre changes the end; they have no single answer. {} are undecided, \
         {} of these without a flag. All others have one end.\n\n{}",
        markdown_table(&header, &rows),
        random.scenes,
        random.no_answer,
        interval(share),
        random.undecided,
        random.undecided_unflagged,
        stored.origin()
    );
    let accuracies = random.by_accuracy.iter().map(|row| {
        let after = row.silent_after_agreement.map_or_else(String::new, |count| count.to_string());
        let counts = [row.scenes, row.wrong, row.silent].map(|count| count.to_string());
        [vec![row.accuracy.clone()], counts.to_vec(), vec![after]].concat()
    });
    let by_accuracy = markdown_table(
        &["accuracy", "scenes", "wrong", "silently wrong", "refined until three levels agree"],
        &accuracies.collect::<Vec<_>>(),
    );
    let chatter_rows = chatter.iter().map(|row| {
        let counts = [row.grasps, row.chattering, row.recomputed, row.remaining, row.chattering_stored];
        let names = [row.preset.clone(), row.accuracy.clone()];
        names.into_iter().chain(counts.map(|count| count.to_string())).collect()
    });
    let chatter = markdown_table(
        &["preset", "accuracy", "grasps", "chatter", "recomputed", "still restless", "chatter as stored"],
        &chatter_rows.collect::<Vec<_>>(),
    );
    let case_rows = cases.iter().map(|case| {
        let closest = case
            .closest
            .as_ref()
            .map(|(setting, found)| format!("{} {:.2e} ({}) at {setting}", found.what, found.measured, found.limit));
        vec![
            case.case.clone(),
            case.claim.clone(),
            format!("{}/{}", case.passed, case.settings),
            closest.unwrap_or_default(),
        ]
    });
    let cases = markdown_table(&["case", "claim", "passed", "closest to its limit"], &case_rows.collect::<Vec<_>>());
    let in_manual = |name, text| GeneratedSection { document: "assets/help/stability.md", name, text };
    Ok(vec![
        in_manual("silent share", policies),
        in_manual("silent share by accuracy", by_accuracy),
        in_manual("chatter", chatter),
        in_manual("hard cases", cases),
        GeneratedSection { document: "README.md", name: "stability in short", text: in_short(&stored.result) },
    ])
}

/// The result in two sentences.
fn in_short(report: &StabilityReport) -> String {
    let share = |policy| {
        let row = report.random.policy(&Accuracy::Standard.to_string(), policy);
        row.map_or_else(Default::default, |row| {
            let [low, high] = [row.silent_share.low, row.silent_share.high].map(percent);
            (format!("{} % ({low} to {high} %)", percent(row.silent_share.estimate)), format!("{:.1}", row.cost))
        })
    };
    let ((single, _), (agreed, cost)) = (share(Policy::Flags), share(Policy::ThreeAgree));
    let sum = |count: fn(&ChatterRow) -> usize| report.chatter.iter().map(count).sum::<usize>();
    format!(
        "At accuracy `standard` {single} of extreme random scenes are silently wrong; refined until three levels agree \
         (`--until-agreement`, {cost} times the cost), {agreed}. Of {} ordinary grasps, {} chatter in the hold as stored.",
        sum(|row| row.grasps),
        sum(|row| row.chattering_stored)
    )
}

/// The figure: share of silently wrong results against cost and against false alarms.
pub fn stability_figure(stored: &StoredStudy<StabilityReport>) -> Figure {
    let random = &stored.result.random;
    let target = ReferenceLine { horizontal: true, at: 100.0 * TARGET, text: "target".to_owned() };
    let top = random.by_policy.iter().map(|row| row.silent_share.high).fold(0.0, f64::max);
    let share = |title: &str| PlotAxis { range: Some([0.0, 105.0 * top]), ..PlotAxis::linear(title) };
    let series = |x: &dyn Fn(&PolicyRow) -> f64, named: bool| -> Vec<DataSeries> {
        [Accuracy::Draft, Accuracy::Standard]
            .iter()
            .enumerate()
            .map(|(colour, accuracy)| {
                let rows = Policy::ALL.iter().filter_map(|policy| random.policy(&accuracy.to_string(), *policy));
                DataSeries {
                    name: if named { format!("asked for {accuracy}") } else { String::new() },
                    colour,
                    line: LineStyle::Thin,
                    marker: if colour == 0 { Marker::Ring } else { Marker::Dot },
                    points: rows.map(|row| point(row, x(row), colour == 0)).collect(),
                }
            })
            .collect()
    };
    Figure {
        title: "What it costs to be wrong less often without noticing".to_owned(),
        plots: vec![
            Plot {
                title: "cost".to_owned(),
                x: PlotAxis::logarithmic("minimisations, as a multiple of one run"),
                y: share("silently wrong, % of the scenes"),
                references: vec![target.clone()],
                series: series(&|row| row.cost, true),
                ..Plot::default()
            },
            Plot {
                title: "false alarms".to_owned(),
                x: PlotAxis::linear("right results that are flagged, %"),
                y: share("silently wrong, % of the scenes"),
                references: vec![target],
                series: series(&|row| 100.0 * row.false_alarms, false),
                ..Plot::default()
            },
        ],
        columns: 1,
        note: format!("{} random scenes; {}", random.scenes, stored.plain_origin()),
    }
}

/// A policy in the figure.
fn point(row: &PolicyRow, x: f64, labelled: bool) -> DataPoint {
    let Interval { estimate, low, high } = row.silent_share;
    DataPoint {
        at: [x, 100.0 * estimate],
        spread: Some([100.0 * low, 100.0 * high]),
        label: if labelled { row.policy.name().to_owned() } else { String::new() },
    }
}
