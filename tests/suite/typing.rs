//! Text fields keep the keyboard: whole words arrive, and letters are no keys, whatever appears above the field.

use crate::bench::{Bench, BenchSetup};
use crate::cpu_renderer::CpuRenderer;
use crate::inspect::three_trials;
use crate::window::labelled;
use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::Node;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use palpate::app::{ALL_PANELS, Mode, Reach, ViewSource};
use palpate_store::Store;

const TOMATO: [(Key, &str); 6] =
    [(Key::T, "t"), (Key::O, "o"), (Key::M, "m"), (Key::A, "a"), (Key::T, "t"), (Key::O, "o")];

/// A recorded trial, and three simulated ones.
fn trials(store: &mut Store) {
    labelled(store);
    three_trials(store);
}

fn window() -> Bench {
    let setup = BenchSetup { fill: trials, size: [1400.0, 1000.0], ..BenchSetup::default() };
    Bench::new(setup, CpuRenderer::default())
}

/// A key and its text, as a keyboard sends them.
fn strike(bench: &mut Bench, (key, text): (Key, &str)) {
    let modifiers = Modifiers::NONE;
    bench.harness.event(egui::Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers });
    bench.harness.event(egui::Event::Text(text.to_owned()));
}

fn fields(bench: &Bench) -> Vec<Node<'_>> {
    let roles = [Role::TextInput, Role::SearchInput].into_iter();
    roles.flat_map(|role| bench.harness.query_all_by_role(role)).collect()
}

/// Selects the recorded trial: bars and menus about a selection appear.
fn select(bench: &mut Bench) {
    bench.tell(|app| app.library.find(palpate_store::TrialQuery::default()));
    bench.tell(|app| app.library.select(1, Reach::Alone));
    bench.harness.run_steps(3);
}

#[test]
fn a_word_typed_with_a_trial_selected_arrives_whole_in_each_field_of_each_mode() {
    let mut bench = window();
    bench.tell(|app| app.show_panel("library"));
    bench.until_shown(true, "Trial 1, ");
    let mut seen = Vec::new();
    for panel in &ALL_PANELS {
        select(&mut bench);
        bench.tell(|app| app.show_panel(panel.name));
        bench.harness.run_steps(3);
        for place in 0..fields(&bench).len() {
            select(&mut bench);
            let Some(field) = fields(&bench).into_iter().nth(place) else { continue };
            let name = format!("{}: {}", panel.name, field.accesskit_node().label().unwrap_or_default());
            field.focus();
            bench.harness.run_steps(2);
            bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
            bench.harness.step();
            let mode = bench.workbench().view().mode;
            for letter in TOMATO {
                strike(&mut bench, letter);
                // The answer to a letter may be on its way for some frames.
                bench.harness.run_steps(3);
                std::thread::sleep(std::time::Duration::from_millis(5));
                bench.harness.step();
            }
            let focused = fields(&bench).into_iter().find(|field| field.accesskit_node().is_focused());
            assert_eq!(focused.and_then(|field| field.value()).as_deref(), Some("tomato"), "{name}");
            assert_eq!(bench.workbench().view().mode, mode, "{name}");
            bench.harness.key_press(Key::Escape);
            bench.harness.run_steps(2);
            seen.push(name);
        }
    }
    for panel in ["library", "objects", "label", "plan", "calibration", "gripper", "doctor"] {
        assert!(seen.iter().any(|name| name.starts_with(panel)), "no field of the panel {panel}: {seen:?}");
    }
}

#[test]
fn a_word_typed_right_after_slash_goes_to_the_search_field() {
    let mut bench = window();
    bench.tell(|app| app.set_mode(Mode::Inspect));
    bench.until_shown(true, "Trial 1, ");
    for letters_per_frame in [6, 2, 1] {
        select(&mut bench);
        strike(&mut bench, (Key::Slash, "/"));
        for (place, letter) in TOMATO.into_iter().enumerate() {
            if place % letters_per_frame == letters_per_frame - 1 {
                bench.harness.step();
            }
            strike(&mut bench, letter);
        }
        bench.harness.run_steps(3);
        let field = bench.harness.get_by_role_and_label(Role::TextInput, "Search trials");
        assert_eq!(field.value().as_deref(), Some("tomato"), "{letters_per_frame} letters in a frame");
        bench.until_shown(true, "1 of 4 trials");
        bench.harness.key_press(Key::Escape);
        bench.harness.run_steps(2);
    }
    // Presenter mode leaves the trial that was shown as it was.
    for on in [true, false] {
        bench.harness.key_press(Key::F11);
        bench.harness.run_steps(3);
        assert_eq!(bench.workbench().view().source == ViewSource::Trial, !on);
    }
    // A mode opens from within a text field, too.
    strike(&mut bench, (Key::Slash, "/"));
    bench.harness.run_steps(2);
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Num1);
    bench.harness.run_steps(2);
    assert_eq!(bench.workbench().view().mode, Mode::Demo);
}
