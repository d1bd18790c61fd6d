//! Guided crosstalk test: each sensor is moved in turn, alone, while the untouched sensors of the other finger are watched.
//! The sensors of the same finger cannot be watched: bending a finger presses on its pad.
//!
//! ```text
//!   leave both fingers alone   -> where every sensor rests
//!   press the left pad         -> share of its change that the right strip and the right pad show
//!   ...                           for every sensor of the board
//! ```
//!
//! With crosstalk of a converter's multiplexer, the reading of one sensor follows the other at once and in proportion.
//! A sensor whose reading changes at other times was touched.

use super::DoctorError;
use palpate_tactile::board::{Board, KNOWN_AFTER, Reading, Sensor, SensorKind, SensorList};
use serde::Serialize;
use std::collections::VecDeque;

/// Least share that is reported: a pad of 1 N at 1 % is 18 counts of 4095, and a degree of bend 10.
const LEAST_SHARE: f64 = 0.01;
/// Counts of 4095 that such a share must come to: four deviations of the usual noise.
const LEAST_COUNTS: f64 = 8.0;
/// Correlation from which on two sensors move in step.
const IN_STEP: f64 = 0.8;
/// Least change of the moved sensor (counts of 4095): a press of 0.1 N, a bend of ten degrees.
const MOVES: f64 = 150.0;
/// A sensor is back when it is this near to its rest (counts of 4095), or within this share of its change: strips
/// creep.
const BACK: f64 = 50.0;
const BACK_SHARE: f64 = 0.25;
/// A sensor must be back for this long (s).
const BACK_S: f64 = 0.4;
/// At rest no sensor changes by more than this (counts of 4095) for [`REST_S`] (s).
const STILL: f64 = 30.0;
const REST_S: f64 = 1.0;
/// After this time (s) a sensor that does not rest is no longer watched.
const PATIENCE_S: f64 = 6.0;
/// Readings that a rest must have.
const LEAST_READINGS: usize = 10;

/// Influence of one sensor on another.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bleed {
    /// The sensor that was moved.
    pub from: Sensor,
    /// The sensor that was watched.
    pub into: Sensor,
    /// Change of the watched sensor over that of the moved one.
    pub share: f64,
    /// Largest change of the watched sensor by the moved one (counts).
    pub counts: f64,
    /// The watched sensor moved.
    pub moved: bool,
    /// It is crosstalk: the watched sensor is in step with the moved one, by more than noise.
    pub bleeds: bool,
}

/// Guided crosstalk test, independent of any port: readings in, instructions out. Terminal and window show it.
#[derive(Clone, Debug, Default)]
pub struct CrosstalkTest {
    /// Readings before the channels of the board are known.
    early: u32,
    /// Sensors of the board and their channels, in the order in which they are moved; none before they are known.
    sensors: Vec<(Sensor, usize)>,
    /// Counts of this converter for one of 4095.
    scale: f64,
    at: usize,
    /// Times (s) and counts of the last second, while everything rests.
    window: VecDeque<(f64, Vec<Option<f64>>)>,
    /// Time since which a rest is awaited (s), and the sensor that does not rest.
    resting: Option<f64>,
    restless: Option<Sensor>,
    /// Sensors that did not come to rest in time.
    flickers: Vec<bool>,
    moving: Option<Moving>,
    found: Vec<Bleed>,
    /// Sensors that could not be watched, each with the one that was moved meanwhile.
    unwatched: Vec<[Sensor; 2]>,
    left_out: Vec<Sensor>,
}

/// A sensor is being moved.
#[derive(Clone, Debug)]
struct Moving {
    list: SensorList,
    rest: Vec<Option<f64>>,
    /// Sums over the readings: of x², x y and y² for each watched sensor y.
    sums: Vec<[f64; 3]>,
    /// Largest change of each sensor (counts).
    others: Vec<f64>,
    /// Largest change so far, with its sign (counts).
    most: f64,
    /// Time since which it is back (s).
    back: Option<f64>,
}

