//! Training on labelled trials: trials of each object, method, result on held-back trials, and the model in use for the
//! real gripper.

use crate::app::actions::Actions;
use crate::app::features::App;
use crate::app::features::tools::{DEFAULT_METHOD, GripperTools, TRAINING_SEED};
use crate::app::features::view::ViewState;
use crate::app::theme::{self, colour};
use crate::app::widgets::{failure_ui, job_ui, just_opened, remark_ui, warning_ui, wrapped};
use egui::{Align2, Button, ComboBox, FontId, Rect, RichText, ScrollArea, Sense, Ui, vec2};
use palpate_geometry::palette::{Rgb, Theme};
use palpate_geometry::units::SPACE;
use palpate_lab::datasets::{HELD_BACK, LEAST_TRIALS, LabelledClass};
use palpate_lab::workers::{FinishedTraining, TrainRequest, TrainingData};
use palpate_learn::comparison::in_table_order;
use palpate_learn::metrics::Confusion;
use palpate_learn::{Labels, Model, counted, method};
use palpate_sim::objects::{capital_title, titled};
use std::path::{Path, PathBuf};

pub(super) fn ui(ui: &mut Ui, tools: &GripperTools, model: Option<&Model>, view: &ViewState, actions: &mut Actions) {
    let chosen = view.gripper_model.as_deref();
    if just_opened(ui, "training") {
        actions.push(|app| _ = app.tools.data.start(()));
    }
    let data = tools.data.outcome();
    let data = data.as_deref();
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        let controls = |ui: &mut Ui, actions: &mut Actions| begin_ui(ui, data, actions);
        let stop = (None, "Cancel; nothing is saved", (|app| app.tools.training.stop()) as fn(&mut App));
        match job_ui(ui, &tools.training, stop, actions, controls) {
            Some(Ok(finished)) => finished_ui(ui, chosen, &finished, actions),
            // Too few trials are said above.
            Some(Err(_)) if data.is_some_and(|data| data.too_little().is_some()) => {}
            Some(Err(cause)) => failure_ui(ui, cause),
            None => {}
        }
        match data.map(|data| &data.classes) {
            Some(Ok(classes)) => classes_ui(ui, model, classes, actions),
            Some(Err(cause)) => failure_ui(ui, cause),
            None => remark_ui(ui, "loading labelled trials …"),
        }
        models_ui(ui, view, data, actions);
    });
}

/// Method, and the button that starts.
fn begin_ui(ui: &mut Ui, data: Option<&TrainingData>, actions: &mut Actions) {
    let id = egui::Id::unique("training method");
    let mut chosen = ui.data_mut(|data| data.get_temp::<String>(id)).unwrap_or_else(|| DEFAULT_METHOD.to_owned());
    let title = method(&chosen).map_or("", |method| method.title);
    let too_little = data.and_then(TrainingData::too_little);
    ui.horizontal_wrapped(|ui| {
        let label = ui.label("Method");
        let combo = ComboBox::from_id_salt("training method").width(150.0).height(520.0).selected_text(title);
        let shown = combo.show_ui(ui, |ui| {
            for method in in_table_order() {
                ui.selectable_value(&mut chosen, method.key.to_owned(), method.title).on_hover_text(method.about);
            }
        });
        let about = method(&chosen).map_or("", |method| method.about);
        shown.response.labelled_by(label.id).on_hover_text(about);
        let ready = data.is_some_and(|data| data.classes.is_ok()) && too_little.is_none();
        let train = ui
            .add_enabled(ready, Button::new("Train"))
            .on_hover_text("Train on all labelled trials of the real gripper");
        if train.on_disabled_hover_text(too_little.as_deref().unwrap_or_default()).clicked() {
            let request = TrainRequest { method: chosen.clone(), seed: TRAINING_SEED, quick: false };
            actions.push(|app| _ = app.tools.training.start(request));
        }
    });
    let share = 100.0 * HELD_BACK;
    remark_ui(ui, format!("{share:.0}{SPACE}% of each object's trials are held back for evaluation."));
    if let Some(why) = too_little {
        warning_ui(ui, why);
    }
    ui.data_mut(|data| data.insert_temp(id, chosen));
}

