//! Imported trials: recorded elsewhere, channels only, without frames.
//!
//! ```text
//! magic "PPS1"       4 bytes
//! samples            u32
//! channels           u32
//! per sample:        f64 time (s), then f32 per channel, little-endian
//! ```

use super::chunks::all_there;
use super::store::{Store, json};
use super::store_error::{StoreError, row_fault};
use palpate_tactile::trial::{TrialId, TrialSource};
use palpate_tactile::{SignalGap, Signals};
use rusqlite::{OptionalExtension, params};

/// One recorded grasp from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedTrial {
    /// Name in the file.
    pub name: String,
    /// Label in the file.
    pub label: String,
    /// Size of the object, where the file states it for the label: `tiny` or `large`.
    pub size: Option<String>,
    /// Shape of the object, where the file states it for the label: `cubic`, `cylindrical` or `spherical`.
    pub shape: Option<String>,
    /// Session in the file, which becomes a collection of its own.
    pub session: Option<String>,
    /// Readings: at least two samples, times as in the file or even from its first one on; NaN where there are none.
    pub signals: Signals,
}

/// Trials that begin later than this count their time from a clock of their own (s).
const LATE_S: f64 = 0.5;

const MAGIC: &[u8; 4] = b"PPS1";
const HEADER: usize = 12;

fn encode(signals: &Signals) -> Vec<u8> {
    let mut out = Vec::with_capacity(HEADER + signals.len() * 8 + signals.values.len() * 4);
    out.extend_from_slice(MAGIC);
    out.extend_from_slice(&(signals.len() as u32).to_le_bytes());
    out.extend_from_slice(&(signals.channels.len() as u32).to_le_bytes());
    for sample in 0..signals.len() {
        out.extend_from_slice(&signals.t_s[sample].to_le_bytes());
        for value in signals.row(sample) {
            out.extend_from_slice(&value.to_le_bytes());
        }
    }
    out
}

fn decode(bytes: &[u8], channels: Vec<String>) -> Option<Signals> {
    let (header, rest) = bytes.split_at_checked(HEADER)?;
    let number = |at: usize| Some(u32::from_le_bytes(header.get(at..at + 4)?.try_into().ok()?) as usize);
    let row = 8 + 4 * channels.len();
    if !header.starts_with(MAGIC) || number(8)? != channels.len() || rest.len() != number(4)?.checked_mul(row)? {
        return None;
    }
    let mut signals = Signals { channels, ..Signals::default() };
    for sample in rest.chunks_exact(row) {
        let (t, values) = sample.split_at(8);
        signals.t_s.push(f64::from_le_bytes(t.try_into().ok()?));
        signals.values.extend(values.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)));
    }
    let sound = !signals.values.iter().any(|x| x.is_infinite()) && signals.t_s.is_sorted_by(|a, b| a < b);
    sound.then_some(signals)
}

/// Gaps of a trial, a sentence each.
pub fn interruptions(signals: &Signals) -> Vec<String> {
    let sentence = |gap: SignalGap| {
        let of = if gap.channels.len() == signals.channels.len() {
            String::new()
        } else {
            let names: Vec<&str> = gap.channels.iter().map(|channel| signals.channels[*channel].as_str()).collect();
            format!(" of {}", names.join(", "))
        };
        let SignalGap { samples, from_s, to_s, .. } = gap;
        format!("no readings{of} from {from_s:.2} s to {to_s:.2} s ({} missing)", samples.len())
    };
    signals.gaps().into_iter().map(sentence).collect()
}

