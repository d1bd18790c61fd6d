//! Two panels that help with the real gripper, doctor and fit: by their labels, with a picture of what they show.

use crate::bench::{Bench, BenchSetup};
use crate::calibration::{capture, parts};
use crate::cpu_renderer::CpuRenderer;
use crate::golden::compare;
use crate::panels::side_by_side;
use crate::program::{refused, run};
use crate::streams::{alike, once_with_a_gap};
use egui::Key;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use image::RgbaImage;
use palpate::app::ALL_PANELS;
use palpate_device::doctor::{ChannelTraces, Observations};
use palpate_device::protocol::{AdcRange, Saturation};
use palpate_device::serial::{BoardKind, LinkState, LinkStatus, PortInfo, UsbIdentity};
use palpate_geometry::palette::Theme;
use palpate_lab::gripper::{Listen, NotOpened};
use palpate_lab::workers::{CalibrationCommand, CalibrationPlan, Examine, GripperCommand};
use palpate_sim::gripper::Side;
use palpate_sim::scene::Scene;
use palpate_store::{BoardInfo, Store};
use palpate_study::jobs::{FitTrials, FittedFinger};
use palpate_study::{Certainty, Estimate, FingerFit, FingerFitError, FingerMotion, Remainder};
use palpate_tactile::board::{Board, Detected, Format, Reading, Sensor, TimeSource};
use palpate_tactile::cadence::Cadence;
use palpate_tactile::trial::{TrialHeader, TrialId};
use serde_json::Value;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// A bench with one panel on it, nothing else.
pub(crate) fn bench(panel: &str, theme: Theme, setup: BenchSetup) -> Bench {
    let panel = ALL_PANELS.iter().find(|own| own.name == panel);
    Bench::new(BenchSetup { panel, theme, ..setup }, CpuRenderer::default())
}

/// The same state in both themes, state by state.
fn pairs<const N: usize>(dark: [RgbaImage; N], light: [RgbaImage; N]) -> impl Iterator<Item = [RgbaImage; 2]> {
    dark.into_iter().zip(light).map(|(dark, light)| [dark, light])
}

/// A sound gripper, its fingers bent and its pads pressed meanwhile.
fn sound() -> Observations {
    let usb = UsbIdentity { vid: 0x2341, pid: 0x003e, serial: None };
    let (title, kind) = ("Arduino Due, native port".to_owned(), BoardKind { rank: 3, native: true });
    let port = PortInfo { path: PathBuf::from("/dev/ttyACM0"), title, usb: Some(usb), kind };
    let (rate_hz, drift_ppm) = (50.0, Some(20.0));
    let board = Board {
        rate_hz: Some(rate_hz),
        divider_ohm: vec![47e3, 47e3, 4.7e3, 4.7e3],
        firmware: Some("1".to_owned()),
        ..Board::default()
    };
    let cadence =
        Cadence { samples: 400, bytes: 40_000, rate_hz, printable_share: 1.0, drift_ppm, ..Cadence::default() };
    let why = "each number follows its name".to_owned();
    let detected = Some(Detected { format: Format::Plotter, why, time: TimeSource::Device });
    let link = LinkStatus {
        state: LinkState::Listening,
        port: port.clone(),
        baud: Some(115_200),
        board,
        detected,
        cadence,
        saturation: vec![None; 4],
        adc_range: AdcRange::Fits,
        reconnects: 0,
        now_s: 8.0,
        dropped: [0; 2],
    };
    let mut traces = ChannelTraces::default();
    for k in 0..400_u16 {
        let bend = 400.0 - (400.0 - 8.0 * f32::from(k % 100)).abs();
        let counts = [1400.0 + bend, 1500.0 + bend, 3.0 * bend, bend].map(Some).to_vec();
        let t_s = 0.02 * f64::from(k);
        traces.add(&Reading { t_s, arrived_s: t_s, seq: None, counts, line_bar: None });
    }
    Observations {
        ports: vec![port],
        refused: None,
        modem_manager: false,
        link: Some(link),
        listened_s: 8.0,
        example: None,
        traces,
    }
}

