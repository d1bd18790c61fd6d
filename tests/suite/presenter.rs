//! Presenter mode: object after object in the demo log, with letters that can be read from afar.

use crate::bench::{Bench, BenchSetup};
use crate::cpu_renderer::CpuRenderer;
use egui::{Key, Rect, Shape};
use egui_kittest::kittest::Queryable as _;
use palpate_geometry::palette::Theme;
use palpate_lab::workers::Command;
use palpate_sim::scene::{PosePreset, Scene};
use palpate_store::{Store, TrialPlace};

fn present(setup: BenchSetup) -> Bench {
    let mut bench = Bench::new(setup, CpuRenderer::default());
    bench.harness.key_press(Key::F11);
    bench.harness.run_steps(2);
    bench.tell(|app| app.simulation.send(Command::SetSpeed(64.0)));
    bench
}

fn says(bench: &Bench, label: &str) -> bool {
    bench.harness.query_by_label(label).is_some()
}

/// True where the reason ends so; what was measured comes before it.
fn reasons(bench: &Bench, end: &str) -> bool {
    bench.harness.query_by_label_contains(end).is_some()
}

/// Lets the window's clock move with its frames until the next object comes.
fn wait_for_next(bench: &mut Bench) {
    for _ in 0..400 {
        bench.harness.run_steps(1);
    }
}

#[test]
fn presenter_mode_shows_object_after_object_and_counts_verdicts() {
    let mut bench = present(BenchSetup::default());
    assert!(bench.workbench().view().presents);
    assert!(!says(&bench, "Recognition"), "no panels");
    let first = bench.until(|s| s.status.finished);
    assert_ne!(first.scene.gripper.mount.yaw_deg, 0.0, "a random pose");
    assert_eq!(first.status.recording, Some(TrialPlace::DemoLog));
    bench.harness.run_steps(2);
    // The script says lemon, which is the first object, and is sure after three grasps.
    assert!(says(&bench, "Right: it is Lemon") && says(&bench, "1 right, 0 wrong"));
    assert!(says(&bench, "Grasp 1: Lemon 61 %") && says(&bench, "Grasp 3: Lemon 95 %"));
    assert!(reasons(&bench, "95 % is enough after 3 grasps: it decides."));
    // K keeps the last grasp, the threshold goes up by keys, and M grasps once more; the verdict is counted once.
    bench.harness.key_press(Key::K);
    bench.until_told("1 trial kept in the store");
    bench.harness.key_press(Key::ArrowUp);
    bench.until(|s| s.identification.as_ref().is_some_and(|view| view.rule.threshold == 0.91));
    bench.tell(|app| app.set_threshold(0.97));
    bench.until(|s| s.identification.as_ref().is_some_and(|view| view.asks_for_more));
    assert!(reasons(&bench, "Now 97 % is asked for. Press M: one more grasp."));
    bench.harness.key_press(Key::M);
    bench.harness.run_steps(2);
    bench.until(|s| s.status.finished && s.status.grasp_of_round == 4);
    bench.harness.run_steps(2);
    assert!(says(&bench, "1 right, 0 wrong"));
    wait_for_next(&mut bench);
    let second = bench.until(|s| s.truth() != "lemon" && s.status.finished);
    bench.harness.run_steps(2);
    let title = second.object.as_ref().map_or_else(|| "Empty hand".to_owned(), |object| object.title.clone());
    assert!(says(&bench, &format!("Wrong: it is {title}")) && says(&bench, "1 right, 1 wrong"));
    // N does not wait.
    bench.tell(|app| app.next_object());
    bench.until(|s| s.truth() != second.truth());
    bench.harness.key_press(Key::Escape);
    bench.harness.run_steps(3);
    assert!(!bench.workbench().view().presents && says(&bench, "Recognition"));
    let back = bench.until(|s| s.scene.pose == Scene::default().pose);
    assert_eq!(back.status.recording, Some(TrialPlace::DemoLog), "as before");
    let rows = bench.store().list(false).unwrap();
    let kept = rows.iter().filter(|row| row.place == TrialPlace::Store).count();
    assert!(kept == 1 && rows.len() > 4, "{rows:?}");
}

#[test]
fn a_hard_pose_is_said_to_be_one() {
    let mut scene = Scene { pose: PosePreset::named("C").unwrap().poses(), ..Scene::default() };
    let hard = |bench: &Bench| bench.harness.query_by_label_contains("A hard one: the hand is").is_some();
    let mut bench = present(BenchSetup::default());
    bench.until(|s| s.status.finished);
    bench.harness.run_steps(2);
    assert!(!hard(&bench));
    scene.object.source = "tomato".to_owned();
    bench.tell(|app| app.set_scene(scene));
    bench.until(|s| s.truth() == "tomato");
    assert!(hard(&bench));
}

/// Texts on the screen: where, how high their letters are (points), and what they say.
pub(crate) fn texts(bench: &Bench) -> Vec<(Rect, f32, String)> {
    fn add(shape: &Shape, found: &mut Vec<(Rect, f32, String)>) {
        match shape {
            Shape::Text(text) => {
                let least = text.galley.job.sections.iter().map(|section| section.format.font_id.size);
                let place = Rect::from_min_size(text.pos, text.galley.size());
                found.push((place, least.fold(f32::INFINITY, f32::min), text.galley.text().to_owned()));
            }
            Shape::Vec(shapes) => shapes.iter().for_each(|shape| add(shape, found)),
            _ => {}
        }
    }
    let mut found = Vec::new();
    bench.harness.output().shapes.iter().for_each(|clipped| add(&clipped.shape, &mut found));
    found.retain(|(_, _, text)| !text.is_empty());
    found
}

