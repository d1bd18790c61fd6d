//! Training on labelled trials of the real gripper, in the background: listing what there is, training a recogniser and
//! saving it to a file, loading such a file.

use super::job::{Job, JobError, JobRun, Newer};
use super::messages::Wake;
use crate::datasets::{
    JudgedModel, LEAST_TRIALS, LabelledClass, LabelledTraining, SavedModel, SensorView, TrainingError, TrainingStage,
    labelled_classes, make_models_folder, new_model_path, save_model, saved_models,
};
use palpate_learn::{Method, Model, ModelError, method};
use palpate_store::{Store, StoreError};
use palpate_tactile::Channel;
use palpate_tactile::board::SensorList;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Settings of a training.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TrainRequest {
    /// Key of the method.
    pub method: String,
    /// Seed of the fit and of the choice of held-out trials.
    pub seed: u64,
    /// A quick fit with worse results.
    pub quick: bool,
}

/// Model and its file.
#[derive(Clone, Debug)]
pub struct TrainedModel {
    /// The model.
    pub model: Arc<Model>,
    /// Its file.
    pub path: PathBuf,
    /// One-line description.
    pub about: String,
}

/// Newly trained model and its evaluation.
#[derive(Clone, Debug)]
pub struct FinishedTraining {
    /// The model.
    pub trained: TrainedModel,
    /// Evaluation on the held-out trials.
    pub judged: JudgedModel,
}

/// Labelled trials to train on, and models trained so far.
#[derive(Clone, Debug)]
pub struct TrainingData {
    /// Labelled trials of each object, or why they cannot be counted.
    pub classes: Result<Vec<LabelledClass>, Arc<StoreError>>,
    /// Saved models, newest first.
    pub models: Vec<SavedModel>,
}

/// The job that lists labelled trials and saved models.
pub fn training_data_job(store: PathBuf, models: PathBuf, wake: Wake) -> Job<(), TrainingData> {
    Job::new("training-data", Newer::Replaces, wake, move |(), _run| {
        let classes = Store::open(&store).and_then(|store| labelled_classes(&store)).map_err(Arc::new);
        Ok(Some(TrainingData { classes, models: saved_models(&models) }))
    })
}

/// The job that trains on trials of the store at `store` and saves the model in the folder `models`.
pub fn training_job(store: PathBuf, models: PathBuf, wake: Wake) -> Job<TrainRequest, FinishedTraining> {
    Job::new("train", Newer::Waits, wake, move |request: &TrainRequest, run| {
        let method = method(&request.method).ok_or_else(|| TrainingError::UnknownMethod(request.method.clone()))?;
        let progress = |stage| report(run, method, stage);
        progress(TrainingStage::Reading(0, 0));
        let store = Store::open(&store)?;
        let (seed, quick) = (request.seed, request.quick);
        let judged = LabelledTraining { method, seed, quick, progress: &progress, stop: run.stop() }.train(&store)?;
        let trained = TrainedModel::save(judged.model.clone(), &models, method.key, &store)?;
        Ok(run.unless_stopped(FinishedTraining { trained, judged }))
    })
}

fn report(run: &JobRun<'_>, method: &Method, stage: TrainingStage) {
    match stage {
        TrainingStage::Reading(done, of) => run.count(done, of, format!("reading trials, {done} of {of}")),
        TrainingStage::Fitting(share) => {
            run.progress(share, format!("training {}, {:.0} %", method.title, 100.0 * share));
        }
        TrainingStage::Judging => run.progress(1.0, "evaluating"),
    }
}

/// The job that loads a model that works with the channels of the real gripper.
pub fn load_model_job(store: PathBuf, wake: Wake) -> Job<PathBuf, TrainedModel> {
    Job::new("load-model", Newer::Waits, wake, move |path: &PathBuf, _run| {
        let model = Model::load(path)?;
        // What is wrong with a store, the trials tell.
        let sensors = Store::open(&store).and_then(|store| store.calibrations().sensors()).unwrap_or_default();
        check_channels(&model, sensors)?;
        Ok(Some(TrainedModel::new(model, path.clone())))
    })
}

impl TrainedModel {
    fn new(model: Model, path: PathBuf) -> Self {
        let about = model.card.described();
        Self { model: Arc::new(model), path, about }
    }

    /// Saves a model under a new name in the folder `models`.
    pub(super) fn save(model: Model, models: &Path, name: &str, store: &Store) -> Result<Self, JobError> {
        let path = new_model_path(models, name, &store.now()?);
        make_models_folder(models)?;
        save_model(&model, &path)?;
        Ok(Self::new(model, path))
    }
}

/// Refuses a model that needs channels the real gripper does not have.
fn check_channels(model: &Model, sensors: SensorList) -> Result<(), ModelError> {
    // Which of the channels of a gripper file a connected gripper lacks is said when a grasp begins.
    let sensors = SensorView::of_model(&model.card).gripper.unwrap_or(sensors);
    let names: Vec<String> = sensors.channels().iter().map(Channel::name).collect();
    if model.card.channels.iter().all(|channel| names.contains(channel)) {
        Ok(())
    } else {
        model.check_channels(&names)
    }
}

impl TrainingData {
    /// Reason why training is not possible yet, as a sentence; `None` if it is.
    pub fn too_little(&self) -> Option<String> {
        let Ok(classes) = &self.classes else { return None };
        let enough = classes.iter().filter(|class| class.is_enough()).count();
        let so_far = match (enough, classes.len()) {
            (_, 0) => String::new(),
            (0, _) => ", and none has as many yet".to_owned(),
            (_, of) => format!(", and one of {of} has as many"),
        };
        (enough < 2).then(|| {
            format!(
                "Training needs two objects with {LEAST_TRIALS} labelled trials each{so_far}. Record and label more; the \
                 paper has 40 to 55 of each."
            )
        })
    }
}
