//! Where grasps begin and end in a stream of readings, and their phases.
//!
//! Where the board reports the line pressure, that says it: a grasp closes when it rises from zero, holds when it stops
//! rising, releases when it falls, and is over when it is zero and the fingers are back. Else the flex strips say it: they
//! leave what they read at rest, stop, come back.
//!
//! Readings are first put together into [`Tick`]s of 20 ms, so that a stream of 1 kHz is judged like one of 50 Hz and memory
//! is bounded. What is rest is the middle of a quiet stretch that lags behind by some tenths of a second: slow drift is
//! followed, a closing is not.

use super::flags::middle_and_deviation;
use palpate_sim::gripper::Phase;
use palpate_tactile::board::{Board, Reading, Sensor};
use palpate_tactile::trial::PhaseMark;
use std::collections::VecDeque;

/// Readings from so long before a grasp begins belong to its trial (s): sensors are zeroed in that window.
pub const PRE_ROLL_S: f64 = 0.5;

/// Whoever keeps readings for the pre-roll keeps so much of them (s): a beginning is noticed up to half a second late.
pub const LOOK_BACK_S: f64 = PRE_ROLL_S + 1.0;

/// Length of a tick (s); slower streams have one to a reading.
const TICK_S: f64 = 0.02;
/// Rest is learned from what lies so far back, from and to (s).
const REST_WINDOW_S: [f64; 2] = [2.0, 0.3];
/// Ticks without which nothing is known of rest.
const LEAST_TICKS: usize = 7;
/// A strip has left rest when it is off by so many deviations ...
const DEVIATIONS: f64 = 6.0;
/// ... and by this share of the converter's range: two degrees of a nominal strip.
const LEAST_SHARE: f64 = 0.004;
/// So many ticks in a row: one or two may be a knock.
const IN_A_ROW: usize = 3;
/// Nothing has risen for so long: it is held (s). A hand at the control box takes a third of a second from step to step.
const HOLD_AFTER_S: f64 = 0.4;
/// What a strip does less than this share of its way within that time is no rise.
const STILL_SHARE: f64 = 0.06;
/// A strip that has come back by this share of its way is released.
const RELEASED_SHARE: f64 = 0.15;
/// One that is within this share of its way from rest is back.
const BACK_SHARE: f64 = 0.15;
/// Strips creep: fingers without pressure, or without any motion, are back after this time (s).
const LEFT_ALONE_S: f64 = 1.5;
/// Below this the line is without pressure (bar): a step of the control box is 0.05 bar.
const NO_BAR: f64 = 0.02;
/// Nobody holds for so long without any motion (s): what was taken for a grasp was none.
const LONGEST_STILL_S: f64 = 20.0;
/// After a gap of this length nothing is known any more (s).
const LONGEST_GAP_S: f64 = 5.0;

/// What happened in a stream.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SegmentEvent {
    /// A trial has begun; readings from this time on belong to it (s).
    Began {
        /// On the clock of the readings.
        from_s: f64,
    },
    /// A phase of its grasp has begun.
    Phase(PhaseMark),
    /// It has ended; readings up to this time belong to it (s).
    Ended {
        /// On the clock of the readings.
        at_s: f64,
    },
}

/// Some readings in one: means of counts, the newest pressure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Tick {
    /// Time of its first reading (s).
    t_s: f64,
    flex: [Option<f64>; 2],
    line_bar: Option<f64>,
}

/// A tick that is being put together.
#[derive(Clone, Copy, Debug)]
struct Gathering {
    t_s: f64,
    sums: [(f64, u32); 2],
    line_bar: Option<f64>,
}

/// What a strip reads at rest (counts).
#[derive(Clone, Copy, Debug)]
struct Rest {
    middle: f64,
    least: f64,
}

/// A grasp that is going on.
#[derive(Clone, Copy, Debug)]
struct Grasp {
    phase: Phase,
    by_pressure: bool,
    rest: [Option<Rest>; 2],
    /// Highest pressure so far (bar), or farthest way of a strip from rest (counts), and when it was last exceeded (s).
    most: f64,
    rose_s: f64,
    /// Since when the line is without pressure (s).
    vented_s: Option<f64>,
    /// Ticks in a row that said that the phase is over, and the first of them (s).
    doubt: (usize, f64),
}

