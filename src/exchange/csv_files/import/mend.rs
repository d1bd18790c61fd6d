//! Mends trials so that they compare: fills gaps, drops columns without numbers, resamples to one rate. Every change is a
//! warning.

use super::resample::{self, three_digits};
use super::rows::{RawTrial, Rows, no_channels, too_many_values};
use super::table::Fault;
use super::{MOST_SAMPLES, MOST_VALUES, brief};
use palpate_store::{ImportedTrial, interruptions};
use palpate_tactile::Signals;

/// Most memory for the names of the channels of all trials (bytes); a thousand times what a large study takes.
const MOST_NAME_BYTES: usize = 1 << 30;

/// Most warnings of one kind; further ones are only counted.
const MOST_ALIKE: usize = 100;

/// Makes trials of the rows.
pub(super) fn finish(rows: Rows, warnings: &mut Vec<String>) -> Result<Vec<ImportedTrial>, Fault> {
    let numeric: Vec<bool> = rows.channels.iter().map(|channel| channel.numeric).collect();
    if !numeric.contains(&true) {
        let first =
            rows.channels.iter().filter_map(|channel| channel.text.as_ref().map(|text| (text, &channel.name))).min();
        return Err(first.map_or_else(
            || (None, no_channels()),
            |((line, text), name)| {
                let name = brief(name);
                (Some(*line), format!("\"{text}\" in the column \"{name}\" is not a number, and {}", no_channels()))
            },
        ));
    }
    for channel in rows.channels.iter().filter(|channel| !channel.numeric) {
        let such = channel.text.as_ref().map_or_else(String::new, |(_, text)| format!(" (such as \"{text}\")"));
        warnings.push(format!("the column \"{}\" holds no number{such} and was left out", brief(&channel.name)));
    }
    let names: Vec<String> = rows.channels.into_iter().map(|channel| channel.name).collect();
    let channels: Vec<String> = kept(&names, &numeric).cloned().collect();
    let (mut trials, labels) = (rows.trials, rows.labels);
    check_names(&channels, trials.len()).map_err(|fault| (None, fault))?;
    warn_of_repeated_times(&trials, warnings);
    if numeric.contains(&false) {
        for trial in &mut trials {
            trial.values = trial.values.chunks(names.len()).flat_map(|row| kept(row, &numeric).copied()).collect();
        }
    }
    fill_gaps(&mut trials, &channels, warnings)?;
    let series = at_one_rate(trials, channels.len(), warnings)?;
    let with_words = |trial: RawTrial| {
        let [size, shape] = labels.get(&trial.label).copied().unwrap_or_default().map(|word| word.map(str::to_owned));
        let signals = Signals { channels: channels.clone(), t_s: trial.t_s, values: trial.values };
        ImportedTrial { name: trial.name, label: trial.label, size, shape, session: trial.session, signals }
    };
    let trials: Vec<ImportedTrial> = series.into_iter().map(with_words).collect();
    warn_of_gaps(&trials, warnings);
    warn_of_lengths(&trials, warnings);
    warn_of_few(trials.len(), labels.len(), warnings);
    Ok(trials)
}

fn kept<'a, T>(all: &'a [T], keep: &'a [bool]) -> impl Iterator<Item = &'a T> {
    all.iter().zip(keep).filter(|(_, keep)| **keep).map(|(one, _)| one)
}

/// Every trial carries the names of its channels: long names in many trials take much memory.
fn check_names(channels: &[String], trials: usize) -> Result<(), String> {
    let each: usize = channels.iter().map(|name| name.len() + size_of::<String>()).sum();
    if trials.saturating_mul(each) > MOST_NAME_BYTES {
        return Err(format!(
            "{trials} trials with {} channels each are too many; split the file or shorten the channels' names",
            channels.len()
        ));
    }
    Ok(())
}

fn warn_of_repeated_times(trials: &[RawTrial], warnings: &mut Vec<String>) {
    let mut alike = Alike::default();
    for trial in trials.iter().filter(|trial| trial.repeated > 0) {
        let (name, count) = (brief(&trial.name), trial.repeated);
        alike.warn(warnings, || {
            format!("trial \"{name}\": at {} the last row was kept", counted(count, "repeated time", "repeated times"))
        });
    }
    alike.close(warnings, "trials with repeated times");
}

fn fill_gaps(trials: &mut [RawTrial], channels: &[String], warnings: &mut Vec<String>) -> Result<(), Fault> {
    let mut alike = Alike::default();
    for trial in trials {
        // Counted before gaps are filled: a trial of one sample has no neighbours to fill from.
        if trial.t_s.len() < 2 {
            let problem = "has only 1 sample; a trial needs at least two at different times".to_owned();
            return Err(fault(trial, &problem));
        }
        for (c, channel) in channels.iter().enumerate() {
            let Some(filled) = resample::fill_short_gaps(&trial.t_s, &mut trial.values, c) else {
                let channel = brief(channel);
                let problem = format!("has no reading of the channel \"{channel}\"; remove the trial or the column");
                return Err(fault(trial, &problem));
            };
            if filled > 0 {
                let count = counted(filled, "missing reading was", "missing readings were");
                alike.warn(warnings, || {
                    format!("trial \"{}\": {count} interpolated in \"{}\"", brief(&trial.name), brief(channel))
                });
            }
        }
    }
    alike.close(warnings, "channels of trials with missing readings");
    Ok(())
}

