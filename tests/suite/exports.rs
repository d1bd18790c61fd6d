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
    // Without poses, the fingers are drawn by the curvature that was read, and it is said so.
    let drawn = run(&other, &["snapshot", "--trial", "1", "--at", "1.2", "--size", "320x200", "--out", "arcs.png"]);
    assert!(
        drawn.code == Some(0) && drawn.err.contains("Fingers as their flex strips read, without the object."),
        "{drawn:?}"
    );
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
    for text in [
        "Lemon (trial ",
        "pressure (kPa)",
        "line pressure (bar)",
        "time since contact (s)",
        "scene ",
        "Drawn by Palpate",
    ] {
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
    misused(at, &["movie", "1", "--out", "a.avi"], &["choose .apng, .png, .gif, .mp4, .glb, a folder"]);
    refused(at, &["movie", "1", "--to", "9", "--out", "a.gif"], &["runs from", "--to within it"]);
    refused(at, &["movie", "1", "--out", "frames"], &["is not empty"]);
    assert_eq!(files(at), ["frames", "grasp.apng", "grasp.gif"]);
}

/// Numbers of an accessor of a glTF file whose components are floats.
fn floats(document: &serde_json::Value, bytes: &[u8], accessor: &serde_json::Value) -> Vec<f32> {
    let accessor = &document["accessors"][accessor.as_u64().unwrap() as usize];
    assert_eq!(accessor["componentType"], 5126);
    let view = &document["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let [from, length] = ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap() as usize);
    let size = match accessor["type"].as_str().unwrap() {
        "SCALAR" => 1,
        "VEC3" => 3,
        "VEC4" => 4,
        _ => 16,
    };
    assert_eq!(length, 4 * size * accessor["count"].as_u64().unwrap() as usize);
    bytes[from..from + length].chunks(4).map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect()
}

#[test]
fn a_model_has_the_fingers_where_the_frames_have_them() {
    let folder = folder();
    let at = folder.path();
    done(at, &["movie", "1", "--from", "0.8", "--to", "1.2", "--fps", "10", "--out", "grasp.glb"]);
    let file = std::fs::read(at.join("grasp.glb")).unwrap();
    let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!((&file[..4], word(4), word(8)), (&b"glTF"[..], 2, file.len()));
    let document: serde_json::Value = serde_json::from_slice(&file[20..20 + word(12)]).unwrap();
    let bytes = &file[28 + word(12)..];
    assert_eq!(document["buffers"][0]["byteLength"], bytes.len());

    // 41 rings: ten stretches between eleven joints, four each. Of the nine corners of a ring four are edges, which both
    // sides have for themselves; each end has its own nine.
    let left = document["meshes"].as_array().unwrap().iter().find(|mesh| mesh["name"] == "left").unwrap();
    let attributes = &left["primitives"][0]["attributes"];
    for (name, size) in [("POSITION", 3), ("NORMAL", 3), ("COLOR_0", 3), ("WEIGHTS_0", 4)] {
        assert_eq!(floats(&document, bytes, &attributes[name]).len(), size * (41 * 13 + 2 * 9), "{name}");
    }
    let targets = left["primitives"][0]["targets"].as_array().unwrap().len();
    assert_eq!(
        (targets, &left["weights"]),
        (5, &serde_json::json!([1.0, 0.0, 0.0, 0.0, 0.0])),
        "viewers that read no animation"
    );
    let weights = floats(&document, bytes, &attributes["WEIGHTS_0"]);
    assert!(weights.chunks(4).all(|four| (four.iter().sum::<f32>() - 1.0).abs() < 1e-6));

    let store = palpate_store::Store::open(&at.join("trials.sqlite")).unwrap();
    let trial = store.load(1).unwrap();
    let palpate_tactile::trial::TrialData::Simulated(data) = &trial.data else { panic!("simulated") };
    let gripper = &trial.header.scene.gripper;
    let frame = data.frames.iter().rev().find(|frame| frame.t <= 1.2).unwrap();
    let names: Vec<&str> = document["nodes"].as_array().unwrap().iter().map(|n| n["name"].as_str().unwrap()).collect();
    let channels = document["animations"][0]["channels"].as_array().unwrap();
    let moved = |name: &str, path: &str| {
        let node = names.iter().position(|own| *own == name).unwrap();
        let own = |channel: &&serde_json::Value| channel["target"]["node"] == node && channel["target"]["path"] == path;
        let sampler = channels.iter().find(own).unwrap()["sampler"].as_u64().unwrap() as usize;
        let sampler = &document["animations"][0]["samplers"][sampler];
        [&sampler["input"], &sampler["output"]].map(|accessor| floats(&document, bytes, accessor))
    };
    for (side, name) in palpate_sim::gripper::Side::BOTH.into_iter().zip(["left tip", "right tip"]) {
        let placed = frame.placed(gripper, side);
        let last = placed.lengths.len() - 1;
        let tip = placed.point(last, placed.lengths[last], 0.0, 0.0);
        let tip = frame.world_from_gripper(&data.world_from_gripper).point(tip).as_vec3();
        let [times, positions] = moved(name, "translation");
        assert_eq!(times.len(), 5);
        assert!(times.iter().enumerate().all(|(k, t)| (t - 0.1 * k as f32).abs() < 1e-6), "{times:?}");
        let shown = glam::Vec3::from_slice(&positions[12..]);
        assert!(shown.distance(tip) < 1e-5, "{name}: {shown} m in the model, {tip} m in the frame");
    }
    // One shape of the pad at a time: the rows of the unit matrix.
    let [times, shapes] = moved("left finger", "weights");
    assert_eq!((times.len(), shapes.len()), (5, 25));
    assert!(shapes.iter().enumerate().all(|(k, weight)| *weight == if k % 6 == 0 { 1.0 } else { 0.0 }));
    refused(at, &["movie", "--demo", "1", "--out", "b.glb"], &["a .glb holds one grasp"]);
}

#[cfg(unix)]
#[test]
fn mp4_is_written_by_ffmpeg_where_it_is_installed() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = folder();
    let at = folder.path();
    let movie = ["movie", "1", "--from", "0.8", "--to", "1.2", "--fps", "10", "--size", "160x100", "--out", "a.mp4"];
    let with_path = |path: &std::path::Path| {
        let mut command = crate::program::palpate(&at.join("trials.sqlite"));
        crate::program::ran(&command.env("PATH", path).args(movie).current_dir(at).output().unwrap())
    };
    let without = with_path(&at.join("nothing"));
    assert!(without.code == Some(1) && without.err.contains("sudo apt install ffmpeg"), "{without:?}");
    assert!(!at.join("a.mp4").exists());
    // In its place a script that keeps what it is given.
    let tools = tempfile::tempdir().unwrap();
    let script = "#!/bin/sh\n[ \"$1\" = -version ] && exit\nfor last; do :; done\n/bin/cat > \"$last\"\n";
    std::fs::write(tools.path().join("ffmpeg"), script).unwrap();
    std::fs::set_permissions(tools.path().join("ffmpeg"), std::fs::Permissions::from_mode(0o755)).unwrap();
    let ran = with_path(tools.path());
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert_eq!(
        std::fs::metadata(at.join("a.mp4")).unwrap().len(),
        5 * 160 * 100 * 4,
        "five pictures, four bytes a pixel"
    );
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
    assert!(ran.err.contains("--bless makes it"), "{ran:?}");
    done(at, &[&shot[..], &["--at", "1.2", "--compare", "none.png", "--bless"]].concat());
    done(at, &[&shot[..], &["--at", "1.2", "--compare", "none.png"]].concat());
    let small = ["snapshot", "--trial", "1", "--size", "100 x 60", "--compare", "golden.png"];
    let ran = run(at, &small);
    assert_eq!(ran.code, Some(3));
    assert!(ran.err.contains("the picture has 100 x 60 pixels, the golden one 200 x 120"), "{ran:?}");
    misused(at, &["snapshot", "ball", "--compare", "golden.jpg"], &["choose .png"]);
    misused(at, &["snapshot", "ball", "--out", "now.jpg"], &["choose .png"]);
    misused(at, &["snapshot", "ball", "--out", "a.png", "--driver", "metal"], &["choose any, software, gl or vulkan"]);
}