/// Tells grasps in a stream. It goes on for ever in bounded memory.
#[derive(Clone, Debug)]
pub struct Segmenter {
    columns: [Option<usize>; 2],
    full_scale: f64,
    last_s: Option<f64>,
    gathering: Option<Gathering>,
    ring: VecDeque<Tick>,
    /// Ticks in a row in which a strip had left rest, and the first of them (s).
    leaving: (usize, f64),
    grasp: Option<Grasp>,
    /// Readings up to here belong to the trial before (s).
    taken_s: f64,
}

impl Segmenter {
    /// Begins to listen to a board.
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

    /// The board has other channels from now on.
    pub fn set_board(&mut self, board: &Board) {
        self.columns = [Sensor::FlexLeft, Sensor::FlexRight].map(|sensor| board.channel_of(sensor));
        self.full_scale = f64::from(board.full_scale);
    }

    /// True between a beginning and its end.
    pub fn in_grasp(&self) -> bool {
        self.grasp.is_some()
    }

    /// Ticks that are remembered.
    #[cfg(test)]
    pub(super) fn held(&self) -> usize {
        self.ring.len()
    }

    /// Takes the next reading; what has happened, in order.
    pub fn push(&mut self, reading: &Reading) -> Vec<SegmentEvent> {
        let mut events = Vec::new();
        let t_s = reading.t_s;
        // Time that does not rise is no time; where the clock was set back, all begins anew.
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

    /// Nothing is known any more; a grasp that was going on has ended with the last reading.
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
        // A tick is over when the next begins; a reading of a slow stream is one by itself.
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

    /// No grasp is going on: does one begin?
    fn wait(&mut self, tick: &Tick, events: &mut Vec<SegmentEvent>) {
        let rest = self.rest(tick.t_s);
        let speaks = self.ring.iter().any(|tick| tick.line_bar.is_some());
        if let Some(bar) = tick.line_bar.filter(|bar| *bar > NO_BAR) {
            // One that is under pressure already when it is first heard is no beginning.
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
        // What lies before is no rest: it is learned anew from here.
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
            // It closes again before it was open: that is another grasp.
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

    /// True where no strip has moved for as long as fingers take to come back.
    fn is_still(&self, now_s: f64, step: f64) -> bool {
        let since = now_s - LEFT_ALONE_S;
        let whole = self.ring.front().is_some_and(|oldest| oldest.t_s <= since);
        let range = |side: usize| {
            let counts = || self.ring.iter().filter(|tick| tick.t_s >= since).filter_map(|tick| tick.flex[side]);
            counts().fold(f64::NEG_INFINITY, f64::max) - counts().fold(f64::INFINITY, f64::min)
        };
        whole && (0..2).all(|side| range(side) < step)
    }

    /// What the strips read at rest, from a quiet stretch that lags behind.
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

impl Gathering {
    fn tick(&self) -> Tick {
        let mean = |(sum, n): (f64, u32)| (n > 0).then(|| sum / f64::from(n));
        Tick { t_s: self.t_s, flex: self.sums.map(mean), line_bar: self.line_bar }
    }
}

fn mark(from_s: f64, phase: Phase, line_bar: Option<f64>) -> SegmentEvent {
    SegmentEvent::Phase(PhaseMark { from_s, phase, line_bar })
}

/// How far the farther strip is from rest, beyond what counts as rest (counts): above zero where it has left.
fn farthest(tick: &Tick, rest: &[Option<Rest>; 2]) -> Option<f64> {
    each(tick, rest).map(|(off, rest)| off - rest.least).max_by(f64::total_cmp)
}

/// How far the farther strip is from rest (counts).
fn way(tick: &Tick, rest: &[Option<Rest>; 2]) -> Option<f64> {
    each(tick, rest).map(|(off, _)| off).max_by(f64::total_cmp)
}

/// What counts as rest, of the noisier strip (counts).
fn least(rest: &[Option<Rest>; 2]) -> f64 {
    rest.iter().flatten().map(|rest| rest.least).fold(0.0, f64::max)
}

fn each<'a>(tick: &'a Tick, rest: &'a [Option<Rest>; 2]) -> impl Iterator<Item = (f64, Rest)> + 'a {
    tick.flex.iter().zip(rest).filter_map(|(count, rest)| Some((((*count)? - (*rest)?.middle).abs(), (*rest)?)))
}
