//! Random changes of sound files through every reader of files: an error in words or something sound comes out, never a
//! panic, and no reader asks for memory out of proportion.
//!
//! A few changes of each run with every test. `PALPATE_FUZZ_S=900 cargo test --release --test suite reader_fuzz` changes the
//! files of each reader for a quarter of an hour, and lists the slowest and the largest.

use crate::allocations::peak_of;
use palpate_exchange::{Mapping, read_points_csv, read_trials};
use palpate_geometry::read_mesh;
use palpate_learn::Model;
use palpate_sim::objects::{LoadOptions, load};
use palpate_sim::scene::Scene;
use palpate_store::Store;
use palpate_tactile::calibration::SensorKind;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;
use std::time::{Duration, Instant};

/// Reads a file; true where something sound came of it.
type Reader = fn(&Path) -> Result<(), String>;

fn text<E: std::fmt::Display>(error: E) -> String {
    error.to_string()
}

fn trials(path: &Path) -> Result<(), String> {
    let own = read_trials(path, &Mapping::default());
    let roles = Mapping {
        time: Some("t_s".to_owned()),
        label: Some("mug".to_owned()),
        split_gap_s: Some(0.5),
        ..Mapping::default()
    };
    let import = own.or_else(|_| read_trials(path, &roles)).map_err(text)?;
    for trial in &import.trials {
        let signals = &trial.signals;
        assert!(signals.len() >= 2 && signals.values.len() == signals.len() * signals.channels.len());
        assert!(signals.t_s.is_sorted_by(|a, b| a < b) && !signals.values.iter().any(|value| value.is_infinite()));
        assert!(signals.clone().filled().values.iter().all(|value| value.is_finite()));
    }
    Ok(())
}

fn object(path: &Path) -> Result<(), String> {
    let object = load(path.to_str().unwrap(), &LoadOptions::default()).map_err(text)?.unwrap();
    assert!(object.mass.is_physical() && object.bounds.size().is_finite());
    Ok(())
}

fn mesh(path: &Path) -> Result<(), String> {
    let name = path.to_str().unwrap();
    read_mesh(name, &|other| std::fs::read(other)).map(drop).map_err(text)
}

fn store(path: &Path) -> Result<(), String> {
    let store = Store::open_to_read(path).map_err(text)?;
    let rows = store.list(false).map_err(text)?;
    rows.iter().try_for_each(|row| store.load(row.id).map(drop)).map_err(text)
}

/// A reader, the ending of its files, and sound ones.
fn readers() -> Vec<(&'static str, &'static str, Reader, Vec<Vec<u8>>)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let cases = |ending: &str| -> Vec<Vec<u8>> {
        let folder = std::fs::read_dir(root.join("tests/suite/cases/objects")).unwrap();
        let paths = folder.map(|entry| entry.unwrap().path());
        let own = paths.filter(|path| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending)));
        own.map(|path| std::fs::read(path).unwrap()).collect()
    };
    let file = |name: &str| vec![std::fs::read(root.join(name)).unwrap()];
    let exported = exported();
    let of = |ending: &str| vec![exported.iter().find(|(own, _)| *own == ending).unwrap().1.clone()];
    let profile: Reader = |path| Mapping::profile(path.to_str().unwrap()).map(drop);
    let scene: Reader = |path| Scene::from_file(path).map(drop).map_err(text);
    let model: Reader = |path| Model::load(path).map(drop).map_err(text);
    let points: Reader = |path| read_points_csv(path, SensorKind::Flex).map(drop).map_err(text);
    let points_text = "angle_deg,counts\n0,1000\n30,1200\n60,1400\n90,1600\n";
    vec![
        ("obj", "obj", mesh, cases("obj")),
        ("stl", "stl", mesh, cases("stl")),
        ("urdf", "urdf", object, cases("urdf")),
        ("csv", "csv", trials, of("csv")),
        ("mcap", "mcap", trials, of("mcap")),
        ("npz", "npz", trials, of("npz")),
        ("parquet", "parquet", trials, of("parquet")),
        ("profile", "toml", profile, file("assets/profiles/lerobot.toml")),
        ("scene", "toml", scene, vec![Scene::default().to_toml().into_bytes()]),
        ("model", "safetensors", model, file("models/live.safetensors")),
        ("points", "csv", points, vec![points_text.as_bytes().to_vec()]),
        ("store", "sqlite", store, file("tests/suite/data/store.sqlite")),
    ]
}

