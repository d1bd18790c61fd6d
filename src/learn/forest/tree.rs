//! A binary tree grown from the root: every node takes the best cut of the columns it searches (CART, Breiman et al.
//! 1984). Leaves hold shares of the classes, or a Newton step, as the caller decides.
//!
//! Nodes are stored in depth-first order, left side first. The left child of a node is the next node and the right child
//! a later one, so a walk always ends.

use super::bins::Bins;
use super::split::{Cut, Search, Target};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Settings of a tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TreeSettings {
    /// Largest number of cuts between root and leaf. Default `None`: grown until every leaf is pure.
    pub(crate) max_depth: Option<usize>,
    /// Smallest number of rows of a leaf, whatever their weights. Default 1; more smooths, but loses rare classes.
    pub(crate) min_leaf: usize,
    /// Smallest number of rows of a node that is cut. Default 2.
    pub(crate) min_split: usize,
    /// Columns that a node searches. Default: all.
    pub(crate) features: FeatureSampling,
    /// Cuts of a column that are compared. Default: all.
    pub(crate) cuts: Cuts,
}

impl Default for TreeSettings {
    fn default() -> Self {
        Self { max_depth: None, min_leaf: 1, min_split: 2, features: FeatureSampling::All, cuts: Cuts::All }
    }
}

/// Cuts of a column that a node compares.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cuts {
    /// Those between all neighbouring bins.
    All,
    /// One, drawn between the smallest and the largest value of the node (Geurts et al. 2006).
    OneDrawn,
}

/// Columns searched for the best cut, drawn anew in every node. If none of those drawn can be cut, more are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FeatureSampling {
    /// All, in order; of equally good cuts the first. Deterministic.
    All,
    /// All, in random order; of equally good cuts any. Trees of different seeds differ more, which bagging relies on: over
    /// 300 seeds on the rows of `scikit_learn_tests.rs`, mean recall was 0.612 instead of 0.610 (scikit-learn: 0.613).
    Shuffled,
    /// The square root of the number of columns, rounded down.
    Sqrt,
}

