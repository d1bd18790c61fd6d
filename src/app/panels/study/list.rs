//! List of the studies: state of each; the chosen one with its purpose, its cost, and the buttons that run and stop it.

use crate::app::actions::Actions;
use crate::app::features::studies::Studies;
use crate::app::theme::{self, accented, colour};
use crate::app::widgets::{command_ui, failure_ui, just_opened, progress_ui, put_line, wrapped};
use egui::{Align2, Button, FontId, Id, RichText, ScrollArea, Sense, Ui, vec2};
use palpate_geometry::palette::{Rgb, ThemeColours};
use palpate_geometry::units::capital;
use palpate_lab::workers::JobProgress;
use palpate_store::Store;
use palpate_study::jobs::{StudyFiles, StudyOrigin, StudyRequest, has_other_units};
use palpate_study::paper::paper_study;
use palpate_study::{StudyCard, StudySize, all_studies};

/// Height of a row (points).
const ROW: f32 = 40.0;

pub(in crate::app::panels) fn ui(ui: &mut Ui, studies: &Studies, actions: &mut Actions) {
    if just_opened(ui, "studies") {
        actions.push(|app| app.studies.look());
    }
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        for study in all_studies() {
            let card = study.card();
            let chosen = card.key == studies.chosen().card().key;
            row_ui(ui, studies, &card, chosen, actions);
            if chosen {
                ui.indent(card.key, |ui| chosen_ui(ui, studies, &card, actions));
            }
        }
        ui.add_space(6.0);
        let all = ui.button("Run all, quick").on_hover_text("Run the quick form of all studies, one after the other");
        if all.clicked() {
            for study in all_studies() {
                run(study.card().key, StudySize::Quick, false, actions);
            }
        }
    });
}

fn run(key: &str, size: StudySize, anew: bool, actions: &mut Actions) {
    let request = StudyRequest { key: key.to_owned(), size, anew };
    actions.push(|app| app.run_study(request));
}

fn row_ui(ui: &mut Ui, studies: &Studies, card: &StudyCard, chosen: bool, actions: &mut Actions) {
    let colours = theme::of(ui).colours();
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
    let (state, ink) = state(studies, card.key, &colours);
    let label = format!("{}, {}: {state}", card.title, card.paper);
    response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, chosen, &label));
    if chosen || response.hovered() || response.has_focus() {
        let share = if chosen { 0.30 } else { 0.10 };
        ui.painter().rect_filled(rect, 4.0, colour(colours.background.mix(colours.accent, share)));
    }
    let inner = rect.shrink2(vec2(6.0, 4.0));
    let painter = ui.painter_at(inner);
    let small = FontId::proportional(11.5);
    let quiet = if chosen { colours.text } else { colours.quiet_text };
    put_line(ui, inner, Align2::LEFT_TOP, card.title, 13.5, colour(colours.text));
    let ink = colour(if chosen { colours.text } else { ink });
    let left = put_line(ui, inner, Align2::LEFT_BOTTOM, &state, 11.5, ink) + 8.0;
    // The state of a study that runs may need the line.
    let paper = painter.layout_no_wrap(card.paper.to_owned(), small, colour(quiet));
    let corner = inner.right_bottom() - paper.size();
    if corner.x > left {
        painter.galley(corner, paper, colour(quiet));
    }
    if response.on_hover_text(capital(card.about)).clicked() {
        let key = card.key;
        actions.push(|app| app.studies.choose(key));
    }
}

/// Progress of a study, while it runs.
fn progress(studies: &Studies, key: &str) -> Option<JobProgress> {
    let JobProgress { share, words } = studies.running().filter(|running| running.command.key == key)?.progress;
    let words = if words.is_empty() { "begins …".to_owned() } else { words };
    Some(JobProgress { share, words })
}

