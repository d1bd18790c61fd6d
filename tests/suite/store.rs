//! The store when things go wrong around it: killed programs, two programs at once, files that are no stores.

use crate::program::{json, palpate, refused, run};
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
fn a_store_of_before_the_first_release_is_refused_with_the_commit_that_converts_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("trials.sqlite");
    let mut older = include_bytes!("data/store.sqlite").to_vec();
    // SQLite's `user_version`.
    older[60..64].copy_from_slice(&14_u32.to_be_bytes());
    std::fs::write(&path, &older).unwrap();
    refused(folder.path(), &["trials", "list"], &["earlier development version", "git checkout 29b20e5"]);
    assert!(std::fs::read(&path).unwrap() == older, "it is left alone");
}

#[test]
fn a_store_made_earlier_is_listed_and_exported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("trials.sqlite");
    std::fs::write(&path, include_bytes!("data/store.sqlite")).unwrap();
    let list = run(folder.path(), &["trials", "list"]);
    assert_eq!((list.code, list.err.as_str()), (Some(0), ""), "{list:?}");
    for row in ["Lemon", "Mug", "Rubber ball (ball)", "slipped a little", "[wet, late]", "unsure"] {
        assert!(list.out.contains(row), "no {row}: {list:?}");
    }
    let export = run(folder.path(), &["trials", "export", "1", "2", "4", "5", "--out", "out"]);
    assert_eq!(export.code, Some(0), "{export:?}");
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

/// Changes a text in a file to another of the same length, wherever it stands.
fn overwrite(path: &Path, from: &str, to: &str) {
    assert_eq!(from.len(), to.len());
    let mut bytes = std::fs::read(path).unwrap();
    let found: Vec<usize> =
        (0..bytes.len() - from.len()).filter(|at| bytes[*at..].starts_with(from.as_bytes())).collect();
    assert!(!found.is_empty());
    found.iter().for_each(|at| bytes[*at..*at + to.len()].copy_from_slice(to.as_bytes()));
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn a_damaged_trial_is_listed_as_such_and_holds_up_no_other() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for object in ["lemon", "ball"] {
        assert_eq!(run(at, &["grasp", object]).code, Some(0));
    }
    let created = json(at, &["trials", "list", "--json"])[0]["created"].as_str().unwrap().to_owned();
    overwrite(&at.join("trials.sqlite"), &created, &created.replace('T', "#"));
    let list = run(at, &["trials", "list"]);
    assert_eq!((list.code, list.out.lines().count()), (Some(0), 3), "{list:?}");
    let damaged = list.out.lines().nth(1).unwrap();
    assert!(damaged.contains("damaged") && damaged.contains("palpate trials delete 1"), "{list:?}");
    assert_eq!(json(at, &["trials", "list", "--json", "--quality", "damaged"])[0]["id"], 1);
    refused(at, &["trials", "show", "1"], &["trial 1", "palpate trials delete 1"]);
    let export = run(at, &["trials", "export", "1", "2", "--out", "csv"]);
    assert_eq!((export.code, at.join("csv/trial_2_ball.csv").is_file()), (Some(0), true), "{export:?}");
    assert!(export.err.contains("trial 1 is damaged") && !at.join("csv/trial_1_lemon.csv").exists(), "{export:?}");
    assert_eq!(run(at, &["recognise", "2"]).code, Some(0));
    let merged = run(at, &["trials", "merge", "trials.sqlite", "--store", "all.sqlite"]);
    assert!(merged.out.contains("1 trial(s) added, 0 already there"), "{merged:?}");
    assert!(merged.err.contains("left out because damaged: trial 1;"), "{merged:?}");
    assert_eq!(run(at, &["trials", "delete", "1"]).code, Some(0));
    assert_eq!(run(at, &["trials", "list"]).out.lines().count(), 2);
}

#[test]
fn every_store_name_is_the_name_of_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for name in [":memory:", "file:real.sqlite", "file:x?mode=memory"] {
        let ran = run(at, &["grasp", "ball", "--store", name]);
        assert!(ran.code == Some(0) && ran.out.contains("trial 1"), "{name}: {ran:?}");
        assert!(at.join(name).is_file(), "{name}");
        assert_eq!(json(at, &["trials", "list", "--json", "--store", name]).as_array().unwrap().len(), 1);
    }
    std::fs::write(at.join("empty.sqlite"), "").unwrap();
    assert!(run(at, &["trials", "list", "--store", "empty.sqlite"]).out.contains("no trials yet"));
    assert_eq!(std::fs::metadata(at.join("empty.sqlite")).unwrap().len(), 0, "not made a store by a look");
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("loop.sqlite", at.join("loop.sqlite")).unwrap();
        refused(at, &["trials", "list", "--store", "loop.sqlite"], &["cannot open the store", "loop.sqlite"]);
    }
}

#[cfg(unix)]
#[test]
fn a_collection_whose_store_is_deleted_does_not_say_that_it_is_stored() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("set.sqlite");
    let mut command = palpate(&path);
    command.args(["collect", "--objects", "ball", "--trials", "100000", "--threads", "1"]);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let begun = || path.is_file() && Store::open(&path).is_ok_and(|store| !store.list(true).unwrap().is_empty());
    while !begun() {
        std::thread::sleep(Duration::from_millis(20));
    }
    std::fs::remove_file(&path).unwrap();
    let ran = crate::program::ran(&child.wait_with_output().unwrap());
    assert!(ran.code == Some(1) && ran.err.contains("was deleted or moved while it was open"), "{ran:?}");
    assert!(!ran.err.contains("are kept") && !path.exists(), "{ran:?}");
}

#[test]
fn a_replay_of_damaged_bytes_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("passwd.txt"), "root:x:0:0:root:/root:/bin/bash\n").unwrap();
    refused(at, &["replay", "passwd.txt"], &["has no reading"]);
    let mut bytes = b"PPB1".to_vec();
    for k in 0..80u32 {
        let line = format!("t_us:{},seq:{k},flexL:2000,flexR:2100,fsrL:10,fsrR:0\n", 20_000 * k);
        let arrived_s = 0.02 * f64::from(k);
        palpate_tactile::capture::Captured::Bytes { arrived_s, bytes: line.into_bytes() }.write(&mut bytes).unwrap();
    }
    std::fs::write(at.join("cut.bytes"), &bytes[..bytes.len() - 9]).unwrap();
    let ran = run(at, &["replay", "cut.bytes", "--speed", "0"]);
    // The first line only tells the format, and the last one is cut.
    assert_eq!((ran.code, ran.out.lines().count()), (Some(1), 79), "{ran:?}");
    assert!(ran.err.contains("after 78 readings") && ran.err.contains("end within a record"), "{ran:?}");
    let ran = run(at, &["record", "--port", "cut.bytes", "--speed", "0"]);
    assert_eq!(ran.code, Some(1), "{ran:?}");
    assert!(ran.err.contains("end within a record"), "{ran:?}");
    let store = Store::open(&at.join("trials.sqlite")).unwrap();
    assert_eq!(store.list(false).unwrap()[0].samples, 78);
}
