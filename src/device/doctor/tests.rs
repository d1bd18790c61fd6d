//! The checks on made-up observations: a sound gripper, and one trouble at a time.

use super::{CHECKS, ChannelTraces, CheckFinding, CheckStatus, Observations, findings};
use crate::protocol::{AdcRange, Saturation};
use crate::serial::{BoardKind, LinkState, LinkStatus, PortError, PortInfo, PortTrouble, UsbIdentity};
use palpate_tactile::board::{Board, Reading};
use palpate_tactile::cadence::Cadence;
use std::path::PathBuf;

/// A sound gripper, its left finger bent meanwhile, its pads pressed.
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
    let cadence =
        Cadence { samples: 400, rate_hz: 50.0, printable_share: 1.0, drift_ppm: Some(20.0), ..Cadence::default() };
    let link = LinkStatus {
        state: LinkState::Listening,
        port: port.clone(),
        baud: Some(115_200),
        board,
        detected: None,
        cadence,
        saturation: vec![None; 4],
        adc_range: AdcRange::Fits,
        reconnects: 0,
        now_s: 8.0,
        dropped: [0; 2],
    };
    let traces = moving(|bend| [1400.0 + bend, 1500.0, 3.0 * bend, bend]);
    Observations { ports: vec![port], refused: None, modem_manager: false, link: Some(link), listened_s: 8.0, traces }
}

/// Four channels while a finger is bent by up to 400 counts.
fn moving(counts: impl Fn(f32) -> [f32; 4]) -> ChannelTraces {
    let mut traces = ChannelTraces::default();
    for k in 0..100_u8 {
        let counts = counts(4.0 * f32::from(k)).map(Some).to_vec();
        traces.add(&Reading { t_s: 0.0, arrived_s: 0.0, seq: None, counts, line_bar: None });
    }
    traces
}

/// The checks that do not find everything good.
fn complaints(seen: &Observations) -> Vec<(&'static str, CheckStatus)> {
    let found = findings(seen).into_iter().filter(|finding| finding.verdict != CheckStatus::Passed);
    let found: Vec<CheckFinding> = found.collect();
    for finding in found.iter().filter(|finding| finding.verdict > CheckStatus::Passed) {
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
        assert!(found.iter().filter(|finding| finding.verdict == CheckStatus::Skipped).count() >= 10);
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
        found.cause.unwrap_or_default()
    };
    assert!(silent(true).contains("DTR") && !silent(false).contains("DTR"));
}

#[test]
fn each_trouble_is_found_by_its_own_check() {
    let high = |channel: usize| changed(|link| link.saturation[channel] = Some(Saturation::High));
    let wrong = |check| vec![(check, CheckStatus::Failed)];
    assert_eq!(complaints(&high(2)), wrong("saturation"));
    assert_eq!(complaints(&high(0)), wrong("open-circuit"));
    assert_eq!(complaints(&changed(|link| link.saturation[1] = Some(Saturation::Low))), wrong("open-circuit"));
    assert_eq!(complaints(&changed(|link| link.saturation[3] = Some(Saturation::Low))), [], "an idle pad is at zero");
    assert_eq!(complaints(&changed(|link| link.adc_range = AdcRange::LooksTenBit)), wrong("bits"));
    assert_eq!(complaints(&changed(|link| link.cadence.lost = 10)), wrong("rate"));
    assert_eq!(complaints(&changed(|link| link.cadence.rate_hz = 42.0)), wrong("rate"));
    let unreadable = |link: &mut LinkStatus| (link.cadence.lost, link.cadence.bad_lines) = (40, 40);
    assert_eq!(complaints(&changed(unreadable)), [("lines", CheckStatus::Failed), ("rate", CheckStatus::Note)]);
    assert_eq!(complaints(&changed(|link| link.cadence.bad_lines = 40)), wrong("lines"));
    assert_eq!(complaints(&changed(|link| link.cadence.drift_ppm = Some(-1e6))), wrong("clock"));
    let lost = |link: &mut LinkStatus| link.state = LinkState::Lost { cause: "unplugged".to_owned() };
    assert_eq!(complaints(&changed(lost)), wrong("port"));
}

#[test]
fn what_is_worth_knowing_is_no_error() {
    let note = |check| vec![(check, CheckStatus::Note)];
    assert_eq!(complaints(&changed(|link| link.cadence.drift_ppm = Some(200.0))), note("clock"));
    assert_eq!(complaints(&changed(|link| link.cadence.drift_ppm = None)), note("clock"));
    assert_eq!(complaints(&changed(|link| link.board.firmware = None)), note("firmware"));
    let quarter = moving(|bend| [350.0 + 0.25 * bend, 375.0, 0.75 * bend, 0.25 * bend]);
    let ten_bits = Observations { traces: quarter, ..changed(|link| link.board.full_scale = 1023) };
    assert_eq!(complaints(&ten_bits), note("bits"));
    assert_eq!(complaints(&changed(|link| link.cadence.bad_lines = 4)), note("lines"));
    let slow = |link: &mut LinkStatus| (link.baud, link.port.kind.native) = (Some(57_600), false);
    assert_eq!(complaints(&changed(slow)), note("baud"));
    let untouched = Observations { traces: moving(|bend| [1400.0 + bend, 1500.0, 0.0, 0.0]), ..sound() };
    assert_eq!(complaints(&untouched), note("open-circuit"));
}

#[test]
fn a_pad_that_follows_the_strip_before_it_is_crosstalk_and_one_that_is_pressed_is_not() {
    let bled = Observations { traces: moving(|bend| [1400.0, 1500.0 + bend, 0.2 * (1500.0 + bend), bend]), ..sound() };
    assert_eq!(complaints(&bled), [("crosstalk", CheckStatus::Failed)]);
    let pressed = Observations { traces: moving(|bend| [1400.0 + bend, 1500.0, 700.0, bend]), ..sound() };
    assert_eq!(complaints(&pressed), [("crosstalk", CheckStatus::Note)]);
    // A grasp: the pad follows the strip, but from nothing.
    let grasped = moving(|bend| [1400.0 + bend, 1500.0 + bend, (8.0 * (bend - 200.0)).max(0.0), bend]);
    assert_eq!(complaints(&Observations { traces: grasped, ..sound() }), []);
}

#[test]
fn nonsense_is_told_as_a_wrong_rate() {
    let mut seen = changed(|link| {
        link.state = LinkState::Unreadable { hint: String::new() };
        link.cadence = Cadence { printable_share: 0.4, bad_lines: 30, ..Cadence::default() };
    });
    seen.traces = ChannelTraces::default();
    let found = complaints(&seen);
    assert!(
        found.contains(&("baud", CheckStatus::Failed)) && found.contains(&("lines", CheckStatus::Failed)),
        "{found:?}"
    );
}

#[test]
fn every_check_has_a_name_of_its_own() {
    for check in CHECKS {
        assert_eq!(CHECKS.iter().filter(|other| other.name == check.name).count(), 1);
        assert!(!check.about.is_empty());
    }
}
