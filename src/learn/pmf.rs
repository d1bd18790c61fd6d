//! Probability mass functions over classes.

use serde::{Deserialize, Serialize};

/// Lower bound of probabilities in products and logarithms: no single grasp may exclude a class permanently.
const FLOOR: f64 = 1e-6;

/// Probability mass function over classes; never empty, sums to one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Pmf(Vec<f64>);

impl Pmf {
    /// Creates a uniform PMF.
    pub fn uniform(classes: usize) -> Self {
        Self(vec![1.0 / classes.max(1) as f64; classes.max(1)])
    }

    /// Computes the softmax of scores.
    pub fn from_scores(scores: impl IntoIterator<Item = f64>) -> Self {
        let scores: Vec<f64> = scores.into_iter().collect();
        let highest = scores.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Self::from_weights(scores.into_iter().map(|s| (s - highest).exp()))
    }

    /// Normalises weights. Negative and non-finite weights count as zero; if all are zero, the PMF is uniform.
    pub fn from_weights(weights: impl IntoIterator<Item = f64>) -> Self {
        let mut weights: Vec<f64> =
            weights.into_iter().map(|w| if w > 0.0 && w.is_finite() { w } else { 0.0 }).collect();
        let sum: f64 = weights.iter().sum();
        if sum > 0.0 && sum.is_finite() {
            weights.iter_mut().for_each(|w| *w /= sum);
            Self(weights)
        } else {
            Self::uniform(weights.len())
        }
    }

    /// The PMF with these probabilities, bit for bit.
    pub(crate) fn as_stored(probabilities: &[f64]) -> Self {
        if probabilities.is_empty() { Self::uniform(1) } else { Self(probabilities.to_vec()) }
    }

    /// Probability of each class.
    pub fn probabilities(&self) -> &[f64] {
        &self.0
    }

    /// Number of classes.
    pub fn classes(&self) -> usize {
        self.0.len()
    }

    /// Most likely class (the first of equals) and its probability.
    pub fn top(&self) -> (usize, f64) {
        let mut best = (0, self.0[0]);
        for (class, &p) in self.0.iter().enumerate() {
            if p > best.1 {
                best = (class, p);
            }
        }
        best
    }

    /// Natural logarithms, at least that of one in a million.
    pub fn logarithms(&self) -> impl Iterator<Item = f64> + '_ {
        self.0.iter().map(|p| p.max(FLOOR).ln())
    }

    /// Entropy (nat).
    pub fn entropy(&self) -> f64 {
        self.0.iter().filter(|p| **p > 0.0).map(|p| -p * p.ln()).sum()
    }

    /// Combines two independent observations under a uniform prior (product of experts).
    pub fn times(&self, other: &Self) -> Self {
        Self::from_scores(self.logarithms().zip(other.logarithms()).map(|(a, b)| a + b))
    }

    /// Rescales by a temperature: sharper below one, flatter above one.
    pub fn at_temperature(&self, temperature: f64) -> Self {
        Self::from_scores(self.logarithms().map(|l| l / temperature))
    }

    /// Averages PMFs; `None` without any.
    pub fn mean<'a>(of: impl IntoIterator<Item = &'a Self>) -> Option<Self> {
        let mut of = of.into_iter();
        let mut sum = of.next()?.0.clone();
        for pmf in of {
            sum.iter_mut().zip(&pmf.0).for_each(|(s, p)| *s += p);
        }
        Some(Self::from_weights(sum))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_follow_bayes() {
        let (a, b) = (Pmf::from_weights([0.6, 0.3, 0.1]), Pmf::from_weights([0.2, 0.5, 0.3]));
        let both = a.times(&b);
        let want = [0.12, 0.15, 0.03].map(|p| p / 0.30);
        assert!(both.probabilities().iter().zip(want).all(|(p, w)| (p - w).abs() < 1e-12));
        let same = a.times(&Pmf::uniform(3));
        assert!(same.probabilities().iter().zip(a.probabilities()).all(|(p, w)| (p - w).abs() < 1e-12));
    }

    #[test]
    fn one_grasp_does_not_exclude_a_class_permanently() {
        let sure = Pmf::from_weights([1.0, 0.0]);
        let mut belief = sure.clone();
        for _ in 0..3 {
            belief = belief.times(&Pmf::from_weights([0.001, 0.999]));
        }
        assert_eq!(belief.top().0, 1);
    }

    #[test]
    fn invalid_weights_still_sum_to_one() {
        for weights in
            [vec![f64::NAN, 1.0], vec![0.0; 3], vec![f64::INFINITY, 2.0], vec![-1.0, 4.0], vec![1e308, 1e308]]
        {
            let pmf = Pmf::from_weights(weights);
            assert!((pmf.probabilities().iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
        assert!((Pmf::from_scores([1e6, -1e6]).top().1 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_low_temperature_sharpens() {
        let pmf = Pmf::from_weights([0.8, 0.2]);
        assert!((pmf.at_temperature(0.5).probabilities()[0] - 0.64 / 0.68).abs() < 1e-9);
    }
}
