//! Trees for classification, and ensembles of them, on tables of hand-made features.
//!
//! | model | how | after |
//! |---|---|---|
//! | [`Forest`] | one tree, bagged trees or a random forest, by its settings | Breiman 1984, 1996, 2001 |
//! | [`GradientBoosting`] | a regression tree per class and round, on the softmax deviance | Friedman 2001 |
//! | [`RusBoost`] | boosting in which every round sees as many rows of each class | Seiffert et al. 2010 |
//!
//! All of them grow the same weighted tree: columns are sorted into at most 255 bins once, after which a split is
//! searched by counting. Nothing is learnt from rows other than those given to `fit`. The same rows, settings and seed
//! give the same model, and a model is a handful of flat [arrays](Array) that can be stored and are checked when read.
//! Rows to be predicted are not checked: a value that is no number goes the way of great ones.

mod arrays;
mod bagging;
mod bins;
mod gradient;
#[cfg(test)]
mod peers;
mod reweighting;
mod rusboost;
mod split;
mod stored_trees;
mod tree;

pub use arrays::{Array, ArrayError};
pub use bagging::{Forest, ForestSettings, RowSampling};
pub use gradient::{GradientBoosting, GradientBoostingSettings};
pub use rusboost::{RusBoost, RusBoostForm, RusBoostSettings};
pub use tree::{FeatureSampling, TreeSettings};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Rows of features, in any units: trees see their order only.
#[derive(Clone, Copy, Debug)]
pub struct Table<'a> {
    /// Row after row, `columns` values each.
    pub values: &'a [f32],
    /// Features of a row.
    pub columns: usize,
}

impl<'a> Table<'a> {
    fn row(&self, row: usize) -> &'a [f32] {
        &self.values[row * self.columns..(row + 1) * self.columns]
    }
}

/// What a model learns from.
#[derive(Clone, Copy, Debug)]
pub struct Examples<'a> {
    /// A row of features for each example.
    pub table: Table<'a>,
    /// The class of each row, below `classes`.
    pub labels: &'a [usize],
    /// Number of classes; some may have no row, and are then never predicted.
    pub classes: usize,
    /// How much each row counts, not negative; `None`: all the same. A row that counts for nothing is left out.
    pub weights: Option<&'a [f64]>,
}

/// Why a model cannot be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// The table is no table of as many rows as there are labels.
    #[error("{values} values are not {rows} rows of {columns} columns")]
    Shape {
        /// Values in the table.
        values: usize,
        /// Labels.
        rows: usize,
        /// Columns asked for.
        columns: usize,
    },
    /// Not as many weights as rows.
    #[error("there are {weights} weights for {rows} rows")]
    WeightCount {
        /// Weights given.
        weights: usize,
        /// Rows given.
        rows: usize,
    },
    /// A label is not below the number of classes.
    #[error("row {row} has class {label}, but there are {classes} classes")]
    Label {
        /// The row, from 0.
        row: usize,
        /// Its label.
        label: usize,
        /// Number of classes.
        classes: usize,
    },
    /// A feature is infinite or no number.
    #[error("column {column} of row {row} is not a finite number")]
    Value {
        /// The row, from 0.
        row: usize,
        /// The column, from 0.
        column: usize,
    },
    /// A weight is negative, huge or no number.
    #[error("the weight of row {row} is not a number from 0 to 1e100")]
    Weight {
        /// The row, from 0.
        row: usize,
    },
    /// There is nothing to learn from.
    #[error("no row has any weight")]
    Empty,
    /// A setting out of its range.
    #[error("{name} must be {range}")]
    Setting {
        /// Which.
        name: &'static str,
        /// What it may be.
        range: &'static str,
    },
}

/// Squares of sums of weights must stay finite.
const MOST_WEIGHT: f64 = 1e100;

impl Examples<'_> {
    /// Refuses what no model can learn from.
    fn check(&self) -> Result<(), FitError> {
        let (rows, columns) = (self.labels.len(), self.table.columns);
        let values = self.table.values.len();
        if columns == 0 || rows.checked_mul(columns) != Some(values) || u32::try_from(rows).is_err() {
            return Err(FitError::Shape { values, rows, columns });
        }
        if let Some((row, &label)) = self.labels.iter().enumerate().find(|(_, label)| **label >= self.classes) {
            return Err(FitError::Label { row, label, classes: self.classes });
        }
        if let Some(at) = self.table.values.iter().position(|value| !value.is_finite()) {
            return Err(FitError::Value { row: at / columns, column: at % columns });
        }
        let weights = self.weights.unwrap_or_default();
        if self.weights.is_some() && weights.len() != rows {
            return Err(FitError::WeightCount { weights: weights.len(), rows });
        }
        if let Some(row) = weights.iter().position(|weight| !(0.0..=MOST_WEIGHT).contains(weight)) {
            return Err(FitError::Weight { row });
        }
        if self.rows().is_empty() { Err(FitError::Empty) } else { Ok(()) }
    }

    fn weight(&self, row: usize) -> f64 {
        self.weights.map_or(1.0, |weights| weights[row])
    }

    /// The rows that count.
    fn rows(&self) -> Vec<u32> {
        (0..self.labels.len()).filter(|&row| self.weight(row) > 0.0).map(|row| row as u32).collect()
    }

    /// The classes that have rows, ascending.
    fn present(&self) -> Vec<usize> {
        let mut has_rows = vec![false; self.classes];
        for row in self.rows() {
            has_rows[self.labels[row as usize]] = true;
        }
        (0..self.classes).filter(|&class| has_rows[class]).collect()
    }
}

