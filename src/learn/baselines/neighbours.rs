//! Nearest neighbours of a row of features, among all training rows.

use crate::arrays::{Arrays, ModelError};
use crate::rows::{RowModel, Rows};

/// Number of neighbours that vote.
const VOTERS: usize = 7;

/// Training rows.
#[derive(Debug)]
pub(super) struct Neighbours {
    rows: Vec<f32>,
    labels: Vec<usize>,
    columns: usize,
    classes: usize,
}

impl Neighbours {
    /// Description of the method for the model's card.
    pub(super) const DESCRIPTION: &str = "7 nearest by Euclidean distance, votes weighted by one over distance";

    pub(super) fn fit(rows: &Rows) -> Self {
        Self { rows: rows.values.clone(), labels: rows.labels.clone(), columns: rows.columns, classes: rows.classes }
    }

    pub(super) fn load(arrays: &Arrays, columns: usize, classes: usize) -> Result<Self, ModelError> {
        let labels = arrays.indices("neighbours.labels", classes, "a class")?;
        arrays.require("neighbours.rows", &[labels.len(), columns], "neighbours.labels")?;
        let rows = arrays.f32s("neighbours.rows", &[labels.len(), columns])?.to_vec();
        Ok(Self { rows, labels, columns, classes })
    }
}

impl RowModel for Neighbours {
    /// Votes for each class, weighted by one over distance.
    fn predict(&self, row: &[f32]) -> Vec<f64> {
        let distance = |own: &[f32]| {
            let squares = own.iter().zip(row).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2));
            squares.sum::<f64>().sqrt()
        };
        let distances = self.rows.chunks_exact(self.columns.max(1)).map(distance);
        let mut nearest: Vec<(f64, usize)> = distances.zip(self.labels.iter().copied()).collect();
        nearest.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut votes = vec![0.0; self.classes];
        for (distance, label) in nearest.into_iter().take(VOTERS) {
            votes[label] += 1.0 / distance.max(1e-9);
        }
        votes
    }

    fn save(&self, arrays: &mut Arrays) {
        arrays.put("neighbours.rows", &[self.labels.len(), self.columns], self.rows.clone());
        arrays.put_integers("neighbours.labels", self.labels.iter().copied());
    }
}
