//! A labelling afternoon at the desk, by keys alone: record, label, record again, discard, take back, find, export. The
//! gripper is the emulated one, on a clock that runs as fast as it can.

use crate::bench::{Bench, BenchSetup};
use crate::calibration::{calibrated, parts};
use crate::cpu_renderer::CpuRenderer;
use crate::gripper::{TRUE_TO_TIME, board, emulated};
use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use palpate::app::{Mode, ViewSource};
use palpate_lab::gripper::Listen;
use palpate_lab::workers::{GripperCommand, LabellingAction, Snapshot};
use palpate_sim::objects::{EMPTY, object_title};
use palpate_store::{Store, TrialPlace};
use palpate_tactile::trial::Control;

fn desk() -> Bench {
    desk_at(board(&parts(1, false)))
}

fn desk_at(listen: Listen) -> Bench {
    desk_of([1400.0, 1000.0], listen)
}

fn desk_of(size: [f32; 2], listen: Listen) -> Bench {
    let fill = |store: &mut Store| {
        for (sensor, calibration) in calibrated(&parts(1, false), 1).1 {
            store.calibrations().add(&calibration.record).unwrap();
            store.calibrations().mount(sensor, &calibration.record.part).unwrap();
        }
    };
    let setup = BenchSetup { fill, listen, size, ..BenchSetup::default() };
    let mut bench = Bench::new(setup, CpuRenderer::default());
    bench.tell(|app| app.set_mode(Mode::Label));
    bench.until_shown(true, "0 of 800 trials");
    bench
}

impl Bench {
    pub(crate) fn press(&mut self, key: Key) {
        self.press_with(Modifiers::NONE, key);
    }

    pub(crate) fn press_with(&mut self, modifiers: Modifiers, key: Key) {
        self.harness.key_press_modifiers(modifiers, key);
        // Once for the key, once for what it has changed.
        self.harness.step();
        self.harness.step();
    }

    fn type_text(&mut self, text: &str) {
        self.harness.event(egui::Event::Text(text.to_owned()));
        self.harness.step();
        self.harness.step();
    }

    pub(crate) fn record(&mut self) {
        // A grasp of a fast board may begin and end between two frames.
        let recorded = self.labels().len();
        self.press(Key::R);
        for _ in 0..MOST_LOOKS {
            if self.labels().len() > recorded {
                break;
            }
            self.wait();
        }
        self.until_shown(false, "Time in the trial");
        self.until_shown(true, "which object?");
    }

    fn labels(&self) -> Vec<(i64, Option<String>, bool)> {
        let trials = self.store().labels().trials().unwrap();
        trials.into_iter().map(|trial| (trial.id, trial.object, trial.discarded)).collect()
    }

    /// Waits until this stored trial is shown, or the live stream.
    fn until_inspected(&mut self, id: Option<i64>) {
        for _ in 0..MOST_LOOKS {
            let source = self.workbench().view().source;
            let shown = self.workbench().inspected().filter(|_| source == ViewSource::Trial).map(|open| open.trial.id);
            if shown == id {
                return;
            }
            self.wait();
        }
        panic!("trial {id:?} is not shown");
    }

    /// Waits until the labels in the store are these.
    fn until_labelled(&mut self, wanted: &[(i64, Option<&str>, bool)]) {
        let wanted: Vec<(i64, Option<String>, bool)> =
            wanted.iter().map(|(id, label, gone)| (*id, label.map(str::to_owned), *gone)).collect();
        for _ in 0..MOST_LOOKS {
            if self.labels() == wanted {
                return;
            }
            self.wait();
        }
        panic!("{:?} instead of {wanted:?}; {:?}", self.labels(), self.workbench().messages());
    }
}

/// Looks after which something that was waited for will not come any more.
const MOST_LOOKS: u32 = 3000;

#[test]
fn all_that_is_asked_of_a_trial_is_in_sight_in_a_window_of_usual_size() {
    let mut desk = desk_of([1280.0, 800.0], board(&parts(1, false)));
    desk.press_with(Modifiers::COMMAND, Key::G);
    desk.until_shown(true, "Stop and vent");
    desk.press(Key::A);
    desk.record();
    let below = desk.harness.get_by_label("Calibration").rect().top();
    for name in ["Note", "Tags"] {
        let field = desk.harness.query_all_by_label(name).map(|node| node.rect().bottom()).fold(0.0, f32::max);
        assert!(field > 0.0 && field < below, "{name} ends at {field}, the panel at {below}");
    }
}

