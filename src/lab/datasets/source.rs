//! Data sets out of the store: which trials, seen through which sensors.

use palpate_learn::{Class, DataCard, Dataset, Example, Labels, Sequence};
use palpate_sim::gripper::{Gripper, Phase};
use palpate_sim::objects::{EMPTY, catalogue};
use palpate_sim::scene::{Between, PRESETS, PoseSpread, Scene};
use palpate_store::{BOARD_RIG, Store, StoreError, TrialRow};
use palpate_tactile::model::SensorModel;
use palpate_tactile::trial::Trial;
use palpate_tactile::trial::TrialId;
use palpate_tactile::{Channel, LayoutError, PressureArea, SensorLayout, Sensors, Signals};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Through which sensors simulated trials are seen. Imported trials bring their own channels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// Name of the sensor layout: `C1+F`.
    pub layout: String,
    /// Perfect sensors, or such as the real gripper has.
    pub sensors: SensorModel,
}

impl Default for View {
    fn default() -> Self {
        Self { layout: "C1+F".to_owned(), sensors: SensorModel::Virtual }
    }
}

/// Which trials make a data set.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Source {
    /// Only trials of this collection, by its name or the beginning of it.
    pub collection: Option<String>,
    /// Only trials of this rig: [`BOARD_RIG`] for those of the real gripper.
    pub rig: Option<String>,
    /// Only these objects; all where the list is empty.
    pub objects: Vec<String>,
    /// Leave the empty hand out: it is never confused with anything and would flatter a table.
    pub without_empty: bool,
    /// At most this many trials of each object, oldest first.
    pub most_of_each: Option<usize>,
}

/// Why there is no data set.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// The store.
    #[error("{cause}")]
    Store {
        /// What it says.
        cause: StoreError,
    },
    /// A layout that does not fit.
    #[error("{cause}")]
    Layout {
        /// What is wrong.
        cause: LayoutError,
    },
    /// A trial's scene that cannot be read.
    #[error("the scene stored with trial {id} cannot be read: {cause}")]
    Scene {
        /// The trial.
        id: TrialId,
        /// What is wrong.
        cause: String,
    },
    /// No trial fits.
    #[error(
        "no trial in the store fits{about}; `palpate collect` makes some, `palpate trials list` shows what is there"
    )]
    Nothing {
        /// What was asked for.
        about: String,
    },
    /// Trials fit, but none that may be learned from.
    #[error(
        "no trial that fits{about} may be learned from: {left_out} did not stay finite or did not converge; `palpate \
         trials show` says where"
    )]
    Unsound {
        /// What was asked for.
        about: String,
        /// How many fit.
        left_out: usize,
    },
    /// Trials that cannot stand in one data set.
    #[error(
        "the trials do not have the same channels: trial {first} has {first_channels}, trial {other} has \
         {other_channels}; choose one kind with --collection"
    )]
    Mixed {
        /// A trial.
        first: TrialId,
        /// Its channels.
        first_channels: String,
        /// Another one.
        other: TrialId,
        /// And its channels.
        other_channels: String,
    },
    /// A trial of the real gripper whose channels cannot be derived.
    #[error("trial {id} of the real gripper does not give the channels of layout {layout}: {why}")]
    Uncalibrated {
        /// The trial.
        id: TrialId,
        /// What was wanted.
        layout: String,
        /// What is missing, in words.
        why: String,
    },
    /// Trials of the real gripper, none of which can be derived.
    #[error(
        "none of the {left_out} trials of the real gripper can be read: {why}; `palpate calibrate list` shows which parts are \
         calibrated"
    )]
    NoneCalibrated {
        /// How many fit.
        left_out: usize,
        /// What is missing of the first, in words.
        why: String,
    },
    /// An object in the list that no trial is of.
    #[error("no trial in the store is of \"{object}\"; `palpate trials list` shows what is there")]
    NoSuchObject {
        /// The object.
        object: String,
    },
}

