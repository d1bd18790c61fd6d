//! A gripper that only its file describes: two pads on each finger and the pressure in the chambers, from its board's lines to
//! a model that recognises with them, in the terminal and in the window.

use crate::bench::{Bench, BenchSetup};
use crate::cpu_renderer::CpuRenderer;
use crate::gripper::{FAST, scene};
use crate::{scripted, streams};
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use palpate::app::Mode;
use palpate_device::emulator::{EmulatedFault, EmulatedGripper, EmulatorSetup, HandPlan, HiddenParts};
use palpate_device::protocol::{BoardEvent, Decoder};
use palpate_lab::datasets::{DatasetQuery, SensorView, trial_signals};
use palpate_lab::grasping::{Adaptation, GraspController, GraspPlan, Identification, Row};
use palpate_lab::gripper::Listen;
use palpate_learn::{Dataset, Fitting, Model, Models, StopRule};
use palpate_sim::gripper::Phase;
use palpate_sim::objects::EMPTY;
use palpate_sim::scene::Scene;
use palpate_store::{BoardChunk, BoardInfo, Store};
use palpate_tactile::board::SensorList;
use palpate_tactile::trial::{BoardCourse, Control, TrialHeader, TrialId, TrialSource};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// The file, as in the manual.
pub(crate) const GRIPPER: &str = include_str!("../../assets/grippers/two_pads.toml");

fn sensors() -> SensorList {
    SensorList::parse(GRIPPER).unwrap()
}

/// The board and what the hand grasps.
fn emulated(parts: &HiddenParts, object: &str, seed: u64, faults: Vec<EmulatedFault>) -> EmulatorSetup {
    let (sensors, objects) = (sensors(), vec![object.to_owned()]);
    let hand = HandPlan { sensors, scene: scene(), objects, seed, grasp_every_s: None, script: Vec::new() };
    let (channels, parts) = (sensors.len(), parts.clone());
    EmulatorSetup { hand, parts, rate_hz: 50, channels, most_steps: 30, clock_start_us: 0, faults, seed }
}

/// Records one grasp of an emulated gripper of this file, whose board has faults.
pub(crate) fn recorded(
    store: &mut Store,
    parts: &HiddenParts,
    object: &str,
    seed: u64,
    faults: Vec<EmulatedFault>,
) -> TrialId {
    let scene = scene();
    let sensors = sensors();
    let mut gripper = EmulatedGripper::new(emulated(parts, object, seed, faults)).unwrap();
    let mut controller = GraspController::new(GraspPlan::recorded(&scene, Control::Driven), 0.0);
    let (mut decoder, mut events, mut phases) = (Decoder::new(sensors), Vec::new(), Vec::new());
    for k in 1..=600u32 {
        let now_s = 0.01 * f64::from(k);
        gripper.advance(now_s);
        decoder.push(&gripper.take_bytes(), now_s, &mut events);
        if let Some(command) = controller.command(now_s) {
            gripper.hear(format!("P {:.2}\n", command.bar).as_bytes());
            phases.push(controller.mark(&command));
        }
    }
    let board = decoder.board();
    assert!(sensors.iter().all(|sensor| board.channel_of(sensor).is_some()), "{:?}", board.channels);
    let header = TrialHeader::new(object, scene);
    let about = BoardInfo { course: BoardCourse { board, phases, ..BoardCourse::default() }, ..BoardInfo::default() };
    let id = store.begin_board(&header, &about).unwrap();
    let readings = events.into_iter().filter_map(BoardEvent::into_reading).collect();
    store.append_board(id, &about, &BoardChunk { readings, ..BoardChunk::default() }).unwrap();
    store.finish_board(id, &about, &[]).unwrap();
    id
}

/// Lets a recogniser feel a stored grasp as if it were live.
pub(crate) fn feel(identification: &mut Identification, store: &Store, id: TrialId, view: &SensorView) {
    let read = trial_signals(store, id, TrialSource::Recorded, view).unwrap();
    identification.begin_grasp(read.signals.channels.iter().cloned().enumerate()).unwrap();
    for (k, t_s) in read.signals.t_s.iter().enumerate() {
        let values = read.signals.row(k).into();
        identification.push(*t_s, &Row { t_s: *t_s, line_bar: f64::NAN, phase: Some(Phase::Close), values });
    }
    identification.end_grasp();
}

fn parts() -> HiddenParts {
    HiddenParts::drawn(7)
}

