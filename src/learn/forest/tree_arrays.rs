//! Trees in a model file. Damaged files are refused: a tree that passes the checks can be walked without panic and
//! without end.
//!
//! | array | contents |
//! |---|---|
//! | `trees.shape` | columns, classes |
//! | `trees.tree_nodes` | number of nodes of each tree |
//! | `trees.feature` | column that each node compares, -1 for a leaf |
//! | `trees.threshold` | values up to it go to the next node; 0 for a leaf |
//! | `trees.link` | node of the tree that larger values go to, always a later one; for a leaf its number in the tree |
//! | `trees.leaf_values` | leaf after leaf, tree after tree: shares of the classes, or one score |
//! | `trees.leaf_weights` | of forests: weight of the training rows in each leaf |

use super::tree::{Node, Tree};
use crate::arrays::{Arrays, ModelError, check_each};

/// Adds the arrays of trees.
pub(super) fn save_trees(trees: &[Tree], columns: usize, classes: usize, arrays: &mut Arrays) {
    let (mut feature, mut threshold, mut link) = (Vec::new(), Vec::new(), Vec::new());
    for node in trees.iter().flat_map(|tree| &tree.nodes) {
        let parts = match *node {
            Node::Cut { feature, threshold, right } => (i64::from(feature), threshold, i64::from(right)),
            Node::Leaf(leaf) => (-1, 0.0, i64::from(leaf)),
        };
        feature.push(parts.0);
        threshold.push(parts.1);
        link.push(parts.2);
    }
    let values: Vec<f32> = trees.iter().flat_map(|tree| tree.values.iter().copied()).collect();
    arrays.put_integers("trees.shape", [columns, classes]);
    arrays.put_integers("trees.tree_nodes", trees.iter().map(|tree| tree.nodes.len()));
    arrays.put_signed("trees.feature", feature);
    arrays.put("trees.threshold", &[threshold.len()], threshold);
    arrays.put_signed("trees.link", link);
    arrays.put("trees.leaf_values", &[values.len()], values);
}

/// Reads trees whose leaves hold the share of each class.
pub(super) fn load_class_trees(arrays: &Arrays, columns: usize, classes: usize) -> Result<Vec<Tree>, ModelError> {
    /// Shares summed to 1 before they were rounded to single precision.
    const ROUNDING: f64 = 1e-4;
    let trees = load_trees(arrays, columns, classes, classes)?;
    if trees.is_empty() {
        return Err(ModelError::shape("trees.tree_nodes", &[0], &[1]));
    }
    let values = arrays.f32_vector("trees.leaf_values")?;
    check_each("trees.leaf_values", values, "a share from 0", |share| *share >= 0.0)?;
    let sum = |shares: &[f32]| shares.iter().copied().map(f64::from).sum::<f64>();
    match values.chunks_exact(classes).position(|shares| (sum(shares) - 1.0).abs() > ROUNDING) {
        Some(leaf) => Err(ModelError::value("trees.leaf_values", leaf * classes, "the first of shares that sum to 1")),
        None => Ok(trees),
    }
}

/// Reads trees whose leaves hold `width` numbers.
pub(super) fn load_trees(
    arrays: &Arrays,
    columns: usize,
    classes: usize,
    width: usize,
) -> Result<Vec<Tree>, ModelError> {
    let shape = arrays.integers("trees.shape")?;
    if shape.len() != 2 {
        return Err(ModelError::shape("trees.shape", &[shape.len()], &[2]));
    }
    let mut of_card = [columns, classes].into_iter();
    let matches_card = |size: &i64| of_card.next().is_some_and(|own| usize::try_from(*size) == Ok(own));
    if let Some(index) = shape.iter().map(matches_card).position(|matches| !matches) {
        return Err(ModelError::value("trees.shape", index, "the number of features and classes of the card"));
    }
    let feature = arrays.integers("trees.feature")?;
    arrays.require("trees.threshold", &[feature.len()], "trees.feature")?;
    arrays.require("trees.link", &[feature.len()], "trees.feature")?;
    let counts = arrays.indices("trees.tree_nodes", MOST_NODES, "a number of nodes")?;
    check_each("trees.tree_nodes", &counts, "at least 1", |count| *count >= 1)?;
    arrays.require("trees.feature", &[counts.iter().sum()], "trees.tree_nodes")?;
    let leaves = feature.iter().filter(|feature| **feature == -1).count();
    arrays.require("trees.leaf_values", &[leaves * width], "trees.feature")?;
    let mut cursor = Cursor {
        feature,
        threshold: arrays.f32_vector("trees.threshold")?,
        link: arrays.integers("trees.link")?,
        values: arrays.f32_vector("trees.leaf_values")?,
        nodes_read: 0,
        columns,
        width,
    };
    counts.iter().map(|count| cursor.tree(*count)).collect()
}

/// Largest number of nodes of a tree in a file; sums of it must not overflow.
const MOST_NODES: usize = 1 << 30;

/// Arrays and the position up to which they were read.
struct Cursor<'a> {
    feature: &'a [i64],
    threshold: &'a [f32],
    link: &'a [i64],
    values: &'a [f32],
    nodes_read: usize,
    columns: usize,
    width: usize,
}

