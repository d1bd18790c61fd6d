//! Origin of the trials of a data set, as their data tell it.

use palpate_learn::ModelCard;
use palpate_sim::gripper::GripperModel;
use palpate_sim::scene::{Between, Faces, PRESETS, PoseSpread, Scene};
use palpate_store::CalibrationId;
use palpate_tactile::trial::TrialHeader;

/// Origin of a trial, as far as its data tell.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct TrialOrigin {
    /// Pose preset and fixed object of a simulated trial.
    pub(super) simulated: Option<(Option<&'static str>, bool)>,
    /// Hash of the fingers of a simulated trial, where they are not those by default.
    pub(super) fingers: Option<String>,
    /// Calibrations of a recorded one.
    pub(super) calibrations: Vec<CalibrationId>,
    /// The build of the gripper was drawn.
    pub(super) built: bool,
    /// Hash of the object's files, and their path; none for other trials, and those of early versions.
    pub(super) object: Option<(u64, String)>,
    /// Group of similar poses.
    pub(super) pose: u32,
    /// Identity of the grasp before, if the object has stayed as that one released it.
    pub(super) after: Option<String>,
    /// The object has stayed as the trial before released it; for trials that do not name that one.
    pub(super) stayed: bool,
}

impl TrialOrigin {
    /// Origin of a simulated trial.
    pub(super) fn simulated(header: &TrialHeader) -> Self {
        let scene = &header.scene;
        let drawn_as = PoseSpread { between: Between::default(), build: 0.0, ..scene.pose.clone() };
        let preset = PRESETS.iter().find(|preset| preset.poses() == drawn_as).map(|preset| preset.name);
        // Early versions stored no predecessor; a random pose never shifts the object itself.
        let stayed = header.origin.is_none()
            && scene.pose.between.leaves_object()
            && !scene.holds_object()
            && scene.object.shift != [0.0; 2];
        Self {
            simulated: Some((preset, scene.holds_object())),
            fingers: fingers_of(scene),
            built: scene.pose.build > 0.0,
            object: header.origin.as_ref().map(|origin| (origin.object, scene.object.source.clone())),
            pose: pose_group(scene),
            after: header.origin.as_ref().and_then(|origin| origin.after.clone()),
            stayed,
            ..Self::default()
        }
    }
}

/// Short stable name of a scene: CRC-32 of its TOML, eight hexadecimal digits.
pub fn scene_hash(scene: &Scene) -> String {
    format!("{:08x}", crc32fast::hash(scene.to_toml().as_bytes()))
}

/// Hash of the fingers of a scene; none for those by default.
fn fingers_of(scene: &Scene) -> Option<String> {
    let gripper = scene.gripper.fingers();
    (gripper != GripperModel::default()).then(|| scene_hash(&Scene { gripper, ..Scene::default() }))
}

/// [`ModelCard::knows_fingers`] for those of a scene.
pub fn knows_fingers(card: &ModelCard, scene: &Scene) -> bool {
    card.knows_fingers(&fingers_of(scene))
}

/// Largest turn about the vertical at which the fingers meet the object from the same side (degrees).
const SAME_SIDE_DEG: f64 = 45.0;

/// Group of similar poses. Where the object lies on one face and is met from one side: the quarter into which the gripper is
/// shifted, 0 to 3. Else the axis of the object that points up and the one across which the fingers close, 4 to 9.
fn pose_group(scene: &Scene) -> u32 {
    let mount = &scene.gripper.mount;
    if scene.pose.faces == Faces::Nominal && scene.pose.yaw_deg <= SAME_SIDE_DEG {
        return u32::from(mount.offset[0] > 0.0) + 2 * u32::from(mount.offset[1] > 0.0);
    }
    let [roll, pitch, yaw] = scene.object.rotation_deg.map(f64::to_radians);
    let world_from_object = glam::DQuat::from_euler(glam::EulerRot::ZYX, yaw, pitch, roll);
    let in_object = |direction: glam::DVec3| (world_from_object.inverse() * direction).abs();
    let turn = mount.yaw_deg.to_radians();
    let up = in_object(glam::DVec3::Z).max_position() as u32;
    let mut across = in_object(glam::DVec3::new(turn.cos(), turn.sin(), 0.0));
    across[up as usize] = 0.0;
    let across = across.max_position() as u32;
    // The closing axis is one of the two that do not point up.
    4 + 2 * up + u32::from((up + 1) % 3 != across)
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_learn::Shipped;
    use std::path::Path;

    #[test]
    fn poses_are_grouped_by_face_and_closing_axis_or_by_shift() {
        let mut scene = Scene::default();
        scene.gripper.mount.offset = [0.001, -0.001, 0.0];
        assert_eq!(pose_group(&scene), 1);
        scene.pose.faces = Faces::Natural;
        let group = |rotation_deg: [f64; 3], yaw_deg: f64| {
            let mut turned = scene.clone();
            turned.object.rotation_deg = rotation_deg;
            turned.gripper.mount.yaw_deg = yaw_deg;
            pose_group(&turned)
        };
        // Upright: z up; the fingers close along x, or turned by a right angle along y.
        assert_eq!([group([0.0; 3], 0.0), group([0.0; 3], 90.0), group([0.0; 3], 180.0)], [8, 9, 8]);
        // On its side: y up; closing along x, or along z.
        assert_eq!([group([90.0, 0.0, 0.0], 0.0), group([90.0, 0.0, 0.0], 90.0)], [7, 6]);
    }

    #[test]
    fn a_model_from_perfect_sensors_knows_the_fingers_that_it_learned_however_they_are_held()
    -> Result<(), Box<dyn std::error::Error>> {
        let [perfect, any] = [Shipped::PerfectSensors, Shipped::AnyGripper].map(Shipped::model);
        let (perfect, any) = (perfect?, any?);
        let (usual, mut held) = (Scene::default(), Scene::default());
        (held.gripper.mount.yaw_deg, held.gripper.mount.offset) = (30.0, [0.004, 0.0, 0.0]);
        held.object.source = "ball".to_owned();
        assert!([&usual, &held].iter().all(|scene| knows_fingers(&perfect.card, scene)));
        let mut soft = Scene::default();
        soft.gripper.pad.thickness *= 1.5;
        let paper = Scene::named_or_from_file(Path::new("paper"))?;
        assert!([&soft, &paper].iter().all(|scene| !knows_fingers(&perfect.card, scene)));
        assert!([&soft, &paper].iter().all(|scene| knows_fingers(&any.card, scene)));
        // One that learned from grasps by both.
        let mut own = perfect.card.clone();
        own.data.fingers = vec![None, fingers_of(&soft)];
        assert!([&usual, &soft].iter().all(|scene| knows_fingers(&own, scene)) && !knows_fingers(&own, &paper));
        Ok(())
    }
}
