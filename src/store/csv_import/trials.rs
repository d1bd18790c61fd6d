//! From rows to trials that compare: gaps filled, columns without numbers left out, everybody at one rate. Whatever was
//! changed on the way is said in a warning.

use super::import_error::{ImportFault, Located, brief};
use super::resample::{self, three_digits};
use super::rows::{RawTrial, Rows};
use super::{ImportedTrial, MOST_SAMPLES, MOST_VALUES};
use palpate_tactile::Signals;

/// The most memory for the channels' names of all trials (bytes); a thousand times what a large study takes.
const MOST_NAME_BYTES: usize = 1 << 30;

/// So many warnings of one kind are listed before the rest is only counted.
const MOST_ALIKE: usize = 100;

/// Makes trials of the rows; `names` are those of all columns of readings.
pub(super) fn finish(
    rows: Rows<'_>,
    names: &[String],
    warnings: &mut Vec<String>,
) -> Result<Vec<ImportedTrial>, Located> {
    let numeric = rows.numeric();
    if !numeric.contains(&true) {
        return Err(ImportFault::NoChannels.into());
    }
    for (name, _) in names.iter().zip(&numeric).filter(|(_, numeric)| !**numeric) {
        warnings.push(format!("the column \"{}\" holds no number and was left out", brief(name)));
    }
    let channels: Vec<String> = kept(names, &numeric).cloned().collect();
    let Rows { mut trials, labels, .. } = rows;
    check_names(&channels, trials.len())?;
    warn_of_repeated_times(&trials, warnings);
    if numeric.contains(&false) {
        for trial in &mut trials {
            trial.values = trial.values.chunks(names.len()).flat_map(|row| kept(row, &numeric).copied()).collect();
        }
    }
    fill_gaps(&mut trials, &channels, warnings)?;
    let series = at_one_rate(trials, channels.len(), warnings)?;
    let with_words = |trial: RawTrial| {
        let words = labels.get(&trial.label).copied().unwrap_or_default();
        ImportedTrial {
            name: trial.name,
            label: trial.label,
            size: words.size.map(str::to_owned),
            shape: words.shape.map(str::to_owned),
            signals: Signals { channels: channels.clone(), t_s: trial.t_s, values: trial.values },
        }
    };
    let trials: Vec<ImportedTrial> = series.into_iter().map(with_words).collect();
    warn_of_lengths(&trials, warnings);
    warn_of_few(trials.len(), labels.len(), warnings);
    Ok(trials)
}

fn kept<'a, T>(all: &'a [T], keep: &'a [bool]) -> impl Iterator<Item = &'a T> {
    all.iter().zip(keep).filter(|(_, keep)| **keep).map(|(one, _)| one)
}

/// Every trial carries the names of its channels, which may be long, and the trials many.
fn check_names(channels: &[String], trials: usize) -> Result<(), ImportFault> {
    let each: usize = channels.iter().map(|name| name.len() + size_of::<String>()).sum();
    if trials.saturating_mul(each) > MOST_NAME_BYTES {
        return Err(ImportFault::TooManyNames { trials, channels: channels.len() });
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

fn fill_gaps(trials: &mut [RawTrial], channels: &[String], warnings: &mut Vec<String>) -> Result<(), Located> {
    let mut alike = Alike::default();
    for trial in trials {
        // Counted before gaps are filled: a trial of one sample has no neighbours to fill from.
        if trial.t_s.len() < 2 {
            let fault = ImportFault::ShortTrial { trial: brief(&trial.name), samples: trial.t_s.len() };
            return Err(fault.at(trial.line));
        }
        for (c, channel) in channels.iter().enumerate() {
            let Some(filled) = resample::fill_gaps(&trial.t_s, &mut trial.values, c) else {
                let fault = ImportFault::EmptyChannel { trial: brief(&trial.name), channel: brief(channel) };
                return Err(fault.at(trial.line));
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

/// Resamples the trials that do not run at the common rate already.
fn at_one_rate(mut trials: Vec<RawTrial>, width: usize, warnings: &mut Vec<String>) -> Result<Vec<RawTrial>, Located> {
    let rates: Vec<f64> = trials.iter().map(|trial| resample::rate(&trial.t_s)).collect();
    let rate_hz = resample::common_rate(&mut rates.clone());
    // Every size is known and within bounds before any memory is asked for.
    let mut lengths = Vec::with_capacity(trials.len());
    for trial in &trials {
        lengths.push(if resample::runs_at(&trial.t_s, rate_hz) { None } else { Some(even_samples(trial, rate_hz)?) });
    }
    let total: usize = trials.iter().zip(&lengths).map(|(trial, n)| n.unwrap_or(trial.t_s.len())).sum();
    if total.saturating_mul(width) > MOST_VALUES {
        return Err(ImportFault::TooManyValues.into());
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
        warnings.push(format!("{count} resampled to {rate_hz} Hz: the times are uneven or at another rate ({own})"));
    }
    if rate_hz < 1.0 {
        let rate_hz = three_digits(rate_hz);
        warnings.push(format!("the trials have only {rate_hz} samples per second; is t_s really in seconds?"));
    }
    Ok(trials)
}

/// How many samples a trial will have at the common rate.
fn even_samples(trial: &RawTrial, rate_hz: f64) -> Result<usize, Located> {
    let samples = resample::even_samples(&trial.t_s, rate_hz);
    let fault = if samples < 2.0 {
        ImportFault::BriefTrial { trial: brief(&trial.name), span_s: resample::span(&trial.t_s), rate_hz }
    } else if samples > MOST_SAMPLES as f64 {
        let (from_s, to_s) = (trial.t_s[0], trial.t_s[trial.t_s.len() - 1]);
        ImportFault::WildTime { trial: brief(&trial.name), from_s, to_s, rate_hz }
    } else {
        return Ok(samples as usize);
    };
    Err(fault.at(trial.line))
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
        warnings.push("only one label: there is nothing to tell apart, and training will refuse".to_owned());
    }
    if trials <= 2 {
        let count = counted(trials, "trial", "trials");
        warnings.push(format!("only {count}: too few to learn from one and be tested on another"));
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

/// Warnings of one kind, so that a million of them do not bury the others.
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

    /// Tells how many were not listed.
    fn close(self, warnings: &mut Vec<String>, what: &str) {
        if self.count > MOST_ALIKE {
            warnings.push(format!("and {} more {what}", self.count - MOST_ALIKE));
        }
    }
}
