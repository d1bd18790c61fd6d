//! One file per panel. Adding one is adding a file and a line in [`ALL`]; it then has a tab, a place that is
//! remembered, and a test that draws it in both themes.

mod calibration;
mod curvature;
mod effects;
mod force;
mod grasp;
mod line_pressure;
mod objects;
mod pressure;
mod recognition;
mod scene;
mod view3d;

use super::actions::Action;
use super::traces::Traces;
use super::view_state::ViewState;
use egui::Ui;
use egui_tiles::{Linear, LinearDir, Tile, TileId, Tiles, Tree};
use palpate_core::scene::Scene;
use palpate_core::trial::Frame;
use palpate_core::workers::{Calibrator, EffectsWorker, MeasuredAccuracy, Snapshot};
use std::collections::BTreeMap;

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
    /// Calibrates the sensors of the real gripper.
    pub calibrator: &'a Calibrator,
    /// Traces of the last grasps.
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
pub const ALL: [PanelKind; 11] = [
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
    PanelKind { name: "calibration", title: "Calibration", ui: calibration::ui },
];

/// A panel by its name.
pub(super) fn named(name: &str) -> Option<&'static PanelKind> {
    ALL.iter().find(|panel| panel.name == name)
}

/// What is grasped on the left, the view over two plots in the middle, what comes out of it on the right.
pub(super) fn default_layout() -> Tree<String> {
    let mut tiles = Tiles::default();
    let mut pane = |name: &str| tiles.insert_pane(name.to_owned());
    let (objects, view, curvature) = (pane("objects"), pane("view"), pane("curvature"));
    let (pressure, force, line) = (pane("pressure"), pane("force"), pane("line"));
    let (recognition, grasp) = (pane("recognition"), pane("grasp"));
    let (scene, effects, calibration) = (pane("scene"), pane("effects"), pane("calibration"));
    let [view, curvature] = [vec![view], vec![curvature]].map(|panes| tiles.insert_tab_tile(panes));
    let loads = tiles.insert_tab_tile(vec![pressure, force, line]);
    let [left, right] = [vec![objects, scene], vec![recognition, grasp, effects, calibration]]
        .map(|panes| tiles.insert_tab_tile(panes));
    let middle = insert_linear(&mut tiles, LinearDir::Vertical, &[(view, 0.58), (curvature, 0.21), (loads, 0.21)]);
    let root = insert_linear(&mut tiles, LinearDir::Horizontal, &[(left, 0.185), (middle, 0.555), (right, 0.26)]);
    Tree::new(egui::Id::unique("workbench"), root, tiles)
}

fn insert_linear(tiles: &mut Tiles<String>, direction: LinearDir, children: &[(TileId, f32)]) -> TileId {
    let mut linear = Linear::new(direction, children.iter().map(|(id, _)| *id).collect());
    for (id, share) in children {
        linear.shares.set_share(*id, *share);
    }
    tiles.insert_container(linear)
}

/// True when every panel stands somewhere in a stored layout, and nothing unknown does.
pub(super) fn is_complete(layout: &Tree<String>) -> bool {
    let mut found: Vec<&str> = Vec::new();
    for tile in layout.tiles.tiles() {
        match tile {
            Tile::Pane(name) if named(name).is_some() && !found.contains(&name.as_str()) => found.push(name),
            Tile::Pane(_) => return false,
            Tile::Container(_) => {}
        }
    }
    layout.root().is_some() && found.len() == ALL.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_layout_holds_every_panel_once() {
        assert!(is_complete(&default_layout()));
        let stored = serde_json::to_string(&default_layout()).unwrap();
        let read: Tree<String> = serde_json::from_str(&stored).unwrap();
        assert!(is_complete(&read));
    }

    #[test]
    fn layouts_of_other_versions_are_recognised() {
        let mut tiles = Tiles::default();
        let unknown = tiles.insert_pane("from the future".to_owned());
        assert!(!is_complete(&Tree::new(egui::Id::unique("workbench"), unknown, tiles)));
    }
}
