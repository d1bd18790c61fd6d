//! Export of all labelled trials of the real gripper into a folder for other programs:
//!
//! ```text
//! README.md                card, as hubs for data sets expect it
//! trials.csv               one row per trial: label, note, tags, flags, prediction, calibrations, cadence
//! signals.csv              trial, label, size, shape, t_s, and curvature, pressure and force of each finger, closing
//!                          and hold: input of `trials import`
//! raw/trial_7_lemon.csv    raw counts, one row per reading
//! raw/trial_7_lemon.bytes  received bytes, a capture file that can be replayed like a port
//! ```
//!
//! The folder appears whole or not at all: it is written under another name and renamed. Unlabelled, deleted and incomplete
//! trials are left out.

use super::board::write_board_csv;
use super::writing::number;
use crate::card::labelled_card;
use crate::format::{ExchangeError, new_folder};
use palpate_sim::objects::catalogue;
use palpate_store::labels::LabelledTrial;
use palpate_store::{FileKind, Store, StoreError, write_whole};
use palpate_tactile::trial::TrialId;
use palpate_tactile::{Channel, Signals, unit_of_channel};
use serde::Serialize;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// Result of an export.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Exported {
    pub folder: PathBuf,
    /// Trials written.
    pub trials: usize,
    /// Trials whose channels are in `signals.csv`.
    pub derived: usize,
    /// Trials left out of `signals.csv`, and damaged ones, with the reason.
    pub left_out: Vec<(TrialId, String)>,
}

type Out = csv::Writer<BufWriter<File>>;

/// Name of an object as part of a file name.
pub fn file_name_of(object: &str) -> String {
    object.chars().map(|c| if c.is_alphanumeric() || c == '-' { c } else { '_' }).collect()
}

/// Writes a trial of the real gripper: counts as CSV, and its bytes beside it. False for a trial of another kind.
pub(super) fn export_board_trial(store: &Store, id: TrialId, path: &Path) -> Result<bool, ExchangeError> {
    let Some(trial) = store.board_log(id)? else { return Ok(false) };
    write_board_csv(path, &trial)?;
    let bytes = path.with_extension("bytes");
    let received = store.board_bytes(id)?.unwrap_or_default();
    write_whole(&bytes, FileKind::Capture, &received).map_err(|e| ExchangeError::cannot_write(&bytes, &e))?;
    Ok(true)
}

/// Writes all labelled trials into a folder that is empty or does not exist.
pub fn export_labelled(store: &Store, folder: &Path) -> Result<Exported, ExchangeError> {
    let trials = store.labels().trials()?;
    let rows: Vec<&LabelledTrial> = trials.iter().filter(|trial| trial.counts()).collect();
    if rows.is_empty() {
        let cause = "no trial of the real gripper is labelled; label one with `palpate trials label ID NAME`";
        return Err(ExchangeError::Refused(cause.to_owned()));
    }
    let new = new_folder(folder)?;
    let mut left_out = write_all(store, &rows, new.unfinished())?;
    new.finish().map_err(|e| ExchangeError::cannot_write(folder, &e))?;
    let derived = rows.len() - left_out.len();
    let damaged = trials.iter().filter(|trial| trial.damaged && !trial.discarded);
    left_out.extend(damaged.map(|trial| (trial.id, StoreError::altered(trial.id).to_string())));
    Ok(Exported { folder: folder.to_owned(), trials: rows.len(), derived, left_out })
}

