//! Data sets from the store: a query for trials, and the sensors through which simulated trials are read.

use super::origin::TrialOrigin;
use super::sampling::{Cut, resampled};
use crate::labelling::SensorWatch;
use palpate_learn::{Class, Labels, ModelCard, Sequence};
use palpate_sim::gripper::{GripperModel, Phase};
use palpate_sim::objects::{EMPTY, catalogue};
use palpate_store::labels::{ClassClash, Flag, compared};
use palpate_store::{
    BoardSignals, CalibrationId, Day, Store, StoreError, TrialColumn, TrialOrder, TrialQuery, TrialRow,
};
use palpate_tactile::board::SensorList;
use palpate_tactile::model::SensorModel;
use palpate_tactile::trial::{BoardCourse, SimulatedTrial, Trial, TrialData, TrialHeader, TrialId, TrialSource};
use palpate_tactile::{Channel, LayoutError, Quantity, SensorLayout, Sensors, SignalDefinition, Signals};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// Sensors through which simulated trials are read. Imported trials have their own channels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SensorView {
    /// Name of the sensor layout: `C1`, or `gripper` for the sensors of a gripper file.
    pub layout: String,
    /// Those sensors.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gripper: Option<SensorList>,
    /// Sensor model: ideal, like those of the real gripper, or like those of any.
    pub sensors: SensorModel,
    /// Number of times that drawn or noisy sensors, others each time, read each grasp for training; the others read it once.
    pub draws: u32,
    /// Definition of the signals.
    pub signals: SignalDefinition,
    /// Rate at which readings of all sources are read (Hz); as they were sampled if `None`.
    pub rate_hz: Option<f64>,
    /// End of the readings of all sources.
    pub cut: Cut,
}

impl Default for SensorView {
    fn default() -> Self {
        let (sensors, signals) = (SensorModel::Virtual, SignalDefinition::Parts);
        Self { layout: "C1".to_owned(), gripper: None, sensors, draws: 1, signals, rate_hz: None, cut: Cut::default() }
    }
}

/// Query for the trials of a data set.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DatasetQuery {
    /// Only trials of collections whose name starts with this.
    pub collection: Option<String>,
    /// Only trials of this source.
    pub source: Option<TrialSource>,
    /// Only simulated trials of this pose preset.
    pub preset: Option<String>,
    /// Only trials begun on this day or later.
    pub since: Option<Day>,
    /// Only trials begun on this day or earlier.
    pub until: Option<Day>,
    /// Only trials with this tag.
    pub tag: Option<String>,
    /// Only simulated trials of this version of the physics.
    pub physics: Option<PhysicsVersion>,
    /// Only trials of a real gripper that these calibrations serve; all where the list is empty.
    pub calibrations: Vec<CalibrationId>,
    /// True to keep trials with flags.
    pub include_flagged: bool,
    /// Only these objects; all where the list is empty.
    pub objects: Vec<String>,
    /// True to leave out the empty hand, which is never confused with an object and would raise mean scores.
    pub without_empty: bool,
    /// Largest number of trials of each object, oldest first.
    pub most_of_each: Option<usize>,
}

/// Version of the physics that made a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PhysicsVersion {
    /// A known one.
    Known(u32),
    /// That of trials of early versions of the program, which stored none.
    Unknown,
}

/// A text that names no [`PhysicsVersion`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("write a number, as `palpate trials show` prints it, or unknown")]
pub struct NoPhysicsVersion;

impl std::str::FromStr for PhysicsVersion {
    type Err = NoPhysicsVersion;

    fn from_str(text: &str) -> Result<Self, NoPhysicsVersion> {
        match text {
            "unknown" => Ok(Self::Unknown),
            number => number.parse().map(Self::Known).map_err(|_no_number| NoPhysicsVersion),
        }
    }
}

/// Reason why there is no data set.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The sensor layout does not fit.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// A trial asked for by its number is not sound.
    #[error("trial {id} is not sound: `palpate trials show {id}` says why")]
    TrialUnsound {
        /// The trial.
        id: TrialId,
    },
    /// A trial of a real gripper, asked for channels of the simulation.
    #[error("trial {id} is of a real gripper, whose pads do not measure contact pressure: choose {choice}")]
    OnlySimulated {
        /// The trial.
        id: TrialId,
        /// What to choose instead.
        choice: &'static str,
    },
    /// A trial of the real gripper whose channels cannot be derived.
    #[error("trial {id} of the real gripper does not give the channels of layout {layout}: {why}")]
    Uncalibrated {
        /// The trial.
        id: TrialId,
        /// Sensor layout.
        layout: String,
        /// Missing parts.
        why: String,
    },
    /// Trials of different objects under one class.
    #[error(transparent)]
    OneClass(#[from] ClassClash),
    /// No trial is left, or those that are do not fit together.
    #[error("{0}")]
    Refused(String),
}