/// The same with a strip unplugged, ModemManager about and lines damaged.
fn troubled() -> Observations {
    let mut seen = sound();
    seen.modem_manager = true;
    if let Some(link) = &mut seen.link {
        link.saturation[1] = Some(Saturation::High);
        link.cadence.bad_lines = 60;
    }
    seen
}

/// True where the last click has put such a text onto the clipboard.
fn has_copied(bench: &Bench, part: &str) -> bool {
    bench.harness.output().platform_output.commands.iter().any(|command| match command {
        egui::OutputCommand::CopyText(text) => text.contains(part),
        _ => false,
    })
}

#[test]
fn a_port_that_may_not_be_opened_says_so_with_a_command_to_copy() {
    let [dark, light] = Theme::ALL.map(|theme| {
        let listen: Listen = Arc::new(|_, _| {
            Err(NotOpened {
                text: "cannot open port \"/dev/ttyACM0\": only members of the group dialout are allowed to. Run `sudo \
                       usermod -aG dialout $USER`, then log out and in again"
                    .to_owned(),
                command: Some("sudo usermod -aG dialout $USER".to_owned()),
                may_pass: false,
            })
        });
        let setup = BenchSetup { size: [320.0, 420.0], listen, ..BenchSetup::default() };
        let mut bench = bench("gripper", theme, setup);
        bench.harness.get_by_label("Connect").click();
        bench.until_shown(true, "only members of the group dialout");
        // Below stand the ports of whatever computer this is.
        bench.harness.run_steps(3);
        bench.harness.run_steps(3);
        let picture = image::imageops::crop_imm(&bench.picture(), 0, 0, 320, 204).to_image();
        bench.harness.get_by_label("Copy the command for the port").click();
        bench.harness.step();
        assert!(has_copied(&bench, "sudo usermod -aG dialout $USER"));
        picture
    });
    compare("gripper_refused", &side_by_side(&dark, &light), "the CPU renderer of the tests");
}

#[test]
fn crosstalk_is_found_sensor_by_sensor_in_a_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let moves = ["angleL=40", "angleR=40", "loadL=2N", "loadR=2N"];
    let script: String = moves.iter().map(|step| format!("rest=2.2; {step} hold=1; ")).collect();
    for (faults, sound) in [("", true), ("crosstalk=0.05@0", false)] {
        // With hysteresis and drift.
        capture(&parts(3, true), &format!("{script} rest=3"), faults, 16.0, &at.join("hand.bytes"));
        let ran = run(at, &["doctor", "hand.bytes", "--crosstalk", "--json"]);
        let result: Value = serde_json::from_str(&ran.out).unwrap();
        assert_eq!((ran.code, &result["sound"]), (Some(i32::from(!sound)), &Value::Bool(sound)), "{ran:?}");
        assert!(ran.err.contains("1 of 4: bend the left finger") && ran.err.contains("4 of 4: release"), "{ran:?}");
        let found = result["found"].as_array().unwrap();
        assert_eq!(found.len(), 8, "{result}");
        for bleed in found {
            // Each channel takes from the one before it, which for the first is the last.
            let [from, into] = ["from", "into"].map(|key| bleed[key].as_str().unwrap());
            let next = [("flexL", "flexR"), ("flexR", "fsrL"), ("fsrL", "fsrR")];
            let follows = next.contains(&(from, into)) || (from, into) == ("fsrR", "flexL");
            assert_eq!(bleed["bleeds"], !sound && follows, "{bleed}");
            let share = bleed["share"].as_f64().unwrap();
            assert!(!bleed["bleeds"].as_bool().unwrap() || (share - 0.05).abs() < 0.02, "{bleed}");
        }
    }
    // What was never moved is not called sound.
    capture(&parts(3, false), "rest=9", "", 4.0, &at.join("idle.bytes"));
    let idle = run(at, &["doctor", "idle.bytes", "--crosstalk"]);
    assert!(idle.code == Some(1) && idle.out.contains("Skipped: left flex strip"), "{idle:?}");
    let text = run(at, &["doctor", "hand.bytes", "--crosstalk"]);
    assert!(text.out.contains("100 nF from each pin") && text.out.contains("FAILED"), "{text:?}");
    refused(at, &["doctor", "nowhere", "--crosstalk"], &["nowhere"]);
}

