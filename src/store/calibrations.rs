//! Calibrations in the store, and which part is mounted where.
//!
//! Versions count up within a part; a calibration is never changed. The newest calibration of a part serves all its
//! trials, older ones too, unless it was withdrawn or another one is asked for. Curves are fitted when they are needed:
//! a record that a later program refuses causes a warning, and the one before it serves.

use super::store::Store;
use super::store_error::StoreError;
use palpate_tactile::board::{Sensor, SensorList};
use palpate_tactile::calibration::{Calibration, Record, SensorKind};
use palpate_tactile::trial::TrialId;
use rusqlite::{Row, Transaction, params};
use serde::{Deserialize, Serialize};

/// Number of a calibration in its store.
pub type CalibrationId = i64;

/// A calibration in a store; also the JSON format in which calibrations are exchanged.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredCalibration {
    /// Number in this store.
    #[serde(default)]
    pub id: CalibrationId,
    /// Identity in every store.
    pub uid: String,
    /// Version within its part, from 1.
    #[serde(default)]
    pub version: i64,
    /// Time of creation, UTC.
    pub created: String,
    /// Time of withdrawal, UTC.
    #[serde(default)]
    pub withdrawn: Option<String>,
    /// Measured points.
    #[serde(flatten)]
    pub record: Record,
}

/// Calibrations that serve a trial, or the present recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Serving {
    /// A calibration for each place that has one, in the order of the gripper's sensors.
    pub calibrations: Vec<(Sensor, Calibration)>,
    /// Numbers of the calibrations, in the same order.
    pub ids: Vec<CalibrationId>,
    /// Missing and skipped calibrations, one sentence each.
    pub warnings: Vec<String>,
}

const COLUMNS: &str = "id, uid, version, created, withdrawn, record";

fn no_calibration(id: CalibrationId) -> StoreError {
    StoreError::Refused(format!("no calibration {id} in the store; `palpate calibrate list` shows all"))
}

/// A stored calibration; an error where its record cannot be read.
fn of_row(row: &Row<'_>) -> rusqlite::Result<Result<StoredCalibration, StoreError>> {
    let (id, uid, version) = (row.get(0)?, row.get(1)?, row.get(2)?);
    let (created, withdrawn) = (row.get(3)?, row.get(4)?);
    let record = serde_json::from_str(&row.get::<_, String>(5)?);
    Ok(match record {
        Ok(record) => Ok(StoredCalibration { id, uid, version, created, withdrawn, record }),
        Err(error) => Err(StoreError::Refused(format!(
            "calibration {id} is damaged: {error}. Withdraw it with `palpate calibrate withdraw {id}`"
        ))),
    })
}

/// Calibrations, mountings and tares of a store.
#[derive(Clone, Copy, Debug)]
pub struct CalibrationRepository<'a> {
    pub(super) store: &'a Store,
}

impl Store {
    /// Calibrations, mounted parts and tares.
    pub fn calibrations(&self) -> CalibrationRepository<'_> {
        CalibrationRepository { store: self }
    }
}

