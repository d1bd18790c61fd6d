//! Tactile signatures as pictures in the window: pads unrolled, joints and taxel rows over time, the contact path.

use crate::bench::{Bench, BenchSetup};
use crate::cpu_renderer::CpuRenderer;
use egui::Key;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use palpate::app::{ALL_PANELS, PathLayer};
use palpate_geometry::palette::Theme;
use palpate_lab::picture::{BendUnit, LoadUnit};

fn panel(name: &str, theme: Theme, size: [f32; 2]) -> Bench {
    let panel = ALL_PANELS.iter().find(|panel| panel.name == name);
    assert!(panel.is_some(), "{name}");
    Bench::new(BenchSetup { theme, size, panel, ..BenchSetup::default() }, CpuRenderer::default())
}

#[test]
fn a_click_in_a_heat_map_over_time_moves_the_cursor() {
    let mut bench = panel("signature", Theme::Dark, [700.0, 420.0]);
    bench.until_shown(true, "Start a grasp");
    bench.advance_to(2.6);
    bench.until_shown(true, "cursor at 2.6");
    for (map, shown) in
        [("Joint angle over time, left finger", "2.00"), ("Row pressure over time, right finger", "2.00")]
    {
        bench.harness.get_by_label_contains(map).click();
        bench.until_shown(true, &format!("cursor at {shown}\u{a0}s"));
    }
}

#[test]
fn units_are_switched() {
    let mut bench = panel("signature", Theme::Light, [280.0, 300.0]);
    bench.advance_to(1.0);
    for (unit, map) in [("N", "Row force over time"), ("m\u{207b}\u{b9}", "Joint curvature over time")] {
        bench.harness.get_by_label(unit).click();
        bench.harness.step();
        bench.harness.step();
        assert_eq!(bench.harness.query_all_by_label_contains(map).count(), 2, "{map}");
    }
    let view = bench.workbench().view();
    assert_eq!((view.load_unit, view.bend_unit), (LoadUnit::Force, BendUnit::Curvature));
}

#[test]
fn pads_say_their_force_in_words() {
    let mut bench = panel("pads", Theme::Dark, [280.0, 300.0]);
    let force = |bench: &Bench, side: &str| -> f64 {
        let wanted = format!("{side} pad: ");
        let pad = bench.harness.get_by_label_contains(&wanted);
        let text = pad.accesskit_node().label().expect("a label");
        text.split(": ").nth(1).and_then(|rest| rest.split('\u{a0}').next()).and_then(|n| n.parse().ok()).expect(&text)
    };
    assert_eq!(force(&bench, "left"), 0.0);
    bench.advance_to(2.6);
    let [left, right] = ["left", "right"].map(|side| force(&bench, side));
    assert!(left > 0.3 && (left - right).abs() < 0.1 * left, "{left} and {right}");
    bench.harness.get_by_label("N").click();
    bench.harness.step();
    assert_eq!(bench.workbench().view().load_unit, LoadUnit::Force);
}

#[test]
fn a_key_draws_the_contact_path() {
    let mut bench = Bench::new(BenchSetup::default(), CpuRenderer::default());
    for layer in [PathLayer::Time, PathLayer::Pressure, PathLayer::Off] {
        bench.harness.key_press(Key::C);
        bench.harness.step();
        assert_eq!(bench.workbench().view().path, layer);
    }
}