#[test]
fn crosstalk_is_found_sensor_by_sensor_in_the_window() {
    const REST: [f64; 4] = [1420.0, 1400.0, 0.0, 0.0];
    let [dark, light] = Theme::ALL.map(|theme| {
        let hand = Arc::new(Mutex::new(REST));
        let read = Arc::clone(&hand);
        let listen: Listen = Arc::new(move |_, _| {
            let read = Arc::clone(&read);
            let counts = move || read.lock().unwrap().map(|counts| Some(counts as f32)).to_vec();
            Ok(Box::new(alike(counts)))
        });
        let setup = BenchSetup { size: [320.0, 420.0], listen, ..BenchSetup::default() };
        let mut bench = bench("doctor", theme, setup);
        bench.harness.get_by_label("Test for crosstalk").click();
        bench.harness.step();
        let mut pictures = Vec::new();
        for (asked, moved, bleeds) in [("Bend the left finger", 0, 1), ("Bend the right finger", 1, 1)] {
            bench.until_shown(true, asked);
            let mut counts = REST;
            counts[moved] += 600.0;
            // The right strip takes a tenth of the left one; the left pad takes nothing.
            counts[bleeds] += if moved == 0 { 60.0 } else { 0.0 };
            *hand.lock().unwrap() = counts;
            bench.until_shown(true, "Release the");
            *hand.lock().unwrap() = REST;
            bench.until_shown(false, "Release the");
        }
        bench.until_shown(true, "Press the left pad firmly");
        // The buttons move with the texts above them.
        bench.harness.hover_at(egui::Pos2::ZERO);
        bench.harness.run_steps(3);
        pictures.push(bench.picture());
        bench.harness.get_by_label("Skip").click();
        bench.harness.step();
        // What it says above the button changes once the fingers have rested.
        bench.until_shown(true, "Press the right pad firmly");
        bench.harness.get_by_label("Stop").click();
        bench.until_shown(true, "The right flex strip follows the left flex strip by 10.0 %: +60 counts");
        bench.until_shown(true, "Skipped: left pad, right pad");
        assert!(bench.harness.query_by_label_contains("STOP").is_none());
        bench.harness.hover_at(egui::Pos2::ZERO);
        bench.harness.run_steps(3);
        pictures.push(bench.picture());
        pictures
    });
    for (k, name) in ["doctor_crosstalk", "doctor_crosstalk_found"].into_iter().enumerate() {
        compare(name, &side_by_side(&dark[k], &light[k]), "the CPU renderer of the tests");
    }
}

#[test]
fn what_is_missing_is_hatched_and_no_line_goes_through_it() {
    let [dark, light] = Theme::ALL.map(|theme| {
        let listen: Listen = Arc::new(|_, _| Ok(Box::new(once_with_a_gap())));
        let setup = BenchSetup { size: [480.0, 220.0], listen, ..BenchSetup::default() };
        let mut bench = bench("counts", theme, setup);
        bench.tell(|app| app.connect(None));
        // It is silent then, and wakes the window now and then.
        for _ in 0..20 {
            bench.wait();
        }
        bench.picture()
    });
    compare("gap", &side_by_side(&dark, &light), "the CPU renderer of the tests");
}

