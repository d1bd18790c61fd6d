//! Scratch memory of a step: allocated once, overwritten every step, never saved.

use super::chain::BothSegments;
use super::clearances::Clearances;
use super::contact::{Against, Contact, ContactStep};
use super::environment::{Environment, Passing};
use super::hessian::{Hessian, Lanes};
use super::model::PhysicsModel;
use super::space::Space;
use super::spatial::{Block, Spatial};
use crate::gripper::{SegmentFrame, SegmentPose};
use glam::{DMat3, DVec3};
use palpate_geometry::Pose;

/// Motion of both fingers in the plane y = 0, or a load on them: along x, along z, about y.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Planar(pub(super) [Lanes; 3]);

impl Planar {
    /// Of one finger, in space.
    #[inline]
    pub(super) fn of(&self, finger: usize) -> Spatial {
        let [x, z, turn] = self.0.map(|lanes| lanes.to_array()[finger]);
        Spatial { linear: DVec3::new(x, 0.0, z), angular: DVec3::new(0.0, turn, 0.0) }
    }

    /// Adds a load in space on one finger, less what the joints do not see.
    #[inline]
    pub(super) fn add_to(&mut self, finger: usize, load: &Spatial) {
        for (lanes, value) in self.0.iter_mut().zip([load.linear.x, load.linear.z, load.angular.y]) {
            lanes.as_mut_array()[finger] += value;
        }
    }

    #[inline]
    pub(super) fn plus(&self, other: &Self) -> Self {
        Self([self.0[0] + other.0[0], self.0[1] + other.0[1], self.0[2] + other.0[2]])
    }

    /// Power of a load at this motion.
    #[inline]
    pub(super) fn dot(&self, load: &Self) -> Lanes {
        self.0[0] * load.0[0] + self.0[1] * load.0[1] + self.0[2] * load.0[2]
    }
}

/// The numbers of a block of each finger that joints see.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PlanarBlock {
    xx: Lanes,
    xz: Lanes,
    zz: Lanes,
    yx: Lanes,
    yz: Lanes,
    yy: Lanes,
}

impl PlanarBlock {
    #[inline]
    pub(super) fn add_to(&mut self, finger: usize, block: &Block) {
        let Self { xx, xz, zz, yx, yz, yy } = self;
        for (lanes, value) in [xx, xz, zz, yx, yz, yy].into_iter().zip([
            block.linear.x_axis.x,
            block.linear.x_axis.z,
            block.linear.z_axis.z,
            block.mixed.x_axis.y,
            block.mixed.z_axis.y,
            block.angular.y_axis.y,
        ]) {
            lanes.as_mut_array()[finger] += value;
        }
    }

    #[inline]
    pub(super) fn times(&self, motion: &Planar) -> Planar {
        let [x, z, turn] = motion.0;
        Planar([
            self.xx * x + self.xz * z + self.yx * turn,
            self.xz * x + self.zz * z + self.yz * turn,
            self.yx * x + self.yz * z + self.yy * turn,
        ])
    }
}

/// Hessians summed over the contacts of one segment: against the object, which couples to it, against the world or the
/// other finger, and from the other finger.
#[derive(Clone, Copy, Debug)]
pub(super) struct LinkBlocks {
    pub(super) object: Block,
    pub(super) world: Block,
    /// Found by the other finger's contact springs; kept apart as in [`Workspace::loads`].
    pub(super) met: Block,
}

