//! Why a model gave its answer: on the command line and in the panel Why.

use crate::bench::{Bench, BenchSetup};
use crate::cpu_renderer::CpuRenderer;
use crate::golden::compare;
use crate::program::{json, refused, run};
use crate::scripted;
use egui_kittest::kittest::Queryable as _;
use palpate::app::{ALL_PANELS, Mode, PanelKind, Seek};
use palpate_geometry::palette::Theme;
use palpate_lab::grasping::grasp;
use palpate_lab::workers::Command;
use palpate_learn::{Model, Shipped};
use palpate_sim::scene::Scene;
use palpate_store::Store;

#[test]
fn the_command_says_why_and_names_the_nearest_trials() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    json(at, &["collect", "--objects", "lemon,tomato", "--trials", "2", "--preset", "A", "--json"]);
    let said = json(at, &["recognise", "1", "--why", "--nearest", "2", "--json"]);
    let why = &said["trials"][0]["why"];
    assert_eq!(why["first"]["name"], said["trials"][0]["decided"]);
    assert_eq!(why["first"]["probability"], said["trials"][0]["probability"]);
    let count = |key: &str| why[key].as_array().unwrap().len();
    let (channels, phases) = (count("by_channel"), count("by_phase"));
    assert_eq!((channels, phases, count("by_channel_and_phase")), (4, 3, 12));
    assert_eq!(why["calls"], 1 + channels + phases + channels * phases);
    assert!(why["by_channel"][0]["points"].is_f64() && why["by_phase"][2]["phase"] == "hold");
    let nearest = &why["nearest"];
    assert_eq!(nearest["compared"], 3, "all but the trial itself");
    let distance = |k: usize| nearest["trials"][k]["distance"].as_f64().unwrap();
    assert!(nearest["trials"].as_array().unwrap().len() == 2 && distance(0) <= distance(1) && distance(0) > 0.0);
    assert!(nearest["trials"].as_array().unwrap().iter().all(|trial| trial["id"] != 1));
    // Without it the output is as before.
    assert!(json(at, &["recognise", "1", "--json"])["trials"][0].get("why").is_none());
    // In words, and how it was measured.
    let text = run(at, &["recognise", "1", "2", "--together", "--why"]).out;
    for part in [
        "trial 1: ",
        ", then ",
        "left pad pressure",
        "in contact",
        "whole grasp",
        "all channels",
        "before this grasp",
        "Nearest of 3 stored trials: ",
        "How measured: ",
        "20 answers per grasp",
    ] {
        assert!(text.contains(part), "no \"{part}\" in {text}");
    }
    let mixed = run(at, &["recognise", "1", "2", "3", "4", "--together"]);
    assert!(mixed.err.contains("of one object, but their labels are Lemon, Tomato"), "{mixed:?}");
    let alone = run(at, &["recognise", "1", "--why", "--nearest", "0"]).out;
    assert!(!alone.contains("Nearest") && alone.contains("How measured"), "{alone}");
    assert_eq!(run(at, &["recognise", "1", "--nearest", "2"]).code, Some(2), "--nearest needs --why");
    // An older model is recognised.
    let bare = Shipped::PerfectSensors.model().unwrap().with_signatures(None);
    palpate_lab::datasets::save_model(&bare, &at.join("old.safetensors")).unwrap();
    assert_eq!(run(at, &["recognise", "1", "--model", "old.safetensors"]).code, Some(0));
    refused(at, &["recognise", "1", "--why", "--model", "old.safetensors"], &["no class signatures", "palpate train"]);
}

#[test]
fn the_shipped_model_has_signatures_of_all_its_classes() {
    let model = Shipped::PerfectSensors.model().unwrap();
    let signatures = model.signatures.clone().expect("stored by training");
    assert_eq!(signatures.channels(), model.card.channels);
    assert!(signatures.grasps().iter().all(|grasps| *grasps >= 290), "{:?}", signatures.grasps());
    let without = Model { signatures: None, ..model.clone() }.with_signatures(None);
    let [with, without] = [&model, &without].map(|model| model.to_bytes().unwrap().len());
    assert!(with - without < 200_000, "{} bytes", with - without);
}

