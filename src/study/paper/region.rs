//! Where the paper's comparison of methods holds: poses that vary little or much, few or many training grasps.

use super::prelude::*;
use crate::frame::{GeneratedSection, ListedStudy, ShownStudy, markdown_table};
use palpate_sim::scene::PRESETS;

pub(super) struct Region;

/// The paper's model as described, and tuned.
const STRICT: &str = "paper-ds-lstm";
const TUNED: &str = "ds-lstm";
/// The single model and the ensemble that the paper compares it with.
const SINGLE: &str = "lstm";
const ENSEMBLE: &str = "rusboost";
const MODELS: [&str; 5] = [STRICT, TUNED, SINGLE, "random-forest", ENSEMBLE];

/// Parts of the grasps, the first of which is tested: a fit on each would take ten CPU hours. And the most training grasps
/// of each object in the others.
const PARTS: usize = 3;
const MOST: usize = 200;

/// How grasps are posed, and how many of each object a model learns from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Case {
    /// Preset, or "stored" for trials of a store.
    poses: String,
    train: usize,
}

impl Factor for Case {
    fn named(&self, sensors: &str, method: &str) -> String {
        format!("{sensors}, poses {}, {method} of {} grasps", self.poses, self.train)
    }
}

/// Poses of a plan: presets A, M and B in place of the usual one.
fn poses(plan: &StudyPlan) -> Vec<String> {
    if plan.query.is_some() {
        return vec!["stored".to_owned()];
    }
    if plan.preset != STUDY_PRESET {
        return vec![plan.preset.clone()];
    }
    let names = || PRESETS.iter().map(|preset| preset.name);
    let to_usual = names().position(|name| name == STUDY_PRESET).map_or(0, |at| at + 1);
    names().take(plan.pick(to_usual, to_usual, 1)).map(str::to_owned).collect()
}

impl Crossing for Region {
    type Factor = Case;

    const CARD: StudyCard = StudyCard {
        key: "region",
        title: "Where the comparison holds",
        about: "the paper's network, strict and tuned, beside a single LSTM, a forest and RUSBoost: poses that vary little or much (presets A, M, B), 20 to 200 training grasps, one fit each",
        paper: "section V-D",
    };

    fn grid(plan: &StudyPlan) -> Vec<Fit<Case>> {
        let sizes = plan.pick(&[20, 55, MOST][..], &[10, 20][..], &[2, 4][..]);
        let of_poses = |poses: String| sizes.iter().map(move |train| Case { poses: poses.clone(), train: *train });
        let cases: Vec<Case> = poses(plan).into_iter().flat_map(of_poses).collect();
        crossed(plan, &cases, &MODELS, |_| 1)
    }

    fn sets(Fit { kind, part }: &Fit<Case>, bench: &StudyData<'_>) -> Result<[Dataset; 2], StudyError> {
        let plan = bench.plan();
        let mut wanted = plan.wanted(plan.grasps(PARTS * MOST / (PARTS - 1), 40), kind.sensors);
        wanted.preset.clone_from(&kind.factor.poses);
        let part = TestPart { of: plan.pick(PARTS, 2, 3), part: *part, train: kind.factor.train };
        bench.split(wanted, kind.method, part)
    }

    fn compared(rows: &mut [Row<Case>]) {
        compare(rows, |kind| Some(Kind { method: method(ENSEMBLE)?, ..kind.clone() }));
    }

    fn report(_: &StudyPlan, rows: &[Row<Case>]) -> (Vec<StudyTable>, Vec<Finding>) {
        let title = format!("Methods by poses and training grasps of each object; differences to {ENSEMBLE}");
        let own = [
            Column("poses", "", &|row: &Row<Case>| row.kind.factor.poses.as_str().into()),
            Column("training grasps", "", &|row| row.kind.factor.train.into()),
        ];
        let table = Row::scores("region", title, rows, &own, Some("against RUSBoost"));
        (vec![table], findings(rows))
    }

    fn figures(report: &StudyReport) -> Vec<Option<LinkedFigure>> {
        let plot = |line: TableLine<'_>| format!("{} sensors, poses {}", line.text("sensors"), line.text("poses"));
        let axis = |_: &[TableLine<'_>]| PlotAxis::logarithmic("training grasps of each object");
        let facets = Facets {
            plot: &plot,
            along: Along::Axis(&axis, &|line| line.value("training grasps")),
            look: &|model, colour| lines(colour, model == STRICT),
            named_once: true,
            columns: 3,
            ..Facets::USUAL
        };
        vec![facets.figure(report, "region")]
    }
}

/// The paper's two sentences on its comparison, each with the region in which it holds.
fn findings(rows: &[Row<Case>]) -> Vec<Finding> {
    let claim = |claim: Claim<'_>, other: &str, words: &str, rule: Rule, holds: &dyn Fn(&Interval) -> bool| {
        let gain = |row: &Row<Case>| {
            let other = Kind { method: method(other)?, ..row.kind.clone() };
            row.pool.against(&find(rows, &other)?.pool).map(|difference| difference.f1)
        };
        let gains = |model: &str| -> Vec<(Kind<Case>, Interval)> {
            let own = rows.iter().filter(|row| row.kind.method.key == model);
            own.filter_map(|row| Some((row.kind.clone(), gain(row)?))).collect()
        };
        let region = |model: &str| region(gains(model).into_iter().map(|(kind, gain)| (kind, holds(&gain))));
        let named = |(kind, gain): (Kind<Case>, Interval)| {
            (format!("{}, poses {}, {} grasps", kind.model(), kind.factor.poses, kind.factor.train), gain)
        };
        let all = [STRICT, TUNED].into_iter().flat_map(gains).map(named);
        let found = format!(
            "The dual-stage network {words}, as the paper describes it: {}; tuned: {}.",
            region(STRICT),
            region(TUNED)
        );
        Finding { found, ..claim.on_groups(POINTS, [(rule, all.collect())]) }
    };
    vec![
        claim(
            Claim(
                "V-D",
                "The dual-stage LSTM is better than a single LSTM",
                "Holds where the paired 95 % interval is above zero",
            ),
            SINGLE,
            "is better than a single LSTM",
            Rule::AllAbove(0.0),
            &|gain| gain.low > 0.0,
        ),
        claim(
            Claim(
                "V-D",
                "The dual-stage LSTM is comparable to RUSBoost",
                "Holds where the paired 95 % interval is not below zero",
            ),
            ENSEMBLE,
            "is no worse than RUSBoost",
            Rule::NoneBelow(0.0),
            &|gain| gain.high >= 0.0,
        ),
    ]
}

