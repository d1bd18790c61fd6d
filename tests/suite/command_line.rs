//! What the program prints and how it exits, run as a user would run it.

use crate::program::{json, palpate, ran, refused, run};
use palpate::manual::TOPICS;
use palpate_sim::objects::catalogue;
use palpate_sim::scene::Effect;
use palpate_store::Store;
use serde_json::Value;
use std::collections::BTreeSet;
use std::process::Stdio;
use std::time::Duration;

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

#[test]
fn a_grasp_as_json_has_what_scripts_rely_on() {
    let folder = folder();
    let report = json(folder.path(), &["grasp", "lemon", "--json"]);
    assert_eq!((&report["object"], &report["trial_id"]), (&"lemon".into(), &1.into()));
    assert_eq!(
        (&report["finite"], &report["converged"], &report["warnings"]),
        (&true.into(), &true.into(), &Value::Array(vec![]))
    );
    assert!(report["cpu_ms"].as_f64().unwrap() > 0.0);
    assert!((0.1..2.0).contains(&report["contact_onset_s"].as_f64().unwrap()));
    for key in ["force_n", "curvature_per_m", "pressure_pa"] {
        let pair = report["hold"][key].as_array().unwrap();
        assert!(pair.len() == 2 && pair.iter().all(|value| value.as_f64().unwrap() > 0.0), "{key}: {pair:?}");
    }
    let crossing = ["grasp", "empty", "--json", "--no-store", "--set", "effects.finger-contact=off"];
    let empty = json(folder.path(), &crossing);
    assert_eq!((&empty["contact_onset_s"], &empty["trial_id"]), (&Value::Null, &Value::Null));
    assert!(!empty["warnings"].as_array().unwrap().is_empty(), "fingers that cross are worth a word");
}

#[test]
fn a_scene_is_explained_effect_by_effect() {
    let folder = folder();
    let at = folder.path();
    std::fs::write(at.join("scene.toml"), "[effects]\nfriction = \"off\"\n[solver]\naccuracy = \"draft\"\n").unwrap();
    let found = json(at, &["scene", "explain", "scene.toml", "--set", "object.source=ball", "--fixed", "--json"]);
    assert_eq!(found["object"], "ball");
    let effects = found["effects"].as_array().unwrap();
    let of = |name: &str| effects.iter().find(|effect| effect["name"] == name).unwrap();
    assert_eq!(effects.len(), Effect::ALL.len());
    assert_eq!((&of("friction")["on"], &of("friction")["setting"]), (&false.into(), &"off".into()));
    assert!(of("friction")["change"]["force_n"].as_f64().unwrap() > 1e-3);
    assert_eq!((&of("free-object")["on"], &of("finger-gravity")["on"]), (&false.into(), &true.into()));
    for effect in effects {
        assert!(effect["number"].is_number() && effect["threshold"].is_number() && effect["cost_share"].is_number());
        assert!(!effect["reason"].as_str().unwrap().is_empty(), "{effect}");
    }
    let text = run(at, &["scene", "explain", "empty", "--accuracy", "draft"]);
    assert!(text.code == Some(0) && text.err.is_empty(), "{text:?}");
    for effect in Effect::ALL {
        assert!(text.out.contains(effect.name()), "{text:?}");
    }
    refused(at, &["scene", "explain", "lemon", "--set", "effects.crep=on"], &["effects.crep", "effects.creep"]);
    refused(at, &["scene", "explain", "nothing.toml"], &["nothing.toml"]);
    refused(at, &["scene", "explain", "scene.toml", "--scene", "scene.toml"], &["two scene files"]);
}

#[test]
fn text_results_go_to_standard_output_and_warnings_beside() {
    let folder = folder();
    let ran = run(folder.path(), &["grasp", "empty", "--set", "effects.finger-contact=off"]);
    let out = ran.out.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(out.contains("first contact none") && out.contains("stored trial 1"), "{ran:?}");
    assert!(ran.err.starts_with("warning: the fingers pass"), "{ran:?}");
}

