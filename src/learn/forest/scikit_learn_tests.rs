//! Agreement with scikit-learn 1.9.1 on a synthetic data set. `scikit_learn_tests.py` makes the same rows and printed every
//! number below.

use super::*;
use crate::rows::RowModel as _;
use std::ops::Range;

pub(super) const COLUMNS: usize = 10;
pub(super) const CLASSES: usize = 6;

/// Six overlapping classes, from common to rare, each of two clusters; the last two columns are noise. All integers.
pub(super) struct Data {
    pub(super) labels: Vec<usize>,
    values: Vec<f32>,
}

/// Index of the largest number; of equal ones, the first.
fn greatest(numbers: &[f64]) -> usize {
    (1..numbers.len()).fold(0, |best, at| if numbers[at] > numbers[best] { at } else { best })
}

/// The finaliser of splitmix64.
fn hash(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

impl Data {
    pub(super) fn new(rows: Range<u64>) -> Self {
        const OF_20: [usize; 20] = [0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 4, 5];
        let (mut labels, mut values) = (Vec::new(), Vec::new());
        for row in rows {
            let label = OF_20[(row % 20) as usize];
            let cluster = 2 * label as u64 + (hash(row) & 1);
            labels.push(label);
            for column in 0..COLUMNS as u64 {
                let centre = if column < 8 { hash(1_000_000 + 100 * cluster + column) % 5 * 100 } else { 0 };
                // The sum of four bytes is nearly normal, with a deviation of 148.
                let noise: u64 =
                    hash(2_000_000 + 100 * row + column).to_le_bytes()[..4].iter().map(|b| u64::from(*b)).sum();
                values.push(((centre + noise) / 8) as f32);
            }
        }
        Self { labels, values }
    }

    pub(super) fn examples(&self) -> Examples<'_> {
        let table = Table { values: &self.values, columns: COLUMNS };
        Examples { table, labels: &self.labels, classes: CLASSES, weights: None }
    }

    pub(super) fn row(&self, row: usize) -> &[f32] {
        self.examples().table.row(row)
    }

    fn predicted(&self, predict: impl Fn(&[f32]) -> Vec<f64>) -> Vec<usize> {
        (0..self.labels.len()).map(|row| greatest(&predict(self.row(row)))).collect()
    }

    /// Recall of each class.
    pub(super) fn recalls(&self, predict: impl Fn(&[f32]) -> Vec<f64>) -> [f64; CLASSES] {
        let (mut right, mut of) = ([0.0; CLASSES], [0.0; CLASSES]);
        for (label, predicted) in self.labels.iter().zip(self.predicted(predict)) {
            of[*label] += 1.0;
            right[*label] += f64::from(u8::from(predicted == *label));
        }
        std::array::from_fn(|class| right[class] / of[class])
    }

    /// Mean recall over classes.
    pub(super) fn macro_recall(&self, predict: impl Fn(&[f32]) -> Vec<f64>) -> f64 {
        self.recalls(predict).iter().sum::<f64>() / CLASSES as f64
    }
}

/// FNV-1a of predicted classes.
fn fingerprint(labels: &[usize]) -> u64 {
    labels.iter().fold(0xcbf2_9ce4_8422_2325, |hash, label| (hash ^ *label as u64).wrapping_mul(0x0100_0000_01b3))
}

fn train() -> Data {
    Data::new(0..360)
}

fn test() -> Data {
    Data::new(360..2360)
}

/// Irregular weights: with equal ones many columns would split a node equally well.
fn weights() -> Vec<f64> {
    (0..360).map(|row| (512 + hash(row) % 1024) as f64).collect()
}

