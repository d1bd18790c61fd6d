//! The board's side of the line: what `assets/firmware/due_gripper/gripper_logic.h` does, statement by statement. A test
//! compiles that header and compares what both print, byte by byte.

use crate::protocol::checksum;
use std::fmt::Write as _;

/// Version that the hello line gives.
const FIRMWARE: u32 = 2;

/// Conversions that are averaged, after one that is thrown away.
pub const OVERSAMPLE: u32 = 8;

/// Pressure goes off after this long without a line (µs).
pub const WATCHDOG_US: u32 = 1_000_000;

/// Bytes of a host's line, its end included.
const LONGEST_HEARD: usize = 32;

/// Hundredths of a bar in a step of the control box.
const STEP_CENTIBAR: u32 = 5;

/// How a board is wired and set.
#[derive(Clone, Debug, PartialEq)]
pub struct BoardSetup {
    /// From sample to sample (µs): 20000 is 50 Hz.
    pub period_us: u32,
    /// What the channels are called, in order.
    pub channels: Vec<String>,
    /// Fixed resistor of each channel's divider (ohm).
    pub divider_ohm: Vec<u32>,
    /// Bits of the converter.
    pub bits: u32,
    /// Highest pressure, in steps of 0.05 bar; 0 where no control box is wired.
    pub most_steps: u8,
}

/// A board that runs the firmware.
#[derive(Clone, Debug)]
pub struct FirmwareBoard {
    setup: BoardSetup,
    next_us: u32,
    heard_us: u32,
    seq: u32,
    steps: u8,
    line: Vec<u8>,
    overlong: bool,
    watched: bool,
}

impl FirmwareBoard {
    /// Starts it at a time of its clock (µs): it vents, says hello, and takes the first sample now.
    pub fn begin(setup: BoardSetup, now_us: u32, out: &mut String) -> Self {
        let board = Self {
            setup,
            next_us: now_us,
            heard_us: now_us,
            seq: 0,
            steps: 0,
            line: Vec::new(),
            overlong: false,
            watched: true,
        };
        board.say_hello(out);
        board
    }

    /// Pressure that is on (bar).
    pub fn line_bar(&self) -> f64 {
        f64::from(u32::from(self.steps) * STEP_CENTIBAR) / 100.0
    }

    /// When its next sample is due, on its clock (µs).
    pub fn next_us(&self) -> u32 {
        self.next_us
    }

    /// Pressure set at the control box itself, in steps of 0.05 bar: not the host's, so that the watchdog leaves it.
    pub fn set_by_hand(&mut self, steps: u8) {
        self.steps = steps;
        self.watched = false;
    }

    /// Takes one byte from the host; true when a pressure was set by it.
    pub fn hear(&mut self, byte: u8, now_us: u32, out: &mut String) -> bool {
        match byte {
            b'\r' => return false,
            b'\n' => {}
            _ => {
                if self.line.len() + 1 >= LONGEST_HEARD {
                    self.overlong = true;
                } else {
                    self.line.push(byte);
                }
                return false;
            }
        }
        let line = std::mem::take(&mut self.line);
        if std::mem::take(&mut self.overlong) {
            out.push_str("# refused reason=too-long\n");
            return false;
        }
        if line.is_empty() {
            return false;
        }
        let heard = self.obey(&line, out);
        if heard != Heard::Rubbish {
            self.heard_us = now_us;
        }
        heard == Heard::Pressure
    }

    /// Samples when one is due, vents when the host has gone silent. `convert` makes one conversion of a channel.
    pub fn poll(&mut self, now_us: u32, convert: &mut dyn FnMut(usize) -> u32, out: &mut String) {
        if self.steps > 0 && self.watched && now_us.wrapping_sub(self.heard_us) > WATCHDOG_US {
            self.steps = 0;
            out.push_str("# vent reason=watchdog\n");
        }
        // Times wrap: the later one is less than half the clock's range ahead.
        if now_us.wrapping_sub(self.next_us) > i32::MAX as u32 {
            return;
        }
        while now_us.wrapping_sub(self.next_us) >= self.setup.period_us {
            self.next_us = self.next_us.wrapping_add(self.setup.period_us);
            self.seq = self.seq.wrapping_add(1);
        }
        self.sample(now_us, convert, out);
        self.next_us = self.next_us.wrapping_add(self.setup.period_us);
        self.seq = self.seq.wrapping_add(1);
    }

    fn sample(&self, now_us: u32, convert: &mut dyn FnMut(usize) -> u32, out: &mut String) {
        put(out, format_args!("t_us:{now_us},seq:{}", self.seq));
        for (channel, name) in self.setup.channels.iter().enumerate() {
            convert(channel);
            let sum: u32 = (0..OVERSAMPLE).map(|_| convert(channel)).sum();
            let tenths = (sum * 10 + OVERSAMPLE / 2) / OVERSAMPLE;
            put(out, format_args!(",{name}:{}.{}", tenths / 10, tenths % 10));
        }
        if self.setup.most_steps > 0 {
            out.push_str(",p_bar:");
            put_bar(out, u32::from(self.steps));
        }
        sign(out, ",ck:");
    }

