//! An audit in numbers: a row per effect, a table for the manual, a figure.

use super::{AuditedEffect, AuditedScene, EffectSize};
use crate::study::stored_study::{StoredStudy, markdown_table};
use palpate_geometry::drawing::{DataPoint, DataSeries, Figure, LineStyle, Marker, Plot, PlotAxis, ReferenceLine};
use palpate_sim::physics::effects::rule_of;
use palpate_sim::scene::Effect;
use serde::{Deserialize, Serialize};

/// Result of an audit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AuditReport {
    /// Random scenes.
    pub scenes: usize,
    /// Scenes in which switching all effects on is seen.
    pub missed: usize,
    /// Scenes in which it changes as much, but no more than what means nothing.
    pub within_noise: usize,
    /// Rows, in the order of [`Effect::ALL`].
    pub effects: Vec<AuditRow>,
}

/// Audit of one effect's rule.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AuditRow {
    /// Name.
    pub name: String,
    /// Threshold of its rule.
    pub threshold: f64,
    /// Scenes in which `auto` leaves it off although it is possible.
    pub off: usize,
    /// Of these, scenes in which switching it on is seen.
    pub missed: usize,
    /// Of these, scenes in which it changes as much, but no more than what means nothing.
    pub within_noise: usize,
    /// Scenes in which `auto` has it on.
    pub on: usize,
    /// Of these, scenes in which switching it off is not seen.
    pub needless: usize,
    /// Median of CPU time with it over that without it, where it is on; absent where it never is.
    pub cost: Option<f64>,
    /// Changes by number over threshold.
    pub bins: Vec<AuditBin>,
    /// Number over threshold, and change over a visible one, of each missed scene.
    pub misses: Vec<[f64; 2]>,
}

/// Scenes whose numbers are within a factor of two.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AuditBin {
    /// Number over threshold: the geometric middle.
    pub number: f64,
    /// Scenes.
    pub count: usize,
    /// Median change over a visible one.
    pub median: f64,
    /// 90th percentile of it.
    pub upper: f64,
}

/// Numbers over their threshold are shown up to this factor away from it, by powers of two.
const FARTHEST: i32 = 10;
/// Fewer scenes make no bin.
const LEAST_COUNT: usize = 5;

impl AuditReport {
    /// Sums up audited scenes.
    pub fn new<'a>(scenes: impl IntoIterator<Item = &'a AuditedScene>) -> Self {
        let scenes: Vec<&AuditedScene> = scenes.into_iter().collect();
        let seen = |scene: &&&AuditedScene| scene.all_on.is_seen(scene.noise);
        let large = |scene: &&&AuditedScene| scene.all_on.of_seen() > 1.0;
        let missed = scenes.iter().filter(seen).count();
        Self {
            scenes: scenes.len(),
            missed,
            within_noise: scenes.iter().filter(large).count() - missed,
            effects: Effect::ALL.iter().map(|effect| AuditRow::new(*effect, &scenes)).collect(),
        }
    }
}

impl AuditRow {
    fn new(effect: Effect, scenes: &[&AuditedScene]) -> Self {
        let threshold = rule_of(effect).threshold;
        let own = |scene: &&AuditedScene| -> Option<(AuditedEffect, EffectSize)> {
            let found = scene.effects.iter().find(|audited| audited.name == effect.name())?;
            found.cost.is_some().then(|| (found.clone(), scene.noise))
        };
        let all: Vec<(AuditedEffect, EffectSize)> = scenes.iter().filter_map(own).collect();
        let (on, off): (Vec<_>, Vec<_>) = all.iter().partition(|(audited, _)| audited.on);
        let seen = |(audited, noise): &&&(AuditedEffect, EffectSize)| audited.change.is_seen(*noise);
        let large = |(audited, _): &&&(AuditedEffect, EffectSize)| audited.change.of_seen() > 1.0;
        let missed: Vec<_> = off.iter().filter(seen).collect();
        let mut costs: Vec<f64> = on.iter().filter_map(|(audited, _)| audited.cost).collect();
        let round = |x: f64| format!("{x:.2e}").parse().unwrap_or(x);
        Self {
            name: effect.name().to_owned(),
            threshold,
            off: off.len(),
            missed: missed.len(),
            within_noise: off.iter().filter(large).count() - missed.len(),
            on: on.len(),
            needless: on.len() - on.iter().filter(seen).count(),
            cost: quantile(&mut costs, 0.5).map(round),
            misses: missed
                .iter()
                .map(|(audited, _)| [round(audited.number / threshold), round(audited.change.of_seen())])
                .collect(),
            bins: (-FARTHEST..=FARTHEST)
                .filter_map(|power| {
                    let within = |(audited, _): &&(AuditedEffect, EffectSize)| {
                        let nearest = (audited.number / threshold).log2().round() as i32;
                        nearest.clamp(-FARTHEST, FARTHEST) == power
                    };
                    let mut changes: Vec<f64> =
                        all.iter().filter(within).map(|(audited, _)| audited.change.of_seen()).collect();
                    let (median, upper) = (quantile(&mut changes, 0.5)?, quantile(&mut changes, 0.9)?);
                    let (median, upper) = (round(median), round(upper));
                    let bin = AuditBin { number: 2f64.powi(power), count: changes.len(), median, upper };
                    (changes.len() >= LEAST_COUNT).then_some(bin)
                })
                .collect(),
        }
    }
}

