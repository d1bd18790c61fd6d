//! Tares in the store: what each part showed while its finger was at rest, whenever somebody asked.
//!
//! A tare is measured through a calibration and means nothing through another, so that each names the one it was taken
//! with: a newer calibration ends it, and where that is withdrawn it serves again. Rows are only ever added.

use super::store::Store;
use super::store_error::{StoreError, fault};
use palpate_tactile::board::Sensor;
use palpate_tactile::calibration::Zero;
use rusqlite::{OptionalExtension, params};
use serde::Serialize;

/// The table, and what keeps it as it is. `calibration` is a uid, `zero` an angle (rad) or a conductance (S).
pub(super) const TARE_TABLES: &str = "
    CREATE TABLE tares (
        id INTEGER PRIMARY KEY AUTOINCREMENT,
        uid TEXT NOT NULL UNIQUE DEFAULT (lower(hex(randomblob(16)))),
        taken TEXT NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ', 'now')),
        part TEXT NOT NULL,
        version INTEGER NOT NULL,
        calibration TEXT NOT NULL,
        zero REAL NOT NULL
    );
    CREATE INDEX tares_by_part ON tares (part, calibration);
    CREATE TRIGGER tares_are_not_altered BEFORE UPDATE ON tares
    BEGIN SELECT raise(ABORT, 'tares are only added to'); END;
    CREATE TRIGGER tares_are_not_shortened BEFORE DELETE ON tares
    BEGIN SELECT raise(ABORT, 'tares are only added to'); END;
";

/// The tare of one part.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PartTare {
    /// Where the part sits.
    pub sensor: Sensor,
    /// Its name.
    pub part: String,
    /// Which of its part's tares it is, from 1.
    pub version: i64,
    /// When it was taken, UTC.
    pub taken: String,
}

/// The zero that serves now, and where it comes from.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct StoredTare {
    /// To be subtracted, by [`palpate_tactile::calibration::Readout::with_zero`].
    pub zero: Zero,
    /// One for each sensor that has one, in the order of [`Sensor::ALL`].
    pub parts: Vec<PartTare>,
}

impl Store {
    /// Stores what the mounted parts show at rest through the calibrations that serve now. It serves until a newer tare or
    /// calibration of the part. Sensors that have no calibration, or of which the zero says nothing, are left out.
    pub fn add_tare(&mut self, zero: &Zero) -> Result<StoredTare, StoreError> {
        let serving = self.serving(None, &[])?;
        let path = self.path().to_owned();
        let fault = |e: rusqlite::Error| fault(&path, &e);
        let transaction = self.write()?;
        for ((sensor, calibration), id) in serving.calibrations.iter().zip(&serving.ids) {
            let Some(offset) = zero.offsets[*sensor as usize].filter(|offset| offset.is_finite()) else { continue };
            let sql = "INSERT INTO tares (part, version, calibration, zero)
                       SELECT ?1, (SELECT coalesce(max(version), 0) + 1 FROM tares WHERE part = ?1), uid, ?3
                       FROM calibrations WHERE id = ?2";
            transaction.execute(sql, params![calibration.record.part, id, offset]).map_err(fault)?;
        }
        transaction.commit().map_err(fault)?;
        Ok(self.tare()?.unwrap_or_default())
    }

    /// The newest tares that serve the mounted parts with their calibrations of now; none where there are none.
    pub fn tare(&self) -> Result<Option<StoredTare>, StoreError> {
        let serving = self.serving(None, &[])?;
        let mut tare = StoredTare::default();
        for ((sensor, calibration), id) in serving.calibrations.iter().zip(&serving.ids) {
            let part = &calibration.record.part;
            let sql = "SELECT zero, version, taken FROM tares WHERE part = ?1
                       AND calibration = (SELECT uid FROM calibrations WHERE id = ?2) ORDER BY id DESC LIMIT 1";
            let row = |row: &rusqlite::Row<'_>| Ok((row.get(0)?, row.get(1)?, row.get(2)?));
            let found = self.connection.query_row(sql, params![part, id], row).optional();
            let Some((offset, version, taken)) = found.map_err(|e| fault(self.path(), &e))? else { continue };
            tare.zero.offsets[*sensor as usize] = Some(offset);
            tare.parts.push(PartTare { sensor: *sensor, part: part.clone(), version, taken });
        }
        Ok((!tare.parts.is_empty()).then_some(tare))
    }
}

#[cfg(test)]
mod tests {
    use super::super::calibrations::tests::strip;
    use super::*;

    #[test]
    fn a_tare_serves_its_part_until_a_newer_calibration() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let mut store = Store::open(&folder.path().join("s"))?;
        assert_eq!(store.tare()?, None);
        for (sensor, part) in [(Sensor::FlexLeft, "A"), (Sensor::FlexRight, "B")] {
            store.add_calibration(&strip(part, 24e3))?;
            store.mount_part(sensor, part)?;
        }
        // The pads have no calibration, and of B nothing is known.
        let zero = |left| Zero { offsets: [Some(left), None, Some(1.0), None] };
        store.add_tare(&zero(0.01))?;
        let tare = store.add_tare(&zero(0.02))?;
        assert_eq!(tare.zero.offsets, [Some(0.02), None, None, None]);
        assert_eq!((tare.parts.len(), tare.parts[0].version, tare.parts[0].part.as_str()), (1, 2, "A"));
        assert_eq!(store.tare()?.as_ref(), Some(&tare));
        // The part moves to the other finger, and its zero with it.
        store.mount_part(Sensor::FlexRight, "A")?;
        store.mount_part(Sensor::FlexLeft, "B")?;
        assert_eq!(store.tare()?.map(|tare| tare.zero.offsets), Some([None, Some(0.02), None, None]));
        let newer = store.add_calibration(&strip("A", 25e3))?.id;
        assert_eq!(store.tare()?, None);
        store.withdraw_calibration(newer, true)?;
        assert_eq!(store.tare()?.map(|tare| tare.zero.offsets[1]), Some(Some(0.02)));
        assert!(store.connection.execute("DELETE FROM tares", []).is_err(), "only added to");
        Ok(())
    }
}
