//! The window by its labels, as someone using a keyboard or a screen reader finds it, and a small picture of each panel
//! in both themes. No graphics driver is needed.

use crate::bench::{Bench, BenchSetup};
use crate::cpu_renderer::CpuRenderer;
use crate::golden::{compare, sheet};
use crate::study_mode::scripted_result;
use egui::accesskit::Role;
use egui::{Key, Modifiers, Rect, vec2};
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use image::RgbaImage;
use palpate::app::{ALL_PANELS, Mode, PanelKind};
use palpate_geometry::palette::Theme;
use palpate_geometry::units::three_digits;
use palpate_lab::grasping::grasp;
use palpate_lab::workers::{Command, MeasuredAccuracy};
use palpate_sim::objects::{EMPTY, catalogue};
use palpate_sim::poses::PoseSampler;
use palpate_sim::scene::{Accuracy, Effect, PosePreset, Scene, Setting};
use palpate_store::{Store, TrialPlace, TrialQuery};
use std::collections::BTreeSet;
use std::sync::Arc;

fn bench(setup: BenchSetup) -> Bench {
    Bench::new(setup, CpuRenderer::default())
}

fn whole_window() -> Bench {
    bench(BenchSetup { size: [1400.0, 1800.0], ..BenchSetup::default() })
}

/// Panels of one picture.
const ON_A_SHEET: usize = 6;

fn logged_trial(store: &mut Store) {
    store.insert_in(TrialPlace::DemoLog, &grasp(&Scene::default(), None, 0)).unwrap();
}

#[test]
fn every_panel_in_both_themes() {
    let picture = |panel: &'static PanelKind| {
        let [dark, light] = Theme::ALL.map(|theme| {
            let size = [300.0, 240.0];
            let fill: fn(&mut Store) = match panel.name {
                "library" => logged_trial,
                name if name.starts_with("study-") => scripted_result,
                _ => |_: &mut Store| (),
            };
            let mut bench = bench(BenchSetup { theme, size, panel: Some(panel), fill, ..BenchSetup::default() });
            bench.advance_to(2.6);
            match panel.name {
                "studies" => bench.until_shown(true, "shipped result"),
                "study-figure" | "study-tables" | "study-findings" => {
                    bench.tell(|app| app.studies.choose("models"));
                    bench.harness.run_steps(4);
                    let text = match panel.name {
                        "study-figure" => "than today's",
                        "study-tables" => "Row virtual, svm",
                        _ => " claim",
                    };
                    bench.until_shown(true, text);
                    bench.harness.run_steps(8);
                }
                "effects" => bench.until_effects_are_measured(),
                "plan" => bench.until_shown(true, "0 of 800 trials"),
                "trials" => bench.until_shown(true, "No trials of the real gripper yet"),
                "label" => bench.until_shown(true, "Connect the gripper:"),
                "library" => {
                    let search = "in no trial".to_owned();
                    bench.tell(|app| app.library.find(TrialQuery { search, ..TrialQuery::default() }));
                    bench.until_shown(true, "0 of 1 trials");
                    // The button beside it has just appeared.
                    bench.harness.run_steps(8);
                }
                _ => {}
            }
            bench.picture()
        });
        side_by_side(&dark, &light)
    };
    for (k, panels) in ALL_PANELS.chunks(ON_A_SHEET).enumerate() {
        let pictures: Vec<RgbaImage> = panels.iter().map(picture).collect();
        compare(&format!("panels_{}", k + 1), &sheet(&pictures, 2), "the CPU renderer of the tests");
    }
}

pub(crate) fn side_by_side(left: &RgbaImage, right: &RgbaImage) -> RgbaImage {
    let mut pair = RgbaImage::new(left.width() + right.width(), left.height());
    image::imageops::replace(&mut pair, left, 0, 0);
    image::imageops::replace(&mut pair, right, i64::from(left.width()), 0);
    pair
}

#[test]
fn time_is_steered_by_buttons() {
    let mut bench = whole_window();
    let start = bench.until(|s| !s.status.playing);
    bench.harness.get_by_label("Step").click();
    let stepped = bench.until(|s| s.frame.t > start.frame.t);
    assert!((stepped.frame.t - 1.0 / 75.0).abs() < 1e-9);
    bench.harness.get_by_label("Play").click();
    bench.until(|s| s.status.playing && s.frame.t > 0.1);
    bench.harness.get_by_label("Pause").click();
    let paused = bench.until(|s| !s.status.playing);
    bench.harness.get_by_label("Reset").click();
    let reset = bench.until(|s| s.grasp > paused.grasp);
    assert_eq!(reset.frame.t, 0.0);
}

