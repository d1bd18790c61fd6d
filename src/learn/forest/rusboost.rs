//! RUSBoost (Seiffert et al. 2010): before every round of boosting, rows of the larger classes are left out at random
//! until all classes have as many as the smallest. A class with few rows is heard as much as one with many, and what
//! one round leaves out, others see.

use super::arrays::{Array, ArrayError, Reader};
use super::bins::Bins;
use super::reweighting::{M2, Reweighting, Samme, Verdict};
use super::split::Target;
use super::stored_trees::push_trees;
use super::tree::{FeatureSampling, Ground, Tree, TreeSettings};
use super::{Examples, FitError, check_boosting, drawn, greatest, normalise, random_of, softmax};
use rand_chacha::ChaCha8Rng;

/// How rows are weighed and trees heard.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RusBoostForm {
    /// AdaBoost.M2, as published: trees say how sure they are of every class, and pairs of row and class that are hard
    /// to tell apart gain weight.
    #[default]
    M2,
    /// As in imbalanced-learn: trees name a class, and rows named wrongly gain weight. Its probabilities are in the
    /// right order, but with many classes all nearly equal, and it often ends after a few rounds.
    Samme,
}

/// How [`RusBoost`] is fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RusBoostSettings {
    /// How rows are weighed and trees heard. Default: as published.
    pub form: RusBoostForm,
    /// Rounds, at least 1, each of one tree. Default 200.
    pub rounds: usize,
    /// How fast weights change, above 0 and at most 10. Default 1, as published.
    pub learning_rate: f64,
    /// How each tree is grown. Default: until leaves are pure, columns shuffled. Depth matters more than all else: for
    /// seventeen classes of synthetic rows, recall was 0.21, 0.75 and 0.90 at depths 1, 4 and 8.
    pub tree: TreeSettings,
    /// Other seeds leave out other rows.
    pub seed: u64,
}

impl Default for RusBoostSettings {
    fn default() -> Self {
        let tree = TreeSettings { features: FeatureSampling::Shuffled, ..TreeSettings::default() };
        Self { form: RusBoostForm::M2, rounds: 200, learning_rate: 1.0, tree, seed: 0 }
    }
}

/// Trees and how much the word of each counts.
#[derive(Clone, Debug, PartialEq)]
pub struct RusBoost {
    columns: usize,
    classes: usize,
    form: RusBoostForm,
    /// Classes that have rows, ascending; others are never predicted.
    present: Vec<usize>,
    trees: Vec<Tree>,
    /// One for each tree, positive.
    words: Vec<f64>,
}

impl RusBoost {
    /// Features of a row.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Number of classes.
    pub fn classes(&self) -> usize {
        self.classes
    }

    /// Grows the trees. Refuses examples that are no table, and settings out of range. If no tree is better than
    /// chance, the first one speaks alone.
    pub fn fit(examples: &Examples<'_>, settings: &RusBoostSettings) -> Result<Self, FitError> {
        examples.check()?;
        check_boosting(settings.rounds, settings.learning_rate)?;
        Ok(match settings.form {
            RusBoostForm::M2 => boost(examples, settings, M2::new(examples)),
            RusBoostForm::Samme => boost(examples, settings, Samme::new(examples)),
        })
    }

    /// A probability for each class: for M2 the mean share of the trees by their words, for SAMME a softmax of votes.
    ///
    /// # Panics
    /// If the row has not as many values as those the model was fitted to.
    pub fn predict(&self, row: &[f32]) -> Vec<f64> {
        assert_eq!(row.len(), self.columns, "values of a row");
        let mut heard = vec![0.0; self.classes];
        for (tree, word) in self.trees.iter().zip(&self.words) {
            let leaf = tree.leaf(row);
            match self.form {
                RusBoostForm::M2 => {
                    for (sum, share) in heard.iter_mut().zip(leaf) {
                        *sum += word * f64::from(*share);
                    }
                }
                RusBoostForm::Samme => heard[greatest(leaf)] += word,
            }
        }
        normalise(&mut heard);
        match self.form {
            RusBoostForm::M2 => heard,
            RusBoostForm::Samme => self.softmax_of_votes(&heard),
        }
    }