/// Fewer test trials tell nothing: with ten, all right, the true share of right answers is still anywhere above 69 %.
const FEW_TESTED: usize = 10;

fn finished_ui(ui: &mut Ui, chosen: Option<&Path>, finished: &FinishedTraining, actions: &mut Actions) {
    let FinishedTraining { trained, judged } = finished;
    let [low, high] = judged.evaluation.ci95;
    ui.add_space(6.0);
    let f1 = judged.evaluation.f1_macro;
    let [learned, held_back] = judged.trials;
    let title = method(&trained.model.card.method).map_or("", |method| method.title);
    let about = format!("{title}: trained on {learned} trials, evaluated on {held_back} others");
    if held_back < FEW_TESTED {
        wrapped(ui, RichText::new(format!("Macro F1 {f1:.2}")).heading());
        warning_ui(ui, format!("{about}: too few to tell how good it is"));
    } else {
        wrapped(ui, RichText::new(format!("Macro F1 {f1:.2} ({low:.2} to {high:.2})")).heading());
        remark_ui(ui, format!("{about}; 95 % interval"));
    }
    for class in &judged.too_few {
        let trials = if class.trials == 1 { "trial" } else { "trials" };
        let title = capital_title(&class.name);
        let text = format!("\"{title}\" left out: {} usable {trials}, {LEAST_TRIALS} needed", class.trials);
        warning_ui(ui, text);
    }
    let data = &trained.model.card.data;
    if data.left_out > 0 {
        let text = format!("{} trials left out: {}", data.left_out, counted(&data.left_out_for));
        warning_ui(ui, text);
    }
    for mixed in &data.mixed {
        warning_ui(ui, format!("Mixed {mixed}"));
    }
    judged.leak_checks.iter().filter(|check| check.leaks).for_each(|check| warning_ui(ui, check.to_string()));
    if trained.model.card.rejection.is_none() {
        let text = "This model cannot answer \"unknown\": that takes more trials.";
        remark_ui(ui, text);
    }
    confusion_ui(ui, theme::of(ui), &judged.evaluation.confusion, &trained.model.card.labels);
    use_ui(ui, chosen, Some(&trained.path), "Use for the real gripper", actions);
}

/// Button that uses a model, or shows that it is in use.
fn use_ui(ui: &mut Ui, chosen: Option<&Path>, path: Option<&Path>, text: &str, actions: &mut Actions) {
    let in_use = chosen == path;
    let button = ui.add_enabled(!in_use, Button::new(if in_use { "in use" } else { text }));
    let name = path.map_or("the shipped model".into(), name_of);
    let label = if in_use { format!("{name} is in use") } else { format!("Use {name}") };
    button.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, !in_use, &label));
    if button.on_hover_text("Use it to recognise objects in the real gripper").clicked() {
        let path = path.map(Path::to_owned);
        actions.push(|app| app.use_model(path));
    }
}

fn name_of(path: &Path) -> std::borrow::Cow<'_, str> {
    path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy()
}

/// Trials of each object.
fn classes_ui(ui: &mut Ui, model: Option<&Model>, classes: &[LabelledClass], actions: &mut Actions) {
    ui.add_space(6.0);
    let all: usize = classes.iter().map(|class| class.trials).sum();
    wrapped(ui, RichText::new("Labelled trials").strong());
    if classes.is_empty() {
        remark_ui(ui, "None yet. Record trials of the real gripper and label them.");
        return;
    }
    remark_ui(ui, format!("{all} trials of {} objects", classes.len()));
    ui.spacing_mut().item_spacing.y = 2.0;
    for class in classes {
        class_ui(ui, theme::of(ui), class);
    }
    let Some(model) = model.filter(|model| model.learns_new_objects()) else { return };
    let is_new = |class: &&LabelledClass| class.is_enough() && model.card.labels.class(&class.name).is_none();
    for class in classes.iter().filter(is_new) {
        let hint =
            format!("The model in use learns it from its {} recorded grasps, besides what it knows", class.trials);
        if ui.button(format!("Teach the model in use: {}", capital_title(&class.name))).on_hover_text(hint).clicked() {
            let name = class.name.clone();
            actions.push(|app| app.teach_recorded(name));
        }
    }
}

