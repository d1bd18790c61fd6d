//! Main settings of the scene. Each change restarts the grasp; a scene file can set all of them.

mod accuracy_dial;

use crate::app::actions::Actions;
use crate::app::features::App;
use crate::app::features::simulation::SimulationFeature;
use crate::app::widgets::number_field;
use egui::{CollapsingHeader, DragValue, Grid, ScrollArea, Ui};
use palpate_geometry::units::SPACE;
use palpate_sim::gripper::{Finger, PadLaw, Sideways};
use palpate_sim::scene::{Auto, EngineKind, Faces, PRESETS, PoseSpread, SCENES, Scene, SupportKind};

pub(super) fn ui(ui: &mut Ui, simulation: &SimulationFeature, actions: &mut Actions) {
    let mut scene = simulation.scene.clone();
    ScrollArea::both().auto_shrink(false).show(ui, |ui| {
        section(ui, "Object", true, |ui| object_ui(ui, &mut scene, simulation));
        section(ui, "Accuracy", true, |ui| solver_ui(ui, &mut scene, simulation, actions));
        section(ui, "Gripper pose", true, |ui| pose_ui(ui, &mut scene));
        section(ui, "Programme", true, |ui| programme_ui(ui, &mut scene));
        section(ui, "Finger", false, |ui| finger_ui(ui, &mut scene));
        section(ui, "Pad", false, |ui| pad_ui(ui, &mut scene));
        section(ui, "Support", false, |ui| support_ui(ui, &mut scene));
        ui.add_space(4.0);
        named_scenes_ui(ui, &mut scene);
        ui.horizontal_wrapped(|ui| {
            actions.on(&ui.button("Save scene …").on_hover_text("As a TOML file (Ctrl+S)"), App::save_scene);
            if ui.button("Reset all").on_hover_text("All settings as at first; the object stays").clicked() {
                let (source, name) = (std::mem::take(&mut scene.object.source), scene.object.name.take());
                scene = Scene::default();
                (scene.object.source, scene.object.name) = (source, name);
            }
        });
    });
    if scene != simulation.scene {
        actions.push(|app| app.set_scene(scene));
    }
}

/// Scenes with a name; each keeps the object, its poses and the solver.
fn named_scenes_ui(ui: &mut Ui, scene: &mut Scene) {
    ui.horizontal_wrapped(|ui| {
        ui.label("Settings of");
        for named in SCENES {
            let applied = named.applied_to(scene);
            let chosen = applied == *scene;
            if ui.selectable_label(chosen, named.name).on_hover_text(named.about()).clicked() && !chosen {
                *scene = applied;
            }
        }
    });
}

fn section(ui: &mut Ui, title: &str, open: bool, contents: impl FnOnce(&mut Ui)) {
    // Without indentation and with one width of names, all sections have the same columns.
    CollapsingHeader::new(title).default_open(open).show_unindented(ui, |ui| {
        ui.spacing_mut().interact_size.x = NUMBER;
        // Names are those of numbers in other sections, too.
        ui.push_id(title, |ui| {
            Grid::new(title).num_columns(2).min_col_width(NAME).spacing([6.0, 5.0]).show(ui, contents);
        });
    });
}

/// Width of the column of names, and of numbers and choices at most (points).
const NAME: f32 = 84.0;
const NUMBER: f32 = 88.0;
const CHOICE: f32 = 140.0;
/// Least width of choices: that of the longest.
const LEAST_CHOICE: f32 = 96.0;
/// Room for the scroll bar (points).
const BAR: f32 = 10.0;

/// Number in another unit than the scene's. The range limits what the user enters; a value outside of it is shown and
/// kept.
struct Number<'a> {
    name: &'a str,
    unit: &'a str,
    /// Shown value per stored value.
    factor: f64,
    range: [f64; 2],
    speed: f64,
}

