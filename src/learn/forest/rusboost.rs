//! RUSBoost (Seiffert et al. 2010): each round of AdaBoost.M2 uses a random subset with equally many rows of each class, as
//! many as the smallest class has. Rare classes count as much as common ones, and other rounds use other rows.

use super::bins::Bins;
use super::reweighting::{Judgement, M2};
use super::split::Target;
use super::tree::{FeatureSampling, Ground, Tree, TreeSettings};
use super::tree_arrays::{load_class_trees, load_classes, save_trees};
use super::{Examples, check_boosting, drawn, normalise, random_of};
use crate::arrays::{Arrays, ModelError, check_each};
use crate::fitting::LearnError;
use crate::rows::RowModel;
use rand_chacha::ChaCha8Rng;

/// Settings of [`RusBoost`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RusBoostSettings {
    /// Number of rounds, at least 1, each of one tree. Default 200.
    pub(crate) rounds: usize,
    /// Exponent of the change of weights, above 0 and at most 10. Default 1, as published.
    pub(crate) learning_rate: f64,
    /// Settings of each tree. Default: grown until leaves are pure, columns shuffled. Depth matters most: for seventeen
    /// classes of synthetic rows, recall was 0.21, 0.75 and 0.90 at depths 1, 4 and 8.
    pub(crate) tree: TreeSettings,
    /// Seed of the rows drawn.
    pub(crate) seed: u64,
}

impl Default for RusBoostSettings {
    fn default() -> Self {
        let tree = TreeSettings { features: FeatureSampling::Shuffled, ..TreeSettings::default() };
        Self { rounds: 200, learning_rate: 1.0, tree, seed: 0 }
    }
}

/// Weighted trees.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RusBoost {
    columns: usize,
    classes: usize,
    /// Classes with training rows, ascending; others are never predicted.
    present: Vec<usize>,
    trees: Vec<Tree>,
    /// Weight of each tree, positive.
    tree_weights: Vec<f64>,
}

impl RusBoost {
    /// Grows the trees. Refuses features that are not finite. If no tree is better than chance, the first one is kept.
    ///
    /// # Panics
    /// If the examples contradict themselves, or a setting is out of range.
    pub(crate) fn fit(examples: &Examples<'_>, settings: &RusBoostSettings) -> Result<Self, LearnError> {
        examples.check()?;
        check_boosting(settings.rounds, settings.learning_rate);
        Ok(boost(examples, settings))
    }

    /// Restores a model from a model file.
    pub(crate) fn load(arrays: &Arrays, columns: usize, classes: usize) -> Result<Self, ModelError> {
        let form = arrays.indices("trees.form", M2_FORM + 1, "0")?;
        if form.len() != 1 {
            return Err(ModelError::shape("trees.form", &[form.len()], &[1]));
        }
        arrays.require("trees.words", &[arrays.integers("trees.tree_nodes")?.len()], "trees.tree_nodes")?;
        let trees = load_class_trees(arrays, columns, classes)?;
        let tree_weights = arrays.f64_vector("trees.words")?;
        // Their sum must not overflow.
        let allowed = |weight: &f64| *weight > 0.0 && *weight <= MOST_WEIGHT;
        check_each("trees.words", tree_weights, "positive, at most 1e12", allowed)?;
        // Every round draws rows of all present classes, so leaves have shares of exactly these.
        let leaves = || trees.iter().flat_map(|tree| tree.values.chunks_exact(classes));
        let occurs = |class: &usize| leaves().any(|shares| shares[*class] > 0.0);
        let present: Vec<usize> = (0..classes).filter(occurs).collect();
        arrays.require("trees.present", &[present.len()], "trees.leaf_values")?;
        let expected = "the classes that the leaves have shares of";
        let named = load_classes(arrays, "trees.present", classes)?;
        if let Some(index) = named.iter().zip(&present).position(|(named, present)| named != present) {
            return Err(ModelError::value("trees.present", index, expected));
        }
        Ok(Self { columns, classes, present, trees, tree_weights: tree_weights.to_vec() })
    }
}

impl RowModel for RusBoost {
    /// Probability of each class: the weighted mean share.
    ///
    /// # Panics
    /// If the row has another number of features than the training rows.
    fn predict(&self, row: &[f32]) -> Vec<f64> {
        assert_eq!(row.len(), self.columns, "values of a row");
        let mut sums = vec![0.0; self.classes];
        for (tree, weight) in self.trees.iter().zip(&self.tree_weights) {
            for (sum, share) in sums.iter_mut().zip(tree.leaf(row)) {
                *sum += weight * f64::from(*share);
            }
        }
        normalise(&mut sums);
        sums
    }

    /// Adds the model to the arrays of a model file.
    fn save(&self, arrays: &mut Arrays) {
        arrays.put_integers("trees.form", [M2_FORM]);
        arrays.put_integers("trees.present", self.present.iter().copied());
        arrays.put_f64("trees.words", self.tree_weights.clone());
        save_trees(&self.trees, self.columns, self.classes, arrays);
    }
}

/// Number of AdaBoost.M2 in model files.
const M2_FORM: usize = 0;
/// Largest weight of a tree; no fit comes near it, because errors are no smaller than rounding.
const MOST_WEIGHT: f64 = 1e12;

