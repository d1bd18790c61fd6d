//! Data sets from the store, and the folder of trained models.

mod card;
mod origin;
mod query;
mod reading;
mod sampling;
mod saved_models;

pub(crate) use query::noise_seed;
pub use query::{
    DatasetError, DatasetQuery, NoPhysicsVersion, PhysicsVersion, SensorView, TrialSignals, labels_of_catalogue,
    sequence_of, trial_signals,
};
pub use sampling::{Cut, NoCut};
pub use saved_models::{
    SavedModel, check_model_path, make_models_folder, models_folder, new_model_path, save_model, saved_models,
};
