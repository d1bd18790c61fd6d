//! Trials of a real gripper as CSV: raw counts, one row per reading. The capture file beside it can be replayed like a
//! port.
//!
//! Columns: `t_s` and `arrived_s` since the trial began, `seq`, `missing_before`, the channels (counts), `line_pressure
//! (bar)`, `command`. A missing number is an empty field; `missing_before` is the number of readings missing before the
//! row, `?` where unknown.

use super::writing::{number, write_file};
use crate::format::ExchangeError;
use palpate_store::FileKind;
use palpate_tactile::board::Reading;
use palpate_tactile::trial::{BoardLog, PhaseMark};
use std::path::Path;

/// Writes one row per reading.
pub(super) fn write_board_csv(path: &Path, trial: &BoardLog) -> Result<(), ExchangeError> {
    let channels = &trial.course.board.channels;
    write_file(path, FileKind::Csv, |out| {
        let before = ["t_s", "arrived_s", "seq", "missing_before"].map(str::to_owned).into_iter();
        let after = ["line_pressure [bar]", "command"].map(str::to_owned);
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

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_sim::gripper::Phase;
    use palpate_tactile::board::{Board, Gap};
    use palpate_tactile::trial::BoardCourse;

    #[test]
    fn rows_have_counts_gaps_and_phases() -> Result<(), Box<dyn std::error::Error>> {
        let reading = |seq: u64, first: Option<f32>| Reading {
            t_s: 0.5 * seq as f64 + 1.0,
            arrived_s: 0.5 * seq as f64 + 1.25,
            seq: Some(seq),
            counts: vec![first, Some(12.5)],
            line_bar: (seq == 0).then_some(0.55),
        };
        let gap = |from_s: f64, to_s: f64, lost| Gap { from_s, to_s, lost, cause: String::new() };
        let mark = PhaseMark { from_s: 2.0, phase: Phase::Close, line_bar: Some(0.05) };
        let board = Board { channels: vec!["flexL".to_owned(), "fsrL".to_owned()], ..Board::default() };
        let log = BoardLog {
            course: BoardCourse { board, began_s: 1.0, phases: vec![mark], ..BoardCourse::default() },
            readings: vec![reading(0, None), reading(3, Some(2003.0)), reading(9, Some(2009.0))],
            gaps: vec![gap(1.0, 2.5, Some(2)), gap(2.5, 5.5, None)],
        };
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("trial.csv");
        write_board_csv(&path, &log)?;
        let wanted = "t_s,arrived_s,seq,missing_before,flexL [counts],fsrL [counts],line_pressure [bar],command
0,0.25,0,,,12.5,0.55,
1.5,1.75,3,2,2003,12.5,0.05,close
4.5,4.75,9,?,2009,12.5,0.05,close
";
        assert_eq!(std::fs::read_to_string(path)?, wanted);
        Ok(())
    }
}
