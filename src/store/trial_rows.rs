//! The list of trials: what is known of each without its data. A damaged row is listed as such, with what can be read of it.

use super::checksum::{columns, of_row};
use super::demo_log::TrialPlace;
use super::store::Store;
use super::store_error::StoreError;
use crate::labels::{Flag, FlagRemark, flaws};
use palpate_sim::frame::Quality;
use palpate_sim::scene::{Between, PRESETS, PoseSpread, Scene};
use palpate_tactile::trial::{GraspOrigin, TrialId, TrialSource, UnknownSource};
use rusqlite::types::{Type, ValueRef};
use rusqlite::{Params, Row};
use serde::Serialize;
use std::collections::BTreeMap;

/// One row of the list of trials.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TrialRow {
    /// Number in this store.
    pub id: TrialId,
    /// Time of its beginning, UTC.
    pub created: String,
    /// The same in local time, to the minute: `2026-11-21T15:36`.
    pub local: String,
    /// `recording`, or `complete`.
    pub state: String,
    /// Origin.
    #[serde(rename = "rig")]
    pub source: TrialSource,
    /// Recorded from an emulated gripper.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub emulated: bool,
    /// In the store, or in the demo log.
    pub place: TrialPlace,
    /// Name of the object; empty while unlabelled.
    pub object: String,
    /// Seed of the pose.
    pub seed: u64,
    /// Data set that it belongs to.
    pub collection: Option<String>,
    /// Further collections that hold the same grasp.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub also_in: Vec<String>,
    /// Version of the physics of a simulated trial; unknown for those of early versions.
    pub physics: Option<u32>,
    /// Identity of a simulated grasp.
    #[serde(skip)]
    pub identity: Option<String>,
    /// Older trial that holds the same grasp.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duplicate_of: Option<TrialId>,
    /// A recogniser asked for it after earlier grasps of the same object, which stayed in between.
    pub follows: bool,
    /// The object of a simulated trial was pulled by hand, which its scene does not repeat.
    pub pulled: bool,
    /// Preset of poses that a simulated trial was drawn from.
    pub preset: Option<&'static str>,
    /// Parts or channels of a real gripper, channels of an imported trial; empty for a simulated one.
    pub sensors: String,
    /// Size and shape of the object, for imported trials that state them.
    pub properties: Option<(String, String)>,
    /// Samples stored.
    pub samples: i64,
    /// Its row cannot be read or does not match its checksum, or a part of its data is missing.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub damaged: bool,
    /// Whether it stayed finite and converged, and is not damaged.
    pub sound: bool,
    /// Number of warnings.
    pub warnings: usize,
    pub note: String,
    pub tags: Vec<String>,
    /// The label is marked as unsure.
    pub unsure: bool,
    /// Flags: faults of a trial of the real gripper, and copies of other trials.
    pub flags: Vec<FlagRemark>,
    /// Time of deletion, UTC.
    pub deleted: Option<String>,
}

/// In the warning of a trial whose object was pulled; early versions store nothing else of it.
const PULLED: &str = "pulled by hand";

impl TrialRow {
    /// Name of its gripper: that of its source, or `emulated`.
    pub fn gripper(&self) -> &'static str {
        if self.emulated { "emulated" } else { self.source.name() }
    }

    /// Simulated for a data set, by a study or by `palpate collect`.
    pub fn is_collected(&self) -> bool {
        self.source == TrialSource::Simulated && self.collection.is_some()
    }

    /// All collections that it belongs to.
    pub fn collections(&self) -> impl Iterator<Item = &String> {
        self.collection.iter().chain(&self.also_in)
    }

    /// A trial of which nothing else can be read.
    fn unreadable(row: &Row<'_>) -> rusqlite::Result<Self> {
        let state = "complete".to_owned();
        Ok(Self { id: row.get(0)?, state, damaged: true, deleted: row.get(9).unwrap_or_default(), ..Self::default() })
    }
}

/// Columns that [`RowReader`] reads, followed by those that the checksum covers. Sensors: the parts of a board, else its channels; or the imported channels.
const ROWS: &str =
    "SELECT id, created, state, rig, object, seed, samples, quality, warnings, deleted, collection, size,
    shape, note, tags, unsure, CASE WHEN json_valid(about) THEN about ->> '$.flags' END,
    strftime('%Y-%m-%dT%H:%M', created, 'localtime'),
    trials.checksum,
    CASE rig
        WHEN 'serial' THEN coalesce((SELECT group_concat(part, ' ') FROM parts WHERE parts.trial = trials.id),
            CASE WHEN json_valid(about) THEN about ->> '$.board.channels' END)
        WHEN 'import' THEN (SELECT channels FROM readings WHERE readings.trial = trials.id)
    END,
    (SELECT json_group_array(collection) FROM memberships WHERE memberships.trial = trials.id),
    origin, identity,
    CASE WHEN identity IS NOT NULL AND state = 'complete' THEN (SELECT min(first.id) FROM trials AS first
        WHERE first.identity = trials.identity AND first.state = 'complete' AND first.deleted IS NULL
        AND first.id < trials.id) END,
    rig = 'serial' AND earlier IS NOT NULL, demo,
    (rig <> 'serial' OR about IS NOT NULL AND checksum(uid, about) IS board_trials.checksum)
    AND trials.chunks = (SELECT count(*) FROM chunks INDEXED BY chunks_by_trial WHERE chunks.trial = trials.id)
        + (SELECT count(*) FROM board_chunks INDEXED BY board_chunks_by_trial
            WHERE board_chunks.trial = trials.id),
    coalesce(CASE WHEN json_valid(about) THEN about ->> '$.board.emulated' END, 0)";

