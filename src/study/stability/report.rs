//! Results of the study: their tables and figure, for the terminal, the manual and the README.

use super::chatter::ChatterRow;
use super::random::{FlagRow, Policy, PolicyRow, RandomReport, SilentShareRow};
use super::{Case, CaseRow, Measurement};
use crate::frame::{
    Column, GeneratedSection, LinkedFigure, PERCENT, StoredStudy, StudyReport, StudyTable, TableRows, plots_of,
};
use palpate_geometry::drawing::{DataPoint, DataSeries, Figure, LineStyle, Marker, Plot, PlotAxis, ReferenceLine};
use palpate_geometry::units::three_digits;
use palpate_learn::metrics::Interval;
use palpate_sim::scene::Accuracy;
use serde::{Deserialize, Serialize};

/// Share of silently wrong results that is aimed at.
const TARGET: f64 = 0.005;

/// Results of the study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StabilityReport {
    /// Hard cases over all settings.
    pub cases: Vec<CaseSummary>,
    /// Holds that chatter, by preset and accuracy.
    pub chatter: Vec<ChatterRow>,
    /// Random scenes.
    pub random: RandomReport,
    /// Hard cases at each setting, in the order of the work; not stored.
    #[serde(skip)]
    pub table: Vec<CaseRow>,
}

/// A hard case over all settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CaseSummary {
    pub case: String,
    pub claim: String,
    /// Settings it was run at.
    pub settings: usize,
    /// Of these, settings at which all its limits hold.
    pub passed: usize,
    /// The value closest to its limit or farthest beyond it, and its setting; absent where all runs diverged.
    pub closest: Option<(String, Measurement)>,
}

impl CaseSummary {
    pub(super) fn new(case: &Case, rows: &[CaseRow]) -> Self {
        let own: Vec<&CaseRow> = rows.iter().filter(|row| row.case == case.name).collect();
        let closest = own.iter().filter_map(|row| Some((row.setting.clone(), row.findings.first()?.clone())));
        let used = |(_, found): &(String, Measurement)| found.limit.used(found.measured);
        Self {
            case: case.name.to_owned(),
            claim: case.claim.to_owned(),
            settings: own.len(),
            passed: own.iter().filter(|row| row.holds).count(),
            closest: closest.max_by(|a, b| used(a).total_cmp(&used(b))),
        }
    }
}

/// A share in percent.
fn percent(Interval { estimate, low, high }: Interval) -> Interval {
    Interval { estimate: 100.0 * estimate, low: 100.0 * low, high: 100.0 * high }
}

impl StabilityReport {
    /// The result in tables.
    pub(super) fn shown(&self) -> StudyReport {
        let Self { cases, chatter, random, table } = self;
        let mut tables = vec![
            cases_table(cases),
            chatter_counts(chatter),
            accuracies_table(&random.by_accuracy),
            policies_table(&random.by_policy),
            flags_table(&random.flags),
        ];
        tables.extend((!table.is_empty()).then(|| settings_table(table)));
        let Interval { estimate, low, high } = percent(random.no_answer_share);
        let [estimate, low, high] = [estimate, low, high].map(three_digits);
        let data = [
            format!("{} random scenes of seed {}.", random.scenes, random.seed),
            format!(
                "In {} ({estimate} %, {low} to {high}) a push of a micrometre changes the end; they have no single answer.",
                random.no_answer
            ),
            format!(
                "{} are undecided, {} of these without a flag. All others have one end.",
                random.undecided, random.undecided_unflagged
            ),
            format!(
                "{} have a number that is not finite; of {} steps {} did not converge.",
                random.non_finite, random.steps, random.unconverged_steps
            ),
            format!(
                "Newton: {:.2} iterations per minimisation, {} at most. Friction: residual {:.3} at the 99th percentile, {:.3} at most.",
                random.newton_mean, random.newton_max, random.friction_residual_p99, random.friction_residual_max
            ),
        ];
        StudyReport::new(data.to_vec(), tables, Vec::new())
    }

