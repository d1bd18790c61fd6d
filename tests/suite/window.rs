//! Actions of the whole window: command palette, undo, keys without effect, files without a system dialog, sizes.

use crate::bench::{Bench, BenchSetup};
use crate::cpu_renderer::CpuRenderer;
use crate::golden::compare;
use crate::panels::side_by_side;
use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use palpate::app::Mode;
use palpate_geometry::palette::Theme;
use palpate_lab::gripper::{Listen, NotOpened};
use palpate_lab::workers::{Command, LabelCommand};
use palpate_sim::objects::catalogue;
use palpate_sim::scene::Scene;
use palpate_store::{BoardInfo, Store};
use palpate_tactile::trial::{TrialHeader, TrialSource};
use std::sync::Arc;

fn window(size: [f32; 2]) -> Bench {
    Bench::new(BenchSetup { size, ..BenchSetup::default() }, CpuRenderer::default())
}

fn press(bench: &mut Bench, modifiers: Modifiers, key: Key) {
    bench.harness.key_press_modifiers(modifiers, key);
    bench.harness.run_steps(2);
}

fn type_text(bench: &mut Bench, text: &str) {
    bench.harness.event(egui::Event::Text(text.to_owned()));
    bench.harness.run_steps(2);
}

/// Opens the palette and runs the first action that fits a text.
fn run(bench: &mut Bench, text: &str) {
    press(bench, Modifiers::COMMAND, Key::K);
    type_text(bench, text);
    press(bench, Modifiers::NONE, Key::Enter);
    assert!(bench.harness.query_by_role_and_label(Role::SearchInput, "Find an action").is_none());
}

#[test]
fn a_port_that_cannot_be_opened_is_named_and_leads_to_its_panel() {
    let listen: Listen = Arc::new(|_, _| Err(NotOpened::from("there is no such port".to_owned())));
    let setup = BenchSetup { size: [1280.0, 820.0], listen, ..BenchSetup::default() };
    let mut bench = Bench::new(setup, CpuRenderer::default());
    bench.tell(|app| app.connect(Some("/dev/ttyACM7".into())));
    bench.until_shown(true, "gripper not connected");
    bench.harness.get_by_label("gripper not connected").click();
    bench.until_shown(true, "List ports");
    let field = bench.harness.get_by_role_and_label(Role::TextInput, "Port or file").value();
    assert_eq!(field.as_deref(), Some("/dev/ttyACM7"));
}

#[test]
fn the_palette_finds_and_runs_every_kind_of_action() {
    let mut bench = window([1280.0, 820.0]);
    run(&mut bench, "tennis");
    bench.until(|s| s.object.as_ref().is_some_and(|object| object.name == "bigball"));
    run(&mut bench, "light theme");
    assert_eq!(bench.workbench().view().theme.name(), "light");
    run(&mut bench, "force arrows");
    assert!(!bench.workbench().view().forces);
    // A panel of another mode opens that mode.
    run(&mut bench, "calibration");
    assert_eq!(bench.workbench().view().mode, Mode::Label);
    run(&mut bench, "worth of accuracy");
    assert_eq!(bench.workbench().view().mode, Mode::Study);
    bench.until_shown(true, "own simulation: shipped result");
    run(&mut bench, "calibration");
    // Arrows choose, Escape closes and runs nothing.
    press(&mut bench, Modifiers::COMMAND, Key::K);
    type_text(&mut bench, "demo mode");
    press(&mut bench, Modifiers::NONE, Key::Escape);
    assert!(bench.harness.query_by_role_and_label(Role::SearchInput, "Find an action").is_none());
    assert_eq!(bench.workbench().view().mode, Mode::Label);
    // Letters in its field are no keys.
    let forces = bench.workbench().view().forces;
    press(&mut bench, Modifiers::COMMAND, Key::K);
    bench.harness.key_press(Key::F);
    type_text(&mut bench, "f");
    assert_eq!(bench.workbench().view().forces, forces);
}

#[test]
fn the_palette_lists_objects_panels_and_keys() {
    let mut bench = window([1280.0, 820.0]);
    press(&mut bench, Modifiers::COMMAND, Key::K);
    for built_in in catalogue() {
        let label = format!("Grasp: {}", built_in.title);
        assert!(bench.harness.query_by_label(&label).is_some(), "{label}");
    }
    for panel in &palpate::app::ALL_PANELS {
        assert!(bench.harness.query_by_label(&format!("Panel: {}", panel.title)).is_some(), "{}", panel.title);
    }
    assert!(bench.harness.query_by_label("General: Save the scene").is_some());
}

