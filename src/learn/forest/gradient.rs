//! Gradient boosting on the multinomial deviance (Friedman 2001, algorithm 6, L_K-TreeBoost).
//!
//! Scores F_k start at the logarithm of the class shares. In every round, with p = softmax(F), a regression tree per class
//! is grown on the residuals r = `[class is k]` - p_k of all classes at once, and every leaf takes one Newton step
//!
//!   F_k += learning rate · (K - 1) / K · sum(w r) / sum(w p_k (1 - p_k)).

use super::bins::Bins;
use super::split::{Item, Target};
use super::tree::{Ground, Tree, TreeSettings};
use super::tree_arrays::{load_classes, load_trees, save_trees};
use super::{Examples, check_boosting, drawn, random_of, softmax};
use crate::arrays::{Arrays, ModelError};
use crate::fitting::LearnError;
use crate::rows::RowModel;
use rand_chacha::ChaCha8Rng;

/// Settings of [`GradientBoosting`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GradientBoostingSettings {
    /// Number of rounds, at least 1; each grows a tree per class. Default 100.
    pub(crate) rounds: usize,
    /// Factor of each step, above 0 and at most 10. Default 0.1: less needs more rounds, 1 overfits at once.
    pub(crate) learning_rate: f64,
    /// Share of the rows drawn without replacement for each round, above 0 and at most 1. Default 1.
    pub(crate) subsample: f64,
    /// Settings of each tree. Default: three levels, that is interactions of three features.
    pub(crate) tree: TreeSettings,
    /// Seed of the rows and columns drawn; without effect unless either is subsampled.
    pub(crate) seed: u64,
}

impl Default for GradientBoostingSettings {
    fn default() -> Self {
        let tree = TreeSettings { max_depth: Some(3), ..TreeSettings::default() };
        Self { rounds: 100, learning_rate: 0.1, subsample: 1.0, tree, seed: 0 }
    }
}

/// Boosted regression trees: the score of a class is a sum over trees.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct GradientBoosting {
    columns: usize,
    classes: usize,
    /// Classes with training rows, ascending; others are never predicted.
    present: Vec<usize>,
    /// Score of each present class before any tree.
    prior: Vec<f64>,
    /// A tree for each present class, round after round.
    trees: Vec<Tree>,
}

/// Largest Newton step, as a score. A leaf of rows of nearly zero probability p takes a step of 1 / p, which is unbounded
/// and forces larger steps in the next round: with half of 800 rows of 17 classes and leaves of a single row, recall fell
/// from 0.71 to 0.62 (scikit-learn, without a bound: 0.64). A bound of ten or less alters ordinary steps.
const LONGEST_STEP: f64 = 30.0;

/// Curvature below which a leaf takes no step: all its rows are fitted, and the quotient is rounding error.
const LEAST_CURVATURE: f64 = 1e-150;

impl GradientBoosting {
    /// Grows the trees. Refuses features that are not finite.
    ///
    /// # Panics
    /// If the examples contradict themselves, or a setting is out of range.
    pub(crate) fn fit(examples: &Examples<'_>, settings: &GradientBoostingSettings) -> Result<Self, LearnError> {
        examples.check()?;
        check_boosting(settings.rounds, settings.learning_rate);
        assert!(settings.subsample > 0.0 && settings.subsample <= 1.0, "subsample {}", settings.subsample);
        let mut fitting = Fitting::new(examples, settings);
        // A single class needs no tree.
        let rounds = if fitting.model.present.len() > 1 { settings.rounds } else { 0 };
        for round in 0..rounds {
            fitting.round(round);
        }
        Ok(fitting.model)
    }

