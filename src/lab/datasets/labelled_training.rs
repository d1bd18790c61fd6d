//! Training on labelled trials: a recogniser is fitted to some trials of the real gripper and evaluated on the held-out
//! ones.

use super::{DatasetError, DatasetQuery, SensorView};
use palpate_learn::comparison::{Comparison, ComparisonError};
use palpate_learn::evaluation::Evaluation;
use palpate_learn::{
    Dataset, Fitting, LeakCheck, LearnError, Method, Model, ModelError, SplitError, SplitPlan, StopRule,
};
use palpate_store::labels::Classes;
use palpate_store::{Store, StoreError};
use palpate_tactile::trial::TrialSource;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};

/// Held-out share of each object's trials.
pub const HELD_BACK: f64 = 0.2;

/// Fewest trials with which an object becomes a class: four for training, of which dual-stage networks use half for
/// each stage, and one held out.
pub const LEAST_TRIALS: usize = 5;

/// Number of labelled trials of an object.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LabelledClass {
    /// Its label.
    pub name: String,
    /// Number of trials.
    pub trials: usize,
}

impl LabelledClass {
    /// True if there are enough trials for training.
    pub fn is_enough(&self) -> bool {
        self.trials >= LEAST_TRIALS
    }
}

/// Numbers of labelled trials of the real gripper, by object name.
pub fn labelled_classes(store: &Store) -> Result<Vec<LabelledClass>, StoreError> {
    let (mut counts, mut classes) = (BTreeMap::<String, usize>::new(), Classes::default());
    let labelled = |row: &palpate_store::TrialRow| {
        row.source == TrialSource::Recorded
            && row.state == "complete"
            && !row.object.is_empty()
            && DatasetQuery::default().refused(row).is_none()
    };
    for row in store.list(false)?.into_iter().filter(labelled) {
        *counts.entry(classes.named(&row.object).to_owned()).or_default() += 1;
    }
    Ok(counts.into_iter().map(|(name, trials)| LabelledClass { name, trials }).collect())
}

/// Progress of a training.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TrainingStage {
    /// Number of trials read, and of all.
    Reading(usize, usize),
    /// Completed share of the fit.
    Fitting(f64),
    /// Evaluation on the held-out trials.
    Judging,
}

/// Settings of a training.
pub struct LabelledTraining<'a> {
    /// Method to fit.
    pub method: &'static Method,
    /// Seed of the fit and of the choice of held-out trials.
    pub seed: u64,
    /// A quick fit with worse results.
    pub quick: bool,
    /// Receives the progress.
    pub progress: &'a (dyn Fn(TrainingStage) + Sync),
    /// Flag that cancels the training.
    pub stop: &'a AtomicBool,
}

/// Result of a training.
#[derive(Clone, Debug)]
pub struct JudgedModel {
    /// The model; its card holds the evaluation.
    pub model: Model,
    /// Evaluation on the held-out trials.
    pub evaluation: Evaluation,
    /// Number of training trials and of held-out trials.
    pub trials: [usize; 2],
    /// Objects excluded because they have too few trials.
    pub too_few: Vec<LabelledClass>,
    /// Unusable trials: without calibration, or unsound.
    pub left_out: usize,
    /// Whether the labels can be told by something else than touch.
    pub leak_checks: [LeakCheck; 2],
}

