//! Checksum at the end of a line: `p_bar:0.55,ck:2698`. Without it a lost or changed digit goes unnoticed.
//!
//! It is the CRC-16 of all bytes before the separator and the key, as a decimal number, so that plotters read it as one more
//! named number: CCITT polynomial 0x1021, from 0xffff, highest bit first ("CRC-16/IBM-3740"). It finds every change within
//! 16 bits; any other damage passes once in 65536 times.

/// Key of the checksum, in lines and in the handshake.
pub(super) const KEY: &str = "ck";

/// CRC-16 of bytes.
pub fn checksum(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xffff, |sum, byte| {
        (0..8).fold(sum ^ u16::from(*byte) << 8, |sum, _| if sum & 0x8000 == 0 { sum << 1 } else { sum << 1 ^ 0x1021 })
    })
}

/// Whether a line ends in a checksum; an error where it is wrong. `mark` separates the key from its number.
pub(super) fn ends_in_one(line: &[u8], mark: char) -> Result<bool, &'static str> {
    let line = line.trim_ascii_end();
    let last = line.iter().rposition(|byte| b",; \t".contains(byte)).unwrap_or(0);
    let (body, word) = line.split_at(last);
    let word = std::str::from_utf8(word).unwrap_or_default().trim_start_matches([',', ';', ' ', '\t']);
    let Some(number) = word.strip_prefix(KEY).and_then(|rest| rest.strip_prefix(mark)) else { return Ok(false) };
    // Compared as text: a sign or a leading zero is damage too.
    if number == checksum(body).to_string() { Ok(true) } else { Err("wrong checksum") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_catalogues() {
        // The check value of CRC-16/IBM-3740 in the catalogue of parametrised CRC algorithms.
        assert_eq!((checksum(b"123456789"), checksum(b"")), (0x29b1, 0xffff));
    }

    #[test]
    fn whatever_one_byte_becomes_is_found() {
        let body = "t_us:20000,seq:1,flexL:1432.5,flexR:1401.0,fsrL:0.0,fsrR:0.0";
        let line = format!("{body},ck:{}", checksum(body.as_bytes())).into_bytes();
        assert_eq!((ends_in_one(&line, ':'), ends_in_one(body.as_bytes(), ':')), (Ok(true), Ok(false)));
        assert_eq!(ends_in_one(&[line.as_slice(), b" \r"].concat(), ':'), Ok(true));
        for at in 0..line.len() {
            let mut lost = line.clone();
            lost.remove(at);
            let twice = [&line[..=at], &line[at..]].concat();
            assert_ne!(ends_in_one(&lost, ':'), Ok(true), "{at}");
            assert_ne!(ends_in_one(&twice, ':'), Ok(true), "{at}");
            for value in (0..=255).filter(|value| *value != line[at]) {
                let mut changed = line.clone();
                changed[at] = value;
                // Which separator stands before the key changes no number.
                let harmless = at == body.len() && b",; \t".contains(&value);
                assert_eq!(ends_in_one(&changed, ':') == Ok(true), harmless, "{at} {value}");
            }
        }
        // Nor may a cut pass for one: the number's beginning is no number of its own.
        assert!((1..line.len()).all(|end| ends_in_one(&line[..end], ':') != Ok(true)));
    }
}
