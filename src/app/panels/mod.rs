//! One file per panel. Adding one is adding a file and a line in [`ALL`]; it then has a tab, a place that is
//! remembered, and a test that draws it in both themes.

mod calibration;
mod console;
mod counts;
mod curvature;
mod doctor;
mod effects;
mod fit;
mod force;
mod grasp;
mod gripper;
mod journal;
mod label;
mod line_pressure;
mod objects;
mod plan;
mod pressure;
mod recognition;
mod scene;
mod training;
mod trials;
mod view3d;

pub(super) use gripper::{control_title, stop_button};
pub(super) use training::USUAL_METHOD;

use super::actions::Action;
use super::gripper_tools::GripperTools;
use super::traces::{GraspTrace, Traces};
use super::view_state::ViewState;
use egui::{Button, Label, RichText, TextEdit, Ui};
use palpate_lab::grasping::{IdentificationView, LEAD_S};
use palpate_lab::workers::{EffectsWorker, GripperView, LabelView, MeasuredAccuracy, Snapshot};
use palpate_sim::frame::Frame;
use palpate_sim::objects::{EMPTY, catalogue};
use palpate_sim::scene::Scene;
use palpate_tactile::Channel;
use palpate_tactile::trial::Control;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// What panels may read.
pub struct PanelContext<'a> {
    /// The newest state of the simulation; absent until the first object is loaded.
    pub snapshot: Option<&'a Snapshot>,
    /// What the accuracy of the last scene that was measured costs and leaves.
    pub accuracy: Option<&'a MeasuredAccuracy>,
    /// The scene as the user has set it.
    pub scene: &'a Scene,
    /// Measures what effects cost and change.
    pub effects: &'a EffectsWorker,
    /// Doctor, fit and training for the real gripper.
    pub tools: &'a GripperTools,
    /// Where the real gripper stands; absent until its thread has begun.
    pub gripper: Option<&'a GripperView>,
    /// Labels, plan and journal; absent until the store has been looked into.
    pub labels: Option<&'a LabelView>,
    /// Which gripper the plots and the recognition are of.
    pub source: Source,
    /// What the model says is hidden until the label is given.
    pub blind: bool,
    /// Traces of the last grasps of that gripper.
    pub traces: &'a Traces,
    /// How the user looks at things.
    pub view: &'a ViewState,
    /// Pictures of the built-in objects.
    pub thumbnails: &'a BTreeMap<String, egui::TextureHandle>,
    /// The graphics driver in words; absent when nothing can draw the 3-D view.
    pub driver: Option<&'a str>,
    /// The other engine's sample at the same time, where it is to be drawn.
    pub ghost: Option<&'a Frame>,
}

/// Which gripper is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Source {
    /// The simulated one.
    #[default]
    Simulation,
    /// The real one.
    Gripper,
}

/// What is recognised, of the gripper that is shown.
pub(super) struct Recognised<'a> {
    /// The newest answers; none where nothing is recognised.
    pub(super) view: Option<&'a Arc<IdentificationView>>,
    /// Why nothing is.
    pub(super) off: Option<&'a str>,
    /// The object in the hand by the name of its class and its title, where that is known.
    pub(super) truth: Option<(&'a str, String)>,
    /// What is going on before the first answer.
    pub(super) waiting: &'static str,
    /// No further grasp comes by itself.
    pub(super) finished: bool,
}

impl<'a> PanelContext<'a> {
    /// What is recognised of the gripper that is shown.
    pub(super) fn recognised(&self) -> Option<Recognised<'a>> {
        match self.source {
            Source::Simulation => self.snapshot.map(|snapshot| {
                let truth = snapshot.truth();
                let title = snapshot.object.as_ref().map_or_else(|| title_of(truth), |object| object.title.clone());
                let playing = snapshot.status.playing;
                Recognised {
                    view: snapshot.identification.as_ref(),
                    off: snapshot.recognition_off.as_deref(),
                    truth: Some((truth, title)),
                    waiting: if playing { "the fingers close" } else { "it begins with the grasp: press play" },
                    finished: snapshot.status.finished,
                }
            }),
            Source::Gripper => self.gripper.map(|gripper| {
                let closing = gripper.trial.is_some();
                Recognised {
                    view: gripper.identification.as_ref(),
                    off: gripper.recognition_off.as_deref(),
                    truth: None,
                    waiting: if closing { "the fingers close" } else { "it begins with a grasp: press R" },
                    finished: false,
                }
            }),
        }
    }

    /// What the values of the traces shown are; counts of a board's channels may follow them.
    pub(super) fn channels(&self) -> &'a [Channel] {
        match self.source {
            Source::Simulation => self.snapshot.map_or(&[], |snapshot| &snapshot.channels),
            Source::Gripper => self.gripper.map_or(&[], |gripper| &gripper.channels),
        }
    }

    /// All the time that plots can show (s).
    pub(super) fn time_span(&self) -> [f64; 2] {
        match self.source {
            Source::Simulation => [0.0, self.snapshot.map_or(4.0, |snapshot| snapshot.status.duration)],
            Source::Gripper => gripper_span(self.traces.current()),
        }
    }

    /// When the hold begins and ends in what the plots show (s), where that is known.
    pub(super) fn hold(&self) -> Option<[f64; 2]> {
        if self.source == Source::Gripper {
            // Only a conducted trial keeps to the programme.
            let gripper = self.gripper?;
            let ended = || gripper.ended.as_ref().map(|ended| ended.request.control);
            let control = gripper.trial.as_ref().map(|trial| trial.request.control).or_else(ended);
            let rolling = self.traces.current().is_none_or(|trace| trace.rolling);
            if rolling || control.is_none_or(|control| control == Control::Free) {
                return None;
            }
        }
        let scene = match self.source {
            Source::Simulation => &self.snapshot?.scene,
            Source::Gripper => self.scene,
        };
        let tick = 1.0 / f64::from(scene.timing.actuation_hz.max(1));
        let closed = f64::from(scene.programme.close_ticks()) * tick;
        let released = (closed + f64::from(scene.programme.hold_ticks) * tick).min(self.time_span()[1]);
        (closed < released).then_some([closed, released])
    }
}