impl CalibrationRepository<'_> {
    /// Stores a record as the newest calibration of its part.
    pub fn add(&self, record: &Record) -> Result<StoredCalibration, StoreError> {
        self.get(self.store.in_transaction(|transaction| insert(transaction, record, None))?)
    }

    /// Imports calibrations of another store, all or none; known ones stay unchanged. Returns how many were added.
    pub fn import(&self, others: &[StoredCalibration]) -> Result<usize, StoreError> {
        self.store.in_transaction(|transaction| {
            let mut added = 0;
            for other in others {
                let known = "SELECT EXISTS (SELECT 1 FROM calibrations WHERE uid = ?1)";
                if !transaction.query_row(known, [&other.uid], |row| row.get::<_, bool>(0))? {
                    insert(transaction, &other.record, Some(other))?;
                    added += 1;
                }
            }
            Ok(added)
        })
    }

    /// One calibration.
    pub fn get(&self, id: CalibrationId) -> Result<StoredCalibration, StoreError> {
        let sql = format!("SELECT {COLUMNS} FROM calibrations WHERE id = ?1");
        self.store.first(&sql, [id], of_row)?.unwrap_or_else(|| Err(no_calibration(id)))
    }

    /// All calibrations, or those of one part, oldest first.
    pub fn list(&self, part: Option<&str>) -> Result<Vec<StoredCalibration>, StoreError> {
        let sql = format!("SELECT {COLUMNS} FROM calibrations WHERE ?1 IS NULL OR part = ?1 ORDER BY created, id");
        self.store.all::<_, Vec<_>>(&sql, [part], of_row)?.into_iter().collect()
    }

    /// Withdraws a calibration, so that it serves only where it is asked for, or restores it.
    pub fn withdraw(&self, id: CalibrationId, withdrawn: bool) -> Result<(), StoreError> {
        let sql = "UPDATE calibrations SET withdrawn =
                   CASE WHEN ?2 THEN strftime('%Y-%m-%dT%H:%M:%fZ', 'now') ELSE NULL END WHERE id = ?1";
        let changed = self.store.in_transaction(|transaction| transaction.execute(sql, params![id, withdrawn]))?;
        if changed == 0 { Err(no_calibration(id)) } else { Ok(()) }
    }

    /// Mounts a part in a place from now on.
    pub fn mount(&self, sensor: Sensor, part: &str) -> Result<(), StoreError> {
        let sql = "INSERT INTO mountings (sensor, part) VALUES (?1, ?2)";
        let values = params![sensor.channel(), part.trim()];
        self.store.in_transaction(|transaction| transaction.execute(sql, values)).map(drop)
    }

    /// The part mounted in each place, in the order of the gripper's sensors.
    pub fn mounted(&self) -> Result<Vec<Option<String>>, StoreError> {
        self.mounted_at(self.sensors()?, None)
    }

    /// The part mounted in each place at a time; before its first mounting, the first part.
    fn mounted_at(&self, sensors: SensorList, at: Option<&str>) -> Result<Vec<Option<String>>, StoreError> {
        sensors.iter().map(|sensor| self.part_at(sensor, at)).collect()
    }

    /// The part mounted in a place now.
    pub fn part_in(&self, sensor: Sensor) -> Result<Option<String>, StoreError> {
        self.part_at(sensor, None)
    }

    fn part_at(&self, sensor: Sensor, at: Option<&str>) -> Result<Option<String>, StoreError> {
        let sql = "SELECT part FROM mountings WHERE sensor = ?1
                   ORDER BY ?2 IS NULL OR since <= ?2 DESC, CASE WHEN ?2 IS NULL OR since <= ?2 THEN -id ELSE id END LIMIT 1";
        self.store.first(sql, params![sensor.channel(), at], |row| row.get(0))
    }

    /// Sensors of the gripper that a trial was recorded with.
    fn sensors_of(&self, trial: TrialId) -> Result<SensorList, StoreError> {
        match self.store.board_info(trial)? {
            Some(info) => Ok(info.course.board.sensors),
            None => self.sensors(),
        }
    }

    /// Stores which parts a trial is recorded with: those mounted now. To be called when it begins.
    pub(super) fn note_parts(&self, trial: TrialId) -> Result<(), StoreError> {
        let (sensors, parts) = (self.sensors()?, self.mounted()?);
        let sql = "INSERT OR REPLACE INTO parts (trial, sensor, part) VALUES (?1, ?2, ?3)";
        let mut known = sensors.iter().zip(parts).filter_map(|(sensor, part)| Some((sensor, part?)));
        self.store.in_transaction(|transaction| {
            known.try_for_each(|(sensor, part)| {
                transaction.execute(sql, params![trial, sensor.channel(), part]).map(drop)
            })
        })
    }

    /// The parts a trial was recorded with; where none are stored, those mounted at its time.
    pub fn parts_of(&self, trial: TrialId) -> Result<Vec<Option<String>>, StoreError> {
        let created: Option<String> =
            self.store.first("SELECT created FROM trials WHERE id = ?1", [trial], |row| row.get(0))?;
        let sensors = self.sensors_of(trial)?;
        let mut parts = self.mounted_at(sensors, created.as_deref())?;
        for (part, sensor) in parts.iter_mut().zip(sensors.iter()) {
            let sql = "SELECT part FROM parts WHERE trial = ?1 AND sensor = ?2";
            let noted = self.store.first(sql, params![trial, sensor.channel()], |row| row.get(0))?;
            *part = noted.or(part.take());
        }
        Ok(parts)
    }

    /// Calibrations that serve a trial, or the present recording: of each part the newest that is not withdrawn, or the one
    /// asked for by its number.
    pub fn serving(&self, trial: Option<TrialId>, asked: &[CalibrationId]) -> Result<Serving, StoreError> {
        let (sensors, parts) = match trial {
            Some(trial) => (self.sensors_of(trial)?, self.parts_of(trial)?),
            None => (self.sensors()?, self.mounted()?),
        };
        let asked = asked.iter().map(|id| self.get(*id)).collect::<Result<Vec<_>, _>>()?;
        let mut serving = Serving::default();
        let calibrated = sensors.iter().zip(parts).filter(|(sensor, _)| sensor.kind() != SensorKind::Raw);
        for (sensor, part) in calibrated {
            let Some(part) = part else {
                let (place, channel) = (sensor.label(), sensor.channel());
                let text = format!("no part is mounted as the {place}: `palpate calibrate mount {channel} NAME`");
                serving.warnings.push(text);
                continue;
            };
            let fits = |c: &&StoredCalibration| c.record.kind == sensor.kind() && c.record.part == part;
            let wanted: Vec<StoredCalibration> = match asked.iter().find(fits) {
                Some(one) => vec![one.clone()],
                None => {
                    let all = self.list(Some(&part))?.into_iter().rev();
                    all.filter(|c| c.withdrawn.is_none() && fits(&c)).collect()
                }
            };
            serving.take_first_sound(sensor, &part, wanted);
        }
        Ok(serving)
    }
}