/// The sixteen with their sizes and shapes, and the empty hand with neither.
pub fn labels_of_catalogue() -> Labels {
    let all = catalogue().iter().map(|built_in| {
        let class = built_in.class();
        (built_in.name.clone(), Some((class.size.name().to_owned(), class.shape.name().to_owned())))
    });
    labels(&all.chain([(EMPTY.to_owned(), None)]).collect())
}

/// Labels from names and, where known, their size and shape.
fn labels(named: &BTreeMap<String, Option<(String, String)>>) -> Labels {
    // The paper's words come first, in its order; others follow by name.
    let listed = |known: &[&str], pick: &dyn Fn(&(String, String)) -> String| -> Vec<String> {
        let found: BTreeSet<String> = named.values().flatten().map(pick).collect();
        let mut list: Vec<String> = known.iter().filter(|w| found.contains(**w)).map(|w| (*w).to_owned()).collect();
        list.extend(found.into_iter().filter(|w| !known.contains(&w.as_str())));
        list
    };
    let sizes = listed(&["tiny", "large"], &|(size, _)| size.clone());
    let shapes = listed(&["cubic", "cylindrical", "spherical"], &|(_, shape)| shape.clone());
    let at = |list: &[String], word: Option<&String>| word.and_then(|w| list.iter().position(|l| l == w));
    let classes = named
        .iter()
        .map(|(name, known)| Class {
            name: name.clone(),
            size: at(&sizes, known.as_ref().map(|(size, _)| size)),
            shape: at(&shapes, known.as_ref().map(|(_, shape)| shape)),
        })
        .collect();
    Labels { classes, sizes, shapes }
}

impl Source {
    fn fits(&self, row: &TrialRow) -> bool {
        let in_collection =
            |prefix: &String| row.collection.as_ref().is_some_and(|own| own.starts_with(prefix.as_str()));
        row.state == "complete"
            && self.collection.as_ref().is_none_or(in_collection)
            && self.rig.as_ref().is_none_or(|rig| *rig == row.rig)
            && (self.objects.is_empty() || self.objects.contains(&row.object))
            && !(self.without_empty && row.object == EMPTY)
    }

    fn described(&self) -> String {
        let mut about = String::new();
        if let Some(collection) = &self.collection {
            about += &format!(" collection {collection}");
        }
        if let Some(rig) = &self.rig {
            about += &format!(" rig {rig}");
        }
        if !self.objects.is_empty() {
            about += &format!(" the objects {}", self.objects.join(", "));
        }
        about
    }

    /// Reads the data set. Trials without a label are no part of it; those that did not stay finite or did not converge are left
    /// out and counted. `tell` hears how many of how many trials have been read.
    pub fn read(
        &self,
        store: &Store,
        view: &View,
        tell: &mut dyn FnMut(usize, usize),
    ) -> Result<Dataset, DatasetError> {
        let mut rows = store.list(false).map_err(|cause| DatasetError::Store { cause })?;
        // Nobody has said yet what they are of.
        rows.retain(|row| !row.object.is_empty());
        self.read_rows(store, &rows, view, tell)
    }

    /// Reads one trial as a data set of its own, labelled or not.
    pub fn read_trial(&self, store: &Store, id: TrialId, view: &View) -> Result<Dataset, DatasetError> {
        let mut rows = store.list(false).map_err(|cause| DatasetError::Store { cause })?;
        rows.retain(|row| row.id == id);
        if rows.is_empty() {
            // Loading it says why it cannot be had.
            store.load(id).map_err(|cause| DatasetError::Store { cause })?;
        }
        self.read_rows(store, &rows, view, &mut |_, _| ())
    }

