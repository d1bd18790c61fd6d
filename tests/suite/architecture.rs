//! The maps in the documentation hold: packages and modules import only from lower ones, third-party crates stay at home.

use crate::imports::{Sources, gather, names_in, related, rows};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Folders of packages below `src`. The root package has the rest of `src`.
const PACKAGES: [&str; 12] = [
    "geometry", "sim", "tactile", "learn", "device", "store", "lab", "exchange", "study", "render", "serve", "workshop",
];

/// Where each third-party crate may be named.
const HOMES: &[(&str, &[&str])] = &[
    ("ab_glyph", &["src/render/text.rs"]),
    ("bytemuck", &["src/render", "src/geometry"]),
    ("candle_core", &["src/learn/baselines", "src/study/network_cost.rs"]),
    ("candle_nn", &["src/learn/baselines", "src/study/network_cost.rs"]),
    ("cc", &["src/device/build.rs"]),
    ("clap", &["src/cli", "src/workshop"]),
    (
        "cpu_time",
        &[
            "src/cli",
            "src/lab/grasping/timed_grasp.rs",
            "src/study",
            "src/learn/evaluation.rs",
            "src/learn/methods.rs",
            "src/sim/bench",
        ],
    ),
    (
        "crc32fast",
        &["src/geometry/grid_file.rs", "src/store/checksum.rs", "src/exchange/mcap", "src/lab/datasets/origin.rs"],
    ),
    ("csv", &["src/exchange/csv_files"]),
    ("ctrlc", &["src/cli/interrupt.rs"]),
    ("directories", &["src/sim/objects/assemble.rs", "src/store/store.rs"]),
    ("earcut", &["src/geometry/mesh_files"]),
    ("eframe", &["src/app"]),
    ("egui", &["src/app"]),
    ("egui_plot", &["src/app"]),
    ("egui_tiles", &["src/app"]),
    ("egui_wgpu", &["src/app"]),
    ("epaint_default_fonts", &["src/render/text.rs", "src/render/figure"]),
    ("fs4", &["src/store"]),
    ("unicode_normalization", &["src/store/labels"]),
    ("gif", &["src/render/movie.rs"]),
    ("glam", &["src"]),
    ("image", &["src/render/picture.rs"]),
    ("include_dir", &["src/sim/objects"]),
    ("half", &["src/exchange/npz_import.rs"]),
    ("indicatif", &["src/cli"]),
    ("libloading", &["src/app/startup.rs"]),
    ("lz4_flex", &["src/exchange/mcap"]),
    ("matrixmultiply", &["src/learn/network/gemm.rs"]),
    ("bytes", &["src/exchange"]),
    ("parquet", &["src/exchange"]),
    ("parry3d", &["src/geometry"]),
    ("plotters", &["src/render/figure"]),
    ("png", &["src/render/movie.rs", "src/render/picture.rs"]),
    ("pollster", &["src/render/gpu.rs", "src/app/offscreen.rs"]),
    ("quick_xml", &["src/sim/objects/xml.rs"]),
    ("rand", RANDOM),
    ("rand_chacha", RANDOM),
    ("rapier3d", &["src/sim/physics/rapier_engine", "src/sim/physics/resting.rs"]),
    (
        "rayon",
        &[
            "src/geometry",
            "src/learn/methods.rs",
            "src/lab/grasping/error_band.rs",
            "src/lab/grasping/known_geometry.rs",
            "src/lab/grasping/lessons.rs",
            "src/lab/grasping/promise.rs",
            "src/study",
        ],
    ),
    ("rustc_hash", &["src/geometry"]),
    ("rusqlite", &["src/store"]),
    ("ruzstd", &["src/exchange/mcap/reader.rs"]),
    ("safetensors", &["src/learn/tensor_file.rs"]),
    ("schemars", &["src/serve/messages.rs"]),
    ("serde", &["src"]),
    ("serde_json", &["src"]),
    ("serde_path_to_error", &["src/serve/messages.rs"]),
    ("serialport", &["src/device/serial", "src/device/emulator/port.rs"]),
    ("statrs", &["src/learn/metrics", "src/tactile/calibration/straight_line.rs"]),
    ("stl_io", &["src/geometry/mesh_files"]),
    ("strsim", &["src/sim/objects", "src/sim/scene"]),
    ("tempfile", &["src"]),
    ("thiserror", &["src"]),
    ("tobj", &["src/geometry/mesh_files"]),
    (
        "toml",
        &[
            "src/tactile/sensor_list.rs",
            "src/sim/scene",
            "src/sim/objects/catalogue.rs",
            "src/exchange/mapping.rs",
            "src/study/public.rs",
        ],
    ),
    ("tracing", &["src"]),
    ("tracing_subscriber", &["src/cli/terminal.rs"]),
    ("wgpu", &["src/render", "src/app"]),
    ("wide", &["src/sim/physics/hessian.rs"]),
    ("winit", &["src/app/startup.rs"]),
    ("zip", &["src/exchange/npz.rs", "src/exchange/npz_import.rs"]),
];

