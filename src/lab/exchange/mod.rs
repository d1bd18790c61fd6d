//! Trials in the file formats of other programs.
//!
//! [`FORMATS`] is the one list of formats that trials are written in: command line, window and help read it. To add a format,
//! write a file with its function here and add a line to the list.

mod content;
mod mcap;
mod npz;
#[cfg(feature = "parquet")]
mod parquet;
mod urdf;

pub use mcap::{McapImportError, read_mcap};

use crate::inspection::{OpenOptions, OpenTrialError};
use palpate_store::{FileKind, Store, StoreError};
use palpate_tactile::trial::TrialId;
use std::path::{Path, PathBuf};

/// A file format.
#[derive(Clone, Copy, Debug)]
pub struct ExchangeFormat {
    /// Name.
    pub name: &'static str,
    /// Kind of its files, by whose ending it is chosen.
    pub kind: FileKind,
    /// What it is for, in a few words.
    pub about: &'static str,
    write: fn(&Request<'_>, &Path, Allow<'_>) -> Result<(), ExchangeError>,
}

/// All formats that trials are written in.
pub const FORMATS: &[ExchangeFormat] = &[
    ExchangeFormat {
        name: "MCAP",
        kind: FileKind::Mcap,
        about: "ROS 2 messages over time: Foxglove, PlotJuggler, Rerun, ros2 bag",
        write: mcap::write,
    },
    ExchangeFormat { name: "NPZ", kind: FileKind::Npz, about: "arrays of all trials: numpy.load", write: npz::write },
    #[cfg(feature = "parquet")]
    ExchangeFormat {
        name: "Parquet",
        kind: FileKind::Parquet,
        about: "a row per sample: pandas, polars, DuckDB",
        write: parquet::write,
    },
];

/// Trials to be written.
pub(crate) struct Request<'a> {
    pub(crate) store: &'a Store,
    pub(crate) ids: &'a [TrialId],
    pub(crate) options: &'a OpenOptions,
}

/// Called before each trial with the number of trials done and of all; false ends the export.
pub type Allow<'a> = &'a mut dyn FnMut(usize, usize) -> bool;

/// Reason why trials are not written.
#[derive(Debug, thiserror::Error)]
pub enum ExchangeError {
    /// The store.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A trial cannot be opened.
    #[error(transparent)]
    Open(#[from] OpenTrialError),
    /// The file cannot be written.
    #[error("cannot write \"{path}\": {cause}", path = path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Cause.
        cause: String,
    },
    /// The format has no place for it.
    #[error("{0}")]
    Refused(String),
    /// The user ended it.
    #[error("stopped; nothing was written")]
    Stopped,
}

impl ExchangeError {
    fn write(path: &Path, cause: &dyn std::fmt::Display) -> Self {
        Self::Write { path: path.to_owned(), cause: cause.to_string() }
    }
}

/// Asks whether to go on with the next trial.
fn step(allow: &mut dyn FnMut(usize, usize) -> bool, done: usize, all: usize) -> Result<(), ExchangeError> {
    if allow(done, all) { Ok(()) } else { Err(ExchangeError::Stopped) }
}

impl ExchangeFormat {
    /// The format of a file, by its extension.
    pub fn of(path: &Path) -> Option<&'static Self> {
        FORMATS.iter().find(|format| FileKind::of(path, &[format.kind]).is_some())
    }

    /// Writes trials into one file, which appears whole or not at all. Simulated trials are read through the sensors of the
    /// options; with a model the recogniser's answers are written too, where the format has a place for them.
    pub fn write(
        &self,
        store: &Store,
        ids: &[TrialId],
        options: &OpenOptions,
        path: &Path,
        allow: Allow<'_>,
    ) -> Result<(), ExchangeError> {
        (self.write)(&Request { store, ids, options }, path, allow)
    }
}