/// A grasp that one Newton iteration does not solve, as the red light needs.
fn shown_light(theme: Theme, iterations: u32) -> (Bench, RgbaImage) {
    let panel = ALL_PANELS.iter().find(|panel| panel.name == "grasp");
    let mut bench = bench(BenchSetup { theme, size: [300.0, 380.0], panel, ..BenchSetup::default() });
    let mut scene = Scene::default();
    scene.solver.max_iterations = iterations;
    bench.tell(|app| app.set_scene(scene));
    bench.tell(|app| app.simulation.send(Command::SetGrasps(1)));
    bench.tell(|app| app.simulation.send(Command::SetSpeed(64.0)));
    bench.tell(|app| app.simulation.send(Command::Play));
    bench.until(|s| s.status.finished && s.status.checking.is_none());
    let picture = bench.picture();
    (bench, picture)
}

#[test]
fn a_light_says_how_far_a_grasp_can_be_trusted() {
    let rows = [100, 1].map(|iterations| {
        let [dark, light] = Theme::ALL.map(|theme| shown_light(theme, iterations).1);
        side_by_side(&dark, &light)
    });
    compare("panel_grasp_trust", &side_by_side(&rows[0], &rows[1]), "the CPU renderer of the tests");
}

#[test]
fn a_grasp_is_computed_again_by_a_button() {
    let (mut bench, _) = shown_light(Theme::Dark, 100);
    assert!(bench.harness.query_by_label("Trust light: green").is_some());
    let before = bench.workbench().snapshot().unwrap();
    bench.harness.get_by_label("Verify at finer accuracy").click();
    let after = bench.until(|s| s.last.as_ref().is_some_and(|last| last.accuracy != Accuracy::Standard));
    let [before, after] = [before, after].map(|snapshot| snapshot.last.clone().unwrap());
    assert_eq!((after.grasp, after.accuracy), (before.grasp, Accuracy::Reference));
    assert!(after.summary.hold != before.summary.hold);
    assert!(bench.harness.query_by_label_contains("three levels had to agree, beginning at standard").is_some());
}

#[test]
fn time_is_steered_by_keys() {
    let mut bench = whole_window();
    bench.harness.key_press(Key::Space);
    bench.until(|s| s.status.playing && s.frame.t > 0.05);
    bench.harness.key_press(Key::Space);
    let paused = bench.until(|s| !s.status.playing);
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::ArrowRight);
    bench.until(|s| s.frame.t > paused.frame.t);
    bench.harness.key_press(Key::Equals);
    bench.until(|s| s.status.target_speed == 2.0);
    bench.harness.key_press(Key::Minus);
    bench.until(|s| s.status.target_speed == 1.0);
    bench.harness.key_press(Key::Minus);
    bench.until(|s| s.status.target_speed == 0.5);
    bench.harness.key_press(Key::Backspace);
    bench.until(|s| s.grasp > paused.grasp && s.frame.t == 0.0);
}

#[test]
fn every_object_of_the_list_can_be_grasped() {
    let mut bench = whole_window();
    for built_in in catalogue() {
        bench.harness.get_by_role_and_label(Role::Button, &built_in.title).click();
        let snapshot = bench.until(|s| s.object.as_ref().is_some_and(|o| o.name == built_in.name));
        assert_eq!(snapshot.scene.object.source, built_in.name);
    }
    bench.harness.get_by_role_and_label(Role::Button, "Empty hand").click();
    bench.until(|s| s.object.is_none());
}

#[test]
fn a_pasted_path_is_opened_and_a_wrong_one_is_explained() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("block.urdf");
    let text = "<robot name='block'><link name='a'><collision><geometry><box size='0.03 0.04 0.03'/></geometry>\
                </collision></link></robot>";
    std::fs::write(&path, text).unwrap();
    let mut bench = whole_window();
    let paste = |bench: &mut Bench, text: &str| {
        let field = bench.harness.get_by_role(Role::TextInput);
        field.focus();
        bench.harness.step();
        bench.harness.get_by_role(Role::TextInput).type_text(text);
        bench.harness.step();
        bench.harness.key_press(Key::Enter);
    };
    paste(&mut bench, path.to_str().unwrap());
    bench.until(|s| s.object.as_ref().is_some_and(|o| o.name == "block"));
    assert!(bench.harness.query_by_role_and_label(Role::Button, "Block").is_some(), "it is listed as a recent file");
    paste(&mut bench, "/nowhere/at/all.obj");
    bench.until(|s| s.status.loading.is_none());
    let heard = (0..30_000).any(|_| {
        bench.harness.step();
        std::thread::sleep(std::time::Duration::from_millis(10));
        bench.workbench().messages().iter().any(|text| text.contains("/nowhere/at/all.obj"))
    });
    assert!(heard, "{:?}", bench.workbench().messages());
    let still = bench.workbench().snapshot().unwrap();
    assert!(still.object.as_ref().is_some_and(|o| o.name == "block"), "the old object stays in the hand");
    assert!(bench.harness.query_by_role_and_label(Role::Button, "All").is_none(), "only what loads is remembered");
}

