//! Random scenes: built-in objects in random poses, of random mass, softness and friction, before random grippers.
//! Ranges reach to where an effect begins or ceases to matter, evenly over their logarithms.

use palpate_sim::gripper::Sideways;
use palpate_sim::objects::{EMPTY, ObjectError, ObjectModel, catalogue};
use palpate_sim::poses::jittered;
use palpate_sim::scene::{Auto, Faces, PoseSpread, Scene, SupportKind};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A random scene.
pub(super) struct RandomScene {
    pub(super) scene: Scene,
    pub(super) object: Option<ObjectModel>,
    /// Settings that make it.
    pub(super) settings: Vec<String>,
}

/// Share of scenes with an empty hand, with an object that is held, with a table, with a hand that is shaken, with a
/// soft object, with slow chambers, and with fingers that bend sideways and twist.
const EMPTY_SHARE: f64 = 0.06;
const HELD_SHARE: f64 = 0.15;
const TABLE_SHARE: f64 = 0.2;
const SHAKEN_SHARE: f64 = 0.3;
const SOFT_SHARE: f64 = 0.5;
const SLOW_SHARE: f64 = 0.5;
const SIDEWAYS_SHARE: f64 = 0.25;

/// The scene of an index.
pub(super) fn random_scene(seed: u64, index: u32) -> Result<RandomScene, ObjectError> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(u64::from(index));
    let mut scene = Scene::default();
    let mut draw = Draw { random: &mut random };
    let built_in = (!draw.happens(EMPTY_SHARE)).then(|| draw.one_of(catalogue()));
    built_in.map_or(EMPTY, |built_in| built_in.name.as_str()).clone_into(&mut scene.object.source);
    let mut object = scene.load_object()?;
    if built_in.is_some() {
        draw.object(&mut scene, object.as_mut());
    }
    draw.gripper(&mut scene);
    draw.surroundings(&mut scene);
    draw.sideways(&mut scene);
    // The widest shifts and turns of the presets, on whichever side it lies.
    scene.pose = PoseSpread { shift: [0.010; 3], yaw_deg: 90.0, faces: Faces::Nominal, ..PoseSpread::default() };
    let (scene, _) = jittered(&scene, object.as_ref(), u64::from(index) ^ seed);
    let settings = differing_settings(&scene);
    Ok(RandomScene { scene, object, settings })
}

/// Settings in which a scene differs from the default one.
fn differing_settings(scene: &Scene) -> Vec<String> {
    let default = flat(&Scene::default().to_toml());
    flat(&scene.to_toml()).into_iter().filter(|setting| !default.contains(setting)).collect()
}

/// All settings of a scene file, each as `table.key=value`.
fn flat(toml: &str) -> Vec<String> {
    let mut table = String::new();
    let mut settings = Vec::new();
    for line in toml.lines() {
        if let Some(name) = line.strip_prefix('[').and_then(|line| line.strip_suffix(']')) {
            table = format!("{name}.");
        } else if let Some((key, value)) = line.split_once(" = ") {
            settings.push(format!("{table}{key}={value}"));
        }
    }
    settings
}

fn to_three_digits(x: f64) -> f64 {
    let digits = 10f64.powi(2 - x.log10().floor() as i32);
    (x * digits).round() / digits
}

struct Draw<'a> {
    random: &'a mut ChaCha8Rng,
}

