//! Trials that are compared with the one shown: their colours, their origin of time, and whether each or the mean of its
//! class is drawn.

use crate::app::actions::Actions;
use crate::app::features::view::ViewSource;
use crate::app::icons::{self, Icon};
use crate::app::shown::{DisplayedData, Pinned};
use crate::app::theme::colour;
use crate::app::widgets::{choice_ui, remark_ui};
use egui::{Color32, Grid, Label, RichText, ScrollArea, Sense, TextStyle, Ui, vec2};
use palpate_geometry::palette::series_colour;
use palpate_geometry::units::{difference, number, read_in, shown as with_unit, symbol};
use palpate_lab::inspection::{Alignment, OpenTrial, TouchPhase};
use palpate_sim::gripper::Side;
use palpate_tactile::trial::TrialId;

pub(super) fn ui(ui: &mut Ui, data: &DisplayedData<'_>, actions: &mut Actions) {
    let comparison = data.comparison;
    if comparison.pinned.is_empty() {
        remark_ui(ui, "No trial is compared. Select trials in the library and press P.");
        return;
    }
    // A bar below the rows, not over one.
    ui.spacing_mut().scroll = egui::style::ScrollStyle::solid();
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 2.0;
        let own = data.shown_trial().map(|own| own.trial.id);
        let own = comparison.pinned.iter().find(|pinned| Some(pinned.trial.id) == own).map(|pinned| pinned.trial.id);
        let remove_ui = |ui: &mut Ui, id: TrialId, actions: &mut Actions| {
            let remove = format!("Remove trial {id} from the comparison");
            actions.on(&icons::button(ui, Icon::Cross, &remove, &remove), move |app| app.inspect.unpin(id));
        };
        if let Some(shown) = shown_name(data) {
            ui.horizontal(|ui| {
                own.into_iter().for_each(|id| remove_ui(ui, id, actions));
                stroke_ui(ui, colour(data.view.theme.colours().text));
                ui.add(Label::new(shown).truncate());
            });
        }
        if comparison.spread {
            for class in comparison.traces {
                row_ui(ui, data, class.colour, &class.name);
            }
            ui.separator();
        }
        // The one that is shown stands above.
        for pinned in comparison.pinned.iter().filter(|pinned| Some(pinned.trial.id) != own) {
            let (id, trial) = (pinned.trial.id, &pinned.trial);
            ui.horizontal(|ui| {
                let colour = if comparison.spread { None } else { Some(pinned.colour) };
                remove_ui(ui, id, actions);
                if let Some(colour) = colour {
                    stroke_ui(ui, ink_of(data, colour));
                }
                let name = format!("{}, trial {}, {}", trial.title, trial.id, trial.source_title());
                let short = format!("Trial {}: {}", trial.id, trial.title);
                let link = ui.add(Label::new(short).truncate().sense(Sense::click()));
                link.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &name));
                actions.on(&link.on_hover_text(format!("{name}. Click to open it")), move |app| app.open_trial(id));
            });
            let shows_counts = data.shown_trial().is_some_and(|shown| shown.trial.has_counts_alone());
            if trial.has_counts_alone() && !shows_counts {
                ui.label(RichText::new("Not calibrated: no values to compare").small().weak());
            }
        }
        options_ui(ui, data, actions);
        hold_ui(ui, data);
        if comparison.pinned.len() > 1 && ui.button("Remove all").clicked() {
            actions.push(|app| app.inspect.unpin_all());
        }
    });
}

/// Origin of time, and whether trials or classes are drawn.
fn options_ui(ui: &mut Ui, data: &DisplayedData<'_>, actions: &mut Actions) {
    let comparison = data.comparison;
    ui.horizontal_wrapped(|ui| {
        ui.label("Aligned at");
        let choices = Alignment::ALL.map(|alignment| (alignment, alignment.name(), "Origin of time (M)"));
        if let Some(alignment) = choice_ui(ui, Some(comparison.alignment), choices) {
            actions.push(move |app| app.inspect.alignment = alignment);
        }
    });
    let mut spread = comparison.spread;
    let hint = "Draw the mean of each class, and its spread as a band, in place of each trial (S)";
    if ui.checkbox(&mut spread, "Mean and spread by class").on_hover_text(hint).changed() {
        actions.push(move |app| app.inspect.spread = spread);
    }
}

/// Width below which the table of the hold has short names (points).
const NARROW: f32 = 260.0;

