//! The checks on made-up observations: a sound gripper, and one trouble at a time.

use super::{CHECKS, ChannelTraces, CheckFinding, CheckStatus, Observations, findings, is_sound, summary};
use crate::protocol::{AdcRange, ConsoleLine, LineKind, Saturation};
use crate::serial::{BoardKind, LinkState, LinkStatus, PortError, PortInfo, PortTrouble, UsbIdentity};
use palpate_tactile::board::{Board, Detected, Format, Reading, TimeSource};
use palpate_tactile::cadence::Cadence;
use std::path::PathBuf;

/// A sound gripper, its fingers bent meanwhile, its pads pressed.
fn sound() -> Observations {
    let board = Board {
        rate_hz: Some(50.0),
        divider_ohm: vec![47e3, 47e3, 4.7e3, 4.7e3],
        firmware: Some("1".to_owned()),
        ..Board::default()
    };
    let usb = UsbIdentity { vid: 0x2341, pid: 0x003e, serial: None };
    let kind = BoardKind { rank: 3, native: true };
    let port = PortInfo { path: PathBuf::from("/dev/ttyACM0"), title: "Due".to_owned(), usb: Some(usb), kind };
    let (rate_hz, drift_ppm) = (50.0, Some(20.0));
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
    let traces = moving(|bend| [1400.0 + bend, 1500.0 + bend, 3.0 * bend, bend]);
    let (link, listened_s, example) = (Some(link), 8.0, None);
    Observations { ports: vec![port], refused: None, modem_manager: false, link, listened_s, traces, example }
}

/// Four channels for eight seconds, in which a finger is bent by up to 400 counts and let go, time and again.
fn moving(counts: impl Fn(f32) -> [f32; 4]) -> ChannelTraces {
    lasting(400, counts)
}

/// The same for so many readings.
fn lasting(readings: u16, counts: impl Fn(f32) -> [f32; 4]) -> ChannelTraces {
    let mut traces = ChannelTraces::default();
    for k in 0..readings {
        let counts = counts(400.0 - (400.0 - 8.0 * f32::from(k % 100)).abs()).map(Some).to_vec();
        let t_s = 0.02 * f64::from(k);
        traces.add(&Reading { t_s, arrived_s: t_s, seq: None, counts, line_bar: None });
    }
    traces
}

/// Nothing that could be read, of so many bytes and lines.
fn nothing_read(bytes: u64, bad_lines: u64, printable_share: f64, example: Option<(&str, LineKind)>) -> Observations {
    let cadence = Cadence { bytes, bad_lines, printable_share, ..Cadence::default() };
    let seen = changed(|link| (link.cadence, link.detected) = (cadence.clone(), None));
    let example = example.map(|(text, kind)| ConsoleLine { arrived_ms: 0, text: text.to_owned(), kind });
    Observations { traces: ChannelTraces::default(), example, ..seen }
}

/// What a check says: its verdict, and what was seen.
fn said(seen: &Observations, check: &str) -> (CheckStatus, String) {
    let finding = findings(seen).into_iter().find(|finding| finding.check == check).expect("there is such a check");
    (finding.verdict, finding.seen)
}

/// The checks that do not find everything good.
fn complaints(seen: &Observations) -> Vec<(&'static str, CheckStatus)> {
    let found = findings(seen).into_iter().filter(|finding| finding.verdict != CheckStatus::Passed);
    let found: Vec<CheckFinding> = found.collect();
    for finding in found.iter().filter(|finding| finding.verdict >= CheckStatus::Note) {
        assert!(finding.cause.is_some() && finding.fix.is_some(), "{finding:?}");
    }
    found.iter().map(|finding| (finding.check, finding.verdict)).collect()
}

fn changed(change: impl Fn(&mut LinkStatus)) -> Observations {
    let mut seen = sound();
    seen.link.iter_mut().for_each(change);
    seen
}

#[test]
fn nothing_is_wrong_with_a_sound_gripper() {
    assert_eq!(complaints(&sound()), []);
}

