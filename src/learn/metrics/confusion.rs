//! Confusion matrix and the scores computed from it.
//!
//! With tp, fp and fn the right, wrongly claimed and missed trials of a class,
//!
//!   precision = tp / (tp + fp),   recall = tp / (tp + fn),   F1 = 2 tp / (2 tp + fp + fn)
//!
//! and 0 where the denominator is 0. Macro scores are plain means over classes, so that a rare object weighs as much
//! as a common one. These are the definitions of scikit-learn (`precision_recall_fscore_support` with
//! `labels=classes, average="macro", zero_division=0`; macro-accuracy is its `balanced_accuracy_score`). A recogniser
//! may also answer "unknown": that misses the trial, and claims no class.

use serde::{Deserialize, Serialize};

/// A confusion matrix: rows are the truth, columns the decision, the last column "unknown".
///
/// Saved as its rows; rows that do not make a matrix of n by n + 1 are refused.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Vec<Vec<u32>>", into = "Vec<Vec<u32>>")]
pub struct Confusion {
    rows: Vec<Vec<u32>>,
}

/// Scores of one class, 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ClassScores {
    /// Share of the trials decided to be this class that were; 0 if there were none.
    pub precision: f64,
    /// Share of the trials of this class that were found; 0 if there were none.
    pub recall: f64,
    /// Harmonic mean of precision and recall.
    pub f1: f64,
    /// Trials of this class.
    pub trials: u64,
}

/// Scores of a set of classes, 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// Share of the trials of these classes that were right.
    pub accuracy: f64,
    /// Mean recall of those classes that occur.
    pub macro_accuracy: f64,
    /// Mean precision of all the classes asked for.
    pub precision: f64,
    /// Mean recall of all the classes asked for; differs from macro-accuracy if some never occur.
    pub recall: f64,
    /// Mean F1 of all the classes asked for (not the F1 of the means).
    pub f1: f64,
    /// Trials of these classes.
    pub trials: u64,
}

impl Confusion {
    /// Counts decisions trial by trial; a decision of `None` is "unknown".
    ///
    /// `None` if the slices differ in length or a class is not below `classes`.
    pub fn of(classes: usize, truth: &[usize], decided: &[Option<usize>]) -> Option<Self> {
        if truth.len() != decided.len() {
            return None;
        }
        Self::from_pairs(classes, truth.iter().copied().zip(decided.iter().copied()))
    }

    /// Counts pairs of truth and decision, say of a resample of the trials; `None` if a class is not below `classes`.
    pub fn from_pairs(classes: usize, pairs: impl IntoIterator<Item = (usize, Option<usize>)>) -> Option<Self> {
        let mut rows = vec![vec![0; classes + 1]; classes];
        for (truth, decided) in pairs {
            if decided.is_some_and(|class| class >= classes) {
                return None;
            }
            rows.get_mut(truth)?[decided.unwrap_or(classes)] += 1;
        }
        Some(Self { rows })
    }

    /// Number of classes.
    pub fn classes(&self) -> usize {
        self.rows.len()
    }

    /// Trials of one class that were decided so; zero for a class that is not in the matrix.
    pub fn count(&self, truth: usize, decided: Option<usize>) -> u64 {
        let column = decided.map_or(self.classes(), |class| if class < self.classes() { class } else { usize::MAX });
        self.rows.get(truth).and_then(|row| row.get(column)).map_or(0, |count| u64::from(*count))
    }

    /// All trials.
    pub fn trials(&self) -> u64 {
        self.rows.iter().flatten().map(|count| u64::from(*count)).sum()
    }

    /// Share of the trials that were right.
    pub fn accuracy(&self) -> Option<f64> {
        self.scores().map(|scores| scores.accuracy)
    }

    /// Mean per-class recall over the classes that occur.
    pub fn macro_accuracy(&self) -> Option<f64> {
        self.scores().map(|scores| scores.macro_accuracy)
    }

    /// Mean F1 over all classes.
    pub fn macro_f1(&self) -> Option<f64> {
        self.scores().map(|scores| scores.f1)
    }

    /// Scores over the classes with trials; `None` without any.
    pub fn scores_over_occurring(&self) -> Option<Scores> {
        let occurring: Vec<usize> = (0..self.classes()).filter(|class| self.class(*class).trials > 0).collect();
        self.scores_over(&occurring)
    }

    /// Macro F1 over the classes with trials; `None` without any.
    pub fn f1_over_occurring(&self) -> Option<f64> {
        self.scores_over_occurring().map(|scores| scores.f1)
    }

    /// Scores over all classes; `None` without trials.
    pub fn scores(&self) -> Option<Scores> {
        let classes: Vec<usize> = (0..self.classes()).collect();
        self.scores_over(&classes)
    }

    /// Scores averaged over some classes only, say all but "empty"; `None` without trials of these classes.
    ///
    /// Trials of the other classes still count where one of these was wrongly claimed for them. A class that is not
    /// in the matrix scores as one that never occurs.
    pub fn scores_over(&self, classes: &[usize]) -> Option<Scores> {
        let each: Vec<ClassScores> = classes.iter().map(|&class| self.class(class)).collect();
        let right: u64 = classes.iter().map(|&class| self.count(class, Some(class))).sum();
        let trials: u64 = each.iter().map(|class| class.trials).sum();
        let occurring = each.iter().filter(|class| class.trials > 0);
        (trials > 0).then(|| Scores {
            accuracy: share(right, trials),
            macro_accuracy: mean(occurring.map(|class| class.recall)),
            precision: mean(each.iter().map(|class| class.precision)),
            recall: mean(each.iter().map(|class| class.recall)),
            f1: mean(each.iter().map(|class| class.f1)),
            trials,
        })
    }

