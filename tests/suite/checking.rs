//! `palpate check`: golden signals, written, found the same, and found different.

use crate::program::{json, misused, run};
use std::path::Path;

fn code(folder: &Path, arguments: &[&str]) -> i32 {
    run(folder, arguments).code.unwrap()
}

#[test]
fn a_grasp_is_the_same_as_itself_and_as_a_finer_one_but_not_as_that_of_a_stiffer_finger() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let ball = ["check", "ball.json", "ball", "--fixed"];
    let missing = run(at, &ball);
    assert!(missing.code == Some(3) && missing.err.contains("--bless makes it"), "{missing:?}");
    assert_eq!(code(at, &[&ball[..], &["--bless"]].concat()), 0);
    assert_eq!(code(at, &ball), 0);
    assert_eq!(code(at, &[&ball[..], &["--accuracy", "reference"]].concat()), 0, "within the stated accuracy");
    let stiffer = run(at, &[&ball[..], &["--set", "gripper.pad.modulus=200000"]].concat());
    assert!(stiffer.code == Some(1) && stiffer.out.contains("DIFFERS"), "{stiffer:?}");
    let short = ["--set", "timing.duration_s=0.5", "--json"];
    let lost = json_rows(at, &[&ball[..], &short].concat());
    let named = |name: &str| lost.iter().find(|row| row["name"] == name).unwrap().clone();
    assert_eq!((&named("touched")["found"], &named("touched")["golden"]), (&"no".into(), &"yes".into()));
    assert_eq!(named("contact_left")["found"], "none s");

    // The tolerance is twice the stated error of the standard accuracy, or more.
    let golden: serde_json::Value = serde_json::from_slice(&std::fs::read(at.join("ball.json")).unwrap()).unwrap();
    let mut fixed = palpate_sim::scene::Scene::default();
    fixed.object.fixed = true;
    let stated = palpate_study::accuracy::stated_error(&fixed).unwrap();
    let tolerance = |name: &str| golden["signals"][name]["tolerance"].as_f64().unwrap();
    assert!(tolerance("hold_force_left") > 1.999 * stated.force_n && tolerance("hold_force_left") < 0.02);
    assert!(tolerance("hold_curvature_left") > 1.999 * stated.curvature_per_m);
    assert_eq!(golden["verdicts"]["touched"], "yes");
    assert!(golden["tolerances"].as_str().unwrap().contains("error of accuracy standard"));
}

fn json_rows(folder: &Path, arguments: &[&str]) -> Vec<serde_json::Value> {
    let ran = run(folder, arguments);
    assert_eq!(ran.code, Some(1), "{ran:?}");
    serde_json::from_str::<serde_json::Value>(&ran.out).unwrap()["rows"].as_array().unwrap().clone()
}

#[test]
fn a_file_that_is_no_golden_one_is_neither_compared_nor_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("mine.json"), "{\"a\": 1}").unwrap();
    let ran = run(at, &["check", "mine.json", "ball"]);
    assert!(ran.code == Some(3) && ran.err.contains("no golden file of palpate check"), "{ran:?}");
    assert_eq!(code(at, &["check", "mine.json", "ball", "--bless"]), 1);
    assert_eq!(std::fs::read_to_string(at.join("mine.json")).unwrap(), "{\"a\": 1}");
    misused(at, &["check", "mine.toml", "ball"], &["choose .json"]);
    let blessed = run(at, &["check", "ball.json", "ball", "--set", "timing.duration_s=0.4", "--bless"]);
    assert_eq!(blessed.code, Some(0), "{blessed:?}");
    let same = json(at, &["check", "ball.json", "ball", "--set", "timing.duration_s=0.4", "--json"]);
    assert_eq!(same["same"], true, "a grasp without a hold has no values there, and neither has its golden file");
}
