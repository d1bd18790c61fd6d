//! An audit in numbers: a row per effect, its table and its figure.

use super::{AuditedEffect, AuditedScene, EffectSize};
use crate::frame::{Column, LinkedFigure, StudyReport, TableRows, plots_of, rounded};
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
    /// Scenes in which it changes as much, but within the noise.
    pub within_noise: usize,
    /// Rows, in the order of [`Effect::ALL`].
    pub effects: Vec<AuditRow>,
}

/// Audit of one effect's rule.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AuditRow {
    pub name: String,
    /// Threshold of its rule.
    pub threshold: f64,
    /// Scenes in which `auto` leaves it off although it is possible.
    pub off: usize,
    /// Of these, scenes in which switching it on is seen.
    pub missed: usize,
    /// Of these, scenes in which it changes as much, but within the noise.
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

    /// The table of effects.
    pub(super) fn shown(&self) -> StudyReport {
        let Self { scenes, missed, within_noise, effects } = self;
        let with_a_rule: Vec<AuditRow> = effects.iter().filter(|row| row.on + row.off > 0).cloned().collect();
        let table = TableRows::new("effects", "Effects, each flipped", &with_a_rule).columns(&[
            Column("effect", "", &|row| row.name.as_str().into()),
            Column("threshold", "", &|row| row.threshold.to_string().into()),
            Column("on", "", &|row| row.on.into()),
            Column("of these not seen", "", &|row| row.needless.into()),
            Column("off", "", &|row| row.off.into()),
            Column("of these missed", "", &|row| row.missed.into()),
            Column("within noise", "", &|row| row.within_noise.into()),
            Column("CPU time", "", &|row| row.cost.into()),
        ]);
        let data = [
            format!(
                "{scenes} random scenes: with all effects on at once the change is seen in {missed}, and in {within_noise} more it \
                 is as large, but within the noise."
            ),
            "Seen: curvature changes by more than 0.1 1/m or force by more than 10 mN (RMS over the grasp), and by more than twice \
             what a tenth of the tolerance or a push of the gripper by 10 µm changes."
                .to_owned(),
            "CPU time: with the effect over that without it, median.".to_owned(),
        ];
        StudyReport::new(data.to_vec(), vec![table], Vec::new())
    }

    /// Change of each effect against the number of its rule.
    pub(super) fn figure(&self) -> LinkedFigure {
        let line = |horizontal: bool, text: &str| ReferenceLine { horizontal, at: 1.0, text: text.to_owned() };
        let axes = Plot {
            x: PlotAxis::logarithmic("number of the rule / threshold"),
            y: PlotAxis::logarithmic("change / visible change (0.1 1/m, 10 mN)"),
            references: vec![line(true, "seen"), line(false, "on from here")],
            ..Plot::default()
        };
        let mut marks = Vec::new();
        for (title, effects) in PLOTS {
            for (colour, effect) in effects.iter().enumerate() {
                let Some(row) = self.effects.iter().find(|row| row.name == effect.name()) else { continue };
                let crosses = DataSeries { colour, marker: Marker::Cross, ..DataSeries::default() };
                let (line, marker) = (LineStyle::Bold, Marker::Dot);
                let curve = DataSeries { name: row.name.clone(), line, marker, ..crosses.clone() };
                let mut mark = |series: &DataSeries, x: f64, y: f64| {
                    marks.push((title.to_owned(), series.clone(), DataPoint::new(x, y)));
                };
                let shown = row.bins.iter().filter(|bin| bin.upper > 0.0);
                shown.for_each(|bin| mark(&curve, bin.number, bin.upper.max(LEAST_SHOWN)));
                row.misses.iter().for_each(|[number, change]| mark(&crosses, *number, *change));
            }
        }
        let figure = Figure {
            title: format!("Effects that auto leaves off: {} random scenes, each effect flipped", self.scenes),
            columns: 1,
            plots: plots_of(&axes, marks),
            note: "90th percentile of the scenes; crosses: missed.".to_owned(),
            ..Figure::default()
        };
        LinkedFigure::plain("effects", figure)
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
        Self {
            name: effect.name().to_owned(),
            threshold,
            off: off.len(),
            missed: missed.len(),
            within_noise: off.iter().filter(large).count() - missed.len(),
            on: on.len(),
            needless: on.len() - on.iter().filter(seen).count(),
            cost: quantile(&mut costs, 0.5).map(rounded),
            misses: missed
                .iter()
                .map(|(audited, _)| [rounded(audited.number / threshold), rounded(audited.change.of_seen())])
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
                    let (median, upper) = (rounded(median), rounded(upper));
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
        let (_, rows) = report.shown().tables[0].shown();
        assert_eq!(rows, [["creep", &threshold.to_string(), "2", "1", "7", "1", "0", "1.10"].map(str::to_owned)]);
    }

    #[test]
    fn every_effect_with_a_rule_is_drawn() {
        let drawn: usize = PLOTS.iter().map(|(_, effects)| effects.len()).sum();
        assert_eq!(drawn, Effect::ALL.len() - 1, "all but free-object");
    }
}
