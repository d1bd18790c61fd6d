//! Objects to grasp: built-in ones, the empty hand, and files.

use crate::app::actions::Actions;
use crate::app::features::App;
use crate::app::theme::{self, colour};
use crate::app::thumbnails::Thumbnails;
use crate::app::widgets::{selectable_row, text_field};
use egui::{Align, Layout, RichText, ScrollArea, Sense, Ui};
use palpate_lab::grasping::{is_doubtful, lesson_warning};
use palpate_learn::Lesson;
use palpate_sim::objects::{EMPTY, catalogue};
use std::ffi::OsStr;
use std::path::Path;

/// Side of a thumbnail (points).
const THUMBNAIL: f32 = 40.0;

pub(super) fn ui<'a>(
    ui: &mut Ui,
    (chosen, loaded, recent): (&str, &str, &[String]),
    (title_of, learned_as): (impl Fn(&str) -> String, impl Fn(&str) -> Option<(&'a str, Option<&'a Lesson>)>),
    pictures: &Thumbnails,
    actions: &mut Actions,
) {
    // A choice made elsewhere comes into sight.
    let seen = egui::Id::unique("object seen");
    let before = ui.data(|data| data.get_temp::<String>(seen));
    let moved = before.as_deref() != Some(chosen);
    let follow = |is_chosen: bool, row: &egui::Response| {
        // Its row may come later than the object.
        if is_chosen && moved {
            row.ctx.data_mut(|data| data.insert_temp(seen, chosen.to_owned()));
            if before.is_some() {
                row.scroll_to_me(None);
            }
        }
    };
    open_row(ui, loaded, actions);
    ui.add_space(2.0);
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        for path in recent {
            let texture = pictures.get(path);
            let class = learned_as(path);
            let title = title_of(path);
            let learned = match class {
                Some((_, Some(lesson))) => {
                    let doubt = match is_doubtful(lesson) {
                        true => ", poorly",
                        false if lesson_warning(lesson).is_some() => ", often not held",
                        false => "",
                    };
                    let Lesson { recognised, tested, after_three, .. } = lesson;
                    match after_three {
                        Some(right) => format!("learned: {right} of {tested} right after three grasps{doubt}, "),
                        None => format!("learned: {recognised} of {tested} right{doubt}, "),
                    }
                }
                Some((_, None)) => "learned, ".to_owned(),
                None => String::new(),
            };
            let clicked = row(ui, chosen == path, texture, &title, &format!("{learned}{path}"));
            follow(chosen == path, &clicked);
            let source = path.clone();
            if class.is_some() {
                clicked.context_menu(|ui| {
                    let [named, forgotten] = [source.clone(), source.clone()];
                    actions.on(&ui.button("Rename …"), move |app| app.ask_for_name(&named));
                    actions.on(&ui.button("Forget"), move |app| app.forget_object(&forgotten));
                });
            }
            actions.on(&clicked, move |app| app.open(&source));
        }
        for built_in in catalogue() {
            let texture = pictures.get(&built_in.name);
            let class = built_in.class().to_string();
            let clicked = row(ui, chosen == built_in.name, texture, &built_in.title, &class);
            follow(chosen == built_in.name, &clicked);
            actions.on(&clicked, |app| app.open(&built_in.name));
        }
        let clicked = row(ui, chosen == EMPTY, None, "Empty hand", "nothing to grasp");
        follow(chosen == EMPTY, &clicked);
        actions.on(&clicked, |app| app.open(EMPTY));
    });
}

/// Button and field for files.
fn open_row(ui: &mut Ui, loaded: &str, actions: &mut Actions) {
    let open = ui.add_sized([ui.available_width(), 28.0], egui::Button::new("Open URDF, OBJ, STL …").truncate());
    actions.on(&open.on_hover_text("Ctrl+O, or drop a file anywhere on the window"), App::ask_for_object);
    let id = egui::Id::unique("object path");
    let mut path = ui.data(|data| data.get_temp::<String>(id)).unwrap_or_default();
    let field = text_field(&mut path, id.with("field")).hint_text("… or paste a path");
    let response = ui.add(field);
    if response.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter)) && !path.trim().is_empty() {
        let source = path.trim().trim_matches(['"', '\'']).to_owned();
        // Where the file cannot be opened, its path can be corrected; the next letters are no keys.
        response.request_focus();
        actions.push(move |app| app.open(&source));
    }
    // Once it is open, keys are keys again.
    let before = ui.data_mut(|data| data.get_temp_mut_or_default::<String>(id.with("loaded")).clone());
    if before != loaded {
        ui.data_mut(|data| data.insert_temp(id.with("loaded"), loaded.to_owned()));
        let name_of = |path: &str| Path::new(path.trim().trim_matches(['"', '\''])).file_name().map(OsStr::to_owned);
        if name_of(&path) == name_of(loaded) {
            path.clear();
            response.surrender_focus();
        }
    }
    ui.data_mut(|data| data.insert_temp(id, path));
}

/// Row of an object: picture, title, and a line below.
fn row(ui: &mut Ui, chosen: bool, texture: Option<&egui::TextureHandle>, title: &str, below: &str) -> egui::Response {
    let colours = theme::of(ui).colours();
    let (rect, response) = selectable_row(ui, THUMBNAIL + 6.0, chosen, title);
    let mut inside = ui.new_child(
        egui::UiBuilder::new()
            .max_rect(rect.shrink2(egui::vec2(4.0, 3.0)))
            .layout(Layout::left_to_right(Align::Center)),
    );
    inside.set_clip_rect(rect.intersect(ui.clip_rect()));
    match texture {
        Some(texture) => {
            let picture = egui::Image::new(texture).alt_text(format!("Picture of {title}"));
            inside.add(picture.fit_to_exact_size(egui::vec2(THUMBNAIL, THUMBNAIL)).corner_radius(4.0));
        }
        None => {
            let (place, _) = inside.allocate_exact_size(egui::vec2(THUMBNAIL, THUMBNAIL), Sense::hover());
            inside.painter().rect_stroke(
                place.shrink(6.0),
                4.0,
                egui::Stroke::new(1.5, colour(colours.border)),
                egui::StrokeKind::Inside,
            );
        }
    }
    inside.vertical(|ui| {
        ui.spacing_mut().item_spacing.y = 0.0;
        ui.add_space(4.0);
        ui.add(egui::Label::new(title).truncate().selectable(false));
        let quiet = RichText::new(below).small().color(colour(colours.quiet_text));
        ui.add(egui::Label::new(quiet).truncate().selectable(false));
    });
    // Narrow panels cut it off.
    response.on_hover_text(format!("{title}\n{below}"))
}
