//! The scene as rapier3d's bodies: two multibody chains, the object, what it stands on.
//!
//! Everything is in the gripper frame, in rapier's own units: rapier and parry hold absolute tolerances made for bodies
//! of about a metre, so that 50 mm are one unit of length here (like `length_unit` = 0.05, but for parry too).

use crate::frame::Plan;
use crate::gripper::{FingerPlane, GripperModel, Side};
use crate::objects::ObjectModel;
use crate::physics::chain::ChainModel;
use crate::physics::placement::Placement;
use crate::scene::{Effect, Scene, SupportKind};
use glam::{DMat3, DVec2, DVec3, Quat, Vec3};
use palpate_geometry::{Primitive, SolidPart, convex_hull};
use rapier3d::prelude::{
    CoefficientCombineRule, ColliderBuilder, ColliderHandle, CollisionPipeline, FrictionModel, Group,
    IntegrationParameters, InteractionGroups, InteractionTestMode, MassProperties, MultibodyJointHandle,
    PhysicsPipeline, PhysicsWorld, Pose, RevoluteJointBuilder, RigidBodyBuilder, RigidBodyHandle, SharedShape,
    SpringCoefficients, TriMeshFlags,
};

/// Units of length per metre.
pub(super) const LENGTH: f64 = 20.0;
/// Units of mass per kilogram: segments of 3 g weigh 0.3.
pub(super) const MASS: f64 = 100.0;
/// Units of force per newton; time is in seconds.
pub(super) const FORCE: f64 = LENGTH * MASS;
/// Units of torque per N m.
const TORQUE: f64 = FORCE * LENGTH;

/// Steps of rapier's own within one tick, each with a full solve ("small steps", Macklin et al. 2019).
const SUBSTEPS: usize = 4;
/// Gauss-Seidel sweeps in each of them.
const SWEEPS: usize = 4;
/// Frequency (Hz) and damping ratio with which overlap is pushed out. The defaults, 30 Hz and 10, are made for crates
/// of a metre: a fingertip then takes seconds to come out of what it has sunk into.
const CONTACT_FREQUENCY: f32 = 200.0;
const CONTACT_DAMPING: f32 = 5.0;
/// The angle of a revolute joint among the six coordinates of a joint.
const HINGE: usize = 3;
/// Chamfer of the front edge of the tip (m), like the round ends of Palpate's contact springs: a sharp edge catches on
/// a pedestal that a soft one slides over.
const TIP_CHAMFER: f64 = 0.00125;
/// A mesh whose hull is larger by less than this share is taken to be convex: the holes of a button are too small for a
/// segment to enter, and a hull is found 20 times as fast as a mesh.
const NEARLY_CONVEX: f64 = 0.1;

/// Collision groups: fingers meet neither themselves nor each other, as in Palpate's own engine.
const FINGERS: Group = Group::GROUP_1;
const OBJECT: Group = Group::GROUP_2;
const SUPPORT: Group = Group::GROUP_3;

/// rapier's world, and where in it things are.
pub(super) struct Hand {
    world: PhysicsWorld,
    /// Bodies of the N + 1 segments of each finger.
    segments: [Vec<RigidBodyHandle>; 2],
    /// Joints of each finger.
    joints: [Vec<MultibodyJointHandle>; 2],
    object: Option<RigidBodyHandle>,
    stiffness: f64,
}

/// A force on a segment, at one point of contact, in the gripper frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    /// Index among the 2 (N + 1) segments.
    pub(super) link: usize,
    /// Position (m).
    pub(super) point: DVec3,
    /// Force on the segment (N).
    pub(super) force: DVec3,
}

impl Clone for Hand {
    /// The pipelines are scratch memory and begin anew.
    fn clone(&self) -> Self {
        let w = &self.world;
        let world = PhysicsWorld {
            gravity: w.gravity,
            integration_parameters: w.integration_parameters,
            physics_pipeline: PhysicsPipeline::new(),
            collision_pipeline: CollisionPipeline::new(),
            islands: w.islands.clone(),
            broad_phase: w.broad_phase.clone(),
            narrow_phase: w.narrow_phase.clone(),
            bodies: w.bodies.clone(),
            colliders: w.colliders.clone(),
            impulse_joints: w.impulse_joints.clone(),
            multibody_joints: w.multibody_joints.clone(),
            soft_bodies: w.soft_bodies.clone(),
            ccd_solver: w.ccd_solver.clone(),
        };
        Self { world, segments: self.segments.clone(), joints: self.joints.clone(), ..*self }
    }
}

