//! Training on labelled trials of the board: made-up readings of objects that differ in how far the fingers bend and how hard
//! they press, through calibrations that are as made up.

use crate::bench::{Bench, BenchSetup};
use crate::golden::compare;
use crate::gripper_tools::{bench, press};
use crate::panels::side_by_side;
use crate::program::{json, refused};
use crate::scripted;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use palpate_geometry::palette::Theme;
use palpate_lab::datasets::{DatasetQuery, SensorView};
use palpate_lab::workers::{EndedJob, Job, TrainRequest, Wake, load_model_job, training_data_job, training_job};
use palpate_learn::{Example, Model, Shipped};
use palpate_sim::gripper::Phase;
use palpate_sim::scene::Scene;
use palpate_store::{BoardChunk, BoardInfo, Store};
use palpate_tactile::board::{Board, Reading, Sensor};
use palpate_tactile::calibration::{Input, Point, Record, SensorKind, plan};
use palpate_tactile::trial::{BoardCourse, PhaseMark, TrialHeader};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// Resistance of every part at an angle (rad) or force (N) (ohm).
fn ohm(kind: SensorKind, stimulus: f64) -> f64 {
    match kind {
        SensorKind::Flex => 25e3 * (1.0 + stimulus.to_degrees() / 90.0),
        SensorKind::Pad | SensorKind::Raw => 6.5e3 * stimulus.max(1e-4).powf(-0.9),
    }
}

fn counts(sensor: Sensor, stimulus: f64) -> f64 {
    Input::on(&Board::default(), sensor).counts(ohm(sensor.kind(), stimulus))
}

/// All four parts, calibrated and in their places.
fn calibrate(store: &mut Store) {
    for sensor in Sensor::PAPER {
        let kind = sensor.kind();
        let point = |stimulus| Point { stimulus, counts: counts(sensor, stimulus), spread: 1.0, readings: 50 };
        let points = plan(kind).into_iter().map(point).collect();
        let part = sensor.channel().to_owned();
        let input = Input::on(&Board::default(), sensor);
        let record = Record { part, kind, input, points, bending: None, assumed: false, note: String::new() };
        store.calibrations().add(&record).unwrap();
        store.calibrations().mount(sensor, &record.part).unwrap();
    }
}

/// Four objects by how far the fingers bend (degrees) and press (N). Nobody can tell the tomato from the lemon.
const OBJECTS: [(&str, f64, f64); 4] =
    [("ball", 60.0, 1.0), ("box", 30.0, 3.0), ("lemon", 45.0, 2.0), ("tomato", 45.0, 2.0)];

/// A trial: the fingers close for a second and hold for one.
fn trial(store: &mut Store, object: &str, degrees: f64, newton: f64, number: u32) {
    let header = TrialHeader::new(object, Scene::default());
    let mark = |from_s, phase| PhaseMark { from_s, phase, line_bar: None };
    let phases = vec![mark(0.0, Phase::Close), mark(2.0, Phase::Release)];
    let about = BoardInfo { course: BoardCourse { phases, ..BoardCourse::default() }, ..BoardInfo::default() };
    // Grasps of one object differ by a few per cent, trials of different objects not alike.
    let spread = 1.0 + 0.05 * (f64::from(number * 7919 % 97) / 48.0 - 1.0);
    let reading = |k: u32| {
        let t_s = 0.02 * f64::from(k);
        let share = spread * t_s.min(1.0);
        let stimulus = |sensor: Sensor| match sensor.kind() {
            SensorKind::Flex => (share * degrees).to_radians(),
            SensorKind::Pad | SensorKind::Raw => share * newton,
        };
        let counts = Sensor::PAPER.map(|sensor| Some(counts(sensor, stimulus(sensor)) as f32)).to_vec();
        Reading { t_s, arrived_s: t_s, seq: None, counts, line_bar: None }
    };
    let id = store.begin_board(&header, &about).unwrap();
    let chunk = BoardChunk { readings: (0..125).map(reading).collect(), ..BoardChunk::default() };
    store.append_board(id, &about, &chunk).unwrap();
    store.finish_board(id, &about, &[]).unwrap();
}

/// Fifteen trials of each of the four, three of a cube, one that nobody has labelled.
fn labelled(store: &mut Store) {
    calibrate(store);
    unmounted(store);
}

/// The same by parts that nobody knows.
fn unmounted(store: &mut Store) {
    for number in 0..15 {
        for (k, (object, degrees, newton)) in OBJECTS.into_iter().enumerate() {
            trial(store, object, degrees, newton, 4 * number + k as u32);
        }
    }
    (0..3).for_each(|number| trial(store, "cube", 20.0, 2.0, number));
    trial(store, "", 20.0, 2.0, 0);
}

/// A `wake`, and the receiver of its calls.
fn waker() -> (Wake, Receiver<()>) {
    let (calls, woken) = channel();
    let wake = Arc::new(move || {
        // The test may have stopped listening.
        let _heard = calls.send(());
    });
    (wake, woken)
}

