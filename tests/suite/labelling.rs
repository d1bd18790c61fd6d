//! A labelling afternoon in the terminal, on bytes of the emulated gripper: flags, labels, undoing, what gets into a data
//! set, and what comes out of the store.

use crate::calibration::{calibrated, model_of_contact, model_of_pads, parts, readings, scenes, stored};
use crate::program::{json, refused, run};
use palpate_device::emulator::{EmulatedGripper, EmulatorSetup, HandPlan, HiddenParts, parse_faults, parse_script};
use palpate_exchange::export_labelled;
use palpate_lab::datasets::{DatasetQuery, SensorView};
use palpate_sim::objects::EMPTY;
use palpate_sim::scene::{Accuracy, Scene};
use palpate_store::Store;
use palpate_tactile::board::Board;
use palpate_tactile::capture::{CAPTURE_MAGIC, Captured};
use std::path::Path;

/// The bytes of five seconds of a emulated gripper that does a script.
fn capture(at: &Path, name: &str, script: &str, faults: &str) {
    let mut scene = Scene::default();
    scene.solver.accuracy = Accuracy::Draft;
    let script = parse_script(script).unwrap();
    let hand = HandPlan {
        sensors: palpate_tactile::board::SensorList::default(),
        scene,
        objects: vec![EMPTY.to_owned()],
        seed: 2,
        grasp_every_s: None,
        script,
    };
    let (parts, faults) = (HiddenParts::drawn(2), parse_faults(faults).unwrap());
    let (rate_hz, channels, most_steps, clock_start_us) = (50, 4, 30, 0);
    let setup = EmulatorSetup { hand, parts, rate_hz, channels, most_steps, clock_start_us, faults, seed: 2 };
    let mut gripper = EmulatedGripper::new(setup).unwrap();
    let mut file = CAPTURE_MAGIC.to_vec();
    for k in 1..=1000 {
        let arrived_s = 0.005 * f64::from(k);
        gripper.advance(arrived_s);
        let bytes = gripper.take_bytes();
        if !bytes.is_empty() {
            Captured::Bytes { arrived_s, bytes }.write(&mut file).unwrap();
        }
    }
    std::fs::write(at.join(name), file).unwrap();
}

/// Records a capture; the flags that are told.
fn record(at: &Path, name: &str, more: &[&str]) -> Vec<String> {
    let result = json(at, &[&["record", "--port", name, "--speed", "0", "--json"], more].concat());
    result["flags"].as_array().unwrap().iter().map(|found| found["flag"].as_str().unwrap().to_owned()).collect()
}

#[test]
fn faults_of_the_emulated_gripper_are_flagged_and_a_good_grasp_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let lemon = "rest=0.5; grasp lemon";
    for (script, faults, wanted) in [
        (lemon, "", vec![]),
        ("rest=0.5; close empty bar=0.6", "", vec!["no-contact"]),
        (lemon, "saturation=3@1.5", vec!["saturated"]),
        (lemon, "silent@2/0.6", vec!["interrupted"]),
        (lemon, "loss=0.3@1/1", vec!["cadence"]),
        (lemon, "nan=1@0", vec!["interrupted"]),
    ] {
        capture(at, "grasp.bytes", script, faults);
        let result = record(at, "grasp.bytes", &["--object", "lemon"]);
        for flag in &wanted {
            assert!(result.iter().any(|found| found == flag), "{faults}: {result:?}");
        }
        assert!(
            result.len() <= wanted.len() + 1 && result.is_empty() == wanted.is_empty(),
            "{script} {faults}: {result:?}"
        );
    }
    // An empty hand feels nothing, and should not.
    capture(at, "grasp.bytes", "rest=0.5; close empty bar=0.6", "");
    assert!(record(at, "grasp.bytes", &["--object", "empty"]).is_empty());
    let list = run(at, &["trials", "list"]).out;
    let flagged = list.lines().filter(|line| line.contains("no contact")).count();
    assert_eq!(flagged, 1, "{list}");
    let shown = run(at, &["trials", "show", "3"]).out;
    assert!(shown.contains("flagged saturated: right pad saturated for"), "{shown}");
    let shown = json(at, &["trials", "show", "1", "--json"]);
    let spark = shown["labels"]["sparkline"][0].as_array().unwrap();
    let at_bin = |k: usize| spark[k].as_f64().unwrap();
    assert!(spark.len() == 48 && at_bin(30) > at_bin(1) + 300.0, "the pad is pressed later: {spark:?}");
    assert!(shown["labels"]["cadence"].as_str().unwrap().starts_with("50.0"), "{shown}");
}

