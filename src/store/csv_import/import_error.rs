//! What can be wrong with somebody's file of grasps, in sentences that say where and what to try.

use super::{
    FARTHEST_TIME_S, LARGEST_FILE, LONGEST_NAME, LONGEST_ROW, MOST_CHANNELS, MOST_SAMPLES, MOST_TRIALS, MOST_VALUES,
};

/// Why a file of grasps could not be read, and where in it.
#[derive(Debug, thiserror::Error)]
#[error("cannot import \"{name}\"{}: {fault}", at_line(*.line))]
pub struct ImportError {
    /// The file, or what its reader is called.
    pub name: String,
    /// The line, counted from 1, where one is to blame.
    pub line: Option<u64>,
    /// What is wrong.
    pub fault: ImportFault,
}

fn at_line(line: Option<u64>) -> String {
    line.map(|n| format!(", line {n}")).unwrap_or_default()
}

/// What is wrong with a file of grasps.
#[derive(Debug, thiserror::Error)]
pub enum ImportFault {
    /// The file could not be opened or read.
    #[error("{cause}")]
    Unreadable {
        /// What the system says.
        cause: String,
    },
    /// More bytes than are read.
    #[error("the file is larger than {} GiB; split it", LARGEST_FILE >> 30)]
    FileTooLarge,
    /// A row without end, as an open quotation mark makes it.
    #[error("the row is longer than {} MiB; look for a quotation mark that is never closed", LONGEST_ROW >> 20)]
    RowTooLong,
    /// Names in another encoding.
    #[error("the column \"{column}\" holds bytes that are not UTF-8; save the file as \"CSV UTF-8\"")]
    NotUtf8 {
        /// The column.
        column: String,
    },
    /// No header, or no row below it.
    #[error("the file has no {what}; it should have a header and below it one row per sample")]
    Empty {
        /// What is not there.
        what: &'static str,
    },
    /// Columns that every file needs.
    #[error(
        "there is no column {missing}. Needed are trial, label, t_s (in seconds) and one column per sensor channel; \
         the file has {found}{advice}"
    )]
    MissingColumns {
        /// Names of the missing columns.
        missing: String,
        /// Names of the columns there are.
        found: String,
        /// Which columns to rename, as a sentence, or nothing.
        advice: String,
    },
    /// Two columns of one name.
    #[error("two columns are called \"{column}\"; rename or remove one (units in brackets do not count)")]
    SameColumn {
        /// Their name.
        column: String,
    },
    /// Time in something else than seconds.
    #[error("the unit of t_s is given as \"{unit}\"; times must be in seconds")]
    TimeUnit {
        /// The unit in the header.
        unit: String,
    },
    /// More columns of readings than make sense.
    #[error("{count} columns of readings are more than the {MOST_CHANNELS} that can be read; remove some")]
    TooManyChannels {
        /// How many there are.
        count: usize,
    },
    /// No column holds readings.
    #[error("no column holds numbers apart from t_s; add one column per sensor channel")]
    NoChannels,
    /// A row with more or fewer fields than the header.
    #[error("the row has {found} fields but the header has {expected}; look for a missing or extra separator")]
    UnevenRow {
        /// Fields of the row.
        found: usize,
        /// Fields of the header.
        expected: usize,
    },
    /// A field that must not be empty.
    #[error("the column \"{column}\" is empty; every row names its trial, label and time")]
    EmptyField {
        /// The column.
        column: String,
    },
    /// A name that no screen can show.
    #[error("the name in \"{column}\" has {length} characters, the limit is {LONGEST_NAME}; shorten it")]
    LongName {
        /// The column, or "header".
        column: String,
        /// Its length.
        length: usize,
    },
    /// A name with a line break, a tab or the like inside.
    #[error("the name \"{text}\" in \"{column}\" has a line break or another control character in it; remove it")]
    ControlCharacter {
        /// The column, or "header".
        column: String,
        /// The name, with the character written out.
        text: String,
    },
    /// A time that is no number.
    #[error("the time \"{text}\" is not a number of seconds")]
    BadTime {
        /// What stands there.
        text: String,
    },
    /// A time that cannot be meant in seconds.
    #[error(
        "the time {t_s} s is beyond {FARTHEST_TIME_S} s; times are in seconds, not in milliseconds or microseconds"
    )]
    FarTime {
        /// The time (s).
        t_s: f64,
    },
    /// Time that runs backwards.
    #[error(
        "in trial \"{trial}\" the time falls from {before} s to {now} s; sort its rows, and give every grasp a trial \
         name of its own"
    )]
    FallingTime {
        /// The trial.
        trial: String,
        /// Time of its previous row (s).
        before: f64,
        /// Time of this row (s).
        now: f64,
    },
    /// Text among numbers.
    #[error("\"{text}\" in the column \"{column}\" is not a number; correct it, or leave the field empty{advice}")]
    NotANumber {
        /// The column.
        column: String,
        /// What stands there.
        text: String,
        /// What else may help, or nothing.
        advice: &'static str,
    },
    /// A reading without bounds.
    #[error("\"{text}\" in the column \"{column}\" is infinite or beyond 3.4e38; correct it, or leave the field empty")]
    Infinite {
        /// The column.
        column: String,
        /// What stands there.
        text: String,
    },
    /// A size or a shape that we have no word for.
    #[error("\"{word}\" is not a {column}; allowed are {allowed}, or an empty field")]
    BadWord {
        /// The column, `size` or `shape`.
        column: &'static str,
        /// What stands there.
        word: String,
        /// The words there are.
        allowed: String,
    },
    /// One trial with two labels.
    #[error(
        "the label of trial \"{trial}\" changes from \"{before}\" to \"{now}\"; one trial is one grasp of one object"
    )]
    LabelChanges {
        /// The trial.
        trial: String,
        /// Its label so far.
        before: String,
        /// The label in this row.
        now: String,
    },
    /// One label with two sizes or shapes.
    #[error(
        "the {column} of \"{label}\" is \"{before}\" in earlier rows and \"{now}\" here; a label has one {column}, so \
         correct the word or use two labels"
    )]
    WordsDiffer {
        /// The column, `size` or `shape`.
        column: &'static str,
        /// The label.
        label: String,
        /// The word so far.
        before: &'static str,
        /// The word in this row.
        now: &'static str,
    },
    /// A channel without any reading in a trial.
    #[error("the channel \"{channel}\" has no reading in trial \"{trial}\"; remove the trial or the column")]
    EmptyChannel {
        /// The trial.
        trial: String,
        /// The channel.
        channel: String,
    },
    /// A trial that is no series.
    #[error("trial \"{trial}\" has only {samples} sample; a trial needs at least two at different times")]
    ShortTrial {
        /// The trial.
        trial: String,
        /// How many samples it has.
        samples: usize,
    },
    /// A trial shorter than one step of the common rate.
    #[error("trial \"{trial}\" lasts {span_s} s, less than one step at the common rate of {rate_hz} Hz; remove it")]
    BriefTrial {
        /// The trial.
        trial: String,
        /// From its first to its last sample (s).
        span_s: f64,
        /// Rate of all trials (Hz).
        rate_hz: f64,
    },
    /// More trials than can be read.
    #[error("there are more than {MOST_TRIALS} trials; split the file")]
    TooManyTrials,
    /// A trial with more rows than can be read.
    #[error("trial \"{trial}\" has more than {MOST_SAMPLES} samples; does every grasp have a trial name of its own?")]
    LongTrial {
        /// The trial.
        trial: String,
    },
    /// A trial that would grow beyond bounds, as one wild time makes it.
    #[error(
        "trial \"{trial}\" runs from {from_s} s to {to_s} s, which is more than {MOST_SAMPLES} samples at {rate_hz} \
         Hz; look for a wrong time in it"
    )]
    WildTime {
        /// The trial.
        trial: String,
        /// Its first time (s).
        from_s: f64,
        /// Its last time (s).
        to_s: f64,
        /// Rate of all trials (Hz).
        rate_hz: f64,
    },
    /// More readings than fit in memory.
    #[error("there are more than {MOST_VALUES} readings in all; split the file or remove channels")]
    TooManyValues,
    /// More names of channels than fit in memory.
    #[error(
        "{trials} trials with {channels} channels each are too many; split the file or shorten the channels' names"
    )]
    TooManyNames {
        /// How many trials there are.
        trials: usize,
        /// How many channels each has.
        channels: usize,
    },
}

impl ImportFault {
    /// Blames a line.
    pub(super) fn at(self, line: u64) -> Located {
        Located { line: Some(line), fault: self }
    }
}

/// A fault with its place in the file, before the file's name is known.
#[derive(Debug)]
pub(super) struct Located {
    pub(super) line: Option<u64>,
    pub(super) fault: ImportFault,
}

impl From<ImportFault> for Located {
    fn from(fault: ImportFault) -> Self {
        Self { line: None, fault }
    }
}

/// As much of somebody's text as a sentence can hold, with control characters written out.
pub(super) fn brief(text: &str) -> String {
    const LENGTH: usize = 60;
    let mut shown: String = text.chars().take(LENGTH).flat_map(char::escape_debug).collect();
    if text.chars().nth(LENGTH).is_some() {
        shown.push_str("...");
    }
    shown
}
