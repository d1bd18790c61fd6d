//! A trial of the real gripper as lists of labels show it.

use super::flag::FlagRemark;
use super::sparkline::Sparkline;
use palpate_tactile::trial::TrialId;
use serde::{Deserialize, Serialize};

/// What a model said of a trial when its label was given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Guess {
    /// The model's name.
    pub model: String,
    /// Classes and their probabilities.
    pub pmf: Vec<(String, f64)>,
}

impl Guess {
    /// The most likely class; of equals the first. None where there are no classes.
    pub fn top(&self) -> Option<&(String, f64)> {
        self.pmf.iter().rev().max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// The probability of a class; none where the model does not know it.
    pub fn probability(&self, class: &str) -> Option<f64> {
        self.pmf.iter().find(|(name, _)| name == class).map(|(_, p)| *p)
    }
}

/// The most likely class of a [`Guess`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GuessTop {
    /// The model's name.
    pub model: String,
    /// The class.
    pub class: String,
    /// Its probability.
    pub p: f64,
    /// The probability of the trial's label; none where it has no label or the model does not know that class.
    pub label_p: Option<f64>,
}

impl GuessTop {
    /// What a guess says of a trial with a label.
    pub fn of(guess: &Guess, label: Option<&str>) -> Option<Self> {
        let (class, p) = guess.top()?;
        let label_p = label.and_then(|label| guess.probability(label));
        Some(Self { model: guess.model.clone(), class: class.clone(), p: *p, label_p })
    }
}

/// A trial of the real gripper with its label.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct LabelledTrial {
    /// Its number in this store.
    pub id: TrialId,
    /// Its identity in every store.
    pub uid: String,
    /// When it began, UTC.
    pub created: String,
    /// Its label; none where nobody has said yet what it is of.
    pub object: Option<String>,
    /// False while it is being recorded, and for one whose recording was cut short.
    pub complete: bool,
    /// What somebody noted of it.
    pub note: String,
    /// Tags, in the order in which they were given.
    pub tags: Vec<String>,
    /// Whoever gave the label was not sure.
    pub unsure: bool,
    /// What is wrong with it, given its label.
    pub flags: Vec<FlagRemark>,
    /// How well its board kept time, in a sentence.
    pub cadence: String,
    /// What the model said when the label was given.
    pub guess: Option<GuessTop>,
    /// Somebody has looked at it again since.
    pub reviewed: bool,
    /// Readings.
    pub samples: u64,
    /// How long it took (s).
    pub seconds: f64,
    /// It was discarded, and may be restored.
    pub discarded: bool,
    /// A small picture of it.
    pub sparkline: Sparkline,
}

impl LabelledTrial {
    /// True where it counts: recorded to its end, labelled and kept.
    pub fn counts(&self) -> bool {
        self.complete && self.object.is_some() && !self.discarded
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
