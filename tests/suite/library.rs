//! The trial library: found, sorted, labelled, tagged, discarded and exported, many trials at once, in the window and on
//! the command line, each of which sees what the other does.

use crate::bench::{Bench, BenchSetup, HANG};
use crate::cpu_renderer::CpuRenderer;
use crate::program::{json, refused, run};
use egui::accesskit::Role;
use egui::{Key, Modifiers, vec2};
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use palpate::app::{ALL_PANELS, Mode, Reach};
use palpate_lab::grasping::grasp;
use palpate_lab::workers::Command;
use palpate_sim::objects::catalogue;
use palpate_sim::scene::Scene;
use palpate_store::labels::TrialEdit;
use palpate_store::{BoardInfo, ImportedTrial, Store, TrialPlace, TrialQuery};
use palpate_tactile::Signals;
use palpate_tactile::trial::{TrialHeader, TrialId};
use std::time::{Duration, Instant};

/// Trials 1 and 2 simulated (lemon, tomato), 3 to 5 recorded (lemon, cube, unlabelled), 6 imported (mug).
fn fill(store: &mut Store) {
    for (seed, name) in [(1, "lemon"), (2, "tomato")] {
        let mut scene = Scene::default();
        name.clone_into(&mut scene.object.source);
        let mut trial = grasp(&scene, scene.load_object().unwrap().as_ref(), seed);
        trial.header.seed = seed;
        store.insert(&trial).unwrap();
    }
    for object in ["lemon", "cube", ""] {
        let id = store.begin_board(&TrialHeader::new(object, Scene::default()), &BoardInfo::default()).unwrap();
        store.finish_board(id, &BoardInfo::default(), &[]).unwrap();
    }
    let signals = Signals { channels: vec!["grip".to_owned()], t_s: vec![0.0, 1.0], values: vec![1.0, 2.0] };
    let (name, label) = ("first".to_owned(), "mug".to_owned());
    store
        .insert_imported("mine", &[ImportedTrial { name, label, size: None, shape: None, session: None, signals }])
        .unwrap();
    store.labels().set_note(3, "slipped at the end").unwrap();
}

fn title(name: &str) -> String {
    catalogue().iter().find(|built_in| built_in.name == name).unwrap().title.clone()
}