impl std::fmt::Debug for Hand {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Hand").field("segments", &self.segments).field("object", &self.object).finish_non_exhaustive()
    }
}

impl Hand {
    pub(super) fn new(scene: &Scene, object: Option<&ObjectModel>, placement: &Placement, plan: &Plan, h: f64) -> Self {
        let chain = ChainModel::new(&scene.gripper.finger, &scene.gripper.pad);
        let gripper_from_world = placement.world_from_gripper.inverse();
        let gravity = gripper_from_world.direction(DVec3::new(0.0, 0.0, -scene.world.gravity));
        let mut hand = Self {
            world: PhysicsWorld {
                gravity: length(gravity),
                integration_parameters: parameters(h),
                ..PhysicsWorld::default()
            },
            segments: [Vec::new(), Vec::new()],
            joints: [Vec::new(), Vec::new()],
            object: None,
            stiffness: chain.stiffness,
        };
        for side in Side::BOTH {
            hand.add_finger(&scene.gripper, &chain, side, plan);
        }
        if plan.is_on(Effect::Support.name()) {
            hand.add_support(scene, &gripper_from_world);
        }
        if let (Some(object), Some(world_from_object)) = (object, placement.world_from_object) {
            hand.add_object(scene, object, &(gripper_from_world * world_from_object), plan);
        }
        hand
    }

    fn add_finger(&mut self, gripper: &GripperModel, chain: &ChainModel, side: Side, plan: &Plan) {
        // No friction where either surface has none.
        let friction = if plan.is_on(Effect::Friction.name()) { gripper.pad.friction } else { 0.0 };
        let gravity_scale = if plan.is_on(Effect::FingerGravity.name()) { 1.0 } else { 0.0 };
        let plane = gripper.plane(side);
        // Turning "along" towards "inward" is a rotation about along x inward.
        let axis = plane.direction(DVec2::Y).cross(plane.direction(DVec2::X)).as_vec3();
        let mut start = plane.point(DVec2::ZERO, 0.0);
        let along = plane.direction(DVec2::Y);
        let mut before: Option<RigidBodyHandle> = None;
        for (j, reach) in chain.lengths.iter().enumerate() {
            let builder = if j == 0 { RigidBodyBuilder::fixed() } else { RigidBodyBuilder::dynamic() };
            let centre = length(along * (0.5 * reach));
            // The chain is planar, so that only the inertia about its own axis matters.
            let inertia = Vec3::splat((chain.inertias[j] * MASS * LENGTH * LENGTH) as f32);
            let mass = MassProperties::new(centre, (chain.masses[j] * MASS) as f32, inertia);
            let body = self.world.insert_body(
                builder
                    .translation(length(start))
                    .additional_mass_properties(mass)
                    .gravity_scale(gravity_scale)
                    .can_sleep(false),
            );
            let chamfer = if j == chain.joints { TIP_CHAMFER.min(0.5 * reach) } else { 0.0 };
            if let Some(shape) = segment_shape(gripper, &plane, *reach, chamfer) {
                let collider = collider(shape, friction, FINGERS, OBJECT | SUPPORT);
                self.world.insert_collider(collider.user_data(user_data(side, chain.lengths.len(), j)), Some(body));
            }
            if let Some(parent) = before {
                let arm = length(along * chain.lengths[j - 1]);
                let limit = chain.angle_limit as f32;
                let joint = RevoluteJointBuilder::new(axis)
                    .local_anchor1(arm)
                    .local_anchor2(Vec3::ZERO)
                    .limits([-limit, limit])
                    .contacts_enabled(false);
                self.joints[side.index()].extend(self.world.multibody_joints.insert(parent, body, joint, true));
            }
            self.segments[side.index()].push(body);
            before = Some(body);
            start += along * *reach;
        }
        self.set_torque(side, 0.0);
        let damping = (chain.damping * TORQUE) as f32;
        let first = self.joints[side.index()].first().copied();
        if let Some((finger, _)) = first.and_then(|joint| self.world.multibody_joints.get_mut(joint)) {
            // Not the default of 0.1, which is several times what a soft finger has.
            finger.damping_mut().fill(damping);
        }
    }

