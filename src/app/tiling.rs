//! Tiles: the panels of a mode beside each other.

use crate::app::actions::Actions;
use crate::app::features::App;
use crate::app::panels::{self, PanelKind};
use crate::app::theme::colour;
use egui::{Frame, Id, Margin, Ui};
use egui_tiles::{
    Behavior, Container, Linear, LinearDir, ResizeState, SimplificationOptions, TabState, Tile, TileId, Tiles, Tree,
    UiResponse,
};
use palpate_geometry::palette::Theme;

/// Margin of a panel. Its background is that of the window.
pub(super) fn panel_frame(panel: &PanelKind) -> Frame {
    let margin = if panel.name == "view" { Margin::ZERO } else { Margin::same(8) };
    Frame::new().inner_margin(margin)
}

/// Greatest width of the panels at either side (points): beyond, the room is for what stands between them.
const WIDEST_SIDE: f32 = 430.0;
/// Least width of these panels (points), where that is at most the share of the window: a name and a number beside it.
const LEAST_SIDE: f32 = 210.0;
const LEAST_SHARE: f32 = 0.22;

/// Shares of the columns of a layout: as they were, and as they are drawn in a wide or narrow window.
pub(super) struct Shares {
    root: TileId,
    before: Vec<(TileId, f32)>,
    drawn: Vec<(TileId, f32)>,
}

/// Columns of a layout.
fn columns(layout: &mut Tree<String>) -> Option<(TileId, &mut Linear)> {
    let root = layout.root()?;
    match layout.tiles.get_mut(root)? {
        Tile::Container(Container::Linear(linear)) if linear.dir == LinearDir::Horizontal => Some((root, linear)),
        Tile::Container(_) | Tile::Pane(_) => None,
    }
}

/// Narrows the panels at both sides of a wide window, and widens them in a narrow one.
pub(super) fn fit_sides(layout: &mut Tree<String>, width: f32) -> Option<Shares> {
    let (root, linear) = columns(layout)?;
    let [left, middle, right] = <[TileId; 3]>::try_from(linear.children.clone()).ok()?;
    let before: Vec<(TileId, f32)> = [left, middle, right].map(|id| (id, linear.shares[id])).to_vec();
    let total: f32 = before.iter().map(|(_, share)| share).sum();
    let most = total * WIDEST_SIDE / width.max(1.0);
    let least = total * LEAST_SHARE.min(LEAST_SIDE / width.max(1.0));
    let sides = [before[0].1, before[2].1].map(|share| share.max(least).min(most));
    let drawn = vec![(left, sides[0]), (middle, total - sides[0] - sides[1]), (right, sides[1])];
    for (id, share) in &drawn {
        linear.shares.set_share(*id, *share);
    }
    Some(Shares { root, before, drawn })
}

impl Shares {
    /// Puts the shares back, unless they were changed by hand meanwhile: a smaller window has them again.
    pub(super) fn restore(self, layout: &mut Tree<String>) {
        let Some((root, linear)) = columns(layout) else { return };
        if root == self.root && self.drawn.iter().all(|(id, share)| linear.shares[*id] == *share) {
            for (id, share) in self.before {
                linear.shares.set_share(id, share);
            }
        }
    }
}

/// Drawing of all panels: what they read, and where their actions go.
pub(super) struct Tiling<'a> {
    pub(super) app: &'a App,
    pub(super) actions: &'a mut Actions,
    /// Tab chosen in a menu.
    pub(super) chosen: Option<TileId>,
}

impl Tiling<'_> {
    fn theme(&self) -> Theme {
        self.app.view.theme
    }
}

/// Frames in which a bar of tabs is scrolled to its active tab, once that or its room has changed: it first learns how wide its
/// tabs are.
const SETTLES: u32 = 3;

/// Scrolls a bar of tabs to the active one, `[left, right]` of all tabs. The key is the bar, the active tab, and the room for tabs.
fn scroll_to_active(ui: &Ui, key: (TileId, TileId, f32), [left, right]: [f32; 2], scroll: &mut f32) {
    let id = Id::unique(("active tab", key.0));
    let last = ui.data(|data| data.get_temp::<((TileId, TileId, f32), u32)>(id));
    let left_frames = last.filter(|(before, _)| *before == key).map_or(SETTLES, |(_, frames)| frames);
    if left_frames == 0 {
        return;
    }
    *scroll = scroll.max(right - key.2).min(left);
    ui.data_mut(|data| data.insert_temp(id, (key, left_frames - 1)));
    ui.request_repaint();
}

