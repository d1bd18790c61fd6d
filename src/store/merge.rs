//! Merging: copies the trials of another store into this one, such as the parts of a data set that several machines
//! collected.

use super::checksum::{BYTES, FRAMES, READINGS};
use super::schema::TABLES_OF_A_TRIAL;
use super::store::{Store, json};
use super::store_error::StoreError;
use palpate_tactile::trial::TrialId;
use rusqlite::Transaction;
use rusqlite::types::{ToSqlOutput, ValueRef};
use serde::Serialize;
use std::path::Path;

/// Result of a merge.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Merged {
    /// Trials copied.
    pub added: u64,
    /// Trials that this store already had.
    pub known: u64,
    /// Of these, the trials with a label, note, tag or corrected phase that only the other store has; a merge does not
    /// copy it.
    pub annotated: u64,
    /// Damaged trials of the other store, which were left out.
    pub damaged: Vec<TrialId>,
    /// What could not be read of it.
    pub warnings: Vec<String>,
}

const CHOOSE_INCOMING: &str = "
    CREATE TEMP TABLE incoming AS SELECT theirs.id, theirs.uid FROM other.trials AS theirs
    WHERE theirs.demo = 0 AND NOT EXISTS (
        SELECT 1 FROM main.trials AS ours WHERE ours.uid = theirs.uid OR (
            ours.collection = theirs.collection AND ours.object = theirs.object AND ours.seed = theirs.seed) OR (
            ours.identity = theirs.identity AND ours.state = 'complete' AND ours.deleted IS NULL));
";

/// If this store already has a grasp, its trial is added to the collections that the grasp has in the other store. That
/// trial is the one with the same uid, or else the oldest complete trial of the same grasp.
const ADD_MEMBERSHIPS: &str = "
    INSERT OR IGNORE INTO main.memberships (trial, collection)
    SELECT holder.id, known.collection FROM (
        SELECT belongs.collection, coalesce(
            (SELECT ours.id FROM main.trials AS ours WHERE ours.uid = theirs.uid),
            (SELECT min(ours.id) FROM main.trials AS ours
                WHERE ours.identity = theirs.identity AND ours.state = 'complete' AND ours.deleted IS NULL)) AS id
        FROM (SELECT id AS trial, collection FROM other.trials WHERE collection IS NOT NULL
            UNION SELECT trial, collection FROM other.memberships) AS belongs
        JOIN other.trials AS theirs ON theirs.id = belongs.trial
        WHERE theirs.deleted IS NULL AND theirs.uid NOT IN (SELECT uid FROM temp.incoming)) AS known
    JOIN main.trials AS holder ON holder.id = known.id
    WHERE holder.collection IS NOT known.collection;
";

/// A grasp of our demo log that the other store keeps is kept here too.
const KEEP_KNOWN: &str = "
    UPDATE main.trials SET demo = 0 WHERE demo = 1 AND EXISTS (
        SELECT 1 FROM other.trials AS theirs WHERE theirs.demo = 0 AND theirs.deleted IS NULL
            AND (theirs.uid = main.trials.uid OR theirs.identity = main.trials.identity));
";

/// Calibrations are copied too, so that signals can be derived here. Mountings and the plan are not copied.
const COPY_CALIBRATIONS: &str = "
    INSERT INTO main.calibrations (uid, part, version, created, withdrawn, record)
    SELECT uid, part, version + coalesce((SELECT max(version) FROM main.calibrations AS ours
        WHERE ours.part = theirs.part), 0), created, withdrawn, record
    FROM other.calibrations AS theirs WHERE uid NOT IN (SELECT uid FROM main.calibrations) ORDER BY id;
";

const COPY_JOURNAL: &str = "
    INSERT INTO main.journal (uid, at, trial, undoes, undoable, merged, entry)
    SELECT theirs.uid, at, trial, undoes, undoable, 1, entry
    FROM temp.incoming JOIN other.journal AS theirs ON theirs.trial = incoming.uid
    WHERE theirs.uid NOT IN (SELECT uid FROM main.journal) ORDER BY theirs.number;
";

/// Takes damaged trials out of those to copy: the trials with these numbers, and trials with damaged chunks.
fn leave_out_damaged(transaction: &Transaction<'_>, rows: &[TrialId]) -> rusqlite::Result<Vec<TrialId>> {
    let of_chunks = [FRAMES, READINGS, BYTES].map(|kind| {
        let (table, intact) = (kind.table, kind.intact("theirs"));
        format!("EXISTS (SELECT 1 FROM other.{table} WHERE trial = theirs.id AND NOT ({intact}))")
    });
    let sql = format!(
        "CREATE TEMP TABLE damaged AS SELECT theirs.id FROM temp.incoming JOIN other.trials AS theirs ON theirs.id = incoming.id
         WHERE theirs.id IN (SELECT value FROM json_each('{}')) OR {}
         OR EXISTS (SELECT 1 FROM other.readings WHERE trial = theirs.id
             AND checksum(theirs.uid, channels, readings.samples) IS NOT readings.checksum);
         DELETE FROM temp.incoming WHERE id IN (SELECT id FROM temp.damaged);",
        json(rows),
        of_chunks.join(" OR ")
    );
    transaction.execute_batch(&sql)?;
    transaction.prepare("SELECT id FROM temp.damaged ORDER BY id")?.query_map([], |row| row.get(0))?.collect()
}