/// Labels of the sixteen built-in objects, and of the empty hand, which has neither size nor shape.
pub fn labels_of_catalogue() -> Labels {
    let all = catalogue().iter().map(|built_in| {
        let class = built_in.class();
        (built_in.name.clone(), Some((class.size.name().to_owned(), class.shape.name().to_owned())))
    });
    labels(&all.chain([(EMPTY.to_owned(), None)]).collect())
}

/// Labels from class names and, where known, size and shape.
pub(super) fn labels(named: &BTreeMap<String, Option<(String, String)>>) -> Labels {
    // The paper's terms come first, in its order; others follow by name.
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

impl DatasetQuery {
    /// The part of it that the library knows.
    pub(super) fn library_query(&self) -> TrialQuery {
        TrialQuery {
            source: self.source,
            preset: self.preset.clone(),
            tag: self.tag.clone(),
            since: self.since.clone(),
            until: self.until.clone(),
            order: TrialOrder { column: TrialColumn::Id, descending: false },
            ..TrialQuery::default()
        }
    }

    /// Collection for which a trial is taken: the first that the query names.
    pub(super) fn collection_of<'a>(&self, row: &'a TrialRow) -> Option<&'a String> {
        row.collections().find(|own| self.collection.as_ref().is_none_or(|prefix| own.starts_with(prefix.as_str())))
    }

    /// The part of it that the library does not know.
    pub(super) fn fits(&self, row: &TrialRow) -> bool {
        let of_physics = |wanted: PhysicsVersion| {
            row.source == TrialSource::Simulated
                && match wanted {
                    PhysicsVersion::Known(version) => row.physics == Some(version),
                    PhysicsVersion::Unknown => row.physics.is_none(),
                }
        };
        row.state == "complete"
            && (self.collection.is_none() || self.collection_of(row).is_some())
            && self.physics.is_none_or(of_physics)
            && (self.calibrations.is_empty() || row.source == TrialSource::Recorded)
            && (self.objects.is_empty() || self.names(&row.object))
            && !(self.without_empty && row.object == EMPTY)
    }

    /// True for a name of one of its objects, however it is written.
    fn names(&self, object: &str) -> bool {
        self.objects.iter().any(|own| own == object) || self.objects.iter().any(|own| compared(own) == compared(object))
    }

    /// The query in words, for tables and cards: `collection 52c1, preset B, since 2026-11-21`. Days are dates.
    pub fn described(&self, store: &Store) -> String {
        let date = |day: &Day| day.date(store).unwrap_or_else(|_| day.to_string());
        let mut parts = Vec::new();
        parts.extend(self.collection.as_ref().map(|collection| format!("collection {collection}")));
        parts.extend(self.source.map(|source| format!("source {source}")));
        parts.extend(self.preset.as_ref().map(|preset| format!("preset {}", preset.to_uppercase())));
        parts.extend(self.since.as_ref().map(|day| format!("since {}", date(day))));
        parts.extend(self.until.as_ref().map(|day| format!("until {}", date(day))));
        parts.extend(self.tag.as_ref().map(|tag| format!("tag {tag}")));
        parts.extend(self.physics.map(|physics| match physics {
            PhysicsVersion::Known(version) => format!("physics {version}"),
            PhysicsVersion::Unknown => "physics unknown".to_owned(),
        }));
        let calibrations: Vec<String> = self.calibrations.iter().map(CalibrationId::to_string).collect();
        parts.extend((!calibrations.is_empty()).then(|| format!("calibrations {}", calibrations.join(" "))));
        parts.extend((!self.objects.is_empty()).then(|| format!("objects {}", self.objects.join(" "))));
        parts.extend(self.without_empty.then(|| "without the empty hand".to_owned()));
        parts.extend(self.most_of_each.map(|most| format!("first {most} of each object")));
        parts.extend(self.include_flagged.then(|| "with flagged trials".to_owned()));
        parts.join(", ")
    }

    /// The query as errors name it: ` (preset B)`; empty for all trials.
    pub(super) fn about(&self, store: &Store) -> String {
        let described = self.described(store);
        if described.is_empty() { described } else { format!(" ({described})") }
    }
}

