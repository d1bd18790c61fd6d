//! From nothing to a recogniser on the command line: collect, train, evaluate, recognise; anybody's data; refusals.

use crate::allocations::allocations_in;
use crate::frozen::{compare_numbers, pretty};
use crate::program::{json, refused, run};
use palpate_lab::datasets::{DatasetQuery, save_model};
use palpate_learn::Shipped;
use palpate_learn::network::{LiveMacroLayer, MacroLayer, MacroShape};
use palpate_sim::objects::catalogue;
use palpate_store::Store;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::fmt::Write as _;
use std::path::Path;

/// A table of grasps as somebody else would have it: two grips that differ in strength.
fn csv(at: &Path, name: &str, trials: usize, labels: &[&str], properties: bool) {
    let mut text =
        String::from(if properties { "trial,label,size,shape,t_s,grip,bend\n" } else { "trial,label,t_s,grip,bend\n" });
    for trial in 0..trials {
        let kind = trial % labels.len();
        let words = if properties { ["tiny,cubic,", "large,spherical,"][kind % 2] } else { "" };
        for k in 0..60 {
            let t = f64::from(k) * 0.02;
            let press = (t - 0.3).max(0.0) * (1.0 + kind as f64 * 2.0) + 0.01 * ((trial * 7 + k as usize) % 5) as f64;
            // No two grasps are the same.
            let press = press + 0.0001 * trial as f64;
            writeln!(text, "{trial},{},{words}{t:.2},{press:.4},{:.4}", labels[kind], t * 3.0).unwrap();
        }
    }
    std::fs::write(at.join(name), text).unwrap();
}

#[test]
fn from_nothing_to_a_table_and_a_model() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let objects = "ball,smallcube,bigball,box";
    let collected = json(at, &["collect", "--objects", objects, "--trials", "14", "--preset", "A", "--json"]);
    assert_eq!(collected["stored"], 56);
    let evaluate = ["evaluate", "--models", "ds-lstm,random-forest", "--train-trials", "8", "--quick", "--json"];
    let rows = json(at, &evaluate);
    let rows = rows.as_array().unwrap();
    assert_eq!(rows.len(), 2);
    for row in rows {
        let number = |key: &str| row[key].as_f64().unwrap_or_else(|| panic!("{key}: {row}"));
        assert!(number("macro_accuracy") > 0.5 && number("f1_macro") <= 1.0, "{row}");
        assert!(number("train_cpu_s") > 0.0 && number("step_us") > 0.0);
        let ends: Vec<f64> = row["ci95"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
        assert!(ends[0] <= number("f1_macro") && number("f1_macro") <= ends[1], "{row}");
        assert_eq!(
            (&row["trials"], &row["data"]["preset"], &row["data"]["sensors"]),
            (&24.into(), &"A".into(), &"virtual".into())
        );
    }
    // Results do not depend on threads, but for times.
    let again = json(at, &[&evaluate[..], &["--threads", "1"]].concat());
    assert_eq!((&again[0]["f1_macro"], &again[1]["confusion"]), (&rows[0]["f1_macro"], &rows[1]["confusion"]));

    std::fs::create_dir(at.join("models")).unwrap();
    let trained =
        json(at, &["train", "ids-lstm", "--quick", "--trials", "8", "--out", "models/own.safetensors", "--json"]);
    assert_eq!(trained["channels"].as_array().unwrap().len(), 4);
    assert!(at.join("models/own.json").is_file(), "the card stands beside it");
    let said = json(at, &["recognise", "1", "2", "--model", "models/own.safetensors", "--together", "--json"]);
    assert_eq!(said["trials"][0]["truth"], "ball");
    let sum: f64 = said["together"]["pmf"].as_object().unwrap().values().map(|p| p.as_f64().unwrap()).sum();
    assert!((sum - 1.0).abs() < 1e-9 && said["trials"][1]["stage_one"]["size"].is_string());
    let judged = json(at, &["evaluate", "--models", "models/own.safetensors", "--json"]);
    assert_eq!(judged[0]["trials"], 56 - 32, "trials that it has learned from are skipped");

    // A model made for other sensors is refused by their names; one cut short is refused, and the store is unharmed.
    let other = json(at, &["train", "macro-layer", "--quick", "--layout", "C2", "--out", "c2.safetensors", "--json"]);
    assert_eq!(other["channels"][2], "pressure_left_proximal");
    refused(
        at,
        &["evaluate", "--models", "c2.safetensors"],
        &["it needs pressure_left_proximal", "does not know pressure_left"],
    );
    let bytes = std::fs::read(at.join("models/own.safetensors")).unwrap();
    std::fs::write(at.join("cut.safetensors"), &bytes[..bytes.len() / 2]).unwrap();
    refused(
        at,
        &["recognise", "1", "--model", "cut.safetensors"],
        &["cut.safetensors", "not a complete Palpate model"],
    );
    refused(at, &["recognise", "1", "--model", "gone.safetensors"], &["gone.safetensors"]);
    refused(at, &["recognise", "99"], &["no trial 99"]);
    refused(at, &["train", "oracle"], &["no method \"oracle\"", "ds-lstm"]);
    refused(at, &["train", "ds-lstm", "--set", "unitz=3"], &["unitz"]);
    refused(at, &["train", "ds-lstm", "--layout", "C9"], &["C9"]);
    refused(at, &["train", "ds-lstm", "--collection", "nope"], &["collection nope", "palpate collect"]);
    refused(at, &["train", "svm", "--objects", "ball"], &["only one class, \"ball\""]);
    refused(at, &["train", "ds-lstm", "--trials", "1"], &["only 1 of the 4 grasps"]);
    // A models folder that cannot be made ends it before the training.
    std::fs::remove_dir_all(at.join("data")).unwrap();
    std::fs::write(at.join("data"), "").unwrap();
    refused(at, &["train", "ds-lstm", "--set", "unitz=3"], &["cannot write"]);
}

