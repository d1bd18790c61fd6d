//! Panels, one file each. To add one, add a file and a line in [`ALL`], and its name to the layout of a mode; it then has a
//! tab, a remembered place, and a test that draws it in both themes.

mod accuracy;
mod calibration;
mod compared;
mod console;
mod curves;
mod doctor;
mod effects;
mod fit;
mod grasp;
mod gripper;
mod hysteresis;
mod journal;
mod label;
mod library;
mod objects;
mod pads;
mod plan;
pub(super) mod recognition;
mod scene;
mod sensors;
mod signature;
mod study;
mod training;
mod trial;
mod trials;
pub(super) mod view3d;
mod why;

use crate::app::actions::Actions;
use crate::app::features::App;
use crate::app::features::view::ViewSource;
use egui::Ui;
use palpate_sim::objects::capital_title;
use view3d::View3d;

/// Kind of a panel.
pub struct PanelKind {
    /// Name in stored layouts.
    pub name: &'static str,
    /// Title of its tab.
    pub title: &'static str,
    /// Draws it from the parts of the [`App`] that it reads.
    pub ui: fn(&mut Ui, &App, &mut Actions),
}

const fn panel(name: &'static str, title: &'static str, ui: fn(&mut Ui, &App, &mut Actions)) -> PanelKind {
    PanelKind { name, title, ui }
}

/// All panels, and what each of them reads.
pub const ALL: [PanelKind; 35] = [
    panel("objects", "Objects", |ui, app, actions| {
        // Nobody knows what a real hand holds.
        let simulated = app.view.source != ViewSource::Gripper;
        let chosen = if simulated { app.simulation.scene.object.source.as_str() } else { "" };
        let learned_as = |path: &str| app.learned_as(path).map(|class| (class, app.lesson(class)));
        let loaded = app.snapshot().map_or("", |snapshot| snapshot.scene.object.source.as_str());
        let title_of = |path: &str| match app.name_of_learned(path) {
            Some(class) => capital_title(class),
            None => app.view.title_of(path),
        };
        objects::ui(ui, (chosen, loaded, &app.view.recent), (title_of, learned_as), &app.thumbnails, actions);
    }),
    panel("view", "3-D view", |ui, app, actions| view3d::ui(ui, &View3d::of(app), actions)),
    panel("curvature", "Curvature", |ui, app, actions| curves::curvature_ui(ui, &app.shown(), actions)),
    panel("pressure", "Pressure", |ui, app, actions| curves::pressure_ui(ui, &app.shown(), actions)),
    panel("force", "Force", |ui, app, actions| curves::force_ui(ui, &app.shown(), actions)),
    panel("other", "Other channels", |ui, app, actions| curves::other_ui(ui, &app.shown(), actions)),
    panel("line", "Line pressure", |ui, app, actions| curves::line_pressure_ui(ui, &app.shown(), actions)),
    panel("recognition", "Recognition", |ui, app, actions| {
        let recognition = (app.recognition.learned.as_ref(), &app.recognition.explainer);
        recognition::ui(ui, &app.shown(), &app.tools, recognition, &app.thumbnails, actions);
    }),
    panel("why", "Why", |ui, app, actions| {
        why::ui(ui, &app.shown(), &app.recognition.explainer, &app.thumbnails, actions);
    }),
    panel("grasp", "This grasp", |ui, app, actions| grasp::ui(ui, &app.shown(), actions)),
    panel("scene", "Scene", |ui, app, actions| scene::ui(ui, &app.simulation, actions)),
    panel("effects", "Effects", |ui, app, actions| effects::ui(ui, &app.simulation, actions)),
    panel("accuracy", "Accuracy", |ui, app, actions| accuracy::ui(ui, &app.simulation, actions)),
    panel("label", "Label", |ui, app, actions| {
        label::ui(ui, &app.labelling, (app.gripper_view(), app.gripper.silent_s()), &app.thumbnails, actions);
    }),
    panel("plan", "Plan", |ui, app, actions| plan::ui(ui, app.labels(), actions)),
    panel("trials", "Trials", |ui, app, actions| trials::ui(ui, &app.labelling, actions)),
    panel("library", "Library", |ui, app, actions| {
        library::ui(ui, (&app.library, &app.inspect.pinned), app.labels(), &app.thumbnails, actions);
    }),
    panel("journal", "Journal", |ui, app, actions| journal::ui(ui, app.labels(), actions)),
    panel("gripper", "Gripper", |ui, app, actions| {
        gripper::ui(ui, (app.gripper_view(), app.gripper.silent_s()), app.view.port.as_deref(), app.control(), actions);
    }),
    panel("counts", "Counts", |ui, app, actions| curves::counts_ui(ui, &app.shown(), actions)),
    panel("console", "Console", |ui, app, _| console::ui(ui, app.gripper_view())),
    panel("calibration", "Calibration", |ui, app, actions| calibration::ui(ui, app.gripper_view(), actions)),
    panel("doctor", "Doctor", |ui, app, actions| doctor::ui(ui, &app.tools.doctor, app.gripper_view(), actions)),
    panel("fit", "Fit", |ui, app, actions| fit::ui(ui, &app.tools, &app.simulation.scene, actions)),
    panel("pads", "Pads", |ui, app, actions| pads::ui(ui, &app.shown(), actions)),
    panel("signature", "Signature", |ui, app, actions| signature::ui(ui, &app.shown(), actions)),
    panel("trial", "This trial", |ui, app, actions| trial::ui(ui, &app.shown(), app.library.view.as_deref(), actions)),
    panel("compared", "Compared", |ui, app, actions| compared::ui(ui, &app.shown(), actions)),
    panel("sensors", "Sensors", |ui, app, actions| {
        sensors::ui(ui, &app.view, &app.simulation.scene, &app.tools.data, actions);
    }),
    panel("hysteresis", "Hysteresis", |ui, app, _| hysteresis::ui(ui, &app.shown())),
    panel("training", "Training", |ui, app, actions| {
        training::ui(ui, &app.tools, app.recognition.gripper_model(), &app.view, actions);
    }),
    panel("studies", "Studies", |ui, app, actions| study::list::ui(ui, &app.studies, actions)),
    panel("study-figure", "Figure", |ui, app, actions| study::figure::ui(ui, &app.studies, actions)),
    panel("study-tables", "Tables", |ui, app, actions| study::tables::ui(ui, &app.studies, actions)),
    panel("study-findings", "Findings", |ui, app, actions| study::findings::ui(ui, &app.studies, actions)),
];

/// Panel of a name.
pub(super) fn named(name: &str) -> Option<&'static PanelKind> {
    ALL.iter().find(|panel| panel.name == name)
}
