//! What a round of boosting learns from the last one: how much each row weighs, and how much a tree's word counts.

use super::tree::Tree;
use super::{Examples, greatest, normalise};

/// What becomes of a tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// Its word counts so much.
    Keep(f64),
    /// Its word counts so much, and it is the last.
    KeepAsLast(f64),
    /// Worse than chance: forgotten. Other rows may give a better one.
    Forget,
    /// Worse than chance, and boosting is over.
    Stop,
}

/// A rule by which rows gain and lose weight.
pub(super) trait Reweighting {
    /// The weight of each row, summing to 1.
    fn weights(&self) -> Vec<f64>;

    /// Judges a tree by all rows, and weighs them anew.
    fn judge(&mut self, tree: &Tree, learning_rate: f64) -> Verdict;
}

/// AdaBoost.M2 (Freund and Schapire 1997): every pair of row i and class y other than its own has a weight w(i, y),
/// large where the two are hard to tell apart. With h(i, y) the share of class y in the leaf of row i,
///
///   epsilon = 1/2 sum of w(i, y) (1 - h(i, own) + h(i, y)),   beta = epsilon / (1 - epsilon),
///   w(i, y) becomes w(i, y) beta^(1/2 (1 + h(i, own) - h(i, y))),   the tree's word counts log(1 / beta).
pub(super) struct M2<'a> {
    examples: &'a Examples<'a>,
    /// Classes with rows; a row cannot be mistaken for others.
    present: Vec<usize>,
    /// Row after row, a weight for each present class, zero for its own; all together sum to 1.
    pairs: Vec<f64>,
}

/// A tree that makes no mistake would count without bound; this lets it count 13.8.
const LEAST_PSEUDO_LOSS: f64 = 1e-6;

/// How much better than chance a tree must be: rounding alone comes to 1e-16 for each row.
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

    /// For every pair with weight, h(i, own) - h(i, y).
    fn margins(&self, tree: &Tree) -> Vec<f64> {
        let mut margins = Vec::with_capacity(self.pairs.len());
        for (row, label) in self.examples.labels.iter().enumerate() {
            let shares = tree.leaf(self.examples.table.row(row));
            let own = f64::from(shares[*label]);
            margins.extend(self.present.iter().map(|class| own - f64::from(shares[*class])));
        }
        margins
    }
}

impl Reweighting for M2<'_> {
    fn weights(&self) -> Vec<f64> {
        if self.present.len() < 2 {
            return vec![1.0; self.examples.labels.len()];
        }
        self.pairs.chunks_exact(self.present.len()).map(|pairs| pairs.iter().sum()).collect()
    }

    fn judge(&mut self, tree: &Tree, learning_rate: f64) -> Verdict {
        if self.present.len() < 2 {
            return Verdict::KeepAsLast(1.0);
        }
        let margins = self.margins(tree);
        let loss = 0.5 * self.pairs.iter().zip(&margins).map(|(weight, margin)| weight * (1.0 - margin)).sum::<f64>();
        if loss >= 0.5 - LEAST_EDGE {
            return Verdict::Forget;
        }
        let loss = loss.max(LEAST_PSEUDO_LOSS);
        let log_beta = learning_rate * (loss / (1.0 - loss)).ln();
        for (weight, margin) in self.pairs.iter_mut().zip(margins) {
            *weight *= (0.5 * log_beta * (1.0 + margin)).exp();
        }
        normalise(&mut self.pairs);
        Verdict::Keep(-log_beta)
    }
}

/// SAMME (Zhu et al. 2009) as in imbalanced-learn: rows whose class is not the greatest share of their leaf gain
/// weight. A tree that errs nowhere ends the boosting, one no better than chance does so unheard.
pub(super) struct Samme<'a> {
    examples: &'a Examples<'a>,
    classes: f64,
    weights: Vec<f64>,
}

impl<'a> Samme<'a> {
    pub(super) fn new(examples: &'a Examples<'a>) -> Self {
        let mut weights: Vec<f64> = (0..examples.labels.len()).map(|row| examples.weight(row)).collect();
        normalise(&mut weights);
        Self { examples, classes: examples.present().len() as f64, weights }
    }
}

impl Reweighting for Samme<'_> {
    fn weights(&self) -> Vec<f64> {
        self.weights.clone()
    }

    fn judge(&mut self, tree: &Tree, learning_rate: f64) -> Verdict {
        let is_wrong = |(row, label): (usize, &usize)| greatest(tree.leaf(self.examples.table.row(row))) != *label;
        let wrong: Vec<bool> = self.examples.labels.iter().enumerate().map(is_wrong).collect();
        let error: f64 = self.weights.iter().zip(&wrong).filter(|(_, wrong)| **wrong).map(|(weight, _)| weight).sum();
        if error <= 0.0 {
            return Verdict::KeepAsLast(1.0);
        }
        if error >= 1.0 - 1.0 / self.classes - LEAST_EDGE {
            return Verdict::Stop;
        }
        let word = learning_rate * (((1.0 - error) / error).ln() + (self.classes - 1.0).ln());
        for (weight, _) in self.weights.iter_mut().zip(wrong).filter(|(_, wrong)| *wrong) {
            *weight *= word.exp();
        }
        normalise(&mut self.weights);
        Verdict::Keep(word)
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

    /// Parts at 1.5; right of it, classes 1 and 2 look alike.
    fn tree() -> Tree {
        let nodes = vec![Node::Cut { feature: 0, threshold: 1.5, right: 2 }, Node::Leaf(0), Node::Leaf(1)];
        Tree { nodes, values: vec![1.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0], width: 4 }
    }

    #[test]
    fn pairs_hard_to_tell_apart_gain_weight() {
        // Of eight pairs, rows 2 and 3 have one each with margin 0 and one with margin 1/2, the others margin 1:
        // epsilon = 1/2 (2 · 1 + 2 · 1/2) / 8 = 3/16, beta = 3/13.
        let mut rule = M2::new(&EXAMPLES);
        assert_eq!(rule.weights(), [0.25; 4]);
        let beta = 3.0_f64 / 13.0;
        let Verdict::Keep(word) = rule.judge(&tree(), 1.0) else { panic!("better than chance") };
        assert!((word + beta.ln()).abs() < 1e-12);
        let (easy, hard) = (2.0 * beta, beta.powf(0.75) + beta.sqrt());
        let sum = 2.0 * (easy + hard);
        for (got, want) in rule.weights().iter().zip([easy, easy, hard, hard]) {
            assert!((got - want / sum).abs() < 1e-12);
        }
    }

    #[test]
    fn wrong_rows_gain_weight() {
        // Row 3 is taken for class 1: error 1/4 of three classes, so its weight grows by 3 · 2.
        let mut rule = Samme::new(&EXAMPLES);
        let Verdict::Keep(word) = rule.judge(&tree(), 1.0) else { panic!("better than chance") };
        assert!((word - 6.0_f64.ln()).abs() < 1e-12);
        for (got, want) in rule.weights().iter().zip([1.0, 1.0, 1.0, 6.0]) {
            assert!((got - want / 9.0).abs() < 1e-12);
        }
    }

    #[test]
    fn trees_worse_than_chance_are_not_heard() {
        let wrong = Tree { nodes: vec![Node::Leaf(0)], values: vec![0.0, 0.0, 0.0, 1.0], width: 4 };
        assert_eq!(M2::new(&EXAMPLES).judge(&wrong, 1.0), Verdict::Forget);
        assert_eq!(Samme::new(&EXAMPLES).judge(&wrong, 1.0), Verdict::Stop);
    }
}
