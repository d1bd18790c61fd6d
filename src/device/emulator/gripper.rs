//! The emulated gripper: fingers, sensors, board and connection, with its faults. It has no port and no clock of its own: time
//! and the host's bytes go in, the board's bytes come out. The same seed, times and input give the same bytes.

use super::event::{EmulatorError, EmulatorEvent, EmulatorEventKind};
use super::faults::{EmulatedFault, FaultKind};
use super::firmware::{BoardSetup, FirmwareBoard};
use super::hand::{Hand, HandPlan};
use super::parts::{HiddenParts, SPARE_OHM, Sensors};
use super::script::Step;
use super::uart::misread;
use crate::protocol::checksum;
use palpate_sim::objects::ObjectError;
use palpate_sim::scene::Scene;
use palpate_tactile::electronics::Converter;
use palpate_tactile::model::Stream;

/// Times that differ by less are equal (s): rounding of summed periods, and less than a tick of the clock.
const SAME_TIME_S: f64 = 5e-7;

/// Setup of the emulated gripper.
#[derive(Clone, Debug)]
pub struct EmulatorSetup {
    /// Programme of its fingers.
    pub hand: HandPlan,
    /// Hidden values of its sensors.
    pub parts: HiddenParts,
    /// Samples per second.
    pub rate_hz: u32,
    /// Number of channels: the sensors of the hand, then spare inputs with slow sine waves.
    pub channels: usize,
    /// Highest pressure of its board, in steps of 0.05 bar; 0: no pressure output.
    pub most_steps: u8,
    /// Start of the board's clock (µs).
    pub clock_start_us: u32,
    pub faults: Vec<EmulatedFault>,
    /// Random seed of noise and faults.
    pub seed: u64,
}

/// Emulated gripper.
#[derive(Debug)]
pub struct EmulatedGripper {
    hand: Hand,
    parts: HiddenParts,
    sensors: Sensors,
    board_setup: BoardSetup,
    board: FirmwareBoard,
    /// Handshake after a restart.
    restarted: String,
    clock_start_us: u32,
    faults: Vec<EmulatedFault>,
    /// Faults that have been reported.
    struck: Vec<bool>,
    converter: Conversions,
    now_s: f64,
    /// Time to which it was advanced (s); earlier than `now_s` while the board starts again.
    reached_s: f64,
    /// A moment on both clocks: our time (s) and the board's, unwrapped (µs).
    anchor: (f64, u64),
    line_chance: Stream,
    garbage: Stream,
    /// Held back by a burst.
    held_back: Vec<u8>,
    released_s: f64,
    bytes: Vec<u8>,
    happened: Vec<EmulatorEvent>,
    /// Output of the board, before faults.
    printed: String,
}

impl EmulatedGripper {
    /// Starts an emulated gripper; takes some tenths of a second for each object.
    pub fn new(setup: EmulatorSetup) -> Result<Self, ObjectError> {
        let spare = (1..).map(|k| format!("aux{k}"));
        let list = setup.hand.sensors;
        let channels = list.iter().map(|sensor| sensor.channel().to_owned()).chain(spare).take(setup.channels);
        let ohm = list.iter().map(|sensor| setup.parts.divider_ohm(sensor)).chain(std::iter::repeat(SPARE_OHM));
        let ohm = ohm.map(|ohm| ohm.round() as u32);
        let board_setup = BoardSetup {
            period_us: 1_000_000 / setup.rate_hz.max(1),
            channels: channels.collect(),
            divider_ohm: ohm.take(setup.channels).collect(),
            bits: 12,
            most_steps: setup.most_steps,
        };
        let mut hello = String::new();
        let board = FirmwareBoard::begin(&board_setup, setup.clock_start_us, &mut hello);
        Ok(Self {
            hand: Hand::new(setup.hand)?,
            sensors: setup.parts.sensors(list, f64::from(setup.rate_hz)),
            converter: Conversions::new(&setup.parts, setup.seed, setup.channels),
            parts: setup.parts,
            board_setup,
            board,
            restarted: hello,
            clock_start_us: setup.clock_start_us,
            struck: vec![false; setup.faults.len()],
            faults: setup.faults,
            now_s: 0.0,
            reached_s: 0.0,
            anchor: (0.0, u64::from(setup.clock_start_us)),
            line_chance: Stream::new(setup.seed, "line", "chance"),
            garbage: Stream::new(setup.seed, "line", "garbage"),
            held_back: Vec::new(),
            released_s: 0.0,
            bytes: Vec::new(),
            happened: Vec::new(),
            printed: String::new(),
        })
    }