/// Copies the chosen trials with everything that belongs to them.
fn copy(transaction: &Transaction<'_>, damaged: &[TrialId]) -> rusqlite::Result<Merged> {
    transaction.execute_batch(CHOOSE_INCOMING)?;
    let damaged = leave_out_damaged(transaction, damaged)?;
    let columns = columns_of(transaction, "trials", "id")?;
    let sql = format!(
        "INSERT INTO main.trials ({columns}) SELECT {columns} FROM other.trials
         WHERE id IN (SELECT id FROM temp.incoming) ORDER BY id"
    );
    let added = transaction.execute(&sql, [])? as u64;
    for table in TABLES_OF_A_TRIAL {
        let columns = columns_of(transaction, table, "trial")?;
        let sql = format!(
            "INSERT INTO main.{table} (trial, {columns}) SELECT numbered.id, {columns} FROM temp.incoming
             JOIN (SELECT id, uid FROM main.trials) AS numbered ON numbered.uid = incoming.uid
             JOIN other.{table} AS theirs ON theirs.trial = incoming.id"
        );
        transaction.execute(&sql, [])?;
    }
    transaction.execute_batch(ADD_MEMBERSHIPS)?;
    transaction.execute_batch(KEEP_KNOWN)?;
    transaction.execute_batch(COPY_CALIBRATIONS)?;
    transaction.execute_batch(COPY_JOURNAL)?;
    let annotated = transaction.query_row(COUNT_ANNOTATED, [], |row| row.get::<_, i64>(0))?.cast_unsigned();
    let count = "SELECT count(*) FROM other.trials WHERE demo = 0";
    let total = transaction.query_row(count, [], |row| row.get::<_, i64>(0))?.cast_unsigned();
    let known = total.saturating_sub(added + damaged.len() as u64);
    transaction.execute_batch("DROP TABLE temp.incoming; DROP TABLE temp.damaged")?;
    Ok(Merged { added, known, annotated, damaged, warnings: Vec::new() })
}

/// Counts trials that this store already has and for which the other store has journal entries missing here, or a note
/// or tag while this store has the grasp under another uid.
const COUNT_ANNOTATED: &str = "
    SELECT count(*) FROM other.trials AS theirs
    WHERE theirs.deleted IS NULL AND theirs.demo = 0 AND theirs.uid NOT IN (SELECT uid FROM temp.incoming)
    AND theirs.id NOT IN (SELECT id FROM temp.damaged) AND (
        EXISTS (SELECT 1 FROM other.journal AS told
            WHERE told.trial = theirs.uid AND told.uid NOT IN (SELECT uid FROM main.journal))
        OR (theirs.note <> '' OR theirs.tags <> '[]') AND theirs.uid NOT IN (SELECT uid FROM main.trials));
";

/// All columns of a table but its key, separated by commas.
fn columns_of(transaction: &Transaction<'_>, table: &str, key: &str) -> rusqlite::Result<String> {
    let sql = "SELECT group_concat(name, ', ') FROM pragma_table_info(?1) WHERE name <> ?2";
    transaction.query_row(sql, [table, key], |row| row.get(0))
}

impl Store {
    /// Copies the trials that this store lacks from another store, except those in the other store's demo log. Trials
    /// keep their uid, so merging a second time adds nothing, but they get new numbers in this store.
    pub fn merge_from(&mut self, other: &Path) -> Result<Merged, StoreError> {
        if !other.is_file() {
            return Err(StoreError::open(other, "no such file"));
        }
        // Open it first as a store: this gives a clear error if it cannot be read.
        let theirs = Self::open_to_read(other)?;
        if std::fs::canonicalize(theirs.file())
            .is_ok_and(|own| std::fs::canonicalize(self.file()).is_ok_and(|to| to == own))
        {
            return Err(StoreError::Refused("it is this store itself".to_owned()));
        }
        let damaged: Vec<TrialId> = theirs.list(true)?.iter().filter(|row| row.damaged).map(|row| row.id).collect();
        let fault = |e: rusqlite::Error| self.fault(&e);
        // Pass the path byte for byte, even if it is not valid UTF-8.
        let name = theirs.name_to_attach();
        let name = ToSqlOutput::Borrowed(ValueRef::Text(&name));
        self.connection.execute("ATTACH DATABASE ?1 AS other", [name]).map_err(fault)?;
        let merged = self.in_transaction(|transaction| copy(transaction, &damaged));
        self.connection.execute("DETACH DATABASE other", []).map_err(fault)?;
        merged.map(|merged| Merged { warnings: theirs.warnings().to_vec(), ..merged })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_trials::grasp;
    use palpate_sim::scene::Scene;
    use palpate_tactile::trial::{GraspOrigin, SimulatedTrial};

    fn merged(added: u64, known: u64, annotated: u64) -> Merged {
        Merged { added, known, annotated, ..Merged::default() }
    }

    #[test]
    fn merging_adds_what_is_new_and_only_once() -> Result<(), StoreError> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = |name: &str| folder.path().join(name);
        let (mut all, mut shard) = (Store::open(&path("all.sqlite"))?, Store::open(&path("shard.sqlite"))?);
        let mut trial = grasp(&Scene::default(), None, 0);
        for seed in 1..=3 {
            trial.header.seed = seed;
            trial.header.collection = Some("set".to_owned());
            assert_eq!(shard.insert_collected([&trial].into_iter())?, 1);
            assert_eq!(shard.insert_collected([&trial].into_iter())?, 0, "twice is once");
        }
        // The same trial of the same collection, made elsewhere.
        all.insert_collected([&trial].into_iter())?;
        assert_eq!(all.merge_from(&path("shard.sqlite"))?, merged(2, 1, 0));
        assert_eq!(all.merge_from(&path("shard.sqlite"))?, merged(0, 3, 0));
        assert_eq!(all.collected("set")?.len(), 3);
        for id in 1..=3 {
            assert!(all.load(id)?.frames() == trial.frames());
        }
        assert!(all.merge_from(&path("gone.sqlite")).is_err_and(|error| error.to_string().contains("no such file")));
        assert!(!path("gone.sqlite").exists());
        Ok(())
    }

