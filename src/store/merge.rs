//! Joining stores: the parts of a data set that several machines have collected.

use super::board_trials::COPY_BOARD_TRIALS;
use super::journal::COPY_JOURNAL;
use super::label_repository::COPY_GUESSES;
use super::store::Store;
use super::store_error::{StoreError, fault};
use serde::Serialize;
use std::path::Path;

/// What a merge came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Merged {
    /// Trials copied.
    pub added: u64,
    /// Trials that were here already.
    pub known: u64,
}

const CHOOSE_INCOMING: &str = "
    CREATE TEMP TABLE incoming AS SELECT theirs.id FROM other.trials AS theirs
    WHERE NOT EXISTS (
        SELECT 1 FROM main.trials AS ours WHERE ours.uid = theirs.uid OR (
            ours.collection = theirs.collection AND ours.object = theirs.object AND ours.seed = theirs.seed));
";

const COPY_TRIALS: &str = "
    INSERT INTO main.trials (uid, created, state, rig, object, seed, scene, world_from_gripper, quality, warnings,
        version, samples, deleted, collection, size, shape, plan, note, tags, unsure, reviewed)
    SELECT uid, created, state, rig, object, seed, scene, world_from_gripper, quality, warnings, version, samples,
        deleted, collection, size, shape, plan, note, tags, unsure, reviewed
    FROM other.trials WHERE id IN (SELECT id FROM temp.incoming) ORDER BY id;
";

const COPY_CHUNKS: &str = "
    INSERT INTO main.chunks (trial, number, frames)
    SELECT ours.id, chunks.number, chunks.frames FROM temp.incoming
    JOIN other.trials AS theirs ON theirs.id = incoming.id
    JOIN main.trials AS ours ON ours.uid = theirs.uid
    JOIN other.chunks AS chunks ON chunks.trial = theirs.id;
    INSERT INTO main.readings (trial, channels, samples)
    SELECT ours.id, readings.channels, readings.samples FROM temp.incoming
    JOIN other.trials AS theirs ON theirs.id = incoming.id
    JOIN main.trials AS ours ON ours.uid = theirs.uid
    JOIN other.readings AS readings ON readings.trial = theirs.id;
    INSERT INTO main.parts (trial, sensor, part)
    SELECT ours.id, parts.sensor, parts.part FROM temp.incoming
    JOIN other.trials AS theirs ON theirs.id = incoming.id
    JOIN main.trials AS ours ON ours.uid = theirs.uid
    JOIN other.parts AS parts ON parts.trial = theirs.id;
";

/// Calibrations come along, so that trials can be derived here too. Where parts sit now is a matter of each gripper.
const COPY_CALIBRATIONS: &str = "
    INSERT INTO main.calibrations (uid, part, version, created, withdrawn, record)
    SELECT uid, part, version + coalesce((SELECT max(version) FROM main.calibrations AS ours
        WHERE ours.part = theirs.part), 0), created, withdrawn, record
    FROM other.calibrations AS theirs WHERE uid NOT IN (SELECT uid FROM main.calibrations) ORDER BY id;
";

impl Store {
    /// Copies what another store holds and this one does not. Trials keep their identity, so that merging twice adds
    /// nothing the second time; their numbers are new ones.
    pub fn merge_from(&mut self, other: &Path) -> Result<Merged, StoreError> {
        // Opening it brings it up to date, or says why it cannot be read.
        if !other.is_file() {
            let cause = "there is no such file".to_owned();
            return Err(StoreError::Open { path: other.to_owned(), cause });
        }
        drop(Self::open(other)?);
        let path = self.path().to_owned();
        let fault = |e: rusqlite::Error| fault(&path, &e);
        self.connection.execute("ATTACH DATABASE ?1 AS other", [other.to_string_lossy()]).map_err(fault)?;
        let merged = self.write().and_then(|transaction| {
            let count = "SELECT count(*) FROM other.trials";
            let total: i64 = transaction.query_row(count, [], |row| row.get(0)).map_err(fault)?;
            transaction.execute_batch(CHOOSE_INCOMING).map_err(fault)?;
            let added = transaction.execute(COPY_TRIALS, []).map_err(fault)? as u64;
            transaction.execute_batch(COPY_CHUNKS).map_err(fault)?;
            transaction.execute_batch(COPY_CALIBRATIONS).map_err(fault)?;
            transaction.execute_batch(COPY_BOARD_TRIALS).map_err(fault)?;
            transaction.execute_batch(COPY_GUESSES).map_err(fault)?;
            transaction.execute_batch(COPY_JOURNAL).map_err(fault)?;
            transaction.execute_batch("DROP TABLE temp.incoming").map_err(fault)?;
            transaction.commit().map_err(fault)?;
            Ok(Merged { added, known: total.cast_unsigned().saturating_sub(added) })
        });
        self.connection.execute("DETACH DATABASE other", []).map_err(fault)?;
        merged
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_trials::grasp;
    use palpate_sim::scene::Scene;

    #[test]
    fn merging_adds_what_is_new_and_only_once() -> Result<(), StoreError> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = |name: &str| folder.path().join(name);
        let (mut all, mut shard) = (Store::open(&path("all.sqlite"))?, Store::open(&path("shard.sqlite"))?);
        let mut trial = grasp(&Scene::default(), None, 0);
        for seed in 1..=3 {
            trial.info.seed = seed;
            trial.info.collection = Some("set".to_owned());
            assert_eq!(shard.insert_collected([&trial].into_iter())?, 1);
            assert_eq!(shard.insert_collected([&trial].into_iter())?, 0, "twice is once");
        }
        // The same trial of the same collection, made elsewhere.
        all.insert_collected([&trial].into_iter())?;
        assert_eq!(all.merge_from(&path("shard.sqlite"))?, Merged { added: 2, known: 1 });
        assert_eq!(all.merge_from(&path("shard.sqlite"))?, Merged { added: 0, known: 3 });
        assert_eq!(all.collected("set")?.len(), 3);
        for id in 1..=3 {
            assert!(all.load(id)?.frames == trial.frames);
        }
        assert!(matches!(all.merge_from(&path("gone.sqlite")), Err(StoreError::Open { .. })));
        assert!(!path("gone.sqlite").exists());
        Ok(())
    }
}