impl Serving {
    fn take_first_sound(&mut self, sensor: Sensor, part: &str, wanted: Vec<StoredCalibration>) {
        let mut wanted = wanted.into_iter();
        while let Some(stored) = wanted.next() {
            match Calibration::fit(stored.record) {
                Ok(calibration) => {
                    let has_bending = |older: &StoredCalibration| older.record.bending.is_some();
                    if calibration.record.bending.is_none()
                        && let Some(older) = wanted.find(has_bending)
                    {
                        let (id, channel) = (stored.id, sensor.channel());
                        self.warnings.push(format!(
                            "calibration {id} (\"{part}\", version {}) has no bending correction, unlike version {}: \
                             measure it with `palpate calibrate {channel} --part \"{part}\" --empty-close 5`",
                            stored.version, older.version
                        ));
                    }
                    self.calibrations.push((sensor, calibration));
                    self.ids.push(stored.id);
                    return;
                }
                Err(cause) => {
                    let (id, version) = (stored.id, stored.version);
                    self.warnings.push(format!("calibration {id} (\"{part}\", version {version}) is skipped: {cause}"));
                }
            }
        }
        let (place, channel) = (sensor.label(), sensor.channel());
        self.warnings.push(format!(
            "the {place}, \"{part}\", has no calibration: run `palpate calibrate {channel} --part \"{part}\"`"
        ));
    }
}