impl Store {
    /// Stores imported trials as a collection, all or none; trials that the collection has already stay unchanged. Returns
    /// how many were added.
    pub fn insert_imported(&mut self, collection: &str, trials: &[ImportedTrial]) -> Result<u32, StoreError> {
        let new = "INSERT OR IGNORE INTO trials (state, rig, object, seed, scene, world_from_gripper, quality,
                warnings, version, samples, collection, size, shape)
            VALUES ('complete', ?10, ?1, ?2, '', ?3, ?4, ?11, ?5, ?6, ?7, ?8, ?9)";
        let sql = "INSERT INTO readings (trial, channels, samples, checksum)
            SELECT id, ?2, ?3, checksum(uid, ?2, ?3) FROM trials WHERE id = ?1";
        self.in_transaction(|transaction| {
            let mut added = 0;
            for (number, trial) in trials.iter().enumerate() {
                let session = trial.session.as_ref().map(|session| format!("{collection} {session}"));
                let values = params![
                    trial.label,
                    number as i64 + 1,
                    json(&palpate_geometry::Pose::IDENTITY),
                    json(&palpate_sim::frame::Quality::default()),
                    env!("CARGO_PKG_VERSION"),
                    trial.signals.len() as i64,
                    session.as_deref().unwrap_or(collection),
                    trial.size,
                    trial.shape,
                    TrialSource::Imported.name(),
                    json(&interruptions(&trial.signals)),
                ];
                if transaction.execute(new, values)? > 0 {
                    let (id, signals) = (transaction.last_insert_rowid(), &trial.signals);
                    transaction.execute(sql, params![id, json(&signals.channels), encode(signals)])?;
                    added += 1;
                }
            }
            Ok(added)
        })
    }

    /// Channels of an imported trial, NaN in its gaps; none for a trial of another kind.
    pub fn readings(&self, id: TrialId) -> Result<Option<Signals>, StoreError> {
        let sql = "SELECT channels, readings.samples, checksum(uid, channels, readings.samples) IS readings.checksum,
                   trials.samples FROM readings JOIN trials ON trials.id = trial WHERE trial = ?1";
        let found: Option<(Vec<u8>, Vec<u8>, bool, i64)> = self
            .connection
            .query_row(sql, [id], |row| {
                Ok((row.get_ref(0)?.as_bytes()?.to_vec(), row.get(1)?, row.get(2)?, row.get(3)?))
            })
            .optional()
            .map_err(|e| row_fault(self.path(), id, &e))?;
        let Some((channels, samples, intact, count)) = found else { return Ok(None) };
        if !intact {
            return Err(StoreError::checksum(id, "channels", 0));
        }
        let bad = |cause: String| StoreError::bad_info(id, cause);
        let channels = serde_json::from_slice(&channels).map_err(|e| bad(e.to_string()))?;
        let signals = decode(&samples, channels).ok_or_else(|| bad("its readings are cut short".to_owned()))?;
        all_there(id, "samples", signals.len(), count)?;
        // A rest before a known closing has negative times.
        let late = signals.t_s.first().copied().filter(|first| *first > LATE_S);
        Ok(Some(match late {
            Some(first) => signals.since(first),
            None => signals,
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::{Flag, FlagRemark};
    use palpate_tactile::trial::TrialData;

    fn imported(label: &str) -> ImportedTrial {
        let signals = Signals {
            channels: vec!["grip".to_owned(), "bend".to_owned()],
            t_s: vec![0.0, 0.02, 0.04],
            values: vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.5],
        };
        let (size, shape) = (Some("tiny".to_owned()), Some("cubic".to_owned()));
        ImportedTrial { name: "first".to_owned(), label: label.to_owned(), size, shape, session: None, signals }
    }

    #[test]
    fn readings_survive_storing_merging_and_a_second_import() -> Result<(), StoreError> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (here, there) = (folder.path().join("here"), folder.path().join("there"));
        let mut store = Store::open(&here)?;
        let trials = [imported("mug"), imported("key")];
        assert_eq!(store.insert_imported("mine", &trials)?, 2);
        assert_eq!(store.insert_imported("mine", &trials)?, 0, "twice is once");
        let rows = store.list(false)?;
        assert_eq!((rows[0].object.as_str(), rows[0].source, rows[0].samples), ("mug", TrialSource::Imported, 3));
        assert_eq!(rows[0].properties, Some(("tiny".to_owned(), "cubic".to_owned())));
        let mut other = Store::open(&there)?;
        other.merge_from(&here)?;
        let id = other.list(false)?[1].id;
        assert_eq!(other.readings(id)?, Some(trials[1].signals.clone()));
        assert_eq!(other.readings(99)?, None);
        Ok(())
    }

    #[test]
    fn gaps_are_kept_and_flagged_and_bridged_where_a_trial_is_computed_with() -> Result<(), StoreError> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut store = Store::open(&folder.path().join("trials.sqlite"))?;
        let mut trial = imported("mug");
        trial.signals.values[3] = f32::NAN;
        store.insert_imported("mine", std::slice::from_ref(&trial))?;
        let row = &store.list(false)?[0];
        let wanted = FlagRemark {
            flag: Flag::Interrupted,
            remark: "no readings of bend from 0.00 s to 0.04 s (1 missing)".to_owned(),
        };
        assert_eq!((&row.flags[..], row.warnings), (&[wanted][..], 0));
        assert!(store.readings(row.id)?.expect("imported").values[3].is_nan());
        let TrialData::Imported(signals) = store.load(row.id)?.data else { panic!("imported") };
        assert_eq!(signals.values[3], 4.25);
        Ok(())
    }

    #[test]
    fn damaged_readings_are_refused() {
        let bytes = encode(&imported("mug").signals);
        let channels = || vec!["grip".to_owned(), "bend".to_owned()];
        assert!(decode(&bytes, channels()).is_some());
        for cut in 0..bytes.len() {
            assert!(decode(&bytes[..cut], channels()).is_none());
        }
        assert!(decode(&bytes, vec!["grip".to_owned()]).is_none());
        let mut infinite = bytes.clone();
        infinite[HEADER + 8..HEADER + 12].copy_from_slice(&f32::INFINITY.to_le_bytes());
        assert!(decode(&infinite, channels()).is_none());
    }
}
