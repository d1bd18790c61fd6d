//! Trials out of the program and in again: MCAP, NPZ, figures, movies, pictures of the window; and what is refused.
//!
//! Files were checked once with public readers, in a virtual environment with mcap 1.6.0, mcap-ros2-support 0.6.0 and
//! numpy 2.4.6:
//!
//! ```python
//! from mcap.reader import make_reader
//! from mcap_ros2.decoder import DecoderFactory
//! reader = make_reader(open("all.mcap", "rb"), validate_crcs=True, decoder_factories=[DecoderFactory()])
//! for schema, channel, message, decoded in reader.iter_decoded_messages(): ...
//! print(reader.get_summary().statistics, list(reader.iter_metadata()), list(reader.iter_attachments()))
//! arrays = numpy.load("all.npz"); print({name: (a.dtype, a.shape) for name, a in arrays.items()})
//! ```

use crate::program::{json, misused, refused, run};
use palpate_render::Picture;
use std::path::Path;

/// A folder with two short simulated trials in its store.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for object in ["lemon", "ball"] {
        let ran = run(folder.path(), &["grasp", object, "--set", "timing.duration_s=1.6"]);
        assert_eq!(ran.code, Some(0), "{ran:?}");
    }
    folder
}

fn done(folder: &Path, arguments: &[&str]) {
    let ran = run(folder, arguments);
    assert_eq!(ran.code, Some(0), "{arguments:?}: {ran:?}");
}

/// Names of files beside the store.
fn files(folder: &Path) -> Vec<String> {
    let names =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned());
    let mut names: Vec<String> = names.filter(|name| !name.starts_with("trials.sqlite")).collect();
    names.sort();
    names
}

#[test]
fn trials_travel_through_mcap_and_npz() {
    let folder = folder();
    let at = folder.path();
    done(at, &["trials", "export", "1", "2", "--out", "both.mcap"]);
    done(at, &["trials", "export", "1", "2", "--out", "both.npz", "--layout", "C6"]);
    assert!(std::fs::read(at.join("both.npz")).unwrap().starts_with(b"PK"));
    let other = at.join("other");
    std::fs::create_dir(&other).unwrap();
    done(&other, &["trials", "import", "../both.mcap"]);
    let listed = json(&other, &["trials", "list", "--json"]);
    let rows = listed.as_array().unwrap();
    assert_eq!(rows.iter().map(|row| row["object"].as_str().unwrap()).collect::<Vec<_>>(), ["lemon", "ball"]);
    assert!(rows.iter().all(|row| row["rig"] == "import" && row["collection"] == "both"));
    // The same numbers, whether they came through the file or not.
    done(at, &["trials", "export", "1", "--out", "own.csv"]);
    done(&other, &["trials", "export", "1", "--out", "came.csv"]);
    let column = |path: &Path, name: &str| -> Vec<f32> {
        let text = std::fs::read_to_string(path).unwrap();
        let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let place = lines.next().unwrap().iter().position(|head| head.split(' ').next() == Some(name)).unwrap();
        lines.map(|fields| fields[place].parse::<f64>().unwrap() as f32).collect()
    };
    for name in ["t_s", "curvature_left", "force_right"] {
        assert_eq!(column(&at.join("own.csv"), name), column(&other.join("came.csv"), name), "{name}");
    }
    // Without poses, the fingers are arcs of the curvature that was read, and it is said so.
    let drawn = run(&other, &["snapshot", "--trial", "1", "--at", "1.2", "--size", "320x200", "--out", "arcs.png"]);
    assert!(drawn.code == Some(0) && drawn.err.contains("Fingers are arcs of the curvature"), "{drawn:?}");
    // Twice is once.
    let again = run(&other, &["trials", "import", "../both.mcap"]);
    assert!(again.out.contains("0 trial(s) added"), "{again:?}");
    std::fs::write(at.join("cut.mcap"), &std::fs::read(at.join("both.mcap")).unwrap()[..500]).unwrap();
    refused(at, &["trials", "import", "cut.mcap"], &["cut.mcap"]);
    std::fs::write(at.join("text.mcap"), "no bag").unwrap();
    refused(at, &["trials", "import", "text.mcap"], &["it is not an MCAP file"]);
    refused(at, &["trials", "export", "1", "--out", "no/such/a.mcap"], &["there is no folder"]);
    refused(at, &["trials", "export", "9", "--out", "nine.mcap"], &["no trial 9"]);
    assert_eq!(files(at), ["both.mcap", "both.npz", "cut.mcap", "other", "own.contacts.csv", "own.csv", "text.mcap"]);
}