/// Resamples the trials that differ from the common rate.
fn at_one_rate(mut trials: Vec<RawTrial>, width: usize, warnings: &mut Vec<String>) -> Result<Vec<RawTrial>, Fault> {
    let rates: Vec<f64> = trials.iter().map(|trial| resample::rate(&trial.t_s)).collect();
    let rate_hz = resample::common_rate(&mut rates.clone());
    // Every size is known and within bounds before any memory is asked for.
    let mut lengths = Vec::with_capacity(trials.len());
    for trial in &trials {
        lengths.push(if resample::runs_at(&trial.t_s, rate_hz) { None } else { Some(even_samples(trial, rate_hz)?) });
    }
    let total: usize = trials.iter().zip(&lengths).map(|(trial, n)| n.unwrap_or(trial.t_s.len())).sum();
    if total.saturating_mul(width) > MOST_VALUES {
        return Err((None, too_many_values()));
    }
    let mut changed_rates = Vec::new();
    for ((trial, samples), own_hz) in trials.iter_mut().zip(lengths).zip(rates) {
        let Some(samples) = samples else { continue };
        (trial.t_s, trial.values) = resample::resample(&trial.t_s, &trial.values, samples, rate_hz);
        changed_rates.push(own_hz);
    }
    if !changed_rates.is_empty() {
        let count = counted_of(changed_rates.len(), trials.len());
        let own = range(changed_rates.iter().copied().map(three_digits), "Hz");
        let why = match changed_rates.iter().all(|own| (own - rate_hz).abs() <= 0.01 * rate_hz) {
            true => "the times are uneven".to_owned(),
            false => format!("the times are uneven or at another rate ({own})"),
        };
        warnings.push(format!("{count} resampled to {rate_hz} Hz: {why}"));
    }
    if rate_hz < 1.0 {
        let rate_hz = three_digits(rate_hz);
        warnings.push(format!("the trials have only {rate_hz} samples per second; check that t_s is in seconds"));
    }
    Ok(trials)
}

/// Samples of a trial at the common rate.
fn even_samples(trial: &RawTrial, rate_hz: f64) -> Result<usize, Fault> {
    let samples = resample::even_samples(&trial.t_s, rate_hz);
    let (from_s, to_s) = (trial.t_s[0], trial.t_s[trial.t_s.len() - 1]);
    if samples < 2.0 {
        let span_s = to_s - from_s;
        let problem = format!("lasts {span_s} s, less than one step at the common rate of {rate_hz} Hz; remove it");
        Err(fault(trial, &problem))
    } else if samples > MOST_SAMPLES as f64 {
        let problem = format!(
            "runs from {from_s} s to {to_s} s, which is more than {MOST_SAMPLES} samples at {rate_hz} Hz; look for a wrong \
             time in it"
        );
        Err(fault(trial, &problem))
    } else {
        Ok(samples as usize)
    }
}

fn fault(trial: &RawTrial, problem: &str) -> Fault {
    (Some(trial.line), format!("trial \"{}\" {problem}", brief(&trial.name)))
}

/// Gaps stay gaps; the trial is flagged.
fn warn_of_gaps(trials: &[ImportedTrial], warnings: &mut Vec<String>) {
    let mut alike = Alike::default();
    for trial in trials {
        for gap in interruptions(&trial.signals) {
            alike.warn(warnings, || format!("trial \"{}\" is flagged: {gap}", brief(&trial.name)));
        }
    }
    alike.close(warnings, "gaps");
}

fn warn_of_lengths(trials: &[ImportedTrial], warnings: &mut Vec<String>) {
    let samples = || trials.iter().map(|trial| trial.signals.len());
    let (Some(least), Some(most)) = (samples().min(), samples().max()) else { return };
    if least != most {
        let spans = range(trials.iter().map(|trial| three_digits(resample::span(&trial.signals.t_s))), "s");
        warnings.push(format!("the trials differ in length: {least} to {most} samples ({spans})"));
    }
}

fn warn_of_few(trials: usize, labels: usize, warnings: &mut Vec<String>) {
    if labels == 1 {
        warnings.push("only one label: a recogniser needs at least two".to_owned());
    }
    if trials <= 2 {
        let count = counted(trials, "trial", "trials");
        warnings.push(format!("only {count}: too few to train and to test"));
    }
}

/// `1 trial` or `3 trials`.
fn counted(count: usize, one: &str, more: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { more })
}

fn counted_of(count: usize, all: usize) -> String {
    format!("{count} of {} {}", counted(all, "trial", "trials"), if count == 1 { "was" } else { "were" })
}

/// `50 Hz` or `50 to 100 Hz`.
fn range(numbers: impl Iterator<Item = f64> + Clone, unit: &str) -> String {
    let (least, most) = (numbers.clone().fold(f64::INFINITY, f64::min), numbers.fold(f64::NEG_INFINITY, f64::max));
    if least < most { format!("{least} to {most} {unit}") } else { format!("{least} {unit}") }
}

/// Warnings of one kind, limited so that they do not bury the others.
#[derive(Default)]
struct Alike {
    count: usize,
}

impl Alike {
    fn warn(&mut self, warnings: &mut Vec<String>, sentence: impl FnOnce() -> String) {
        self.count += 1;
        if self.count <= MOST_ALIKE {
            warnings.push(sentence());
        }
    }

    /// Warns how many were not listed.
    fn close(self, warnings: &mut Vec<String>, what: &str) {
        if self.count > MOST_ALIKE {
            warnings.push(format!("and {} more {what}", self.count - MOST_ALIKE));
        }
    }
}
