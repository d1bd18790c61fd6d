//! Trials written and read back, in every format.

use super::*;
use palpate_lab::grasping::grasp;
use palpate_lab::inspection::{OpenOptions, OpenTrial};
use palpate_sim::scene::Scene;
use palpate_store::{ImportedTrial, Store};
use palpate_tactile::Signals;
use palpate_tactile::trial::TrialId;
use std::cell::Cell;

pub(crate) fn store_of(objects: &[&str]) -> (tempfile::TempDir, Store) {
    let folder = tempfile::tempdir().expect("a folder");
    let mut store = Store::open(&folder.path().join("trials.sqlite")).expect("opens");
    for object in objects {
        let mut scene = Scene::default();
        scene.object.source = (*object).to_owned();
        scene.timing.duration_s = 1.5;
        let model = scene.load_object().expect("built in");
        store.insert(&grasp(&scene, model.as_ref(), 0)).expect("stored");
    }
    (folder, store)
}

/// Writes trials, unless it is stopped.
fn write(
    store: &Store,
    ids: &[TrialId],
    options: &OpenOptions,
    (path, is_stopped): (&Path, &dyn Fn() -> bool),
) -> Result<Written, ExchangeError> {
    write_trials(&TrialExport { store, ids, options, taxels: false, is_stopped }, path)
}

/// The ideal sensors' forces on both pads at each sample of a simulated trial (N).
pub(crate) fn ideal_forces(store: &Store, id: TrialId) -> Vec<[f64; 2]> {
    let open = OpenTrial::open(store, id, &OpenOptions::default()).expect("opens");
    let [left, right] = ["force_left", "force_right"].map(|name| &open.column(name).expect("is read").values);
    let forces: Vec<[f64; 2]> = left.iter().zip(right).map(|(l, r)| [l, r].map(|force| f64::from(*force))).collect();
    assert!(forces.iter().flatten().any(|force| *force > 0.1), "trial {id} holds its object");
    forces
}

/// Checks that the normal forces of all taxels, the left pad first, add up to those of ideal sensors (N).
pub(crate) fn assert_sums(normal: &[f32], wanted: [f64; 2]) {
    for (pad, wanted) in normal.chunks(normal.len() / 2).zip(wanted) {
        let sum: f64 = pad.iter().map(|force| f64::from(*force)).sum();
        assert!((sum - wanted).abs() < 1e-5, "{sum} N instead of {wanted}");
    }
}

/// A store with a simulated trial of a lemon and an imported one.
pub(crate) fn mixed_store() -> (tempfile::TempDir, Store) {
    let (folder, mut store) = store_of(&["lemon"]);
    let signals = Signals { channels: vec!["grip".to_owned()], t_s: vec![0.0, 0.1], values: vec![1.0, 2.0] };
    let (name, label) = ("1".to_owned(), "mug".to_owned());
    let imported = ImportedTrial { name, label, size: None, shape: None, session: None, signals };
    store.insert_imported("mine", &[imported]).expect("stored");
    (folder, store)
}

#[test]
fn trials_with_taxels_come_back_as_those_without() -> Result<(), Box<dyn std::error::Error>> {
    let (folder, store) = mixed_store();
    let options = OpenOptions::default();
    let export = |ids: &[TrialId], taxels: bool, path: &Path| {
        write_trials(&TrialExport { store: &store, ids, options: &options, taxels, is_stopped: &|| false }, path)
    };
    for ending in ["mcap", "npz", "parquet"] {
        let [bare, full] = ["bare", "full"].map(|name| folder.path().join(format!("{name}.{ending}")));
        export(&[1], false, &bare)?;
        export(&[1], true, &full)?;
        let [bare, full] = [bare, full].map(|path| {
            let columns = columns_of(&path, &Mapping::default()).expect("lists");
            (
                columns,
                read_trials(&path, &Mapping::default()).expect("reads"),
                std::fs::metadata(path).expect("is there"),
            )
        });
        assert!(full.2.len() > bare.2.len(), "{ending}");
        assert_eq!((bare.0, bare.1), (full.0, full.1), "{ending}");
        let lost = folder.path().join(format!("lost.{ending}"));
        let error = export(&[2], true, &lost).expect_err("refused").to_string();
        assert!(error.contains("only simulated grasps") && !lost.exists(), "{error}");
    }
    let error = export(&[1], true, folder.path()).expect_err("refused").to_string();
    assert!(error.contains(".contacts.csv"), "{error}");
    Ok(())
}

