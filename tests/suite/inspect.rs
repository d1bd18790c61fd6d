//! Looking back: a stored trial shows what was live, and the window finds its way through time.

use crate::bench::{Bench, BenchSetup};
use crate::cpu_renderer::CpuRenderer;
use crate::presenter::texts;
use crate::scripted;
use egui::{Key, Modifiers, Rect};
use egui_kittest::kittest::Queryable as _;
use palpate::app::{Mode, Seek, ViewSource};
use palpate_lab::datasets::SensorView;
use palpate_lab::grasping::grasp;
use palpate_lab::inspection::{Keep, OpenOptions, OpenTrial, TouchPhase};
use palpate_lab::picture::PictureView;
use palpate_lab::workers::{Command, Notice, SimWorker, SimWorkerSetup, TraceRow};
use palpate_learn::Models;
use palpate_sim::scene::Scene;
use palpate_store::{Store, TrialPlace};
use rand::{RngExt, SeedableRng};
use std::sync::Arc;
use std::time::Duration;

#[test]
fn a_stored_grasp_opens_as_it_was_live() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("trials.sqlite");
    let mut scene = Scene::default();
    "lemon".clone_into(&mut scene.object.source);
    let mut model = palpate_learn::Shipped::PerfectSensors.model().unwrap();
    // Three grasps, so that answers build on those before.
    model.card.stop.threshold = 1.0;
    let model = Arc::new(model);
    let setup = SimWorkerSetup {
        scene,
        sensors: SensorView::default(),
        store: store.clone(),
        recording: Some(TrialPlace::Store),
        grasps: 3,
        models: Models::all(&model),
        playing: false,
        wake: Arc::new(|| ()),
    };
    let worker = SimWorker::start(setup).unwrap();
    for command in [Command::SetSpeed(64.0), Command::Play] {
        worker.send(command);
    }
    let (mut rows, mut stored): (Vec<TraceRow>, Vec<i64>) = (Vec::new(), Vec::new());
    let finished = || worker.snapshot().filter(|snapshot| snapshot.status.finished).map(|snapshot| snapshot.grasp);
    while finished().is_none_or(|grasps| (stored.len() as u64) < grasps) {
        rows.extend(worker.rows());
        stored.extend(worker.notices().filter_map(|notice| match notice {
            Notice::Stored(stored) => Some(stored.id()),
            _ => None,
        }));
        std::thread::sleep(Duration::from_millis(5));
    }
    rows.extend(worker.rows());
    let (stage, last) = worker.snapshot().map(|snapshot| (Arc::clone(&snapshot.stage), snapshot.grasp)).unwrap();
    assert_eq!(last, 3);
    drop(worker);
    let store = Store::open(&store).unwrap();
    let view = PictureView::default();
    for (number, id) in stored.into_iter().enumerate() {
        let live: Vec<&TraceRow> = rows.iter().filter(|row| row.grasp == number as u64 + 1).collect();
        let options =
            OpenOptions { models: Models::all(&model), grasps: Some(3), keep: Keep::Scenery, ..OpenOptions::default() };
        let open = OpenTrial::open(&store, id, &options).unwrap();
        assert_eq!(open.t_s, live.iter().map(|row| row.sample.t_s).collect::<Vec<f64>>());
        assert_eq!(open.line_bar, live.iter().map(|row| row.sample.line_bar).collect::<Vec<f64>>());
        for (k, row) in live.iter().enumerate() {
            let values: Vec<u32> = open.columns.iter().map(|column| column.values[k].to_bits()).collect();
            assert_eq!(
                values,
                row.sample.values.iter().map(|value| value.to_bits()).collect::<Vec<u32>>(),
                "sample {k}"
            );
            let now = open.at(row.sample.t_s).unwrap();
            assert_eq!((now.sample, now.frame), (k, row.frame.as_ref()));
            let (then, live) = (now.answer.unwrap(), row.answer.as_ref().unwrap());
            assert_eq!((&then.verdict, then.listening), (&live.verdict, live.listening), "trial {id}, sample {k}");
            assert_eq!(then.beliefs, live.beliefs, "trial {id}, sample {k}");
        }
        // The picture is made of scene and frame alone.
        let frame = &open.frames[open.frames.len() / 2];
        if number as u64 + 1 == last {
            let drawn = |stage: &palpate_lab::picture::Stage| format!("{:?}", stage.draw(frame, &view));
            assert_eq!(drawn(open.stage.as_ref().unwrap()), drawn(&stage));
        }
    }
}

