//! One pad, one signal: what strips and pads measure is the same in simulated, physical-like, emulated and recorded grasps.

use crate::calibration::{calibrated, parts, readings};
use crate::program::{json, refused, run};
use palpate_device::emulator::HiddenParts;
use palpate_lab::datasets::{DatasetError, DatasetQuery, SensorView};
use palpate_lab::grasping::grasp;
use palpate_learn::Model;
use palpate_sim::poses::PoseSampler;
use palpate_sim::scene::Scene;
use palpate_store::{BoardChunk, BoardInfo, Store};
use palpate_tactile::board::Board;
use palpate_tactile::calibration::Readout;
use palpate_tactile::electronics::{PadPart, StripPart};
use palpate_tactile::model::PhysicalLike;
use palpate_tactile::trial::{BoardCourse, TrialHeader};
use palpate_tactile::{Sensors, SignalDefinition, Signals};

/// Seed of the emulated hand.
const SEED: u64 = 3;
/// Rest of the emulated hand before it closes (s).
const REST_S: f64 = 0.5;

fn scene() -> Scene {
    let mut scene = Scene::default();
    scene.object.source = "ball".to_owned();
    scene.object.fixed = true;
    scene
}

/// The grasp that the emulated hand does first.
fn simulated() -> Signals {
    let scene = scene();
    let object = scene.load_object().unwrap();
    let drawn = PoseSampler::new(&scene, object.as_ref()).draw(object.as_ref(), SEED + 1).0;
    Sensors::whole_fingers(&drawn.gripper, SignalDefinition::Parts).signals(grasp(&drawn, object.as_ref(), 0).frames())
}

/// The same grasp as its board sends it and calibrations read it.
fn emulated(parts: &HiddenParts) -> Signals {
    let (board, calibrations) = calibrated(parts, 1);
    let (_, stream) = readings(parts, &scene(), &format!("rest={REST_S}; grasp ball"), 4.4, SEED);
    let readout = Readout::new(&board, &calibrations).unwrap();
    readout.derive(&stream, Some(REST_S)).signals.since(REST_S)
}

fn column(signals: &Signals, name: &str) -> Vec<f64> {
    signals.chosen(&[name.to_owned()]).unwrap().values.iter().map(|value| f64::from(*value)).collect()
}

#[test]
fn a_pads_pressure_is_its_force_over_its_area_in_all_four_worlds() {
    let parts = parts(2, true);
    let simulated = simulated();
    let board = emulated(&parts);
    let estimates = {
        let (board, calibrations) = calibrated(&parts, 1);
        let (_, stream) = readings(&parts, &Scene::default(), "load=0.2kg hold=2", 2.0, 5);
        let readout = Readout::new(&board, &calibrations).unwrap();
        readout.derive(&stream, None).signals
    };
    let worlds = [
        ("virtual", simulated.clone()),
        ("physical-like", PhysicalLike::OFF.apply(&simulated, 1)),
        ("physical-like with faults", PhysicalLike::default().apply(&simulated, 1)),
        ("emulated", board),
        ("board", estimates),
    ];
    for (world, signals) in worlds {
        for side in ["left", "right"] {
            let (force, pressure) =
                (column(&signals, &format!("force_{side}")), column(&signals, &format!("pressure_{side}")));
            let most = force.iter().copied().fold(0.0, f64::max);
            assert!(most > 0.1, "{world}: {most} N");
            for (force, pressure) in force.iter().zip(&pressure) {
                assert!((pressure * PadPart::ACTIVE_AREA - force).abs() < 1e-6 * most, "{world}: {force} {pressure}");
            }
        }
    }
}