    fn read_rows(
        &self,
        store: &Store,
        rows: &[TrialRow],
        view: &View,
        tell: &mut dyn FnMut(usize, usize),
    ) -> Result<Dataset, DatasetError> {
        let mut met: BTreeMap<String, usize> = BTreeMap::new();
        let mut few_enough = |row: &&TrialRow| {
            let count = met.entry(row.object.clone()).or_default();
            *count += 1;
            self.most_of_each.is_none_or(|most| *count <= most)
        };
        let (sound, unsound): (Vec<&TrialRow>, Vec<&TrialRow>) =
            rows.iter().filter(|row| self.fits(row)).partition(|row| row.sound);
        let left_out = unsound.len();
        let rows: Vec<&TrialRow> = sound.into_iter().filter(&mut few_enough).collect();
        if rows.is_empty() {
            let about = self.described();
            return Err(match left_out {
                0 => DatasetError::Nothing { about },
                _ => DatasetError::Unsound { about, left_out },
            });
        }
        if let Some(object) = self.objects.iter().find(|object| !rows.iter().any(|row| row.object == **object)) {
            return Err(DatasetError::NoSuchObject { object: object.clone() });
        }
        let mut channels: Option<(TrialId, Vec<String>)> = None;
        let mut named = BTreeMap::new();
        let mut read = Vec::new();
        let (mut origins, mut uncalibrated, mut missing) = (BTreeSet::new(), 0, String::new());
        for (k, row) in rows.iter().enumerate() {
            tell(k, rows.len());
            let (signals, origin) = match signals_of(store, row, view) {
                // Counts of a board mean nothing without a calibration; others may have one.
                Err(DatasetError::Uncalibrated { why, .. }) if rows.len() > 1 => {
                    if uncalibrated == 0 {
                        missing = why;
                    }
                    uncalibrated += 1;
                    continue;
                }
                outcome => outcome?,
            };
            origins.insert(origin);
            let (first, known) = channels.get_or_insert_with(|| (row.id, signals.channels.clone()));
            if *known != signals.channels {
                return Err(DatasetError::Mixed {
                    first: *first,
                    first_channels: known.join(", "),
                    other: row.id,
                    other_channels: signals.channels.join(", "),
                });
            }
            named.entry(row.object.clone()).or_insert_with(|| known_properties(row));
            read.push((row.id, row.object.clone(), sequence_of(&signals)));
        }
        let labels = labels(&named);
        let example = |(id, object, grasp): (TrialId, String, Sequence)| {
            Some(Example { id, class: labels.class(&object)?, grasp: Arc::new(grasp) })
        };
        if read.is_empty() {
            return Err(DatasetError::NoneCalibrated { left_out: uncalibrated, why: missing });
        }
        let examples = read.into_iter().filter_map(example).collect();
        let channels = channels.map(|(_, channels)| channels).unwrap_or_default();
        let collections: BTreeSet<String> = rows.iter().filter_map(|row| row.collection.clone()).collect();
        let left_out = left_out + uncalibrated;
        let about = DataCard { left_out, ..card(&origins, view, collections.into_iter().collect(), rows.len()) };
        Ok(Dataset { channels, labels, examples, about })
    }
}

/// How a trial came about: its pose preset, and whether its object was free.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Origin {
    Simulated { preset: Option<&'static str>, fixed: bool },
    Recorded,
}