/// Where random numbers are drawn, always from a seed.
const RANDOM: &[&str] = &[
    "src/cli/demo",
    "src/lab/grasping/known_geometry.rs",
    "src/lab/grasping/shuffled_objects.rs",
    "src/study/effects",
    "src/study/network_cost.rs",
    "src/study/paper",
    "src/study/stability",
    "src/learn",
    "src/sim/objects/random_shape.rs",
    "src/sim/physics/placement.rs",
    "src/sim/physics/resting.rs",
    "src/sim/poses.rs",
    "src/tactile/model/streams.rs",
    "src/workshop/attack.rs",
];

/// One row of the package table in `src/lib.rs`.
struct Package {
    /// Last word of `palpate-NAME`; `palpate` for the root package.
    name: String,
    uses: BTreeSet<String>,
    /// Production lines that it may have.
    most_lines: usize,
}

fn packages() -> Vec<Package> {
    let text = std::fs::read_to_string(root().join("src/lib.rs")).unwrap();
    let rows = rows(&text, "| package |");
    assert_eq!(rows.len(), PACKAGES.len() + 1, "packages in the table of src/lib.rs");
    let short = |name: &str| name.strip_prefix("palpate-").unwrap_or(name).to_owned();
    rows.iter()
        .map(|row| Package {
            name: short(&names_in(&row[0])[0]),
            uses: names_in(&row[3]).into_iter().collect(),
            most_lines: row[4].parse().unwrap(),
        })
        .collect()
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Folder of a package, below the root of the repository.
fn folder(package: &str) -> String {
    if package == "palpate" { "src".to_owned() } else { format!("src/{package}") }
}

/// Folders below that of a package which belong to other packages.
fn skipped(package: &str) -> &'static [&'static str] {
    if package == "palpate" { &PACKAGES } else { &[] }
}

fn sources(package: &str) -> Sources {
    Sources::read(&folder(package), "crate", skipped(package))
}

/// All packages, with their sources.
fn workspace() -> Vec<(&'static str, Sources)> {
    PACKAGES.iter().chain(&["palpate"]).map(|package| (*package, sources(package))).collect()
}

/// Crates in a section of a package's manifest, spelt as in code.
fn dependencies(package: &str, section: &str) -> BTreeSet<String> {
    let manifest = if package == "palpate" { "Cargo.toml".to_owned() } else { format!("src/{package}/Cargo.toml") };
    let text = std::fs::read_to_string(root().join(manifest)).unwrap();
    let lines = text.split(&format!("\n[{section}]\n")).nth(1).unwrap_or_default();
    let lines = lines.split("\n[").next().unwrap().lines().filter(|line| !line.starts_with('#'));
    let names = lines.map(|line| line.split(['.', ' ', '=']).next().unwrap().replace('-', "_"));
    names.filter(|name| !name.is_empty()).collect()
}

