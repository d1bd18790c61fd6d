//! Gradient boosting on the multinomial deviance (Friedman 2001, algorithm 6, L_K-TreeBoost).
//!
//! Scores F_k begin at the log of the classes' shares. In every round, with p = softmax(F), a regression tree per class
//! is grown on the residuals r = `[class is k]` - p_k of all classes at once, and every leaf takes one Newton step
//!
//!   F_k += learning rate · (K - 1) / K · sum(w r) / sum(w p_k (1 - p_k)).

use super::arrays::{Array, ArrayError, Reader};
use super::bins::Bins;
use super::split::{Item, Target};
use super::stored_trees::push_trees;
use super::tree::{Ground, Tree, TreeSettings};
use super::{Examples, FitError, check_boosting, drawn, random_of, softmax};
use rand_chacha::ChaCha8Rng;

/// How [`GradientBoosting`] is fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GradientBoostingSettings {
    /// Rounds, at least 1; each grows a tree per class. Default 100.
    pub rounds: usize,
    /// How much of each step is taken, above 0 and at most 10. Default 0.1: less needs more rounds, 1 overfits at once.
    pub learning_rate: f64,
    /// Share of the rows, drawn without replacement, that a round is grown from; above 0, at most 1. Default 1.
    pub subsample: f64,
    /// How each tree is grown. Default: three levels, that is interactions of three features.
    pub tree: TreeSettings,
    /// Other seeds draw other rows and columns; without subsampling of either, there is nothing to draw.
    pub seed: u64,
}

impl Default for GradientBoostingSettings {
    fn default() -> Self {
        let tree = TreeSettings { max_depth: Some(3), ..TreeSettings::default() };
        Self { rounds: 100, learning_rate: 0.1, subsample: 1.0, tree, seed: 0 }
    }
}

/// Scores of the classes as sums of trees.
#[derive(Clone, Debug, PartialEq)]
pub struct GradientBoosting {
    columns: usize,
    classes: usize,
    /// Classes that have rows, ascending; others are never predicted.
    present: Vec<usize>,
    /// Score of each present class before any tree.
    prior: Vec<f64>,
    /// Round after round, a tree for each present class.
    trees: Vec<Tree>,
}

/// Longest Newton step, as a score. A leaf of rows thought nearly impossible asks for a step of 1 / p without bound, and
/// drags others along, which ask for more in the next round: with half of 800 rows of 17 classes and leaves of a single
/// row, recall fell from 0.71 to 0.62 (scikit-learn, which has no bound: 0.64). Ten or less bends ordinary steps too.
const LONGEST_STEP: f64 = 30.0;

/// Curvature below which a leaf makes no step: all its rows are fitted, and the quotient is rounding.
const LEAST_CURVATURE: f64 = 1e-150;

impl GradientBoosting {
    /// Features of a row.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Number of classes.
    pub fn classes(&self) -> usize {
        self.classes
    }

    /// Grows the trees. Refuses examples that are no table, and settings out of range.
    pub fn fit(examples: &Examples<'_>, settings: &GradientBoostingSettings) -> Result<Self, FitError> {
        examples.check()?;
        check_boosting(settings.rounds, settings.learning_rate)?;
        if !(settings.subsample > 0.0 && settings.subsample <= 1.0) {
            return Err(FitError::Setting { name: "the subsample", range: "above 0 and at most 1" });
        }
        let mut fitting = Fitting::new(examples, settings);
        // A single class needs no tree.
        let rounds = if fitting.model.present.len() > 1 { settings.rounds } else { 0 };
        for round in 0..rounds {
            fitting.round(round);
        }
        Ok(fitting.model)
    }

    /// A probability for each class.
    ///
    /// # Panics
    /// If the row has not as many values as those the model was fitted to.
    pub fn predict(&self, row: &[f32]) -> Vec<f64> {
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

    /// The whole model, to be stored.
    pub fn to_arrays(&self) -> Vec<(String, Array)> {
        let present = self.present.iter().map(|&class| class as i32).collect();
        let mut arrays = vec![
            Array::shape(self.columns, self.classes),
            ("present".to_owned(), Array::I32(present)),
            ("prior".to_owned(), Array::F64(self.prior.clone())),
        ];
        push_trees(&self.trees, &mut arrays);
        arrays
    }

    /// A model from storage. Refuses arrays that are missing or contradict each other.
    pub fn from_arrays(arrays: &[(String, Array)]) -> Result<Self, ArrayError> {
        let reader = Reader::new(arrays);
        let (columns, classes) = reader.shape()?;
        let present = reader.ascending("present", classes)?;
        let prior = reader.f64s("prior", present.len())?.to_vec();
        let trees = reader.trees(columns, 1)?;
        if trees.len() % present.len() != 0 {
            return Err(ArrayError::Length { name: "tree_nodes", length: trees.len(), expected: "whole rounds" });
        }
        Ok(Self { columns, classes, present, prior, trees })
    }
}

struct Fitting<'a> {
    examples: &'a Examples<'a>,
    settings: &'a GradientBoostingSettings,
    bins: Bins,
    /// Rows that count.
    rows: Vec<u32>,
    /// Scores F of every row, present classes side by side.
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

    /// A tree for the k-th present class, given the probability that every row now has of it.
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
    use super::super::{Table, peers};
    use super::*;

    #[test]
    fn one_round_in_closed_form() -> Result<(), FitError> {
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
    fn unseen_classes_and_single_classes() -> Result<(), FitError> {
        let examples =
            Examples { table: Table { values: &[0.0, 1.0], columns: 1 }, labels: &[2, 2], classes: 4, weights: None };
        let model = GradientBoosting::fit(&examples, &GradientBoostingSettings::default())?;
        assert_eq!(model.predict(&[9.0]), [0.0, 0.0, 1.0, 0.0]);
        assert_eq!(GradientBoosting::from_arrays(&model.to_arrays()), Ok(model));
        let model = GradientBoosting::fit(&Examples { labels: &[3, 1], ..examples }, &Default::default())?;
        assert!(model.predict(&[0.0])[3] > 0.99 && model.predict(&[1.0])[1] > 0.99);
        Ok(())
    }

    #[test]
    fn subsamples_follow_the_seed() -> Result<(), FitError> {
        let data = peers::Data::new(0..150);
        let settings = GradientBoostingSettings { rounds: 3, subsample: 0.5, ..Default::default() };
        let model = GradientBoosting::fit(&data.examples(), &settings)?;
        assert_eq!(model, GradientBoosting::fit(&data.examples(), &settings)?);
        assert_ne!(model, GradientBoosting::fit(&data.examples(), &GradientBoostingSettings { seed: 1, ..settings })?);
        assert!((model.predict(data.row(0)).iter().sum::<f64>() - 1.0).abs() < 1e-12);
        Ok(())
    }

    #[test]
    fn settings_out_of_range_are_refused() {
        let data = peers::Data::new(0..10);
        let good = GradientBoostingSettings::default();
        for bad in [
            GradientBoostingSettings { rounds: 0, ..good },
            GradientBoostingSettings { learning_rate: f64::NAN, ..good },
            GradientBoostingSettings { subsample: 1.1, ..good },
        ] {
            assert!(matches!(GradientBoosting::fit(&data.examples(), &bad), Err(FitError::Setting { .. })));
        }
    }
}
