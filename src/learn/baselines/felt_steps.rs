//! Inputs of networks that answer from the beginning of a grasp on: time steps of which only the first have been felt.

use super::candle_network::{STEPS, add_noise, mirrored};
use crate::data::{Dataset, Sequence};
use crate::gaps;
use crate::network::Preparation;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Fewest steps that are read; the fingers touch nothing before.
pub(super) const LEAST_FELT: usize = 3;
/// Steps of a grasp that are calibrated together.
const STAGE: usize = 3;
/// Number of such stages.
pub(super) const STAGES: usize = STEPS / STAGE;

/// Readings as the inputs of a network.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FeltSteps {
    /// Channels that are read.
    pub(super) channels: Vec<String>,
    preparation: Preparation,
    mirror: Option<Vec<usize>>,
}

/// A grasp as inputs: `[inputs][STEPS]` for the grasp and, where there is one, its mirror image. Steps that have not been
/// felt are zero; the last input is 1 for those that have.
#[derive(Clone)]
pub(super) struct Views {
    pub(super) inputs: Vec<Vec<f32>>,
    /// Number of steps felt.
    pub(super) felt: usize,
}

impl FeltSteps {
    /// Fits the scaling of the inputs to grasps.
    pub(super) fn fit(data: &Dataset) -> Self {
        let duration_s = data.median_duration_s().max(0.05);
        let preparation = Preparation::fit(data, (STEPS as f32 / duration_s).clamp(0.1, 1000.0));
        let mirror = preparation.mirror(&data.channels);
        Self { channels: data.channels.clone(), preparation, mirror }
    }

    /// Number of inputs.
    pub(super) fn inputs(&self) -> usize {
        self.preparation.width() + 1
    }

    /// Part that cannot be, of settings from a file.
    pub(super) fn fault(&self) -> Option<&'static str> {
        let width = self.preparation.width();
        if !self.preparation.is_sound(self.channels.len()) {
            Some("the input scaling")
        } else if !self.mirror.as_ref().is_none_or(|m| m.len() == width && m.iter().all(|to| *to < width)) {
            Some("the mirror image")
        } else {
            None
        }
    }

    /// Steps felt at a time since the start of the grasp (s).
    pub(super) fn felt_at(&self, t: f32) -> usize {
        ((t * self.preparation.rate_hz) as usize).min(STEPS)
    }

    /// Inputs of a grasp.
    pub(super) fn views(&self, grasp: &Sequence) -> Views {
        let width = self.preparation.width();
        let rows = self.preparation.inputs(&gaps::filled(grasp));
        let felt = (rows.len() / width.max(1)).min(STEPS);
        let at = |step: usize, input: usize| if step < felt { rows[step * width + input] } else { 0.0 };
        self.views_of((0..width).flat_map(|input| (0..STEPS).map(move |step| at(step, input))).collect(), felt)
    }

    /// Inputs of a grasp and its mirror image, from those of the grasp, `[inputs][STEPS]`, without the last one.
    pub(super) fn views_of(&self, own: Vec<f32>, felt: usize) -> Views {
        let mask = (0..STEPS).map(|step| f32::from(u8::from(step < felt)));
        let mut inputs = vec![own];
        inputs.extend(self.mirror.as_ref().map(|mirror| mirrored(mirror, &inputs[0])));
        inputs.iter_mut().for_each(|view| view.extend(mask.clone()));
        Views { inputs, felt }
    }
}

impl Views {
    /// The same as if the grasp had ended after some steps.
    pub(super) fn until(mut self, felt: usize) -> Self {
        self.felt = felt.min(self.felt);
        self.inputs.iter_mut().for_each(|view| forget_after(view, self.felt));
        self
    }

    /// One view for training, with noise of some deviation: of the grasp or its mirror image; one in two ends early.
    pub(super) fn drawn(&self, noise: f32, random: &mut ChaCha8Rng) -> Vec<f32> {
        let mut view = self.inputs[random.random_range(0..self.inputs.len())].clone();
        let readings = view.len() - STEPS;
        add_noise(&mut view[..readings], noise, random);
        let ends_early = random.random::<bool>() && self.felt > LEAST_FELT;
        let felt = if ends_early { random.random_range(LEAST_FELT..self.felt) } else { self.felt };
        forget_after(&mut view, felt);
        view
    }
}

/// Stage of a grasp of which some steps have been felt.
pub(super) fn stage_of(felt: usize) -> usize {
    (felt.clamp(1, STEPS) - 1) / STAGE
}

/// Steps felt at the end of a stage.
pub(super) fn end_of_stage(stage: usize) -> usize {
    ((stage + 1) * STAGE).max(LEAST_FELT)
}

/// Zeroes all inputs of a view after some steps.
fn forget_after(view: &mut [f32], felt: usize) {
    view.chunks_exact_mut(STEPS).for_each(|input| input[felt.min(STEPS)..].fill(0.0));
}

/// Columns in which the channels of a network stand, each with the factor to its unit.
pub(super) struct Columns(Vec<(usize, f32)>);

/// Sensing area of a pad (m²): force and pressure of one pad are two units of one reading.
const PAD_AREA: f32 = 1.697e-4;

impl Columns {
    /// Finds channels among others; none where one is missing.
    pub(super) fn of(wanted: &[String], found: &[String]) -> Option<Self> {
        let at = |name: &str| found.iter().position(|own| own == name);
        let column = |channel: &String| {
            let as_force = || {
                let column = at(&format!("force_{}", channel.strip_prefix("pressure_")?))?;
                Some((column, 1.0 / PAD_AREA))
            };
            at(channel).map(|column| (column, 1.0)).or_else(as_force)
        };
        wanted.iter().map(column).collect::<Option<_>>().map(Self)
    }

    /// The readings of these channels.
    pub(super) fn pick(&self, grasp: &Sequence) -> Sequence {
        let values = grasp.rows().flat_map(|(_, row)| self.0.iter().map(|(column, factor)| row[*column] * factor));
        Sequence { t_s: grasp.t_s.clone(), values: values.collect() }
    }
}
