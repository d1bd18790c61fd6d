//! Decoder: bytes to readings. The line format is detected; unreadable lines are counted and become gaps, which are not
//! filled.

use super::cadence::Meter;
use super::checksum;
use super::clock::{Counters, Stamp, StreamClock};
use super::columns::Columns;
use super::fields::{Field, Parsed, parse};
use super::handshake::{self, Handshake};
use super::line_log::{ConsoleLine, LineKind, LineLog};
use super::lines::{Line, LineSplitter};
use super::reply::BoardReply;
use super::saturation::{AdcRange, FULL_10_BIT, FULL_12_BIT, Saturation, SaturationWatch};
use super::shape::{Candidate, LineVerdict, Role, Shapes};
use palpate_tactile::board::{Board, Detected, Format, Gap, Reading, Sensor, SensorList, TimeSource};
use palpate_tactile::cadence::Cadence;
use palpate_tactile::capture::Captured;

/// Event of a board's stream, in order. A link adds the bytes; the decoder gives the rest.
#[derive(Clone, Debug, PartialEq)]
pub enum BoardEvent {
    /// Raw bytes, or a mark that the connection was lost. The events decoded from them follow.
    Captured(Captured),
    /// A line of numbers.
    Reading(Reading),
    /// Readings are missing before the next one.
    Gap(Gap),
    /// The description of the board changed. Channels are only added, or renamed in place.
    Board(Board),
    /// A reply or remark of the board.
    Reply(BoardReply),
}

impl BoardEvent {
    /// The reading, if it is one.
    pub fn reading(&self) -> Option<&Reading> {
        if let Self::Reading(reading) = self { Some(reading) } else { None }
    }

    /// The same by value.
    pub fn into_reading(self) -> Option<Reading> {
        if let Self::Reading(reading) = self { Some(reading) } else { None }
    }
}

/// Decoder of one board's stream, in bounded memory.
#[derive(Clone, Debug, Default)]
pub struct Decoder {
    splitter: LineSplitter,
    reader: Reader,
}

/// A decoder without the unfinished line.
#[derive(Clone, Debug, Default)]
struct Reader {
    /// Sensors of the gripper.
    list: SensorList,
    shapes: Shapes,
    columns: Columns,
    /// Names of the channels, in the order of the counts.
    channels: Vec<String>,
    /// Sensor of each channel.
    sensors: Vec<Option<Sensor>>,
    /// Channels of flex strips beside a usual resistor.
    strips: Vec<bool>,
    /// Handshake of the board.
    handshake: Option<Handshake>,
    clock: StreamClock,
    meter: Meter,
    saturation: SaturationWatch,
    line_log: LineLog,
    /// Unreadable lines since the last reading.
    unreadable: u64,
    /// Why readings may be missing before the next one.
    broken: Option<String>,
    /// The newest reading's time (s).
    last_s: Option<f64>,
}

/// Divider resistor up to which a strip, which has at least 17.5 kΩ (data sheet), stays above a quarter of the range (ohm).
const LARGEST_BESIDE_A_STRIP: f64 = 50e3;

/// Parts of the line in which an ESP32 and an ESP8266 give the reason of a restart.
const START_MESSAGES: [&str; 2] = ["rst:0x", ",rst cause:"];

/// Largest valid counter: beyond it an `f64` no longer separates whole numbers.
const LARGEST_COUNTER: f64 = 9.0e15;

impl Decoder {
    /// A decoder of boards that carry these sensors.
    pub fn new(sensors: SensorList) -> Self {
        let reader = Reader { list: sensors, columns: Columns::new(sensors), ..Reader::default() };
        Self { reader, ..Self::default() }
    }

    /// Decodes bytes that arrived at a time (s since the stream began) and appends their events to `events`.
    pub fn push(&mut self, bytes: &[u8], arrived_s: f64, events: &mut Vec<BoardEvent>) {
        let Self { splitter, reader } = self;
        reader.meter.bytes(bytes, arrived_s);
        splitter.push(bytes, |line| match line {
            Line::Whole(line) => reader.line(line, arrived_s, events),
            Line::First(line) => reader.first(line, arrived_s, events),
            Line::TooLong => reader.bad(b"", "too long", arrived_s),
        });
    }

