//! Modes of the window: the same data, other panels and keys. To add one, add its name to [`Mode`], a file with its
//! [`ModeKind`], and a line in [`ALL`].

mod demo;
mod inspect;
mod label;
mod study;

use crate::app::actions::Act;
use crate::app::features::App;
use crate::app::features::view::Mode;
use egui_tiles::{Linear, LinearDir, Tile, TileId, Tiles, Tree};

/// Kind of a mode.
pub(super) struct ModeKind {
    pub(super) mode: Mode,
    /// Title of its tab.
    pub(super) title: &'static str,
    /// Hint on its tab.
    pub(super) about: &'static str,
    /// Lays out its panels.
    layout: fn(&mut Tiles<String>) -> TileId,
    /// Key that opens it.
    pub(super) open: Act,
    /// Keys that act in it alone.
    pub(super) keys: &'static [Act],
    /// Its search field: whether it waits for the keyboard, and what takes text that is typed ahead of it.
    pub(super) search: Option<SearchField>,
}

type SearchField = (fn(&App) -> bool, fn(&mut App, String));

/// All modes, in the order of their tabs.
pub(super) static ALL: [ModeKind; 4] = [demo::KIND, inspect::KIND, label::KIND, study::KIND];

/// Kind of a mode.
pub(super) fn kind(mode: Mode) -> &'static ModeKind {
    ALL.iter().find(|kind| kind.mode == mode).unwrap_or(&ALL[0])
}

/// Default layout of a mode.
pub(super) fn default_layout(mode: Mode) -> Tree<String> {
    let mut tiles = Tiles::default();
    let root = (kind(mode).layout)(&mut tiles);
    Tree::new(egui::Id::unique(("workbench", mode)), root, tiles)
}

/// True when a stored layout has every panel of the mode, and no other.
pub(super) fn is_complete(mode: Mode, layout: &Tree<String>) -> bool {
    let (mut own, mut found) = (panes(&default_layout(mode)), panes(layout));
    own.sort_unstable();
    found.sort_unstable();
    layout.root().is_some() && own == found
}

fn panes(layout: &Tree<String>) -> Vec<String> {
    let pane = |tile: &Tile<String>| match tile {
        Tile::Pane(name) => Some(name.clone()),
        Tile::Container(_) => None,
    };
    layout.tiles.tiles().filter_map(pane).collect()
}

/// Panels as tabs.
fn tabs(tiles: &mut Tiles<String>, names: &[&str]) -> TileId {
    let panes = names.iter().map(|name| tiles.insert_pane((*name).to_owned())).collect::<Vec<TileId>>();
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::panels;

    #[test]
    fn every_panel_is_in_a_mode_and_no_mode_has_one_twice() {
        let mut seen = Vec::new();
        for ModeKind { mode, .. } in &ALL {
            let layout = default_layout(*mode);
            assert!(is_complete(*mode, &layout));
            let stored = serde_json::to_string(&layout).unwrap();
            assert!(is_complete(*mode, &serde_json::from_str(&stored).unwrap()));
            let mut own = panes(&layout);
            own.sort_unstable();
            assert!(own.windows(2).all(|pair| pair[0] != pair[1]), "{own:?}");
            assert!(own.iter().all(|name| panels::named(name).is_some()), "{own:?}");
            seen.extend(own);
        }
        for panel in &panels::ALL {
            assert!(seen.iter().any(|name| name == panel.name), "{} is in no mode", panel.name);
        }
    }

    #[test]
    fn layouts_of_other_versions_and_modes_are_recognised() {
        let mut tiles = Tiles::default();
        let unknown = tiles.insert_pane("from the future".to_owned());
        assert!(!is_complete(Mode::Demo, &Tree::new(egui::Id::unique("workbench"), unknown, tiles)));
        assert!(!is_complete(Mode::Label, &default_layout(Mode::Demo)));
    }
}
