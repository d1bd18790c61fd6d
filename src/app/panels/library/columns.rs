//! Columns of the library: which fit, and the text of each.

use crate::app::widgets::capital;
use palpate_lab::workers::LibraryView;
use palpate_store::{LibraryTrial, TrialColumn, TrialPlace, TrialQuality};

/// A column: what it holds, its width (points), and its rank: the lowest stay where there is little room.
#[derive(Clone, Copy)]
pub(super) struct Column {
    pub(super) shows: Shows,
    width: f32,
    rank: u8,
}

/// Content of a column.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Shows {
    /// Picture of the object.
    Thumbnail,
    /// Small plot.
    Sparkline,
    Text(TrialColumn),
}

const fn text(column: TrialColumn, width: f32, rank: u8) -> Column {
    Column { shows: Shows::Text(column), width, rank }
}

/// All columns in their order.
const COLUMNS: [Column; 11] = [
    Column { shows: Shows::Thumbnail, width: 30.0, rank: 0 },
    text(TrialColumn::Id, 54.0, 3),
    text(TrialColumn::Object, 116.0, 0),
    Column { shows: Shows::Sparkline, width: 66.0, rank: 2 },
    text(TrialColumn::Date, 104.0, 0),
    text(TrialColumn::Source, 70.0, 4),
    text(TrialColumn::Quality, 68.0, 1),
    text(TrialColumn::Preset, 52.0, 6),
    text(TrialColumn::Sensors, 84.0, 7),
    text(TrialColumn::Tags, 84.0, 4),
    text(TrialColumn::Note, 110.0, 5),
];

/// Width from which on the list is a table (points).
pub(super) const TABLE: f32 = 460.0;

/// Columns that fit into a width, with their widths; the last text gets what is left over.
pub(super) fn fitting(room: f32) -> Vec<(Shows, f32)> {
    let mut ranks: Vec<u8> = COLUMNS.iter().map(|column| column.rank).collect();
    ranks.sort_unstable();
    ranks.dedup();
    let width = |rank: u8| COLUMNS.iter().filter(|c| c.rank <= rank).map(|c| c.width).sum::<f32>();
    let rank = ranks.into_iter().rev().find(|rank| width(*rank) <= room).unwrap_or(0);
    let mut fit: Vec<(Shows, f32)> =
        COLUMNS.iter().filter(|column| column.rank <= rank).map(|column| (column.shows, column.width)).collect();
    let spare = (room - width(rank)).max(0.0);
    if let Some((_, width)) = fit.last_mut() {
        *width += spare;
    }
    fit
}

/// Title of a column.
pub(super) fn title(column: TrialColumn) -> &'static str {
    match column {
        TrialColumn::Id => "no",
        other => other.name(),
    }
}

/// Text of a trial in a column.
pub(super) fn cell(view: &LibraryView, trial: &LibraryTrial, column: TrialColumn) -> String {
    let row = &trial.row;
    match column {
        TrialColumn::Id => row.id.to_string(),
        TrialColumn::Object => format!("{}{}", capital(&trial.title), if row.unsure { "?" } else { "" }),
        TrialColumn::Date => view.date(&row.local),
        TrialColumn::Source if row.place == TrialPlace::DemoLog => row.place.title().to_owned(),
        TrialColumn::Source if row.emulated => row.gripper().to_owned(),
        TrialColumn::Source => row.source.title().to_owned(),
        TrialColumn::Preset => row.preset.unwrap_or_default().to_owned(),
        TrialColumn::Sensors => row.sensors.clone(),
        TrialColumn::Quality => quality(trial),
        TrialColumn::Tags => row.tags.join(", "),
        TrialColumn::Note => row.note.clone(),
        TrialColumn::Samples => row.samples.to_string(),
    }
}

fn quality(trial: &LibraryTrial) -> String {
    match trial.quality() {
        _ if trial.row.deleted.is_some() => "discarded".to_owned(),
        TrialQuality::Warned if trial.row.state != "complete" => "incomplete".to_owned(),
        quality => quality.name().to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_fill_the_room_and_leave_in_their_rank() {
        for room in [TABLE, 600.0, 700.0, 884.0, 1400.0] {
            let fit = fitting(room);
            let sum: f32 = fit.iter().map(|(_, width)| width).sum();
            assert!((sum - room).abs() < 0.01, "{room}: {sum}");
            let has = |column: TrialColumn| fit.iter().any(|(shows, _)| *shows == Shows::Text(column));
            assert!(has(TrialColumn::Object) && has(TrialColumn::Date), "{room}");
            assert_eq!(has(TrialColumn::Sensors), room > 850.0, "{room}");
        }
        assert_eq!(fitting(884.0).len(), COLUMNS.len());
    }
}
