//! The scene: everything a user may set, as plain data with defaults. Saved and edited, never changed by a run.
//!
//! A scene file is TOML; each table below is a table there, and every key may be left out. See
//! [`Scene::from_toml`] for reading and [`Scene::to_toml`] for the whole list with its defaults.

mod accuracy;
mod check;
mod effects;
mod engine;
mod file;
mod named;
mod poses;
mod shaking;
mod timing;

pub use crate::gripper::Auto;
pub use accuracy::{Accuracy, IntegrationMethod, Integrator, UnknownAccuracy};
pub use effects::{Effect, EffectSettings, Setting};
pub use engine::EngineKind;
pub use file::{SceneError, SceneKey};
pub use named::{NamedScene, SCENES};
pub use poses::{Between, Faces, PRESETS, PosePreset, PoseSpread};
pub use shaking::{HandMotion, HandPlace, Shaking};
pub use timing::{Clock, Timing};

use crate::gripper::{GripperModel, Programme};
use crate::objects::{CollisionShape, LoadOptions, ObjectError, ObjectModel, is_file, load};
use palpate_geometry::units::STANDARD_GRAVITY;
use serde::{Deserialize, Serialize};

/// Everything that defines a grasp.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Scene {
    /// Object and its pose.
    pub object: ObjectSetup,
    /// Support of the object.
    pub support: Support,
    /// The gripper and where it is held.
    pub gripper: GripperModel,
    /// Variation of poses from grasp to grasp.
    pub pose: PoseSpread,
    /// Line pressure over time.
    pub programme: Programme,
    /// Motion of the hand once it has closed.
    pub shaking: Shaking,
    /// Rates and duration.
    pub timing: Timing,
    /// Solver settings.
    pub solver: Solver,
    /// The world around.
    pub world: World,
    /// Settings of the physical effects.
    pub effects: EffectSettings,
}

impl Scene {
    /// Options for loading its object.
    pub fn load_options(&self) -> LoadOptions {
        LoadOptions {
            scale: self.object.scale.value(),
            mass: self.object.mass.value(),
            density: self.object.density,
            collision: self.object.collision,
            cell: self.solver.distance_cell.value(),
        }
    }

    /// True where the object is held in place: by `effects.free-object`, or by `object.fixed` where that is `auto`.
    pub fn holds_object(&self) -> bool {
        match self.effects.get(Effect::FreeObject) {
            Setting::Off => true,
            Setting::Auto => self.object.fixed,
            Setting::On => false,
        }
    }

    /// True where random poses put the object on the faces that it comes to rest on. A free object cannot lie on any
    /// other: it would fall off its pedestal before the fingers come.
    pub fn uses_resting_faces(&self) -> bool {
        match self.pose.faces {
            Faces::Nominal => false,
            Faces::Natural => true,
            Faces::Any => !self.holds_object(),
        }
    }

    /// Holds the object in place, or lets it rest freely; resets `effects.free-object` to `auto`.
    pub fn set_object_fixed(&mut self, fixed: bool) {
        self.object.fixed = fixed;
        self.effects.set(Effect::FreeObject, Setting::Auto);
    }

    /// Softness of an object in this scene; `None` where it is rigid.
    pub fn softness(&self, object: &ObjectModel) -> Option<Softness> {
        let modulus = self.object.modulus.value().or(object.modulus)?;
        // Against finite elements of a soft ball within 20 % from 0.3 to 1.1 N; see `physics/effects/soft_object.rs`.
        let soft_to_the_middle = 0.25 * object.bounds.size().min_element();
        Some(Softness { modulus, thickness: self.object.shell.value().unwrap_or(soft_to_the_middle) })
    }

    /// Loads what the scene grasps; `None` for an empty hand.
    pub fn load_object(&self) -> Result<Option<ObjectModel>, ObjectError> {
        let object = load(&self.object.source, &self.load_options())?;
        let name = self.object.name.as_ref().filter(|name| !name.is_empty() && is_file(&self.object.source));
        Ok(object.map(|object| ObjectModel { name: name.cloned().unwrap_or(object.name.clone()), ..object }))
    }
}

/// Settings of the grasped object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ObjectSetup {
    /// The name of a built-in object, the path of a URDF, OBJ or STL file, or `empty` for an empty hand.
    pub source: String,
    /// Name of an object from a file, which is its class; without one or an empty one, the file says it. Built-in objects keep theirs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Held in place instead of resting freely until the fingers move it; see [`Scene::holds_object`].
    pub fixed: bool,
    /// Fixed-axis roll, pitch, yaw of the object as it is put down (degrees).
    pub rotation_deg: [f64; 3],
    /// Shift of the object from the middle of its support (m).
    pub shift: [f64; 2],
    /// Mass (kg); `auto` takes it from the file, or else from volume and density.
    pub mass: Auto,
    /// Density used where the file gives no usable mass (kg/m³).
    pub density: f64,
    /// Friction coefficient of the surface; `auto` takes the object's own, or 0.6.
    pub friction: Auto,
    /// Young's modulus of its surface (Pa); `auto` takes the object's own, or leaves it rigid.
    pub modulus: Auto,
    /// Thickness of the soft shell around its rigid core (m); `auto`: a quarter of the smallest extent, which presses
    /// like a body that is soft to the middle.
    pub shell: Auto,
    /// Factor on all lengths in the file; `auto` guesses millimetres or metres, with a warning.
    pub scale: Auto,
    /// Shape used for contact.
    pub collision: CollisionShape,
}