/// Two lemons and a tomato in the store.
pub(crate) fn three_trials(store: &mut Store) {
    for (object, seed) in [("lemon", 0), ("tomato", 0), ("lemon", 7)] {
        let mut scene = Scene::default();
        object.clone_into(&mut scene.object.source);
        let model = scene.load_object().unwrap();
        store.insert(&grasp(&scene, model.as_ref(), seed)).unwrap();
    }
}

fn inspecting(id: i64) -> Bench {
    let setup = BenchSetup { fill: three_trials, size: [1400.0, 1600.0], ..BenchSetup::default() };
    let mut bench = Bench::new(setup, CpuRenderer::default());
    bench.tell(|app| app.open_trial(id));
    bench.until_shown(true, &format!("TRIAL {id}, SIMULATED"));
    bench
}

impl Bench {
    /// Draws what an action has changed: once to apply it, once to show it.
    fn look(&mut self) {
        self.harness.step();
        self.harness.step();
    }

    fn cursor(&mut self) -> f64 {
        self.harness.step();
        self.workbench().inspected().expect("a trial is open").cursor_s
    }

    fn key(&mut self, modifiers: Modifiers, key: Key) -> f64 {
        self.harness.key_press_modifiers(modifiers, key);
        self.harness.step();
        self.cursor()
    }
}

#[test]
fn a_trial_is_stepped_through_by_keys_and_closed() {
    let mut bench = inspecting(2);
    assert_eq!((bench.workbench().view().mode, bench.workbench().view().source), (Mode::Inspect, ViewSource::Trial));
    let released = bench.workbench().inspected().unwrap().trial.phase_from(TouchPhase::Release).unwrap();
    let held = bench.cursor();
    assert!(held < released && released - held < 1.5 / 75.0, "it opens at the end of the hold, not at {held}");
    let none = Modifiers::NONE;
    let first = bench.key(none, Key::Home);
    let second = bench.key(Modifiers::COMMAND, Key::ArrowRight);
    assert!((second - first - 1.0 / 75.0).abs() < 1e-9);
    assert_eq!(bench.key(Modifiers::COMMAND, Key::ArrowLeft), first);
    // A tenth of a second, to a sample.
    assert!((bench.key(none, Key::ArrowRight) - first - 0.1).abs() < 0.5 / 75.0 + 1e-9);
    let last = bench.key(none, Key::End);
    assert_eq!(last, bench.workbench().inspected().unwrap().trial.span_s()[1]);
    // The same by the buttons of the time bar.
    bench.harness.get_by_label("To the start").click();
    assert_eq!(bench.cursor(), first);
    bench.harness.get_by_label("Step").click();
    assert_eq!(bench.cursor(), second);
    // Marks, and the difference between them beside each curve.
    bench.key(Modifiers::SHIFT, Key::A);
    bench.key(none, Key::End);
    bench.key(Modifiers::SHIFT, Key::B);
    bench.look();
    bench.until_shown(true, "B − A");
    bench.harness.get_by_label("Close the trial").click();
    bench.look();
    bench.until_shown(false, "TRIAL 2");
    assert_eq!(bench.workbench().view().source, ViewSource::Simulation);
}