    /// Scores of one class; all zero for a class that is not in the matrix.
    pub fn class(&self, class: usize) -> ClassScores {
        let right = self.count(class, Some(class));
        let trials = self.rows.get(class).into_iter().flatten().map(|count| u64::from(*count)).sum();
        let claimed = (0..self.classes()).map(|truth| self.count(truth, Some(class))).sum();
        ClassScores {
            precision: share(right, claimed),
            recall: share(right, trials),
            f1: share(2 * right, trials + claimed),
            trials,
        }
    }
}

impl TryFrom<Vec<Vec<u32>>> for Confusion {
    type Error = &'static str;

    fn try_from(rows: Vec<Vec<u32>>) -> Result<Self, Self::Error> {
        if rows.iter().any(|row| row.len() != rows.len() + 1) {
            return Err("a confusion matrix has one column per row and one for unknown");
        }
        Ok(Self { rows })
    }
}

impl From<Confusion> for Vec<Vec<u32>> {
    fn from(confusion: Confusion) -> Self {
        confusion.rows
    }
}

fn share(part: u64, whole: u64) -> f64 {
    if whole == 0 { 0.0 } else { part as f64 / whole as f64 }
}

/// Mean of at least one number; callers have a class that occurs.
fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = values.fold((0.0, 0.0), |(count, sum), value| (count + 1.0, sum + value));
    sum / count
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const TRUTH: [usize; 12] = [0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 2, 2];

    fn four_classes() -> Confusion {
        let decided = [0, 0, 1, -1, 1, 1, 2, 2, 2, 0, -1, 2].map(|class| usize::try_from(class).ok());
        Confusion::of(4, &TRUTH, &decided).expect("valid classes")
    }

    #[test]
    fn scores_agree_with_scikit_learn() {
        // t = [0,0,0,0,1,1,1,2,2,2,2,2]; d = [0,0,1,-1,1,1,2,2,2,0,-1,2]
        // accuracy_score(t, d); balanced_accuracy_score(t, d)
        // precision_recall_fscore_support(t, d, labels=[0,1,2,3], average="macro", zero_division=0), then labels=[1,2]
        let confusion = four_classes();
        let all = confusion.scores().expect("trials");
        let some = confusion.scores_over(&[1, 2]).expect("trials");
        for (got, expected) in [
            (all.accuracy, 0.5833333333333334),
            (all.macro_accuracy, 0.5888888888888889),
            (all.precision, 0.5208333333333333),
            (all.recall, 0.44166666666666665),
            (all.f1, 0.47619047619047616),
            (some.precision, 0.7083333333333333),
            (some.recall, 0.6333333333333333),
            (some.f1, 0.6666666666666666),
            // Trials of classes 1 and 2: five of eight are right.
            (some.accuracy, 0.625),
        ] {
            assert!((got - expected).abs() < 1e-15, "{got} {expected}");
        }
        assert_eq!((all.trials, some.trials), (12, 8));
    }

    #[test]
    fn unknown_is_wrong_but_claims_no_class() {
        let confusion = Confusion::of(1, &[0, 0, 0, 0], &[Some(0), None, None, None]).expect("valid classes");
        assert_eq!(confusion.class(0), ClassScores { precision: 1.0, recall: 0.25, f1: 0.4, trials: 4 });
        assert_eq!((confusion.count(0, None), confusion.count(0, Some(0))), (3, 1));
    }

    #[test]
    fn nothing_to_score_has_no_scores() {
        assert_eq!(Confusion::of(0, &[], &[]).and_then(|confusion| confusion.scores()), None);
        assert_eq!(Confusion::of(3, &[], &[]).and_then(|confusion| confusion.accuracy()), None);
        assert_eq!(four_classes().scores_over(&[3]), None);
        assert_eq!(four_classes().scores_over(&[]), None);
        assert_eq!(four_classes().class(9), ClassScores::default());
        assert_eq!(four_classes().count(0, Some(4)), 0);
    }

    #[test]
    fn classes_out_of_range_are_refused() {
        assert_eq!(Confusion::of(2, &[2], &[None]), None);
        assert_eq!(Confusion::of(2, &[0], &[Some(2)]), None);
        assert_eq!(Confusion::of(2, &[0, 1], &[Some(0)]), None);
        assert!(Confusion::try_from(vec![vec![1, 0]]).is_ok());
        assert!(Confusion::try_from(vec![vec![1, 0], vec![1, 0]]).is_err());
    }

    proptest! {
        #[test]
        fn scores_are_shares(pairs in prop::collection::vec((0usize..4, prop::option::of(0usize..4)), 1..60)) {
            let confusion = Confusion::from_pairs(4, pairs.iter().copied()).expect("valid classes");
            for class in (0..4).map(|class| confusion.class(class)) {
                let (least, most) = (class.precision.min(class.recall), class.precision.max(class.recall));
                prop_assert!((0.0..=1.0).contains(&least) && most <= 1.0);
                prop_assert!(class.f1 >= least - 1e-15 && class.f1 <= most + 1e-15);
            }
            let scores = confusion.scores().expect("trials");
            prop_assert!(scores.macro_accuracy >= scores.recall);
            prop_assert!((0.0..=1.0).contains(&scores.f1) && scores.trials == pairs.len() as u64);
            let right = pairs.iter().filter(|(truth, decided)| *decided == Some(*truth)).count();
            prop_assert!((scores.accuracy - right as f64 / pairs.len() as f64).abs() < 1e-15);
        }
    }
}