#[test]
fn a_port_that_does_not_open_is_told_once_and_the_rest_is_not_seen() {
    for (trouble, check) in [
        (PortTrouble::NotFound, "port"),
        (PortTrouble::Several, "port"),
        (PortTrouble::Permission, "permission"),
        (PortTrouble::Busy, "busy"),
    ] {
        let refused = PortError {
            trouble,
            what: "cannot open".to_owned(),
            cause: "why".to_owned(),
            fix: "what to do".to_owned(),
            command: Some("sudo".to_owned()),
        };
        let seen = Observations { refused: Some(refused), link: None, ..sound() };
        let found = findings(&seen);
        let wrong: Vec<&CheckFinding> = found.iter().filter(|finding| finding.verdict == CheckStatus::Failed).collect();
        assert!(wrong.len() == 1 && wrong[0].check == check, "{wrong:?}");
        assert_eq!((wrong[0].command.as_deref(), wrong[0].cause.as_deref()), (Some("sudo"), Some("why")));
        assert!(found.iter().filter(|finding| finding.verdict == CheckStatus::NotChecked).count() >= 10);
    }
}

#[test]
fn modem_manager_is_worth_a_note_where_it_can_do_harm() {
    let seen = Observations { modem_manager: true, ..sound() };
    assert_eq!(complaints(&seen), [("modem-manager", CheckStatus::Note)]);
    let mut terminal = changed(|link| link.port.usb = None);
    terminal.modem_manager = true;
    assert_eq!(complaints(&terminal), []);
}

#[test]
fn a_silent_port_is_told_by_what_it_is() {
    let silent = |native| {
        let mut seen = changed(|link| {
            link.state = LinkState::Silent { hint: String::new() };
            link.cadence = Cadence::default();
            link.port.kind.native = native;
        });
        seen.traces = ChannelTraces::default();
        let found =
            findings(&seen).into_iter().find(|finding| finding.verdict == CheckStatus::Failed).expect("one is wrong");
        assert_eq!(found.check, "silence");
        assert!(!is_sound(&findings(&seen)));
        found.cause.unwrap_or_default()
    };
    assert!(silent(true).contains("DTR") && !silent(false).contains("DTR"));
}

#[test]
fn each_trouble_is_found_by_its_own_check() {
    let high = |channel: usize| changed(|link| link.saturation[channel] = Some(Saturation::High));
    let wrong = |check| vec![(check, CheckStatus::Failed)];
    // A saturated pad hides what the strip before it would do to it.
    let hidden = [("saturation", CheckStatus::Failed), ("crosstalk", CheckStatus::NotChecked)];
    assert_eq!(complaints(&high(2)), hidden);
    assert_eq!(complaints(&high(0)), wrong("open-circuit"));
    assert_eq!(complaints(&changed(|link| link.saturation[1] = Some(Saturation::Low))), wrong("open-circuit"));
    assert_eq!(complaints(&changed(|link| link.saturation[3] = Some(Saturation::Low))), [], "an idle pad is at zero");
    assert_eq!(complaints(&changed(|link| link.adc_range = AdcRange::LooksTenBit)), wrong("bits"));
    assert_eq!(complaints(&changed(|link| link.cadence.lost = 10)), wrong("rate"));
    assert_eq!(complaints(&changed(|link| link.cadence.rate_hz = 42.0)), wrong("rate"));
    let unreadable = |link: &mut LinkStatus| (link.cadence.lost, link.cadence.bad_lines) = (40, 40);
    assert_eq!(complaints(&changed(unreadable)), [("lines", CheckStatus::Failed), ("rate", CheckStatus::Note)]);
    assert_eq!(complaints(&changed(|link| link.cadence.bad_lines = 40)), wrong("lines"));
    for (text, verdict) in [
        ("entry 0x400805e4", CheckStatus::Note),
        ("WiFi reconnecting..., rssi=-71", CheckStatus::Note),
        ("flexL:14\u{fffd}2,flexR:1500", CheckStatus::Failed),
        ("exL:1433,flexR:15 0", CheckStatus::Failed),
        ("14 2,15", CheckStatus::Failed),
    ] {
        let example = Some(ConsoleLine { arrived_ms: 0, text: text.to_owned(), kind: LineKind::Bad("why") });
        let seen = Observations { example, ..changed(|link| link.cadence.bad_lines = 40) };
        assert_eq!(complaints(&seen), [("lines", verdict)], "{text}");
    }
    assert_eq!(complaints(&changed(|link| link.cadence.drift_ppm = Some(-1e6))), wrong("clock"));
    let silent = |link: &mut LinkStatus| link.state = LinkState::Silent { hint: String::new() };
    assert_eq!(complaints(&changed(silent)), wrong("silence"));
    assert_eq!(complaints(&changed(|link| link.cadence.restarts = 3)), wrong("restarts"));
    assert_eq!(complaints(&changed(|link| link.reconnects = 1)), wrong("port"));
    let came_back = |link: &mut LinkStatus| (link.reconnects, link.cadence.lost) = (1, 50);
    assert_eq!(complaints(&changed(came_back)), [("port", CheckStatus::Failed), ("rate", CheckStatus::Note)]);
    let lost = |link: &mut LinkStatus| link.state = LinkState::Lost { cause: "unplugged".to_owned() };
    assert_eq!(complaints(&changed(lost)), wrong("port"));
}