#[test]
fn an_opened_trial_shows_the_answer_to_its_whole_grasp() {
    let mut model = palpate_learn::Model::clone(&scripted::weighing());
    model.card.stop.threshold = 0.5;
    let models = Ok(scripted::models(&Arc::new(model)));
    let setup = BenchSetup { models, fill: three_trials, size: [1400.0, 1000.0], ..BenchSetup::default() };
    let mut bench = Bench::new(setup, CpuRenderer::default());
    bench.tell(|app| app.view.truth_shown = true);
    bench.tell(|app| app.open_trial(1));
    bench.until_shown(true, "TRIAL 1, SIMULATED");
    bench.harness.run_steps(3);
    let held = bench.workbench().inspected().map(|own| (own.cursor_s, own.trial.span_s()[1])).unwrap();
    assert!(held.0 < held.1 - 0.5, "it is shown as it was held: {held:?}");
    let said =
        |bench: &Bench| ["Right: Lemon", "Wrong: Lemon"].map(|text| bench.harness.query_by_label(text).is_some());
    assert!(said(&bench).contains(&true), "no answer");
    // Within the grasp it is still open.
    bench.tell(|app| app.seek(Seek::To(0.5)));
    bench.look();
    assert_eq!(said(&bench), [false, false]);
}

#[test]
fn compared_trials_are_exported_without_an_open_one() {
    let setup = BenchSetup { fill: three_trials, size: [1400.0, 1000.0], ..BenchSetup::default() };
    let mut bench = Bench::new(setup, CpuRenderer::default());
    bench.tell(|app| app.set_mode(Mode::Inspect));
    for id in [1, 3] {
        bench.tell(|app| app.pin(id));
    }
    bench.until_shown(true, "Lemon, trial 3, simulated");
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::E);
    bench.harness.run_steps(3);
    let field = bench.harness.get_by_role_and_label(egui::accesskit::Role::TextInput, "Path").value();
    assert!(field.is_some_and(|path| path.ends_with("lemon_trials_1_3.svg")));
    // A click on a folder puts the cursor behind the path that it writes.
    bench.harness.get_by_label("src/").click();
    bench.harness.run_steps(3);
    bench.harness.event(egui::Event::Text("x".to_owned()));
    bench.harness.run_steps(3);
    let field = bench.harness.get_by_role_and_label(egui::accesskit::Role::TextInput, "Path").value();
    assert!(field.as_ref().is_some_and(|path| path.ends_with("src/lemon_trials_1_3.svgx")), "{field:?}");
}

#[test]
fn a_heat_map_is_exported_alone_beside_compared_trials() {
    let mut bench = inspecting(2);
    bench.tell(|app| app.pin(1));
    bench.until_shown(true, "Lemon, trial 1, simulated");
    bench.harness.get_by_label("Signature").click();
    bench.look();
    for (button, name) in [("Export joints", "joint_angles"), ("Export pads", "taxels")] {
        bench.harness.get_by_label(button).click();
        bench.harness.run_steps(3);
        let field = bench.harness.get_by_role_and_label(egui::accesskit::Role::TextInput, "Path").value();
        assert!(field.as_ref().is_some_and(|path| path.ends_with(&format!("tomato_trial_2_{name}.svg"))), "{field:?}");
        bench.harness.key_press(Key::Escape);
        bench.harness.run_steps(3);
    }
}

#[test]
fn compared_trials_have_a_line_each_or_a_mean() {
    let mut bench = inspecting(1);
    for id in [1, 2, 3] {
        bench.tell(|app| app.pin(id));
    }
    bench.until_shown(true, "Tomato, trial 2, simulated");
    bench.until_shown(true, "Lemon, trial 3, simulated");
    // The one that is shown stands in the list once, and can be taken out of it.
    bench.until_shown(true, "Trial 1, shown: Lemon");
    bench.until_shown(true, "closing to contact, left, s");
    bench.until_shown(true, "closing to contact, right, s");
    assert!(bench.harness.query_by_label_contains("Lemon, trial 1, simulated").is_none());
    bench.harness.get_by_label("Remove trial 1 from the comparison").click();
    bench.look();
    bench.until_shown(false, "Remove trial 1 from");
    bench.tell(|app| app.inspect.spread = true);
    bench.look();
    bench.until_shown(true, "Lemon, simulated, mean of 1");
    bench.harness.get_by_label("Remove trial 3 from the comparison").click();
    bench.look();
    bench.until_shown(false, "Lemon, trial 3");
    // A trial that does not exist is refused, and what is open stays.
    bench.tell(|app| app.open_trial(99));
    bench.until_told("Trial 99 cannot be opened");
    assert_eq!(bench.workbench().inspected().map(|own| own.trial.id), Some(1));
}

