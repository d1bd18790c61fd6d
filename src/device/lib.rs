//! Sensor boards: bytes in, readings out, pressure out. The line protocol, serial ports, diagnosis, and an emulated gripper.

pub mod doctor;
pub mod pretended;
pub mod serial;
pub mod wire;
