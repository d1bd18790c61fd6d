//! A table in a file: where its header stands, what separates its fields, what its columns are called.

use super::{LARGEST_FILE, LONGEST_NAME, LONGEST_ROW, brief};
use crate::mapping::{Mapping, PROFILES, named_column};
use csv::ByteRecord;
use palpate_geometry::is_invisible;
use palpate_tactile::{Dimension, Unit};
use std::io::{BufRead, BufReader, Read};

/// A fault with its line.
pub(super) type Fault = (Option<u64>, String);

/// A table whose header has been read.
pub(super) struct Opened<R> {
    pub(super) reader: csv::Reader<Limited<R>>,
    pub(super) header: ByteRecord,
    /// Line of the header.
    pub(super) line: u64,
    /// The first row, where the table has no header.
    pub(super) first: Option<ByteRecord>,
    pub(super) decimal_comma: bool,
}

impl<R: Read> Opened<R> {
    pub(super) fn open(reader: R, mapping: &Mapping) -> Result<Self, Fault> {
        let mut reader = BufReader::with_capacity(64 << 10, reader);
        for _ in 0..mapping.skip {
            reader.skip_until(b'\n').map_err(|e| (None, e.to_string()))?;
        }
        let head = reader.fill_buf().map_err(|e| (None, e.to_string()))?;
        let separator = mapping.delimiter.map_or_else(|| separator(head, mapping), |delimiter| delimiter as u8);
        let source = Limited {
            bytes: reader.bytes(),
            after_return: false,
            ended: false,
            total: 0,
            row: 0,
            skipped: mapping.skip,
        };
        let mut reader =
            csv::ReaderBuilder::new().delimiter(separator).has_headers(false).flexible(true).from_reader(source);
        let mut header = ByteRecord::new();
        let line = loop {
            let line = next_row(&mut reader, &mut header)?.ok_or_else(|| empty("header"))?;
            match preamble(&header) {
                Preamble::None => break line,
                Preamble::Skipped => {}
                Preamble::Header(own) => {
                    header = own;
                    break line;
                }
            }
        };
        let decimal_comma = separator != b',';
        let is_number = |field: &[u8]| number(String::from_utf8_lossy(field).trim(), decimal_comma).is_some();
        let by_number = mapping.is_by_number() && header.iter().any(is_number);
        let first = (by_number || header.iter().all(is_number)).then(|| header.clone());
        if first.is_some() {
            header = (1..=header.len()).map(|number| number.to_string().into_bytes()).collect();
        }
        Ok(Self { reader, header, line, first, decimal_comma })
    }
}

pub(super) fn empty(what: &str) -> Fault {
    (None, format!("the file has no {what}; it should have a header and below it one row per sample"))
}

/// Names of the columns of a table.
pub(super) fn columns(reader: impl Read, mapping: &Mapping) -> Result<Vec<String>, Fault> {
    let table = Opened::open(reader, mapping)?;
    let header = Header::read(&table.header).map_err(|fault| (Some(table.line), fault))?;
    Ok(header.whole.into_iter().map(str::to_owned).collect())
}

/// What a row above the data is.
enum Preamble {
    None,
    /// A remark after `#`, or the line `sep=;` of spreadsheets.
    Skipped,
    /// A header after `#`, as numpy writes it.
    Header(ByteRecord),
}

fn preamble(record: &ByteRecord) -> Preamble {
    let first = record[0].strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&record[0]).trim_ascii();
    let Some(rest) = first.strip_prefix(b"#") else {
        return if first.starts_with(b"sep=") { Preamble::Skipped } else { Preamble::None };
    };
    let fields: ByteRecord = std::iter::once(rest).chain(record.iter().skip(1)).collect();
    if number_of(&fields, &REQUIRED) == REQUIRED.len() { Preamble::Header(fields) } else { Preamble::Skipped }
}

/// Columns that every table of this program has.
pub(super) const REQUIRED: [&str; 3] = ["trial", "label", TIME];
/// Column of times (s).
pub(super) const TIME: &str = "t_s";