/// Name, bar and number of an object's trials. A full bar is enough.
fn class_ui(ui: &mut Ui, theme: Theme, class: &LabelledClass) {
    let share = (class.trials as f32 / LEAST_TRIALS as f32).min(1.0);
    let colours = theme.colours();
    let (number, bar, ink) = match class.is_enough() {
        true => (class.trials.to_string(), colours.accent, colours.text),
        false => (format!("{}, needs {LEAST_TRIALS}", class.trials), colours.warning, colours.warning),
    };
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width().max(120.0), 18.0), Sense::hover());
    let title = capital_title(&class.name);
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, format!("{title}: {number}")));
    let painter = ui.painter_at(rect);
    let font = FontId::proportional(13.0);
    let [names, numbers] = [0.36, 0.26].map(|share: f32| share * rect.width());
    let name = painter.with_clip_rect(rect.with_max_x(rect.left() + names - 4.0));
    name.text(rect.left_center(), Align2::LEFT_CENTER, &title, font.clone(), colour(colours.text));
    painter.text(rect.right_center(), Align2::RIGHT_CENTER, &number, font, colour(ink));
    let room = rect.with_min_x(rect.left() + names).with_max_x(rect.right() - numbers).shrink2(vec2(0.0, 4.0));
    let filled = room.with_max_x(room.left() + share * room.width());
    painter.rect_filled(filled, 2.0, colour(bar));
    response.on_hover_text(titled(&class.name));
}

/// Room for the button beside a model, and for the scroll bar (points).
const BUTTON: f32 = 72.0;

/// Saved models and the shipped one.
fn models_ui(ui: &mut Ui, view: &ViewState, data: Option<&TrainingData>, actions: &mut Actions) {
    let chosen = view.gripper_model.as_deref();
    let saved = data.map_or(&[][..], |data| &data.models);
    ui.add_space(8.0);
    ui.horizontal(|ui| {
        ui.strong("Models for the real gripper");
        actions.on(&ui.button("Refresh").on_hover_text("Reload trials and models"), |app| _ = app.tools.data.start(()));
    });
    let shipped = ("Shipped model".to_owned(), "trained on simulated grasps".to_owned(), None);
    // Models from outside the folder.
    let is_unlisted = |path: &&Path| view.gripper_models.iter().all(|known| known != path);
    let others = chosen.filter(is_unlisted).into_iter().chain(view.gripper_models.iter().map(PathBuf::as_path));
    let others = others.filter(|own| saved.iter().all(|m| m.path != *own));
    let others = others.map(|path| (name_of(path).into_owned(), path.display().to_string(), Some(path)));
    let saved =
        saved.iter().map(|model| (name_of(&model.path).into_owned(), model.about.clone(), Some(model.path.as_path())));
    for (name, about, path) in std::iter::once(shipped).chain(others).chain(saved) {
        ui.horizontal(|ui| {
            let width = (ui.available_width() - BUTTON).max(80.0);
            ui.vertical(|ui| {
                ui.set_width(width);
                ui.spacing_mut().item_spacing.y = 1.0;
                wrapped(ui, RichText::new(name));
                wrapped(ui, RichText::new(about).small().weak());
            });
            use_ui(ui, chosen, path, "Use", actions);
        });
        ui.add_space(3.0);
    }
}

/// Cells of a confusion matrix: largest and least side (points).
const CELLS: [f32; 2] = [26.0, 9.0];

