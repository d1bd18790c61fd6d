//! Background training for the window: a thread "train" that counts the labelled trials of the real gripper, trains a
//! recogniser on them, saves it to a file, and loads such files.

use super::background_job::{BackgroundJob, Outlet};
use super::messages::Wake;
use crate::datasets::{SavedModel, make_models_folder, new_model_path, save_model, saved_models};
use crate::study::{
    JudgedModel, LEAST_TRIALS, LabelledClass, LabelledTraining, TrainingError, TrainingStage, labelled_classes,
};
use palpate_learn::{Model, ModelError, method};
use palpate_store::{Store, StoreError};
use palpate_tactile::{Channel, SignalDefinition, whole_fingers};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Command to the training thread.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TrainCommand {
    /// List the trials and models.
    Look,
    /// Train a model.
    Train(TrainRequest),
    /// Load a model.
    Load(PathBuf),
}

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

/// State of the training thread.
#[derive(Clone, Debug, Default)]
pub struct TrainerView {
    /// Labelled trials of each object, or why they cannot be counted; `None` before the first count.
    pub classes: Option<Result<Arc<[LabelledClass]>, Arc<StoreError>>>,
    /// Saved models, newest first.
    pub models: Arc<[SavedModel]>,
    /// Training in progress and its stage.
    pub running: Option<(TrainRequest, TrainingStage)>,
    /// Result of the last training that was not cancelled.
    pub finished: Option<Result<Arc<FinishedTraining>, Arc<TrainingError>>>,
    /// Number of load commands, and result of the last.
    pub loaded: (u64, Option<Result<Arc<TrainedModel>, ModelError>>),
}

/// Handle of the training thread.
pub type Trainer = BackgroundJob<TrainCommand, TrainerView>;

impl Trainer {
    /// Starts the thread; trials come from the store at `store`, models go into the folder `models`.
    pub fn start(store: PathBuf, models: PathBuf, wake: Wake) -> std::io::Result<Self> {
        let mut service = TrainingService { store, models, view: TrainerView::default() };
        Self::spawn("train", wake, move |command, stop, outlet| {
            service.handle(command, stop, outlet);
            outlet.publish(service.view.clone());
        })
    }
}

/// State owned by the thread.
struct TrainingService {
    store: PathBuf,
    models: PathBuf,
    view: TrainerView,
}

impl TrainingService {
    fn handle(&mut self, command: TrainCommand, stop: &AtomicBool, outlet: &Outlet<TrainerView>) {
        match command {
            TrainCommand::Look => {
                let counted = Store::open(&self.store).and_then(|store| labelled_classes(&store));
                self.view.classes = Some(counted.map(Arc::from).map_err(Arc::new));
                self.view.models = saved_models(&self.models).into();
            }
            TrainCommand::Train(request) => {
                let finished = self.trained(&request, stop, outlet).map(Arc::new).map_err(Arc::new);
                if !stop.load(Ordering::Relaxed) {
                    self.view.finished = Some(finished);
                }
                self.view.models = saved_models(&self.models).into();
            }
            TrainCommand::Load(path) => {
                let loaded = loaded(&path).map(Arc::new);
                self.view.loaded = (self.view.loaded.0 + 1, Some(loaded));
            }
        }
    }

    fn trained(
        &self,
        request: &TrainRequest,
        stop: &AtomicBool,
        outlet: &Outlet<TrainerView>,
    ) -> Result<FinishedTraining, TrainingError> {
        let progress = |stage| {
            outlet.publish(TrainerView { running: Some((request.clone(), stage)), ..self.view.clone() });
        };
        progress(TrainingStage::Reading(0, 0));
        let method = method(&request.method).ok_or_else(|| TrainingError::UnknownMethod(request.method.clone()))?;
        let store = Store::open(&self.store)?;
        let (seed, quick) = (request.seed, request.quick);
        let training = LabelledTraining { method, seed, quick, progress: &progress, stop };
        let judged = training.train(&store)?;
        let now = store.now()?;
        let path = new_model_path(&self.models, method.key, &now);
        make_models_folder(&self.models)?;
        save_model(&judged.model, &path)?;
        let (model, about) = (Arc::new(judged.model.clone()), judged.model.card.described());
        Ok(FinishedTraining { trained: TrainedModel { model, path, about }, judged })
    }
}

/// Loads a model that works with the channels of the real gripper.
fn loaded(path: &Path) -> Result<TrainedModel, ModelError> {
    let model = Model::load(path)?;
    check_listens(&model)?;
    let about = model.card.described();
    Ok(TrainedModel { model: Arc::new(model), path: path.to_owned(), about })
}

/// Refuses a model that needs channels the real gripper does not have.
fn check_listens(model: &Model) -> Result<(), ModelError> {
    let names: Vec<String> = whole_fingers(SignalDefinition::Parts).iter().map(Channel::name).collect();
    if model.card.channels.iter().all(|channel| names.contains(channel)) {
        Ok(())
    } else {
        model.check_channels(&names)
    }
}

impl TrainerView {
    /// Reason why training is not possible yet, as a sentence; `None` if it is.
    pub fn too_little(&self) -> Option<String> {
        let Some(Ok(classes)) = &self.classes else { return None };
        let enough = classes.iter().filter(|class| class.is_enough()).count();
        let so_far = match classes.len() {
            0 => String::new(),
            of => format!(" (now {enough} of {of})"),
        };
        (enough < 2).then(|| {
            format!(
                "Training needs two objects with {LEAST_TRIALS} labelled trials each{so_far}. Record and label more; the \
                 paper has 40 to 55 of each."
            )
        })
    }
}