#[test]
fn an_afternoon_by_keys_alone() {
    let mut desk = desk();
    desk.press_with(Modifiers::COMMAND, Key::G);
    desk.until_shown(true, "Stop and vent");
    desk.press(Key::A);
    assert_eq!(desk.workbench().view().control, Control::Driven);
    // What the plan has next is proposed: Enter takes it.
    let next = desk.next_object();
    desk.record();
    // What the model says stays hidden until then.
    assert!(desk.harness.query_by_label_contains("The model").is_none());
    desk.press(Key::Enter);
    desk.until_labelled(&[(1, Some(&next), false)]);
    desk.until_shown(true, "1 of 800 trials");
    desk.until_shown(true, "The model predicts Lemon");
    // The next one is not the same again; it is recorded twice, and the first stays without a label.
    assert_ne!(desk.next_object(), next);
    desk.record();
    desk.record();
    desk.until_told("Trial 2 is kept without a label.");
    desk.until_labelled(&[(1, Some(&next), false), (2, None, false), (3, None, false)]);
    // Typing finds an object; Enter gives the label.
    desk.press(Key::Slash);
    desk.type_text("stop");
    desk.press(Key::Enter);
    desk.until_labelled(&[(1, Some(&next), false), (2, None, false), (3, Some("button"), false)]);
    desk.until_shown(true, "2 of 800 trials");
    desk.until_shown(true, "Trial 2: which object?");
    desk.press(Key::D);
    desk.until_labelled(&[(1, Some(&next), false), (2, None, true), (3, Some("button"), false)]);
    desk.record();
    desk.press(Key::Escape);
    desk.tell(|app| app.label(LabellingAction::Search(String::new())));
    desk.tell(|app| app.label(LabellingAction::Discard));
    desk.until_labelled(&[(1, Some(&next), false), (2, None, true), (3, Some("button"), false), (4, None, true)]);
    // The first is called something new after all: the arrows pick it.
    desk.press(Key::ArrowDown);
    desk.press(Key::ArrowDown);
    desk.until_shown(true, "Trial 1: labelled");
    // What is shown is that trial, not the live stream.
    desk.until_inspected(Some(1));
    desk.tell(|app| app.set_mode(Mode::Label));
    desk.wait();
    desk.until_inspected(Some(1));
    desk.press(Key::Slash);
    desk.type_text("garlic");
    desk.press(Key::Enter);
    desk.until_labelled(&[(1, Some("garlic"), false), (2, None, true), (3, Some("button"), false), (4, None, true)]);
    // The strip tells the label given last, of whichever trial.
    desk.until_shown(true, "trial 1: Garlic. The model predicts Lemon");
    // Taken back, and made again.
    desk.press_with(Modifiers::COMMAND, Key::Z);
    desk.until_labelled(&[(1, Some(&next), false), (2, None, true), (3, Some("button"), false), (4, None, true)]);
    desk.press_with(Modifiers { shift: true, ..Modifiers::COMMAND }, Key::Z);
    desk.until_labelled(&[(1, Some("garlic"), false), (2, None, true), (3, Some("button"), false), (4, None, true)]);
    // Thrown away while it goes on, and out of the list.
    desk.press(Key::R);
    desk.until_shown(true, "Time in the trial");
    desk.until_inspected(None);
    desk.press(Key::D);
    desk.until_shown(false, "Time in the trial");
    desk.press(Key::ArrowDown);
    desk.until_shown(true, "Trial 3: labelled");
    desk.press(Key::D);
    let with_third_gone = |gone: bool| {
        [(1, Some("garlic"), false), (2, None, true), (3, Some("button"), gone), (4, None, true), (5, None, true)]
    };
    desk.until_labelled(&with_third_gone(true));
    desk.press_with(Modifiers::COMMAND, Key::Z);
    desk.until_labelled(&with_third_gone(false));
    desk.press_with(Modifiers::COMMAND, Key::E);
    desk.until_told("2 labelled trials exported");
    assert!(desk.store_folder().join("export").join("trials.csv").is_file());
    desk.press_with(Modifiers::COMMAND, Key::E);
    desk.until_told("export-2");
    // Too few to learn from: that is said, and what is missing.
    desk.press_with(Modifiers::COMMAND, Key::T);
    desk.until_told("Training failed: training needs two objects");
    // A click on the plan decides what is proposed next.
    desk.harness.get_by_role_and_label(Role::Button, "Syringe: 0 of 50").click_accesskit();
    desk.harness.run_steps(3);
    desk.record();
    desk.press(Key::Enter);
    desk.until_shown(true, "trial 6: Syringe");
}

