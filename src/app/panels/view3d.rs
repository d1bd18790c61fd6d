//! 3-D view: drag turns, the right or middle button moves, the wheel zooms, a double click shows everything, Ctrl and drag
//! pulls at the object.

use crate::app::actions::Actions;
use crate::app::contact_path::{path_colour, path_mesh};
use crate::app::export::ExportRequest;
use crate::app::features::App;
use crate::app::features::view::{PathLayer, ViewSource};
use crate::app::icons::{self, Icon};
use crate::app::shown::{DisplayedData, HeldMoment, Moment};
use crate::app::shown_grasp::ShownGrasp;
use crate::app::small_pads::{BUTTONS, small_pads};
use crate::app::theme::{colour, veil};
use crate::app::viewport::{Paint, PictureKey};
use egui::{PointerButton, Pos2, Rect, Sense, Ui};
use glam::{DVec3, Vec2};
use palpate_geometry::drawing::{Align, Camera, Detail, DrawList, Overlay, Shape2, StandardView};
use palpate_geometry::palette::{Rgb, Theme};
use palpate_geometry::units;
use palpate_lab::picture::{PAD_FULL_SCALE, PictureView, Stage, ghost_colour};
use palpate_lab::workers::{Command, GhostGrasp};
use palpate_sim::frame::Frame;
use palpate_sim::gripper::Side;
use palpate_tactile::{Quantity, SignalDefinition};
use std::sync::Arc;

/// What the 3-D view reads.
pub(in crate::app) struct View3d<'a> {
    data: DisplayedData<'a>,
    /// Last grasp of the other engine, where it is drawn.
    ghost: Option<Arc<GhostGrasp>>,
    /// Share of the pixels along each side.
    resolution: f32,
    has_driver: bool,
    /// Time for which the real gripper has sent no readings (s).
    silent_s: Option<u64>,
}

impl<'a> View3d<'a> {
    pub(in crate::app) fn of(app: &'a App) -> Self {
        let (data, ghost) = (app.shown(), app.simulation.ghost(&app.view));
        let (resolution, has_driver) = (app.resolution(), app.driver.is_some());
        Self { data, ghost, resolution, has_driver, silent_s: app.gripper.silent_s() }
    }
}

/// Force of a pull across the height of the picture (N).
const PULL: f64 = 3.0;

/// Height of the inset with the touch in presenter mode, as a share of the picture's.
const PRESENTED: f32 = 0.38;

/// The same where it is enlarged.
const LARGE: f32 = 0.62;

/// Smallest visible change of curvature (1/m): half a millimetre at the tip of a 100 mm finger.
const SEEN_PER_M: f64 = 0.1;

pub(super) fn ui(ui: &mut Ui, own: &View3d<'_>, actions: &mut Actions) {
    let rect = ui.available_rect_before_wrap();
    let response = ui.allocate_rect(rect, Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "3-D view"));
    let Some(moment) = own.data.moment() else {
        return message(ui, rect, own, why_nothing(own));
    };
    if !own.has_driver {
        message(ui, rect, own, "The 3-D view needs a graphics driver. Everything else works without.");
        return;
    }
    let picture = paint(ui, rect, own, moment, 1.0);
    steer(ui, &response, picture.camera, actions);
    small_pads(ui, rect, &own.data, &picture);
    buttons(ui, rect, own, actions);
    if let Some(loading) = own.data.snapshot.and_then(|snapshot| snapshot.status.loading.as_ref()) {
        // Below the buttons.
        let text = format!("Loading {} …", own.data.view.title_of(loading));
        let (font, ink) = (egui::FontId::proportional(14.0), colour(own.data.view.theme.colours().text));
        let galley = ui.painter().layout(text, font, ink, (rect.width() - 24.0).max(60.0));
        let place = rect.center_top() + egui::vec2(-0.5 * galley.size().x, 48.0);
        let ground = Rect::from_min_size(place, galley.size()).expand(4.0);
        ui.painter().rect_filled(ground, 4.0, veil(own.data.view.theme.colours().background, 0.7));
        ui.painter().galley(place, galley, ink);
    }
}