#[test]
fn a_picture_says_what_drew_it_and_a_comparison_what_has_changed() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let shot = ["snapshot", "ball", "--size", "200x120", "--at", "0.1", "--driver", "software"];
    done(at, &[&shot[..], &["--compare", "golden.png", "--bless"]].concat());
    let bytes = std::fs::read(at.join("golden.png")).unwrap();
    let text = |key: &str| Picture::text_of_png(&bytes, key).unwrap();
    assert_eq!(text("Software"), format!("Palpate {}", env!("CARGO_PKG_VERSION")));
    assert_eq!(text("Physics"), palpate_sim::PHYSICS_VERSION.to_string());
    assert!(text("Driver").contains("software rendering") && text("Scene").contains("source = \"ball\""));
    let ran = run(at, &[&shot[..], &["--set", "gripper.finger.joints=6", "--compare", "golden.png"]].concat());
    assert_eq!(ran.code, Some(1));
    let line = ran.err.lines().find_map(|line| line.strip_prefix("Pixels that differ: ")).unwrap();
    let counts: Vec<usize> = line.split(", ").map(|part| part.split(' ').next().unwrap().parse().unwrap()).collect();
    assert!(line.ends_with("by more than 16") && counts.len() == 5 && counts[0] > 0, "{line}");
    assert!(counts.windows(2).all(|pair| pair[0] >= pair[1]), "{counts:?}");
    assert!(ran.err.contains("The scenes differ: joints = 6."), "{ran:?}");
    assert!(ran.err.contains(&format!("Both were drawn by {}.", text("Driver"))), "{ran:?}");
    // A picture of another program says nothing.
    let plain = Picture { width: 200, height: 120, rgba: vec![0; 4 * 200 * 120] };
    std::fs::write(at.join("plain.png"), plain.to_png().unwrap()).unwrap();
    let ran = run(at, &[&shot[..], &["--compare", "plain.png"]].concat());
    assert!(ran.code == Some(1) && ran.err.contains("The golden picture does not name its driver."), "{ran:?}");
}