#[test]
fn settings_are_searched_for_on_training_grasps() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    json(at, &["collect", "--objects", "ball,box", "--trials", "6", "--preset", "A", "--json"]);
    let search = [
        "train",
        "macro-layer",
        "--quick",
        "--search",
        "--set",
        "epochs=5",
        "--set",
        "units=8",
        "--json",
        "--out",
        "m.safetensors",
    ];
    let trained = json(at, &search);
    let tried = trained["search"].as_array().unwrap();
    assert_eq!(tried.len(), 4, "two settings of two values; units were given");
    assert!(tried.iter().all(|row| row["settings"]["epochs"] == 5 && row["f1_macro"].is_f64()));
    let f1 = |k: usize| tried[k]["f1_macro"].as_f64().unwrap();
    assert!(f1(0) >= f1(3), "best first");
    let card: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(at.join("m.json")).unwrap()).unwrap();
    assert_eq!(card["metrics"]["search"].as_array().unwrap().len(), 4, "the card tells what was tried");
    let [kept, best] =
        [&card["settings"]["recipe"]["training"], &tried[0]["settings"]].map(|from| from["dropout"].as_f64());
    assert!(kept.zip(best).is_some_and(|(kept, best)| (kept - best).abs() < 1e-6), "{kept:?} {best:?}");
}