#[test]
fn taxels_and_data_sets_leave_the_program() {
    let folder = folder();
    let at = folder.path();
    for ending in ["mcap", "npz", "parquet"] {
        done(at, &["trials", "export", "1", "2", "--taxels", "--out", &format!("pads.{ending}")]);
    }
    done(at, &["trials", "export", "1", "2", "--as", "lerobot", "--out", "set"]);
    assert!(at.join("set/meta/episodes/chunk-000/file-000.parquet").is_file());
    done(at, &["trials", "import", "pads.npz"]);
    refused(at, &["trials", "export", "3", "--taxels", "--out", "no.npz"], &["only simulated grasps know"]);
    refused(at, &["trials", "export", "1", "--taxels", "--out", "csv"], &[".contacts.csv"]);
    refused(at, &["trials", "export", "1", "--as", "lerobot", "--out", "a.npz"], &["a data set is a folder"]);
    refused(at, &["trials", "export", "1", "--as", "lerobot", "--out", "set"], &["is not empty"]);
    assert_eq!(files(at), ["pads.mcap", "pads.npz", "pads.parquet", "set"]);
}

#[test]
fn figures_of_trials_are_drawn_and_named() {
    let folder = folder();
    let at = folder.path();
    done(at, &["plot", "1", "2", "--channels", "pressure,line", "--align", "contact", "--out", "two.svg"]);
    let svg = std::fs::read_to_string(at.join("two.svg")).unwrap();
    for text in
        ["Lemon (1), ", "pressure (kPa)", "line pressure (bar)", "time since contact (s)", "scene ", "Drawn by Palpate"]
    {
        assert!(svg.contains(text), "{text}");
    }
    done(at, &["plot", "1", "2", "--mean", "--out", "mean.svg"]);
    assert!(std::fs::read_to_string(at.join("mean.svg")).unwrap().contains("<polygon"));
    for kind in ["joints", "pads"] {
        let name = format!("{kind}.png");
        done(at, &["plot", "1", "--heat", kind, "--theme", "dark", "--size", "600x300", "--out", &name]);
        let picture = Picture::from_png(&std::fs::read(at.join(&name)).unwrap()).unwrap();
        assert_eq!((picture.width, picture.height), (1200, 600));
    }
    refused(at, &["plot", "1", "--channels", "warmth", "--out", "a.svg"], &["no channel \"warmth\"", "pressure_left"]);
    refused(at, &["plot", "1", "--raw", "--out", "a.svg"], &["only trials of the real gripper have raw counts"]);
    misused(at, &["plot", "1", "--out", "a.pdf"], &["no format has this ending; choose .svg, .png"]);
    refused(at, &["plot", "7", "--out", "a.svg"], &["no trial 7"]);
    let nobody = tempfile::tempdir().unwrap();
    refused(nobody.path(), &["plot", "1", "--out", "a.svg"], &["no trials yet", "there is no store"]);
    assert_eq!(std::fs::read_dir(nobody.path()).unwrap().count(), 0);
}

#[test]
fn movies_hold_every_picture() {
    let folder = folder();
    let at = folder.path();
    let span = ["--from", "0.8", "--to", "1.2", "--fps", "10", "--size", "160x100"];
    for out in ["grasp.apng", "grasp.gif", "frames/"] {
        done(at, &[&["movie", "1", "--out", out][..], &span].concat());
    }
    assert_eq!(std::fs::read_dir(at.join("frames")).unwrap().count(), 5);
    let frames = ["frame_00001.png", "frame_00005.png"]
        .map(|name| Picture::from_png(&std::fs::read(at.join("frames").join(name)).unwrap()).unwrap());
    assert_ne!(frames[0], frames[1], "the fingers move");
    let apng = std::fs::read(at.join("grasp.apng")).unwrap();
    assert_eq!(apng.windows(4).filter(|window| window == b"fcTL").count(), 5);
    assert!(std::fs::read(at.join("grasp.gif")).unwrap().starts_with(b"GIF89a"));
    misused(at, &["movie", "1", "--out", "a.mp4"], &["choose .apng, .png, .gif, a folder"]);
    refused(at, &["movie", "1", "--to", "9", "--out", "a.gif"], &["runs from", "--to within it"]);
    refused(at, &["movie", "1", "--out", "frames"], &["is not empty"]);
    assert_eq!(files(at), ["frames", "grasp.apng", "grasp.gif"]);
}