/// Signals of one trial, as recognisers read them.
#[derive(Clone, Debug, PartialEq)]
pub struct TrialSignals {
    /// Signals from the start of the closing to the end of the hold.
    pub signals: Signals,
    /// The same grasp as other drawn grippers read it.
    pub further: Vec<Signals>,
    /// Start of the hold, on the clock of the signals (s), where known.
    pub hold_s: Option<f64>,
    /// Signals of a real gripper before it began to close, where that is known; they may be none.
    pub rest: Option<Signals>,
}

/// Reads the signals of a trial: its own channels if imported, calibrated ones if recorded, those of the view if
/// simulated.
pub fn trial_signals(
    store: &Store,
    id: TrialId,
    source: TrialSource,
    view: &SensorView,
) -> Result<TrialSignals, DatasetError> {
    Ok(signals_of(store, id, source, view, &[])?.0)
}

/// Signals and origin of a trial; a board's by these calibrations, where they fit its parts.
pub(super) fn signals_of(
    store: &Store,
    id: TrialId,
    source: TrialSource,
    view: &SensorView,
    calibrations: &[CalibrationId],
) -> Result<(TrialSignals, TrialOrigin), DatasetError> {
    let of_board = || {
        let (signals, used) = board_signals(store, id, view, calibrations)?;
        Ok((signals, TrialOrigin { calibrations: used, ..TrialOrigin::default() }))
    };
    if source == TrialSource::Recorded {
        return of_board();
    }
    let Trial { header, data } = store.load(id)?;
    let trial = match data {
        TrialData::Simulated(data) => SimulatedTrial { header, data },
        TrialData::Imported(signals) => {
            let signals = resampled(signals.until(view.cut.end(f64::INFINITY)), view.rate_hz);
            let signals = TrialSignals { signals, further: Vec::new(), hold_s: None, rest: None };
            return Ok((signals, TrialOrigin::default()));
        }
        TrialData::Recorded(_) => return of_board(),
    };
    let mut readings = view.readings(&trial)?.into_iter();
    let signals = readings.next().unwrap_or_default();
    let hold_s = trial.frames().iter().find(|frame| frame.phase == Phase::Hold).map(|frame| frame.t);
    let signals = TrialSignals { signals, further: readings.collect(), hold_s, rest: None };
    Ok((signals, TrialOrigin::simulated(&trial.header)))
}

/// Trials of the real gripper, none of which can be derived, for what the first one lacks.
pub(super) fn none_calibrated(left_out: usize, why: &str) -> DatasetError {
    DatasetError::Refused(format!(
        "none of the {left_out} trials of the real gripper is calibrated: {why}; `palpate calibrate list` lists the \
         calibrations"
    ))
}

/// Puts what the other sensors foretell in place of what failed ones read, in a trial that was flagged for it.
fn mend(store: &Store, id: TrialId, read: &mut BoardSignals) -> Result<(), StoreError> {
    let info = store.board_info(id)?;
    let is_flagged = info.is_some_and(|info| info.flags.iter().any(|found| found.flag == Flag::SensorFault));
    let Some(log) = is_flagged.then(|| store.board_log(id)).transpose()?.flatten() else { return Ok(()) };
    let BoardCourse { board, phases, began_s, .. } = &log.course;
    let closing_s = read.closing_s.map_or(f64::NEG_INFINITY, |closing_s| began_s + closing_s);
    let rest = &log.readings[..log.readings.partition_point(|reading| reading.t_s < closing_s)];
    let watch = SensorWatch::of_trial(board, [rest, &log.readings], phases, &read.serving.calibrations);
    let (channels, old) = (board.sensors.channels(), &read.derived.signals);
    let columns: Vec<Option<usize>> =
        channels.iter().map(|own| old.channels.iter().position(|name| *name == own.name())).collect();
    let mut signals = Signals { channels: channels.iter().map(Channel::name).collect(), ..Signals::default() };
    for (sample, t_s) in old.t_s.iter().enumerate() {
        let last = read.line.partition_point(|(from_s, _)| from_s <= t_s).checked_sub(1);
        let mut row: Vec<f32> =
            columns.iter().map(|column| column.map_or(f32::NAN, |column| old.row(sample)[column])).collect();
        watch.mend(&channels, &mut row, last.map_or(f64::NAN, |last| read.line[last].1));
        signals.push(*t_s, &row);
    }
    // What nothing foretells is left out.
    let known = |k: &usize| (0..signals.t_s.len()).any(|sample| signals.row(sample)[*k].is_finite());
    let known: Vec<String> = (0..channels.len()).filter(known).map(|k| signals.channels[k].clone()).collect();
    read.derived.signals = signals.chosen(&known).unwrap_or_default();
    Ok(())
}