/// The sensors of a board with their channels, where there are some on both fingers.
fn sensors_of(board: &Board) -> Result<Vec<(Sensor, usize)>, DoctorError> {
    let channel = |sensor: Sensor| Some((sensor, board.channel_of(sensor)?));
    let can_be_moved = board.sensors.iter().filter(|sensor| sensor.kind() != SensorKind::Raw);
    let sensors: Vec<(Sensor, usize)> = can_be_moved.filter_map(channel).collect();
    if sensors.iter().any(|(sensor, _)| sensor.finger() != sensors[0].0.finger()) {
        return Ok(sensors);
    }
    let channels = board.channels.join(", ");
    Err(DoctorError(format!("the crosstalk test needs sensors on both fingers; the board has {channels}")))
}

impl CrosstalkTest {
    /// True once the channels of the board are known.
    pub fn is_begun(&self) -> bool {
        !self.sensors.is_empty()
    }

    /// True when every sensor was moved or skipped.
    pub fn is_over(&self) -> bool {
        self.is_begun() && self.source().is_none()
    }

    /// Sensor to move; none before the board is known, and when all have been.
    pub fn source(&self) -> Option<Sensor> {
        self.sensors.get(self.at).map(|(sensor, _)| *sensor)
    }

    /// Number of the step, from 1, and how many there are.
    pub fn step(&self) -> [usize; 2] {
        [(self.at + 1).min(self.sensors.len()), self.sensors.len()]
    }

    /// Instruction for the user, while there is a sensor to move.
    pub fn instruction(&self) -> Option<String> {
        let sensor = self.source()?;
        let side = sensor.finger();
        let mut others: Vec<&str> =
            self.sensors.iter().map(|(own, _)| own.finger()).filter(|own| *own != side).collect();
        others.sort_unstable();
        others.dedup();
        let (other, pad) = (others.join(" and "), sensor.label());
        Some(match (&self.moving, self.restless) {
            (None, None) => "do not touch the fingers".to_owned(),
            (None, Some(restless)) => format!("do not touch the fingers: the {} is not at rest", restless.label()),
            (Some(moving), _) if moving.most.abs() >= MOVES * self.scale => format!("release the {side} finger"),
            (Some(_), _) if sensor.is_flex() => {
                format!("bend the {side} finger by hand and release it; do not touch the {other} one")
            }
            (Some(_), _) => format!("press the {pad} firmly and release it; do not touch the {other} finger"),
        })
    }

    /// Takes in a reading of a board. Fails where the board has too few sensors.
    pub fn feed(&mut self, reading: &Reading, board: &Board) -> Result<(), DoctorError> {
        self.scale = f64::from(board.full_scale) / 4095.0;
        if !self.is_begun() {
            self.early += 1;
            if self.early < KNOWN_AFTER {
                return Ok(());
            }
            self.sensors = sensors_of(board)?;
        }
        self.take(reading);
        Ok(())
    }

    fn take(&mut self, reading: &Reading) {
        let Some(source) = self.source() else { return };
        let mut counts = vec![None; source.list().len()];
        for (sensor, channel) in &self.sensors {
            let count = reading.counts.get(*channel).copied().flatten().filter(|count| count.is_finite());
            counts[sensor.index()] = count.map(f64::from);
        }
        match &mut self.moving {
            None => self.rest(reading.t_s, &counts),
            Some(moving) => {
                if moving.add(source, &counts, reading.t_s, self.scale) {
                    let found = moving.found(source, self.scale);
                    let other = |sensor: &Sensor| sensor.finger() != source.finger();
                    let watched = |sensor: &Sensor| found.iter().any(|bleed| bleed.into == *sensor);
                    let others = self.sensors.iter().map(|(sensor, _)| *sensor).filter(other);
                    self.unwatched.extend(others.filter(|sensor| !watched(sensor)).map(|into| [source, into]));
                    self.found.extend(found);
                    self.next();
                }
            }
        }
    }

    /// Skips the sensor to move.
    pub fn skip(&mut self) {
        if let Some(source) = self.source() {
            self.left_out.push(source);
            self.next();
        }
    }

    /// Results so far.
    pub fn found(&self) -> &[Bleed] {
        &self.found
    }

    /// True where every sensor was moved and none shows crosstalk.
    pub fn is_sound(&self) -> bool {
        let all = self.left_out.is_empty() && self.unwatched.is_empty();
        self.source().is_none() && all && !self.found.iter().any(|bleed| bleed.bleeds)
    }

