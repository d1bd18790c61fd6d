//! Sensors that drift (section VI): gains and zeros that are others in the test than in the training, with and without a
//! zero taken before contact, and hysteresis that the training has not seen.

use super::answers::{ModelAnswers, PARTS, Pool, TestPart, judge, usual_grasps};
use super::bench::{StudyBench, StudyError};
use super::cases::{CaseStudy, StudyCase};
use super::drawing::{F1_PERCENT, percent_point};
use super::plan::StudyPlan;
use super::report::{Agreement, Cell, FigureLink, FigureMark, Finding, LinkedFigure, PERCENT, StudyReport, StudyTable};
use super::{StudyCard, UnitResult};
use crate::datasets::{SensorView, noise_seed, sequence_of};
use palpate_geometry::drawing::{DataSeries, Figure, LineStyle, Marker, Plot, PlotAxis};
use palpate_learn::metrics::Interval;
use palpate_learn::{Dataset, Example, Method, Sequence, method};
use palpate_sim::gripper::Phase;
use palpate_tactile::model::{PhysicalLike, SensorModel};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::sync::Arc;

pub(super) struct Drift;

const CARD: StudyCard = StudyCard {
    key: "drift",
    title: "Drift of sensors",
    about: "recognition with gains and zeros that have drifted since the training, re-zeroed or not, and with hysteresis",
    paper: "section VI, future work",
    budget: "about 30 CPU minutes",
};

/// Methods: trees on features of the whole grasp, and the paper's network.
const METHODS: [&str; 2] = ["extra-trees", "macro-layer"];

/// What drifts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Gain,
    Zero,
    Both,
}

impl Kind {
    const ALL: [Self; 3] = [Self::Gain, Self::Zero, Self::Both];

    fn name(self) -> &'static str {
        match self {
            Self::Gain => "gain",
            Self::Zero => "zero",
            Self::Both => "gain and zero",
        }
    }
}

/// Largest drifts, as shares: of the gain, and of the channel's range for the zero.
const LEVELS: [f64; 4] = [0.0, 0.05, 0.10, 0.20];
/// Names of the ways of reading.
const AS_READ: &str = "as read";
const ZEROED: &str = "re-zeroed";
const READINGS: [&str; 2] = [AS_READ, ZEROED];
/// Beginning of a grasp over which zeros are taken (s): fingers have hardly begun to bend.
const ZERO_S: f32 = 0.1;

pub(super) enum Case {
    Drifted { sensors: SensorModel, reading: &'static str, method: &'static Method, part: usize },
    Hysteresis { method: &'static Method, part: usize },
}

impl StudyCase for Case {
    fn all(plan: &StudyPlan) -> Vec<Self> {
        let methods = || METHODS.into_iter().take(plan.pick(2, 1, 1)).filter_map(method);
        let parts = plan.pick(PARTS, 1, 1);
        let mut cases = Vec::new();
        for &sensors in &plan.sensors {
            for method in methods() {
                for reading in READINGS {
                    cases.extend((0..parts).map(|part| Self::Drifted { sensors, reading, method, part }));
                }
            }
        }
        if plan.query.is_none() && plan.sensors.contains(&SensorModel::PhysicalLike) {
            for method in methods() {
                cases.extend((0..parts).map(|part| Self::Hysteresis { method, part }));
            }
        }
        cases
    }

    fn name(&self) -> String {
        match self {
            Self::Drifted { sensors, reading, method, part } => {
                format!("{}, {reading}, {}, part {}", sensors.name(), method.key, part + 1)
            }
            Self::Hysteresis { method, part } => format!("hysteresis, {}, part {}", method.key, part + 1),
        }
    }

    fn method(&self) -> &'static Method {
        match self {
            Self::Drifted { method, .. } | Self::Hysteresis { method, .. } => method,
        }
    }
}

/// A copy of the grasps with other readings.
fn with_readings(data: &Dataset, read: impl Fn(usize, &Example) -> Sequence) -> Dataset {
    let example = |(k, example): (usize, &Example)| {
        let grasp = read(k, example);
        Example { content: grasp.content(), grasp: Arc::new(grasp), ..example.clone() }
    };
    Dataset { examples: data.examples.iter().enumerate().map(example).collect(), ..data.part(&[]) }
}

