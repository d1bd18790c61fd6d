//! Data sets read from the store: the trials that a query chooses, those that are left out and why, and their card.

use super::card::card;
use super::origin::TrialOrigin;
use super::query::{
    DatasetError, DatasetQuery, SensorView, TrialSignals, labels, none_calibrated, sequence_of, signals_of,
};
use palpate_learn::{Dataset, Example, OTHER, Sequence};
use palpate_sim::objects::{EMPTY, RandomShape, catalogue};
use palpate_store::labels::{ADAPTING, Classes, Flag, compared};
use palpate_store::{Library, Store, TrialPlace, TrialRow};
use palpate_tactile::trial::{TrialId, TrialSource};
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Numbers of trials left out, by reason.
type LeftOut = BTreeMap<String, usize>;

impl DatasetQuery {
    /// Reads the data set of all labelled trials that match. Trials of the demo log, trials that diverged, did not converge or
    /// did not come to rest, whose object was pulled, that a gripper was adapted by, that are flagged, or that hold the grasp of an earlier trial among them are left
    /// out and counted, but not those after the last one that `most_of_each` allows. `progress` gets the number of trials
    /// read and their total.
    pub fn read(
        &self,
        store: &Store,
        view: &SensorView,
        progress: &mut dyn FnMut(usize, usize),
    ) -> Result<Dataset, DatasetError> {
        view.learnt()?;
        let library = Library::read(store)?;
        let mut before = Predecessors::of(library.rows());
        let found = library.find(store, &self.library_query())?;
        let mut rows: Vec<&TrialRow> = found.iter().map(|trial| &trial.row).collect();
        rows.retain(|row| !row.object.is_empty() && self.fits(row));
        let matching = rows.len();
        // An object whose trials are all left out is counted among those.
        let has_trials = |object: &&String| rows.iter().any(|row| compared(&row.object) == compared(object));
        if matching > 0
            && let Some(object) = self.objects.iter().find(|object| !has_trials(object))
        {
            return Err(DatasetError::Refused(format!(
                "the store has no trial of \"{object}\"; `palpate trials list` lists the trials"
            )));
        }
        let mut left_out = LeftOut::new();
        let (mut kept, mut held) = (BTreeMap::<String, usize>::new(), BTreeSet::new());
        rows.retain(|row| {
            let count = kept.entry(compared(&row.object)).or_default();
            if self.most_of_each.is_some_and(|most| *count >= most) {
                return false;
            }
            // The original of a copy may be outside the query, so only copies within it are left out.
            let mut is_copy = || row.identity.as_ref().is_some_and(|identity| !held.insert(identity));
            let reason = self.refused(row).or_else(|| is_copy().then_some(COPIES));
            match reason {
                Some(reason) => *left_out.entry(reason.to_owned()).or_default() += 1,
                None => *count += 1,
            }
            reason.is_none()
        });
        // Of equal grasps, the one within the query comes before those that follow it.
        before.by_identity.extend(rows.iter().filter_map(|row| Some((row.identity.clone()?, row.id))));
        if rows.is_empty() {
            return Err(match matching {
                0 => DatasetError::Refused(format!(
                    "no trial in the store matches{}; `palpate collect` makes trials, `palpate trials list` lists them",
                    self.about(store)
                )),
                _ => self.unusable(store, &left_out),
            });
        }
        self.read_rows(store, &rows, view, &before, left_out, progress)
    }

    /// Reads one trial, labelled or not, flagged or not, as a data set.
    pub fn read_trial(&self, store: &Store, id: TrialId, view: &SensorView) -> Result<Dataset, DatasetError> {
        let listed = store.list(false)?;
        let rows: Vec<&TrialRow> = listed.iter().filter(|row| row.id == id).collect();
        match rows.first() {
            // Loading returns the reason.
            None | Some(TrialRow { damaged: true, .. }) => drop(store.load(id)?),
            Some(row) if !row.sound => return Err(DatasetError::TrialUnsound { id }),
            Some(_) => {}
        }
        let read = self.read_rows(store, &rows, view, &Predecessors::default(), LeftOut::new(), &mut |_, _| ());
        read.map_err(|error| match error {
            // Who names a trial has a model and no options for signals.
            DatasetError::OnlySimulated { id, .. } => {
                DatasetError::OnlySimulated { id, choice: "a model of the signals of parts" }
            }
            other => other,
        })
    }

