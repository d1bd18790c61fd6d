//! Scratch memory of a step: allocated once, overwritten every step, never saved.

use super::clearances::Clearances;
use super::contact::{Contact, ContactStep};
use super::hessian::Hessian;
use super::model::PhysicsModel;
use crate::gripper::SegmentPose;
use glam::{DMat3, DVec2, DVec3};
use palpate_geometry::Pose;

/// Velocity of a rigid body: of the point at the reference, and angular.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Spatial {
    pub(super) linear: DVec3,
    pub(super) angular: DVec3,
}

impl Spatial {
    pub(super) fn scaled(&self, factor: f64) -> Self {
        Self { linear: self.linear * factor, angular: self.angular * factor }
    }

    pub(super) fn plus(&self, other: &Self) -> Self {
        Self { linear: self.linear + other.linear, angular: self.angular + other.angular }
    }

    /// Power of a wrench on a body with this velocity.
    pub(super) fn dot(&self, wrench: &Self) -> f64 {
        self.linear.dot(wrench.linear) + self.angular.dot(wrench.angular)
    }
}

/// A symmetric 6 x 6 block over (linear, angular), as contacts at different arms add up to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    /// Linear by linear.
    pub(super) linear: DMat3,
    /// Angular rows, linear columns.
    pub(super) mixed: DMat3,
    /// Angular by angular.
    pub(super) angular: DMat3,
}

impl Block {
    pub(super) const ZERO: Self = Self { linear: DMat3::ZERO, mixed: DMat3::ZERO, angular: DMat3::ZERO };

    /// Adds a contact's 3 x 3 Hessian G at an arm r: J' G J with J = [1, -[r]x].
    #[inline]
    pub(super) fn add_at(&mut self, g: &DMat3, arm: DVec3) {
        let crossed = |m: &DMat3| DMat3::from_cols(arm.cross(m.x_axis), arm.cross(m.y_axis), arm.cross(m.z_axis));
        let mixed = crossed(g);
        self.linear += *g;
        self.mixed += mixed;
        self.angular += crossed(&mixed.transpose());
    }

    #[inline]
    pub(super) fn add(&mut self, other: &Self) {
        self.linear += other.linear;
        self.mixed += other.mixed;
        self.angular += other.angular;
    }

    #[inline]
    pub(super) fn times(&self, x: &Spatial) -> Spatial {
        Spatial {
            linear: self.linear * x.linear + self.mixed.transpose() * x.angular,
            angular: self.mixed * x.linear + self.angular * x.angular,
        }
    }
}

/// The numbers of a block that joints see: they move in the plane y = 0 and turn about y.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PlanarBlock {
    xx: f64,
    xz: f64,
    zz: f64,
    yx: f64,
    yz: f64,
    yy: f64,
}

impl PlanarBlock {
    #[inline]
    pub(super) fn add(&mut self, block: &Block) {
        self.xx += block.linear.x_axis.x;
        self.xz += block.linear.x_axis.z;
        self.zz += block.linear.z_axis.z;
        self.yx += block.mixed.x_axis.y;
        self.yz += block.mixed.z_axis.y;
        self.yy += block.angular.y_axis.y;
    }

    /// Forces along x and z and the torque about y.
    #[inline]
    pub(super) fn times(&self, x: &Spatial) -> [f64; 3] {
        let (lx, lz, ay) = (x.linear.x, x.linear.z, x.angular.y);
        [
            self.xx * lx + self.xz * lz + self.yx * ay,
            self.xz * lx + self.zz * lz + self.yz * ay,
            self.yx * lx + self.yz * lz + self.yy * ay,
        ]
    }
}

/// Sums over the contacts of one segment: against the object, which couples to it, against the world or the other
/// finger, and from the other finger.
#[derive(Clone, Copy, Debug)]
pub(super) struct PerLink<T> {
    pub(super) object: T,
    pub(super) world: T,
    /// Found by the other finger's contact springs. Kept apart, so that both fingers add up alike and mirrored scenes
    /// stay so.
    pub(super) met: T,
}

