//! Trees as flat arrays, and back.
//!
//! | array | holds |
//! |---|---|
//! | `shape` | columns, classes |
//! | `tree_nodes` | number of nodes of each tree |
//! | `feature` | column each node looks at, -1 for a leaf |
//! | `threshold` | values up to it go to the next node; 0 for a leaf |
//! | `link` | node of the tree that other values go to, always a later one; for a leaf its number in the tree |
//! | `leaf_values` | leaf after leaf, tree after tree: shares of the classes, or a single step |

use super::arrays::{Array, ArrayError, Reader, all, same_length};
use super::tree::{Node, Tree};

/// Appends the arrays of some trees.
pub(super) fn push_trees(trees: &[Tree], arrays: &mut Vec<(String, Array)>) {
    let (mut feature, mut threshold, mut link) = (Vec::new(), Vec::new(), Vec::new());
    for node in trees.iter().flat_map(|tree| &tree.nodes) {
        let parts = match *node {
            Node::Cut { feature, threshold, right } => (feature as i32, threshold, right as i32),
            Node::Leaf(leaf) => (-1, 0.0, leaf as i32),
        };
        feature.push(parts.0);
        threshold.push(parts.1);
        link.push(parts.2);
    }
    let nodes = trees.iter().map(|tree| tree.nodes.len() as i32).collect();
    let values = trees.iter().flat_map(|tree| tree.values.iter().copied()).collect();
    let named = [
        ("tree_nodes", Array::I32(nodes)),
        ("feature", Array::I32(feature)),
        ("threshold", Array::F32(threshold)),
        ("link", Array::I32(link)),
        ("leaf_values", Array::F32(values)),
    ];
    arrays.extend(named.map(|(name, array)| (name.to_owned(), array)));
}

impl Reader<'_> {
    /// Trees whose leaves hold a share of each class.
    pub(super) fn class_trees(&self, columns: usize, classes: usize) -> Result<Vec<Tree>, ArrayError> {
        /// Shares are single precision numbers that summed to 1 before they were rounded.
        const ROUNDING: f64 = 1e-4;
        let trees = self.trees(columns, classes)?;
        if trees.is_empty() {
            return Err(ArrayError::Length { name: "tree_nodes", length: 0, expected: "at least one" });
        }
        let values = self.f32s("leaf_values")?;
        all("leaf_values", values, "a share from 0", |share| *share >= 0.0)?;
        let sum = |shares: &[f32]| shares.iter().copied().map(f64::from).sum::<f64>();
        match values.chunks_exact(classes).position(|shares| (sum(shares) - 1.0).abs() > ROUNDING) {
            Some(leaf) => {
                let expected = "the first of shares that sum to 1";
                Err(ArrayError::Number { name: "leaf_values", index: leaf * classes, expected })
            }
            None => Ok(trees),
        }
    }

    /// Trees whose leaves hold `width` numbers.
    pub(super) fn trees(&self, columns: usize, width: usize) -> Result<Vec<Tree>, ArrayError> {
        let counts = self.i32s("tree_nodes")?;
        let mut cursor = Cursor {
            feature: self.i32s("feature")?,
            threshold: self.f32s("threshold")?,
            link: self.i32s("link")?,
            values: self.f32s("leaf_values")?,
            nodes_read: 0,
            columns,
            width,
        };
        all("tree_nodes", counts, "at least 1", |count| *count >= 1)?;
        let nodes = counts.iter().try_fold(0, |sum: usize, count| sum.checked_add(*count as usize));
        same_length("feature", cursor.feature.len(), nodes.unwrap_or(usize::MAX))?;
        same_length("threshold", cursor.threshold.len(), cursor.feature.len())?;
        same_length("link", cursor.link.len(), cursor.feature.len())?;
        let trees = counts.iter().map(|count| cursor.tree(*count as usize)).collect::<Result<_, _>>()?;
        if !cursor.values.is_empty() {
            return Err(ArrayError::Length {
                name: "leaf_values",
                length: self.f32s("leaf_values")?.len(),
                expected: "as many as there are leaves and classes",
            });
        }
        Ok(trees)
    }
}

/// What has not been read yet.
struct Cursor<'a> {
    feature: &'a [i32],
    threshold: &'a [f32],
    link: &'a [i32],
    values: &'a [f32],
    nodes_read: usize,
    columns: usize,
    width: usize,
}

impl Cursor<'_> {
    fn tree(&mut self, count: usize) -> Result<Tree, ArrayError> {
        let (mut nodes, mut leaves) = (Vec::with_capacity(count), 0_u32);
        for at in 0..count {
            let index = self.nodes_read + at;
            let link = self.link[index];
            let refuse = |name, expected| Err(ArrayError::Number { name, index, expected });
            if self.feature[index] == -1 {
                if link != leaves as i32 {
                    return refuse("link", "the number of the leaf in its tree");
                }
                nodes.push(Node::Leaf(leaves));
                leaves += 1;
                continue;
            }
            let Some(feature) = u32::try_from(self.feature[index]).ok().filter(|f| (*f as usize) < self.columns) else {
                return refuse("feature", "a column, or -1");
            };
            // The left child is the next node; the right one is not that, and stands behind it.
            let Some(right) = u32::try_from(link).ok().filter(|r| (at + 2..count).contains(&(*r as usize))) else {
                return refuse("link", "a later node of the tree");
            };
            nodes.push(Node::Cut { feature, threshold: self.threshold[index], right });
        }
        self.nodes_read += count;
        let wanted = (leaves as usize).checked_mul(self.width);
        let Some((values, rest)) = wanted.and_then(|wanted| self.values.split_at_checked(wanted)) else {
            let expected = "as many as there are leaves and classes";
            return Err(ArrayError::Length { name: "leaf_values", length: self.values.len(), expected });
        };
        self.values = rest;
        Ok(Tree { nodes, values: values.to_vec(), width: self.width })
    }
}
