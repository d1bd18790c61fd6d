//! Label card: the next object and its pose, the running trial, or the question for a label. Everything on it has a key.

use crate::app::actions::Actions;
use crate::app::features::gripper::instruction;
use crate::app::features::labelling::LabellingFeature;
use crate::app::theme::{self, accented, colour, veil};
use crate::app::thumbnails::Thumbnails;
use crate::app::widgets::{focus_field, remark_ui, selectable_row, text_field, warning_ui, wrapped};
use egui::text_edit::TextEditState;
use egui::{Align, Button, Id, Key, Layout, Rect, RichText, ScrollArea, Sense, Ui, vec2};
use palpate_geometry::units::percent;
use palpate_lab::workers::{
    GripperView, LISTED_OBJECTS, LabelCommand, LabelDraft, LabelView, LabellingAction, NUMBERED_OBJECTS, TrialView,
    parse_tags,
};
use palpate_sim::objects::{capital_title, catalogue};
use palpate_store::Change;
use palpate_store::labels::{LabelledTrial, NextTrial, TrialEdit};

/// Height for objects, note and tags below which objects to choose stand in two columns (points).
const LOW: f32 = 320.0;
/// Side of the picture of an object (points).
const PICTURE: f32 = 72.0;

pub(super) fn ui(
    ui: &mut Ui,
    labelling: &LabellingFeature,
    (gripper, silent_s): (Option<&GripperView>, Option<u64>),
    pictures: &Thumbnails,
    actions: &mut Actions,
) {
    let Some(view) = &labelling.labels else {
        ui.weak("Reading the store …");
        return;
    };
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        let running = gripper.and_then(|gripper| gripper.trial.as_ref());
        let draft = labelling.session.draft();
        let open = draft.trial(view).filter(|trial| trial.object.is_none());
        match (running, draft.trial(view)) {
            (Some(trial), _) if trial.automatic && draft.selected.is_some() && open.is_some() => {
                let text = format!("{} is being recorded automatically: {}", trial.title(), instruction(trial));
                wrapped(ui, RichText::new(text).small().color(colour(theme::of(ui).colours().accent)));
                open.into_iter()
                    .for_each(|asked| question_ui(ui, labelling, pictures, (gripper, view, asked), actions));
            }
            (Some(trial), _) if trial.adapting => adapting_ui(ui, (trial, silent_s)),
            (Some(trial), _) => {
                running_ui(ui, pictures, view, (trial, silent_s));
                answer_ahead_ui(ui, labelling, actions);
            }
            (None, Some(trial)) => question_ui(ui, labelling, pictures, (gripper, view, trial), actions),
            (None, None) => {
                next_ui(ui, gripper, pictures, view, actions);
                answer_ahead_ui(ui, labelling, actions);
            }
        }
    });
}

/// Picture, name and class of an object.
fn object_ui(ui: &mut Ui, pictures: &Thumbnails, name: &str, below: &str) {
    ui.horizontal(|ui| {
        let (rect, _) = ui.allocate_exact_size(vec2(PICTURE, PICTURE), Sense::hover());
        picture(ui, pictures, name, rect);
        ui.vertical(|ui| {
            ui.label(RichText::new(capital_title(name)).size(24.0).strong());
            if let Some(built_in) = catalogue().iter().find(|built_in| built_in.name == name) {
                ui.weak(built_in.class().to_string());
            }
            if !below.is_empty() {
                wrapped(ui, RichText::new(below));
            }
        });
    });
}

fn picture(ui: &Ui, pictures: &Thumbnails, name: &str, place: Rect) {
    match pictures.get(name) {
        Some(texture) => egui::Image::new(texture).corner_radius(4.0).paint_at(ui, place),
        None => {
            let stroke = egui::Stroke::new(1.5, colour(theme::of(ui).colours().border));
            ui.painter().rect_stroke(place.shrink(1.0), 4.0, stroke, egui::StrokeKind::Inside);
        }
    }
}

