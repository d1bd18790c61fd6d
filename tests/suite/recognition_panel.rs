//! Live recognition in the window: by its labels, and in small pictures.

use crate::bench::{Bench, BenchSetup};
use crate::cpu_renderer::CpuRenderer;
use crate::golden::compare;
use egui::accesskit::Role;
use egui::{Key, Modifiers, Rect};
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use image::RgbaImage;
use palpate::app::{ALL_PANELS, PanelKind};
use palpate_geometry::palette::Theme;
use palpate_lab::workers::{Command, Snapshot};
use palpate_learn::{ModelError, Models, StopReason};
use palpate_sim::objects::catalogue;
use palpate_sim::scene::{Between, Scene};

fn panel() -> &'static PanelKind {
    ALL_PANELS.iter().find(|panel| panel.name == "recognition").unwrap()
}

fn bench(setup: BenchSetup) -> Bench {
    Bench::new(setup, CpuRenderer::default())
}

/// The panel as large as in a window of the first size.
fn alone(theme: Theme) -> Bench {
    bench(BenchSetup { theme, size: [330.0, 708.0], panel: Some(panel()), ..BenchSetup::default() })
}

fn beliefs(snapshot: &Snapshot) -> usize {
    snapshot.identification.as_ref().map_or(0, |view| view.beliefs.len())
}

/// Lets a round of grasps run to its end.
fn run_out(bench: &mut Bench) {
    bench.tell(|app| app.simulation.send(Command::SetSpeed(64.0)));
    bench.tell(|app| app.simulation.send(Command::Play));
    bench.until(|snapshot| snapshot.status.finished);
    bench.harness.run_steps(3);
}

fn says(bench: &Bench, label: &str) -> bool {
    bench.harness.query_all_by_label(label).next().is_some()
}

#[test]
fn a_grasp_is_followed_until_it_is_sure() {
    let mut bench = alone(Theme::Dark);
    assert!(says(&bench, "No contact yet") && says(&bench, "Press play to start a grasp"));
    bench.advance_to(0.5);
    let named = |bench: &Bench| bench.harness.query_by_label_contains("Grasp 1, running: ").is_some();
    assert!(says(&bench, "Sensing …") && says(&bench, "Grasp 1, running") && !named(&bench), "no answer beside it");
    bench.advance_to(2.6);
    assert!(says(&bench, "Lemon, 61 %") && says(&bench, "Grasp 1 of up to 4, needed 90 %"));
    assert!(says(&bench, "large 95 %") && says(&bench, "spherical 96 %"));
    assert!(says(&bench, "Tomato 24 %") && says(&bench, "Empty hand 0 %"));
    assert!(says(&bench, "Grasp 1, running: Lemon 61 %") && says(&bench, "Grasp 2: not yet"));
    assert!(says(&bench, "Truth: Lemon"));
    bench.tell(|app| app.simulation.send(Command::SetSpeed(64.0)));
    bench.tell(|app| app.simulation.send(Command::Play));
    bench.until(|s| beliefs(s) == 1 && s.identification.as_ref().is_some_and(|view| !view.listening));
    assert!(
        says(&bench, "Not sure yet (lemon 61 %, tomato 24 %): grasping again")
            || beliefs(&bench.workbench().snapshot().unwrap()) > 1
    );
    run_out(&mut bench);
    let end = bench.workbench().snapshot().unwrap();
    let view = end.identification.clone().unwrap();
    assert_eq!((view.decided(), view.decision), (Some("lemon"), Some(StopReason::Sure)));
    assert!(says(&bench, "Right: Lemon") && says(&bench, "Grasp 4: not needed"));
}

#[test]
fn a_guided_grasp_says_by_which_move_it_was_chosen() {
    let models = Models::shipped();
    let mut bench = bench(BenchSetup { models, size: [330.0, 708.0], panel: Some(panel()), ..BenchSetup::default() });
    let mut scene = Scene::clone(&bench.workbench().snapshot().unwrap().scene);
    scene.pose.between = Between::Guided;
    scene.set_object_fixed(true);
    bench.tell(|app| app.set_scene(scene));
    bench.until(|s| s.scene.pose.between == Between::Guided);
    bench.tell(|app| app.set_threshold(0.999));
    bench.tell(|app| app.simulation.send(Command::SetSpeed(64.0)));
    bench.tell(|app| app.simulation.send(Command::Play));
    let second = bench.until(|s| s.status.grasp_of_round == 2);
    bench.tell(|app| app.simulation.send(Command::Pause));
    bench.harness.run_steps(3);
    let by = second.status.guided.unwrap();
    assert!(says(&bench, &format!("Guided: gripper {by}").replace(" mm", "\u{a0}mm")), "{by}");
}