    fn obey(&mut self, line: &[u8], out: &mut String) -> Heard {
        match line {
            [b'P', b' ', text @ ..] => return self.press(text, out),
            b"V" => {
                self.steps = 0;
                self.watched = true;
                self.say_ok(out);
                return Heard::Pressure;
            }
            b"K" => self.say_ok(out),
            b"?" => self.say_hello(out),
            _ => {
                out.push_str("# refused reason=not-understood\n");
                return Heard::Rubbish;
            }
        }
        Heard::Line
    }

    fn press(&mut self, text: &[u8], out: &mut String) -> Heard {
        let Some(centibar) = centibar(text) else {
            out.push_str("# refused reason=not-understood\n");
            return Heard::Rubbish;
        };
        let steps = centibar / STEP_CENTIBAR;
        if self.setup.most_steps == 0 {
            out.push_str("# refused reason=no-control-box\n");
        } else if !centibar.is_multiple_of(STEP_CENTIBAR) {
            out.push_str("# refused reason=not-a-step step=0.05\n");
        } else if steps > u32::from(self.setup.most_steps) {
            out.push_str("# refused reason=above-maximum max=");
            put_bar(out, u32::from(self.setup.most_steps));
            out.push('\n');
        } else {
            self.steps = steps as u8;
            self.watched = true;
            self.say_ok(out);
            return Heard::Pressure;
        }
        Heard::Line
    }

    fn say_ok(&self, out: &mut String) {
        out.push_str("# ok p=");
        put_bar(out, u32::from(self.steps));
        out.push('\n');
    }

    fn say_hello(&self, out: &mut String) {
        let BoardSetup { period_us, channels, divider_ohm, bits, most_steps } = &self.setup;
        let (rate, names) = (1_000_000 / period_us, channels.join(","));
        let ohm: Vec<String> = divider_ohm.iter().map(u32::to_string).collect();
        put(out, format_args!("# tactile-gripper fw={FIRMWARE} adc={bits} vref=3.3 rate={rate} ch={names}"));
        put(out, format_args!(" rm={}", ohm.join(",")));
        if *most_steps > 0 {
            out.push_str(" p_max=");
            put_bar(out, u32::from(*most_steps));
        }
        sign(out, " ck=");
    }
}

/// What a host's line was.
#[derive(Clone, Copy, PartialEq)]
enum Heard {
    /// Not understood.
    Rubbish,
    /// Understood, and nothing was set.
    Line,
    /// A pressure was set.
    Pressure,
}

/// Writing into a string does not fail.
fn put(out: &mut String, text: std::fmt::Arguments<'_>) {
    let _never = out.write_fmt(text);
}

/// Ends the last line of a text with its checksum.
pub(super) fn sign(out: &mut String, key: &str) {
    let begins = out.rfind('\n').map_or(0, |end| end + 1);
    let sum = checksum(&out.as_bytes()[begins..]);
    put(out, format_args!("{key}{sum}\n"));
}

fn put_bar(out: &mut String, steps: u32) {
    let centibar = steps * STEP_CENTIBAR;
    put(out, format_args!("{}.{:02}", centibar / 100, centibar % 100));
}

/// "0.55" in hundredths: at most four digits, at most two of them behind the point, one at least before it.
fn centibar(text: &[u8]) -> Option<u32> {
    let (mut number, mut digits, mut decimals) = (0, 0, None);
    for &byte in text {
        match byte {
            b'.' if decimals.is_none() && digits > 0 => decimals = Some(0),
            b'0'..=b'9' if digits < 4 && decimals < Some(2) => {
                number = number * 10 + u32::from(byte - b'0');
                digits += 1;
                decimals = decimals.map(|count| count + 1);
            }
            _ => return None,
        }
    }
    let missing = 2 - decimals.unwrap_or(0);
    (digits > 0).then(|| number * 10_u32.pow(missing))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pressures_are_read_in_hundredths_or_not_at_all() {
        let read = |text: &str| centibar(text.as_bytes());
        for (text, want) in [("0.55", 55), ("1", 100), ("1.", 100), ("0.5", 50), ("1234", 123_400), ("00.05", 5)] {
            assert_eq!(read(text), Some(want), "{text}");
        }
        for text in ["", ".", ".5", "-1", "1e3", "0.555", "1.2.3", "12345", "0,5", " 1", "nan", "0x1"] {
            assert_eq!(read(text), None, "{text}");
        }
    }
}
