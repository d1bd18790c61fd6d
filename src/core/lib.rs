//! core (tour comes here)

pub mod drawing;
pub mod geometry;
pub mod grasping;
pub mod gripper;
pub mod objects;
pub mod palette;
pub mod physics;
pub mod picture;
pub mod recording;
pub mod rig;
pub mod scene;
pub mod sensing;
pub mod study;
pub mod trial;
pub mod units;
pub mod workers;
