//! Sensors that fail in the middle of a grasp, on emulated grippers of drawn parts and builds: which are found within the grasp,
//! which sound ones are suspected, and what recognition loses when a pad is dead. Fits what sound channels foretell.

use crate::emulated::{EmulatedHand, REST_S};
use crate::frame::{
    Cell, Claim, Column, Experiment, LinkedFigure, PERCENT, POINTS, Rule, StudyCell, StudyCommand, StudyError,
    StudyReport, StudyTable, TableRows, grouped,
};
use crate::paper::{Pool, STUDY_PRESET, TestAnswers, judge};
use palpate_device::emulator::{EmulatedFault, parse_faults};
use palpate_lab::datasets::labels_of_catalogue;
use palpate_lab::grasping::random_shapes;
use palpate_lab::labelling::SensorWatch;
use palpate_learn::metrics::Interval;
use palpate_learn::{
    DataCard, Dataset, Example, Fitting, LearnError, Method, Model, Sequence, Shipped, SoundChannels, method,
};
use palpate_sim::gripper::{Phase, Programme};
use palpate_sim::objects::{EMPTY, catalogue};
use palpate_sim::poses::PoseSampler;
use palpate_sim::scene::{PosePreset, Scene};
use palpate_tactile::board::Sensor;
use palpate_tactile::trial::BoardLog;
use palpate_tactile::{Channel, SignalDefinition, whole_fingers};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Key of the study, and its name.
pub const SENSOR_FAULTS: &str = "sensor-faults";
pub(crate) const TITLE: &str = "Sensors that fail";

/// Seeds of the grippers that judge, that recognisers learn from, and that the predictors learn from.
const JUDGES: u64 = 1;
const LEARNT: u64 = 2000;
const SOUND: u64 = 1000;
/// Seeds of unknown objects: random shapes that judge, and those that the predictors learn from.
const UNKNOWN: u64 = 70_000;
const UNKNOWN_LEARNT: u64 = 80_000;
/// How far a fixed object lies from the middle at most (m): mostly one finger touches it first, or alone.
const ONE_SIDED: f64 = 0.02;
/// Grasps of each object by a gripper.
const EACH: usize = 2;
/// Faults begin before the closing, or in the hold (s since the rest began).
const BEGINS: [(&str, f64); 2] = [("before the closing", 0.2), ("in the hold", REST_S + 2.2)];
/// Faults of a channel, as the emulator takes them.
const KINDS: [(&str, &str); 7] = [
    ("open", "open={}"),
    ("saturated", "saturation={}"),
    ("no number", "nan={}"),
    ("stuck", "stuck={}"),
    ("gain 0.5", "gain={}*0.5"),
    ("gain 0.7", "gain={}*0.7"),
    ("gain 1.4", "gain={}*1.4"),
];
/// Faults of the whole board.
const OF_BOARD: [(&str, &str); 2] = [("crosstalk 0.2", "crosstalk=0.2"), ("10 bits", "tenbit=0")];
/// Length of a fault: until the fingers are open again (s).
const LASTS_S: f64 = 4.2;
/// Steps of the programme in a second.
const TICKS_PER_S: f32 = 10.0;
/// Methods that learn with and without a pad, and the model that is shipped, which learned with both.
const METHODS: [&str; 2] = ["extra-trees", "macro-layer"];
const SHIPPED: &str = "shipped";
/// The pads of [`whole_fingers`].
const PADS: [&str; 2] = ["pressure_left", "pressure_right"];
/// Readings of a strip (1/m) and a pad (Pa) from which their predictors are logarithmic.
const SCALES: [f32; 2] = [20.0, 2000.0];
/// Most that a dead pad may cost, and the largest share of false alarms.
const MOST_LOSS: f64 = 0.01;
const MOST_ALARMS: f64 = 0.01;

/// The study in full, or in less than a minute.
pub fn sensor_fault_study(quick: bool) -> impl Experiment<Report = StudyReport> {
    let (judges, learnt) = if quick { (1, 1) } else { (12, 30) };
    SensorFaultStudy { judges, learnt, quick, data: Mutex::default() }
}

struct SensorFaultStudy {
    /// Grippers that judge, and that recognisers learn from.
    judges: u64,
    learnt: u64,
    quick: bool,
    /// Grasps to learn from and to judge by, once they are made.
    data: Mutex<Option<Arc<[Dataset; 2]>>>,
}

