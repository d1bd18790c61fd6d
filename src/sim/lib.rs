//! Soft-gripper simulation: a scene in, frames out.

pub mod frame;
pub mod gripper;
pub mod objects;
pub mod physics;
pub mod poses;
pub mod run;
pub mod scene;