#[test]
fn fixed_objects_are_recognised_by_a_model_that_has_learned_them() {
    let setup =
        BenchSetup { models: Models::shipped(), size: [330.0, 708.0], panel: Some(panel()), ..BenchSetup::default() };
    let mut bench = bench(setup);
    for fixed in [true, false] {
        let mut scene = Scene::clone(&bench.workbench().snapshot().unwrap().scene);
        scene.set_object_fixed(fixed);
        bench.tell(|app| app.set_scene(scene));
        bench.until(|s| s.scene.holds_object() == fixed);
        bench.tell(|app| app.simulation.send(Command::SetSpeed(64.0)));
        bench.tell(|app| app.simulation.send(Command::Play));
        let last = |s: &Snapshot| s.identification.as_ref().and_then(|view| view.last.clone());
        let grasped = bench.until(|s| s.scene.holds_object() == fixed && last(s).is_some());
        assert_eq!(last(&grasped).unwrap().model.card.data.fixed(), Some(fixed));
    }
}

#[test]
fn the_panel_in_every_state_and_both_themes() {
    type Reach = fn(&mut Bench);
    let states: [(&str, Reach); 5] = [
        ("ready", |_| ()),
        ("feeling", |bench| bench.advance_to(0.9)),
        ("first", |bench| bench.advance_to(2.6)),
        ("right", run_out),
        ("wrong", |bench| {
            bench.tell(|app| app.open("case"));
            bench.until(|s| s.truth() == "case");
            run_out(bench);
        }),
    ];
    for (name, reach) in states {
        let [dark, light] = Theme::ALL.map(|theme| {
            let mut bench = alone(theme);
            reach(&mut bench);
            bench.harness.run_steps(3);
            bench.picture()
        });
        let mut pair = RgbaImage::new(dark.width() + light.width(), dark.height());
        image::imageops::replace(&mut pair, &dark, 0, 0);
        image::imageops::replace(&mut pair, &light, i64::from(dark.width()), 0);
        compare(&format!("recognition_{name}"), &pair, "the CPU renderer of the tests");
    }
}

#[test]
fn the_threshold_follows_its_line_and_its_number() {
    let mut bench = alone(Theme::Dark);
    bench.advance_to(2.6);
    let line = bench.harness.get_by_label("Threshold").rect().center();
    bench.harness.drag_at(line);
    bench.harness.step();
    bench.harness.hover_at(line - egui::vec2(40.0, 0.0));
    bench.harness.step();
    bench.harness.drop_at(line - egui::vec2(40.0, 0.0));
    let threshold = |s: &Snapshot| s.identification.as_ref().unwrap().rule.threshold;
    let lower = threshold(&bench.until(|s| threshold(s) < 0.89));
    assert!(lower > 0.5 && (lower * 100.0).fract().min(1.0 - (lower * 100.0).fract()) < 1e-6, "{lower}");
    let number = bench.harness.get_by_label("threshold");
    assert!(number.accesskit_node().role() == Role::Label || number.accesskit_node().role() == Role::SpinButton);
}

#[test]
fn another_object_comes_by_button_and_by_key() {
    let mut bench = bench(BenchSetup::default());
    bench.harness.get_by_label("Next object").click();
    let first = bench.until(|s| s.truth() != "lemon" && s.status.playing);
    assert!(beliefs(&first) == 0 && first.status.grasp_of_round == 1);
    bench.harness.key_press(Key::N);
    let second = bench.until(|s| s.truth() != first.truth() && s.status.playing);
    assert!(second.truth() != "lemon", "everyone else gets a turn first");
}

#[test]
fn the_truth_can_be_hidden() {
    let mut bench = bench(BenchSetup::default());
    run_out(&mut bench);
    assert!(says(&bench, "Right: Lemon"));
    bench.harness.get_by_label("Show the truth").click();
    bench.harness.run_steps(3);
    assert!(!says(&bench, "Right: Lemon") && says(&bench, "Truth hidden"));
}