fn write_all(store: &Store, rows: &[&LabelledTrial], folder: &Path) -> Result<Vec<(TrialId, String)>, ExchangeError> {
    let raw = folder.join("raw");
    std::fs::create_dir_all(&raw).map_err(|e| ExchangeError::cannot_write(&raw, &e))?;
    let channels = store.calibrations().sensors()?.channels();
    let (list, signals) = (folder.join("trials.csv"), folder.join("signals.csv"));
    let mut list_out = create(&list)?;
    let mut signals_out = create(&signals)?;
    list_out.write_record(LIST_COLUMNS).map_err(|e| ExchangeError::cannot_write(&list, &e))?;
    let with_unit = |channel: &Channel| format!("{} [{}]", unit_of_channel(&channel.name()).0, channel.quantity.unit());
    let with_units = channels.iter().map(with_unit);
    let header = ["trial", "label", "size", "shape", "t_s"].into_iter().map(str::to_owned).chain(with_units);
    signals_out.write_record(header).map_err(|e| ExchangeError::cannot_write(&signals, &e))?;
    let mut left_out = Vec::new();
    for row in rows {
        let label = row.object.as_deref().unwrap_or_default();
        let name = format!("trial_{}_{}.csv", row.id, file_name_of(label));
        match export_board_trial(store, row.id, &raw.join(&name)) {
            Err(ExchangeError::Store(error)) if error.is_damage() => {
                left_out.push((row.id, error.to_string()));
                continue;
            }
            written => written?,
        };
        let read = store.board_signals(row.id, &[])?.unwrap_or_default();
        list_out
            .write_record(list_row(row, &read.serving.ids, &name))
            .map_err(|e| ExchangeError::cannot_write(&list, &e))?;
        let wanted: Vec<String> = channels.iter().map(Channel::name).collect();
        match read.grasp(&wanted) {
            Some(chosen) => write_signals(&mut signals_out, row, label, &chosen)
                .map_err(|e| ExchangeError::cannot_write(&signals, &e))?,
            None => left_out.push((row.id, read.derived.warnings.join("; "))),
        }
    }
    list_out.flush().map_err(|e| ExchangeError::cannot_write(&list, &e))?;
    signals_out.flush().map_err(|e| ExchangeError::cannot_write(&signals, &e))?;
    let (card, names) = (folder.join("README.md"), channels.iter().map(with_unit).collect::<Vec<_>>());
    let text = labelled_card(rows, &names, left_out.len());
    std::fs::write(&card, text).map_err(|e| ExchangeError::cannot_write(&card, &e))?;
    Ok(left_out)
}

const LIST_COLUMNS: [&str; 17] = [
    "id",
    "uid",
    "recorded_utc",
    "label",
    "unsure",
    "reviewed",
    "note",
    "tags",
    "flags",
    "flag_remarks",
    "guess",
    "guess_probability",
    "calibrations",
    "cadence",
    "samples",
    "seconds",
    "file",
];

fn list_row(row: &LabelledTrial, calibrations: &[i64], file: &str) -> [String; 17] {
    let guess = row.guess.as_ref();
    let flags: Vec<&str> = row.flags.iter().map(|found| found.flag.label()).collect();
    let remarks: Vec<&str> = row.flags.iter().map(|found| found.remark.as_str()).collect();
    let calibrations: Vec<String> = calibrations.iter().map(ToString::to_string).collect();
    [
        row.id.to_string(),
        row.uid.clone(),
        row.created.clone(),
        row.object.clone().unwrap_or_default(),
        row.unsure.to_string(),
        row.reviewed.to_string(),
        row.note.clone(),
        row.tags.join("; "),
        flags.join("; "),
        remarks.join("; "),
        guess.map(|guess| guess.class.clone()).unwrap_or_default(),
        guess.map(|guess| number(guess.p)).unwrap_or_default(),
        calibrations.join("; "),
        row.cadence.clone(),
        row.samples.to_string(),
        number(row.seconds),
        format!("raw/{file}"),
    ]
}

fn write_signals(out: &mut Out, row: &LabelledTrial, label: &str, signals: &Signals) -> csv::Result<()> {
    let class = catalogue().iter().find(|built_in| built_in.name == label).map(|built_in| built_in.class());
    let (size, shape) = class.map_or(("", ""), |class| (class.size.name(), class.shape.name()));
    for (sample, t) in signals.t_s.iter().enumerate() {
        // The identity, because numbers differ between stores.
        let before = [row.uid.clone(), label.to_owned(), size.to_owned(), shape.to_owned(), number(*t)];
        out.write_record(before.into_iter().chain(signals.row(sample).iter().map(ToString::to_string)))?;
    }
    Ok(())
}

fn create(path: &Path) -> Result<Out, ExchangeError> {
    Ok(csv::Writer::from_writer(BufWriter::new(File::create(path).map_err(|e| ExchangeError::cannot_write(path, &e))?)))
}
