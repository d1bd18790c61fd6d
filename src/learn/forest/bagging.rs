//! One tree, or the average of many on rows drawn with replacement: bagging (Breiman 1996), and with few columns searched
//! in every node the random forest (Breiman 2001). With random cuts of all rows: extremely randomised trees (Geurts, Ernst and
//! Wehenkel 2006).

use super::bins::Bins;
use super::split::Target;
use super::tree::{Cuts, FeatureSampling, Ground, Tree, TreeSettings};
use super::tree_arrays::{load_class_trees, save_trees};
use super::{Examples, normalise, random_of};
use crate::arrays::{Arrays, ModelError, check_each};
use crate::fitting::LearnError;
use crate::rows::RowModel;
use rand::RngExt;

/// Settings of a [`Forest`]. Default: [`ForestSettings::random_forest`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ForestSettings {
    /// Number of trees, at least 1. The spread between seeds falls with the square root.
    pub(crate) trees: usize,
    /// Rows that a tree is grown from.
    pub(crate) rows: RowSampling,
    /// Settings of each tree.
    pub(crate) tree: TreeSettings,
    /// Seed of the rows and columns drawn.
    pub(crate) seed: u64,
}

/// Rows that a tree is grown from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RowSampling {
    /// All of them.
    All,
    /// As many as there are, drawn with replacement: about 63 % of them occur.
    Bootstrap,
}

impl ForestSettings {
    /// A single tree on all rows and columns, grown until leaves are pure; deterministic.
    pub(crate) fn decision_tree() -> Self {
        Self { trees: 1, rows: RowSampling::All, tree: TreeSettings::default(), seed: 0 }
    }

    /// 100 trees on bootstrapped rows and all columns.
    pub(crate) fn bagged_trees() -> Self {
        let tree = TreeSettings { features: FeatureSampling::Shuffled, ..TreeSettings::default() };
        Self { trees: 100, rows: RowSampling::Bootstrap, tree, seed: 0 }
    }

    /// 200 trees on bootstrapped rows; each node searches the square root of the number of columns.
    pub(crate) fn random_forest() -> Self {
        let tree = TreeSettings { features: FeatureSampling::Sqrt, ..TreeSettings::default() };
        Self { trees: 200, rows: RowSampling::Bootstrap, tree, seed: 0 }
    }

    /// 250 trees on all rows, grown until leaves are pure; each node compares one random cut of each of the square root of
    /// the number of columns.
    pub(crate) fn extra_trees() -> Self {
        let tree = TreeSettings { features: FeatureSampling::Sqrt, cuts: Cuts::OneDrawn, ..TreeSettings::default() };
        Self { trees: 250, rows: RowSampling::All, tree, seed: 0 }
    }
}

impl Default for ForestSettings {
    fn default() -> Self {
        Self::random_forest()
    }
}

/// Trees whose leaves hold the share of each class.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Forest {
    columns: usize,
    classes: usize,
    trees: Vec<Tree>,
    /// Weight of the training rows in each leaf, tree after tree; empty in files of versions that did not answer on parts of a
    /// row.
    leaf_weights: Vec<f32>,
    /// Weights of all nodes of each tree.
    node_weights: Vec<Vec<f32>>,
}

impl Forest {
    /// Grows the trees. Refuses features that are not finite.
    ///
    /// # Panics
    /// If the examples contradict themselves, or there is no tree.
    pub(crate) fn fit(examples: &Examples<'_>, settings: &ForestSettings) -> Result<Self, LearnError> {
        examples.check()?;
        assert!(settings.trees > 0, "at least one tree");
        let bins = Bins::new(&examples.table);
        let mut leaf_weights = Vec::new();
        let grow = |number| grow_one(examples, &bins, settings, number, &mut leaf_weights);
        let trees = (0..settings.trees).map(grow).collect();
        Ok(Self::new([examples.table.columns, examples.classes], trees, leaf_weights))
    }

    fn new([columns, classes]: [usize; 2], trees: Vec<Tree>, leaf_weights: Vec<f32>) -> Self {
        let mut rest = &leaf_weights[..];
        let mut node_weights = Vec::new();
        for tree in trees.iter().filter(|_| !leaf_weights.is_empty()) {
            let (own, others) = rest.split_at(tree.values.len() / tree.width);
            node_weights.push(tree.node_weights(own));
            rest = others;
        }
        Self { columns, classes, trees, leaf_weights, node_weights }
    }