    /// A store in a folder.
    fn open(folder: &tempfile::TempDir, name: &str) -> Result<Store, StoreError> {
        Store::open(&folder.path().join(name))
    }

    /// A grasp whose identity is known, in a collection.
    fn collected(collection: &str) -> SimulatedTrial {
        let mut trial = grasp(&Scene::default(), None, 0);
        trial.header.origin = Some(GraspOrigin::default());
        trial.header.collection = Some(collection.to_owned());
        trial
    }

    fn collections_of(store: &Store) -> Result<Vec<Vec<String>>, StoreError> {
        Ok(store.list(false)?.iter().map(|row| row.collections().cloned().collect()).collect())
    }

    #[test]
    fn a_trial_merged_earlier_joins_the_collections_that_it_has_joined_since() -> Result<(), StoreError> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (mut all, mut shard) = (open(&folder, "all.sqlite")?, open(&folder, "shard.sqlite")?);
        shard.insert_collected([&collected("first")].into_iter())?;
        all.merge_from(shard.path())?;
        assert_eq!(shard.insert_collected([&collected("second")].into_iter())?, 0, "it has joined");
        for _ in 0..2 {
            assert_eq!(all.merge_from(shard.path())?.added, 0);
            assert_eq!(collections_of(&all)?, [["first", "second"]]);
        }
        Ok(())
    }

    #[test]
    fn a_grasp_known_here_joins_all_collections_of_the_other_store() -> Result<(), StoreError> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (mut all, mut shard) = (open(&folder, "all.sqlite")?, open(&folder, "shard.sqlite")?);
        all.insert_collected([&collected("own")].into_iter())?;
        for collection in ["first", "second", "own"] {
            shard.insert_collected([&collected(collection)].into_iter())?;
        }
        assert_eq!(all.merge_from(shard.path())?.added, 0);
        assert_eq!(collections_of(&all)?, [["own", "first", "second"]]);
        Ok(())
    }

    #[test]
    fn what_people_noted_on_known_grasps_is_counted() -> Result<(), StoreError> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (mut all, mut shard) = (open(&folder, "all.sqlite")?, open(&folder, "shard.sqlite")?);
        all.insert(&collected("own"))?;
        let id = shard.insert(&collected("first"))?.id();
        assert_eq!(all.merge_from(shard.path())?, merged(0, 1, 0));
        shard.labels().set_note(id, "slipped")?;
        assert_eq!(all.merge_from(shard.path())?, merged(0, 1, 1));

        // A trial merged earlier, annotated since; what has come along already does not count.
        let mut other = collected("own");
        other.header.seed = 1;
        let id = shard.insert(&other)?.id();
        shard.labels().set_tags(id, &["wet".to_owned()])?;
        assert_eq!(all.merge_from(shard.path())?, merged(1, 1, 1));
        shard.labels().set_note(id, "late")?;
        assert_eq!(all.merge_from(shard.path())?, merged(0, 2, 2));
        Ok(())
    }

    #[test]
    fn of_several_copies_the_oldest_joins() -> Result<(), StoreError> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (mut all, mut shard) = (open(&folder, "all.sqlite")?, open(&folder, "shard.sqlite")?);
        let mut alone = collected("first");
        shard.insert_collected([&alone].into_iter())?;
        alone.header.collection = None;
        let oldest = all.insert(&alone)?.id();
        all.delete(&[oldest])?;
        let copy = all.insert(&alone)?.id();
        all.restore(&[oldest])?;
        all.merge_from(shard.path())?;
        let joined = |row: &crate::TrialRow| !row.also_in.is_empty();
        let found: Vec<_> = all.list(false)?.iter().map(|row| (row.id, joined(row))).collect();
        assert_eq!(found, [(oldest, true), (copy, false)]);
        Ok(())
    }
}
