//! Rows of a file gathered into trials. Every row is checked as it comes, and only numbers are kept.

use super::date_time::date_time_s;
use super::table::{
    Fault, Header, Limited, Opened, REQUIRED, TIME, empty, empty_field, filled_name, is_called, name, next_row, number,
    time_factor, unmapped, without_unit,
};
use super::{FARTHEST_TIME_S, MOST_CHANNELS, MOST_SAMPLES, MOST_TRIALS, MOST_VALUES, brief};
use crate::mapping::{Mapping, named_column};
use crate::series::Series;
use csv::ByteRecord;
use palpate_tactile::channel_with_unit;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Read;

/// Readings from here on are no readings: instruments write 9.9e37 (SCPI-99, volume 1, 7.2.1) or infinity.
const OVER_RANGE: f64 = 1e30;

/// Sizes of an object.
const SIZES: [&str; 2] = ["tiny", "large"];
/// Shapes of an object.
const SHAPES: [&str; 3] = ["cubic", "cylindrical", "spherical"];

/// A trial as it stands in the file.
pub(super) struct RawTrial {
    pub(super) name: String,
    pub(super) label: String,
    /// Session of its first row.
    pub(super) session: Option<String>,
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
    thousands: Thousands,
}

/// Whether points may separate thousands: the first number such as 1.002 with its line, and whether others are whole or
/// have another number of decimals.
#[derive(Default)]
struct Thousands {
    first: Option<(u64, String)>,
    whole: bool,
    others: bool,
}

impl Thousands {
    fn note(&mut self, line: u64, text: &str) {
        let text = text.trim_start_matches('-');
        let Some((before, after)) = text.split_once('.') else {
            self.whole = true;
            return;
        };
        let is_group = after.split('.').all(|part| part.len() == 3);
        if is_group && !before.starts_with('0') && (1..=3).contains(&before.len()) {
            self.first.get_or_insert_with(|| (line, text.to_owned()));
        } else {
            self.others = true;
        }
    }
}