/// True where code names a crate as the start of a path.
fn names_crate(code: &str, name: &str) -> bool {
    code.match_indices(&format!("{name}::")).any(|(at, _)| {
        let before = code[..at].chars().next_back();
        before.is_none_or(|c| !c.is_alphanumeric() && c != '_' && c != ':')
    })
}

/// Lines of a source that ship: neither blank, nor a comment, nor of an item that is built for tests only.
fn production_lines(text: &str) -> usize {
    let (mut lines, mut count) = (text.lines().map(str::trim), 0);
    while let Some(line) = lines.next() {
        if line.starts_with("#[cfg(test)]") {
            let (mut opened, mut closed) = (0, 0);
            lines.by_ref().any(|line| {
                (opened, closed) = (opened + line.matches('{').count(), closed + line.matches('}').count());
                opened <= closed && (opened > 0 || line.ends_with(';'))
            });
        } else if !line.is_empty() && !line.starts_with("//") {
            count += 1;
        }
    }
    count
}

/// Production lines of a package, with its macros and without its tests and examples.
fn lines_of(package: &str) -> usize {
    let (top, mut files) = (root().join(folder(package)), BTreeMap::new());
    gather(&top, &top, skipped(package), &mut files);
    let is_other = |file: &str| {
        let file = format!("/{file}");
        file.ends_with("_tests.rs") || ["/tests.rs", "/tests/", "/examples/"].iter().any(|part| file.contains(part))
    };
    files.iter().filter(|(file, _)| !is_other(file)).map(|(_, text)| production_lines(text)).sum()
}

#[test]
fn packages_keep_to_their_budgets_of_lines() {
    let sample = "//! a\nuse b;\n\n#[cfg(test)]\nmod c;\n#[cfg(test)]\nmod d {\n    fn e() {}\n}\nfn f() {} // g\n";
    assert_eq!(production_lines(sample), 2);
    for Package { name, most_lines, .. } in packages() {
        let lines = lines_of(&name);
        assert!(
            lines <= most_lines,
            "{name} has {lines} production lines; the table of src/lib.rs allows {most_lines}"
        );
    }
}

#[test]
fn packages_use_what_the_table_says() {
    let mut above = BTreeSet::new();
    for package in packages() {
        for used in &package.uses {
            assert!(above.contains(used), "{used} must stand above {} in the table of src/lib.rs", package.name);
        }
        let named = dependencies(&package.name, "dependencies");
        let named = named.iter().filter_map(|name| name.strip_prefix("palpate_")).map(str::to_owned);
        assert_eq!(named.collect::<BTreeSet<_>>(), package.uses, "packages that {} uses", package.name);
        above.insert(package.name);
    }
}

#[test]
fn modules_import_only_from_lower_layers() {
    for package in PACKAGES.into_iter().filter(|package| *package != "workshop") {
        let sources = sources(package);
        let mut layers: BTreeMap<String, usize> = BTreeMap::new();
        for row in rows(&sources.text("lib.rs"), "| layer |") {
            let layer = row[0].parse().unwrap();
            layers.extend(names_in(&row[1]).into_iter().map(|module| (module, layer)));
        }
        let module = |file: &str| file.split('/').next().unwrap().trim_end_matches(".rs").to_owned();
        let exist: BTreeSet<String> =
            sources.files.keys().map(|file| module(file)).filter(|name| name != "lib" && name != "build").collect();
        assert_eq!(layers.keys().cloned().collect::<BTreeSet<_>>(), exist, "modules in the table of src/{package}");
        for (file, others) in sources.imports() {
            let Some(own) = layers.get(&module(file)) else { continue };
            for other in others.iter().filter(|other| module(other) != module(file)) {
                let below = layers.get(&module(other)).is_some_and(|below| below < own);
                assert!(below, "src/{package}/{file} must not import from {other}");
            }
        }
    }
}

#[test]
fn files_do_not_import_each_other() {
    for (_, sources) in workspace() {
        sources.assert_no_cycles();
    }
}