/// Starts a command and waits for its end.
fn done<C: Send + Sync + 'static, O: Send + Sync + 'static>(
    job: &Job<C, O>,
    woken: &Receiver<()>,
    command: C,
) -> Result<Arc<O>, String> {
    let number = job.start(command);
    loop {
        if let Some(ended) = job.last().filter(|ended: &EndedJob<C, O>| ended.number == number) {
            return ended.outcome.map_err(|cause| cause.to_string());
        }
        woken.recv_timeout(Duration::from_secs(600)).expect("the thread is alive");
    }
}

fn request(method: &str) -> TrainRequest {
    TrainRequest { method: method.to_owned(), seed: 1, quick: true }
}

#[test]
fn what_was_labelled_is_learned_judged_kept_and_found_again() {
    let folder = tempfile::tempdir().unwrap();
    let (path, models) = (folder.path().join("trials.sqlite"), folder.path().join("models"));
    labelled(&mut Store::open(&path).unwrap());
    let (wake, woken) = waker();
    let data = training_data_job(path.clone(), models.clone(), Arc::clone(&wake));
    let listed = done(&data, &woken, ()).unwrap();
    let classes = listed.classes.as_ref().unwrap();
    let counts: Vec<(&str, usize)> = classes.iter().map(|class| (class.name.as_str(), class.trials)).collect();
    assert_eq!(counts, [("ball", 15), ("box", 15), ("cube", 3), ("lemon", 15), ("tomato", 15)]);
    assert_eq!(listed.too_little(), None);

    // A long training is given up, and nothing comes of it.
    let training = training_job(path.clone(), models, Arc::clone(&wake));
    training.start(TrainRequest { quick: false, ..request("macro-layer") });
    while training.running().is_some_and(|running| running.progress.words.is_empty()) {
        woken.recv_timeout(Duration::from_secs(600)).expect("the thread is alive");
    }
    training.stop();
    let finished = done(&training, &woken, request("knn")).unwrap();
    assert_eq!(training.take().len(), 1);
    let judged = &finished.judged;
    assert_eq!((judged.trials, judged.left_out), ([48, 12], 0));
    assert_eq!(judged.too_few.iter().map(|class| class.name.as_str()).collect::<Vec<_>>(), ["cube"]);
    let found = |truth: usize| judged.evaluation.confusion.count(truth, Some(truth));
    assert_eq!((found(0), found(1)), (3, 3), "what can be told apart is");
    assert!(found(2) + found(3) < 6 && judged.evaluation.f1_macro < 1.0, "what cannot is not");
    let saved = &done(&data, &woken, ()).unwrap().models;
    assert_eq!(saved.len(), 1);
    assert!(saved[0].about.starts_with("KNN, 4 classes, 48 grasps, macro F1 0."), "{saved:?}");

    // From its file it comes back with its card.
    let load = load_model_job(path, wake);
    let loaded = done(&load, &woken, saved[0].path.clone()).unwrap();
    assert_eq!((&loaded.path, &loaded.model.card), (&saved[0].path, &finished.trained.model.card));
    assert_eq!(loaded.model.card.metrics["f1_macro"], judged.evaluation.f1_macro);

    // Files that are none, or listen to something else, are told.
    let odd = folder.path().join("odd.safetensors");
    let mut foreign = Model::clone(&loaded.model);
    foreign.card.channels[0] = "grip".to_owned();
    palpate_lab::datasets::save_model(&foreign, &odd).unwrap();
    for (file, result) in [("gone.safetensors", "cannot read the model"), ("odd.safetensors", "it needs grip")] {
        let cause = done(&load, &woken, folder.path().join(file)).unwrap_err();
        assert!(cause.contains(result), "{cause}");
    }
}

#[test]
fn too_little_to_learn_from_is_told() {
    let few = |store: &mut Store| (0..6).for_each(|number| trial(store, "ball", 60.0, 1.0, number));
    for (fill, result) in [
        (few as fn(&mut Store), "training needs two objects with 5 labelled trials each (now 1)"),
        (
            unmounted,
            "none of the 60 trials of the real gripper is calibrated: no part is mounted as the left flex strip",
        ),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let (path, models) = (folder.path().join("trials.sqlite"), folder.path().join("models"));
        fill(&mut Store::open(&path).unwrap());
        let (wake, woken) = waker();
        let cause = done(&training_job(path, models.clone(), wake), &woken, request("knn")).unwrap_err();
        assert!(cause.contains(result), "{cause}");
        assert!(!models.exists(), "nothing is saved");
    }
}