impl Cursor<'_> {
    fn tree(&mut self, count: usize) -> Result<Tree, ModelError> {
        let (mut nodes, mut leaves) = (Vec::with_capacity(count), 0_u32);
        for at in 0..count {
            let index = self.nodes_read + at;
            let link = self.link[index];
            let refuse = |name: &str, expected| Err(ModelError::value(name, index, expected));
            if self.feature[index] == -1 {
                if link != i64::from(leaves) {
                    return refuse("trees.link", "the number of the leaf in its tree");
                }
                nodes.push(Node::Leaf(leaves));
                leaves += 1;
                continue;
            }
            let Some(feature) = u32::try_from(self.feature[index]).ok().filter(|f| (*f as usize) < self.columns) else {
                return refuse("trees.feature", "a column, or -1");
            };
            // The left child is the next node, the right child a later one.
            let Some(right) = u32::try_from(link).ok().filter(|r| (at + 2..count).contains(&(*r as usize))) else {
                return refuse("trees.link", "a later node of the tree");
            };
            nodes.push(Node::Cut { feature, threshold: self.threshold[index], right });
        }
        self.nodes_read += count;
        let (values, rest) = self.values.split_at(leaves as usize * self.width);
        self.values = rest;
        Ok(Tree { nodes, values: values.to_vec(), width: self.width })
    }
}

/// Reads class indices that ascend.
pub(super) fn load_classes(arrays: &Arrays, name: &str, classes: usize) -> Result<Vec<usize>, ModelError> {
    let expected = "a class greater than the one before";
    let found = arrays.indices(name, classes, expected)?;
    if let Some(at) = found.windows(2).position(|pair| pair[0] >= pair[1]) {
        return Err(ModelError::value(name, at + 1, expected));
    }
    if found.is_empty() {
        return Err(ModelError::shape(name, &[0], &[1]));
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::super::*;
    use crate::arrays::{Arrays, ModelError, Numbers};
    use crate::fitting::LearnError;
    use crate::rows::RowModel as _;

    /// Loads a model of ten columns and six classes, and predicts a row.
    type Load = fn(&Arrays) -> Result<Vec<f64>, ModelError>;

    fn models() -> Result<[(Arrays, Load); 3], LearnError> {
        const COLUMNS: usize = scikit_learn_tests::COLUMNS;
        const CLASSES: usize = scikit_learn_tests::CLASSES;
        fn row() -> Vec<f32> {
            scikit_learn_tests::Data::new(0..1).row(0).to_vec()
        }
        let data = scikit_learn_tests::Data::new(0..90);
        let forest = ForestSettings { trees: 3, ..ForestSettings::default() };
        let boosting = GradientBoostingSettings { rounds: 2, ..Default::default() };
        let rusboost = RusBoostSettings { rounds: 3, ..Default::default() };
        let examples = data.examples();
        let mut arrays: [Arrays; 3] = Default::default();
        Forest::fit(&examples, &forest)?.save(&mut arrays[0]);
        GradientBoosting::fit(&examples, &boosting)?.save(&mut arrays[1]);
        RusBoost::fit(&examples, &rusboost)?.save(&mut arrays[2]);
        let [forest, boosting, rusboost] = arrays;
        Ok([
            (forest, |a| Forest::load(a, COLUMNS, CLASSES).map(|m| m.predict(&row()))),
            (boosting, |a| GradientBoosting::load(a, COLUMNS, CLASSES).map(|m| m.predict(&row()))),
            (rusboost, |a| RusBoost::load(a, COLUMNS, CLASSES).map(|m| m.predict(&row()))),
        ])
    }

    /// The same arrays except for one element.
    fn altered(arrays: &Arrays, name: &str, index: usize, number: f64) -> Arrays {
        let mut arrays = arrays.clone();
        match arrays.0.get_mut(name).map(|array| &mut array.numbers) {
            Some(Numbers::F32(numbers)) => numbers[index] = number as f32,
            Some(Numbers::F64(numbers)) => numbers[index] = number,
            Some(Numbers::I64(numbers)) => numbers[index] = number as i64,
            Some(Numbers::I16(_)) | None => panic!("no array {name}"),
        }
        arrays
    }

    #[test]
    fn altered_elements_are_refused_or_harmless() -> Result<(), LearnError> {
        for (arrays, load) in models()? {
            assert!(load(&arrays).is_ok());
            for (name, array) in &arrays.0 {
                for index in 0..array.numbers.len().min(60) {
                    for number in [-2.0, -1.0, 0.0, 1.0, 2.0, 5.0, 1e9, 2_147_483_647.0, 1e18] {
                        if let Ok(probabilities) = load(&altered(&arrays, name, index, number)) {
                            let sum: f64 = probabilities.iter().sum();
                            assert!((sum - 1.0).abs() < 1e-9, "{name}[{index}] = {number}: {sum}");
                        }
                    }
                }
            }
        }
        Ok(())
    }

    #[test]
    fn errors_name_array_and_element() -> Result<(), LearnError> {
        let [(arrays, load), ..] = models()?;
        let text = |name, number| load(&altered(&arrays, name, 0, number)).map_err(|error| error.to_string());
        let refused = |text: &str| Err(text.to_owned());
        assert_eq!(
            text("trees.link", 0.0),
            refused("element 0 of array \"trees.link\" must be a later node of the tree")
        );
        assert_eq!(text("trees.feature", 1e6), refused("element 0 of array \"trees.feature\" must be a column, or -1"));
        assert_eq!(
            text("trees.tree_nodes", 0.0),
            refused("element 0 of array \"trees.tree_nodes\" must be at least 1")
        );
        Ok(())
    }
}