enum FaultCell {
    /// A gripper whose sensors fail.
    Gripper(u64),
    /// A recogniser that loses a pad; none for the shipped one.
    Answers(Option<&'static Method>),
}

impl StudyCell for FaultCell {
    fn name(&self) -> String {
        match self {
            Self::Gripper(seed) => format!("gripper {seed}"),
            Self::Answers(method) => format!("dead pad, {}", method.map_or(SHIPPED, |method| method.key)),
        }
    }

    fn method(&self) -> Option<&'static Method> {
        if let Self::Answers(method) = self { *method } else { None }
    }
}

/// What is found in a cell.
#[derive(Clone, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum FaultFound {
    Gripper {
        /// Kind of sound grasp, number of grasps, and of those in which a sensor was suspected.
        sound: Vec<(String, [usize; 2])>,
        /// Fault, sensors, beginning; number of grasps, of those in which the sensor was named, and only others.
        faults: Vec<([String; 3], [usize; 3])>,
    },
    /// Answers by condition and pad.
    Answers(Vec<([String; 2], TestAnswers)>),
}

/// Conditions of the pads.
const BOTH: &str = "both pads";
const AS_READ: &str = "dead, as read";
const FORETOLD: &str = "dead, foretold by the others";
const WITHOUT: &str = "learned without it";

/// Scene of a gripper of drawn build; one-sided where the object is fixed beside the middle.
fn scene_of(seed: u64, one_sided: bool) -> Result<Scene, StudyError> {
    let preset =
        PosePreset::named(STUDY_PRESET).ok_or_else(|| StudyError::Unknown(format!("preset {STUDY_PRESET}")))?;
    let mut scene = Scene { pose: preset.poses(), ..Scene::default() };
    let mut builds = scene.clone();
    builds.pose.build = 1.0;
    scene.gripper = PoseSampler::new(&builds, None).draw(None, seed).0.gripper;
    // The pose is drawn for each grasp.
    scene.gripper.mount = builds.gripper.mount;
    if one_sided {
        scene.object.fixed = true;
        scene.pose.shift = [ONE_SIDED; 3];
    }
    Ok(scene)
}

fn objects() -> Vec<String> {
    catalogue().iter().map(|object| object.name.clone()).collect()
}

fn channels() -> Vec<Channel> {
    whole_fingers(SignalDefinition::Parts).into_iter().filter(|own| !own.name().starts_with("force")).collect()
}

fn names() -> Vec<String> {
    channels().iter().map(Channel::name).collect()
}

