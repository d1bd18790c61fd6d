//! Grasps that a network keeps in its file, as its inputs, so that it can learn new objects without forgetting the known ones.

use super::candle_network::STEPS;
use super::felt_steps::{FeltSteps, Views};
use crate::arrays::{Arrays, ModelError};

/// Most readings that are kept of each class.
const KEPT: usize = 100;
/// The same of the class "other", which is of many kinds.
const KEPT_OF_OTHER: usize = 400;
/// Kept inputs are integers in this unit; inputs have unit deviation.
const UNIT: f32 = 1.0 / 1024.0;

/// Names of the arrays in a model file.
const INPUTS: &str = "kept.inputs";
const CLASSES: &str = "kept.classes";
const FELT: &str = "kept.felt";

/// Kept grasps, each with its class.
#[derive(Clone, Default)]
pub(super) struct KeptGrasps(Vec<KeptGrasp>);

#[derive(Clone)]
struct KeptGrasp {
    class: usize,
    /// Steps felt.
    felt: usize,
    /// Inputs of the grasp itself, `[inputs][STEPS]`, without the input that says what was felt.
    inputs: Vec<i16>,
}

impl KeptGrasps {
    /// Keeps some grasps of each class, evenly chosen.
    pub(super) fn of(truth: &[usize], classes: usize, other: Option<usize>, views: &[Views]) -> Self {
        let chosen = (0..classes).flat_map(|class| {
            let of_class: Vec<usize> = (0..truth.len()).filter(|k| truth[*k] == class).collect();
            let count = of_class.len().min(if Some(class) == other { KEPT_OF_OTHER } else { KEPT });
            (0..count).map(move |k| (class, of_class[k * of_class.len() / count]))
        });
        Self(chosen.map(|(class, k)| KeptGrasp::of(class, &views[k])).collect())
    }

    /// The same without a class; later classes move up.
    pub(super) fn without(&self, class: usize) -> Self {
        let rest = self.0.iter().filter(|kept| kept.class != class);
        Self(
            rest.map(|kept| KeptGrasp { class: kept.class - usize::from(kept.class > class), ..kept.clone() })
                .collect(),
        )
    }

    /// Number of grasps.
    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// Inputs and class of each.
    pub(super) fn views(&self, steps: &FeltSteps) -> impl Iterator<Item = (usize, Views)> {
        let inputs = |kept: &KeptGrasp| kept.inputs.iter().map(|x| f32::from(*x) * UNIT).collect();
        self.0.iter().map(move |kept| (kept.class, steps.views_of(inputs(kept), kept.felt)))
    }

    /// Adds them to the arrays of a model file.
    pub(super) fn put_into(&self, arrays: &mut Arrays) {
        let width = self.0.first().map_or(0, |kept| kept.inputs.len());
        if self.0.is_empty() {
            return;
        }
        let inputs = self.0.iter().flat_map(|kept| kept.inputs.iter().copied()).collect();
        arrays.put_small(INPUTS, &[self.0.len(), width], inputs);
        arrays.put_integers(CLASSES, self.0.iter().map(|kept| kept.class));
        arrays.put_integers(FELT, self.0.iter().map(|kept| kept.felt));
    }

    /// Reads so many from the arrays of a model file.
    pub(super) fn read(
        arrays: &Arrays,
        count: usize,
        steps: &FeltSteps,
        number_of_classes: usize,
    ) -> Result<Self, ModelError> {
        if count == 0 {
            return Ok(Self::default());
        }
        let width = (steps.inputs() - 1) * STEPS;
        let inputs = arrays.small(INPUTS, &[count, width])?;
        arrays.require(CLASSES, &[count], INPUTS)?;
        arrays.require(FELT, &[count], INPUTS)?;
        let classes = arrays.indices(CLASSES, number_of_classes, "a class")?;
        let felt = arrays.indices(FELT, STEPS + 1, "a number of steps")?;
        let grasps = inputs.chunks_exact(width).zip(classes).zip(felt);
        Ok(Self(grasps.map(|((inputs, class), felt)| KeptGrasp { class, felt, inputs: inputs.to_vec() }).collect()))
    }
}

impl KeptGrasp {
    fn of(class: usize, views: &Views) -> Self {
        let own = views.inputs.first().map_or(&[][..], |own| &own[..own.len() - STEPS]);
        // A conversion from floats saturates.
        Self { class, felt: views.felt, inputs: own.iter().map(|x| (x / UNIT).round() as i16).collect() }
    }
}