#[test]
fn a_data_set_of_lerobot_has_an_episode_for_each_trial() -> Result<(), Box<dyn std::error::Error>> {
    let (folder, mut store) = store_of(&["lemon", "ball"]);
    let (at, options) = (folder.path().join("set"), OpenOptions::default());
    let export = |store: &Store, ids: &[TrialId], taxels: bool, path: &Path| {
        write_lerobot(&TrialExport { store, ids, options: &options, taxels, is_stopped: &|| false }, path)
    };
    export(&store, &[1, 2], true, &at)?;
    let read = |name: &str| std::fs::read_to_string(at.join(name));
    let info: serde_json::Value = serde_json::from_str(&read("meta/info.json")?)?;
    let opened = [1, 2].map(|id| OpenTrial::open(&store, id, &options).expect("opens"));
    let frames: usize = opened.iter().map(|open| open.t_s.len()).sum();
    assert_eq!((&info["total_frames"], &info["fps"]), (&serde_json::json!(frames), &serde_json::json!(75)));
    let features = &info["features"];
    assert_eq!(features["observation.state"]["names"], serde_json::json!(["curvature_left", "curvature_right"]));
    for (name, width) in [("observation.tactile", 4), ("observation.taxel_shear", 640), ("action", 1)] {
        assert_eq!(features[name]["shape"], serde_json::json!([width]), "{name}");
    }
    let stats: serde_json::Value = serde_json::from_str(&read("meta/stats.json")?)?;
    let force = opened.iter().flat_map(|open| &open.column("force_left").expect("is read").values);
    let highest = force.copied().fold(0.0, f32::max);
    assert!((stats["observation.tactile"]["max"][2].as_f64().expect("a number") - f64::from(highest)).abs() < 1e-9);
    assert_eq!(stats["action"]["count"], serde_json::json!([frames]));
    let card = read("README.md")?;
    for text in ["license: unknown", "- LeRobot", "| lemon | 1 |", "physics 2", "`force_left` (N)", "free object"] {
        assert!(card.contains(text), "{text}: {card}");
    }
    // Its tables come back by the profile for data sets of LeRobot.
    export(&store, &[1, 2], false, &folder.path().join("bare"))?;
    let data = folder.path().join("bare/data/chunk-000/file-000.parquet");
    let import = read_trials(&data, &Mapping::profile("lerobot")?)?;
    for (trial, open) in import.trials.iter().zip(&opened) {
        let column = |name: &str| trial.signals.channels.iter().position(|own| own == name).expect(name);
        assert_eq!(trial.signals.t_s.len(), open.t_s.len());
        for (name, own) in [("observation.state_1", "curvature_right"), ("observation.tactile_2", "force_left")] {
            let (column, own) = (column(name), &open.column(own).expect("is read").values);
            assert!((0..own.len()).all(|k| trial.signals.row(k)[column].to_bits() == own[k].to_bits()), "{name}");
        }
    }
    assert_eq!(import.trials.len(), 2);

    let error = export(&store, &[1], false, &at).expect_err("refused").to_string();
    assert!(error.contains("is not empty"), "{error}");
    let signals = Signals { channels: vec!["grip".to_owned()], t_s: vec![0.0, 0.1], values: vec![1.0, 2.0] };
    let (name, label) = ("1".to_owned(), "mug".to_owned());
    let imported = ImportedTrial { name, label, size: None, shape: None, session: None, signals };
    store.insert_imported("mine", &[imported])?;
    let other = folder.path().join("other");
    for (taxels, wanted) in [(false, "no channel that all"), (true, "trial 3 has no taxels")] {
        let error = export(&store, &[1, 3], taxels, &other).expect_err("refused").to_string();
        assert!(error.contains(wanted) && !other.exists(), "{error}");
    }
    // What other programs measured has no line pressure, so that nothing acts.
    export(&store, &[3], false, &other)?;
    let info: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(other.join("meta/info.json"))?)?;
    assert!(info["features"].get("action").is_none() && info["fps"] == 10);
    Ok(())
}

fn bits(signals: &Signals) -> (Vec<u64>, Vec<u32>) {
    (signals.t_s.iter().map(|t| t.to_bits()).collect(), signals.values.iter().map(|v| v.to_bits()).collect())
}

