//! Choice of sensors for the simulated gripper and stored trials: sensor layout, signals, sensor model, and the model
//! that recognises; and in which poses the simulation grasps.

use crate::app::actions::Actions;
use crate::app::features::view::ViewState;

use crate::app::widgets::{choice_ui, just_opened, remark_ui};
use egui::{Checkbox, ComboBox, RichText, ScrollArea, Ui};
use palpate_lab::workers::{Job, TrainingData};
use palpate_sim::scene::{Between, PRESETS, PoseSpread, Scene};
use palpate_tactile::model::SensorModel;
use palpate_tactile::{CATALOGUE, SignalDefinition};
use std::path::{Path, PathBuf};

pub(super) fn ui(ui: &mut Ui, view: &ViewState, scene: &Scene, data: &Job<(), TrainingData>, actions: &mut Actions) {
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.strong("Sensors");
        let now = &view.sensors;
        let mut sensors = now.clone();
        let (name, force) = match now.layout.strip_suffix("+F") {
            Some(name) => (name.to_owned(), true),
            None => (now.layout.clone(), false),
        };
        ui.horizontal_wrapped(|ui| {
            let mut chosen = name.clone();
            let combo = ComboBox::from_id_salt("layout").width(70.0).selected_text(&chosen);
            let shown = combo.show_ui(ui, |ui| {
                for layout in &CATALOGUE {
                    ui.selectable_value(
                        &mut chosen,
                        layout.name.to_owned(),
                        format!("{}: {}", layout.name, about(layout)),
                    );
                }
            });
            shown.response.on_hover_text("Sensor layout: stretches of a finger with a sensor of their own");
            let mut with_force = force;
            ui.add_enabled(now.signals != SignalDefinition::Parts, Checkbox::new(&mut with_force, "force (+F)"))
                .on_hover_text("Force as a channel beside each contact pressure")
                .on_disabled_hover_text("A pad gives one signal: its pressure is its force over its area");
            sensors.layout = if with_force { format!("{chosen}+F") } else { chosen };
        });
        ui.horizontal_wrapped(|ui| {
            ui.label("Signals");
            let signals = choice_ui(
                ui,
                Some(sensors.signals),
                [
                    (SignalDefinition::Parts, "parts", "What strips and pads measure, as on a real gripper"),
                    (
                        SignalDefinition::Contact,
                        "contact",
                        "Simulation only: circle through all joints, force over the participation area of the contact",
                    ),
                    (
                        SignalDefinition::Hull,
                        "hull",
                        "Simulation only: force over the convex hull of the contacts, as in the paper (section IV-A1); \
                     undefined for points and rows",
                    ),
                ],
            );
            if let Some(signals) = signals {
                sensors = sensors.clone().with_signals(signals);
            }
        });
        ui.horizontal_wrapped(|ui| {
            ui.label("Sensor model for stored trials");
            for model in SensorModel::BOTH {
                let hint = match model {
                    SensorModel::Virtual => "Ideal sensors, as in the paper's simulation",
                    SensorModel::Noisy => "Perfect parts that slip and drift a little and are read with noise",
                    SensorModel::PhysicalLike => "Strips, pads and clock of a real gripper, with their noise and drift",
                    SensorModel::Adapted => "The same, calibrated by one close of the empty hand",
                    SensorModel::Drawn => {
                        "Those of another gripper for each grasp, whose strips an empty close has calibrated"
                    }
                };
                let label = match model {
                    SensorModel::Virtual => "ideal (virtual)",
                    SensorModel::PhysicalLike => "realistic (physical-like)",
                    SensorModel::Noisy | SensorModel::Adapted | SensorModel::Drawn => model.name(),
                };
                if ui.selectable_label(sensors.sensors == model, label).on_hover_text(hint).clicked() {
                    sensors.sensors = model;
                    if sensors.is_physical() {
                        sensors = sensors.clone().with_signals(SignalDefinition::Parts);
                    }
                }
            }
        });
        if sensors != *now {
            actions.push(|app| app.set_sensors(sensors));
        }
        ui.add_space(8.0);
        ui.strong("Model");
        model_ui(ui, view.simulation_models[usize::from(scene.holds_object())].as_ref(), data, actions);
        ui.add_space(8.0);
        ui.strong("Poses of the simulation");
        poses_ui(ui, scene, actions);
    });
}