#[test]
fn the_terminal_lists_and_changes_what_matches() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fill(&mut Store::open(&at.join("trials.sqlite")).unwrap());
    let list = |filters: &[&str]| -> Vec<i64> {
        let rows = json(at, &[&["trials", "list", "--json"], filters].concat());
        rows.as_array().unwrap().iter().map(|row| row["id"].as_i64().unwrap()).collect()
    };
    assert_eq!(list(&[]), [1, 2, 3, 4, 5, 6]);
    assert_eq!((list(&["--object", "Lemon"]), list(&["--label", "mug"])), (vec![1, 3], vec![6]));
    assert_eq!((list(&["--search", "lemon slipped"]), list(&["--unlabelled"])), (vec![3], vec![5]));
    assert_eq!((list(&["--source", "serial"]), list(&["--collection", "mine"])), (vec![3, 4, 5], vec![6]));
    assert_eq!((list(&["--preset", "m"]), list(&["--sensors", "grip"])), (vec![1, 2], vec![6]));
    assert_eq!((list(&["--until", "yesterday"]), list(&["--since", "today"]).len()), (vec![], 6));
    assert_eq!(list(&["--sort", "object", "--reverse", "--limit", "2"]), [5, 2]);
    assert_eq!(list(&["--quality", "unsound"]), [0i64; 0]);
    let plain = run(at, &["trials", "list", "--search", "tomato", "--limit", "1"]);
    assert!(plain.out.contains("Tomato") && plain.out.lines().count() == 2, "{plain:?}");
    assert!(run(at, &["trials", "list", "--search", "zebra"]).out.contains("no trial matches"));
    for (option, value) in [("--since", "soon"), ("--sort", "colour"), ("--flag", "odd"), ("--quality", "fine")] {
        let ran = run(at, &["trials", "list", option, value]);
        assert!(ran.code == Some(2) && ran.err.contains(value) && ran.err.contains("choose"), "{ran:?}");
    }
    // Many at once, by numbers and by filters; the number of trials is said.
    let said = |arguments: &[&str]| {
        let ran = run(at, arguments);
        assert_eq!(ran.code, Some(0), "{arguments:?}: {ran:?}");
        (ran.out, ran.err)
    };
    let (out, err) = said(&["trials", "tag", "matching", "wet", "late", "--add", "--search", "lemon"]);
    assert!(out.contains("2 trials tagged wet, late") && err.contains("2 trials match"), "{out}{err}");
    assert_eq!((list(&["--tag", "wet"]), list(&["--search", "late"])), (vec![1, 3], vec![1, 3]));
    said(&["trials", "tag", "1-3", "wet", "--remove"]);
    assert_eq!((list(&["--tag", "wet"]), list(&["--tag", "late"])), (vec![], vec![1, 3]));
    assert!(said(&["trials", "undo"]).0.contains("Undone: trials 1, 3: tag \"wet\" removed"));
    assert_eq!(list(&["--tag", "wet"]), [1, 3]);
    // A label leaves simulated and imported trials alone.
    let (out, _) = said(&["trials", "label", "1,3-6", "tomato"]);
    assert!(out.contains("3 trials labelled tomato; 2 are simulated or imported and keep their object"), "{out}");
    assert_eq!(list(&["--object", &title("tomato")]), [2, 3, 4, 5]);
    assert!(said(&["trials", "undo"]).0.contains("trials 3, 4, 5: labelled Tomato"));
    assert_eq!((list(&["--unlabelled"]), list(&["--object", "cube"])), (vec![5], vec![4]));
    refused(at, &["trials", "label", "1,6", "ball"], &["only trials of the real gripper"]);
    said(&["trials", "discard", "2-4", "6"]);
    assert_eq!((list(&[]), list(&["--discarded"])), (vec![1, 5], vec![2, 3, 4, 6]));
    said(&["trials", "undo"]);
    assert_eq!((list(&[]).len(), list(&["--discarded"])), (6, vec![]));
    said(&["trials", "redo"]);
    said(&["trials", "restore", "matching", "--object", "lemon"]);
    assert_eq!(list(&["--deleted"]), [1, 2, 3, 4, 5, 6]);
    assert_eq!(list(&[]), [1, 3, 5]);
    said(&["trials", "export", "matching", "--source", "sim", "--out", "csv"]);
    assert!(at.join("csv/trial_1_lemon.csv").is_file() && !at.join("csv/trial_3_lemon.csv").exists());
    refused(at, &["trials", "delete", "matching"], &["needs a filter"]);
    refused(at, &["trials", "delete", "matching", "--object", "zebra"], &["no trial matches"]);
    assert_eq!(run(at, &["trials", "delete", "9-7"]).code, Some(2));
}

fn library(size: [f32; 2]) -> Bench {
    let panel = ALL_PANELS.iter().find(|panel| panel.name == "library");
    let mut bench = Bench::new(BenchSetup { panel, size, fill, ..BenchSetup::default() }, CpuRenderer::default());
    bench.until_shown(true, "Trial 6, mug");
    bench
}

/// Rows in the order of the list.
fn rows(bench: &Bench) -> Vec<String> {
    let found = bench.harness.query_all_by_label_contains("Trial ");
    let mut rows: Vec<(f32, String)> = found
        .filter(|node| node.accesskit_node().role() == Role::Button)
        .map(|node| (node.rect().top(), node.accesskit_node().label().unwrap_or_default()))
        .filter(|(_, label)| label.starts_with("Trial "))
        .collect();
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    rows.into_iter().map(|(_, label)| label.split(',').next().unwrap_or_default().replace("Trial ", "")).collect()
}

fn until_rows(bench: &mut Bench, wanted: &[&str]) {
    for _ in 0..2000 {
        if rows(bench) == wanted {
            return;
        }
        bench.wait();
    }
    panic!("{:?}, not {wanted:?}; said: {:?}", rows(bench), bench.workbench().messages());
}