#[test]
fn values_beyond_a_field_s_range_are_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("anvil.urdf");
    let text = "<robot name='anvil'><link name='a'><inertial><mass value='40'/></inertial><collision><geometry>\
                <box size='0.05 0.1 0.05'/></geometry></collision></link></robot>";
    std::fs::write(&path, text).unwrap();
    let mut bench = whole_window();
    bench.tell(|app| app.open(path.to_str().unwrap()));
    let loaded = bench.until(|s| s.object.as_ref().is_some_and(|o| o.name == "anvil"));
    bench.harness.run_steps(4);
    let after = bench.workbench().snapshot().unwrap();
    assert_eq!((after.grasp, after.object.as_ref().unwrap().mass), (loaded.grasp, 40.0));
}

#[test]
fn scene_settings_reach_the_simulation() {
    let mut bench = whole_window();
    bench.harness.get_by_label("Scene").click();
    bench.harness.run_steps(2);
    let support = bench.harness.get_by_role_and_label(Role::ComboBox, "support").rect();
    bench.harness.get_by_role_and_label(Role::ComboBox, "support").click();
    bench.harness.run_steps(3);
    // The list closes when the panel under it scrolls.
    assert!(bench.harness.query_by_label("fixed").is_some());
    bench.harness.event(egui::Event::PointerMoved(support.left_top() - vec2(0.0, 20.0)));
    let (unit, phase, modifiers) = (egui::MouseWheelUnit::Point, egui::TouchPhase::Move, Modifiers::NONE);
    let (delta, source) = (vec2(0.0, -10.0), egui::MouseWheelSource::Wheel);
    bench.harness.event(egui::Event::MouseWheel { unit, delta, source, phase, modifiers });
    bench.harness.run_steps(3);
    assert!(bench.harness.query_by_label("fixed").is_none());
    bench.harness.get_by_role_and_label(Role::ComboBox, "support").click();
    bench.harness.run_steps(3);
    bench.harness.get_by_label("fixed").click();
    bench.until(|s| s.scene.object.fixed);
    bench.harness.get_by_role_and_label(Role::ComboBox, "accuracy").click();
    bench.harness.run_steps(3);
    bench.harness.get_by_label("draft, 1e-3").click();
    bench.until(|s| s.scene.solver.accuracy == Accuracy::Draft);
    bench.harness.get_by_label("Reset all").click();
    let back = bench.until(|s| !s.scene.object.fixed);
    assert_eq!((back.scene.solver.accuracy, back.scene.object.source.as_str()), (Accuracy::Standard, "lemon"));
}

#[test]
fn a_click_on_any_number_of_the_scene_begins_to_edit_it() {
    let panel = ALL_PANELS.iter().find(|panel| panel.name == "scene").unwrap();
    let mut bench = bench(BenchSetup { size: [320.0, 1600.0], panel: Some(panel), ..BenchSetup::default() });
    bench.until(|s| s.truth() == "lemon");
    for section in ["Finger", "Pad", "Support"] {
        bench.harness.get_by_label(section).click();
        bench.harness.run_steps(8);
    }
    let numbers = |bench: &Bench| -> Vec<Rect> {
        let numbers = bench.harness.query_all_by_role(Role::SpinButton);
        numbers.filter(|node| !node.accesskit_node().is_disabled()).map(|node| node.rect()).collect()
    };
    let places = numbers(&bench);
    assert!(places.len() > 20, "{}", places.len());
    for place in places {
        for pressed in [true, false] {
            bench.harness.event(egui::Event::PointerMoved(place.center()));
            let (button, modifiers) = (egui::PointerButton::Primary, Modifiers::NONE);
            bench.harness.event(egui::Event::PointerButton { pos: place.center(), button, pressed, modifiers });
            bench.harness.step();
        }
        bench.harness.run_steps(2);
        let is_edited = [Role::SpinButton, Role::TextInput].into_iter().any(|role| {
            let mut nodes = bench.harness.query_all_by_role(role);
            nodes.any(|node| node.accesskit_node().is_focused() && node.rect().contains(place.center()))
        });
        assert!(is_edited, "{place:?}");
        bench.harness.key_press(Key::Escape);
        bench.harness.run_steps(2);
    }
}

