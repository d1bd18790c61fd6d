//! Single fields: names, times, readings, and the words for sizes and shapes.

use super::LONGEST_NAME;
use super::import_error::{ImportFault, brief};
use std::borrow::Cow;
use std::str::FromStr;

/// Words for the size of an object.
pub(super) const SIZES: [&str; 2] = ["tiny", "large"];

/// Words for the shape of an object.
pub(super) const SHAPES: [&str; 3] = ["cubic", "cylindrical", "spherical"];

/// What a field of a sensor channel says.
#[derive(Debug, PartialEq)]
pub(super) enum Reading {
    /// A finite number.
    Number(f32),
    /// Nothing: empty, `nan`, `NA` or `null`.
    Missing,
    /// An infinity, or a number too large for 32 bits.
    Infinite,
    /// Anything else.
    Text,
}

/// How numbers are written in a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Numbers {
    /// `0,5` is one half. Only where the comma does not separate fields.
    pub(super) decimal_comma: bool,
}

impl Numbers {
    fn parse<T: FromStr>(self, text: &str) -> Option<T> {
        let comma = self.decimal_comma && text.contains(',') && !text.contains('.');
        let text = if comma { Cow::from(text.replacen(',', ".", 1)) } else { Cow::from(text) };
        text.parse().ok()
    }

    /// A reading in single precision, as the text nearest to it.
    pub(super) fn reading(self, field: &str) -> Reading {
        let field = field.trim();
        if ["", "na", "null"].iter().any(|word| field.eq_ignore_ascii_case(word)) {
            return Reading::Missing;
        }
        match self.parse::<f32>(field) {
            Some(value) if value.is_nan() => Reading::Missing,
            Some(value) if value.is_infinite() => Reading::Infinite,
            Some(value) => Reading::Number(value),
            None => Reading::Text,
        }
    }

    /// A time (s).
    pub(super) fn time(self, field: &str) -> Result<f64, ImportFault> {
        let field = field.trim();
        if field.is_empty() {
            return Err(ImportFault::EmptyField { column: "t_s".to_owned() });
        }
        match self.parse::<f64>(field) {
            Some(t) if t.abs() <= super::FARTHEST_TIME_S => Ok(t),
            Some(t) if t.is_finite() => Err(ImportFault::FarTime { t_s: t }),
            _ => Err(ImportFault::BadTime { text: brief(field) }),
        }
    }
}

/// A name as written, without the blanks around it; it may be empty.
pub(super) fn name<'a>(field: &'a [u8], column: &str) -> Result<&'a str, ImportFault> {
    let Ok(text) = std::str::from_utf8(field) else {
        return Err(ImportFault::NotUtf8 { column: column.to_owned() });
    };
    let text = text.trim_matches(|c: char| c.is_whitespace() || c == '\u{feff}');
    let length = text.chars().count();
    if length > LONGEST_NAME {
        return Err(ImportFault::LongName { column: column.to_owned(), length });
    }
    if text.chars().any(char::is_control) {
        return Err(ImportFault::ControlCharacter { column: column.to_owned(), text: brief(text) });
    }
    Ok(text)
}

/// A name that must be there.
pub(super) fn filled_name<'a>(field: &'a [u8], column: &str) -> Result<&'a str, ImportFault> {
    match name(field, column)? {
        "" => Err(ImportFault::EmptyField { column: column.to_owned() }),
        text => Ok(text),
    }
}

/// One of `allowed` in any case, or nothing.
pub(super) fn word(
    field: &[u8],
    column: &'static str,
    allowed: &[&'static str],
) -> Result<Option<&'static str>, ImportFault> {
    let text = name(field, column)?;
    if text.is_empty() {
        return Ok(None);
    }
    match allowed.iter().find(|word| word.eq_ignore_ascii_case(text)) {
        Some(word) => Ok(Some(word)),
        None => Err(ImportFault::BadWord { column, word: brief(text), allowed: allowed.join(", ") }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_are_numbers_gaps_or_text() {
        let point = Numbers { decimal_comma: false };
        let comma = Numbers { decimal_comma: true };
        assert_eq!(point.reading(" 0.1 "), Reading::Number(0.1));
        assert_eq!(comma.reading("-0,5e1"), Reading::Number(-5.0));
        assert_eq!(comma.reading("0.5"), Reading::Number(0.5));
        for field in ["0,5", "1,000.5", "1,2,3", "contact", "0x10", "1 000"] {
            assert_eq!(point.reading(field), Reading::Text, "{field}");
        }
        assert_eq!(comma.reading("1.000,5"), Reading::Text);
        for field in ["", " ", "NaN", "-nan", "NA", "null"] {
            assert_eq!(point.reading(field), Reading::Missing, "{field}");
        }
        for field in ["inf", "-Infinity", "1e39"] {
            assert_eq!(point.reading(field), Reading::Infinite, "{field}");
        }
    }

    #[test]
    fn words_are_read_in_any_case() {
        assert_eq!(word(b" Tiny ", "size", &SIZES).expect("allowed"), Some("tiny"));
        assert_eq!(word(b"", "size", &SIZES).expect("may be empty"), None);
        let refused = word(b"huge", "size", &SIZES).expect_err("no such size").to_string();
        assert_eq!(refused, "\"huge\" is not a size; allowed are tiny, large, or an empty field");
    }
}