    fn add_support(&mut self, scene: &Scene, gripper_from_world: &palpate_geometry::Pose) {
        let support = &scene.support;
        let friction = support.friction;
        let place = |body: RigidBodyBuilder, pose: &palpate_geometry::Pose| body.pose(rapier_pose(pose));
        if support.kind != SupportKind::None {
            let body = self.world.insert_body(place(RigidBodyBuilder::fixed(), gripper_from_world));
            let table = collider(SharedShape::halfspace(Vec3::Z), friction, SUPPORT, FINGERS | OBJECT);
            self.world.insert_collider(table, Some(body));
        }
        if support.kind == SupportKind::Pedestal && support.height > 0.0 {
            let column = Primitive::Cylinder { radius: support.radius, half_length: 0.5 * support.height };
            let middle = *gripper_from_world * palpate_geometry::Pose::from_position(DVec3::Z * (0.5 * support.height));
            let body = self.world.insert_body(place(RigidBodyBuilder::fixed(), &middle));
            let (shape, local) = primitive_shape(&column);
            let column = collider(shape, friction, SUPPORT, FINGERS | OBJECT).position(local);
            self.world.insert_collider(column, Some(body));
        }
    }

    fn add_object(
        &mut self,
        scene: &Scene,
        object: &ObjectModel,
        gripper_from_object: &palpate_geometry::Pose,
        plan: &Plan,
    ) {
        let is_on = |effect: Effect| plan.is_on(effect.name());
        let builder = if is_on(Effect::FreeObject) { RigidBodyBuilder::dynamic() } else { RigidBodyBuilder::fixed() };
        let gravity_scale = if is_on(Effect::ObjectGravity) { 1.0 } else { 0.0 };
        let inertia: DMat3 = object.mass.inertia * (MASS * LENGTH * LENGTH);
        let mass = MassProperties::with_inertia_matrix(
            length(object.mass.centre),
            (object.mass.mass * MASS) as f32,
            inertia.as_mat3(),
        );
        let body = self.world.insert_body(
            builder
                .pose(rapier_pose(gripper_from_object))
                .additional_mass_properties(mass)
                .gravity_scale(gravity_scale)
                .can_sleep(false),
        );
        let surface = scene.object.friction.value().unwrap_or(object.friction);
        let friction = if is_on(Effect::Friction) { surface } else { 0.0 };
        for (shape, local) in object.parts.iter().filter_map(part_shape) {
            let part = collider(shape, friction, OBJECT, FINGERS | SUPPORT).position(local);
            self.world.insert_collider(part, Some(body));
        }
        self.object = Some(body);
    }

    /// Sets the actuation torque on every joint of a finger (N m), as the rest angle tau / k of its springs: springs
    /// are taken at the end of a step, torques would not be.
    pub(super) fn set_torque(&mut self, side: Side, torque: f64) {
        let (stiffness, rest) = ((self.stiffness * TORQUE) as f32, (torque / self.stiffness) as f32);
        for handle in &self.joints[side.index()] {
            if let Some((finger, link)) = self.world.multibody_joints.get_mut(*handle)
                && let Some(link) = finger.link_mut(link)
            {
                link.joint.set_spring(HINGE, stiffness, rest);
            }
        }
    }

    /// Lets one tick pass while a force (N, gripper frame) pulls at the object's centre of mass.
    pub(super) fn step(&mut self, pull: DVec3) {
        if let Some(body) = self.object.and_then(|object| self.world.bodies.get_mut(object)) {
            body.reset_forces(false);
            body.add_force((pull * FORCE).as_vec3(), false);
        }
        self.world.step();
    }

    /// Moves the object: a shift (m) and a turn about its centre of mass (axis times angle, rad), gripper frame.
    pub(super) fn move_object(&mut self, shift: DVec3, turn: DVec3) {
        let Some(body) = self.object.and_then(|object| self.world.bodies.get_mut(object)) else { return };
        let (centre, turn) = (body.center_of_mass(), Quat::from_scaled_axis(turn.as_vec3()));
        let position = centre + turn * (body.translation() - centre) + length(shift);
        let rotation = turn * *body.rotation();
        body.set_position(Pose::from_parts(position, rotation), false);
    }

