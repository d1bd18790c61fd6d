//! Readings by channel, each at its own times, and the table that they make.

use std::collections::BTreeMap;
use std::io::{self, Read};

/// Most channels, and most numbers in all.
pub(crate) const MOST_CHANNELS: usize = 200;
pub(crate) const MOST_NUMBERS: usize = 50_000_000;
/// Longest pause between readings of a channel that a line bridges, in usual intervals: three readings are missing.
pub(crate) const LONGEST_PAUSE: f64 = 4.5;

/// Readings of one run by name: time (s) and value.
type Run = BTreeMap<String, Vec<(f64, f64)>>;

/// Readings of channels over time, in runs that follow each other.
#[derive(Default)]
pub(crate) struct Series {
    runs: Vec<Run>,
    held: usize,
}

impl Series {
    /// Adds a reading to a run.
    pub(crate) fn push(&mut self, run: usize, name: &str, t_s: f64, value: f64) -> Result<(), String> {
        if self.held >= MOST_NUMBERS {
            return Err(format!("it has more than {MOST_NUMBERS} numbers; split it"));
        }
        if self.runs.len() <= run {
            self.runs.resize_with(run + 1, Run::new);
        }
        let run = &mut self.runs[run];
        if !run.contains_key(name) && run.len() >= MOST_CHANNELS {
            return Err(format!("it has more than {MOST_CHANNELS} channels; split it"));
        }
        run.entry(name.to_owned()).or_default().push((t_s, value));
        self.held += 1;
        Ok(())
    }

    /// Channels of a single reading, which it holds at all times.
    pub(crate) fn singles(&self) -> Vec<&str> {
        let is_single =
            |name: &&String| self.runs.iter().filter_map(|run| run.get(*name)).map(Vec::len).sum::<usize>() == 1;
        let mut names: Vec<&str> = self.runs.iter().flat_map(Run::keys).filter(is_single).map(String::as_str).collect();
        names.dedup();
        names
    }

    /// A table of this program: the channel with most readings gives the times of a run, the others are interpolated. None
    /// without two readings of any channel.
    pub(crate) fn into_csv(self, label: &str) -> Option<impl Read + use<>> {
        let names: Vec<String> = {
            let mut names: Vec<&String> = self.runs.iter().flat_map(Run::keys).collect();
            names.sort();
            names.dedup();
            names.into_iter().cloned().collect()
        };
        let mut tables: Vec<(Vec<f64>, Vec<Vec<f64>>)> = Vec::new();
        for run in self.runs {
            let Some(clock) = run.values().max_by_key(|readings| readings.len()).filter(|clock| clock.len() > 1) else {
                continue;
            };
            let mut times: Vec<f64> = clock.iter().map(|(t, _)| *t).collect();
            times.sort_by(f64::total_cmp);
            times.dedup();
            let column = |name: &String| run.get(name).map_or_else(Vec::new, |readings| at_times(readings, &times));
            let columns = names.iter().map(column).collect();
            tables.push((times, columns));
        }
        if tables.is_empty() {
            return None;
        }
        let header: Vec<String> =
            ["trial", "label", "t_s"].into_iter().chain(names.iter().map(String::as_str)).map(quoted).collect();
        let header = header.join(",");
        let label = quoted(label);
        let lines = tables.into_iter().enumerate().flat_map(move |(run, (times, columns))| {
            let label = label.clone();
            let origin = times[0];
            times.into_iter().enumerate().map(move |(sample, t)| {
                let mut line = format!("\n{},{label},{}", run + 1, t - origin);
                for column in &columns {
                    line.push(',');
                    if let Some(value) = column.get(sample).filter(|value| value.is_finite()) {
                        line.push_str(&(*value as f32).to_string());
                    }
                }
                Ok(line.into_bytes())
            })
        });
        Some(Lines { rest: header.into_bytes(), at: 0, lines })
    }
}

/// Readings at other times, on straight lines between them; none in a pause, nor more than an interval before the first and
/// after the last.
fn at_times(readings: &[(f64, f64)], times: &[f64]) -> Vec<f64> {
    let mut sorted: Vec<(f64, f64)> = readings.iter().copied().filter(|(_, value)| value.is_finite()).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut intervals: Vec<f64> =
        sorted.windows(2).map(|pair| pair[1].0 - pair[0].0).filter(|step| *step > 0.0).collect();
    let middle = intervals.len() / 2;
    // A single reading holds at all times.
    let usual =
        if intervals.is_empty() { f64::INFINITY } else { *intervals.select_nth_unstable_by(middle, f64::total_cmp).1 };
    let longest = LONGEST_PAUSE * usual;
    let value = |t: &f64| {
        let after = sorted.partition_point(|(own, _)| own <= t);
        match (after.checked_sub(1).and_then(|before| sorted.get(before)), sorted.get(after)) {
            (Some((t0, value)), _) if t == t0 => *value,
            (Some((t0, v0)), Some((t1, v1))) if t1 - t0 <= longest => v0 + (v1 - v0) * ((t - t0) / (t1 - t0)),
            (Some((t0, value)), None) if t - t0 <= usual => *value,
            (None, Some((t1, value))) if t1 - t <= usual => *value,
            _ => f64::NAN,
        }
    };
    times.iter().map(value).collect()
}

/// A text as one field of a table.
pub(crate) fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}

/// Lines of text as bytes.
pub(crate) struct Lines<I> {
    pub(crate) rest: Vec<u8>,
    pub(crate) at: usize,
    pub(crate) lines: I,
}

impl<I: Iterator<Item = io::Result<Vec<u8>>>> Read for Lines<I> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if self.at == self.rest.len() {
            match self.lines.next().transpose()? {
                Some(line) => (self.rest, self.at) = (line, 0),
                None => return Ok(0),
            }
        }
        let count = out.len().min(self.rest.len() - self.at);
        out[..count].copy_from_slice(&self.rest[self.at..self.at + count]);
        self.at += count;
        Ok(count)
    }
}