/// State of a study in a few words.
fn state(studies: &Studies, key: &str, colours: &ThemeColours) -> (String, Rgb) {
    if let Some(progress) = progress(studies, key) {
        return (progress.words, colours.accent);
    }
    if studies.waits(key) {
        return ("queued".to_owned(), colours.accent);
    }
    if studies.failed(key).is_some() {
        return ("failed".to_owned(), colours.error);
    }
    let Some(StudyFiles { results, begun, .. }) = studies.files(key) else {
        return ("…".to_owned(), colours.quiet_text);
    };
    let stopped = if begun.is_empty() { "" } else { "; your run is paused" };
    let text = match results.first() {
        None if !begun.is_empty() => return ("stopped, can be resumed".to_owned(), colours.warning),
        None => return ("not run".to_owned(), colours.quiet_text),
        Some(result) => match result.origin {
            StudyOrigin::Run(StudySize::Full) => "run in full",
            StudyOrigin::Run(StudySize::Quick) => "quick run done",
            StudyOrigin::Run(StudySize::Sample { .. }) => "sample run",
            StudyOrigin::Shipped => "shipped result",
        },
    };
    (format!("{text}{stopped}"), colours.quiet_text)
}

/// Purpose and cost of the chosen study, and its buttons.
fn chosen_ui(ui: &mut Ui, studies: &Studies, card: &StudyCard, actions: &mut Actions) {
    let key = card.key;
    wrapped(ui, RichText::new(format!("{}.", capital(card.about))));
    let kept = if paper_study(key).is_some() {
        "Beside it, grasps that the store lacks are simulated and kept there."
    } else {
        "Its grasps are not kept."
    };
    let cost = format!("In full: {}. Quick: fewer grasps, not to be quoted. {kept}", card.cost());
    wrapped(ui, RichText::new(cost).small().weak());
    let running = progress(studies, key);
    let busy = running.is_some() || studies.waits(key);
    ui.horizontal_wrapped(|ui| {
        let begun = |size: StudySize| studies.files(key).is_some_and(|files| files.begun.contains(&size));
        for (size, title, shortcut) in
            [(StudySize::Quick, "Run quick", "Enter"), (StudySize::Full, "Run in full", "Shift+Enter")]
        {
            let text = if begun(size) { title.replace("Run", "Resume") } else { title.to_owned() };
            let mut button = Button::new(text);
            if size == StudySize::Quick {
                button = button.fill(accented(theme::of(ui)));
            }
            if ui.add_enabled(!busy, button).on_hover_text(format!("{title} ({shortcut})")).clicked() {
                run(key, size, false, actions);
            }
        }
    });
    if let Some(JobProgress { share, words }) = &running {
        progress_ui(ui, *share, &format!("{:.0} %", 100.0 * share));
        wrapped(ui, RichText::new(words).small().weak());
    }
    // Below the others: a second click on it must start nothing.
    if busy {
        let (title, hint) = match running.is_some() {
            true => ("Stop study", "Stop this study and those that wait (Delete). Finished parts stay."),
            false => ("Do not run it", "Take it out of the queue; the others go on."),
        };
        let stop = ui.button(title).on_hover_text(hint);
        if just_begun(ui, key) {
            stop.scroll_to_me(None);
        }
        let runs = running.is_some();
        actions.on(&stop, move |app| if runs { app.studies.stop() } else { app.studies.withdraw(key) });
    } else {
        ui.data_mut(|data| data.remove::<bool>(Id::unique(("begun", key))));
    }
    if let Some((size, cause)) = studies.failed(key).filter(|_| running.is_none()) {
        failure_ui(ui, cause);
        if has_other_units(cause)
            && ui.button("Begin anew").on_hover_text("Forget the finished parts and run the study again").clicked()
        {
            run(key, *size, true, actions);
        }
    }
    for cause in studies.files(key).into_iter().flat_map(|files| &files.unreadable) {
        failure_ui(ui, cause);
    }
    ui.collapsing("In the terminal", |ui| command_ui(ui, "this study", &command(studies, card)));
    ui.add_space(4.0);
}

/// True once in each run.
fn just_begun(ui: &Ui, key: &str) -> bool {
    let id = Id::unique(("begun", key));
    let before: Option<bool> = ui.data(|data| data.get_temp(id));
    ui.data_mut(|data| data.insert_temp(id, true));
    before.is_none()
}

/// Command that runs the study in the same files.
fn command(studies: &Studies, card: &StudyCard) -> String {
    let store = studies.store();
    let folder = StudySize::Quick.folder(store);
    let own = if store == Store::default_path() { String::new() } else { format!(" --store \"{}\"", store.display()) };
    format!("palpate study {} --quick{own} --out \"{}\"", card.key, folder.path().display())
}
