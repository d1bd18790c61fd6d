//! The map in `src/lib.rs` stays true by itself: modules import only from lower layers, third-party crates stay at home.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Layers of `src/core`, lowest first. A module may import from rows above its own, never from its own or below.
const LAYERS: &[&[&str]] = &[
    &["units", "palette"],
    &["geometry"],
    &["drawing", "objects", "gripper"],
    &["trial", "board"],
    &["scene", "wire"],
    &["physics"],
    &["sensing"],
    &["rig", "labelling"],
    &["recording"],
    &["recognition"],
    &["grasping"],
    &["pretended", "doctor"],
    &["study"],
    &["picture"],
    &["workers"],
];

/// What `src/render` may know of core.
const SEEN_BY_RENDER: [&str; 3] = ["geometry", "palette", "drawing"];

/// Files of tests that stand beside the code.
const TEST_FILES: &[&str] = &[
    "physics/closed_form.rs",
    "physics/effects_tests.rs",
    "workers/sim_tests.rs",
    "recognition/conformance.rs",
    "recognition/network/gradients.rs",
    "recognition/forest/peers.rs",
    "sensing/model/tests.rs",
    "wire/decoder_tests.rs",
    "recording/board_tests.rs",
    "recording/journal_tests.rs",
    "recording/store_tests.rs",
    "labelling/segmentation_tests.rs",
    "rig/serial/link_tests.rs",
    "pretended/tests.rs",
    "study/finger_fit/tests.rs",
    "sensing/calibration/pad_curve_tests.rs",
    "sensing/calibration/readout_tests.rs",
    "doctor/tests.rs",
];

/// Where each third-party crate may be named.
const HOMES: &[(&str, &[&str])] = &[
    ("ab_glyph", &["src/render/text.rs"]),
    ("candle_core", &["src/core/recognition", "src/core/study/network_cost.rs"]),
    ("candle_nn", &["src/core/recognition/rivals/convolution.rs", "src/core/study/network_cost.rs"]),
    ("bytemuck", &["src/render", "src/core/geometry", "src/core/recording"]),
    ("clap", &["src/cli"]),
    (
        "cpu_time",
        &["src/cli", "src/core/study", "src/core/recognition/evaluation.rs", "src/core/recognition/methods.rs"],
    ),
    ("csv", &["src/core/recording"]),
    ("ctrlc", &["src/cli/interrupt.rs"]),
    ("directories", &["src/core/recording"]),
    ("eframe", &["src/app"]),
    ("egui", &["src/app"]),
    ("egui_notify", &["src/app"]),
    ("egui_plot", &["src/app"]),
    ("egui_tiles", &["src/app"]),
    ("egui_wgpu", &["src/app"]),
    ("epaint_default_fonts", &["src/render/text.rs"]),
    ("fs4", &["src/core/recording"]),
    ("glam", &["src"]),
    ("image", &["src/render"]),
    ("include_dir", &["src/core/objects", "src/render/shaders.rs"]),
    ("indicatif", &["src/cli"]),
    ("libloading", &["src/app/startup.rs"]),
    ("matrixmultiply", &["src/core/recognition/network/gemm.rs"]),
    ("parry3d", &["src/core/geometry"]),
    ("pollster", &["src/render"]),
    ("quick_xml", &["src/core/objects"]),
    ("rand", RANDOM),
    ("rand_chacha", RANDOM),
    ("rapier3d", &["src/core/physics"]),
    (
        "rayon",
        &[
            "src/core/geometry",
            "src/core/recognition/methods.rs",
            "src/core/study/effects.rs",
            "src/core/study/network_cost.rs",
        ],
    ),
    ("rfd", &["src/app/files.rs"]),
    ("rusqlite", &["src/core/recording"]),
    ("safetensors", &["src/core/recognition/model_file.rs"]),
    ("serialport", &["src/core/rig", "src/core/pretended"]),
    ("serde", &["src"]),
    ("serde_json", &["src"]),
    ("smartcore", &["src/core/recognition/rivals"]),
    ("statrs", &["src/core/recognition/metrics", "src/core/sensing/calibration/straight_line.rs"]),
    ("stl_io", &["src/core/geometry"]),
    ("strsim", &["src/core/objects", "src/core/scene"]),
    ("thiserror", &["src"]),
    ("tobj", &["src/core/geometry"]),
    ("toml", &["src/core/scene", "src/core/objects/catalogue.rs"]),
    ("tracing", &["src"]),
    ("tracing_subscriber", &["src/cli/terminal.rs"]),
    ("urdf_rs", &["src/core/objects"]),
    ("wgpu", &["src/render", "src/app"]),
    ("winit", &["src/app/startup.rs"]),
];

