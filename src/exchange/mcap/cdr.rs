//! CDR, the encoding of ROS 2 messages: little-endian, each number aligned to its size. Source: OMG, *DDS Interoperability
//! Wire Protocol* 2.5, chapter 10.

/// Header of a little-endian message. Alignment counts from behind it.
const HEADER: [u8; 4] = [0, 1, 0, 0];

/// Longest sequence that is read: more numbers at once are an image, not channels.
const LONGEST_SEQUENCE: u32 = 4096;

/// Writes a message.
#[derive(Debug)]
pub(super) struct CdrWriter {
    bytes: Vec<u8>,
}

impl CdrWriter {
    pub(super) fn new() -> Self {
        Self { bytes: HEADER.to_vec() }
    }

    fn align(&mut self, size: usize) {
        let body = self.bytes.len() - HEADER.len();
        self.bytes.resize(HEADER.len() + body.next_multiple_of(size), 0);
    }

    pub(super) fn u8(&mut self, value: u8) {
        self.bytes.push(value);
    }

    pub(super) fn u32(&mut self, value: u32) {
        self.align(4);
        self.bytes.extend(value.to_le_bytes());
    }

    pub(super) fn f32(&mut self, value: f32) {
        self.u32(value.to_bits());
    }

    pub(super) fn f64(&mut self, value: f64) {
        self.align(8);
        self.bytes.extend(value.to_le_bytes());
    }

    /// Text, with its length and a closing zero.
    pub(super) fn text(&mut self, text: &str) {
        self.u32(text.len() as u32 + 1);
        self.bytes.extend(text.as_bytes());
        self.bytes.push(0);
    }

    pub(super) fn numbers(&mut self, numbers: impl ExactSizeIterator<Item = f64>) {
        self.u32(numbers.len() as u32);
        numbers.for_each(|number| self.f64(number));
    }

    /// Nanoseconds since 1970 as seconds and nanoseconds.
    pub(super) fn time(&mut self, ns: u64) {
        self.u32((ns / 1_000_000_000) as u32);
        self.u32((ns % 1_000_000_000) as u32);
    }

    pub(super) fn finish(self) -> Vec<u8> {
        self.bytes
    }
}

/// Reads a message of any program: every length is checked, and nothing is read beyond its end.
#[derive(Clone, Debug)]
pub(super) struct CdrReader<'a> {
    body: &'a [u8],
    at: usize,
    big_endian: bool,
}

impl<'a> CdrReader<'a> {
    /// Begins a message; none where it is not plain CDR.
    pub(super) fn new(bytes: &'a [u8]) -> Option<Self> {
        let (header, body) = bytes.split_at_checked(HEADER.len())?;
        let big_endian = match header {
            [0, 0, ..] => true,
            [0, 1, ..] => false,
            _ => return None,
        };
        Some(Self { body, at: 0, big_endian })
    }

    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let end = self.at.checked_add(count)?;
        let taken = self.body.get(self.at..end)?;
        self.at = end;
        Some(taken)
    }

    fn number<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.at = self.at.next_multiple_of(N);
        let mut bytes: [u8; N] = self.take(N)?.try_into().ok()?;
        if self.big_endian {
            bytes.reverse();
        }
        Some(bytes)
    }

    pub(super) fn u16(&mut self) -> Option<u16> {
        self.number().map(u16::from_le_bytes)
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        self.number().map(u32::from_le_bytes)
    }

    pub(super) fn f32(&mut self) -> Option<f32> {
        self.number().map(f32::from_le_bytes)
    }

    pub(super) fn f64(&mut self) -> Option<f64> {
        self.number().map(f64::from_le_bytes)
    }

    pub(super) fn text(&mut self) -> Option<&'a str> {
        let length = self.u32()? as usize;
        let bytes = self.take(length)?;
        std::str::from_utf8(bytes.strip_suffix(&[0]).unwrap_or(bytes)).ok()
    }

    /// Length of a sequence whose elements take at least `size` bytes each; none where they cannot all be there, or are more
    /// than a channel can be.
    pub(super) fn length(&mut self, size: usize) -> Option<usize> {
        let length = self.u32().filter(|length| *length <= LONGEST_SEQUENCE)? as usize;
        (length.checked_mul(size)? <= self.body.len().saturating_sub(self.at)).then_some(length)
    }

    pub(super) fn numbers(&mut self) -> Option<Vec<f64>> {
        let length = self.length(8)?;
        (0..length).map(|_| self.f64()).collect()
    }

    pub(super) fn small_numbers(&mut self) -> Option<Vec<f64>> {
        let length = self.length(4)?;
        (0..length).map(|_| self.f32().map(f64::from)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_aligned_and_read_back() {
        let mut out = CdrWriter::new();
        out.text("ab");
        out.f64(-1.5);
        out.u32(7);
        out.numbers([0.1, f64::NAN].into_iter());
        let bytes = out.finish();
        // Four bytes of length, three of text, one of padding; then the number.
        assert_eq!(bytes[..12], [0, 1, 0, 0, 3, 0, 0, 0, b'a', b'b', 0, 0]);
        assert_eq!(bytes.len(), 4 + 8 + 8 + 4 + 4 + 16);
        let mut back = CdrReader::new(&bytes).expect("a message");
        assert_eq!((back.text(), back.f64(), back.u32()), (Some("ab"), Some(-1.5), Some(7)));
        let numbers = back.numbers().expect("two");
        assert!(numbers[0].to_bits() == 0.1f64.to_bits() && numbers[1].is_nan());
        for cut in 0..bytes.len() {
            let whole = CdrReader::new(&bytes[..cut]).and_then(|mut cut| {
                cut.text()?;
                cut.f64()?;
                cut.u32()?;
                cut.numbers()
            });
            assert!(whole.is_none());
        }
    }

    #[test]
    fn huge_lengths_ask_for_no_memory() {
        let mut out = CdrWriter::new();
        out.u32(u32::MAX);
        out.f64(1.0);
        let bytes = out.finish();
        assert!(CdrReader::new(&bytes).expect("a message").numbers().is_none());
        assert!(CdrReader::new(&bytes).expect("a message").text().is_none());
        assert!(CdrReader::new(&[0, 9, 0, 0]).is_none());
        let big = [0, 0, 0, 0, 0, 0, 0, 5];
        assert_eq!(CdrReader::new(&big).and_then(|mut reader| reader.u32()), Some(5));
    }
}