impl LinkBlocks {
    pub(super) const ZERO: Self = Self { object: Block::ZERO, world: Block::ZERO, met: Block::ZERO };
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
    /// Segments of both fingers in their planes, together and one after the other.
    pub(super) both: Vec<BothSegments>,
    pub(super) segments: Vec<SegmentPose>,
    /// Both fingers in space, where they leave their planes.
    pub(super) space: Option<Box<Space>>,
    /// Point about which spatial velocities are taken: the object's centre of mass (m).
    pub(super) reference: DVec3,
    /// Velocity of everything beyond a joint of each finger per unit of its rate, about the reference.
    pub(super) columns: Vec<Planar>,
    /// Velocity of each segment.
    pub(super) spatial: Vec<Spatial>,
    // dynamics
    pub(super) accelerations: Vec<[Lanes; 2]>,
    /// Joint rates of both fingers, as factors of a product.
    pub(super) rates: Vec<Lanes>,
    /// A = M + h C + h² K of both fingers, N x N.
    pub(super) finger_matrix: Vec<Lanes>,
    /// Inertia of the object in the gripper frame (kg m²).
    pub(super) body_inertia: DMat3,
    /// Momentum and known impulses, r: without contact A v = r.
    pub(super) rhs: Vec<f64>,
    // a hand that moves
    /// Motion of the surroundings in this step; at rest where the hand is.
    pub(super) passing: Passing,
    /// The surroundings where they are in this step; `None` where the hand never moves.
    pub(super) moved_world: Option<Environment>,
    // contacts
    pub(super) clearances: Clearances,
    pub(super) contacts: Vec<Contact>,
    /// True while any of them is between the fingers.
    pub(super) fingers_meet: bool,
    /// Load of contacts on each of the N + 1 segments of both fingers, found by its own contact springs and by those of
    /// the other finger. Kept apart, so that both fingers add up alike and mirrored scenes stay so.
    pub(super) loads: Vec<[Planar; 2]>,
    pub(super) blocks: Vec<LinkBlocks>,
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
    /// Length of the step that the factor of the Hessian is of (s), and whether the fingers met in it.
    pub(super) factor_of: Option<(f64, bool)>,
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
            both: vec![BothSegments::default(); n + 1],
            segments: vec![SegmentPose::default(); links],
            space: model.sideways.as_ref().map(|_| Box::new(Space::new(model))),
            reference: DVec3::ZERO,
            columns: vec![Planar::default(); n],
            spatial: vec![Spatial::default(); links],
            accelerations: vec![[Lanes::ZERO; 2]; n + 1],
            rates: vec![Lanes::ZERO; n],
            finger_matrix: vec![Lanes::ZERO; n * n],
            body_inertia: DMat3::ZERO,
            rhs: vec![0.0; unknowns],
            passing: Passing::default(),
            moved_world: model.hand_motion.as_ref().map(|_| model.environment.clone()),
            clearances: Clearances::new(model),
            contacts: Vec::with_capacity(model.sites()),
            fingers_meet: false,
            loads: vec![[Planar::default(); 2]; n + 1],
            blocks: vec![LinkBlocks::ZERO; links],
            loaded: vec![false; links],
            weights: vec![0.0; unknowns],
            gradient: vec![0.0; unknowns],
            direction: vec![0.0; unknowns],
            a_velocity: vec![0.0; unknowns],
            a_direction: vec![0.0; unknowns],
            hessian: Hessian::new(n, unknowns - 2 * n),
            factor_of: None,
            coupling: vec![Spatial::default(); n * (n + 1)],
        }
    }

    /// Segments in space, where they leave their planes; else none.
    #[inline]
    pub(super) fn frames(&self) -> &[SegmentFrame] {
        self.space.as_ref().map_or(&[], |space| &space.frames)
    }

    /// Size of a vector of all unknowns in the norm of the diagonal of A.
    #[inline]
    pub(super) fn weighted_size(&self, x: &[f64]) -> f64 {
        x.iter().zip(&self.weights).map(|(x, weight)| x * x * weight).sum::<f64>().sqrt()
    }

    /// Force of the surroundings on fingers and object in the last step (N).
    pub(super) fn force_of_world(&self) -> DVec3 {
        let against_world = self.contacts.iter().filter(|contact| contact.against == Against::World);
        let force = |contact: &Contact| {
            let (normal, tangential) = contact.force(self.step);
            contact.normal * normal + tangential
        };
        against_world.map(force).sum()
    }
}