/// Next object of the plan.
fn next_ui(ui: &mut Ui, gripper: Option<&GripperView>, pictures: &Thumbnails, view: &LabelView, actions: &mut Actions) {
    last_ui(ui, view);
    match &view.next {
        Some(next) => {
            ui.weak("next");
            object_ui(ui, pictures, &next.object, &cue(next));
        }
        None if view.progress.wanted() == 0 => {
            ui.heading("Nothing planned");
            remark_ui(ui, "Add objects in the panel Plan, or record: each trial asks what it was of.");
        }
        None => {
            ui.heading("Plan complete");
            remark_ui(ui, "Export with Ctrl+E, train in the panel Training, or extend the panel Plan.");
        }
    }
    ui.add_space(4.0);
    if gripper.is_some_and(GripperView::is_connected) {
        let button = Button::new("Record  R").fill(accented(theme::of(ui))).min_size(vec2(ui.available_width(), 36.0));
        record_ui(ui, gripper, button, "Record a grasp (R)", actions);
    } else {
        warning_ui(ui, "Connect the gripper: Ctrl+G, or the panel Gripper below.");
    }
}

/// Button that records a grasp, while readings come.
fn record_ui(ui: &mut Ui, gripper: Option<&GripperView>, button: Button<'_>, about: &str, actions: &mut Actions) {
    let why = match gripper.filter(|gripper| gripper.is_connected()) {
        Some(gripper) if gripper.is_silent() => Some("The board sends no readings: is it plugged in?"),
        Some(_) => None,
        None => Some("No gripper is connected (Ctrl+G)"),
    };
    let shown = ui.add_enabled(why.is_none(), button).on_hover_text(about).on_disabled_hover_text(why.unwrap_or(about));
    actions.on(&shown, |app| app.label(LabellingAction::Record));
}

/// Pose of the object, in words.
fn cue(next: &NextTrial) -> String {
    format!("Placement {}: {}", next.number, next.cue.words())
}

fn running_ui(ui: &mut Ui, pictures: &Thumbnails, view: &LabelView, running: (&TrialView, Option<u64>)) {
    stage_ui(ui, running);
    if let Some(next) = &view.next {
        object_ui(ui, pictures, &next.object, &cue(next));
    }
}

/// A close to adapt to holds no object.
fn adapting_ui(ui: &mut Ui, running: (&TrialView, Option<u64>)) {
    ui.strong("Adapting: take everything out of the hand");
    stage_ui(ui, running);
}

/// Instruction, large enough to be read at the control box; without readings there is none.
fn stage_ui(ui: &mut Ui, (trial, silent_s): (&TrialView, Option<u64>)) {
    let colours = theme::of(ui).colours();
    let (text, ink) = match silent_s {
        Some(silent_s) => (format!("No readings for {silent_s}\u{a0}s"), colours.warning),
        None => (instruction(trial).to_owned(), colours.accent),
    };
    ui.label(RichText::new(text).size(26.0).strong().color(colour(ink)));
    if let Some(left_s) = trial.left_s.filter(|_| silent_s.is_none()) {
        ui.label(RichText::new(format!("{left_s:.1} s left")).size(30.0).monospace());
    }
    ui.weak(format!("{}: {} readings", trial.title(), trial.samples));
}

/// Last label that was given, with the model's prediction.
fn last_ui(ui: &mut Ui, view: &LabelView) {
    let mut changes = view.journal.iter().filter(|entry| matches!(entry.change, Change::Label { .. }));
    let is_labelled = |trial: &&LabelledTrial| !trial.discarded && trial.object.is_some();
    let given = changes.find_map(|entry| view.trial(entry.trial?)).filter(is_labelled);
    let last = given.or_else(|| view.trials.iter().find(is_labelled));
    let Some((trial, label)) = last.and_then(|trial| Some((trial, trial.object.as_ref()?))) else { return };
    let (colours, title) = (theme::of(ui).colours(), capital_title(label));
    let (text, ink) = match &trial.guess {
        Some(guess) if guess.class == *label => {
            let agrees = if guess.p < 0.5 { "Also the model's first guess" } else { "The model agrees" };
            (format!("Last label, trial {}: {title}. {agrees} ({})", trial.id, percent(guess.p)), colours.accent)
        }
        Some(guess) => {
            let (class, p) = (capital_title(&guess.class), percent(guess.p));
            let (state, ink) =
                if trial.reviewed { ("label kept", colours.quiet_text) } else { ("please review", colours.warning) };
            (format!("Last label, trial {}: {title}. The model predicts {class} ({p}): {state}", trial.id), ink)
        }
        None => (format!("Last label, trial {}: {title}", trial.id), colours.quiet_text),
    };
    let frame = egui::Frame::new().fill(veil(ink, 0.14)).corner_radius(4).inner_margin(egui::Margin::symmetric(6, 3));
    frame.show(ui, |ui| {
        ui.set_min_width(ui.available_width());
        wrapped(ui, RichText::new(text).small().color(colour(ink)));
        for flag in &trial.flags {
            wrapped(
                ui,
                RichText::new(format!("{}: {}", flag.flag.label(), flag.remark)).small().color(colour(colours.warning)),
            );
        }
    });
}

