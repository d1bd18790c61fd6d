//! The same seed gives the same bytes: on repeat, in one thread and in two, in this process and in another. Ids and
//! dates are what differs between two trials, and are left out.

use crate::program::palpate;
use palpate_exchange::{write_contacts_csv, write_trial_csv};
use palpate_lab::grasping::grasp;
use palpate_sim::poses::jittered;
use palpate_sim::scene::Scene;
use palpate_store::{Store, encode_frames};
use palpate_tactile::trial::{SimulatedData, SimulatedTrial};
use palpate_tactile::{SensorLayout, Sensors, SignalDefinition};
use std::path::Path;

/// A mesh that is baked in parallel, a union of primitives, and a primitive.
const OBJECTS: [&str; 3] = ["lemon", "case", "cube"];
const SEED: u64 = 7;

fn jittered_grasp(name: &str, seed: u64) -> (Scene, SimulatedTrial) {
    let mut scene = Scene::default();
    name.clone_into(&mut scene.object.source);
    let object = scene.load_object().unwrap();
    let (scene, _) = jittered(&scene, object.as_ref(), seed);
    let trial = grasp(&scene, object.as_ref(), seed);
    (scene, trial)
}

/// Everything of a grasp that lands on a disk.
#[derive(PartialEq, Eq)]
struct Bytes {
    blob: Vec<u8>,
    csv: Vec<u8>,
    contacts: Vec<u8>,
    info: String,
}

fn bytes_of(name: &str, seed: u64) -> Bytes {
    let (scene, trial) = jittered_grasp(name, seed);
    let folder = tempfile::tempdir().unwrap();
    let (csv, contacts) = (folder.path().join("a.csv"), folder.path().join("a.contacts.csv"));
    let layout = SensorLayout::named("C6+F").unwrap();
    let sensors = Sensors::new(&layout, &scene.gripper, SignalDefinition::Contact).unwrap();
    write_trial_csv(&csv, &trial, &scene, &sensors).unwrap();
    write_contacts_csv(&contacts, &trial, &scene).unwrap();
    Bytes {
        blob: encode_frames(trial.frames()),
        csv: std::fs::read(csv).unwrap(),
        contacts: std::fs::read(contacts).unwrap(),
        info: {
            let SimulatedData { world_from_gripper, plan, quality, .. } = &trial.data;
            format!("{:?}", (&trial.header, world_from_gripper, plan, quality))
        },
    }
}

#[test]
fn repeats_are_identical_in_one_thread_and_in_two() {
    let once: Vec<Bytes> = OBJECTS.iter().map(|name| bytes_of(name, SEED)).collect();
    let again: Vec<Bytes> = OBJECTS.iter().map(|name| bytes_of(name, SEED)).collect();
    let [forth, back] = std::thread::scope(|scope| {
        let forth = scope.spawn(|| OBJECTS.iter().map(|name| bytes_of(name, SEED)).collect::<Vec<_>>());
        let back = scope.spawn(|| OBJECTS.iter().rev().map(|name| bytes_of(name, SEED)).collect::<Vec<_>>());
        [forth, back].map(|thread| thread.join().unwrap())
    });
    for (k, name) in OBJECTS.iter().enumerate() {
        assert!(once[k] == again[k], "{name} differs on repeat");
        assert!(once[k] == forth[k] && once[k] == back[OBJECTS.len() - 1 - k], "{name} differs in two threads");
    }
    assert!(once[0] != bytes_of(OBJECTS[0], SEED + 1), "another seed is another grasp");
}

/// The program's own files, with loading confined to `threads` threads.
fn bytes_of_the_program(folder: &Path, name: &str, threads: u32) -> Vec<Vec<u8>> {
    let csv = folder.join(format!("{name}{threads}.csv"));
    let store = folder.join(format!("{name}{threads}.sqlite"));
    let seed = SEED.to_string();
    let mut command = palpate(&store);
    command.args(["grasp", name, "--seed", &seed, "--layout", "C6+F", "--signals", "contact", "--out"]).arg(&csv);
    assert!(command.env("RAYON_NUM_THREADS", threads.to_string()).status().unwrap().success());
    let stored = Store::open(&store).unwrap().load(1).unwrap();
    vec![
        std::fs::read(&csv).unwrap(),
        std::fs::read(csv.with_extension("contacts.csv")).unwrap(),
        encode_frames(stored.frames()),
        stored.header.scene.to_toml().into_bytes(),
    ]
}

#[test]
fn the_program_writes_the_same_bytes_whatever_its_threads() {
    let folder = tempfile::tempdir().unwrap();
    for name in OBJECTS {
        let [one, two] = [1, 2].map(|threads| bytes_of_the_program(folder.path(), name, threads));
        assert!(one == two, "{name} differs between one thread and two");
        let here = bytes_of(name, SEED);
        assert!(one[0] == here.csv && one[2] == here.blob, "{name} differs between the program and this one");
    }
}