/// Kinds of sound grasps of a gripper, with their logs.
fn sound_grasps(
    seed: u64,
    unknown: Range<u64>,
    mut take: impl FnMut(&str, &EmulatedHand<'_>, BoardLog),
) -> Result<(), StudyError> {
    let modelled = Scene::default();
    let [free, fixed] = [scene_of(seed, false)?, scene_of(seed, true)?];
    let kinds = [
        ("objects", &free, objects()),
        ("unknown objects", &free, random_shapes(unknown)),
        ("empty hand", &free, vec![EMPTY.to_owned()]),
        ("fixed beside the middle", &fixed, objects()),
    ];
    for (kind, scene, objects) in kinds {
        let hand = EmulatedHand::new(scene, &modelled, seed)?;
        for (number, object) in (0..).zip(&objects) {
            let each = if object == EMPTY { 2 * EACH } else { EACH };
            let logs = hand.grasps(object, seed * 10_000 + 100 * number, &vec![Vec::new(); each])?;
            logs.into_iter().for_each(|log| take(kind, &hand, log));
        }
    }
    Ok(())
}

/// The watch after a whole trial.
fn watched(hand: &EmulatedHand<'_>, log: &BoardLog) -> SensorWatch {
    let course = &log.course;
    let closing_s = course.phases.first().map_or(f64::INFINITY, |mark| mark.from_s);
    let rest = log.readings.partition_point(|reading| reading.t_s < closing_s);
    SensorWatch::of_trial(&course.board, [&log.readings[..rest], &log.readings], &course.phases, &hand.calibrations)
}

/// A fault of a gripper's grasp: words, the sensor, and what the emulator does.
type FaultCase = ([String; 3], Option<Sensor>, EmulatedFault);

fn fault_cases(left: bool) -> Result<Vec<FaultCase>, StudyError> {
    let mut cases = Vec::new();
    let mut add = |name: &str, text: String, sensor: Option<(&str, Sensor)>, (begins, from_s): (&str, f64)| {
        let faults =
            parse_faults(&format!("{text}@{from_s}/{}", LASTS_S - from_s + REST_S)).map_err(StudyError::missing)?;
        let words = [name, sensor.map_or("all", |(kind, _)| kind), begins].map(str::to_owned);
        cases.extend(faults.into_iter().map(|fault| (words.clone(), sensor.map(|(_, sensor)| sensor), fault)));
        Ok::<(), StudyError>(())
    };
    let sensors = if left {
        [("strip", Sensor::FLEX_LEFT), ("pad", Sensor::PAD_LEFT)]
    } else {
        [("strip", Sensor::FLEX_RIGHT), ("pad", Sensor::PAD_RIGHT)]
    };
    for begins in BEGINS {
        for (name, text) in KINDS {
            for sensor in sensors {
                add(name, text.replace("{}", &sensor.1.index().to_string()), Some(sensor), begins)?;
            }
        }
    }
    OF_BOARD.into_iter().try_for_each(|(name, text)| add(name, text.to_owned(), None, BEGINS[0]))?;
    Ok(cases)
}

/// Which faults of a gripper are found, and which sound sensors are suspected.
fn watched_gripper(seed: u64, objects: &[String], stop: &AtomicBool) -> Result<FaultFound, StudyError> {
    let mut sound = Vec::new();
    let unknown = UNKNOWN + 10 * seed;
    sound_grasps(seed, unknown..unknown + 8, |kind, hand, log| {
        sound.push((kind.to_owned(), [1, usize::from(watched(hand, &log).faults().next().is_some())]));
    })?;
    let scene = scene_of(seed, false)?;
    let hand = EmulatedHand::new(&scene, &Scene::default(), seed)?;
    let mut faults = Vec::new();
    for (number, object) in (0..).zip(objects) {
        if stop.load(Ordering::Relaxed) {
            return Err(StudyError::Stopped);
        }
        let cases = fault_cases(number % 2 == 0)?;
        let lists: Vec<Vec<EmulatedFault>> = cases.iter().map(|(_, _, fault)| vec![*fault]).collect();
        let logs = hand.grasps(object, seed * 10_000 + 5000 + 100 * number, &lists)?;
        for ((words, sensor, _), log) in cases.into_iter().zip(logs) {
            let watch = watched(&hand, &log);
            let named = watch.faults().any(|fault| sensor.is_none_or(|sensor| fault.sensor == sensor));
            let other = !named && watch.faults().next().is_some();
            faults.push((words, [1, usize::from(named), usize::from(other)]));
        }
    }
    Ok(FaultFound::Gripper { sound: summed(sound), faults: summed(faults) })
}

/// Sums of equal kinds.
fn summed<K: PartialEq, const N: usize>(all: impl IntoIterator<Item = (K, [usize; N])>) -> Vec<(K, [usize; N])> {
    let sum =
        |counts: Vec<[usize; N]>| -> [usize; N] { std::array::from_fn(|k| counts.iter().map(|own| own[k]).sum()) };
    grouped(all).into_iter().map(|(kind, counts)| (kind, sum(counts))).collect()
}

/// Sound grasps of the built-in objects by these grippers.
fn grasps(seeds: Range<u64>) -> Result<Dataset, StudyError> {
    let (labels, names) = (labels_of_catalogue(), names());
    let of = |seed: u64| -> Result<Vec<Example>, StudyError> {
        let scene = scene_of(seed, false)?;
        let hand = EmulatedHand::new(&scene, &Scene::default(), seed)?;
        let mut examples = Vec::new();
        for (number, object) in (0..).zip(objects()) {
            let class = labels.class(&object).ok_or_else(|| StudyError::Unknown(object.clone()))?;
            for log in hand.grasps(&object, seed * 10_000 + 100 * number, &vec![Vec::new(); EACH])? {
                let grasp = hand.sequence(&log, &names)?;
                let id = (seed * 1000) as i64 + examples.len() as i64;
                examples.push(Example {
                    id,
                    class,
                    content: grasp.content(),
                    grasp: Arc::new(grasp),
                    ..Example::default()
                });
            }
        }
        Ok(examples)
    };
    let examples = seeds.into_par_iter().map(of).collect::<Result<Vec<_>, _>>()?.concat();
    let object = "free, emulated grippers of drawn parts and builds".to_owned();
    let about =
        DataCard { preset: Some(STUDY_PRESET.to_owned()), object, grasps: examples.len(), ..DataCard::default() };
    Ok(Dataset { channels: names, labels, examples, about })
}

/// The line pressure at a time since the closing (bar).
fn line_bar(programme: &Programme, t_s: f32) -> f32 {
    programme.command((t_s * TICKS_PER_S) as u32).0 as f32
}

/// The same grasps with another reading in a channel, from the time and the row.
fn with_reading(data: &Dataset, channel: usize, reading: impl Fn(f32, &[f32]) -> f32) -> Dataset {
    let mut other = data.clone();
    for example in &mut other.examples {
        let values = example.grasp.rows().flat_map(|(t, row)| {
            let mut row = row.to_vec();
            row[channel] = reading(t, &row);
            row
        });
        example.grasp = Arc::new(Sequence { t_s: example.grasp.t_s.clone(), values: values.collect() });
    }
    other
}

fn without(data: &Dataset, channel: usize) -> Dataset {
    let names = (0..data.channels.len()).filter(|own| *own != channel).map(|own| data.channels[own].clone()).collect();
    data.with_channels(names, |_, row| [&row[..channel], &row[channel + 1..]].concat())
}

impl SensorFaultStudy {
    fn objects(&self) -> Vec<String> {
        let all = objects();
        let few = if self.quick { 2 } else { all.len() };
        all.into_iter().take(few).collect()
    }

    /// Grasps to learn from and to judge by.
    fn data(&self) -> Result<Arc<[Dataset; 2]>, StudyError> {
        let mut data = self.data.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(data) = &*data {
            return Ok(Arc::clone(data));
        }
        let made = [grasps(LEARNT..LEARNT + self.learnt)?, grasps(JUDGES..JUDGES + self.judges)?];
        Ok(Arc::clone(data.insert(Arc::new(made))))
    }

    /// Answers with both pads and with a dead one.
    fn answers(&self, method: Option<&'static Method>, stop: &AtomicBool) -> Result<FaultFound, StudyError> {
        let data = self.data()?;
        let [train, test] = &*data;
        let sound = SoundChannels::shipped().map_err(StudyError::missing)?;
        let programme = Programme::default();
        let fit = |method: &'static Method, train: &Dataset| {
            let fitting = Fitting::new(1, self.quick, stop);
            method.train(train, &fitting).map_err(|cause: LearnError| StudyError::of_fit(method.key, cause))
        };
        let model: Model = match method {
            Some(method) => fit(method, train)?,
            None => Shipped::AnyGripper.model().map_err(StudyError::missing)?,
        };
        let asked = |model: &Model, test: &Dataset| {
            let test = test.relabelled(&model.card.labels);
            test.map(|test| TestAnswers::Answers(judge(model, &test)))
                .ok_or_else(|| StudyError::missing("known objects"))
        };
        let mut all = vec![([BOTH.to_owned(), String::new()], asked(&model, test)?)];
        for pad in PADS {
            let Some(channel) = test.channels.iter().position(|own| own == pad) else { continue };
            let dead = with_reading(test, channel, |_, _| 0.0);
            let foretold = with_reading(test, channel, |t, row| sound.foretold(channel, row, line_bar(&programme, t)));
            let mut add = |condition: &str, answers| all.push(([condition.to_owned(), pad.to_owned()], answers));
            add(AS_READ, asked(&model, &dead)?);
            add(FORETOLD, asked(&model, &foretold)?);
            if let Some(method) = method {
                add(WITHOUT, asked(&fit(method, &without(train, channel))?, &without(test, channel))?);
            }
        }
        Ok(FaultFound::Answers(all))
    }
}

