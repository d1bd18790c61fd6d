//! Segmentation of a stream of readings into grasps and their phases.
//!
//! If the board reports the line pressure, the pressure decides: a grasp closes when it rises from zero, holds when it
//! stops rising, releases when it falls, and ends when it is zero and the fingers are back at rest. Otherwise the flex
//! strips decide: they leave their rest value, stop, and return.
//!
//! Readings are first averaged into [`Tick`]s of 20 ms, so that streams of 1 kHz and 50 Hz are treated alike and memory
//! is bounded. The rest value is the median of a window that ends 0.3 s before the present: it follows slow drift, but
//! not the closing of the fingers.

use super::flags::middle_and_deviation;
use palpate_sim::gripper::Phase;
use palpate_tactile::board::{Board, Reading, SensorKind};
use palpate_tactile::trial::PhaseMark;
use std::collections::VecDeque;

/// Time before the start of a grasp that belongs to its trial (s): the sensors are zeroed in this window.
pub const PRE_ROLL_S: f64 = 0.5;

/// Length of a tick (s); in slower streams, each reading is a tick.
const TICK_S: f64 = 0.02;
/// Window for the rest value, as start and end before the present (s).
const REST_WINDOW_S: [f64; 2] = [2.0, 0.3];
/// Fewest ticks from which a rest value is computed.
const LEAST_TICKS: usize = 7;
/// Offset from rest at which a strip has left rest, in standard deviations ...
const DEVIATIONS: f64 = 6.0;
/// ... and as a share of the converter's range: two degrees of a nominal strip. Both must be exceeded.
const LEAST_SHARE: f64 = 0.004;
/// Consecutive ticks required: one or two may be a knock.
const IN_A_ROW: usize = 3;
/// Time without a rise after which the hold begins (s). A person at the control box needs a third of a second per step.
const HOLD_AFTER_S: f64 = 0.4;
/// Smallest rise of a strip in that time, as a share of its travel.
const STILL_SHARE: f64 = 0.06;
/// Return of a strip that starts the release, as a share of its travel.
const RELEASED_SHARE: f64 = 0.15;
/// Distance from rest at which a strip counts as back, as a share of its travel.
const BACK_SHARE: f64 = 0.15;
/// Time without pressure or motion after which fingers count as back (s), because strips creep and may not return
/// fully.
const LEFT_ALONE_S: f64 = 1.5;
/// Line pressure that counts as zero (bar): a step of the control box is 0.05 bar.
const NO_BAR: f64 = 0.02;
/// Longest hold without motion (s): after it, the detected grasp was a false one and ends.
const LONGEST_STILL_S: f64 = 20.0;
/// Longest gap in the stream that does not reset the segmentation (s).
const LONGEST_GAP_S: f64 = 5.0;

/// Event in a stream of readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SegmentEvent {
    /// Start of a trial; readings from this time on belong to it.
    Began {
        /// Time on the clock of the readings (s).
        from_s: f64,
    },
    /// Start of a phase of its grasp.
    Phase(PhaseMark),
    /// End of the trial; readings up to this time belong to it.
    Ended {
        /// Time on the clock of the readings (s).
        at_s: f64,
    },
}

/// Average of several readings: mean counts, newest pressure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Tick {
    /// Time of its first reading (s).
    t_s: f64,
    flex: [Option<f64>; 2],
    line_bar: Option<f64>,
}

/// Tick under construction.
#[derive(Clone, Copy, Debug)]
struct Gathering {
    t_s: f64,
    sums: [(f64, u32); 2],
    line_bar: Option<f64>,
}

/// Rest value of a strip, and the smallest offset that has left it (counts).
#[derive(Clone, Copy, Debug)]
struct Rest {
    middle: f64,
    least: f64,
}