#[test]
fn what_is_worth_knowing_is_no_error() {
    let note = |check| vec![(check, CheckStatus::Note)];
    assert_eq!(complaints(&changed(|link| link.cadence.drift_ppm = Some(200.0))), note("clock"));
    assert_eq!(complaints(&changed(|link| link.cadence.drift_ppm = None)), note("clock"));
    assert_eq!(complaints(&changed(|link| link.cadence.delay_p95_ms = 240.0)), note("rate"));
    assert_eq!(complaints(&changed(|link| link.board.firmware = None)), note("firmware"));
    let quarter = moving(|bend| [350.0 + 0.25 * bend, 375.0 + 0.25 * bend, 0.75 * bend, 0.25 * bend]);
    let ten_bits = Observations { traces: quarter, ..changed(|link| link.board.full_scale = 1023) };
    assert_eq!(complaints(&ten_bits), note("bits"));
    assert_eq!(complaints(&changed(|link| link.cadence.bad_lines = 4)), note("lines"));
    let slow = |link: &mut LinkStatus| (link.baud, link.port.kind.native) = (Some(57_600), false);
    assert_eq!(complaints(&changed(slow)), note("baud"));
    let fewer = |link: &mut LinkStatus| link.board.channels[3] = "temperature".to_owned();
    assert_eq!(complaints(&changed(fewer)), note("sensors"));
}

#[test]
fn what_was_not_seen_is_not_called_sound() {
    let unseen = |seen: &Observations, checks: &[&str]| {
        let found = findings(seen);
        let all: Vec<&str> = checks.to_vec();
        assert_eq!(super::not_checked(&found), all);
        assert!(is_sound(&found), "nothing is wrong either");
        assert_eq!(summary(&found), format!("no fault in what was seen, but not checked: {}", all.join(", ")));
    };
    let pads_at_rest = moving(|bend| [1400.0 + bend, 1500.0 + bend, 0.0, 0.0]);
    unseen(&Observations { traces: pads_at_rest, ..sound() }, &["open-circuit"]);
    let resting = Observations { traces: moving(|_| [1400.0, 1500.0, 0.0, 0.0]), ..sound() };
    unseen(&resting, &["open-circuit", "movement"]);
    assert_eq!(said(&resting, "movement").1, "nothing moved");
    let one = moving(|bend| [1400.0 + bend, 1500.0 + 0.01 * bend, 3.0 * bend, bend]);
    unseen(&Observations { traces: one, ..sound() }, &["movement"]);
    // Half a second of readings says little.
    let mut short = Observations { traces: lasting(25, |bend| [700.0 + bend, 700.0 + bend, bend, bend]), ..sound() };
    short.link.iter_mut().for_each(|link| (link.board.firmware, link.cadence.drift_ppm) = (None, Some(0.0)));
    unseen(&short, &["firmware", "bits", "saturation", "open-circuit", "movement", "crosstalk", "rate", "clock"]);
    assert_eq!(summary(&findings(&sound())), "no faults found");
}