/// Error of a training.
#[derive(Debug, thiserror::Error)]
pub enum TrainingError {
    #[error(
        "training needs two objects with {LEAST_TRIALS} labelled trials each (now {found}): record and label more trials of \
         the real gripper"
    )]
    TooFew {
        /// Number of objects with enough trials.
        found: usize,
    },
    #[error(
        "training needs two objects with {LEAST_TRIALS} usable trials each (now {found}): {usable} of {all} labelled trials \
         are usable. `palpate calibrate list` shows which parts are calibrated"
    )]
    TooFewUsable {
        /// Number of usable trials.
        usable: usize,
        /// Number of all trials.
        all: usize,
        /// Number of objects with enough trials.
        found: usize,
    },
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    #[error(transparent)]
    Split(#[from] SplitError),
    #[error(transparent)]
    Fit(#[from] LearnError),
    #[error(transparent)]
    Judge(#[from] ComparisonError),
    #[error("unknown method \"{0}\"")]
    UnknownMethod(String),
    #[error(transparent)]
    Save(#[from] ModelError),
}

impl LabelledTraining<'_> {
    /// Reads the labelled trials of the real gripper, fits the method and evaluates the model.
    pub fn train(&self, store: &Store) -> Result<JudgedModel, TrainingError> {
        let (enough, mut too_few): (Vec<LabelledClass>, Vec<LabelledClass>) =
            labelled_classes(store)?.into_iter().partition(LabelledClass::is_enough);
        if enough.len() < 2 {
            return Err(TrainingError::TooFew { found: enough.len() });
        }
        let objects = enough.iter().map(|class| class.name.clone()).collect();
        let source = DatasetQuery { source: Some(TrialSource::Recorded), objects, ..DatasetQuery::default() };
        let data = source.read(store, &SensorView::default().of_store(store)?, &mut |done, of| {
            (self.progress)(TrainingStage::Reading(done, of));
        })?;
        let all = enough.iter().map(|class| class.trials).sum();
        let data = without_small_classes(&data, all, &mut too_few)?;
        let splits = SplitPlan::Shares([1.0 - HELD_BACK, 0.0, HELD_BACK]).splits(&data, self.seed, 1)?;
        let split = splits.first().ok_or_else(LearnError::no_data)?;
        let (learned, held_back) = (data.part(&split.train), data.part(&split.test));
        let mut model = self.fitted(&learned)?;
        let evaluation = self.judged(&model, &learned, &held_back)?;
        let trials = [learned.examples.len(), held_back.examples.len()];
        let [tested, all_used] = [trials[1], trials[0] + trials[1]];
        let test = format!("{tested} trials held back of {all_used}: {}", data.about.lines().join("; "));
        model.card.metrics = evaluation.metrics(&test);
        model.card.metrics["confusion"] = serde_json::json!(evaluation.confusion);
        let leak_checks = data.leak_checks(self.seed);
        model.card.metrics["leak_checks"] = serde_json::json!(leak_checks);
        Ok(JudgedModel { model, evaluation, trials, too_few, left_out: all - data.examples.len(), leak_checks })
    }

    fn fitted(&self, data: &Dataset) -> Result<Model, LearnError> {
        let progress = |share| (self.progress)(TrainingStage::Fitting(share));
        let fitting = Fitting { progress: &progress, ..Fitting::new(self.seed, self.quick, self.stop) };
        fitting.check()?;
        self.method.train(data, &fitting)
    }

    fn judged(&self, model: &Model, train: &Dataset, test: &Dataset) -> Result<Evaluation, TrainingError> {
        if self.stop.load(Ordering::Relaxed) {
            return Err(LearnError::Stopped.into());
        }
        (self.progress)(TrainingStage::Judging);
        let (seed, quick, stop) = (self.seed, self.quick, StopRule::default());
        let comparison = Comparison { train, second: None, test, seed, quick, stop, interrupted: self.stop };
        Ok(comparison.of_fitted(self.method.key, model)?.evaluation)
    }
}

/// Drops objects with too few readable trials from the classes.
fn without_small_classes(
    data: &Dataset,
    all: usize,
    too_few: &mut Vec<LabelledClass>,
) -> Result<Dataset, TrainingError> {
    let by_class = data.by_class();
    let small = |class: usize| by_class[class].len() < LEAST_TRIALS;
    let names = data.labels.classes.iter().zip(&by_class);
    let names = names.filter(|(_, members)| members.len() < LEAST_TRIALS);
    too_few.extend(names.map(|(class, own)| LabelledClass { name: class.name.clone(), trials: own.len() }));
    let kept: Vec<usize> = (0..data.examples.len()).filter(|k| !small(data.examples[*k].class)).collect();
    let found = (0..by_class.len()).filter(|class| !small(*class)).count();
    if found < 2 {
        return Err(TrainingError::TooFewUsable { usable: data.examples.len(), all, found });
    }
    let kept = data.part(&kept);
    let mut labels = kept.labels.clone();
    labels.classes.retain(|class| !too_few.iter().any(|small| small.name == class.name));
    // Relabelling cannot fail: all remaining examples belong to remaining classes.
    Ok(kept.relabelled(&labels).unwrap_or(kept))
}
