//! Files of captured bytes, for replay. Two forms, distinguished by the first four bytes:
//!
//! - records with their times of arrival, see [`palpate_tactile::capture`];
//! - raw bytes, as any terminal program saves them. They get times of arrival from the board's clock where its lines have
//!   one, else 50 lines per second.

use super::columns::Columns;
use super::fields::{Parsed, parse};
use super::shape::Role;
use palpate_tactile::capture::{CAPTURE_MAGIC, Captured, LONGEST_RECORD, read_record};
use std::io::{self, Read};

/// Time between lines that have no clock (s): the paper's board takes 50 samples a second.
const PACE_S: f64 = 0.02;
/// Largest step of the clock between two lines of a raw file (s).
const FARTHEST_S: f64 = 10.0;

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

/// Times of arrival of a raw file.
#[derive(Debug, Default)]
struct Pace {
    now_s: f64,
    clock: Option<f64>,
    columns: Columns,
}

impl<R: Read> CaptureReader<R> {
    /// A reader of either form.
    pub fn new(mut source: R) -> io::Result<Self> {
        let mut head = Vec::new();
        source.by_ref().take(CAPTURE_MAGIC.len() as u64).read_to_end(&mut head)?;
        let form = if head == CAPTURE_MAGIC {
            Form::Stamped
        } else {
            Form::Raw { pace: Pace::default(), waiting: head, ended: false }
        };
        Ok(Self { source, form })
    }

    /// The next line of a raw file, with what ends it.
    fn raw(source: &mut R, pace: &mut Pace, waiting: &mut Vec<u8>, ended: &mut bool) -> io::Result<Option<Captured>> {
        loop {
            let end = waiting.iter().position(|byte| *byte == b'\n').map(|at| at + 1);
            let end = end.or_else(|| (*ended || waiting.len() >= LONGEST_RECORD).then_some(waiting.len()));
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

impl Pace {
    fn go_on(&mut self, line: &[u8]) {
        let clock = match parse(line, self.columns.sensors()) {
            Ok(Parsed::Named(_, fields)) => Role::time_s(&fields),
            Ok(Parsed::Columns(values)) => Role::time_s(&self.columns.name(values, None)),
            Ok(Parsed::Header(names)) => {
                self.columns.set_header(names);
                None
            }
            Err(_) => None,
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
            Form::Stamped => read_record(&mut self.source),
            Form::Raw { pace, waiting, ended } => Self::raw(&mut self.source, pace, waiting, ended),
        }
        .transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn raw_files_get_the_pace_of_their_clock_or_of_fifty_lines_a_second() -> io::Result<()> {
        let times = |text: &str| -> io::Result<Vec<f64>> {
            CaptureReader::new(text.as_bytes())?.map(|piece| piece.map(|piece| piece.arrived_s())).collect()
        };
        let close = |found: &[f64], wanted: &[f64]| found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(close(&times("1,2\n3,4\r\n5,6")?, &[0.02, 0.04, 0.06]));
        let clocked = times("t_us:1000,a:1\nt_us:6000,a:1\nt_us:16000,a:1\n")?;
        assert!(clocked.len() == 3 && close(&clocked, &[0.02, 0.025, 0.035]), "{clocked:?}");
        for slow in ["millis:500,a:1\nmillis:700,a:2\n", "9,9\n9,9\nmillis,a\n500,1\n700,2\n"] {
            let found = times(slow)?;
            assert!((found[found.len() - 1] - found[found.len() - 2] - 0.2).abs() < 1e-9, "{slow}: {found:?}");
        }
        assert!(times("")?.is_empty());
        Ok(())
    }
}
