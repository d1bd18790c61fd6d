//! Sensors that drift (section VI): gains and zeros that differ between training and test, with and without a zero taken before
//! contact, and hysteresis that the training has not seen.

use super::prelude::*;
use palpate_lab::datasets::{DatasetError, noise_seed, sequence_of};
use palpate_sim::gripper::Phase;
use palpate_tactile::model::PhysicalLike;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub(super) struct Drift;

/// Methods: trees on features of the whole grasp, and the paper's network.
const METHODS: [&str; 2] = ["extra-trees", "macro-layer"];

/// What drifts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum DriftOf {
    Gain,
    Zero,
    Both,
}

impl DriftOf {
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
/// How grasps are read, and what the test varies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reading {
    AsRead,
    /// Less a zero taken before contact.
    Zeroed,
    /// As read, with hysteresis in training or test.
    Hysteresis,
}

impl Reading {
    const DRIFTED: [Self; 2] = [Self::AsRead, Self::Zeroed];
}

impl Factor for Reading {
    fn name(&self) -> String {
        if *self == Self::Zeroed { "re-zeroed" } else { "as read" }.to_owned()
    }

    fn named(&self, sensors: &str, method: &str) -> String {
        match self {
            Self::AsRead | Self::Zeroed => format!("{sensors}, {}, {method}", self.name()),
            Self::Hysteresis => format!("hysteresis, {method}"),
        }
    }
}

/// Beginning of a grasp over which zeros are taken (s): fingers have hardly begun to bend.
const ZERO_S: f32 = 0.1;

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
fn drifted(data: &Dataset, ranges: &[f32], kind: DriftOf, level: f64, seed: u64) -> Dataset {
    let drawn = |k: usize| -> Vec<[f32; 2]> {
        let mut random = ChaCha8Rng::seed_from_u64(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ k as u64);
        let mut within = || (level * (2.0 * random.random::<f64>() - 1.0)) as f32;
        ranges.iter().map(|range| [within(), within() * range]).collect()
    };
    let drawn: Vec<Vec<[f32; 2]>> = (0..data.examples.len()).map(drawn).collect();
    let moved = |(value, [gain, zero]): (&f32, &[f32; 2])| match kind {
        DriftOf::Gain => value * (1.0 + gain),
        DriftOf::Zero => value + zero,
        DriftOf::Both => value * (1.0 + gain) + zero,
    };
    data.with_channels(data.channels.clone(), |k, row| row.iter().zip(&drawn[k]).map(moved).collect())
}

/// Grasps less the mean of each channel at the beginning.
fn zeroed(data: &Dataset) -> Dataset {
    let zeros = |example: &Example| -> Vec<f32> {
        let grasp = &example.grasp;
        let from = grasp.t_s.first().copied().unwrap_or_default();
        let count = grasp.t_s.iter().take_while(|t| **t <= from + ZERO_S).count().max(1);
        let mean = |channel: usize| grasp.rows().take(count).map(|(_, row)| row[channel]).sum::<f32>() / count as f32;
        (0..data.channels.len()).map(mean).collect()
    };
    let zeros: Vec<Vec<f32>> = data.examples.iter().map(zeros).collect();
    let less = |k: usize, row: &[f32]| row.iter().zip(&zeros[k]).map(|(value, zero)| value - zero).collect();
    data.with_channels(data.channels.clone(), less)
}

/// Readings of the same simulated grasps by real sensors with these faults.
fn read_again(bench: &StudyData<'_>, data: &Dataset, settings: &PhysicalLike) -> Result<Dataset, StudyError> {
    let mut read = data.clone();
    for example in &mut read.examples {
        let trial = bench.simulated(example.id)?.ok_or_else(|| StudyError::missing("simulated grasps"))?;
        let clean = SensorView::default().signals(&trial).map_err(DatasetError::Layout)?;
        let end = trial.frames().iter().rev().find(|f| f.phase != Phase::Release).map_or(f64::INFINITY, |f| f.t);
        example.grasp = Arc::new(sequence_of(&settings.apply(&clean, noise_seed(&trial.header)).until(end)));
    }
    Ok(read)
}

/// The grasps that another data set has, with the readings of this one.
fn same_grasps(data: &Dataset, as_in: &Dataset) -> Dataset {
    let wanted: Vec<i64> = as_in.examples.iter().map(|example| example.id).collect();
    let kept: Vec<usize> = (0..data.examples.len()).filter(|k| wanted.contains(&data.examples[*k].id)).collect();
    data.part(&kept)
}

/// Answers under each condition, in its words.
type Answers = Vec<(String, ModelAnswers)>;

/// Condition without drift.
const NONE: &str = "none";

fn condition(kind: DriftOf, level: f64) -> String {
    if level > 0.0 { format!("{} {:.0} %", kind.name(), 100.0 * level) } else { NONE.to_owned() }
}

/// All conditions: none, then each kind at each level.
fn conditions() -> impl Iterator<Item = (DriftOf, f64)> {
    let drifts = DriftOf::ALL.into_iter().flat_map(|kind| LEVELS[1..].iter().map(move |level| (kind, *level)));
    std::iter::once((DriftOf::Gain, 0.0)).chain(drifts)
}