/// Why there is nothing to draw.
fn why_nothing(own: &View3d<'_>) -> &'static str {
    match own.data.source {
        ViewSource::Trial if own.data.opening => "Opening the trial …",
        ViewSource::Trial if own.data.inspected.is_some() => {
            "Nothing to draw: this trial has no poses, and no calibrated flex strip from which the fingers could be \
             reconstructed."
        }
        ViewSource::Trial => "Choose a trial in the library.",
        ViewSource::Simulation | ViewSource::Gripper => "Loading the object …",
    }
}

fn message(ui: &Ui, rect: Rect, own: &View3d<'_>, text: &str) {
    let ink = colour(own.data.view.theme.colours().quiet_text);
    let font = egui::FontId::proportional(15.0);
    let galley = ui.painter().layout(text.to_owned(), font, ink, rect.width() - 24.0);
    ui.painter().galley(rect.center() - 0.5 * galley.size(), galley, ink);
}

/// Moves the camera or pulls at the object by the mouse.
fn steer(ui: &Ui, response: &egui::Response, camera: Camera, actions: &mut Actions) {
    let height = response.rect.height().max(1.0);
    let moved = response.drag_delta() / height;
    let drag = Vec2::new(moved.x, moved.y);
    let (ctrl, shift) = ui.input(|i| (i.modifiers.command, i.modifiers.shift));
    // Releasing the button or Ctrl releases the object.
    let pulling = response.dragged_by(PointerButton::Primary) && ctrl;
    let pulled = ui.data(|data| data.get_temp::<bool>(response.id)).unwrap_or(false);
    if pulled && !pulling {
        actions.push(|app| app.simulation.send(Command::Pull(DVec3::ZERO)));
    }
    ui.data_mut(|data| data.insert_temp(response.id, pulling));
    if pulling {
        let force = pull(response, &camera, height);
        actions.push(move |app| app.simulation.send(Command::Pull(force)));
    } else if response.dragged_by(PointerButton::Primary) && !shift {
        actions.push(move |app| app.view.camera = camera.orbited(drag));
    } else if response.dragged() && drag != Vec2::ZERO {
        actions.push(move |app| app.view.camera = camera.panned(drag));
    }
    if response.hovered() {
        let wheel = ui.input(|i| i.smooth_scroll_delta().y + 60.0 * i.zoom_delta().ln());
        if wheel != 0.0 {
            actions.push(move |app| app.view.camera = camera.zoomed((-wheel * 0.0025).exp()));
        }
    }
    if response.double_clicked() {
        actions.push(App::frame_all);
    }
}

/// Force in the plane of the picture, in proportion to the drag.
fn pull(response: &egui::Response, camera: &Camera, height: f32) -> DVec3 {
    let Some(total) = response.total_drag_delta() else { return DVec3::ZERO };
    let [right, up, _] = camera.axes();
    let along = (right * total.x - up * total.y) / height;
    along.as_dvec3() * PULL
}

/// What a picture of this size shows. A camera that nobody has moved from a standard view shows the whole hand.
fn picture_view(own: &View3d<'_>, moment: Moment<'_>, size: Vec2) -> PictureView {
    let inset = match own.data.source {
        // Nothing is known of where a real gripper touched.
        ViewSource::Gripper => 0.0,
        ViewSource::Trial if own.data.inspected.is_none_or(|own| own.trial.simulated.is_none()) => 0.0,
        ViewSource::Trial | ViewSource::Simulation if own.data.view.presents => PRESENTED,
        ViewSource::Trial | ViewSource::Simulation if own.data.view.inset_large => LARGE,
        ViewSource::Trial | ViewSource::Simulation => PictureView::default().inset,
    };
    // Plots of other signals, or by other sensors, have another curvature than the fingers.
    let reads_strips = own.data.view.sensors.signals == SignalDefinition::Parts && !own.data.reads_like_parts();
    let view = PictureView {
        camera: own.data.view.camera,
        theme: own.data.view.theme,
        size,
        forces: own.data.view.forces,
        plain: own.data.view.presents,
        layout: own.data.view.sensors.sensor_layout().ok(),
        circles: own.data.view.circles && !own.data.view.presents && reads_strips,
        inset,
        ..PictureView::default()
    };
    match own.data.view.standard_view() {
        Some(standard) => PictureView { camera: moment.stage.camera(standard, moment.frame, &view), ..view },
        None => view,
    }
}

/// Draw list of a moment, and the view that it was made for.
struct Drawn {
    list: DrawList,
    view: PictureView,
    /// Time of the ghost's frame (s), and how far its fingers are off (m, share of their length), where one is drawn.
    ghost: Option<(f64, [f64; 2])>,
    /// Curvature of the real fingers, where they are drawn (1/m).
    real: Option<[Option<f64>; 2]>,
}

fn drawn(ctx: &egui::Context, own: &View3d<'_>, moment: Moment<'_>, size: Vec2) -> Drawn {
    let Moment { stage, frame, .. } = moment;
    let shown = ShownGrasp::of(&own.data);
    let last_hold = own.data.last_hold();
    // In presenter mode colours are the same for all objects.
    let own_scale = shown.as_ref().filter(|_| !own.data.view.presents).map_or(PAD_FULL_SCALE, |shown| shown.full_scale);
    let full_scale = last_hold.map_or(own_scale, |held| own_scale.max(held.stage.full_scale_of([&*held.frame])));
    let course = shown.filter(|shown| !shown.frames.is_empty() && frame.world_from_object.is_some());
    let grasp_path = course.and_then(|shown| path_colour(own.data.view.path, &shown).map(|colour| (shown, colour)));
    let path = grasp_path.as_ref().map(|(_, colour)| *colour);
    let view = PictureView { full_scale, path, ..picture_view(own, moment, size) };
    // Beside the real fingers stands the simulation itself, where it is asked for.
    let ghost = match own.data.source {
        ViewSource::Gripper => Some(frame).filter(|_| own.data.view.ghost),
        ViewSource::Simulation | ViewSource::Trial => ghost_frame(own.ghost.as_deref(), moment),
    };
    let real = real_curvature(own);
    let mut list = match own.data.source {
        ViewSource::Gripper => stage.draw_real(real.unwrap_or_default(), &view),
        ViewSource::Simulation | ViewSource::Trial => stage.draw(frame, &view),
    };
    if let Some(held) = last_hold {
        stage.add_hold(&mut list, frame, &view, (&held.stage, &held.frame));
    }
    if let Some(ghost) = ghost {
        list.ghosts.extend(stage.ghosts(ghost, own.data.view.theme));
    }
    if let Some((shown, colour)) = &grasp_path {
        let path = stage.path(&path_mesh(ctx, stage, shown, *colour), frame);
        if let Some(inset) = &mut list.inset {
            inset.list.solids.extend(path.clone());
            inset.past = inset.past.map(|past| past ^ frame.t.to_bits());
        }
        list.solids.extend(path);
        Stage::unveil(&mut list, own.data.view.theme);
    }
    Drawn { list, view, ghost: ghost.map(|ghost| (ghost.t, stage.difference(frame, ghost))), real }
}

/// Frame of the other engine at the time of a moment, if it belongs to the same grasp.
fn ghost_frame<'a>(ghost: Option<&'a GhostGrasp>, moment: Moment<'_>) -> Option<&'a Frame> {
    ghost.filter(|ghost| ghost.grasp == moment.grasp)?.at(moment.frame.t)
}

/// Size of exported pictures (points).
const EXPORTED: [u32; 2] = [800, 560];

/// Asks where to save the 3-D view as it stands, or says that there is nothing to draw.
pub(in crate::app) fn save_picture(app: &mut App) -> Result<(), &'static str> {
    let picture = exported(&app.ctx, &View3d::of(app)).ok_or("There is nothing to draw.")?;
    app.files.export(picture);
    Ok(())
}

