//! Rows that tabular recognisers classify: features of a grasp, and those of the geometry encoder behind them.

use super::felt_steps::Columns;
use super::geometry::{GeometryEncoder, Shipped};
use crate::arrays::{Arrays, ModelError};
use crate::data::{Dataset, Sequence};
use crate::features::Features;
use crate::fitting::LearnError;
use crate::rows::Rows;
use std::sync::Arc;

/// Features of a grasp, with those of the geometry encoder for classifiers that read them.
pub(super) struct RowMaker {
    pub(super) features: Features,
    pub(super) encoder: Option<ReadEncoder>,
}

impl RowMaker {
    pub(super) fn width(&self) -> usize {
        self.features.width() + self.encoder.as_ref().map_or(0, |own| own.encoder.width())
    }

    /// Features of a grasp, and of its mirror image where it can be mirrored.
    pub(super) fn views(&self, grasp: &Sequence) -> (Vec<f32>, Option<Vec<f32>>) {
        let (mut own, mut mirrored) = (self.features.row(grasp), self.features.mirrored(grasp));
        if let Some(encoder) = &self.encoder {
            // They are means over both views.
            let encoded = encoder.features(grasp);
            own.extend_from_slice(&encoded);
            mirrored.iter_mut().for_each(|row| row.extend_from_slice(&encoded));
        }
        (own, mirrored)
    }

    /// The row of a beginning of a grasp, of which the first windows are over; what comes later is unknown.
    pub(super) fn known(&self, windows: usize, mut row: Vec<f32>) -> Vec<f32> {
        self.features.forget_after(windows, &mut row[..self.features.width()]);
        row
    }
}

/// The geometry encoder with the columns of its channels.
pub(super) struct ReadEncoder {
    encoder: Arc<GeometryEncoder>,
    columns: Columns,
}

/// Beginning of the names of the encoder's arrays in a model file.
const ENCODER: &str = "encoder.";

impl ReadEncoder {
    /// The shipped encoder for grasps of this data set.
    pub(super) fn shipped_for(data: &Dataset) -> Result<Self, LearnError> {
        let encoder = Shipped::of(&data.about).encoder().map_err(LearnError::failed)?;
        let refused = LearnError::encoder(encoder.channels(), &data.channels);
        Self::on(encoder, &data.channels).ok_or(refused)
    }

    /// Restores the encoder of a model file.
    pub(super) fn load(settings: &serde_json::Value, channels: &[String], arrays: &Arrays) -> Result<Self, ModelError> {
        let encoder = Arc::new(GeometryEncoder::load_from(settings, arrays, ENCODER)?);
        Self::on(encoder, channels).ok_or_else(|| ModelError::card("the geometry encoder"))
    }

    /// The encoder on readings of these channels; none where they lack one of its own.
    fn on(encoder: Arc<GeometryEncoder>, channels: &[String]) -> Option<Self> {
        let columns = Columns::of(encoder.channels(), channels)?;
        Some(Self { encoder, columns })
    }

    /// Settings for a model file.
    pub(super) fn settings(&self) -> serde_json::Value {
        self.encoder.settings()
    }

    /// Adds the arrays for a model file.
    pub(super) fn save(&self, arrays: &mut Arrays) {
        let own = self.encoder.arrays().0;
        arrays.0.extend(own.into_iter().map(|(name, array)| (format!("{ENCODER}{name}"), array)));
    }

    fn features(&self, grasp: &Sequence) -> Vec<f32> {
        self.encoder.features(&self.columns.pick(grasp))
    }
}

/// Mean and one over the standard deviation of each column; the factor of a constant column is zero.
pub(super) fn scaling(rows: &Rows) -> Vec<(f32, f32)> {
    let count = rows.labels.len().max(1) as f64;
    (0..rows.columns)
        .map(|column| {
            let values = || rows.values.iter().skip(column).step_by(rows.columns).map(|x| f64::from(*x));
            let mean = values().sum::<f64>() / count;
            let deviation = (values().map(|x| (x - mean).powi(2)).sum::<f64>() / count).sqrt();
            let factor = if deviation > 1e-6 * mean.abs().max(1e-30) { 1.0 / deviation } else { 0.0 };
            (mean as f32, factor as f32)
        })
        .collect()
}

/// Bound of scaled features: one that hardly varied in training must not dominate later.
const MOST_DEVIATIONS: f32 = 10.0;

pub(super) fn scale(row: &mut [f32], scaling: &[(f32, f32)]) {
    for (x, (mean, factor)) in row.iter_mut().zip(scaling) {
        *x = ((*x - mean) * factor).clamp(-MOST_DEVIATIONS, MOST_DEVIATIONS);
    }
}
