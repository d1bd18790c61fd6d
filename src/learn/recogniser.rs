//! The interface of all recognisers: one grasp in, probabilities out.

use crate::arrays::Arrays;
use crate::belief::Rejection;
use crate::data::{Dataset, Sequence};
use crate::fitting::{Fitting, LearnError};
use crate::pmf::Pmf;

/// Result of stage one: probabilities of size and shape (paper, section III).
#[derive(Clone, Debug, PartialEq)]
pub struct Properties {
    /// PMF over [`crate::Labels::sizes`].
    pub size: Pmf,
    /// PMF over [`crate::Labels::shapes`].
    pub shape: Pmf,
}

/// Result of recognising one grasp.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// PMF over [`crate::Labels::classes`], combined with that of earlier grasps where one was given.
    pub pmf: Pmf,
    /// Result of stage one for this grasp alone; `None` for recognisers with one stage.
    pub properties: Option<Properties>,
}

/// Fitted recogniser.
pub trait Recogniser: Send + Sync {
    /// Recognises one grasp. `before` is the belief after earlier grasps of the same object.
    fn recognise(&self, grasp: &Sequence, before: Option<&Pmf>) -> Verdict;

    /// Creates a recogniser for samples as they arrive; `None` for methods that need the whole grasp.
    fn live(&self) -> Option<Box<dyn LiveRecogniser>> {
        None
    }

    /// The recogniser as one that learns new objects; `None` for methods that need all their training grasps again.
    fn as_pupil(&self) -> Option<&dyn Pupil> {
        None
    }

    /// Returns the learned parameters under the names used in model files.
    fn arrays(&self) -> Arrays;

    /// Number of learned parameters.
    fn parameters(&self) -> usize;

    /// Settings chosen or found while fitting, as stored on the model's card.
    fn settings(&self) -> serde_json::Value;

    /// True for recognisers that estimate size and shape first.
    fn has_stage_one(&self) -> bool {
        false
    }

    /// Threshold that separates known from unknown objects; `None` after training on too few grasps.
    fn rejection(&self) -> Option<&Rejection> {
        None
    }
}

/// Recogniser that learns new objects without the grasps that it was trained on.
pub trait Pupil: Sync {
    /// Learns these grasps besides what it knows. Their labels begin with its own.
    fn taught(&self, grasps: &Dataset, fitting: &Fitting<'_>) -> Result<Box<dyn Recogniser>, LearnError>;
}

/// Recogniser that takes one sample at a time.
pub trait LiveRecogniser: Send {
    /// Starts a grasp. `before` is the belief after earlier grasps of the same object.
    fn begin(&mut self, before: Option<&Pmf>);

    /// Takes a sample at a time since the start of the grasp (s), one value per channel; returns a verdict whenever a
    /// time step is complete.
    fn push(&mut self, t: f32, row: &[f32]) -> Option<Verdict>;

    /// Ends the grasp; returns the verdict on all samples, `None` without samples.
    fn finish(&mut self) -> Option<Verdict>;
}
