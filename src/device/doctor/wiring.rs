//! Wiring of the gripper's board, and the sketch that runs on it. The files of `assets/firmware/due_gripper` are part of the
//! program.

use super::DoctorError;
use palpate_tactile::board::{Sensor, SensorKind, SensorList};
use palpate_tactile::electronics::{PadPart, StripPart};
use std::fs;
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};

/// Wiring, ports and protocol of the board, as a page of Markdown.
pub const WIRING_PAGE: &str = include_str!("../../../assets/firmware/due_gripper/README.md");

/// Name of the sketch, and of its folder: Arduino wants them to be the same.
pub const SKETCH: &str = "due_gripper";

const SKETCH_FILES: [(&str, &str); 3] = [
    ("due_gripper.ino", include_str!("../../../assets/firmware/due_gripper/due_gripper.ino")),
    ("gripper_logic.h", include_str!("../../../assets/firmware/due_gripper/gripper_logic.h")),
    ("README.md", WIRING_PAGE),
];

/// Rules of the wiring.
pub const WIRING_RULES: [&str; 2] = [
    "The pins of a Due take at most 3.3 V: feed the dividers from its 3.3 V pin, never from 5 V.",
    "100 nF from each pin to ground, at the pin: without it one channel bleeds into the next.",
];

/// Voltage divider of one pin.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wire {
    /// Pin; empty where the gripper file names none.
    pub pin: &'static str,
    pub sensor: Sensor,
    /// Part between the pin and 3.3 V.
    pub above: String,
    /// Part between the pin and ground.
    pub below: String,
}

/// The dividers of the strips and pads.
pub fn wires(sensors: SensorList) -> Vec<Wire> {
    let kilo = |ohm: f64| format!("{} kΩ", ohm * 1e-3);
    let wire = |sensor: Sensor| {
        let (pin, part) = (sensor.row().pin.as_deref().unwrap_or_default(), sensor.label());
        let stated = sensor.row().divider_ohm;
        let (above, below) = match sensor.kind() {
            SensorKind::Flex => (kilo(stated.unwrap_or(StripPart::DIVIDER_OHM)), part),
            SensorKind::Pad => (part, kilo(stated.unwrap_or(PadPart::DIVIDER_OHM))),
            SensorKind::Raw => return None,
        };
        Some(Wire { pin, sensor, above, below })
    };
    sensors.iter().filter_map(wire).collect()
}

/// Most channels of the sketch, and the longest name of one (bytes).
const MOST_CHANNELS: usize = 16;
const LONGEST_NAME: usize = 15;

/// Refuses sensors that the sketch has no room for.
pub fn check_firmware(sensors: SensorList) -> Result<(), DoctorError> {
    let has_room = |sensor: &Sensor| sensor.index() < MOST_CHANNELS && sensor.channel().len() <= LONGEST_NAME;
    match sensors.iter().find(|sensor| !has_room(sensor)) {
        None => Ok(()),
        Some(sensor) => Err(DoctorError(format!(
            "the sketch reads at most {MOST_CHANNELS} channels with names of at most {LONGEST_NAME} letters; \"{}\" is one too \
             many or too long",
            sensor.channel()
        ))),
    }
}

/// Table of the channels of the sketch for these sensors, in C.
pub fn firmware_header(sensors: SensorList) -> Result<String, DoctorError> {
    check_firmware(sensors)?;
    let (mut pins, mut names, mut ohms) = (Vec::new(), Vec::new(), Vec::new());
    for sensor in sensors.iter() {
        let (row, name) = (sensor.row(), sensor.channel());
        let pin = row.pin.as_deref().map_or_else(|| format!("A{}", sensor.index()), str::to_owned);
        if !pin.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
            return Err(DoctorError(format!("\"{pin}\", the pin of \"{name}\", is no name of a pin such as A4")));
        }
        let usual = match sensor.kind() {
            SensorKind::Flex => StripPart::DIVIDER_OHM,
            SensorKind::Pad => PadPart::DIVIDER_OHM,
            SensorKind::Raw => 0.0,
        };
        pins.push(pin);
        names.push(format!("\"{name}\""));
        ohms.push(format!("{:.0}", row.divider_ohm.unwrap_or(usual)));
    }
    let [pins, names, ohms] = [pins, names, ohms].map(|cells| cells.join(", "));
    Ok(format!(
        "/* Channels of the gripper, made by palpate doctor --firmware-header. */\n#define CHANNELS {}\nstatic const uint8_t \
         pins_read[] = {{{pins}}};\nstatic const char *const names[] = {{{names}}};\nstatic const uint32_t divider_ohm[] = \
         {{{ohms}}};\n",
        sensors.len()
    ))
}

fn cannot_write(path: &Path, cause: &std::io::Error) -> DoctorError {
    DoctorError(format!("cannot write \"{}\": {cause}. Choose a folder that you may write to", path.display()))
}

/// Writes the sketch into a folder, which is created where it is missing, and returns its files. Writes nothing where a
/// different file exists.
pub fn write_sketch(folder: &Path) -> Result<Vec<PathBuf>, DoctorError> {
    fs::create_dir_all(folder).map_err(|cause| cannot_write(folder, &cause))?;
    let files = SKETCH_FILES.map(|(name, text)| (folder.join(name), text));
    let mut missing = Vec::new();
    for (path, text) in &files {
        match fs::read(path) {
            Ok(there) if there == text.as_bytes() => {}
            Ok(_) => {
                let path = path.display();
                return Err(DoctorError(format!(
                    "\"{path}\" exists and differs: nothing was written. Choose another folder"
                )));
            }
            Err(error) if error.kind() == ErrorKind::NotFound => missing.push((path, text)),
            Err(cause) => return Err(cannot_write(path, &cause)),
        }
    }
    for (path, text) in missing {
        let written = fs::File::create_new(path).and_then(|mut file| file.write_all(text.as_bytes()));
        written.map_err(|cause| cannot_write(path, &cause))?;
    }
    Ok(files.map(|(path, _)| path).to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_says_what_the_dividers_are() {
        let wires = wires(SensorList::default());
        for wire in &wires {
            let row = WIRING_PAGE.lines().find(|line| line.starts_with(&format!("| {} |", wire.pin))).expect("a row");
            let resistor = if wire.sensor.is_flex() { "47 k to 3.3 V" } else { "4.7 k to ground" };
            assert!(row.contains(&wire.sensor.label()) && row.contains(resistor), "{row}");
        }
        assert_eq!([&wires[1].above, &wires[3].below], ["47 kΩ", "4.7 kΩ"]);
    }

    #[test]
    fn the_sketch_is_written_once_and_nothing_is_overwritten() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let at = folder.path().join("new/due_gripper");
        let written = write_sketch(&at)?;
        assert_eq!((written.len(), write_sketch(&at)?), (3, written.clone()));
        assert!(fs::read_to_string(&written[0])?.contains("gripper_logic.h"));
        fs::write(&written[1], "mine")?;
        fs::remove_file(&written[0])?;
        assert!(write_sketch(&at).is_err_and(|error| error.to_string().contains("exists and differs")));
        assert!(!written[0].exists() && fs::read_to_string(&written[1])? == "mine");
        fs::write(folder.path().join("file"), "")?;
        let refused = write_sketch(&folder.path().join("file/due"));
        assert!(refused.is_err_and(|error| error.to_string().starts_with("cannot write")));
        Ok(())
    }
}