#[test]
fn fingers_are_let_bend_sideways() {
    let panel = ALL_PANELS.iter().find(|panel| panel.name == "scene").unwrap();
    let [dark, light] = Theme::ALL.map(|theme| {
        let mut bench = bench(BenchSetup { theme, size: [300.0, 420.0], panel: Some(panel), ..BenchSetup::default() });
        bench.until(|s| s.scene.gripper.finger.sideways.stiffness().is_none());
        // Room for the section that is to be unfolded.
        for section in ["Object", "Accuracy", "Gripper pose", "Programme"] {
            bench.harness.get_by_label(section).click();
            bench.harness.run_steps(8);
        }
        bench.harness.get_by_label("Finger").click();
        bench.harness.run_steps(20);
        bench.harness.get_by_role_and_label(Role::ComboBox, "out of plane").click();
        bench.harness.run_steps(3);
        bench.harness.get_by_label("bends and twists").click();
        let bent = bench.until(|s| s.scene.gripper.finger.sideways.stiffness().is_some());
        let (finger, pad) = (&bent.scene.gripper.finger, &bent.scene.gripper.pad);
        assert_eq!(finger.sideways, finger.of_solid_section(pad.thickness));
        bench.harness.run_steps(3);
        bench.picture()
    });
    compare("scene_sideways", &side_by_side(&dark, &light), "the CPU renderer of the tests");
}

#[test]
fn turning_the_accuracy_dial_moves_both_numbers() {
    let mut bench = whole_window();
    bench.harness.get_by_label("Scene").click();
    bench.harness.run_steps(2);
    let sliders = |bench: &Bench| bench.harness.query_all_by_role(Role::Slider).count();
    assert_eq!(sliders(&bench), 1, "a name needs no slider; the time bar is one");
    // Held in place: a free object may slip one way or the other, and its error then does not shrink with the tolerance.
    bench.harness.get_by_role_and_label(Role::ComboBox, "support").click();
    bench.harness.run_steps(3);
    bench.harness.get_by_label("fixed").click();
    bench.until(|s| s.scene.object.fixed);
    let standard = measured(&mut bench);
    bench.harness.get_by_role_and_label(Role::ComboBox, "accuracy").click();
    bench.harness.run_steps(3);
    bench.harness.get_by_label("own tolerance").click();
    bench.until(|s| s.scene.solver.accuracy == Accuracy::Tolerance(1e-5));
    bench.harness.run_steps(3);
    assert!(bench.harness.query_by_role_and_label(Role::Slider, "tolerance").is_some());
    let tolerance = measured(&mut bench);
    assert!(tolerance.cost.error.curvature_per_m < 0.7 * standard.cost.error.curvature_per_m);
    // On a shared machine either may take longer.
    assert_ne!(tolerance.cost.cpu_ms, standard.cost.cpu_ms);
    let cost = format!("{} ms CPU", three_digits(tolerance.cost.cpu_ms));
    assert!(bench.harness.query_by_label(&cost).is_some(), "{cost} is not on the screen");
    bench.harness.get_by_role_and_label(Role::CheckBox, "error band").click();
    bench.until(|s| s.status.error_band);
    bench.advance_to(0.4);
    bench.harness.get_by_role_and_label(Role::CheckBox, "error band").click();
    bench.until(|s| !s.status.error_band && s.frame.t == 0.0);
}

