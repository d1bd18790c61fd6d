//! Scores of the manual: all methods on grasps of one kind, some of them on grasps of other kinds, and the controls.

use super::comparison::{Comparison, ComparisonError, ComparisonRow, in_table_order};
use super::effects::Measuring;
use super::result_file::{ResultFile, ResultFileError};
use super::stored_study::{GeneratedSection, StoredStudy, markdown_table};
use crate::datasets::{DatasetError, DatasetQuery, SensorView};
use crate::grasping::{CollectionError, CollectionPlan, collect};
use palpate_learn::metrics::Interval;
use palpate_learn::{Dataset, Method, SplitError, SplitPlan, StopRule, method};
use palpate_sim::scene::{PosePreset, Scene};
use palpate_store::Store;
use palpate_tactile::SignalDefinition;
use palpate_tactile::model::SensorModel;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::path::Path;

/// The stored result.
const STORED: &str = include_str!("../../../assets/studies/recognition.json");
/// Command that repeats it.
const COMMAND: &str = "cargo run --release -p palpate-workshop -- scores --store FILE";
/// Grasps of each object to learn from, and to judge by.
const TRAIN: usize = 50;
const TEST: usize = 100;
/// Seed of the poses: not one that settings were chosen with.
const POSES: u64 = 7;
/// Seed of initial weights, order and sampling.
const SEED: u64 = 1;
/// Method that stands for the others.
const EXAMPLE: &str = "macro-layer";
/// Methods whose feedback of earlier grasps is compared with the product of experts.
const ITERATED: [&str; 2] = ["ids-lstm", "ids-lstm-cross"];

/// A kind of grasps.
#[derive(Clone, Copy, Debug)]
struct Kind {
    about: &'static str,
    preset: &'static str,
    fixed: bool,
    layout: &'static str,
    sensors: SensorModel,
    signals: SignalDefinition,
    /// Keys of the methods; all where there are none.
    methods: &'static [&'static str],
}

/// The kind that all methods are judged on.
const MAIN: Kind = Kind {
    about: "preset B, objects free, virtual sensors, C1+F",
    preset: "B",
    fixed: false,
    layout: "C1+F",
    sensors: SensorModel::Virtual,
    signals: SignalDefinition::Contact,
    methods: &[],
};
/// Grasps in other poses, through sensors like those of the real gripper.
const PHYSICAL: Kind = Kind {
    about: "preset A, physical-like sensors, objects free",
    preset: "A",
    layout: "C1",
    sensors: SensorModel::PhysicalLike,
    signals: SignalDefinition::Parts,
    methods: &[EXAMPLE],
    ..MAIN
};
const KINDS: [Kind; 5] = [
    MAIN,
    Kind { about: "plain C1", layout: "C1", methods: &[EXAMPLE], ..MAIN },
    Kind { about: "objects fixed", fixed: true, methods: &[EXAMPLE, "committee"], ..MAIN },
    PHYSICAL,
    Kind { about: "preset A, physical-like sensors, objects fixed", fixed: true, ..PHYSICAL },
];

impl Kind {
    fn methods(&self) -> Vec<&'static Method> {
        if self.methods.is_empty() {
            in_table_order()
        } else {
            self.methods.iter().filter_map(|key| method(key)).collect()
        }
    }
}

/// Scores of a method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecognitionScores {
    /// Kind of grasps.
    pub grasps: String,
    /// Key of the method.
    pub method: String,
    /// Macro F1 after one grasp, and its 95 % interval over trials.
    pub f1: f64,
    /// Its 95 % interval.
    pub ci95: [f64; 2],
    /// Macro F1 after one grasp, two, and so on.
    pub by_grasps: Vec<f64>,
    /// The same by the product of experts.
    pub by_grasps_independent: Vec<f64>,
    /// Macro F1 of size and shape; absent without stage one.
    pub size_and_shape: Option<[f64; 2]>,
    /// Expected calibration error.
    pub ece: f64,
    /// Grasps that were judged.
    pub tested: usize,
}

