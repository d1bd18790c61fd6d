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

/// Columns in which the channels of a network stand: one, or those of the parts of a finger, with the factor from their mean to
/// its unit.
#[derive(Clone)]
pub(super) struct Columns(Vec<(Vec<usize>, f32)>);

/// Sensing area of a pad (m²): force and pressure of one pad are two units of one reading.
const PAD_AREA: f32 = 1.697e-4;

impl Columns {
    /// Finds channels among others; none where one is missing. Where a finger has several strips or pads in place of a channel,
    /// it is the mean of their curvatures or pressures, or the sum of their forces, as if they were equal parts of one.
    pub(super) fn of(wanted: &[String], found: &[String]) -> Option<Self> {
        let at = |name: &str| found.iter().position(|own| own == name).map(|column| vec![column]);
        let parts = |name: &str| -> Option<Vec<usize>> {
            let is_part = |own: &String| own.strip_prefix(name).is_some_and(|rest| rest.starts_with('_'));
            let parts: Vec<usize> = (0..found.len()).filter(|column| is_part(&found[*column])).collect();
            (!parts.is_empty()).then_some(parts)
        };
        let column = |channel: &String| {
            let force = channel.strip_prefix("pressure_").map(|side| format!("force_{side}"));
            let as_force = |columns: Vec<usize>| (columns.len() as f32 / PAD_AREA, columns);
            let own = at(channel).map(|columns| (1.0, columns));
            let own = own.or_else(|| at(force.as_ref()?).map(as_force));
            let own = own.or_else(|| parts(channel).map(|columns| (1.0, columns)));
            own.or_else(|| parts(force.as_ref()?).map(as_force)).map(|(factor, columns)| (columns, factor))
        };
        wanted.iter().map(column).collect::<Option<_>>().map(Self)
    }

    /// The readings of these channels.
    pub(super) fn pick(&self, grasp: &Sequence) -> Sequence {
        let values = grasp.rows().flat_map(|(_, row)| {
            let mean = |columns: &[usize]| columns.iter().map(|own| row[*own]).sum::<f32>() / columns.len() as f32;
            self.0.iter().map(move |(columns, factor)| mean(columns) * factor)
        });
        Sequence { t_s: grasp.t_s.clone(), values: values.collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_a_finger_stand_for_the_whole() {
        let names = |all: &[&str]| -> Vec<String> { all.iter().map(|own| (*own).to_owned()).collect() };
        let wanted = names(&["curvature_left", "pressure_left"]);
        let picked = |found: &[&str], values: &[f32]| {
            let columns = Columns::of(&wanted, &names(found))?;
            Some(columns.pick(&Sequence { t_s: vec![0.0], values: values.to_vec() }).values)
        };
        let parts = ["pressure_left_distal", "curvature_left", "pressure_left_proximal", "chamber [Pa]"];
        assert_eq!(picked(&parts, &[300.0, 5.0, 100.0, 9e4]), Some(vec![5.0, 200.0]));
        // 1 N and 2 N on halves of a pad press like 3 N on the whole.
        let forces = ["curvature_left", "force_left_distal", "force_left_proximal"];
        assert_eq!(picked(&forces, &[5.0, 1.0, 2.0]), Some(vec![5.0, 3.0 / PAD_AREA]));
        assert_eq!(picked(&["curvature_left", "pressure_leftover"], &[5.0, 1.0]), None);
    }
}
