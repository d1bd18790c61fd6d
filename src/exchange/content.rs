//! What a stored trial gives to other programs: its channels, poses, labels and origin, whatever its source.

use crate::format::{ExchangeError, TrialExport};
use crate::taxels::Taxels;
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
        // An unknown number is told where the trial is opened.
        let has_taxels = |id: &TrialId| rows.get(id).is_none_or(|row| row.source == TrialSource::Simulated);
        if self.taxels && !self.ids.iter().any(has_taxels) {
            let text = "no trial has taxels: only simulated grasps know the force on each; export without them";
            return Err(ExchangeError::Refused(text.to_owned()));
        }
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

    /// Frame of a simulated trial at a sample: the last until then.
    pub(crate) fn frame_at(&self, sample: usize) -> Option<&Frame> {
        self.simulated()?;
        self.open.at(self.open.t_s[sample])?.frame.map(Arc::as_ref)
    }

    /// Taxels of a simulated trial.
    pub(crate) fn taxels(&self) -> Option<Taxels<'_>> {
        self.simulated().map(|_| Taxels::of(&self.open.header.scene.gripper))
    }

    /// Forces on all taxels at samples of a simulated trial (N): normal, towards the tip, across.
    pub(crate) fn taxel_forces(&self, samples: impl Iterator<Item = usize>) -> impl Iterator<Item = [f32; 3]> {
        let taxels = self.taxels();
        samples.flat_map(move |k| {
            taxels.as_ref().zip(self.frame_at(k)).map_or_else(Vec::new, |(taxels, frame)| taxels.forces(frame))
        })
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

/// Fingers, rows and columns of taxels, which must be those of every trial that has any.
pub(crate) fn common_pads(trials: &[TrialContent]) -> Result<[usize; 3], ExchangeError> {
    let mut shapes = trials.iter().filter_map(|trial| Some((trial.open.id, trial.taxels()?.shape())));
    let (first, shape) = shapes.next().unwrap_or_default();
    match shapes.find(|(_, other)| *other != shape) {
        None => Ok(shape),
        Some((id, [_, rows, columns])) => Err(ExchangeError::Refused(format!(
            "trial {first} has {} x {} taxels on a pad, and trial {id} has {rows} x {columns}; export them into separate files",
            shape[1], shape[2]
        ))),
    }
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
    use palpate_sim::frame::TaxelLoad;
    use palpate_sim::gripper::{Phase, Sway};
    use palpate_sim::run::SimRun;
    use palpate_sim::scene::Scene;

    #[test]
    fn taxels_of_a_straight_finger_lie_in_the_frame_of_its_first_segment() {
        let scene = Scene::default();
        let gripper = &scene.gripper;
        let mut frame = SimRun::new(&scene, None).0.first_look();
        let taxels = Taxels::of(gripper);
        let load = |taxel| TaxelLoad { taxel, normal: 0.5, along: 0.25, across: 0.125 };
        frame.taxels = (0..taxels.count() as u16).map(load).collect();
        let positions = taxels.positions();
        for side in Side::BOTH {
            let first = side.index() * positions.len() / 2;
            let root = segment_pose(&frame, gripper, side, 0);
            for loaded in taxels.loaded(&frame, side) {
                let place = root.point(DVec3::from(positions[first + loaded.taxel]));
                assert!((place - loaded.place).length() < 1e-12, "{side:?} {}: {place}", loaded.taxel);
                // Into the pad, towards the tip that hangs down, and along y.
                let wanted = DVec3::new(-0.5 * side.closing_sign(), 0.125, -0.25);
                assert!((loaded.force - wanted).length() < 1e-12, "{}", loaded.force);
            }
        }
        assert_eq!(taxels.forces(&frame)[7], [0.5, 0.25, 0.125]);
    }

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
