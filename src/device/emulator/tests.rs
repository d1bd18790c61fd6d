//! The whole emulated gripper, without a port.

use super::*;
use palpate_sim::objects::EMPTY;
use palpate_sim::scene::{Accuracy, Scene};

fn setup(script: &str, faults: &str) -> EmulatorSetup {
    let mut scene = Scene::default();
    scene.solver.accuracy = Accuracy::Draft;
    let script = parse_script(script).expect("sound");
    let hand = HandPlan {
        sensors: palpate_tactile::board::SensorList::default(),
        scene,
        objects: vec![EMPTY.to_owned()],
        seed: 1,
        grasp_every_s: None,
        script,
    };
    let mut parts = HiddenParts::drawn(1);
    parts.noise_counts = 0.0;
    (parts.hysteresis, parts.drift) = (false, false);
    let faults = parse_faults(faults).expect("sound");
    EmulatorSetup { hand, parts, rate_hz: 50, channels: 4, most_steps: 30, clock_start_us: 0, faults, seed: 1 }
}

/// Everything it sends until a time (s), told to go on every 5 ms.
fn sent(gripper: &mut EmulatedGripper, from_s: f64, to_s: f64) -> Vec<u8> {
    let turns = ((to_s - from_s) / 0.005).round() as u32;
    (1..=turns)
        .flat_map(|k| {
            gripper.advance(from_s + 0.005 * f64::from(k));
            gripper.take_bytes()
        })
        .collect()
}

fn text(setup: EmulatorSetup, to_s: f64) -> String {
    let mut gripper = EmulatedGripper::new(setup).expect("nothing to load");
    String::from_utf8(sent(&mut gripper, 0.0, to_s)).expect("plain text")
}

fn number(line: &str, key: &str) -> Option<f64> {
    line.split(',').find_map(|field| field.strip_prefix(key)?.strip_prefix(':')?.parse().ok())
}

/// The samples among the lines.
fn samples(text: &str) -> Vec<&str> {
    text.lines().filter(|line| line.starts_with("t_us:")).collect()
}

#[test]
fn it_says_hello_and_prints_fifty_samples_a_second_at_exact_times() {
    let found = text(setup("", ""), 2.0);
    assert!(
        found.starts_with("# tactile-gripper fw=2 adc=12 vref=3.3 rate=50 ch=flexL,flexR,fsrL,fsrR rm=47000,"),
        "{found}"
    );
    let lines = samples(&found);
    assert_eq!(lines.len(), 101);
    for (k, line) in lines.iter().enumerate() {
        assert_eq!((number(line, "t_us"), number(line, "seq")), (Some(20_000.0 * k as f64), Some(k as f64)), "{line}");
    }
}

#[test]
fn counts_are_those_of_the_hidden_parts() {
    let setup = setup("angle=60 hold=2; load=0.2kg hold=2", "");
    let parts = setup.parts.clone();
    let found = text(setup, 4.0);
    let lines = samples(&found);
    let count = |line: &str, key: &str| number(line, key).expect("printed");
    for (side, key) in ["flexL", "flexR"].into_iter().enumerate() {
        let strip = parts.strips[side];
        let ohm = strip.part.flat_ohm * (1.0 + strip.part.rise_per_rad * 60_f64.to_radians());
        let want = (4096.0 * ohm / (ohm + 47e3)).floor();
        assert_eq!(count(lines[75], key), want);
    }
    for (side, key) in ["fsrL", "fsrR"].into_iter().enumerate() {
        let pad = parts.pads[side].part;
        let ratio = 4.7e3 * pad.gain * (0.2 * palpate_geometry::units::STANDARD_GRAVITY).powf(pad.exponent);
        assert_eq!(count(lines[180], key), (4096.0 * ratio / (1.0 + ratio)).floor());
        assert!(count(lines[75], key) > 0.0 || parts.pads[side].bending_load * 18.9 < 0.18, "bending alone loads it");
        assert_eq!(count(lines[0], key), 0.0);
    }
}

#[test]
fn the_same_seed_gives_the_same_bytes_whatever_the_turns() {
    let faults = "garbage@0.5,loss@1,partial@2,burst@3,clock@0";
    let setup = |seed| EmulatorSetup { parts: HiddenParts::drawn(2), seed, ..setup("close empty", faults) };
    let all = |seed, every: f64| {
        let mut gripper = EmulatedGripper::new(setup(seed)).expect("nothing to load");
        let mut bytes = Vec::new();
        for k in 0..=(5.0 / every) as u32 {
            gripper.advance(f64::from(k) * every);
            bytes.extend(gripper.take_bytes());
        }
        bytes
    };
    let one = all(1, 0.001);
    assert!(one.len() > 8000 && one == all(1, 0.25) && one == all(1, 0.001));
    assert_ne!(one, all(2, 0.001));
}

