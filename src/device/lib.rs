//! Sensor boards: serial protocol, ports, diagnosis, and an emulated gripper.

pub mod doctor;
pub mod emulator;
pub mod protocol;
pub mod serial;
