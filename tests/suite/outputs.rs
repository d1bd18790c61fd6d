//! What is written replaces nothing else, and is what its name says; one class holds one object.

use crate::program::{json, misused, refused, run};
use palpate_store::Store;
use std::collections::BTreeMap;
use std::path::Path;

/// A folder with a store of two short trials.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for object in ["lemon", "ball"] {
        let ran = run(folder.path(), &["grasp", object, "--set", "timing.duration_s=1.2"]);
        assert_eq!(ran.code, Some(0), "{ran:?}");
    }
    folder
}

/// Contents of the files in a folder, without those of SQLite's log.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let files = files.map(|file| (file.file_name().to_string_lossy().into_owned(), file.path()));
    let kept = files.filter(|(name, path)| path.is_file() && !name.ends_with("-wal") && !name.ends_with("-shm"));
    kept.map(|(name, path)| (name, std::fs::read(path).unwrap())).collect()
}

#[test]
fn no_output_replaces_a_store_or_a_file_of_another_kind() {
    let folder = folder();
    let at = folder.path();
    let store = std::fs::read(at.join("trials.sqlite")).unwrap();
    let outputs: [(&str, &[&str]); 10] = [
        ("csv", &["grasp", "lemon", "--no-store"]),
        ("csv", &["trials", "export", "1"]),
        ("npz", &["trials", "export", "1", "2"]),
        ("mcap", &["trials", "export", "1", "2"]),
        ("svg", &["plot", "1"]),
        ("png", &["snapshot", "ball"]),
        ("gif", &["movie", "1"]),
        ("json", &["calibrate", "export"]),
        ("safetensors", &["train", "knn"]),
        ("safetensors", &["teach", "mug.urdf"]),
    ];
    for (ending, command) in outputs {
        for (name, bytes, wanted) in [
            ("store", store.as_slice(), "is a store of trials"),
            ("notes", b"dear diary", "there is a file of this name"),
        ] {
            let name = format!("{name}.{ending}");
            std::fs::write(at.join(&name), bytes).unwrap();
            let before = contents(at);
            refused(at, &[command, &["--out", &name]].concat(), &[&name, wanted, "choose another name"]);
            assert!(contents(at) == before, "{command:?} changed something");
        }
    }
    assert_eq!(Store::open(&at.join("trials.sqlite")).unwrap().list(false).unwrap().len(), 2);
}

#[cfg(unix)]
#[test]
fn the_lines_of_an_emulated_board_replace_no_store() {
    let folder = folder();
    let at = folder.path();
    std::fs::copy(at.join("trials.sqlite"), at.join("sent.txt")).unwrap();
    let before = contents(at);
    refused(at, &["emulate", "--link", "port", "--sent", "sent.txt"], &["sent.txt", "is a store of trials"]);
    assert!(contents(at) == before);
}

#[test]
fn a_model_replaces_neither_the_card_of_others_nor_what_has_a_temporary_name() {
    let folder = folder();
    let at = folder.path();
    json(at, &["collect", "--objects", "ball,lemon", "--trials", "2", "--accuracy", "draft", "--json"]);
    for (name, text) in [("m.json", "{\"name\": \"mine\"}"), ("n.unfinished", "mine"), ("n.json.unfinished", "mine")] {
        std::fs::write(at.join(name), text).unwrap();
    }
    let before = contents(at);
    refused(at, &["train", "knn", "--out", "m.safetensors"], &["m.json", "no card of a model"]);
    misused(at, &["train", "knn", "--out", "q.json"], &["no format has this ending; choose .safetensors"]);
    assert!(contents(at) == before);
    std::fs::write(at.join("o.md"), "# Notes").unwrap();
    refused(at, &["train", "knn", "--out", "o.safetensors"], &["o.md", "card of a model"]);
    std::fs::remove_file(at.join("o.md")).unwrap();
    for _ in 0..2 {
        let trained = run(at, &["train", "knn", "--out", "n.safetensors"]);
        assert_eq!(trained.code, Some(0), "{trained:?}");
    }
    let mut after = contents(at);
    assert!(["n.safetensors", "n.json", "n.md"].iter().all(|name| after.remove(*name).is_some()));
    assert!(after == before, "nothing else was touched or left");
}