#[test]
fn a_strip_that_never_changes_while_others_move_is_a_fault() {
    let wrong = vec![("movement", CheckStatus::Failed)];
    let stuck = moving(|bend| [1433.0, 1500.0 + bend, 3.0 * bend, bend]);
    assert_eq!(complaints(&Observations { traces: stuck, ..sound() }), wrong);
    let held = moving(|bend| [1400.0 + bend, 1500.0 + bend, 700.0, bend]);
    let found = Observations { traces: held, ..sound() };
    assert_eq!(
        said(&found, "movement"),
        (CheckStatus::Failed, "fsrL stays at 700 for 7.98 s while others move".to_owned())
    );
    // Idle pads never change, and a strip that has come off is another check's.
    let idle = moving(|bend| [4095.0, 1500.0 + bend, 0.0, bend]);
    let mut off = Observations { traces: idle, ..sound() };
    off.link.iter_mut().for_each(|link| link.saturation[0] = Some(Saturation::High));
    assert_eq!(said(&off, "movement").0, CheckStatus::Passed);
}

#[test]
fn other_boards_are_told_by_what_they_print() {
    let names = |names: [&str; 4]| changed(|link| link.board.channels = names.map(str::to_owned).to_vec());
    let other = names(["left_flex", "right_flex", "left_fsr", "right_fsr"]);
    let (verdict, seen) = said(&other, "sensors");
    assert!(verdict == CheckStatus::Failed && seen.contains("left_flex, right_flex"), "{seen}");
    let swapped = Observations { traces: moving(|bend| [3.0 * bend, bend, 1400.0 + bend, 1500.0 + bend]), ..sound() };
    let found: Vec<&str> =
        findings(&swapped).iter().filter(|f| f.verdict >= CheckStatus::Note).map(|f| f.check).collect();
    assert_eq!(found, ["sensors"], "no crosstalk, no short circuit");
    let volt = |bend: f32| [1400.0 + bend, 1500.0 + bend, 3.0 * bend, bend].map(|count| count * 3.3 / 4095.0);
    let mut volts = Observations { traces: moving(volt), ..sound() };
    volts.link.iter_mut().for_each(|link| link.saturation = vec![Some(Saturation::Low); 4]);
    let found: Vec<&str> =
        findings(&volts).iter().filter(|f| f.verdict >= CheckStatus::Note).map(|f| f.check).collect();
    assert_eq!((found, said(&volts, "bits").1), (vec!["bits"], "no value above 1.53, with decimals".to_owned()));
    let complains = |counts: &dyn Fn(f32) -> [f32; 4], range: AdcRange, essence: &str| {
        let mut seen = Observations { traces: moving(counts), ..sound() };
        seen.link.iter_mut().for_each(|link| link.adc_range = range);
        let found: Vec<&str> =
            findings(&seen).iter().filter(|f| f.verdict >= CheckStatus::Note).map(|f| f.check).collect();
        assert!(found == ["bits"] && said(&seen, "bits").1.contains(essence), "{found:?}");
    };
    let bytes = |bend: f32| [1400.0 + bend, 1500.0 + bend, 3.0 * bend, bend].map(|count| (count / 16.0).floor());
    complains(&bytes, AdcRange::Fits, "no strip above 118 of 4095");
    let ohms = |bend: f32| [25e3 + bend, 24e3 + bend, 1e6 / (1.0 + bend), 1e6 - bend];
    complains(&ohms, AdcRange::Exceeded, "values up to 1000000, which no usual converter has");
    // Limits of a plot are no sensors.
    let mut limits = sound();
    limits.link.iter_mut().for_each(|link| {
        link.board.channels.push("Max".to_owned());
        link.saturation.push(Some(Saturation::High));
    });
    assert_eq!(complaints(&limits), []);
}