#[test]
fn values_of_compared_trials_stand_in_a_table() {
    let mut bench = inspecting(1);
    for id in [2, 3] {
        bench.tell(|app| app.pin(id));
    }
    bench.until_shown(true, "Lemon, trial 3, simulated");
    bench.harness.run_steps(3);
    // Texts of the line at this height, from the left.
    let line = |bench: &Bench, head: Rect, below: usize| -> Vec<String> {
        let y = head.center().y + 14.0 * below as f32;
        let mut found = texts(bench);
        found.retain(|(place, ..)| (place.center().y - y).abs() < 4.0 && place.left() > head.left() - 1.0);
        found.retain(|(place, ..)| place.left() < head.left() + 120.0);
        found.sort_by(|a, b| a.0.left().total_cmp(&b.0.left()));
        found.into_iter().map(|(.., text)| text).collect()
    };
    let heads: Vec<Rect> = texts(&bench).into_iter().filter(|(.., t)| t == "trial").map(|(place, ..)| place).collect();
    assert!(heads.len() >= 2, "a table beside each plot");
    for head in heads {
        assert_eq!(line(&bench, head, 0)[1..], ["left", "right"]);
        for id in 1..=3_usize {
            let row = line(&bench, head, id);
            assert!(row.len() == 3 && row[0] == id.to_string(), "{row:?}");
            assert!(row[1..].iter().all(|value| value.parse::<f64>().is_ok()), "{row:?}");
        }
    }
    // Between two marks there is a line for each curve.
    bench.key(Modifiers::SHIFT, Key::A);
    bench.key(Modifiers::NONE, Key::Home);
    bench.key(Modifiers::SHIFT, Key::B);
    bench.look();
    let said = texts(&bench);
    assert!(!said.iter().any(|(.., text)| text == "trial"));
    assert!(said.iter().filter(|(.., text)| text.contains("Δ")).count() >= 12);
}

#[test]
fn other_sensors_are_read_at_once() {
    let mut bench = inspecting(1);
    let names = |bench: &Bench| -> Vec<String> {
        bench.workbench().inspected().unwrap().trial.columns.iter().map(|column| column.name.clone()).collect()
    };
    assert!(names(&bench).contains(&"force_left".to_owned()));
    bench.tell(|app| app.set_sensors(SensorView { layout: "C6".to_owned(), ..SensorView::default() }));
    while !names(&bench).contains(&"pressure_left_distal".to_owned()) {
        bench.wait();
    }
    assert!(!names(&bench).contains(&"force_left".to_owned()));
    // The simulation reads them, too.
    bench.until(|snapshot| snapshot.channels.iter().any(|channel| channel.name() == "pressure_left_distal"));
}

#[test]
fn the_past_of_a_running_grasp_is_looked_back_on() {
    let setup = BenchSetup { size: [1400.0, 1000.0], ..BenchSetup::default() };
    let mut bench = Bench::new(setup, CpuRenderer::default());
    bench.advance_to(2.0);
    bench.until_shown(false, "Live");
    bench.tell(|app| app.seek(Seek::To(1.0)));
    bench.look();
    bench.until_shown(true, "Live");
    bench.harness.get_by_label("Play").click();
    bench.harness.step();
    bench.harness.step();
    bench.harness.get_by_label("Pause").click();
    bench.harness.step();
    bench.harness.get_by_label("Live").click();
    bench.look();
    bench.until_shown(false, "Live");
    // The next sample is that of the grasp, which has waited.
    bench.advance_to(2.1);
}