/// A labelled trial of the real gripper.
pub(crate) fn labelled(store: &mut Store) {
    let header = TrialHeader::new("", Scene::default());
    let id = store.begin_board(&header, &BoardInfo::default()).unwrap();
    store.finish_board(id, &BoardInfo::default(), &[]).unwrap();
    store.labels().set_label(id, "lemon").unwrap();
}

#[test]
fn undo_acts_on_what_the_mode_shows() {
    let setup = BenchSetup { fill: labelled, ..BenchSetup::default() };
    let mut bench = Bench::new(setup, CpuRenderer::default());
    let label = |bench: &Bench| bench.store().labels().trials().unwrap()[0].object.clone();
    bench.tell(|app| app.open("tomato"));
    bench.until(|s| s.truth() == "tomato");
    press(&mut bench, Modifiers::COMMAND, Key::Z);
    bench.until(|s| s.truth() == "lemon");
    press(&mut bench, Modifiers::COMMAND, Key::Z);
    bench.until_told("No scene change to undo");
    assert_eq!(label(&bench).as_deref(), Some("lemon"));
    press(&mut bench, Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    bench.until(|s| s.truth() == "tomato");
    // In Label mode the label goes.
    bench.tell(|app| app.set_mode(Mode::Label));
    bench.harness.step();
    press(&mut bench, Modifiers::COMMAND, Key::Z);
    bench.until_told("Undone: trial 1: label");
    assert_eq!(label(&bench), None);
}

#[test]
fn keys_without_effect_say_why() {
    let mut bench = window([1280.0, 820.0]);
    for (key, told) in [
        (Key::Q, "No trial of the real gripper is running"),
        (Key::D, "No trial to discard"),
        (Key::W, "W works in Label mode"),
    ] {
        press(&mut bench, Modifiers::NONE, key);
        bench.until_told(told);
    }
    bench.tell(|app| app.open("empty"));
    bench.until(|s| s.object.is_none());
    press(&mut bench, Modifiers::NONE, Key::Z);
    bench.until_told("There is no object in the hand");
    bench.tell(|app| app.set_mode(Mode::Label));
    bench.until_shown(true, "0 of 800 trials");
    press(&mut bench, Modifiers::NONE, Key::N);
    bench.until_told("No trial waits for a label");
}

#[test]
fn files_are_saved_and_opened_by_the_dialog() {
    let folder = tempfile::tempdir().unwrap();
    let mut bench = window([1280.0, 820.0]);
    let write = |bench: &mut Bench, path: &str| {
        press(bench, Modifiers::COMMAND, Key::A);
        type_text(bench, path);
        press(bench, Modifiers::NONE, Key::Enter);
    };
    press(&mut bench, Modifiers::COMMAND, Key::S);
    let field = |bench: &Bench| bench.harness.get_by_role_and_label(Role::TextInput, "Path").value();
    assert!(field(&bench).is_some_and(|path| path.ends_with("lemon_scene.toml")));
    write(&mut bench, folder.path().join("nowhere/mine.toml").to_str().unwrap());
    assert!(bench.harness.query_by_label_contains("There is no folder").is_some());
    let mine = folder.path().join("mine.toml");
    write(&mut bench, mine.to_str().unwrap());
    bench.until_told("Scene saved as");
    assert!(mine.is_file() && bench.harness.query_by_role_and_label(Role::TextInput, "Path").is_none());
    // The next one begins there; an existing file is replaced only when asked for again.
    press(&mut bench, Modifiers::COMMAND, Key::S);
    assert_eq!(field(&bench), Some(folder.path().join("lemon_scene.toml").to_str().unwrap().to_owned()));
    write(&mut bench, mine.to_str().unwrap());
    assert!(bench.harness.query_by_label_contains("Replace it?").is_some());
    bench.harness.get_by_label("Replace").click();
    bench.harness.run_steps(3);
    assert!(bench.harness.query_by_role_and_label(Role::TextInput, "Path").is_none());
    // A file is opened from the list.
    bench.tell(|app| app.open("tomato"));
    bench.until(|s| s.truth() == "tomato");
    bench.tell(|app| app.ask_for_object());
    bench.harness.run_steps(3);
    bench.harness.get_by_label("mine.toml").click();
    bench.harness.run_steps(3);
    bench.harness.get_by_role_and_label(Role::Button, "Open").click();
    bench.harness.run_steps(3);
    bench.until(|s| s.truth() == "lemon");
}

/// A log of another program: two grasps with a pause between them.
fn log_of_another_program(path: &std::path::Path) {
    let rows = |from: f64| {
        (0..100).map(move |k| {
            let t = 0.02 * f64::from(k);
            let load = (t - 0.5).clamp(0.0, 0.8);
            format!("{},{:.3},{:.4},{}\n", from + 1e3 * t, 40.0 * load, 12.0 - 4.0 * load, k % 3)
        })
    };
    let header = "timestamp,grip,bend [1/m],mode\n".to_owned();
    let text: String = std::iter::once(header).chain(rows(0.0)).chain(rows(5000.0)).collect();
    std::fs::write(path, text).unwrap();
}

#[test]
fn trials_of_another_program_are_imported_by_saying_what_the_columns_are() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("mug.csv");
    log_of_another_program(&log);
    let pictures = [Theme::Dark, Theme::Light].map(|theme| {
        let setup = BenchSetup { size: [960.0, 600.0], theme, ..BenchSetup::default() };
        let mut bench = Bench::new(setup, CpuRenderer::default());
        bench.tell(|app| app.open_file(&log));
        // The time is found by its name; its unit is doubted.
        bench.until_shown(true, "samples per second");
        bench.harness.get_by_label("Unit of timestamp").focus();
        bench.harness.run_steps(2);
        type_text(&mut bench, "ms");
        bench.until_shown(true, "1 trial: mug 1");
        bench.harness.get_by_label("New trial after a pause of 1 s").click();
        bench.until_shown(true, "2 trials: mug 2");
        let picture = bench.picture();
        // The roles are kept for other files, and read from their profile.
        let profile = folder.path().join(format!("{theme:?}.toml"));
        bench.harness.get_by_label("Save profile …").click();
        bench.harness.run_steps(3);
        press(&mut bench, Modifiers::COMMAND, Key::A);
        type_text(&mut bench, profile.to_str().unwrap());
        press(&mut bench, Modifiers::NONE, Key::Enter);
        bench.until_told("Import profile saved as");
        let saved = palpate_exchange::Mapping::profile(profile.to_str().unwrap()).unwrap();
        assert_eq!((saved.time.as_deref(), saved.label, saved.split_gap_s), (Some("timestamp [ms]"), None, Some(1.0)));
        bench.harness.get_by_label("Cancel").click();
        bench.harness.run_steps(2);
        bench.tell(|app| app.open_file(&log));
        bench.until_shown(true, "samples per second");
        bench.harness.get_by_value("its own names").click();
        bench.harness.run_steps(2);
        bench.harness.get_by_label("a profile of yours …").click();
        bench.harness.run_steps(3);
        press(&mut bench, Modifiers::COMMAND, Key::A);
        type_text(&mut bench, profile.to_str().unwrap());
        press(&mut bench, Modifiers::NONE, Key::Enter);
        bench.until_shown(true, "2 trials: mug 2");
        bench.harness.get_by_label("Import 2 trials").click();
        bench.harness.run_steps(2);
        bench.until_told("2 trials imported as collection mug");
        let rows = bench.store().list(false).unwrap();
        let imported: Vec<&str> =
            rows.iter().filter(|row| row.source == TrialSource::Imported).map(|row| row.object.as_str()).collect();
        assert_eq!(imported, ["mug", "mug"]);
        picture
    });
    let [dark, light] = pictures;
    compare("import", &side_by_side(&dark, &light), "the CPU renderer of the tests");
}

