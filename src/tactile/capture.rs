//! Captured bytes of a board with their times of arrival, as records. Little-endian:
//!
//! ```text
//! magic "PPB1"      4 bytes
//! per record:
//!   kind            u8      0 bytes, 1 interrupted: the text gives the cause
//!   arrived (s)     f64     since the stream began
//!   length          u32     at most 65536
//!   bytes           u8 x length
//! ```
//!
//! Records are only ever appended; a file cut within one, as after a kill, keeps the others, and the cut is an error.

use std::io::{self, Read, Write};

/// Begins a file of records.
pub const CAPTURE_MAGIC: &[u8; 4] = b"PPB1";
/// Longest record (bytes).
pub const LONGEST_RECORD: usize = 65_536;

/// A piece of a stream.
#[derive(Clone, Debug, PartialEq)]
pub enum Captured {
    /// Bytes that arrived together.
    Bytes {
        /// Time (s since the stream began).
        arrived_s: f64,
        bytes: Vec<u8>,
    },
    /// The stream was interrupted.
    Interrupted {
        /// Time (s since the stream began).
        at_s: f64,
        cause: String,
    },
}

impl Captured {
    /// Time of arrival (s since the stream began).
    pub fn arrived_s(&self) -> f64 {
        match self {
            Self::Bytes { arrived_s, .. } => *arrived_s,
            Self::Interrupted { at_s, .. } => *at_s,
        }
    }

    /// Writes it as a record; [`CAPTURE_MAGIC`] stands before the first.
    pub fn write(&self, out: &mut impl Write) -> io::Result<()> {
        let (kind, payload) = match self {
            Self::Bytes { bytes, .. } => (0, bytes.as_slice()),
            Self::Interrupted { cause, .. } => (1, cause.as_bytes()),
        };
        // Bytes that arrived together may fill several records.
        let parts: Vec<&[u8]> =
            if payload.is_empty() { vec![payload] } else { payload.chunks(LONGEST_RECORD).collect() };
        for part in parts {
            out.write_all(&[kind])?;
            out.write_all(&self.arrived_s().to_le_bytes())?;
            out.write_all(&(part.len() as u32).to_le_bytes())?;
            out.write_all(part)?;
        }
        Ok(())
    }
}

/// Reads the next record; `None` at the end. An error where a record is cut or damaged.
pub fn read_record(source: &mut impl Read) -> io::Result<Option<Captured>> {
    let damaged =
        |what: &str| Err(io::Error::new(io::ErrorKind::InvalidData, format!("{what}; what follows is missing")));
    const CUT: &str = "the captured bytes end within a record, as a file that was cut does";
    let mut head = [0; 13];
    match fill(source, &mut head)? {
        0 => return Ok(None),
        found if head[..found].starts_with(CAPTURE_MAGIC) => {
            return damaged("a second file of captured bytes begins here: take joined files apart");
        }
        found if found < head.len() => return damaged(CUT),
        _ => {}
    }
    let [kind, a, b, c, d, e, f, g, h, i, j, k, l] = head;
    let at_s = f64::from_le_bytes([a, b, c, d, e, f, g, h]);
    let length = u32::from_le_bytes([i, j, k, l]) as usize;
    if kind > 1 || !at_s.is_finite() || length > LONGEST_RECORD {
        return damaged("a record of captured bytes is damaged");
    }
    let mut bytes = vec![0; length];
    if fill(source, &mut bytes)? < length {
        return damaged(CUT);
    }
    Ok(Some(if kind == 0 {
        Captured::Bytes { arrived_s: at_s, bytes }
    } else {
        Captured::Interrupted { at_s, cause: String::from_utf8_lossy(&bytes).into_owned() }
    }))
}

/// Fills the buffer as far as the source goes; returns how far.
fn fill(source: &mut impl Read, mut buffer: &mut [u8]) -> io::Result<usize> {
    Ok(io::copy(&mut source.take(buffer.len() as u64), &mut buffer)? as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn records() -> Vec<Captured> {
        vec![
            Captured::Bytes { arrived_s: 0.5, bytes: b"flexL:1,fl".to_vec() },
            Captured::Interrupted { at_s: 0.6, cause: "unplugged".to_owned() },
            Captured::Bytes { arrived_s: 0.7, bytes: vec![7; 100_000] },
        ]
    }

    fn read_all(mut bytes: &[u8]) -> io::Result<Vec<Captured>> {
        let mut magic = [0; CAPTURE_MAGIC.len()];
        bytes.read_exact(&mut magic)?;
        std::iter::from_fn(|| read_record(&mut bytes).transpose()).collect()
    }

    fn file(records: &[Captured]) -> io::Result<Vec<u8>> {
        let mut out = CAPTURE_MAGIC.to_vec();
        records.iter().try_for_each(|record| record.write(&mut out))?;
        Ok(out)
    }

    #[test]
    fn captured_bytes_come_back_with_their_times() -> io::Result<()> {
        let bytes = file(&records())?;
        let back: Vec<Captured> = read_all(&bytes)?;
        assert_eq!(back[..2], records()[..2]);
        let length = |piece: &Captured| if let Captured::Bytes { bytes, .. } = piece { bytes.len() } else { 0 };
        assert_eq!(back[2..].iter().map(length).collect::<Vec<_>>(), [LONGEST_RECORD, 100_000 - LONGEST_RECORD]);
        // Every cut leaves the records before it, and is an error.
        for end in [5, 30, 60, bytes.len() - 1] {
            let mut rest = &bytes[CAPTURE_MAGIC.len()..end];
            let mut cut = Vec::new();
            let error = loop {
                match read_record(&mut rest) {
                    Ok(record) => cut.push(record.ok_or_else(|| io::Error::other("the cut is hidden"))?),
                    Err(error) => break error.to_string(),
                }
            };
            assert!(
                cut == back[..cut.len()] && cut.len() < back.len() && error.contains("end within"),
                "{end}: {error}"
            );
        }
        let joined = read_all(&[&*bytes, &*bytes].concat()).expect_err("two files").to_string();
        assert!(joined.contains("joined"), "{joined}");
        let mut damaged = bytes;
        damaged[4] = 9;
        assert!(read_all(&damaged).is_err());
        Ok(())
    }
}