/// Random clicks, drags and keys.
fn shaken(seed: u64, many: u32) {
    let mut bench = inspecting(1);
    bench.tell(|app| app.pin(2));
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let keys = [
        Key::Space,
        Key::ArrowLeft,
        Key::ArrowRight,
        Key::ArrowUp,
        Key::ArrowDown,
        Key::Home,
        Key::End,
        Key::Enter,
        Key::Escape,
        Key::Backspace,
        Key::Minus,
        Key::Equals,
        Key::A,
        Key::B,
        Key::D,
        Key::F,
        Key::G,
        Key::L,
        Key::M,
        Key::N,
        Key::P,
        Key::R,
        Key::S,
        Key::T,
        Key::U,
        Key::W,
        Key::Z,
        Key::Slash,
        Key::Num1,
        Key::Num2,
        Key::Num3,
        Key::F1,
        Key::K,
        Key::Tab,
        Key::Delete,
    ];
    let modifiers = [Modifiers::NONE, Modifiers::NONE, Modifiers::SHIFT, Modifiers::COMMAND, Modifiers::ALT];
    for _ in 0..many {
        let place = egui::pos2(random.random_range(0.0..1400.0), random.random_range(0.0..1600.0));
        let button = [egui::PointerButton::Primary, egui::PointerButton::Secondary][random.random_range(0..2usize)];
        let pointer = |pos, pressed| egui::Event::PointerButton { pos, button, pressed, modifiers: Modifiers::NONE };
        match random.random_range(0..4u32) {
            0 | 1 => {
                let modifiers = modifiers[random.random_range(0..modifiers.len())];
                let key = keys[random.random_range(0..keys.len())];
                // What opens a dialog of the desktop is not for tests.
                if !(modifiers == Modifiers::COMMAND && [Key::P, Key::S, Key::O, Key::E].contains(&key)) {
                    bench.harness.key_press_modifiers(modifiers, key);
                }
            }
            2 => {
                bench.harness.event(egui::Event::PointerMoved(place));
                bench.harness.event(pointer(place, true));
                bench.harness.event(pointer(place, false));
            }
            _ => {
                let to = place + egui::vec2(random.random_range(-200.0..200.0), random.random_range(-200.0..200.0));
                bench.harness.event(egui::Event::PointerMoved(place));
                bench.harness.event(pointer(place, true));
                bench.harness.step();
                bench.harness.event(egui::Event::PointerMoved(to));
                bench.harness.event(pointer(to, false));
            }
        }
        bench.harness.step();
    }
}

#[test]
fn random_clicks_and_keys_break_nothing() {
    for seed in 0..3 {
        shaken(seed, 150);
    }
}

/// The same for ten minutes: `cargo test --test suite -- --ignored ten_minutes`.
#[test]
#[ignore = "takes ten minutes"]
fn ten_minutes_of_random_clicks_and_keys_break_nothing() {
    let began = std::time::Instant::now();
    for seed in 100.. {
        if began.elapsed() > Duration::from_secs(600) {
            return;
        }
        shaken(seed, 400);
    }
}

/// Resident memory of this process (bytes), as Linux reports it.
#[cfg(target_os = "linux")]
fn resident() -> u64 {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap();
    4096 * text.split_whitespace().nth(1).and_then(|pages| pages.parse::<u64>().ok()).unwrap()
}

/// `cargo test --test suite -- --ignored hours_of_samples`: one hour of grasps, then three more.
#[cfg(target_os = "linux")]
#[test]
#[ignore = "takes minutes"]
fn hours_of_samples_take_no_more_memory_than_the_first() {
    let mut bench = Bench::new(BenchSetup::default(), CpuRenderer::default());
    for command in [Command::SetRecording(None), Command::SetGrasps(1000), Command::SetSpeed(64.0)] {
        bench.tell(|app| app.simulation.send(command));
    }
    let mut grasps_until = |many: u64| {
        while bench.workbench().snapshot().unwrap().grasp < many {
            bench.tell(|app| app.simulation.send(Command::Play));
            bench.wait();
        }
        resident()
    };
    let first = grasps_until(900);
    let fourth = grasps_until(3600);
    let more = fourth.saturating_sub(first) as f64 * 1e-6;
    assert!(more < 20.0, "{more} MB more than {} MB", first / 1_000_000);
}