/// Confusion matrix; a cell is as strong as its share of the row.
fn confusion_ui(ui: &mut Ui, theme: Theme, confusion: &Confusion, labels: &Labels) {
    let count = confusion.classes().max(1);
    let colours = theme.colours();
    let names = 96.0f32.min(0.4 * ui.available_width());
    let cell = ((ui.available_width() - names - 8.0) / count as f32).clamp(CELLS[1], CELLS[0]);
    let heading = if cell > 12.0 { 18.0 } else { 0.0 };
    ui.add_space(4.0);
    wrapped(ui, RichText::new("Rows: true class. Columns: predicted.").small().weak());
    let size = vec2(names + cell * count as f32, heading + cell * count as f32);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    let name = |class: usize| labels.classes.get(class).map_or_else(String::new, |class| capital_title(&class.name));
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Figure, true, confusions(confusion, labels)));
    let painter = ui.painter_at(rect);
    let corner = rect.min + vec2(names, heading);
    let ink = colour(colours.text);
    for column in 0..if heading > 0.0 { count } else { 0 } {
        let at = corner + vec2((column as f32 + 0.5) * cell, -0.5 * heading);
        painter.text(at, Align2::CENTER_CENTER, column + 1, FontId::proportional(11.0), colour(colours.quiet_text));
    }
    for row in 0..count {
        let trials = confusion.class(row).trials.max(1);
        let middle = corner + vec2(-6.0, (row as f32 + 0.5) * cell);
        let font = FontId::proportional(cell.min(12.5));
        let text = format!("{} {}", row + 1, name(row));
        let galley = painter.layout_no_wrap(text, font, ink);
        painter.galley(middle - vec2(galley.size().x.min(names - 6.0), 0.5 * galley.size().y), galley, ink);
        for column in 0..count {
            let trials_here = confusion.count(row, Some(column));
            let at = corner + vec2(column as f32 * cell, row as f32 * cell);
            let place = Rect::from_min_size(at, vec2(cell, cell)).shrink(0.5);
            let share = trials_here as f32 / trials as f32;
            let hue = if row == column { colours.accent } else { colours.error };
            let fill = colours.raised.mix(hue, share);
            painter.rect_filled(place, 1.0, colour(fill));
            if trials_here > 0 && cell > 14.0 {
                let font = FontId::proportional(11.0);
                painter.text(place.center(), Align2::CENTER_CENTER, trials_here, font, colour(readable(fill, theme)));
            }
        }
    }
    let hint = ui.input(|input| input.pointer.hover_pos()).filter(|at| rect.contains(*at)).and_then(|at| {
        let [column, row] = [(at.x - corner.x) / cell, (at.y - corner.y) / cell];
        (row >= 0.0 && column >= 0.0).then(|| {
            let (row, column) = ((row as usize).min(count - 1), (column as usize).min(count - 1));
            let (here, all) = (confusion.count(row, Some(column)), confusion.class(row).trials);
            format!("{} predicted as {}: {here} of {all}", name(row), name(column))
        })
    });
    if let Some(hint) = hint {
        response.on_hover_text_at_pointer(hint);
    }
}

/// Text colour with more contrast.
fn readable(behind: Rgb, theme: Theme) -> Rgb {
    let colours = theme.colours();
    let stands_out = |ink: &Rgb| (100.0 * ink.contrast(behind)) as u32;
    [colours.text, colours.background].into_iter().max_by_key(stands_out).unwrap_or(colours.text)
}

/// Confusions in words.
fn confusions(confusion: &Confusion, labels: &Labels) -> String {
    let classes: Vec<String> = labels.classes.iter().map(|class| capital_title(&class.name)).collect();
    let pairs = (0..classes.len()).flat_map(|row| (0..classes.len()).map(move |column| (row, column)));
    let wrong = pairs.filter(|(row, column)| row != column).filter_map(|(row, column)| {
        let count = confusion.count(row, Some(column));
        (count > 0).then(|| format!("{} predicted as {}: {count}", classes[row], classes[column]))
    });
    let wrong: Vec<String> = wrong.collect();
    if wrong.is_empty() { "No confusions".to_owned() } else { wrong.join("; ") }
}