#[test]
fn the_panel_finds_sorts_and_selects() {
    for size in [[300.0, 700.0], [900.0, 600.0]] {
        let mut bench = library(size);
        until_rows(&mut bench, &["6", "5", "4", "3", "2", "1"]);
        bench.harness.get_by_label("Search trials").focus();
        bench.harness.step();
        bench.harness.get_by_label("Search trials").type_text("lemon");
        bench.harness.step();
        until_rows(&mut bench, &["3", "1"]);
        bench.until_shown(true, "2 of 6 trials");
        bench.harness.get_by_label("Clear").click();
        bench.harness.step();
        until_rows(&mut bench, &["6", "5", "4", "3", "2", "1"]);
        bench.harness.get_by_label("unlabelled 1").click();
        bench.harness.step();
        until_rows(&mut bench, &["5"]);
        bench.harness.get_by_label("unlabelled 1").click();
        bench.harness.step();
        until_rows(&mut bench, &["6", "5", "4", "3", "2", "1"]);
        bench.harness.get_by_label("yesterday").click();
        bench.until_shown(true, "No trial matches");
        bench.harness.get_by_label("Clear").click();
        bench.harness.step();
        until_rows(&mut bench, &["6", "5", "4", "3", "2", "1"]);
        if size[0] > 500.0 {
            bench.harness.get_by_label("Sort by object").click();
            bench.harness.step();
            until_rows(&mut bench, &["1", "3", "6", "4", "2", "5"]);
            bench.harness.get_by_label("Sort by id").click();
            bench.harness.step();
            until_rows(&mut bench, &["1", "2", "3", "4", "5", "6"]);
        } else {
            bench.harness.get_by_label("Sort").click();
            bench.harness.run_steps(3);
            bench.harness.get_by_label("id").click();
            bench.harness.step();
            until_rows(&mut bench, &["6", "5", "4", "3", "2", "1"]);
        }
        // A click selects one, with Shift all between, with Ctrl one more.
        let row = |bench: &mut Bench, name: &str, modifiers: Modifiers| {
            bench.harness.get_by_label(name).click_modifiers(modifiers);
            bench.harness.run_steps(2);
        };
        row(&mut bench, &format!("Trial 2, {}", title("tomato")), Modifiers::NONE);
        bench.until_shown(true, "1 selected");
        row(&mut bench, &format!("Trial 4, {}", title("cube")), Modifiers::SHIFT);
        bench.until_shown(true, "3 selected");
        row(&mut bench, "Trial 6, mug", Modifiers::COMMAND);
        bench.until_shown(true, "4 selected");
        // Tagged together, and taken back together by another program's undo.
        bench.tell(|app| app.library.edit(TrialEdit::Tag(vec!["wet".to_owned()])));
        bench.until_told("4 trials tagged wet");
        let tagged = |bench: &Bench| -> Vec<TrialId> {
            let rows = bench.store().list(false).unwrap();
            rows.iter().filter(|row| !row.tags.is_empty()).map(|row| row.id).collect()
        };
        assert_eq!(tagged(&bench), [2, 3, 4, 6]);
        bench.store().journal().undo().unwrap();
        assert_eq!(tagged(&bench), [0i64; 0]);
        if size[0] < 500.0 {
            bench.harness.get_by_label("Edit").click();
            bench.harness.run_steps(3);
        }
        bench.harness.get_by_label("Discard").click();
        bench.until_told("4 trials discarded");
        until_left(&mut bench);
    }
}

/// The trials that were not discarded, in either direction.
fn until_left(bench: &mut Bench) {
    bench.until_shown(true, "discarded 4");
    let mut left = rows(bench);
    left.sort();
    assert_eq!(left, ["1", "5"]);
}