    /// Restores a forest from a model file.
    pub(crate) fn load(arrays: &Arrays, columns: usize, classes: usize) -> Result<Self, ModelError> {
        let trees = load_class_trees(arrays, columns, classes)?;
        let leaf_weights = match arrays.0.contains_key(LEAF_WEIGHTS) {
            true => {
                let leaves = trees.iter().map(|tree| tree.values.len() / tree.width).sum();
                let weights = arrays.f32s(LEAF_WEIGHTS, &[leaves])?.to_vec();
                check_each(LEAF_WEIGHTS, &weights, "a weight above 0", |x| x.is_finite() && *x > 0.0)?;
                weights
            }
            false => Vec::new(),
        };
        Ok(Self::new([columns, classes], trees, leaf_weights))
    }
}

impl RowModel for Forest {
    /// Probability of each class: mean share over all trees. NaN stands for an unknown value: there, both sides of a cut count,
    /// by the training rows that fell there.
    ///
    /// # Panics
    /// If the row has another number of features than the training rows.
    fn predict(&self, row: &[f32]) -> Vec<f64> {
        assert_eq!(row.len(), self.columns, "values of a row");
        let mut shares = vec![0.0; self.classes];
        if self.answers_in_part() && row.iter().any(|x| x.is_nan()) {
            let with_weights = self.trees.iter().zip(&self.node_weights);
            with_weights.for_each(|(tree, weights)| tree.add_leaves(row, weights, &mut shares));
        } else {
            for tree in &self.trees {
                for (share, of_leaf) in shares.iter_mut().zip(tree.leaf(row)) {
                    *share += f64::from(*of_leaf);
                }
            }
        }
        normalise(&mut shares);
        shares
    }

    /// True if it answers on rows of which some values are unknown.
    fn answers_in_part(&self) -> bool {
        !self.leaf_weights.is_empty()
    }

    /// Adds the trees to the arrays of a model file.
    fn save(&self, arrays: &mut Arrays) {
        save_trees(&self.trees, self.columns, self.classes, arrays);
        if self.answers_in_part() {
            arrays.put(LEAF_WEIGHTS, &[self.leaf_weights.len()], self.leaf_weights.clone());
        }
    }
}

/// Array of the weight of the training rows in each leaf.
const LEAF_WEIGHTS: &str = "trees.leaf_weights";

/// Grows a tree, and adds the weights of its leaves.
fn grow_one(
    examples: &Examples<'_>,
    bins: &Bins,
    settings: &ForestSettings,
    number: usize,
    leaf_weights: &mut Vec<f32>,
) -> Tree {
    let mut random = random_of(settings.seed, number);
    let rows = examples.rows();
    let mut drawn = vec![u32::from(settings.rows == RowSampling::All); examples.labels.len()];
    if settings.rows == RowSampling::Bootstrap {
        for _ in 0..rows.len() {
            drawn[rows[random.random_range(0..rows.len())] as usize] += 1;
        }
    }
    let weight = |row: usize| f64::from(drawn[row]) * examples.weight(row);
    let target = Target::classes(examples.labels, examples.classes, weight);
    let rows = rows.into_iter().filter(|&row| drawn[row as usize] > 0).collect();
    let ground = Ground { bins, target: &target, settings: &settings.tree };
    ground.grow(rows, &mut random, &mut |rows, values| {
        target.push_shares(rows, values);
        leaf_weights.push(target.weight_of(rows) as f32);
    })
}

#[cfg(test)]
mod tests {
    use super::super::tree::Node;
    use super::super::{Table, scikit_learn_tests};
    use super::*;

    #[test]
    fn weights_are_repetitions() -> Result<(), LearnError> {
        let data = scikit_learn_tests::Data::new(0..120);
        let weights: Vec<f64> = (0..120_u32).map(|row| f64::from(row % 4)).collect();
        let repeated: Vec<usize> = (0..120).flat_map(|row| std::iter::repeat_n(row, row % 4)).collect();
        let values: Vec<f32> = repeated.iter().flat_map(|&row| data.row(row).to_vec()).collect();
        let labels: Vec<usize> = repeated.iter().map(|&row| data.labels[row]).collect();
        let repeated =
            Examples { table: Table { values: &values, ..data.examples().table }, labels: &labels, ..data.examples() };
        let weighted = Examples { weights: Some(&weights), ..data.examples() };
        let settings = ForestSettings::decision_tree();
        assert_eq!(Forest::fit(&weighted, &settings)?, Forest::fit(&repeated, &settings)?);
        Ok(())
    }

