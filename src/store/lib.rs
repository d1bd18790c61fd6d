//! Trials on disk: an SQLite store that survives kills and that several programs can share; CSV import and export.

mod board_export;
mod board_signals;
mod board_trials;
mod calibrations;
mod checksum;
mod csv_export;
mod csv_import;
#[cfg(test)]
mod damage_tests;
mod frame_blob;
mod free_space;
mod imported_trials;
mod journal;
#[cfg(test)]
mod journal_tests;
mod label_repository;
mod labelled_export;
mod labelled_trials;
pub mod labels;
mod merge;
#[cfg(test)]
mod old_store_tests;
mod points_csv;
mod reading_blob;
mod schema;
mod store;
mod store_error;
#[cfg(test)]
mod store_tests;
mod tares;
#[cfg(test)]
mod test_trials;

pub use board_export::write_board_csv;
pub use board_signals::BoardSignals;
pub use board_trials::{BoardChunk, BoardInfo};
pub use calibrations::{CalibrationId, CalibrationRepository, Serving, StoredCalibration};
pub use csv_export::{CsvError, contacts_path, write_contacts_csv, write_signals_csv, write_trial_csv};
pub use csv_import::{Import, ImportError, ImportFault, ImportedTrial, read_trials, read_trials_csv};
pub use frame_blob::{BlobError, decode_frames, encode_frames};
pub use free_space::check_space;
pub use journal::{Change, JournalEntry, JournalRepository};
pub use label_repository::LabelRepository;
pub use labelled_export::{ExportError, Exported, export_board_trial, export_labelled, file_name_of};
pub use merge::Merged;
pub use points_csv::{PointsError, read_points_csv};
pub use store::{Store, TrialRow};
pub use store_error::StoreError;
pub use tares::{PartTare, StoredTare};
