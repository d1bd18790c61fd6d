//! Origin of the trials of a data set, and what was mixed in it.

use super::query::{DatasetQuery, SensorView};
use super::sampling::Cut;
use palpate_learn::DataCard;
use palpate_sim::scene::{Between, Faces, PRESETS, PoseSpread, Scene};
use palpate_store::{CalibrationId, TrialRow};
use palpate_tactile::trial::{TrialHeader, TrialSource};
use std::collections::{BTreeMap, BTreeSet};

/// Origin of a trial, as far as its data tell.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct TrialOrigin {
    /// Pose preset and fixed object of a simulated trial.
    pub(super) simulated: Option<(Option<&'static str>, bool)>,
    /// Calibrations of a recorded one.
    pub(super) calibrations: Vec<CalibrationId>,
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
        let drawn_as = PoseSpread { between: Between::default(), ..scene.pose.clone() };
        let preset = PRESETS.iter().find(|preset| preset.poses() == drawn_as).map(|preset| preset.name);
        // Early versions stored no predecessor; a random pose never shifts the object itself.
        let stayed = header.origin.is_none()
            && scene.pose.between == Between::AsReleased
            && !scene.holds_object()
            && scene.object.shift != [0.0; 2];
        Self {
            simulated: Some((preset, scene.holds_object())),
            pose: pose_group(scene),
            after: header.origin.as_ref().and_then(|origin| origin.after.clone()),
            stayed,
            ..Self::default()
        }
    }
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

/// Card of a data set.
pub(super) fn card(
    query: &DatasetQuery,
    asked: &str,
    rows: &[&TrialRow],
    origins: &[TrialOrigin],
    view: &SensorView,
    left_out_for: BTreeMap<String, usize>,
) -> DataCard {
    let collections: Vec<Option<&String>> = rows.iter().map(|row| query.collection_of(row)).collect();
    let simulated: Vec<(Option<&'static str>, bool)> = origins.iter().filter_map(|origin| origin.simulated).collect();
    let sources: BTreeSet<&str> = rows.iter().map(|row| row.source.name()).collect();
    let presets: BTreeSet<Option<&str>> = simulated.iter().map(|(preset, _)| *preset).collect();
    let fixed: BTreeSet<bool> = simulated.iter().map(|(_, fixed)| *fixed).collect();
    let of_simulation = rows.iter().filter(|row| row.source == TrialSource::Simulated);
    let physics: BTreeSet<Option<u32>> = of_simulation.map(|row| row.physics).collect();
    let calibrations: BTreeSet<&[i64]> =
        origins.iter().map(|origin| &*origin.calibrations).filter(|ids| !ids.is_empty()).collect();
    let distinct: BTreeSet<Option<&String>> = collections.into_iter().collect();

    let mut mixed = Vec::new();
    let mut note = |count: usize, named: bool, what: &str, which: Vec<String>, option: &str| {
        if count > 1 && !named {
            mixed.push(format!("{count} {what} ({}); {option}", which.join(", ")));
        }
    };
    let texts = |all: &BTreeSet<Option<&String>>| -> Vec<String> {
        all.iter().map(|name| name.map_or_else(|| "none".to_owned(), Clone::clone)).collect()
    };
    note(distinct.len(), query.collection.is_some(), "collections", texts(&distinct), "--collection selects one");
    note(
        sources.len(),
        query.source.is_some(),
        "sources",
        sources.iter().map(|name| (*name).to_owned()).collect(),
        "--source selects one",
    );
    let named = |preset: &Option<&str>| preset.unwrap_or("others").to_owned();
    note(
        presets.len(),
        query.preset.is_some(),
        "pose presets",
        presets.iter().map(named).collect(),
        "--preset selects one",
    );
    note(
        fixed.len(),
        false,
        "kinds of support",
        vec!["free".to_owned(), "fixed".to_owned()],
        "--collection selects one",
    );
    let version = |physics: &Option<u32>| physics.map_or_else(|| "unknown".to_owned(), |version| version.to_string());
    note(
        physics.len(),
        query.physics.is_some(),
        "versions of the physics",
        physics.iter().map(version).collect(),
        "--physics selects one",
    );
    let ids = |ids: &&[i64]| ids.iter().map(i64::to_string).collect::<Vec<_>>().join("+");
    note(
        calibrations.len(),
        !query.calibrations.is_empty(),
        "sets of calibrations",
        calibrations.iter().map(ids).collect(),
        "--calibration selects one",
    );

    let object = match (fixed.len(), fixed.contains(&true)) {
        (0, _) => "recorded",
        (1, true) => "fixed",
        (1, false) => "free",
        _ => "free and fixed",
    };
    let only =
        |set: &BTreeSet<Option<&str>>| set.first().copied().flatten().filter(|_| set.len() == 1).map(str::to_owned);
    let seen = !simulated.is_empty();
    DataCard {
        collections: distinct.into_iter().flatten().cloned().collect(),
        preset: only(&presets),
        object: object.to_owned(),
        grasps: rows.len(),
        layout: seen.then(|| view.layout.to_ascii_uppercase()),
        sensors: seen.then(|| view.sensors.name().to_owned()),
        signals: seen.then(|| view.signals.name().to_owned()),
        rate_hz: view.rate_hz,
        cut: (view.cut != Cut::default()).then(|| view.cut.to_string()),
        left_out: left_out_for.values().sum(),
        left_out_for,
        query: asked.to_owned(),
        mixed,
        physics: physics.first().copied().flatten().filter(|_| physics.len() == 1),
        calibrations: calibrations.into_iter().flatten().copied().collect::<BTreeSet<i64>>().into_iter().collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