#[test]
fn trials_are_listed_shown_exported_deleted_and_restored() {
    let folder = folder();
    let at = folder.path();
    for object in ["ball", "cube"] {
        assert_eq!(run(at, &["grasp", object, "--seed", "3"]).code, Some(0));
    }
    let listed = json(at, &["trials", "list", "--json"]);
    let objects: Vec<&str> = listed.as_array().unwrap().iter().map(|row| row["object"].as_str().unwrap()).collect();
    assert_eq!(objects, ["ball", "cube"]);
    let shown = run(at, &["trials", "show", "2"]);
    assert!(shown.code == Some(0) && shown.out.contains("cube"), "{shown:?}");
    assert!(shown.out.contains("effect creep off (auto): the load lasts 2.00 s"), "{shown:?}");
    assert_eq!(json(at, &["trials", "show", "2", "--json"])["plan"].as_array().unwrap().len(), Effect::ALL.len());
    let exported = run(at, &["trials", "export", "1", "2", "--out", "csv"]);
    assert_eq!(exported.code, Some(0), "{exported:?}");
    let files = std::fs::read_dir(at.join("csv")).unwrap().count();
    assert_eq!(files, 4, "a trial and its contacts each");
    assert_eq!(run(at, &["trials", "delete", "1"]).code, Some(0));
    refused(at, &["trials", "show", "1"], &["no trial 1"]);
    assert_eq!(run(at, &["trials", "restore", "1"]).code, Some(0));
    assert_eq!(run(at, &["trials", "show", "1"]).code, Some(0));
    refused(at, &["trials", "delete", "1", "99"], &["no trial 99"]);
    assert_eq!(json(at, &["trials", "list", "--json"]).as_array().unwrap().len(), 2, "all or none are deleted");
}

#[test]
fn exported_csv_names_its_units_and_is_complete() {
    let folder = folder();
    let at = folder.path();
    assert_eq!(run(at, &["grasp", "ball", "--out", "ball.csv"]).code, Some(0));
    let text = std::fs::read_to_string(at.join("ball.csv")).unwrap();
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    for column in ["t_s", "command"] {
        assert!(header.contains(&column), "{header:?}");
    }
    for unit in ["[bar]", "[1/m]", "[Pa]", "[N]", "[rad]", "[m]"] {
        assert!(header.iter().any(|column| column.ends_with(unit)), "no column in {unit}: {header:?}");
    }
    let rows: Vec<&str> = lines.collect();
    assert_eq!(rows.len(), 300);
    assert!(rows.iter().all(|row| row.split(',').count() == header.len()));
    assert!(at.join("ball.contacts.csv").is_file());
}

#[test]
fn wrong_names_and_files_are_refused_in_words() {
    let folder = folder();
    let at = folder.path();
    std::fs::write(at.join("notes.txt"), "hello").unwrap();
    std::fs::write(at.join("cut.urdf"), "<robot name='x'><link name='a'><visual>").unwrap();
    for name in ["empty.stl", "empty.obj", "empty.urdf"] {
        std::fs::write(at.join(name), "").unwrap();
        refused(at, &["grasp", name], &[name, "the file is empty"]);
    }
    std::fs::write(at.join("prose.obj"), "This is no mesh.\n").unwrap();
    refused(at, &["grasp", "prose.obj"], &["no corners", "no faces"]);
    std::fs::create_dir(at.join("folder")).unwrap();
    refused(at, &["grasp", "folder"], &["is a folder", ".urdf, .obj or .stl"]);
    std::fs::write(at.join("typo.toml"), "[gripper.finger]\njonts = 12\n").unwrap();
    refused(at, &["grasp", "lemmon"], &["lemmon", "did you mean \"lemon\""]);
    refused(at, &["grasp", "gone.urdf"], &["cannot read", "gone.urdf"]);
    refused(at, &["grasp", "notes.txt"], &[".txt", ".urdf"]);
    refused(at, &["grasp", "cut.urdf"], &["cut", "malformed"]);
    refused(at, &["grasp", "--scene", "typo.toml"], &["jonts", "joints"]);
    refused(at, &["grasp", "ball", "--set", "gripper.finger.joints=900"], &["joints", "80"]);
    refused(at, &["grasp", "ball", "--set", "gripper.finger.length=nan"], &["length"]);
    refused(at, &["grasp", "ball", "--layout", "C9"], &["C9", "C8"]);
    refused(at, &["grasp", "ball", "--out", "/proc/nowhere/x.csv"], &["/proc/nowhere"]);
    refused(at, &["snapshot", "--trial", "77", "--out", "x.png"], &["no trial 77"]);
    refused(at, &["trials", "export", "12", "--out", "x"], &["no trial 12"]);
}