    /// Marks an interruption; readings that turn out to be missing are attributed to `cause`.
    pub fn interrupt(&mut self, cause: &str) {
        self.splitter.interrupt();
        self.reader.shapes.give_up();
        self.reader.clock.interrupt();
        // Another sketch may be on the board when it comes back, without checksums or a handshake.
        self.reader.handshake.iter_mut().for_each(|handshake| handshake.checked = false);
        self.reader.broken = Some(cause.to_owned());
        self.reader.saturation.interrupt();
        self.reader.columns.interrupt();
        self.reader.meter.forget_start();
    }

    /// Present description of the board.
    pub fn board(&self) -> Board {
        self.reader.board()
    }

    /// True once a handshake came.
    pub fn knows_board(&self) -> bool {
        self.reader.handshake.is_some()
    }

    /// Detected line format; none before two lines agree.
    pub fn detected(&self) -> Option<Detected> {
        let format = self.reader.shapes.format?;
        let why = match format {
            Format::Csv => format!("{}; {}", format.mark(), self.reader.columns.why()),
            Format::Plotter | Format::JsonLines => format.mark().to_owned(),
        };
        Some(Detected { format, why, time: self.reader.clock.source() })
    }

    /// Rate, jitter and losses.
    pub fn cadence(&self) -> Cadence {
        self.reader.meter.cadence(self.reader.clock.drift())
    }

    /// Number of readings, cheaper than [`Decoder::cadence`].
    pub fn readings(&self) -> u64 {
        self.reader.meter.readings()
    }

    /// Newest raw lines, oldest first.
    pub fn console(&self) -> impl Iterator<Item = &ConsoleLine> {
        self.reader.line_log.lines()
    }

    /// Channels that have been saturated for half a second or more.
    pub fn saturation(&self) -> Vec<Option<Saturation>> {
        self.reader.saturation.at()
    }

    /// Whether the counts fit the converter's range, stated or assumed.
    pub fn adc_range(&self) -> AdcRange {
        self.reader.saturation.adc_range()
    }
}

impl Reader {
    fn board(&self) -> Board {
        let mut board = self.said().cloned().unwrap_or_default();
        board.sensors = self.list;
        let is_same = |a: &str, b: &str| {
            a.eq_ignore_ascii_case(b) || self.list.called(a).is_some_and(|sensor| sensor.is_called(b))
        };
        let place = |name: &String| board.channels.iter().position(|known| is_same(known, name));
        let ohm = self.channels.iter().map(|name| board.divider_ohm.get(place(name)?).copied());
        board.divider_ohm = ohm.collect::<Option<Vec<f64>>>().unwrap_or_default();
        board.channels.clone_from(&self.channels);
        board
    }

    /// Handshake of the board.
    fn said(&self) -> Option<&Board> {
        self.handshake.as_ref().map(|handshake| &handshake.board)
    }

    fn bad(&mut self, line: &[u8], why: &'static str, arrived_s: f64) {
        self.line_log.add(line, arrived_s, LineKind::Bad(why));
        // Opening the port may restart the board, before its first reading; a counter shows restarts by itself.
        let text = String::from_utf8_lossy(line);
        let counts = self.clock.source() != TimeSource::Arrival;
        if self.last_s.is_some() && !counts && START_MESSAGES.iter().any(|part| text.contains(part)) {
            self.meter.restart();
        }
        self.give_up(arrived_s);
        self.unreadable += 1;
        self.meter.bad_line(arrived_s);
    }

    /// Counts the line that waited for another like it as unreadable.
    fn give_up(&mut self, arrived_s: f64) {
        if self.shapes.give_up() {
            self.unreadable += 1;
            self.meter.bad_line(arrived_s);
        }
    }

