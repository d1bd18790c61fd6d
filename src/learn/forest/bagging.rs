//! One tree, or many on rows drawn with replacement whose answers are averaged: bagging (Breiman 1996), and with few
//! columns looked at in every node the random forest (Breiman 2001).

use super::arrays::{Array, ArrayError, Reader};
use super::bins::Bins;
use super::split::Target;
use super::stored_trees::push_trees;
use super::tree::{FeatureSampling, Ground, Tree, TreeSettings};
use super::{Examples, FitError, normalise, random_of};
use rand::RngExt;

/// How a [`Forest`] is grown. Default: [`ForestSettings::random_forest`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ForestSettings {
    /// Trees, at least 1. More never harm but take time; the spread between seeds falls with their square root.
    pub trees: usize,
    /// Which rows a tree is grown from.
    pub rows: RowSampling,
    /// How each tree is grown.
    pub tree: TreeSettings,
    /// Other seeds draw other rows and columns.
    pub seed: u64,
}

/// Which rows a tree is grown from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RowSampling {
    /// All of them.
    All,
    /// As many as there are, drawn with replacement: about 63 % of them, some several times.
    Bootstrap,
}

impl ForestSettings {
    /// A single tree of all rows and columns, grown until leaves are pure; there is no chance in it.
    pub fn decision_tree() -> Self {
        Self { trees: 1, rows: RowSampling::All, tree: TreeSettings::default(), seed: 0 }
    }

    /// 100 trees on bootstrapped rows that look at all columns.
    pub fn bagged_trees() -> Self {
        let tree = TreeSettings { features: FeatureSampling::Shuffled, ..TreeSettings::default() };
        Self { trees: 100, rows: RowSampling::Bootstrap, tree, seed: 0 }
    }

    /// 200 trees on bootstrapped rows that look at the square root of the columns in every node.
    pub fn random_forest() -> Self {
        let tree = TreeSettings { features: FeatureSampling::Sqrt, ..TreeSettings::default() };
        Self { trees: 200, rows: RowSampling::Bootstrap, tree, seed: 0 }
    }
}

impl Default for ForestSettings {
    fn default() -> Self {
        Self::random_forest()
    }
}

/// Trees whose leaves hold shares of the classes.
#[derive(Clone, Debug, PartialEq)]
pub struct Forest {
    columns: usize,
    classes: usize,
    trees: Vec<Tree>,
}

impl Forest {
    /// Features of a row.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Number of classes.
    pub fn classes(&self) -> usize {
        self.classes
    }

    /// Grows the trees. Refuses examples that are no table, and a forest of no trees.
    pub fn fit(examples: &Examples<'_>, settings: &ForestSettings) -> Result<Self, FitError> {
        examples.check()?;
        if settings.trees == 0 {
            return Err(FitError::Setting { name: "the number of trees", range: "at least 1" });
        }
        let bins = Bins::new(&examples.table);
        let trees = (0..settings.trees).map(|number| grow_one(examples, &bins, settings, number)).collect();
        Ok(Self { columns: examples.table.columns, classes: examples.classes, trees })
    }

    /// A probability for each class: the mean share over all trees.
    ///
    /// # Panics
    /// If the row has not as many values as those the forest was grown from.
    pub fn predict(&self, row: &[f32]) -> Vec<f64> {
        assert_eq!(row.len(), self.columns, "values of a row");
        let mut shares = vec![0.0; self.classes];
        for tree in &self.trees {
            for (share, of_leaf) in shares.iter_mut().zip(tree.leaf(row)) {
                *share += f64::from(*of_leaf);
            }
        }
        normalise(&mut shares);
        shares
    }

    /// The whole forest, to be stored.
    pub fn to_arrays(&self) -> Vec<(String, Array)> {
        let mut arrays = vec![Array::shape(self.columns, self.classes)];
        push_trees(&self.trees, &mut arrays);
        arrays
    }

    /// A forest from storage. Refuses arrays that are missing or contradict each other.
    pub fn from_arrays(arrays: &[(String, Array)]) -> Result<Self, ArrayError> {
        let reader = Reader::new(arrays);
        let (columns, classes) = reader.shape()?;
        Ok(Self { columns, classes, trees: reader.class_trees(columns, classes)? })
    }
}

fn grow_one(examples: &Examples<'_>, bins: &Bins, settings: &ForestSettings, number: usize) -> Tree {
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
    Ground { bins, target: &target, settings: &settings.tree }.grow_classes(rows, &mut random)
}

#[cfg(test)]
mod tests {
    use super::super::{Table, peers};
    use super::*;

    #[test]
    fn weights_are_repetitions() -> Result<(), FitError> {
        let data = peers::Data::new(0..120);
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
    fn seeds_decide_everything() -> Result<(), FitError> {
        let data = peers::Data::new(0..200);
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
    fn shuffled_labels_teach_nothing() -> Result<(), FitError> {
        let train = peers::Data::new(0..360);
        let labels: Vec<usize> = (0..360).map(|row| train.labels[(row * 151 + 7) % 360]).collect();
        let settings = ForestSettings { trees: 30, ..ForestSettings::random_forest() };
        let forest = Forest::fit(&Examples { labels: &labels, ..train.examples() }, &settings)?;
        let recall = peers::Data::new(360..1360).macro_recall(|row| forest.predict(row));
        assert!((recall - 1.0 / 6.0).abs() < 0.06, "{recall}");
        Ok(())
    }

    #[test]
    fn classes_without_rows_are_never_predicted() -> Result<(), FitError> {
        let examples =
            Examples { table: Table { values: &[0.0, 1.0], columns: 1 }, labels: &[3, 1], classes: 5, weights: None };
        let tree = Forest::fit(&examples, &ForestSettings::decision_tree())?;
        assert_eq!(tree.predict(&[0.4]), [0.0, 0.0, 0.0, 1.0, 0.0]);
        assert_eq!(tree.predict(&[0.6]), [0.0, 1.0, 0.0, 0.0, 0.0]);
        let none = ForestSettings { trees: 0, ..ForestSettings::default() };
        assert!(matches!(Forest::fit(&examples, &none), Err(FitError::Setting { .. })));
        Ok(())
    }
}
