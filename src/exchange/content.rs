//! What a stored trial gives to other programs: its channels, poses, labels and origin, whatever its source.

use crate::format::{ExchangeError, TrialExport};
use glam::{DMat3, DQuat};
use palpate_geometry::Pose;
use palpate_lab::inspection::{Keep, OpenOptions, OpenTrial, SimulatedFacts};
use palpate_sim::frame::Frame;
use palpate_sim::gripper::{GripperModel, Side};
use palpate_store::{Store, TrialRow};
use palpate_tactile::trial::{TrialId, TrialSource};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A trial to be written.
pub(crate) struct TrialContent {
    /// The opened trial: channels, phases, answers.
    pub(crate) open: OpenTrial,
    /// Samples with any number; those left out mark gaps.
    pub(crate) samples: Vec<usize>,
    /// Note, tags and doubt of the label.
    pub(crate) row: Option<TrialRow>,
    /// Calibrations of a real gripper's parts, as JSON.
    pub(crate) calibrations: Option<String>,
}

impl TrialExport<'_> {
    /// The trials, opened one by one.
    pub(crate) fn contents(&self) -> Result<impl Iterator<Item = Result<TrialContent, ExchangeError>>, ExchangeError> {
        let rows: BTreeMap<TrialId, TrialRow> = self.store.list(false)?.into_iter().map(|row| (row.id, row)).collect();
        let options = OpenOptions { keep: Keep::Frames, ..self.options.clone() };
        Ok(self.numbers().map(move |id| {
            let id = id?;
            content(self.store, id, &options, rows.get(&id).cloned())
        }))
    }
}

fn content(
    store: &Store,
    id: TrialId,
    options: &OpenOptions,
    row: Option<TrialRow>,
) -> Result<TrialContent, ExchangeError> {
    let open = OpenTrial::open(store, id, options)?;
    let read =
        |k: usize| open.line_bar[k].is_finite() || open.columns.iter().any(|column| column.values[k].is_finite());
    let samples = (0..open.t_s.len()).filter(|k| read(*k)).collect();
    let calibrations = match open.source {
        TrialSource::Recorded => Some(calibrations(store, id)?),
        TrialSource::Simulated | TrialSource::Imported => None,
    };
    Ok(TrialContent { open, samples, row, calibrations })
}

fn calibrations(store: &Store, id: TrialId) -> Result<String, ExchangeError> {
    let repository = store.calibrations();
    let ids = repository.serving(Some(id), &[])?.ids;
    let used = ids.into_iter().map(|id| repository.get(id)).collect::<Result<Vec<_>, _>>()?;
    serde_json::to_string_pretty(&used)
        .map_err(|e| ExchangeError::Refused(format!("trial {id} cannot be written: {e}")))
}

impl TrialContent {
    /// Facts and frames of a simulated trial; none of others, whose fingers are only reconstructed.
    pub(crate) fn simulated(&self) -> Option<(&SimulatedFacts, &[Arc<Frame>])> {
        self.open.simulated.as_ref().map(|facts| (facts, self.open.frames.as_slice()))
    }
}

/// Channels of any trial with their units, in the order in which they appear.
pub(crate) fn channels_of(trials: &[TrialContent]) -> Vec<(&str, &'static str)> {
    let mut channels: Vec<(&str, &'static str)> = Vec::new();
    for column in trials.iter().flat_map(|trial| &trial.open.columns) {
        if !channels.iter().any(|(name, _)| *name == column.name) {
            channels.push((&column.name, column.unit));
        }
    }
    channels
}

/// Pose of a finger's segment in the gripper: z towards the tip, x out of the pad, so that joints turn about y.
pub(crate) fn segment_pose(frame: &Frame, gripper: &GripperModel, side: Side, segment: usize) -> Pose {
    let finger = frame.placed(gripper, side);
    let axes = finger.axes(segment);
    let (along, inward) = (axes.x_axis, axes.z_axis);
    let rotation = DQuat::from_mat3(&DMat3::from_cols(inward, along.cross(inward), along));
    Pose::new(finger.point(segment, 0.0, 0.0, 0.0), rotation)
}

/// Name of a joint, counted from 1 at the palm.
pub(crate) fn joint_name(side: Side, joint: usize) -> String {
    format!("{}_joint_{joint}", side.name())
}

/// Name of a segment, counted from 0 at the palm.
pub(crate) fn segment_name(side: Side, segment: usize) -> String {
    format!("{}_segment_{segment}", side.name())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use palpate_sim::gripper::{Phase, Sway};

    #[test]
    fn joints_turn_about_y_from_one_segment_to_the_next() {
        let gripper = GripperModel::default();
        let joints = gripper.finger.joints;
        let q: Vec<f64> = (0..2 * joints).map(|k| 0.01 * k as f64).collect();
        let frame = Frame {
            sample: 0,
            t: 0.0,
            line_bar: 0.0,
            phase: Phase::Close,
            q,
            sways: [Sway::NONE; 2],
            hand: DVec3::ZERO,
            world_from_object: None,
            taxels: Vec::new(),
        };
        let lengths: Vec<f64> = gripper.finger.segment_lengths().collect();
        for side in Side::BOTH {
            for joint in 1..=joints {
                let [from, to] = [joint - 1, joint].map(|segment| segment_pose(&frame, &gripper, side, segment));
                let turn = DQuat::from_rotation_y(frame.joints(side)[joint - 1]);
                let end = from.point(glam::DVec3::Z * lengths[joint - 1]);
                assert!((end - to.position).length() < 1e-12);
                assert!((from.rotation * turn).angle_between(to.rotation) < 1e-6);
            }
        }
    }
}