#[test]
fn trees_predict_exactly_alike() -> Result<(), LearnError> {
    let (train, test, weights) = (train(), test(), weights());
    let print = |examples: &Examples<'_>, tree: TreeSettings| -> Result<u64, LearnError> {
        let forest = Forest::fit(examples, &ForestSettings { tree, ..ForestSettings::decision_tree() })?;
        Ok(fingerprint(&test.predicted(|row| forest.predict(&row[..examples.table.columns]))))
    };
    let full = TreeSettings::default();
    let column: Vec<f32> = train.values.iter().copied().step_by(COLUMNS).collect();
    let one_column = Examples { table: Table { values: &column, columns: 1 }, ..train.examples() };
    assert_eq!(print(&one_column, full)?, 0x8e24_b21a_dd09_9211);
    let three_levels = TreeSettings { max_depth: Some(3), min_leaf: 5, ..full };
    assert_eq!(print(&train.examples(), three_levels)?, 0xf38e_7ebe_e452_4d81);
    let weighted = Examples { weights: Some(&weights), ..train.examples() };
    assert_eq!(print(&weighted, TreeSettings { min_leaf: 5, ..full })?, 0x44ab_fdd4_b32e_25a1);
    Ok(())
}

#[test]
fn gradient_boosting_predicts_exactly_alike() -> Result<(), LearnError> {
    let (train, test, weights) = (train(), test(), weights());
    let mut settings = GradientBoostingSettings { rounds: 20, ..GradientBoostingSettings::default() };
    settings.tree.min_leaf = 10;
    let model = GradientBoosting::fit(&Examples { weights: Some(&weights), ..train.examples() }, &settings)?;
    assert_eq!(fingerprint(&test.predicted(|row| model.predict(row))), 0x5e0c_b320_2865_89a0);
    let peer = [0.395_585_982, 0.287_760_193, 0.039_007_01, 0.077_707_879, 0.188_771_618, 0.011_167_318];
    for (ours, theirs) in model.predict(test.row(0)).iter().zip(peer) {
        assert!((ours - theirs).abs() < 1e-6, "{ours} and {theirs}");
    }
    Ok(())
}

/// Compares the mean macro recall of a few seeds on unseen rows with that of twenty seeds of the peer. The band is four
/// standard deviations of the difference, at least 0.01.
fn agree(
    name: &str,
    peer: f64,
    deviation: f64,
    recall_of: impl Fn(u64) -> Result<f64, LearnError>,
) -> Result<(), LearnError> {
    const SEEDS: u64 = 4;
    let mut ours = 0.0;
    for seed in 0..SEEDS {
        ours += recall_of(seed)? / SEEDS as f64;
    }
    let band = (4.0 * deviation * (1.0_f64 / 4.0 + 1.0 / 20.0).sqrt()).max(0.01);
    println!("{name}: {ours:.4}, peer {peer:.4}, band {band:.4}");
    assert!((ours - peer).abs() < band, "{name}: {ours:.4} differs from {peer:.4} by more than {band:.4}");
    Ok(())
}

#[test]
fn forests_are_as_good() -> Result<(), LearnError> {
    let (train, test) = (train(), test());
    let recall = |settings: &ForestSettings| {
        Forest::fit(&train.examples(), settings).map(|forest| test.macro_recall(|row| forest.predict(row)))
    };
    let tree = TreeSettings { features: FeatureSampling::Shuffled, ..TreeSettings::default() };
    agree("decision tree", 0.5388, 0.0066, |seed| {
        recall(&ForestSettings { tree, seed, ..ForestSettings::decision_tree() })
    })?;
    agree("random forest", 0.6181, 0.0093, |seed| {
        recall(&ForestSettings { trees: 100, seed, ..ForestSettings::random_forest() })
    })?;
    agree("extra-trees", 0.6195, 0.0084, |seed| {
        recall(&ForestSettings { trees: 100, seed, ..ForestSettings::extra_trees() })
    })?;
    agree("bagged trees", 0.6158, 0.0098, |seed| {
        recall(&ForestSettings { trees: 50, seed, ..ForestSettings::bagged_trees() })
    })
}

#[test]
fn boosting_is_as_good() -> Result<(), LearnError> {
    let (train, test) = (train(), test());
    agree("gradient boosting", 0.5955, 0.0094, |seed| {
        let settings = GradientBoostingSettings { rounds: 50, subsample: 0.5, seed, ..Default::default() };
        let model = GradientBoosting::fit(&train.examples(), &settings)?;
        Ok(test.macro_recall(|row| model.predict(row)))
    })
}