/// Range of each channel: the value that one reading in a hundred exceeds.
fn ranges(data: &Dataset) -> Vec<f32> {
    let width = data.channels.len();
    let range = |channel: usize| {
        let rows = data.examples.iter().flat_map(|example| example.grasp.values.iter().skip(channel).step_by(width));
        let mut values: Vec<f32> = rows.map(|value| value.abs()).collect();
        values.sort_by(f32::total_cmp);
        values.get(values.len() * 99 / 100).copied().unwrap_or_default()
    };
    (0..width).map(range).collect()
}

/// Grasps whose channels each have a gain and a zero of their own, drawn evenly up to a level.
fn drifted(data: &Dataset, ranges: &[f32], kind: Kind, level: f64, seed: u64) -> Dataset {
    with_readings(data, |k, example| {
        let mut random = ChaCha8Rng::seed_from_u64(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ k as u64);
        let mut within = || (level * (2.0 * random.random::<f64>() - 1.0)) as f32;
        let drawn: Vec<[f32; 2]> = ranges.iter().map(|range| [within(), within() * range]).collect();
        let mut grasp = (*example.grasp).clone();
        for row in grasp.values.chunks_exact_mut(ranges.len().max(1)) {
            for (value, [gain, zero]) in row.iter_mut().zip(&drawn) {
                *value = match kind {
                    Kind::Gain => *value * (1.0 + gain),
                    Kind::Zero => *value + zero,
                    Kind::Both => *value * (1.0 + gain) + zero,
                };
            }
        }
        grasp
    })
}

/// Grasps less the mean of each channel at the beginning.
fn zeroed(data: &Dataset) -> Dataset {
    let width = data.channels.len().max(1);
    with_readings(data, |_, example| {
        let mut grasp = (*example.grasp).clone();
        let from = grasp.t_s.first().copied().unwrap_or_default();
        let count = grasp.t_s.iter().take_while(|t| **t <= from + ZERO_S).count().max(1);
        let zeros: Vec<f32> = (0..width)
            .map(|channel| grasp.values.iter().skip(channel).step_by(width).take(count).sum::<f32>() / count as f32)
            .collect();
        for row in grasp.values.chunks_exact_mut(width) {
            row.iter_mut().zip(&zeros).for_each(|(value, zero)| *value -= zero);
        }
        grasp
    })
}

/// Readings of the same simulated grasps by real sensors with these faults; none where one is not simulated.
fn read_again(bench: &StudyBench<'_>, data: &Dataset, settings: &PhysicalLike) -> Result<Option<Dataset>, StudyError> {
    let mut read = Vec::new();
    for example in &data.examples {
        let Some(trial) = bench.simulated(example.id)? else { return Ok(None) };
        let clean = SensorView::default().signals(&trial);
        let clean = clean.map_err(|cause| crate::datasets::DatasetError::Layout { cause })?;
        let end = trial.frames().iter().rev().find(|f| f.phase != Phase::Release).map_or(f64::INFINITY, |f| f.t);
        read.push(sequence_of(&settings.apply(&clean, noise_seed(&trial.header)).until(end)));
    }
    Ok(Some(with_readings(data, |k, _| read[k].clone())))
}

/// The grasps that another data set has, with the readings of this one.
fn same_grasps(data: &Dataset, as_in: &Dataset) -> Dataset {
    let wanted: Vec<i64> = as_in.examples.iter().map(|example| example.id).collect();
    let kept: Vec<usize> = (0..data.examples.len()).filter(|k| wanted.contains(&data.examples[*k].id)).collect();
    data.part(&kept)
}

/// Answers under each condition, in its words.
type Answers = Vec<(String, ModelAnswers)>;

fn condition(kind: Kind, level: f64) -> String {
    if level > 0.0 { format!("{} {:.0} %", kind.name(), 100.0 * level) } else { "none".to_owned() }
}

/// All conditions: none, then each kind at each level.
fn conditions() -> impl Iterator<Item = (Kind, f64)> {
    let drifts = Kind::ALL.into_iter().flat_map(|kind| LEVELS[1..].iter().map(move |level| (kind, *level)));
    std::iter::once((Kind::Gain, 0.0)).chain(drifts)
}

