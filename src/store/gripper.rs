//! The gripper of a store: the sensors that its boards carry. The table is made with the first gripper file that is
//! remembered; without one a store is of the paper's gripper, as all were before.

use super::calibrations::CalibrationRepository;
use super::store_error::StoreError;
use palpate_tactile::board::SensorList;
use rusqlite::params;

impl CalibrationRepository<'_> {
    /// Sensors of the gripper: those of the file that was remembered last, else the paper's.
    pub fn sensors(&self) -> Result<SensorList, StoreError> {
        let made = "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = 'grippers'";
        if self.store.first(made, [], |_row| Ok(()))?.is_none() {
            return Ok(SensorList::default());
        }
        let newest = "SELECT sensors FROM grippers ORDER BY id DESC LIMIT 1";
        let text: Option<String> = self.store.first(newest, [], |row| row.get(0))?;
        let read = text.map(|text| serde_json::from_str(&text)).transpose();
        let read = read.map_err(|error| {
            StoreError::Refused(format!(
                "the store's gripper is damaged: {error}. Set it again with --gripper FILE.toml"
            ))
        })?;
        Ok(read.unwrap_or_default())
    }

    /// Remembers the sensors of the gripper, and mounts the parts that its file names.
    pub fn set_sensors(&self, sensors: SensorList) -> Result<(), StoreError> {
        if self.sensors().ok() != Some(sensors) {
            self.store.in_transaction(|transaction| {
                transaction.execute_batch(
                    "CREATE TABLE IF NOT EXISTS grippers (
                        id INTEGER PRIMARY KEY AUTOINCREMENT,
                        since TEXT NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ', 'now')),
                        sensors TEXT NOT NULL  -- JSON
                    );",
                )?;
                transaction.execute("INSERT INTO grippers (sensors) VALUES (?1)", params![super::store::json(&sensors)])
            })?;
        }
        for sensor in sensors.iter() {
            let Some(part) = sensor.row().part.as_deref() else { continue };
            if self.part_in(sensor)?.as_deref() != Some(part) {
                self.mount(sensor, part)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use crate::Store;
    use palpate_tactile::board::SensorList;

    #[test]
    fn a_store_remembers_its_gripper_and_old_ones_are_the_papers() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let store = Store::open(&folder.path().join("s"))?;
        assert_eq!(store.calibrations().sensors()?, SensorList::default());
        let text = "[[sensor]]\nname = \"flexL\"\nfinger = \"left\"\nkind = \"flex\"\npart = \"A7\"\n[[sensor]]\nname = \"imu\"\nkind = \"raw\"\n";
        let own = SensorList::parse(text)?;
        store.calibrations().set_sensors(own)?;
        drop(store);
        let store = Store::open(&folder.path().join("s"))?;
        assert_eq!(store.calibrations().sensors()?, own);
        assert_eq!(store.calibrations().mounted()?, [Some("A7".to_owned()), None]);
        assert_eq!(store.calibrations().serving(None, &[])?.warnings.len(), 1, "a raw sensor needs no part");
        store.calibrations().set_sensors(SensorList::default())?;
        assert_eq!(store.calibrations().mounted()?[0].as_deref(), Some("A7"));
        Ok(())
    }
}