    /// Joint angles, left finger then right, from palm to tip (rad).
    pub(super) fn angles(&self) -> impl Iterator<Item = f64> + '_ {
        self.joints.iter().flatten().map(|handle| {
            let joint = self.world.multibody_joints.get(*handle).and_then(|(finger, link)| finger.link(link));
            joint.map_or(f64::NAN, |link| f64::from(link.joint.coords()[HINGE]))
        })
    }

    /// The object's frame in the gripper frame (m).
    pub(super) fn gripper_from_object(&self) -> Option<palpate_geometry::Pose> {
        let body = &self.world.bodies[self.object?];
        let (position, rotation) = (body.translation().as_dvec3() / LENGTH, body.rotation().as_dquat());
        Some(palpate_geometry::Pose::new(position, rotation))
    }

    /// Display name of a body whose state is not finite: rapier disables such a body and continues.
    pub(super) fn not_finite(&self) -> Option<String> {
        for side in Side::BOTH {
            let lost = |handle: &RigidBodyHandle| !self.world.bodies[*handle].is_enabled();
            if let Some(j) = self.segments[side.index()].iter().position(lost) {
                return Some(format!("segment {j} of the {} finger", side.name()));
            }
        }
        if let Some(k) = self.angles().position(|q| !q.is_finite()) {
            let n = self.joints[0].len();
            let side = if k < n { Side::Left } else { Side::Right };
            return Some(format!("joint {} of the {} finger", k % n + 1, side.name()));
        }
        let object = self.object.map(|object| &self.world.bodies[object]);
        let lost = object.is_some_and(|body| !body.is_enabled() || !body.position().translation.is_finite());
        lost.then(|| "the object".to_owned())
    }

    /// Forces on the segments in the last small step.
    pub(super) fn touches(&self) -> Vec<Touch> {
        let per_newton = FORCE * f64::from(self.world.integration_parameters.dt) / SUBSTEPS as f64;
        let mut touches = Vec::new();
        for pair in self.world.narrow_phase.contact_pairs() {
            let of = |collider: ColliderHandle| self.world.colliders[collider].user_data;
            let (link, sign) = match (of(pair.collider1), of(pair.collider2)) {
                (0, 0) => continue,
                (0, second) => (second, 1.0),
                (first, _) => (first, -1.0),
            };
            for manifold in pair.solver_manifolds() {
                for contact in &manifold.data.solver_contacts {
                    let point = manifold.points.get(contact.contact_indices()[0] as usize);
                    let Some(data) = point.map(|point| &point.data) else { continue };
                    let (a, b) = manifold.data.solver_contact_world_points(contact, &self.world.bodies);
                    // The normal points from the first collider to the second, the tangent acts on the first.
                    let impulse = manifold.data.normal * data.warmstart_impulse - data.warmstart_tangent_world;
                    let force = impulse.as_dvec3() * (sign / per_newton);
                    if force != DVec3::ZERO {
                        let point = (0.5 * (a + b)).as_dvec3() / LENGTH;
                        touches.push(Touch { link: link as usize - 1, point, force });
                    }
                }
            }
        }
        // The order of pairs is that in which they met: sums must not depend on it.
        touches.sort_by(|a, b| a.link.cmp(&b.link).then(a.point.z.total_cmp(&b.point.z)));
        touches
    }

    /// Segments of a finger.
    pub(super) fn links_per_finger(&self) -> usize {
        self.segments[0].len()
    }
}

/// Solver settings of rapier for steps of h (s).
fn parameters(h: f64) -> IntegrationParameters {
    let softness = SpringCoefficients::new(CONTACT_FREQUENCY, CONTACT_DAMPING);
    IntegrationParameters {
        dt: h as f32,
        num_solver_iterations: SUBSTEPS,
        num_internal_pgs_iterations: SWEEPS,
        contact_softness: softness,
        static_contact_softness: softness,
        friction_model: FrictionModel::Coulomb,
        // Contacts are found anew in every step: reused ones would be up to 2.5 mm old.
        contact_recycling: false,
        ..IntegrationParameters::default()
    }
}