/// Exports of a short imported trial, and the same as a table.
fn exported() -> Vec<(&'static str, Vec<u8>)> {
    use palpate_exchange::{TrialExport, write_trials};
    use palpate_lab::inspection::OpenOptions;
    let folder = tempfile::tempdir().unwrap();
    let rows = (0..30)
        .map(|k| format!("1,mug,{},{k},{}\n2,key,{},{},1\n", 0.02 * f64::from(k), 30 - k, 0.02 * f64::from(k), k * k));
    let table: String =
        std::iter::once("trial,label,t_s,grip [N],pressure_left [kPa]\n".to_owned()).chain(rows).collect();
    let path = folder.path().join("a.csv");
    std::fs::write(&path, &table).unwrap();
    let mut store = Store::open(&folder.path().join("a.sqlite")).unwrap();
    store.insert_imported("a", &read_trials(&path, &Mapping::default()).unwrap().trials).unwrap();
    let options = OpenOptions::default();
    let export = TrialExport { store: &store, ids: &[1, 2], options: &options, taxels: false, is_stopped: &|| false };
    let mut files = vec![("csv", table.into_bytes())];
    for ending in ["mcap", "npz", "parquet"] {
        let path = folder.path().join(format!("b.{ending}"));
        write_trials(&export, &path).unwrap();
        files.push((ending, std::fs::read(path).unwrap()));
    }
    files
}

/// Texts that upset readers.
const WORDS: [&str; 16] = [
    "nan",
    "-inf",
    "1e400",
    "1e30",
    "-1",
    "0",
    "99999999999999999999",
    "0x10",
    "1,5",
    "\"",
    "\u{feff}",
    "\n\n",
    "\\",
    "<!--",
    "\u{1b}[31m",
    "[[",
];

/// A sound file with some changes.
fn changed(random: &mut ChaCha8Rng, sound: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = sound[random.random_range(0..sound.len())].clone();
    for _ in 0..random.random_range(1..6) {
        let length = bytes.len();
        if length == 0 {
            break;
        }
        let at = random.random_range(0..length);
        let end = (at + random.random_range(1..40usize)).min(length);
        match random.random_range(0..9) {
            0 => bytes[at] = random.random(),
            1 => bytes[at] ^= 1 << random.random_range(0..8),
            2 => bytes.truncate(at),
            3 => drop(bytes.drain(at..end)),
            4 => drop(bytes.splice(at..at, bytes[at..end].to_vec())),
            5 => drop(bytes.splice(at..end, WORDS[random.random_range(0..WORDS.len())].bytes())),
            6 => drop(bytes.splice(at..at, std::iter::repeat_n(bytes[at], random.random_range(1..300)))),
            7 => {
                // Sizes and counts are whole numbers of four or eight bytes.
                let number = [0, 1, u64::from(u32::MAX), u64::MAX, 1 << 40, 255][random.random_range(0..6)];
                number.to_le_bytes().iter().zip(&mut bytes[at..]).take(8).for_each(|(new, old)| *old = *new);
            }
            _ => {
                let other = &sound[random.random_range(0..sound.len())];
                let from = random.random_range(0..other.len().max(1)).min(other.len());
                let part = other[from..(from + 60).min(other.len())].to_vec();
                drop(bytes.splice(at..end, part));
            }
        }
    }
    bytes
}

/// Memory that a reader may take for its tables and buffers (bytes), besides ten times the file.
const ROOM: usize = 24 << 20;
/// The same for the reader of objects, which fills a grid of distances.
const ROOM_OF_GRIDS: usize = 256 << 20;

