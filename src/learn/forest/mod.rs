//! Decision trees for classification, and ensembles of them, on tables of features.
//!
//! | model | method | source |
//! |---|---|---|
//! | [`Forest`] | one tree, bagged trees, a random forest or extra-trees, by its settings | Breiman 1984, 1996, 2001; Geurts 2006 |
//! | [`GradientBoosting`] | a regression tree per class and round, on the softmax deviance | Friedman 2001 |
//! | [`RusBoost`] | boosting on subsets with equally many rows of each class | Seiffert et al. 2010 |
//!
//! All grow the same weighted tree: columns are sorted into at most 255 bins once, after which a split is searched by
//! counting. The same rows, settings and seed give the same model.

mod bagging;
mod bins;
mod gradient;
mod reweighting;
mod rusboost;
#[cfg(test)]
mod scikit_learn_tests;
mod split;
mod tree;
mod tree_arrays;

pub(crate) use bagging::{Forest, ForestSettings};
pub(crate) use gradient::{GradientBoosting, GradientBoostingSettings};
pub(crate) use rusboost::{RusBoost, RusBoostSettings};
pub(crate) use tree::{FeatureSampling, TreeSettings};

use crate::fitting::LearnError;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Version of how trees are grown, part of the fingerprint of methods that use them.
pub(crate) const REVISION: u32 = 1;

/// Rows of features, in any units: trees depend on their order only.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Table<'a> {
    /// `[rows][columns]`.
    pub(crate) values: &'a [f32],
    /// Features of a row, at least 1.
    pub(crate) columns: usize,
}

impl<'a> Table<'a> {
    fn row(&self, row: usize) -> &'a [f32] {
        &self.values[row * self.columns..(row + 1) * self.columns]
    }

    /// Refuses features that are not finite.
    pub(crate) fn check_finite(&self) -> Result<(), LearnError> {
        match self.values.iter().position(|value| !value.is_finite()) {
            Some(at) => Err(LearnError::Refused(format!(
                "feature {} of training row {} is not a finite number; remove the trial with gaps",
                at % self.columns,
                at / self.columns
            ))),
            None => Ok(()),
        }
    }
}

/// Training examples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Examples<'a> {
    /// A row of features for each example.
    pub(crate) table: Table<'a>,
    /// Class of each row, below `classes`.
    pub(crate) labels: &'a [usize],
    /// Number of classes; a class without rows is never predicted.
    pub(crate) classes: usize,
    /// Weight of each row, 0 to 1e100; `None`: all 1. Rows of weight 0 are left out.
    pub(crate) weights: Option<&'a [f64]>,
}

/// Largest weight: squares of sums of weights must stay finite.
const MOST_WEIGHT: f64 = 1e100;

impl Examples<'_> {
    /// Refuses features that are not finite.
    ///
    /// # Panics
    /// If sizes contradict each other, a label or weight is out of range, or no row has any weight.
    fn check(&self) -> Result<(), LearnError> {
        let (rows, columns) = (self.labels.len(), self.table.columns);
        assert!(columns > 0 && self.table.values.len() == rows * columns, "{rows} rows of {columns} columns");
        assert!(self.labels.iter().all(|label| *label < self.classes), "labels below {}", self.classes);
        assert!(self.weights.is_none_or(|weights| weights.len() == rows), "a weight for each of {rows} rows");
        let mut weights = self.weights.unwrap_or_default().iter();
        assert!(weights.all(|weight| (0.0..=MOST_WEIGHT).contains(weight)), "weights from 0 to {MOST_WEIGHT:e}");
        assert!(!self.rows().is_empty(), "a row with weight");
        self.table.check_finite()
    }

    fn weight(&self, row: usize) -> f64 {
        self.weights.map_or(1.0, |weights| weights[row])
    }

    /// Rows with weight.
    fn rows(&self) -> Vec<u32> {
        (0..self.labels.len()).filter(|&row| self.weight(row) > 0.0).map(|row| row as u32).collect()
    }

    /// Classes with rows, ascending.
    fn present(&self) -> Vec<usize> {
        let mut has_rows = vec![false; self.classes];
        for row in self.rows() {
            has_rows[self.labels[row as usize]] = true;
        }
        (0..self.classes).filter(|&class| has_rows[class]).collect()
    }
}