/// Random numbers of their own for every tree, so that trees could be grown in any order.
fn random_of(seed: u64, tree: usize) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(tree as u64);
    random
}

/// Greatest learning rate: a weight that grows by exp(10 · 40) in a round is still finite.
const MOST_LEARNING_RATE: f64 = 10.0;

/// What boosting can be told wrongly.
fn check_boosting(rounds: usize, learning_rate: f64) -> Result<(), FitError> {
    if rounds == 0 {
        return Err(FitError::Setting { name: "the number of rounds", range: "at least 1" });
    }
    if !(learning_rate > 0.0 && learning_rate <= MOST_LEARNING_RATE) {
        return Err(FitError::Setting { name: "the learning rate", range: "above 0 and at most 10" });
    }
    Ok(())
}

/// So many of the rows, without replacement, ascending.
fn drawn(rows: &[u32], count: usize, random: &mut ChaCha8Rng) -> Vec<u32> {
    let mut rows = rows.to_vec();
    if count < rows.len() {
        for k in 0..count {
            let other = random.random_range(k..rows.len());
            rows.swap(k, other);
        }
        rows.truncate(count);
        rows.sort_unstable();
    }
    rows
}

/// Makes numbers that are not negative sum to 1; equal ones where all are zero.
fn normalise(numbers: &mut [f64]) {
    let sum: f64 = numbers.iter().sum();
    let equal = 1.0 / numbers.len() as f64;
    for number in numbers {
        *number = if sum > 0.0 { *number / sum } else { equal };
    }
}

/// exp(x) / sum(exp(x)).
fn softmax(numbers: &mut [f64]) {
    let most = numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    for number in &mut *numbers {
        *number = (*number - most).exp();
    }
    normalise(numbers);
}

/// Where the greatest number stands; of several, the first.
fn greatest<T: Copy + PartialOrd>(numbers: &[T]) -> usize {
    (1..numbers.len()).fold(0, |best, at| if numbers[at] > numbers[best] { at } else { best })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nonsense_is_refused() {
        let good = Examples {
            table: Table { values: &[0.0, 1.0, 2.0, 3.0], columns: 2 },
            labels: &[0, 1],
            classes: 2,
            weights: Some(&[1.0, 0.0]),
        };
        assert_eq!(good.check(), Ok(()));
        assert_eq!(good.rows(), [0]);
        let table = |values, columns| Examples { table: Table { values, columns }, ..good };
        assert_eq!(table(&[0.0; 3], 2).check(), Err(FitError::Shape { values: 3, rows: 2, columns: 2 }));
        assert_eq!(table(&[], 0).check(), Err(FitError::Shape { values: 0, rows: 2, columns: 0 }));
        assert_eq!(table(&[0.0, 0.0, f32::NAN, 0.0], 2).check(), Err(FitError::Value { row: 1, column: 0 }));
        assert_eq!(Examples { labels: &[0, 2], ..good }.check(), Err(FitError::Label { row: 1, label: 2, classes: 2 }));
        let weights = |weights: &[f64]| Examples { weights: Some(weights), ..good }.check();
        assert_eq!(weights(&[1.0]), Err(FitError::WeightCount { weights: 1, rows: 2 }));
        for bad in [-1.0, f64::NAN, 1e101] {
            assert_eq!(weights(&[1.0, bad]), Err(FitError::Weight { row: 1 }));
        }
        assert_eq!(weights(&[0.0, 0.0]), Err(FitError::Empty));
        let none = Examples { table: Table { values: &[], columns: 2 }, labels: &[], classes: 2, weights: None };
        assert_eq!(none.check(), Err(FitError::Empty));
    }

    #[test]
    fn drawing_leaves_out_and_repeats_nothing() {
        let rows: Vec<u32> = (10..20).collect();
        let mut random = random_of(0, 0);
        assert_eq!(drawn(&rows, 10, &mut random), rows);
        let some = drawn(&rows, 4, &mut random);
        assert!(some.len() == 4 && some.is_sorted_by(|a, b| a < b) && some.iter().all(|row| rows.contains(row)));
    }

    #[test]
    fn softmax_survives_great_numbers() {
        let mut numbers = [1000.0, 1000.0, -1000.0];
        softmax(&mut numbers);
        assert_eq!(numbers, [0.5, 0.5, 0.0]);
        assert_eq!(greatest(&[1, 3, 3]), 1);
    }
}