/// Reads rows; presets are looked up once per text.
#[derive(Default)]
struct RowReader {
    presets: BTreeMap<String, Option<&'static str>>,
}

impl RowReader {
    /// A row of [`ROWS`].
    fn read(&mut self, row: &Row<'_>) -> rusqlite::Result<TrialRow> {
        let read = self.read_intact(row).or_else(|_damage| TrialRow::unreadable(row))?;
        let matches = row.get_ref(18)? == ValueRef::Integer(of_row(row)?.into());
        let damaged = read.damaged || !matches || !row.get::<_, bool>(26)?;
        Ok(TrialRow { damaged, sound: read.sound && !damaged, ..read })
    }

    fn read_intact(&mut self, row: &Row<'_>) -> rusqlite::Result<TrialRow> {
        let unknown = |error: UnknownSource| rusqlite::Error::FromSqlConversionFailure(3, Type::Text, Box::new(error));
        let source: TrialSource = row.get::<_, String>(3)?.parse().map_err(unknown)?;
        let quality: Option<Quality> = serde_json::from_str(&row.get::<_, String>(7)?).ok();
        let mut warnings: Vec<String> = json_or_default(&row.get::<_, String>(8)?);
        let object: String = row.get(4)?;
        let mut flags = flaws(json_or_default(&row.get::<_, Option<String>>(16)?.unwrap_or_default()), Some(&object));
        if source == TrialSource::Imported {
            let interrupted = |remark| FlagRemark { flag: Flag::Interrupted, remark };
            flags.extend(std::mem::take(&mut warnings).into_iter().map(interrupted));
        }
        let duplicate_of = row.get::<_, Option<TrialId>>(23)?;
        flags.extend(duplicate_of.map(|first| FlagRemark {
            flag: Flag::Duplicate,
            remark: format!("the same grasp as trial {first}; a data set with both uses that one"),
        }));
        let origin: Option<GraspOrigin> =
            row.get::<_, Option<String>>(21)?.and_then(|origin| serde_json::from_str(&origin).ok());
        let pulled = origin.as_ref().is_some_and(|origin| origin.pulls != 0)
            || source == TrialSource::Simulated && warnings.iter().any(|warning| warning.contains(PULLED));
        Ok(TrialRow {
            id: row.get(0)?,
            created: row.get(1)?,
            damaged: row.get_ref(17)? == ValueRef::Null,
            local: row.get::<_, Option<String>>(17)?.unwrap_or_default(),
            state: row.get(2)?,
            source,
            emulated: row.get(27)?,
            seed: row.get::<_, i64>(5)?.cast_unsigned(),
            collection: row.get(10)?,
            preset: if source == TrialSource::Simulated { self.preset(row.get_ref("scene")?.as_str()?) } else { None },
            sensors: sensors(row.get::<_, Option<String>>(19)?.unwrap_or_default()),
            properties: row.get::<_, Option<String>>(11)?.zip(row.get(12)?),
            samples: row.get(6)?,
            sound: quality.is_some_and(|quality| quality.is_sound()),
            warnings: warnings.len(),
            note: row.get(13)?,
            tags: json_or_default(&row.get::<_, String>(14)?),
            unsure: row.get(15)?,
            flags,
            also_in: json_or_default(&row.get::<_, String>(20)?),
            physics: origin.map(|origin| origin.physics),
            identity: row.get(22)?,
            duplicate_of,
            follows: row.get(24)?,
            place: TrialPlace::of_column(row.get(25)?),
            pulled,
            deleted: row.get(9)?,
            object,
        })
    }

    /// Preset of a scene, from its table of poses.
    fn preset(&mut self, scene: &str) -> Option<&'static str> {
        let text = scene.find("[pose]").map_or(scene, |begin| &scene[begin..]);
        let table = text.find("\n[").map_or(text, |end| &text[..end]);
        if let Some(known) = self.presets.get(table) {
            return *known;
        }
        let poses = Scene::from_toml(table).ok().map(|scene| PoseSpread { between: Between::default(), ..scene.pose });
        let found = PRESETS.iter().find(|preset| Some(preset.poses()) == poses).map(|preset| preset.name);
        self.presets.insert(table.to_owned(), found);
        found
    }
}

/// Names of channels out of their JSON; parts are separated by spaces already.
fn sensors(text: String) -> String {
    match serde_json::from_str::<Vec<String>>(&text) {
        Ok(channels) => channels.join(" "),
        Err(_) => text,
    }
}

fn json_or_default<T: Default + serde::de::DeserializeOwned>(text: &str) -> T {
    serde_json::from_str(text).unwrap_or_default()
}

impl Store {
    /// All trials, oldest first; with or without deleted ones.
    pub fn list(&self, with_deleted: bool) -> Result<Vec<TrialRow>, StoreError> {
        self.rows("WHERE ?1 OR deleted IS NULL ORDER BY id", [with_deleted])
    }

    /// Rows that a condition in SQL chooses.
    pub(super) fn rows(&self, condition: &str, values: impl Params) -> Result<Vec<TrialRow>, StoreError> {
        let mut reader = RowReader::default();
        let columns = columns("trials");
        let sql = format!(
            "{ROWS}, {columns} FROM trials LEFT JOIN board_trials ON board_trials.trial = trials.id {condition}"
        );
        self.all(&sql, values, |row| reader.read(row))
    }
}
