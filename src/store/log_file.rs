//! SQLite's log beside a store (`-wal`). SQLite drops what was stored behind a damaged place of it without a word; this finds
//! such a place. Form of the file: <https://www.sqlite.org/fileformat2.html#the_write_ahead_log>.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;
use std::time::Duration;

/// Bytes before the first frame, and before the page of a frame.
const HEAD: usize = 32;
const FRAME_HEAD: usize = 24;
/// The number with which a log begins, whose last bit says that sums are of big-endian words.
const MAGIC: u32 = 0x377f_0682;
/// Largest page (bytes).
const MOST_OF_A_PAGE: usize = 65_536;

/// Time in which a frame that another program is writing becomes whole.
const WHOLE_AFTER: Duration = Duration::from_millis(50);

/// True where a stored change stands behind a damaged place. One that another program is just writing is whole at a second look.
pub(super) fn has_lost_changes(log: &Path) -> bool {
    let looks_damaged = || File::open(log).is_ok_and(|file| lost_changes(BufReader::new(file)).unwrap_or(false));
    looks_damaged() && {
        std::thread::sleep(WHOLE_AFTER);
        looks_damaged()
    }
}

fn lost_changes(mut log: impl Read) -> Option<bool> {
    let mut head = [0; HEAD];
    log.read_exact(&mut head).ok()?;
    let (magic, page) = (word(&head, 0), word(&head, 8) as usize);
    if magic & !1 != MAGIC || !(512..=MOST_OF_A_PAGE).contains(&page) {
        return None;
    }
    let big = magic & 1 == 1;
    let mut sums = added([0; 2], &head[..24], big);
    let mut is_damaged = sums != [word(&head, 24), word(&head, 28)];
    let mut frame = vec![0; FRAME_HEAD + page];
    while log.read_exact(&mut frame).is_ok() {
        // Frames of an earlier round have other numbers.
        if frame[8..16] != head[16..24] {
            break;
        }
        let commits = word(&frame, 4) != 0;
        if is_damaged && commits {
            return Some(true);
        }
        sums = added(added(sums, &frame[..8], big), &frame[FRAME_HEAD..], big);
        is_damaged |= sums != [word(&frame, 16), word(&frame, 20)];
    }
    Some(false)
}

fn word(bytes: &[u8], at: usize) -> u32 {
    bytes[at..at + 4].iter().fold(0, |word, byte| word << 8 | u32::from(*byte))
}

/// Sums of a log with further words.
fn added(sums: [u32; 2], bytes: &[u8], big: bool) -> [u32; 2] {
    let word = |bytes: &[u8; 4]| if big { u32::from_be_bytes(*bytes) } else { u32::from_le_bytes(*bytes) };
    bytes.as_chunks::<4>().0.as_chunks::<2>().0.iter().fold(sums, |[a, b], [first, second]| {
        let a = a.wrapping_add(word(first)).wrapping_add(b);
        [a, b.wrapping_add(word(second)).wrapping_add(a)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rusqlite::Connection;

    #[test]
    fn changes_behind_a_damaged_place_are_noticed() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("a.sqlite");
        let connection = Connection::open(&path)?;
        connection.execute_batch("PRAGMA journal_mode = WAL; PRAGMA wal_autocheckpoint = 0; CREATE TABLE a (x)")?;
        for k in 0..20 {
            connection.execute("INSERT INTO a VALUES (?1)", [k])?;
        }
        let log = std::fs::read(folder.path().join("a.sqlite-wal"))?;
        assert!(!lost_changes(log.as_slice()).ok_or("a log")?);
        let frame = FRAME_HEAD + word(&log, 8) as usize;
        let frames = (log.len() - HEAD) / frame;
        assert!(frames >= 20);
        for at in [HEAD + 100, HEAD + 5 * frame + 30, HEAD + (frames - 2) * frame + 17] {
            let mut damaged = log.clone();
            damaged[at] ^= 4;
            assert!(lost_changes(damaged.as_slice()).ok_or("a log")?, "{at}");
        }
        // A log that is being written, or was cut, has an end.
        for length in [0, 20, HEAD, HEAD + 3 * frame + 50, log.len() - 1] {
            assert!(!lost_changes(&log[..length]).unwrap_or(false), "{length}");
        }
        let mut last = log.clone();
        let end = last.len() - 1;
        last[end] ^= 4;
        assert!(!lost_changes(last.as_slice()).ok_or("a log")?);
        Ok(())
    }
}
