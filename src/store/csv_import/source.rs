//! The bytes of a file made uniform before they are taken apart: every line ends with a line feed, also the last, so
//! that lines can be counted; and neither a file nor a row grows without bounds.

use super::import_error::ImportFault;
use super::{LARGEST_FILE, LONGEST_ROW};
use std::io::{ErrorKind, Read};

/// How much is looked at to find the separator (bytes): a header of 200 long names fits.
const HEAD: usize = 64 << 10;

/// A reader with uniform line ends and limits.
pub(super) struct Source<R> {
    inner: R,
    /// Bytes made uniform; those before `served` have been handed out.
    ready: Vec<u8>,
    served: usize,
    after_return: bool,
    ended: bool,
    /// Bytes read from the file.
    total: u64,
    /// Bytes handed out since the current row began.
    row: u64,
}

impl<R: Read> Source<R> {
    pub(super) fn new(inner: R) -> Self {
        Self { inner, ready: Vec::new(), served: 0, after_return: false, ended: false, total: 0, row: 0 }
    }

    /// The beginning of the file, which will be handed out all the same.
    pub(super) fn head(&mut self) -> std::io::Result<&[u8]> {
        while self.ready.len() < HEAD && !self.ended {
            self.fetch()?;
        }
        Ok(&self.ready)
    }

    /// Tells that a row is complete and another begins.
    pub(super) fn row_begins(&mut self) {
        self.row = 0;
    }

    /// Reads some more of the file and makes it uniform.
    fn fetch(&mut self) -> std::io::Result<()> {
        let mut chunk = [0; 8 << 10];
        let count = loop {
            match self.inner.read(&mut chunk) {
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                other => break other?,
            }
        };
        if count == 0 {
            self.ended = true;
            self.ready.push(b'\n');
        }
        self.total += count as u64;
        if self.total > LARGEST_FILE {
            return Err(std::io::Error::other(ImportFault::FileTooLarge));
        }
        for &byte in &chunk[..count] {
            match byte {
                // The second half of a line end that has been written already.
                b'\n' if self.after_return => {}
                b'\r' => self.ready.push(b'\n'),
                other => self.ready.push(other),
            }
            self.after_return = byte == b'\r';
        }
        Ok(())
    }
}

impl<R: Read> Read for Source<R> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        while self.served == self.ready.len() && !self.ended {
            self.ready.clear();
            self.served = 0;
            self.fetch()?;
        }
        let rest = &self.ready[self.served..];
        let count = rest.len().min(out.len());
        out[..count].copy_from_slice(&rest[..count]);
        self.served += count;
        self.row += count as u64;
        if self.row > LONGEST_ROW {
            return Err(std::io::Error::other(ImportFault::RowTooLong));
        }
        Ok(count)
    }
}

/// The fault inside a failure to read: one of ours, or what the system says.
pub(super) fn fault(error: std::io::Error) -> ImportFault {
    match error.downcast::<ImportFault>() {
        Ok(ours) => ours,
        Err(other) => ImportFault::Unreadable { cause: other.to_string() },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_ends_with_one_line_feed() {
        let mut text = String::new();
        Source::new(&b"a\r\nb\rc\n\r\nd"[..]).read_to_string(&mut text).expect("from memory");
        assert_eq!(text, "a\nb\nc\n\nd\n");
    }

    #[test]
    fn the_head_is_handed_out_again() {
        let mut source = Source::new(&b"trial\r\n1"[..]);
        assert_eq!(source.head().expect("from memory"), b"trial\n1\n");
        let mut text = String::new();
        source.read_to_string(&mut text).expect("from memory");
        assert_eq!(text, "trial\n1\n");
    }

    #[test]
    fn a_row_has_an_end() {
        let error = Source::new(std::io::repeat(b'x')).read_to_end(&mut Vec::new()).expect_err("never ends");
        assert!(matches!(fault(error), ImportFault::RowTooLong));
    }
}
