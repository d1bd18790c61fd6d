//! Palpate against other engines on the same scenes. What the others found is stored under `tests/peers/results`, with
//! the scripts that made it one folder up; no Python runs here.

use palpate_lab::grasping::grasp;
use palpate_sim::frame::Frame;
use palpate_sim::gripper::{BentFinger, Side};
use palpate_sim::scene::Scene;
use palpate_tactile::trial::SimulatedTrial;
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peers")
}

/// A stored row: time (s), joint angles of the left finger (rad), force on it (N).
struct Row {
    t: f64,
    q: Vec<f64>,
    force: f64,
}

fn stored(name: &str) -> Vec<Row> {
    let text = std::fs::read_to_string(folder().join(format!("results/{name}.csv"))).unwrap();
    let numbers = |line: &str| line.split(',').map(|field| field.parse().unwrap()).collect::<Vec<f64>>();
    let rows = text.lines().skip(1).map(numbers);
    rows.map(|row| Row { t: row[0], q: row[1..11].to_vec(), force: row[11] }).collect()
}

fn palpate(scene: &str) -> (Scene, SimulatedTrial) {
    let mut scene = Scene::from_file(&folder().join(format!("scenes/{scene}.toml"))).unwrap();
    scene.solver.accuracy = "1e-6".parse().unwrap();
    let object = scene.load_object().unwrap();
    let trial = grasp(&scene, object.as_ref(), 0);
    assert!(trial.data.quality.finite && trial.data.quality.converged);
    (scene, trial)
}

/// Horizontal force on the left finger (N).
fn squeeze(scene: &Scene, frame: &Frame) -> f64 {
    let (grid, finger) = (scene.gripper.taxels(), &scene.gripper.finger);
    let bent = BentFinger::new(finger, frame.joints(Side::Left));
    let across = |(taxel, load): (usize, palpate_sim::frame::TaxelLoad)| {
        let along = bent.segments[grid.place(taxel, finger).0].along;
        f64::from(load.normal) * along.y - f64::from(load.along) * along.x
    };
    frame.loads(Side::Left, grid.count()).map(across).sum()
}

/// Root mean square over joints between two peers, row by row (degrees).
fn between(one: &[Row], other: &[Row]) -> f64 {
    let squares = one.iter().zip(other).flat_map(|(a, b)| a.q.iter().zip(&b.q).map(|(a, b)| (a - b).powi(2)));
    (squares.sum::<f64>() / (10 * one.len()) as f64).sqrt().to_degrees()
}

/// Root mean square over joints and rows (degrees); `later` is by how much the peer's clock is late (s).
fn apart(trial: &SimulatedTrial, peer: &[Row], later: f64) -> f64 {
    let mut squares = Vec::new();
    for row in peer.iter().filter(|row| row.t - later > 0.02) {
        let near = |frame: &&Frame| (frame.t - (row.t - later)).abs() < 0.5 / 75.0;
        let Some(frame) = trial.frames().iter().find(near) else { continue };
        squares.extend(frame.joints(Side::Left).iter().zip(&row.q).map(|(a, b)| (a - b).powi(2)));
    }
    assert!(squares.len() > 500);
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt().to_degrees()
}

fn row_at(rows: &[Row], t: f64) -> &Row {
    rows.iter().find(|row| (row.t - t).abs() < 0.01).unwrap()
}

fn frame_at(trial: &SimulatedTrial, t: f64) -> &Frame {
    trial.frames().iter().find(|frame| (frame.t - t).abs() < 0.5 / 75.0).unwrap()
}

/// A time at which the grasp has long been at rest and a row is stored (s).
const HELD: f64 = 2.933_333;

#[test]
fn a_free_bend_is_that_of_mujoco_and_of_the_formula() {
    let (scene, trial) = palpate("free_bend");
    let formula = (0.06 / scene.gripper.finger.joint_stiffness()).to_degrees();
    let held = frame_at(&trial, HELD).joints(Side::Left);
    for peer in ["mujoco_free_bend", "scipy_free_bend"] {
        let rows = stored(peer);
        for (ours, theirs) in held.iter().zip(&row_at(&rows, HELD).q) {
            assert!((ours - theirs).abs().to_degrees() < 0.01, "{peer}: {ours} against {theirs} rad");
            assert!((ours.to_degrees() - formula).abs() < 0.01);
        }
        let apart = apart(&trial, &rows, 0.0);
        assert!(apart < 0.01, "{peer}: {apart} degrees over the whole motion");
    }
}

#[test]
fn balls_are_held_as_mujoco_and_scipy_hold_them() {
    for name in ["fixed_sphere", "free_sphere"] {
        let (scene, trial) = palpate(name);
        let ours = squeeze(&scene, frame_at(&trial, HELD));
        let [scipy, mujoco] = ["scipy", "mujoco"].map(|peer| stored(&format!("{peer}_{name}")));
        for (rows, most) in [(&scipy, 0.001), (&mujoco, 0.025)] {
            let theirs = row_at(rows, HELD).force;
            assert!((ours / theirs - 1.0).abs() < most, "{name}: {ours} N, the other {theirs} N");
        }
        // SciPy solves the same equations. MuJoCo's contact stiffness changes with the pose: it cannot be nearer to us than
        // it is to SciPy.
        let from_scipy = apart(&trial, &scipy, 0.0);
        assert!(from_scipy < 0.004, "{name}: {from_scipy} degrees from SciPy");
        let (from_mujoco, its_own) = (apart(&trial, &mujoco, 0.0), between(&mujoco, &scipy));
        assert!(its_own < 0.04 && from_mujoco < its_own + 0.004, "{name}: {from_mujoco} degrees, {its_own} its own");
    }
}

#[test]
fn a_fixed_ball_is_held_as_somo_holds_it() {
    let (scene, trial) = palpate("somo_sphere_fixed");
    // SoMo's programme runs one tick later; its force is the sum of the normal forces of its links.
    let rows = stored("somo_sphere_fixed");
    let theirs = row_at(&rows, 2.4).force;
    let ours = frame_at(&trial, 2.3).normal_force(Side::Left, scene.gripper.taxels().count());
    assert!((ours / theirs - 1.0).abs() < 0.05, "{ours} N, SoMo {theirs} N");
    let apart = apart(&trial, &rows, 0.1);
    assert!(apart < 0.2, "{apart} degrees");
}