#[test]
fn anybodys_grasps_are_taken_in_and_learned() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    csv(at, "mine.csv", 24, &["mug", "sponge"], true);
    let imported = run(at, &["trials", "import", "mine.csv"]);
    assert!(imported.code == Some(0) && imported.out.contains("24 trial(s) added as collection mine"), "{imported:?}");
    let again = run(at, &["trials", "import", "mine.csv"]);
    assert!(again.out.contains("0 trial(s) added as collection mine, 24 already there"), "{again:?}");
    let shown = run(at, &["trials", "show", "1"]);
    assert!(shown.code == Some(0) && shown.out.contains("mug") && shown.out.contains("grip, bend"), "{shown:?}");
    let exported = run(at, &["trials", "export", "1", "--out", "back.csv"]);
    assert_eq!(exported.code, Some(0), "{exported:?}");
    assert!(std::fs::read_to_string(at.join("back.csv")).unwrap().starts_with("t_s,grip,bend\n0,0,0\n"));
    let rows = json(at, &["evaluate", "--models", "ds-lstm,knn", "--train-trials", "8", "--quick", "--json"]);
    assert!(rows.as_array().unwrap().iter().all(|row| row["macro_accuracy"].as_f64().unwrap() > 0.9), "{rows}");
    assert_eq!(rows[0]["data"]["object"], "recorded");
    refused(at, &["recognise", "1"], &["it needs curvature_left", "does not know grip"]);

    // Simulated and imported trials do not mix, and are told apart by collection.
    json(at, &["collect", "--objects", "ball,box", "--trials", "2", "--json"]);
    refused(at, &["train", "knn"], &["do not have the same channels", "--collection"]);
    assert_eq!(run(at, &["train", "knn", "--collection", "mine", "--out", "knn.safetensors"]).code, Some(0));

    // Without sizes and shapes there is no first stage to learn.
    csv(at, "bare.csv", 12, &["nut", "bolt", "washer"], false);
    assert_eq!(run(at, &["trials", "import", "bare.csv"]).code, Some(0));
    refused(at, &["train", "ds-lstm", "--collection", "bare"], &["no class in these data has them"]);
    let model = ["train", "macro-layer", "--collection", "bare", "--quick", "--out", "bare.safetensors"];
    assert_eq!(run(at, &model).code, Some(0));
}

#[test]
fn bad_tables_are_refused_and_nothing_is_lost() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    csv(at, "mine.csv", 4, &["mug", "sponge"], false);
    assert_eq!(run(at, &["trials", "import", "mine.csv"]).code, Some(0));
    let write = |name: &str, text: &str| std::fs::write(at.join(name), text).unwrap();
    write("columns.csv", "grasp,class,time,grip\n1,mug,0,1\n");
    refused(at, &["trials", "import", "columns.csv"], &["columns.csv", "t_s", "label"]);
    write("words.csv", "trial,label,t_s,grip\n1,mug,0,1\n1,mug,0.1,much\n");
    refused(at, &["trials", "import", "words.csv"], &["words.csv", "line 3", "much"]);
    write("endless.csv", "trial,label,t_s,grip\n1,mug,0,1\n1,mug,0.1,inf\n");
    refused(at, &["trials", "import", "endless.csv"], &["line 3", "inf"]);
    write("empty.csv", "");
    refused(at, &["trials", "import", "empty.csv"], &["empty.csv"]);
    refused(at, &["trials", "import", "gone.csv"], &["gone.csv"]);
    // Gaps and unequal lengths are mended, and said.
    write(
        "gaps.csv",
        "trial,label,t_s,grip\n1,mug,0,1\n1,mug,0.1,nan\n1,mug,0.2,3\n2,pen,0,1\n2,pen,0.1,2\n2,pen,0.2,2\n2,pen,0.3,2\n",
    );
    let mended = run(at, &["trials", "import", "gaps.csv"]);
    assert!(mended.code == Some(0) && mended.err.contains("warning: "), "{mended:?}");
    let store = Store::open(&at.join("trials.sqlite")).unwrap();
    assert_eq!(store.list(false).unwrap().len(), 6, "what was there is there, and the mended two");
    let readings = store.readings(5).unwrap().unwrap();
    assert_eq!(readings.values, [1.0, 2.0, 3.0]);
}