impl Draw<'_> {
    fn happens(&mut self, share: f64) -> bool {
        self.random.random::<f64>() < share
    }

    fn one_of<'b, T>(&mut self, all: &'b [T]) -> &'b T {
        &all[self.random.random_range(0..all.len())]
    }

    /// Evenly over the logarithm, to three digits, as a user would write it.
    fn between(&mut self, low: f64, high: f64) -> f64 {
        to_three_digits((low.ln() + (high / low).ln() * self.random.random::<f64>()).exp())
    }

    fn object(&mut self, scene: &mut Scene, model: Option<&mut ObjectModel>) {
        let setup = &mut scene.object;
        setup.fixed = self.happens(HELD_SHARE);
        setup.rotation_deg = *self.one_of(&[[0.0; 3], [90.0, 0.0, 0.0], [0.0, 90.0, 0.0]]);
        setup.friction = Auto::Value(self.between(0.1, 1.5));
        if let Some(model) = model {
            let mass = model.mass.mass * self.between(0.03, 3.0);
            model.mass = model.mass.with_mass(mass);
            setup.mass = Auto::Value(mass);
        }
        if self.happens(SOFT_SHARE) {
            setup.modulus = Auto::Value(self.between(5e3, 1e9));
            setup.shell = Auto::Value(self.between(0.001, 0.01));
        }
    }

    fn gripper(&mut self, scene: &mut Scene) {
        let finger = &mut scene.gripper.finger;
        finger.bending_stiffness *= self.between(0.5, 3.0);
        finger.mass = self.between(3e-4, 0.06);
        finger.damping_time = self.between(0.01, 0.1);
        finger.creep_share = self.between(0.003, 0.3);
        finger.creep_time = self.between(0.5, 1000.0);
        let pad = &mut scene.gripper.pad;
        pad.modulus = self.between(3e4, 1e6);
        pad.thickness = self.between(0.004, 0.012);
        pad.friction = self.between(0.2, 2.0);
        scene.gripper.mount.opening = self.between(0.070, 0.110);
        if self.happens(SLOW_SHARE) {
            scene.gripper.actuation.filling_time = self.between(1e-3, 0.3);
        }
        scene.programme.peak_bar = self.between(0.3, 1.5);
        scene.programme.close_bar_per_tick = self.between(0.03, 0.15);
        scene.programme.hold_ticks = self.between(5.0, 50.0).round() as u32;
        scene.timing.duration_s = 0.1 * f64::from(scene.programme.total_ticks() + 2);
    }

    /// Last, so that scenes with fingers that stay in their planes do not depend on it.
    fn sideways(&mut self, scene: &mut Scene) {
        if self.happens(SIDEWAYS_SHARE) {
            let gripper = &mut scene.gripper;
            let solid = gripper.finger.of_solid_section(gripper.pad.thickness);
            let mut stiffened = |stiffness: Auto| {
                Auto::Value(to_three_digits(stiffness.value().unwrap_or_default() * self.between(0.3, 3000.0)))
            };
            gripper.finger.sideways = Sideways {
                bending_stiffness: stiffened(solid.bending_stiffness),
                torsional_stiffness: stiffened(solid.torsional_stiffness),
            };
        }
    }

    fn surroundings(&mut self, scene: &mut Scene) {
        if self.happens(TABLE_SHARE) {
            scene.support.kind = SupportKind::Table;
        }
        scene.world.gravity = *self.one_of(&[9.81, 9.81, 9.81, 9.81, 1.62, 0.1]);
        if self.happens(SHAKEN_SHARE) {
            let shaking = &mut scene.shaking;
            shaking.amplitude = self.between(1e-6, 0.01);
            shaking.frequency = self.between(0.5, 8.0);
            shaking.direction = *self.one_of(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]]);
            // Without a lift the support passes by, which only what is held without touching it should feel.
            shaking.lift = if self.happens(0.5) { 0.0 } else { self.between(0.005, 0.04) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_are_valid_differ_and_repeat_by_their_settings() -> Result<(), Box<dyn std::error::Error>> {
        let mut seen = Vec::new();
        for index in 0..40 {
            let drawn = random_scene(1, index)?;
            assert_eq!(drawn.scene.check(), Ok(()), "scene {index}");
            let again = Scene::default().with_settings(&drawn.settings)?;
            assert_eq!(again, drawn.scene, "scene {index}");
            let loaded = again.load_object()?;
            let mass = |object: &Option<ObjectModel>| object.as_ref().map(|object| object.mass.mass.to_bits());
            assert_eq!(mass(&loaded), mass(&drawn.object), "scene {index}");
            assert!(!seen.contains(&drawn.settings));
            seen.push(drawn.settings);
        }
        Ok(())
    }
}