fn exported(ctx: &egui::Context, own: &View3d<'_>) -> Option<ExportRequest> {
    let moment = own.data.moment()?;
    let badge = match own.data.inspected.filter(|_| own.data.source == ViewSource::Trial) {
        Some(own) => format!("TRIAL {}, {}", own.trial.id, own.trial.source_title().to_uppercase()),
        None => "SIMULATED".to_owned(),
    };
    let Drawn { mut list, view, .. } = drawn(ctx, own, moment, Vec2::from(EXPORTED.map(|side| side as f32)));
    let badged = PictureView { badge: Some(badge), ..view };
    list.overlay = moment.stage.draw(moment.frame, &badged).overlay;
    Some(ExportRequest::View3d(Box::new(list), EXPORTED))
}

/// The picture alone, with letters of a size relative to the usual one; false where there is nothing to draw.
pub(in crate::app) fn picture_ui(ui: &Ui, rect: Rect, own: &View3d<'_>, letters: f32) -> bool {
    match own.data.moment().filter(|_| own.has_driver) {
        Some(moment) => {
            paint(ui, rect, own, moment, letters);
            true
        }
        None => false,
    }
}

/// Draws the picture, with letters of a size relative to the usual one; returns what it was drawn by.
fn paint(ui: &Ui, rect: Rect, own: &View3d<'_>, moment: Moment<'_>, letters: f32) -> PictureView {
    let size = Vec2::new(rect.width(), rect.height());
    let Drawn { mut list, view, ghost, real } = drawn(ui.ctx(), own, moment, size / letters);
    if own.resolution < 1.0 {
        list.detail = Detail::Fast;
        list.inset.iter_mut().for_each(|inset| inset.list.detail = Detail::Fast);
    }
    let per_point = own.resolution * ui.ctx().pixels_per_point();
    let pixels = [rect.width(), rect.height()].map(|side| (side * per_point).round().max(1.0) as u32);
    let pixels_per_point = per_point * letters;
    let (grasp, sample) = (moment.grasp, moment.frame.t);
    let off = ghost.map(|(_, off)| off);
    let ghost = ghost.map(|(t, _)| t);
    let key = PictureKey { grasp, sample, ghost, real, view: view.clone(), pixels, pixels_per_point };
    let theme = own.data.view.theme;
    let (caption, ghosted) = caption(own, &key, off);
    // Texts keep their sharpness where the picture has fewer pixels.
    let mut overlays = vec![(rect.min, std::mem::take(&mut list.overlay))];
    if let Some(inset) = &mut list.inset {
        let corner = rect.min + letters * egui::vec2(inset.corner.x, inset.corner.y);
        overlays.push((corner, std::mem::take(&mut inset.list.overlay)));
    }
    ui.painter().add(egui_wgpu::Callback::new_paint_callback(rect, Paint { key, list }));
    for (corner, overlay) in overlays {
        overlay_ui(&ui.painter().with_clip_rect(rect), corner, &overlay, letters);
    }
    // Presenter mode says it in its own words.
    let covers = caption == INVITATION && rect.width() < INVITED;
    if !caption.is_empty() && letters == 1.0 && !covers {
        caption_ui(ui, rect, theme, caption, ghosted);
    }
    view
}

