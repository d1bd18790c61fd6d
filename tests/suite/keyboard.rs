//! The window without a mouse: Tab reaches every control, and keys belong to the widget that has the keyboard.

use crate::bench::{Bench, BenchSetup};
use crate::cpu_renderer::CpuRenderer;
use crate::inspect::three_trials;
use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use palpate::app::Mode;
use std::collections::BTreeSet;

/// Roles of what can be used; splitters are for the mouse, and each has a number or a key beside it.
const USED: [Role; 10] = [
    Role::Button,
    Role::CheckBox,
    Role::RadioButton,
    Role::TextInput,
    Role::SearchInput,
    Role::ComboBox,
    Role::SpinButton,
    Role::Slider,
    Role::Tab,
    Role::Link,
];

fn window() -> Bench {
    let setup = BenchSetup { fill: three_trials, size: [1400.0, 1000.0], ..BenchSetup::default() };
    Bench::new(setup, CpuRenderer::default())
}

/// Name and place of the widget that has the keyboard.
fn focused(bench: &Bench) -> Option<(String, egui::Rect)> {
    let nodes = USED.into_iter().flat_map(|role| bench.harness.query_all_by_role(role));
    let found = nodes.into_iter().find(|node| node.accesskit_node().is_focused())?;
    Some((found.accesskit_node().label().unwrap_or_default(), found.rect()))
}

#[test]
fn tab_reaches_every_control_of_each_mode() {
    let mut bench = window();
    for mode in [Mode::Demo, Mode::Inspect, Mode::Label, Mode::Study] {
        bench.tell(|app| app.set_mode(mode));
        // What the store and the results fill has come.
        match mode {
            Mode::Inspect => bench.until_shown(true, "Trial 1, "),
            Mode::Study => bench.until_shown(true, "shipped result"),
            Mode::Demo | Mode::Label => {}
        }
        bench.harness.run_steps(8);
        let usable = |bench: &Bench| -> BTreeSet<String> {
            let nodes = USED.into_iter().flat_map(|role| bench.harness.query_all_by_role(role));
            let able = nodes.filter(|node| !node.accesskit_node().is_disabled());
            able.filter_map(|node| node.accesskit_node().label()).collect()
        };
        let wanted = usable(&bench);
        assert!(wanted.len() > 15, "{mode:?}: {wanted:?}");
        let (mut reached, mut bar) = (BTreeSet::new(), Vec::new());
        for _ in 0..400 {
            bench.harness.key_press(Key::Tab);
            bench.harness.step();
            let Some((name, place)) = focused(&bench) else { continue };
            // The bar above the panels is walked through once.
            if place.center().y < 40.0 && reached.insert(name.clone()) {
                bar.push(place.left());
            }
            reached.insert(name);
            if wanted.iter().all(|name| reached.contains(name)) {
                break;
            }
        }
        let missed: Vec<&String> = wanted.iter().filter(|name| !reached.contains(*name)).collect();
        assert!(missed.is_empty(), "{mode:?}: Tab does not reach {missed:?}");
        assert!(bar.windows(2).all(|pair| pair[0] < pair[1]), "{mode:?}: Tab jumps in the upper bar: {bar:?}");
        bench.harness.key_press(Key::Escape);
        bench.harness.run_steps(2);
    }
}

#[test]
fn keys_belong_to_the_widget_that_has_the_keyboard() {
    let mut bench = window();
    bench.harness.get_by_role_and_label(Role::Button, "Theme").focus();
    bench.harness.run_steps(2);
    assert_eq!(focused(&bench).map(|(name, _)| name).as_deref(), Some("Theme"));
    bench.harness.key_press(Key::Space);
    bench.harness.run_steps(2);
    assert_eq!(bench.workbench().view().theme.name(), "light");
    assert!(!bench.workbench().snapshot().is_some_and(|now| now.status.playing), "the grasp does not begin");
    bench.harness.key_press(Key::Enter);
    bench.harness.run_steps(2);
    assert_eq!(bench.workbench().view().theme.name(), "dark");
    assert!(!bench.workbench().messages().iter().any(|text| text.starts_with("Enter")));
    // Without a focus they act on the grasp again.
    bench.harness.key_press(Key::Escape);
    bench.harness.run_steps(2);
    bench.harness.key_press(Key::Space);
    bench.until(|now| now.status.playing);
}

#[test]
fn escape_closes_what_is_topmost() {
    let mut bench = window();
    bench.harness.get_by_role_and_label(Role::Button, "Menu").click();
    bench.harness.run_steps(3);
    bench.harness.get_by_label_contains("Manual").click();
    bench.harness.run_steps(3);
    assert!(bench.workbench().view().manual_shown);
    bench.harness.key_press(Key::F1);
    bench.harness.run_steps(2);
    bench.harness.key_press(Key::Escape);
    bench.harness.run_steps(2);
    assert!(!bench.workbench().view().keys_shown && bench.workbench().view().manual_shown);
    bench.harness.key_press_modifiers(Modifiers::NONE, Key::Escape);
    bench.harness.run_steps(2);
    assert!(!bench.workbench().view().manual_shown);
}
