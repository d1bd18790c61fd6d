//! One file per panel. Adding one is adding a file and a line in [`ALL`]; it then has a tab, a place that is
//! remembered, and a test that draws it in both themes.

mod calibration;
mod curvature;
mod doctor;
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
use super::gripper_tools::GripperTools;
use super::traces::Traces;
use super::view_state::ViewState;
use egui::{Label, RichText, TextEdit, Ui};
use egui_tiles::{Linear, LinearDir, Tile, TileId, Tiles, Tree};
use palpate_core::scene::Scene;
use palpate_core::trial::Frame;
use palpate_core::workers::{Calibrator, EffectsWorker, MeasuredAccuracy, Snapshot};
use std::collections::BTreeMap;
use std::path::PathBuf;

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
    /// Doctor, fit and training for the real gripper.
    pub tools: &'a GripperTools,
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
pub const ALL: [PanelKind; 12] = [
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
    PanelKind { name: "doctor", title: "Doctor", ui: doctor::ui },
];

/// A panel by its name.
pub(super) fn named(name: &str) -> Option<&'static PanelKind> {
    ALL.iter().find(|panel| panel.name == name)
}

/// Text that breaks its lines.
fn wrapped(ui: &mut Ui, text: RichText) {
    ui.add(Label::new(text).wrap());
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

/// What is grasped on the left, the view over two plots in the middle, what comes out of it on the right.
pub(super) fn default_layout() -> Tree<String> {
    let mut tiles = Tiles::default();
    let mut pane = |name: &str| tiles.insert_pane(name.to_owned());
    let (objects, view, curvature) = (pane("objects"), pane("view"), pane("curvature"));
    let (pressure, force, line) = (pane("pressure"), pane("force"), pane("line"));
    let (recognition, grasp) = (pane("recognition"), pane("grasp"));
    let (scene, effects) = (pane("scene"), pane("effects"));
    let of_gripper = ["calibration", "doctor"].map(&mut pane);
    let [view, curvature] = [vec![view], vec![curvature]].map(|panes| tiles.insert_tab_tile(panes));
    let loads = tiles.insert_tab_tile(vec![pressure, force, line]);
    let right = [recognition, grasp, effects].into_iter().chain(of_gripper).collect();
    let [left, right] = [vec![objects, scene], right].map(|panes| tiles.insert_tab_tile(panes));
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
