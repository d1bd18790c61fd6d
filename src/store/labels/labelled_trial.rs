//! A trial of the real gripper in lists of labels.

use super::flag::FlagRemark;
use super::sparkline::Sparkline;
use palpate_tactile::trial::TrialId;
use serde::{Deserialize, Serialize};

/// Tag of the trial of the empty hand that a gripper was adapted by. Its sensors were calibrated to read it as the model does, so
/// that it is no example to learn from; without the tag it is.
pub const ADAPTING: &str = "adapting";

/// Prediction of a model for a trial, made when its label was given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Guess {
    /// Name of the model.
    pub model: String,
    /// Classes and their probabilities.
    pub pmf: Vec<(String, f64)>,
}

impl Guess {
    /// The most likely class, of equals the first; none without classes.
    pub fn top(&self) -> Option<&(String, f64)> {
        self.pmf.iter().rev().max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Probability of a class; none where the model does not know it.
    pub fn probability(&self, class: &str) -> Option<f64> {
        self.pmf.iter().find(|(name, _)| name == class).map(|(_, p)| *p)
    }
}

/// The most likely class of a [`Guess`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GuessTop {
    /// Name of the model.
    pub model: String,
    /// Name of the class.
    pub class: String,
    /// Probability of the class.
    pub p: f64,
    /// Probability of the trial's label; none without a label or where the model does not know it.
    pub label_p: Option<f64>,
}

impl GuessTop {
    /// The top of a prediction for a trial with a label.
    pub fn of(guess: &Guess, label: Option<&str>) -> Option<Self> {
        let (class, p) = guess.top()?;
        let label_p = label.and_then(|label| guess.probability(label));
        Some(Self { model: guess.model.clone(), class: class.clone(), p: *p, label_p })
    }
}

/// A trial of the real gripper with its label.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct LabelledTrial {
    /// Number in this store.
    pub id: TrialId,
    /// Identity in every store.
    pub uid: String,
    /// Time of its beginning, UTC.
    pub created: String,
    /// Label, if any.
    pub object: Option<String>,
    /// Recorded to its end.
    pub complete: bool,
    pub note: String,
    /// Tags, in the order given.
    pub tags: Vec<String>,
    /// The label is marked as unsure.
    pub unsure: bool,
    /// Flags that are faults for its label.
    pub flags: Vec<FlagRemark>,
    /// Timing of its board in one line.
    pub cadence: String,
    /// Prediction made when the label was given.
    pub guess: Option<GuessTop>,
    /// Reviewed since.
    pub reviewed: bool,
    /// Recorded from an emulated gripper.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub emulated: bool,
    /// Number of readings.
    pub samples: u64,
    /// Duration (s).
    pub seconds: f64,
    /// Deleted, can be restored.
    pub discarded: bool,
    /// Its row cannot be read or does not match its checksum.
    pub damaged: bool,
    /// Small plot.
    pub sparkline: Sparkline,
}

impl LabelledTrial {
    /// True for a trial that counts: complete, labelled, neither deleted nor damaged, and not the one that the gripper was adapted
    /// by.
    pub fn counts(&self) -> bool {
        let adapting = self.tags.iter().any(|tag| tag == ADAPTING);
        self.complete && self.object.is_some() && !self.discarded && !self.damaged && !adapting
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_close_that_a_gripper_was_adapted_by_does_not_count() {
        let empty = LabelledTrial { complete: true, object: Some("empty".to_owned()), ..LabelledTrial::default() };
        assert!(empty.counts());
        assert!(!LabelledTrial { tags: vec!["wet".to_owned(), ADAPTING.to_owned()], ..empty }.counts());
    }

    #[test]
    fn the_top_of_a_guess_is_its_first_largest() {
        let pmf = [("a", 0.2), ("b", 0.4), ("c", 0.4)].map(|(name, p)| (name.to_owned(), p)).to_vec();
        let guess = Guess { model: "m".to_owned(), pmf };
        let top = GuessTop::of(&guess, Some("a")).expect("it has classes");
        assert_eq!((top.class.as_str(), top.p, top.label_p), ("b", 0.4, Some(0.2)));
        assert_eq!(GuessTop::of(&guess, Some("mug")).and_then(|top| top.label_p), None);
        assert_eq!(Guess { pmf: Vec::new(), ..guess }.top(), None);
    }
}