#[test]
fn a_crosstalk_test_ends_by_itself_and_gives_the_port_back() {
    const REST: [f64; 4] = [1420.0, 1400.0, 0.0, 0.0];
    let hand = Arc::new(Mutex::new(REST));
    let read = Arc::clone(&hand);
    let open = Arc::new(AtomicU32::new(0));
    let opened = Arc::clone(&open);
    let listen: Listen = Arc::new(move |_, _| {
        let (read, _) = (Arc::clone(&read), opened.fetch_add(1, Ordering::Relaxed));
        let counts = move || read.lock().unwrap().map(|counts| Some(counts as f32)).to_vec();
        Ok(Box::new(alike(counts)))
    });
    let mut bench = bench("doctor", Theme::Dark, BenchSetup { size: [320.0, 420.0], listen, ..BenchSetup::default() });
    let calibrate = || {
        let plan = CalibrationPlan { sensor: Sensor::FLEX_LEFT, part: "A".to_owned(), port: None };
        GripperCommand::Calibrate(CalibrationCommand::Begin(plan))
    };
    // What has the fingers is not disturbed.
    bench.tell(|app| _ = app.gripper.send(calibrate()));
    bench.wait();
    bench.harness.get_by_label("Test for crosstalk").click();
    bench.until_shown(true, "calibration is running: end it first");
    bench.tell(|app| _ = app.gripper.send(GripperCommand::Calibrate(CalibrationCommand::Stop)));
    bench.harness.get_by_label("Test for crosstalk").click();
    bench.harness.step();
    for (asked, moved) in [("Bend the left", 0), ("Bend the right", 1), ("Press the left", 2), ("Press the right", 3)] {
        bench.until_shown(true, asked);
        let mut counts = REST;
        counts[moved] += 600.0;
        *hand.lock().unwrap() = counts;
        bench.until_shown(true, "Release the");
        *hand.lock().unwrap() = REST;
        bench.until_shown(false, "Release the");
    }
    bench.until_shown(true, "No crosstalk of 1 % or more");
    // Each opened the port anew, for the one before had given it back.
    assert_eq!(open.load(Ordering::Relaxed), 2);
    bench.tell(|app| _ = app.gripper.send(calibrate()));
    while open.load(Ordering::Relaxed) < 3 {
        bench.wait();
    }
}

#[test]
fn wiring_and_sketch_come_with_the_program() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let page = run(at, &["doctor", "--wiring"]);
    assert!(page.code == Some(0) && page.out.contains("47 k to 3.3 V") && page.out.contains("2341:003e"), "{page:?}");
    for _ in 0..2 {
        let result = run(at, &["doctor", "--sketch", "due_gripper"]);
        assert!(result.code == Some(0) && result.out.contains("gripper_logic.h"), "{result:?}");
    }
    std::fs::write(at.join("due_gripper/due_gripper.ino"), "mine").unwrap();
    crate::program::misused(at, &["doctor", "--sketch", "foo"], &["a folder named due_gripper"]);
    refused(at, &["doctor", "--sketch", "due_gripper"], &["due_gripper.ino", "nothing was written", "another folder"]);
    let [dark, light] = Theme::ALL.map(|theme| {
        let setup = BenchSetup { size: [320.0, 720.0], ..BenchSetup::default() };
        let mut bench = bench("doctor", theme, setup);
        bench.harness.get_by_label("Wiring and firmware").click();
        bench.harness.run_steps(30);
        assert_eq!(bench.harness.query_all_by_label("4.7 kΩ").count(), 2);
        bench.harness.get_by_label("Copy the command for the sketch").click();
        bench.harness.step();
        assert!(has_copied(&bench, "palpate doctor --sketch due_gripper"));
        bench.harness.run_steps(4);
        bench.picture()
    });
    compare("doctor_wiring", &side_by_side(&dark, &light), "the CPU renderer of the tests");
}

