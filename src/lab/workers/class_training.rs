//! Training of one more class, in the background: a model learns a new object from its file or from recorded grasps,
//! and is saved.

use super::job::{Job, JobError, Newer};
use super::messages::Wake;
use super::training::TrainedModel;
use crate::grasping::{LESSON_GRASPS, LessonStage, Lessons};
use palpate_learn::Model;
use palpate_sim::objects::capital_title;
use palpate_sim::scene::ObjectSetup;
use palpate_store::Store;
use std::path::PathBuf;
use std::sync::Arc;

/// Seed of poses and fit: the same object gives the same model.
const SEED: u64 = 1;
/// Share of the time that simulating takes.
const SIMULATING: f64 = 0.4;

/// Object that a model is to learn.
#[derive(Clone, Debug)]
pub struct TeachRequest {
    /// The model.
    pub model: Arc<Model>,
    /// Name of the object, for people.
    pub name: String,
    /// The object, if its grasps are simulated.
    pub object: Option<ObjectSetup>,
    pub change: ClassChange,
}

/// Change of a class of a model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ClassChange {
    /// It is learned from simulated grasps.
    Simulated,
    /// From recorded grasps with its name, and simulated ones where the object is known.
    Recorded,
    /// It gets another name.
    Renamed(String),
    Forgotten,
}

/// The job: recorded grasps come from the store at `store`, models go into the folder `models`.
pub fn class_training_job(store: PathBuf, models: PathBuf, wake: Wake) -> Job<TeachRequest, TrainedModel> {
    Job::new("teach", Newer::Waits, wake, move |request: &TeachRequest, run| {
        let name = capital_title(&request.name);
        let progress = |stage: LessonStage| {
            let (share, words) = match stage {
                LessonStage::Simulating(done, of) => (SIMULATING * done as f64 / of.max(1) as f64, "grasping"),
                LessonStage::Fitting(share) => (SIMULATING + (1.0 - SIMULATING) * share, "fitting"),
            };
            run.progress(share, format!("Learning {name}: {words}"));
        };
        let store = Store::open(&store)?;
        let file = format!("taught-{}", plain_name(&request.name));
        let save = |model| -> Result<_, JobError> { Ok(Some(TrainedModel::save(model, &models, &file, &store)?)) };
        match &request.change {
            ClassChange::Renamed(new) => return save(request.model.renamed(&request.name, new)),
            ClassChange::Forgotten => return save(request.model.without(&request.name)?),
            ClassChange::Simulated | ClassChange::Recorded => {}
        }
        let objects: Vec<ObjectSetup> = request.object.iter().cloned().collect();
        let recorded: Vec<String> =
            (request.change == ClassChange::Recorded).then(|| request.name.clone()).into_iter().collect();
        let lessons = Lessons {
            objects: &objects,
            classes: &[],
            recorded: &recorded,
            grasps: LESSON_GRASPS,
            seed: SEED,
            progress: &progress,
            stop: run.stop(),
        };
        // A file that has changed, or whose unit has, is learned anew.
        let from = |object: &ObjectSetup| {
            request.model.card.taught_from.get(&request.name).map(|(_, file)| *file == object.source)
        };
        let again = request.object.as_ref().and_then(from).unwrap_or(false);
        let without = again.then(|| request.model.without(&request.name)).transpose()?;
        let taught = lessons.teach(without.as_ref().unwrap_or(&request.model), Some(&store))?;
        Ok(run.unless_stopped(TrainedModel::save(taught.model, &models, &file, &store)?))
    })
}

/// A name as a part of a file's name.
fn plain_name(name: &str) -> String {
    const LONGEST: usize = 40;
    name.chars().take(LONGEST).map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).collect()
}
