//! Rows of the running grasp of a real gripper: passed to a recogniser without what failed sensors read, and all anew when
//! another sensor fails.

use super::row::Row;
use crate::labelling::SensorWatch;
use palpate_tactile::Channel;

/// Rows that are kept: four seconds at 1 kHz, more of slower boards. Of a longer grasp the first count.
const MOST: usize = 4000;

/// The watched sensors and the rows of the running grasp.
#[derive(Clone, Debug, Default)]
pub(crate) struct FeltRows {
    pub(crate) watch: SensorWatch,
    /// Time since the closing (s), and the row as it was read.
    rows: Vec<(f64, Row)>,
}

impl FeltRows {
    /// A grasp begins.
    pub(crate) fn begin(&mut self) {
        self.watch.begin();
        self.rows.clear();
    }

    /// Keeps a row, `t` seconds after the closing, whose first values are of these channels; returns it for the recogniser.
    pub(crate) fn push(&mut self, t: f64, row: Row, channels: &[Channel]) -> Row {
        let mended = self.mended(&row, channels);
        if self.rows.len() < MOST {
            self.rows.push((t, row));
        }
        mended
    }

    /// All rows so far, for a recogniser that begins anew.
    pub(crate) fn anew(&self, channels: &[Channel]) -> Vec<(f64, Row)> {
        self.rows.iter().map(|(t, row)| (*t, self.mended(row, channels))).collect()
    }

    fn mended(&self, row: &Row, channels: &[Channel]) -> Row {
        let mut mended = row.clone();
        self.watch.mend(channels, &mut mended.values, row.line_bar);
        mended
    }
}