/// Line of the first start.
const INVITATION: &str = "Drop an object of yours here (URDF, OBJ or STL): it is grasped and learned";
/// Least width of the picture in which that is one line, below the object (points).
const INVITED: f32 = 700.0;

/// Times closer than this are one (s).
const SOON: f64 = 1e-6;

/// What is said about an object that is shown in the hand or beside it, at a time (s) in or before the hold: one that is lost
/// by the end of the hold is shown before.
fn held_words(in_hand: bool, t: f64, [from, to]: [f64; 2]) -> &'static str {
    match in_hand {
        false => "Nothing is held",
        true if t < from - SOON => "Not held: shown as it was pressed most",
        true if t < to - SOON => "Not held to the end: shown as it was pressed most",
        true => "As it was held",
    }
}

/// What is said about a picture, and the colour of the ghost in it.
fn caption(own: &View3d<'_>, key: &PictureKey, off: Option<[f64; 2]>) -> (String, Option<Rgb>) {
    let theme = own.data.view.theme;
    let held = own.data.held_s().map(|t| {
        let touched = own.data.moment().is_none_or(|now| now.stage.force_on_object(now.frame).is_some());
        let hold = own.data.hold().unwrap_or([t, t]);
        // Fingers may touch a support close to the object.
        let nothing_held = own.data.recognised().is_some_and(|recognised| recognised.nothing_held);
        let words = held_words(touched && !(nothing_held && t >= hold[1] - SOON), t, hold);
        format!("{words}, at {t:.1}{}s", units::SPACE)
    });
    if let Some(inspected) = own.data.shown_trial() {
        let lost = held.filter(|_| inspected.trial.nothing_held()).map(|held| held + ".");
        // Otherwise the time bar tells the time.
        let sensors = own.data.view.sensors.sensors.name();
        let through = own.data.reads_like_parts();
        let through = through.then(|| format!("As simulated; the curves are what {sensors} sensors read."));
        let remarks = inspected.trial.remarks.iter().cloned();
        let said: Vec<String> = lost.into_iter().chain(remarks).chain(through).collect();
        return (said.join(" "), None);
    }
    if own.data.source == ViewSource::Gripper {
        let is_emulated = own.data.board().is_some_and(|board| board.emulated);
        let fingers = if is_emulated { "emulated fingers" } else { "real fingers" };
        let text = match (own.silent_s, key.real) {
            (_, None) => "The fingers are not drawn: their flex strips are not calibrated".to_owned(),
            (Some(silent_s), _) => format!("No readings for {silent_s}\u{a0}s: {fingers} as last read"),
            (None, _) => {
                let at =
                    own.data.playback.cursor_s.map_or_else(String::new, |t| format!(", at {t:.1}{}s", units::SPACE));
                format!("{}, as their flex strips read{at}", units::capital(fingers))
            }
        };
        match key.ghost {
            Some(_) => (format!("{text}. Translucent: the simulation"), Some(ghost_colour(theme))),
            None => (text, None),
        }
    } else if key.ghost.is_some() {
        let engine = own.data.scene.solver.engine.other().name();
        let off = off.map_or_else(String::new, |[far, share]| {
            let (far, share) = (units::shown(units::mm(far), "mm"), 100.0 * share);
            format!(": its fingers differ by up to {far}, {share:.1}{}% of their length", units::SPACE)
        });
        let texts: Vec<String> =
            std::iter::once(format!("The same grasp by the engine {engine}{off}")).chain(held).collect();
        (texts.join(". "), Some(ghost_colour(theme)))
    } else {
        let begins = own.data.view.recent.is_empty() && own.data.source == ViewSource::Simulation;
        let last = own.data.last_hold().and_then(last_hold_words);
        (held.or(last).or_else(|| begins.then(|| INVITATION.to_owned())).unwrap_or_default(), None)
    }
}