#[test]
fn an_answer_typed_fast_or_before_the_question_is_an_answer() {
    let mut desk = desk();
    desk.press_with(Modifiers::COMMAND, Key::G);
    desk.until_shown(true, "Stop and vent");
    desk.press(Key::A);
    let blind = desk.workbench().view().blind;
    // In the frame of the key that goes to the field, or in the frames after it: letters are no keys, which would throw
    // away, tare, or show the model's guess.
    let pressed = |at: Key| egui::Event::Key {
        key: at,
        physical_key: None,
        pressed: true,
        repeat: false,
        modifiers: Modifiers::NONE,
    };
    for letters_per_frame in [5, 1] {
        desk.record();
        desk.harness.event(pressed(Key::Slash));
        for (i, (key, letter)) in
            [(Key::Slash, "/"), (Key::D, "d"), (Key::U, "u"), (Key::B, "b"), (Key::T, "t")].into_iter().enumerate()
        {
            if i > 0 {
                desk.harness.event(pressed(key));
            }
            desk.harness.event(egui::Event::Text(letter.to_owned()));
            if (i + 1) % letters_per_frame == 0 {
                desk.harness.step();
            }
        }
        desk.harness.step();
        desk.harness.step();
        let field = desk.harness.get_by_role_and_label(Role::SearchInput, "Find an object");
        assert_eq!(field.value().as_deref(), Some("dubt"), "{letters_per_frame} letters in a frame");
        desk.press(Key::Enter);
    }
    desk.until_labelled(&[(1, Some("dubt"), false), (2, Some("dubt"), false)]);
    assert_eq!(desk.workbench().view().blind, blind);
    // More letters at once than the last answer had, whose end the cursor stood at.
    desk.record();
    desk.harness.event(pressed(Key::Slash));
    desk.harness.event(egui::Event::Text("syrin".to_owned()));
    desk.harness.step();
    for letter in ["g", "e"] {
        desk.harness.step();
        desk.harness.event(egui::Event::Text(letter.to_owned()));
    }
    desk.harness.step();
    let field = desk.harness.get_by_role_and_label(Role::SearchInput, "Find an object");
    assert_eq!(field.value().as_deref(), Some("syringe"));
    desk.press(Key::Enter);
    let typed = [(1, Some("dubt"), false), (2, Some("dubt"), false), (3, Some("syringe"), false)];
    desk.until_labelled(&typed);
    // While the grasp goes on, too: the field is there as soon as it is wanted, and keeps the cursor up to the question.
    desk.press(Key::R);
    desk.until_shown(true, "Time in the trial");
    desk.press(Key::Slash);
    desk.type_text("cu");
    desk.until_shown(true, "which object?");
    // The last letters and Enter in one frame.
    desk.harness.event(egui::Event::Text("be".to_owned()));
    desk.press(Key::Enter);
    desk.until_labelled(&[&typed[..], &[(4, Some("cube"), false)]].concat());
    // Where no question is asked or coming, there is nothing to type into.
    desk.press(Key::Slash);
    assert!(desk.harness.query_by_role_and_label(Role::SearchInput, "Find an object").is_none());
    // Elsewhere a further grasp gives up nothing.
    desk.tell(|app| app.set_mode(Mode::Demo));
    for _ in 0..2 {
        desk.press(Key::R);
        desk.until_shown(true, "Time in the trial");
        desk.until_shown(false, "Time in the trial");
    }
    let grasps = [(4, Some("cube"), false), (5, None, false), (6, None, false)];
    desk.until_labelled(&[&typed[..], &grasps[..]].concat());
}

#[test]
fn stop_works_while_something_is_typed() {
    let mut desk = desk();
    desk.tell(|app| app.connect(None));
    desk.until_shown(true, "Stop and vent");
    desk.press(Key::A);
    desk.record();
    desk.press(Key::Slash);
    desk.type_text("r");
    // A letter in the field begins no trial.
    assert!(desk.harness.query_by_label_contains("Time in the trial").is_none());
    desk.press(Key::Escape);
    desk.until_told("Vent sent");
    let field = desk.harness.get_by_role_and_label(Role::SearchInput, "Find an object");
    assert_eq!(field.value().as_deref(), Some("r"));
}

#[test]
fn blind_hides_the_models_guess_until_the_label_is_given() {
    let mut desk = desk();
    desk.tell(|app| app.connect(None));
    desk.until_shown(true, "Stop and vent");
    desk.press(Key::A);
    desk.record();
    desk.harness.get_by_label("Recognition").click();
    desk.harness.step();
    desk.until_shown(true, "is hidden until you label the trial");
    desk.press(Key::B);
    desk.until_shown(false, "is hidden until you label the trial");
    desk.press(Key::B);
    desk.until_shown(true, "is hidden until you label the trial");
    desk.press(Key::N);
    desk.until_shown(false, "is hidden until you label the trial");
}

