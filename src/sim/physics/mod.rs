//! Soft-finger physics: two planar chains with compliant pads and one rigid object, stepped by a single convex
//! minimisation per step of length h.
//!
//! ```text
//! v+ = argmin  1/2 (v - v*)' A (v - v*)  +  sum over contacts l_c(J_c v),     A = M + h C + h² K
//! ```
//!
//! v: all joint rates, and six velocities of the object where it is free. M, C, K: inertia, damping and stiffness;
//! v* carries torques, gravity and Coriolis forces. Springs, dampers and contacts are all taken at the *end* of the
//! step, so that no stiffness, however large, makes a step unstable.
//!
//! [`effects`] decides which parts of this a scene needs.
//!
//! Read in this order: `chain` (what a finger resists), `contact springs`, `stretch` and `detect` (where it touches), `contact`
//! (what a touch costs), `solve` (the minimisation), `step` (all of it in order), `integrator` and `stepper` (which
//! steps, and how long), [`Simulation`] (a grasp in time). A second engine, `RapierSimulation` (feature `rapier`),
//! computes the same scenes independently; both are an [`Engine`].
//! [`SteppedScene`] takes steps of any length, for tests and hard cases; `explicit` is there to be compared with.

mod balance;
mod chain;
mod clearances;
#[cfg(test)]
mod closed_form_tests;
mod contact;
mod contact_springs;
mod coupling;
mod detect;
pub mod effects;
#[cfg(test)]
mod effects_tests;
mod energy;
#[cfg(test)]
mod energy_tests;
mod engine;
mod environment;
mod explicit;
mod finger_pair;
mod hessian;
mod integrator;
mod model;
mod placement;
#[cfg(feature = "rapier")]
mod rapier_engine;
#[cfg(feature = "rapier")]
mod resting;
#[cfg(test)]
mod shaking_tests;
mod sideways;
mod simulation;
#[cfg(test)]
mod softness_tests;
mod solve;
mod space;
mod space_step;
#[cfg(test)]
mod space_tests;
mod spatial;
mod state;
mod step;
mod stepped;
mod stepper;
#[cfg(test)]
mod stepper_tests;
mod stretch;
mod workspace;

pub use engine::{Engine, SimulationError};
pub use model::PhysicsModel;
pub use placement::{Placement, random_rotation};
#[cfg(feature = "rapier")]
pub use rapier_engine::RapierSimulation;
#[cfg(feature = "rapier")]
pub use resting::natural_rotations;
pub use simulation::{Refinement, Simulation};
pub use solve::Unbalanced;
pub use state::State;
pub use step::{Drive, NotFinite, StepReport, step};
pub use stepped::{SkinForce, SteppedScene, Stepping};
pub use workspace::Workspace;
