//! The geometry of whatever is grasped, felt row by row.

use super::row::Row;
use palpate_learn::{GeometryEncoder, Measured, Sequence, Shipped};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Time between two estimates (s).
const EVERY_S: f32 = 0.1;

/// The geometry encoder at work on successive grasps.
#[derive(Default)]
pub(super) struct FeltGeometry {
    /// None where the rows lack readings that it needs.
    encoder: Option<Arc<GeometryEncoder>>,
    /// Column of each of its channels in a row.
    columns: Vec<usize>,
    readings: Sequence,
    /// Number of the time step of the last estimate.
    step: i64,
    newest: Option<Arc<Measured>>,
}

impl FeltGeometry {
    /// Begins a grasp whose rows have these channels in these columns, for the shipped encoder.
    pub(super) fn begin(&mut self, shipped: Shipped, columns: &BTreeMap<String, usize>) {
        // A damaged encoder fails a test; without one, nothing is measured.
        let places = |encoder: &GeometryEncoder| -> Option<Vec<usize>> {
            encoder.channels().iter().map(|channel| columns.get(channel).copied()).collect()
        };
        let found = shipped.encoder().ok().and_then(|encoder| Some((places(&encoder)?, encoder)));
        let (columns, encoder) = found.unzip();
        *self = Self { encoder, columns: columns.unwrap_or_default(), ..Self::default() };
    }

    /// Forgets the grasp.
    pub(super) fn forget(&mut self) {
        (self.readings, self.step, self.newest) = (Sequence::default(), 0, None);
    }

    /// Takes in a row, `t` seconds after the closing began; true when there is a new estimate. A row in which a channel is
    /// undefined is skipped.
    pub(super) fn push(&mut self, t: f64, row: &Row) -> bool {
        let values = self.columns.iter().map(|column| row.values[*column]);
        if self.encoder.is_none() || values.clone().any(f32::is_nan) {
            return false;
        }
        self.readings.t_s.push(t as f32);
        self.readings.values.extend(values);
        let step = (t as f32 / EVERY_S) as i64;
        step != std::mem::replace(&mut self.step, step) && self.measure()
    }

    /// Estimates from all readings so far; true where it can.
    pub(super) fn measure(&mut self) -> bool {
        let measured = self.encoder.as_ref().and_then(|encoder| encoder.measure(&self.readings));
        let is_new = measured.is_some();
        self.newest = measured.map(Arc::new).or_else(|| self.newest.take());
        is_new
    }

    /// Whether the rows serve.
    pub(super) fn serves(&self) -> bool {
        self.encoder.is_some()
    }

    /// The newest estimate; none before the first contact.
    pub(super) fn newest(&self) -> Option<Arc<Measured>> {
        self.newest.clone()
    }
}
