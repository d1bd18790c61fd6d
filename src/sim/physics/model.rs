//! Constants that a step reads: the scene resolved to numbers, in the gripper frame.

use super::chain::ChainModel;
use super::contact::ContactStep;
use super::contact_springs::ContactSprings;
use super::effects::{Chamber, FingerContact, Relaxation, Shell, plan};
use super::environment::Environment;
use super::placement::Placement;
use super::sideways::{SWAYS, Sideways};
use crate::frame::Plan;
use crate::gripper::{FingerPlane, GripperModel, PadLaw, Side};
use crate::objects::{ObjectModel, Resting};
use crate::scene::{Effect, HandMotion, Scene, Support, SupportKind};
use glam::{DMat3, DVec3};
use palpate_geometry::{DistanceField, Pose};

/// Constants of a simulation. Built once, never changed; a step is a function of it and a [`super::State`].
#[derive(Clone, Debug)]
pub struct PhysicsModel {
    /// Contact constants; the step length is set at each step.
    pub(super) contact: ContactStep,
    pub(super) chain: ChainModel,
    /// Fingers that bend sideways and twist.
    pub(super) sideways: Option<Sideways>,
    pub(super) planes: [FingerPlane; 2],
    pub(super) springs: ContactSprings,
    pub(super) pad_law: PadLaw,
    /// Friction of the pads against the object and against the environment.
    pub(super) pad_friction: PadFriction,
    pub(super) body: Option<Body>,
    pub(super) environment: Environment,
    /// Gravity on the fingers and on the object (m/s²).
    pub(super) finger_gravity: DVec3,
    pub(super) object_gravity: DVec3,
    /// False where fingers move from balance to balance.
    pub(super) finger_inertia: bool,
    pub(super) finger_contact: FingerContact,
    pub(super) skin: Skin,
    /// Chambers that lag behind the line.
    pub(super) chamber: Option<Chamber>,
    /// Joints that creep.
    pub(super) relaxation: Option<Relaxation>,
    pub(super) hand_motion: Option<HandMotion>,
    /// Soft shell of the object.
    pub(super) shell: Option<Shell>,
    /// Effects simulated.
    pub(super) plan: Plan,
    pub(super) tolerance: f64,
    pub(super) max_iterations: u32,
    pub(super) relag_passes: u32,
    pub(super) world_from_gripper: Pose,
}

/// Friction coefficients of the pads.
#[derive(Clone, Copy, Debug)]
pub(super) struct PadFriction {
    pub(super) on_object: f64,
    pub(super) on_world: f64,
    pub(super) on_pad: f64,
}

/// Outline of a finger, as the other one meets it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Skin {
    /// Height of the pad's middle above the neutral axis (m).
    pub(super) thickness: f64,
    crown_radius: f64,
    /// Depth of the bellows behind the neutral axis (m).
    pub(super) back: f64,
    pub(super) width: f64,
    pub(super) rows: usize,
    pub(super) columns: usize,
    /// Distance of the last row of contact springs from the tip (m).
    pub(super) last_row: f64,
}

impl Skin {
    fn new(gripper: &GripperModel) -> Self {
        let (finger, pad) = (&gripper.finger, &gripper.pad);
        let (rows, columns) = (pad.rows, pad.columns);
        let (thickness, crown_radius) = (pad.thickness, pad.crown_radius);
        let last_row = 0.5 * gripper.taxels().row_pitch();
        Self { thickness, crown_radius, back: finger.back, width: finger.width, rows, columns, last_row }
    }

    /// Height of the pad above the neutral axis at `across` from its middle (m).
    pub(super) fn height(&self, across: f64) -> f64 {
        self.thickness - across * across / (2.0 * self.crown_radius)
    }
}

/// The object as the solver sees it.
#[derive(Clone, Debug)]
pub(super) struct Body {
    pub(super) field: DistanceField,
    pub(super) resting: Resting,
    /// Centre of mass in the object's frame (m).
    pub(super) centre: DVec3,
    /// Radius of a ball about the centre of mass that holds the object (m).
    pub(super) radius: f64,
    /// Mass (kg).
    pub(super) mass: f64,
    /// Inertia about the centre of mass, in object axes (kg m²).
    pub(super) inertia: DMat3,
    pub(super) inverse_inertia: DMat3,
    pub(super) free: bool,
    /// Stiffness of a contact point with the support (N/m).
    pub(super) support_stiffness: f64,
    pub(super) support_friction: f64,
}

/// A resting object is carried by at least three points.
const RESTING_POINTS: f64 = 3.0;

impl PhysicsModel {
    /// Resolves a scene.
    pub fn new(scene: &Scene, object: Option<&ObjectModel>, placement: &Placement) -> Self {
        Self::planned(scene, object, placement, plan(scene, object, placement))
    }