impl Number<'_> {
    fn ui(&self, ui: &mut Ui, value: &mut f64) {
        let label = ui.label(self.name);
        let mut shown = *value * self.factor;
        let drag = DragValue::new(&mut shown)
            .range(self.range[0]..=self.range[1])
            .clamp_existing_to_range(false)
            .speed(self.speed)
            .max_decimals(3)
            .suffix(format!("{SPACE}{}", self.unit));
        if number_field(ui, self.name, drag).labelled_by(label.id).changed() {
            *value = shown / self.factor;
        }
        ui.end_row();
    }
}

/// Number that defaults to the object's own.
fn automatic(ui: &mut Ui, number: &Number<'_>, value: &mut Auto, known: f64) {
    let label = ui.label(number.name);
    ui.horizontal(|ui| {
        let mut own = value.value().is_some();
        // With its tick as wide as other numbers.
        ui.spacing_mut().interact_size.x = NUMBER - ui.spacing().icon_width - ui.spacing().item_spacing.x;
        let mut shown = value.value().unwrap_or(known) * number.factor;
        let drag = DragValue::new(&mut shown)
            .range(number.range[0]..=number.range[1])
            .clamp_existing_to_range(false)
            .speed(number.speed)
            .max_decimals(3)
            .suffix(format!("{SPACE}{}", number.unit));
        let enabled = |ui: &mut Ui| ui.add_enabled(own, drag);
        if number_field(ui, number.name, enabled).labelled_by(label.id).changed() {
            *value = Auto::Value(shown / number.factor);
        }
        let tick = ui.add(egui::Checkbox::without_text(&mut own)).labelled_by(label.id);
        if tick.on_hover_text("Override the object's own value").changed() {
            *value = if own { Auto::Value(known) } else { Auto::Auto };
        }
    });
    ui.end_row();
}

fn object_ui(ui: &mut Ui, scene: &mut Scene, simulation: &SimulationFeature) {
    let mut fixed = scene.holds_object();
    choice(ui, "support", &mut fixed, &[(false, "free"), (true, "fixed")]);
    if fixed != scene.holds_object() {
        scene.set_object_fixed(fixed);
    }
    let object = &mut scene.object;
    let card = simulation.snapshot.as_ref().and_then(|s| s.object.as_deref());
    let mass = Number { name: "mass", unit: "g", factor: 1e3, range: [0.1, 5000.0], speed: 0.5 };
    automatic(ui, &mass, &mut object.mass, card.map_or(0.05, |c| c.mass));
    let friction = Number { name: "friction", unit: "", factor: 1.0, range: [0.0, 5.0], speed: 0.01 };
    automatic(ui, &friction, &mut object.friction, card.map_or(0.6, |c| c.friction));
    for (axis, name) in ["roll", "pitch", "yaw"].into_iter().enumerate() {
        Number { name, unit: "°", factor: 1.0, range: [-180.0, 180.0], speed: 0.5 }
            .ui(ui, &mut object.rotation_deg[axis]);
    }
    let faces = match scene.pose.faces {
        Faces::Nominal => return,
        Faces::Natural => "resting faces",
        Faces::Any => "any face",
    };
    ui.label("+ random");
    ui.label(faces).on_hover_text("Each grasp turns the object at random, on top of this base pose");
    ui.end_row();
}

/// Random poses by their preset.
fn random_ui(ui: &mut Ui, scene: &mut Scene) {
    let between = scene.pose.between;
    let poses = PRESETS.map(|preset| PoseSpread { between, ..preset.poses() });
    let before = poses.iter().position(|poses| *poses == scene.pose);
    let names = PRESETS.map(|preset| format!("preset {}", preset.name));
    let presets = names.iter().enumerate().map(|(place, name)| (Some(place), name.as_str()));
    let own = before.is_none().then_some((None, "its own"));
    let mut now = before;
    choice(ui, "+ random", &mut now, &presets.chain(own).collect::<Vec<_>>());
    if let Some(poses) = now.filter(|_| now != before).and_then(|place| poses.into_iter().nth(place)) {
        scene.pose = poses;
    }
}