#[test]
fn a_host_drives_it_and_the_watchdog_lets_go() {
    let mut gripper = EmulatedGripper::new(setup("", "")).expect("nothing to load");
    let open = sent(&mut gripper, 0.0, 0.1);
    let mut found = Vec::new();
    gripper.hear(b"P 0.50\n");
    // Alive for two seconds, then silent.
    for k in 0..4 {
        found.extend(sent(&mut gripper, 0.1 + 0.5 * f64::from(k), 0.6 + 0.5 * f64::from(k)));
        gripper.hear(b"K\n");
    }
    let flex = |bytes: &[u8]| {
        let text = String::from_utf8_lossy(bytes).into_owned();
        samples(&text).last().and_then(|line| Some((number(line, "flexL")?, number(line, "p_bar")?)))
    };
    let (open, closed) = (flex(&open).expect("a sample"), flex(&found).expect("a sample"));
    assert!(closed.0 > open.0 + 50.0 && closed.1 == 0.5, "{open:?} {closed:?}");
    let silent = sent(&mut gripper, 2.1, 5.0);
    let text = String::from_utf8_lossy(&silent).into_owned();
    assert!(text.contains("# vent reason=watchdog") && flex(&silent).expect("a sample").1 == 0.0);
    assert!(gripper.take_happened().iter().any(|happened| happened.what == EmulatorEventKind::Watchdog));
}

#[test]
fn an_empty_hand_first_shifts_no_object_out_of_its_turn() {
    let mut setup = setup("", "");
    setup.hand.objects = [EMPTY, "ball", "cube", "cylinder"].map(str::to_owned).to_vec();
    let mut gripper = EmulatedGripper::new(setup).expect("loads");
    let mut grasped = Vec::new();
    for k in 0..5 {
        let from_s = 2.0 * f64::from(k);
        gripper.hear(b"P 0.50\n");
        sent(&mut gripper, from_s, from_s + 0.2);
        gripper.hear(b"P 0.00\n");
        sent(&mut gripper, from_s + 0.2, from_s + 2.0);
        grasped.extend(gripper.take_happened().into_iter().filter_map(|happened| match happened.what {
            EmulatorEventKind::Grasp { object, .. } => Some(object),
            _ => None,
        }));
    }
    assert_eq!(grasped, [EMPTY, "ball", "cube", "cylinder", "ball"]);
}

#[test]
fn every_fault_does_what_it_says() {
    let clean = text(setup("", ""), 3.0);
    let lines = |faults: &str| {
        let mut gripper = EmulatedGripper::new(setup("", faults)).expect("nothing to load");
        String::from_utf8_lossy(&sent(&mut gripper, 0.0, 3.0)).into_owned()
    };
    let at = |text: &str, s: f64, key: &str| number(samples(text)[(50.0 * s) as usize], key);
    assert_eq!(at(&lines("saturation=2@1"), 2.0, "fsrL"), Some(4095.0));
    assert_eq!((at(&lines("open=0@1"), 2.0, "flexL"), at(&lines("open=2@1"), 2.0, "fsrL")), (Some(4095.0), Some(0.0)));
    let nan = lines("nan=3@1");
    assert!(samples(&nan)[100].contains("fsrR:nan") && nan.lines().count() == clean.lines().count());
    let ten = at(&lines("tenbit@0"), 2.0, "flexL").expect("printed");
    let twelve = at(&clean, 2.0, "flexL").expect("printed");
    assert!((ten - twelve / 4.0).abs() <= 1.0, "{ten} of {twelve}");
    let bled = at(&lines("crosstalk=0.2@0"), 2.0, "fsrL").expect("printed");
    let right = at(&clean, 2.0, "flexR").expect("printed");
    assert!((bled - 0.2 * right).abs() <= 1.0, "a fifth of the one before: {bled} of {right}");
    // 200 ppm fast: within 3 s the board's clock gains 0.6 ms, so that its 151st sample comes that much earlier.
    assert_eq!(samples(&lines("clock=200000@0")).len(), 181, "a fifth faster, for it to show");
    let lost = lines("loss=0.5@1/1");
    assert!((110..142).contains(&samples(&lost).len()) && samples(&lost).iter().all(|line| clean.contains(*line)));
    assert_eq!(samples(&lines("silent@1/1")).len(), 101);
    let reset = lines("reset@1/1");
    assert_eq!((reset.matches("# tactile-gripper").count(), reset.matches("seq:0,").count()), (2, 2));
    assert!(lines("garbage@1/1").matches('\u{fffd}').count() > 500);
    let cut = lines("partial=1@1/1");
    assert!(cut.lines().count() < 110 && cut.lines().any(|line| line.matches("t_us").count() > 1));
    let short = lines("byte=1@1/1");
    assert_eq!(clean.len() - short.len(), 50, "a byte of each");
    assert_ne!(lines("baud@1/1"), clean);
    assert_eq!(lines("burst=0.3@1/1"), clean, "late, but all there");
}

