//! How the user looks at things: remembered between runs, never written into a trial.

use super::labelling::LabelDraft;
use super::modes::Mode;
use super::panels::Source;
use egui_tiles::Tree;
use palpate_geometry::drawing::Camera;
use palpate_geometry::palette::Theme;
use palpate_tactile::trial::Control;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Camera, theme, layout and the like.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct ViewState {
    /// Dark or light.
    pub theme: Theme,
    /// Where the 3-D view is seen from.
    pub camera: Camera,
    /// Force arrows are drawn.
    pub forces: bool,
    /// The other engine's fingers and object are drawn too.
    pub ghost: bool,
    /// What is in the hand in truth is told in words.
    pub truth_shown: bool,
    /// What the window is used for.
    pub mode: Mode,
    /// Which panels are where in each mode; panes are the names of panels.
    pub layouts: BTreeMap<Mode, Tree<String>>,
    /// Which gripper is shown.
    #[serde(skip)]
    pub source: Source,
    /// Who moves the fingers of the real gripper.
    pub control: Control,
    /// The port that was connected to last.
    pub port: Option<PathBuf>,
    /// What the model says is hidden until the label is given.
    pub blind: bool,
    /// What the user is about to say of a trial.
    #[serde(skip)]
    pub draft: LabelDraft,
    /// The model that listens to the real gripper; the one that comes with the program where none is named.
    pub gripper_model: Option<PathBuf>,
    /// The stretch of time that all plots show (s); `None` for the whole grasp.
    #[serde(skip)]
    pub time_window: Option<[f64; 2]>,
    /// The key sheet is open.
    #[serde(skip)]
    pub keys_shown: bool,
    /// Files opened lately, newest first.
    pub recent: Vec<String>,
}

/// Files that are remembered.
const MOST_RECENT: usize = 6;

impl Default for ViewState {
    fn default() -> Self {
        Self {
            theme: Theme::Dark,
            camera: Camera::default(),
            forces: true,
            ghost: false,
            truth_shown: true,
            mode: Mode::default(),
            layouts: BTreeMap::new(),
            source: Source::default(),
            control: Control::ByHand,
            port: None,
            blind: true,
            draft: LabelDraft::default(),
            gripper_model: None,
            time_window: None,
            keys_shown: false,
            recent: Vec::new(),
        }
    }
}

impl ViewState {
    /// Forgets layouts of other versions.
    pub fn check_layouts(&mut self) {
        self.layouts.retain(|mode, layout| mode.is_complete(layout));
    }

    /// Takes the layout of the mode out, to be drawn and put back.
    pub fn take_layout(&mut self) -> Tree<String> {
        self.layouts.remove(&self.mode).unwrap_or_else(|| self.mode.default_layout())
    }
    /// Puts a file in front of the list of recent ones.
    pub fn remember_file(&mut self, path: &str) {
        self.recent.retain(|known| known != path);
        self.recent.insert(0, path.to_owned());
        self.recent.truncate(MOST_RECENT);
    }
}
