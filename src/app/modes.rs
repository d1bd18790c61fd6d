//! Modes of the window: the same data and the same time, other panels. Adding one is adding a line in [`ALL`] and a
//! function that lays its panels out.

use super::panels;
use egui_tiles::{Linear, LinearDir, Tile, TileId, Tiles, Tree};
use serde::{Deserialize, Serialize};

/// What the window is used for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// Grasp, live.
    #[default]
    Demo,
    /// Record grasps of the real gripper and label them.
    Label,
}

/// One mode.
pub(super) struct ModeKind {
    pub(super) mode: Mode,
    pub(super) title: &'static str,
    pub(super) about: &'static str,
    layout: fn(&mut Tiles<String>) -> TileId,
}

/// All modes, as their tabs stand.
pub(super) const ALL: [ModeKind; 2] = [
    ModeKind { mode: Mode::Demo, title: "Demo", about: "Grasp and recognise, live (Ctrl+1)", layout: demo },
    ModeKind {
        mode: Mode::Label,
        title: "Label",
        about: "Record grasps of the real gripper and label them (Ctrl+3)",
        layout: label,
    },
];

impl Mode {
    fn kind(self) -> &'static ModeKind {
        ALL.iter().find(|kind| kind.mode == self).unwrap_or(&ALL[0])
    }

    /// Where its panels stand at first.
    pub(super) fn default_layout(self) -> Tree<String> {
        let mut tiles = Tiles::default();
        let root = (self.kind().layout)(&mut tiles);
        Tree::new(egui::Id::unique(("workbench", self)), root, tiles)
    }

    /// True when every panel of the mode stands somewhere in a stored layout, and nothing else does.
    pub(super) fn is_complete(self, layout: &Tree<String>) -> bool {
        let (mut own, mut found) = (panes(&self.default_layout()), panes(layout));
        own.sort_unstable();
        found.sort_unstable();
        layout.root().is_some() && own == found
    }
}

fn panes(layout: &Tree<String>) -> Vec<String> {
    let pane = |tile: &Tile<String>| match tile {
        Tile::Pane(name) => Some(name.clone()),
        Tile::Container(_) => None,
    };
    layout.tiles.tiles().filter_map(pane).collect()
}

/// Panels one behind the other.
fn tabs(tiles: &mut Tiles<String>, names: &[&str]) -> TileId {
    let panes = names.iter().filter(|name| panels::named(name).is_some());
    let panes = panes.map(|name| tiles.insert_pane((*name).to_owned())).collect::<Vec<TileId>>();
    tiles.insert_tab_tile(panes)
}

/// Parts beside or below each other, with their shares of the room.
fn split<const N: usize>(tiles: &mut Tiles<String>, direction: LinearDir, parts: [(TileId, f32); N]) -> TileId {
    let mut linear = Linear::new(direction, parts.iter().map(|(id, _)| *id).collect());
    for (id, share) in parts {
        linear.shares.set_share(id, share);
    }
    tiles.insert_container(linear)
}

/// What is grasped on the left, the view over two plots in the middle, what comes out of it on the right.
fn demo(tiles: &mut Tiles<String>) -> TileId {
    let left = tabs(tiles, &["objects", "scene"]);
    let [view, curvature] = ["view", "curvature"].map(|name| tabs(tiles, &[name]));
    let loads = tabs(tiles, &["pressure", "force", "line"]);
    let right = tabs(tiles, &["recognition", "grasp", "effects", "gripper"]);
    let middle = split(tiles, LinearDir::Vertical, [(view, 0.58), (curvature, 0.21), (loads, 0.21)]);
    split(tiles, LinearDir::Horizontal, [(left, 0.185), (middle, 0.555), (right, 0.26)])
}

/// The trials on the left, plots over the view in the middle, the label and the gripper on the right.
fn label(tiles: &mut Tiles<String>) -> TileId {
    let plan = tabs(tiles, &["plan"]);
    let trials = tabs(tiles, &["trials", "journal"]);
    let left = split(tiles, LinearDir::Vertical, [(plan, 0.45), (trials, 0.55)]);
    let [curvature, view] = ["curvature", "view"].map(|name| tabs(tiles, &[name]));
    let loads = tabs(tiles, &["pressure", "force", "line", "counts"]);
    let middle = split(tiles, LinearDir::Vertical, [(curvature, 0.28), (loads, 0.28), (view, 0.44)]);
    let label = tabs(tiles, &["label", "recognition"]);
    let gripper = tabs(tiles, &["gripper", "calibration", "doctor", "fit", "training", "console"]);
    let right = split(tiles, LinearDir::Vertical, [(label, 0.56), (gripper, 0.44)]);
    split(tiles, LinearDir::Horizontal, [(left, 0.22), (middle, 0.48), (right, 0.30)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_panel_stands_in_a_mode_and_no_mode_holds_one_twice() {
        let mut seen = Vec::new();
        for ModeKind { mode, .. } in &ALL {
            let layout = mode.default_layout();
            assert!(mode.is_complete(&layout));
            let stored = serde_json::to_string(&layout).unwrap();
            assert!(mode.is_complete(&serde_json::from_str(&stored).unwrap()));
            let mut own = panes(&layout);
            own.sort_unstable();
            assert!(own.windows(2).all(|pair| pair[0] != pair[1]), "{own:?}");
            seen.extend(own);
        }
        for panel in &panels::ALL {
            assert!(seen.iter().any(|name| name == panel.name), "{} stands nowhere", panel.name);
        }
    }

    #[test]
    fn layouts_of_other_versions_and_modes_are_recognised() {
        let mut tiles = Tiles::default();
        let unknown = tiles.insert_pane("from the future".to_owned());
        assert!(!Mode::Demo.is_complete(&Tree::new(egui::Id::unique("workbench"), unknown, tiles)));
        assert!(!Mode::Label.is_complete(&Mode::Demo.default_layout()));
    }
}
