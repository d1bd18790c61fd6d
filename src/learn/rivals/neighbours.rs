//! The nearest neighbours of a row of features, found by smartcore's cover tree.

use super::super::FitError;
use super::super::model_file::Arrays;
use super::tabular::Rows;
use smartcore::algorithm::neighbour::cover_tree::CoverTree;
use smartcore::metrics::distance::euclidian::Euclidian;

/// Neighbours that vote.
const VOTERS: usize = 7;

/// Rows that are remembered.
#[derive(Debug)]
pub(super) struct Neighbours {
    tree: CoverTree<Vec<f64>, Euclidian<f64>>,
    rows: Vec<f32>,
    labels: Vec<usize>,
    columns: usize,
    classes: usize,
}

impl Neighbours {
    pub(super) fn fit(rows: &Rows) -> Result<Self, FitError> {
        Self::remember(rows.values.clone(), rows.labels.clone(), rows.columns, rows.classes)
            .map_err(|cause| FitError::Failed { cause })
    }

    fn remember(rows: Vec<f32>, labels: Vec<usize>, columns: usize, classes: usize) -> Result<Self, String> {
        let points = rows.chunks_exact(columns.max(1)).map(|row| row.iter().map(|x| f64::from(*x)).collect()).collect();
        let tree = CoverTree::new(points, Euclidian::new()).map_err(|e| e.to_string())?;
        Ok(Self { tree, rows, labels, columns, classes })
    }

    pub(super) fn columns(&self) -> usize {
        self.columns
    }

    pub(super) fn classes(&self) -> usize {
        self.classes
    }

    pub(super) fn described(&self) -> String {
        format!("{VOTERS} nearest by Euclidean distance, votes weighted by one over distance")
    }

    /// Shares of the votes, weighted by one over the distance.
    pub(super) fn predict(&self, row: &[f32]) -> Vec<f64> {
        let point = row.iter().map(|x| f64::from(*x)).collect();
        let mut votes = vec![0.0; self.classes];
        // It fails only when asked for more neighbours than there are.
        for (index, distance, _) in self.tree.find(&point, VOTERS.min(self.labels.len())).unwrap_or_default() {
            votes[self.labels[index]] += 1.0 / distance.max(1e-9);
        }
        votes
    }

    pub(super) fn save(&self, arrays: &mut Arrays) {
        arrays.put("neighbours.rows", &[self.labels.len(), self.columns], &self.rows);
        arrays.put_integers("neighbours.labels", &self.labels.iter().map(|l| *l as i64).collect::<Vec<_>>());
    }

    pub(super) fn load(arrays: &Arrays, columns: usize, classes: usize) -> Result<Self, String> {
        let labels = arrays.get_integers("neighbours.labels")?;
        let rows = arrays.get("neighbours.rows", &[labels.len(), columns])?;
        let labels: Vec<usize> = labels.into_iter().filter_map(|l| usize::try_from(l).ok()).collect();
        if labels.is_empty() || labels.len() * columns != rows.len() || labels.iter().any(|l| *l >= classes) {
            return Err("the labels of its neighbours do not fit".to_owned());
        }
        Self::remember(rows, labels, columns, classes)
    }
}