fn pose_ui(ui: &mut Ui, scene: &mut Scene) {
    let mount = &mut scene.gripper.mount;
    for (axis, name) in ["x offset", "y offset", "z offset"].into_iter().enumerate() {
        Number { name, unit: "mm", factor: 1e3, range: [-60.0, 60.0], speed: 0.1 }.ui(ui, &mut mount.offset[axis]);
    }
    Number { name: "yaw", unit: "°", factor: 1.0, range: [-180.0, 180.0], speed: 0.5 }.ui(ui, &mut mount.yaw_deg);
    Number { name: "grasp depth", unit: "mm", factor: 1e3, range: [20.0, 150.0], speed: 0.2 }
        .ui(ui, &mut mount.grasp_depth);
    Number { name: "opening", unit: "mm", factor: 1e3, range: [10.0, 200.0], speed: 0.2 }.ui(ui, &mut mount.opening);
    random_ui(ui, scene);
}

fn programme_ui(ui: &mut Ui, scene: &mut Scene) {
    let max = scene.gripper.actuation.max_bar;
    let step = scene.gripper.actuation.step_bar;
    let per_s = f64::from(scene.timing.actuation_hz.max(1));
    let programme = &mut scene.programme;
    Number { name: "peak", unit: "bar", factor: 1.0, range: [0.0, max], speed: 0.01 }.ui(ui, &mut programme.peak_bar);
    let rates = [step * per_s, max * per_s];
    Number { name: "closing", unit: "bar/s", factor: per_s, range: rates, speed: 0.05 }
        .ui(ui, &mut programme.close_bar_per_tick);
    // Stored in whole actuation ticks.
    let mut hold = f64::from(programme.hold_ticks);
    Number { name: "hold", unit: "s", factor: 1.0 / per_s, range: [0.0, 600.0 / per_s], speed: 0.05 }.ui(ui, &mut hold);
    programme.hold_ticks = hold.round() as u32;
    Number { name: "releasing", unit: "bar/s", factor: per_s, range: rates, speed: 0.05 }
        .ui(ui, &mut programme.release_bar_per_tick);
    Number { name: "trial", unit: "s", factor: 1.0, range: [0.1, 60.0], speed: 0.02 }
        .ui(ui, &mut scene.timing.duration_s);
}

fn solver_ui(ui: &mut Ui, scene: &mut Scene, simulation: &SimulationFeature, actions: &mut Actions) {
    let engines = EngineKind::ALL.map(|engine| (engine, engine.name()));
    choice(ui, "engine", &mut scene.solver.engine, &engines);
    accuracy_dial::rows(ui, scene, simulation, actions);
    let label = ui.label("sampling");
    let rate = DragValue::new(&mut scene.timing.sample_hz);
    let rate = rate.range(1..=1000).clamp_existing_to_range(false).suffix("\u{a0}Hz");
    number_field(ui, "sampling", rate).labelled_by(label.id);
    ui.end_row();
}

fn finger_ui(ui: &mut Ui, scene: &mut Scene) {
    let pad_thickness = scene.gripper.pad.thickness;
    let finger = &mut scene.gripper.finger;
    let label = ui.label("joints");
    let range = Finger::FEWEST_JOINTS as usize..=Finger::MOST_JOINTS as usize;
    number_field(ui, "joints", DragValue::new(&mut finger.joints).range(range).speed(0.1)).labelled_by(label.id);
    ui.end_row();
    Number { name: "length", unit: "mm", factor: 1e3, range: [20.0, 300.0], speed: 0.2 }.ui(ui, &mut finger.length);
    Number { name: "stiffness EI", unit: "N·cm²", factor: 1e4, range: [0.1, 10_000.0], speed: 0.2 }
        .ui(ui, &mut finger.bending_stiffness);
    Number { name: "mass", unit: "g", factor: 1e3, range: [0.1, 500.0], speed: 0.2 }.ui(ui, &mut finger.mass);
    Number { name: "relaxation", unit: "ms", factor: 1e3, range: [0.0, 1000.0], speed: 0.5 }
        .ui(ui, &mut finger.damping_time);
    sideways_ui(ui, finger, pad_thickness);
}

