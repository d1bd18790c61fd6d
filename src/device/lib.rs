//! Sensor boards: bytes in, readings out, pressure out. The line protocol, serial ports, diagnosis, and an emulated gripper.

pub mod doctor;
pub mod emulator;
pub mod protocol;
pub mod serial;
