//! Trials in and out as files of other programs: MCAP, NPZ, Parquet.

use super::super::prelude::*;
use palpate_lab::datasets::SensorView;
use palpate_lab::exchange::{ExchangeFormat, read_mcap};
use palpate_lab::inspection::OpenOptions;
use palpate_learn::{Model, Models};
use palpate_store::{Import, read_trials_csv};
use std::sync::Arc;

/// Writes trials into one file.
pub(super) fn export(
    store: &Store,
    (ids, format): (&[TrialId], &ExchangeFormat),
    (out, model): (&Path, Option<&Path>),
    sensors: SensorView,
) -> Result<(), Failure> {
    check_new(out, format.kind)?;
    let models = match model {
        Some(path) => Models::all(&Arc::new(Model::load(path)?)),
        None => Models::shipped()?,
    };
    let options = OpenOptions { sensors, models, ..OpenOptions::default() };
    let stop = stop_flag()?;
    format.write(store, ids, &options, out, &mut |_, _| !stop.load(Ordering::Relaxed))?;
    say(out.display())
}

/// Reads the trials of a file: MCAP, or else CSV. `label` names the object of a file that does not.
pub(super) fn read(file: &Path, label: Option<&str>) -> Result<Import, Failure> {
    if file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("mcap")) {
        let stem = file.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        return Ok(read_mcap(file, label.or(stem.as_deref()).unwrap_or("import"))?);
    }
    Ok(read_trials_csv(file)?)
}