#[test]
fn a_board_that_leaves_gives_back_where_grasps_are_recorded() {
    let mut desk = desk();
    let grasps = |snapshot: &Snapshot| (snapshot.status.recording, snapshot.status.grasps);
    desk.tell(|app| app.connect(None));
    desk.until(|snapshot| grasps(snapshot) == (None, 1));
    // While the simulation is looked at, it grasps and stores as without a gripper.
    desk.tell(|app| app.view.source = ViewSource::Simulation);
    desk.until(|snapshot| grasps(snapshot) == (Some(TrialPlace::DemoLog), 4));
    desk.tell(|app| app.view.source = ViewSource::Gripper);
    desk.until(|snapshot| grasps(snapshot) == (None, 1));
    for _ in 0..2 {
        desk.tell(|app| _ = app.gripper.send(GripperCommand::Disconnect));
        desk.until(|snapshot| grasps(snapshot) == (Some(TrialPlace::DemoLog), 4));
        desk.tell(|app| app.connect(None));
        desk.until(|snapshot| grasps(snapshot) == (None, 1));
    }
}

#[test]
fn before_it_is_calibrated_an_emulated_gripper_shows_its_counts_and_says_how_it_moves() {
    let listen = emulated(&parts(1, false), None, TRUE_TO_TIME, 30);
    let setup = BenchSetup { listen, size: [1400.0, 1000.0], ..BenchSetup::default() };
    let mut desk = Bench::new(setup, CpuRenderer::default());
    desk.tell(|app| app.set_mode(Mode::Label));
    desk.press_with(Modifiers::COMMAND, Key::G);
    for text in ["EMULATED GRIPPER 50 Hz", "not calibrated: raw counts"] {
        desk.until_shown(true, text);
    }
    desk.press(Key::R);
    desk.until_shown(true, "Recording: the emulated hand moves by itself");
    desk.press(Key::Escape);
    desk.until_told("The emulated hand stays open until a trial with actuation \"board\" drives it");
    desk.press(Key::R);
    desk.until_shown(true, "Closing");
    // Its trials have no answer, and say so.
    desk.tell(|app| app.open_trial(1));
    desk.until_shown(true, "No answer");
}

#[test]
fn a_hand_that_did_not_close_has_no_phases_and_no_answer() {
    let mut desk = desk();
    desk.tell(|app| app.connect(None));
    desk.until_shown(true, "Stop and vent");
    desk.record();
    desk.until_told("no close from open fingers was seen, so there is no answer");
    let course = desk.store().board_log(1).unwrap().unwrap().course;
    assert_eq!(course.phases, []);
}

#[test]
fn the_answer_to_a_discarded_trial_goes_with_it() {
    let mut desk = desk();
    desk.tell(|app| app.connect(None));
    desk.until_shown(true, "Stop and vent");
    for key in [Key::A, Key::B] {
        desk.press(key);
    }
    desk.record();
    let answered = "press R to grasp again";
    desk.tell(|app| app.set_mode(Mode::Demo));
    desk.until_shown(true, answered);
    desk.tell(|app| app.set_mode(Mode::Label));
    desk.until_shown(true, "Trial 1: which object?");
    desk.press(Key::D);
    desk.until_labelled(&[(1, None, true)]);
    desk.tell(|app| app.set_mode(Mode::Demo));
    desk.until_shown(true, "Press R to start a grasp");
    assert!(desk.harness.query_all_by_label_contains(answered).next().is_none());
}

#[test]
fn adapting_shows_the_empty_hand_and_asks_for_one() {
    let mut desk = desk_at(emulated(&parts(1, false), None, TRUE_TO_TIME, 30));
    desk.press_with(Modifiers::COMMAND, Key::G);
    desk.until_shown(true, "Stop and vent");
    let object = |desk: &Bench| desk.workbench().snapshot().map(|snapshot| snapshot.scene.object.source.clone());
    assert_ne!(object(&desk).as_deref(), Some(EMPTY));
    let next = desk.next_object();
    // Before the first reading nothing can be recorded.
    desk.until_shown(true, "EMULATED GRIPPER 50 Hz");
    desk.tell(|app| _ = app.gripper.send(GripperCommand::Adapt(Control::Driven)));
    desk.until_shown(true, "Adapting: take everything out of the hand");
    assert!(desk.harness.query_all_by_label(object_title(&next).as_ref()).next().is_none(), "nothing is to be held");
    for _ in 0..MOST_LOOKS {
        if object(&desk).as_deref() == Some(EMPTY) {
            break;
        }
        desk.wait();
    }
    assert_eq!(object(&desk).as_deref(), Some(EMPTY));
    desk.until_shown(false, "Adapting: take everything out of the hand");
    for _ in 0..MOST_LOOKS {
        if object(&desk).as_deref() != Some(EMPTY) {
            return;
        }
        desk.wait();
    }
    panic!("the scene from before does not come back: {:?}", object(&desk));
}