impl RecognitionScores {
    fn new(grasps: &str, row: ComparisonRow) -> Self {
        let ComparisonRow { model, evaluation, f1_by_grasps_independent, .. } = row;
        Self {
            grasps: grasps.to_owned(),
            method: model,
            f1: evaluation.f1_macro,
            ci95: evaluation.ci95,
            by_grasps: evaluation.f1_by_grasps,
            by_grasps_independent: f1_by_grasps_independent,
            size_and_shape: evaluation.stage_one.map(|scores| [scores.size_f1, scores.shape_f1]),
            ece: evaluation.ece,
            tested: evaluation.trials,
        }
    }

    /// Macro F1 after some grasps, in percent.
    fn after(&self, grasps: usize) -> String {
        self.by_grasps.get(grasps - 1).map_or_else(|| "-".to_owned(), |f1| percent(*f1))
    }
}

/// Macro accuracy of the controls.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ControlScores {
    /// Trained on shuffled labels.
    pub shuffled_labels: Interval,
    /// Given the true size and shape.
    pub true_size_and_shape: Interval,
}

/// A unit of work, finished.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum ScoreUnit {
    Scores(RecognitionScores),
    Controls(ControlScores),
}

/// All scores.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScoreReport {
    /// One row for each method and kind of grasps.
    pub rows: Vec<RecognitionScores>,
    /// Controls of the first kind.
    pub controls: ControlScores,
}