    fn line(&mut self, line: &[u8], arrived_s: f64, events: &mut Vec<BoardEvent>) {
        if line.starts_with(b"#") {
            return self.remark(line, arrived_s, events);
        }
        let (format, fields) = match self.check(line).and_then(|()| parse(line, self.list)) {
            Err(why) => return self.bad(line, why, arrived_s),
            Ok(Parsed::Header(names)) => return self.header(names, line, arrived_s, events),
            Ok(Parsed::Columns(values)) => {
                (Format::Csv, self.columns.name(values, self.handshake.as_ref().map(|handshake| &handshake.board)))
            }
            Ok(Parsed::Named(format, fields)) => (format, fields),
        };
        self.line_log.add(line, arrived_s, LineKind::Values);
        match self.shapes.judge(Candidate { format, fields, arrived_s }) {
            LineVerdict::Known(line) => {
                self.give_up(arrived_s);
                self.reading(&line, events);
            }
            LineVerdict::Changed(lines) => lines.iter().for_each(|line| self.reading(line, events)),
            LineVerdict::Waits { given_up } => {
                for _ in 0..given_up {
                    self.unreadable += 1;
                    self.meter.bad_line(arrived_s);
                }
            }
        }
    }

    /// Skips the first line, which is most often the rest of one, unless it is a header: a board that restarts on connection
    /// begins with it. It is complete unless its first name may be the end of a known one.
    fn first(&mut self, line: &[u8], arrived_s: f64, events: &mut Vec<BoardEvent>) {
        let Ok(Parsed::Header(names)) = parse(line, self.list) else { return };
        let is_known = |name: &String| !Role::is_channel(name) || self.list.called(name).is_some();
        let is_rest = |name: &String| {
            let known =
                self.list.iter().map(Sensor::channel).chain(["t_us", "t_ms", "millis", "micros", "seq", "p_bar"]);
            known.into_iter().any(|known| known.to_ascii_lowercase().ends_with(&name.to_ascii_lowercase()))
        };
        if names.first().is_some_and(|name| is_known(name) || !is_rest(name)) {
            self.header(names, line, arrived_s, events);
        }
    }