    /// The same with a plan of the caller's.
    pub(super) fn planned(scene: &Scene, object: Option<&ObjectModel>, placement: &Placement, plan: Plan) -> Self {
        let gripper = &scene.gripper;
        let is_on = |effect: Effect| plan.is_on(effect.name());
        let mu = |a: f64, b: f64| if is_on(Effect::Friction) { (a * b).sqrt() } else { 0.0 };
        let surface_friction = |object: &ObjectModel| scene.object.friction.value().unwrap_or(object.friction);
        let gravity_world = DVec3::new(0.0, 0.0, -scene.world.gravity);
        let gravity = placement.world_from_gripper.inverse().direction(gravity_world);
        let gravity_if = |effect: Effect| if is_on(effect) { gravity } else { DVec3::ZERO };
        let shell = if is_on(Effect::SoftObject) { Shell::new(scene, object) } else { None };
        let on_support = |object: &ObjectModel| {
            let heavy = object.mass.mass * scene.world.gravity / (RESTING_POINTS * scene.support.sink);
            let rigid = heavy.max(scene.support.stiffness);
            shell.map_or(rigid, |shell| shell.on_support(rigid, RESTING_POINTS, scene, object))
        };
        let body = object.map(|object| Body {
            field: object.field.clone(),
            resting: object.resting.clone(),
            centre: object.mass.centre,
            radius: object.field.radius_about(object.mass.centre),
            mass: object.mass.mass,
            inertia: object.mass.inertia,
            inverse_inertia: object.mass.inertia.inverse(),
            free: is_on(Effect::FreeObject),
            support_stiffness: on_support(object),
            support_friction: mu(surface_friction(object), scene.support.friction),
        });
        let nothing = Support { kind: SupportKind::None, ..scene.support.clone() };
        let support = if is_on(Effect::Support) { &scene.support } else { &nothing };
        Self {
            contact: ContactStep {
                h: 0.0,
                dissipation: gripper.pad.dissipation,
                shear_damping_time: gripper.pad.shear_damping_time,
            },
            chain: ChainModel::new(&gripper.finger, &gripper.pad),
            sideways: (gripper.finger.sideways.stiffness())
                .filter(|_| is_on(Effect::OutOfPlane))
                .map(|stiffness| Sideways::new(&gripper.finger, &gripper.pad, stiffness)),
            planes: Side::BOTH.map(|side| gripper.plane(side)),
            springs: ContactSprings::new(&gripper.finger, &gripper.pad, &gripper.taxels()),
            pad_law: gripper.pad.law,
            pad_friction: PadFriction {
                on_object: object.map_or(0.0, |o| mu(gripper.pad.friction, surface_friction(o))),
                on_world: mu(gripper.pad.friction, scene.support.friction),
                on_pad: mu(gripper.pad.friction, gripper.pad.friction),
            },
            body,
            environment: Environment::new(support, &placement.world_from_gripper),
            finger_gravity: gravity_if(Effect::FingerGravity),
            object_gravity: gravity_if(Effect::ObjectGravity),
            finger_inertia: is_on(Effect::FingerInertia),
            finger_contact: FingerContact::planned(&plan),
            skin: Skin::new(gripper),
            chamber: is_on(Effect::PneumaticLag).then(|| Chamber::new(&gripper.actuation)),
            relaxation: is_on(Effect::Creep).then(|| Relaxation::new(&gripper.finger)),
            hand_motion: if is_on(Effect::Shaking) { scene.hand_motion() } else { None },
            shell,
            plan,
            tolerance: scene.solver.tolerance,
            max_iterations: scene.solver.max_iterations,
            relag_passes: scene.solver.relag_passes,
            world_from_gripper: placement.world_from_gripper,
        }
    }

    /// Effects simulated, with the reason for each.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Joints of both fingers, 2 N.
    pub(super) fn joint_count(&self) -> usize {
        2 * self.chain.joints
    }

    /// Segments of both fingers, 2 (N + 1).
    pub(super) fn link_count(&self) -> usize {
        2 * (self.chain.joints + 1)
    }

    /// Unknowns of a step: all joint rates, six for a free object, and four where fingers leave their planes.
    pub(super) fn unknowns(&self) -> usize {
        self.first_sway() + if self.sideways.is_some() { SWAYS } else { 0 }
    }

    /// The first unknown of fingers that leave their planes: sideways curvature and twist of the left one, then of the
    /// right one.
    pub(super) fn first_sway(&self) -> usize {
        self.joint_count() + if self.free_body().is_some() { 6 } else { 0 }
    }

    /// The object, where it can move.
    pub(super) fn free_body(&self) -> Option<&Body> {
        self.body.as_ref().filter(|body| body.free)
    }

    /// Places where contact can be remembered: contact springs of both fingers, resting points, rim of the pedestal.
    pub(super) fn sites(&self) -> usize {
        self.first_resting_site() + self.resting_points() + self.environment.rim().len()
    }

    /// The first place of contact between object and support; before it are those of the contact springs of both fingers
    /// against the object, against the support and against the other finger.
    pub(super) fn first_resting_site(&self) -> usize {
        3 * 2 * self.springs.all.len()
    }

    /// Finger and contact spring of a place of contact.
    pub(super) fn spring_at(&self, site: u32) -> (usize, usize) {
        let all = self.springs.all.len();
        (site as usize / all % 2, site as usize % all)
    }

    pub(super) fn resting_points(&self) -> usize {
        self.body.as_ref().map_or(0, |body| body.resting.0.len())
    }
}