/// Rigid out of the plane, or the two stiffnesses; a solid section to begin with.
fn sideways_ui(ui: &mut Ui, finger: &mut Finger, pad_thickness: f64) {
    let mut bends = finger.sideways.stiffness().is_some();
    choice(ui, "out of plane", &mut bends, &[(false, "rigid"), (true, "bends and twists")]);
    if bends != finger.sideways.stiffness().is_some() {
        finger.sideways = if bends { finger.of_solid_section(pad_thickness) } else { Sideways::default() };
    }
    let Sideways { bending_stiffness, torsional_stiffness } = &mut finger.sideways;
    for (name, stiffness) in [("sideways EI", bending_stiffness), ("torsion GJ", torsional_stiffness)] {
        if let Auto::Value(stiffness) = stiffness {
            Number { name, unit: "N·cm²", factor: 1e4, range: [0.1, 10_000.0], speed: 0.2 }.ui(ui, stiffness);
        }
    }
}

fn pad_ui(ui: &mut Ui, scene: &mut Scene) {
    let pad = &mut scene.gripper.pad;
    choice(ui, "law", &mut pad.law, &[(PadLaw::NeoHookean, "neo-Hookean"), (PadLaw::Linear, "linear")]);
    Number { name: "modulus", unit: "kPa", factor: 1e-3, range: [1.0, 10_000.0], speed: 1.0 }.ui(ui, &mut pad.modulus);
    Number { name: "friction", unit: "", factor: 1.0, range: [0.0, 5.0], speed: 0.01 }.ui(ui, &mut pad.friction);
    Number { name: "thickness", unit: "mm", factor: 1e3, range: [1.0, 30.0], speed: 0.05 }.ui(ui, &mut pad.thickness);
}

fn support_ui(ui: &mut Ui, scene: &mut Scene) {
    let kinds = [(SupportKind::Pedestal, "pedestal"), (SupportKind::Table, "table"), (SupportKind::None, "none")];
    choice(ui, "stands on", &mut scene.support.kind, &kinds);
    Number { name: "height", unit: "mm", factor: 1e3, range: [0.0, 300.0], speed: 0.2 }
        .ui(ui, &mut scene.support.height);
    Number { name: "radius", unit: "mm", factor: 1e3, range: [1.0, 100.0], speed: 0.05 }
        .ui(ui, &mut scene.support.radius);
    Number { name: "gravity", unit: "m/s²", factor: 1.0, range: [0.0, 30.0], speed: 0.02 }
        .ui(ui, &mut scene.world.gravity);
}

/// Choice by name, as a row of a grid.
fn choice<T: PartialEq + Copy>(ui: &mut Ui, name: &str, value: &mut T, all: &[(T, &str)]) {
    let label = ui.label(name);
    // A grid remembers how wide it was.
    let in_sight = ui.clip_rect().right() - ui.cursor().left() - BAR;
    let width = ui.available_width().min(CHOICE).min(in_sight).max(LEAST_CHOICE);
    // Explanations after a comma are shown in the list only.
    let text = all.iter().find(|(each, _)| each == value).map_or("", |(_, text)| *text);
    let shown = text.split(", ").next().unwrap_or(text);
    egui::ComboBox::from_id_salt(name)
        .selected_text(shown)
        .width(width)
        .truncate()
        .show_ui(ui, |ui| {
            for (each, text) in all {
                ui.selectable_value(value, *each, *text);
            }
        })
        .response
        .labelled_by(label.id);
    ui.end_row();
}