/// Force of each finger in the last hold.
pub(in crate::app) fn last_hold_words(held: &HeldMoment) -> Option<String> {
    let forces = Side::BOTH.into_iter().zip(held.stage.finger_forces(&held.frame));
    let of_side = |(side, force): (Side, Option<f64>)| {
        let letter = side.name().get(..1)?.to_uppercase();
        Some(format!("{letter} {}", units::shown(force?, "N")))
    };
    let words: Vec<String> = forces.filter_map(of_side).collect();
    (!words.is_empty()).then(|| format!("Last hold: {}", words.join(", ")))
}

/// Paints annotations over the picture, with letters of a size relative to the usual one.
fn overlay_ui(painter: &egui::Painter, corner: Pos2, overlay: &Overlay, letters: f32) {
    let at = |place: Vec2| corner + letters * egui::vec2(place.x, place.y);
    for shape in &overlay.shapes {
        match shape {
            Shape2::Line { from, to, width, colour, opacity } => {
                painter.line_segment([at(*from), at(*to)], (letters * width, veil(*colour, *opacity)));
            }
            Shape2::Rectangle { min, max, colours, opacity } => {
                let [left, right] = colours.map(|colour| veil(colour, *opacity));
                let place = Rect::from_min_max(at(*min), at(*max));
                let mut mesh = egui::Mesh::default();
                let corners = [place.left_top(), place.left_bottom(), place.right_top(), place.right_bottom()];
                corners.into_iter().zip([left, left, right, right]).for_each(|(at, ink)| mesh.colored_vertex(at, ink));
                mesh.add_triangle(0, 1, 2);
                mesh.add_triangle(2, 1, 3);
                painter.add(mesh);
            }
            Shape2::Disc { centre, radius, colour: ink } => {
                painter.circle_filled(at(*centre), letters * radius, colour(*ink));
            }
            Shape2::Text { at: place, align, size, colour: ink, text } => {
                let align = match align {
                    Align::Left => egui::Align2::LEFT_CENTER,
                    Align::Centre => egui::Align2::CENTER_CENTER,
                    Align::Right => egui::Align2::RIGHT_CENTER,
                };
                painter.text(at(*place), align, text, egui::FontId::proportional(letters * size), colour(*ink));
            }
        }
    }
}

