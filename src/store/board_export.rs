//! Trials of a real gripper as CSV: raw counts, one row per reading. The capture file beside it can be replayed like a
//! port.
//!
//! Columns: `t_s` and `arrived_s` since the trial began, `seq`, `missing_before`, the channels (counts), `line_pressure
//! (bar)`, `phase`. A missing number is an empty field; `missing_before` is the number of readings missing before the
//! row, `?` where unknown.

use super::csv_export::{number, write_file};
use super::file_kind::FileKind;
use super::store_error::ExportError;
use palpate_tactile::board::Reading;
use palpate_tactile::trial::{BoardLog, PhaseMark};
use std::path::Path;

/// Writes one row per reading.
pub fn write_board_csv(path: &Path, trial: &BoardLog) -> Result<(), ExportError> {
    let channels = &trial.course.board.channels;
    write_file(path, FileKind::Csv, |out| {
        let before = ["t_s", "arrived_s", "seq", "missing_before"].map(str::to_owned).into_iter();
        let after = ["line_pressure [bar]", "phase"].map(str::to_owned);
        out.write_record(before.chain(channels.iter().map(|name| format!("{name} [counts]"))).chain(after))?;
        let mut gaps = trial.gaps.iter().peekable();
        for reading in &trial.readings {
            let mut missing = String::new();
            while let Some(gap) = gaps.next_if(|gap| gap.to_s <= reading.t_s) {
                missing = gap.lost.map_or_else(|| "?".to_owned(), |lost| lost.to_string());
            }
            out.write_record(row(reading, missing, trial))?;
        }
        Ok(())
    })
}

fn row(reading: &Reading, missing: String, trial: &BoardLog) -> Vec<String> {
    let since = |t: f64| number(t - trial.course.began_s);
    let mut fields = vec![since(reading.t_s), since(reading.arrived_s)];
    fields.push(reading.seq.map(|seq| seq.to_string()).unwrap_or_default());
    fields.push(missing);
    fields.extend(reading.counts.iter().map(|count| count.map(|count| count.to_string()).unwrap_or_default()));
    let mark = trial.course.phases.iter().rev().find(|mark| mark.from_s <= reading.t_s);
    let bar = reading.line_bar.or_else(|| mark?.line_bar);
    fields.push(bar.map(number).unwrap_or_default());
    fields.push(mark.map(|PhaseMark { phase, .. }| phase.name().to_owned()).unwrap_or_default());
    fields
}
