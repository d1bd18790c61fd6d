//! What nearly every command uses.

pub(super) use super::Failure;
pub(super) use super::interrupt::stop_flag;
pub(super) use super::output::{check_folder, check_new, check_replaced, file_of, file_or_folder, write_new};
pub(super) use super::setup::{
    BetweenArguments, SceneArguments, SignalArguments, existing_store, existing_store_to_change, load_object, one_of,
    open_store, read_store, sensor_called, sensors, store_to_change, within,
};
pub(super) use super::terminal::{Page, Progress, Report, date, note, say, say_as_is, say_json, typed_lines, warn};
pub(super) use palpate_sim::scene::Between;
pub(super) use palpate_store::{FileKind, Store};
pub(super) use palpate_tactile::trial::TrialId;
pub(super) use serde::Serialize;
pub(super) use std::path::{Path, PathBuf};
pub(super) use std::sync::atomic::{AtomicBool, Ordering};
