//! Interface of a physics engine. Implemented by [`super::Simulation`], Palpate's own convex step, and by
//! `RapierSimulation`, which is rapier3d (feature `rapier`).

use super::step::NotFinite;
use crate::frame::{Frame, Plan, Quality};
use crate::gripper::Phase;
use crate::scene::Clock;
use glam::DVec3;

/// A simulation that had to stop.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the simulation stopped after {seconds:.3} s (step {tick}): {cause}")]
pub struct SimulationError {
    /// The step that failed.
    pub tick: u64,
    /// Its time (s).
    pub seconds: f64,
    pub cause: NotFinite,
}

/// A gripper and an object in motion, on a clock of whole ticks.
pub trait Engine {
    /// The clock that ticks count.
    fn clock(&self) -> Clock;

    /// Ticks passed.
    fn tick(&self) -> u64;

    /// Effects simulated, with the reason for each.
    fn plan(&self) -> &Plan;

    /// Sets the line pressure (bar) from now on.
    fn command(&mut self, bar: f64, phase: Phase);

    /// Pulls at the object's centre of mass (N, world axes) from now on.
    fn pull_object(&mut self, force: DVec3);

    /// Moves the object to another place and orientation, as if it had been put down there: a shift (m) and a turn
    /// about its centre of mass (axis times angle, rad), world axes.
    fn move_object(&mut self, shift: DVec3, turn: DVec3);

    /// Lets some ticks pass, within which nothing is sampled or commanded.
    fn advance_by(&mut self, ticks: u64) -> Result<(), SimulationError>;

    /// Time at which finger contact left out by the plan was turned on (s); `None` if never.
    fn finger_contact_turned_on(&self) -> Option<f64> {
        None
    }

    /// Sample of the present state.
    fn frame(&self) -> Frame;

    /// Normal force of each pad on the object in the last step, left and right (N); `None` where pads touch nothing else, so
    /// that it is the whole load of their taxels.
    fn force_on_object(&self) -> Option<[f64; 2]> {
        None
    }

    /// Deepest compression of the pads before the first step (m).
    fn starting_overlap(&mut self) -> f64;

    /// Convex minimisations so far.
    fn solves(&self) -> u64;

    /// Numerical quality of the steps so far; the static residual is that of the present state.
    fn quality(&self) -> Quality;
}