#[test]
fn each_fault_of_the_pressure_does_what_it_says() {
    let drive = |faults: &str| {
        let mut gripper = EmulatedGripper::new(setup("", faults)).expect("nothing to load");
        sent(&mut gripper, 0.0, 1.0);
        gripper.hear(b"P 0.50\n");
        (String::from_utf8_lossy(&sent(&mut gripper, 1.0, 1.5)).into_owned(), gripper.take_printed())
    };
    let line = |text: &str, words: &str| text.lines().any(|line| line.contains(words));
    let (sound, _) = drive("");
    assert!(line(&sound, "# ok p=0.50") && line(&sound, ",p_bar:0.50,") && !line(&sound, ",p_bar:1.20,"));
    let (mute, printed) = drive("noanswer@1");
    assert!(!line(&mute, "# ok") && line(&mute, ",p_bar:0.50,") && line(&printed, "# ok p=0.50"));
    let (deaf, printed) = drive("deaf@1");
    assert!(!line(&deaf, "# ok") && !line(&printed, "# ok") && !line(&deaf, ",p_bar:0.50,"));
    let (wrong, _) = drive("wronganswer=1.2@1");
    assert!(line(&wrong, "# ok p=1.20") && !line(&wrong, "# ok p=0.50") && line(&wrong, ",p_bar:0.50,"));
    let (off, _) = drive("wrongpressure=1.2@1");
    assert!(line(&off, "# ok p=0.50") && line(&off, ",p_bar:1.20,") && !line(&off, ",p_bar:0.50,"));
    let (restarted, _) = drive("reset@0.9/0.3");
    assert!(line(&restarted, "# tactile-gripper") && line(&restarted, ",p_bar:0.00,"));
    assert!(!line(&restarted, "# ok") && !line(&restarted, ",p_bar:0.50,"), "what is sent meanwhile is lost");
}

#[test]
fn a_stuck_channel_keeps_its_reading_while_the_others_go_on() {
    let found = text(setup("rest=1;angle=90 hold=2", "stuck=0@0.5"), 2.5);
    let lines = samples(&found);
    let count = |k: usize, key: &str| number(lines[k], key).expect("printed");
    assert_eq!(count(110, "flexL"), count(10, "flexL"));
    assert!(count(110, "flexR") > count(10, "flexR") + 300.0);
}

#[test]
fn a_gain_changes_one_channel_by_its_factor() {
    let found = text(setup("load=0.5kg hold=4", "gain=2*0.7@2,gain=0@3"), 4.0);
    let lines = samples(&found);
    let count = |k: usize, key: &str| number(lines[k], key).expect("printed");
    assert!((count(110, "fsrL") - 0.7 * count(90, "fsrL")).abs() <= 1.0 && count(90, "fsrL") > 1000.0);
    assert!((count(170, "flexL") - 0.5 * count(90, "flexL")).abs() <= 1.0 && count(110, "flexL") == count(90, "flexL"));
    assert_eq!((count(170, "flexR"), count(170, "fsrR")), (count(90, "flexR"), count(90, "fsrR")));
}

#[test]
fn a_thousand_samples_a_second_on_eight_channels() {
    let setup = EmulatorSetup { rate_hz: 1000, channels: 8, parts: HiddenParts::drawn(1), ..setup("", "") };
    let found = text(setup, 1.0);
    let lines = samples(&found);
    assert_eq!(lines.len(), 1001);
    assert!(lines.iter().all(|line| line.split(',').count() == 12 && number(line, "aux4").is_some()));
}

#[test]
fn sensors_with_a_memory_follow_a_grasp_from_its_first_sample_on() {
    let setup = EmulatorSetup { parts: HiddenParts::drawn(1), ..setup("close empty", "") };
    assert!(setup.parts.hysteresis && setup.parts.drift && setup.parts.noise_counts > 0.0);
    let found = text(setup, 4.5);
    let count = |k: usize| number(samples(&found)[k], "flexL").expect("printed");
    // 11.7 1/m at 1 bar: a bend of 0.65 rad, which raises the resistance by four tenths.
    assert!(count(140) > count(0) + 250.0 && (count(224) - count(0)).abs() < 40.0, "{} {}", count(140), count(224));
}