/// Number of columns in a header that have one of these names.
fn number_of(header: &ByteRecord, wanted: &[&str]) -> usize {
    let names: Vec<&str> = header.iter().filter_map(|field| name(field, "header").ok()).collect();
    let has = |wanted: &str| names.iter().any(|name| is_called(name, wanted));
    wanted.iter().filter(|wanted| has(wanted)).count()
}

/// True where a column of a header, with or without its unit, is meant.
pub(super) fn is_called(column: &str, wanted: &str) -> bool {
    column == wanted || without_unit(column).0.eq_ignore_ascii_case(without_unit(wanted).0)
}

/// Names and units of the columns of a table.
pub(super) struct Header<'a> {
    /// As they stand there.
    pub(super) whole: Vec<&'a str>,
    pub(super) names: Vec<(&'a str, Option<&'a str>)>,
}

impl<'a> Header<'a> {
    pub(super) fn read(header: &'a ByteRecord) -> Result<Self, String> {
        let whole = header.iter().map(|field| name(field, "header")).collect::<Result<Vec<_>, _>>()?;
        let names = whole.iter().map(|text| without_unit(text)).collect();
        Ok(Self { whole, names })
    }

    /// Place and unit of a column that is named with or without its unit.
    pub(super) fn column<'b>(&'b self, wanted: &'b str) -> Option<(usize, Option<&'b str>)> {
        if let Some(at) = self.whole.iter().position(|text| *text == wanted) {
            return Some((at, self.names[at].1));
        }
        let (name, unit) = without_unit(wanted);
        let at = self.names.iter().position(|(own, _)| own.eq_ignore_ascii_case(name))?;
        Some((at, unit.or(self.names[at].1)))
    }

    /// The same for a column that has to be there.
    pub(super) fn needed<'b>(&'b self, wanted: &'b str) -> Result<(usize, Option<&'b str>), String> {
        self.column(wanted).ok_or_else(|| self.lacks(&[wanted]))
    }

    /// The same for times, whose unit may be the end of a name such as `timestamp_ms`. Seconds may be a habit of the name alone.
    pub(super) fn time<'b>(&'b self, wanted: &'b str) -> Result<(usize, Option<&'b str>), String> {
        let (at, unit) = self.needed(wanted)?;
        let end = self.names[at].0.rsplit_once(['_', ' ']).map(|(_, end)| end);
        Ok((at, unit.or(end.filter(|end| ["ms", "us", "ns"].contains(end)))))
    }

    /// Some columns are not there.
    pub(super) fn lacks(&self, missing: &[&str]) -> String {
        let missing: Vec<String> = missing.iter().map(|name| format!("\"{}\"", brief(name))).collect();
        let few = if self.whole.len() > 2 {
            ""
        } else {
            "; --skip N passes over lines above the header, --delimiter C names another character between fields"
        };
        format!("there is no column {}; the file has {}{few}", missing.join(" and no "), self.listed())
    }

    fn listed(&self) -> String {
        let mut found: Vec<String> =
            self.whole.iter().filter(|text| !text.is_empty()).map(|text| brief(text)).collect();
        found.truncate(20);
        found.join(", ")
    }
}

/// Factor of a unit of time to seconds; none where no unit is named.
pub(super) fn time_factor(unit: Option<&str>) -> Result<Option<f64>, String> {
    let of_time = |text: &str| Unit::parse(text).filter(|unit| unit.dimension == Dimension::Time);
    let no_time = |text: &str| format!("\"{}\" is no unit of time; known are s, ms, us, ns and min", brief(text));
    let unit = unit.map(|text| of_time(text).ok_or_else(|| no_time(text))).transpose()?;
    Ok(unit.map(|unit| unit.factor))
}

