//! Nearest neighbours of a row of features, searched in smartcore's cover tree.

use super::row_model::{RowModel, Rows};
use crate::arrays::Arrays;
use crate::fitting::LearnError;
use crate::model::LoadError;
use smartcore::algorithm::neighbour::cover_tree::CoverTree;
use smartcore::error::Failed;
use smartcore::metrics::distance::euclidian::Euclidian;

/// Number of neighbours that vote.
const VOTERS: usize = 7;

/// Training rows in a search tree.
#[derive(Debug)]
pub(super) struct Neighbours {
    tree: CoverTree<Vec<f64>, Euclidian<f64>>,
    rows: Vec<f32>,
    labels: Vec<usize>,
    columns: usize,
    classes: usize,
}

impl Neighbours {
    /// Description of the method for the model's card.
    pub(super) const DESCRIPTION: &str = "7 nearest by Euclidean distance, votes weighted by one over distance";

    pub(super) fn fit(rows: &Rows) -> Result<Self, LearnError> {
        Self::new(rows.values.clone(), rows.labels.clone(), rows.columns, rows.classes).map_err(LearnError::failed)
    }

    pub(super) fn load(arrays: &Arrays, columns: usize, classes: usize) -> Result<Self, LoadError> {
        let labels = arrays.indices("neighbours.labels", classes, "a class")?;
        arrays.require("neighbours.rows", &[labels.len(), columns], "neighbours.labels")?;
        let rows = arrays.f32s("neighbours.rows", &[labels.len(), columns])?.to_vec();
        Self::new(rows, labels, columns, classes).map_err(|error| LoadError::Failed { cause: error.to_string() })
    }

    fn new(rows: Vec<f32>, labels: Vec<usize>, columns: usize, classes: usize) -> Result<Self, Failed> {
        let points = rows.chunks_exact(columns.max(1)).map(|row| row.iter().map(|x| f64::from(*x)).collect()).collect();
        Ok(Self { tree: CoverTree::new(points, Euclidian::new())?, rows, labels, columns, classes })
    }
}

impl RowModel for Neighbours {
    /// Votes for each class, weighted by one over distance.
    fn predict(&self, row: &[f32]) -> Vec<f64> {
        let point = row.iter().map(|x| f64::from(*x)).collect();
        let mut votes = vec![0.0; self.classes];
        // The search fails only when asked for more neighbours than rows.
        for (index, distance, _) in self.tree.find(&point, VOTERS.min(self.labels.len())).unwrap_or_default() {
            votes[self.labels[index]] += 1.0 / distance.max(1e-9);
        }
        votes
    }

    fn save(&self, arrays: &mut Arrays) {
        arrays.put("neighbours.rows", &[self.labels.len(), self.columns], self.rows.clone());
        arrays.put_integers("neighbours.labels", self.labels.iter().copied());
    }
}
