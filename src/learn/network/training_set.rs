//! Training set of one stage: prepared sequences with the outputs of stage one and the PMF of earlier grasps as further
//! inputs, and their augmentation.

use super::training::{TrainingSequence, TrainingSet};
use crate::pmf::Pmf;
use rand::{Rng, RngExt};

/// Input sequences of a stage with their true classes, and how to augment them.
#[derive(Clone, Debug, Default)]
pub(super) struct StageInputs {
    /// Inputs per step.
    pub(super) width: usize,
    /// Inputs of each grasp, `[steps][width]`.
    pub(super) sequences: Vec<Vec<f32>>,
    /// True class in each group, for each grasp.
    pub(super) targets: Vec<Vec<usize>>,
    /// Index of each input's counterpart when left and right are exchanged; `None` to switch mirroring off.
    pub(super) mirror: Option<Vec<usize>>,
    /// Number of leading inputs that are readings, to which noise is added; the others are probabilities.
    pub(super) readings: usize,
    /// Standard deviation of the noise, in standard deviations of the input.
    pub(super) noise: f32,
    /// PMFs to feed back as those of earlier grasps; `None` for networks that are not iterated.
    pub(super) earlier: Option<Earlier>,
}

/// PMFs of held-out grasps, fed back as those of earlier grasps of the same object (paper, section V-E).
#[derive(Clone, Debug)]
pub(super) struct Earlier {
    /// PMF of each held-out grasp.
    pub(super) alone: Vec<Pmf>,
    /// For each grasp, the indices into `alone` of other grasps of its class.
    pub(super) same: Vec<Vec<usize>>,
    /// Number of classes.
    pub(super) classes: usize,
    /// Largest number of earlier grasps.
    pub(super) most: usize,
}

impl Earlier {
    /// PMFs of held-out grasps, each with the number of its grasp, to be fed back to others of the same class.
    pub(super) fn new(alone: Vec<(usize, Pmf)>, class_of: &[usize], classes: usize, most: usize) -> Self {
        let mut of_class = vec![Vec::new(); classes];
        alone.iter().enumerate().for_each(|(place, (k, _))| of_class[class_of[*k]].push(place));
        let mut same = vec![Vec::new(); class_of.len()];
        for (place, (k, _)) in alone.iter().enumerate() {
            same[*k] = of_class[class_of[*k]].iter().copied().filter(|other| *other != place).collect();
        }
        Self { alone: alone.into_iter().map(|(_, pmf)| pmf).collect(), same, classes, most }
    }

    /// Draws the belief after up to [`most`](Self::most) other grasps of the same object; uniform after none.
    fn draw(&self, k: usize, random: &mut dyn Rng) -> Pmf {
        let mut before = Pmf::uniform(self.classes);
        if !self.same[k].is_empty() {
            for _ in 0..random.random_range(0..=self.most) {
                let other = self.same[k][random.random_range(0..self.same[k].len())];
                before = before.times(&self.alone[other]);
            }
        }
        before
    }
}

impl TrainingSet for StageInputs {
    fn count(&self) -> usize {
        self.sequences.len()
    }

    fn longest(&self) -> usize {
        self.sequences.iter().map(Vec::len).max().unwrap_or(0) / self.width.max(1)
    }

    fn draw(&self, k: usize, random: &mut dyn Rng, drawn: &mut TrainingSequence) {
        drawn.targets.clone_from(&self.targets[k]);
        let sequence = &self.sequences[k];
        drawn.x.clear();
        match self.mirror.as_ref().filter(|_| random.random::<bool>()) {
            Some(mirror) => {
                for row in sequence.chunks_exact(self.width) {
                    drawn.x.extend(mirror.iter().map(|from| row[*from]));
                }
            }
            None => drawn.x.extend_from_slice(sequence),
        }
        if self.noise > 0.0 {
            for row in drawn.x.chunks_exact_mut(self.width) {
                row[..self.readings].iter_mut().for_each(|x| *x += self.noise * nearly_normal(random));
            }
        }
        drawn.log_prior.clear();
        if let Some(earlier) = &self.earlier {
            let before = earlier.draw(k, random);
            drawn.log_prior.extend(before.logarithms().map(|l| l as f32));
            for row in drawn.x.chunks_exact_mut(self.width) {
                let from = self.width - before.classes();
                row[from..].iter_mut().zip(before.probabilities()).for_each(|(x, p)| *x = *p as f32);
            }
        }
    }
}

/// Sum of three uniform numbers, scaled to unit standard deviation: nearly normal, and bounded.
fn nearly_normal(random: &mut dyn Rng) -> f32 {
    let mut uniform = || random.random::<f32>();
    2.0 * (uniform() + uniform() + uniform() - 1.5)
}