fn panel() -> &'static PanelKind {
    ALL_PANELS.iter().find(|panel| panel.name == "why").unwrap()
}

fn run_out(bench: &mut Bench) {
    bench.tell(|app| app.simulation.send(Command::SetRecording(None)));
    bench.tell(|app| app.simulation.send(Command::SetGrasps(1)));
    bench.tell(|app| app.simulation.send(Command::SetSpeed(64.0)));
    bench.tell(|app| app.simulation.send(Command::Play));
    bench.until(|snapshot| snapshot.status.finished);
}

/// A lemon and a case in the store.
fn fill(store: &mut Store) {
    for name in ["lemon", "case"] {
        let mut scene = Scene::default();
        name.clone_into(&mut scene.object.source);
        let object = scene.load_object().unwrap();
        store.insert(&grasp(&scene, object.as_ref(), 0)).unwrap();
    }
}

#[test]
fn the_panel_shows_evidence_and_the_nearest_trials() {
    let models = Ok(scripted::models(&scripted::weighing()));
    let size = [280.0, 760.0];
    let setup = BenchSetup { panel: Some(panel()), models, fill, theme: Theme::Light, size, ..BenchSetup::default() };
    let mut bench = Bench::new(setup, CpuRenderer::default());
    assert!(bench.harness.query_by_label_contains("appears when a grasp ends: press play").is_some());
    run_out(&mut bench);
    bench.until_shown(true, "Trial 1, Lemon, simulated, distance 0.00, same readings");
    assert!(bench.harness.query_by_label("At the end of grasp 1.").is_some());
    compare("why_found", &bench.picture(), "the CPU renderer of the tests");
    // The model weighs the pads alone: curvature counts nothing, in no phase.
    for label in ["left curvature: 0 percentage points", "left curvature, hold: 0 percentage points", "pre-shaping: "] {
        assert!(bench.harness.query_all_by_label_contains(label).next().is_some(), "no {label}");
    }
    let of_force = bench.harness.get_by_label_contains("left pad force, hold: +");
    assert!(of_force.rect().right() <= size[0], "nothing is cut off");
    assert!(bench.harness.query_by_label_contains("For Lemon: left pad force").is_some());
    assert!(bench.harness.query_by_label_contains("Trial 2, Earphone case").is_some());
    // It is explained wherever the cursor is in its past.
    bench.tell(|app| app.seek(Seek::To(1.0)));
    bench.harness.run_steps(3);
    assert!(bench.harness.query_by_label_contains("At the end of grasp 1").is_some());
    assert!(bench.harness.query_by_label_contains("For Lemon: left pad force").is_some());
}

#[test]
fn a_link_beside_the_answer_opens_the_panel() {
    let mut bench = Bench::new(
        BenchSetup {
            models: Ok(scripted::models(&scripted::weighing())),
            fill,
            size: [1280.0, 1400.0],
            ..BenchSetup::default()
        },
        CpuRenderer::default(),
    );
    assert!(bench.harness.query_by_label("Why?").is_none(), "no answer yet");
    run_out(&mut bench);
    bench.harness.run_steps(2);
    // The strongest reason stands beside it.
    bench.until_shown(true, "left pad force");
    // The time is that of the picture, which shows the hand as it was held.
    bench.until_shown(true, "3.00 / 4.00 s");
    bench.harness.get_by_label("Why?").click();
    bench.until_shown(true, "Channel by phase");
    // A nearest trial opens in Inspect mode, and is explained there; it is not among its own nearest.
    bench.until_shown(true, "Trial 1, Lemon, sim");
    bench.harness.get_by_label_contains("Trial 1, Lemon, sim").click();
    bench.harness.run_steps(2);
    assert_eq!(bench.workbench().view().mode, Mode::Inspect);
    bench.tell(|app| app.show_panel("why"));
    bench.until_shown(false, "Trial 1, Lemon, sim");
    bench.until_shown(true, "Trial 2, Earphone case, sim");
    // A model without signatures says what to do.
    let setup = BenchSetup { panel: Some(panel()), ..BenchSetup::default() };
    let mut bench = Bench::new(setup, CpuRenderer::default());
    run_out(&mut bench);
    bench.until_shown(true, "train it again");
}