#[test]
fn a_grasp_reads_the_same_in_simulation_and_through_the_board() {
    let parts = parts(2, false);
    let (simulated, board) = (simulated(), emulated(&parts));
    let at = |signals: &Signals, name: &str, t_s: f64| {
        let k = signals.t_s.iter().position(|own| *own >= t_s).unwrap();
        column(signals, name)[k]
    };
    // In the hold, of 1.6 to 3.2 s.
    for t_s in [2.2, 2.6, 3.0] {
        for side in ["left", "right"] {
            let both = |quantity: &str| {
                let name = format!("{quantity}_{side}");
                [at(&simulated, &name, t_s), at(&board, &name, t_s)]
            };
            let [wanted, read] = both("curvature");
            // A strip that is calibrated point by point is right within a degree.
            let degree = 1f64.to_radians() / StripPart::ACTIVE_LENGTH;
            assert!((wanted - read).abs() < degree, "{side} at {t_s} s: {read} of {wanted} 1/m");
            let [wanted, read] = both("pressure");
            // A pad is right within 5 % of its load, and below its threshold not at all. Bending, which no empty close has
            // measured here, is a part of what it reads.
            let bending = MOST_BENDING_LOAD * at(&simulated, &format!("curvature_{side}"), t_s);
            let force = wanted * PadPart::ACTIVE_AREA;
            let within = 0.05 * (force + bending) + 0.02;
            assert!(force + bending > 1.3 * PadPart::LEAST_FORCE, "too light a grasp: {force} N");
            let more = read * PadPart::ACTIVE_AREA - force;
            assert!((-within..bending + within).contains(&more), "{side} at {t_s} s: {read} of {wanted} Pa");
        }
    }
}

/// Largest load that bending puts on a pad of the emulated gripper (N m).
const MOST_BENDING_LOAD: f64 = 0.02;

#[test]
fn contact_pressure_is_refused_where_only_pads_can_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    json(at, &["grasp", "ball", "--fixed", "--json"]);
    refused(at, &["train", "knn", "--layout", "C1+F", "--out", "a.safetensors"], &["choose C1", "--signals contact"]);
    let physical = ["train", "knn", "--signals", "contact", "--sensors", "physical-like", "--out", "a.safetensors"];
    refused(at, &physical, &["--signals parts"]);
    refused(at, &["trials", "export", "1", "--layout", "C2+F", "--out", "csv"], &["choose C2"]);
    let header = |arguments: &[&str]| {
        run(at, arguments);
        let text = std::fs::read_to_string(at.join("a.csv")).unwrap();
        text.lines().next().unwrap().to_owned()
    };
    let parts = header(&["trials", "export", "1", "--out", "a.csv"]);
    assert!(parts.contains(",pressure_left [Pa],pressure_right [Pa],force_left [N],"), "{parts}");
    let contact = header(&["trials", "export", "1", "--signals", "hull", "--out", "a.csv"]);
    assert!(contact.contains(",contact_pressure_left [Pa],") && !contact.contains("force"), "{contact}");

    let mut store = Store::open(&at.join("trials.sqlite")).unwrap();
    let about =
        BoardInfo { course: BoardCourse { board: Board::default(), ..BoardCourse::default() }, ..BoardInfo::default() };
    let id = store.begin_board(&TrialHeader::new("ball", Scene::default()), &about).unwrap();
    store.append_board(id, &about, &BoardChunk::default()).unwrap();
    store.finish_board(id, &about, &[]).unwrap();
    let view = SensorView { signals: SignalDefinition::Contact, ..SensorView::default() };
    let refused = DatasetQuery::default().read_trial(&store, id, &view).expect_err("a real gripper");
    assert!(matches!(refused, DatasetError::OnlySimulated { .. }), "{refused}");
}

#[test]
fn a_model_of_an_earlier_version_never_runs_on_what_pads_measure() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("old.safetensors");
    let mut model = crate::scripted::made_up();
    // As versions wrote it that knew no definition: contact pressure was called pressure.
    model.card.data.signals = None;
    model.card.data.sensors = Some("virtual".to_owned());
    palpate_lab::datasets::save_model(&model, &path).unwrap();
    let old = Model::load(&path).unwrap();
    assert!(old.card.only_simulated() && old.card.described().contains("simulation only"), "{}", old.card.described());
    assert_eq!(old.card.data.signals.as_deref(), Some("contact"));
    assert_eq!(SensorView::of_model(&old.card).signals, SignalDefinition::Contact);
    let board: Vec<String> =
        ["curvature_left", "curvature_right", "pressure_left", "pressure_right"].map(str::to_owned).to_vec();
    let refused = old.check_channels(&board).expect_err("pads measure no contact pressure").to_string();
    assert!(refused.contains("no real gripper can run this model"), "{refused}");
    assert!(refused.contains("simulated grasps need --signals contact"), "{refused}");
    // One that was trained on a board's readings stays as it was.
    let mut recorded = crate::scripted::made_up();
    (recorded.card.data.signals, recorded.card.data.sensors) = (None, None);
    palpate_lab::datasets::save_model(&recorded, &path).unwrap();
    assert_eq!(Model::load(&path).unwrap().card.channels, recorded.card.channels);
}
