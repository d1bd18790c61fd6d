//! The interface of models that classify a row of features.

use crate::arrays::Arrays;
use std::fmt::Debug;

/// Training rows.
pub(crate) struct Rows {
    /// Features, `[rows][columns]`.
    pub(crate) values: Vec<f32>,
    /// Features of a row.
    pub(crate) columns: usize,
    /// Class of each row.
    pub(crate) labels: Vec<usize>,
    /// Weight of each row; none where all are equal. Nearest neighbours and support vector machines do without.
    pub(crate) weights: Option<Vec<f64>>,
    /// Number of classes.
    pub(crate) classes: usize,
}

/// Fitted classifier of rows.
pub(crate) trait RowModel: Debug + Send + Sync {
    /// Weight of each class for a row of features, not negative and not normalised.
    fn predict(&self, row: &[f32]) -> Vec<f64>;

    /// True if NaN may stand for a value that is not known.
    fn answers_in_part(&self) -> bool {
        false
    }

    /// Adds the learned parameters.
    fn save(&self, arrays: &mut Arrays);
}