#[test]
fn a_list_draws_many_pictures_and_ends_with_the_greatest_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let size = "--size 160x100 --at 0.1";
    std::fs::write(
        at.join("a.txt"),
        format!("# two\nball {size} --out ball.png\n\ncube {size} --out cube.png # cube\n"),
    )
    .unwrap();
    done(at, &["snapshot", "--list", "a.txt"]);
    assert_eq!(files(at), ["a.txt", "ball.png", "cube.png"]);
    let code = |lines: &str| {
        std::fs::write(at.join("b.txt"), lines).unwrap();
        let ran = run(at, &["snapshot", "--list", "b.txt"]);
        (ran.code.unwrap(), ran.err)
    };
    assert_eq!(code(&format!("ball {size} --compare ball.png")).0, 0);
    assert_eq!(code(&format!("cube {size} --compare ball.png\nball {size} --compare ball.png")).0, 1);
    assert_eq!(code(&format!("cube {size} --compare none.png\ncube {size} --compare ball.png")).0, 3);
    let (wrong, said) = code("ball --out c.png\nball --nonsense");
    assert!(wrong == 2 && said.contains("line 2 of b.txt") && !at.join("c.png").exists(), "{said}");
    misused(at, &["snapshot", "--list", "a.txt", "--out", "a.png"], &["--list"]);
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