const NOWHERE: &str = "nowhere";

/// In words: for each sensor model the poses at which a sentence holds, with the fewest grasps from which on it does.
fn region(cases: impl IntoIterator<Item = (Kind<Case>, bool)>) -> String {
    let by_poses = grouped(cases.into_iter().map(|(kind, holds)| {
        let Case { poses, train } = kind.factor;
        ((kind.sensors.name(), poses), (train, holds))
    }));
    let from =
        |sizes: &[(usize, bool)]| sizes.iter().rev().take_while(|(_, holds)| *holds).last().map(|(train, _)| *train);
    let part = |((sensors, poses), sizes): ((&'static str, String), Vec<(usize, bool)>)| {
        (sensors, from(&sizes).map(|train| format!("poses {poses} from {train} grasps")))
    };
    let of_sensors = grouped(by_poses.into_iter().map(part));
    let words = of_sensors.into_iter().map(|(sensors, parts)| {
        let parts: Vec<String> = parts.into_iter().flatten().collect();
        let where_ = if parts.is_empty() { NOWHERE.to_owned() } else { parts.join(" and ") };
        format!("{where_} ({sensors} sensors)")
    });
    let words: Vec<String> = words.collect();
    if words.iter().all(|words| words.starts_with(NOWHERE)) { NOWHERE.to_owned() } else { words.join(", ") }
}

/// The map on the page of the paper, and its two sentences in the README where the study has been run in full.
pub(super) fn sections() -> Result<Vec<GeneratedSection>, serde_json::Error> {
    let section = |document: &'static str, name: &'static str, text: String| GeneratedSection { document, name, text };
    let of_map = |text: String| section("assets/help/paper.md", "region", text);
    let Some(ShownStudy { stored, .. }) = Region.shipped()? else {
        return Ok(vec![of_map("Not run in full with this version.".to_owned())]);
    };
    let said: Vec<&str> = stored.result.findings.iter().map(|finding| finding.found.as_str()).collect();
    Ok(vec![of_map(map(&stored.result, &stored.origin())), section("README.md", "region in short", said.join(" "))])
}

/// A line for each model, sensors and poses; macro F1 and the difference to RUSBoost for each number of grasps.
fn map(report: &StudyReport, origin: &str) -> String {
    let Some((_, table)) = report.table("region") else { return String::new() };
    let all = (0..table.rows.len()).map(|row| TableLine { table, row });
    let sizes = unique(all.clone().map(|line| line.value("training grasps")));
    let key = |line: TableLine<'_>| ["sensors", "poses", "model"].map(|column| line.text(column).to_owned());
    let cell = |line: &TableLine<'_>| {
        let [f1, gain] = [("F1", PERCENT), ("against RUSBoost", POINTS)]
            .map(|(column, unit)| table.cell(line.row, column).shown(unit));
        if gain == "-" { f1 } else { format!("{f1}; {gain}") }
    };
    let line = |(names, own): ([String; 3], Vec<TableLine<'_>>)| {
        let of =
            |size: &f64| own.iter().find(|line| line.value("training grasps") == *size).map_or_else(String::new, cell);
        [names.to_vec(), sizes.iter().map(of).collect()].concat()
    };
    let lines: Vec<Vec<String>> = grouped(all.map(|line| (key(line), line))).into_iter().map(line).collect();
    let counts: Vec<String> = sizes.iter().map(|size| format!("{size:.0} grasps")).collect();
    let header = [&["sensors", "poses", "model"][..], &counts.iter().map(String::as_str).collect::<Vec<_>>()].concat();
    format!(
        "Macro F1 in percent, then the paired difference to RUSBoost in points, each with its 95 % interval.\n\n{}\n\n{origin}.",
        markdown_table(&header, &lines)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_region_begins_where_every_larger_size_holds() {
        let method = method(STRICT).expect("known");
        let case = |sensors, poses: &str, train, holds| {
            (Kind { sensors, method, factor: Case { poses: poses.to_owned(), train } }, holds)
        };
        let [clean, noisy] = SensorModel::BOTH;
        let cases = [
            case(clean, "A", 20, true),
            case(clean, "A", 50, false),
            case(clean, "A", 100, true),
            case(clean, "A", 200, true),
            case(clean, "B", 20, true),
            case(clean, "B", 50, false),
            case(noisy, "A", 20, false),
        ];
        let said = "poses A from 100 grasps (virtual sensors), nowhere (physical-like sensors)";
        assert_eq!(region(cases), said);
        assert_eq!(region([case(clean, "A", 20, false), case(noisy, "A", 20, false)]), NOWHERE);
    }
}