#[test]
fn wrong_use_exits_with_2() {
    let folder = folder();
    let at = folder.path();
    for arguments in [
        &["grasp", "ball", "--accuracy", "perfect"][..],
        &["grasp", "--accuracy", "2"],
        &["fly"],
        &["snapshot"],
        &["trials", "show", "x"],
    ] {
        let ran = run(at, arguments);
        assert_eq!(ran.code, Some(2), "{ran:?}");
        assert!(ran.err.contains("error:"), "{ran:?}");
    }
}

/// Every command: what succeeds, and what fails. `--help` succeeds and an unknown option is wrong use for all.
const EXIT_CODES: [(&str, &str, &str); 26] = [
    ("grasp", "ball --no-store", "nothing.urdf"),
    ("demo", "--object ball --grasps 1 --no-store", "--object nothing"),
    ("collect", "--objects empty --trials 1", "--objects nothing"),
    ("train", "", "knn --out m.safetensors --collection nothing"),
    ("promise", "", "nothing.safetensors"),
    ("teach", "", "nothing.urdf"),
    ("evaluate", "", "--models nothing.safetensors"),
    ("recognise", "1", "99"),
    ("record", "--list", "--port nothing"),
    ("replay", "1 --speed 0", "99"),
    ("snapshot", "ball --out a.png --size 64x64", "nothing.urdf --out b.png"),
    ("check", "a.json ball --bless", "nowhere/a.json ball --bless"),
    ("plot", "1 --out a.svg", "99 --out b.svg"),
    ("movie", "", "99 --out a.gif"),
    ("scene", "explain empty", "explain nothing.urdf"),
    ("plan", "show", "set nothing 5000000"),
    ("trials", "list", "show 99"),
    ("adapt", "", "--port nothing"),
    ("calibrate", "list", "flexL --points nothing.csv"),
    ("fit", "", "99"),
    ("gap", "", "99"),
    ("doctor", "--wiring", "nothing"),
    ("serve", "--schema", "--port nothing"),
    ("emulate", "--print-secrets", "--link l --secrets nothing.json"),
    ("study", "", "merge nothing --out x"),
    ("help", "store", ""),
];

#[test]
fn every_command_exits_with_0_1_or_2() {
    let folder = folder();
    let at = folder.path();
    let words = |command: &str, rest: &str| {
        let words = [command].into_iter().chain(rest.split_whitespace());
        words.map(str::to_owned).collect::<Vec<String>>()
    };
    assert_eq!(run(at, &["grasp", "ball"]).code, Some(0));
    let help = run(at, &["--help"]).out;
    let listed = help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let listed: Vec<&str> =
        listed.filter(|line| !line.starts_with("     ")).filter_map(|line| line.split_whitespace().next()).collect();
    let known: Vec<&str> = EXIT_CODES.iter().map(|(command, ..)| *command).chain(["bench"]).collect();
    assert!(listed.len() > 20 && listed.iter().all(|command| known.contains(command)), "{listed:?}");
    for (command, succeeds, fails) in EXIT_CODES {
        for (rest, code) in [("--help", 0), (succeeds, 0), (fails, 1), ("--no-such-option", 2)] {
            if !rest.is_empty() {
                let ran = run(at, &words(command, rest));
                assert_eq!(ran.code, Some(code), "{command} {rest}: {ran:?}");
            }
        }
    }
}