    /// Reason why a trial that matches is left out.
    pub(crate) fn refused(&self, row: &TrialRow) -> Option<&'static str> {
        if row.place == TrialPlace::DemoLog {
            Some("in the demo log")
        } else if row.damaged {
            Some(DAMAGED)
        } else if !row.sound {
            Some(NOT_SOUND)
        } else if row.pulled {
            Some("pulled by hand")
        } else if row.tags.iter().any(|tag| tag == ADAPTING) && self.tag.is_none() {
            Some("recorded to adapt")
        } else if row.flags.iter().any(|found| found.flag != Flag::Duplicate) && !self.include_flagged {
            Some("flagged")
        } else {
            None
        }
    }

    /// Trials match, but none of them can be used.
    fn unusable(&self, store: &Store, left_out: &LeftOut) -> DatasetError {
        let (about, reasons) = (self.about(store), palpate_learn::counted(left_out));
        DatasetError::Refused(format!(
            "no matching trial{about} is usable: {reasons}; `palpate trials show` says why, --include-flagged keeps flagged \
             trials, `palpate trials keep` takes trials out of the demo log"
        ))
    }

    fn read_rows(
        &self,
        store: &Store,
        rows: &[&TrialRow],
        view: &SensorView,
        before: &Predecessors,
        mut left_out: LeftOut,
        progress: &mut dyn FnMut(usize, usize),
    ) -> Result<Dataset, DatasetError> {
        let mut channels: Option<(TrialId, Vec<String>)> = None;
        let (mut named, mut classes) = (BTreeMap::new(), Classes::default());
        let (mut read, mut origins) = (Vec::new(), Vec::new());
        let mut seen: BTreeMap<(u64, u64), TrialId> = BTreeMap::new();
        let (mut uncalibrated, mut missing) = (0, String::new());
        for (k, row) in rows.iter().enumerate() {
            progress(k, rows.len());
            let (TrialSignals { signals, further, rest, .. }, origin) =
                match signals_of(store, row.id, row.source, view, &self.calibrations) {
                    // Skip boards without a calibration, unless it is the only trial.
                    Err(DatasetError::Uncalibrated { why, .. }) if rows.len() > 1 => {
                        if uncalibrated == 0 {
                            missing = why;
                        }
                        uncalibrated += 1;
                        continue;
                    }
                    Err(DatasetError::Store(cause)) if rows.len() > 1 && cause.is_damage() => {
                        *left_out.entry(DAMAGED.to_owned()).or_default() += 1;
                        continue;
                    }
                    outcome => outcome?,
                };
            if !self.calibrations.is_empty() && !origin.calibrations.iter().all(|id| self.calibrations.contains(id)) {
                *left_out.entry("with other calibrations".to_owned()).or_default() += 1;
                continue;
            }
            let (first, known) = channels.get_or_insert_with(|| (row.id, signals.channels.clone()));
            if *known != signals.channels {
                return Err(DatasetError::Refused(format!(
                    "the trials do not have the same channels: trial {first} has {}, trial {} has {}; choose one kind with \
                     --collection",
                    known.join(", "),
                    row.id,
                    signals.channels.join(", ")
                )));
            }
            let grasp = sequence_of(&signals);
            // All grasps of an empty hand are alike: it touches nothing.
            let seed = if row.object == EMPTY { row.seed } else { 0 };
            match seen.entry((grasp.content(), seed)) {
                Entry::Occupied(_) => *left_out.entry(COPIES.to_owned()).or_default() += 1,
                Entry::Vacant(free) => {
                    free.insert(row.id);
                    let class = classes.named(class_of(row)).to_owned();
                    if let Some((content, source)) = origin.object.as_ref().filter(|_| class != OTHER && class != EMPTY)
                    {
                        classes.take(&class, *content, source, SEPARATE)?;
                    }
                    named.entry(class.clone()).or_insert_with(|| known_properties(row, &class));
                    let further: Vec<_> = further.iter().map(|signals| Arc::new(sequence_of(signals))).collect();
                    let rest = rest.map(|rest| Arc::new(sequence_of(&rest)));
                    read.push((*row, (grasp, further, rest), before.of_trial(row, &origin)));
                    origins.push(origin);
                }
            }
        }
        if uncalibrated > 0 {
            left_out.insert("not calibrated".to_owned(), uncalibrated);
        }
        if read.is_empty() {
            return Err(match uncalibrated {
                0 => self.unusable(store, &left_out),
                _ => none_calibrated(uncalibrated, &missing),
            });
        }
        let labels = labels(&named);
        let used: Vec<&TrialRow> = read.iter().map(|(row, ..)| *row).collect();
        let mut about = card(self, &self.described(store), &used, &origins, view, left_out);
        about
            .mixed
            .extend(classes.several().iter().map(|all| format!("spellings of one class ({all}); it is one here")));
        let poses: Vec<u32> = origins.iter().map(|origin| origin.pose).collect();
        type Readings = (Sequence, Vec<Arc<Sequence>>, Option<Arc<Sequence>>);
        type Read<'r> = (&'r TrialRow, Readings, Option<TrialId>);
        let mut sessions = Sessions { tares: store.calibrations().tare_times()?, ..Sessions::default() };
        let mut example = |((row, (grasp, further, rest), after), pose): (Read<'_>, u32)| {
            let content = content_of(row, &grasp);
            Some(Example {
                id: row.id,
                class: labels.class(classes.named(class_of(row)))?,
                grasp: Arc::new(grasp),
                content,
                after,
                pose,
                session: sessions.of(row),
                rest,
                further,
            })
        };
        let examples = read.into_iter().zip(poses).filter_map(&mut example).collect();
        let channels = channels.map(|(_, channels)| channels).unwrap_or_default();
        Ok(Dataset { channels, labels, examples, about })
    }
}

