//! Rows of a file gathered into trials. Every row is checked as it comes, and only numbers are kept.

use super::{
    FARTHEST_TIME_S, LARGEST_FILE, LONGEST_NAME, LONGEST_ROW, MOST_CHANNELS, MOST_SAMPLES, MOST_TRIALS, MOST_VALUES,
    brief,
};
use csv::ByteRecord;
use palpate_tactile::{Dimension, Unit, channel_with_unit};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read};
use std::str::FromStr;

/// Readings from here on are no readings: instruments write 9.9e37 (SCPI-99, volume 1, 7.2.1) or infinity.
const OVER_RANGE: f64 = 1e30;

/// A fault with its line.
pub(super) type Fault = (Option<u64>, String);

/// Sizes of an object.
const SIZES: [&str; 2] = ["tiny", "large"];
/// Shapes of an object.
const SHAPES: [&str; 3] = ["cubic", "cylindrical", "spherical"];

/// A trial as it stands in the file.
pub(super) struct RawTrial {
    pub(super) name: String,
    pub(super) label: String,
    /// Line of its first row.
    pub(super) line: u64,
    /// Rising times (s).
    pub(super) t_s: Vec<f64>,
    /// One row of readings per time; NaN where there is none.
    pub(super) values: Vec<f32>,
    /// Rows replaced by a later one at the same time.
    pub(super) repeated: usize,
}

/// A column of readings.
pub(super) struct ChannelColumn {
    place: usize,
    pub(super) name: String,
    /// Factor of its numbers to the unit in which they are kept.
    factor: f64,
    /// It holds a number.
    pub(super) numeric: bool,
    /// Line and beginning of its first text.
    pub(super) text: Option<(u64, String)>,
}

/// All rows of a file.
pub(super) struct Rows {
    /// In the order in which they begin.
    pub(super) trials: Vec<RawTrial>,
    /// Size and shape of each label.
    pub(super) labels: BTreeMap<String, [Option<&'static str>; 2]>,
    pub(super) channels: Vec<ChannelColumn>,
    /// Places of trial, label and time.
    required: [usize; 3],
    /// Places of size and shape.
    words: [Option<usize>; 2],
    /// Fields of the header.
    width: usize,
    decimal_comma: bool,
    /// Factor of times to seconds; none where the header names no unit.
    time_factor: Option<f64>,
    /// The first numbers with a point and with a comma, each with its line.
    separators: [Option<(u64, String)>; 2],
    by_name: BTreeMap<String, usize>,
    readings: usize,
}

/// Reads all rows below a header.
pub(super) fn read_rows(reader: impl Read, warnings: &mut Vec<String>) -> Result<Rows, Fault> {
    let mut reader = BufReader::with_capacity(64 << 10, reader);
    let separator = separator(reader.fill_buf().map_err(|e| (None, e.to_string()))?);
    let source = Limited { bytes: reader.bytes(), after_return: false, ended: false, total: 0, row: 0 };
    let mut reader =
        csv::ReaderBuilder::new().delimiter(separator).has_headers(false).flexible(true).from_reader(source);
    let mut record = ByteRecord::new();
    let empty =
        |what: &str| (None, format!("the file has no {what}; it should have a header and below it one row per sample"));
    let line = loop {
        let line = next_row(&mut reader, &mut record)?.ok_or_else(|| empty("header"))?;
        match preamble(&record) {
            Preamble::None => break line,
            Preamble::Skipped => {}
            Preamble::Header(own) => {
                record = own;
                break line;
            }
        }
    };
    let mut rows = Rows::below(&record, separator != b',', warnings).map_err(|fault| (Some(line), fault))?;
    while let Some(line) = next_row(&mut reader, &mut record)? {
        if !record[0].starts_with(b"#") {
            rows.add(line, &record)?;
        }
    }
    if rows.trials.is_empty() {
        return Err(empty("row below its header"));
    }
    rows.check_times()?;
    Ok(rows)
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
    if required_in(&fields) == REQUIRED.len() { Preamble::Header(fields) } else { Preamble::Skipped }
}

/// Columns that every file has.
const REQUIRED: [&str; 3] = ["trial", "label", "t_s"];

/// Number of the required columns in a header.
fn required_in(header: &ByteRecord) -> usize {
    let names = header.iter().filter_map(|field| name(field, "header").ok()).map(|text| without_unit(text).0);
    let names: Vec<&str> = names.collect();
    REQUIRED.iter().filter(|wanted| names.iter().any(|name| name.eq_ignore_ascii_case(wanted))).count()
}

/// Reads the next row that is not blank and returns the line on which it begins, or none at the end.
fn next_row<R: Read>(reader: &mut csv::Reader<Limited<R>>, record: &mut ByteRecord) -> Result<Option<u64>, Fault> {
    loop {
        reader.get_mut().row = 0;
        // The reader stops on the line after the row; the record's own position may be a blank line before it.
        let more = reader.read_byte_record(record);
        let breaks = record.as_slice().iter().filter(|byte| **byte == b'\n').count() as u64;
        let line = reader.position().line().saturating_sub(1 + breaks).max(1);
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

/// Of comma, semicolon and tab, the one that finds most of the required columns in the header, or else most columns.
fn separator(head: &[u8]) -> u8 {
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
        (required_in(&header), header.len())
    };
    // The last of equals wins, and a comma is the likeliest.
    [b'\t', b';', b','].into_iter().max_by_key(|s| score(*s)).unwrap_or(b',')
}

/// `pressure_left [Pa]` is the name `pressure_left` and the unit `Pa`; also in round brackets, where it is a unit.
fn without_unit(text: &str) -> (&str, Option<&str>) {
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
fn name<'a>(field: &'a [u8], column: &str) -> Result<&'a str, String> {
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
    if text.chars().any(char::is_control) {
        let text = brief(text);
        return Err(format!(
            "the name \"{text}\" in \"{column}\" has a line break or another control character in it; remove it"
        ));
    }
    Ok(text)
}

/// A name that must not be empty.
fn filled_name<'a>(field: &'a [u8], column: &str) -> Result<&'a str, String> {
    match name(field, column)? {
        "" => Err(empty_field(column)),
        text => Ok(text),
    }
}

