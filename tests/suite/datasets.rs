//! Data sets that can be trusted: each grasp once, nothing mixed in silence, few and foreign trials judged without flags.

use crate::program::{json, refused, run};
use palpate_lab::datasets::{DatasetQuery, SensorView, noise_seed, sequence_of};
use palpate_lab::grasping::grasp;
use palpate_learn::{Class, Dataset, Example, Labels};
use palpate_sim::scene::Scene;
use palpate_store::labels::TrialEdit;
use palpate_store::{Store, TrialPlace};
use palpate_tactile::model::SensorModel;
use palpate_tactile::trial::TrialHeader;
use palpate_tactile::{Channel, SignalDefinition, Signals, whole_fingers};
use std::fmt::Write as _;
use std::path::Path;

fn trials(at: &Path) -> Store {
    Store::open(&at.join("trials.sqlite")).unwrap()
}

/// A scene with a built-in object.
fn scene_of(object: &str) -> Scene {
    let mut scene = Scene::default();
    object.clone_into(&mut scene.object.source);
    scene.timing.duration_s = 1.5;
    scene
}

#[test]
fn six_identical_grasps_of_each_of_two_objects_are_not_judged() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    // As early versions stored them: without origin, as often as they were made.
    let mut store = trials(at);
    for object in ["ball", "box"] {
        let scene = scene_of(object);
        let mut trial = grasp(&scene, scene.load_object().unwrap().as_ref(), 0);
        trial.header.origin = None;
        for _ in 0..6 {
            assert!(store.insert(&trial).unwrap().is_new());
        }
    }
    drop(store);
    let once = ["\"ball\" has 1 different grasp(s)", "copies"];
    refused(at, &["evaluate", "--models", "knn"], &once);
    for split in ["folds:2", "80/20", "first:1", "leave-a-pose-out"] {
        refused(at, &["evaluate", "--models", "knn", "--split", split], &once[..1]);
    }
    let said = run(at, &["evaluate", "--models", "knn"]);
    assert!(said.err.contains("10 trial(s) left out: 10 copies of other trials"), "{said:?}");
}

#[test]
fn the_same_grasp_is_one_trial_collected_or_not() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let collect = |trials: &str| {
        json(
            at,
            &[
                "collect",
                "--objects",
                "ball",
                "--trials",
                trials,
                "--preset",
                "A",
                "--set",
                "timing.duration_s=1",
                "--json",
            ],
        )
    };
    let pose_of = |seed: &str| {
        json(at, &["grasp", "ball", "--preset", "A", "--set", "timing.duration_s=1", "--seed", seed, "--json"])
    };
    assert_eq!(collect("2")["stored"], 2);
    let rows = trials(at).list(true).unwrap();
    let again = pose_of(&rows[1].seed.to_string());
    assert_eq!((&again["trial_id"], &again["newly_stored"]), (&2.into(), &false.into()));
    let said = run(
        at,
        &["grasp", "ball", "--preset", "A", "--set", "timing.duration_s=1", "--seed", &rows[1].seed.to_string()],
    );
    assert!(said.code == Some(0) && said.out.contains("not again: trial 2 is the same grasp"), "{said:?}");

    // A grasp recorded alone first belongs to the collection that asks for it later.
    let third = tempfile::tempdir().unwrap();
    let seeds: Vec<u64> = {
        json(
            third.path(),
            &[
                "collect",
                "--objects",
                "ball",
                "--trials",
                "3",
                "--preset",
                "A",
                "--set",
                "timing.duration_s=1",
                "--json",
            ],
        );
        trials(third.path()).list(true).unwrap().iter().map(|row| row.seed).collect()
    };
    assert_eq!(pose_of(&seeds[2].to_string())["newly_stored"], true);
    let resumed = collect("3");
    assert_eq!((&resumed["stored"], &resumed["known"]), (&0.into(), &3.into()));
    let collection = rows[0].collection.clone().unwrap();
    let rows = trials(at).list(true).unwrap();
    assert_eq!(rows.iter().map(|row| row.collections().collect::<Vec<_>>()).collect::<Vec<_>>(), [[&collection]; 3]);
    let listed = json(at, &["trials", "list", "--collection", &collection, "--json"]);
    assert_eq!(listed.as_array().map(Vec::len), Some(3));

    // Another pose, seed or setting is another grasp.
    assert_eq!(pose_of("77")["newly_stored"], true);
    let other = json(at, &["grasp", "ball", "--set", "timing.duration_s=1.2", "--json"]);
    assert_eq!(other["newly_stored"], true);

    // Merging keeps one of each and both collections.
    let merged = run(third.path(), &["trials", "merge", at.join("trials.sqlite").to_str().unwrap()]);
    assert_eq!(merged.code, Some(0), "{merged:?}");
    let rows = trials(third.path()).list(false).unwrap();
    assert!(rows.len() == 5 && rows.iter().all(|row| row.duplicate_of.is_none()), "{rows:?}");
}