impl Experiment for SensorFaultStudy {
    type Cell = FaultCell;
    type Found = FaultFound;
    type Report = StudyReport;

    fn key(&self) -> &'static str {
        SENSOR_FAULTS
    }

    fn header(&self) -> serde_json::Value {
        let sound = SoundChannels::shipped().and_then(|sound| sound.to_bytes()).unwrap_or_default();
        let sound = format!("{:016x}", palpate_sim::fingerprint([sound.as_slice()]));
        serde_json::json!({ "judges": self.judges, "learnt": self.learnt, "quick": self.quick, "sound": sound })
    }

    fn command(&self) -> StudyCommand {
        StudyCommand::new(SENSOR_FAULTS).flag("quick", self.quick)
    }

    fn grid(&self) -> Vec<FaultCell> {
        let grippers = (JUDGES..JUDGES + self.judges).map(FaultCell::Gripper);
        let methods = METHODS.into_iter().take(if self.quick { 1 } else { METHODS.len() }).filter_map(method).map(Some);
        grippers.chain(methods.chain([None]).map(FaultCell::Answers)).collect()
    }

    fn measure(&self, cell: &FaultCell, stop: &AtomicBool) -> Result<FaultFound, StudyError> {
        match cell {
            FaultCell::Gripper(seed) => watched_gripper(*seed, &self.objects(), stop),
            FaultCell::Answers(method) => self.answers(*method, stop),
        }
    }

    fn report(&self, found: Vec<(FaultCell, FaultFound)>) -> StudyReport {
        let (mut sound, mut faults, mut pads) = (Vec::new(), Vec::new(), Vec::new());
        for (cell, found) in found {
            match found {
                FaultFound::Gripper { sound: own_sound, faults: own } => {
                    sound.extend(own_sound);
                    faults.extend(own);
                }
                FaultFound::Answers(answers) => pads.extend(pad_rows(&cell, answers)),
            }
        }
        let (sound, faults) = (summed(sound), summed(faults));
        let all = sound.iter().fold([0; 2], |all, (_, own)| [all[0] + own[0], all[1] + own[1]]);
        let lost = pads.iter().filter_map(|row| Some((format!("{}, {}", row.model, row.pad), row.gain?)));
        let findings = vec![
            Claim("Sensors", "At most 1 % of sound grasps raise an alarm", "Agrees where the 95 % interval is below 1 %")
                .on_each(PERCENT, Rule::AllBelow(MOST_ALARMS), [("all".to_owned(), Interval::of_share(all[1], all[0]))]),
            Claim(
                "Sensors",
                "A dead pad, foretold by the others, costs at most a point of F1 against a model that learned without it",
                "Agrees where no paired 95 % interval lies below -1 point",
            )
            .on_each(POINTS, Rule::NoneBelow(-MOST_LOSS), lost),
        ];
        let lines = vec![format!(
            "{} emulated grippers of drawn parts and builds, adapted to by one close of the empty hand, preset {STUDY_PRESET}",
            self.judges
        )];
        StudyReport::new(lines, vec![fault_table(&faults), sound_table(&sound), pad_table(&pads)], findings)
    }

    fn shown(report: &StudyReport) -> StudyReport {
        report.clone()
    }

    fn figures(_: &StudyReport) -> Vec<LinkedFigure> {
        Vec::new()
    }
}

