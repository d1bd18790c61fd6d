//! Panels, one file each. To add one, add a file and a line in [`ALL`], and its name to the layout of a mode; it then has a
//! tab, a remembered place, and a test that draws it in both themes.

mod accuracy;
mod calibration;
mod compared;
mod console;
mod counts;
mod curvature;
mod doctor;
mod effects;
mod fit;
mod force;
mod grasp;
mod gripper;
mod hysteresis;
mod journal;
mod label;
mod library;
mod line_pressure;
mod objects;
mod pads;
mod plan;
mod pressure;
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
use crate::app::context::PanelContext;
use egui::Ui;

/// Kind of a panel.
pub struct PanelKind {
    /// Name in stored layouts.
    pub name: &'static str,
    /// Title of its tab.
    pub title: &'static str,
    /// Draws it.
    pub ui: fn(&mut Ui, &PanelContext<'_>, &mut Actions),
}

/// All panels.
pub const ALL: [PanelKind; 34] = [
    PanelKind { name: "objects", title: "Objects", ui: objects::ui },
    PanelKind { name: "view", title: "3-D view", ui: view3d::ui },
    PanelKind { name: "curvature", title: "Curvature", ui: curvature::ui },
    PanelKind { name: "pressure", title: "Pressure", ui: pressure::ui },
    PanelKind { name: "force", title: "Force", ui: force::ui },
    PanelKind { name: "line", title: "Line pressure", ui: line_pressure::ui },
    PanelKind { name: "recognition", title: "Recognition", ui: recognition::ui },
    PanelKind { name: "why", title: "Why", ui: why::ui },
    PanelKind { name: "grasp", title: "This grasp", ui: grasp::ui },
    PanelKind { name: "scene", title: "Scene", ui: scene::ui },
    PanelKind { name: "effects", title: "Effects", ui: effects::ui },
    PanelKind { name: "accuracy", title: "Accuracy", ui: accuracy::ui },
    PanelKind { name: "label", title: "Label", ui: label::ui },
    PanelKind { name: "plan", title: "Plan", ui: plan::ui },
    PanelKind { name: "trials", title: "Trials", ui: trials::ui },
    PanelKind { name: "library", title: "Library", ui: library::ui },
    PanelKind { name: "journal", title: "Journal", ui: journal::ui },
    PanelKind { name: "gripper", title: "Gripper", ui: gripper::ui },
    PanelKind { name: "counts", title: "Counts", ui: counts::ui },
    PanelKind { name: "console", title: "Console", ui: console::ui },
    PanelKind { name: "calibration", title: "Calibration", ui: calibration::ui },
    PanelKind { name: "doctor", title: "Doctor", ui: doctor::ui },
    PanelKind { name: "fit", title: "Fit", ui: fit::ui },
    PanelKind { name: "pads", title: "Pads", ui: pads::ui },
    PanelKind { name: "signature", title: "Signature", ui: signature::ui },
    PanelKind { name: "trial", title: "This trial", ui: trial::ui },
    PanelKind { name: "compared", title: "Compared", ui: compared::ui },
    PanelKind { name: "sensors", title: "Sensors", ui: sensors::ui },
    PanelKind { name: "hysteresis", title: "Hysteresis", ui: hysteresis::ui },
    PanelKind { name: "training", title: "Training", ui: training::ui },
    PanelKind { name: "studies", title: "Studies", ui: study::list::ui },
    PanelKind { name: "study-figure", title: "Figure", ui: study::figure::ui },
    PanelKind { name: "study-tables", title: "Tables", ui: study::tables::ui },
    PanelKind { name: "study-findings", title: "Findings", ui: study::findings::ui },
];

/// Panel of a name.
pub(super) fn named(name: &str) -> Option<&'static PanelKind> {
    ALL.iter().find(|panel| panel.name == name)
}