/// Reads the next row that is not blank and returns the line on which it begins, or none at the end.
pub(super) fn next_row<R: Read>(
    reader: &mut csv::Reader<Limited<R>>,
    record: &mut ByteRecord,
) -> Result<Option<u64>, Fault> {
    loop {
        reader.get_mut().row = 0;
        // The reader stops on the line after the row; the record's own position may be a blank line before it.
        let more = reader.read_byte_record(record);
        let breaks = record.as_slice().iter().filter(|byte| **byte == b'\n').count() as u64;
        let line = reader.get_ref().skipped + reader.position().line().saturating_sub(1 + breaks).max(1);
        match more.map_err(csv::Error::into_kind) {
            Ok(false) => return Ok(None),
            Ok(true) if is_blank(record) => {}
            Ok(true) => return Ok(Some(line)),
            Err(csv::ErrorKind::Io(cause)) => return Err((None, cause.to_string())),
            Err(other) => return Err((None, format!("{other:?}"))),
        }
    }
}

/// True for a row of separators only, as spreadsheets write them.
fn is_blank(record: &ByteRecord) -> bool {
    record.as_slice().iter().all(|byte| byte.is_ascii_whitespace() || b",;".contains(byte))
}

/// Of comma, semicolon and tab, the one that finds most of the wanted columns in the header, or else most columns.
fn separator(head: &[u8], mapping: &Mapping) -> u8 {
    let named = [&mapping.time, &mapping.trial, &mapping.label, &mapping.name, &mapping.value].into_iter().flatten();
    let columns = mapping.channels.iter().map(|channel| named_column(channel).1);
    let known = mapping.known_by.iter().map(String::as_str);
    let wanted: Vec<&str> = REQUIRED.into_iter().chain(named.map(String::as_str)).chain(columns).chain(known).collect();
    let score = |separator: u8| {
        let mut reader =
            csv::ReaderBuilder::new().delimiter(separator).has_headers(false).flexible(true).from_reader(head);
        let rows = reader.byte_records().filter_map(Result::ok).filter(|row| !is_blank(row));
        let header = rows.map(|row| match preamble(&row) {
            Preamble::None => Some(row),
            Preamble::Skipped => None,
            Preamble::Header(own) => Some(own),
        });
        let header = header.flatten().next().unwrap_or_default();
        (number_of(&header, &wanted), header.len())
    };
    // The last of equals wins, and a comma is the likeliest.
    [b'\t', b';', b','].into_iter().max_by_key(|s| score(*s)).unwrap_or(b',')
}

/// `pressure_left [Pa]` is the name `pressure_left` and the unit `Pa`; also in round brackets, where it is a unit.
pub(super) fn without_unit(text: &str) -> (&str, Option<&str>) {
    for (open, close) in [('[', ']'), ('(', ')')] {
        if let Some((name, unit)) = text.strip_suffix(close).and_then(|rest| rest.rsplit_once(open))
            && !name.trim().is_empty()
            && (open == '[' || Unit::parse(unit).is_some())
        {
            return (name.trim(), Some(unit.trim()));
        }
    }
    (text, None)
}

/// A name without the blanks around it; it may be empty.
pub(super) fn name<'a>(field: &'a [u8], column: &str) -> Result<&'a str, String> {
    let text = std::str::from_utf8(field).map_err(|_utf8| {
        format!("the column \"{column}\" holds bytes that are not UTF-8; save the file as \"CSV UTF-8\"")
    })?;
    let text = text.trim_matches(|c: char| c.is_whitespace() || c == '\u{feff}');
    let text = text.strip_prefix('\'').and_then(|rest| rest.strip_suffix('\'')).unwrap_or(text).trim();
    let length = text.chars().count();
    if length > LONGEST_NAME {
        return Err(format!(
            "the name in \"{column}\" has {length} characters, the limit is {LONGEST_NAME}; shorten it"
        ));
    }
    if text.chars().any(|c| c.is_control() || is_invisible(c)) {
        let text = brief(text);
        return Err(format!(
            "the name \"{text}\" in \"{column}\" has a line break or another character in it that is not seen; remove it"
        ));
    }
    Ok(text)
}