#[test]
fn the_scale_is_set_by_keys_and_remembered() {
    let mut bench = window([1280.0, 820.0]);
    press(&mut bench, Modifiers::COMMAND, Key::Plus);
    press(&mut bench, Modifiers::COMMAND, Key::Plus);
    bench.harness.run_steps(2);
    assert!((bench.workbench().view().scale - 1.2).abs() < 1e-6);
    assert!((bench.harness.ctx.zoom_factor() - 1.2).abs() < 1e-6);
    press(&mut bench, Modifiers::COMMAND, Key::Minus);
    assert!((bench.workbench().view().scale - 1.1).abs() < 1e-6);
    press(&mut bench, Modifiers::COMMAND, Key::Num0);
    assert!((bench.workbench().view().scale - 1.0).abs() < 1e-6);
    for _ in 0..20 {
        press(&mut bench, Modifiers::COMMAND, Key::Plus);
    }
    assert!((bench.workbench().view().scale - 2.0).abs() < 1e-6);
}

#[test]
fn results_of_an_earlier_object_vanish() {
    let mut bench = window([1400.0, 1000.0]);
    bench.tell(|app| app.simulation.send(Command::SetGrasps(1)));
    bench.tell(|app| app.simulation.send(Command::SetSpeed(64.0)));
    bench.tell(|app| app.simulation.send(Command::Play));
    bench.until(|s| s.status.finished && s.last.is_some());
    bench.harness.get_by_label("This grasp").click();
    bench.harness.run_steps(2);
    assert!(bench.harness.query_by_label_contains("result of ").is_some());
    bench.tell(|app| app.simulation.send(Command::Pause));
    bench.tell(|app| app.open("tomato"));
    let changed = bench.until(|s| s.truth() == "tomato");
    assert!(changed.last.is_none() && changed.scene_since == changed.grasp);
    assert!(bench.harness.query_by_label_contains("result of ").is_none());
}