    /// Hidden values of its sensors.
    pub fn parts(&self) -> &HiddenParts {
        &self.parts
    }

    /// Adds a step to its script.
    pub fn add_step(&mut self, step: Step) -> Result<(), ObjectError> {
        self.hand.add(step)
    }

    /// Puts an object into the hand that a host drives, for the next grasps: first as in `scene`, where one is given, then and
    /// without one in random poses.
    pub fn place(&mut self, object: &str, scene: Option<Scene>) -> Result<(), EmulatorError> {
        self.hand.place(object, scene)
    }

    /// Scene of the last grasp, its object included.
    pub fn scene(&self) -> Option<&Scene> {
        self.hand.scene()
    }

    /// Time to which it was advanced (s).
    pub fn now_s(&self) -> f64 {
        self.now_s
    }

    /// Adds a fault.
    pub fn add_fault(&mut self, fault: EmulatedFault) {
        self.faults.push(fault);
        self.struck.push(false);
    }

    /// Takes the bytes since the last call.
    pub fn take_bytes(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.bytes)
    }

    /// Takes the events since the last call.
    pub fn take_happened(&mut self) -> Vec<EmulatorEvent> {
        std::mem::take(&mut self.happened)
    }

    /// Takes the output of the board since the last call, before faults.
    pub fn take_printed(&mut self) -> String {
        std::mem::take(&mut self.printed)
    }

    /// The active fault of a kind.
    pub fn fault(&self, kind: FaultKind) -> Option<EmulatedFault> {
        self.faults.iter().copied().find(|fault| fault.kind == kind && fault.is_on(self.now_s))
    }

    /// Advances to the time `t` (s since the first host).
    pub fn advance(&mut self, t: f64) {
        loop {
            let due_s = self.due_s();
            if due_s > t + SAME_TIME_S {
                break;
            }
            self.now_s = due_s.max(self.now_s);
            self.tell_faults();
            if self.fault(FaultKind::Reset).is_some() {
                self.restart();
                continue;
            }
            self.sample();
        }
        self.now_s = t.max(self.now_s);
        self.reached_s = t;
        self.release();
    }

    /// Takes bytes from the host, now. A board that starts again does not get them.
    pub fn hear(&mut self, bytes: &[u8]) {
        if self.fault(FaultKind::Deaf).is_some() || self.reached_s + SAME_TIME_S < self.anchor.0 {
            return;
        }
        let mut said = String::new();
        let clock_us = self.clock_us(self.now_s) as u32;
        for &byte in bytes {
            let was_bar = self.board.line_bar();
            if self.board.hear(byte, clock_us, &mut said) {
                self.hand.take_over(self.now_s, was_bar);
            }
        }
        self.send(&said);
    }

    /// Our time of the board's next sample (s).
    fn due_s(&self) -> f64 {
        let (anchor_s, anchor_us) = self.anchor;
        let ahead = self.board.next_us().wrapping_sub(anchor_us as u32);
        anchor_s + f64::from(ahead) * 1e-6 / self.clock_rate()
    }

    /// The board's clock at a time, unwrapped (µs).
    fn clock_us(&self, t: f64) -> u64 {
        let (anchor_s, anchor_us) = self.anchor;
        anchor_us + ((t - anchor_s) * self.clock_rate() * 1e6).max(0.0) as u64
    }

    /// Seconds of the board's clock per second.
    fn clock_rate(&self) -> f64 {
        1.0 + 1e-6 * self.fault(FaultKind::Clock).map_or(0.0, |fault| fault.value)
    }

    fn sample(&mut self) {
        let hello = std::mem::take(&mut self.restarted);
        self.send(&hello);
        let due = self.board.next_us();
        let (_, anchor_us) = self.anchor;
        let clock_us = anchor_us + u64::from(due.wrapping_sub(anchor_us as u32));
        self.anchor = (self.now_s, clock_us);
        let stimuli = self.hand.at(self.now_s, self.board.line_bar());
        self.hand.take_began().into_iter().for_each(|began| self.tell(began));
        if let Some(bar) = self.hand.own_bar() {
            self.board.set_by_hand((bar * 20.0).round() as u8, due);
        }
        let shares = self.shares(&stimuli);
        self.converter.strike(&self.faults, self.now_s);
        let converter = &mut self.converter;
        let mut said = String::new();
        self.board.poll(due, &mut |channel| converter.convert(channel, &shares), &mut said);
        if said.starts_with("# vent") {
            self.tell(EmulatorEventKind::Watchdog);
        }
        self.send(&said);
    }

    /// Shares of the supply on all inputs.
    fn shares(&mut self, stimuli: &[f64]) -> Vec<f64> {
        let spare = |k: usize| 0.5 + 0.4 * (self.now_s * (k as f64 + 1.0) * 0.2).sin();
        let mut shares: Vec<f64> =
            self.sensors.shares(stimuli).into_iter().chain((0..self.board_setup.channels.len()).map(spare)).collect();
        for fault in self.faults.iter().filter(|fault| fault.is_on(self.now_s)) {
            let channel = fault.value as usize;
            match (fault.kind, shares.get_mut(channel)) {
                (FaultKind::Open, Some(share)) => *share = self.sensors.share_when_open(channel),
                (FaultKind::Gain, Some(share)) => *share = (*share * fault.factor).min(1.0),
                _ => {}
            }
        }
        shares
    }

    /// The board starts again, and is silent until the fault is over.
    fn restart(&mut self) {
        let until = self.fault(FaultKind::Reset).map_or(self.now_s, |fault| fault.until_s);
        self.restarted.clear();
        self.board = FirmwareBoard::begin(&self.board_setup, self.clock_start_us, &mut self.restarted);
        self.now_s = until;
        self.anchor = (until, u64::from(self.clock_start_us));
    }

    /// Adds an event, now.
    pub fn tell(&mut self, what: EmulatorEventKind) {
        self.happened.push(EmulatorEvent { t_s: self.now_s, what });
    }

    fn tell_faults(&mut self) {
        for k in 0..self.faults.len() {
            if !self.struck[k] && self.faults[k].from_s <= self.now_s {
                self.struck[k] = true;
                self.tell(EmulatorEventKind::Fault { fault: self.faults[k].to_string() });
            }
        }
    }

    /// Sends output of the board through the faulty connection.
    fn send(&mut self, said: &str) {
        self.printed.push_str(said);
        for line in said.split_inclusive('\n') {
            let sent = self.on_the_line(line);
            self.held_back.extend(sent);
        }
    }

    /// Applies the faults to a line.
    fn on_the_line(&mut self, line: &str) -> Vec<u8> {
        let line = self.misstated(line);
        let chance = self.line_chance.within(0.0, 1.0);
        let where_cut = self.line_chance.within(0.0, line.len() as f64) as usize;
        if line.is_empty()
            || self.fault(FaultKind::Silent).is_some()
            || self.fault(FaultKind::Loss).is_some_and(|f| chance < f.value)
        {
            return Vec::new();
        }
        let mut sent = line.as_bytes().to_vec();
        if self.fault(FaultKind::Partial).is_some_and(|fault| chance < fault.value) {
            sent.truncate(where_cut);
        }
        if self.fault(FaultKind::Byte).is_some_and(|fault| chance < fault.value) {
            sent.remove(where_cut);
        }
        if self.fault(FaultKind::Garbage).is_some() {
            sent = line.bytes().map(|_| self.garbage.within(0.0, 256.0) as u8).collect();
        }
        match self.fault(FaultKind::Baud) {
            Some(fault) => misread(&sent, fault.value, 1.0),
            None => sent,
        }
    }

    /// A line as the board says it, where it is wrong itself.
    fn misstated(&self, line: &str) -> String {
        let bar = |kind| self.fault(kind).map(|fault| format!("{:.2}", fault.value));
        let answers = line.starts_with("# ok") || line.starts_with("# refused");
        if answers && self.fault(FaultKind::NoAnswer).is_some() {
            return String::new();
        }
        if let Some(bar) = bar(FaultKind::WrongAnswer).filter(|_| answers) {
            return format!("# ok p={bar}\n");
        }
        let mut line = line.to_owned();
        if let Some(bar) = bar(FaultKind::WrongPressure) {
            line = with_field(&line, "p_bar", &bar);
        }
        let silenced = self.fault(FaultKind::Nan).and_then(|fault| self.board_setup.channels.get(fault.value as usize));
        match silenced {
            Some(name) => with_field(&line, name, "nan"),
            None => line,
        }
    }

    /// Releases what a burst holds back, at its time.
    fn release(&mut self) {
        if let Some(burst) = self.fault(FaultKind::Burst) {
            if self.now_s - self.released_s < burst.value {
                return;
            }
            self.released_s = self.now_s;
        }
        self.bytes.append(&mut self.held_back);
    }
}