#[test]
fn changed_files_end_in_order() {
    let whole = std::env::var("PALPATE_FUZZ_S").ok().and_then(|text| text.parse().ok());
    let seconds = Duration::from_secs_f64(whole.unwrap_or(0.4));
    let only = std::env::var("PALPATE_FUZZ_READER").ok();
    let folder = tempfile::tempdir().unwrap();
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if !palpate_exchange::is_contained() {
            usual(panic);
        }
    }));
    for (name, ending, reader, sound) in readers() {
        if only.as_ref().is_some_and(|only| only != name) {
            continue;
        }
        let reads = |bytes: &Vec<u8>| {
            let path = folder.path().join(format!("{name}.{ending}"));
            std::fs::write(&path, bytes).unwrap();
            name == "model" || reader(&path).is_ok()
        };
        assert!(sound.iter().any(reads), "{name} reads nothing");
        let room = if name == "urdf" { ROOM_OF_GRIDS } else { ROOM };
        let mut random = ChaCha8Rng::seed_from_u64(whole.map_or(1, |_| u64::from(std::process::id())));
        let (mut read, mut refused, mut longest, mut most) = (0u64, 0u64, Duration::ZERO, 0);
        let began = Instant::now();
        // At least some, however slow the machine.
        while began.elapsed() < seconds || read + refused < 20 {
            let bytes = changed(&mut random, &sound);
            let path = folder.path().join(format!("{name}.{ending}"));
            std::fs::write(&path, &bytes).unwrap();
            if name == "model" {
                let card = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/live.json");
                std::fs::copy(card, path.with_extension("json")).unwrap();
            }
            let number = read + refused;
            let start = Instant::now();
            let (peak, outcome) = peak_of(|| std::panic::catch_unwind(|| reader(&path)));
            let took = start.elapsed();
            let kept = || {
                let kept = std::env::temp_dir().join(format!("palpate-fuzz-{name}-{number}.{ending}"));
                std::fs::write(&kept, &bytes).unwrap();
                kept
            };
            match outcome {
                Ok(Ok(())) => read += 1,
                Ok(Err(why)) => {
                    refused += 1;
                    assert!(!why.is_empty() && why.len() < 6000, "{name}: {why}");
                }
                Err(_panic) => panic!("{name} panics at {}", kept().display()),
            }
            assert!(
                peak < 10 * bytes.len() + room,
                "{name} takes {peak} bytes for {} at {}",
                bytes.len(),
                kept().display()
            );
            if whole.is_some() && took > Duration::from_secs(1) {
                println!("{name}: {took:?} at {}", kept().display());
            }
            (longest, most) = (longest.max(took), most.max(peak));
        }
        println!("{name}: {read} read, {refused} refused, longest {longest:?}, most memory {} KiB", most >> 10);
        assert!(refused > 0, "{name} refuses nothing");
    }
}

#[test]
fn a_page_of_parquet_that_claims_gigabytes_is_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let sound = exported().into_iter().find(|(ending, _)| *ending == "parquet").unwrap().1;
    // The first page begins behind the mark of four bytes: its kind, its size unpacked (0x15, then seven bits to a byte), and
    // its size packed, which gives way so that the page keeps its place.
    let number = |from: usize| from + 1 + sound[from + 1..].iter().position(|byte| byte & 0x80 == 0).unwrap() + 1;
    let (unpacked, packed) = (number(4), number(number(4)));
    assert!([4, unpacked, packed].iter().all(|at| sound[*at] == 0x15));
    let claim = [0x15, 0x80, 0xa8, 0xd6, 0xb9, 0x0f, 0x15, 0x02];
    let changed = [&sound[..unpacked], &claim, &sound[number(packed)..]].concat();
    let path = folder.path().join("claim.parquet");
    std::fs::write(&path, &changed).unwrap();
    let (peak, outcome) = peak_of(|| trials(&path));
    let why = outcome.unwrap_err();
    assert!(peak < 4 << 20 && why.contains("a page claims to unpack to 2073741824 bytes"), "{peak}: {why}");
}