fn empty_field(column: &str) -> String {
    format!("the column \"{column}\" is empty; every row names its trial, label and time")
}

impl Rows {
    /// Finds the columns in a header.
    fn below(header: &ByteRecord, decimal_comma: bool, warnings: &mut Vec<String>) -> Result<Self, String> {
        let names = header.iter().map(|f| name(f, "header")).collect::<Result<Vec<_>, _>>()?;
        let names: Vec<(&str, Option<&str>)> = names.into_iter().map(without_unit).collect();
        let place = |wanted: &str| names.iter().position(|(name, _)| name.eq_ignore_ascii_case(wanted));
        let missing: Vec<String> = REQUIRED.iter().filter(|n| place(n).is_none()).map(|n| format!("\"{n}\"")).collect();
        let (Some(trial), Some(label), Some(time)) = (place("trial"), place("label"), place("t_s")) else {
            let mut found: Vec<String> = names.iter().filter(|n| !n.0.is_empty()).map(|n| brief(n.0)).collect();
            found.truncate(20);
            let (missing, found) = (missing.join(" and no "), found.join(", "));
            return Err(format!(
                "there is no column {missing}. Required are trial, label, t_s (in seconds) and one column per sensor \
                 channel; the file has {found}"
            ));
        };
        let of_time = |text: &str| Unit::parse(text).filter(|unit| unit.dimension == Dimension::Time);
        let no_time = |text: &str| format!("\"{}\" is no unit of time; known are s, ms, us, ns and min", brief(text));
        let time_factor = names[time].1.map(|text| of_time(text).ok_or_else(|| no_time(text))).transpose()?;
        let time_factor = time_factor.map(|unit| unit.factor);
        let words = [place("size"), place("shape")];
        let known = [Some(trial), Some(label), Some(time), words[0], words[1]];
        let mut channels: Vec<ChannelColumn> = Vec::new();
        for (at, (name, unit)) in
            names.iter().enumerate().filter(|(at, n)| !n.0.is_empty() && !known.contains(&Some(*at)))
        {
            let reserved = ["trial", "label", "t_s", "size", "shape"].iter().find(|r| r.eq_ignore_ascii_case(name));
            if reserved.is_some() || channels.iter().any(|other| names[other.place].0 == *name) {
                let name = brief(reserved.unwrap_or(name));
                return Err(format!(
                    "two columns are called \"{name}\"; rename or remove one (units in brackets do not count)"
                ));
            }
            if channels.len() == MOST_CHANNELS {
                return Err(format!("there are more than {MOST_CHANNELS} columns of readings; remove some"));
            }
            let (name, factor) = unit.map_or(Ok(((*name).to_owned(), 1.0)), |unit| channel_with_unit(name, unit))?;
            channels.push(ChannelColumn { place: at, name, factor, numeric: false, text: None });
        }
        if channels.is_empty() {
            return Err(no_channels());
        }
        let nameless: Vec<usize> = (1..).zip(&names).filter(|(_, n)| n.0.is_empty()).map(|(at, _)| at).collect();
        if let [first, others @ ..] = nameless.as_slice() {
            let others = if others.is_empty() { String::new() } else { format!(" (and {} more)", others.len()) };
            warnings.push(format!("column {first}{others} has no name in the header and was left out"));
        }
        let (trials, labels, by_name) = (Vec::new(), BTreeMap::new(), BTreeMap::new());
        let (required, width) = ([trial, label, time], names.len());
        Ok(Self {
            trials,
            labels,
            channels,
            required,
            words,
            width,
            decimal_comma,
            time_factor,
            separators: [None, None],
            by_name,
            readings: 0,
        })
    }