#[test]
fn no_pose_of_a_test_seed_is_in_the_training_set() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for seed in ["1", "2"] {
        json(at, &["collect", "--objects", "ball", "--trials", "30", "--seed", seed, "--json"]);
    }
    let rows = Store::open(&at.join("trials.sqlite")).unwrap().list(false).unwrap();
    let seeds: std::collections::BTreeSet<u64> = rows.iter().map(|row| row.seed).collect();
    assert_eq!(seeds.len(), 60, "no pose is met twice");
    let collections: std::collections::BTreeSet<Option<String>> = rows.iter().map(|r| r.collection.clone()).collect();
    assert_eq!(collections.len(), 2);
    let first = rows[0].collection.clone();
    let store = Store::open(&at.join("trials.sqlite")).unwrap();
    let source = DatasetQuery { collection: first, ..DatasetQuery::default() };
    let data = source.read(&store, &Default::default(), &mut |_, _| ()).unwrap();
    assert_eq!(data.examples.len(), 30);
}

#[test]
fn the_demo_goes_on_until_it_is_sure_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let story = json(at, &["demo", "--object", "box", "--seed", "3", "--no-pictures", "--no-store", "--json"]);
    assert_eq!(story["truth"], "box");
    let grasps = story["grasps"].as_array().unwrap();
    let last = grasps.last().unwrap()["pmf"].as_object().unwrap();
    let decided = story["decided"].as_str().unwrap();
    let (top, p) = last.iter().map(|(n, p)| (n, p.as_f64().unwrap())).max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
    match story["stopped_because"].as_str().unwrap() {
        "sure" => assert!(p >= 0.9 && top == decided, "{story}"),
        "grasp-limit" => assert!(grasps.len() == 4 && p < 0.9 && top == decided, "{story}"),
        other => assert!(other == "unknown" && decided == "unknown", "{story}"),
    }
    for grasp in &grasps[..grasps.len() - 1] {
        let most = grasp["pmf"].as_object().unwrap().values().map(|p| p.as_f64().unwrap()).fold(0.0, f64::max);
        assert!(most < 0.9, "it would have been sure earlier: {grasp}");
    }
    assert_eq!(catalogue().len() + 2, last.len(), "the sixteen, the empty hand, and other objects");
    let touch = &grasps.last().unwrap()["touch"];
    assert!(touch["shape"].is_string() && touch["width_mm"][0].as_f64().unwrap() > 10.0, "{touch}");
    let found = run(at, &["demo", "--object", "box", "--seed", "3", "--no-pictures", "--no-store"]);
    assert!(found.code == Some(0) && found.out.contains("Most likely:") && found.out.contains("Felt: "), "{found:?}");
    assert_eq!(run(at, &["demo", "--threshold", "1.5"]).code, Some(2));
    refused(at, &["demo", "--model", "gone.safetensors"], &["gone.safetensors"]);
}

#[test]
fn a_guided_demo_chooses_each_grasp_after_the_first() {
    let folder = tempfile::tempdir().unwrap();
    let demo = ["demo", "--guided", "--fixed", "--object", "lemon", "--seed", "4", "--threshold", "1", "--grasps", "2"];
    let rest = ["--no-pictures", "--no-store"];
    let story = json(folder.path(), &[&demo[..], &rest, &["--json"]].concat());
    let guided: Vec<_> = story["grasps"].as_array().unwrap().iter().map(|grasp| grasp["guided"].as_str()).collect();
    assert!(guided.len() == 2 && guided[0].is_none() && guided[1].is_some(), "{guided:?}");
    let found = run(folder.path(), &[&demo[..], &rest].concat());
    assert!(found.out.contains(&format!("Chosen to learn most: gripper {}.", guided[1].unwrap())), "{found:?}");
    let refusal = run(folder.path(), &["demo", "--guided", "--as-released"]);
    assert_eq!(refusal.code, Some(2), "{refusal:?}");
}