#[test]
fn the_window_trains_and_uses_what_it_trained() {
    let [dark, light] = Theme::ALL.map(|theme| {
        let setup = BenchSetup { size: [320.0, 760.0], fill: labelled, ..BenchSetup::default() };
        let mut bench: Bench = bench("training", theme, setup);
        bench.until_shown(true, "63 trials of 5 objects");
        assert!(bench.harness.query_by_label("Puzzle cube: 3, needs 5").is_some());
        press(&mut bench, "Method");
        bench.harness.run_steps(3);
        bench.harness.get_by_label("KNN").click();
        bench.harness.run_steps(3);
        press(&mut bench, "Train");
        bench.until_shown(true, "Macro F1");
        assert!(bench.harness.query_by_label_contains("evaluated on 12 others").is_some());
        let confused = |text: &str| bench.harness.query_by_label_contains(text).is_some();
        assert!(confused("Lemon predicted as Tomato") || confused("Tomato predicted as Lemon"));
        // Without the list of files, in whose names the time stands.
        let picture = bench.picture();
        let end = bench.harness.get_by_label("Models for the real gripper").rect().top() as u32 - 8;
        let picture = image::imageops::crop_imm(&picture, 0, 0, picture.width(), end.min(picture.height())).to_image();
        assert!(bench.harness.get_by_label("the shipped model is in use").accesskit_node().is_disabled());
        let label = "Use knn-20";
        bench.harness.query_all_by_label_contains(label).next().unwrap().click();
        bench.until_shown(true, "is in use");
        while bench.workbench().view().gripper_model.is_none() {
            bench.harness.step();
            std::thread::sleep(Duration::from_millis(5));
        }
        let used = bench.workbench().view().gripper_model.clone().unwrap();
        assert!(used.extension().is_some_and(|extension| extension == "safetensors"), "{used:?}");
        assert!(bench.workbench().messages().iter().any(|text| text.contains("Model for the real gripper: KNN")));
        bench.tell(|app| app.use_model(Some("/nowhere.safetensors".into())));
        while !bench.workbench().messages().iter().any(|text| text.contains("Model not changed")) {
            bench.harness.step();
            std::thread::sleep(Duration::from_millis(5));
        }
        assert_eq!(bench.workbench().view().gripper_model.as_ref(), Some(&used));
        // A model from elsewhere is offered again after another one is used.
        let elsewhere = tempfile::tempdir().unwrap();
        let mine = elsewhere.path().join("mine.safetensors");
        std::fs::copy(&used, &mine).unwrap();
        for (path, next) in [(&mine, &used), (&used, &mine)] {
            bench.tell(|app| app.use_model(Some(path.clone())));
            while bench.workbench().view().gripper_model.as_ref() != Some(path) {
                bench.harness.step();
                std::thread::sleep(Duration::from_millis(5));
            }
            let next = format!("Use {}", next.file_stem().unwrap().to_string_lossy());
            bench.until_shown(true, &next);
        }
        bench.harness.get_by_label("Use the shipped model").click();
        bench.harness.run_steps(2);
        assert_eq!(bench.workbench().view().gripper_model, None);
        picture
    });
    compare("training_done", &side_by_side(&dark, &light), "the CPU renderer of the tests");
}

#[test]
fn recorded_grasps_of_a_new_object_are_taught_to_the_model_for_real_grippers() {
    fn with_mug(store: &mut Store) {
        labelled(store);
        (0..6).for_each(|number| trial(store, "mug", 20.0, 4.0, number));
        (0..3).for_each(|number| trial(store, "pen", 80.0, 0.5, number));
    }
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    with_mug(&mut Store::open(&at.join("t.sqlite")).unwrap());
    let teach = |label: &'static str| {
        ["teach", "--real", "--recorded", label, "--store", "t.sqlite", "--out", "m.safetensors", "--json"]
    };
    assert_eq!(json(at, &teach("mug"))["taught"], serde_json::json!(["mug"]));
    refused(at, &teach("pen"), &["\"pen\" has 3 usable recorded grasps", "needs 5"]);
    refused(at, &teach("nobody"), &["nobody"]);
    let model = Model::load(&at.join("m.safetensors")).unwrap();
    let query = DatasetQuery { objects: vec!["mug".to_owned()], ..DatasetQuery::default() };
    let store = Store::open(&at.join("t.sqlite")).unwrap();
    let mugs = query.read(&store, &SensorView::of_model(&model.card), &mut |_, _| ()).unwrap();
    let mug = model.card.labels.class("mug").unwrap();
    let right = |example: &&Example| model.recogniser.recognise(&example.grasp, None).pmf.top().0 == mug;
    assert_eq!(mugs.examples.iter().filter(right).count(), 6);

    let setup = BenchSetup {
        size: [320.0, 760.0],
        fill: with_mug,
        models: Shipped::AnyGripper.model().map(|model| scripted::models(&Arc::new(model))),
        ..BenchSetup::default()
    };
    let mut bench: Bench = bench("training", Theme::Dark, setup);
    bench.until_shown(true, "72 trials of 7 objects");
    assert!(bench.harness.query_by_label_contains("Teach the model in use: Pen").is_none());
    press(&mut bench, "Teach the model in use: Mug");
    bench.until_told("taught mug");
    bench.harness.step();
    assert!(bench.harness.query_by_label_contains("Teach the model in use: Mug").is_none());
}