    /// Refuses times that may well be numbers of samples, unless the header names their unit.
    fn check_times(&self) -> Result<(), Fault> {
        const FEW: usize = 8;
        let counts = |trial: &&RawTrial| {
            trial.t_s.len() >= FEW
                && trial.t_s.windows(2).all(|pair| pair[1] - pair[0] == 1.0)
                && trial.t_s[0].fract() == 0.0
        };
        match self.trials.iter().find(counts).filter(|_| self.time_factor.is_none()) {
            None => Ok(()),
            Some(trial) => {
                let text = "the times rise by 1 from row to row: seconds, milliseconds, or the numbers of the samples? Name \
                            their unit in the header, as in t_s [ms] or t_s [s]; numbers of samples must become times";
                Err((Some(trial.line), text.to_owned()))
            }
        }
    }

    /// A number of this file. A file that writes some with a point and some with a comma is refused: one of the two may
    /// separate thousands.
    fn number(&mut self, line: u64, field: &str) -> Result<Option<f64>, Fault> {
        let Some(value) = number::<f64>(field, self.decimal_comma) else { return Ok(None) };
        if self.decimal_comma
            && let Some(kind) = [".", ","].iter().position(|separator| field.contains(separator))
        {
            self.separators[kind].get_or_insert_with(|| (line, brief(field)));
            if let [Some((_, point)), Some((_, comma))] = &self.separators {
                return Err((
                    Some(line),
                    format!(
                        "the file writes \"{point}\" with a point and \"{comma}\" with a comma, one of which may separate \
                         thousands; write all numbers without thousands separators and with the same decimal sign"
                    ),
                ));
            }
        }
        Ok(Some(value))
    }

    /// Adds the row that begins at `line`.
    fn add(&mut self, line: u64, record: &ByteRecord) -> Result<(), Fault> {
        let expected = self.width;
        // Empty fields beyond the header are the spreadsheet's.
        if record.len() < expected || record.iter().skip(expected).any(|field| !field.trim_ascii().is_empty()) {
            let found = record.len();
            return Err((
                Some(line),
                format!(
                    "the row has {found} fields but the header has {expected}; look for a missing or extra separator"
                ),
            ));
        }
        let row = self.row(line, record)?;
        self.store(line, record, &row).map_err(|fault| (Some(line), fault))
    }

