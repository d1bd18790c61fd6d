//! Simulates a grasp of an object and writes its samples: `cargo run --release -p palpate-exchange --example grasp_to_csv -- lemon`.

#![expect(clippy::print_stdout, reason = "an example that says what it did")]

use palpate_exchange::write_trial_csv;
use palpate_lab::grasping::{GraspSummary, grasp};
use palpate_sim::scene::Scene;
use palpate_tactile::{Sensors, SignalDefinition};
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut scene = Scene::default();
    scene.object.source = std::env::args().nth(1).unwrap_or_else(|| "lemon".to_owned());
    let object = scene.load_object()?;
    let trial = grasp(&scene, object.as_ref(), 0);
    let summary = GraspSummary::new(&trial, &scene);
    let sensors = Sensors::whole_fingers(&scene.gripper, SignalDefinition::Parts);
    write_trial_csv(Path::new("grasp.csv"), &trial, &scene, &sensors)?;
    let touch = summary.contact_onset_s.map_or("never".to_owned(), |t_s| format!("at {t_s:.2} s"));
    println!("{} samples in grasp.csv, first touch {touch}", trial.frames().len());
    Ok(())
}