/// Means over the hold, channel by channel: of the trial shown, and of those compared with the difference to it.
fn hold_ui(ui: &mut Ui, data: &DisplayedData<'_>) {
    let Some(shown) = data.inspected.filter(|_| data.source == ViewSource::Trial).map(|own| own.trial) else { return };
    let pinned = data.comparison.pinned.iter().filter(|pinned| pinned.trial.id != shown.id);
    let pinned: Vec<&Pinned> = pinned.collect();
    ui.separator();
    ui.strong("Mean in the hold, and difference to the trial shown");
    let table = Grid::new("hold").num_columns(2 + pinned.len()).spacing([8.0, 2.0]);
    let narrow = ui.available_width() < NARROW;
    let table_ui = |ui: &mut Ui| {
        // Small letters, so that several trials have room.
        ui.style_mut().override_text_style = Some(TextStyle::Small);
        ui.weak("");
        ui.weak(shown.id.to_string());
        for own in &pinned {
            ui.label(RichText::new(own.trial.id.to_string()).color(ink_of(data, own.colour)).strong());
        }
        ui.end_row();
        let counts = shown.has_counts_alone();
        for column in shown.columns.iter().filter(|column| column.channel.is_none() == counts) {
            let (unit, factor) = read_in(column.unit);
            let mean = |trial: &OpenTrial| Some(trial.hold_mean(&column.name)? * factor);
            let name = column.name.replace('_', " ");
            let short = name.replace(" left", " L").replace(" right", " R");
            values_ui(ui, narrow, [&name, &short], unit, mean(shown), pinned.iter().map(|own| mean(&own.trial)));
        }
        for side in Side::BOTH {
            let touched = |trial: &OpenTrial| {
                let closing = trial.phase_from(TouchPhase::PreShaping).or(trial.phase_from(TouchPhase::Contact));
                Some(trial.touched_s[side.index()]? - closing?)
            };
            let name = format!("closing to contact, {}", side.name());
            let short = format!("contact {}", &side.name()[..1].to_uppercase());
            values_ui(ui, narrow, [&name, &short], "s", touched(shown), pinned.iter().map(|own| touched(&own.trial)));
        }
    };
    ScrollArea::horizontal().show(ui, |ui| table.show(ui, table_ui));
}

/// A row of the table, where the trial shown has a value: its own, and those of the others with the differences to it.
fn values_ui(
    ui: &mut Ui,
    narrow: bool,
    [name, short]: [&str; 2],
    unit: &str,
    own: Option<f64>,
    others: impl ExactSizeIterator<Item = Option<f64>>,
) {
    let Some(own) = own else { return };
    match narrow {
        true => ui.weak(short).on_hover_text(name),
        false => ui.weak(format!("{name}, {}", symbol(unit))),
    };
    ui.label(if narrow { with_unit(own, unit) } else { number(own, unit) });
    // A panel has room for both of one trial.
    let both = others.len() == 1 && !narrow;
    for other in others {
        let Some(other) = other else {
            ui.label("–");
            continue;
        };
        let off = difference(other - own, unit);
        match both {
            true => ui.label(format!("{} ({off})", number(other, unit))),
            false => ui.label(off).on_hover_text(with_unit(other, unit)),
        };
    }
    ui.end_row();
}

/// Name of the trial or gripper shown.
fn shown_name(data: &DisplayedData<'_>) -> Option<String> {
    match data.source {
        ViewSource::Trial => data.inspected.map(|own| format!("Trial {}, shown: {}", own.trial.id, own.trial.title)),
        ViewSource::Simulation => Some("Simulation, live".to_owned()),
        ViewSource::Gripper => Some("Real gripper, live".to_owned()),
    }
}

fn row_ui(ui: &mut Ui, data: &DisplayedData<'_>, ink: usize, name: &str) {
    ui.horizontal(|ui| {
        stroke_ui(ui, ink_of(data, ink));
        ui.add(Label::new(name).truncate());
    });
}

fn ink_of(data: &DisplayedData<'_>, ink: usize) -> Color32 {
    colour(series_colour(ink, data.view.theme))
}

/// A stroke in the colour of a trial's curves.
fn stroke_ui(ui: &mut Ui, ink: Color32) {
    let (rect, _) = ui.allocate_exact_size(vec2(18.0, 12.0), Sense::hover());
    ui.painter().hline(rect.x_range(), rect.center().y, egui::Stroke::new(3.0, ink));
}
