//! CSV for spreadsheets, pandas and plotting tools: one row per sample, units in the header, time first, no byte-order
//! mark. A second file lists every loaded taxel with its place in the world.
//!
//! Columns: `t_s`, `line_pressure (bar)`, `command` (close, hold or release), the channels of a sensor layout, joint angles,
//! joint positions in the world frame (as the paper stores them, section IV-A), the object's pose, and where fingers leave
//! their planes the sideways curvature at the palm and the twist of each. Joints are numbered from 1 at the palm.

use super::writing::{number, write_file};
use crate::format::ExchangeError;
use crate::taxels::{LoadedTaxel, Taxels};
use palpate_sim::frame::Frame;
use palpate_sim::gripper::{Side, Sway};
use palpate_sim::scene::Scene;
use palpate_store::FileKind;
use palpate_tactile::Sensors;
use palpate_tactile::trial::SimulatedTrial;
use std::path::{Path, PathBuf};

/// Path of the file with the contacts, beside a trial's file: `trial.csv` has `trial.contacts.csv`.
pub fn contacts_path(path: &Path) -> PathBuf {
    path.with_extension("contacts.csv")
}

/// Writes one row per sample.
pub fn write_trial_csv(
    path: &Path,
    trial: &SimulatedTrial,
    scene: &Scene,
    sensors: &Sensors,
) -> Result<(), ExchangeError> {
    write_file(path, FileKind::Csv, |out| {
        let sway = trial.frames().iter().any(|frame| frame.sways != [Sway::NONE; 2]);
        out.write_record(header(scene, sensors, trial, sway))?;
        for frame in trial.frames() {
            out.write_record(row(frame, trial, (scene, sensors), sway))?;
        }
        Ok(())
    })
}

/// Writes one row per loaded taxel and sample: its position in the world and the force on it.
pub fn write_contacts_csv(path: &Path, trial: &SimulatedTrial, scene: &Scene) -> Result<(), ExchangeError> {
    let header = [
        "t_s",
        "finger",
        "segment",
        "taxel",
        "x [m]",
        "y [m]",
        "z [m]",
        "normal_force [N]",
        "shear_along [N]",
        "shear_across [N]",
    ];
    let taxels = Taxels::of(&scene.gripper);
    write_file(path, FileKind::Contacts, |out| {
        out.write_record(header)?;
        for frame in trial.frames() {
            let world_from_gripper = frame.world_from_gripper(&trial.data.world_from_gripper);
            for side in Side::BOTH {
                for LoadedTaxel { segment, taxel, load, place, .. } in taxels.loaded(frame, side) {
                    let mut record = vec![number(frame.t), side.name().to_owned()];
                    record.extend([segment, taxel].map(|n| n.to_string()));
                    record.extend(world_from_gripper.point(place).to_array().map(number));
                    record.extend([load.normal, load.along, load.across].map(|f| f.to_string()));
                    out.write_record(record)?;
                }
            }
        }
        Ok(())
    })
}

/// `sway` adds the shapes of fingers that leave their planes.
fn header(scene: &Scene, sensors: &Sensors, trial: &SimulatedTrial, sway: bool) -> Vec<String> {
    let mut names = vec!["t_s".to_owned(), "line_pressure [bar]".to_owned(), "command".to_owned()];
    names.extend(sensors.channels().iter().map(|c| format!("{} [{}]", c.name(), c.quantity.unit())));
    let joints = || Side::BOTH.into_iter().flat_map(|side| (1..=scene.gripper.finger.joints).map(move |j| (side, j)));
    names.extend(joints().map(|(side, j)| format!("q_{}_{j} [rad]", side.name())));
    for (side, j) in joints() {
        names.extend(["x", "y", "z"].map(|axis| format!("joint_{}_{j}_{axis} [m]", side.name())));
    }
    if trial.frames().first().is_some_and(|f| f.world_from_object.is_some()) {
        names.extend(["x", "y", "z"].map(|axis| format!("object_{axis} [m]")));
        names.extend(["qx", "qy", "qz", "qw"].map(|part| format!("object_{part}")));
    }
    if sway {
        let shapes = |side: Side| {
            [format!("sideways_{}_curvature [1/m]", side.name()), format!("twist_{} [rad/m]", side.name())]
        };
        names.extend(Side::BOTH.into_iter().flat_map(shapes));
    }
    names
}