#[test]
fn without_a_model_everything_else_works_and_it_says_so() {
    let mut bench = bench(BenchSetup { models: Err(ModelError("it is broken".to_owned())), ..BenchSetup::default() });
    assert!(bench.workbench().messages().iter().any(|text| text.contains("it is broken")));
    assert!(says(&bench, "Recognition is off"));
    bench.tell(|app| app.simulation.send(Command::SetGrasps(2)));
    run_out(&mut bench);
    assert_eq!(bench.workbench().snapshot().unwrap().grasp, 2);
}

#[test]
fn an_empty_hand_is_an_answer_like_others() {
    let mut bench = bench(BenchSetup { object: "empty", ..BenchSetup::default() });
    run_out(&mut bench);
    assert!(says(&bench, "Wrong: Empty hand"), "the script says lemon");
}

#[test]
fn nothing_is_cut_off_or_covered_in_the_smallest_window() {
    let mut bench = bench(BenchSetup { size: [720.0, 480.0], ..BenchSetup::default() });
    run_out(&mut bench);
    let whole = Rect::from_min_max(egui::pos2(500.0, 66.0), egui::pos2(720.0, 404.0));
    let labels = [
        "Right: Lemon",
        "Show the truth",
        "tiny 0 %",
        "large 99.",
        "cubic 0 %",
        "cylindrical 0 %",
        "spherical 99.",
        "threshold",
        "Grasp 1: Lemon 61 %",
        "Grasp 4: not needed",
        "Next object",
    ];
    let mut places: Vec<(&str, Rect)> = Vec::new();
    for label in labels {
        let part = || bench.harness.query_all_by_label_contains(label).next();
        let Some(node) = bench.harness.query_all_by_label(label).next().or_else(part) else { panic!("no \"{label}\"") };
        let place = node.rect();
        assert!(whole.contains_rect(place), "{label} at {place} is cut off");
        for (other, there) in &places {
            assert!(!there.shrink(0.5).intersects(place), "{label} covers {other}");
        }
        places.push((label, place));
    }
    // Every class has its bar.
    for built_in in catalogue() {
        let bar = format!("{} ", built_in.title);
        let place = bench
            .harness
            .query_all_by_label_contains(&bar)
            .map(|node| node.rect())
            .min_by(|a, b| a.width().total_cmp(&b.width()));
        assert!(place.is_some_and(|place| whole.contains_rect(place)), "{bar}: {place:?}");
    }
}