/// Writes trials in the format that the extension of the file names.
pub fn write_trials(
    store: &Store,
    ids: &[TrialId],
    options: &OpenOptions,
    path: &Path,
    allow: Allow<'_>,
) -> Result<(), ExchangeError> {
    let format = ExchangeFormat::of(path).ok_or_else(|| {
        let known: Vec<&str> = FORMATS.iter().flat_map(|format| format.kind.endings()).copied().collect();
        let (path, known) = (path.display(), known.join(", "));
        ExchangeError::Refused(format!("no format for \"{path}\": its extension has to be {known}"))
    })?;
    format.write(store, ids, options, path, allow)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grasping::grasp;
    use palpate_sim::scene::Scene;
    use palpate_store::ImportedTrial;
    use palpate_tactile::Signals;

    fn store_of(objects: &[&str]) -> (tempfile::TempDir, Store) {
        let folder = tempfile::tempdir().expect("a folder");
        let mut store = Store::open(&folder.path().join("trials.sqlite")).expect("opens");
        for object in objects {
            let mut scene = Scene::default();
            scene.object.source = (*object).to_owned();
            scene.timing.duration_s = 1.5;
            let model = scene.load_object().expect("built in");
            store.insert(&grasp(&scene, model.as_ref(), 0)).expect("stored");
        }
        (folder, store)
    }

    fn bits(signals: &Signals) -> (Vec<u64>, Vec<u32>) {
        (signals.t_s.iter().map(|t| t.to_bits()).collect(), signals.values.iter().map(|v| v.to_bits()).collect())
    }

    #[test]
    fn channels_come_back_from_mcap_bit_by_bit() -> Result<(), Box<dyn std::error::Error>> {
        let (folder, mut store) = store_of(&["lemon", "ball"]);
        // Numbers with all bits in use, at uneven times.
        let awkward = Signals {
            channels: vec!["grip".to_owned(), "a b, \"c\" [N]".to_owned()],
            t_s: vec![-0.1, 1.0 / 3.0, 0.333_333_333_333_333_4, 2e9 + 1e-7],
            values: vec![1e-45, -0.0, f32::MIN_POSITIVE, 0.1, f32::MAX, 1.0 + f32::EPSILON, -3.3, 7.0],
        };
        let imported = ImportedTrial {
            name: "first".to_owned(),
            label: "mug".to_owned(),
            size: None,
            shape: None,
            signals: awkward.clone(),
        };
        store.insert_imported("mine", &[imported])?;
        let path = folder.path().join("out.mcap");
        let models = palpate_learn::Models::shipped()?;
        let options = OpenOptions { models, ..OpenOptions::default() };
        let mut steps = Vec::new();
        write_trials(&store, &[1, 2, 3], &options, &path, &mut |done, all| {
            steps.push((done, all));
            true
        })?;
        assert_eq!(steps, [(0, 3), (1, 3), (2, 3)]);
        let import = read_mcap(&path, "unused")?;
        assert!(import.warnings.is_empty(), "{:?}", import.warnings);
        let labels: Vec<&str> = import.trials.iter().map(|trial| trial.label.as_str()).collect();
        assert_eq!(labels, ["lemon", "ball", "mug"]);
        for (trial, id) in import.trials.iter().zip([1, 2]) {
            let stored = store.load(id)?;
            let open = crate::inspection::OpenTrial::open(&store, id, &OpenOptions::default())?;
            let wanted = palpate_tactile::Sensors::new(
                &palpate_tactile::SensorLayout::named("C1+F")?,
                &stored.header.scene.gripper,
                palpate_tactile::SignalDefinition::Parts,
            )?;
            // Where a pressure is undefined, recognisers take none: so do imported trials.
            assert_eq!(bits(&trial.signals), bits(&wanted.signals(stored.frames())));
            assert_eq!(trial.signals.t_s, open.t_s);
            assert!(trial.size.is_some() && trial.shape.is_some());
        }
        let back = &import.trials[2];
        assert_eq!(bits(&back.signals), bits(&awkward));
        // A second way through the store and a file changes nothing more.
        let mut other = Store::open(&folder.path().join("other.sqlite"))?;
        assert_eq!(other.insert_imported("bag", &import.trials)?, 3);
        let again = folder.path().join("again.mcap");
        write_trials(&other, &[1, 2, 3], &OpenOptions::default(), &again, &mut |_, _| true)?;
        for (first, second) in import.trials.iter().zip(read_mcap(&again, "")?.trials) {
            assert_eq!((bits(&first.signals), &first.label), (bits(&second.signals), &second.label));
        }
        Ok(())
    }

    #[test]
    fn an_export_that_ends_early_leaves_no_file() {
        let (folder, store) = store_of(&["ball", "ball"]);
        for format in FORMATS {
            let path = folder.path().join(format!("out.{}", format.kind.endings()[0]));
            let mut allowed = 0;
            let outcome = write_trials(&store, &[1, 2], &OpenOptions::default(), &path, &mut |done, _| {
                allowed += 1;
                done == 0
            });
            assert!(matches!(outcome, Err(ExchangeError::Stopped)), "{}", format.name);
            assert_eq!(allowed, 2);
            assert!(matches!(
                write_trials(&store, &[1, 99], &OpenOptions::default(), &path, &mut |_, _| true),
                Err(ExchangeError::Open(_) | ExchangeError::Store(_))
            ));
            let nowhere = folder.path().join(format!("no/such/out.{}", format.kind.endings()[0]));
            let outcome = write_trials(&store, &[1], &OpenOptions::default(), &nowhere, &mut |_, _| true);
            assert!(matches!(outcome, Err(ExchangeError::Write { .. })), "{}", format.name);
        }
        let names: Vec<String> = std::fs::read_dir(folder.path())
            .expect("reads")
            .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
            .filter(|name| !name.starts_with("trials.sqlite"))
            .collect();
        assert!(names.is_empty(), "{names:?}");
        let error = write_trials(&store, &[1], &OpenOptions::default(), Path::new("a.xyz"), &mut |_, _| true);
        assert!(error.expect_err("refused").to_string().contains("mcap, npz"));
    }
}
