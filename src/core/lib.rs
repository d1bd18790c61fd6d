//! core (tour comes here)

pub mod geometry;
pub mod gripper;
pub mod objects;
pub mod palette;
pub mod physics;
pub mod scene;
pub mod sensing;
pub mod trial;
pub mod units;