    /// Restores a model from a model file.
    pub(crate) fn load(arrays: &Arrays, columns: usize, classes: usize) -> Result<Self, ModelError> {
        let trees = load_trees(arrays, columns, classes, 1)?;
        let prior = arrays.f64_vector("trees.prior")?.to_vec();
        arrays.require("trees.present", &[prior.len()], "trees.prior")?;
        let present = load_classes(arrays, "trees.present", classes)?;
        if trees.len() % present.len() != 0 {
            let rounds = trees.len() / present.len();
            arrays.require("trees.tree_nodes", &[rounds * present.len()], "trees.present")?;
        }
        Ok(Self { columns, classes, present, prior, trees })
    }
}

impl RowModel for GradientBoosting {
    /// Probability of each class.
    ///
    /// # Panics
    /// If the row has another number of features than the training rows.
    fn predict(&self, row: &[f32]) -> Vec<f64> {
        assert_eq!(row.len(), self.columns, "values of a row");
        let mut scores = self.prior.clone();
        for round in self.trees.chunks_exact(scores.len()) {
            for (score, tree) in scores.iter_mut().zip(round) {
                *score += f64::from(tree.leaf(row)[0]);
            }
        }
        softmax(&mut scores);
        let mut probabilities = vec![0.0; self.classes];
        for (class, probability) in self.present.iter().zip(scores) {
            probabilities[*class] = probability;
        }
        probabilities
    }

    /// Adds the model to the arrays of a model file.
    fn save(&self, arrays: &mut Arrays) {
        arrays.put_integers("trees.present", self.present.iter().copied());
        arrays.put_f64("trees.prior", self.prior.clone());
        save_trees(&self.trees, self.columns, self.classes, arrays);
    }
}

struct Fitting<'a> {
    examples: &'a Examples<'a>,
    settings: &'a GradientBoostingSettings,
    bins: Bins,
    /// Rows with weight.
    rows: Vec<u32>,
    /// Scores F, `[rows][present classes]`.
    scores: Vec<f64>,
    model: GradientBoosting,
}

impl<'a> Fitting<'a> {
    fn new(examples: &'a Examples<'a>, settings: &'a GradientBoostingSettings) -> Self {
        let (rows, present) = (examples.rows(), examples.present());
        let mut of_class = vec![0.0; examples.classes];
        for &row in &rows {
            of_class[examples.labels[row as usize]] += examples.weight(row as usize);
        }
        let total: f64 = of_class.iter().sum();
        let prior: Vec<f64> = present.iter().map(|&class| (of_class[class] / total).ln()).collect();
        let scores = prior.repeat(examples.labels.len());
        let (columns, classes) = (examples.table.columns, examples.classes);
        let model = GradientBoosting { columns, classes, present, prior, trees: Vec::new() };
        Self { examples, settings, bins: Bins::new(&examples.table), rows, scores, model }
    }

    fn round(&mut self, round: usize) {
        let count = self.model.present.len();
        let mut random = random_of(self.settings.seed, round);
        let share = self.settings.subsample * self.rows.len() as f64;
        let rows = drawn(&self.rows, (share as usize).max(1), &mut random);
        let mut probabilities = self.scores.clone();
        probabilities.chunks_exact_mut(count).for_each(softmax);
        for k in 0..count {
            let of_class: Vec<f64> = probabilities.iter().skip(k).step_by(count).copied().collect();
            let tree = self.grow(k, &of_class, rows.clone(), &mut random);
            for (row, scores) in self.scores.chunks_exact_mut(count).enumerate() {
                scores[k] += f64::from(tree.leaf(self.examples.table.row(row))[0]);
            }
            self.model.trees.push(tree);
        }
    }