/// Reads the signals of a real gripper, calibrated, in the channels of the layout.
fn board_signals(
    store: &Store,
    id: TrialId,
    view: &SensorView,
    calibrations: &[CalibrationId],
) -> Result<(TrialSignals, Vec<CalibrationId>), DatasetError> {
    if view.signals != SignalDefinition::Parts {
        let choice = "--signals parts, or --source sim for simulated trials alone";
        return Err(DatasetError::OnlySimulated { id, choice });
    }
    let read = store.board_signals(id, calibrations)?;
    let mut read = read.ok_or_else(|| none_calibrated(1, "its board sent no data"))?;
    mend(store, id, &mut read)?;
    let layout = view.sensor_layout()?;
    let channels = match layout.list {
        Some(list) => list.channels().into_iter().filter(|channel| channel.quantity != Quantity::Force).collect(),
        None => layout.channels(&GripperModel::default(), view.signals)?,
    };
    let wanted: Vec<String> = channels.iter().map(Channel::name).collect();
    let cut = match view.cut {
        Cut::HoldEnd => read.grasp(&wanted),
        cut @ (Cut::Whole | Cut::Seconds(_)) => read.grasp_until(&wanted, cut.end(f64::INFINITY)),
    };
    let signals = cut.ok_or_else(|| DatasetError::Uncalibrated {
        id,
        layout: layout.full_name(),
        why: read.derived.warnings.join("; "),
    })?;
    let hold_s = read.hold_s.map(|hold_s| hold_s - read.closing_s.unwrap_or(0.0));
    let signals = resampled(signals, view.rate_hz);
    let before = |closing_s: f64| Some(resampled(read.derived.signals.chosen(&wanted)?.until(closing_s), view.rate_hz));
    let rest = read.closing_s.and_then(before);
    Ok((TrialSignals { signals, further: Vec::new(), hold_s, rest }, read.serving.ids))
}

impl SensorView {
    /// Sensors that a recogniser expects of simulated trials.
    pub fn of_model(card: &ModelCard) -> Self {
        let (data, usual) = (&card.data, Self::default());
        let gripper: Option<SensorList> = data.gripper.as_deref().and_then(|text| serde_json::from_str(text).ok());
        let of_file = || gripper.map(|_| SensorLayout::OF_FILE.to_owned());
        Self {
            layout: data.layout.clone().or_else(of_file).unwrap_or(usual.layout),
            gripper,
            sensors: data.sensors.as_deref().and_then(SensorModel::named).unwrap_or_default(),
            draws: 1,
            signals: data.signals.as_deref().and_then(SignalDefinition::named).unwrap_or_default(),
            rate_hz: data.rate_hz,
            cut: data.cut.as_deref().and_then(|cut| cut.parse().ok()).unwrap_or_default(),
        }
    }

    /// The same through the sensors of the gripper that a store remembers, where it is not the paper's.
    pub fn of_store(self, store: &Store) -> Result<Self, StoreError> {
        let sensors = store.calibrations().sensors()?;
        if sensors == SensorList::default() {
            return Ok(self);
        }
        Ok(Self { layout: SensorLayout::OF_FILE.to_owned(), gripper: Some(sensors), ..self })
    }

    /// The layout.
    pub fn sensor_layout(&self) -> Result<SensorLayout, LayoutError> {
        if self.layout.eq_ignore_ascii_case(SensorLayout::OF_FILE) {
            return Ok(SensorLayout::of_list(self.gripper.unwrap_or_default()));
        }
        SensorLayout::named(&self.layout)
    }

    /// The same with another definition of the signals, and without what that definition does not have.
    #[must_use]
    pub fn with_signals(mut self, signals: SignalDefinition) -> Self {
        match signals {
            SignalDefinition::Parts => {
                let plain = self.sensor_layout().map(|layout| layout.name.to_owned());
                self.layout = plain.unwrap_or(self.layout);
            }
            SignalDefinition::Contact | SignalDefinition::Hull => self.sensors = SensorModel::Virtual,
        }
        Self { signals, ..self }
    }

    /// Number of readings of each grasp: one, unless they differ.
    pub fn readers(&self) -> u32 {
        match self.sensors {
            SensorModel::Noisy | SensorModel::Drawn => self.draws.max(1),
            SensorModel::Virtual | SensorModel::PhysicalLike | SensorModel::Adapted => 1,
        }
    }

    /// True for sensors such as a real gripper has.
    pub fn is_physical(&self) -> bool {
        self.sensors != SensorModel::Virtual
    }