#[test]
fn a_model_of_free_objects_warns_about_a_fixed_one_and_the_other_way_round() {
    let folder = tempfile::tempdir().unwrap();
    let models = ["live", "fixed"].map(|name| format!("{}/models/{name}.safetensors", env!("CARGO_MANIFEST_DIR")));
    for (id, fixed) in [("1", &[][..]), ("2", &["--fixed"])] {
        let grasp = run(folder.path(), &[&["grasp", "lemon"], fixed].concat());
        assert_eq!(grasp.code, Some(0), "{grasp:?}");
        let with = |model: &[&str]| {
            let recognised = run(folder.path(), &[&["recognise", id], model].concat());
            assert_eq!(recognised.code, Some(0), "{recognised:?}");
            recognised.err.contains("objects only")
        };
        assert!(!with(&[]), "the shipped models suit their objects");
        let warns = [0, 1].map(|k| with(&["--model", &models[k]]));
        assert_eq!(warns, [!fixed.is_empty(), fixed.is_empty()]);
    }
}

#[test]
fn the_demo_names_objects_as_the_window_does() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let story = ["demo", "--object", "bigball", "--seed", "1", "--grasps", "1", "--no-pictures", "--no-store"];
    let told = run(at, &story);
    assert!(told.out.contains("Object: Tennis ball (bigball) ("), "{told:?}");
    assert!(told.out.contains("true object: Tennis ball (bigball))"), "{told:?}");
    let numbers = json(at, &[&story[..], &["--json"]].concat());
    assert_eq!(numbers["truth"], "bigball");
}

#[test]
fn no_folder_is_made_that_nobody_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let model = Shipped::PerfectSensors.model().unwrap();
    let refusal = save_model(&model, &at.join("not/there/m.safetensors")).unwrap_err().to_string();
    assert!(refusal.contains("not/there") && refusal.contains("cannot write"), "{refusal}");
    refused(at, &["train", "macro-layer", "--out", "not/there/m.safetensors"], &["there is no folder", "not/there"]);
    refused(at, &["demo", "--object", "box", "--grasps", "1", "--out", "not/there"], &["there is no folder", "not"]);
    assert_eq!(std::fs::read_dir(at).unwrap().count(), 0, "something was created");
}

#[test]
fn a_live_step_allocates_nothing() {
    let shape = MacroShape { inputs: 6, units: 32, hidden: Some(16), groups: vec![5], with_prior: false };
    let layer = MacroLayer::new(shape, &mut ChaCha8Rng::seed_from_u64(1));
    let mut live = LiveMacroLayer::new(&layer);
    let (count, sum) = allocations_in(|| (0..100).map(|k| live.step(&[k as f32 * 0.01; 6], &[])[0]).sum::<f32>());
    assert!(count == 0 && sum.is_finite(), "{count} allocations");
}

/// A tall box that none of the sixteen resembles.
pub(crate) const CARTON: &str = r#"<robot name="carton"><link name="carton">
  <inertial><mass value="0.12"/><inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial>
  <visual><geometry><box size="0.05 0.05 0.11"/></geometry></visual>
  <collision><geometry><box size="0.05 0.05 0.11"/></geometry></collision>
</link></robot>"#;

