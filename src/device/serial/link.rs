//! Link to a board: delivers its events in order and reconnects after a disconnection.
//!
//! ```text
//!   "serial-read"                 "serial-decode"              listener
//!   reads, stamps  --bytes-->     Decoder      --events-->     take(): readings, gaps, bytes
//!   reconnects                                                 status(), console(), send()
//! ```
//!
//! Both queues are bounded. From a port, data that do not fit are dropped, counted and reported as a gap; a file of
//! captured bytes waits, so nothing is lost.

use super::baud::Baud;
use super::port_error::PortError;
use super::ports::{BoardKind, PortInfo, describe, list_ports};
use super::queue::{WhenFull, lock};
use super::reader::{PortReader, discard_old, open_port};
use super::replay::Replay;
use super::shared::{LinkOptions, LinkState, Shared};
use crate::protocol::{AdcRange, BoardEvent, ConsoleLine, Saturation};
use palpate_tactile::board::{Board, Detected, Sensor, SensorKind};
use palpate_tactile::cadence::Cadence;
use serde::Serialize;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::JoinHandle;
use std::time::Duration;

/// Status of a link, for display.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LinkStatus {
    /// State of the connection.
    #[serde(flatten)]
    pub state: LinkState,
    /// Port, or file of captured bytes.
    pub port: PortInfo,
    /// Baud rate; none for captured bytes.
    pub baud: Option<u32>,
    /// Present description of the board.
    pub board: Board,
    /// Detected line format; none before two lines agree.
    pub detected: Option<Detected>,
    /// Rate, jitter and losses.
    pub cadence: Cadence,
    /// Saturation of each channel.
    pub saturation: Vec<Option<Saturation>>,
    /// Whether the counts fit the converter's range.
    pub adc_range: AdcRange,
    /// Number of reconnections.
    pub reconnects: u32,
    /// Time since the link was opened (s).
    pub now_s: f64,
    /// Bytes, and readings, dropped because this computer was too slow.
    pub dropped: [u64; 2],
}

impl LinkStatus {
    /// Faults of the connection, and what to try.
    pub fn line_remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        if self.cadence.troubled {
            let bad = self.cadence.bad_lines;
            remarks.push(format!(
                "{bad} unreadable lines so far: see the console; use a short cable directly into the computer, and no other \
                 program on the port"
            ));
        }
        if let [bytes, readings] = self.dropped
            && bytes + readings > 0
        {
            remarks.push(format!("this computer was too slow: {bytes} bytes and {readings} readings dropped"));
        }
        remarks
    }

    /// Faults of the wiring that show in the counts.
    pub fn wiring_remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        let full = self.board.full_scale;
        match self.adc_range {
            AdcRange::Fits => {}
            AdcRange::LooksTenBit => remarks.push(format!(
                "the counts look like 10 bits, but the range is {full}: derived values are wrong. Call \
                 analogReadResolution(12) in the sketch"
            )),
            AdcRange::Exceeded => remarks.push(format!(
                "counts exceed {full}: derived values are wrong. State the converter's bits in the handshake, as in adc=16"
            )),
        }
        for (channel, (name, saturation)) in self.board.channels.iter().zip(&self.saturation).enumerate() {
            let sensor = self.board.sensor_of(channel).filter(|sensor| sensor.kind() != SensorKind::Raw);
            remarks.extend(match (saturation, sensor.is_some_and(Sensor::is_flex)) {
                (Some(Saturation::High), true) => {
                    Some(format!("{name} is at full scale: the strip or one of its wires is disconnected"))
                }
                (Some(Saturation::Low), true) => Some(format!("{name} reads zero: the strip is shorted, or its divider has no supply")),
                // Other channels, such as the limits of a plot, need not come from the converter.
                (Some(Saturation::High), false) => sensor.map(|_| {
                    format!(
                        "{name} is saturated: more than it can measure, a divider on 5 V instead of 3.3 V, or a resistor to \
                         ground that is missing or too large"
                    )
                }),
                (Some(Saturation::NoNumber), _) => sensor.map(|_| {
                    format!("{name} has no numbers: an open circuit as the sketch sees it; look at its lines in the console")
                }),
                // A pad without load reads zero.
                (Some(Saturation::Low), false) | (None, _) => None,
            });
        }
        remarks
    }

    /// Baud rate and line format, in words.
    pub fn format_summary(&self) -> String {
        let speed = self.baud.map(|baud| format!("{baud} baud"));
        let format = self.detected.as_ref().map(|detected| detected.why.clone());
        speed.into_iter().chain(format).collect::<Vec<String>>().join("; ")
    }
}

/// Why a line could not be sent to the board.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SendError {
    #[error("the board is not connected: nothing was sent")]
    NotConnected,
    #[error("cannot send to the board: {0}")]
    Port(String),
}

/// Open link. Dropping it closes the port.
#[derive(Debug)]
pub struct SerialLink {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
}

impl SerialLink {
    /// Opens a port or a file of captured bytes, and starts listening.
    pub fn open(options: &LinkOptions) -> Result<Self, PortError> {
        let port = match &options.path {
            Some(path) if is_capture(path) => return Self::replay(path, options),
            Some(path) => describe(path),
            None => choose(&list_ports())?,
        };
        let shared = Shared::new(port.clone(), WhenFull::Drop, options.sensors);
        let baud = options.baud.unwrap_or(Baud::B115200);
        let opened = open_port(&port.path, baud)?;
        discard_old(opened.as_ref(), port.kind);
        *lock(&shared.writer) = opened.try_clone().ok();
        let reader = PortReader::new(Arc::clone(&shared), port, baud, options);
        Self::start(&shared, move || reader.run(opened))
    }