#[test]
fn what_the_terminal_changes_shows_in_the_window_and_the_other_way_round() {
    let mut bench = library([900.0, 600.0]);
    let at = bench.store_folder().to_owned();
    assert_eq!(run(&at, &["trials", "label", "5", "syringe"]).code, Some(0));
    bench.until_shown(true, &format!("Trial 5, {}", title("syringe")));
    assert_eq!(run(&at, &["trials", "discard", "1-3"]).code, Some(0));
    until_rows(&mut bench, &["6", "5", "4"]);
    assert_eq!(run(&at, &["trials", "undo"]).code, Some(0));
    until_rows(&mut bench, &["6", "5", "4", "3", "2", "1"]);
    bench.tell(|app| app.library.find(TrialQuery { search: "lemon".to_owned(), ..TrialQuery::default() }));
    until_rows(&mut bench, &["3", "1"]);
    bench.tell(|app| app.library.select_all());
    bench.tell(|app| app.library.edit(TrialEdit::Note("ripe".to_owned())));
    bench.until_told("2 trials with the note now");
    assert!(run(&at, &["trials", "list", "--search", "ripe"]).out.lines().count() == 3);
}

#[test]
fn a_label_from_the_terminal_shows_in_label_mode() {
    let panel = ALL_PANELS.iter().find(|panel| panel.name == "trials");
    let setup = BenchSetup { panel, size: [300.0, 400.0], fill, ..BenchSetup::default() };
    let mut bench = Bench::new(setup, CpuRenderer::default());
    bench.until_shown(true, "Trial 5, unlabelled");
    let at = bench.store_folder().to_owned();
    assert_eq!(run(&at, &["trials", "label", "5", "syringe"]).code, Some(0));
    bench.until_shown(true, &format!("Trial 5, {}", title("syringe")));
}

#[test]
fn keys_walk_through_the_library_and_open_trials() {
    let setup = BenchSetup { size: [1400.0, 900.0], fill, ..BenchSetup::default() };
    let mut bench = Bench::new(setup, CpuRenderer::default());
    bench.tell(|app| app.set_mode(Mode::Inspect));
    bench.until_shown(true, "Trial 6, mug");
    let press = |bench: &mut Bench, modifiers: Modifiers, key: Key| {
        bench.harness.key_press_modifiers(modifiers, key);
        bench.harness.run_steps(2);
    };
    press(&mut bench, Modifiers::NONE, Key::ArrowDown);
    bench.until_shown(true, "1 selected");
    press(&mut bench, Modifiers::SHIFT, Key::ArrowDown);
    press(&mut bench, Modifiers::SHIFT, Key::ArrowDown);
    bench.until_shown(true, "3 selected");
    press(&mut bench, Modifiers::COMMAND, Key::A);
    bench.until_shown(true, "6 selected");
    press(&mut bench, Modifiers::NONE, Key::Slash);
    assert!(bench.harness.get_by_label("Search trials").accesskit_node().is_focused());
    bench.harness.get_by_label("Search trials").type_text("tomato");
    bench.harness.step();
    until_rows(&mut bench, &["2"]);
    press(&mut bench, Modifiers::NONE, Key::Enter);
    press(&mut bench, Modifiers::NONE, Key::ArrowDown);
    bench.until_shown(true, "1 selected");
    press(&mut bench, Modifiers::NONE, Key::Enter);
    bench.harness.get_by_label("This trial").click();
    bench.until_shown(true, "Phases");
    press(&mut bench, Modifiers::NONE, Key::Delete);
    bench.until_told("1 trial discarded");
    press(&mut bench, Modifiers::COMMAND, Key::Z);
    bench.until_told("Undone: trial 2: discarded");
    until_rows(&mut bench, &["2"]);
}

/// A lemon, below forty trials of a board, below a tomato.
fn fill_high(store: &mut Store) {
    let simulated = |store: &mut Store, name: &str| {
        let mut scene = Scene::default();
        name.clone_into(&mut scene.object.source);
        store.insert(&grasp(&scene, scene.load_object().unwrap().as_ref(), 0)).unwrap();
    };
    simulated(store, "lemon");
    for _ in 0..40 {
        let id = store.begin_board(&TrialHeader::new("cube", Scene::default()), &BoardInfo::default()).unwrap();
        store.finish_board(id, &BoardInfo::default(), &[]).unwrap();
    }
    simulated(store, "tomato");
}