/// Question for a label.
fn question_ui(
    ui: &mut Ui,
    labelling: &LabellingFeature,
    pictures: &Thumbnails,
    (gripper, view, trial): (Option<&GripperView>, &LabelView, &LabelledTrial),
    actions: &mut Actions,
) {
    let draft = labelling.session.draft();
    let question = match &trial.object {
        Some(label) => format!("Trial {}: labelled {}. Change it?", trial.id, capital_title(label)),
        None => format!("Trial {}: which object?", trial.id),
    };
    ui.label(RichText::new(question).heading().strong());
    wrapped(ui, RichText::new(&trial.cadence).small().weak());
    for flag in &trial.flags {
        let text = format!("{}: {}", flag.flag.label(), flag.remark);
        wrapped(ui, RichText::new(text).small().color(ui.visuals().warn_fg_color));
    }
    search_ui(ui, labelling, actions);
    ui.horizontal_wrapped(|ui| {
        // The list may be lower than the chosen row.
        let label = draft.label(view);
        let text = label.as_deref().map_or("Label".to_owned(), |name| format!("Label {}", capital_title(name)));
        let button = Button::new(format!("{text}  N, Enter")).fill(accented(theme::of(ui)));
        let shown = ui.add_enabled(label.is_some(), button).on_disabled_hover_text("No object is chosen");
        actions.on(&shown, |app| app.label(LabellingAction::GiveLabel));
        record_ui(
            ui,
            gripper,
            Button::new("Record  R"),
            "Record a grasp; a trial without a label is kept (R)",
            actions,
        );
        actions.on(&ui.button("Discard  D"), |app| app.label(LabellingAction::Discard));
        let mut unsure = trial.unsure;
        if ui.checkbox(&mut unsure, "unsure  U").changed() {
            let id = trial.id;
            actions.push(move |app| app.edit_labels(LabelCommand::Edit(id, TrialEdit::Unsure(unsure))));
        }
    });
    let (names, chosen) = (draft.objects(view), draft.place(view));
    if chosen.is_none() {
        ui.weak("Which one? Choose with the arrow keys or the mouse.");
    }
    let shown = names.len().min(LISTED_OBJECTS);
    // In a low panel, tags and note stay in sight below.
    let low = ui.clip_rect().bottom() - ui.cursor().top() < LOW;
    let columns = if low || shown > NUMBERED_OBJECTS { 2 } else { 1 };
    ui.columns(columns, |columns| {
        let rows = shown.div_ceil(columns.len()).max(1);
        columns.iter_mut().for_each(|column| column.spacing_mut().item_spacing.y = 1.0);
        for (place, name) in names.iter().take(shown).enumerate() {
            let known = view.progress.objects.iter().any(|object| object.name == *name) || name == "empty";
            let remark = match known {
                _ if draft.predicted(view) == Some(name.as_str()) => " (predicted)",
                true => "",
                false => " (new)",
            };
            let row = object_row(&mut columns[place / rows], pictures, (place, name), Some(place) == chosen, remark);
            if row.clicked() {
                actions.push(move |app| app.label(LabellingAction::ChooseObject(place)));
                actions.push(|app| app.label(LabellingAction::GiveLabel));
            }
        }
    });
    if names.len() > shown {
        ui.weak(format!("and {} more: type to find them (/)", names.len() - shown));
    }
    remarks_ui(ui, draft, trial, actions);
}

/// Search field before the question, to answer ahead.
fn answer_ahead_ui(ui: &mut Ui, labelling: &LabellingFeature, actions: &mut Actions) {
    let draft = labelling.session.draft();
    if draft.focus_search || !draft.search.is_empty() || ui.memory(|memory| memory.has_focus(search_id())) {
        ui.add_space(4.0);
        search_ui(ui, labelling, actions);
    }
}

fn search_id() -> egui::Id {
    egui::Id::unique("label search")
}