#[test]
fn the_accuracy_dial_tells_stick_slip_and_what_reference_costs() {
    let mut bench = whole_window();
    bench.harness.get_by_label("Scene").click();
    let mut scene = Scene { pose: PosePreset::named("B").unwrap().poses(), ..Scene::default() };
    scene.object.source = "ball".to_owned();
    scene.object.fixed = true;
    bench.tell(|app| app.set_scene(scene.clone()));
    bench.until(|s| s.scene.object.fixed);
    let fixed = measured(&mut bench);
    assert!(!fixed.cost.persists);
    assert!(bench.harness.query_by_label("stick-slip").is_none());
    assert!(bench.harness.query_by_label("reference").is_some());
    let shown = bench.harness.query_all_by_label_contains("×").count();
    assert!(shown >= 2, "real time, and the cost at reference beside that now");
    // A free cylinder on its side rolls one way or the other.
    (scene.object.fixed, scene.object.source) = (false, "syringe".to_owned());
    let object = scene.load_object().unwrap();
    let sampler = PoseSampler::new(&scene, object.as_ref());
    let persists = |seed: u64| {
        let drawn = sampler.draw(object.as_ref(), seed).0;
        bench.tell(|app| app.set_scene(drawn.clone()));
        bench.until(|s| *s.scene == drawn);
        let persists = measured(&mut bench).cost.persists;
        assert_eq!(bench.harness.query_by_label("stick-slip").is_some(), persists, "seed {seed}");
        persists
    };
    assert!((1..=8).any(persists));
}

/// What the gauge says of the scene that is being grasped.
fn measured(bench: &mut Bench) -> Arc<MeasuredAccuracy> {
    let scene = bench.workbench().snapshot().unwrap().scene.clone();
    let found = (0..30_000).find_map(|_| {
        std::thread::sleep(std::time::Duration::from_millis(10));
        bench.workbench().accuracy().filter(|measured| measured.scene == *scene)
    });
    bench.harness.run_steps(2);
    found.expect("measured in five minutes")
}

#[test]
fn error_bands_are_drawn_about_the_traces() {
    let panel = ALL_PANELS.iter().find(|panel| panel.name == "force").unwrap();
    let [dark, light] = Theme::ALL.map(|theme| {
        let mut bench = bench(BenchSetup { theme, size: [300.0, 240.0], panel: Some(panel), ..BenchSetup::default() });
        bench.tell(|app| app.simulation.send(Command::SetErrorBand(true)));
        bench.until(|s| s.status.error_band);
        bench.advance_to(2.6);
        bench.picture()
    });
    compare("panel_force_band", &side_by_side(&dark, &light), "the CPU renderer of the tests");
}

#[test]
fn effects_are_switched_and_both_numbers_move() {
    let mut bench = whole_window();
    bench.tell(|app| app.open(EMPTY));
    bench.until(|s| s.object.is_none());
    bench.harness.get_by_label("Effects").click();
    bench.harness.run_steps(2);
    assert!(bench.harness.query_by_label("finger contact is on").is_some());
    assert!(bench.harness.query_by_label_contains("measuring").is_some(), "it says so while it is not known");
    bench.until_effects_are_measured();
    // Without contact the empty hand feels nothing; what that costs is in front of it.
    let cost = "the CPU time";
    assert!(bench.harness.query_all_by_label_contains(cost).count() == Effect::ALL.len());
    assert!(bench.harness.query_all_by_label_contains("without it: curvature").count() >= 3);
    let before = bench.workbench().snapshot().unwrap();
    bench.harness.get_by_role_and_label(Role::Button, "finger contact off").click();
    let after = bench.until(|s| s.grasp > before.grasp);
    assert!(before.plan.is_on("finger-contact") && !after.plan.is_on("finger-contact"));
    assert_eq!(after.scene.effects.get(Effect::FingerContact), Setting::Off);
    // Old values stay in their places until new ones come.
    let row = |bench: &Bench| bench.harness.get_by_label("about creep").rect();
    let place = row(&bench);
    assert!(bench.harness.query_by_label_contains("measuring").is_some());
    // A line and each bar that stays say that they are of another scene.
    let old = |bench: &Bench| bench.harness.query_all_by_label_contains("of the scene before").count();
    assert_eq!(bench.harness.query_all_by_label_contains(cost).count(), Effect::ALL.len());
    assert_eq!(old(&bench), 1 + 2 * Effect::ALL.len());
    bench.until_effects_are_measured();
    assert_eq!(old(&bench), 0);
    assert_eq!(row(&bench), place, "nothing jumps");
    assert!(bench.harness.query_by_label("finger contact is off").is_some());
    assert!(bench.harness.query_by_label_contains("onset at").is_some(), "what putting it in would change");
    // Words on demand.
    let words = "The pads of the two fingers touch each other";
    assert!(bench.harness.query_by_label_contains(words).is_none());
    bench.harness.get_by_label("about finger contact").click();
    bench.harness.run_steps(2);
    assert!(bench.harness.query_by_label_contains(words).is_some());
    bench.harness.get_by_label("about finger contact").click();
    bench.harness.run_steps(2);
    assert!(bench.harness.query_by_label_contains(words).is_none());
    bench.harness.get_by_role_and_label(Role::Button, "finger contact auto").click();
    bench.until(|s| s.plan.is_on("finger-contact"));
}