#[test]
fn the_trial_shown_is_marked_in_sight_and_exported() {
    let setup = BenchSetup { size: [1400.0, 900.0], fill: fill_high, ..BenchSetup::default() };
    let mut bench = Bench::new(setup, CpuRenderer::default());
    // The newest opens by itself, is marked and selected.
    bench.tell(|app| app.set_mode(Mode::Inspect));
    bench.until_shown(true, "Trial 42, Tomato, shown");
    bench.until_shown(true, "1 selected");
    // One far below comes into sight; rows out of sight are not drawn.
    assert!(bench.harness.query_by_label_contains("Trial 1, Lemon").is_none());
    bench.tell(|app| app.open_trial(1));
    bench.until_shown(true, "Trial 1, Lemon, shown");
    bench.until_shown(false, "Trial 42, Tomato");
    // Also after a search that did not find it.
    let search = |text: &str| TrialQuery { search: text.to_owned(), ..TrialQuery::default() };
    bench.tell(|app| app.library.find(search("tomato")));
    bench.until_shown(true, "Trial 42, Tomato");
    bench.until_shown(false, "1 selected");
    bench.tell(|app| app.library.find(search("")));
    bench.until_shown(true, "Trial 1, Lemon, shown");
    bench.until_shown(true, "1 selected");
    // And in a lower window.
    bench.harness.set_size(vec2(1400.0, 620.0));
    bench.harness.run_steps(20);
    assert!(bench.harness.query_by_label("Trial 1, Lemon, shown").is_some());
    // It is exported, until the keys select another one; its mark stays.
    for (key, file) in [(None, "trial_1.mcap"), (Some(Key::ArrowUp), "trial_2.mcap")] {
        key.into_iter().for_each(|key| bench.harness.key_press(key));
        bench.harness.run_steps(3);
        bench.harness.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::E);
        bench.harness.run_steps(3);
        let field = bench.harness.get_by_role_and_label(Role::TextInput, "Path").value();
        assert!(field.as_ref().is_some_and(|path| path.ends_with(file)), "{field:?}");
        bench.harness.key_press(Key::Escape);
        bench.harness.run_steps(3);
        assert!(bench.harness.query_by_label("Trial 1, Lemon, shown").is_some());
    }
    // The menu and the message name it.
    let mut bench = library([900.0, 600.0]);
    bench.tell(|app| app.open_trial(1));
    bench.until_shown(true, "Trial 1, Lemon, shown");
    let export = |bench: &mut Bench| {
        bench.harness.get_by_label("Export").click();
        bench.harness.run_steps(4);
    };
    export(&mut bench);
    assert!(bench.harness.query_by_label("Export trial 1").is_some());
    bench.harness.get_by_label("CSV into a folder beside the store").click();
    bench.until_told("Exported trial 1 as CSV: ");
    assert!(bench.store_folder().join("export").join("trial_1_lemon.csv").is_file());
    bench.tell(|app| app.library.select(2, Reach::Alone));
    bench.harness.run_steps(3);
    export(&mut bench);
    assert!(bench.harness.query_by_label("Export trial 2").is_some());
    assert!(bench.harness.query_by_label("Trial 1, which is shown, is not selected.").is_some());
}

#[test]
fn a_grasp_that_is_stored_already_names_its_trial_which_opens() {
    let setup = BenchSetup { size: [1400.0, 900.0], fill: crate::inspect::three_trials, ..BenchSetup::default() };
    let mut bench = Bench::new(setup, CpuRenderer::default());
    bench.tell(|app| app.simulation.send(Command::SetGrasps(1)));
    bench.tell(|app| app.simulation.send(Command::SetSpeed(64.0)));
    bench.tell(|app| app.simulation.send(Command::SetRecording(Some(TrialPlace::DemoLog))));
    bench.tell(|app| app.simulation.send(Command::Play));
    bench.until_told("Not stored again: trial 1 is the same grasp");
    bench.tell(|app| app.set_mode(Mode::Inspect));
    bench.until_shown(true, "TRIAL 1, SIMULATED");
    bench.until_shown(true, "Trial 1, Lemon, shown");
    // A trial that was chosen stays open, until there is a newer one.
    bench.tell(|app| app.open_trial(3));
    bench.until_shown(true, "TRIAL 3, SIMULATED");
    let look = |bench: &mut Bench| {
        bench.tell(|app| app.set_mode(Mode::Demo));
        bench.harness.run_steps(3);
        bench.tell(|app| app.set_mode(Mode::Inspect));
        for _ in 0..20 {
            bench.harness.step();
            std::thread::sleep(Duration::from_millis(10));
        }
        bench.workbench().inspected().map(|own| own.trial.id)
    };
    assert_eq!(look(&mut bench), Some(3));
    bench.tell(|app| app.set_mode(Mode::Demo));
    let mut scene = Scene::default();
    "ball".clone_into(&mut scene.object.source);
    bench.tell(|app| app.set_scene(scene));
    bench.tell(|app| app.simulation.send(Command::Play));
    let began = Instant::now();
    while look(&mut bench) != Some(4) {
        assert!(began.elapsed() < HANG, "the new grasp is not opened");
    }
}

