//! Options and errors of fitting a recogniser.

use crate::data::{DataCard, Dataset};
use std::borrow::Cow;
use std::sync::atomic::{AtomicBool, Ordering};

/// Options of a fit, its progress callback and its stop flag.
pub struct Fitting<'a> {
    /// Seed of initial weights, order of training and folds.
    pub seed: u64,
    /// Shorter fit of the same form for tests and previews, with worse results; recorded on the model's card.
    pub quick: bool,
    /// Settings that replace the method's defaults, by name.
    pub settings: serde_json::Map<String, serde_json::Value>,
    /// Further training grasps: stage two of a dual-stage network learns from these, with outputs of a stage one that has not
    /// seen them, as in the paper (40/40/20, section V-C). Other methods learn from both sets. With `None`, a dual-stage
    /// network divides its data in halves.
    pub second: Option<&'a Dataset>,
    /// Called with the share of work done, 0 to 1.
    pub progress: &'a (dyn Fn(f64) + Sync),
    /// Set by the caller to stop the fit.
    pub stop: &'a AtomicBool,
}

impl Fitting<'_> {
    /// Returns an error once the stop flag is set.
    pub fn check(&self) -> Result<(), LearnError> {
        if self.stop.load(Ordering::Relaxed) { Err(LearnError::Stopped) } else { Ok(()) }
    }

    /// The data of a fit together with the further training grasps.
    pub(crate) fn joined<'d>(&self, data: &'d Dataset) -> Result<Cow<'d, Dataset>, LearnError> {
        let Some(second) = self.second else { return Ok(Cow::Borrowed(data)) };
        if second.channels != data.channels || second.labels != data.labels {
            return Err(LearnError::SecondDiffers);
        }
        let mut both = data.clone();
        both.examples.extend_from_slice(&second.examples);
        both.about = DataCard { grasps: both.examples.len(), ..both.about };
        Ok(Cow::Owned(both))
    }

    /// Returns an error if settings are given to a method without settings.
    pub(crate) fn refuse_settings(&self) -> Result<(), LearnError> {
        let refused = |name: &String| {
            let cause = "this method has no settings".to_owned();
            Err(LearnError::Setting { name: name.clone(), cause })
        };
        self.settings.keys().next().map_or(Ok(()), refused)
    }
}

/// Reason why a recogniser could not be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LearnError {
    /// All grasps have the same class.
    #[error("the data contain only one class, \"{class}\"; add grasps of other objects")]
    OneClass {
        /// Class name.
        class: String,
    },
    /// The data set is empty.
    #[error("the data set contains no grasps; `palpate collect` and `palpate record` make some")]
    NoData,
    /// A class with too few grasps.
    #[error("class \"{class}\" has only {found} grasps, {needed} are needed; record more or leave the class out")]
    TooFew {
        /// Class name.
        class: String,
        /// Grasps in the data set.
        found: usize,
        /// Grasps needed.
        needed: usize,
    },
    /// A method with two stages, but no class has a size and a shape.
    #[error(
        "{method} learns size and shape first, but no class in these data has them; add columns \"size\" and \
         \"shape\", or train another method"
    )]
    NoProperties {
        /// Title of the method.
        method: &'static str,
    },
    /// Other readings than those of the geometry encoder.
    #[error(
        "the geometry encoder reads {needs}, but these grasps have {found}; read them through layout C1, or train \
         extra-trees, which needs no encoder"
    )]
    Encoder {
        /// Channels that it reads.
        needs: String,
        /// Channels of the grasps.
        found: String,
    },
    /// A model that cannot learn new objects without its training grasps.
    #[error(
        "this model ({method}) cannot learn new objects by itself; use one of the method geometry-network, such as those that \
         come with Palpate, or train again with grasps of all objects"
    )]
    LearnsNothingNew {
        /// Title of the method.
        method: String,
    },
    /// Grasps for stage two with other channels or labels.
    #[error("the grasps for stage two have other channels or labels than those for stage one")]
    SecondDiffers,
    /// A feature that is NaN or infinite.
    #[error("feature {feature} of training row {row} is not a finite number; remove the trial with gaps")]
    NotFinite {
        /// Row, from 0.
        row: usize,
        /// Feature, from 0.
        feature: usize,
    },
    /// An unknown setting or one out of range.
    #[error("setting {name}: {cause}")]
    Setting {
        /// Setting name.
        name: String,
        /// Problem.
        cause: String,
    },
    /// Stopped by the caller.
    #[error("training stopped; no model was saved")]
    Stopped,
    /// A library failed.
    #[error("training failed: {cause}")]
    Failed {
        /// Message of the library.
        cause: String,
    },
}

impl LearnError {
    /// Wraps the error of a library.
    pub(crate) fn failed(cause: impl std::fmt::Display) -> Self {
        Self::Failed { cause: cause.to_string() }
    }
}

/// Checks that at least two classes occur, each with enough grasps.
pub(crate) fn check_enough(data: &Dataset, needed: usize) -> Result<(), LearnError> {
    let counts: Vec<(usize, usize)> =
        data.by_class().iter().map(Vec::len).enumerate().filter(|(_, count)| *count > 0).collect();
    match counts.as_slice() {
        [] => Err(LearnError::NoData),
        [(class, _)] => Err(LearnError::OneClass { class: data.labels.classes[*class].name.clone() }),
        _ => match counts.iter().find(|(_, found)| *found < needed) {
            Some(&(class, found)) => {
                Err(LearnError::TooFew { class: data.labels.classes[class].name.clone(), found, needed })
            }
            None => Ok(()),
        },
    }
}