const HYSTERESIS: [(&str, bool, bool); 4] = [
    ("hysteresis in both", true, true),
    ("hysteresis in neither", false, false),
    ("hysteresis in the test alone", false, true),
    ("hysteresis in the training alone", true, false),
];

impl CaseStudy for Drift {
    type Case = Case;

    const CARD: StudyCard = CARD;

    fn measure(&self, case: Case, bench: &StudyBench<'_>) -> Result<Option<UnitResult>, StudyError> {
        let plan = bench.plan();
        let answers = match case {
            Case::Drifted { sensors, reading, method, part } => {
                let Some(data) = bench.data(&usual_grasps(plan, sensors))? else { return Ok(None) };
                let (train, test) = TestPart::usual(plan, part).split(&data, plan.seed)?;
                let ranges = ranges(&train);
                let read = |data: Dataset| if reading == ZEROED { zeroed(&data) } else { data };
                let Some(model) = bench.fit(method, &read(train))? else { return Ok(None) };
                let judged = conditions().map(|(kind, level)| {
                    let test = drifted(&test, &ranges, kind, level, plan.seed);
                    (condition(kind, level), judge(&model, &read(test)))
                });
                judged.take_while(|_| !bench.is_cancelled()).collect::<Answers>()
            }
            Case::Hysteresis { method, part } => {
                let Some(data) = bench.data(&usual_grasps(plan, SensorModel::PhysicalLike))? else { return Ok(None) };
                let read =
                    |hysteresis| read_again(bench, &data, &PhysicalLike { hysteresis, ..PhysicalLike::default() });
                let read = [read(false)?, read(true)?];
                let [Some(without), Some(with)] = read else {
                    return Err(StudyError::Missing("simulated grasps".to_owned()));
                };
                let mut answers = Answers::new();
                let (train, test) = TestPart::usual(plan, part).split(&data, plan.seed)?;
                for (name, in_training, in_test) in HYSTERESIS {
                    let of = |on: bool, grasps: &Dataset| same_grasps(if on { &with } else { &without }, grasps);
                    let (train, test) = (of(in_training, &train), of(in_test, &test));
                    let Some(model) = bench.fit(method, &train)? else { return Ok(None) };
                    answers.push((name.to_owned(), judge(&model, &test)));
                }
                answers
            }
        };
        if bench.is_cancelled() {
            return Ok(None);
        }
        UnitResult::new(&answers).map(Some)
    }

    fn report(&self, plan: &StudyPlan, units: &BTreeMap<String, UnitResult>) -> Result<StudyReport, StudyError> {
        let mut groups: Vec<Group> = Vec::new();
        let mut report = StudyReport::default();
        for case in Case::all(plan) {
            let Some(unit) = units.get(&case.name()) else { continue };
            let key = match &case {
                Case::Drifted { sensors, reading, method, .. } => [sensors.name(), *reading, method.key],
                Case::Hysteresis { method, .. } => [SensorModel::PhysicalLike.name(), AS_READ, method.key],
            };
            for (condition, answers) in unit.read::<Answers>()? {
                if !report.data.contains(&answers.data) {
                    report.data.push(answers.data.clone());
                }
                let fits = |group: &&mut Group| group.key == key && group.condition == condition;
                match groups.iter_mut().find(fits) {
                    Some(group) => group.answers.push(answers),
                    None => groups.push(Group { key, condition, answers: vec![answers] }),
                }
            }
        }
        let mut table = StudyTable::new(
            CARD.key,
            format!("Drift of the sensors in the test, preset {}; differences to none", plan.preset),
            &[
                ("sensors", ""),
                ("reading", ""),
                ("model", ""),
                ("drift up to", ""),
                ("F1", PERCENT),
                ("accuracy", PERCENT),
                ("F1 against none", PERCENT),
                ("F1 against as read", PERCENT),
                ("tested", "grasps"),
            ],
        );
        let mut measured = Vec::new();
        for group in &groups {
            let pool = group.pool();
            let other = |key: [&str; 3], condition: &str| {
                let found = groups.iter().find(|other| other.key == key && other.condition == condition)?;
                let differs = found.key != group.key || found.condition != group.condition;
                differs.then(|| pool.against(&found.pool())).flatten().map(|difference| difference.f1)
            };
            let is_hysteresis = group.condition.starts_with("hysteresis");
            let reference = if is_hysteresis { HYSTERESIS[0].0 } else { "none" };
            let against_none = other(group.key, reference);
            let [sensors, reading, model] = group.key;
            let against_read =
                (reading == ZEROED).then(|| other([sensors, AS_READ, model], &group.condition)).flatten();
            table.push(
                vec![
                    Cell::text(sensors),
                    Cell::text(reading),
                    Cell::text(model),
                    Cell::text(&group.condition),
                    Cell::interval(pool.f1()),
                    Cell::interval(pool.accuracy()),
                    Cell::interval(against_none),
                    Cell::interval(against_read),
                    Cell::Number(pool.len() as f64),
                ],
                pool.misjudged(),
            );
            measured.push((group.key, group.condition.clone(), against_none, against_read));
        }
        report.findings = findings(&measured);
        report.tables.push(table);
        Ok(report)
    }