    /// Reads the channels. A column may hold text as long as it holds no number.
    fn row(&mut self, line: u64, record: &ByteRecord) -> Result<Vec<f32>, Fault> {
        let mut row = Vec::with_capacity(self.channels.len());
        for at in 0..self.channels.len() {
            let field = String::from_utf8_lossy(&record[self.channels[at].place]);
            let field = field.trim();
            let missing = ["", "na", "null"].iter().any(|word| field.eq_ignore_ascii_case(word));
            let read = if missing { Some(f64::NAN) } else { self.number(line, field)? };
            let channel = &mut self.channels[at];
            let value = match read {
                Some(value) if value.abs() >= OVER_RANGE => {
                    return Err((
                        Some(line),
                        format!(
                            "\"{}\" in the column \"{}\" is no reading: instruments write such numbers for \"over range\"; \
                             correct it, or leave the field empty",
                            brief(field),
                            brief(&channel.name)
                        ),
                    ));
                }
                Some(value) => (value * channel.factor) as f32,
                None => {
                    channel.text.get_or_insert_with(|| (line, brief(field)));
                    f32::NAN
                }
            };
            channel.numeric |= value.is_finite();
            if channel.numeric
                && let Some((line, text)) = channel.text.take()
            {
                let advice = if self.decimal_comma || !text.contains(',') {
                    ", or remove the column if it is not a channel"
                } else {
                    "; decimal commas need a semicolon or a tab between the fields"
                };
                return Err((
                    Some(line),
                    format!(
                        "\"{text}\" in the column \"{}\" is not a number; correct it, or leave the field empty{advice}",
                        brief(&channel.name)
                    ),
                ));
            }
            row.push(value);
        }
        Ok(row)
    }

    /// Adds readings to their trial, or replaces those of the same time.
    fn store(&mut self, line: u64, record: &ByteRecord, row: &[f32]) -> Result<(), String> {
        let at = self.trial(line, record)?;
        self.check_words(record)?;
        let now = self.time(line, &record[self.required[2]])?;
        let readings = self.readings + row.len();
        let trial = &mut self.trials[at];
        let name = || brief(&trial.name);
        match trial.t_s.last() {
            Some(before) if *before > now => {
                let wrapped = (4294.0..4296.0).contains(before) && now < 1.0;
                let advice = if wrapped {
                    "a counter of microseconds starts again after 4294.97 s; add that to the times from here on"
                } else {
                    "sort its rows, and give every grasp a trial name of its own"
                };
                return Err(format!("in trial \"{}\" the time falls from {before} s to {now} s; {advice}", name()));
            }
            Some(before) if *before >= now => {
                trial.repeated += 1;
                trial.values.truncate(trial.values.len() - row.len());
            }
            _ if trial.t_s.len() == MOST_SAMPLES => {
                return Err(format!(
                    "trial \"{}\" has more than {MOST_SAMPLES} samples; give every grasp a trial name of its own",
                    name()
                ));
            }
            _ if readings > MOST_VALUES => return Err(too_many_values()),
            _ => {
                trial.t_s.push(now);
                self.readings = readings;
            }
        }
        trial.values.extend_from_slice(row);
        Ok(())
    }

    /// The trial of a row.
    fn trial(&mut self, line: u64, record: &ByteRecord) -> Result<usize, String> {
        let name = filled_name(&record[self.required[0]], "trial")?;
        let label = filled_name(&record[self.required[1]], "label")?;
        let Some(at) = self.by_name.get(name).copied() else {
            if self.trials.len() == MOST_TRIALS {
                return Err(format!("there are more than {MOST_TRIALS} trials; split the file"));
            }
            self.by_name.insert(name.to_owned(), self.trials.len());
            let (name, label) = (name.to_owned(), label.to_owned());
            self.trials.push(RawTrial { name, label, line, t_s: Vec::new(), values: Vec::new(), repeated: 0 });
            return Ok(self.trials.len() - 1);
        };
        if self.trials[at].label != label {
            return Err(format!(
                "the label of trial \"{}\" changes from \"{}\" to \"{}\"; one trial is one grasp of one object",
                brief(name),
                brief(&self.trials[at].label),
                brief(label)
            ));
        }
        Ok(at)
    }