    /// Results in sentences, and what to do.
    pub fn summary(&self) -> Vec<String> {
        let mut lines: Vec<String> = self.found.iter().filter(|bleed| bleed.bleeds).map(Bleed::sentence).collect();
        if !lines.is_empty() {
            lines.push(
                "The converter's multiplexer does not settle behind the high resistance of a divider: solder 100 nF from each \
                 pin to ground, and discard the first conversion of each channel, as our firmware does"
                    .to_owned(),
            );
        } else if !self.found.is_empty() {
            let percent = 100.0 * LEAST_SHARE;
            lines.push(format!("No crosstalk of {percent:.0} % or more"));
        }
        let touched = self.found.iter().filter(|bleed| bleed.moved && !bleed.bleeds);
        lines.extend(touched.map(|bleed| {
            let (into, from) = (bleed.into.label(), bleed.from.label());
            format!("The {into} moved during the {from}'s turn, but not in step with it: was it touched? Test again")
        }));
        lines.extend(self.unwatched.iter().map(|[from, into]| {
            format!(
                "The {} was not at rest or has no readings: crosstalk from the {} is unknown",
                into.label(),
                from.label()
            )
        }));
        let asked = self.left_out.iter().map(|sensor| sensor.label());
        let left_out = asked.chain(self.sensors[self.at..].iter().map(|(sensor, _)| sensor.label()));
        let left_out: Vec<String> = left_out.collect();
        if !left_out.is_empty() {
            lines.push(format!("Skipped: {}", left_out.join(", ")));
        }
        lines
    }

    fn next(&mut self) {
        self.at += 1;
        self.moving = None;
        (self.resting, self.restless) = (None, None);
        self.flickers.clear();
        self.window.clear();
    }

    fn rest(&mut self, t_s: f64, counts: &[Option<f64>]) {
        // A clock that was set back begins anew.
        if self.window.back().is_some_and(|(last, _)| t_s < *last) {
            self.window.clear();
        }
        self.window.push_back((t_s, counts.to_vec()));
        self.flickers.resize(counts.len(), false);
        // Of a slow board it takes longer to see enough.
        while self.window.len() > LEAST_READINGS && self.window.front().is_some_and(|(first, _)| *first < t_s - REST_S)
        {
            self.window.pop_front();
        }
        let waited_s = t_s - *self.resting.get_or_insert(t_s);
        let since = self.window.front().map_or(t_s, |(first, _)| *first);
        // A window is full when one more period would be too much.
        if t_s - since < 0.95 * REST_S || self.window.len() < LEAST_READINGS {
            return;
        }
        let Some(source) = self.source() else { return };
        let mut rest = vec![None; self.flickers.len()];
        self.restless = None;
        for (sensor, rest) in source.list().iter().zip(&mut rest) {
            let place = sensor.index();
            let counts: Vec<f64> = self.window.iter().filter_map(|(_, counts)| counts[place]).collect();
            let least = counts.iter().copied().fold(f64::INFINITY, f64::min);
            let most = counts.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            if most - least > STILL * self.scale {
                // One that flickers for ever shall not keep the others from being looked at.
                self.flickers[place] |= waited_s >= PATIENCE_S;
                if !self.flickers[place] || sensor == source {
                    self.restless = Some(sensor);
                }
                continue;
            }
            *rest = (!counts.is_empty()).then(|| counts.iter().sum::<f64>() / counts.len() as f64);
        }
        let is_read = self.window.iter().any(|(_, counts)| counts[source.index()].is_some());
        if !is_read {
            return self.skip();
        }
        if self.restless.is_some() {
            return;
        }
        self.window.clear();
        let (list, sums, others) = (source.list(), vec![[0.0; 3]; rest.len()], vec![0.0; rest.len()]);
        self.moving = Some(Moving { list, rest, sums, others, most: 0.0, back: None });
    }
}

