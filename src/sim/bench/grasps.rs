//! Cost of a grasp in the simulator alone: `cargo run --release -p palpate-sim --no-default-features --features bench`.
//!
//! Built without rapier. Columns: CPU time of one trial on one thread (ms, the least of the
//! runs), minimisations, CPU time per minimisation (µs). Arguments: names of scenes and accuracies select rows;
//! `--runs N`; `--against PROGRAM` interleaves the runs with those of another build of this benchmark and adds the ratio.

use glam::DVec3;
use palpate_geometry::Primitive;
use palpate_sim::objects::ObjectModel;
use palpate_sim::run::SimRun;
use palpate_sim::scene::Scene;
use std::io::Write;
use std::process::Command;

/// Names of the scenes. The lemon is a baked mesh, the syringe a union of solids; an empty hand presses finger on finger.
const SCENES: [&str; 8] = ["fixed_ball", "ball", "fixed_box", "box", "cylinder", "lemon", "syringe", "empty"];

fn scene(name: &str) -> (Scene, Option<ObjectModel>) {
    let mut scene = Scene::default();
    let (kind, fixed) = name.strip_prefix("fixed_").map_or((name, false), |kind| (kind, true));
    scene.object.fixed = fixed;
    let shape = match kind {
        "empty" => return (scene, None),
        "ball" => Primitive::Sphere { radius: 0.025 },
        "box" => Primitive::Cuboid { half: DVec3::splat(0.020) },
        "cylinder" => Primitive::Cylinder { radius: 0.0175, half_length: 0.030 },
        other => {
            other.clone_into(&mut scene.object.source);
            let object = scene.load_object().unwrap_or_else(|cause| panic!("{other}: {cause}"));
            return (scene, object);
        }
    };
    (scene, Some(ObjectModel::from_primitive(kind, shape, 400.0, 0.6)))
}

/// CPU time of a trial (s) and its minimisations.
fn grasp(scene: &Scene, object: Option<&ObjectModel>) -> (f64, u64) {
    let (mut run, _) = SimRun::new(scene, object);
    let start = cpu_time::ThreadTime::now();
    if let Err(cause) = run.run_programme(&scene.programme) {
        panic!("{cause}");
    }
    (start.elapsed().as_secs_f64(), run.quality().solves)
}

/// CPU time (s) of the same row in another build.
fn elsewhere(program: &str, scene: &str, accuracy: &str) -> f64 {
    let output = Command::new(program).args(["--once", scene, accuracy]).output();
    let output = output.unwrap_or_else(|cause| panic!("{program}: {cause}"));
    let text = String::from_utf8_lossy(&output.stdout);
    text.trim().parse().unwrap_or_else(|cause| panic!("{program}: {cause} in {text:?}"))
}

fn main() -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut take = |name: &str, count: usize| -> Option<Vec<String>> {
        let at = arguments.iter().position(|a| a == name)?;
        let taken: Vec<String> = arguments.drain(at..arguments.len().min(at + 1 + count)).skip(1).collect();
        assert_eq!(taken.len(), count, "{name} takes {count} value(s)");
        Some(taken)
    };
    if let Some(row) = take("--once", 2) {
        let (mut scene, object) = scene(&row[0]);
        scene.solver.accuracy = row[1].parse().expect("an accuracy");
        let least = (0..3).map(|_| grasp(&scene, object.as_ref()).0).fold(f64::INFINITY, f64::min);
        return writeln!(out, "{least}");
    }
    let runs = take("--runs", 1).map_or(5, |n| n[0].parse().expect("a number of runs"));
    let other = take("--against", 1).map(|program| program[0].clone());
    let (scenes, accuracies): (Vec<_>, Vec<_>) =
        arguments.iter().map(String::as_str).partition(|name| SCENES.contains(name));
    let scenes = if scenes.is_empty() { SCENES.to_vec() } else { scenes };
    let accuracies = if accuracies.is_empty() { vec!["draft", "standard"] } else { accuracies };
    writeln!(
        out,
        "scene       accuracy     CPU ms  solves  us/solve{}",
        if other.is_some() { "   ratio" } else { "" }
    )?;
    for name in scenes {
        let (mut scene, object) = scene(name);
        for accuracy in &accuracies {
            scene.solver.accuracy = accuracy.parse().unwrap_or_else(|cause| panic!("{accuracy}: {cause}"));
            let (mut least, mut theirs, mut solves) = (f64::INFINITY, f64::INFINITY, 0);
            for _ in 0..runs {
                if let Some(program) = &other {
                    theirs = theirs.min(elsewhere(program, name, accuracy));
                }
                let (cpu, count) = grasp(&scene, object.as_ref());
                (least, solves) = (least.min(cpu), count);
            }
            let us = least * 1e6 / solves.max(1) as f64;
            write!(out, "{name:11} {accuracy:10} {:8.2} {solves:7} {us:9.2}", least * 1e3)?;
            if theirs.is_finite() {
                write!(out, "{:8.2}", theirs / least)?;
            }
            writeln!(out)?;
        }
    }
    Ok(())
}