/// Where things are drawn at random, always from a seed.
const RANDOM: &[&str] = &[
    "src/core/grasping",
    "src/core/physics/resting.rs",
    "src/core/sensing/model/streams.rs",
    "src/core/recognition",
    "src/core/study/stability",
    "src/core/study/network_cost.rs",
    "src/cli/demo.rs",
];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn sources_below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(sources_below(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// Sources that ship: without comments, and without test modules, which stand at the end of a file.
fn shipped(path: &Path) -> String {
    let text = std::fs::read_to_string(path).unwrap();
    let text = text.split("mod tests {").next().unwrap();
    text.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

/// The names that follow `prefix` as a path, as in `crate::NAME` or `use crate::{NAME, ..`.
fn names_after<'a>(text: &'a str, prefix: &str) -> BTreeSet<&'a str> {
    let name = |rest: &'a str| {
        let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
        &rest[..end]
    };
    text.match_indices(prefix).map(|(at, _)| name(&text[at + prefix.len()..])).filter(|n| !n.is_empty()).collect()
}

fn layer_of(module: &str) -> Option<usize> {
    LAYERS.iter().position(|layer| layer.contains(&module))
}

#[test]
fn modules_import_only_from_lower_layers() {
    let core = root().join("src/core");
    let mut seen = BTreeSet::new();
    for path in sources_below(&core) {
        let below_core = path.strip_prefix(&core).unwrap();
        let first = below_core.iter().next().unwrap().to_str().unwrap();
        let module = first.strip_suffix(".rs").unwrap_or(first);
        // Tests of a folder may stand in a file of their own.
        let only_tests = TEST_FILES.iter().any(|file| below_core.ends_with(file));
        if ["lib", "build"].contains(&module) || only_tests {
            continue;
        }
        let own = layer_of(module).unwrap_or_else(|| panic!("src/core/{module} has no place in LAYERS"));
        seen.insert(module.to_owned());
        let text = shipped(&path);
        assert!(!text.contains("crate::{"), "{}: import one module per line", path.display());
        for name in names_after(&text, "crate::") {
            let other = layer_of(name).unwrap_or_else(|| panic!("{}: crate::{name} is no module", path.display()));
            assert!(name == module || other < own, "{} must not import from {name}", path.display());
        }
    }
    assert!(seen.len() >= 15, "only {seen:?} were found");
}

#[test]
fn the_renderer_knows_nothing_of_gripper_or_scene() {
    for path in sources_below(&root().join("src/render")) {
        for name in names_after(&shipped(&path), "palpate_core::") {
            assert!(SEEN_BY_RENDER.contains(&name), "{} must not know {name}", path.display());
        }
    }
}

#[test]
fn the_window_does_not_know_the_command_line() {
    for path in sources_below(&root().join("src/app")) {
        let text = shipped(&path);
        assert!(!names_after(&text, "crate::").contains("cli"), "{}", path.display());
        assert!(!names_after(&text, "palpate_core::").contains("physics"), "{} must not step", path.display());
    }
}

#[test]
fn third_party_crates_stay_at_home() {
    let mut homeless = BTreeSet::new();
    for manifest in ["Cargo.toml", "src/core/Cargo.toml", "src/render/Cargo.toml"] {
        let text = std::fs::read_to_string(root().join(manifest)).unwrap();
        let dependencies = text.split("\n[dependencies]\n").nth(1).unwrap().split("\n[").next().unwrap();
        for line in dependencies.lines().filter(|l| !l.starts_with('#')) {
            let name = line.split(['.', ' ', '=']).next().unwrap().replace('-', "_");
            if !name.is_empty() && !name.starts_with("palpate") && !HOMES.iter().any(|(c, _)| *c == name) {
                homeless.insert(name);
            }
        }
    }
    assert!(homeless.is_empty(), "give these a home in HOMES: {homeless:?}");

    let mut used = BTreeSet::new();
    for path in sources_below(&root().join("src")) {
        let text = shipped(&path);
        let place = path.strip_prefix(root()).unwrap();
        if TEST_FILES.iter().any(|file| place.ends_with(file)) {
            continue;
        }
        for (name, homes) in HOMES {
            let mentioned = text.match_indices(&format!("{name}::")).any(|(at, _)| {
                let before = text[..at].chars().next_back();
                before.is_none_or(|c| !c.is_alphanumeric() && c != '_' && c != ':')
            });
            if mentioned {
                used.insert(*name);
                let at_home = homes.iter().any(|home| place.starts_with(home));
                assert!(at_home, "{name} is named in {}; its home is {}", place.display(), homes.join(", "));
            }
        }
    }
    let unused: Vec<&str> = HOMES.iter().map(|(n, _)| *n).filter(|n| !used.contains(n)).collect();
    assert!(unused.is_empty(), "nobody names {unused:?}");
}