#[test]
fn a_query_keeps_a_copy_whose_original_it_does_not_select() {
    let folder = tempfile::tempdir().unwrap();
    let mut store = trials(folder.path());
    let mut before = None;
    for object in ["ball", "box"] {
        let scene = scene_of(object);
        let mut trial = grasp(&scene, scene.load_object().unwrap().as_ref(), 0);
        trial.header.origin.as_mut().unwrap().after = before.take();
        before = trial.header.identity();
        trial.header.collection = Some("first".to_owned());
        assert_eq!(store.insert_collected([&trial].into_iter()).unwrap(), 1);
        trial.header.collection = Some("second".to_owned());
        let first = store.list(false).unwrap().last().unwrap().id;
        store.delete(&[first]).unwrap();
        assert!(store.insert(&trial).unwrap().is_new());
        store.restore(&[first]).unwrap();
    }
    let read = |collection: Option<&str>| {
        let query = DatasetQuery { collection: collection.map(str::to_owned), ..DatasetQuery::default() };
        let data = query.read(&store, &SensorView::default(), &mut |_, _| ()).unwrap();
        (data.examples.iter().map(|example| (example.id, example.after)).collect::<Vec<_>>(), data.about.left_out)
    };
    assert_eq!(read(Some("first")), (vec![(1, None), (3, Some(1))], 0));
    assert_eq!(read(Some("second")), (vec![(2, None), (4, Some(2))], 0));
    assert_eq!(read(None), (vec![(1, None), (3, Some(1))], 2), "each once");
}

#[test]
fn collections_and_presets_do_not_mix_in_silence() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for preset in ["A", "M"] {
        let collect = ["collect", "--objects", "ball,box", "--trials", "6", "--preset", preset, "--json"];
        assert_eq!(json(at, &collect)["stored"], 12);
    }
    let both = run(at, &["evaluate", "--models", "knn"]);
    assert_eq!(both.code, Some(0), "{both:?}");
    for told in [
        "mixed 2 collections (",
        "--collection selects one",
        "mixed 2 pose presets (A, M)",
        "query: without the empty hand",
    ] {
        assert!(both.out.contains(told), "{told}: {both:?}");
    }
    assert!(both.err.contains("the trials mix 2 pose presets (A, M); --preset selects one"), "{both:?}");
    let rows = json(at, &["evaluate", "--models", "knn", "--json"]);
    assert_eq!(rows[0]["data"]["mixed"].as_array().map(Vec::len), Some(2), "{rows}");

    let one = run(at, &["evaluate", "--models", "knn", "--preset", "a"]);
    assert!(one.code == Some(0) && !one.out.contains("mixed") && !one.err.contains("mix"), "{one:?}");
    assert!(one.out.contains("preset A") && one.out.contains("12 trials"), "{one:?}");

    // The query is stored with the model and printed.
    let trained = run(at, &["train", "knn", "--preset", "M", "--since", "today", "--out", "m.safetensors"]);
    assert!(trained.code == Some(0) && trained.out.contains("query       preset M, since 20"), "{trained:?}");
    let card: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(at.join("m.json")).unwrap()).unwrap();
    assert!(card["data"]["query"].as_str().is_some_and(|query| query.starts_with("preset M, since 20")), "{card}");
    assert_eq!(
        (&card["data"]["physics"], card["data"]["mixed"].is_null()),
        (&palpate_sim::PHYSICS_VERSION.into(), true)
    );

    // The model is judged on what it has not learned.
    let judged = run(at, &["evaluate", "--models", "m.safetensors"]);
    assert!(judged.code == Some(0) && judged.err.contains("12 trial(s) skipped because it has learned"), "{judged:?}");
    refused(at, &["evaluate", "--models", "m.safetensors", "--preset", "M"], &["learned from all of these 12 trials"]);
    refused(at, &["evaluate", "--physics", "unknown"], &["no trial in the store matches", "physics unknown"]);
    let nonsense = run(at, &["evaluate", "--split", "40/40/40"]);
    assert!(nonsense.code == Some(2) && nonsense.err.contains("40/40/20"), "{nonsense:?}");
}