#[test]
fn every_tab_is_reachable_in_a_small_window() {
    let mut bench = window([960.0, 600.0]);
    bench.harness.run_steps(2);
    let menus = bench.harness.query_all_by_label("All tabs").count();
    assert!(menus > 0, "the tabs on the right do not fit");
    bench.harness.query_all_by_label("All tabs").last().unwrap().click();
    bench.harness.run_steps(3);
    // The tab, and below it its line in the menu.
    let both: Vec<_> = bench.harness.query_all_by_label("Gripper").collect();
    both.iter().max_by(|a, b| a.rect().top().total_cmp(&b.rect().top())).unwrap().click();
    bench.harness.run_steps(3);
    assert!(bench.harness.query_all_by_label_contains("Connect").next().is_some());
    // Its tab has come into sight, left of the menu.
    bench.harness.run_steps(4);
    let menu = bench.harness.query_all_by_label("All tabs").last().unwrap().rect();
    let tab = bench.harness.query_all_by_label("Gripper").next().unwrap().rect();
    assert!(tab.right() <= menu.left() && tab.width() > 40.0, "{tab:?} {menu:?}");
    // Also with large letters.
    bench.tell(|app| app.set_scale(1.5));
    bench.harness.run_steps(4);
    let room = bench.harness.ctx.content_rect();
    for label in ["Menu", "?", "Theme"] {
        let button = bench.harness.get_by_role_and_label(Role::Button, label).rect();
        assert!(room.contains_rect(button), "{label} at {button:?} in {room:?}");
    }
}

#[test]
fn a_title_names_the_same_object_as_its_class() {
    let mut bench = window([1280.0, 820.0]);
    bench.tell(|app| app.set_mode(Mode::Label));
    bench.until_shown(true, "0 of 800 trials");
    bench.tell(|app| app.edit_labels(LabelCommand::Want("bigball".to_owned(), 3)));
    bench.until_shown(true, "Tennis ball: 0 of 3");
    let field = bench.harness.get_by_role_and_label(Role::TextInput, "Add an object to the plan");
    field.focus();
    bench.harness.run_steps(2);
    type_text(&mut bench, "tennis ball");
    press(&mut bench, Modifiers::NONE, Key::Enter);
    bench.until_shown(true, "Tennis ball: 0 of 50");
}

#[test]
fn a_warning_carries_the_button_that_helps() {
    let folder = tempfile::tempdir().unwrap();
    // A box without a lid: too wide a hole to close.
    let path = folder.path().join("bin.obj");
    let corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)];
    let mut text = String::new();
    for (x, y, z) in corners {
        text += &format!("v {} {} {}\n", 0.04 * f64::from(x), 0.04 * f64::from(y), 0.04 * f64::from(z));
    }
    for [a, b, c, d] in [[1, 4, 3, 2], [1, 2, 6, 5], [2, 3, 7, 6], [3, 4, 8, 7], [4, 1, 5, 8]] {
        text += &format!("f {a} {b} {c} {d}\n");
    }
    std::fs::write(&path, text).unwrap();
    let mut bench = window([1280.0, 820.0]);
    bench.tell(|app| app.open(path.to_str().unwrap()));
    bench.until_told("the mesh is open");
    bench.harness.run_steps(2);
    bench.harness.get_by_role_and_label(Role::Button, "Use its hull").click();
    bench.harness.run_steps(2);
    bench.until(|s| s.object.as_ref().is_some_and(|object| object.name == "bin"));
    // An open mesh has its picture in the list of objects.
    bench.tell(|app| app.show_panel("objects"));
    bench.until_shown(true, "Picture of Bin");
    // What was refused leaves nothing to undo; the hull does.
    press(&mut bench, Modifiers::COMMAND, Key::Z);
    bench.until(|s| s.truth() == "lemon");
}
