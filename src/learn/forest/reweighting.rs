//! Weights of rows and trees from round to round of boosting.

use super::tree::Tree;
use super::{Examples, normalise};

/// Decision about a tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Judgement {
    /// Keep it with this weight.
    Keep(f64),
    /// Keep it with this weight and end boosting.
    KeepAsLast(f64),
    /// Drop it: worse than chance. Other rows may give a better one.
    Forget,
}

/// AdaBoost.M2 (Freund and Schapire 1997): every pair of row i and class y other than its own has a weight w(i, y),
/// large where the two are easily confused. With h(i, y) the share of class y in the leaf of row i,
///
///   epsilon = 1/2 sum of w(i, y) (1 - h(i, own) + h(i, y)),   beta = epsilon / (1 - epsilon),
///   w(i, y) becomes w(i, y) beta^(1/2 (1 + h(i, own) - h(i, y))),   the tree has weight log(1 / beta).
pub(super) struct M2<'a> {
    examples: &'a Examples<'a>,
    /// Classes with rows; others cannot be confused with them.
    present: Vec<usize>,
    /// Pair weights, `[rows][present classes]`, zero for a row's own class; they sum to 1.
    pairs: Vec<f64>,
}

/// Smallest pseudo-loss: it bounds the weight of a perfect tree to 13.8.
const LEAST_PSEUDO_LOSS: f64 = 1e-6;

/// Margin over chance that a tree must have; rounding alone is 1e-16 for each row.
const LEAST_EDGE: f64 = 1e-9;

impl<'a> M2<'a> {
    pub(super) fn new(examples: &'a Examples<'a>) -> Self {
        let present = examples.present();
        let mut pairs = Vec::with_capacity(present.len() * examples.labels.len());
        for (row, label) in examples.labels.iter().enumerate() {
            let weight = examples.weight(row);
            pairs.extend(present.iter().map(|class| if class == label { 0.0 } else { weight }));
        }
        normalise(&mut pairs);
        Self { examples, present, pairs }
    }

    /// h(i, own) - h(i, y) for every pair.
    fn margins(&self, tree: &Tree) -> Vec<f64> {
        let mut margins = Vec::with_capacity(self.pairs.len());
        for (row, label) in self.examples.labels.iter().enumerate() {
            let shares = tree.leaf(self.examples.table.row(row));
            let own = f64::from(shares[*label]);
            margins.extend(self.present.iter().map(|class| own - f64::from(shares[*class])));
        }
        margins
    }

    /// Weight of each row; they sum to 1.
    pub(super) fn weights(&self) -> Vec<f64> {
        if self.present.len() < 2 {
            return vec![1.0; self.examples.labels.len()];
        }
        self.pairs.chunks_exact(self.present.len()).map(|pairs| pairs.iter().sum()).collect()
    }

    /// Judges a tree on all rows and updates their weights.
    pub(super) fn judge(&mut self, tree: &Tree, learning_rate: f64) -> Judgement {
        if self.present.len() < 2 {
            return Judgement::KeepAsLast(1.0);
        }
        let margins = self.margins(tree);
        let loss = 0.5 * self.pairs.iter().zip(&margins).map(|(weight, margin)| weight * (1.0 - margin)).sum::<f64>();
        if loss >= 0.5 - LEAST_EDGE {
            return Judgement::Forget;
        }
        let loss = loss.max(LEAST_PSEUDO_LOSS);
        let log_beta = learning_rate * (loss / (1.0 - loss)).ln();
        for (weight, margin) in self.pairs.iter_mut().zip(margins) {
            *weight *= (0.5 * log_beta * (1.0 + margin)).exp();
        }
        normalise(&mut self.pairs);
        Judgement::Keep(-log_beta)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Table;
    use super::super::tree::Node;
    use super::*;

    const EXAMPLES: Examples<'static> = Examples {
        table: Table { values: &[0.0, 1.0, 2.0, 3.0], columns: 1 },
        labels: &[0, 0, 1, 2],
        classes: 4,
        weights: None,
    };

    /// Splits at 1.5; right of it, classes 1 and 2 look alike.
    fn tree() -> Tree {
        let nodes = vec![Node::Cut { feature: 0, threshold: 1.5, right: 2 }, Node::Leaf(0), Node::Leaf(1)];
        Tree { nodes, values: vec![1.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0], width: 4 }
    }

    #[test]
    fn confused_pairs_gain_weight() {
        // Of eight pairs, rows 2 and 3 have one each with margin 0 and one with margin 1/2, the others margin 1:
        // epsilon = 1/2 (2 · 1 + 2 · 1/2) / 8 = 3/16, beta = 3/13.
        let mut rule = M2::new(&EXAMPLES);
        assert_eq!(rule.weights(), [0.25; 4]);
        let beta = 3.0_f64 / 13.0;
        let Judgement::Keep(word) = rule.judge(&tree(), 1.0) else { panic!("better than chance") };
        assert!((word + beta.ln()).abs() < 1e-12);
        let (easy, hard) = (2.0 * beta, beta.powf(0.75) + beta.sqrt());
        let sum = 2.0 * (easy + hard);
        for (got, want) in rule.weights().iter().zip([easy, easy, hard, hard]) {
            assert!((got - want / sum).abs() < 1e-12);
        }
    }

    #[test]
    fn trees_worse_than_chance_are_dropped() {
        let wrong = Tree { nodes: vec![Node::Leaf(0)], values: vec![0.0, 0.0, 0.0, 1.0], width: 4 };
        assert_eq!(M2::new(&EXAMPLES).judge(&wrong, 1.0), Judgement::Forget);
    }
}