/// `sway` adds the shapes of fingers that leave their planes.
fn row(frame: &Frame, trial: &SimulatedTrial, (scene, sensors): (&Scene, &Sensors), sway: bool) -> Vec<String> {
    let mut fields = vec![number(frame.t), number(frame.line_bar), frame.phase.name().to_owned()];
    // An undefined pressure is an empty field.
    fields.extend(sensors.read(frame).into_iter().map(|v| v.map(number).unwrap_or_default()));
    fields.extend(frame.q.iter().copied().map(number));
    for side in Side::BOTH {
        let placed = frame.placed(&scene.gripper, side);
        let world_from_gripper = frame.world_from_gripper(&trial.data.world_from_gripper);
        let places = placed.joints().map(|p| world_from_gripper.point(p));
        fields.extend(places.flat_map(|p| p.to_array().map(number)));
    }
    if let Some(pose) = frame.world_from_object {
        fields.extend(pose.position.to_array().map(number));
        fields.extend(pose.rotation.to_array().map(number));
    }
    if sway {
        fields.extend(frame.sways.map(Sway::to_array).concat().into_iter().map(number));
    }
    fields
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_geometry::Primitive;
    use palpate_lab::grasping::grasp;
    use palpate_sim::objects::ObjectModel;
    use palpate_tactile::{SensorLayout, SignalDefinition};

    #[test]
    fn rows_match_their_header_and_joints_lie_in_the_world() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("deep/trial.csv");
        let mut scene = Scene::default();
        scene.timing.duration_s = 2.0;
        let ball = ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.02 }, 400.0, 0.6);
        let trial = grasp(&scene, Some(&ball), 0);
        let layout = SensorLayout::named("C5+F").expect("known");
        let sensors = Sensors::new(&layout, &scene.gripper, SignalDefinition::Parts).expect("fits");
        write_trial_csv(&path, &trial, &scene, &sensors).expect("writes");
        write_contacts_csv(&contacts_path(&path), &trial, &scene).expect("writes");

        let mut reader = csv::Reader::from_path(&path).expect("opens");
        let header = reader.headers().expect("has one").clone();
        assert_eq!(&header[0], "t_s");
        let column = |name: &str| header.iter().position(|h| h == name).unwrap_or_else(|| panic!("no {name}"));
        let rows: Vec<csv::StringRecord> = reader.records().collect::<Result<_, _>>().expect("even rows");
        assert_eq!(rows.len(), 150);
        // The first joint of the left finger never moves: 5 mm below the palm, half the opening and the pad away.
        let at = |name: &str| rows[100][column(name)].parse::<f64>().expect("a number");
        let palm = trial.data.world_from_gripper.position.z;
        assert!((at("joint_left_1_x [m]") + scene.gripper.half_gap()).abs() < 1e-12);
        assert!((at("joint_left_1_z [m]") - (palm - 0.005)).abs() < 1e-12);
        assert!(at("curvature_left_distal [1/m]") > 0.0);
        assert!((at("object_z [m]") - 0.07).abs() < 0.02);

        let mut contacts = csv::Reader::from_path(contacts_path(&path)).expect("opens");
        let first = contacts.records().next().expect("the ball was touched").expect("even rows");
        let height: f64 = first[6].parse().expect("a number");
        assert!((height - 0.07).abs() < 0.02, "contact at the height of the ball: {height}");
    }

    #[test]
    fn fingers_that_leave_their_planes_have_columns_and_joints_of_their_own() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut scene = Scene::default();
        scene.timing.duration_s = 1.0;
        let layout = SensorLayout::named("C1").expect("known");
        let sensors = Sensors::new(&layout, &scene.gripper, SignalDefinition::Parts).expect("fits");
        let planar = grasp(&scene, None, 0);
        let mut swayed = planar.clone();
        swayed.data.frames[50].sways[1] = Sway { curvature: 1.5, twist: -0.25 };
        let written = |trial: &SimulatedTrial| {
            let path = folder.path().join("trial.csv");
            write_trial_csv(&path, trial, &scene, &sensors).expect("writes");
            let mut reader = csv::Reader::from_path(&path).expect("opens");
            let header = reader.headers().expect("has one").clone();
            let rows: Vec<csv::StringRecord> = reader.records().collect::<Result<_, _>>().expect("even rows");
            (header, rows)
        };
        let ((planar_header, planar_rows), (header, rows)) = (written(&planar), written(&swayed));
        assert_eq!(header.len(), planar_header.len() + 4);
        let at = |rows: &[csv::StringRecord], row: usize, name: &str| {
            let column = header.iter().position(|h| h == name).unwrap_or_else(|| panic!("no {name}"));
            rows[row][column].parse::<f64>().expect("a number")
        };
        assert_eq!(at(&rows, 50, "sideways_right_curvature [1/m]"), 1.5);
        assert_eq!(at(&rows, 50, "twist_right [rad/m]"), -0.25);
        assert_eq!(at(&rows, 50, "twist_left [rad/m]"), 0.0);
        assert_eq!(at(&rows, 51, "sideways_right_curvature [1/m]"), 0.0);
        // Positive curvature moves the tip along the gripper's y, which is the world's here.
        let moved = |joint: &str| {
            let name = format!("joint_{joint}_y [m]");
            at(&rows, 50, &name) - at(&planar_rows, 50, &name)
        };
        assert!(moved("right_10") > 2e-3 && moved("left_10") == 0.0, "{} {}", moved("right_10"), moved("left_10"));
    }
}