    /// The figure: share of silently wrong results against cost and against false alarms.
    pub(super) fn figure(&self) -> LinkedFigure {
        let random = &self.random;
        let top = random.by_policy.iter().map(|row| row.silent_share.high).fold(0.0, f64::max);
        let axes = Plot {
            x: PlotAxis::logarithmic("minimisations, as a multiple of one run"),
            y: PlotAxis { range: Some([0.0, 105.0 * top]), ..PlotAxis::linear("silently wrong, % of the scenes") },
            references: vec![ReferenceLine { horizontal: true, at: 100.0 * TARGET, text: "target".to_owned() }],
            ..Plot::default()
        };
        let mut marks = Vec::new();
        for (colour, accuracy) in [Accuracy::Draft, Accuracy::Standard].map(|own| own.to_string()).iter().enumerate() {
            let marker = if colour == 0 { Marker::Ring } else { Marker::Dot };
            let plain = DataSeries { colour, line: LineStyle::None, marker, ..DataSeries::default() };
            let named = DataSeries { name: format!("asked for {accuracy}"), ..plain.clone() };
            for row in Policy::ALL.iter().filter_map(|policy| random.policy(accuracy, *policy)) {
                let Interval { estimate, low, high } = percent(row.silent_share);
                let label = if colour == 0 { row.policy.name().to_owned() } else { String::new() };
                let point = |x| DataPoint { at: [x, estimate], spread: Some([low, high]), label: label.clone() };
                marks.push(("cost".to_owned(), named.clone(), point(row.cost)));
                marks.push(("false alarms".to_owned(), plain.clone(), point(100.0 * row.false_alarms)));
            }
        }
        let mut plots = plots_of(&axes, marks);
        plots.iter_mut().skip(1).for_each(|plot| plot.x = PlotAxis::linear("right results that are flagged, %"));
        let (title, note) = (
            "What it costs to be wrong less often without noticing".to_owned(),
            format!("{} random scenes.", random.scenes),
        );
        LinkedFigure::plain("stability", Figure { title, plots, columns: 1, note, ..Figure::default() })
    }
}

/// A value and its limit.
fn measured(found: &Measurement) -> String {
    format!("{} {:.2e} ({})", found.what, found.measured, found.limit)
}

fn cases_table(cases: &[CaseSummary]) -> StudyTable {
    TableRows::new("stability-cases", "Hard cases", cases).columns(&[
        Column("case", "", &|case| case.case.as_str().into()),
        Column("claim", "", &|case| case.claim.as_str().into()),
        Column("passed", "", &|case| format!("{}/{}", case.passed, case.settings).into()),
        Column("closest to its limit", "", &|case| {
            let closest = case.closest.as_ref().map(|(setting, found)| format!("{} at {setting}", measured(found)));
            closest.unwrap_or_default().into()
        }),
    ])
}

fn settings_table(rows: &[CaseRow]) -> StudyTable {
    TableRows::new("stability-settings", "Hard cases at each setting", rows).columns(&[
        Column("case", "", &|row| row.case.as_str().into()),
        Column("setting", "", &|row| row.setting.as_str().into()),
        Column("closest to its limit", "", &|row| match (&row.not_finite, row.findings.first()) {
            (Some(body), _) => format!("{body} diverged").into(),
            (None, found) => found.map(measured).unwrap_or_default().into(),
        }),
        Column("verdict", "", &|row| if row.holds { "pass" } else { "FAIL" }.into()),
    ])
}

fn chatter_counts(rows: &[ChatterRow]) -> StudyTable {
    TableRows::new("stability-chatter", "Holds that chatter", rows).columns(&[
        Column("preset", "", &|row| row.preset.as_str().into()),
        Column("accuracy", "", &|row| row.accuracy.as_str().into()),
        Column("grasps", "", &|row| row.grasps.into()),
        Column("changing", "", &|row| row.changing.into()),
        Column("chatter", "", &|row| row.chattering.into()),
        Column("recomputed", "", &|row| row.recomputed.into()),
        Column("still restless", "", &|row| row.remaining.into()),
        Column("chatter as stored", "", &|row| row.chattering_stored.into()),
    ])
}

