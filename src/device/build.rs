//! Compiles the board's firmware for the emulator.

fn main() {
    let (wrapper, firmware) = ("emulator/firmware.c", "../../assets/firmware/due_gripper");
    println!("cargo::rerun-if-changed={wrapper}");
    println!("cargo::rerun-if-changed={firmware}/gripper_logic.h");
    cc::Build::new().file(wrapper).include(firmware).std("c99").extra_warnings(true).compile("palpate_firmware");
}