    /// A tree votes 1 for its class and -1 / (K - 1) for others; with v the mean vote, p = softmax(v / (K - 1)).
    fn softmax_of_votes(&self, heard: &[f64]) -> Vec<f64> {
        let others = (self.present.len() as f64 - 1.0).max(1.0);
        let mut votes: Vec<f64> =
            self.present.iter().map(|&class| (heard[class] - (1.0 - heard[class]) / others) / others).collect();
        softmax(&mut votes);
        let mut probabilities = vec![0.0; self.classes];
        for (class, vote) in self.present.iter().zip(votes) {
            probabilities[*class] = vote;
        }
        probabilities
    }

    /// The whole model, to be stored.
    pub fn to_arrays(&self) -> Vec<(String, Array)> {
        let present = self.present.iter().map(|&class| class as i32).collect();
        let form = match self.form {
            RusBoostForm::M2 => 0,
            RusBoostForm::Samme => 1,
        };
        let mut arrays = vec![
            Array::shape(self.columns, self.classes),
            ("form".to_owned(), Array::I32(vec![form])),
            ("present".to_owned(), Array::I32(present)),
            ("words".to_owned(), Array::F64(self.words.clone())),
        ];
        push_trees(&self.trees, &mut arrays);
        arrays
    }

    /// A model from storage. Refuses arrays that are missing or contradict each other.
    pub fn from_arrays(arrays: &[(String, Array)]) -> Result<Self, ArrayError> {
        let reader = Reader::new(arrays);
        let (columns, classes) = reader.shape()?;
        let form = match reader.i32s("form")? {
            [0] => RusBoostForm::M2,
            [1] => RusBoostForm::Samme,
            [_] => return Err(ArrayError::Number { name: "form", index: 0, expected: "0 or 1" }),
            other => return Err(ArrayError::Length { name: "form", length: other.len(), expected: "one" }),
        };
        let present = reader.ascending("present", classes)?;
        let trees = reader.class_trees(columns, classes)?;
        let words = reader.f64s("words", trees.len())?.to_vec();
        // Their sum must not overflow.
        if let Some(index) = words.iter().position(|word| !(*word > 0.0 && *word <= MOST_WORD)) {
            return Err(ArrayError::Number { name: "words", index, expected: "positive, and no more than 1e12" });
        }
        Ok(Self { columns, classes, form, present, trees, words })
    }
}

/// No tree that was ever fitted counts as much: errors are no smaller than rounding.
const MOST_WORD: f64 = 1e12;

fn boost(examples: &Examples<'_>, settings: &RusBoostSettings, mut rule: impl Reweighting) -> RusBoost {
    let bins = Bins::new(&examples.table);
    let by_class = rows_by_class(examples);
    let (mut trees, mut words) = (Vec::new(), Vec::new());
    let mut first = None;
    for round in 0..settings.rounds {
        let mut random = random_of(settings.seed, round);
        let rows = under_sampled(&by_class, &mut random);
        let weights = rule.weights();
        // A row that has never been mistaken still is an example.
        let target = Target::classes(examples.labels, examples.classes, |row| weights[row].max(f64::EPSILON));
        let tree = Ground { bins: &bins, target: &target, settings: &settings.tree }.grow_classes(rows, &mut random);
        let verdict = rule.judge(&tree, settings.learning_rate);
        if let Verdict::Keep(word) | Verdict::KeepAsLast(word) = verdict {
            trees.push(tree);
            words.push(word.clamp(f64::MIN_POSITIVE, MOST_WORD));
        } else {
            first = first.or(Some(tree));
        }
        if matches!(verdict, Verdict::KeepAsLast(_) | Verdict::Stop) {
            break;
        }
    }
    if trees.is_empty() {
        trees.extend(first);
        words.push(1.0);
    }
    let (columns, classes) = (examples.table.columns, examples.classes);
    RusBoost { columns, classes, form: settings.form, present: examples.present(), trees, words }
}