/// Random generator of one tree: trees do not depend on the order in which they are grown.
fn random_of(seed: u64, tree: usize) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(tree as u64);
    random
}

/// Largest learning rate: a weight that grows by exp(10 · 40) in a round is still finite.
const MOST_LEARNING_RATE: f64 = 10.0;

/// Checks the settings that both forms of boosting share.
///
/// # Panics
/// If there is no round, or the learning rate is not above 0 and at most 10.
fn check_boosting(rounds: usize, learning_rate: f64) {
    assert!(rounds > 0, "at least one round");
    assert!(learning_rate > 0.0 && learning_rate <= MOST_LEARNING_RATE, "learning rate {learning_rate}");
}

/// Draws `count` rows without replacement, ascending.
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

/// Divides numbers by their sum; makes them equal if all are zero.
fn normalise(numbers: &mut [f64]) {
    let sum: f64 = numbers.iter().sum();
    let equal = 1.0 / numbers.len() as f64;
    for number in numbers {
        *number = if sum > 0.0 { *number / sum } else { equal };
    }
}

/// Replaces numbers x by exp(x) / sum(exp(x)).
fn softmax(numbers: &mut [f64]) {
    let most = numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    for number in &mut *numbers {
        *number = (*number - most).exp();
    }
    normalise(numbers);
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: Examples<'static> = Examples {
        table: Table { values: &[0.0, 1.0, 2.0, 3.0], columns: 2 },
        labels: &[0, 1],
        classes: 2,
        weights: Some(&[1.0, 0.0]),
    };

    #[test]
    fn features_must_be_finite() {
        assert_eq!(GOOD.check(), Ok(()));
        assert_eq!(GOOD.rows(), [0]);
        let bad = Examples { table: Table { values: &[0.0, 0.0, f32::NAN, 0.0], columns: 2 }, ..GOOD };
        assert!(bad.check().is_err_and(|error| error.to_string().starts_with("feature 0 of training row 1")));
    }

    #[test]
    fn contradicting_examples_panic() {
        let table = |values, columns| Examples { table: Table { values, columns }, ..GOOD };
        for bad in [
            table(&[0.0; 3], 2),
            table(&[], 0),
            Examples { labels: &[0, 2], ..GOOD },
            Examples { weights: Some(&[1.0]), ..GOOD },
            Examples { weights: Some(&[1.0, -1.0]), ..GOOD },
            Examples { weights: Some(&[1.0, f64::NAN]), ..GOOD },
            Examples { weights: Some(&[1.0, 1e101]), ..GOOD },
            Examples { weights: Some(&[0.0, 0.0]), ..GOOD },
            Examples { table: Table { values: &[], columns: 2 }, labels: &[], classes: 2, weights: None },
        ] {
            assert!(std::panic::catch_unwind(|| bad.check()).is_err(), "{bad:?}");
        }
        for (rounds, rate) in [(0, 1.0), (1, f64::NAN), (1, 0.0), (1, 11.0)] {
            assert!(std::panic::catch_unwind(|| check_boosting(rounds, rate)).is_err(), "{rounds} {rate}");
        }
    }

    #[test]
    fn rows_are_drawn_without_replacement() {
        let rows: Vec<u32> = (10..20).collect();
        let mut random = random_of(0, 0);
        assert_eq!(drawn(&rows, 10, &mut random), rows);
        let some = drawn(&rows, 4, &mut random);
        assert!(some.len() == 4 && some.is_sorted_by(|a, b| a < b) && some.iter().all(|row| rows.contains(row)));
    }

    #[test]
    fn softmax_of_large_numbers_does_not_overflow() {
        let mut numbers = [1000.0, 1000.0, -1000.0];
        softmax(&mut numbers);
        assert_eq!(numbers, [0.5, 0.5, 0.0]);
    }
}
