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

impl<'a> Fitting<'a> {
    /// A fit of one set with the defaults of its method, whose progress nobody sees.
    pub fn new(seed: u64, quick: bool, stop: &'a AtomicBool) -> Self {
        Self { seed, quick, settings: serde_json::Map::new(), second: None, progress: &|_| (), stop }
    }

    /// Returns an error once the stop flag is set.
    pub fn check(&self) -> Result<(), LearnError> {
        if self.stop.load(Ordering::Relaxed) { Err(LearnError::Stopped) } else { Ok(()) }
    }

    /// The data of a fit together with the further training grasps.
    pub(crate) fn joined<'d>(&self, data: &'d Dataset) -> Result<Cow<'d, Dataset>, LearnError> {
        let Some(second) = self.second else { return Ok(Cow::Borrowed(data)) };
        if second.channels != data.channels || second.labels != data.labels {
            return Err(LearnError::Refused(
                "the grasps for stage two have other channels or labels than those for stage one".to_owned(),
            ));
        }
        let mut both = data.clone();
        both.examples.extend_from_slice(&second.examples);
        both.about = DataCard { grasps: both.examples.len(), ..both.about };
        Ok(Cow::Owned(both))
    }

    /// Returns an error if settings are given to a method without settings.
    pub(crate) fn refuse_settings(&self) -> Result<(), LearnError> {
        let refused = |name: &String| Err(LearnError::setting(name, "this method has no settings"));
        self.settings.keys().next().map_or(Ok(()), refused)
    }
}

/// Reason why a recogniser could not be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LearnError {
    #[error("training stopped; no model was saved")]
    Stopped,
    #[error("{0}")]
    Refused(String),
}

impl LearnError {
    /// An empty data set.
    pub fn no_data() -> Self {
        Self::Refused("the data set contains no grasps; `palpate collect` and `palpate record` make some".to_owned())
    }

    /// An unknown setting or one out of range.
    pub fn setting(name: &str, cause: impl std::fmt::Display) -> Self {
        Self::Refused(format!("setting {name}: {cause}"))
    }

    /// Readings of other channels than those of the geometry encoder.
    pub(crate) fn encoder(needs: &[String], found: &[String]) -> Self {
        let (needs, found) = (needs.join(", "), found.join(", "));
        Self::Refused(format!(
            "the geometry encoder reads {needs}, but these grasps have {found}; read them through layout C1, or train \
             extra-trees, which needs no encoder"
        ))
    }

    /// Wraps the error of a library.
    pub(crate) fn failed(cause: impl std::fmt::Display) -> Self {
        Self::Refused(format!("training failed: {cause}"))
    }
}

/// Checks that at least two classes occur, each with enough grasps.
pub(crate) fn check_enough(data: &Dataset, needed: usize) -> Result<(), LearnError> {
    let counts: Vec<(usize, usize)> =
        data.by_class().iter().map(Vec::len).enumerate().filter(|(_, count)| *count > 0).collect();
    let name = |class: usize| &data.labels.classes[class].name;
    match counts.as_slice() {
        [] => Err(LearnError::no_data()),
        [(class, _)] => Err(LearnError::Refused(format!(
            "the data contain only one class, \"{}\"; add grasps of other objects",
            name(*class)
        ))),
        _ => match counts.iter().find(|(_, found)| *found < needed) {
            Some(&(class, found)) => Err(LearnError::Refused(format!(
                "class \"{}\" has only {found} of the {needed} grasps that are needed; record more or leave the class out",
                name(class)
            ))),
            None => Ok(()),
        },
    }
}