#[test]
fn a_clock_that_counts_other_than_microseconds_is_a_fault() {
    let mut slow = ChannelTraces::default();
    for k in 0..400_u16 {
        let (t_s, arrived_s, counts) = (2e-5 * f64::from(k), 0.02 * f64::from(k), vec![Some(1400.0); 4]);
        slow.add(&Reading { t_s, arrived_s, seq: None, counts, line_bar: None });
    }
    let seen = Observations { traces: slow, ..changed(|link| link.cadence.drift_ppm = Some(0.0)) };
    assert_eq!(said(&seen, "clock"), (CheckStatus::Failed, "it counted 0.00798 s in 7.98 s".to_owned()));
}

#[test]
fn a_pad_that_follows_the_strip_before_it_is_crosstalk_and_one_that_is_pressed_is_not() {
    let bled =
        Observations { traces: moving(|bend| [1400.0 + bend, 1500.0 + bend, 0.2 * (1500.0 + bend), bend]), ..sound() };
    assert_eq!(complaints(&bled), [("crosstalk", CheckStatus::Failed)]);
    let pressed =
        Observations { traces: moving(|bend| [1400.0 + bend, 1500.0 - bend, 700.0 + 0.01 * bend, bend]), ..sound() };
    assert_eq!(complaints(&pressed), [("crosstalk", CheckStatus::Note)]);
    // A grasp: the pad follows the strip, but from nothing.
    let grasped = moving(|bend| [1400.0 + bend, 1500.0 + bend, (8.0 * (bend - 200.0)).max(0.0), bend]);
    assert_eq!(complaints(&Observations { traces: grasped, ..sound() }), []);
}

#[test]
fn what_cannot_be_read_is_told_by_what_came() {
    let failed = |seen: &Observations| {
        let found = findings(seen).into_iter().filter(|finding| finding.verdict == CheckStatus::Failed);
        found.map(|finding| (finding.check, finding.seen)).collect::<Vec<_>>()
    };
    let noise = failed(&nothing_read(3000, 30, 0.4, Some(("\\xff\\x03", LineKind::Bad("not text")))));
    assert_eq!(noise[0], ("baud", "unreadable data: 40 % of the bytes are text".to_owned()));
    assert_eq!((noise[1].0, noise.len()), ("lines", 2));
    // Text is no matter of speed: a line of it is shown, and why it was not understood.
    let long = format!(">flexL:{}|g", "1".repeat(90));
    let text = failed(&nothing_read(3000, 30, 1.0, Some((&long, LineKind::Bad("a value is not a number")))));
    let [("lines", seen)] = &text[..] else { panic!("{text:?}") };
    assert!(seen.starts_with("none of 30 line(s) understood, such as `>flexL:111") && seen.len() < 150, "{seen}");
    assert!(seen.ends_with("..` (a value is not a number)"), "{seen}");
    let two = nothing_read(3000, 30, 1.0, Some(("temp:22.4,hum:40", LineKind::Values)));
    let cause = findings(&two).into_iter().find_map(|finding| finding.cause).expect("one is wrong");
    assert!(cause.contains("two devices"), "{cause}");
    assert_eq!(failed(&nothing_read(3, 0, 1.0, None)), [("lines", "no line understood in 3 byte(s)".to_owned())]);
    let mut empty = nothing_read(0, 0, 1.0, None);
    empty.link.iter_mut().for_each(|link| link.baud = None);
    assert_eq!(failed(&empty), [("silence", "the file is empty".to_owned())]);
}

#[test]
fn every_check_has_a_name_of_its_own() {
    for check in CHECKS {
        assert_eq!(CHECKS.iter().filter(|other| other.name == check.name).count(), 1);
        assert!(!check.about.is_empty());
    }
}