impl FeatureSampling {
    fn count(self, columns: usize) -> usize {
        match self {
            Self::All | Self::Shuffled => columns,
            Self::Sqrt => columns.isqrt(),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Node {
    /// Values up to the threshold go to the next node, others to `right`.
    Cut { feature: u32, threshold: f32, right: u32 },
    /// Number of the leaf in this tree.
    Leaf(u32),
}

/// A grown tree.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    /// `[leaves][width]`.
    pub(super) values: Vec<f32>,
    pub(super) width: usize,
}

impl Tree {
    /// Values of the leaf that a row falls into.
    pub(super) fn leaf(&self, row: &[f32]) -> &[f32] {
        let mut at = 0;
        loop {
            match self.nodes[at] {
                Node::Leaf(leaf) => return &self.values[leaf as usize * self.width..][..self.width],
                Node::Cut { feature, threshold, right } => {
                    at = if row[feature as usize] <= threshold { at + 1 } else { right as usize };
                }
            }
        }
    }
}

/// Paths of less weight than this follow the heavier side of a cut whose value is unknown: the number of paths stays small.
const LIGHT: f32 = 1.0 / 8.0;

impl Tree {
    /// Adds the values of the leaves that a row may fall into, where NaN is a value that is not known. Each side of its cuts
    /// counts by the training weight that fell there, which `weights` gives for each node.
    pub(super) fn add_leaves(&self, row: &[f32], weights: &[f32], sums: &mut [f64]) {
        let mut paths = vec![(0, 1.0)];
        while let Some((at, share)) = paths.pop() {
            match self.nodes[at] {
                Node::Leaf(leaf) => {
                    let values = &self.values[leaf as usize * self.width..][..self.width];
                    sums.iter_mut().zip(values).for_each(|(sum, x)| *sum += f64::from(share * x));
                }
                Node::Cut { feature, threshold, right } => {
                    let (x, right) = (row[feature as usize], right as usize);
                    let to_left = weights[at + 1] / weights[at];
                    if x.is_nan() && share >= LIGHT {
                        paths.extend([(at + 1, share * to_left), (right, share * (1.0 - to_left))]);
                    } else {
                        let goes_left = if x.is_nan() { to_left >= 0.5 } else { x <= threshold };
                        paths.push((if goes_left { at + 1 } else { right }, share));
                    }
                }
            }
        }
    }

    /// Weight of each node from that of each leaf.
    pub(super) fn node_weights(&self, leaves: &[f32]) -> Vec<f32> {
        let mut weights = vec![0.0; self.nodes.len()];
        for (at, node) in self.nodes.iter().enumerate().rev() {
            weights[at] = match *node {
                Node::Leaf(leaf) => leaves[leaf as usize],
                Node::Cut { right, .. } => weights[at + 1] + weights[right as usize],
            };
        }
        weights
    }
}

/// Training data and settings of a tree.
pub(super) struct Ground<'a> {
    pub(super) bins: &'a Bins,
    pub(super) target: &'a Target,
    pub(super) settings: &'a TreeSettings,
}

impl Ground<'_> {
    /// Grows a tree from some of the rows, ascending and at least one. `write_leaf` appends the values of a leaf, given its
    /// rows.
    pub(super) fn grow(
        &self,
        rows: Vec<u32>,
        random: &mut ChaCha8Rng,
        write_leaf: &mut dyn FnMut(&[u32], &mut Vec<f32>),
    ) -> Tree {
        let mut search = NodeSearch::new(self, random);
        let mut tree = Tree { nodes: Vec::new(), values: Vec::new(), width: 0 };
        let mut leaves = 0;
        let mut waiting = vec![Waiting { rows, depth: 0, right_of: None }];
        while let Some(Waiting { rows, depth, right_of }) = waiting.pop() {
            let number = tree.nodes.len() as u32;
            if let Some(Node::Cut { right, .. }) = right_of.and_then(|parent: u32| tree.nodes.get_mut(parent as usize))
            {
                *right = number;
            }
            let Some((feature, cut)) = self.may_cut(&rows, depth).then(|| search.best_cut(&rows)).flatten() else {
                tree.nodes.push(Node::Leaf(leaves));
                write_leaf(&rows, &mut tree.values);
                leaves += 1;
                continue;
            };
            tree.nodes.push(Node::Cut { feature, threshold: cut.threshold, right: 0 });
            let values = &self.bins.columns[feature as usize].values;
            let (left, right) = rows.iter().partition(|&&row| values[row as usize] <= cut.threshold);
            waiting.push(Waiting { rows: right, depth: depth + 1, right_of: Some(number) });
            waiting.push(Waiting { rows: left, depth: depth + 1, right_of: None });
        }
        tree.width = tree.values.len() / leaves as usize;
        tree
    }

    /// Grows a tree whose leaves hold the share of each class.
    pub(super) fn grow_classes(&self, rows: Vec<u32>, random: &mut ChaCha8Rng) -> Tree {
        self.grow(rows, random, &mut |rows, values| self.target.push_shares(rows, values))
    }

    fn may_cut(&self, rows: &[u32], depth: usize) -> bool {
        let TreeSettings { max_depth, min_leaf, min_split, .. } = *self.settings;
        max_depth.is_none_or(|most| depth < most)
            && rows.len() >= min_split.max(2 * min_leaf.max(1))
            && !self.target.is_pure(rows)
    }
}

/// Rows of a node that is not grown yet.
struct Waiting {
    rows: Vec<u32>,
    depth: usize,
    right_of: Option<u32>,
}

struct NodeSearch<'a> {
    ground: &'a Ground<'a>,
    random: &'a mut ChaCha8Rng,
    search: Search,
    /// All columns, in an order that drawing permutes.
    features: Vec<u32>,
}

impl<'a> NodeSearch<'a> {
    fn new(ground: &'a Ground<'a>, random: &'a mut ChaCha8Rng) -> Self {
        let features = (0..ground.bins.columns.len() as u32).collect();
        Self { ground, random, search: Search::new(ground.target.channels), features }
    }