    #[test]
    fn seeds_decide_everything() -> Result<(), LearnError> {
        let data = scikit_learn_tests::Data::new(0..200);
        let settings = ForestSettings { trees: 5, ..ForestSettings::random_forest() };
        let forest = Forest::fit(&data.examples(), &settings)?;
        assert_eq!(forest, Forest::fit(&data.examples(), &settings)?);
        assert_ne!(forest, Forest::fit(&data.examples(), &ForestSettings { seed: 1, ..settings })?);
        // A tree does not depend on those grown before it.
        let fewer = Forest::fit(&data.examples(), &ForestSettings { trees: 3, ..settings })?;
        assert_eq!(fewer.trees, forest.trees[..3]);
        for row in 0..200 {
            assert!((forest.predict(data.row(row)).iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
        Ok(())
    }

    #[test]
    fn shuffled_labels_give_chance_level() -> Result<(), LearnError> {
        let train = scikit_learn_tests::Data::new(0..360);
        let labels: Vec<usize> = (0..360).map(|row| train.labels[(row * 151 + 7) % 360]).collect();
        let settings = ForestSettings { trees: 30, ..ForestSettings::random_forest() };
        let forest = Forest::fit(&Examples { labels: &labels, ..train.examples() }, &settings)?;
        let recall = scikit_learn_tests::Data::new(360..1360).macro_recall(|row| forest.predict(row));
        assert!((recall - 1.0 / 6.0).abs() < 0.06, "{recall}");
        Ok(())
    }

    #[test]
    fn an_unknown_value_counts_as_either_side_by_the_weight_there() -> Result<(), LearnError> {
        // The first column tells class 0 from the others, the second class 1 from class 2.
        let values = [0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 1.0];
        let weights = [1.0, 1.0, 1.0, 5.0];
        let examples = Examples {
            table: Table { values: &values, columns: 2 },
            labels: &[0, 0, 1, 2],
            classes: 3,
            weights: Some(&weights),
        };
        let forest = Forest::fit(&examples, &ForestSettings::decision_tree())?;
        let near = |row: &[f32], wanted: [f64; 3]| {
            let found = forest.predict(row);
            assert!(found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-6), "{row:?}: {found:?}");
        };
        near(&[1.0, 1.0], [0.0, 0.0, 1.0]);
        near(&[f32::NAN, f32::NAN], [2.0 / 8.0, 1.0 / 8.0, 5.0 / 8.0]);
        let mut arrays = Arrays::default();
        forest.save(&mut arrays);
        assert_eq!(Forest::load(&arrays, 2, 3).as_ref(), Ok(&forest));
        arrays.put(LEAF_WEIGHTS, &[3], vec![1.0, -1.0, 1.0]);
        assert!(Forest::load(&arrays, 2, 3).is_err());
        // A file of an earlier version.
        arrays.0.remove(LEAF_WEIGHTS);
        assert!(!Forest::load(&arrays, 2, 3).expect("loads").answers_in_part());
        Ok(())
    }

    #[test]
    fn extra_trees_of_two_values_are_the_same_as_the_best_cut() -> Result<(), LearnError> {
        // Two values leave no choice but where between them the threshold is.
        let examples = Examples {
            table: Table { values: &[0.0, 1.0, 0.0, 1.0], columns: 1 },
            labels: &[0, 1, 0, 1],
            classes: 2,
            weights: None,
        };
        let settings = ForestSettings { trees: 20, ..ForestSettings::extra_trees() };
        let forest = Forest::fit(&examples, &settings)?;
        let thresholds: Vec<f32> = forest
            .trees
            .iter()
            .filter_map(|tree| match tree.nodes[..] {
                [Node::Cut { feature: 0, threshold, right: 2 }, Node::Leaf(0), Node::Leaf(1)] => Some(threshold),
                _ => None,
            })
            .collect();
        assert_eq!(thresholds.len(), 20);
        assert!(thresholds.iter().all(|threshold| (0.0..1.0).contains(threshold)));
        assert_eq!([forest.predict(&[0.0]), forest.predict(&[1.0])], [[1.0, 0.0], [0.0, 1.0]]);
        Ok(())
    }

    #[test]
    fn extra_trees_remember_their_rows() -> Result<(), LearnError> {
        // No bootstrap and pure leaves: every training row is answered with certainty.
        let data = scikit_learn_tests::Data::new(0..200);
        let forest = Forest::fit(&data.examples(), &ForestSettings { trees: 10, ..ForestSettings::extra_trees() })?;
        assert!((0..200).all(|row| forest.predict(data.row(row))[data.labels[row]] == 1.0));
        Ok(())
    }

    #[test]
    fn classes_without_rows_are_never_predicted() -> Result<(), LearnError> {
        let examples =
            Examples { table: Table { values: &[0.0, 1.0], columns: 1 }, labels: &[3, 1], classes: 5, weights: None };
        let tree = Forest::fit(&examples, &ForestSettings::decision_tree())?;
        assert_eq!(tree.predict(&[0.4]), [0.0, 0.0, 0.0, 1.0, 0.0]);
        assert_eq!(tree.predict(&[0.6]), [0.0, 1.0, 0.0, 0.0, 0.0]);
        Ok(())
    }
}