#[test]
fn presenter_mode_is_filmed_on_a_clock_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    done(at, &["movie", "--demo", "1.2", "--fps", "2.5", "--size", "320x200", "--out", "frames"]);
    assert_eq!(std::fs::read_dir(at.join("frames")).unwrap().count(), 4);
    let frames = ["frame_00001.png", "frame_00004.png"]
        .map(|name| Picture::from_png(&std::fs::read(at.join("frames").join(name)).unwrap()).unwrap());
    assert_ne!(frames[0], frames[1], "the fingers move");
    // The filmed grasps stay in no store.
    assert_eq!(files(at), ["frames"]);
    let endless = ["movie", "--demo", "600", "--speed", "0.01", "--fps", "100", "--out", "a.gif"];
    refused(at, &endless, &["6000001 pictures are more than 15000", "--fps"]);
}

#[test]
fn pictures_are_compared_with_golden_ones() {
    let folder = folder();
    let at = folder.path();
    let shot = ["snapshot", "--trial", "1", "--size", "200x120"];
    done(at, &[&shot[..], &["--at", "1.2", "--out", "golden.png"]].concat());
    let same = run(at, &[&shot[..], &["--at", "1.2", "--compare", "golden.png"]].concat());
    assert_eq!((same.code, same.out.contains("0 pixels differ")), (Some(0), true), "{same:?}");
    let other = [&shot[..], &["--at", "0.2", "--out", "now.png", "--compare", "golden.png"]].concat();
    let ran = run(at, &other);
    assert_eq!(ran.code, Some(1));
    assert!(ran.err.contains("pixels differ by more than 2") && ran.err.contains("now.diff.png"), "{ran:?}");
    assert_eq!(files(at), ["golden.png", "now.diff.png", "now.png"]);
    refused(at, &[&shot[..], &["--at", "5", "--out", "a.png"]].concat(), &["beyond the end: trial 1 lasts 1.6"]);
    refused(at, &["snapshot", "ball", "--at", "9", "--out", "a.png"], &["beyond the end: the grasp lasts 4.00 s"]);
    let ran = run(at, &[&shot[..], &["--compare", "none.png"]].concat());
    assert!(ran.code == Some(3) && ran.err.contains("not compared: cannot read \"none.png\""), "{ran:?}");
}

#[test]
fn the_whole_window_is_drawn_without_a_display() {
    let folder = folder();
    let at = folder.path();
    for (mode, theme) in [("demo", "dark"), ("inspect", "light"), ("label", "dark")] {
        let out = format!("{mode}.png");
        let mut arguments =
            vec!["snapshot", "--panels", "--mode", mode, "--theme", theme, "--size", "960x600", "--out", &out];
        arguments.extend(if mode == "inspect" { ["--trial", "1", "--at", "1.2"].iter() } else { [].iter() });
        done(at, &arguments);
        let picture = Picture::from_png(&std::fs::read(at.join(&out)).unwrap()).unwrap();
        assert_eq!((picture.width, picture.height), (960, 600));
        let mut colours: Vec<&[u8]> = picture.rgba.chunks_exact(4).collect();
        colours.sort_unstable();
        colours.dedup();
        assert!(colours.len() > 500, "{mode}: {} colours", colours.len());
    }
    let rows = json(at, &["trials", "list", "--json"]);
    assert_eq!(rows.as_array().unwrap().len(), 2, "the window recorded nothing");
    refused(at, &["snapshot", "--panels", "--trial", "9", "--out", "a.png"], &["no trial 9"]);
}
