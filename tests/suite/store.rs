//! The store when things go wrong around it: killed programs, two programs at once, files that are no stores.

use crate::program::{palpate, run};
use palpate_lab::grasping::grasp;
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::Scene;
use palpate_store::Store;
use palpate_tactile::trial::Trial;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::Duration;

/// Starts grasping a hundred times, without pictures, and waits until the first trials are told of. The reader has to be
/// kept, or the program ends by itself.
fn busy_program(store: &Path, after_lines: usize) -> (Child, impl Sized) {
    let mut command = palpate(store);
    let folder = store.parent().unwrap();
    command
        .args([
            "demo",
            "--object",
            "ball",
            "--seed",
            "1",
            "--grasps",
            "100",
            "--threshold",
            "1",
            "--no-pictures",
            "--out",
        ])
        .arg(folder);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    assert_eq!(lines.by_ref().take(after_lines).filter(Result::is_ok).count(), after_lines);
    (child, lines)
}

#[test]
fn a_kill_at_any_moment_leaves_whole_trials() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = Scene::default();
    "ball".clone_into(&mut scene.object.source);
    let ball = scene.load_object().unwrap();
    for round in 0..12 {
        let path = folder.path().join(format!("{round}.sqlite"));
        let (mut child, _reader) = busy_program(&path, 8 + 3 * round as usize);
        // Anywhere between two lines: while grasping, or while writing.
        std::thread::sleep(Duration::from_millis(round * 7 % 31));
        child.kill().unwrap();
        child.wait().unwrap();
        let mut store = Store::open(&path).unwrap();
        let rows = store.list(true).unwrap();
        assert!(!rows.is_empty(), "it was killed before its first trial");
        for row in &rows {
            let trial = store.load(row.id).unwrap();
            assert_eq!((row.state.as_str(), trial.frames().len()), ("complete", 300));
            assert!(trial == regrasped(&trial, ball.as_ref()), "trial {} is not what was grasped", row.id);
        }
        // The store goes on working for the next program.
        let more = grasp(&scene, ball.as_ref(), 0);
        assert_eq!(store.insert(&more).unwrap().id(), rows.len() as i64 + 1);
    }
}

/// The same grasp once more, from what the trial says of itself.
fn regrasped(trial: &Trial, object: Option<&ObjectModel>) -> Trial {
    grasp(&trial.header.scene, object, trial.header.seed).into()
}

#[test]
fn a_recording_cut_short_keeps_its_chunks_and_harms_no_other_trial() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("live.sqlite");
    let mut scene = Scene::default();
    "cube".clone_into(&mut scene.object.source);
    let trial = grasp(&scene, scene.load_object().unwrap().as_ref(), 0);
    let mut store = Store::open(&path).unwrap();
    store.insert(&trial).unwrap();
    let cut = store.begin(&trial).unwrap();
    for chunk in trial.frames().chunks(75).take(3) {
        store.append(cut, chunk).unwrap();
    }
    // What a power cut would leave: the files as they are, while they are in use.
    let left = folder.path().join("left.sqlite");
    for suffix in ["", "-wal"] {
        let with = |path: &Path| format!("{}{suffix}", path.display());
        std::fs::copy(with(&path), with(&left)).unwrap();
    }
    let found = Store::open(&left).unwrap();
    assert!(*found.load(cut).unwrap().frames() == trial.frames()[..225]);
    assert!(found.load(1).unwrap() == trial.into());
    let states: Vec<String> = found.list(false).unwrap().into_iter().map(|row| row.state).collect();
    assert_eq!(states, ["complete", "recording"]);
}

#[test]
fn two_programs_record_into_one_store() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shared.sqlite");
    let grasps = |object: &str| {
        let mut command = palpate(&path);
        command.args([
            "demo",
            "--object",
            object,
            "--seed",
            "1",
            "--grasps",
            "6",
            "--threshold",
            "1",
            "--no-pictures",
            "--json",
        ]);
        command.stdout(Stdio::null()).spawn().unwrap()
    };
    let (mut first, mut second) = (grasps("ball"), grasps("cube"));
    assert!(first.wait().unwrap().success() && second.wait().unwrap().success());
    let store = Store::open(&path).unwrap();
    let rows = store.list(false).unwrap();
    let of = |object: &str| rows.iter().filter(|row| row.object == object && row.state == "complete").count();
    assert_eq!((of("ball"), of("cube")), (6, 6));
    assert!(rows.iter().all(|row| store.load(row.id).is_ok_and(|trial| trial.frames().len() == 300)));
}

#[test]
fn what_is_no_store_is_refused_and_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("trials.sqlite");
    for text in ["just some notes", "SQLite format 3\0 but cut short"] {
        std::fs::write(&path, text).unwrap();
        let ran = run(folder.path(), &["grasp", "ball"]);
        assert_eq!(ran.code, Some(1), "{ran:?}");
        assert!(ran.err.starts_with("error: ") && ran.err.contains("trials.sqlite"), "{ran:?}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
    }
    let ran = run(folder.path(), &["grasp", "ball", "--store", "/proc/nowhere/trials.sqlite"]);
    assert_eq!(ran.code, Some(1));
    assert!(ran.err.contains("there is no folder \"/proc/nowhere\""), "{ran:?}");
}

#[test]
fn a_store_of_version_0_1_0_is_copied_updated_listed_and_exported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("trials.sqlite");
    std::fs::write(&path, include_bytes!("data/store_0_1.sqlite")).unwrap();
    let list = run(folder.path(), &["trials", "list"]);
    assert_eq!(list.code, Some(0), "{list:?}");
    assert!(
        list.err.contains("trials.before-v") && folder.path().join("trials.before-v14.sqlite").is_file(),
        "{list:?}"
    );
    for row in ["Lemon", "mug", "Rubber ball (ball)", "slipped a little", "[wet, late]", "unsure"] {
        assert!(list.out.contains(row), "no {row}: {list:?}");
    }
    let export = run(folder.path(), &["trials", "export", "1", "2", "4", "5", "--out", "out"]);
    assert_eq!((export.code, export.err.contains("before-v")), (Some(0), false), "{export:?}");
    let read = |name: &str| std::fs::read_to_string(folder.path().join("out").join(name)).unwrap();
    assert_eq!(
        read("trial_2_mug.csv"),
        "t_s,pressure_left,pressure_right\n0,102.5,99.1\n0.02,103,99.4\n0.04,103,100.25\n"
    );
    assert_eq!(
        (read("trial_1_lemon.csv").lines().count(), read("trial_1_lemon.contacts.csv").lines().count()),
        (91, 166)
    );
    let row = "1.1599999999999997,1.1610256049999998,84,,1687.8,1618.1,842.3,946.1,0.6,close";
    assert_eq!(read("trial_4_lemon.csv").lines().nth(59), Some(row));
    assert_eq!(std::fs::metadata(folder.path().join("out/trial_4_lemon.bytes")).unwrap().len(), 17_083);
}