#[test]
fn without_a_display_it_says_so_and_names_the_demo() {
    let folder = folder();
    let ran = run::<&str>(folder.path(), &[]);
    assert_eq!(ran.code, Some(1));
    let lines: Vec<&str> = ran.err.lines().collect();
    assert!(lines.len() == 1 && lines[0].contains("no display") && lines[0].contains("palpate demo"), "{ran:?}");
}

#[test]
fn a_dead_display_is_told_alike() {
    let folder = folder();
    let output = palpate(&folder.path().join("t.sqlite")).env("DISPLAY", ":987").output().unwrap();
    let ran = ran(&output);
    assert_eq!(ran.code, Some(1), "{ran:?}");
    assert!(!ran.err.contains("panicked"), "{ran:?}");
    // Where the window's libraries are missing too, those come first.
    assert!(ran.err.contains("palpate demo") || ran.err.contains("the window needs"), "{ran:?}");
}

#[test]
fn readers_may_leave_early() {
    let folder = folder();
    let mut child = palpate(&folder.path().join("t.sqlite"))
        .args(["grasp", "--print-scene"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let ran = ran(&child.wait_with_output().unwrap());
    assert!(ran.code == Some(0) && ran.err.is_empty(), "{ran:?}");
}

#[test]
fn a_printed_scene_is_the_scene() {
    let folder = folder();
    let at = folder.path();
    let printed = run(at, &["grasp", "cube", "--print-scene", "--set", "gripper.finger.joints=12"]).out;
    std::fs::write(at.join("scene.toml"), &printed).unwrap();
    let again = run(at, &["grasp", "--print-scene", "--scene", "scene.toml"]).out;
    assert_eq!(printed, again);
    assert!(printed.contains("joints = 12") && printed.contains("source = \"cube\""));
}

#[test]
fn the_bench_reports_rows() {
    let folder = folder();
    let report = json(folder.path(), &["bench", "physics", "--json", "--runs", "1"]);
    let rows = report.as_array().or(report["rows"].as_array()).unwrap();
    for scene in ["sphere_fixed", "sphere_free", "box_free"] {
        let row = rows.iter().find(|row| row["scene"] == scene).unwrap();
        for key in ["cpu_ms_median", "us_per_step", "newton_mean", "newton_max"] {
            assert!(row[key].as_f64().unwrap() > 0.0, "{scene}: {key}");
        }
        assert!(row["accuracy"].is_string());
    }
    // Finer is nearer to the truth, and costs more steps.
    let row = |accuracy: &str| rows.iter().find(|r| r["scene"] == "sphere_fixed" && r["accuracy"] == accuracy).unwrap();
    let off = |accuracy: &str| row(accuracy)["error"]["curvature_per_m"].as_f64().unwrap();
    assert!(off("draft") > off("standard") && off("standard") > off("1e-5"));
    assert!(row("1e-5")["step_s"].as_f64().unwrap() < row("3e-4")["step_s"].as_f64().unwrap());
}

#[test]
fn a_grasp_to_a_tolerance_tells_its_error() {
    let folder = folder();
    let at = folder.path();
    let grasp =
        |accuracy: &str| json(at, &["grasp", "ball", "--accuracy", accuracy, "--error-band", "--json", "--no-store"]);
    let (draft, fine) = (grasp("draft"), grasp("1e-5"));
    for key in ["curvature_per_m", "curvature_share", "pressure_pa", "pressure_share", "force_n", "force_share"] {
        let value = |report: &Value| report["error_band"][key].as_f64().unwrap();
        assert!(value(&fine) > 0.0 && value(&fine) < value(&draft), "{key}");
    }
    assert_eq!(fine["accuracy"], "1e-5");
    assert!(fine["quality"]["rejected_steps"].as_u64().unwrap() > 0 && fine["quality"]["missed_steps"] == 0);
    let found = run(at, &["grasp", "ball", "--set", "solver.accuracy=1e-3", "--error-band", "--no-store"]);
    assert!(found.code == Some(0) && found.out.contains("shortest step") && found.out.contains("±"), "{found:?}");
    refused(at, &["grasp", "ball", "--set", "solver.accuracy=7"], &["solver.accuracy = 7", "0.1"]);
}

#[test]
fn the_demo_tells_the_same_story_for_the_same_seed() {
    let folder = folder();
    let story = |out: &str| {
        let fixed =
            ["demo", "--seed", "5", "--grasps", "2", "--threshold", "1", "--no-store", "--no-pictures", "--json"];
        json(folder.path(), &[&fixed[..], &["--out", out]].concat())
    };
    let (first, second) = (story("a"), story("b"));
    assert_eq!(first, second);
    assert_eq!(first["grasps"].as_array().unwrap().len(), 2);
    let name = first["truth"].as_str().unwrap();
    assert!(catalogue().iter().any(|built_in| built_in.name == name), "{name}");
}

#[test]
fn a_data_set_survives_a_kill_and_is_joined_from_parts() {
    let folder = folder();
    let at = folder.path();
    let collect = ["collect", "--objects", "ball,smallcube", "--trials", "12", "--preset", "A", "--json"];
    // Killed as soon as something is stored, and taken up again.
    let mut child = palpate(&at.join("trials.sqlite")).args(collect).stdout(Stdio::null()).spawn().unwrap();
    while Store::open(&at.join("trials.sqlite")).unwrap().list(false).unwrap().is_empty() {
        assert_eq!(child.try_wait().unwrap(), None, "it ended before it stored anything");
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let report = json(at, &collect);
    let count = |key: &str| report[key].as_u64().unwrap();
    assert_eq!(count("stored") + count("known"), 24, "{report}");
    assert!(count("known") > 0 && count("unsound") == 0, "{report}");
    // The same in two parts, joined.
    for part in ["1/2", "2/2"] {
        let store = format!("part{}.sqlite", &part[..1]);
        let ran = run(at, &[&collect[..], &["--shard", part, "--store", &store]].concat());
        assert_eq!(ran.code, Some(0), "{ran:?}");
    }
    let merged = run(at, &["trials", "merge", "part1.sqlite", "part2.sqlite", "--store", "joined.sqlite"]);
    assert!(merged.code == Some(0) && merged.out.matches("12 trial(s) added").count() == 2, "{merged:?}");
    let seeds = |store: &str| {
        let rows = Store::open(&at.join(store)).unwrap().list(false).unwrap();
        rows.into_iter().map(|row| (row.object, row.seed)).collect::<BTreeSet<_>>()
    };
    assert!(seeds("trials.sqlite") == seeds("joined.sqlite") && seeds("joined.sqlite").len() == 24);
    // As in the window, a list leaves them out and says so; one with filters shows what `matching` takes.
    let listed = run(at, &["trials", "list"]);
    assert!(listed.out.contains("no trials but those of data sets"), "{listed:?}");
    assert!(listed.err.contains("24 trial(s) of data sets are not listed; --data-sets lists them"), "{listed:?}");
    for more in ["--data-sets", "--object=ball"] {
        let listed = run(at, &["trials", "list", more]);
        assert!(listed.err.is_empty() && listed.out.contains("Rubber ball"), "{listed:?}");
    }
    refused(at, &["trials", "merge", "gone.sqlite"], &["gone.sqlite", "no such file"]);
    refused(at, &["collect", "--objects", "lemmon"], &["lemmon", "lemon"]);
    assert_eq!(run(at, &["collect", "--shard", "3/2"]).code, Some(2));
}

#[test]
fn help_lists_and_prints_topics_and_commands() {
    let folder = folder();
    let at = folder.path();
    let list = run(at, &["help"]);
    assert!(list.code == Some(0) && list.err.is_empty(), "{list:?}");
    for topic in TOPICS {
        let summary = topic.summary().split([':', '.']).next().unwrap();
        assert!(list.out.contains(&format!("\n  {}", topic.name)) && list.out.contains(summary), "{list:?}");
        let page = run(at, &["help", topic.name]);
        assert!(page.code == Some(0) && page.out.contains(summary) && page.out.lines().count() > 10, "{page:?}");
        assert!(!page.out.contains('\x1b') && page.err.is_empty(), "emphasis belongs to a terminal: {page:?}");
    }
    for command in ["grasp", "collect", "train", "evaluate", "recognise", "snapshot", "demo", "trials", "bench", "help"]
    {
        let long = run(at, &[command, "--help"]);
        assert!(long.code == Some(0) && long.out.contains("Usage:") && long.out.contains("Examples:"), "{long:?}");
        assert_eq!(run(at, &["help", command]).out, long.out);
    }
    assert_eq!(run(at, &["help", "trials", "label"]).out, run(at, &["trials", "label", "--help"]).out);
    for (wrong, nearest) in
        [(&["help", "scnes"][..], "scenes"), (&["help", "grsp"], "grasp"), (&["help", "trials", "lable"], "label")]
    {
        let ran = run(at, wrong);
        assert!(ran.code == Some(2) && ran.out.is_empty() && ran.err.contains(&format!("'{nearest}'")), "{ran:?}");
    }
}

#[test]
fn the_readme_is_short_and_begins_with_two_commands() {
    let readme = include_str!("../../README.md");
    assert!(readme.lines().count() <= 150, "the manual belongs into assets/help");
    assert!(readme.contains("\n    cargo run --release ") && readme.contains("\n    cargo test "));
    for topic in TOPICS.iter().filter(|topic| topic.name != "start") {
        assert!(readme.contains(topic.name), "the README does not name {}", topic.name);
    }
}

#[test]
fn misspelt_words_are_answered_with_the_nearest() {
    let folder = folder();
    for (arguments, wanted) in [
        (&["lemn"][..], "'lemon'"),
        (&["grsp", "lemon"][..], "'grasp'"),
        (&["colect", "--trials", "3"][..], "'collect'"),
        (&["trails", "list"][..], "'trials'"),
    ] {
        let ran = run(folder.path(), arguments);
        assert!(ran.code == Some(2) && ran.err.contains("similar value") && ran.err.contains(wanted), "{ran:?}");
    }
    // The store before it is no word.
    let ran = run(folder.path(), &["lemn", "--model", "grasp"]);
    assert!(ran.code == Some(2) && ran.err.contains("'lemon'"), "{ran:?}");
}

#[test]
fn commands_that_read_create_nothing() {
    let folder = folder();
    let at = folder.path();
    let list = run(at, &["trials", "list"]);
    assert!(list.code == Some(0) && list.out.contains("no trials yet"), "{list:?}");
    assert_eq!(json(at, &["trials", "list", "--json"]), Value::Array(vec![]));
    let plan = run(at, &["plan"]);
    assert!(plan.code == Some(0) && plan.out.contains("0 of 800 trials"), "{plan:?}");
    assert_eq!(run(at, &["calibrate", "list"]).code, Some(0));
    for arguments in [
        &["trials", "show", "1"][..],
        &["trials", "export", "1", "--out", "x.csv"][..],
        &["recognise", "1"][..],
        &["replay", "1"][..],
        &["snapshot", "--trial", "1", "--out", "x.png"][..],
        &["evaluate"][..],
    ] {
        refused(at, arguments, &["there is no store"]);
    }
    for arguments in [
        &["calibrate", "show", "1"][..],
        &["calibrate", "withdraw", "1"][..],
        &["calibrate", "export", "--out", "c.json"][..],
        &["calibrate", "tare", "--dry-run"][..],
    ] {
        refused(at, arguments, &["no calibrations yet"]);
    }
    refused(at, &["calibrate", "flexL", "--part", "A7", "--points", "none.csv"], &["none.csv"]);
    refused(at, &["calibrate", "flexL", "--points", "none.csv"], &["give it a name"]);
    assert_eq!(json(at, &["calibrate", "list", "--json"])["calibrations"].as_array().map(Vec::len), Some(0));
    assert_eq!(std::fs::read_dir(at).unwrap().count(), 0, "something was created");
    // A folder that was not asked for is not created either.
    for arguments in [&["trials", "list"][..], &["grasp", "lemon"][..]] {
        let ran = ran(&palpate(&at.join("not/there.sqlite")).args(arguments).output().unwrap());
        assert!(ran.code == Some(1) && ran.err.contains("there is no folder"), "{ran:?}");
    }
    assert_eq!(std::fs::read_dir(at).unwrap().count(), 0, "something was created");
}

#[cfg(unix)]
#[test]
fn an_interrupted_training_and_study_fail_and_say_what_is_kept() {
    let folder = folder();
    let at = folder.path();
    let collect = ["collect", "--objects", "ball,cube", "--trials", "30", "--accuracy", "draft"];
    assert_eq!(run(at, &collect).code, Some(0));
    let interrupted = |arguments: &[&str], begun: &dyn Fn() -> bool| {
        let mut command = palpate(&at.join("trials.sqlite"));
        command.args(arguments).current_dir(at).stderr(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().unwrap();
        while !begun() {
            assert_eq!(child.try_wait().unwrap(), None, "it ended before it began");
            std::thread::sleep(Duration::from_millis(10));
        }
        // It is told right after this sign when to stop.
        std::thread::sleep(Duration::from_millis(300));
        assert!(std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
        ran(&child.wait_with_output().unwrap())
    };
    let trained = interrupted(&["train", "ids-lstm"], &|| at.join("data").exists());
    assert!(
        trained.code == Some(1) && trained.err.contains("error: training stopped; no model was saved"),
        "{trained:?}"
    );
    let count = || Store::open(&at.join("trials.sqlite")).unwrap().list(false).unwrap().len();
    let study = interrupted(&["study", "layouts", "--quick", "--out", "s"], &|| count() > 70);
    assert!(study.code == Some(1) && study.err.contains("error: stopped after a part of layouts"), "{study:?}");
    assert!(study.err.contains("grasps simulated for it stay in ") && study.err.contains("trials.sqlite"), "{study:?}");
}

#[cfg(unix)]
#[test]
fn an_interrupted_collection_says_what_is_kept() {
    let folder = folder();
    let store = folder.path().join("set.sqlite");
    let arguments = ["collect", "--objects", "ball", "--trials", "100000", "--accuracy", "draft", "--threads", "1"];
    let mut command = palpate(&store);
    let mut child = command.args(arguments).stderr(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    while !Store::open(&store).is_ok_and(|store| store.list(false).is_ok_and(|rows| rows.len() > 2)) {
        assert_eq!(child.try_wait().unwrap(), None, "it ended before it stored anything");
        std::thread::sleep(Duration::from_millis(50));
    }
    let id = child.id().to_string();
    assert!(std::process::Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    let ran = ran(&child.wait_with_output().unwrap());
    assert!(ran.code == Some(1) && ran.err.contains("of 100000 trials are kept in"), "{ran:?}");
    assert!(ran.err.contains("the same command resumes"), "{ran:?}");
}