/// What to do with two objects in one class.
const SEPARATE: &str = "choose one of them with --collection, or collect one of them anew under another --class";
/// Reason: diverged, did not converge, or did not come to rest.
pub const NOT_SOUND: &str = "not sound";
/// Reason: not what was stored.
const DAMAGED: &str = "damaged";
/// Reason: another trial holds the same grasp.
const COPIES: &str = "copies of other trials";

/// A pause of this length begins a new session (s).
const PAUSE_S: f64 = 600.0;

/// Numbers of the sessions of trials that were not simulated, in the order in which they were made: another day, ten minutes
/// without a trial, a tare, another imported file.
#[derive(Default)]
struct Sessions {
    /// Times of all tares, as those of trials.
    tares: Vec<String>,
    newest: u32,
    /// File, time of day (s) and time of the last trial.
    last: Option<(Option<String>, f64, String)>,
}

impl Sessions {
    fn of(&mut self, row: &TrialRow) -> u32 {
        if row.source == TrialSource::Simulated {
            return 0;
        }
        let (day, time) = row.created.split_once('T').unwrap_or((&row.created, ""));
        let parts = time.trim_end_matches('Z').split(':').zip([3600.0, 60.0, 1.0]);
        let time_s: f64 = parts.map(|(part, unit)| unit * part.parse::<f64>().unwrap_or(0.0)).sum();
        // Imported trials are all made at once.
        let file = row.collection.clone().filter(|_| row.source == TrialSource::Imported);
        let goes_on = self.last.as_ref().is_some_and(|(own, at_s, at)| {
            let is_tared = || self.tares.iter().any(|tare| at < tare && *tare <= row.created);
            let at_once = at.starts_with(day) && (time_s - at_s).abs() < PAUSE_S && !is_tared();
            *own == file && (file.is_some() || at_once)
        });
        self.newest += u32::from(!goes_on);
        self.last = Some((file, time_s, row.created.clone()));
        self.newest
    }
}

/// Hash of a grasp: of its identity where it is known, else of its readings.
fn content_of(row: &TrialRow, grasp: &Sequence) -> u64 {
    let of_identity = |identity: &String| palpate_sim::fingerprint([identity.as_bytes()]);
    row.identity.as_ref().map_or_else(|| grasp.content(), of_identity)
}

/// The trials made just before others.
#[derive(Default)]
struct Predecessors {
    by_identity: BTreeMap<String, TrialId>,
    /// The last trial of the same object, source and collection before each.
    last: BTreeMap<TrialId, TrialId>,
}

impl Predecessors {
    fn of<'a>(rows: impl Iterator<Item = &'a TrialRow>) -> Self {
        let mut found = Self::default();
        let mut newest = BTreeMap::new();
        for row in rows {
            if let Some(identity) = &row.identity {
                found.by_identity.entry(identity.clone()).or_insert(row.id);
            }
            let kind = (&row.object, row.source.name(), &row.collection);
            if let Some(before) = newest.insert(kind, row.id) {
                found.last.insert(row.id, before);
            }
        }
        found
    }

    /// The trial before, if the object has stayed as that one released it.
    fn of_trial(&self, row: &TrialRow, origin: &TrialOrigin) -> Option<TrialId> {
        match &origin.after {
            Some(identity) => self.by_identity.get(identity).copied(),
            None => self.last.get(&row.id).copied().filter(|_| origin.stayed || row.follows),
        }
    }
}

/// Class of a trial: the name of its object, or "other" for random shapes.
fn class_of(row: &TrialRow) -> &str {
    if RandomShape::seed_of(&row.object).is_some() { OTHER } else { &row.object }
}

fn known_properties(row: &TrialRow, class: &str) -> Option<(String, String)> {
    let of_catalogue = || {
        let class = catalogue().iter().find(|b| b.name == class)?.class();
        Some((class.size.name().to_owned(), class.shape.name().to_owned()))
    };
    row.properties.clone().or_else(of_catalogue)
}