    /// Refuses a line of numbers whose checksum is wrong, or missing though the handshake announced one.
    fn check(&self, line: &[u8]) -> Result<(), &'static str> {
        let has_one = checksum::ends_in_one(line, ':')?;
        let wanted = self.handshake.as_ref().is_some_and(|handshake| handshake.checked);
        if wanted && !has_one { Err("checksum missing") } else { Ok(()) }
    }

    fn remark(&mut self, line: &[u8], arrived_s: f64, events: &mut Vec<BoardEvent>) {
        let text = std::str::from_utf8(line).map_err(|_not_text| "not text");
        let (text, handshake) = match text.and_then(|text| Ok((text, handshake::parse(text)?))) {
            Ok(said) => said,
            Err(why) => return self.bad(line, why, arrived_s),
        };
        self.line_log.add(line, arrived_s, LineKind::Remark);
        if handshake.is_some() && self.handshake != handshake {
            self.handshake = handshake;
            self.find_sensors();
            self.name_columns(events);
            events.push(BoardEvent::Board(self.board()));
        }
        events.push(BoardEvent::Reply(BoardReply::parse(text)));
    }

    fn header(&mut self, names: Vec<String>, line: &[u8], arrived_s: f64, events: &mut Vec<BoardEvent>) {
        if !self.columns.set_header(names) {
            return self.bad(line, "neither numbers nor names of sensors", arrived_s);
        }
        self.line_log.add(line, arrived_s, LineKind::Remark);
        self.name_columns(events);
    }

    /// Renames columns whose names have become known.
    fn name_columns(&mut self, events: &mut Vec<BoardEvent>) {
        if self.shapes.format != Some(Format::Csv) {
            return;
        }
        let said = self.handshake.as_ref().map(|handshake| &handshake.board);
        let names = self.columns.names(self.shapes.names().len(), said);
        let before = self.shapes.roles(&mut self.channels).to_vec();
        if !self.shapes.rename(&names) {
            return;
        }
        for (column, (role, name)) in before.iter().zip(names).enumerate() {
            if let Role::Channel(place) = role {
                // A column that turns out to be a counter leaves an empty channel behind.
                let name = if Role::is_channel(&name) { name } else { format!("column {}", column + 1) };
                self.channels[*place] = name;
            }
        }
        self.shapes.roles(&mut self.channels);
        self.find_sensors();
        events.push(BoardEvent::Board(self.board()));
    }

    fn find_sensors(&mut self) {
        self.sensors = self.channels.iter().map(|name| self.list.called(name)).collect();
        let said = self.said();
        let ohm = |sensor: Sensor| said.and_then(|board| board.divider_ohm.get(board.channel_of(sensor)?));
        let is_strip = |sensor: &Option<Sensor>| {
            sensor.is_some_and(|s| s.is_flex() && ohm(s).is_none_or(|ohm| *ohm <= LARGEST_BESIDE_A_STRIP))
        };
        self.strips = self.sensors.iter().map(is_strip).collect();
    }

    fn reading(&mut self, line: &Candidate, events: &mut Vec<BoardEvent>) {
        let known = self.channels.len();
        let roles = self.shapes.roles(&mut self.channels);
        let mut counts = vec![None; self.channels.len()];
        let mut sent = vec![false; self.channels.len()];
        let (mut counters, mut line_bar) = (Counters { unreadable: self.unreadable, ..Counters::default() }, None);
        let mut whole = true;
        for (role, Field { value, .. }) in roles.iter().zip(&line.fields) {
            let counter = value.filter(|value| (0.0..LARGEST_COUNTER).contains(value));
            match role {
                // Values beyond f32 are not counts.
                Role::Channel(place) => {
                    counts[*place] = value.map(|value| value as f32).filter(|c| c.is_finite());
                    sent[*place] = true;
                }
                Role::Micros => counters.time = counter.map(|count| (count, 1e-6)),
                Role::Millis if counters.time.is_none() => counters.time = counter.map(|count| (count, 1e-3)),
                Role::Sequence => counters.seq = counter,
                Role::LineBar => line_bar = *value,
                Role::Millis | Role::Checksum | Role::Ignored => {}
            }
            whole &= counter.is_some() || !matches!(role, Role::Micros | Role::Millis | Role::Sequence);
        }
        if self.channels.len() != known {
            self.find_sensors();
            events.push(BoardEvent::Board(self.board()));
        }
        let stamp = if whole { self.clock.stamp(&counters, line.arrived_s) } else { None };
        let Some(stamp) = stamp else {
            self.unreadable += 1;
            return self.meter.bad_line(line.arrived_s);
        };
        self.report_gap(&stamp, events);
        self.last_s = Some(stamp.t_s);
        self.meter.reading(&stamp, line.arrived_s);
        let full_scale = self.said().map_or(FULL_12_BIT, |board| board.full_scale);
        self.saturation.add_range(&self.largest(&counts), stamp.t_s, full_scale);
        let ten_bits = self.saturation.adc_range() == AdcRange::LooksTenBit;
        self.saturation.add(&counts, &sent, stamp.t_s, if ten_bits { FULL_10_BIT } else { full_scale });
        let Stamp { t_s, seq, .. } = stamp;
        events.push(BoardEvent::Reading(Reading { t_s, arrived_s: line.arrived_s, seq, counts, line_bar }));
    }

    /// Largest count of the strips, and of all sensors; other channels need not come from the converter.
    fn largest(&self, counts: &[Option<f32>]) -> [f32; 2] {
        let mut largest = [0.0f32; 2];
        for ((sensor, strip), count) in self.sensors.iter().zip(&self.strips).zip(counts) {
            let count = count.filter(|_| sensor.is_some()).unwrap_or(0.0);
            largest[1] = largest[1].max(count);
            if *strip {
                largest[0] = largest[0].max(count);
            }
        }
        largest
    }

    fn report_gap(&mut self, stamp: &Stamp, events: &mut Vec<BoardEvent>) {
        let unreadable = std::mem::take(&mut self.unreadable);
        let broken = self.broken.take();
        // After an interruption it was given power anew.
        if stamp.restarted && broken.is_none() {
            self.meter.restart();
        }
        let Some(from_s) = self.last_s.filter(|_| stamp.missing != Some(0)) else { return };
        let cause = match (broken, stamp.restarted, unreadable) {
            (Some(cause), true, _) => format!("{cause}; {}", Gap::RESTARTED),
            (Some(cause), false, _) => cause,
            (None, true, _) => Gap::RESTARTED.to_owned(),
            (None, false, 0) if stamp.missing.is_none() => "no data".to_owned(),
            (None, false, 0) => "lost in transit".to_owned(),
            (None, false, 1) => "1 unreadable line".to_owned(),
            (None, false, n) => format!("{n} unreadable lines"),
        };
        self.meter.gap(stamp.missing);
        events.push(BoardEvent::Gap(Gap { from_s, to_s: stamp.t_s, lost: stamp.missing, cause }));
    }
}