/// Adds a record as the newest version of its part; an imported one keeps its identity and date.
fn insert(
    transaction: &Transaction<'_>,
    record: &Record,
    imported: Option<&StoredCalibration>,
) -> rusqlite::Result<CalibrationId> {
    let text = serde_json::to_string(record).map_err(|e| rusqlite::Error::ToSqlConversionFailure(Box::new(e)))?;
    transaction.execute(
        "INSERT INTO calibrations (part, version, record, uid, created, withdrawn)
         VALUES (?1, (SELECT coalesce(max(version), 0) + 1 FROM calibrations WHERE part = ?1), ?2,
            coalesce(?3, lower(hex(randomblob(16)))), coalesce(?4, strftime('%Y-%m-%dT%H:%M:%fZ', 'now')), ?5)",
        params![
            record.part,
            text,
            imported.map(|other| &other.uid),
            imported.map(|other| &other.created),
            imported.and_then(|other| other.withdrawn.as_ref()),
        ],
    )?;
    Ok(transaction.last_insert_rowid())
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use palpate_tactile::board::{Board, Reading};
    use palpate_tactile::calibration::{Input, Point, Readout};

    /// A strip's record with some resistance flat, twice that at a right angle.
    pub(crate) fn strip(part: &str, flat_ohm: f64) -> Record {
        let input = Input::on(&Board::default(), Sensor::FLEX_LEFT);
        let point = |degrees: f64| Point {
            stimulus: degrees.to_radians(),
            counts: input.counts(flat_ohm * (1.0 + degrees / 90.0)),
            spread: 1.0,
            readings: 50,
        };
        let points = [0.0, 45.0, 90.0].map(point).to_vec();
        Record {
            part: part.to_owned(),
            kind: SensorKind::Flex,
            input,
            points,
            bending: None,
            assumed: false,
            note: String::new(),
        }
    }

    fn store(folder: &tempfile::TempDir, name: &str) -> Store {
        Store::open(&folder.path().join(name)).expect("opens")
    }

    fn folder() -> tempfile::TempDir {
        tempfile::tempdir().expect("a temporary folder")
    }

    #[test]
    fn versions_count_up_within_a_part_and_survive_an_exchange() -> Result<(), Box<dyn std::error::Error>> {
        let folder = folder();
        let here = store(&folder, "here");
        let versions =
            [("A", 20e3), ("B", 25e3), ("A", 21e3)].map(|(part, flat)| here.calibrations().add(&strip(part, flat)));
        let versions: Vec<i64> =
            versions.into_iter().map(|stored| stored.map(|s| s.version)).collect::<Result<_, _>>()?;
        assert_eq!(versions, [1, 1, 2]);
        here.calibrations().withdraw(1, true)?;
        let text = serde_json::to_string(&here.calibrations().list(None)?)?;
        let there = store(&folder, "there");
        there.calibrations().add(&strip("A", 30e3))?;
        let others: Vec<StoredCalibration> = serde_json::from_str(&text)?;
        assert_eq!((there.calibrations().import(&others)?, there.calibrations().import(&others)?), (3, 0));
        let of_a = there.calibrations().list(Some("A"))?;
        assert_eq!(of_a.len(), 3);
        // Older ones come first, whatever their version here.
        assert_eq!(of_a[0].record, strip("A", 20e3));
        assert!(of_a[0].withdrawn.is_some() && of_a[0].version == 2 && of_a[2].version == 1);
        assert!(
            there.calibrations().withdraw(99, true).is_err_and(|error| error.to_string().contains("no calibration 99"))
        );
        Ok(())
    }

    #[test]
    fn parts_get_swapped_and_trials_know_theirs() -> Result<(), Box<dyn std::error::Error>> {
        let folder = folder();
        let mut store = store(&folder, "s");
        assert_eq!(store.calibrations().mounted()?, vec![None; 4]);
        let begun = crate::test_trials::without_frames("empty");
        let untold = store.insert(&begun)?.id();
        // Times are stored to the millisecond.
        std::thread::sleep(std::time::Duration::from_millis(3));
        store.calibrations().mount(Sensor::FLEX_LEFT, "A")?;
        let first = store.insert(&begun)?.id();
        store.calibrations().note_parts(first)?;
        store.calibrations().mount(Sensor::FLEX_LEFT, "B")?;
        let second = store.insert(&begun)?.id();
        store.calibrations().note_parts(second)?;
        let left = |trial| store.calibrations().parts_of(trial).map(|parts| parts[0].clone());
        assert_eq!((left(first)?.as_deref(), left(second)?.as_deref()), (Some("A"), Some("B")));
        assert_eq!(left(untold)?.as_deref(), Some("A"), "the first that is known");
        assert_eq!(store.calibrations().mounted()?[0].as_deref(), Some("B"));
        Ok(())
    }

    #[test]
    fn the_newest_sound_calibration_serves_old_trials_too() -> Result<(), Box<dyn std::error::Error>> {
        let folder = folder();
        let mut store = store(&folder, "s");
        store.calibrations().mount(Sensor::FLEX_LEFT, "A")?;
        let begun = crate::test_trials::without_frames("empty");
        let trial = store.insert(&begun)?.id();
        store.calibrations().note_parts(trial)?;
        assert!(store.calibrations().serving(Some(trial), &[])?.warnings[0].contains("has no calibration"));
        let reading = {
            let counts = strip("A", 24e3).input.counts(36e3) as f32;
            Reading { t_s: 0.0, arrived_s: 0.0, seq: None, counts: vec![Some(counts); 4], line_bar: None }
        };
        let degrees = |store: &Store, asked: &[CalibrationId]| -> Result<f64, Box<dyn std::error::Error>> {
            let serving = store.calibrations().serving(Some(trial), asked)?;
            let estimate = Readout::new(&Board::default(), &serving.calibrations)?.estimate(&reading);
            Ok(estimate.value(Sensor::FLEX_LEFT).ok_or("calibrated")?.to_degrees())
        };
        // 36 kΩ are a right angle of a strip of 18, and 45 degrees of one of 24.
        let old = store.calibrations().add(&strip("A", 18e3))?.id;
        assert!((degrees(&store, &[])? - 90.0).abs() < 1e-2);
        let new = store.calibrations().add(&strip("A", 24e3))?.id;
        assert!((degrees(&store, &[])? - 45.0).abs() < 1e-2);
        assert!((degrees(&store, &[old])? - 90.0).abs() < 1e-2);
        store.calibrations().withdraw(new, true)?;
        assert!((degrees(&store, &[])? - 90.0).abs() < 1e-2);
        store.calibrations().withdraw(new, false)?;
        // One that no program of today would make is skipped with a warning.
        store.calibrations().add(&strip("A", 90e3))?;
        let serving = store.calibrations().serving(Some(trial), &[])?;
        assert_eq!(serving.ids, [new]);
        assert!(serving.warnings.iter().any(|w| w.contains("is skipped") && w.contains("90.0 kΩ")), "{serving:?}");
        Ok(())
    }
}