/// Soft shell of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Softness {
    /// Young's modulus (Pa).
    pub modulus: f64,
    /// Thickness (m).
    pub thickness: f64,
}

/// The kinds of support.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SupportKind {
    /// A slim column on the table, so that the fingers reach around the object.
    Pedestal,
    /// The table itself.
    Table,
    /// Nothing: the object floats, or falls when free.
    None,
}

/// Support of the object. The table is the plane z = 0 of the world; fingers touch both.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Support {
    /// Pedestal, table or none.
    pub kind: SupportKind,
    /// Height of the pedestal above the table (m).
    pub height: f64,
    /// Radius of the pedestal (m).
    pub radius: f64,
    /// Friction coefficient; combined with the object's as a geometric mean.
    pub friction: f64,
    /// Largest depth that a resting object sinks into the support under its own weight (m).
    pub sink: f64,
    /// Least stiffness of a contact point (N/m), for light objects that are pressed down.
    pub stiffness: f64,
}

/// Solver settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Solver {
    /// Physics engine.
    pub engine: EngineKind,
    /// Tolerance to which steps are chosen, by name or as a number.
    pub accuracy: Accuracy,
    /// Method of integration.
    pub integrator: Integrator,
    /// Newton stops when the scaled gradient falls below this share of the forces at play.
    pub tolerance: f64,
    /// Newton iterations after which a step is reported as not converged.
    pub max_iterations: u32,
    /// Times the friction limits are brought up to date with the normal forces within a step.
    pub relag_passes: u32,
    /// Lattice spacing of baked distances (m); `auto` chooses by the object's size.
    pub distance_cell: Auto,
}

/// The world around.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct World {
    /// Gravity along -z (m/s²).
    pub gravity: f64,
}

impl Default for ObjectSetup {
    fn default() -> Self {
        Self {
            source: "lemon".to_owned(),
            name: None,
            fixed: false,
            rotation_deg: [0.0; 3],
            shift: [0.0; 2],
            mass: Auto::Auto,
            density: LoadOptions::default().density,
            friction: Auto::Auto,
            modulus: Auto::Auto,
            shell: Auto::Auto,
            scale: Auto::Auto,
            collision: CollisionShape::File,
        }
    }
}

impl Default for Support {
    fn default() -> Self {
        Self {
            kind: SupportKind::Pedestal,
            height: 0.050, // fingertips stay clear of the table at every offset up to 12 mm
            radius: 0.008, // slimmer than the smallest of the sixteen objects
            friction: 0.6,
            sink: 2e-5,
            stiffness: 1e4,
        }
    }
}

impl Solver {
    /// The method that steps are taken by.
    pub fn method(&self) -> IntegrationMethod {
        self.integrator.method(self.accuracy)
    }

    /// Estimated error that steps are chosen by; `None` where Euler takes the fixed steps of a named accuracy.
    pub fn step_tolerance(&self) -> Option<f64> {
        match self.method() {
            IntegrationMethod::Sdirk2 => Some(self.accuracy.step_tolerance()),
            IntegrationMethod::Euler => self.accuracy.tolerance(),
        }
    }

    /// Settings of the refined run for the error estimate: a tenth of the tolerance.
    #[must_use]
    pub fn refined(&self) -> Self {
        let accuracy = Accuracy::Tolerance(0.1 * self.accuracy.step_tolerance());
        Self { accuracy, integrator: Integrator::Auto, ..self.clone() }
    }

    /// Settings of the next level of accuracy, for computing a grasp again; `None` where the engine controls no error,
    /// and below the least tolerance.
    pub fn finer(&self) -> Option<Self> {
        let accuracy = self.accuracy.finer();
        let possible = self.engine == EngineKind::Palpate && Accuracy::TOLERANCES.contains(&accuracy.step_tolerance());
        possible.then(|| Self { accuracy, integrator: Integrator::Auto, ..self.clone() })
    }

    /// The same at so many times the tolerance, or at the largest; `None` where the engine controls no error.
    pub fn coarser(&self, factor: f64) -> Option<Self> {
        let tolerance = (factor * self.accuracy.step_tolerance()).min(*Accuracy::TOLERANCES.end());
        let accuracy = Accuracy::Tolerance(tolerance);
        (self.engine == EngineKind::Palpate).then(|| Self { accuracy, integrator: Integrator::Auto, ..self.clone() })
    }
}

impl Default for Solver {
    fn default() -> Self {
        Self {
            engine: EngineKind::Palpate,
            accuracy: Accuracy::Standard,
            integrator: Integrator::Auto,
            tolerance: 1e-6,
            max_iterations: 100,
            relag_passes: 2, // of 1662 random scenes 116 end wrongly at standard with one, 96 with two, no fewer with four
            distance_cell: Auto::Auto,
        }
    }
}

impl Default for World {
    fn default() -> Self {
        Self { gravity: STANDARD_GRAVITY }
    }
}