    /// A label has one size and one shape; an empty field leaves it to other rows.
    fn check_words(&mut self, record: &ByteRecord) -> Result<(), String> {
        let label = filled_name(&record[self.required[1]], "label")?;
        if !self.labels.contains_key(label) {
            self.labels.insert(label.to_owned(), [None, None]);
        }
        let Some(known) = self.labels.get_mut(label) else { return Ok(()) };
        let allowed = [("size", SIZES.as_slice()), ("shape", SHAPES.as_slice())];
        for (((column, allowed), place), known) in allowed.into_iter().zip(self.words).zip(known) {
            let Some(place) = place else { continue };
            let text = name(&record[place], column)?;
            if text.is_empty() {
                continue;
            }
            let Some(now) = allowed.iter().find(|word| word.eq_ignore_ascii_case(text)) else {
                let (text, allowed) = (brief(text), allowed.join(", "));
                return Err(format!("\"{text}\" is not a {column}; allowed are {allowed}, or an empty field"));
            };
            let before = *known.get_or_insert(now);
            if before != *now {
                return Err(format!(
                    "the {column} of \"{}\" is \"{before}\" in earlier rows and \"{now}\" here; a label has one \
                         {column}, so correct the word or use two labels",
                    brief(label)
                ));
            }
        }
        Ok(())
    }

    /// A time (s).
    fn time(&mut self, line: u64, field: &[u8]) -> Result<f64, String> {
        let field = String::from_utf8_lossy(field);
        let field = field.trim();
        if field.is_empty() {
            return Err(empty_field("t_s"));
        }
        let factor = self.time_factor.unwrap_or(1.0);
        match self.number(line, field).map_err(|(_, fault)| fault)?.map(|t| t * factor) {
            Some(t) if t.abs() <= FARTHEST_TIME_S => Ok(t),
            Some(t) if t.is_finite() => Err(format!(
                "the time {t} s is beyond {FARTHEST_TIME_S} s; name the unit in the header if it is another, as in t_s [ms]"
            )),
            _ => Err(format!("the time \"{}\" is not a number of seconds", brief(field))),
        }
    }
}

pub(super) fn no_channels() -> String {
    "no column holds numbers apart from t_s; add one column per sensor channel".to_owned()
}

pub(super) fn too_many_values() -> String {
    format!("there are more than {MOST_VALUES} readings in all; split the file or remove channels")
}

pub(super) fn file_too_large() -> String {
    format!("the file is larger than {} GiB; split it", LARGEST_FILE >> 30)
}

/// A number; with decimal commas `0,5` is one half.
fn number<T: FromStr>(text: &str, decimal_comma: bool) -> Option<T> {
    if decimal_comma && text.contains(',') && !text.contains('.') {
        return text.replacen(',', ".", 1).parse().ok();
    }
    text.parse().ok()
}

/// A reader that ends every line with one line feed, so that lines can be counted, and that limits files and rows.
struct Limited<R> {
    bytes: std::io::Bytes<BufReader<R>>,
    after_return: bool,
    ended: bool,
    /// Bytes handed out.
    total: u64,
    /// Bytes handed out since the present row began.
    row: u64,
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
        assert_eq!(separator(b"trial,label,t_s,p"), b',');
        assert_eq!(separator(b"\n\"trial\";label;t_s;a,b,c,d,e,f\n1,2,3,4"), b';');
        assert_eq!(separator(b"\xEF\xBB\xBFtrial\tlabel\tt_s\tp [a;b]"), b'\t');
        assert_eq!(separator(b"time;class;p"), b';');
        assert_eq!(separator(b""), b',');
    }

    #[test]
    fn columns_are_found_in_any_order_and_case() {
        let header = ["", "Pressure_Left [Pa]", " T_S [s]", "LABEL", "shape", "Trial", "k (1/m)"];
        let mut warnings = Vec::new();
        let Ok(found) = Rows::below(&ByteRecord::from(header.to_vec()), false, &mut warnings) else {
            panic!("all are there")
        };
        assert_eq!((found.required, found.words, found.width), ([5, 3, 2], [None, Some(4)], 7));
        let channels: Vec<(usize, &str)> = found.channels.iter().map(|c| (c.place, c.name.as_str())).collect();
        assert_eq!((channels, warnings.len()), (vec![(1, "Pressure_Left [Pa]"), (6, "k [1/m]")], 1));
    }

    #[test]
    fn numbers_may_have_decimal_commas() {
        assert_eq!((number("-0,5e1", true), number("0.5", true)), (Some(-5.0), Some(0.5)));
        for text in ["0,5", "1,000.5", "1,2,3", "contact", "0x10", "1 000"] {
            assert_eq!(number::<f32>(text, false), None, "{text}");
        }
        assert_eq!(number::<f32>("1.000,5", true), None);
    }
}
