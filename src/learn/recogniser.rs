//! The interface of all recognisers: one grasp in, probabilities out.

use crate::arrays::Arrays;
use crate::belief::Rejection;
use crate::data::{Class, Dataset, Labels, Sequence};
use crate::fitting::{Fitting, LearnError};
use crate::pmf::Pmf;

/// Probabilities of size and shape, as stage one gives them (paper, section III), or as they follow from the classes.
#[derive(Clone, Debug, PartialEq)]
pub struct Properties {
    /// PMF over [`crate::Labels::sizes`].
    pub size: Pmf,
    /// PMF over [`crate::Labels::shapes`].
    pub shape: Pmf,
}

impl Properties {
    /// Sums of the probabilities of the classes that have a size, and a shape. Together with the class, they are one belief.
    pub fn of_classes(labels: &Labels, pmf: &Pmf) -> Self {
        let sums = |names: &[String], of: fn(&Class) -> Option<usize>| {
            let classes = || labels.classes.iter().zip(pmf.probabilities());
            let share = |k: usize| classes().filter(|(class, _)| of(class) == Some(k)).map(|(_, p)| p).sum();
            Pmf::from_weights((0..names.len()).map(share))
        };
        Self { size: sums(&labels.sizes, |class| class.size), shape: sums(&labels.shapes, |class| class.shape) }
    }
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

    /// Forgets a class; later classes move up.
    fn without(&self, class: usize) -> Result<Box<dyn Recogniser>, LearnError>;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn size_and_shape_are_sums_over_the_classes_that_have_them() {
        let class = |size, shape| Class { name: String::new(), size, shape };
        let names = |all: [&str; 2]| all.map(str::to_owned).to_vec();
        let labels = Labels {
            classes: vec![class(Some(0), Some(1)), class(Some(1), Some(1)), class(Some(1), Some(0)), class(None, None)],
            sizes: names(["small", "large"]),
            shapes: names(["round", "flat"]),
        };
        let Properties { size, shape } = Properties::of_classes(&labels, &Pmf::from_weights([0.1, 0.2, 0.5, 0.2]));
        let close = |pmf: &Pmf, own: [f64; 2]| pmf.probabilities().iter().zip(own).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(close(&size, [0.125, 0.875]) && close(&shape, [0.625, 0.375]), "{size:?} {shape:?}");
    }
}
