//! Data sets from the store, training on labelled trials, and the folder of trained models.

mod card;
mod labelled_training;
mod origin;
mod query;
mod reading;
mod sampling;
mod saved_models;

pub use labelled_training::{
    HELD_BACK, JudgedModel, LEAST_TRIALS, LabelledClass, LabelledTraining, TrainingError, TrainingStage,
    labelled_classes,
};
pub use origin::{knows_fingers, scene_hash};
pub use query::{
    DatasetError, DatasetQuery, NoPhysicsVersion, PhysicsVersion, SensorView, TrialSignals, labels_of_catalogue,
    noise_seed, sequence_of, trial_signals,
};
pub use reading::NOT_SOUND;
pub use sampling::{Cut, NoCut};
pub use saved_models::{
    SavedModel, check_model_path, make_models_folder, models_folder, new_model_path, save_model, saved_models,
};
