//! What is in the hand: recognisers, from decision trees to the paper's iterated dual-stage LSTM, behind one interface.
//!
//! A [`Recogniser`] is fitted to a [`Dataset`] and answers a [`Sequence`] of readings with a [`Verdict`]: a PMF over
//! classes and, where the labels have them, one over sizes and one over shapes (stage one). Answers to several grasps of
//! one object add up to a [`Belief`]; [`StopRule`] says when it is enough, and why.
//!
//! Adding a recogniser is writing its file and one line in [`METHODS`].

mod belief;
#[cfg(test)]
mod conformance;
mod data;
pub mod evaluation;
mod features;
pub mod forest;
mod methods;
pub mod metrics;
mod model_file;
pub mod network;
mod pmf;
mod rivals;

pub use belief::{Belief, Rejection, StopReason, StopRule};
pub use data::{Class, DataCard, Dataset, Example, Labels, Sequence};
pub use methods::{Kind, METHODS, Method, method};
pub use model_file::{Arrays, Model, ModelCard, ModelError, shipped_model};
pub use pmf::Pmf;

use std::sync::atomic::{AtomicBool, Ordering};

/// What stage one says of an object.
#[derive(Clone, Debug, PartialEq)]
pub struct Properties {
    /// Over [`Labels::sizes`].
    pub size: Pmf,
    /// Over [`Labels::shapes`].
    pub shape: Pmf,
}

/// What a recogniser says of a grasp.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// Over [`Labels::classes`], with what was known before where it was given.
    pub pmf: Pmf,
    /// Stage one, from this grasp alone; absent where the recogniser has none.
    pub properties: Option<Properties>,
}

/// Something that has learned to tell classes apart.
pub trait Recogniser: Send + Sync {
    /// Answers the readings of one grasp. `before` is the belief that earlier grasps of the same object left behind.
    fn recognise(&self, grasp: &Sequence, before: Option<&Pmf>) -> Verdict;

    /// A reader that answers while a grasp goes on; absent where only a whole grasp can be answered.
    fn live(&self) -> Option<Box<dyn LiveRecogniser>> {
        None
    }

    /// What has been learned, as named arrays.
    fn arrays(&self) -> Arrays;

    /// How many numbers have been learned.
    fn parameters(&self) -> usize;

    /// Settings that were chosen or found while fitting, for the model's card.
    fn settings(&self) -> serde_json::Value;

    /// Whether it says something of sizes and shapes, before it knows the object.
    fn has_stage_one(&self) -> bool {
        false
    }

    /// How sure its answers must be to be taken for known objects; absent where too little was seen to tell.
    fn rejection(&self) -> Option<&Rejection> {
        None
    }
}

/// Answers sample by sample.
pub trait LiveRecogniser: Send {
    /// Another grasp begins; `before` is what earlier ones left behind.
    fn begin(&mut self, before: Option<&Pmf>);

    /// Takes in readings at a time since the grasp began (s); gives an answer whenever there is a new one.
    fn push(&mut self, t: f32, row: &[f32]) -> Option<Verdict>;

    /// Answers all that has been taken in.
    fn finish(&mut self) -> Option<Verdict>;
}

/// How fitting is told what to do and says how far it is.
pub struct Fitting<'a> {
    /// Other seeds give other initial weights, orders and folds.
    pub seed: u64,
    /// A shorter fit for quick looks and tests, of the same form; its results are worse and are marked as quick.
    pub quick: bool,
    /// Settings that differ from the method's own, by name.
    pub settings: serde_json::Map<String, serde_json::Value>,
    /// Hears which share of the work is done.
    pub progress: &'a (dyn Fn(f64) + Sync),
    /// Set from outside to end the work early.
    pub stop: &'a AtomicBool,
}

impl Fitting<'_> {
    /// Fails once the work is to end.
    pub fn check(&self) -> Result<(), FitError> {
        if self.stop.load(Ordering::Relaxed) { Err(FitError::Stopped) } else { Ok(()) }
    }

    /// Fails where settings were given to a method that has none.
    pub(crate) fn refuse_settings(&self) -> Result<(), FitError> {
        let refused = |name: &String| {
            let cause = "this method has none that can be changed".to_owned();
            Err(FitError::Setting { name: name.clone(), cause })
        };
        self.settings.keys().next().map_or(Ok(()), refused)
    }
}

/// Why a recogniser could not be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// Nothing to tell apart.
    #[error("the data hold only one class, \"{class}\": there is nothing to tell apart; add grasps of other objects")]
    OneClass {
        /// The class.
        class: String,
    },
    /// No data.
    #[error("there are no grasps to learn from")]
    NoData,
    /// A class with too few grasps.
    #[error("class \"{class}\" has only {found} grasps, and {needed} are needed; record more or leave the class out")]
    TooFew {
        /// The class.
        class: String,
        /// How many there are.
        found: usize,
        /// How many are needed.
        needed: usize,
    },
    /// Stage one has nothing to learn.
    #[error(
        "{method} learns sizes and shapes first, but no class of these data has any; give the data columns \"size\" \
         and \"shape\", or train another method"
    )]
    NoProperties {
        /// The method.
        method: &'static str,
    },
    /// A setting that is unknown or out of range.
    #[error("setting {name}: {cause}")]
    Setting {
        /// Its name.
        name: String,
        /// What is wrong.
        cause: String,
    },
    /// Stopped from outside.
    #[error("training was stopped; nothing was saved")]
    Stopped,
    /// A library failed.
    #[error("training failed: {cause}")]
    Failed {
        /// What it says.
        cause: String,
    },
}

/// Checks that there is something to learn, and enough of each class that occurs.
pub(crate) fn check_enough(data: &Dataset, needed: usize) -> Result<(), FitError> {
    let counts: Vec<(usize, usize)> =
        data.by_class().iter().map(Vec::len).enumerate().filter(|(_, count)| *count > 0).collect();
    match counts.as_slice() {
        [] => Err(FitError::NoData),
        [(class, _)] => Err(FitError::OneClass { class: data.labels.classes[*class].name.clone() }),
        _ => match counts.iter().find(|(_, found)| *found < needed) {
            Some(&(class, found)) => {
                Err(FitError::TooFew { class: data.labels.classes[class].name.clone(), found, needed })
            }
            None => Ok(()),
        },
    }
}