    fn figures(&self, report: &StudyReport) -> Vec<LinkedFigure> {
        report.table(CARD.key).map(|(at, table)| figure(at, table)).into_iter().collect()
    }
}

/// Answers of one kind of model and reading under one condition.
struct Group {
    /// Sensors, reading, model.
    key: [&'static str; 3],
    condition: String,
    answers: Vec<ModelAnswers>,
}

impl Group {
    fn pool(&self) -> Pool {
        Pool::of(&self.answers)
    }
}

/// Sensors, reading and model; the condition; difference to no drift, and to the same without re-zeroing.
type MeasuredDrift = ([&'static str; 3], String, Option<Interval>, Option<Interval>);

fn findings(measured: &[MeasuredDrift]) -> Vec<Finding> {
    let points = |gain: Interval| {
        format!("{:+.1} ({:+.1} to {:+.1})", 100.0 * gain.estimate, 100.0 * gain.low, 100.0 * gain.high)
    };
    let of = |wanted: &dyn Fn(&MeasuredDrift) -> bool, pick: &dyn Fn(&MeasuredDrift) -> Option<Interval>, sign: f64| {
        let own: Vec<(String, Interval)> = measured
            .iter()
            .filter(|one| wanted(one))
            .filter_map(|one| {
                let ([sensors, _, model], condition, ..) = one;
                Some((format!("{sensors}, {model}, {condition}"), pick(one)?))
            })
            .collect();
        let verdict = Agreement::of_all(own.iter().map(|(_, gain)| {
            let (low, high) = if sign < 0.0 { (-gain.high, -gain.low) } else { (gain.low, gain.high) };
            Agreement::of_gain(Some(Interval { estimate: sign * gain.estimate, low, high }))
        }));
        let listed: Vec<String> = own.iter().map(|(name, gain)| format!("{name}: {}", points(*gain))).collect();
        (format!("points of macro F1: {}", listed.join("; ")), verdict)
    };
    let mut findings = Vec::new();
    let mut add = |claim: &str, (found, verdict): (String, Agreement), why: &str| {
        if verdict != Agreement::NotMeasured {
            let (section, claim, why) = ("VI".to_owned(), claim.to_owned(), why.to_owned());
            findings.push(Finding { section, claim, found, verdict, why });
        }
    };
    let most = format!("{:.0} %", 100.0 * LEVELS[LEVELS.len() - 1]);
    let worst = |condition: &str| condition.ends_with(&most);
    add(
        "Drifts of the sensors lower recognition",
        of(&|one| one.0[1] == AS_READ && worst(&one.1), &|one| one.2, -1.0),
        "Agrees where the paired 95 % interval of the loss to gains and zeros drawn within 20 % is above zero in each case",
    );
    add(
        "A zero taken before contact takes back what a drift of zeros costs",
        of(&|one| worst(&one.1) && one.1.starts_with(Kind::Zero.name()), &|one| one.3, 1.0),
        "Agrees where models on re-zeroed readings are better under a zero that has drifted within 20 % of the range, each paired 95 % \
         interval above zero",
    );
    add(
        "Hysteresis that the training has not seen lowers recognition",
        of(&|one| one.1 == HYSTERESIS[2].0, &|one| one.2, -1.0),
        "Agrees where the paired 95 % interval of the loss against hysteresis in training and test is above zero",
    );
    findings
}

/// A plot for each kind of drift and sensors: F1 over its level, one line for each model and reading.
fn figure(at: usize, table: &StudyTable) -> LinkedFigure {
    let (mut plots, mut links) = (Vec::new(), Vec::new());
    for sensors in table.texts("sensors") {
        for kind in Kind::ALL {
            let mut plot = Plot {
                title: format!("{sensors}: {}", kind.name()),
                x: PlotAxis::linear("drift up to (%)"),
                y: PlotAxis { range: Some([0.0, 100.0]), ..PlotAxis::linear(F1_PERCENT) },
                ..Plot::default()
            };
            for (colour, model) in table.texts("model").into_iter().enumerate() {
                for reading in READINGS {
                    let mut points = Vec::new();
                    for level in LEVELS {
                        let texts = [("sensors", sensors), ("reading", reading), ("model", model)];
                        let condition = condition(kind, level);
                        let rows = table.rows_with(&texts);
                        let row = rows.into_iter().find(|row| table.text(*row, "drift up to") == condition);
                        let Some(row) = row else { continue };
                        let mark = FigureMark::Point(plot.series.len(), points.len());
                        links.push(FigureLink { plot: plots.len(), mark, table: at, row });
                        points.push(percent_point(table, row, "F1", 100.0 * level));
                    }
                    let zeroed = reading == ZEROED;
                    plot.series.push(DataSeries {
                        name: if plots.is_empty() { format!("{model}, {reading}") } else { String::new() },
                        colour,
                        line: if zeroed { LineStyle::Bold } else { LineStyle::Dashed },
                        marker: if zeroed { Marker::Dot } else { Marker::Ring },
                        points,
                    });
                }
            }
            plots.push(plot);
        }
    }
    let note = "Each channel of each test grasp has a gain and a zero of its own, drawn evenly; zeros as shares of the channel's range. \
                95 % intervals by bootstrap over test grasps."
        .to_owned();
    let figure = Figure { title: table.title.clone(), plots, columns: 3, note };
    LinkedFigure { name: CARD.key.to_owned(), figure, size: [1180, 760], links }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn data() -> Dataset {
        let grasp = |level: f32| {
            let t_s: Vec<f32> = (0..40).map(|k| 0.05 * k as f32).collect();
            let values = t_s.iter().flat_map(|t| [level * t, 100.0 * level * t]).collect();
            Arc::new(Sequence { t_s, values })
        };
        let examples = (0..3).map(|k| Example { id: k, grasp: grasp(1.0 + k as f32), ..Example::default() });
        Dataset {
            channels: ["curvature_left", "pressure_left"].map(str::to_owned).to_vec(),
            examples: examples.collect(),
            ..Dataset::default()
        }
    }

    #[test]
    fn drifts_stay_within_their_level_and_a_zero_takes_back_a_drift_of_zeros() {
        let (data, ranges) = (data(), ranges(&data()));
        assert!((ranges[1] / ranges[0] - 100.0).abs() < 1e-3 && ranges[0] > 5.0, "{ranges:?}");
        assert_eq!(drifted(&data, &ranges, Kind::Both, 0.0, 1).examples[2].grasp.values, data.examples[2].grasp.values);
        let moved = drifted(&data, &ranges, Kind::Zero, 0.2, 1);
        let shifts: Vec<f32> =
            moved.examples.iter().zip(&data.examples).map(|(a, b)| a.grasp.values[0] - b.grasp.values[0]).collect();
        assert!(shifts.iter().all(|shift| shift.abs() <= 0.2 * ranges[0]) && shifts[0] != shifts[1], "{shifts:?}");
        let (back, straight) = (zeroed(&moved), zeroed(&data));
        for (a, b) in back.examples.iter().zip(&straight.examples) {
            assert!(a.grasp.values.iter().zip(&b.grasp.values).all(|(a, b)| (a - b).abs() < 1e-3));
        }
        let scaled = drifted(&data, &ranges, Kind::Gain, 0.2, 1);
        let gain = scaled.examples[0].grasp.values[78] / data.examples[0].grasp.values[78];
        assert!((0.8..1.2).contains(&gain) && gain != 1.0, "{gain}");
    }
}