#[test]
fn the_doctor_looks_tells_and_can_be_stopped() {
    let [dark, light] = Theme::ALL.map(|theme| {
        let seen = Arc::new(Mutex::new(sound()));
        let look = Arc::clone(&seen);
        // Listens for two seconds and a half, which take no time, and on if it is to go on.
        let examine: Examine = Arc::new(move |request, goes_on| {
            let patient = request.port.is_some();
            goes_on(2.5);
            while patient && goes_on(2.5) {
                std::thread::sleep(Duration::from_millis(2));
            }
            look.lock().unwrap().clone()
        });
        let setup = BenchSetup { size: [320.0, 820.0], examine, ..BenchSetup::default() };
        let mut bench = bench("doctor", theme, setup);
        assert!(bench.harness.query_by_label("What is checked").is_some());
        bench.harness.get_by_label("Examine").click();
        bench.until_shown(true, "No faults found");
        assert!(bench.harness.query_by_label("crosstalk: ok").is_some());
        // Which button the pointer is on is known a frame later.
        bench.harness.run_steps(3);
        let good = bench.picture();
        *seen.lock().unwrap() = troubled();
        bench.harness.get_by_label("Port").focus();
        bench.harness.step();
        bench.harness.get_by_label("Port").type_text("/dev/ttyACM0");
        bench.harness.step();
        bench.harness.get_by_label("Examine").click();
        bench.harness.step();
        // What was found before stays in view.
        bench.until_shown(true, "listening, 2 of 8 s");
        assert!(bench.harness.query_by_label("crosstalk: ok").is_some());
        bench.harness.get_by_label("Stop").click();
        bench.until_shown(true, "faults found");
        bench.until_shown(true, "then stopped");
        assert!(bench.harness.query_by_label("lines: FAILED").is_some());
        bench.harness.run_steps(3);
        let wrong = bench.picture();
        bench.harness.get_by_label("Copy the command for modem-manager").click();
        bench.harness.step();
        assert!(has_copied(&bench, "77-palpate.rules"));
        [good, wrong]
    });
    for (name, [dark, light]) in ["doctor_good", "doctor_wrong"].into_iter().zip(pairs(dark, light)) {
        compare(name, &side_by_side(&dark, &light), "the CPU renderer of the tests");
    }
}

/// Two empty closes and two grasps of the real gripper, without a reading.
fn recorded(store: &mut Store) {
    for object in ["empty", "bigball", "bigball", "empty"] {
        let header = TrialHeader::new(object, Scene::default());
        let id = store.begin_board(&header, &BoardInfo::default()).unwrap();
        store.finish_board(id, &BoardInfo::default(), &[]).unwrap();
    }
}

/// Goes to something by the tabulator key and presses it by Enter.
pub(crate) fn press(bench: &mut Bench, label: &str) {
    for _ in 0..30 {
        let harness = &bench.harness;
        let node = harness.query_by_label(label).unwrap_or_else(|| harness.get_by_label_contains(label));
        if node.accesskit_node().is_focused() {
            bench.harness.key_press(Key::Enter);
            bench.harness.step();
            return;
        }
        bench.harness.key_press(Key::Tab);
        bench.harness.step();
    }
    panic!("the keyboard does not reach {label}");
}

/// A fit of made-up numbers: what the panel shows does not depend on what the solver happens to find.
fn made_up_fit(trials: &[TrialId]) -> FittedFinger {
    let estimate = |name: &str, unit, value: f64, share: f64, known| {
        let (low, high) = (value * (1.0 - share), value * (1.0 + share));
        Estimate { name: name.to_owned(), unit, value, low, high, known }
    };
    let estimates = vec![
        estimate("gripper.finger.bending_stiffness", "N m²", 3.36e-3, 0.021, Certainty::Well),
        estimate("gripper.finger.damping_time", "s", 0.03, 0.18, Certainty::Roughly),
        estimate("gripper.actuation.filling_time", "s", 0.06, 0.7, Certainty::Hardly),
        estimate("torque at 0.40 bar", "N m", 0.018, 0.03, Certainty::Well),
        estimate("torque at 0.80 bar / bending stiffness", "1/m", 12.5, 0.004, Certainty::Well),
    ];
    let remainders = trials.iter().map(|id| Remainder {
        name: format!("trial {id}"),
        curvature_per_m: 0.21,
        force_share: (id % 2 == 0).then_some(0.031),
        shift_s: 0.01,
    });
    let course = |id: &TrialId, side: Side| {
        let t_s: Vec<f64> = (0..200).map(|k| 0.02 * f64::from(k)).collect();
        let fitted =
            t_s.iter().map(|t| (8.0 + side.index() as f64) * (1.0 - (1.2 * t).cos()) / 2.0).collect::<Vec<_>>();
        let recorded = t_s.iter().zip(&fitted).map(|(t, own)| own + 0.3 * (9.0 * t).sin()).collect();
        FingerMotion { name: format!("trial {id}"), side, t_s, recorded, fitted }
    };
    let mut scene = Scene::default();
    scene.gripper.finger.bending_stiffness = 3.36e-3;
    let fit = FingerFit {
        gripper: scene.gripper.clone(),
        estimates,
        remainders: remainders.collect(),
        widened: 1.4,
        steps: 7,
        remarks: vec![
            "gripper.actuation.filling_time cannot be identified from the recordings: any value from 0.018 to 0.102 s fits".to_owned(),
        ],
        courses: trials.iter().flat_map(|id| Side::BOTH.map(|side| course(id, side))).collect(),
    };
    FittedFinger { trials: trials.to_vec(), fit, scene, warnings: Vec::new() }
}