/// Width of axes and scale bar at the foot of the picture, with the gaps (points).
const BESIDE: f32 = 216.0;

/// A line at the foot of the picture, between axes and scale bar; of a ghost with its colour.
fn caption_ui(ui: &Ui, rect: Rect, theme: Theme, text: String, ghost: Option<Rgb>) {
    let ink = colour(theme.colours().text);
    let swatch = if ghost.is_some() { 18.0 } else { 0.0 };
    let width = (rect.width() - BESIDE).max(80.0);
    let galley = ui.painter().layout(text, egui::FontId::proportional(12.0), ink, width);
    let size = galley.size() + egui::vec2(swatch, 0.0);
    // Below the fingers and their arrows.
    let middle = rect.center_bottom() - egui::vec2(0.0, 0.5 * size.y + 8.0);
    let ground = Rect::from_center_size(middle, size).expand(4.0);
    ui.painter().rect_filled(ground, 4.0, veil(theme.colours().background, 0.7));
    if let Some(ghost) = ghost {
        let square = Rect::from_min_size(ground.min + egui::vec2(4.0, 6.0), egui::vec2(12.0, 12.0));
        ui.painter().rect_filled(square, 2.0, colour(ghost));
    }
    ui.painter().galley(ground.min + egui::vec2(4.0 + swatch, 4.0), galley, ink);
}

/// Curvature of the real fingers (1/m), while they are shown.
fn real_curvature(own: &View3d<'_>) -> Option<[Option<f64>; 2]> {
    let estimate = &own.data.gripper?.latest.as_ref()?.estimate;
    let past = own.data.looks_back().then(|| ShownGrasp::of(&own.data)).flatten();
    // In invisible steps, so that noise alone does not redraw the picture.
    let seen = |kappa: f64| (kappa / SEEN_PER_M).round() * SEEN_PER_M;
    let curvature = Side::BOTH.map(|side| {
        let now = || estimate.curvature(side);
        past.as_ref().map_or_else(now, |past| past.read(Quantity::Curvature, side)).map(seen)
    });
    (own.data.source == ViewSource::Gripper && curvature.iter().any(Option::is_some)).then_some(curvature)
}

/// Standard views and switches, in the upper left corner; in a menu where there is no room.
fn buttons(ui: &mut Ui, rect: Rect, own: &View3d<'_>, actions: &mut Actions) {
    let place = Rect::from_min_size(rect.min + egui::vec2(10.0, 10.0), egui::vec2(rect.width() - 20.0, 26.0));
    let layout = egui::Layout::left_to_right(egui::Align::Center);
    let mut bar = ui.new_child(egui::UiBuilder::new().max_rect(place).layout(layout));
    bar.spacing_mut().item_spacing.x = 4.0;
    if rect.width() < BUTTONS {
        let menu = bar.menu_button("View", |ui| {
            for Switch { name, hint, on, act, .. } in switches(own) {
                actions.on(&ui.selectable_label(on, name).on_hover_text(hint), act);
            }
            let large = ui.selectable_label(own.data.view.inset_large, "Large inset");
            let large = large.on_hover_text("Enlarge the picture of the touch (I)");
            actions.on(&large, App::enlarge_touch);
        });
        menu.response.on_hover_text("Standard views, parallel projection, forces, ghost");
    } else {
        // Legible on whatever comes near.
        let behind = ui.painter().add(egui::Shape::Noop);
        for (k, Switch { icon, name, hint, on, act }) in switches(own).into_iter().enumerate() {
            // Camera, and what is drawn.
            if k == CAMERA {
                bar.separator();
            }
            actions.on(&icons::toggle(&mut bar, icon, on, name, &hint), act);
        }
        let ground = veil(own.data.view.theme.colours().background, 0.6);
        ui.painter().set(behind, egui::Shape::rect_filled(bar.min_rect().expand(3.0), 4.0, ground));
    }
}