const HYSTERESIS: [(&str, bool, bool); 4] = [
    ("hysteresis in both", true, true),
    ("hysteresis in neither", false, false),
    ("hysteresis in the test alone", false, true),
    ("hysteresis in the training alone", true, false),
];

/// Reading and condition.
type Drifted = (Reading, String);

impl Study for Drift {
    type Cell = Fit<Reading>;
    type Found = Answers;

    const CARD: StudyCard = StudyCard {
        key: "drift",
        title: "Drift of sensors",
        about: "recognition with gains and zeros that have drifted since the training, re-zeroed or not, and with hysteresis",
        paper: "section VI, future work",
    };

    fn grid(plan: &StudyPlan) -> Vec<Self::Cell> {
        let methods = METHODS.into_iter().take(plan.pick(2, 1, 1)).filter_map(method);
        let kinds = |sensors: SensorModel, readings: &'static [Reading]| {
            let kind = move |method, factor: &Reading| Kind { sensors, method, factor: *factor };
            methods.clone().flat_map(move |method| readings.iter().map(move |reading| kind(method, reading)))
        };
        let drifted = plan.sensors.iter().flat_map(|sensors| kinds(*sensors, &Reading::DRIFTED));
        let has_hysteresis = plan.query.is_none() && plan.sensors.contains(&SensorModel::PhysicalLike);
        let hysteresis = has_hysteresis.then(|| kinds(SensorModel::PhysicalLike, &[Reading::Hysteresis]));
        let parts = plan.pick(PARTS, 1, 1);
        drifted.chain(hysteresis.into_iter().flatten()).flat_map(|kind| kind.fits(parts)).collect()
    }

    fn measure(Fit { kind, part }: &Self::Cell, bench: &StudyData<'_>) -> Result<Answers, StudyError> {
        let (plan, Kind { sensors, method, factor: reading }) = (bench.plan(), *kind);
        let mut answers = Answers::new();
        let data = bench.data(&usual_grasps(plan, sensors))?;
        let [train, test] = TestPart::usual(plan, *part).split(&data, plan.seed)?;
        if reading == Reading::Hysteresis {
            let read = |hysteresis| read_again(bench, &data, &PhysicalLike { hysteresis, ..PhysicalLike::default() });
            let (without, with) = (read(false)?, read(true)?);
            for (name, in_training, in_test) in HYSTERESIS {
                let of = |on: bool, grasps: &Dataset| same_grasps(if on { &with } else { &without }, grasps);
                let (train, test) = (of(in_training, &train), of(in_test, &test));
                answers.push((name.to_owned(), judge(&bench.fit(method, &train)?, &test)));
            }
        } else {
            let ranges = ranges(&train);
            let read = |data: Dataset| if reading == Reading::Zeroed { zeroed(&data) } else { data };
            let model = bench.fit(method, &read(train))?;
            for (kind, level) in conditions() {
                bench.check_stop()?;
                let test = drifted(&test, &ranges, kind, level, plan.seed);
                answers.push((condition(kind, level), judge(&model, &read(test))));
            }
        }
        bench.check_stop()?;
        Ok(answers)
    }

    fn report(plan: &StudyPlan, found: Vec<(Self::Cell, Answers)>) -> StudyReport {
        let mut rows: Vec<Row<Drifted>> = pooled(found.into_iter().flat_map(|(fit, answers)| {
            let judged = |(condition, own)| (fit.kind.with((fit.kind.factor, condition)), TestAnswers::Answers(own));
            answers.into_iter().map(judged).collect::<Vec<_>>()
        }));
        compare(&mut rows, |kind| {
            let reference = if kind.factor.0 == Reading::Hysteresis { HYSTERESIS[0].0 } else { NONE };
            Some(kind.with((kind.factor.0, reference.to_owned())))
        });
        let title = format!("Drift of the sensors in the test, preset {}; differences to none", plan.preset);
        StudyReport::new(
            described(&rows),
            vec![Row::table("drift", title, &rows).columns(&[
                Row::SENSORS,
                Column("reading", "", &|row| row.kind.factor.0.name().into()),
                Row::MODEL,
                Column("drift up to", "", &|row| row.kind.factor.1.as_str().into()),
                Row::F1,
                Row::ACCURACY,
                Row::gain("F1 against none"),
                Column("F1 against as read", POINTS, &|row| Cell::from(against_as_read(&rows, row))),
                Row::TESTED,
            ])],
            findings(&rows),
        )
    }

    fn figures(report: &StudyReport) -> Vec<Option<LinkedFigure>> {
        let Some(mut figure) = LinkedPlots::of(report, "drift") else { return Vec::new() };
        figure.named_once = true;
        let texts = |column: &'static str| unique(figure.lines().map(move |line| line.text(column)));
        let (all_sensors, models) = (texts("sensors"), texts("model"));
        for (sensors, kind) in all_sensors.into_iter().flat_map(|own| DriftOf::ALL.map(|kind| (own, kind))) {
            figure.plots.push(Plot {
                title: format!("{sensors}: {}", kind.name()),
                x: PlotAxis::linear("drift up to (%)"),
                y: PlotAxis { range: Some([0.0, 100.0]), ..PlotAxis::linear(F1_PERCENT) },
                ..Plot::default()
            });
            for (colour, model) in models.iter().enumerate() {
                for reading in Reading::DRIFTED {
                    let lines = figure.lines_with(&[
                        ("sensors", sensors),
                        ("reading", reading.name().as_str()),
                        ("model", model),
                    ]);
                    let points = LEVELS.into_iter().filter_map(|level| {
                        let condition = condition(kind, level);
                        let line = lines.iter().find(|line| line.text("drift up to") == condition)?;
                        Some((*line, line.percent("F1", 100.0 * level)))
                    });
                    let (line, marker) = match reading {
                        Reading::Zeroed => (LineStyle::Bold, Marker::Dot),
                        Reading::AsRead | Reading::Hysteresis => (LineStyle::Dashed, Marker::Ring),
                    };
                    let name = format!("{model}, {}", reading.name());
                    figure.series(DataSeries { name, colour, line, marker, points: Vec::new() }, points);
                }
            }
        }
        let note = "Each channel of each test grasp has a gain and a zero of its own, drawn evenly; zeros as shares of the channel's range. \
                    95 % intervals by bootstrap over test grasps.";
        vec![Some(figure.figure("drift", 3, [1180, 760], note))]
    }
}

