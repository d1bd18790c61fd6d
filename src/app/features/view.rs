//! View state: camera, theme, layout and settings of the window. Remembered between runs, never written into a trial.

use crate::app::derived::Derivation;
use crate::app::modes::mode::Mode;
use crate::app::theme;
use crate::app::view_source::ViewSource;
use egui_tiles::Tree;
use palpate_geometry::drawing::{Camera, StandardView};
use palpate_geometry::palette::Theme;
use palpate_lab::datasets::SensorView;
use palpate_lab::picture::{BendUnit, LoadUnit};
use palpate_lab::workers::Snapshot;
use palpate_tactile::trial::Control;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

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
    /// Recognition model for the simulation; the shipped one where none is named.
    pub simulation_model: Option<PathBuf>,
    /// Time shown by all plots (s); `None` for the whole grasp.
    #[serde(skip)]
    pub time_window: Option<[f64; 2]>,
    /// The key sheet is open.
    #[serde(skip)]
    pub keys_shown: bool,
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

/// Change of the view state.
#[derive(Clone, Debug)]
pub enum ViewAction {
    /// Change to another mode.
    SetMode(Mode),
    /// Show the data of this gripper.
    Show(ViewSource),
    /// Move the camera.
    SetCamera(Camera),
    /// Show everything in the 3-D view.
    FrameAll,
    /// Change the theme.
    SetTheme(Theme),
    /// Show or hide force arrows.
    SetForces(bool),
    /// Show or hide the circles that flex strips read.
    SetCircles(bool),
    /// Draw the contact path, or do not.
    SetPath(PathLayer),
    /// Unit of loads in heat maps.
    SetLoadUnit(LoadUnit),
    /// Unit of bending in heat maps.
    SetBendUnit(BendUnit),
    /// Time shown by all plots (s); `None` for the whole grasp.
    SetTimeWindow(Option<[f64; 2]>),
    /// Sensors that plots and recognisers read.
    SetSensors(SensorView),
    /// What a plot derives from its channels.
    Derive(String, Derivation),
    /// Show or hide mean and spread of the two likeliest classes.
    ShowClassBands(bool),
    /// Show raw counts of the real gripper, or physical units.
    ShowRaw(bool),
    /// Show or hide the true object.
    ShowTruth(bool),
    /// Show or hide the key sheet.
    ShowKeys(bool),
    /// Show or hide the command palette.
    ShowPalette(bool),
    /// Set the size of texts and buttons.
    SetScale(f32),
    /// Bring a panel to the front, in a mode that has it.
    ShowPanel(&'static str),
    /// Begin or end presenter mode: full screen, object after object.
    Present(bool),
    /// Restore the default layouts.
    ResetLayout,
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
            simulation_model: None,
            time_window: None,
            keys_shown: false,
            sensors: SensorView::default(),
            derived: BTreeMap::new(),
            class_bands: false,
            raw: false,
            palette_shown: false,
            scale: 1.0,
            recent: Vec::new(),
        }
    }
}

impl ViewState {
    pub(in crate::app) fn apply(&mut self, ctx: &egui::Context, action: ViewAction, snapshot: Option<&Snapshot>) {
        match action {
            ViewAction::SetMode(mode) => self.mode = mode,
            ViewAction::Show(source) => self.source = source,
            ViewAction::SetCamera(camera) => self.camera = camera,
            ViewAction::FrameAll => {
                if let Some(snapshot) = snapshot {
                    self.frame_all(snapshot);
                }
            }
            ViewAction::SetTheme(theme) => {
                self.theme = theme;
                theme::apply(ctx, theme);
            }
            ViewAction::SetForces(forces) => self.forces = forces,
            ViewAction::SetCircles(circles) => self.circles = circles,
            ViewAction::SetPath(path) => self.path = path,
            ViewAction::SetLoadUnit(unit) => self.load_unit = unit,
            ViewAction::SetBendUnit(unit) => self.bend_unit = unit,
            ViewAction::SetTimeWindow(window) => self.time_window = window,
            ViewAction::SetSensors(sensors) => self.sensors = sensors,
            ViewAction::Derive(plot, derived) => {
                self.derived.insert(plot, derived);
            }
            ViewAction::ShowClassBands(shown) => self.class_bands = shown,
            ViewAction::ShowRaw(raw) => self.raw = raw,
            ViewAction::ShowTruth(shown) => self.truth_shown = shown,
            ViewAction::ShowKeys(shown) => self.keys_shown = shown,
            ViewAction::ShowPalette(shown) => self.palette_shown = shown,
            ViewAction::SetScale(scale) => {
                self.scale = scale.clamp(*SCALES.start(), *SCALES.end());
                ctx.set_zoom_factor(self.scale);
            }
            // The workbench knows which mode has it.
            ViewAction::ShowPanel(_) => {}
            ViewAction::Present(on) => {
                self.presents = on;
                ctx.send_viewport_cmd(egui::ViewportCommand::Fullscreen(on));
            }
            ViewAction::ResetLayout => self.layouts.clear(),
        }
    }

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

    /// Puts a file in front of the recent ones.
    pub(in crate::app) fn remember_file(&mut self, path: &str) {
        self.recent.retain(|known| known != path);
        self.recent.insert(0, path.to_owned());
        self.recent.truncate(MOST_RECENT);
    }
}
