//! Data sets out of the store: which trials, seen through which sensors; and where trained models are kept.

mod saved;
mod source;

pub use saved::{SavedModel, models_folder, new_model_path, saved_models};
pub use source::{DatasetError, Source, View, labels_of_catalogue, sequence_of};
