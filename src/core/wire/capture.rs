//! Bytes of a board in a file, so that they can be heard again. Two forms; the first four bytes tell which.
//!
//! Raw: the bytes as they came, as any terminal program saves them. When they came is lost; they are given the pace of the
//! board's own clock where its lines have one, else that of 50 lines a second.
//!
//! With their times of arrival, little-endian:
//!
//! ```text
//! magic "PPB1"      4 bytes
//! per record:
//!   kind            u8      0 bytes, 1 interrupted: the text says why
//!   arrived (s)     f64     since the stream began
//!   length          u32     at most 65536
//!   bytes           u8 x length
//! ```
//!
//! Records are only ever added; a file that ends within one, as after a kill, holds the others.

use super::fields::{Parsed, parse};
use std::io::{self, Read, Write};

/// Begins a file with times of arrival.
pub const MAGIC: &[u8; 4] = b"PPB1";
/// Longest record (bytes).
const LONGEST: usize = 65_536;
/// Time between lines that have no clock (s): the paper's board takes 50 samples a second.
const PACE_S: f64 = 0.02;
/// Two lines of a raw file further apart than this are not of one stretch (s).
const FARTHEST_S: f64 = 10.0;

/// A piece of a stream.
#[derive(Clone, Debug, PartialEq)]
pub enum Captured {
    /// Bytes that arrived together.
    Bytes {
        /// When (s since the stream began).
        arrived_s: f64,
        /// What.
        bytes: Vec<u8>,
    },
    /// The stream was interrupted.
    Interrupted {
        /// When (s since the stream began).
        at_s: f64,
        /// Why.
        cause: String,
    },
}

impl Captured {
    /// When it came (s since the stream began).
    pub fn arrived_s(&self) -> f64 {
        match self {
            Self::Bytes { arrived_s, .. } => *arrived_s,
            Self::Interrupted { at_s, .. } => *at_s,
        }
    }

    /// Writes it as a record; [`MAGIC`] stands before the first.
    pub fn write(&self, out: &mut impl Write) -> io::Result<()> {
        let (kind, payload) = match self {
            Self::Bytes { bytes, .. } => (0, bytes.as_slice()),
            Self::Interrupted { cause, .. } => (1, cause.as_bytes()),
        };
        // What came together may be longer than a record; it is told in several.
        let parts: Vec<&[u8]> = if payload.is_empty() { vec![payload] } else { payload.chunks(LONGEST).collect() };
        for part in parts {
            out.write_all(&[kind])?;
            out.write_all(&self.arrived_s().to_le_bytes())?;
            out.write_all(&(part.len() as u32).to_le_bytes())?;
            out.write_all(part)?;
        }
        Ok(())
    }
}

/// Reads a captured file piece by piece, in bounded memory.
#[derive(Debug)]
pub struct CaptureReader<R> {
    source: R,
    form: Form,
}

#[derive(Debug)]
enum Form {
    Stamped,
    Raw { pace: Pace, waiting: Vec<u8>, ended: bool },
}

/// The clock that a raw file is given.
#[derive(Debug, Default)]
struct Pace {
    now_s: f64,
    clock: Option<f64>,
}

impl<R: Read> CaptureReader<R> {
    /// A reader of either form.
    pub fn new(mut source: R) -> io::Result<Self> {
        let mut head = Vec::new();
        source.by_ref().take(MAGIC.len() as u64).read_to_end(&mut head)?;
        let form = if head == MAGIC {
            Form::Stamped
        } else {
            Form::Raw { pace: Pace::default(), waiting: head, ended: false }
        };
        Ok(Self { source, form })
    }

    fn stamped(source: &mut R) -> io::Result<Option<Captured>> {
        let mut head = [0; 13];
        if !fill(source, &mut head)? {
            return Ok(None);
        }
        let [kind, a, b, c, d, e, f, g, h, i, j, k, l] = head;
        let at_s = f64::from_le_bytes([a, b, c, d, e, f, g, h]);
        let length = u32::from_le_bytes([i, j, k, l]) as usize;
        if kind > 1 || !at_s.is_finite() || length > LONGEST {
            return Err(io::Error::new(io::ErrorKind::InvalidData, "a record of captured bytes is damaged"));
        }
        let mut bytes = vec![0; length];
        if !fill(source, &mut bytes)? {
            return Ok(None);
        }
        Ok(Some(if kind == 0 {
            Captured::Bytes { arrived_s: at_s, bytes }
        } else {
            Captured::Interrupted { at_s, cause: String::from_utf8_lossy(&bytes).into_owned() }
        }))
    }

