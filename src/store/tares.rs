//! Tares in the store: the zero of each part, measured while its finger was at rest.
//!
//! A tare is measured through a calibration and is valid only with that one: a newer calibration ends it, and where that is
//! withdrawn it serves again. Rows are only ever added.

use super::calibrations::CalibrationRepository;
use super::store_error::StoreError;
use palpate_tactile::board::Sensor;
use palpate_tactile::calibration::Zero;
use rusqlite::params;
use serde::Serialize;

/// Tare of one part.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PartTare {
    /// Place of the part.
    pub sensor: Sensor,
    /// Name of the part.
    pub part: String,
    /// Version within its part, from 1.
    pub version: i64,
    /// Time of the measurement, UTC.
    pub taken: String,
}

/// The present zero and its origin.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct StoredTare {
    /// To be subtracted, by [`palpate_tactile::calibration::Readout::with_zero`].
    pub zero: Zero,
    /// Tare of each sensor that has one, in the order of the gripper's sensors.
    pub parts: Vec<PartTare>,
}

impl CalibrationRepository<'_> {
    /// Stores the zeros of the mounted parts, measured through the calibrations that serve now. A zero is valid until a
    /// newer tare or calibration of the part. Leaves out sensors without a calibration or a zero.
    pub fn add_tare(&self, zero: &Zero) -> Result<StoredTare, StoreError> {
        let serving = self.serving(None, &[])?;
        let sql = "INSERT INTO tares (part, version, calibration, zero)
                   SELECT ?1, (SELECT coalesce(max(version), 0) + 1 FROM tares WHERE part = ?1), uid, ?3
                   FROM calibrations WHERE id = ?2";
        self.store.in_transaction(|transaction| {
            for ((sensor, calibration), id) in serving.calibrations.iter().zip(&serving.ids) {
                let Some(offset) = zero.of(*sensor).filter(|offset| offset.is_finite()) else { continue };
                transaction.execute(sql, params![calibration.record.part, id, offset])?;
            }
            Ok(())
        })?;
        Ok(self.tare()?.unwrap_or_default())
    }

    /// When each tare was taken, in the format of [`TrialRow::created`](crate::TrialRow::created), rising.
    pub fn tare_times(&self) -> Result<Vec<String>, StoreError> {
        self.store.all("SELECT DISTINCT taken FROM tares ORDER BY taken", [], |row| row.get(0))
    }

    /// The newest tares of the mounted parts with their present calibrations, if any.
    pub fn tare(&self) -> Result<Option<StoredTare>, StoreError> {
        let serving = self.serving(None, &[])?;
        let mut tare = StoredTare::default();
        for ((sensor, calibration), id) in serving.calibrations.iter().zip(&serving.ids) {
            let part = &calibration.record.part;
            let sql = "SELECT zero, version, taken FROM tares WHERE part = ?1
                       AND calibration = (SELECT uid FROM calibrations WHERE id = ?2) ORDER BY id DESC LIMIT 1";
            let row = |row: &rusqlite::Row<'_>| Ok((row.get(0)?, row.get(1)?, row.get(2)?));
            let Some((offset, version, taken)) = self.store.first(sql, params![part, id], row)? else { continue };
            tare.zero.set(*sensor, Some(offset));
            tare.parts.push(PartTare { sensor: *sensor, part: part.clone(), version, taken });
        }
        Ok((!tare.parts.is_empty()).then_some(tare))
    }
}

#[cfg(test)]
mod tests {
    use super::super::calibrations::tests::strip;
    use super::*;
    use crate::store::Store;

    #[test]
    fn a_tare_serves_its_part_until_a_newer_calibration() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let store = Store::open(&folder.path().join("s"))?;
        assert_eq!(store.calibrations().tare()?, None);
        for (sensor, part) in [(Sensor::FLEX_LEFT, "A"), (Sensor::FLEX_RIGHT, "B")] {
            store.calibrations().add(&strip(part, 24e3))?;
            store.calibrations().mount(sensor, part)?;
        }
        // The pads have no calibration, and of B nothing is known.
        let zero = |left| Zero { offsets: vec![Some(left), None, Some(1.0), None] };
        store.calibrations().add_tare(&zero(0.01))?;
        let tare = store.calibrations().add_tare(&zero(0.02))?;
        assert_eq!(tare.zero.offsets, [Some(0.02)]);
        let times = store.calibrations().tare_times()?;
        assert!(times.is_sorted() && times.contains(&tare.parts[0].taken), "{times:?}");
        assert_eq!((tare.parts.len(), tare.parts[0].version, tare.parts[0].part.as_str()), (1, 2, "A"));
        assert_eq!(store.calibrations().tare()?.as_ref(), Some(&tare));
        // The part moves to the other finger, and its zero with it.
        store.calibrations().mount(Sensor::FLEX_RIGHT, "A")?;
        store.calibrations().mount(Sensor::FLEX_LEFT, "B")?;
        assert_eq!(store.calibrations().tare()?.map(|tare| tare.zero.offsets), Some(vec![None, Some(0.02)]));
        let newer = store.calibrations().add(&strip("A", 25e3))?.id;
        assert_eq!(store.calibrations().tare()?, None);
        store.calibrations().withdraw(newer, true)?;
        assert_eq!(store.calibrations().tare()?.map(|tare| tare.zero.offsets[1]), Some(Some(0.02)));
        assert!(store.connection.execute("DELETE FROM tares", []).is_err(), "only added to");
        Ok(())
    }
}