#[test]
fn channels_come_back_from_mcap_bit_by_bit() -> Result<(), Box<dyn std::error::Error>> {
    let (folder, mut store) = store_of(&["lemon", "ball"]);
    // Numbers with all bits in use, at uneven times.
    let awkward = Signals {
        channels: vec!["grip".to_owned(), "a b, \"c\" [N]".to_owned()],
        t_s: vec![-0.1, 1.0 / 3.0, 0.333_333_333_333_333_4, 2e9 + 1e-7],
        values: vec![1e-45, -0.0, f32::MIN_POSITIVE, 0.1, f32::MAX, 1.0 + f32::EPSILON, -3.3, 7.0],
    };
    let imported = ImportedTrial {
        name: "first".to_owned(),
        label: "mug".to_owned(),
        size: None,
        shape: None,
        session: None,
        signals: awkward.clone(),
    };
    store.insert_imported("mine", &[imported])?;
    let path = folder.path().join("out.mcap");
    let models = palpate_learn::Models::shipped()?;
    let options = OpenOptions { models, ..OpenOptions::default() };
    assert_eq!(write(&store, &[1, 2, 3], &options, (&path, &|| false))?.files, [path.as_path()]);
    let import = read_trials(&path, &Mapping { label: Some("unused".to_owned()), ..Mapping::default() })?;
    assert!(import.warnings.is_empty(), "{:?}", import.warnings);
    let labels: Vec<&str> = import.trials.iter().map(|trial| trial.label.as_str()).collect();
    assert_eq!(labels, ["lemon", "ball", "mug"]);
    for (trial, id) in import.trials.iter().zip([1, 2]) {
        let stored = store.load(id)?;
        let open = OpenTrial::open(&store, id, &OpenOptions::default())?;
        let wanted = palpate_tactile::Sensors::new(
            &palpate_tactile::SensorLayout::named("C1+F")?,
            &stored.header.scene.gripper,
            palpate_tactile::SignalDefinition::Parts,
        )?;
        // Where a pressure is undefined, recognisers take none: so do imported trials.
        assert_eq!(bits(&trial.signals), bits(&wanted.signals(stored.frames())));
        assert_eq!(trial.signals.t_s, open.t_s);
        assert!(trial.size.is_some() && trial.shape.is_some());
    }
    let back = &import.trials[2];
    assert_eq!(bits(&back.signals), bits(&awkward));
    // A second way through the store and a file changes nothing more.
    let mut other = Store::open(&folder.path().join("other.sqlite"))?;
    assert_eq!(other.insert_imported("bag", &import.trials)?, 3);
    let again = folder.path().join("again.mcap");
    write(&other, &[1, 2, 3], &OpenOptions::default(), (&again, &|| false))?;
    for (first, second) in import.trials.iter().zip(read_trials(&again, &Mapping::default())?.trials) {
        assert_eq!((bits(&first.signals), &first.label), (bits(&second.signals), &second.label));
    }
    Ok(())
}

#[test]
fn arrays_and_tables_come_back_with_times_labels_units_and_gaps() -> Result<(), Box<dyn std::error::Error>> {
    let (folder, mut store) = store_of(&["lemon", "ball"]);
    let stored: Vec<Signals> = [1, 2]
        .iter()
        .map(|id| {
            let open = OpenTrial::open(&store, *id, &OpenOptions::default()).expect("opens");
            let channels = open.columns.iter().map(|column| column.name.clone()).collect();
            let mut signals = Signals { channels, ..Signals::default() };
            for (k, t) in open.t_s.iter().enumerate() {
                let value = |value: f32| if value.is_nan() { 0.0 } else { value };
                signals.push(*t, &open.columns.iter().map(|column| value(column.values[k])).collect::<Vec<_>>());
            }
            signals
        })
        .collect();
    let mut trials: Vec<ImportedTrial> = Vec::new();
    for (name, signals) in ["lemon", "ball"].iter().zip(&stored) {
        let label = (*name).to_owned();
        trials.push(ImportedTrial {
            name: label.clone(),
            label,
            size: None,
            shape: None,
            session: None,
            signals: signals.clone(),
        });
    }
    // A gap of a channel, and one of all.
    let width = stored[0].channels.len();
    (40..50).for_each(|k| trials[0].signals.values[k * width] = f32::NAN);
    trials[1].signals.values[60 * width..80 * width].fill(f32::NAN);
    store.insert_imported("gaps", &trials)?;
    for ending in ["npz", "parquet"] {
        let path = folder.path().join(format!("out.{ending}"));
        write(&store, &[3, 4], &OpenOptions::default(), (&path, &|| false))?;
        let import = read_trials(&path, &Mapping::default())?;
        assert_eq!(import.trials.len(), 2, "{ending}");
        for (trial, wanted) in import.trials.iter().zip(&trials) {
            assert_eq!((&trial.label, &trial.signals.channels), (&wanted.label, &wanted.signals.channels), "{ending}");
            assert_eq!(bits(&trial.signals).1, bits(&wanted.signals).1, "{ending} {}", wanted.label);
            // Times within a gap of all channels are made anew.
            let times = trial.signals.t_s.iter().zip(&wanted.signals.t_s);
            assert!(times.clone().all(|(t, own)| (t - own).abs() < 1e-12), "{ending} {}", wanted.label);
        }
        assert!(import.warnings.iter().any(|text| text.contains("flagged: no readings")), "{:?}", import.warnings);
    }
    Ok(())
}