impl Moving {
    /// Takes in counts; true when the sensor has been moved and is back.
    fn add(&mut self, source: Sensor, counts: &[Option<f64>], t_s: f64, scale: f64) -> bool {
        let change = |place: usize| Some(counts[place]? - self.rest[place]?);
        let Some(x) = change(source.index()) else { return false };
        if x.abs() > self.most.abs() {
            self.most = x;
        }
        for (place, sums) in self.sums.iter_mut().enumerate() {
            if let (Some(count), Some(rest)) = (counts[place], self.rest[place]) {
                let most = &mut self.others[place];
                *most = most.max((count - rest).abs());
            }
            // While it rests there is only noise and creep to be seen.
            if x.abs() > BACK * scale
                && let (Some(count), Some(rest)) = (counts[place], self.rest[place])
            {
                let y = count - rest;
                for (sum, term) in sums.iter_mut().zip([x * x, x * y, y * y]) {
                    *sum += term;
                }
            }
        }
        let near = (BACK * scale).max(BACK_SHARE * self.most.abs());
        if self.most.abs() < MOVES * scale || x.abs() > near {
            self.back = None;
            return false;
        }
        t_s - *self.back.get_or_insert(t_s) >= BACK_S
    }

    /// Results for the sensors of the other finger.
    fn found(&self, source: Sensor, scale: f64) -> Vec<Bleed> {
        let watched = |sensor: &Sensor| sensor.finger() != source.finger() && self.rest[sensor.index()].is_some();
        let bleed = |into: Sensor| {
            let [xx, xy, yy] = self.sums[into.index()];
            let share = if xx > 0.0 { xy / xx } else { 0.0 };
            let counts = share * self.most;
            let in_step = xy.abs() >= IN_STEP * (xx * yy).sqrt();
            let bleeds = in_step && share.abs() >= LEAST_SHARE && counts.abs() >= LEAST_COUNTS * scale;
            let moved = self.others[into.index()] > STILL * scale;
            Bleed { from: source, into, share, counts, moved, bleeds }
        };
        self.list.iter().filter(watched).map(bleed).collect()
    }
}