/// Grasp in progress.
#[derive(Clone, Copy, Debug)]
struct Grasp {
    phase: Phase,
    by_pressure: bool,
    rest: [Option<Rest>; 2],
    /// Highest pressure (bar) or farthest travel of a strip from rest (counts) so far, and time of its last rise (s).
    most: f64,
    rose_s: f64,
    /// Time at which the line pressure became zero (s).
    vented_s: Option<f64>,
    /// Consecutive ticks that indicate the end of the phase, and time of the first (s).
    doubt: (usize, f64),
}

/// Finds grasps in an endless stream of readings, in bounded memory.
#[derive(Clone, Debug)]
pub struct Segmenter {
    columns: [Option<usize>; 2],
    full_scale: f64,
    last_s: Option<f64>,
    gathering: Option<Gathering>,
    ring: VecDeque<Tick>,
    /// Consecutive ticks in which a strip was off its rest value, and time of the first (s).
    leaving: (usize, f64),
    grasp: Option<Grasp>,
    /// End of the previous trial (s): readings up to here belong to it.
    taken_s: f64,
}

impl Segmenter {
    /// Starts segmenting the readings of a board.
    pub fn new(board: &Board) -> Self {
        let mut segmenter = Self {
            columns: [None; 2],
            full_scale: 0.0,
            last_s: None,
            gathering: None,
            ring: VecDeque::new(),
            leaving: (0, 0.0),
            grasp: None,
            taken_s: f64::NEG_INFINITY,
        };
        segmenter.set_board(board);
        segmenter
    }

    /// Changes the channels and the full scale to those of `board`.
    pub fn set_board(&mut self, board: &Board) {
        // Strips move first; of a gripper without any, what else there is shows a grasp.
        let kinds = [SensorKind::Flex, SensorKind::Pad, SensorKind::Raw];
        let kind = kinds.into_iter().find(|kind| board.sensors.of_kind(*kind).next().is_some());
        let sensors = kind.into_iter().flat_map(|kind| board.sensors.of_kind(kind));
        let columns: Vec<usize> = sensors.filter_map(|sensor| board.channel_of(sensor)).take(2).collect();
        self.columns = [columns.first().copied(), columns.get(1).copied()];
        self.full_scale = f64::from(board.full_scale);
    }

    /// True during a grasp.
    #[cfg(test)]
    pub(super) fn in_grasp(&self) -> bool {
        self.grasp.is_some()
    }

    /// Number of ticks in memory.
    #[cfg(test)]
    pub(super) fn held(&self) -> usize {
        self.ring.len()
    }

    /// Takes the next reading and returns new events in order.
    pub fn push(&mut self, reading: &Reading) -> Vec<SegmentEvent> {
        let mut events = Vec::new();
        let t_s = reading.t_s;
        // Readings whose time is not finite or does not rise are skipped; a clock set back far resets everything.
        let Some(last_s) = self.last_s.filter(|_| t_s.is_finite()) else {
            self.last_s = self.last_s.or(t_s.is_finite().then_some(t_s));
            self.gather(reading, &mut events);
            return events;
        };
        if t_s < last_s - LONGEST_GAP_S || t_s > last_s + LONGEST_GAP_S {
            self.forget(last_s, &mut events);
            self.taken_s = self.taken_s.min(t_s);
        } else if t_s <= last_s {
            return events;
        }
        self.last_s = Some(t_s);
        self.gather(reading, &mut events);
        events
    }

    /// Resets the segmentation; a grasp in progress ends at the last reading.
    fn forget(&mut self, last_s: f64, events: &mut Vec<SegmentEvent>) {
        if self.grasp.is_some() {
            self.end(last_s, events);
        }
        self.ring.clear();
        self.gathering = None;
        self.leaving = (0, 0.0);
    }