/// Grasps of somebody else: irregular times and lengths, one channel, no sizes or shapes.
fn foreign(at: &Path, of_each: usize) {
    let mut text = String::from("trial,label,t_s,grip\n");
    for trial in 0..3 * of_each {
        let kind = trial % 3;
        let mut t = 0.0;
        for k in 0..40 + trial % 17 {
            t += 0.02 + 0.001 * ((trial * 5 + k * 3) % 7) as f64;
            let press = (t - 0.3_f64).max(0.0) * (1.0 + kind as f64) + 0.003 * trial as f64;
            writeln!(text, "{trial},{},{t:.4},{press:.4}", ["nut", "bolt", "washer"][kind]).unwrap();
        }
    }
    std::fs::write(at.join("foreign.csv"), text).unwrap();
}

#[test]
fn foreign_grasps_without_sizes_get_a_table_without_a_flag() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    foreign(at, 20);
    assert_eq!(run(at, &["trials", "import", "foreign.csv"]).code, Some(0));
    let table = run(at, &["evaluate", "--models", "ds-lstm,knn,random-forest,macro-layer", "--quick"]);
    assert_eq!(table.code, Some(0), "{table:?}");
    assert!(
        table.out.contains("cross-validation with 5 folds") && table.out.contains("60 of them tested"),
        "{table:?}"
    );
    for method in ["knn", "random-forest", "macro-layer"] {
        assert!(table.out.lines().any(|line| line.starts_with(method)), "{method}: {table:?}");
    }
    assert!(!table.out.lines().any(|line| line.starts_with("ds-lstm")));
    assert!(table.err.contains("ds-lstm is left out") && table.err.contains("size"), "{table:?}");
    let rows = json(at, &["evaluate", "--models", "knn,svm", "--split", "40/40/20", "--repeats", "3", "--json"]);
    assert!(rows.as_array().unwrap().iter().all(|row| row["macro_accuracy"].as_f64().unwrap() > 0.8), "{rows}");
    // Of several methods, each has a line with its F1 as it ends, and standard output stays one document.
    let said = run(at, &["evaluate", "--models", "knn,svm", "--split", "40/40/20", "--repeats", "3", "--json"]);
    assert_eq!(serde_json::from_str::<serde_json::Value>(&said.out).unwrap().as_array().unwrap().len(), 2);
    for row in rows.as_array().unwrap() {
        let line = format!("{}: F1 {:.1},", row["model"].as_str().unwrap(), 100.0 * row["f1_macro"].as_f64().unwrap());
        assert_eq!(said.err.lines().filter(|own| own.starts_with(&line)).count(), 1, "{line} in {}", said.err);
    }
    assert!(!run(at, &["evaluate", "--models", "knn"]).err.contains("knn: F1"), "one method has its table alone");
    // Only a method that these data cannot train: an error, not an empty table.
    refused(at, &["evaluate", "--models", "ds-lstm", "--quick"], &["ds-lstm", "size"]);
}

