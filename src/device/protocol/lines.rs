//! Bytes to lines. A line ends with LF, CR or both. The first line is most often the end of one, and is marked. A line longer
//! than [`MAX_LINE`] is skipped to its end and reported once.

/// Longest line (bytes): thirty-two channels with long names fit. It bounds the memory of a stream without line ends.
pub const MAX_LINE: usize = 1024;

/// First byte of a remark, found nowhere else: such a line is whole even as the first.
const OPENING: u8 = b'#';

/// Raw line, without its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Line<'a> {
    /// Its bytes.
    Whole(&'a [u8]),
    /// The first line: its beginning may be missing.
    First(&'a [u8]),
    /// Longer than [`MAX_LINE`].
    TooLong,
}

/// Splits a stream into lines, chunk by chunk.
#[derive(Clone, Debug)]
pub(super) struct LineSplitter {
    begun: Vec<u8>,
    state: State,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// In the first line, whose beginning may be missing.
    First,
    /// In a whole line.
    Inside,
    /// In a line that is too long.
    Passing,
}

impl Default for LineSplitter {
    fn default() -> Self {
        Self { begun: Vec::new(), state: State::First }
    }
}

impl LineSplitter {
    /// Takes in bytes and passes on each complete line that is not empty.
    pub(super) fn push(&mut self, bytes: &[u8], mut take: impl FnMut(Line<'_>)) {
        for &byte in bytes {
            if byte == b'\n' || byte == b'\r' {
                self.end_line(&mut take);
            } else if self.begun.len() < MAX_LINE {
                self.begun.push(byte);
            } else if self.state != State::First {
                self.state = State::Passing;
            }
        }
    }

    fn end_line(&mut self, take: &mut impl FnMut(Line<'_>)) {
        match self.state {
            State::Passing => take(Line::TooLong),
            State::First | State::Inside if self.begun.is_empty() => {}
            State::First if self.begun.first() != Some(&OPENING) => take(Line::First(&self.begun)),
            State::First | State::Inside => take(Line::Whole(&self.begun)),
        }
        self.begun.clear();
        self.state = State::Inside;
    }

    /// Marks an interruption: drops the unfinished line; the next one may lack its beginning.
    pub(super) fn interrupt(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn lines(chunks: &[&[u8]]) -> Vec<String> {
        let mut splitter = LineSplitter::default();
        let mut found = Vec::new();
        for chunk in chunks {
            splitter.push(chunk, |line| {
                found.push(match line {
                    Line::Whole(bytes) => String::from_utf8_lossy(bytes).into_owned(),
                    Line::First(bytes) => format!("first {}", String::from_utf8_lossy(bytes)),
                    Line::TooLong => "TOO LONG".to_owned(),
                });
            });
        }
        found
    }

    #[test]
    fn the_first_line_is_told_as_such_and_every_kind_of_end_ends() {
        assert_eq!(lines(&[b"12,13\n1,2\r\n3,", b"4\r5,6\n\n7"]), ["first 12,13", "1,2", "3,4", "5,6"]);
        assert_eq!(lines(&[b"# tactile-gripper fw=1\n1,2\n"]), ["# tactile-gripper fw=1", "1,2"]);
    }

    #[test]
    fn a_line_that_never_ends_costs_one_line_and_bounded_memory() {
        let mut splitter = LineSplitter::default();
        let mut too_long = Vec::new();
        splitter.push(b"\n", |_| {});
        for _ in 0..1000 {
            splitter.push(&[b'x'; 1000], |line| too_long.push(line == Line::TooLong));
            assert!(splitter.begun.capacity() <= 2 * MAX_LINE);
        }
        splitter.push(b"\n1,2\n", |line| too_long.push(line == Line::TooLong));
        assert_eq!(too_long, [true, false]);
    }

    proptest! {
        #[test]
        fn how_a_stream_is_cut_into_chunks_does_not_matter(bytes in prop::collection::vec(prop_oneof![
            Just(b'\n'), Just(b'\r'), Just(b','), any::<u8>()], 0..3000), cut in 1usize..700) {
            let chunks: Vec<&[u8]> = bytes.chunks(cut).collect();
            prop_assert_eq!(lines(&chunks), lines(&[&bytes]));
        }
    }
}