fn card(origins: &BTreeSet<Origin>, view: &View, collections: Vec<String>, grasps: usize) -> DataCard {
    let simulated: Vec<(Option<&'static str>, bool)> = origins
        .iter()
        .filter_map(|origin| match origin {
            Origin::Simulated { preset, fixed } => Some((*preset, *fixed)),
            Origin::Recorded => None,
        })
        .collect();
    let preset = simulated.first().and_then(|(preset, _)| *preset).filter(|p| simulated.iter().all(|o| o.0 == Some(p)));
    let object = match simulated.first() {
        None => "recorded",
        Some(first) if simulated.iter().any(|o| o.1 != first.1) => "free and fixed",
        Some((_, true)) => "fixed",
        Some((_, false)) => "free",
    };
    let seen = !simulated.is_empty();
    DataCard {
        collections,
        preset: preset.map(str::to_owned),
        object: object.to_owned(),
        grasps,
        layout: seen.then(|| view.layout.to_ascii_uppercase()),
        sensors: seen.then(|| view.sensors.name().to_owned()),
        left_out: 0,
    }
}

fn known_properties(row: &TrialRow) -> Option<(String, String)> {
    let of_catalogue = || {
        let class = catalogue().iter().find(|b| b.name == row.object)?.class();
        Some((class.size.name().to_owned(), class.shape.name().to_owned()))
    };
    row.properties.clone().or_else(of_catalogue)
}

/// What is read of a trial: its own channels where it was imported, those of a view where it was simulated.
fn signals_of(store: &Store, row: &TrialRow, view: &View) -> Result<(Signals, Origin), DatasetError> {
    if let Some(signals) = store.readings(row.id).map_err(|cause| DatasetError::Store { cause })? {
        return Ok((signals, Origin::Recorded));
    }
    if row.rig == BOARD_RIG {
        return Ok((board_signals(store, row.id, view)?, Origin::Recorded));
    }
    let trial = store.load(row.id).map_err(|cause| DatasetError::Store { cause })?;
    let scene = Scene::from_toml(&trial.info.scene)
        .map_err(|error| DatasetError::Scene { id: row.id, cause: error.to_string() })?;
    let drawn_as = PoseSpread { between: Between::default(), ..scene.pose.clone() };
    let preset = PRESETS.iter().find(|preset| preset.poses() == drawn_as).map(|preset| preset.name);
    let signals = view.signals(&trial, &scene).map_err(|cause| DatasetError::Layout { cause })?;
    Ok((signals, Origin::Simulated { preset, fixed: scene.holds_object() }))
}

/// What a real gripper felt, by the calibrations of its parts, in the channels of the layout.
fn board_signals(store: &Store, id: TrialId, view: &View) -> Result<Signals, DatasetError> {
    let read = store.board_signals(id, &[]).map_err(|cause| DatasetError::Store { cause })?;
    // One that says it is of a board, and has nothing of it, has nothing at all.
    let read =
        read.ok_or(DatasetError::NoneCalibrated { left_out: 1, why: "nothing was heard of its board".to_owned() })?;
    let layout = SensorLayout::named(&view.layout).map_err(|cause| DatasetError::Layout { cause })?;
    let channels = layout.channels(&Gripper::default()).map_err(|cause| DatasetError::Layout { cause })?;
    let wanted: Vec<String> = channels.iter().map(Channel::name).collect();
    read.grasp(&wanted).ok_or_else(|| DatasetError::Uncalibrated {
        id,
        layout: layout.full_name(),
        why: read.derived.warnings.join("; "),
    })
}

impl View {
    /// What a simulated trial looks like through these sensors, from its start to the end of the hold. The release is
    /// left out: it tells classes apart only by what integrators and dampers leave behind.
    pub fn signals(&self, trial: &Trial, scene: &Scene) -> Result<Signals, LayoutError> {
        let layout = SensorLayout::named(&self.layout)?;
        let sensors = Sensors::new(&layout, &scene.gripper, PressureArea::Participation)?;
        let clean = sensors.signals(trial);
        let end = trial.frames.iter().rev().find(|f| f.phase != Phase::Release).map_or(f64::INFINITY, |f| f.t);
        // Poses of different objects may share a seed; their noise should not.
        let seed = trial
            .info
            .object
            .bytes()
            .fold(trial.info.seed, |seed, byte| (seed ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
        Ok(self.sensors.apply(&clean, seed).until(end))
    }
}

/// Signals in the form recognisers take.
pub fn sequence_of(signals: &Signals) -> Sequence {
    Sequence { t_s: signals.t_s.iter().map(|t| *t as f32).collect(), values: signals.values.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_model_knows_the_sixteen_and_the_empty_hand() {
        let model = palpate_learn::shipped_model().expect("whole");
        assert_eq!(model.card.labels, labels_of_catalogue());
    }
}
