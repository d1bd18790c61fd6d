//! View state: camera, theme, layout and settings of the window. Remembered between runs, never written into a trial.

use super::App;
use crate::app::theme;
use egui_tiles::Tree;
use palpate_geometry::drawing::{Camera, StandardView};
use palpate_geometry::palette::Theme;
use palpate_lab::datasets::SensorView;
use palpate_lab::picture::{BendUnit, LoadUnit};
use palpate_lab::workers::{Command, LabelCommand, Snapshot};
use palpate_sim::objects::capital_title;
use palpate_tactile::trial::Control;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Camera, theme, layout and settings.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct ViewState {
    /// Dark or light.
    pub theme: Theme,
    /// Camera of the 3-D view.
    pub camera: Camera,
    /// Camera as last framed; while the user leaves it there, it follows the objects.
    #[serde(skip)]
    pub framed: Option<Camera>,
    /// Presenter mode is on.
    #[serde(skip)]
    pub presents: bool,
    /// Force arrows are drawn.
    pub forces: bool,
    /// The circle that each flex strip reads is drawn.
    pub circles: bool,
    /// The picture of the touch within the 3-D view is enlarged.
    pub inset_large: bool,
    /// Contact path on the object.
    pub path: PathLayer,
    /// Unit of loads in heat maps.
    pub load_unit: LoadUnit,
    /// Unit of bending in heat maps.
    pub bend_unit: BendUnit,
    /// Fingers and object of the other engine are drawn.
    pub ghost: bool,
    /// The true object is shown beside the recognised one.
    pub truth_shown: bool,
    /// Mode of the window.
    pub mode: Mode,
    /// Layout of each mode; panes are the names of panels.
    pub layouts: BTreeMap<Mode, Tree<String>>,
    /// Gripper whose data are shown.
    #[serde(skip)]
    pub source: ViewSource,
    /// Actuation of the real gripper.
    pub control: Control,
    /// Port of the last connection.
    pub port: Option<PathBuf>,
    /// The model's prediction is hidden until the label is given.
    pub blind: bool,
    /// Recognition model for the real gripper; the shipped one where none is named.
    pub gripper_model: Option<PathBuf>,
    /// Models used for the real gripper, newest first.
    pub gripper_models: Vec<PathBuf>,
    /// Recognition models for the simulation, of free and of fixed objects; the shipped ones where none are named.
    pub simulation_models: [Option<PathBuf>; 2],
    /// Time shown by all plots (s); `None` for the whole grasp.
    #[serde(skip)]
    pub time_window: Option<[f64; 2]>,
    /// The key sheet is open.
    #[serde(skip)]
    pub keys_shown: bool,
    /// The manual is open.
    #[serde(skip)]
    pub manual_shown: bool,
    /// What the program is stands in a window.
    #[serde(skip)]
    pub about_shown: bool,
    /// Sensors that plots and recognisers read of the simulation and of stored trials.
    pub sensors: SensorView,
    /// What each plot derives from its channels.
    pub derived: BTreeMap<String, Derivation>,
    /// Plots show mean and spread of the two likeliest classes.
    pub class_bands: bool,
    /// Plots of the real gripper show raw counts in place of physical units.
    pub raw: bool,
    /// The command palette is open.
    #[serde(skip)]
    pub palette_shown: bool,
    /// Size of texts and buttons, as a multiple of the system's.
    pub scale: f32,
    /// Files opened last, newest first.
    pub recent: Vec<String>,
    /// Titles of the objects in them.
    pub titles: BTreeMap<String, String>,
}

/// Mode of the window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// Grasp and recognise, live.
    #[default]
    Demo,
    /// Look back: open, replay, compare and explain stored trials.
    Inspect,
    /// Record and label trials of the real gripper.
    Label,
    /// Run the studies of the paper and look at their figures.
    Study,
}

/// Source of the data that are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ViewSource {
    /// The simulated gripper.
    #[default]
    Simulation,
    /// The real gripper.
    Gripper,
    /// The stored trial that is open.
    Trial,
}

/// What a plot shows of its channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Derivation {
    /// Their values.
    #[default]
    Values,
    /// Left and right finger together.
    Sum,
    /// Left finger less the right one.
    Difference,
    /// Change per second.
    Derivative,
}

impl Derivation {
    /// All.
    pub const ALL: [Self; 4] = [Self::Values, Self::Sum, Self::Difference, Self::Derivative];

    /// Name on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Values => "values",
            Self::Sum => "left + right",
            Self::Difference => "left − right",
            Self::Derivative => "change per second",
        }
    }

    /// Unit of the derived values.
    pub(in crate::app) fn unit(self, unit: &str) -> String {
        match self {
            Self::Values | Self::Sum | Self::Difference => unit.to_owned(),
            Self::Derivative => format!("{unit}/s"),
        }
    }
}

/// Contact path on the object: not drawn, or by what it is coloured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PathLayer {
    /// Not drawn.
    #[default]
    Off,
    /// Coloured by the time of the first touch.
    Time,
    /// Coloured by the largest pressure.
    Pressure,
}

impl PathLayer {
    /// The next one: off, time, pressure.
    pub fn next(self) -> Self {
        match self {
            Self::Off => Self::Time,
            Self::Time => Self::Pressure,
            Self::Pressure => Self::Off,
        }
    }

    /// Text on its button.
    pub fn title(self) -> &'static str {
        match self {
            Self::Off => "Path",
            Self::Time => "Path: s",
            Self::Pressure => "Path: kPa",
        }
    }
}