/// One close of the empty hand, by which all sensors are calibrated.
fn adapted(store: &mut Store) {
    store.calibrations().set_sensors(sensors()).unwrap();
    let empty = recorded(store, &parts(), EMPTY, 1, Vec::new());
    let adaptation = Adaptation::from_trial(store, empty, &Scene::default(), &[], false).unwrap();
    assert!(adaptation.is_complete() && adaptation.sensors.len() == 6, "{adaptation:?}");
    adaptation.keep(store).unwrap();
}

/// Grasps of three objects, and what was grasped.
fn grasped(store: &mut Store) -> (Vec<(TrialId, &'static str)>, Dataset) {
    let trials = ["ball", "box", "syringe"]
        .into_iter()
        .flat_map(|object| (0..6).map(move |k| (object, k)))
        .map(|(object, k)| (recorded(store, &parts(), object, 20 + k, Vec::new()), object))
        .collect();
    let view = SensorView::default().of_store(store).unwrap();
    let query = DatasetQuery { source: Some(TrialSource::Recorded), without_empty: true, ..DatasetQuery::default() };
    (trials, query.read(store, &view, &mut |_, _| ()).unwrap())
}

/// Learned from some of the grasps.
fn learned(data: &Dataset) -> Arc<Model> {
    let stop = AtomicBool::new(false);
    Arc::new(palpate_learn::method("extra-trees").unwrap().train(data, &Fitting::new(1, true, &stop)).unwrap())
}

#[test]
fn in_the_window_a_grasp_of_it_is_recorded_recognised_and_explained() {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Store::open(&folder.path().join("trials.sqlite")).unwrap();
    adapted(&mut store);
    let model = learned(&grasped(&mut store).1);
    let listen: Listen =
        Arc::new(|_, _| Ok(Box::new(streams::emulated(emulated(&parts(), "box", 40, Vec::new()), FAST))));
    let models = Ok(Models::all(&scripted::model()).with_real(Some(model)));
    let setup = BenchSetup { models, listen, fill: adapted, size: [1400.0, 1000.0], ..BenchSetup::default() };
    let mut desk = Bench::new(setup, CpuRenderer::default());
    desk.tell(|app| app.set_mode(Mode::Label));
    desk.press_with(Modifiers::COMMAND, Key::G);
    desk.until_shown(true, "Stop and vent");
    desk.press(Key::A);
    desk.record();
    desk.press(Key::Enter);
    desk.until_shown(true, "The model predicts Cardboard box");
    // The added sensors are shown by their names, and count.
    desk.tell(|app| app.show_panel("other"));
    desk.until_shown(true, "chamber");
    desk.tell(|app| app.show_panel("why"));
    desk.until_shown(true, "chamber: ");
    assert!(desk.harness.query_all_by_label_contains("left distal").next().is_some());
}

#[test]
fn a_gripper_of_another_file_is_calibrated_recorded_learned_and_recognised() {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Store::open(&folder.path().join("trials.sqlite")).unwrap();
    adapted(&mut store);
    let (trials, data) = grasped(&mut store);
    let wanted = [
        "curvature_left",
        "curvature_right",
        "pressure_left_proximal",
        "pressure_left_distal",
        "pressure_right_proximal",
        "pressure_right_distal",
        "chamber [Pa]",
    ];
    assert_eq!(data.channels, wanted);

    // Learned from five of each, it knows the sixth.
    let part: Vec<usize> = (0..data.examples.len()).filter(|k| k % 6 != 5).collect();
    let model = learned(&data.part(&part));
    assert_eq!(SensorView::of_model(&model.card).gripper, Some(sensors()));
    for (id, object) in trials.iter().skip(5).step_by(6) {
        let mut identification = Identification::new(Arc::clone(&model), StopRule::default());
        feel(&mut identification, &store, *id, &SensorView::of_model(&model.card));
        let belief = identification.view().beliefs.last().cloned().unwrap();
        assert_eq!(model.card.labels.classes[belief.top().0].name, *object);
    }

    // A gripper without the added channels is told which it lacks.
    let mut identification = Identification::new(model, StopRule::default());
    let paper = SensorList::default().channels();
    let cause = identification.begin_grasp(paper.iter().map(|own| own.name()).enumerate()).unwrap_err().to_string();
    assert!(cause.contains("pressure_left_proximal") && cause.contains("chamber"), "{cause}");
    assert!(cause.contains("models/any-gripper.safetensors would fit"), "{cause}");
}