/// Stretch of a stream that is shown while no trial goes on (s).
const ROLLING_S: f64 = 10.0;
/// A trial is shown at least this long (s).
const TRIAL_S: f64 = 4.0;

/// A trial from its rest before the closing, or the last seconds of a stream.
fn gripper_span(trace: Option<&GraspTrace>) -> [f64; 2] {
    let last = |trace: &GraspTrace| trace.t.last().copied().unwrap_or(0.0);
    match trace {
        Some(trace) if !trace.rolling => {
            [trace.t.first().copied().unwrap_or(0.0).max(-LEAD_S), last(trace).max(TRIAL_S)]
        }
        Some(trace) => [last(trace).max(ROLLING_S) - ROLLING_S, last(trace).max(ROLLING_S)],
        None => [0.0, ROLLING_S],
    }
}

/// What people call an object, by the name of its class.
pub(super) fn title_of(name: &str) -> String {
    let built_in = catalogue().iter().find(|b| b.name == name).map(|b| b.title.as_str());
    built_in.unwrap_or(if name == EMPTY { "Empty hand" } else { name }).to_owned()
}

/// A kind of panel.
pub struct PanelKind {
    /// Its name in the stored layout.
    pub name: &'static str,
    /// Its title.
    pub title: &'static str,
    /// Draws it.
    pub ui: fn(&mut Ui, &PanelContext<'_>, &mut Vec<Action>),
}

/// All panels.
pub const ALL: [PanelKind; 21] = [
    PanelKind { name: "objects", title: "Objects", ui: objects::ui },
    PanelKind { name: "view", title: "3-D view", ui: view3d::ui },
    PanelKind { name: "curvature", title: "Curvature", ui: curvature::ui },
    PanelKind { name: "pressure", title: "Pressure", ui: pressure::ui },
    PanelKind { name: "force", title: "Force", ui: force::ui },
    PanelKind { name: "line", title: "Line pressure", ui: line_pressure::ui },
    PanelKind { name: "recognition", title: "Recognition", ui: recognition::ui },
    PanelKind { name: "grasp", title: "This grasp", ui: grasp::ui },
    PanelKind { name: "scene", title: "Scene", ui: scene::ui },
    PanelKind { name: "effects", title: "Effects", ui: effects::ui },
    PanelKind { name: "label", title: "Label", ui: label::ui },
    PanelKind { name: "plan", title: "Plan", ui: plan::ui },
    PanelKind { name: "trials", title: "Trials", ui: trials::ui },
    PanelKind { name: "journal", title: "Journal", ui: journal::ui },
    PanelKind { name: "gripper", title: "Gripper", ui: gripper::ui },
    PanelKind { name: "counts", title: "Counts", ui: counts::ui },
    PanelKind { name: "console", title: "Console", ui: console::ui },
    PanelKind { name: "calibration", title: "Calibration", ui: calibration::ui },
    PanelKind { name: "doctor", title: "Doctor", ui: doctor::ui },
    PanelKind { name: "fit", title: "Fit", ui: fit::ui },
    PanelKind { name: "training", title: "Training", ui: training::ui },
];

/// A panel by its name.
pub(super) fn named(name: &str) -> Option<&'static PanelKind> {
    ALL.iter().find(|panel| panel.name == name)
}

/// Text that breaks its lines.
fn wrapped(ui: &mut Ui, text: RichText) {
    ui.add(Label::new(text).wrap());
}

/// A command that mends something, with a button that copies it.
fn command_ui(ui: &mut Ui, mends: &str, command: &str) {
    egui::Frame::new().fill(ui.visuals().faint_bg_color).corner_radius(4).inner_margin(6).show(ui, |ui| {
        ui.add(Label::new(RichText::new(command).monospace()).wrap());
        let copy = ui.add(Button::new("Copy"));
        let label = format!("Copy the command for {mends}");
        copy.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &label));
        if copy.on_hover_text("Paste it into a terminal").clicked() {
            ui.copy_text(command.to_owned());
        }
    });
}

/// True in the first frame in which something is shown after it was not: what a panel shows from elsewhere is then looked
/// for again.
fn just_opened(ui: &Ui, name: &str) -> bool {
    let id = egui::Id::unique(("shown last", name));
    let now = ui.ctx().cumulative_frame_nr();
    let last = ui.data_mut(|data| {
        let last = data.get_temp::<u64>(id);
        data.insert_temp(id, now);
        last
    });
    last.is_none_or(|last| last + 1 < now)
}

/// A field for the port of the real gripper; nothing where it is left empty. What was typed is kept under `id`.
fn port_field(ui: &mut Ui, id: egui::Id) -> Option<PathBuf> {
    let mut port = ui.data_mut(|data| data.get_temp::<String>(id)).unwrap_or_default();
    ui.horizontal(|ui| {
        let label = ui.label("Port");
        ui.add(TextEdit::singleline(&mut port).hint_text("the only one there is")).labelled_by(label.id);
    });
    let named = Some(port.trim()).filter(|port| !port.is_empty()).map(PathBuf::from);
    ui.data_mut(|data| data.insert_temp(id, port));
    named
}