/// Error of measuring scores.
#[derive(Debug, thiserror::Error)]
pub enum ScoreError {
    /// Grasps could not be collected.
    #[error(transparent)]
    Collect(#[from] CollectionError),
    /// Grasps could not be read.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// Too few different grasps.
    #[error(transparent)]
    Split(#[from] SplitError),
    /// A method could not be fitted.
    #[error(transparent)]
    Comparison(#[from] ComparisonError),
    /// The file of results.
    #[error(transparent)]
    Results(#[from] ResultFileError),
    /// A preset or method that the plan names is gone.
    #[error("there is no {0} any more")]
    Gone(&'static str),
}

/// Collects the grasps into a store, fits and judges the methods, and returns what is to be stored; `None` where it was
/// cancelled. A file of results keeps finished methods; a second run computes only the others.
pub fn measure_scores(
    store: &mut Store,
    results: &Path,
    how: &Measuring<'_>,
) -> Result<Option<StoredStudy<ScoreReport>>, ScoreError> {
    // Fits have threads of their own, which the times of the units leave out.
    let start = cpu_time::ProcessTime::now();
    let mut results = ResultFile::<ScoreUnit>::open(results, "recognition scores", &(TRAIN, TEST, POSES, SEED))?;
    let example = method(EXAMPLE).ok_or(ScoreError::Gone(EXAMPLE))?;
    let (mut rows, mut controls) = (Vec::new(), None);
    for (number, kind) in KINDS.iter().enumerate() {
        let mut units: Vec<(String, Option<&'static Method>)> =
            kind.methods().into_iter().map(|m| (format!("{}, {}", kind.about, m.key), Some(m))).collect();
        if number == 0 {
            units.push(("controls".to_owned(), None));
        }
        let data = data_set(kind, store, how.threads)?;
        let splits = SplitPlan::FirstOfEach { train: TRAIN, test: None }.splits(&data, SEED, 1)?;
        let split = splits.first().ok_or(SplitError::Nothing)?;
        let (train, test) = (data.part(&split.train), data.part(&split.test));
        let stop = StopRule::default();
        let comparison = Comparison {
            train: &train,
            second: None,
            test: &test,
            seed: SEED,
            quick: false,
            stop,
            interrupted: how.cancelled,
        };
        let finished = results.complete(&units, how, |unit| match unit {
            Some(method) => {
                let row = comparison.row_of(method)?;
                Ok::<_, ScoreError>(Some(ScoreUnit::Scores(RecognitionScores::new(kind.about, row))))
            }
            None => {
                let measured = comparison.controls(example)?;
                let (shuffled_labels, true_size_and_shape) = (measured.shuffled_labels, measured.true_size_and_shape);
                Ok(Some(ScoreUnit::Controls(ControlScores { shuffled_labels, true_size_and_shape })))
            }
        })?;
        if !finished {
            return Ok(None);
        }
        for unit in units.iter().filter_map(|(name, _)| results.get(name)) {
            match unit {
                ScoreUnit::Scores(row) => rows.push(row.clone()),
                ScoreUnit::Controls(measured) => controls = Some(*measured),
            }
        }
    }
    let report = controls.map(|controls| ScoreReport { rows, controls });
    Ok(report.map(|report| StoredStudy::new(COMMAND, start.elapsed().as_secs_f64() / 3600.0, report)))
}

/// Grasps of a kind, collected where the store does not hold them.
fn data_set(kind: &Kind, store: &mut Store, threads: usize) -> Result<Dataset, ScoreError> {
    let preset = PosePreset::named(kind.preset).ok_or(ScoreError::Gone(kind.preset))?;
    let mut scene = Scene { pose: preset.poses(), ..Scene::default() };
    scene.object.fixed = kind.fixed;
    let plan = CollectionPlan::of_all_objects(scene, (TRAIN + TEST) as u32, POSES);
    let collection = collect(&plan, store, threads, &mut |_| ControlFlow::Continue(()))?.collection;
    let query = DatasetQuery { collection: Some(collection), without_empty: true, ..DatasetQuery::default() };
    let layout = kind.layout.to_owned();
    let view = SensorView { layout, sensors: kind.sensors, signals: kind.signals, ..SensorView::default() };
    Ok(query.read(store, &view, &mut |_, _| ())?)
}

fn percent(share: f64) -> String {
    format!("{:.1}", 100.0 * share)
}

/// Sections of the manual and the README that are written from the stored result.
pub(super) fn sections() -> Result<Vec<GeneratedSection>, serde_json::Error> {
    let stored = StoredStudy::<ScoreReport>::parse(STORED)?;
    let ScoreReport { rows, controls } = &stored.result;
    let (first, others): (Vec<_>, Vec<_>) = rows.iter().partition(|row| row.grasps == MAIN.about);
    let methods = first.iter().map(|row| {
        let [size, shape] = row.size_and_shape.map_or_else(|| ["-", "-"].map(str::to_owned), |f1| f1.map(percent));
        let interval = format!("{} ({} to {})", percent(row.f1), percent(row.ci95[0]), percent(row.ci95[1]));
        let ece = format!("{:.3}", row.ece);
        vec![format!("`{}`", row.method), interval, row.after(3), row.after(5), size, shape, ece]
    });
    let kinds =
        others.iter().map(|row| vec![row.grasps.clone(), format!("`{}`", row.method), row.after(1), row.after(3)]);
    let fed_back = first.iter().filter(|row| ITERATED.contains(&row.method.as_str()));
    let gap = fed_back.flat_map(|row| row.by_grasps.iter().zip(&row.by_grasps_independent)).map(|(a, b)| (a - b).abs());
    let shuffled = &controls.shuffled_labels;
    let text = format!(
        "{}\n\n{}\n\nControls of `{EXAMPLE}` (`palpate evaluate --controls`): with shuffled labels {} ({} to {}), with the \
         true size and shape given {}. PMF feedback stays within {} points of the product of experts, which treats grasps \
         as independent, at every number of grasps.\n\n{}",
        markdown_table(
            &["method", "one grasp", "after three", "after five", "size", "shape", "ECE"],
            &methods.collect::<Vec<_>>()
        ),
        markdown_table(&["other grasps", "method", "one grasp", "after three"], &kinds.collect::<Vec<_>>()),
        percent(shuffled.estimate),
        percent(shuffled.low),
        percent(shuffled.high),
        percent(controls.true_size_and_shape.estimate),
        percent(gap.fold(0.0, f64::max)),
        stored.origin()
    );
    let best = first.iter().max_by(|a, b| a.f1.total_cmp(&b.f1));
    let in_short = best.map_or_else(String::new, |best| {
        format!(
            "Of {} methods, each trained on {TRAIN} grasps per object ({}), `{}` is best after one grasp: F1 {} % ({} to {}), \
             {} % after three.",
            first.len(),
            best.grasps,
            best.method,
            percent(best.f1),
            percent(best.ci95[0]),
            percent(best.ci95[1]),
            best.after(3)
        )
    });
    Ok(vec![
        GeneratedSection { document: "assets/help/recognition.md", name: "scores", text },
        GeneratedSection { document: "README.md", name: "recognition in short", text: in_short },
    ])
}