impl Bleed {
    /// In a sentence.
    pub fn sentence(&self) -> String {
        let (into, from) = (self.into.label(), self.from.label());
        format!("The {into} follows the {from} by {:.1} %: {:+.0} counts", 100.0 * self.share, self.counts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A hand that follows the instructions, seen through a converter by which each channel takes a share of the one before it.
    struct Hand {
        test: CrosstalkTest,
        t_s: f64,
        share: f64,
        /// Moves the right pad while the left one is pressed.
        clumsy: bool,
    }

    /// A test of a board that is known.
    fn begun() -> CrosstalkTest {
        CrosstalkTest { sensors: sensors_of(&Board::default()).expect("has both fingers"), ..CrosstalkTest::default() }
    }

    impl Hand {
        fn new(share: f64) -> Self {
            Self { test: begun(), t_s: 0.0, share, clumsy: false }
        }

        fn feed(&mut self, mut counts: [f64; 4]) {
            for k in (1..4).rev() {
                counts[k] += self.share * (counts[k - 1] - counts[k]);
            }
            self.t_s += 0.02;
            let noise = f64::from((self.t_s * 50.0).round() as i32 % 3 - 1);
            let counts = counts.iter().map(|count| Some((count + noise) as f32)).collect();
            let reading = Reading { t_s: self.t_s, arrived_s: self.t_s, seq: None, counts, line_bar: None };
            self.test.feed(&reading, &Board::default()).expect("has both fingers");
        }

        fn asks(&self) -> String {
            self.test.instruction().unwrap_or_default()
        }

        fn rest(&mut self, seconds: f64) {
            for _ in 0..(50.0 * seconds) as u32 {
                self.feed([1420.0, 1400.0, 0.0, 0.0]);
            }
        }

        /// Follows the instructions to the end.
        fn follow(&mut self) {
            while let Some(sensor) = self.test.source() {
                assert_eq!(self.asks(), "do not touch the fingers");
                self.rest(1.1);
                assert!(self.asks().contains("release it; do not touch"), "{}", self.asks());
                for k in 0..100u32 {
                    let wave = (std::f64::consts::PI * f64::from(k) / 100.0).sin();
                    let mut counts = [1420.0, 1400.0, 0.0, 0.0];
                    counts[sensor.index()] += 600.0 * wave;
                    if self.clumsy && sensor == Sensor::PAD_LEFT && k > 80 {
                        counts[3] += 40.0;
                    }
                    self.feed(counts);
                }
                self.rest(0.6);
            }
        }
    }

    #[test]
    fn each_pair_that_bleeds_is_found_and_no_other() {
        let mut hand = Hand::new(0.1);
        assert_eq!(hand.test.step(), [1, 4]);
        hand.follow();
        let bleeds: Vec<(Sensor, Sensor, i32)> = hand
            .test
            .found()
            .iter()
            .filter(|bleed| bleed.bleeds)
            .map(|bleed| (bleed.from, bleed.into, (1000.0 * bleed.share).round() as i32))
            .collect();
        let [flex_left, flex_right, pad_left, pad_right] = Sensor::PAPER;
        // Of the change of the channel before, which keeps 90 % of its own.
        assert_eq!(bleeds, [(flex_left, flex_right, 100), (flex_right, pad_left, 111), (pad_left, pad_right, 111)]);
        assert_eq!(hand.test.found().len(), 8);
        let lines = hand.test.summary();
        assert!(lines.len() == 4 && lines[0].contains("right flex strip follows the left flex strip by 10.0 %"));
        assert!(lines[3].contains("100 nF"), "{lines:?}");
    }

    #[test]
    fn a_sound_board_and_a_clumsy_hand_are_no_crosstalk() {
        for clumsy in [false, true] {
            let mut hand = Hand { clumsy, ..Hand::new(0.0) };
            hand.follow();
            let lines = hand.test.summary();
            let sound = "No crosstalk of 1 % or more";
            let touched =
                "The right pad moved during the left pad's turn, but not in step with it: was it touched? Test again";
            assert_eq!(lines, if clumsy { vec![sound, touched] } else { vec![sound] }, "{:?}", hand.test.found());
            assert!(hand.test.is_sound());
        }
    }

    #[test]
    fn a_small_share_is_found_though_the_hand_is_slow() {
        let mut hand = Hand::new(0.015);
        while let Some(sensor) = hand.test.source() {
            hand.rest(1.1);
            // Half a minute goes by, in which a strip creeps.
            for k in 0..1500u32 {
                hand.feed([1420.0, 1400.0 + f64::from(k) / 500.0, 0.0, 0.0]);
            }
            for _ in 0..50 {
                let mut counts = [1420.0, 1403.0, 0.0, 0.0];
                counts[sensor.index()] += 1000.0;
                hand.feed(counts);
            }
            hand.rest(0.6);
        }
        let bleeds: Vec<[Sensor; 2]> =
            hand.test.found().iter().filter(|bleed| bleed.bleeds).map(|bleed| [bleed.from, bleed.into]).collect();
        assert_eq!(bleeds.len(), 3, "{:?}", hand.test.found());
    }

    #[test]
    fn one_that_flickers_or_says_nothing_does_not_hold_up_the_others() {
        let mut test = CrosstalkTest::default();
        for k in 0..500u32 {
            assert_eq!(test.is_begun(), k >= KNOWN_AFTER);
            let (t_s, flickers) = (0.02 * f64::from(k), if k % 2 == 0 { 300.0 } else { 0.0 });
            let counts = vec![None, Some(1400.0), Some(0.0), Some(flickers)];
            let reading = Reading { t_s, arrived_s: t_s, seq: None, counts, line_bar: None };
            test.feed(&reading, &Board::default()).expect("has both fingers");
        }
        assert!(test.instruction().is_some_and(|text| text.starts_with("bend the right finger")), "{test:?}");
        assert_eq!(test.summary().last().map(|line| line.starts_with("Skipped: left flex strip")), Some(true));
    }

    #[test]
    fn what_does_not_rest_or_move_is_waited_for_and_may_be_left_out() {
        let mut hand = Hand::new(0.0);
        for k in 0..200 {
            hand.feed([1420.0 + f64::from(k % 10) * 20.0, 1400.0, 0.0, 0.0]);
        }
        assert_eq!(hand.asks(), "do not touch the fingers: the left flex strip is not at rest");
        hand.test.skip();
        hand.rest(3.0);
        assert!(hand.asks().starts_with("bend the right finger"), "{}", hand.asks());
        assert_eq!((hand.test.step(), hand.test.found()), ([2, 4], &[][..]));
        assert_eq!(hand.test.summary(), ["Skipped: left flex strip, right flex strip, left pad, right pad"]);
        assert!(!hand.test.is_sound());
        let one = Board { channels: vec!["flexL".into(), "fsrL".into()], ..Board::default() };
        assert!(sensors_of(&one).is_err(), "nothing could be watched");
    }
}