/// Difference of a re-zeroed row to the same as read.
fn against_as_read(rows: &[Row<Drifted>], row: &Row<Drifted>) -> Option<Interval> {
    let (reading, condition) = &row.kind.factor;
    let as_read = find(rows, &row.kind.with((Reading::AsRead, condition.clone())));
    Some(row.pool.against(&as_read.filter(|_| *reading == Reading::Zeroed)?.pool)?.f1)
}

fn findings(rows: &[Row<Drifted>]) -> Vec<Finding> {
    let most = format!("{:.0} %", 100.0 * LEVELS[LEVELS.len() - 1]);
    let claim = |claim: &str, why: &str, rule: Rule, pick: &dyn Fn(&Row<Drifted>) -> Option<Interval>| {
        let found =
            rows.iter().filter_map(|row| Some((format!("{}, {}", row.kind.model(), row.kind.factor.1), pick(row)?)));
        Claim("VI", claim, why).on_each(POINTS, rule, found)
    };
    let findings = [
        claim(
            "Drifts of the sensors lower recognition",
            "Agrees where the paired 95 % interval of the change by gains and zeros drawn within 20 % is below zero in each case",
            Rule::AllBelow(0.0),
            &|row| row.gain.filter(|_| row.kind.factor.0 == Reading::AsRead && row.kind.factor.1.ends_with(&most)),
        ),
        claim(
            "A zero taken before contact takes back what a drift of zeros costs",
            "Agrees where models on re-zeroed readings are better under a zero that has drifted within 20 % of the range, each paired \
             95 % interval above zero",
            Rule::AllAbove(0.0),
            &|row| {
                let condition = &row.kind.factor.1;
                let is_worst = condition.ends_with(&most) && condition.starts_with(DriftOf::Zero.name());
                is_worst.then(|| against_as_read(rows, row)).flatten()
            },
        ),
        claim(
            "Hysteresis that the training has not seen lowers recognition",
            "Agrees where the paired 95 % interval of the change against hysteresis in training and test is below zero",
            Rule::AllBelow(0.0),
            &|row| row.gain.filter(|_| row.kind.factor.1 == HYSTERESIS[2].0),
        ),
    ];
    findings.into_iter().filter(|finding| finding.verdict != Agreement::NotMeasured).collect()
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
        assert_eq!(
            drifted(&data, &ranges, DriftOf::Both, 0.0, 1).examples[2].grasp.values,
            data.examples[2].grasp.values
        );
        let moved = drifted(&data, &ranges, DriftOf::Zero, 0.2, 1);
        let shifts: Vec<f32> =
            moved.examples.iter().zip(&data.examples).map(|(a, b)| a.grasp.values[0] - b.grasp.values[0]).collect();
        assert!(shifts.iter().all(|shift| shift.abs() <= 0.2 * ranges[0]) && shifts[0] != shifts[1], "{shifts:?}");
        let (back, straight) = (zeroed(&moved), zeroed(&data));
        for (a, b) in back.examples.iter().zip(&straight.examples) {
            assert!(a.grasp.values.iter().zip(&b.grasp.values).all(|(a, b)| (a - b).abs() < 1e-3));
        }
        let scaled = drifted(&data, &ranges, DriftOf::Gain, 0.2, 1);
        let gain = scaled.examples[0].grasp.values[78] / data.examples[0].grasp.values[78];
        assert!((0.8..1.2).contains(&gain) && gain != 1.0, "{gain}");
    }
}