#[test]
fn a_name_that_no_format_claims_is_refused() {
    let folder = folder();
    let at = folder.path();
    let before = contents(at);
    let names: [(&[&str], &str); 8] = [
        (&["grasp", "ball", "--no-store", "--out", "a.xlsx"], "choose .csv"),
        (&["trials", "export", "1", "--out", "a.xyz"], "choose .csv, .mcap, .npz"),
        (&["trials", "export", "1", "--out", "a.parquets"], "a folder, whose name has no ending"),
        (&["snapshot", "ball", "--out", "a.jpg"], "choose .png"),
        (&["train", "knn", "--out", "a.pt"], "choose .safetensors"),
        (&["teach", "a.urdf", "--out", "a.onnx"], "choose .safetensors"),
        (&["fit", "1", "--out", "a.json"], "choose .toml"),
        (&["calibrate", "export", "--out", "a.csv"], "choose .json"),
    ];
    for (command, wanted) in names {
        misused(at, command, &[wanted, "no format has this ending"]);
    }
    for (command, name) in [("demo", "a.png"), ("study accuracy", "a.svg"), ("study grasps", "a.csv")] {
        let command: Vec<&str> = command.split(' ').chain(["--out", name]).collect();
        misused(at, &command, &["name of a file; choose that of a folder"]);
    }
    refused(at, &["trials", "export", "--labelled", "--out", "a.csv"], &["need a folder"]);
    assert!(contents(at) == before && std::fs::read_dir(at).unwrap().all(|entry| entry.unwrap().path().is_file()));
    std::fs::create_dir(at.join("v1.2")).unwrap();
    let ran = run(at, &["demo", "--object", "ball", "--grasps", "1", "--out", "demo-0.2"]);
    assert!(ran.code == Some(0) && at.join("demo-0.2").is_dir(), "{ran:?}");
    for out in ["v1.2", "new.set/", "plain"] {
        let ran = run(at, &["trials", "export", "1", "--out", out]);
        assert!(ran.code == Some(0) && at.join(out).join("trial_1_lemon.csv").is_file(), "{ran:?}");
    }
}

#[test]
fn a_collection_that_cannot_begin_leaves_no_store() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    refused(at, &["collect", "--objects", "ball,lemn"], &["no object \"lemn\"", "lemon"]);
    refused(at, &["collect", "--objects", "ball,gone.urdf"], &["gone.urdf"]);
    refused(at, &["collect", "--objects", "ball", "--class", "a,b"], &["2 classes for 1 objects"]);
    assert_eq!(std::fs::read_dir(at).unwrap().count(), 0, "something was created");
}

/// Writes a box that its file, in a folder of its own, calls by this name.
fn boxed(at: &Path, folder: &str, robot: &str, side: f64) -> String {
    let path = at.join(folder).join("model.urdf");
    std::fs::create_dir(at.join(folder)).unwrap();
    let shape = format!("<collision><geometry><box size='0.03 0.03 {side}'/></geometry></collision>");
    std::fs::write(&path, format!("<robot name='{robot}'><link name='a'>{shape}</link></robot>")).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn one_class_is_one_object() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let named = |file: &str| json(at, &["grasp", file, "--no-store", "--json"])["object"].clone();
    let (can, brick) = (boxed(at, "can", "model", 0.03), boxed(at, "brick", "Robot", 0.04));
    assert_eq!([named(&can), named(&brick)], ["can", "brick"]);
    let (first, other) = (boxed(at, "a", "mug", 0.03), boxed(at, "b", "Mug ", 0.04));
    let objects = format!("{first},{other}");
    let draft = ["--accuracy", "draft", "--trials", "3"];
    let set = ["collect", "--objects", &objects];
    refused(at, &[&set[..], &draft].concat(), &[&first, &other, "the class of both is \"mug\"", "--class"]);
    refused(at, &["teach", &first, &other], &[&first, &other, "the class of both is \"mug\"", "--class"]);

    // One after the other they come into one store, but not into one data set.
    for object in [&first, &other] {
        json(at, &[&["collect", "--objects", object, "--json"], &draft[..]].concat());
    }
    let train = ["train", "knn", "--out", "m.safetensors", "--json"];
    refused(at, &train, &[&first, &other, "the class of both is \"mug\"", "--class"]);
    assert_eq!(json(at, &["grasp", &other, "--class", "cup", "--json"])["object"], "cup");
    let told = ["--class", "mug,cup", "--store", "told.sqlite", "--json"];
    json(at, &[&set[..], &draft, &told].concat());
    let trained = json(at, &[&train[..], &["--store", "told.sqlite"]].concat());
    assert_eq!(trained["trials"], 6);
}

#[test]
fn spellings_of_a_label_are_one_class() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let labels = ["Lemon", "lemon", "LEMON ", "Caf\u{e9}", "cafe\u{301}", "big  ball", "Big ball"];
    let mut text = "trial,label,t_s,pressure_left\n".to_owned();
    for (trial, label) in labels.into_iter().cycle().take(28).enumerate() {
        for sample in 0..20 {
            text.push_str(&format!("{trial},{label},{},{}\n", 0.02 * f64::from(sample), trial * (sample as usize + 1)));
        }
    }
    std::fs::write(at.join("mine.csv"), text).unwrap();
    assert_eq!(run(at, &["trials", "import", "mine.csv"]).code, Some(0));
    let trained = run(at, &["train", "knn", "--out", "m.safetensors", "--json"]);
    assert_eq!(trained.code, Some(0), "{trained:?}");
    assert!(trained.err.contains("spellings of one class (\"Caf\u{e9}\", \"cafe\u{301}\")"), "{trained:?}");
    let card: serde_json::Value = serde_json::from_slice(&std::fs::read(at.join("m.json")).unwrap()).unwrap();
    let classes = card["labels"]["classes"].as_array().unwrap();
    let names: Vec<&str> = classes.iter().map(|class| class["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["Caf\u{e9}", "big  ball", "lemon"]);
    let one = ["train", "knn", "--objects", "LEMON,CAF\u{c9}", "--out", "two.safetensors", "--json"];
    assert_eq!(json(at, &one)["trials"], 20);
}