/// Value below which a share of all lies; `None` without any.
fn quantile(values: &mut [f64], share: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(((values.len() as f64 - 1.0) * share).round().max(0.0) as usize).copied()
}

/// The stored result.
pub fn stored_effects() -> Result<StoredStudy<AuditReport>, serde_json::Error> {
    StoredStudy::parse(include_str!("../../../../assets/studies/effects.json"))
}

/// Table of an audit, in Markdown.
pub fn audit_table(report: &AuditReport) -> String {
    let rows: Vec<Vec<String>> = report
        .effects
        .iter()
        .filter(|row| row.on + row.off > 0)
        .map(|row| {
            let cost = row.cost.map_or("-".to_owned(), |cost| format!("{cost:.2}"));
            let counts = [row.on, row.needless, row.off, row.missed, row.within_noise].map(|count| count.to_string());
            [vec![format!("`{}`", row.name), row.threshold.to_string()], counts.to_vec(), vec![cost]].concat()
        })
        .collect();
    let header =
        ["effect", "threshold", "on", "of these not seen", "off", "of these missed", "within noise", "CPU time"];
    markdown_table(&header, &rows)
}

/// Effects of the two plots of the figure.
const PLOTS: [(&str, &[Effect]); 2] = [
    (
        "Weight, inertia and pressure",
        &[Effect::FingerGravity, Effect::ObjectGravity, Effect::FingerInertia, Effect::Shaking, Effect::PneumaticLag],
    ),
    (
        "Contact and material",
        &[
            Effect::Support,
            Effect::Friction,
            Effect::FingerContact,
            Effect::Creep,
            Effect::SoftObject,
            Effect::OutOfPlane,
        ],
    ),
];

/// Change of each effect against the number of its rule.
pub fn audit_figure(stored: &StoredStudy<AuditReport>) -> Figure {
    let report = &stored.result;
    Figure {
        title: format!("What auto leaves out: {} random scenes, each effect flipped", report.scenes),
        columns: 1,
        plots: PLOTS.iter().map(|(title, effects)| plot(report, title, effects)).collect(),
        note: format!("90th percentile of the scenes; crosses: missed. {}", stored.plain_origin()),
    }
}

fn plot(report: &AuditReport, title: &str, effects: &[Effect]) -> Plot {
    let mut series = Vec::new();
    for (colour, effect) in effects.iter().enumerate() {
        let Some(row) = report.effects.iter().find(|row| row.name == effect.name()) else { continue };
        let shown = row.bins.iter().filter(|bin| bin.upper > 0.0);
        series.push(DataSeries {
            name: row.name.clone(),
            colour,
            line: LineStyle::Bold,
            marker: Marker::Dot,
            points: shown.map(|bin| DataPoint::new(bin.number, bin.upper.max(LEAST_SHOWN))).collect(),
        });
        series.push(DataSeries {
            name: String::new(),
            colour,
            line: LineStyle::None,
            marker: Marker::Cross,
            points: row.misses.iter().map(|[number, change]| DataPoint::new(*number, *change)).collect(),
        });
    }
    let line = |horizontal: bool, text: &str| ReferenceLine { horizontal, at: 1.0, text: text.to_owned() };
    Plot {
        title: title.to_owned(),
        x: PlotAxis { range: Some([1e-3, 1e3]), ..PlotAxis::logarithmic("number of the rule / threshold") },
        y: PlotAxis::logarithmic("change / visible change (0.1 1/m, 10 mN)"),
        references: vec![line(true, "seen"), line(false, "on from here")],
        series,
        ..Plot::default()
    }
}

/// Changes below this share of a visible one are drawn at it.
const LEAST_SHOWN: f64 = 1e-3;

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(number: f64, on: bool, force_n: f64) -> AuditedScene {
        let change = EffectSize { curvature_per_m: 0.0, force_n };
        let name = Effect::Creep.name().to_owned();
        let creep = AuditedEffect { name, on, number, change, cost: Some(1.1) };
        AuditedScene { settings: Vec::new(), noise: EffectSize::default(), all_on: change, effects: vec![creep] }
    }

    #[test]
    fn what_is_left_off_and_seen_is_missed() {
        let threshold = rule_of(Effect::Creep).threshold;
        let (below, above) = (0.1 * threshold, 10.0 * threshold);
        let mut scenes = vec![scene(below, false, 0.001); 6];
        scenes.extend([scene(below, false, 0.02), scene(above, true, 0.05), scene(above, true, 0.001)]);
        let report = AuditReport::new(&scenes);
        assert_eq!((report.scenes, report.missed), (9, 2));
        let creep = report.effects.iter().find(|row| row.name == "creep").expect("a row");
        assert_eq!((creep.off, creep.missed, creep.on, creep.needless), (7, 1, 2, 1));
        assert_eq!(creep.bins.len(), 1, "{:?}", creep.bins);
        assert_eq!(creep.misses, [[0.1, 2.0]]);
        let row = format!("| `creep` | {threshold} | 2 | 1 | 7 | 1 | 0 | 1.10 |");
        assert!(audit_table(&report).contains(&row), "{}", audit_table(&report));
    }

    #[test]
    fn every_effect_with_a_rule_is_drawn() {
        let drawn: usize = PLOTS.iter().map(|(_, effects)| effects.len()).sum();
        assert_eq!(drawn, Effect::ALL.len() - 1, "all but free-object");
    }
}