fn accuracies_table(rows: &[SilentShareRow]) -> StudyTable {
    TableRows::new("stability-accuracies", "Random scenes by accuracy", rows).columns(&[
        Column("accuracy", "", &|row| row.accuracy.as_str().into()),
        Column("scenes", "", &|row| row.scenes.into()),
        Column("wrong", "", &|row| row.wrong.into()),
        Column("silently wrong", "", &|row| row.silent.into()),
        Column("refined until three levels agree", "", &|row| row.silent_after_agreement.into()),
        Column("minimisations per scene", "", &|row| Some(row.solves.round()).filter(|_| row.scenes > 0).into()),
    ])
}

fn policies_table(rows: &[PolicyRow]) -> StudyTable {
    TableRows::new("stability-policies", "What it costs to be wrong less often without noticing", rows).columns(&[
        Column("accuracy", "", &|row| row.accuracy.as_str().into()),
        Column("policy", "", &|row| row.policy.about().into()),
        Column("wrong", "", &|row| row.wrong.into()),
        Column("silently wrong", "% of scenes", &|row| Some(percent(row.silent_share)).into()),
        Column("or undecided", "% of scenes", &|row| row.silent_or_undecided.map(percent).into()),
        Column("false alarms", "% of right results", &|row| Some(100.0 * row.false_alarms).into()),
        Column("cost", "", &|row| Some(row.cost).into()),
    ])
}

fn flags_table(rows: &[FlagRow]) -> StudyTable {
    TableRows::new("stability-flags", "Flags at the drawn accuracies", rows).columns(&[
        Column("flag", "", &|row| row.flag.as_str().into()),
        Column("wrong detected", PERCENT, &|row| Some(row.recall).into()),
        Column("false alarms", PERCENT, &|row| Some(row.false_alarms).into()),
    ])
}

/// Sections of manual and README that are written from the stored result.
pub(crate) fn sections() -> Result<Vec<GeneratedSection>, serde_json::Error> {
    let Some(stored) = StoredStudy::<StabilityReport>::shipped("stability")? else { return Ok(Vec::new()) };
    let shown = stored.result.shown();
    let in_manual = |name, table: &str, below: String| {
        let table = shown.table(table).map_or_else(String::new, |(_, table)| table.markdown());
        GeneratedSection { document: "assets/help/stability.md", name, text: table + &below }
    };
    let random = format!("\n\n{}\n\n{}", shown.data.join(" "), stored.origin());
    Ok(vec![
        in_manual("silent share", "stability-policies", random),
        in_manual("silent share by accuracy", "stability-accuracies", String::new()),
        in_manual("chatter", "stability-chatter", String::new()),
        in_manual("hard cases", "stability-cases", String::new()),
        GeneratedSection { document: "README.md", name: "stability in short", text: in_short(&stored.result) },
    ])
}

/// The result in two sentences.
fn in_short(report: &StabilityReport) -> String {
    let share = |policy| {
        let row = report.random.policy(&Accuracy::Standard.to_string(), policy);
        row.map_or_else(Default::default, |row| {
            let Interval { estimate, low, high } = percent(row.silent_share);
            (format!("{estimate:.2} % ({low:.2} to {high:.2} %)"), format!("{:.1}", row.cost))
        })
    };
    let [(single, _), (compared, light), (agreed, cost)] =
        [Policy::Flags, Policy::Compared, Policy::ThreeAgree].map(share);
    let sum = |count: fn(&ChatterRow) -> usize| report.chatter.iter().map(count).sum::<usize>();
    format!(
        "At accuracy `standard`, {single} of extreme random scenes give a wrong result without raising a flag; {compared} \
         are wrong behind a green trust light ({light} times the cost of one run), and {agreed} if each is refined until three \
         levels of accuracy agree (`--until-agreement`, {cost} times). Of {} stored grasps of \
         ordinary objects, {} have forces that keep jumping (chatter) in the hold.",
        sum(|row| row.grasps),
        sum(|row| row.chattering_stored)
    )
}