    fn replay(path: &Path, options: &LinkOptions) -> Result<Self, PortError> {
        let replay = Replay::open(path, options.replay_speed)?;
        let port = PortInfo {
            path: path.to_owned(),
            title: "captured bytes".to_owned(),
            usb: None,
            kind: BoardKind::default(),
        };
        let shared = Shared::new(port, WhenFull::Wait, options.sensors);
        let for_thread = Arc::clone(&shared);
        Self::start(&shared, move || replay.run(&for_thread))
    }

    fn start(shared: &Arc<Shared>, read: impl FnOnce() + Send + 'static) -> Result<Self, PortError> {
        let mut link = Self { shared: Arc::clone(shared), threads: Vec::new() };
        let path = lock(&shared.port).path.clone();
        let thread = |name: &str| std::thread::Builder::new().name(name.to_owned());
        let failed = |error: std::io::Error| PortError::of(&path, &error.into(), &[]);
        let decoding = Arc::clone(shared);
        link.threads.push(thread("serial-decode").spawn(move || decoding.decode()).map_err(failed)?);
        let closing = Arc::clone(shared);
        let reading = thread("serial-read").spawn(move || {
            read();
            closing.bytes.close();
        });
        match reading {
            Ok(reading) => link.threads.push(reading),
            Err(error) => {
                shared.bytes.close();
                return Err(failed(error));
            }
        }
        Ok(link)
    }

    /// Takes the events since the last call; waits up to `patience` for the first.
    pub fn take(&self, patience: Duration) -> Vec<BoardEvent> {
        self.shared.events.take(patience)
    }

    /// True when every event was taken and no more will come.
    pub fn is_over(&self) -> bool {
        self.shared.events.is_over()
    }

    /// Time on the clock of the readings (s since the link was opened).
    pub fn now_s(&self) -> f64 {
        self.shared.began.elapsed().as_secs_f64()
    }

    /// Sends a line to the board.
    pub fn send(&self, line: &str) -> Result<(), SendError> {
        let mut writer = lock(&self.shared.writer);
        let port = writer.as_mut().ok_or(SendError::NotConnected)?;
        port.write_all(format!("{line}\n").as_bytes()).map_err(|error| SendError::Port(error.to_string()))
    }

    /// Status, for display.
    pub fn status(&self) -> LinkStatus {
        let shared = &self.shared;
        let decoder = lock(&shared.decoder);
        let baud = shared.baud.load(Ordering::Relaxed);
        LinkStatus {
            state: lock(&shared.state).clone(),
            port: lock(&shared.port).clone(),
            baud: (baud > 0).then_some(baud),
            board: decoder.board(),
            detected: decoder.detected(),
            cadence: decoder.cadence(),
            saturation: decoder.saturation(),
            adc_range: decoder.adc_range(),
            reconnects: shared.reconnects.load(Ordering::Relaxed),
            now_s: self.now_s(),
            dropped: [shared.bytes.dropped_bytes(), shared.events.dropped_readings()],
        }
    }

    /// Newest raw lines, oldest first.
    pub fn console(&self) -> Vec<ConsoleLine> {
        lock(&self.shared.decoder).console().cloned().collect()
    }

    /// Stops listening; events so far can still be taken.
    pub fn stop(&self) {
        self.shared.stop.store(true, Ordering::Relaxed);
    }
}

impl Drop for SerialLink {
    fn drop(&mut self) {
        self.stop();
        // Wakes threads that wait for room.
        self.shared.events.close();
        self.shared.bytes.close();
        for thread in self.threads.drain(..) {
            // A panic in the thread has printed itself.
            let _ended = thread.join();
        }
    }
}

/// True for a file of bytes; ports are devices.
pub(crate) fn is_capture(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|metadata| metadata.is_file())
}

/// Chooses the only likely port.
fn choose(ports: &[PortInfo]) -> Result<PortInfo, PortError> {
    let best = ports.iter().map(|port| port.kind.rank).max().unwrap_or(0);
    let mut likely = ports.iter().filter(|port| best > 0 && port.kind.rank == best);
    match (likely.next(), likely.next()) {
        (Some(port), None) => Ok(port.clone()),
        (Some(_), Some(_)) => Err(PortError::several(ports)),
        (None, _) => Err(PortError::no_board(ports)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serialport::{SerialPortType, UsbPortInfo};

    fn usb(path: &str, vid: u16, pid: u16) -> PortInfo {
        let info = UsbPortInfo { vid, pid, serial_number: None, manufacturer: None, product: None };
        PortInfo::new(path.to_owned(), &SerialPortType::UsbPort(info))
    }

    #[test]
    fn one_likely_board_is_chosen_and_several_are_listed() {
        let built_in = PortInfo::new("/dev/ttyS0".to_owned(), &SerialPortType::PciPort);
        let due = usb("/dev/ttyACM0", 0x2341, 0x003d);
        let other = usb("/dev/ttyUSB0", 0x1a86, 0x7523);
        assert_eq!(choose(&[built_in.clone(), other, due.clone()]), Ok(due.clone()));
        let both = choose(&[due, usb("/dev/ttyACM1", 0x2341, 0x003e)]).map_err(|e| e.to_string());
        assert!(both.is_err_and(|text| text.contains("native port") && text.contains("/dev/ttyACM0")));
        assert!(choose(&[built_in]).is_err_and(|e| e.to_string().contains("/dev/ttyS0")));
        assert!(choose(&[]).is_err());
    }
}
