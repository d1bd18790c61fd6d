//! Trials on disk: an SQLite store that survives kills and that several programs can share.
//!
//! # Terms
//!
//! A **store** is one SQLite file of **trials**, raw and append-only. A trial of a real gripper may have **labels**:
//! class, note, tags and **flags**; each change of them is an entry of the **journal**, and can be undone. The last simulated
//! grasps of the window that nobody keeps are in the **demo log**. The **plan** says what to record next. **Calibrations** and **tares** belong to the parts of a board.
//!
//! # Modules, lowest layer first
//!
//! A module imports only from lower layers. All but [`labels`] are private; their items stand at the root of the crate.
//!
//! | layer | module | holds |
//! |---|---|---|
//! | 0 | `checksum`, `frame_blob`, `reading_blob` | checksums of rows; frames and readings as bytes |
//! | 0 | [`labels`] | class names, flags, plan, labelled trials, sparklines: plain values |
//! | 0 | `file_kind` | kinds of files, and what each may replace |
//! | 1 | `new_file` | the one way to write a file or folder that a person names |
//! | 1 | `store_error` | errors, with cause and fix |
//! | 1 | `identity`, `demo_log` | which trials are the same grasp; which are in the demo log |
//! | 2 | `schema`, `free_space`, `open_file`, `log_file` | tables; free space on the disk; whether the open file is still there; damage of its log |
//! | 3 | `store` | open, begin, append, finish and load trials ([`Store`]) |
//! | 4 | `chunks` | chunks of a trial, checked |
//! | 4 | `trial_rows` | the list of trials |
//! | 4 | `calibrations`, `journal`, `merge` | calibrations, undoable changes, merging of stores |
//! | 5 | `board_trials`, `imported_trials` | trials of a board and of imported files |
//! | 5 | `library` | search, filters and order of all trials ([`Library`]) |
//! | 5 | `gripper` | sensors of the gripper that a store remembers |
//! | 5 | `label_repository`, `tares` | labels, notes and plan; zeros of parts |
//! | 5 | `board_signals` | signals of a board trial by the calibrations |
//! | 6 | `labelled_trials` | lists of trials with labels |
//!
//! # Example
//!
//! ```
//! use palpate_store::{Store, check_space};
//!
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("trials.sqlite");
//! let store = Store::open(&path)?;
//! assert!(store.list(false)?.is_empty());
//! check_space(&path, 60.0)?; // reports a full disk before a recording of a minute
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod board_signals;
mod board_trials;
mod calibrations;
mod checksum;
mod chunks;
#[cfg(test)]
mod damage_tests;
mod demo_log;
#[cfg(test)]
mod demo_log_tests;
mod file_kind;
#[cfg(test)]
mod file_tests;
mod frame_blob;
mod free_space;
mod gripper;
mod identity;
mod imported_trials;
mod journal;
#[cfg(test)]
mod journal_tests;
#[cfg(test)]
mod kept_store_tests;
mod label_repository;
mod labelled_trials;
pub mod labels;
mod library;
#[cfg(test)]
mod library_tests;
mod log_file;
mod merge;
mod new_file;
mod open_file;
mod reading_blob;
mod schema;
mod store;
mod store_error;
#[cfg(test)]
mod store_tests;
mod tares;
#[cfg(test)]
mod test_trials;
mod trial_rows;

pub use board_signals::BoardSignals;
pub use board_trials::{BoardChunk, BoardInfo};
pub use calibrations::{CalibrationId, CalibrationRepository, Serving, StoredCalibration};
pub use demo_log::{DEMO_LOG_TRIALS, TrialPlace};
pub use file_kind::{FileKind, check_target};
pub use frame_blob::{BlobError, decode_frames, encode_frames};
pub use free_space::check_space;
pub use identity::Stored;
pub use imported_trials::{ImportedTrial, interruptions};
pub use journal::{Change, JournalEntry, JournalRepository};
pub use label_repository::{LabelRepository, LabelRevision};
pub use library::{
    Counted, Day, Library, LibraryCounts, LibraryTrial, Shown, TrialColumn, TrialOrder, TrialQuality, TrialQuery,
};
pub use merge::Merged;
pub use new_file::{NewFile, NewFolder, write_whole};
pub use store::Store;
pub use store_error::StoreError;
pub use tares::{PartTare, StoredTare};
pub use trial_rows::TrialRow;