/// Choice of the recogniser of the simulation and of its trials.
fn model_ui(ui: &mut Ui, chosen: Option<&PathBuf>, data: &Job<(), TrainingData>, actions: &mut Actions) {
    if just_opened(ui, "sensors") {
        actions.push(|app| _ = app.tools.data.start(()));
    }
    let data = data.outcome();
    let saved = data.as_ref().map_or(&[][..], |data| &data.models);
    let mut name = |path: &Path, about: &str| {
        let file = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        if ui.radio(chosen.is_some_and(|own| own == path), file).on_hover_text(about).clicked() {
            let path = path.to_owned();
            actions.push(|app| app.use_simulation_model(Some(path)));
        }
    };
    for model in saved {
        name(&model.path, &model.about);
    }
    if let Some(path) = chosen.filter(|path| !saved.iter().any(|model| model.path == **path)) {
        name(path, "Loaded from this file");
    }
    if ui
        .radio(chosen.is_none(), "Shipped model")
        .on_hover_text("Comes with Palpate; trained on simulated grasps")
        .clicked()
    {
        actions.push(|app| app.use_simulation_model(None));
    }
    let hint =
        "A model answers for fixed or free objects, whichever it learned; the shipped ones answer for the others";
    let text = RichText::new("For simulated trials. That of the real gripper: panel Training.").weak().small();
    ui.add(egui::Label::new(text).wrap()).on_hover_text(hint);
}

/// Quantities and stretches of a layout, in words.
fn about(layout: &palpate_tactile::SensorLayout) -> String {
    use palpate_tactile::{CurvatureSplit, PressureSplit};
    let curvature = match layout.curvature {
        CurvatureSplit::Whole => "whole finger",
        CurvatureSplit::Halves => "halves",
    };
    let pressure = match layout.pressure {
        PressureSplit::Whole => "whole pad",
        PressureSplit::Halves => "halves",
        PressureSplit::Pairs => "pairs of joints",
        PressureSplit::Joints => "every joint",
    };
    format!("curvature of {curvature}, pressure of {pressure}")
}

/// First line of a preset's file.
fn about_preset(text: &str) -> &str {
    text.lines().next().unwrap_or_default().trim_start_matches('#').trim()
}

fn poses_ui(ui: &mut Ui, scene: &Scene, actions: &mut Actions) {
    let drawn = PoseSpread { between: Between::default(), ..scene.pose.clone() };
    let now = PRESETS.iter().find(|preset| preset.poses() == drawn);
    ui.horizontal_wrapped(|ui| {
        for preset in &PRESETS {
            let chosen = now.is_some_and(|now| now.name == preset.name);
            if ui.selectable_label(chosen, preset.name).on_hover_text(about_preset(preset.text)).clicked() && !chosen {
                let mut scene = scene.clone();
                scene.pose = PoseSpread { between: scene.pose.between, ..preset.poses() };
                actions.push(|app| app.set_scene(scene));
            }
        }
    });
    if now.is_none() {
        remark_ui(ui, "The scene has poses of its own.");
    }
    ui.horizontal_wrapped(|ui| {
        ui.label("Between grasps");
        let between = choice_ui(
            ui,
            Some(scene.pose.between),
            [
                (Between::Reposed, "re-posed", "Every grasp draws its pose anew"),
                (Between::AsReleased, "as released", "The object stays as the grasp before left it"),
                (
                    Between::Guided,
                    "guided",
                    "The object stays; the gripper comes from where most is expected to be learned about it",
                ),
            ],
        );
        if let Some(between) = between.filter(|between| *between != scene.pose.between) {
            let mut scene = scene.clone();
            scene.pose.between = between;
            actions.push(|app| app.set_scene(scene));
        }
    });
}