#[test]
fn an_object_from_a_file_is_learned_by_itself() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("carton.urdf");
    std::fs::write(&file, crate::learning::CARTON).unwrap();
    let shipped = Models::shipped();
    let size = [330.0, 708.0];
    let mut bench = bench(BenchSetup { size, panel: Some(panel()), models: shipped, ..BenchSetup::default() });
    let knows = |bench: &Bench| {
        let snapshot = bench.workbench().snapshot();
        let view = snapshot.as_ref().and_then(|snapshot| snapshot.identification.as_ref());
        view.is_some_and(|view| view.labels.class("carton").is_some())
    };
    bench.tell(|app| app.open(&file.to_string_lossy()));
    bench.until_shown(true, "Learning Carton");
    bench.harness.get_by_label("Stop").click();
    bench.until_shown(false, "Learning Carton");
    assert!(!knows(&bench) && bench.workbench().messages().iter().any(|text| text == "Model unchanged."));

    bench.tell(|app| app.teach_object());
    bench.until_told("Learned \"Carton\".");
    while !knows(&bench) {
        bench.wait();
    }
    // Its bar is there before the next grasp.
    bench.harness.run_steps(3);
    assert!(bench.harness.query_by_label_contains("Carton, learned 0 %").is_some());
    let saved = bench.workbench().view().simulation_models[0].clone().unwrap();
    let model = palpate_learn::Model::load(&saved).unwrap();
    assert_eq!(model.card.taught, ["carton"]);
    // It is learned once, and not again when it is opened again.
    bench.tell(|app| app.open("lemon"));
    bench.until(|s| s.truth() == "lemon");
    bench.tell(|app| app.open(&file.to_string_lossy()));
    bench.until(|s| s.truth() == "carton");
    bench.harness.run_steps(5);
    assert!(bench.harness.query_by_label_contains("Learning Carton").is_none());

    // Learned fixed in place as well, it stays learned as a free one.
    let free = palpate_sim::scene::Scene::clone(&bench.until(|s| s.truth() == "carton").scene);
    let mut fixed = free.clone();
    fixed.set_object_fixed(true);
    bench.tell(|app| app.set_scene(fixed));
    bench.until_shown(true, "Learned as a free object, not yet fixed in place.");
    while bench.workbench().view().simulation_models[1].is_none() {
        bench.wait();
    }
    let models = bench.workbench().view().simulation_models.clone();
    assert!(models[0] == Some(saved.clone()) && models[1].is_some() && models[1] != models[0], "{models:?}");
    bench.tell(|app| app.set_scene(free));
    bench.until(|s| s.truth() == "carton" && !s.scene.holds_object());
    bench.harness.run_steps(5);
    assert!(knows(&bench) && bench.harness.query_by_label_contains("Learning Carton").is_none());
    // Its card was about the fixed one.
    assert!(!says(&bench, "Learned Carton"));
    bench.tell(|app| app.change_learned(&file.to_string_lossy()));
    bench.harness.run_steps(3);

    // Another name is its class, its truth and its name in scene files, also when it is opened again.
    bench.harness.get_by_label("Rename").click();
    bench.harness.run_steps(3);
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
    bench.harness.run_steps(2);
    bench.harness.get_by_label("Name of the object").type_text("crate");
    bench.harness.run_steps(2);
    bench.harness.get_by_label("Save").click();
    bench.until_told("\"Carton\" is \"Crate\" now.");
    let named = bench.until(|s| s.truth() == "crate");
    assert!(named.scene.to_toml().contains("name = \"crate\""), "{}", named.scene.to_toml());
    let saved = bench.workbench().view().simulation_models[0].clone().unwrap();
    assert_eq!(palpate_learn::Model::load(&saved).unwrap().card.taught, ["crate"]);
    bench.tell(|app| app.open("lemon"));
    bench.until(|s| s.truth() == "lemon");
    bench.tell(|app| app.open(&file.to_string_lossy()));
    bench.until(|s| s.truth() == "crate");

    // It is forgotten at any time: the card comes back by its row or by an action.
    bench.tell(|app| app.change_learned(&file.to_string_lossy()));
    bench.harness.run_steps(3);
    // It says again how well it was learned, also under its new name.
    let test = "from 160 simulated grasps: ";
    assert!(says(&bench, "Learned Crate") && bench.harness.query_by_label_contains(test).is_some());
    bench.harness.get_by_label("Forget").click();
    bench.until_told("Forgot \"Crate\".");
    assert_eq!(bench.workbench().view().simulation_models[0], None);
}

#[test]
fn a_raised_threshold_offers_one_more_grasp_beyond_the_limit_too() {
    // The script says 61, 86, 95 and 98 %.
    let mut bench = alone(Theme::Dark);
    let raise = |bench: &mut Bench, threshold: f64| {
        bench.tell(|app| app.set_threshold(threshold));
        bench.until(|s| s.identification.as_ref().is_some_and(|view| view.rule.threshold == threshold));
        bench.harness.run_steps(2);
    };
    run_out(&mut bench);
    assert!(says(&bench, "Lemon, 95 %") && !says(&bench, "One more grasp"));
    raise(&mut bench, 0.92);
    assert!(!says(&bench, "One more grasp"), "the verdict stands");
    raise(&mut bench, 0.97);
    bench.harness.get_by_label("One more grasp").click();
    bench.harness.run_steps(2);
    let more = bench.until(|s| s.status.finished && s.status.grasp_of_round == 4);
    assert_eq!(beliefs(&more), 4, "all grasps count");
    bench.harness.run_steps(3);
    assert!(says(&bench, "Lemon, 98 %") && !says(&bench, "One more grasp"));
    // At the limit there is one more too; the limit stays.
    bench.tell(|app| app.simulation.send(Command::SetGrasps(2)));
    bench.tell(|app| app.simulation.send(Command::Play));
    bench.until(|s| s.status.finished && s.grasp == more.grasp + 2);
    raise(&mut bench, 0.98);
    bench.harness.get_by_label("One more grasp").click();
    bench.harness.run_steps(2);
    let more = bench.until(|s| s.status.finished && s.status.grasp_of_round == 3);
    assert_eq!((beliefs(&more), more.status.grasps), (3, 2));
    bench.tell(|app| app.simulation.send(Command::Play));
    let next = bench.until(|s| s.status.finished && s.grasp > more.grasp);
    assert_eq!(next.status.grasp_of_round, 2);
}
