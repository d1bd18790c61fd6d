//! Background teaching for the window: a thread "teach" that teaches a model a new object, from its file or from recorded
//! grasps, and saves the model.

use super::background_job::{BackgroundJob, Outlet};
use super::messages::Wake;
use super::trainer::TrainedModel;
use crate::datasets::{make_models_folder, new_model_path, save_model};
use crate::grasping::{LESSON_GRASPS, LessonError, LessonStage, Lessons};
use palpate_learn::{Model, ModelError};
use palpate_sim::scene::ObjectSetup;
use palpate_store::{Store, StoreError};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Seed of poses and fit: the same object gives the same model.
const SEED: u64 = 1;

/// What is taught.
#[derive(Clone, Debug)]
pub struct TeachRequest {
    /// The model.
    pub model: Arc<Model>,
    /// Name of the object, for people.
    pub name: String,
    /// The object, if its grasps are simulated.
    pub object: Option<ObjectSetup>,
    /// True to learn recorded grasps with this name.
    pub recorded: bool,
}

/// Why a model was not taught.
#[derive(Debug, thiserror::Error)]
pub enum TeachError {
    /// It learned nothing.
    #[error(transparent)]
    Lesson(#[from] LessonError),
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// It could not be saved.
    #[error(transparent)]
    Save(#[from] ModelError),
}

/// State of the teaching thread.
#[derive(Clone, Debug, Default)]
pub struct TeacherView {
    /// What is being taught, and how far.
    pub running: Option<(Arc<TeachRequest>, LessonStage)>,
    /// Number of ended lessons that were not cancelled.
    pub ended: u64,
    /// The last of them.
    pub last: Option<EndedLesson>,
}

/// A lesson that has ended.
#[derive(Clone, Debug)]
pub struct EndedLesson {
    /// What was asked.
    pub request: Arc<TeachRequest>,
    /// The model that learned it, or why none did.
    pub outcome: Result<Arc<TrainedModel>, Arc<TeachError>>,
}

/// Handle of the teaching thread.
pub type Teacher = BackgroundJob<TeachRequest, TeacherView>;

impl Teacher {
    /// Starts the thread; recorded grasps come from the store at `store`, models go into the folder `models`.
    pub fn start(store: PathBuf, models: PathBuf, wake: Wake) -> std::io::Result<Self> {
        let mut view = TeacherView::default();
        Self::spawn("teach", wake, move |request, stop, outlet| {
            let request = Arc::new(request);
            let outcome = taught(&store, &models, &request, &view, stop, outlet);
            if !stop.load(Ordering::Relaxed) {
                view.ended += 1;
                let outcome = outcome.map(Arc::new).map_err(Arc::new);
                view.last = Some(EndedLesson { request, outcome });
            }
            outlet.publish(view.clone());
        })
    }
}

fn taught(
    store: &Path,
    models: &Path,
    request: &Arc<TeachRequest>,
    view: &TeacherView,
    stop: &AtomicBool,
    outlet: &Outlet<TeacherView>,
) -> Result<TrainedModel, TeachError> {
    // Publishing wakes the window: a hundred times in a lesson is enough.
    let shown = std::sync::Mutex::new(0_u32);
    let progress = |stage: LessonStage| {
        let percent = match stage {
            LessonStage::Simulating(done, of) => (100 * done / of.max(1)) as u32,
            LessonStage::Fitting(share) => 1000 + (100.0 * share) as u32,
        };
        let is_new = shown.lock().is_ok_and(|mut shown| std::mem::replace(&mut *shown, percent) != percent);
        if is_new {
            outlet.publish(TeacherView { running: Some((Arc::clone(request), stage)), ..view.clone() });
        }
    };
    let store = Store::open(store)?;
    let objects: Vec<ObjectSetup> = request.object.iter().cloned().collect();
    let recorded: Vec<String> = request.recorded.then(|| request.name.clone()).into_iter().collect();
    let lessons = Lessons {
        objects: &objects,
        classes: &[],
        recorded: &recorded,
        grasps: LESSON_GRASPS,
        seed: SEED,
        progress: &progress,
        stop,
    };
    let model = lessons.teach(&request.model, Some(&store))?;
    let path = new_model_path(models, "taught", &store.now()?);
    make_models_folder(models)?;
    save_model(&model, &path)?;
    let about = model.card.described();
    Ok(TrainedModel { model: Arc::new(model), path, about })
}