    /// The next line of a raw file, with what ends it.
    fn raw(source: &mut R, pace: &mut Pace, waiting: &mut Vec<u8>, ended: &mut bool) -> io::Result<Option<Captured>> {
        loop {
            let end = waiting.iter().position(|byte| *byte == b'\n').map(|at| at + 1);
            let end = end.or_else(|| (*ended || waiting.len() >= LONGEST).then_some(waiting.len()));
            if let Some(end) = end {
                if end == 0 {
                    return Ok(None);
                }
                let bytes: Vec<u8> = waiting.drain(..end).collect();
                pace.go_on(&bytes);
                return Ok(Some(Captured::Bytes { arrived_s: pace.now_s, bytes }));
            }
            let read = source.by_ref().take(4096).read_to_end(waiting)?;
            *ended = read == 0;
        }
    }
}

/// Fills the buffer; false where the source ends before.
fn fill(source: &mut impl Read, buffer: &mut [u8]) -> io::Result<bool> {
    match source.read_exact(buffer) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
        Err(error) => Err(error),
    }
}

impl Pace {
    fn go_on(&mut self, line: &[u8]) {
        let clock = match parse(line) {
            Ok(Parsed::Named { fields, .. }) => fields.iter().find_map(|field| match field.name.as_str() {
                "t_us" => field.value.map(|us| us * 1e-6),
                "ms" => field.value.map(|ms| ms * 1e-3),
                _ => None,
            }),
            _ => None,
        };
        let step = clock.zip(self.clock).map(|(now, before)| now - before);
        self.now_s += step.filter(|step| (0.0..FARTHEST_S).contains(step)).unwrap_or(PACE_S);
        self.clock = clock.or(self.clock);
    }
}

impl<R: Read> Iterator for CaptureReader<R> {
    type Item = io::Result<Captured>;

    fn next(&mut self) -> Option<Self::Item> {
        match &mut self.form {
            Form::Stamped => Self::stamped(&mut self.source),
            Form::Raw { pace, waiting, ended } => Self::raw(&mut self.source, pace, waiting, ended),
        }
        .transpose()
    }
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

    fn file(records: &[Captured]) -> io::Result<Vec<u8>> {
        let mut out = MAGIC.to_vec();
        records.iter().try_for_each(|record| record.write(&mut out))?;
        Ok(out)
    }

    #[test]
    fn what_was_captured_comes_back_with_its_times() -> io::Result<()> {
        let bytes = file(&records())?;
        let back: Vec<Captured> = CaptureReader::new(bytes.as_slice())?.collect::<io::Result<_>>()?;
        assert_eq!(back[..2], records()[..2]);
        let length = |piece: &Captured| if let Captured::Bytes { bytes, .. } = piece { bytes.len() } else { 0 };
        assert_eq!(back[2..].iter().map(length).collect::<Vec<_>>(), [LONGEST, 100_000 - LONGEST]);
        // Every cut leaves the records before it.
        for end in [5, 30, 60, bytes.len() - 1] {
            let cut: Vec<Captured> = CaptureReader::new(&bytes[..end])?.collect::<io::Result<_>>()?;
            assert!(cut.iter().zip(&back).all(|(a, b)| a == b) && cut.len() < back.len(), "{end}");
        }
        let mut damaged = bytes;
        damaged[4] = 9;
        assert!(CaptureReader::new(damaged.as_slice())?.next().is_some_and(|piece| piece.is_err()));
        Ok(())
    }

    #[test]
    fn raw_files_get_the_pace_of_their_clock_or_of_fifty_lines_a_second() -> io::Result<()> {
        let times = |text: &str| -> io::Result<Vec<f64>> {
            CaptureReader::new(text.as_bytes())?.map(|piece| piece.map(|piece| piece.arrived_s())).collect()
        };
        let close = |found: &[f64], wanted: &[f64]| found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(close(&times("1,2\n3,4\r\n5,6")?, &[0.02, 0.04, 0.06]));
        let clocked = times("t_us:1000,a:1\nt_us:6000,a:1\nt_us:16000,a:1\n")?;
        assert!(clocked.len() == 3 && close(&clocked, &[0.02, 0.025, 0.035]), "{clocked:?}");
        assert!(times("")?.is_empty());
        Ok(())
    }
}