impl Behavior<String> for Tiling<'_> {
    fn tab_title_for_pane(&mut self, pane: &String) -> egui::WidgetText {
        panels::named(pane).map_or(pane.as_str(), |panel| panel.title).into()
    }

    fn pane_ui(&mut self, ui: &mut Ui, _tile: TileId, pane: &mut String) -> UiResponse {
        let Some(panel) = panels::named(pane) else { return UiResponse::None };
        panel_frame(panel).show(ui, |ui| {
            ui.set_min_size(ui.available_size());
            (panel.ui)(ui, self.app, self.actions);
        });
        UiResponse::None
    }

    /// Menu of all tabs, where they do not fit.
    fn top_bar_right_ui(
        &mut self,
        tiles: &Tiles<String>,
        ui: &mut Ui,
        tile: TileId,
        tabs: &egui_tiles::Tabs,
        scroll: &mut f32,
    ) {
        let font = egui::TextStyle::Button.resolve(ui.style());
        let titles: Vec<(TileId, String)> =
            tabs.children.iter().map(|id| (*id, self.tab_title_for_tile(tiles, *id).text().to_owned())).collect();
        let width = |title: &str| {
            let ink = egui::Color32::PLACEHOLDER;
            ui.painter().layout_no_wrap(title.to_owned(), font.clone(), ink).size().x
        };
        let spacing = 2.0 * self.tab_title_spacing(ui.visuals());
        // Right end of each tab.
        let ends: Vec<f32> = titles
            .iter()
            .scan(0.0, |end, (_, title)| {
                *end += width(title) + spacing;
                Some(*end)
            })
            .collect();
        if ends.last().is_none_or(|needed| *needed <= ui.available_width()) {
            return;
        }
        let response = ui.menu_button("⏷", |ui| {
            for (id, title) in &titles {
                if ui.selectable_label(tabs.is_active(*id), title).clicked() {
                    self.chosen = Some(*id);
                    ui.close();
                }
            }
        });
        response.response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, "All tabs"));
        response.response.on_hover_text("All tabs");
        let Some(place) = titles.iter().position(|(id, _)| tabs.is_active(*id)) else { return };
        let start = if place > 0 { ends[place - 1] } else { 0.0 };
        let arrow = self.tab_bar_height(ui.style()) + ui.spacing().item_spacing.x;
        let room = (ui.available_width() - 2.0 * arrow).max(0.0);
        scroll_to_active(ui, (tile, titles[place].0, room), [start, ends[place]], scroll);
        // The bar has an arrow at either side where tabs go on there. The last tab in sight is whole: none ends within a word.
        let left = if *scroll > self.tab_bar_height(ui.style()) { arrow } else { 0.0 };
        let seen = *scroll + ui.available_width() - left;
        let seen = if ends.last().is_some_and(|last| *last > seen) { seen - arrow } else { seen };
        if let Some(end) = ends.iter().rfind(|end| **end <= seen).filter(|end| **end > *scroll) {
            ui.add_space(seen - end);
        }
    }

    fn simplification_options(&self) -> SimplificationOptions {
        SimplificationOptions { all_panes_must_have_tabs: true, ..SimplificationOptions::default() }
    }

    fn gap_width(&self, _style: &egui::Style) -> f32 {
        2.0
    }

    fn min_size(&self) -> f32 {
        70.0
    }

    fn tab_bar_height(&self, _style: &egui::Style) -> f32 {
        26.0
    }

    fn resize_stroke(&self, style: &egui::Style, state: ResizeState) -> egui::Stroke {
        let ink = match state {
            ResizeState::Idle => colour(self.theme().colours().border),
            ResizeState::Hovering => style.visuals.widgets.hovered.fg_stroke.color,
            ResizeState::Dragging => style.visuals.widgets.active.fg_stroke.color,
        };
        egui::Stroke::new(self.gap_width(style), ink)
    }

    fn tab_bar_color(&self, _visuals: &egui::Visuals) -> egui::Color32 {
        colour(self.theme().colours().raised)
    }

    fn tab_bg_color(
        &self,
        _visuals: &egui::Visuals,
        _tiles: &Tiles<String>,
        _tile: TileId,
        state: &TabState,
    ) -> egui::Color32 {
        let colours = self.theme().colours();
        colour(if state.active { colours.background } else { colours.raised })
    }

    fn tab_text_color(
        &self,
        _visuals: &egui::Visuals,
        _tiles: &Tiles<String>,
        _tile: TileId,
        state: &TabState,
    ) -> egui::Color32 {
        let colours = self.theme().colours();
        colour(if state.active { colours.text } else { colours.quiet_text })
    }

    fn tab_outline_stroke(
        &self,
        _visuals: &egui::Visuals,
        _tiles: &Tiles<String>,
        _tile: TileId,
        _state: &TabState,
    ) -> egui::Stroke {
        egui::Stroke::NONE
    }

    fn tab_bar_hline_stroke(&self, _visuals: &egui::Visuals) -> egui::Stroke {
        egui::Stroke::NONE
    }
}