/// A name that must not be empty.
pub(super) fn filled_name<'a>(field: &'a [u8], column: &str) -> Result<&'a str, String> {
    match name(field, column)? {
        "" => Err(empty_field(column)),
        text => Ok(text),
    }
}

pub(super) fn empty_field(column: &str) -> String {
    format!("the column \"{column}\" is empty; every row names its trial, label and time")
}

/// A table whose columns have other names, and what to do.
pub(super) fn unmapped(header: &Header<'_>, missing: &[&str]) -> String {
    let advice = match Mapping::known_for(&header.whole) {
        Some((name, profile)) => format!("it looks like a file of {}: add --profile {name}", profile.title),
        None => {
            let like_time =
                |text: &&&str| text.to_ascii_lowercase().contains("time") || **text == "t" || text.starts_with("t_");
            let time = header.whole.iter().find(like_time).map_or("COLUMN [s]", |text| text);
            format!(
                "say which columns hold them, as in --time \"{}\" --trial COLUMN --label COLUMN (or --label NAME), or name a \
                 --profile ({})",
                brief(time),
                PROFILES.map(|(name, _)| name).join(", ")
            )
        }
    };
    format!("{}; {advice}", header.lacks(missing))
}

pub(super) fn file_too_large() -> String {
    format!("the file is larger than {} GiB; split it", LARGEST_FILE >> 30)
}

/// A number; with decimal commas `0,5` is one half.
pub(super) fn number(text: &str, decimal_comma: bool) -> Option<f64> {
    if decimal_comma && text.contains(',') && !text.contains('.') {
        return text.replacen(',', ".", 1).parse().ok();
    }
    text.parse().ok()
}

/// A reader that ends every line with one line feed, so that lines can be counted, and that limits files and rows.
pub(super) struct Limited<R> {
    bytes: std::io::Bytes<BufReader<R>>,
    after_return: bool,
    ended: bool,
    /// Bytes handed out.
    total: u64,
    /// Bytes handed out since the present row began.
    row: u64,
    /// Lines above the header that were skipped.
    skipped: u64,
}

impl<R: Read> Read for Limited<R> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        let mut count = 0;
        while count < out.len() {
            let byte = match self.bytes.next().transpose()? {
                Some(byte) => byte,
                None if std::mem::replace(&mut self.ended, true) => break,
                None => b'\n',
            };
            let second_half = byte == b'\n' && self.after_return;
            self.after_return = byte == b'\r';
            if !second_half {
                out[count] = if byte == b'\r' { b'\n' } else { byte };
                count += 1;
            }
        }
        self.total += count as u64;
        self.row += count as u64;
        if self.total > LARGEST_FILE {
            return Err(std::io::Error::other(file_too_large()));
        }
        if self.row > LONGEST_ROW {
            let limit = LONGEST_ROW >> 20;
            return Err(std::io::Error::other(format!(
                "the row is longer than {limit} MiB; look for an unclosed quotation mark"
            )));
        }
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_separator_is_the_one_that_finds_the_columns() {
        let separator = |head: &[u8]| separator(head, &Mapping::default());
        assert_eq!(separator(b"trial,label,t_s,p"), b',');
        assert_eq!(separator(b"\n\"trial\";label;t_s;a,b,c,d,e,f\n1,2,3,4"), b';');
        assert_eq!(separator(b"\xEF\xBB\xBFtrial\tlabel\tt_s\tp [a;b]"), b'\t');
        assert_eq!(separator(b"time;class;p"), b';');
        assert_eq!(separator(b""), b',');
    }

    #[test]
    fn numbers_may_have_decimal_commas() {
        assert_eq!((number("-0,5e1", true), number("0.5", true)), (Some(-5.0), Some(0.5)));
        for text in ["0,5", "1,000.5", "1,2,3", "contact", "0x10", "1 000"] {
            assert_eq!(number(text, false), None, "{text}");
        }
        assert_eq!(number("1.000,5", true), None);
    }
}
