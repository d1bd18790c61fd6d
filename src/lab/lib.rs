//! What people do with a gripper: grasp, record, recognise, label, study.

pub mod datasets;
pub mod grasping;
pub mod gripper;
pub mod labelling;
pub mod picture;
pub mod recording;
pub mod study;
pub mod workers;