#[test]
fn imports_are_found_through_re_exports() {
    let sources = sources("geometry");
    let imports = sources.imports();
    assert!(imports["mesh_files/mod.rs"].contains("mesh.rs"), "{imports:?}");
    assert!(imports["drawing/overlay.rs"].contains("palette.rs"), "{imports:?}");
    assert!(related("drawing/mod.rs", "drawing/camera.rs") && !related("mesh.rs", "mesh_files/mod.rs"));
}

#[test]
fn public_items_are_documented() {
    let item = ["struct", "enum", "trait", "fn", "const", "static", "type", "union"];
    let is_item = |line: &str| {
        let rest = line.trim_start().strip_prefix("pub ");
        let mut words =
            rest.unwrap_or_default().split_whitespace().skip_while(|word| ["async", "unsafe"].contains(word));
        words.next().is_some_and(|word| item.contains(&word))
    };
    let mut found = 0;
    for (package, sources) in workspace() {
        for file in sources.files.keys().filter(|file| !file.contains("test")) {
            let text = sources.text(file);
            let lines: Vec<&str> = text.lines().take_while(|line| !line.starts_with("#[cfg(test)]")).collect();
            for at in (0..lines.len()).filter(|at| is_item(lines[*at])) {
                let mut above = lines[..at].iter().rev().map(|line| line.trim());
                // Attributes stand between an item and its documentation, some over several lines.
                let near = above.find(|line| line.starts_with("///") || line.is_empty() || line.ends_with(['}', ';']));
                assert!(near.is_some_and(|line| line.starts_with("///")), "{package} {file}: {}", lines[at]);
                found += 1;
            }
        }
    }
    assert!(found > 1000, "only {found} items");
}

#[test]
fn the_window_knows_neither_command_line_nor_physics() {
    let sources = sources("palpate");
    for (file, code) in sources.files.iter().filter(|(file, _)| file.starts_with("app/")) {
        assert!(!code.contains("crate::cli"), "{file} must not know the command line");
        assert!(!code.contains("palpate_sim::physics"), "{file} must not step the physics");
    }
}

#[test]
fn third_party_crates_stay_at_home() {
    let mut used = BTreeSet::new();
    for (package, sources) in workspace() {
        for (file, code) in &sources.files {
            let place = format!("{}/{file}", folder(package));
            for (name, homes) in HOMES.iter().filter(|(name, _)| names_crate(code, name)) {
                used.insert(*name);
                let at_home = homes.iter().any(|home| Path::new(&place).starts_with(home));
                assert!(at_home, "{name} is named in {place}; its home is {}", homes.join(", "));
            }
        }
    }
    let unused: Vec<&str> = HOMES.iter().map(|(name, _)| *name).filter(|name| !used.contains(name)).collect();
    assert!(unused.is_empty(), "no code names {unused:?}");
}

#[test]
fn every_dependency_is_used() {
    for (package, sources) in workspace() {
        for name in dependencies(package, "dependencies").union(&dependencies(package, "build-dependencies")) {
            let has_home = name.starts_with("palpate_") || HOMES.iter().any(|(known, _)| known == name);
            assert!(has_home, "{name} of package {package} has no home in HOMES");
            let used = sources.files.values().any(|code| names_crate(code, name));
            assert!(used, "package {package} depends on {name} but does not use it");
        }
    }
}

#[test]
fn no_two_public_types_share_a_name() {
    let mut homes: BTreeMap<String, String> = BTreeMap::new();
    for (package, sources) in workspace() {
        for (file, code) in &sources.files {
            let place = format!("{}/{file}", folder(package));
            let public = code.lines().filter_map(|line| line.trim_start().strip_prefix("pub "));
            for line in public {
                let mut words = line.split(|c: char| !c.is_alphanumeric() && c != '_');
                if words.next().is_some_and(|word| ["struct", "enum", "trait", "type"].contains(&word)) {
                    let name = words.next().unwrap().to_owned();
                    if let Some(other) = homes.insert(name.clone(), place.clone()) {
                        panic!("{name} is public in {other} and in {place}");
                    }
                }
            }
        }
    }
    assert!(homes.len() > 300, "only {} public types were found", homes.len());
}