/// All rows of a file.
pub(super) struct Rows {
    /// In the order in which they begin.
    pub(super) trials: Vec<RawTrial>,
    /// Size and shape of each label.
    pub(super) labels: BTreeMap<String, [Option<&'static str>; 2]>,
    pub(super) channels: Vec<ChannelColumn>,
    roles: Roles,
    /// Places of size and shape.
    words: [Option<usize>; 2],
    /// Fields of the header.
    width: usize,
    decimal_comma: bool,
    /// The first numbers with a point and with a comma, each with its line.
    separators: [Option<(u64, String)>; 2],
    by_name: BTreeMap<String, usize>,
    /// A pause of this length begins a new trial, and so does a time that falls (s).
    split_gap_s: Option<f64>,
    readings: usize,
}

/// Which columns say what a row belongs to.
struct Roles {
    /// Without it the file is one trial, or one for each change of the label.
    trial: Option<usize>,
    label: Label,
    session: Option<usize>,
    time: usize,
    /// Factor of times to seconds; none where no unit is named.
    time_factor: Option<f64>,
}

/// Where a label stands.
enum Label {
    Column(usize),
    Fixed(String),
}

/// Reads all rows below a header. `label` is that of rows without one, where columns are mapped.
pub(super) fn read_rows(
    reader: impl Read,
    mapping: &Mapping,
    label: &str,
    warnings: &mut Vec<String>,
) -> Result<Rows, Fault> {
    let Opened { mut reader, header, line, first, decimal_comma } = Opened::open(reader, mapping)?;
    if first.is_some() && !mapping.has_roles() {
        let text = "its first row holds numbers, where the names of the columns should stand; add a header, or name the \
                    columns by number, as in --time \"1 [s]\" --channel \"force=2 [N]\"";
        return Err((Some(line), text.to_owned()));
    }
    if let (Some(name), Some(value)) = (&mapping.name, &mapping.value) {
        let series = long_table(&mut reader, &header, line, [name, value], mapping, decimal_comma)?;
        let text = series.into_csv(label).ok_or_else(|| empty("row with a number"))?;
        let own = Mapping { split_gap_s: mapping.split_gap_s, ..Mapping::default() };
        let boxed: Box<dyn Read> = Box::new(text);
        return read_rows(boxed, &own, label, warnings);
    }
    let mut rows =
        Rows::below(&header, decimal_comma, mapping, label, warnings).map_err(|fault| (Some(line), fault))?;
    if let Some(first) = first {
        rows.add(line, &first)?;
    }
    let mut record = ByteRecord::new();
    let mut remarks = 0;
    while let Some(line) = next_row(&mut reader, &mut record)? {
        if record[0].starts_with(b"#") && !SPREADSHEET_ERRORS.iter().any(|error| record[0].starts_with(error)) {
            // A whole row may have been meant.
            remarks += usize::from(record.len() == rows.width);
        } else {
            rows.add(line, &record)?;
        }
    }
    if remarks > 0 {
        warnings.push(format!("{remarks} row(s) that begin with # were taken for remarks and skipped"));
    }
    rows.check_thousands()?;
    if rows.trials.is_empty() {
        return Err(empty("row below its header"));
    }
    rows.check_times()?;
    Ok(rows)
}

/// What spreadsheets write for a value that they cannot compute.
const SPREADSHEET_ERRORS: [&[u8]; 4] = [b"#N/A", b"#DIV/0", b"#VALUE", b"#NUM"];

/// Reads a table with a row for each value.
fn long_table<R: Read>(
    reader: &mut csv::Reader<Limited<R>>,
    header: &ByteRecord,
    line: u64,
    [name, value]: [&String; 2],
    mapping: &Mapping,
    decimal_comma: bool,
) -> Result<Series, Fault> {
    let header = Header::read(header).map_err(|fault| (Some(line), fault))?;
    let time = mapping.time.as_deref().unwrap_or(TIME);
    let columns = || -> Result<_, String> {
        let (time, unit) = header.time(time)?;
        Ok(([time, header.needed(name)?.0, header.needed(value)?.0], time_factor(unit)?.unwrap_or(1.0)))
    };
    let ([time, name, value], factor) = columns().map_err(|fault| (Some(line), fault))?;
    let mut series = Series::default();
    let mut record = ByteRecord::new();
    while let Some(line) = next_row(reader, &mut record)? {
        let text = |place: usize| String::from_utf8_lossy(record.get(place).unwrap_or_default()).trim().to_owned();
        let (time, channel, field) = (text(time), text(name), text(value));
        let t_s = number(&time, decimal_comma).map(|t| t * factor).or_else(|| date_time_s(&time));
        let fault = |text: &str| (Some(line), format!("\"{}\" is not a number", brief(text)));
        let t_s = t_s.filter(|t| t.is_finite()).ok_or_else(|| fault(&time))?;
        let value = number(&field, decimal_comma).ok_or_else(|| fault(&field))?;
        series.push(0, &channel, t_s, value).map_err(|fault| (Some(line), fault))?;
    }
    Ok(series)
}

impl Rows {
    /// Finds the columns in a header.
    fn below(
        header: &ByteRecord,
        decimal_comma: bool,
        mapping: &Mapping,
        fallback: &str,
        warnings: &mut Vec<String>,
    ) -> Result<Self, String> {
        let header = Header::read(header)?;
        let place = |wanted: &str| header.column(wanted).map(|(at, _)| at);
        // Without a column of trials, each change of the label begins one.
        let missing: Vec<&str> =
            REQUIRED.into_iter().filter(|wanted| *wanted != "trial" && place(wanted).is_none()).collect();
        if !mapping.has_roles() && !missing.is_empty() {
            return Err(unmapped(&header, &missing));
        }
        let time = mapping.time.as_deref().unwrap_or(TIME);
        let (time, unit) = header.time(time)?;
        let trial = match &mapping.trial {
            Some(wanted) => Some(header.needed(wanted)?.0),
            None => place("trial"),
        };
        let columns = [mapping.label.as_deref(), mapping.label_column.as_deref(), Some("label")];
        let found = columns.into_iter().flatten().take(if mapping.label.is_some() { 1 } else { 3 }).find_map(place);
        let label = found.map_or_else(|| Label::Fixed(fallback.to_owned()), Label::Column);
        if let (Label::Fixed(name), None) = (&label, &mapping.label) {
            warnings.push(format!("no label is given: the trials are called \"{}\" after the file", brief(name)));
        }
        let session = place("session");
        let roles = Roles { trial, label, session, time, time_factor: time_factor(unit)? };
        let label = match roles.label {
            Label::Column(at) => Some(at),
            Label::Fixed(_) => None,
        };
        let words = [place("size"), place("shape")];
        let mut channels: Vec<ChannelColumn> = Vec::new();
        let mut add = |at: usize, name: &str, unit: Option<&str>| {
            let reserved = ["trial", "label", "t_s", "size", "shape"].iter().find(|r| r.eq_ignore_ascii_case(name));
            let (full, factor) = unit.map_or(Ok((name.to_owned(), 1.0)), |unit| channel_with_unit(name, unit))?;
            if reserved.is_some()
                || channels.iter().any(|other| other.name == full || without_unit(&other.name).0 == name)
            {
                let name = brief(reserved.unwrap_or(&name));
                return Err(format!(
                    "two columns are called \"{name}\"; rename or remove one (units in brackets do not count)"
                ));
            }
            if channels.len() == MOST_CHANNELS {
                return Err(format!("there are more than {MOST_CHANNELS} columns of readings; remove some"));
            }
            channels.push(ChannelColumn {
                place: at,
                name: full,
                factor,
                numeric: false,
                text: None,
                thousands: Thousands::default(),
            });
            Ok(())
        };
        for text in &mapping.channels {
            let (own, column) = named_column(text);
            let (at, unit) = header.needed(column)?;
            add(at, own.unwrap_or(header.names[at].0), unit)?;
        }
        let names = &header.names;
        if mapping.channels.is_empty() {
            let known = [trial, label, session, Some(time), words[0], words[1], place("label"), place("trial")];
            let is_ignored = |at: usize| mapping.ignore.iter().any(|wanted| is_called(header.whole[at], wanted));
            for (at, (name, unit)) in names.iter().enumerate() {
                if !name.is_empty() && !known.contains(&Some(at)) && !is_ignored(at) {
                    add(at, name, *unit)?;
                }
            }
        }
        if channels.is_empty() {
            return Err(no_channels());
        }
        let nameless: Vec<usize> = (1..).zip(names).filter(|(_, n)| n.0.is_empty()).map(|(at, _)| at).collect();
        if let [first, others @ ..] = nameless.as_slice() {
            let others = if others.is_empty() { String::new() } else { format!(" (and {} more)", others.len()) };
            warnings.push(format!("column {first}{others} has no name in the header and was left out"));
        }
        let (trials, labels, by_name) = (Vec::new(), BTreeMap::new(), BTreeMap::new());
        let width = names.len();
        Ok(Self {
            trials,
            labels,
            channels,
            roles,
            words,
            width,
            decimal_comma,
            separators: [None, None],
            by_name,
            split_gap_s: mapping.split_gap_s,
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
        match self.trials.iter().find(counts).filter(|_| self.roles.time_factor.is_none()) {
            None => Ok(()),
            Some(trial) => {
                let text = "the times rise by 1 from row to row: seconds, milliseconds, or the numbers of the samples? Name \
                            their unit in the header, as in t_s [ms] or t_s [s]; numbers of samples must become times";
                Err((Some(trial.line), text.to_owned()))
            }
        }
    }

    /// Refuses a column whose points may well separate thousands: it has whole numbers, and others with three decimals alone.
    fn check_thousands(&self) -> Result<(), Fault> {
        let doubtful = |channel: &&ChannelColumn| channel.thousands.whole && !channel.thousands.others;
        let first = |channel: &'_ ChannelColumn| Some((channel.name.clone(), channel.thousands.first.clone()?));
        match self.channels.iter().filter(doubtful).find_map(first) {
            None => Ok(()),
            Some((name, (line, text))) => Err((
                Some(line),
                format!(
                    "\"{text}\" in the column \"{}\" may be a thousand times as large: beside whole numbers, a point before three \
                     digits separates thousands in many countries; write all numbers without thousands separators, or with \
                     decimals",
                    brief(&name)
                ),
            )),
        }
    }

    /// A number of this file. A file that writes some with a point and some with a comma is refused: one of the two may
    /// separate thousands.
    fn number(&mut self, line: u64, field: &str) -> Result<Option<f64>, Fault> {
        let Some(value) = number(field, self.decimal_comma) else { return Ok(None) };
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
            if self.decimal_comma && !missing {
                channel.thousands.note(line, field);
            }
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
        let now = self.time(line, &record[self.roles.time])?;
        let at = self.trial(line, record, now)?;
        self.check_words(record)?;
        let readings = self.readings + row.len();
        let is_split = self.split_gap_s.is_some();
        let trial = &mut self.trials[at];
        let name = || brief(&trial.name);
        match trial.t_s.last() {
            Some(before) if *before > now => {
                let advice = match before {
                    4294.0..4296.0 if now < 1.0 => {
                        "a counter of microseconds starts again after 4294.97 s; add that to the times from here on"
                    }
                    86_390.0..86_400.0 if now < 10.0 => {
                        "the clock passes midnight; add the date, as in 2026-03-01 23:59:59.5, or split the file with --split-by gap"
                    }
                    _ => {
                        "sort its rows, and give every grasp a trial name of its own, or split the file with --split-by gap"
                    }
                };
                return Err(format!("in trial \"{}\" the time falls from {before} s to {now} s; {advice}", name()));
            }
            Some(before) if *before >= now => {
                trial.repeated += 1;
                trial.values.truncate(trial.values.len() - row.len());
            }
            _ if trial.t_s.len() == MOST_SAMPLES => {
                let advice =
                    if is_split { "choose a shorter pause" } else { "give every grasp a trial name of its own" };
                return Err(format!("trial \"{}\" has more than {MOST_SAMPLES} samples; {advice}", name()));
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

    /// Label of a row.
    fn label(&self, record: &ByteRecord) -> Result<String, String> {
        match &self.roles.label {
            Label::Column(at) => Ok(filled_name(&record[*at], "label")?.to_owned()),
            Label::Fixed(label) => Ok(label.clone()),
        }
    }

    /// The trial of a row at a time (s).
    fn trial(&mut self, line: u64, record: &ByteRecord, now: f64) -> Result<usize, String> {
        let name = match self.roles.trial {
            Some(at) => filled_name(&record[at], "trial")?,
            None => "",
        };
        let label = self.label(record)?;
        let session = self.roles.session.map(|at| name_of_session(&record[at])).transpose()?.flatten();
        // No name has a line break in it.
        let key = session.as_ref().map_or(Cow::Borrowed(name), |session| format!("{session}\n{name}").into());
        let known = self.by_name.get(key.as_ref()).copied();
        let splits = |trial: &RawTrial| {
            let falls = |gap: f64| trial.t_s.last().is_some_and(|before| now < *before || now - before >= gap);
            self.split_gap_s.is_some_and(falls) || (self.roles.trial.is_none() && trial.label != label)
        };
        if let Some(at) = known.filter(|at| !splits(&self.trials[*at])) {
            if self.trials[at].label != label {
                return Err(format!(
                    "the label of trial \"{}\" changes from \"{}\" to \"{}\"; one trial is one grasp of one object",
                    brief(name),
                    brief(&self.trials[at].label),
                    brief(&label)
                ));
            }
            return Ok(at);
        }
        let count = self.trials.len();
        if count == MOST_TRIALS {
            return Err(format!("there are more than {MOST_TRIALS} trials; split the file"));
        }
        self.by_name.insert(key.into_owned(), count);
        let name = match (name, known) {
            ("", _) => (count + 1).to_string(),
            (name, None) => name.to_owned(),
            (name, Some(_)) => format!("{name}, row {line}"),
        };
        self.trials.push(RawTrial { name, label, session, line, t_s: Vec::new(), values: Vec::new(), repeated: 0 });
        Ok(count)
    }

    /// A label has one size and one shape; an empty field leaves it to other rows.
    fn check_words(&mut self, record: &ByteRecord) -> Result<(), String> {
        let label = self.label(record)?;
        let known = self.labels.entry(label.clone()).or_insert([None, None]);
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
                    brief(&label)
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
        let factor = self.roles.time_factor.unwrap_or(1.0);
        let read = self.number(line, field).map_err(|(_, fault)| fault)?.map(|t| t * factor);
        match read.or_else(|| date_time_s(field)) {
            Some(t) if t.abs() <= FARTHEST_TIME_S => Ok(t),
            Some(t) if t.is_finite() => Err(format!(
                "the time {t} s is beyond {FARTHEST_TIME_S} s; name the unit in the header if it is another, as in t_s [ms]"
            )),
            _ => Err(format!(
                "the time \"{}\" is not a number of seconds, nor a date and time such as 2026-03-01 12:00:00.5 (where day and \
                 month can be exchanged, the year must come first); --skip N passes over lines above the header",
                brief(field)
            )),
        }
    }
}

/// A session; none where the field is empty.
fn name_of_session(field: &[u8]) -> Result<Option<String>, String> {
    Ok(Some(name(field, "session")?.to_owned()).filter(|name| !name.is_empty()))
}

pub(super) fn no_channels() -> String {
    "no column holds numbers apart from t_s; add one column per sensor channel".to_owned()
}

pub(super) fn too_many_values() -> String {
    format!("there are more than {MOST_VALUES} readings in all; split the file or remove channels")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_found_in_any_order_and_case() {
        let header = ["", "Pressure_Left [Pa]", " T_S [s]", "LABEL", "shape", "Trial", "k (1/m)"];
        let mut warnings = Vec::new();
        let header = ByteRecord::from(header.to_vec());
        let Ok(found) = Rows::below(&header, false, &Mapping::default(), "", &mut warnings) else {
            panic!("all are there")
        };
        assert!(matches!(found.roles, Roles { trial: Some(5), label: Label::Column(3), time: 2, .. }));
        assert_eq!((found.words, found.width), ([None, Some(4)], 7));
        let channels: Vec<(usize, &str)> = found.channels.iter().map(|c| (c.place, c.name.as_str())).collect();
        assert_eq!((channels, warnings.len()), (vec![(1, "Pressure_Left [Pa]"), (6, "k [1/m]")], 1));
    }
}