/// A button of the view.
struct Switch {
    icon: Icon,
    name: &'static str,
    hint: String,
    on: bool,
    act: Box<dyn FnOnce(&mut App)>,
}

/// Number of switches of the camera, which come first.
const CAMERA: usize = 5;

fn switches(own: &View3d<'_>) -> Vec<Switch> {
    let view = own.data.view;
    let now = view.standard_view();
    let standard = [
        (StandardView::Home, Icon::Home, "Home", "double click, Shift+Z"),
        (StandardView::Front, Icon::Front, "Front", "Alt+1"),
        (StandardView::Right, Icon::Right, "Right", "Alt+3"),
        (StandardView::Top, Icon::Top, "Top", "Alt+7"),
    ];
    let turn = |(standard, icon, name, key): (StandardView, Icon, &'static str, &str)| {
        let camera = view.camera;
        let act = Box::new(move |app: &mut App| {
            app.view.camera = camera.turned_to(standard);
            if standard == StandardView::Home {
                app.frame_all();
            }
        });
        Switch { icon, name, hint: format!("{name} view ({key})"), on: now == Some(standard), act }
    };
    let switch = |icon, name, hint: &str, on, act: fn(&mut App)| Switch {
        icon,
        name,
        hint: hint.to_owned(),
        on,
        act: Box::new(act),
    };
    let other = own.data.scene.solver.engine.other().name();
    let ghost = format!("Ghost: result of the other engine, {other}, translucent (G)");
    let path = "Contact path on the object, by time or by pressure; the fingers become translucent (C)";
    let mut all: Vec<Switch> = standard.map(turn).into();
    all.extend([
        switch(Icon::Parallel, "Parallel", "Parallel projection (Alt+5)", view.camera.parallel, |app| {
            app.view.camera.parallel = !app.view.camera.parallel;
        }),
        switch(Icon::Force, "Forces", "Force arrows (F)", view.forces, |app| app.view.forces = !app.view.forces),
        switch(
            Icon::Circle,
            "Circles",
            "The circle that each flex strip reads, with its curvature (O)",
            view.circles,
            |app| app.view.circles = !app.view.circles,
        ),
        switch(Icon::Path, view.path.title(), path, view.path != PathLayer::Off, |app| {
            app.view.path = app.view.path.next();
        }),
        switch(Icon::Ghost, "Ghost", &ghost, view.ghost, |app| app.set_ghost(!app.view.ghost)),
    ]);
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_geometry::Pose;
    use palpate_lab::grasping::grasp;
    use palpate_sim::scene::Scene;

    #[test]
    fn the_ghost_is_that_of_the_time_shown() {
        let scene = Scene::default();
        let frames = grasp(&scene, None, 0).frames().to_vec();
        let held = frames[frames.len() / 2].clone();
        let ghost = GhostGrasp { grasp: 7, engine: scene.solver.engine.other(), frames };
        let stage = Stage::new(&scene, None, Pose::IDENTITY);
        let moment = |grasp| Moment { grasp, stage: &stage, frame: &held };
        assert_eq!(ghost_frame(Some(&ghost), moment(7)).map(|frame| frame.t), Some(held.t));
        assert_eq!(ghost_frame(Some(&ghost), moment(8)), None);
    }

    #[test]
    fn an_object_that_was_lost_was_not_held() {
        let hold = [2.0, 3.0];
        assert_eq!(held_words(true, 3.0, hold), "As it was held");
        assert_eq!(held_words(false, 3.0, hold), "Nothing is held");
        assert_eq!(held_words(true, 0.0, hold), "Not held: shown as it was pressed most");
        assert_eq!(held_words(true, 2.5, hold), "Not held to the end: shown as it was pressed most");
    }
}