#[test]
fn an_afternoon_of_labels_from_the_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    capture(at, "grasp.bytes", "rest=0.5; grasp lemon", "");
    record(at, "grasp.bytes", &[]);
    record(at, "grasp.bytes", &["--object", "cube"]);
    let list = run(at, &["trials", "list"]).out;
    assert!(list.contains("unlabelled") && list.contains("cube"), "{list}");
    refused(at, &["record", "--port", "grasp.bytes", "--object", "a\tb"], &["control character"]);
    let misspelt = run(at, &["trials", "label", "1", "lemmon"]);
    assert!(misspelt.code == Some(0) && misspelt.err.contains("new class"), "{misspelt:?}");
    let said = |arguments: &[&str]| {
        let ran = run(at, arguments);
        assert_eq!(ran.code, Some(0), "{arguments:?}: {ran:?}");
        ran.out
    };
    assert!(said(&["trials", "undo"]).contains("Undone: trial 1: labelled lemmon"));
    assert!(said(&["trials", "label", "1", "lemon", "--unsure"]).contains("Lemon, unsure"));
    said(&["trials", "note", "1", "slipped at the end"]);
    said(&["trials", "tag", "1", "wet", "late"]);
    let list = said(&["trials", "list"]);
    assert!(list.contains("unsure, [wet, late], \"slipped at the end\""), "{list}");
    // What the emulator has sent never passes for real data.
    assert!(list.contains("  emulated  ") && !list.contains("serial"), "{list}");
    assert!(said(&["trials", "show", "1"]).contains("(emulated gripper on "));
    said(&["trials", "export", "--labelled", "--out", "set"]);
    let card = std::fs::read_to_string(at.join("set/README.md")).unwrap();
    assert!(card.contains("# Labelled grasps of an emulated soft gripper"), "{card}");
    assert!(card.contains("- emulated gripper: ") && !card.contains("- real gripper"), "{card}");
    said(&["trials", "discard", "2"]);
    assert!(said(&["trials", "undo"]).contains("trial 2: discarded"));
    assert!(said(&["trials", "redo"]).contains("Redone: "));
    said(&["trials", "delete", "1"]);
    refused(at, &["trials", "label", "1", "ball"], &["trial 1", "restore"]);
    said(&["trials", "restore", "1"]);
    let plan = json(at, &["plan", "--json"]);
    let of = |name: &str| plan["objects"].as_array().unwrap().iter().find(|o| o["name"] == name).unwrap().clone();
    assert_eq!((&of("lemon")["done"], &of("cube")["done"], &plan["wanted"]), (&1.into(), &0.into(), &800.into()));
    assert_ne!(plan["next"]["object"], "lemon");
    said(&["plan", "set", "mug", "40"]);
    assert!(said(&["plan", "remove", "lemon"]).contains("not planned"));
    refused(at, &["plan", "set", "mug", "0"], &["1 to 1000"]);
    refused(at, &["plan", "remove", "cup"], &["\"cup\" is not in the plan"]);
    let journal = json(at, &["trials", "journal", "--json", "--last", "100"]);
    let journal = journal.as_array().unwrap();
    assert_eq!((journal.len(), &journal[0]["what"], &journal[1]["what"]), (13, &"plan".into(), &"plan".into()));
    assert!(said(&["trials", "journal"]).contains("undoes 1"));
    refused(at, &["snapshot", "--trial", "1", "--out", "x.png"], &["was not simulated", "palpate trials export 1"]);
    refused(at, &["recognise", "1"], &["trial 1", "no part is mounted"]);
    refused(
        at,
        &["recognise", "1", "--model", &model_of_contact(at)],
        &["trial 1", "do not measure contact pressure: choose a model of the signals of parts"],
    );
    refused(at, &["trials", "label", "9", "ball"], &["no trial 9"]);
}