/// The rows of each class that has any.
fn rows_by_class(examples: &Examples<'_>) -> Vec<Vec<u32>> {
    let mut by_class = vec![Vec::new(); examples.classes];
    for row in examples.rows() {
        by_class[examples.labels[row as usize]].push(row);
    }
    by_class.retain(|rows| !rows.is_empty());
    by_class
}

/// As many rows of each class as the smallest has, ascending.
fn under_sampled(by_class: &[Vec<u32>], random: &mut ChaCha8Rng) -> Vec<u32> {
    let least = by_class.iter().map(Vec::len).min().unwrap_or_default();
    let mut rows: Vec<u32> = by_class.iter().flat_map(|rows| drawn(rows, least, random)).collect();
    rows.sort_unstable();
    rows
}

#[cfg(test)]
mod tests {
    use super::super::{Forest, ForestSettings, Table, peers};
    use super::*;

    #[test]
    fn every_round_sees_classes_equally() {
        let mut random = random_of(0, 0);
        let drawn = under_sampled(&[vec![0, 3], vec![1, 2, 4, 5, 6], vec![7, 8]], &mut random);
        assert_eq!(drawn.len(), 6);
        assert!(drawn.is_sorted() && drawn.starts_with(&[0]) && drawn.ends_with(&[7, 8]) && drawn.contains(&3));
    }

    #[test]
    fn rare_classes_are_found() -> Result<(), FitError> {
        // Classes 4 and 5 have one row in twenty each.
        let (train, test) = (peers::Data::new(0..360), peers::Data::new(360..1360));
        let found = |recalls: [f64; peers::CLASSES]| 0.5 * (recalls[4] + recalls[5]);
        let forest = Forest::fit(&train.examples(), &ForestSettings { trees: 50, ..ForestSettings::random_forest() })?;
        let without = found(test.recalls(|row| forest.predict(row)));
        for form in [RusBoostForm::M2, RusBoostForm::Samme] {
            let settings = RusBoostSettings { form, rounds: 50, ..RusBoostSettings::default() };
            let model = RusBoost::fit(&train.examples(), &settings)?;
            let with = found(test.recalls(|row| model.predict(row)));
            assert!(with > without + 0.15, "{form:?}: {with:.3}, forest {without:.3}");
        }
        Ok(())
    }

    #[test]
    fn seeds_decide_and_probabilities_sum_to_one() -> Result<(), FitError> {
        let data = peers::Data::new(0..200);
        for form in [RusBoostForm::M2, RusBoostForm::Samme] {
            let tree = TreeSettings { max_depth: Some(4), ..TreeSettings::default() };
            let settings = RusBoostSettings { form, rounds: 5, tree, ..RusBoostSettings::default() };
            let model = RusBoost::fit(&data.examples(), &settings)?;
            assert_eq!(model, RusBoost::fit(&data.examples(), &settings)?);
            assert_ne!(model, RusBoost::fit(&data.examples(), &RusBoostSettings { seed: 1, ..settings })?);
            for row in 0..200 {
                assert!((model.predict(data.row(row)).iter().sum::<f64>() - 1.0).abs() < 1e-12);
            }
        }
        Ok(())
    }

    #[test]
    fn a_single_class_and_rows_that_cannot_be_told_apart() -> Result<(), FitError> {
        let table = Table { values: &[1.0, 1.0, 1.0], columns: 1 };
        for form in [RusBoostForm::M2, RusBoostForm::Samme] {
            let settings = RusBoostSettings { form, ..RusBoostSettings::default() };
            let one = Examples { table, labels: &[2, 2, 2], classes: 3, weights: None };
            assert_eq!(RusBoost::fit(&one, &settings)?.predict(&[0.0]), [0.0, 0.0, 1.0]);
            let alike = Examples { labels: &[0, 1, 2], ..one };
            let model = RusBoost::fit(&alike, &settings)?;
            assert_eq!((model.trees.len(), model.words.clone()), (1, vec![1.0]));
            assert!((model.predict(&[0.0]).iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
        Ok(())
    }
}