    fn gather(&mut self, reading: &Reading, events: &mut Vec<SegmentEvent>) {
        if !reading.t_s.is_finite() {
            return;
        }
        // A tick is complete when the next one begins; in a slow stream, each reading is a tick.
        if let Some(done) = self.gathering.filter(|gathering| reading.t_s >= gathering.t_s + TICK_S - 1e-4) {
            self.gathering = None;
            self.tick(done.tick(), events);
        }
        let begun = Gathering { t_s: reading.t_s, sums: [(0.0, 0); 2], line_bar: None };
        let gathering = self.gathering.get_or_insert(begun);
        for (sum, column) in gathering.sums.iter_mut().zip(self.columns) {
            let count = column.and_then(|column| reading.counts.get(column).copied().flatten());
            if let Some(count) = count.filter(|count| count.is_finite()) {
                *sum = (sum.0 + f64::from(count), sum.1 + 1);
            }
        }
        gathering.line_bar = reading.line_bar.filter(|bar| bar.is_finite()).or(gathering.line_bar);
    }

    fn tick(&mut self, tick: Tick, events: &mut Vec<SegmentEvent>) {
        while self.ring.front().is_some_and(|oldest| oldest.t_s < tick.t_s - REST_WINDOW_S[0]) {
            self.ring.pop_front();
        }
        self.ring.push_back(tick);
        match self.grasp {
            None => self.wait(&tick, events),
            Some(grasp) if grasp.by_pressure => self.follow_pressure(grasp, &tick, events),
            Some(grasp) => self.follow_strips(grasp, &tick, events),
        }
    }

    /// Checks whether a grasp begins.
    fn wait(&mut self, tick: &Tick, events: &mut Vec<SegmentEvent>) {
        let rest = self.rest(tick.t_s);
        let speaks = self.ring.iter().any(|tick| tick.line_bar.is_some());
        if let Some(bar) = tick.line_bar.filter(|bar| *bar > NO_BAR) {
            // Pressure in the first reading of a stream does not start a grasp: its start was missed.
            let before = self.ring.iter().rev().skip(1).find_map(|tick| tick.line_bar);
            if before.is_some_and(|before| before <= NO_BAR) {
                self.begin(tick.t_s, Some(bar), rest, events);
            }
        } else if !speaks {
            self.leaving = match farthest(tick, &rest) {
                Some(way) if way > 0.0 && self.leaving.0 == 0 => (1, tick.t_s),
                Some(way) if way > 0.0 => (self.leaving.0 + 1, self.leaving.1),
                _ => (0, 0.0),
            };
            if self.leaving.0 >= IN_A_ROW {
                self.begin(self.leaving.1, None, rest, events);
            }
        }
    }

    fn begin(&mut self, t_s: f64, bar: Option<f64>, rest: [Option<Rest>; 2], events: &mut Vec<SegmentEvent>) {
        let (by_pressure, most) = (bar.is_some(), bar.unwrap_or(0.0));
        let doubt = (0, 0.0);
        self.leaving = (0, 0.0);
        self.grasp = Some(Grasp { phase: Phase::Close, by_pressure, rest, most, rose_s: t_s, vented_s: None, doubt });
        events.push(SegmentEvent::Began { from_s: (t_s - PRE_ROLL_S).max(self.taken_s) });
        events.push(mark(t_s, Phase::Close, bar));
    }

    fn end(&mut self, at_s: f64, events: &mut Vec<SegmentEvent>) {
        self.grasp = None;
        self.taken_s = at_s;
        // The grasp must not enter the rest value, which is computed from later ticks only.
        self.ring.clear();
        events.push(SegmentEvent::Ended { at_s });
    }