/// Sizes of texts and buttons that can be set.
pub(in crate::app) const SCALES: std::ops::RangeInclusive<f32> = 0.8..=2.0;

/// Files that are remembered.
const MOST_RECENT: usize = 6;

impl Default for ViewState {
    fn default() -> Self {
        Self {
            theme: Theme::Dark,
            camera: Camera::default(),
            presents: false,
            framed: None,
            forces: true,
            circles: true,
            inset_large: false,
            path: PathLayer::default(),
            load_unit: LoadUnit::default(),
            bend_unit: BendUnit::default(),
            ghost: false,
            truth_shown: true,
            mode: Mode::default(),
            layouts: BTreeMap::new(),
            source: ViewSource::default(),
            control: Control::ByHand,
            port: None,
            blind: true,
            gripper_model: None,
            gripper_models: Vec::new(),
            simulation_models: [None, None],
            time_window: None,
            keys_shown: false,
            manual_shown: false,
            about_shown: false,
            sensors: SensorView::default(),
            derived: BTreeMap::new(),
            class_bands: false,
            raw: false,
            palette_shown: false,
            scale: 1.0,
            recent: Vec::new(),
            titles: BTreeMap::new(),
        }
    }
}

impl ViewState {
    /// The standard view in which the camera is, while nobody has moved it from there.
    pub(in crate::app) fn standard_view(&self) -> Option<StandardView> {
        let framed = Camera { parallel: self.camera.parallel, ..self.framed? };
        StandardView::ALL.into_iter().find(|view| framed.turned_to(*view) == self.camera)
    }

    /// Shows the whole scene.
    pub(in crate::app) fn frame_all(&mut self, snapshot: &Snapshot) {
        let (centre, radius) = snapshot.stage.bounds();
        self.camera = self.camera.framing(centre, radius);
        self.framed = Some(self.camera);
    }

    /// Title of the object in a file: that which it had when it was opened last.
    pub(in crate::app) fn title_of(&self, path: &str) -> String {
        let stem = || Path::new(path).file_stem().map_or(path.into(), |stem| stem.to_string_lossy());
        self.titles.get(path).cloned().unwrap_or_else(|| capital_title(&stem()))
    }

    /// Uses a model for the real gripper, which is offered again after others.
    pub(super) fn set_gripper_model(&mut self, path: &Path) {
        self.gripper_models.retain(|known| known != path);
        self.gripper_models.insert(0, path.to_owned());
        self.gripper_models.truncate(MOST_RECENT);
        self.gripper_model = Some(path.to_owned());
    }

    /// Puts a file in front of the recent ones.
    pub(in crate::app) fn remember_file(&mut self, path: &str, title: Option<&str>) {
        self.recent.retain(|known| known != path);
        self.recent.insert(0, path.to_owned());
        self.recent.truncate(MOST_RECENT);
        self.titles.extend(title.map(|title| (path.to_owned(), title.to_owned())));
        self.titles.retain(|path, _| self.recent.contains(path));
    }
}

impl App {
    /// Changes to another mode.
    pub fn set_mode(&mut self, mode: Mode) {
        if std::mem::replace(&mut self.view.mode, mode) == mode {
            self.labelling.show_again();
        }
        self.labelling.refresh();
        self.enter_mode(mode);
    }

    /// Takes the last change back, or makes it again: of the scene in Demo mode, of labels in the others.
    pub(in crate::app) fn undo(&mut self, again: bool) {
        match (self.view.mode, again) {
            (Mode::Demo, false) => self.undo_scene(),
            (Mode::Demo, true) => self.redo_scene(),
            (_, false) => self.edit_labels(LabelCommand::Undo),
            (_, true) => self.edit_labels(LabelCommand::Redo),
        }
    }

    /// Brings a panel to the front, in a mode that has it.
    pub fn show_panel(&mut self, name: &'static str) {
        self.wanted_panel = Some(name);
    }

    /// Shows everything in the 3-D view.
    pub(in crate::app) fn frame_all(&mut self) {
        if let Some(snapshot) = &self.simulation.snapshot {
            self.view.frame_all(snapshot);
        }
    }

    pub(in crate::app) fn set_theme(&mut self, theme: Theme) {
        self.view.theme = theme;
        theme::apply(&self.ctx, theme);
    }

    /// Sets the size of texts and buttons.
    pub fn set_scale(&mut self, scale: f32) {
        self.view.scale = scale.clamp(*SCALES.start(), *SCALES.end());
        self.ctx.set_zoom_factor(self.view.scale);
    }

    /// Sets the sensors that plots and recognisers read of the simulation and of stored trials.
    pub fn set_sensors(&mut self, sensors: SensorView) {
        self.simulation.send(Command::SetSensors(sensors.clone()));
        self.view.sensors = sensors;
    }

    /// Begins or ends presenter mode: full screen, object after object.
    pub(in crate::app) fn present(&mut self, on: bool) {
        self.view.presents = on;
        self.ctx.send_viewport_cmd(egui::ViewportCommand::Fullscreen(on));
    }

    /// Vents the fingers, and closes what is topmost: palette, key sheet or manual; else it ends presenter mode.
    pub(in crate::app) fn stop(&mut self) {
        self.gripper.stop();
        let view = &mut self.view;
        for shown in [&mut view.palette_shown, &mut view.keys_shown, &mut view.manual_shown, &mut view.about_shown] {
            if std::mem::take(shown) {
                return;
            }
        }
        if self.view.presents {
            self.present(false);
        }
    }
}