#[test]
fn a_finger_is_fitted_and_used_without_the_mouse() {
    let [dark, light] = Theme::ALL.map(|theme| {
        let fit: FitTrials = Arc::new(|_, trials, watch| {
            (watch.progress)(3.4);
            // A single trial is never enough for this one. It reports again and again, as a fit does: of reports that
            // follow each other closely only the first wakes the window.
            while trials.len() < 2 {
                (watch.progress)(3.4);
                if watch.stop.load(Ordering::Relaxed) {
                    return Err(FingerFitError::Stopped.into());
                }
                std::thread::sleep(Duration::from_millis(2));
            }
            // Not within the frames of the key, so that the picture is always that of the first frame with the outcome.
            std::thread::sleep(Duration::from_millis(300));
            Ok(made_up_fit(trials))
        });
        let setup = BenchSetup { size: [320.0, 860.0], fit, fill: recorded, ..BenchSetup::default() };
        let mut bench = bench("fit", theme, setup);
        bench.until_shown(true, "4  empty close");
        assert!(bench.harness.get_by_label("Fit").accesskit_node().is_disabled(), "nothing is chosen");
        press(&mut bench, "4  empty close");
        press(&mut bench, "Fit");
        bench.until_shown(true, "step 4 of at most 25");
        press(&mut bench, "Stop");
        bench.until_shown(true, "Refresh");
        press(&mut bench, "3  bigball");
        press(&mut bench, "Fit");
        bench.until_shown(true, "Fitted to trials 3, 4");
        assert!(bench.harness.query_by_label("filling time: 0.0180 to 0.102").is_some());
        // Without the list, in which the time stands.
        let top = bench.harness.get_by_label("Fitted to trials 3, 4").rect().top() as u32;
        let picture = bench.picture();
        let picture = image::imageops::crop_imm(&picture, 0, top, picture.width(), picture.height() - top).to_image();
        press(&mut bench, "Use this finger");
        let scene = bench.until(|s| s.scene.gripper.finger.bending_stiffness == 3.36e-3).scene.clone();
        assert_eq!(scene.object.source, "lemon", "what is grasped stays");
        bench.until_shown(true, "Finger in use");
        picture
    });
    compare("fit_done", &side_by_side(&dark, &light), "the CPU renderer of the tests");
}

#[test]
fn trials_that_cannot_be_fitted_say_why() {
    let setup = BenchSetup { size: [320.0, 500.0], fill: recorded, ..BenchSetup::default() };
    let mut bench = bench("fit", Theme::Dark, setup);
    bench.until_shown(true, "1  empty close");
    bench.harness.get_by_label_contains("1  empty close").click();
    bench.harness.step();
    bench.harness.get_by_label("Fit").click();
    bench.until_shown(true, "rial 1 has no curvature of either finger");
}