    fn follow_pressure(&mut self, mut grasp: Grasp, tick: &Tick, events: &mut Vec<SegmentEvent>) {
        let Some(bar) = tick.line_bar else {
            self.grasp = Some(grasp);
            return;
        };
        let rises = bar > grasp.most + NO_BAR;
        let enter = |grasp: &mut Grasp, phase: Phase, from_s: f64, events: &mut Vec<SegmentEvent>| {
            grasp.phase = phase;
            events.push(mark(from_s, phase, Some(bar)));
        };
        match grasp.phase {
            Phase::Close | Phase::Hold if bar < grasp.most - NO_BAR => {
                enter(&mut grasp, Phase::Release, tick.t_s, events);
                grasp.most = bar;
            }
            Phase::Hold if rises => enter(&mut grasp, Phase::Close, tick.t_s, events),
            Phase::Close if tick.t_s - grasp.rose_s > HOLD_AFTER_S => {
                let rose_s = grasp.rose_s;
                enter(&mut grasp, Phase::Hold, rose_s, events);
            }
            // Closing again before the fingers were open starts another grasp.
            Phase::Release if rises => {
                self.end(tick.t_s, events);
                self.begin(tick.t_s, Some(bar), grasp.rest, events);
                return;
            }
            Phase::Close | Phase::Hold | Phase::Release => {}
        }
        if rises {
            grasp.rose_s = tick.t_s;
        }
        grasp.most = if grasp.phase == Phase::Release { grasp.most.min(bar) } else { grasp.most.max(bar) };
        grasp.vented_s = if bar <= NO_BAR { grasp.vented_s.or(Some(tick.t_s)) } else { None };
        self.grasp = Some(grasp);
        if let Some(vented_s) = grasp.vented_s {
            let alone = tick.t_s - vented_s >= LEFT_ALONE_S;
            if alone || farthest(tick, &grasp.rest).is_some_and(|way| way <= 0.0) {
                self.end(tick.t_s, events);
            }
        }
    }

    fn follow_strips(&mut self, mut grasp: Grasp, tick: &Tick, events: &mut Vec<SegmentEvent>) {
        let Some(way) = way(tick, &grasp.rest) else {
            self.grasp = Some(grasp);
            return;
        };
        let step = (STILL_SHARE * grasp.most).max(least(&grasp.rest));
        if way > grasp.most + step && grasp.phase != Phase::Release {
            (grasp.most, grasp.rose_s) = (way, tick.t_s);
        }
        let still_s = tick.t_s - grasp.rose_s;
        let leaves = match grasp.phase {
            Phase::Close | Phase::Hold => way < (1.0 - RELEASED_SHARE) * grasp.most - least(&grasp.rest),
            Phase::Release => way < (BACK_SHARE * grasp.most).max(least(&grasp.rest)),
        };
        grasp.doubt = match grasp.doubt {
            (0, _) if leaves => (1, tick.t_s),
            (n, since) if leaves => (n + 1, since),
            _ => (0, 0.0),
        };
        let sure = grasp.doubt.0 >= IN_A_ROW;
        match grasp.phase {
            Phase::Close | Phase::Hold if sure => {
                events.push(mark(grasp.doubt.1, Phase::Release, None));
                (grasp.phase, grasp.doubt, grasp.rose_s) = (Phase::Release, (0, 0.0), tick.t_s);
            }
            Phase::Close if still_s > HOLD_AFTER_S => {
                grasp.phase = Phase::Hold;
                events.push(mark(grasp.rose_s, Phase::Hold, None));
            }
            Phase::Close | Phase::Hold | Phase::Release => {}
        }
        self.grasp = Some(grasp);
        let over = match grasp.phase {
            Phase::Release => sure && grasp.doubt.0 >= IN_A_ROW || self.is_still(tick.t_s, step),
            Phase::Close | Phase::Hold => still_s > LONGEST_STILL_S,
        };
        if over {
            self.end(tick.t_s, events);
        }
    }

    /// True if no strip has moved for [`LEFT_ALONE_S`].
    fn is_still(&self, now_s: f64, step: f64) -> bool {
        let since = now_s - LEFT_ALONE_S;
        let whole = self.ring.front().is_some_and(|oldest| oldest.t_s <= since);
        let range = |side: usize| {
            let counts = || self.ring.iter().filter(|tick| tick.t_s >= since).filter_map(|tick| tick.flex[side]);
            counts().fold(f64::NEG_INFINITY, f64::max) - counts().fold(f64::INFINITY, f64::min)
        };
        whole && (0..2).all(|side| range(side) < step)
    }