/// Share of a count, with its interval.
fn share(count: usize, of: usize) -> Cell {
    (of > 0).then(|| Interval::of_share(count, of)).into()
}

fn fault_table(rows: &[([String; 3], [usize; 3])]) -> StudyTable {
    type Row = ([String; 3], [usize; 3]);
    TableRows::new(SENSOR_FAULTS, "Faults that are found within the grasp", rows).columns(&[
        Column("fault", "", &|(words, _): &Row| words[0].as_str().into()),
        Column("sensor", "", &|(words, _)| words[1].as_str().into()),
        Column("begins", "", &|(words, _)| words[2].as_str().into()),
        Column("found", PERCENT, &|(_, own)| share(own[1], own[0])),
        Column("another named", PERCENT, &|(_, own)| share(own[2], own[0])),
        Column("grasps", "", &|(_, own)| own[0].into()),
    ])
}

fn sound_table(rows: &[(String, [usize; 2])]) -> StudyTable {
    type Row = (String, [usize; 2]);
    TableRows::new("sensor-faults-sound", "Sound grasps in which a sensor is suspected", rows).columns(&[
        Column("grasps of", "", &|(kind, _): &Row| kind.as_str().into()),
        Column("suspected", PERCENT, &|(_, own)| share(own[1], own[0])),
        Column("grasps", "", &|(_, own)| own[0].into()),
    ])
}

