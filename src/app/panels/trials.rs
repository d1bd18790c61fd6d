//! Trials of the real gripper, newest first: sparkline, label, flags, and disagreement of the model.

use crate::app::actions::Actions;
use crate::app::features::labelling::LabellingFeature;
use crate::app::theme::{self, colour};
use crate::app::widgets::{LEAST_COUNTS, put_line, selectable_row, sparkline};
use egui::{Align2, Rect, RichText, ScrollArea, Ui, pos2, vec2};
use palpate_geometry::units::percent;
use palpate_lab::workers::{LabelCommand, LabelView, LabellingAction, TrialFilter};
use palpate_sim::objects::capital_title;
use palpate_store::labels::{LabelledTrial, TrialEdit};
use palpate_tactile::trial::TrialId;

/// Height of a row (points).
const ROW: f32 = 38.0;
/// Width of the sparkline (points).
const PICTURE: f32 = 74.0;

pub(super) fn ui(ui: &mut Ui, labelling: &LabellingFeature, actions: &mut Actions) {
    let Some(view) = &labelling.labels else {
        ui.weak("Reading the store …");
        return;
    };
    let draft = labelling.session.draft();
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        for shown in TrialFilter::ALL {
            let text = format!("{} {}", shown.title(), shown.of(view).len());
            let mut chip = ui.selectable_label(draft.filter == shown, RichText::new(text).small());
            if shown == TrialFilter::Disagreeing {
                chip = chip.on_hover_text("Label and model differ, and nobody has reviewed it");
            }
            actions.on(&chip, move |app| app.label(LabellingAction::Filter(shown)));
        }
    });
    let listed = draft.filter.of(view);
    if listed.is_empty() {
        let text = match draft.filter {
            TrialFilter::Kept if !view.trials.is_empty() => "All trials are discarded.",
            TrialFilter::Kept => "No trials of the real gripper yet: with it connected, R records one.",
            TrialFilter::Disagreeing => "No label is to be reviewed.",
            TrialFilter::Unlabelled | TrialFilter::Flagged | TrialFilter::Discarded => "None.",
        };
        ui.weak(text);
        return;
    }
    let current = draft.trial(view).map(|trial| trial.id);
    let mut list = ScrollArea::vertical().auto_shrink(false);
    if let Some(offset) = scroll_offset(ui, &listed, current) {
        list = list.vertical_scroll_offset(offset);
    }
    let height = ROW - ui.spacing().item_spacing.y;
    list.show_rows(ui, height, listed.len(), |ui, rows| {
        for trial in &listed[rows] {
            row_ui(ui, labelling, view, trial, current == Some(trial.id), actions);
        }
    });
}

/// Scroll offset that shows a newly selected trial in the middle.
fn scroll_offset(ui: &Ui, listed: &[&LabelledTrial], current: Option<TrialId>) -> Option<f32> {
    let seen = ui.scope_id().with("seen");
    let before = ui.data(|data| data.get_temp::<Option<TrialId>>(seen)).flatten();
    if before == current {
        return None;
    }
    ui.data_mut(|data| data.insert_temp(seen, current));
    let place = listed.iter().position(|trial| Some(trial.id) == current)?;
    let above = 0.5 * (ui.available_height() - ROW);
    Some((ROW * place as f32 - above).max(0.0))
}

fn row_ui(
    ui: &mut Ui,
    labelling: &LabellingFeature,
    view: &LabelView,
    trial: &LabelledTrial,
    current: bool,
    actions: &mut Actions,
) {
    let (id, colours) = (trial.id, theme::of(ui).colours());
    let name = trial.object.as_deref().map_or_else(|| "unlabelled".to_owned(), capital_title);
    let height = ROW - ui.spacing().item_spacing.y;
    let (rect, response) = selectable_row(ui, height, current, &format!("Trial {}, {name}", trial.id));
    let picture = Rect::from_min_size(rect.min + vec2(4.0, 4.0), vec2(PICTURE, rect.height() - 8.0));
    sparkline(ui, (&trial.sparkline, LEAST_COUNTS), picture);
    let disagrees = view.disagreements.iter().find(|found| found.id == trial.id);
    let words = Rect::from_min_max(pos2(picture.right() + 8.0, rect.top() + 3.0), rect.max - vec2(4.0, 3.0));
    let ink = if trial.object.is_some() { colours.text } else { colours.warning };
    let mark = if trial.unsure { "?" } else { "" };
    let tags: String = trial.tags.iter().map(|tag| format!("  #{tag}")).collect();
    let title = format!("{}  {name}{mark}{tags}", trial.id);
    put_line(ui, words, Align2::LEFT_TOP, &title, 13.0, colour(ink));
    let blind = labelling.blind && trial.object.is_none();
    let kept = trial.guess.as_ref().filter(|guess| trial.reviewed && trial.object.as_ref() != Some(&guess.class));
    let kept = kept.map(|guess| format!("model: {} {}, label kept", capital_title(&guess.class), percent(guess.p)));
    let (below, ink) = match (trial.discarded, trial.flags.first(), disagrees.filter(|_| !blind)) {
        (true, ..) => ("discarded".to_owned(), colours.error),
        (_, Some(_), _) => {
            let labels: Vec<&str> = trial.flags.iter().map(|flag| flag.flag.label()).collect();
            (labels.join(", "), colours.warning)
        }
        (_, None, Some(found)) => {
            (format!("model: {} {}", capital_title(&found.guess), percent(found.p)), colours.warning)
        }
        (_, None, None) if !trial.complete => ("recording …".to_owned(), colours.quiet_text),
        (_, None, None) => {
            let length = || format!("{:.1} s, {} readings", trial.seconds, trial.samples);
            (kept.unwrap_or_else(length), colours.quiet_text)
        }
    };
    put_line(ui, words, Align2::LEFT_BOTTOM, &below, 11.0, colour(ink));
    let clicked = response.clicked();
    let about = || {
        format!(
            "{}\n{}{}",
            trial.cadence,
            trial.note,
            trial.tags.iter().map(|tag| format!(" #{tag}")).collect::<String>()
        )
    };
    if response.double_clicked() {
        actions.push(move |app| app.open_trial(id));
    }
    response.on_hover_text(about()).context_menu(|ui| {
        if !trial.discarded && ui.button("Inspect").clicked() {
            actions.push(move |app| app.open_trial(id));
        }
        if disagrees.is_some() && ui.button("Label is right").clicked() {
            actions.push(move |app| app.edit_labels(LabelCommand::Reviewed(id)));
        }
        actions.on(&ui.button("Discard"), move |app| app.edit_labels(LabelCommand::Edit(id, TrialEdit::Discard)));
    });
    if clicked {
        actions.push(move |app| app.label(LabellingAction::Select(Some(id))));
    }
}
