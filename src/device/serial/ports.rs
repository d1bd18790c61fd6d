//! Serial ports, their boards, and the choice among them. Names and numbers come from the USB device.

use serde::Serialize;
use serialport::{SerialPortType, available_ports};
use std::path::{Path, PathBuf};

/// Identity of a USB device, by which it is found again on another port.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct UsbIdentity {
    /// Vendor.
    pub vid: u16,
    /// Product.
    pub pid: u16,
    /// Serial number, where it has one.
    pub serial: Option<String>,
}

/// Serial port.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct PortInfo {
    /// Its path: `/dev/ttyACM0`, `COM3`.
    pub path: PathBuf,
    /// Its board, in words.
    pub title: String,
    /// Its USB device, if it is one.
    pub usb: Option<UsbIdentity>,
    #[serde(skip)]
    pub kind: BoardKind,
}

/// Kind of board, by its USB numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BoardKind {
    /// Likelihood of being the gripper's board; 0 is never chosen automatically.
    pub rank: u8,
    /// Native USB: the baud rate has no effect, and nothing is sent until DTR is set.
    pub native: bool,
}

/// Known devices by vendor and product; product 0 means any other of the vendor. Sources: Arduino's
/// `boards.txt`, usb.ids.
const KNOWN: &[(u16, u16, &str, BoardKind)] = &[
    (0x2341, 0x003d, "Arduino Due, programming port", BoardKind { rank: 3, native: false }),
    (0x2a03, 0x003d, "Arduino Due, programming port", BoardKind { rank: 3, native: false }),
    (0x2341, 0x003e, "Arduino Due, native port", BoardKind { rank: 3, native: true }),
    (0x2a03, 0x003e, "Arduino Due, native port", BoardKind { rank: 3, native: true }),
    (0x2341, 0x0043, "Arduino Uno", BoardKind { rank: 2, native: false }),
    (0x2341, 0x0042, "Arduino Mega 2560", BoardKind { rank: 2, native: false }),
    (0x2341, 0x8036, "Arduino Leonardo", BoardKind { rank: 2, native: true }),
    (0x2341, 0x8037, "Arduino Micro", BoardKind { rank: 2, native: true }),
    (0x2341, 0x804d, "Arduino Zero", BoardKind { rank: 2, native: true }),
    (0x2341, 0x0058, "Arduino Nano Every", BoardKind { rank: 2, native: false }),
    (0x2341, 0, "Arduino", BoardKind { rank: 2, native: false }),
    (0x2a03, 0, "Arduino", BoardKind { rank: 2, native: false }),
    (0x16c0, 0x0483, "Teensy", BoardKind { rank: 2, native: true }),
    (0x2e8a, 0x000a, "Raspberry Pi Pico", BoardKind { rank: 2, native: true }),
    (0x1a86, 0x7523, "CH340 converter (many boards)", BoardKind { rank: 1, native: false }),
    (0x1a86, 0, "WCH converter (many boards)", BoardKind { rank: 1, native: false }),
    (0x0403, 0, "FTDI converter (many boards)", BoardKind { rank: 1, native: false }),
    (0x10c4, 0xea60, "CP210x converter (many boards)", BoardKind { rank: 1, native: false }),
    (0x067b, 0x2303, "PL2303 converter (many boards)", BoardKind { rank: 1, native: false }),
];

impl PortInfo {
    /// A port as the system describes it.
    pub(super) fn new(path: String, kind: &SerialPortType) -> Self {
        let path = PathBuf::from(path);
        let SerialPortType::UsbPort(usb) = kind else {
            let title = match kind {
                SerialPortType::BluetoothPort => "Bluetooth",
                SerialPortType::PciPort => "built-in port",
                SerialPortType::UsbPort(_) | SerialPortType::Unknown => "serial port",
            };
            return Self { path, title: title.to_owned(), usb: None, kind: BoardKind::default() };
        };
        let known = |wanted: u16| KNOWN.iter().find(|(vid, pid, ..)| *vid == usb.vid && *pid == wanted);
        let known = known(usb.pid).or_else(|| known(0));
        let kind = known.map_or(BoardKind { rank: 1, native: false }, |(.., kind)| *kind);
        let named = known.map(|(_, _, name, _)| (*name).to_owned());
        let name = named.or_else(|| usb.product.clone()).unwrap_or_else(|| "USB serial port".to_owned());
        let title = format!("{name} (USB {:04x}:{:04x})", usb.vid, usb.pid);
        let identity = UsbIdentity { vid: usb.vid, pid: usb.pid, serial: usb.serial_number.clone() };
        Self { path, title, usb: Some(identity), kind }
    }

    /// A port that is not listed: a pseudo-terminal, or a link to one.
    pub(super) fn unlisted(path: &Path) -> Self {
        // On a Mac they are called /dev/ttys000.
        let is_pty = std::fs::canonicalize(path)
            .is_ok_and(|real| real.starts_with("/dev/pts") || real.to_string_lossy().starts_with("/dev/ttys"));
        let title = if is_pty { "pseudo-terminal" } else { "serial port" };
        Self { path: path.to_owned(), title: title.to_owned(), usb: None, kind: BoardKind::default() }
    }
}

/// Lists all ports, likely boards first.
pub fn list_ports() -> Vec<PortInfo> {
    // The library expects this folder; containers may lack it.
    if cfg!(target_os = "linux") && !Path::new("/sys/class/tty").is_dir() {
        return Vec::new();
    }
    let found = available_ports().unwrap_or_default();
    let mut ports: Vec<PortInfo> =
        found.into_iter().map(|port| PortInfo::new(port.port_name, &port.port_type)).collect();
    // Every port of a Mac comes twice; tty.* waits for a carrier that boards do not give.
    ports.retain(|port| !port.path.to_string_lossy().starts_with("/dev/tty."));
    ports.sort_by(|a, b| b.kind.rank.cmp(&a.kind.rank).then_with(|| a.path.cmp(&b.path)));
    ports
}

/// Describes the port at a path.
pub(super) fn describe(path: &Path) -> PortInfo {
    let real = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let listed = list_ports().into_iter().find(|port| port.path == real || port.path == path);
    listed.map_or_else(|| PortInfo::unlisted(path), |port| PortInfo { path: path.to_owned(), ..port })
}

/// Finds the port of a device.
pub(super) fn find(identity: &UsbIdentity) -> Option<PortInfo> {
    list_ports().into_iter().find(|port| port.usb.as_ref() == Some(identity))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serialport::UsbPortInfo;

    fn usb(path: &str, vid: u16, pid: u16, product: Option<&str>) -> PortInfo {
        let info = UsbPortInfo {
            vid,
            pid,
            serial_number: Some("A1".to_owned()),
            manufacturer: None,
            product: product.map(str::to_owned),
        };
        PortInfo::new(path.to_owned(), &SerialPortType::UsbPort(info))
    }

    #[test]
    fn boards_are_called_by_their_names() {
        let due = usb("/dev/ttyACM0", 0x2341, 0x003d, Some("Arduino Due Prog. Port"));
        assert_eq!(due.title, "Arduino Due, programming port (USB 2341:003d)");
        assert!(usb("/dev/ttyACM1", 0x2a03, 0x003e, None).kind.native);
        assert_eq!(usb("/dev/ttyACM1", 0x2341, 0x9999, None).title, "Arduino (USB 2341:9999)");
        assert_eq!(usb("/dev/ttyUSB0", 0x1234, 0x5678, Some("Odd thing")).title, "Odd thing (USB 1234:5678)");
    }
}