    /// The layout, as recognisers learn it.
    pub fn learnt(&self) -> Result<SensorLayout, LayoutError> {
        self.check_parts()?;
        let layout = self.sensor_layout()?;
        if layout.list.is_some() { Ok(layout) } else { SensorLayout::learnt(&self.layout, self.signals) }
    }

    /// The layout, as it is shown and exported.
    pub fn shown(&self) -> Result<SensorLayout, LayoutError> {
        Ok(self.learnt()?.shown(self.signals))
    }

    fn check_parts(&self) -> Result<(), LayoutError> {
        let none = self.is_physical() && self.signals != SignalDefinition::Parts;
        if none { Err(LayoutError::no_such_part()) } else { Ok(()) }
    }

    /// Computes the signals of a simulated trial from its start to the end that the view has.
    pub fn signals(&self, trial: &SimulatedTrial) -> Result<Signals, LayoutError> {
        let once = Self { draws: 1, ..self.clone() };
        Ok(once.readings(trial)?.swap_remove(0))
    }

    /// The same on the gripper of a number, where the view draws grippers.
    pub fn signals_on(&self, trial: &SimulatedTrial, gripper: u64) -> Result<Signals, LayoutError> {
        let (clean, end) = self.clean(trial)?;
        let read = self.sensors.apply_on(&clean, gripper, noise_seed(&trial.header));
        Ok(resampled(read.until(self.cut.end(end)), self.rate_hz))
    }

    /// Signals of perfect sensors, and the end of the hold (s).
    fn clean(&self, trial: &SimulatedTrial) -> Result<(Signals, f64), LayoutError> {
        self.check_parts()?;
        let sensors = Sensors::new(&self.sensor_layout()?, &trial.header.scene.gripper, self.signals)?
            .with_palm(trial.data.world_from_gripper.position);
        let clean = sensors.signals(trial.frames());
        let end = trial.frames().iter().rev().find(|f| f.phase != Phase::Release).map_or(f64::INFINITY, |f| f.t);
        Ok((clean, end))
    }

    /// The same as often as the view reads a grasp; once at least.
    pub fn readings(&self, trial: &SimulatedTrial) -> Result<Vec<Signals>, LayoutError> {
        let (clean, end) = self.clean(trial)?;
        let seed = noise_seed(&trial.header);
        let read = |draw: u32| {
            let seed = seed.wrapping_add(u64::from(draw).wrapping_mul(NEXT_DRAW));
            resampled(self.sensors.apply(&clean, seed).until(self.cut.end(end)), self.rate_hz)
        };
        Ok((0..self.readers()).map(read).collect())
    }
}

/// Difference between the seeds of two draws: odd and large, so that no two grasps share one.
const NEXT_DRAW: u64 = 0x9e37_79b9_7f4a_7c15;

/// Seed of the sensors' noise in a trial. Poses of different objects may share a seed; their noise must not. FNV-1a of the
/// name: changing it would change every data set with noisy sensors.
pub fn noise_seed(header: &TrialHeader) -> u64 {
    let mix = |seed: u64, byte: u8| (seed ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    header.object.bytes().fold(header.seed, mix)
}

/// Converts signals to the input of recognisers.
pub fn sequence_of(signals: &Signals) -> Sequence {
    Sequence { t_s: signals.t_s.iter().map(|t| *t as f32).collect(), values: signals.values.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_model_knows_all_objects_and_the_empty_hand() {
        for shipped in palpate_learn::Shipped::ALL {
            let mut labels = shipped.model().expect("valid").card.labels;
            assert!(labels.other().is_some());
            labels.classes.retain(|class| class.name != palpate_learn::OTHER);
            assert_eq!(labels, labels_of_catalogue());
        }
    }

    #[test]
    fn views_are_read_as_written_and_physical_sensors_have_signals_of_parts_alone() -> serde_json::Result<()> {
        let parts = SensorView { layout: "C6".to_owned(), sensors: SensorModel::PhysicalLike, ..SensorView::default() };
        let hull = SensorView { layout: "C1+F".to_owned(), signals: SignalDefinition::Hull, ..SensorView::default() };
        for own in [&parts, &hull] {
            assert_eq!(&serde_json::from_str::<SensorView>(&serde_json::to_string(own)?)?, own);
            assert!(own.learnt().is_ok());
        }
        let impossible = SensorView { signals: SignalDefinition::Contact, ..parts };
        assert_eq!(impossible.learnt(), Err(LayoutError::no_such_part()));
        Ok(())
    }
}