#[test]
fn the_terminal_lists_and_keeps_grasps_of_the_demo_log() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut store = Store::open(&at.join("trials.sqlite")).unwrap();
    for (seed, place) in [(1, TrialPlace::Store), (2, TrialPlace::DemoLog), (3, TrialPlace::DemoLog)] {
        store.insert_in(place, &grasp(&Scene::default(), None, seed)).unwrap();
    }
    let list = |filters: &[&str]| -> Vec<i64> {
        let rows = json(at, &[&["trials", "list", "--json"], filters].concat());
        rows.as_array().unwrap().iter().map(|row| row["id"].as_i64().unwrap()).collect()
    };
    assert_eq!((list(&[]), list(&["--place", "demo-log"])), (vec![1, 2, 3], vec![2, 3]));
    assert_eq!(json(at, &["trials", "list", "--json"])[1]["place"], "demo-log");
    assert!(run(at, &["trials", "list"]).out.lines().filter(|line| line.contains("demo log")).count() == 2);
    assert!(run(at, &["trials", "show", "2"]).out.contains("in the demo log"));
    let out = run(at, &["trials", "keep", "1-3"]);
    assert!(out.out.contains("2 trials kept in the store"), "{out:?}");
    assert!(run(at, &["trials", "undo"]).out.contains("Undone: trials 2, 3: kept in the store"));
    assert_eq!(list(&["--place", "demo-log"]), [2, 3]);
    // A note keeps.
    assert_eq!(run(at, &["trials", "note", "3", "slipped"]).code, Some(0));
    assert_eq!((list(&["--place", "store"]), list(&["--place", "demo-log"])), (vec![1, 3], vec![2]));
    assert!(run(at, &["trials", "keep", "3"]).out.contains("In the store already"));
    assert_eq!(run(at, &["trials", "list", "--place", "shelf"]).code, Some(2));
}

/// A lemon in the store and a tomato in the demo log.
fn fill_demo(store: &mut Store) {
    for (name, place) in [("lemon", TrialPlace::Store), ("tomato", TrialPlace::DemoLog)] {
        let mut scene = Scene::default();
        name.clone_into(&mut scene.object.source);
        store.insert_in(place, &grasp(&scene, scene.load_object().unwrap().as_ref(), 1)).unwrap();
    }
}

#[test]
fn the_library_marks_the_demo_log_and_keeps_the_selection() {
    let panel = ALL_PANELS.iter().find(|panel| panel.name == "library");
    let setup = BenchSetup { panel, size: [900.0, 600.0], fill: fill_demo, ..BenchSetup::default() };
    let mut bench = Bench::new(setup, CpuRenderer::default());
    bench.until_shown(true, "Trial 2, Tomato");
    assert!(bench.harness.query_by_label("Trial 1, Lemon").is_some(), "both are listed");
    bench.harness.get_by_label("demo log 1").click();
    bench.until_shown(false, "Trial 1, Lemon");
    bench.harness.get_by_label("Trial 2, Tomato").click();
    bench.harness.run_steps(3);
    bench.harness.get_by_label("Keep").click();
    bench.harness.step();
    bench.until_told("1 trial kept in the store");
    bench.until_shown(false, "Trial 2, Tomato");
    assert!(bench.store().list(false).unwrap().iter().all(|row| row.place == TrialPlace::Store));
}
