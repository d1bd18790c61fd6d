//! CRC-32 of rows: finds every flipped bit of a stored trial, chunks that were exchanged, and rows that another program changed.
//!
//! A checksum covers the identity of the trial, the number of a chunk, and each value with its type and length. SQL computes
//! it by the function `checksum`. Triggers of each connection keep the checksum of a row of `trials`: a change carries a
//! mismatch on, so that an edit does not hide damage.

use rusqlite::functions::{Context, FunctionFlags};
use rusqlite::types::ValueRef;
use rusqlite::{Connection, Row};

/// Columns of `trials` whose change would falsify a trial. The number differs between stores, and `deleted`, `demo` and
/// `reviewed` say nothing of the grasp.
const COLUMNS: &str = "uid created state rig object seed scene world_from_gripper quality warnings version samples chunks \
    collection size shape plan note tags unsure earlier phases origin identity";

/// Frames of `chunks`.
pub(super) const FRAMES: Chunks =
    Chunks { table: "chunks", columns: &["frames"], checksum: "checksum", what: "frames" };
/// Readings and gaps of `board_chunks`.
pub(super) const READINGS: Chunks =
    Chunks { table: "board_chunks", columns: &["readings", "gaps"], checksum: "checksum", what: "readings" };
/// Bytes of `board_chunks`.
pub(super) const BYTES: Chunks =
    Chunks { table: "board_chunks", columns: &["bytes"], checksum: "bytes_checksum", what: "bytes" };

/// Columns of a table of chunks that one checksum covers.
pub(super) struct Chunks {
    pub(super) table: &'static str,
    pub(super) columns: &'static [&'static str],
    pub(super) checksum: &'static str,
    /// What they hold, for messages.
    pub(super) what: &'static str,
}

impl Chunks {
    /// SQL that is true for an intact chunk, where the table `trials` has the trial's identity.
    pub(super) fn intact(&self, trials: &str) -> String {
        let Self { table, columns, checksum, .. } = self;
        format!("checksum({trials}.uid, number, {}) IS {table}.{checksum}", columns.join(", "))
    }
}

/// SQL of the columns that a row's checksum covers, under the name that the row has in the statement.
pub(super) fn columns(row: &str) -> String {
    let columns: Vec<String> = COLUMNS.split_whitespace().map(|column| format!("{row}.{column}")).collect();
    columns.join(", ")
}

/// The checksum of a row whose last columns are [`columns`]. For lists: SQLite reads each use of a long column anew.
pub(super) fn of_row(row: &Row<'_>) -> rusqlite::Result<u32> {
    let count = row.as_ref().column_count();
    let mut hasher = crc32fast::Hasher::new();
    for index in count - COLUMNS.split_whitespace().count()..count {
        add(&mut hasher, row.get_ref(index)?);
    }
    Ok(hasher.finalize())
}

/// SQL of the checksum of a row of `trials`.
fn of_trial(row: &str) -> String {
    format!("checksum({})", columns(row))
}

/// SQL that is true for an intact row of `trials`.
pub(super) fn is_intact() -> String {
    format!("{} IS trials.checksum", of_trial("trials"))
}

/// Adds the functions to a connection: `checksum` of values, and `carried` to a changed row, by the old checksum and those of
/// the row before and after.
pub(super) fn add_functions(connection: &Connection) -> rusqlite::Result<()> {
    let flags = FunctionFlags::SQLITE_UTF8 | FunctionFlags::SQLITE_DETERMINISTIC;
    connection.create_scalar_function("checksum", -1, flags, |context| {
        let mut hasher = crc32fast::Hasher::new();
        values(context).for_each(|value| add(&mut hasher, value));
        Ok(hasher.finalize())
    })?;
    connection.create_scalar_function("carried", 3, flags, |context| {
        let [old, before, after] = [context.get::<Option<i64>>(0)?, context.get(1)?, context.get(2)?];
        Ok(old.zip(before).zip(after).map(|((old, before), after)| old ^ before ^ after))
    })
}

fn values<'a>(context: &'a Context<'_>) -> impl Iterator<Item = ValueRef<'a>> {
    (0..context.len()).map(|index| context.get_raw(index))
}

fn add(hasher: &mut crc32fast::Hasher, value: ValueRef<'_>) {
    let (kind, bytes): (u8, &[u8]) = match value {
        ValueRef::Null => (0, &[]),
        ValueRef::Integer(number) => (1, &number.to_le_bytes()),
        ValueRef::Real(number) => (2, &number.to_le_bytes()),
        ValueRef::Text(bytes) | ValueRef::Blob(bytes) => (3, bytes),
    };
    hasher.update(&[kind]);
    hasher.update(&(bytes.len() as u64).to_le_bytes());
    hasher.update(bytes);
}

/// Makes the triggers that keep the checksums of `trials`. Merged rows bring their own.
pub(super) fn add_triggers(connection: &Connection) -> rusqlite::Result<()> {
    let (columns, old, new) = (COLUMNS.replace(' ', ", "), of_trial("OLD"), of_trial("NEW"));
    connection.execute_batch(&format!(
        "CREATE TEMP TRIGGER trial_added AFTER INSERT ON main.trials WHEN NEW.checksum IS NULL
         BEGIN UPDATE trials SET checksum = {new} WHERE id = NEW.id; END;
         CREATE TEMP TRIGGER trial_changed AFTER UPDATE OF {columns} ON main.trials
         BEGIN UPDATE trials SET checksum = carried(checksum, {old}, {new}) WHERE id = NEW.id; END;"
    ))
}