/// A recogniser on one condition of the pads.
struct PadRow {
    model: &'static str,
    condition: String,
    pad: String,
    pool: Pool,
    /// Difference to the model that learned without the pad.
    gain: Option<Interval>,
}

fn pad_rows(cell: &FaultCell, answers: Vec<([String; 2], TestAnswers)>) -> Vec<PadRow> {
    let FaultCell::Answers(method) = cell else { return Vec::new() };
    let pool = |([condition, pad], own): ([String; 2], TestAnswers)| {
        (condition, pad, Pool::of_parts(std::slice::from_ref(&own)))
    };
    let pools: Vec<(String, String, Pool)> = answers.into_iter().map(pool).collect();
    let gain = |(condition, pad, pool): &(String, String, Pool)| {
        let learned = pools.iter().find(|(other, of, _)| other == WITHOUT && of == pad)?;
        Some(pool.against(&learned.2).filter(|_| condition == FORETOLD)?.f1)
    };
    let gains: Vec<Option<Interval>> = pools.iter().map(gain).collect();
    let model = method.map_or(SHIPPED, |method| method.key);
    let row = |((condition, pad, pool), gain)| PadRow { model, condition, pad, pool, gain };
    pools.into_iter().zip(gains).map(row).collect()
}

fn pad_table(rows: &[PadRow]) -> StudyTable {
    TableRows::new("sensor-faults-pads", "Recognition with a dead pad, after one grasp", rows).columns(&[
        Column("model", "", &|row: &PadRow| row.model.into()),
        Column("pads", "", &|row| row.condition.as_str().into()),
        Column("dead", "", &|row| row.pad.as_str().into()),
        Column("F1", PERCENT, &|row| row.pool.f1().into()),
        Column("F1 against learned without it", POINTS, &|row| row.gain.into()),
        Column("tested", "grasps", &|row| row.pool.len().into()),
    ])
}

/// Fits what sound channels foretell to sound grasps of so many emulated grippers.
pub fn sound_channels(grippers: u64) -> Result<SoundChannels, StudyError> {
    let names = names();
    let of = |seed: u64| -> Result<Vec<Sequence>, StudyError> {
        let unknown = UNKNOWN_LEARNT + 10 * seed;
        let mut found = Vec::new();
        sound_grasps(seed, unknown..unknown + 8, |_, hand, log| {
            let bars = log.readings.iter().filter_map(|reading| Some((reading.t_s, reading.line_bar?)));
            let closing_s =
                log.course.phases.iter().find(|own| own.phase == Phase::Close).map_or(0.0, |own| own.from_s);
            let bars: Vec<(f64, f64)> = bars.map(|(t_s, bar)| (t_s - closing_s, bar)).collect();
            found.push(hand.sequence(&log, &names).map(|grasp| with_bars(&grasp, &bars)));
        })?;
        found.into_iter().collect()
    };
    let grasps = (SOUND..SOUND + grippers).into_par_iter().map(of).collect::<Result<Vec<_>, _>>()?.concat();
    let about = format!(
        "{} sound grasps by {grippers} emulated grippers: free objects, fixed ones beside the middle, unknown ones, the empty hand",
        grasps.len()
    );
    let scales: Vec<f32> = names.iter().map(|name| SCALES[usize::from(name.starts_with("pressure"))]).collect();
    Ok(SoundChannels::fit(&names, &scales, &grasps, about))
}

/// A grasp with the line pressure as a further channel.
fn with_bars(grasp: &Sequence, bars: &[(f64, f64)]) -> Sequence {
    let bar = |t: f32| {
        let next = bars.partition_point(|(t_s, _)| *t_s <= f64::from(t) + 1e-6);
        next.checked_sub(1).map_or(0.0, |last| bars[last].1 as f32)
    };
    let values = grasp.rows().flat_map(|(t, row)| row.iter().copied().chain([bar(t)]).collect::<Vec<_>>());
    Sequence { t_s: grasp.t_s.clone(), values: values.collect() }
}