#[test]
fn an_export_that_ends_early_leaves_no_file() {
    let (folder, store) = store_of(&["ball", "ball"]);
    let options = OpenOptions::default();
    for format in FORMATS.iter().filter(|format| format.kind() != FileKind::Csv) {
        let ending = format.kind().endings()[0];
        let path = folder.path().join(format!("out.{ending}"));
        let asked = Cell::new(0);
        let is_stopped = || asked.replace(asked.get() + 1) > 0;
        let outcome = write(&store, &[1, 2], &options, (&path, &is_stopped));
        assert!(matches!(outcome, Err(ExchangeError::Stopped)), "{ending}");
        assert_eq!(asked.get(), 2);
        let outcome = write(&store, &[1, 99], &options, (&path, &|| false));
        assert!(matches!(outcome, Err(ExchangeError::Open(_) | ExchangeError::Store(_))), "{ending}");
        let nowhere = folder.path().join(format!("no/such/out.{ending}"));
        let outcome = write(&store, &[1], &options, (&nowhere, &|| false));
        assert!(matches!(outcome, Err(ExchangeError::Refused(_))), "{ending}");
    }
    let names: Vec<String> = std::fs::read_dir(folder.path())
        .expect("reads")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .filter(|name| !name.starts_with("trials.sqlite"))
        .collect();
    assert!(names.is_empty(), "{names:?}");
    for (ids, path, wanted) in
        [(&[1][..], "a.xyz", "csv, mcap, npz"), (&[1, 2], "a.csv", "several trials need a folder")]
    {
        let error = write(&store, ids, &options, (Path::new(path), &|| false)).expect_err("refused").to_string();
        assert!(error.contains(wanted), "{error}");
    }
    let error = read_trials(Path::new("a.npz"), &Mapping::default()).expect_err("refused").to_string();
    assert!(error.contains("\"a.npz\": No such file"), "{error}");
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig::with_cases(24))]

    /// A grasp that is written in any units gives the answers of the grasp.
    #[test]
    fn units_do_not_change_answers(choice in proptest::collection::vec(0usize..100, 12), time in 0usize..4) {
        let (_folder, store) = store_of(&["lemon"]);
        let trial = store.load(1).expect("stored");
        let layout = palpate_tactile::SensorLayout::named("C1+F").expect("known");
        let gripper = &trial.header.scene.gripper;
        let definition = palpate_tactile::SignalDefinition::Parts;
        let sensors = palpate_tactile::Sensors::new(&layout, gripper, definition).expect("sensors");
        let signals = sensors.signals(trial.frames());
        let units = |name: &str| match palpate_tactile::unit_of_channel(name).1 {
            "N" => &["N", "mN", "gf", "kgf", "lbf"][..],
            "Pa" => &["Pa", "kPa", "hPa", "MPa", "psi", "mbar", "bar", "N/cm2"],
            "1/m" => &["1/m", "1/mm", "1/cm", "m^-1"],
            _ => &[""],
        };
        let chosen: Vec<&str> =
            signals.channels.iter().zip(&choice).map(|(name, k)| units(name)[k % units(name).len()]).collect();
        let clock = ["s", "ms", "us", "ns"][time];
        let factor = |unit: &str| palpate_tactile::Unit::parse(unit).map_or(1.0, |unit| unit.factor);
        let mut text = format!("trial,label,t_s [{clock}]");
        signals.channels.iter().zip(&chosen).for_each(|(name, unit)| text += &format!(",{name} [{unit}]"));
        for (sample, t) in signals.t_s.iter().enumerate() {
            text += &format!("\n1,lemon,{}", t / factor(clock));
            let row = signals.row(sample).iter().zip(&chosen);
            row.for_each(|(value, unit)| text += &format!(",{}", f64::from(*value) / factor(unit)));
        }
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.csv");
        std::fs::write(&path, text.replace(" []", "")).expect("writes");
        let import = read_trials(&path, &Mapping::default()).expect("reads");
        let read = &import.trials[0].signals;
        proptest::prop_assert_eq!(&read.channels, &signals.channels);
        let model = palpate_learn::Models::shipped().expect("shipped");
        let model = model.of(palpate_learn::Shipped::PerfectSensors).expect("shipped");
        let answer = |signals: &Signals| {
            let chosen = signals.chosen(&model.card.channels).expect("its channels");
            model.recogniser.recognise(&palpate_lab::datasets::sequence_of(&chosen), None).pmf.probabilities().to_vec()
        };
        for (a, b) in answer(&signals).iter().zip(answer(read)) {
            proptest::prop_assert!((a - b).abs() < 1e-3, "{} {}", a, b);
        }
    }
}