/// A captured file of 50 readings a second, in lines made of time, strips and pads: each finger is bent and pressed in turn.
fn captured(line: impl Fn(u32, [u32; 4]) -> String) -> Vec<u8> {
    let wave = |k: u32, from: u32| k.checked_sub(from).filter(|k| *k < 60).map_or(0, |k| 30 - k.abs_diff(30));
    let counts = |k: u32| {
        let [left, right] = [wave(k, 20), wave(k, 100)];
        // Strips are never quite still.
        [1300 + 20 * left + k % 3, 1150 + 18 * right + k % 3, 25 * wave(k, 200), 30 * wave(k, 270)]
    };
    (0..400).map(|k| line(k, counts(k)) + "\n").collect::<String>().into_bytes()
}

#[test]
fn the_doctor_calls_sound_only_what_it_has_seen() {
    let named = |[a, b, c, d]: [u32; 4]| format!("flexL:{a},flexR:{b},fsrL:{c},fsrR:{d}");
    let timed = |k: u32, counts: [u32; 4]| format!("t_us:{},seq:{k},{}", k * 20_000, named(counts));
    let mut seed = 1_u32;
    let noise = (0..20_000).map(|_| {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        seed.to_be_bytes()[0]
    });
    let cases = [
        (captured(timed), None),
        (noise.collect(), Some(("lines", "none of"))),
        (Vec::new(), Some(("silence", "empty"))),
        (captured(|_, [a, b, c, d]| format!("{a},{b},{c},{d},7")), Some(("sensors", "none of flexL"))),
        (
            captured(|_, [a, b, c, d]| format!("left_flex:{a},right_flex:{b},left_fsr:{c},right_fsr:{d}")),
            Some(("sensors", "left_flex")),
        ),
        (captured(|k, [a, _, c, d]| timed(k, [a, 1433, c, d])), Some(("movement", "flexR stays at 1433"))),
        // After each restart the board counts from the beginning.
        (captured(|k, counts| timed(k % 100, counts)), Some(("restarts", "restarted 3 times"))),
        (captured(|_, [a, b, ..]| format!("flexL:0x{a:x},flexR:0x{b:x}")), Some(("lines", "flexL:0x"))),
        (
            captured(|_, [a, b, c, d]| format!("{{\"flex\": [{a}, {b}], \"fsr\": [{c}, {d}]}}")),
            Some(("lines", "nested")),
        ),
    ];
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for (bytes, wrong) in cases {
        std::fs::write(at.join("hand.bytes"), bytes).unwrap();
        let ran = run(at, &["doctor", "hand.bytes"]);
        assert_eq!(ran.code, Some(i32::from(wrong.is_some())), "{ran:?}");
        assert_eq!(ran.out.contains("no faults found"), wrong.is_none(), "{ran:?}");
        if let Some((check, words)) = wrong {
            let failed = |line: &str| line.starts_with("FAILED") && line.contains(check) && line.contains(words);
            assert!(ran.out.lines().any(failed), "{ran:?}");
        }
    }
    // A hand that nobody moved: no fault, and not called sound.
    std::fs::write(at.join("hand.bytes"), captured(|k, _| timed(k, [1300, 1150, 0, 0]))).unwrap();
    let ran = run(at, &["doctor", "hand.bytes"]);
    assert!(ran.out.contains("not checked movement") && !ran.out.contains("no faults found\n"), "{ran:?}");
    // A beginning too short to tell.
    let begun = captured(timed).into_iter().take(900).collect::<Vec<u8>>();
    std::fs::write(at.join("hand.bytes"), begun).unwrap();
    let ran = run(at, &["doctor", "hand.bytes", "--json"]);
    let result: Value = serde_json::from_str(&ran.out).unwrap();
    assert!(result["not_checked"].as_array().is_some_and(|names| names.len() > 2), "{ran:?}");
    // A file of text that no board sends.
    std::fs::write(at.join("hostname"), "vm\n").unwrap();
    assert_eq!(run(at, &["doctor", "hostname"]).code, Some(1));
}