#[test]
fn grasps_of_the_demo_log_are_counted_and_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let mut store = trials(folder.path());
    for (object, place) in [("ball", TrialPlace::Store), ("box", TrialPlace::DemoLog)] {
        let scene = scene_of(object);
        store.insert_in(place, &grasp(&scene, scene.load_object().unwrap().as_ref(), 0)).unwrap();
    }
    let read = |store: &Store, objects: &[&str]| {
        let objects = objects.iter().map(|name| (*name).to_owned()).collect();
        let query = DatasetQuery { objects, ..DatasetQuery::default() };
        query.read(store, &SensorView::default(), &mut |_, _| ())
    };
    let data = read(&store, &[]).unwrap();
    assert_eq!((data.examples.len(), data.about.left_out), (1, 1));
    let none = read(&store, &["box"]).unwrap_err().to_string();
    assert!(none.contains("in the demo log") && none.contains("palpate trials keep"), "{none}");
    store.labels().edit(&[2], &TrialEdit::Keep).unwrap();
    assert_eq!(read(&store, &[]).unwrap().examples.len(), 2);
}

#[test]
fn labels_that_can_be_told_before_the_touch_are_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    // Two sessions of two objects. The baseline of the pad rises from trial to trial, and each object has its block.
    let mut text = "session,trial,label,t_s,pad [N],flex [1/m]\n".to_owned();
    for k in 0..40 {
        let (session, label) = (k / 20, if k / 10 % 2 == 0 { "mug" } else { "key" });
        let grip = if label == "mug" { 2.0 } else { 1.0 };
        for n in 0..50 {
            let t = 0.02 * f64::from(n);
            let noise = f64::from((n * 7919 + k * 104_729) % 101) * 1e-4;
            let touch = (t - 0.5).max(0.0);
            let [pad, flex] = [0.05 * f64::from(k % 20) + noise + grip * touch, 3.0 + noise - touch];
            writeln!(text, "{session},{k},{label},{t},{pad},{flex}").unwrap();
        }
    }
    std::fs::write(at.join("lab.csv"), text).unwrap();
    run(at, &["trials", "import", "lab.csv"]);
    let evaluate = ["evaluate", "--models", "knn", "--collection", "lab"];
    let said = run(at, &evaluate);
    assert!(said.err.contains("can be told before it is touched (") && said.err.contains("; by pad [N])"), "{said:?}");
    assert!(said.out.contains("length check: ") && said.out.contains("random parts of 2 sessions are an upper bound"));
    let said = run(at, &[&evaluate[..], &["--rezero", "--split", "leave-a-session-out"]].concat());
    assert!(!said.err.contains("before it is touched"), "{said:?}");
    assert!(
        said.out.contains("leak check: ") && said.out.contains("one session left out at a time, 2 fits"),
        "{said:?}"
    );
    json(at, &["collect", "--objects", "ball,box", "--trials", "6", "--json"]);
    refused(at, &["evaluate", "--models", "knn", "--source", "sim", "--rezero"], &["--rezero", "imported"]);
    let said = run(at, &["train", "knn", "--collection", "lab", "--out", "lab.safetensors"]);
    assert!(said.err.contains("can be told before it is touched"), "{said:?}");
    let card = std::fs::read_to_string(at.join("lab.json")).unwrap();
    assert!(card.contains("leak_checks") && card.contains("\"leaks\": true"), "{card}");
}

