//! The panels that help with the real gripper: doctor, fit and training, by their labels, with a picture of each state.

use crate::bench::{Bench, BenchSetup};
use crate::cpu_renderer::CpuRenderer;
use crate::golden::compare;
use crate::panels::side_by_side;
use egui_kittest::kittest::Queryable as _;
use image::RgbaImage;
use palpate::app::ALL_PANELS;
use palpate_core::board::{Board, Reading};
use palpate_core::doctor::{Observations, Traces};
use palpate_core::palette::Theme;
use palpate_core::rig::serial::{BoardKind, LinkState, LinkStatus, PortInfo, UsbIdentity};
use palpate_core::wire::{Cadence, Rail};
use palpate_core::workers::Examine;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

/// A bench with one of the panels on it, nothing else.
fn bench(panel: &str, theme: Theme, setup: BenchSetup) -> Bench {
    let panel = ALL_PANELS.iter().find(|own| own.name == panel);
    Bench::new(BenchSetup { panel, theme, ..setup }, CpuRenderer::default())
}

/// The same state in both themes, state by state.
fn pairs<const N: usize>(dark: [RgbaImage; N], light: [RgbaImage; N]) -> impl Iterator<Item = [RgbaImage; 2]> {
    dark.into_iter().zip(light).map(|(dark, light)| [dark, light])
}

/// A sound gripper, its left finger bent and its pads pressed meanwhile.
fn sound() -> Observations {
    let usb = UsbIdentity { vid: 0x2341, pid: 0x003e, serial: None };
    let (title, kind) = ("Arduino Due, native port".to_owned(), BoardKind { rank: 3, native: true });
    let port = PortInfo { path: PathBuf::from("/dev/ttyACM0"), title, usb: Some(usb), kind };
    let cadence =
        Cadence { samples: 400, rate_hz: 50.0, printable_share: 1.0, drift_ppm: Some(20.0), ..Cadence::default() };
    let link = LinkStatus {
        state: LinkState::Listening,
        port: port.clone(),
        baud: Some(115_200),
        board: Board { rate_hz: Some(50.0), firmware: Some("1".to_owned()), ..Board::default() },
        detected: None,
        cadence,
        rails: vec![None; 4],
        looks_10_bit: false,
        reconnects: 0,
        now_s: 8.0,
        dropped: [0; 2],
    };
    let mut traces = Traces::default();
    for k in 0..100_u8 {
        let bend = 4.0 * f32::from(k);
        let counts = [1400.0 + bend, 1500.0, 3.0 * bend, bend].map(Some).to_vec();
        traces.add(&Reading { t_s: 0.0, arrived_s: 0.0, seq: None, counts, line_bar: None });
    }
    Observations { ports: vec![port], refused: None, modem_manager: false, link: Some(link), listened_s: 8.0, traces }
}

/// The same with a strip unplugged, ModemManager about and lines damaged.
fn troubled() -> Observations {
    let mut seen = sound();
    seen.modem_manager = true;
    if let Some(link) = &mut seen.link {
        link.rails[1] = Some(Rail::High);
        link.cadence.bad_lines = 60;
    }
    seen
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
                std::thread::sleep(std::time::Duration::from_millis(2));
            }
            look.lock().unwrap().clone()
        });
        let setup = BenchSetup { size: [320.0, 620.0], examine, ..BenchSetup::default() };
        let mut bench = bench("doctor", theme, setup);
        assert!(bench.harness.query_by_label_contains("It checks that there is a board").is_some());
        bench.harness.get_by_label("Examine").click();
        bench.harness.step();
        bench.until_shown(true, "Nothing is wrong");
        assert!(bench.harness.query_by_label("crosstalk: good").is_some());
        let good = bench.harness.render().unwrap();
        *seen.lock().unwrap() = troubled();
        bench.harness.get_by_label("Port").focus();
        bench.harness.step();
        bench.harness.get_by_label("Port").type_text("/dev/ttyACM0");
        bench.harness.step();
        bench.harness.get_by_label("Examine").click();
        bench.harness.step();
        // What was found before stays in view.
        bench.until_shown(true, "listening, 2 of 8 s");
        assert!(bench.harness.query_by_label("crosstalk: good").is_some());
        bench.harness.get_by_label("Stop").click();
        bench.harness.step();
        bench.until_shown(true, "things are wrong");
        bench.until_shown(true, "then stopped");
        assert!(bench.harness.query_by_label("lines: WRONG").is_some());
        let wrong = bench.harness.render().unwrap();
        bench.harness.get_by_label("Copy the command for modem-manager").click();
        bench.harness.step();
        let copied = bench.harness.output().platform_output.commands.iter().any(|command| match command {
            egui::OutputCommand::CopyText(text) => text.contains("77-palpate.rules"),
            _ => false,
        });
        assert!(copied, "{:?}", bench.harness.output().platform_output.commands);
        [good, wrong]
    });
    for (name, [dark, light]) in ["doctor_good", "doctor_wrong"].into_iter().zip(pairs(dark, light)) {
        compare(name, &side_by_side(&dark, &light), "the CPU renderer of the tests");
    }
}