#[test]
fn settings_are_adopted_from_the_picture_of_what_accuracy_costs() {
    let mut bench = whole_window();
    bench.tell(|app| app.show_panel("accuracy"));
    bench.harness.run_steps(3);
    assert!(bench.harness.query_by_label_contains("stored study: free objects").is_some());
    let before = bench.workbench().snapshot().unwrap();
    bench.harness.get_by_role_and_label(Role::Button, "Adopt draft").click();
    let after = bench.until(|s| s.grasp > before.grasp);
    assert_eq!(after.scene.solver.accuracy, Accuracy::Draft);
    let at = point_at(&mut bench, "--set solver.engine=rapier");
    bench.harness.drag_at(at);
    bench.harness.drop_at(at);
    bench.harness.run_steps(2);
    bench.until(|s| s.scene.solver.engine == palpate_sim::scene::EngineKind::Rapier);
}

/// Moves the pointer over the plot of what accuracy costs until it shows a text there. Rapier and coarse settings stand in its
/// upper half.
fn point_at(bench: &mut Bench, text: &str) -> egui::Pos2 {
    let plot = bench.harness.get_by_label_contains("Error against CPU time").rect();
    for row in 1..28 {
        for column in 1..56 {
            let at = plot.min + plot.size() * egui::vec2(column as f32 / 56.0, row as f32 / 56.0);
            bench.harness.hover_at(at);
            bench.harness.run_steps(2);
            if bench.harness.query_by_label_contains(text).is_some() {
                return at;
            }
        }
    }
    panic!("{text} is nowhere in the plot");
}

#[test]
fn the_picture_of_what_accuracy_costs_shows_the_setting_under_the_pointer() {
    let panel = ALL_PANELS.iter().find(|panel| panel.name == "accuracy").unwrap();
    let [dark, light] = Theme::ALL.map(|theme| {
        let mut bench = bench(BenchSetup { theme, size: [520.0, 420.0], panel: Some(panel), ..BenchSetup::default() });
        bench.harness.run_steps(3);
        point_at(&mut bench, "solver.engine=rapier");
        bench.picture()
    });
    compare("panel_accuracy_wide", &side_by_side(&dark, &light), "the CPU renderer of the tests");
}

#[test]
fn effects_are_unfolded_in_both_themes() {
    let panel = ALL_PANELS.iter().find(|panel| panel.name == "effects").unwrap();
    let [dark, light] = Theme::ALL.map(|theme| {
        let mut bench = bench(BenchSetup { theme, size: [300.0, 400.0], panel: Some(panel), ..BenchSetup::default() });
        bench.advance_to(2.6);
        bench.until_effects_are_measured();
        bench.harness.get_by_label("about support").click();
        bench.harness.run_steps(2);
        bench.picture()
    });
    compare("effects_unfolded", &side_by_side(&dark, &light), "the CPU renderer of the tests");
}

#[test]
fn theme_keys_and_layout_answer() {
    let mut bench = whole_window();
    bench.harness.get_by_label("Theme").click();
    bench.harness.run_steps(2);
    assert_eq!(bench.workbench().view().theme, Theme::Light);
    bench.harness.key_press(Key::F1);
    bench.harness.run_steps(2);
    assert!(bench.harness.query_by_label("pull at the object").is_some());
    bench.harness.key_press(Key::Escape);
    bench.harness.run_steps(2);
    assert!(bench.harness.query_by_label("pull at the object").is_none());
    let tabs = |bench: &Bench| -> BTreeSet<&str> {
        let has_tab = |title: &&str| bench.harness.query_all_by_label(title).next().is_some();
        ALL_PANELS.iter().map(|panel| panel.title).filter(has_tab).collect()
    };
    let mut seen = tabs(&bench);
    for (key, mode) in [(Key::Num2, Mode::Inspect), (Key::Num3, Mode::Label), (Key::Num4, Mode::Study)] {
        bench.harness.key_press_modifiers(Modifiers::COMMAND, key);
        bench.harness.run_steps(2);
        assert_eq!(bench.workbench().view().mode, mode);
        seen.extend(tabs(&bench));
    }
    assert_eq!(seen.len(), ALL_PANELS.len(), "tabs only of {seen:?}");
}
