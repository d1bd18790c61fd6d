//! A lesson: its progress while it runs, and its result with what can be done about it.

use super::Measures;
use crate::app::actions::Actions;
use crate::app::features::App;
use crate::app::features::recognition::{Learned, name_id};
use crate::app::features::tools::GripperTools;
use crate::app::theme::{self, colour, veil};
use crate::app::widgets::{capital, progress_ui, text_field};
use egui::{Label, RichText, Ui};
use palpate_geometry::units::SPACE;
use palpate_lab::grasping::{is_doubtful, lesson_result, lesson_warning};
use palpate_learn::Labels;
use palpate_sim::objects::capital_title;

/// A lesson that is running, with its progress, or the last one, with its result: the object is known from now on.
pub(super) fn ui(
    ui: &mut Ui,
    tools: &GripperTools,
    learned: Option<&Learned>,
    labels: Option<&Labels>,
    measures: &Measures,
    actions: &mut Actions,
) {
    let (running, good) = (tools.teaching.running(), theme::of(ui).colours().good);
    if running.is_none() && learned.is_none() {
        return;
    }
    let frame = egui::Frame::new().fill(veil(good, 0.14)).corner_radius(4).inner_margin(egui::Margin::symmetric(8, 5));
    frame.show(ui, |ui| {
        ui.set_min_width(ui.available_width());
        ui.spacing_mut().item_spacing.y = 3.0;
        if let Some(progress) = running.map(|running| running.progress) {
            ui.horizontal(|ui| {
                actions.on(&ui.button("Stop").on_hover_text("Cancel"), App::stop_teaching);
                let waiting = tools.teaching.waiting();
                let next: Vec<String> = waiting.iter().map(|next| capital_title(&next.name)).collect();
                let next = if next.is_empty() { String::new() } else { format!("; then {}", next.join(", ")) };
                let text = format!("{:.0}{SPACE}%  {}{next}", 100.0 * progress.share, progress.words);
                progress_ui(ui, progress.share, &text);
            });
        } else if let Some(learned) = learned {
            let warning = learned.lesson.as_ref().and_then(lesson_warning);
            let amber = colour(theme::of(ui).colours().warning);
            // Classes need the height: in a small window the warning stands for all that is said.
            let warned_above = measures.is_tight() && warning.is_some();
            if let Some(warning) = warning.as_ref().filter(|_| warned_above) {
                let text = format!("{}, {warning}.", capital_title(&learned.name));
                ui.add(Label::new(RichText::new(text).color(amber)).truncate());
            }
            ui.horizontal_wrapped(|ui| {
                let title = capital_title(&learned.name);
                let ink = if warning.is_some() { amber } else { colour(good) };
                let poorly = if learned.lesson.as_ref().is_some_and(is_doubtful) { " poorly" } else { "" };
                let told = RichText::new(format!("Learned {title}{poorly}")).strong().color(ink);
                if !warned_above {
                    ui.label(if measures.is_tight() { told } else { told.heading() });
                }
                if let Some(lesson) = learned.lesson.as_ref().filter(|_| !warned_above) {
                    let time = learned.seconds.map_or_else(String::new, |seconds| format!(" in {seconds:.0}\u{a0}s"));
                    let text = format!("from {} simulated grasps{time}: {}.", lesson.grasps, lesson_result(lesson));
                    if measures.is_tight() {
                        let right = lesson.after_three.unwrap_or(lesson.recognised);
                        let right = format!("{right}\u{a0}of\u{a0}{}\u{a0}right", lesson.tested);
                        ui.label(right).on_hover_text(text);
                    } else {
                        ui.label(text);
                    }
                }
                if labels.is_some_and(|labels| labels.classes.iter().all(|class| class.name != learned.name)) {
                    ui.label("The model that answers here has not learned it.");
                }
                let id = name_id();
                if let Some(name) = ui.data(|data| data.get_temp::<String>(id)) {
                    return rename_ui(ui, id, name, actions);
                }
                let hint = "Use the model without this object again";
                actions.on(&ui.small_button("Forget").on_hover_text(hint), App::forget_learned);
                if ui.small_button("Rename").on_hover_text("Give it another name").clicked() {
                    ui.data_mut(|data| data.insert_temp(id, title));
                    ui.memory_mut(|memory| memory.request_focus(id.with("field")));
                }
                actions.on(&ui.small_button("Dismiss"), App::dismiss_learned);
            });
            if let Some(warning) = warning.filter(|_| !warned_above) {
                ui.add(Label::new(RichText::new(format!("{}.", capital(&warning))).color(amber)));
            }
        }
    });
}

/// Field for another name; its text is kept under `id` while it is open.
fn rename_ui(ui: &mut Ui, id: egui::Id, mut name: String, actions: &mut Actions) {
    let field = ui.add(text_field(&mut name, id.with("field")).desired_width(120.0));
    field.widget_info(|| egui::WidgetInfo::labeled(egui::Role::TextInput, true, "Name of the object"));
    let enter = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
    let [save, cancel] = ["Save", "Cancel"].map(|text| ui.small_button(text).clicked());
    if save || enter || cancel {
        ui.data_mut(|data| data.remove::<String>(id));
    } else {
        ui.data_mut(|data| data.insert_temp(id, name.clone()));
    }
    if save || enter {
        actions.push(move |app| app.rename_learned(&name));
    }
}