/// Letters are large enough, within the window, and stand beside each other.
fn assert_legible(bench: &Bench, size: [f32; 2], when: &str) {
    let found = texts(bench);
    let window = Rect::from_min_size(egui::Pos2::ZERO, size.into());
    assert!(found.len() > 5, "{found:?}");
    for (k, (place, letters, text)) in found.iter().enumerate() {
        assert!(*letters >= size[1] / 36.0 - 0.01, "{when}: {letters} points in {size:?}: {text}");
        assert!(window.contains_rect(*place), "{when}: {text} at {place:?} in {size:?}");
        for (other, _, neighbour) in &found[k + 1..] {
            let shared = place.intersect(*other);
            let apart = shared.width() < 0.5 || shared.height() < 0.5;
            assert!(apart, "{when}: \"{text}\" and \"{neighbour}\" overlap in {size:?}");
        }
    }
}

#[test]
fn letters_are_a_36th_of_the_window_and_never_overlap() {
    for (size, theme) in
        [([960.0, 600.0], Theme::Dark), ([1280.0, 800.0], Theme::Light), ([2560.0, 1440.0], Theme::Dark)]
    {
        let mut bench =
            Bench::new(BenchSetup { size, theme, object: "button", ..BenchSetup::default() }, CpuRenderer::default());
        bench.harness.key_press(Key::F11);
        bench.harness.run_steps(2);
        bench.tell(|app| app.simulation.send(Command::Pause));
        for (t, when) in [(0.3, "closing"), (1.5, "touching"), (2.6, "holding")] {
            bench.advance_to(t);
            bench.harness.run_steps(2);
            assert_legible(&bench, size, when);
        }
        bench.tell(|app| app.simulation.send(Command::SetSpeed(64.0)));
        bench.tell(|app| app.simulation.send(Command::Play));
        bench.until(|s| s.status.finished);
        bench.harness.run_steps(2);
        assert_legible(&bench, size, "decided");
        bench.tell(|app| app.set_threshold(0.99));
        bench.until(|s| s.identification.as_ref().is_some_and(|view| view.asks_for_more));
        assert_legible(&bench, size, "asked for more");
    }
}

#[test]
fn forces_are_told_in_newtons_and_those_of_the_hold_stay_until_the_next_contact() {
    let mut bench = Bench::new(BenchSetup::default(), CpuRenderer::default());
    bench.harness.key_press(Key::F11);
    bench.harness.run_steps(2);
    bench.tell(|app| app.simulation.send(Command::Pause));
    let tells = |bench: &Bench, text: &str| bench.harness.query_all_by_label_contains(text).next().is_some();
    bench.advance_to(2.6);
    bench.harness.run_steps(2);
    assert!(tells(&bench, "\u{a0}N (right)") && !tells(&bench, "Last hold"));
    let mut t = 2.6;
    while !bench.workbench().snapshot().unwrap().frame.taxels.is_empty() {
        t += 0.1;
        bench.advance_to(t);
    }
    bench.harness.run_steps(2);
    assert!(tells(&bench, "Last hold: L ") && !tells(&bench, "Pressing with "));
    // It is the hold of this object only.
    bench.tell(|app| app.next_object());
    bench.until(|s| s.truth() != "lemon");
    bench.harness.run_steps(2);
    assert!(!tells(&bench, "Last hold"));
}

#[test]
fn plots_name_the_hold_once_there_are_samples_of_it() {
    let mut bench = Bench::new(BenchSetup::default(), CpuRenderer::default());
    let named = |bench: &Bench| texts(bench).iter().any(|(_, _, text)| text.trim() == "hold");
    bench.harness.run_steps(2);
    assert!(!named(&bench));
    bench.advance_to(2.9);
    bench.harness.run_steps(2);
    assert!(named(&bench));
}

/// A grasp in the demo log.
fn fill(store: &mut Store) {
    let trial = palpate_lab::grasping::grasp(&Scene::default(), None, 1);
    store.insert_in(TrialPlace::DemoLog, &trial).unwrap();
}

#[test]
fn the_bar_records_into_the_demo_log_and_keeps_its_last_grasp() {
    let mut bench = Bench::new(BenchSetup { fill, ..BenchSetup::default() }, CpuRenderer::default());
    bench.tell(|app| app.simulation.send(Command::SetGrasps(1)));
    bench.tell(|app| app.simulation.send(Command::SetSpeed(64.0)));
    bench.tell(|app| app.simulation.send(Command::Play));
    bench.until(|s| s.status.finished);
    let places =
        |bench: &Bench| -> Vec<TrialPlace> { bench.store().list(false).unwrap().iter().map(|row| row.place).collect() };
    while places(&bench).len() < 2
        || bench.harness.query_by_label("Keep").is_none_or(|keep| {
            use egui_kittest::kittest::NodeT as _;
            keep.accesskit_node().is_disabled()
        })
    {
        bench.wait();
    }
    assert_eq!(places(&bench), [TrialPlace::DemoLog; 2]);
    bench.harness.get_by_label("Keep").click();
    bench.harness.run_steps(2);
    bench.until_told("1 trial kept in the store");
    assert!(bench.harness.query_by_label("Kept").is_some());
    assert_eq!(places(&bench), [TrialPlace::DemoLog, TrialPlace::Store]);
    // The other choice stores the next grasp at once.
    bench.harness.get_by_label("Store").click();
    bench.harness.run_steps(2);
    bench.tell(|app| app.simulation.send(Command::Play));
    bench.until(|s| s.status.finished && s.grasp > 1 && s.status.recording == Some(TrialPlace::Store));
    bench.until_told("stored");
    assert_eq!(places(&bench), [TrialPlace::DemoLog, TrialPlace::Store, TrialPlace::Store]);
}
