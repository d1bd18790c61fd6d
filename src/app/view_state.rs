//! How the user looks at things: remembered between runs, never written into a trial.

use super::panels;
use egui_tiles::Tree;
use palpate_core::drawing::Camera;
use palpate_core::palette::Theme;
use serde::{Deserialize, Serialize};

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
    /// Which panels are where; panes are the names of panels.
    pub layout: Tree<String>,
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
            layout: panels::default_layout(),
            time_window: None,
            keys_shown: false,
            recent: Vec::new(),
        }
    }
}

impl ViewState {
    /// Puts a file in front of the list of recent ones.
    pub fn remember_file(&mut self, path: &str) {
        self.recent.retain(|known| known != path);
        self.recent.insert(0, path.to_owned());
        self.recent.truncate(MOST_RECENT);
    }
}