#[test]
fn a_model_is_taught_an_object_by_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("carton.urdf"), CARTON).unwrap();
    let taught = json(at, &["teach", "carton.urdf", "--grasps", "60", "--out", "m.safetensors", "--json"]);
    compare_numbers("json_teach", &pretty(taught.clone()));
    assert_eq!(taught["taught"], serde_json::json!(["carton"]));
    let classes: Vec<&str> = taught["classes"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
    assert!(
        classes.ends_with(&["carton"]) && catalogue().iter().all(|built_in| classes.contains(&built_in.name.as_str()))
    );

    // It knows the new object, and the others as well as before.
    let objects = "carton.urdf,lemon,case,smallbutton";
    json(at, &["collect", "--objects", objects, "--trials", "10", "--preset", "B", "--seed", "96", "--json"]);
    let trials: Vec<String> = (1..=40).map(|id| id.to_string()).collect();
    let right = |model: &[&str]| {
        let mut arguments = [&["recognise", "--json"], model].concat();
        arguments.extend(trials.iter().map(String::as_str));
        let answers = json(at, &arguments);
        let answers = answers["trials"].as_array().unwrap().clone();
        ["carton", "lemon", "case", "smallbutton"]
            .map(|name| answers.iter().filter(|answer| answer["truth"] == name && answer["decided"] == name).count())
    };
    let (before, after) = (right(&[]), right(&["--model", "m.safetensors"]));
    let others = |counts: [usize; 4]| counts[1..].iter().sum::<usize>();
    assert!(before[0] == 0 && after[0] >= 6, "{before:?} {after:?}");
    assert!(others(after) + 3 >= others(before) && others(before) >= 20, "{before:?} {after:?}");

    // Taught again from where it was left, it learns another one besides.
    std::fs::write(at.join("bar.urdf"), CARTON.replace("0.05 0.05 0.11", "0.025 0.025 0.1")).unwrap();
    let more = ["teach", "bar.urdf", "--model", "m.safetensors", "--grasps", "10", "--out", "m2.safetensors", "--json"];
    // A copy still has the name of the original in it.
    refused(at, &more, &["carton.urdf", "bar.urdf", "the class of both is \"carton\"", "--class"]);
    let more = [&more[..], &["--class", "bar"]].concat();
    assert_eq!(json(at, &more)["taught"], serde_json::json!(["carton", "bar"]));

    refused(at, &["teach", "lemon"], &["already knows", "lemon"]);
    refused(at, &["teach", "empty"], &["empty", "is no object"]);
    refused(at, &["teach", "gone.urdf"], &["gone.urdf"]);
    refused(at, &["teach", "carton.urdf", "--out", "no/folder/m.safetensors"], &["no/folder"]);
    json(at, &["train", "knn", "--out", "knn.safetensors", "--json"]);
    refused(
        at,
        &["teach", "bar.urdf", "--model", "knn.safetensors"],
        &["cannot learn new objects", "geometry-network"],
    );
}

#[test]
fn a_promise_is_calibrated_kept_in_the_model_and_shown() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    json(at, &["collect", "--objects", "ball,bigball", "--trials", "12", "--json"]);
    run(at, &["train", "knn", "--out", "mine.safetensors"]);
    let promise = ["promise", "mine.safetensors", "--rounds", "150", "--grasps", "2", "--json"];
    refused(at, &["promise", "mine.safetensors", "--rounds", "20"], &["40 rounds are too few", "300 in all"]);
    refused(at, &["promise", "no.safetensors"], &["no.safetensors"]);
    let plain = std::fs::read(at.join("mine.safetensors")).unwrap();
    let found = json(at, &[&promise[..], &["--out", "promised.safetensors"]].concat());
    assert_eq!(std::fs::read(at.join("mine.safetensors")).unwrap(), plain, "the model itself stays as it is");
    compare_numbers("json_promise", &pretty(found.clone()));
    let sets = &found["sets"];
    assert_eq!((&sets["rounds"], &sets["risk"]), (&300.into(), &0.1.into()));
    assert_eq!(sets["by"], serde_json::json!(["shape", "shape"]));
    assert!(sets["stop"]["at_most"].as_f64().unwrap() <= 0.1, "{sets}");
    // Balls of 40 and 65 mm are told apart at once.
    let demo = ["demo", "--object", "bigball", "--seed", "4", "--grasps", "2", "--no-pictures", "--no-store"];
    let with = |model: &'static str| [&demo[..], &["--model", model]].concat();
    let said = json(at, &[&with("promised.safetensors")[..], &["--json"]].concat());
    assert_eq!(said["grasps"][0]["left"], serde_json::json!(["bigball"]), "{said}");
    assert_eq!(said["threshold"], sets["stop"]["level"]);
    assert!(run(at, &with("promised.safetensors")).out.contains("  Left: Tennis ball (bigball)."), "in words");
    let plain = json(at, &[&with("mine.safetensors")[..], &["--json"]].concat());
    assert!(plain["grasps"][0].get("left").is_none());
    // Poses that a guide chooses are not those of the promise.
    let guided = json(at, &[&with("promised.safetensors")[..], &["--as-released", "--json"]].concat());
    assert!(guided["grasps"][0].get("left").is_none());
}