    /// Rest values of the strips, from the window [`REST_WINDOW_S`].
    fn rest(&self, now_s: f64) -> [Option<Rest>; 2] {
        let [from, to] = REST_WINDOW_S.map(|back| now_s - back);
        [0, 1].map(|side| {
            let window = self.ring.iter().filter(|tick| tick.t_s >= from && tick.t_s <= to);
            let counts: Vec<f64> = window.filter_map(|tick| tick.flex[side]).collect();
            if counts.len() < LEAST_TICKS {
                return None;
            }
            let (middle, deviation) = middle_and_deviation(counts)?;
            Some(Rest { middle, least: (DEVIATIONS * deviation).max(LEAST_SHARE * self.full_scale) })
        })
    }
}

/// Phases of the first grasp in readings that holds its beginning, as measured: closing, the last hold before the release,
/// and release. Empty where no grasp begins.
pub fn measured_phases(board: &Board, readings: &[Reading]) -> Vec<PhaseMark> {
    let mut segmenter = Segmenter::new(board);
    let mut marks: Vec<PhaseMark> = Vec::new();
    for event in readings.iter().flat_map(|reading| segmenter.push(reading)) {
        match event {
            SegmentEvent::Began { .. } => {}
            SegmentEvent::Ended { .. } => break,
            // Fingers may pause while they close.
            SegmentEvent::Phase(mark) if mark.phase == Phase::Close && !marks.is_empty() => {}
            SegmentEvent::Phase(mark) => {
                marks.retain(|earlier| earlier.phase != mark.phase);
                marks.push(PhaseMark { line_bar: None, ..mark });
            }
        }
    }
    marks
}

/// True where line pressure or a flex strip is read, so that a grasp would be seen in the readings.
pub fn shows_grasps(board: &Board, readings: &[Reading]) -> bool {
    let has_strip = board.sensors.of_kind(SensorKind::Flex).into_iter().any(|strip| board.channel_of(strip).is_some());
    !readings.is_empty() && (has_strip || readings.iter().any(|reading| reading.line_bar.is_some()))
}

impl Gathering {
    fn tick(&self) -> Tick {
        let mean = |(sum, n): (f64, u32)| (n > 0).then(|| sum / f64::from(n));
        Tick { t_s: self.t_s, flex: self.sums.map(mean), line_bar: self.line_bar }
    }
}

fn mark(from_s: f64, phase: Phase, line_bar: Option<f64>) -> SegmentEvent {
    SegmentEvent::Phase(PhaseMark { from_s, phase, line_bar })
}

/// Offset of the farther strip beyond its rest threshold (counts): positive when it has left rest.
fn farthest(tick: &Tick, rest: &[Option<Rest>; 2]) -> Option<f64> {
    each(tick, rest).map(|(off, rest)| off - rest.least).max_by(f64::total_cmp)
}

/// Offset of the farther strip from rest (counts).
fn way(tick: &Tick, rest: &[Option<Rest>; 2]) -> Option<f64> {
    each(tick, rest).map(|(off, _)| off).max_by(f64::total_cmp)
}

/// Rest threshold of the noisier strip (counts).
fn least(rest: &[Option<Rest>; 2]) -> f64 {
    rest.iter().flatten().map(|rest| rest.least).fold(0.0, f64::max)
}

fn each<'a>(tick: &'a Tick, rest: &'a [Option<Rest>; 2]) -> impl Iterator<Item = (f64, Rest)> + 'a {
    tick.flex.iter().zip(rest).filter_map(|(count, rest)| Some((((*count)? - (*rest)?.middle).abs(), (*rest)?)))
}