    /// Finds the best cut and its column; of equally good ones, the first searched.
    fn best_cut(&mut self, rows: &[u32]) -> Option<(u32, Cut)> {
        let Ground { bins, target, settings } = self.ground;
        let columns = self.features.len();
        let enough = settings.features.count(columns);
        let mut best: Option<(u32, Cut)> = None;
        for searched in 0..columns {
            if searched >= enough && best.is_some() {
                break;
            }
            if settings.features != FeatureSampling::All {
                self.features.swap(searched, self.random.random_range(searched..columns));
            }
            let feature = self.features[searched];
            let column = &bins.columns[feature as usize];
            let cut = match settings.cuts {
                Cuts::All => self.search.best_cut(column, target, rows, settings.min_leaf),
                Cuts::OneDrawn => self.search.random_cut(column, target, rows, settings.min_leaf, self.random),
            };
            best = match (best, cut) {
                (Some((_, old)), Some(new)) if new.score > old.score => Some((feature, new)),
                (None, Some(new)) => Some((feature, new)),
                (best, _) => best,
            };
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Table, random_of};
    use super::*;

    fn grow(values: &[f32], columns: usize, labels: &[usize], settings: &TreeSettings) -> Tree {
        let bins = Bins::new(&Table { values, columns });
        let classes = labels.iter().max().map_or(0, |most| most + 1);
        let target = Target::classes(labels, classes, |_| 1.0);
        let ground = Ground { bins: &bins, target: &target, settings };
        ground.grow_classes((0..labels.len() as u32).collect(), &mut random_of(0, 0))
    }

    #[test]
    fn exclusive_or_takes_two_levels() {
        // No first cut helps; one is made nevertheless.
        let tree = grow(&[0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 1.0], 2, &[0, 1, 1, 0], &TreeSettings::default());
        let cut = |feature, right| Node::Cut { feature, threshold: 0.5, right };
        let leaf = Node::Leaf;
        assert_eq!(tree.nodes, [cut(0, 4), cut(1, 3), leaf(0), leaf(1), cut(1, 6), leaf(2), leaf(3)]);
        assert_eq!(tree.leaf(&[0.2, 0.9]), [0.0, 1.0]);
        assert_eq!(tree.leaf(&[0.5, 0.5]), [1.0, 0.0]);
    }

    #[test]
    fn thresholds_lie_midway_between_the_rows_of_the_node() {
        // The value 5 is in the other branch when its neighbours 1 and 9 are separated.
        let values = [0.0, 1.0, 1.0, 5.0, 0.0, 9.0, 1.0, 5.0, 1.0, 5.0];
        let tree = grow(&values, 2, &[0, 1, 2, 1, 1], &TreeSettings::default());
        assert_eq!(tree.nodes[0], Node::Cut { feature: 0, threshold: 0.5, right: 4 });
        assert_eq!(tree.nodes[1], Node::Cut { feature: 1, threshold: 5.0, right: 3 });
    }

    #[test]
    fn limits_are_kept() {
        let values: Vec<f32> = (0..64u8).map(f32::from).collect();
        let labels: Vec<usize> = (0..64).map(|k| (k * 7) % 5).collect();
        let leaves = |settings: &TreeSettings| grow(&values, 1, &labels, settings).values.len() / 5;
        let limit = TreeSettings::default();
        assert_eq!(leaves(&limit), 64);
        assert_eq!(leaves(&TreeSettings { max_depth: Some(0), ..limit }), 1);
        assert!((3..=4).contains(&leaves(&TreeSettings { max_depth: Some(2), ..limit })));
        assert!(leaves(&TreeSettings { min_leaf: 10, ..limit }) <= 6);
        assert_eq!(leaves(&TreeSettings { min_leaf: 0, ..limit }), 64);
        assert_eq!(leaves(&TreeSettings { min_split: 65, ..limit }), 1);
    }

    #[test]
    fn columns_are_drawn_until_one_can_be_cut() {
        // Nineteen constant columns and one that differs.
        let mut values = vec![1.0; 80];
        values[27] = 2.0;
        let settings = TreeSettings { features: FeatureSampling::Sqrt, ..TreeSettings::default() };
        let tree = grow(&values, 20, &[0, 1, 0, 0], &settings);
        assert_eq!(tree.nodes[0], Node::Cut { feature: 7, threshold: 1.5, right: 2 });
        assert_eq!(FeatureSampling::Sqrt.count(20), 4);
    }
}