/// Segment that a collider belongs to, counted from 1 over both fingers; 0 for all others.
fn user_data(side: Side, links_per_finger: usize, j: usize) -> u128 {
    (side.index() * links_per_finger + j + 1) as u128
}

fn collider(shape: SharedShape, friction: f64, group: Group, meets: Group) -> ColliderBuilder {
    ColliderBuilder::new(shape)
        .density(0.0)
        .friction(friction as f32)
        .friction_combine_rule(CoefficientCombineRule::GeometricMean)
        .collision_groups(InteractionGroups::new(group, meets, InteractionTestMode::And))
}

/// The outline of a segment, pad and bellows, from its joint on: flat behind, and as high in front as the skin over the
/// columns of taxels is. `chamfer` (m) is cut off the front edge of its far end.
fn segment_shape(gripper: &GripperModel, plane: &FingerPlane, reach: f64, chamfer: f64) -> Option<SharedShape> {
    let (grid, half_width) = (gripper.taxels(), 0.5 * gripper.finger.width);
    let edge = gripper.pad.height(half_width);
    let columns = (0..grid.columns).map(|column| (grid.across(column), grid.height(column)));
    let front = columns.chain([-half_width, half_width].map(|across| (across, edge)));
    let back = [-half_width, half_width].map(|across| (across, -gripper.finger.back));
    let front = front.flat_map(|(across, inward)| {
        [(0.0, across, inward), (reach - chamfer, across, inward), (reach, across, inward - chamfer)]
    });
    let back = back.into_iter().flat_map(|(across, inward)| [0.0, reach].map(|along| (along, across, inward)));
    let corners: Vec<Vec3> = front
        .chain(back)
        .map(|(along, across, inward)| plane.direction(DVec2::new(inward, along)) + DVec3::Y * across)
        .map(length)
        .collect();
    SharedShape::convex_hull(&corners)
}

/// A solid of the object as rapier's shape, and its place in the object's frame. A mesh that is not convex stays a
/// mesh.
fn part_shape(part: &SolidPart) -> Option<(SharedShape, Pose)> {
    match part {
        SolidPart::Primitive(shape, object_from_shape) => {
            let (shape, local) = primitive_shape(shape);
            Some((shape, rapier_pose(object_from_shape) * local))
        }
        SolidPart::Mesh(mesh) => {
            let points: Vec<Vec3> = mesh.points.iter().copied().map(length).collect();
            let hull = convex_hull(&mesh.points).ok()?;
            let shape = if hull.signed_volume() < (1.0 + NEARLY_CONVEX) * mesh.signed_volume() {
                SharedShape::convex_hull(&points)?
            } else {
                let flags = TriMeshFlags::FIX_INTERNAL_EDGES | TriMeshFlags::ORIENTED;
                SharedShape::trimesh_with_flags(points, mesh.triangles.clone(), flags).ok()?
            };
            Some((shape, Pose::IDENTITY))
        }
    }
}

/// A primitive as rapier's shape, and how that is turned: rapier's cylinders and capsules stand along y.
fn primitive_shape(shape: &Primitive) -> (SharedShape, Pose) {
    let units = |x: f64| (x * LENGTH) as f32;
    let upright = Pose::from_parts(Vec3::ZERO, Quat::from_rotation_x(std::f32::consts::FRAC_PI_2));
    match *shape {
        Primitive::Sphere { radius } => (SharedShape::ball(units(radius)), Pose::IDENTITY),
        Primitive::Cuboid { half } => {
            (SharedShape::cuboid(units(half.x), units(half.y), units(half.z)), Pose::IDENTITY)
        }
        Primitive::Cylinder { radius, half_length } => {
            (SharedShape::cylinder(units(half_length), units(radius)), upright)
        }
        Primitive::Capsule { radius, half_length } => {
            (SharedShape::capsule_y(units(half_length), units(radius)), upright)
        }
    }
}

/// A length, or a place, in rapier's units.
fn length(v: DVec3) -> Vec3 {
    (v * LENGTH).as_vec3()
}

fn rapier_pose(pose: &palpate_geometry::Pose) -> Pose {
    Pose::from_parts(length(pose.position), pose.rotation.as_quat())
}