#[test]
fn recordings_of_others_are_judged_beside_what_is_told_without_touch() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    // Three sessions of two objects, whose force differs, and whose baseline does in the first file.
    let mut text = "session,trial,label,t_s,pad [N],flex [1/m]\n".to_owned();
    for k in 0..36 {
        let (session, label) = (k / 12, if k % 2 == 0 { "mug" } else { "key" });
        let [grip, baseline] = if label == "mug" { [2.0, 0.4] } else { [1.0, 0.0] };
        for n in 0..25 {
            let t = 0.04 * f64::from(n);
            let noise = f64::from((n * 7919 + k * 104_729) % 101) * 1e-4;
            let touch = (t - 0.5).max(0.0);
            let [pad, flex] = [baseline + noise + grip * touch, 3.0 + noise - touch];
            writeln!(text, "{session},{k},{label},{t},{pad},{flex}").unwrap();
        }
    }
    std::fs::write(at.join("glove.csv"), text).unwrap();
    let published =
        "[[published]]\nmethod = \"SVM\"\nresult = \"93 %\"\nprotocol = \"ten folds\"\nsource = \"a journal\"\n";
    std::fs::write(at.join("glove.toml"), published).unwrap();
    std::fs::write(at.join("wrong.toml"), published.replace("result", "score")).unwrap();
    let study = ["study", "public", "--data", "glove.csv", "--quick", "--out", "found"];
    refused(at, &[&study[..], &["--published", "wrong.toml"]].concat(), &["wrong.toml", "score", "line 3"]);
    refused(at, &["study", "public", "--data", "no.csv"], &["no.csv"]);
    let found = json(at, &[&study[..], &["--published", "glove.toml", "--json"]].concat());
    let lines: Vec<&str> =
        found["result"]["data"].as_array().unwrap().iter().filter_map(|line| line.as_str()).collect();
    assert_eq!(lines[0], "glove.csv: 36 grasps of 2 objects, 2 channels");
    assert!(lines[1].starts_with("3 sessions: one session left out at a time; intervals"), "{lines:?}");
    let csv = |name: &str| std::fs::read_to_string(at.join("found").join(format!("{name}.csv"))).unwrap();
    let (methods, leaks) = (csv("public"), csv("public-leaks"));
    let f1 = |readings: &str, model: &str| -> f64 {
        let line = methods.lines().find(|line| line.starts_with(&format!("{readings},{model},"))).expect(model);
        line.split(',').nth(3).unwrap().parse().unwrap()
    };
    assert!(f1("as recorded", "extra-trees") > 0.9 && f1("re-zeroed", "extra-trees") > 0.9, "{methods}");
    let told = |form: &str| leaks.lines().find(|line| line.starts_with(&format!("{form},readings before"))).unwrap();
    assert!(told("as recorded").contains(",the object is told,pad"), "{leaks}");
    assert!(told("re-zeroed").contains(",no sign of a leak,"), "{leaks}");
    assert!(csv("public-published").contains("SVM,93 %,ten folds,a journal"));
    let left_out = csv("public-left-out");
    assert!(left_out.contains("ds-lstm") && left_out.contains("geometry-trees"), "{left_out}");
    assert!(
        !at.join("store.sqlite").exists() || json(at, &["trials", "list", "--json"]).as_array().unwrap().is_empty()
    );
}

/// A set of ten objects, twelve trials of each, as sensors of the simulation read them: the open hand at rest for half a second,
/// then a touch that differs.
fn simulated_rests(set: u64, sensors: SensorModel) -> Dataset {
    let channels: Vec<String> = whole_fingers(SignalDefinition::Parts)[..4].iter().map(Channel::name).collect();
    let example = |k: u64| {
        let class = k % 10;
        let mut clean = Signals { channels: channels.clone(), ..Signals::default() };
        for n in 0..60 {
            let t = f64::from(n) / 75.0;
            let touch = (t - 0.5).max(0.0) as f32 * (1 + class) as f32;
            clean.push(t, &[touch, touch, 2000.0 * touch, 2000.0 * touch]);
        }
        let mut header = TrialHeader::new(&format!("object {class}"), Scene::default());
        header.seed = 1000 * set + k / 10;
        let grasp = sequence_of(&sensors.apply(&clean, noise_seed(&header)));
        Example { id: k as i64, class: class as usize, grasp: grasp.into(), ..Example::default() }
    };
    let class = |k: u64| Class { name: format!("object {k}"), size: None, shape: None };
    let labels = Labels { classes: (0..10).map(class).collect(), ..Labels::default() };
    Dataset { channels: channels.clone(), labels, examples: (0..120).map(example).collect(), ..Dataset::default() }
}

#[test]
fn sensors_of_the_simulation_tell_nothing_before_the_touch() {
    let warned = |sensors: SensorModel| {
        (0..100).filter(|set| simulated_rests(*set, sensors).leak_checks(1).iter().any(|check| check.leaks)).count()
    };
    let [real, any] = [SensorModel::PhysicalLike, SensorModel::Drawn].map(warned);
    assert!(real + any <= 1, "{real} and {any} of 100");
}
