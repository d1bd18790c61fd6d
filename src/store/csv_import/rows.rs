//! Rows gathered into trials: every row is checked as it comes, and only numbers are kept.

use super::columns::Columns;
use super::fields::{Numbers, Reading, SHAPES, SIZES, filled_name, word};
use super::import_error::{ImportFault, Located, brief};
use super::{MOST_SAMPLES, MOST_TRIALS, MOST_VALUES};
use csv::ByteRecord;
use std::collections::BTreeMap;

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

/// What is said of a label's objects.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Words {
    pub(super) size: Option<&'static str>,
    pub(super) shape: Option<&'static str>,
}

/// What a column of readings has shown so far.
#[derive(Default)]
struct Seen {
    number: bool,
    /// Line and beginning of the first text.
    text: Option<(u64, String)>,
}

/// All rows so far.
pub(super) struct Rows<'a> {
    columns: &'a Columns,
    numbers: Numbers,
    /// In the order in which they begin.
    pub(super) trials: Vec<RawTrial>,
    pub(super) labels: BTreeMap<String, Words>,
    by_name: BTreeMap<String, usize>,
    latest: usize,
    seen: Vec<Seen>,
    readings: usize,
    row: Vec<f32>,
}

impl<'a> Rows<'a> {
    pub(super) fn new(columns: &'a Columns, numbers: Numbers) -> Self {
        Self {
            columns,
            numbers,
            trials: Vec::new(),
            labels: BTreeMap::new(),
            by_name: BTreeMap::new(),
            latest: 0,
            seen: columns.channels.iter().map(|_| Seen::default()).collect(),
            readings: 0,
            row: Vec::new(),
        }
    }

    /// Takes in the row that begins at `line`.
    pub(super) fn add(&mut self, line: u64, record: &ByteRecord) -> Result<(), Located> {
        self.check_width(record).map_err(|fault| fault.at(line))?;
        self.read_row(line, record)?;
        let trial = self.trial(line, record).map_err(|fault| fault.at(line))?;
        self.check_words(&record[self.columns.label], record).map_err(|fault| fault.at(line))?;
        self.store(trial, record).map_err(|fault| fault.at(line))
    }

    /// Empty fields beyond the header are the spreadsheet's.
    fn check_width(&self, record: &ByteRecord) -> Result<(), ImportFault> {
        let expected = self.columns.width;
        if record.len() < expected || record.iter().skip(expected).any(|field| !field.trim_ascii().is_empty()) {
            return Err(ImportFault::UnevenRow { found: record.len(), expected });
        }
        Ok(())
    }

    /// Reads the channels. A column may hold text as long as it holds no number.
    fn read_row(&mut self, line: u64, record: &ByteRecord) -> Result<(), Located> {
        self.row.clear();
        for ((place, column), seen) in self.columns.channels.iter().zip(&mut self.seen) {
            let field = String::from_utf8_lossy(&record[*place]);
            let column = || brief(column);
            self.row.push(match self.numbers.reading(&field) {
                Reading::Number(value) => {
                    seen.number = true;
                    value
                }
                Reading::Missing => f32::NAN,
                Reading::Infinite => {
                    return Err(ImportFault::Infinite { column: column(), text: brief(&field) }.at(line));
                }
                Reading::Text => {
                    seen.text.get_or_insert_with(|| (line, brief(&field)));
                    f32::NAN
                }
            });
            if seen.number
                && let Some((line, text)) = seen.text.take()
            {
                let advice = if self.numbers.decimal_comma || !text.contains(',') {
                    ", or remove the column if it is not meant as a channel"
                } else {
                    "; decimal commas need a semicolon or a tab between the fields"
                };
                return Err(ImportFault::NotANumber { column: column(), text, advice }.at(line));
            }
        }
        Ok(())
    }

    /// The trial that a row belongs to.
    fn trial(&mut self, line: u64, record: &ByteRecord) -> Result<usize, ImportFault> {
        let name = filled_name(&record[self.columns.trial], "trial")?;
        let label = filled_name(&record[self.columns.label], "label")?;
        let known = match self.trials.get(self.latest) {
            Some(trial) if trial.name == name => Some(self.latest),
            _ => self.by_name.get(name).copied(),
        };
        self.latest = match known {
            Some(trial) if self.trials[trial].label == label => trial,
            Some(trial) => {
                let before = brief(&self.trials[trial].label);
                return Err(ImportFault::LabelChanges { trial: brief(name), before, now: brief(label) });
            }
            None if self.trials.len() == MOST_TRIALS => return Err(ImportFault::TooManyTrials),
            None => {
                self.by_name.insert(name.to_owned(), self.trials.len());
                let (name, label) = (name.to_owned(), label.to_owned());
                self.trials.push(RawTrial { name, label, line, t_s: Vec::new(), values: Vec::new(), repeated: 0 });
                self.trials.len() - 1
            }
        };
        Ok(self.latest)
    }

    /// A label has one size and one shape; an empty field leaves it to other rows to say.
    fn check_words(&mut self, label: &[u8], record: &ByteRecord) -> Result<(), ImportFault> {
        let label = filled_name(label, "label")?;
        if !self.labels.contains_key(label) {
            self.labels.insert(label.to_owned(), Words::default());
        }
        let Some(words) = self.labels.get_mut(label) else { return Ok(()) };
        let said = [
            ("size", self.columns.size, SIZES.as_slice(), &mut words.size),
            ("shape", self.columns.shape, SHAPES.as_slice(), &mut words.shape),
        ];
        for (column, place, allowed, known) in said {
            let Some(place) = place else { continue };
            let Some(now) = word(&record[place], column, allowed)? else { continue };
            let before = *known.get_or_insert(now);
            if before != now {
                return Err(ImportFault::WordsDiffer { column, label: brief(label), before, now });
            }
        }
        Ok(())
    }

    /// Adds the readings to their trial, or replaces those of the same time.
    fn store(&mut self, trial: usize, record: &ByteRecord) -> Result<(), ImportFault> {
        let now = self.numbers.time(&String::from_utf8_lossy(&record[self.columns.time]))?;
        let trial = &mut self.trials[trial];
        match trial.t_s.last() {
            Some(before) if *before > now => {
                let trial = brief(&trial.name);
                return Err(ImportFault::FallingTime { trial, before: *before, now });
            }
            Some(before) if *before >= now => {
                trial.repeated += 1;
                trial.values.truncate(trial.values.len() - self.row.len());
            }
            _ if trial.t_s.len() == MOST_SAMPLES => return Err(ImportFault::LongTrial { trial: brief(&trial.name) }),
            _ if self.readings + self.row.len() > MOST_VALUES => return Err(ImportFault::TooManyValues),
            _ => {
                trial.t_s.push(now);
                self.readings += self.row.len();
            }
        }
        trial.values.extend_from_slice(&self.row);
        Ok(())
    }

    /// Which columns of readings hold a number at all.
    pub(super) fn numeric(&self) -> Vec<bool> {
        self.seen.iter().map(|seen| seen.number).collect()
    }
}