/// A line with another text in a field, and its checksum.
fn with_field(line: &str, name: &str, text: &str) -> String {
    let Some((body, _)) = line.rsplit_once(",ck:") else { return line.to_owned() };
    let field = |field: &str| match field.split_once(':') {
        Some((key, _)) if key == name => format!("{key}:{text}"),
        _ => field.to_owned(),
    };
    let body = body.split(',').map(field).collect::<Vec<_>>().join(",");
    format!("{body},ck:{}\n", checksum(body.as_bytes()))
}

/// The board's converter, with its faults.
#[derive(Debug)]
struct Conversions {
    noise_counts: f64,
    noise: Stream,
    ten_bits: bool,
    crosstalk: f64,
    saturated: Vec<bool>,
    stuck: Vec<bool>,
    kept: Vec<u32>,
}

impl Conversions {
    fn new(parts: &HiddenParts, seed: u64, channels: usize) -> Self {
        Self {
            noise_counts: parts.noise_counts,
            noise: Stream::new(seed, "converter", "noise"),
            ten_bits: false,
            crosstalk: 0.0,
            saturated: vec![false; channels],
            stuck: vec![false; channels],
            kept: vec![0; channels],
        }
    }

    /// Sets the faults of a time (s).
    fn strike(&mut self, faults: &[EmulatedFault], t: f64) {
        let on = |kind: FaultKind| faults.iter().filter(move |fault| fault.kind == kind && fault.is_on(t));
        self.ten_bits = on(FaultKind::TenBit).next().is_some();
        self.crosstalk = on(FaultKind::Crosstalk).map(|fault| fault.value).next().unwrap_or(0.0);
        for channel in 0..self.kept.len() {
            self.saturated[channel] = on(FaultKind::Saturated).any(|fault| fault.value as usize == channel);
            self.stuck[channel] = on(FaultKind::Stuck).any(|fault| fault.value as usize == channel);
        }
    }

    /// One conversion of a channel, of shares of the supply: counts.
    fn convert(&mut self, channel: usize, shares: &[f64]) -> u32 {
        let noise = self.noise.normal();
        if self.stuck[channel] {
            return self.kept[channel];
        }
        let before = shares[(channel + self.kept.len() - 1) % self.kept.len()];
        let share = shares[channel] + self.crosstalk * (before - shares[channel]);
        let share = if self.saturated[channel] { 1.0 } else { share };
        let levels = if self.ten_bits { 1024.0 } else { Converter::DUE.levels };
        let noise = noise * self.noise_counts * levels / Converter::DUE.levels;
        // Saturated: no noise exceeds full scale.
        let noise = if self.saturated[channel] { 0.0 } else { noise };
        self.kept[channel] = Converter { levels, ..Converter::DUE }.counts(share, noise) as u32;
        self.kept[channel]
    }
}