    /// Grows a tree for the k-th present class from the current probability of that class in each row.
    fn grow(&self, k: usize, probabilities: &[f64], rows: Vec<u32>, random: &mut ChaCha8Rng) -> Tree {
        let class = self.model.present[k];
        let item = |(row, p): (usize, &f64)| {
            let weight = self.examples.weight(row);
            let residual = f64::from(u8::from(self.examples.labels[row] == class)) - p;
            Item { amount: weight * residual, weight, channel: 0 }
        };
        let target = Target { channels: 1, items: probabilities.iter().enumerate().map(item).collect() };
        let ground = Ground { bins: &self.bins, target: &target, settings: &self.settings.tree };
        let classes = self.model.present.len() as f64;
        ground.grow(rows, random, &mut |rows, values| {
            let slope: f64 = rows.iter().map(|&row| target.items[row as usize].amount).sum();
            let curvature = |&row: &u32| {
                let p = probabilities[row as usize];
                target.items[row as usize].weight * p * (1.0 - p)
            };
            let curvature: f64 = rows.iter().map(curvature).sum();
            let step = if curvature < LEAST_CURVATURE { 0.0 } else { (classes - 1.0) / classes * slope / curvature };
            values.push((self.settings.learning_rate * step.clamp(-LONGEST_STEP, LONGEST_STEP)) as f32);
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Table, scikit_learn_tests};
    use super::*;

    #[test]
    fn one_round_in_closed_form() -> Result<(), LearnError> {
        // Two classes of two rows: p = 1/2, r = ±1/2, so each leaf steps by (1/2) · (±1/2) / (1/4) = ±1.
        let examples = Examples {
            table: Table { values: &[0.0, 1.0, 4.0, 5.0], columns: 1 },
            labels: &[0, 0, 1, 1],
            classes: 2,
            weights: None,
        };
        let settings = GradientBoostingSettings { rounds: 1, learning_rate: 0.5, ..Default::default() };
        let model = GradientBoosting::fit(&examples, &settings)?;
        let want = 1.0 / (1.0 + (-1.0_f64).exp());
        assert!((model.predict(&[2.5])[0] - want).abs() < 1e-7);
        assert!((model.predict(&[2.6])[1] - want).abs() < 1e-7);
        Ok(())
    }

    #[test]
    fn unseen_classes_and_single_classes() -> Result<(), LearnError> {
        let examples =
            Examples { table: Table { values: &[0.0, 1.0], columns: 1 }, labels: &[2, 2], classes: 4, weights: None };
        let model = GradientBoosting::fit(&examples, &GradientBoostingSettings::default())?;
        assert_eq!(model.predict(&[9.0]), [0.0, 0.0, 1.0, 0.0]);
        let mut arrays = Arrays::default();
        model.save(&mut arrays);
        assert_eq!(GradientBoosting::load(&arrays, 1, 4), Ok(model));
        let model = GradientBoosting::fit(&Examples { labels: &[3, 1], ..examples }, &Default::default())?;
        assert!(model.predict(&[0.0])[3] > 0.99 && model.predict(&[1.0])[1] > 0.99);
        Ok(())
    }

    #[test]
    fn subsamples_follow_the_seed() -> Result<(), LearnError> {
        let data = scikit_learn_tests::Data::new(0..150);
        let settings = GradientBoostingSettings { rounds: 3, subsample: 0.5, ..Default::default() };
        let model = GradientBoosting::fit(&data.examples(), &settings)?;
        assert_eq!(model, GradientBoosting::fit(&data.examples(), &settings)?);
        assert_ne!(model, GradientBoosting::fit(&data.examples(), &GradientBoostingSettings { seed: 1, ..settings })?);
        assert!((model.predict(data.row(0)).iter().sum::<f64>() - 1.0).abs() < 1e-12);
        Ok(())
    }

    #[test]
    fn settings_out_of_range_panic() {
        let data = scikit_learn_tests::Data::new(0..10);
        let good = GradientBoostingSettings::default();
        for bad in [
            GradientBoostingSettings { rounds: 0, ..good },
            GradientBoostingSettings { learning_rate: f64::NAN, ..good },
            GradientBoostingSettings { subsample: 1.1, ..good },
        ] {
            assert!(std::panic::catch_unwind(|| GradientBoosting::fit(&data.examples(), &bad)).is_err(), "{bad:?}");
        }
    }
}