/// Search field for objects.
fn search_ui(ui: &mut Ui, labelling: &LabellingFeature, actions: &mut Actions) {
    let draft = labelling.session.draft();
    let mut search = draft.search.clone();
    let hint = "find or name an object ( / )";
    if draft.focus_search && focus_field(ui, search_id()) {
        actions.push(|app| app.label(LabellingAction::SearchFocused));
    }
    // Ctrl+Z must not bring back what was typed for another trial.
    if search.is_empty()
        && let Some(mut state) = TextEditState::load(ui.ctx(), search_id())
    {
        state.clear_undoer();
        state.store(ui.ctx(), search_id());
    }
    let field = text_field(&mut search, search_id()).hint_text(hint).char_limit(80);
    let response = ui.add(field);
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::SearchInput, true, "Find an object"));
    // Arrows choose among the matches while the cursor stays in the field.
    let step = ui.input(|i| i32::from(i.key_pressed(Key::ArrowDown)) - i32::from(i.key_pressed(Key::ArrowUp)));
    if response.has_focus() && step != 0 {
        let chosen = draft.chosen.or_else(|| labelling.labels.as_ref().and_then(|view| draft.place(view)));
        let next = |chosen: usize| chosen.saturating_add_signed(step as isize).min(LISTED_OBJECTS - 1);
        let place = chosen.map_or(0, next);
        actions.push(move |app| app.label(LabellingAction::ChooseObject(place)));
    }
    if search != draft.search {
        actions.push(|app| app.label(LabellingAction::Search(search)));
    }
    // It may come with the last letter.
    if response.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter)) {
        actions.push(|app| app.label(LabellingAction::GiveLabel));
    }
}

/// Object to choose: key, picture, name.
fn object_row(
    ui: &mut Ui,
    pictures: &Thumbnails,
    (place, name): (usize, &str),
    chosen: bool,
    remark: &str,
) -> egui::Response {
    let colours = theme::of(ui).colours();
    let title = format!("{}{remark}", capital_title(name));
    let (rect, response) = selectable_row(ui, 23.0, chosen, &format!("Label {title}"));
    let builder =
        egui::UiBuilder::new().max_rect(rect.shrink2(vec2(4.0, 1.0))).layout(Layout::left_to_right(Align::Center));
    let mut inside = ui.new_child(builder);
    let key = if place < NUMBERED_OBJECTS { (place + 1).to_string() } else { " ".to_owned() };
    inside.label(RichText::new(key).monospace().color(colour(colours.quiet_text)));
    let (thumbnail, _) = inside.allocate_exact_size(vec2(21.0, 21.0), Sense::hover());
    picture(&inside, pictures, name, thumbnail);
    inside.add(egui::Label::new(title).truncate().selectable(false));
    response
}

/// Note and tags.
fn remarks_ui(ui: &mut Ui, draft: &LabelDraft, trial: &LabelledTrial, actions: &mut Actions) {
    let id = trial.id;
    let own = |written: &Option<(i64, String)>, stored: String| match written {
        Some((id, text)) if *id == trial.id => text.clone(),
        _ => stored,
    };
    egui::Grid::new("remarks").num_columns(2).spacing([8.0, 4.0]).show(ui, |ui| {
        let mut note = own(&draft.note, trial.note.clone());
        let label = ui.label("Note");
        let response = ui.add(text_field(&mut note, Id::unique("note")).char_limit(500)).labelled_by(label.id);
        if response.changed() {
            let note = note.clone();
            actions.push(move |app| app.label(LabellingAction::WriteNote(id, note)));
        }
        if response.lost_focus() && note != trial.note {
            actions.push(move |app| {
                app.edit_labels(LabelCommand::Edit(id, TrialEdit::Note(note)));
                app.notices.info(format!("Note of trial {id} saved."));
            });
        }
        ui.end_row();
        let mut tags = own(&draft.tags, trial.tags.join(", "));
        let label = ui.label("Tags");
        let field = text_field(&mut tags, Id::unique("tags")).hint_text("separated by commas").char_limit(200);
        let response = ui.add(field).labelled_by(label.id);
        if response.changed() {
            let tags = tags.clone();
            actions.push(move |app| app.label(LabellingAction::WriteTags(id, tags)));
        }
        let list = parse_tags(&tags);
        if response.lost_focus() && list != trial.tags {
            actions.push(move |app| {
                app.edit_labels(LabelCommand::Edit(id, TrialEdit::Tags(list)));
                app.notices.info(format!("Tags of trial {id} saved."));
            });
        }
        ui.end_row();
    });
}