fn boost(examples: &Examples<'_>, settings: &RusBoostSettings) -> RusBoost {
    let mut rule = M2::new(examples);
    let bins = Bins::new(&examples.table);
    let by_class = rows_by_class(examples);
    let (mut trees, mut tree_weights) = (Vec::new(), Vec::new());
    let mut first = None;
    for round in 0..settings.rounds {
        let mut random = random_of(settings.seed, round);
        let rows = under_sampled(&by_class, &mut random);
        let weights = rule.weights();
        // A row that was never misclassified still is an example.
        let target = Target::classes(examples.labels, examples.classes, |row| weights[row].max(f64::EPSILON));
        let tree = Ground { bins: &bins, target: &target, settings: &settings.tree }.grow_classes(rows, &mut random);
        let judgement = rule.judge(&tree, settings.learning_rate);
        if let Judgement::Keep(weight) | Judgement::KeepAsLast(weight) = judgement {
            trees.push(tree);
            tree_weights.push(weight.clamp(f64::MIN_POSITIVE, MOST_WEIGHT));
        } else {
            first = first.or(Some(tree));
        }
        if matches!(judgement, Judgement::KeepAsLast(_)) {
            break;
        }
    }
    if trees.is_empty() {
        trees.extend(first);
        tree_weights.push(1.0);
    }
    let (columns, classes) = (examples.table.columns, examples.classes);
    RusBoost { columns, classes, present: examples.present(), trees, tree_weights }
}

/// Rows of each class that has any.
fn rows_by_class(examples: &Examples<'_>) -> Vec<Vec<u32>> {
    let mut by_class = vec![Vec::new(); examples.classes];
    for row in examples.rows() {
        by_class[examples.labels[row as usize]].push(row);
    }
    by_class.retain(|rows| !rows.is_empty());
    by_class
}

/// Draws as many rows of each class as the smallest class has; ascending.
fn under_sampled(by_class: &[Vec<u32>], random: &mut ChaCha8Rng) -> Vec<u32> {
    let least = by_class.iter().map(Vec::len).min().unwrap_or_default();
    let mut rows: Vec<u32> = by_class.iter().flat_map(|rows| drawn(rows, least, random)).collect();
    rows.sort_unstable();
    rows
}

#[cfg(test)]
mod tests {
    use super::super::{Forest, ForestSettings, Table, scikit_learn_tests};
    use super::*;

    #[test]
    fn every_round_draws_classes_equally() {
        let mut random = random_of(0, 0);
        let drawn = under_sampled(&[vec![0, 3], vec![1, 2, 4, 5, 6], vec![7, 8]], &mut random);
        assert_eq!(drawn.len(), 6);
        assert!(drawn.is_sorted() && drawn.starts_with(&[0]) && drawn.ends_with(&[7, 8]) && drawn.contains(&3));
    }

    #[test]
    fn rare_classes_are_found() -> Result<(), LearnError> {
        // Classes 4 and 5 have one row in twenty each.
        let (train, test) = (scikit_learn_tests::Data::new(0..360), scikit_learn_tests::Data::new(360..1360));
        let found = |recalls: [f64; scikit_learn_tests::CLASSES]| 0.5 * (recalls[4] + recalls[5]);
        let forest = Forest::fit(&train.examples(), &ForestSettings { trees: 50, ..ForestSettings::random_forest() })?;
        let without = found(test.recalls(|row| forest.predict(row)));
        let model = RusBoost::fit(&train.examples(), &RusBoostSettings { rounds: 50, ..RusBoostSettings::default() })?;
        let with = found(test.recalls(|row| model.predict(row)));
        assert!(with > without + 0.15, "{with:.3}, forest {without:.3}");
        Ok(())
    }

    #[test]
    fn seeds_decide_and_probabilities_sum_to_one() -> Result<(), LearnError> {
        let data = scikit_learn_tests::Data::new(0..200);
        let tree = TreeSettings { max_depth: Some(4), ..TreeSettings::default() };
        let settings = RusBoostSettings { rounds: 5, tree, ..RusBoostSettings::default() };
        let model = RusBoost::fit(&data.examples(), &settings)?;
        assert_eq!(model, RusBoost::fit(&data.examples(), &settings)?);
        assert_ne!(model, RusBoost::fit(&data.examples(), &RusBoostSettings { seed: 1, ..settings })?);
        for row in 0..200 {
            assert!((model.predict(data.row(row)).iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
        Ok(())
    }

    #[test]
    fn a_single_class_and_identical_rows_are_handled() -> Result<(), LearnError> {
        let table = Table { values: &[1.0, 1.0, 1.0], columns: 1 };
        let settings = RusBoostSettings::default();
        let one = Examples { table, labels: &[2, 2, 2], classes: 3, weights: None };
        assert_eq!(RusBoost::fit(&one, &settings)?.predict(&[0.0]), [0.0, 0.0, 1.0]);
        let alike = Examples { labels: &[0, 1, 2], ..one };
        let model = RusBoost::fit(&alike, &settings)?;
        assert_eq!((model.trees.len(), model.tree_weights.clone()), (1, vec![1.0]));
        assert!((model.predict(&[0.0]).iter().sum::<f64>() - 1.0).abs() < 1e-12);
        Ok(())
    }
}