#[test]
fn what_is_labelled_is_learned_from_and_leaves_the_store_whole() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let (parts, [scene, _]) = (parts(8, false), scenes());
    let (board, calibrations) = calibrated(&parts, 8);
    let board = Board { emulated: true, ..board };
    let mut store = Store::open(&at.join("trials.sqlite")).unwrap();
    for (sensor, calibration) in &calibrations {
        store.calibrations().add(&calibration.record).unwrap();
        store.calibrations().mount(*sensor, &calibration.record.part).unwrap();
    }
    let mut grasped = |object: &str, label: &str, seed: u64| {
        let script = format!("rest=0.5; grasp {object}");
        let (_, readings) = readings(&parts, &scene, &script, 5.0, seed);
        stored(&mut store, &board, readings, &scene, label, 0.5)
    };
    let (kept, other, unknown, discarded) =
        (grasped("lemon", "lemon", 1), grasped("ball", "ball", 2), grasped("ball", "", 3), grasped("ball", "cube", 4));
    store.delete(&[discarded]).unwrap();
    let read = |store: &Store| DatasetQuery::default().read(store, &SensorView::default(), &mut |_, _| ()).unwrap();
    let data = read(&store);
    let ids: Vec<i64> = data.examples.iter().map(|example| example.id).collect();
    assert_eq!((ids, data.labels.classes.len()), (vec![kept, other], 2));
    // Cards of models print it.
    assert!(data.about.query.is_empty() && data.about.emulated);
    assert!(data.about.described().contains("some of an emulated gripper"), "{}", data.about.described());
    // One without a label is recognised all the same.
    let model = model_of_pads(at);
    let said = json(at, &["recognise", &unknown.to_string(), "--model", &model, "--json"]);
    assert!(said["trials"][0]["truth"].is_null() && said["trials"][0]["decided"].is_string(), "{said}");
    refused(at, &["recognise", &discarded.to_string()], &["restore"]);
    store.labels().set_guess(kept, "ds-lstm", &[("ball".to_owned(), 0.75), ("lemon".to_owned(), 0.25)]).unwrap();
    store.labels().set_note(kept, "with a \"quote\",\nand a line").unwrap();
    let result = run(at, &["trials", "export", "--labelled", "--out", "out"]);
    assert!(result.code == Some(0) && result.out.contains("2 trial(s), 2 of them"), "{result:?}");
    let names = |folder: &str| {
        let entries = std::fs::read_dir(at.join(folder)).unwrap().map(|entry| entry.unwrap().file_name());
        let mut names: Vec<String> = entries.map(|name| name.into_string().unwrap()).collect();
        names.sort();
        names
    };
    assert_eq!(names("out"), ["README.md", "raw", "signals.csv", "trials.csv"]);
    assert_eq!(
        names("out/raw"),
        ["trial_1_lemon.bytes", "trial_1_lemon.csv", "trial_2_ball.bytes", "trial_2_ball.csv"]
    );
    let list = std::fs::read_to_string(at.join("out/trials.csv")).unwrap();
    assert!(
        list.contains("\"with a \"\"quote\"\",\nand a line\"") && list.contains(",ball,0.75,1; 2; 3; 4,"),
        "{list}"
    );
    // Taken in again, it is the same data set.
    let imported = run(at, &["trials", "import", "out/signals.csv", "--store", "again.sqlite"]);
    assert!(imported.code == Some(0) && imported.out.contains("2 trial(s) added"), "{imported:?}");
    let again = read(&Store::open(&at.join("again.sqlite")).unwrap());
    // The export also has the force of each pad, which is the same signal as its pressure.
    let width = data.channels.len();
    assert_eq!((&again.channels[..width], &again.labels), (&data.channels[..], &data.labels));
    assert!(again.channels[width..].iter().all(|name| name.starts_with("force_")), "{:?}", again.channels);
    for (one, other) in data.examples.iter().zip(&again.examples) {
        assert_eq!(one.class, other.class);
        // The import puts samples onto even times: each lies between those that were exported.
        for (t, row) in other.grasp.t_s.iter().zip(other.grasp.values.chunks(again.channels.len())) {
            let after = one.grasp.t_s.partition_point(|own| own < t).min(one.grasp.t_s.len() - 1);
            let own = |k: usize| &one.grasp.values[k * width..(k + 1) * width];
            for ((value, a), b) in row.iter().zip(own(after.saturating_sub(1))).zip(own(after)) {
                let slack = 1e-3 * (1.0 + a.abs().max(b.abs()));
                assert!((a.min(*b) - slack..=a.max(*b) + slack).contains(value), "{value} at {t}: {a} {b}");
            }
        }
    }
    // Nothing is overwritten, and nothing half-made is left behind.
    refused(at, &["trials", "export", "--labelled", "--out", "out"], &["out", "is not empty"]);
    std::fs::write(at.join("file"), "mine").unwrap();
    refused(at, &["trials", "export", "--labelled", "--out", "file/out"], &["cannot write"]);
    refused(at, &["trials", "export", "--labelled", "--out", "new", "--store", "none.sqlite"], &["no trial", "label"]);
    std::fs::create_dir(at.join("empty")).unwrap();
    assert!(export_labelled(&store, &at.join("empty")).is_ok());
    assert!(export_labelled(&store, &at.join("empty")).is_err_and(|error| error.to_string().contains("is not empty")));
    let left = names("").into_iter().filter(|name| name.contains("unfinished")).count();
    assert_eq!(left, 0);
}