impl<T: Copy> PerLink<T> {
    pub(super) fn all(value: T) -> Self {
        Self { object: value, world: value, met: value }
    }
}

/// Scratch memory; see the fields for what each stage leaves.
#[derive(Clone, Debug)]
pub struct Workspace {
    /// Length of the step that is being taken, or was taken last.
    pub(super) step: ContactStep,
    // layout
    /// Joint angles and pose of the object that geometry is taken from.
    pub(super) q: Vec<f64>,
    pub(super) body: Pose,
    /// Segments of both fingers in their planes.
    pub(super) segments: Vec<SegmentPose>,
    /// Point about which spatial velocities are taken: the object's centre of mass (m).
    pub(super) reference: DVec3,
    /// Velocity of everything beyond a joint per unit of its rate, about the reference.
    pub(super) columns: Vec<Spatial>,
    /// Velocity of each segment.
    pub(super) spatial: Vec<Spatial>,
    // dynamics
    pub(super) accelerations: Vec<DVec2>,
    pub(super) bias: Vec<f64>,
    /// Rates of a finger without inertia, as its bias forces see them: zero.
    pub(super) still: Vec<f64>,
    /// A = M + h C + h² K of both fingers, one N x N matrix after the other.
    pub(super) finger_matrix: Vec<f64>,
    /// Inertia of the object in the gripper frame (kg m²).
    pub(super) body_inertia: DMat3,
    /// Momentum and known impulses, r: without contact A v = r.
    pub(super) rhs: Vec<f64>,
    // contacts
    pub(super) clearances: Clearances,
    pub(super) contacts: Vec<Contact>,
    /// True while any of them is between the fingers.
    pub(super) fingers_meet: bool,
    pub(super) wrenches: Vec<PerLink<Spatial>>,
    pub(super) blocks: Vec<PerLink<Block>>,
    /// Segments whose blocks are not zero.
    pub(super) loaded: Vec<bool>,
    /// One over the diagonal of A.
    pub(super) weights: Vec<f64>,
    // Newton
    pub(super) gradient: Vec<f64>,
    pub(super) direction: Vec<f64>,
    pub(super) a_velocity: Vec<f64>,
    pub(super) a_direction: Vec<f64>,
    pub(super) hessian: Hessian,
    /// Forces of the contacts between the fingers on each segment of the right finger per unit rate of each joint of
    /// the left one, `N x (N + 1)`.
    pub(super) coupling: Vec<Spatial>,
}

impl Workspace {
    /// Memory for a step of the model; its length is set as it is taken.
    pub fn new(model: &PhysicsModel) -> Self {
        let (n, links, unknowns) = (model.chain.joints, model.link_count(), model.unknowns());
        Self {
            step: ContactStep { h: 0.0, ..model.contact },
            q: vec![0.0; 2 * n],
            body: Pose::IDENTITY,
            segments: vec![SegmentPose::default(); links],
            reference: DVec3::ZERO,
            columns: vec![Spatial::default(); 2 * n],
            spatial: vec![Spatial::default(); links],
            accelerations: vec![DVec2::ZERO; n + 1],
            bias: vec![0.0; n],
            still: vec![0.0; n],
            finger_matrix: vec![0.0; 2 * n * n],
            body_inertia: DMat3::ZERO,
            rhs: vec![0.0; unknowns],
            clearances: Clearances::new(model),
            contacts: Vec::with_capacity(model.sites()),
            fingers_meet: false,
            wrenches: vec![PerLink::all(Spatial::default()); links],
            blocks: vec![PerLink::all(Block::ZERO); links],
            loaded: vec![false; links],
            weights: vec![0.0; unknowns],
            gradient: vec![0.0; unknowns],
            direction: vec![0.0; unknowns],
            a_velocity: vec![0.0; unknowns],
            a_direction: vec![0.0; unknowns],
            hessian: Hessian::new(n, unknowns - 2 * n),
            coupling: vec![Spatial::default(); n * (n + 1)],
        }
    }
}
