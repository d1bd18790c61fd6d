//! Sensors that fail while the gripper works: found in their counts and beside the other sensors, and left out.
//!
//! | trouble | of | found when, for 0.3 s |
//! |---|---|---|
//! | silent | any sensor | its lines have no number |
//! | at an end | any sensor | its counts are at an end of the converter's range; pads and raw sensors may read zero |
//! | stuck | strips, loaded pads | its count is exactly the same while another strip or pad moves |
//! | jumped | strips, loaded pads | it changed within one reading by more than a finger can, and no other sensor did |
//! | silent | pads of whole fingers | it feels nothing, though its finger is held back and another pad is loaded ([`SoundChannels`]) |
//!
//! An open pad reads as an unloaded one: only the others say what it should feel.

use palpate_device::doctor::ChannelTraces;
use palpate_device::protocol::{Saturation, SaturationWatch};
use palpate_learn::{SOUND_WINDOW_S, SoundChannels};
use palpate_tactile::board::{Board, Reading, Sensor, SensorKind};
use palpate_tactile::calibration::{Calibration, Readout, SensorEstimate};
use palpate_tactile::electronics::PadPart;
use palpate_tactile::trial::PhaseMark;
use palpate_tactile::{Channel, Quantity};
use std::sync::{Arc, LazyLock};

/// Time that a trouble must last (s): shorter ones are knocks and loose contacts.
const LASTS_S: f64 = 0.3;
/// Readings further apart than this are not compared (s).
const GAP_S: f64 = 0.25;
/// Longest time between two readings in which a jump is looked for (s): a slow board sees fingers jump.
const JUMP_WITHIN_S: f64 = 0.05;
/// Share of the range that an idle pad reads at most: 20 counts of 12 bits.
const IDLE: f32 = 0.005;
/// Share of the range from which a pad is loaded, about half a newton beside 4.7 kΩ: below it, contact begins and ends at once.
const LOADED: f32 = 0.3;
/// Least jump of a strip, as a share of the range: ten times what the fastest release moves it in a reading at 50 Hz.
const STRIP_JUMP: f32 = 0.025;
/// Least jump of a loaded pad: logarithm of the ratio of its conductances. Closing fingers reach half of it.
const PAD_JUMP: f32 = 0.35;
/// Share of its least jump that another sensor may move meanwhile.
const QUIET: f32 = 0.25;
/// Line pressure that counts as zero, and its fall that begins a release (bar).
const NO_BAR: f64 = 0.02;

/// The shipped predictors; none where their file is damaged, which a test excludes.
static SOUND: LazyLock<Option<Arc<SoundChannels>>> = LazyLock::new(|| SoundChannels::shipped().ok().map(Arc::new));

/// What is wrong with a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorTrouble {
    /// It says nothing: no number, or no load where the others foretell one.
    Silent,
    /// At an end of the converter's range.
    AtEnd,
    /// The same count while others move.
    Stuck,
    /// It changed at once, and alone.
    Jumped,
}

impl SensorTrouble {
    /// Its words after the sensor's name.
    pub fn words(self) -> &'static str {
        match self {
            Self::Silent => "silent",
            Self::AtEnd => "at an end of its range",
            Self::Stuck => "stuck",
            Self::Jumped => "jumped",
        }
    }
}

/// A sensor that has failed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorFault {
    pub sensor: Sensor,
    pub trouble: SensorTrouble,
    /// When it was found, on the clock of the readings (s).
    pub found_s: f64,
    /// Its counts show it at each moment, so that it may pass.
    shows: bool,
}

impl SensorFault {
    /// `left pad silent`.
    pub fn words(&self) -> String {
        format!("{} {}", self.sensor.label(), self.trouble.words())
    }
}

/// A sensor on the board.
#[derive(Clone, Debug)]
struct Watched {
    sensor: Sensor,
    column: usize,
    /// A jump: when (s), and the counts before and after it.
    jump: Option<(f64, [f32; 2])>,
    /// Since when it feels nothing that it should feel (s).
    numb: Option<f64>,
}

/// Watches the sensors of a board.
#[derive(Clone, Debug, Default)]
pub struct SensorWatch {
    sensors: Vec<Watched>,
    full_scale: u32,
    sound: Option<Arc<SoundChannels>>,
    /// Channel and place in `sensors` of each predicted channel; empty where the board lacks one of them.
    predicted: Vec<(Channel, usize)>,
    traces: ChannelTraces,
    saturation: SaturationWatch,
    /// The reading before: time (s) and counts.
    last: Option<(f64, Vec<Option<f32>>)>,
    /// Highest line pressure of the grasp (bar).
    peak_bar: f64,
    /// Found so far, and whether since the beginning of the grasp.
    found: Vec<(SensorFault, bool)>,
}

impl SensorWatch {
    /// Watches the sensors that the board has.
    pub fn new(board: &Board) -> Self {
        let watched = |sensor| {
            let column = board.channel_of(sensor)?;
            Some(Watched { sensor, column, jump: None, numb: None })
        };
        let sensors: Vec<Watched> = board.sensors.iter().filter_map(watched).collect();
        let channels = board.sensors.channels();
        let place = |name: &String| {
            let channel = channels.iter().find(|channel| channel.name() == *name)?;
            Some((channel.clone(), sensors.iter().position(|own| own.sensor.gives(channel))?))
        };
        let sound = SOUND.clone();
        let predicted =
            sound.as_ref().and_then(|sound| sound.channels().iter().map(place).collect()).unwrap_or_default();
        Self { sensors, full_scale: board.full_scale, sound, predicted, ..Self::default() }
    }

    /// Watches all readings of a trial; its zeros are taken from those before the closing, `rest`. Of a board that does not
    /// report it, the line pressure is that of the phases.
    pub fn of_trial(
        board: &Board,
        [rest, readings]: [&[Reading]; 2],
        phases: &[PhaseMark],
        calibrations: &[(Sensor, Calibration)],
    ) -> Self {
        let mut watch = Self::new(board);
        let readout = Readout::new(board, calibrations).unwrap_or_default();
        let readout = readout.clone().with_zero(readout.zero_from(rest));
        for reading in readings {
            let marked = || phases.iter().rev().find(|mark| mark.from_s <= reading.t_s)?.line_bar;
            watch.add(reading, &readout.estimate(reading), reading.line_bar.or_else(marked));
        }
        watch
    }

    /// A grasp begins: what has passed since the last one began is forgotten, but for what the counts alone do not show.
    pub fn begin(&mut self) {
        self.found.retain(|(fault, again)| *again || !fault.shows);
        self.found.iter_mut().for_each(|(_, again)| *again = false);
    }

    /// Takes in a reading, what the calibrations make of it, and the line pressure where it is known (bar). True where another
    /// sensor has failed.
    pub fn add(&mut self, reading: &Reading, estimate: &SensorEstimate, line_bar: Option<f64>) -> bool {
        if self.last.as_ref().is_some_and(|(t_s, _)| !(0.0..GAP_S).contains(&(reading.t_s - t_s))) {
            (self.traces, self.saturation, self.last) = Default::default();
            self.sensors.iter_mut().for_each(|own| (own.jump, own.numb) = Default::default());
        }
        self.traces.add(reading);
        let sent = vec![true; reading.counts.len()];
        self.saturation.add(&reading.counts, &sent, reading.t_s, self.full_scale);
        let shown = self.in_counts();
        let hidden = [self.jumped(reading), self.numb(reading, estimate, line_bar)].concat();
        let troubles = shown.into_iter().map(|own| (own, true)).chain(hidden.into_iter().map(|own| (own, false)));
        self.last = Some((reading.t_s, reading.counts.clone()));
        let before = self.found.len();
        for ((sensor, trouble), shows) in troubles {
            match self.found.iter_mut().find(|(fault, _)| fault.sensor == sensor) {
                Some((_, again)) => *again = true,
                None => self.found.push((SensorFault { sensor, trouble, found_s: reading.t_s, shows }, true)),
            }
        }
        self.found.len() > before
    }

    /// Sensors that have failed.
    pub fn faults(&self) -> impl Iterator<Item = &SensorFault> {
        self.found.iter().map(|(fault, _)| fault)
    }

    fn has_failed(&self, sensor: Sensor) -> bool {
        self.faults().any(|fault| fault.sensor == sensor)
    }

    /// Troubles that the counts show by themselves.
    fn in_counts(&self) -> Vec<(Sensor, SensorTrouble)> {
        let lasting = self.saturation.lasting(LASTS_S);
        let is_part = |column: usize, kinds: &[SensorKind]| {
            self.sensors.iter().any(|own| own.column == column && kinds.contains(&own.sensor.kind()))
        };
        let trouble = |own: &Watched| {
            let (flex, pad) = (SensorKind::Flex, SensorKind::Pad);
            let kind = own.sensor.kind();
            match lasting.get(own.column).copied().flatten() {
                Some(Saturation::NoNumber) => return Some(SensorTrouble::Silent),
                Some(Saturation::High) => return Some(SensorTrouble::AtEnd),
                Some(Saturation::Low) => return (kind == flex).then_some(SensorTrouble::AtEnd),
                None => {}
            }
            let others: &[SensorKind] = match kind {
                // A finger that something holds may rest while its pad is pressed on, but not while the other finger bends.
                SensorKind::Flex => &[flex],
                SensorKind::Pad => &[flex, pad],
                SensorKind::Raw => return None,
            };
            let [count, lasted] = self.traces.constant(own.column, |column| is_part(column, others))?;
            let idle = kind == pad && count as f32 <= IDLE * self.full();
            (lasted >= LASTS_S && !idle).then_some(SensorTrouble::Stuck)
        };
        self.sensors.iter().filter_map(|own| Some((own.sensor, trouble(own)?))).collect()
    }

    fn full(&self) -> f32 {
        self.full_scale as f32
    }

    /// How far a sensor moved from one count to another, over its least jump.
    fn moved(&self, sensor: Sensor, [before, after]: [f32; 2]) -> f32 {
        let full = self.full();
        let conductance = |count: f32| count.clamp(1.0, full) / (full + 1.0 - count.clamp(1.0, full));
        match sensor.kind() {
            SensorKind::Pad if before >= LOADED * full => {
                (conductance(after) / conductance(before)).ln().abs() / PAD_JUMP
            }
            // An unloaded pad does not jump, but it may move.
            SensorKind::Pad => ((after - before).abs() / (STRIP_JUMP * full)).min(1.0),
            SensorKind::Flex => (after - before).abs() / (STRIP_JUMP * full),
            SensorKind::Raw => 0.0,
        }
    }

    /// Sensors that moved alone since the reading before, by more than a finger can: their places, and when and how far.
    fn jumps(&self, reading: &Reading) -> Vec<(usize, (f64, [f32; 2]))> {
        let Some((last_s, last)) = self.last.as_ref().filter(|(t_s, _)| reading.t_s - t_s <= JUMP_WITHIN_S) else {
            return Vec::new();
        };
        let of = |own: &Watched| Some([(*last.get(own.column)?)?, (*reading.counts.get(own.column)?)?]);
        let pairs: Vec<Option<[f32; 2]>> = self.sensors.iter().map(of).collect();
        let moved: Vec<f32> = self
            .sensors
            .iter()
            .zip(&pairs)
            .map(|(own, pair)| pair.map_or(0.0, |pair| self.moved(own.sensor, pair)))
            .collect();
        let is_loaded_pad = |k: usize| {
            let is_loaded = pairs[k].is_some_and(|[before, _]| before >= LOADED * self.full());
            is_loaded && self.sensors[k].sensor.kind() == SensorKind::Pad
        };
        // Alone: no other sensor moves; what a pad feels, another feels too.
        let alone = |k: usize| {
            let others: Vec<usize> =
                (0..pairs.len()).filter(|other| *other != k && !self.has_failed(self.sensors[*other].sensor)).collect();
            let felt =
                self.sensors[k].sensor.kind() != SensorKind::Pad || others.iter().any(|other| is_loaded_pad(*other));
            felt && others.iter().all(|other| moved[*other] < QUIET)
        };
        (0..pairs.len())
            .filter(|k| moved[*k] > 1.0 && alone(*k))
            .filter_map(|k| Some((k, (*last_s, pairs[k]?))))
            .collect()
    }

    /// Sensors that have jumped alone and not come back.
    fn jumped(&mut self, reading: &Reading) -> Vec<(Sensor, SensorTrouble)> {
        let count = |counts: &[Option<f32>], own: &Watched| counts.get(own.column).copied().flatten();
        for (k, jump) in self.jumps(reading) {
            self.sensors[k].jump.get_or_insert(jump);
        }
        let (mut found, idle, at) = (Vec::new(), IDLE * self.full(), self.saturation.lasting(0.0));
        for own in &mut self.sensors {
            let (Some((t_s, [before, after])), Some(now)) = (own.jump, count(&reading.counts, own)) else { continue };
            let at_end = match at.get(own.column).copied().flatten() {
                Some(Saturation::Low) => own.sensor.kind() != SensorKind::Pad,
                other => other.is_some(),
            };
            if at_end || (now - before).abs() < 0.5 * (after - before).abs() {
                own.jump = None;
            } else if reading.t_s - t_s >= LASTS_S {
                let is_silent = own.sensor.kind() == SensorKind::Pad && after <= idle;
                found.push((own.sensor, if is_silent { SensorTrouble::Silent } else { SensorTrouble::Jumped }));
                own.jump = None;
            }
        }
        found
    }

    /// Pads that feel nothing, though the others say that they should, while the fingers close and hold.
    fn numb(
        &mut self,
        reading: &Reading,
        estimate: &SensorEstimate,
        line_bar: Option<f64>,
    ) -> Vec<(Sensor, SensorTrouble)> {
        let bar = line_bar.unwrap_or(0.0);
        self.peak_bar = if bar < NO_BAR { 0.0 } else { self.peak_bar.max(bar) };
        // Of a failed sensor nothing follows.
        let value = |(channel, place): &(Channel, usize)| {
            estimate.of(channel).filter(|_| !self.has_failed(self.sensors[*place].sensor)).map(|value| value as f32)
        };
        let values: Option<Vec<f32>> = self.predicted.iter().map(value).collect();
        let presses = bar >= NO_BAR && bar > self.peak_bar - NO_BAR;
        let known = self.sound.as_ref().zip(values).filter(|_| presses);
        let mut found = Vec::new();
        for (channel, (_, place)) in self.predicted.iter().enumerate() {
            let is_silent = known.as_ref().is_some_and(|(sound, row)| sound.is_silent(channel, row, bar as f32));
            let own = &mut self.sensors[*place];
            own.numb = is_silent.then(|| own.numb.unwrap_or(reading.t_s));
            if own.numb.is_some_and(|since| reading.t_s - since >= f64::from(SOUND_WINDOW_S)) {
                found.push((own.sensor, SensorTrouble::Silent));
            }
        }
        found
    }

    /// Replaces what failed sensors read in these channels: by what the others foretell at this line pressure (bar), where one
    /// alone has failed, else by NaN.
    pub fn mend(&self, channels: &[Channel], values: &mut [f32], line_bar: f64) {
        if self.found.is_empty() {
            return;
        }
        let foretold = self.foretold(channels, values, line_bar);
        for (channel, value) in channels.iter().zip(values) {
            let Some(fault) = self.faults().find(|fault| fault.sensor.gives(channel)) else { continue };
            let own = foretold.filter(|(sensor, _)| *sensor == fault.sensor).map(|(_, reading)| reading);
            let of_pad = if channel.quantity == Quantity::Force { PadPart::ACTIVE_AREA as f32 } else { 1.0 };
            *value = own.map_or(f32::NAN, |reading| reading * of_pad);
        }
    }

    /// The predicted channel whose sensor alone has failed: its sensor and reading.
    fn foretold(&self, channels: &[Channel], values: &[f32], line_bar: f64) -> Option<(Sensor, f32)> {
        let (channel, sensor) = self.mended()?;
        let place = |(own, _): &(Channel, usize)| channels.iter().position(|other| other == own);
        let row: Vec<f32> = self.predicted.iter().map(|own| Some(values[place(own)?])).collect::<Option<_>>()?;
        let known = row.iter().enumerate().all(|(k, value)| k == channel || value.is_finite());
        let sound = self.sound.as_ref().filter(|_| known && line_bar.is_finite())?;
        Some((sensor, sound.foretold(channel, &row, line_bar as f32)))
    }

    /// The one predicted channel whose sensor has failed, and the sensor.
    fn mended(&self) -> Option<(usize, Sensor)> {
        let sensor = |(channel, (_, place)): (usize, &(Channel, usize))| (channel, self.sensors[*place].sensor);
        let mut failed = self.predicted.iter().enumerate().map(sensor).filter(|(_, own)| self.has_failed(*own));
        failed.next().filter(|_| failed.next().is_none())
    }

    /// What has failed, and from how many of these channels of a model it still answers:
    /// `left pad silent: answering from 3 channels`.
    pub fn words(&self, channels: &[Channel], model: &[String]) -> Option<String> {
        let failed: Vec<String> = self.faults().map(SensorFault::words).collect();
        if failed.is_empty() {
            return None;
        }
        let read = || channels.iter().filter(|channel| model.contains(&channel.name()));
        let lost = |sensor: Sensor| read().filter(|channel| sensor.gives(channel)).count();
        let all: usize = self.faults().map(|fault| lost(fault.sensor)).sum();
        let answers = match self.mended() {
            _ if all == 0 => String::new(),
            Some((_, sensor)) if lost(sensor) == all => format!(": answering from {} channels", model.len() - all),
            _ => ": no answer".to_owned(),
        };
        Some(failed.join(", ") + &answers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_tactile::board::SensorList;

    /// What a watch of a board finds in readings at 50 Hz, in seconds since the first.
    fn found(board: &Board, seconds: f64, counts: impl Fn(f64) -> Vec<Option<f32>>) -> Vec<(String, f64)> {
        let mut watch = SensorWatch::new(board);
        for k in 0..(50.0 * seconds) as u32 {
            let t_s = 0.02 * f64::from(k);
            let reading = Reading { t_s, arrived_s: t_s, seq: None, counts: counts(t_s), line_bar: None };
            watch.add(&reading, &SensorEstimate::default(), None);
        }
        watch.faults().map(|fault| (fault.words(), fault.found_s)).collect()
    }

    /// A close, a hold from 2 s on and a release from 3 s on: counts of strips and pads, all noisy.
    fn grasp(t_s: f64) -> [f32; 4] {
        let closed = (t_s / 2.0).clamp(0.0, 1.0).min(1.0 - (t_s - 3.0).clamp(0.0, 1.0)) as f32;
        let noise = |k: f64| ((50.0 * t_s + k) as u32 * 7 % 5) as f32 * 0.5;
        let pad = (4000.0 * (closed - 0.5)).max(0.0);
        [1400.0 + 700.0 * closed + noise(0.0), 1300.0 + 600.0 * closed + noise(1.0), pad + noise(2.0), pad + noise(3.0)]
    }

    fn with(channel: usize, from_s: f64, reading: impl Fn(f32) -> Option<f32>) -> impl Fn(f64) -> Vec<Option<f32>> {
        move |t_s| {
            let mut counts = grasp(t_s).map(Some).to_vec();
            if t_s >= from_s {
                counts[channel] = reading(grasp(t_s)[channel]);
            }
            counts
        }
    }

    #[test]
    fn what_counts_show_is_found_within_a_third_of_a_second_and_sound_grasps_are_not() {
        let board = Board::default();
        assert_eq!(found(&board, 4.5, |t_s| grasp(t_s).map(Some).to_vec()), []);
        let stuck = grasp(0.98)[0];
        for (words, faulty, from_s, within_s) in [
            ("right pad silent", found(&board, 4.5, with(3, 1.0, |_| None)), 1.0, 0.34),
            ("left flex strip at an end of its range", found(&board, 4.5, with(0, 1.0, |_| Some(4095.0))), 1.0, 0.34),
            ("left flex strip stuck", found(&board, 4.5, with(0, 1.0, move |_| Some(stuck))), 1.0, 0.4),
            // A pad that sticks in the hold shows it when the fingers open.
            ("left pad stuck", found(&board, 4.5, with(2, 2.5, |_| Some(2001.0))), 3.0, 0.4),
            // Disconnected under load: the other pad still feels it.
            ("left pad silent", found(&board, 4.5, with(2, 2.5, |_| Some(0.0))), 2.5, 0.34),
            ("right pad jumped", found(&board, 4.5, with(3, 2.5, |count| Some(0.7 * count))), 2.5, 0.34),
            ("right flex strip jumped", found(&board, 4.5, with(1, 2.5, |count| Some(0.7 * count))), 2.5, 0.34),
        ] {
            let [(found, found_s)] = &faulty[..] else { panic!("{words}: {faulty:?}") };
            assert!(found == words && (from_s..from_s + within_s).contains(found_s), "{words}: {faulty:?}");
        }
    }

    #[test]
    fn a_knock_an_idle_pad_and_a_gap_are_no_fault() {
        let board = Board::default();
        let knock = |t_s: f64| {
            let mut counts = grasp(t_s).map(Some).to_vec();
            counts[2] = if (2.5..2.6).contains(&t_s) { Some(0.0) } else { counts[2] };
            counts
        };
        assert_eq!(found(&board, 4.5, knock), []);
        assert_eq!(found(&board, 4.5, with(2, 0.0, |_| Some(0.0))), [], "one-sided contact looks the same");
        let mut watch = SensorWatch::new(&board);
        for (t_s, bent) in [(0.0, 1400.0), (0.02, 1401.0), (5.0, 1900.0), (5.02, 1950.0)] {
            let counts = vec![Some(bent), Some(1300.0), Some(0.0), Some(0.0)];
            watch.add(
                &Reading { t_s, arrived_s: t_s, seq: None, counts, line_bar: None },
                &SensorEstimate::default(),
                None,
            );
        }
        assert_eq!(watch.faults().count(), 0, "nothing is known of the time between");
    }

    #[test]
    fn any_list_of_sensors_is_watched_by_its_counts() {
        let text = "[[sensor]]\nname = \"thumb\"\nfinger = \"thumb\"\nkind = \"flex\"\n\
                    [[sensor]]\nname = \"palm\"\nkind = \"raw\"\n";
        let sensors = SensorList::parse(text).expect("sound");
        let board = Board { sensors, channels: vec!["thumb".to_owned(), "palm".to_owned()], ..Board::default() };
        let sound = |t_s: f64| vec![Some(grasp(t_s)[0]), Some(0.0)];
        assert_eq!(found(&board, 4.5, sound), [], "a raw sensor may rest at zero");
        let names = |found: Vec<(String, f64)>| found.into_iter().map(|(words, _)| words).collect::<Vec<_>>();
        let broken = |t_s: f64| vec![Some(if t_s < 1.0 { 1400.0 } else { 4095.0 }), None];
        assert_eq!(names(found(&board, 4.5, broken)), ["palm silent", "thumb flex strip at an end of its range"]);
    }

    #[test]
    fn a_pad_that_failed_reads_what_the_others_foretell_and_two_are_not_answered() {
        let board = Board::default();
        let channels = board.sensors.channels();
        let names: Vec<String> = channels.iter().map(Channel::name).collect();
        let (mut watch, model) = (SensorWatch::new(&board), &names[..4]);
        let values = |left: f32, right: f32| [8.0, 8.0, left, right, 2e-4 * left, 2e-4 * right, 2000.0];
        let mended = |watch: &SensorWatch| {
            let mut row = values(0.0, 2e4);
            watch.mend(&channels, &mut row, 1.0);
            row
        };
        assert_eq!((mended(&watch), watch.words(&channels, model)), (values(0.0, 2e4), None));
        let mut lose = |lost: &[usize]| {
            for k in 0..30 {
                let t_s = 0.02 * f64::from(k);
                let mut counts = grasp(t_s).map(Some).to_vec();
                lost.iter().for_each(|k| counts[*k] = None);
                let reading = Reading { t_s, arrived_s: t_s, seq: None, counts, line_bar: None };
                watch.add(&reading, &SensorEstimate::default(), None);
            }
            (mended(&watch), watch.words(&channels, model))
        };
        let (row, words) = lose(&[2]);
        assert_eq!(words.as_deref(), Some("left pad silent: answering from 3 channels"));
        assert!(row[2] > 2e3 && (row[4] / row[2] - PadPart::ACTIVE_AREA as f32).abs() < 1e-9, "{row:?}");
        assert_eq!((row[3], row[6]), (2e4, 2000.0), "others stay as they are");
        let (row, words) = lose(&[2, 3]);
        assert_eq!(words.as_deref(), Some("left pad silent, right pad silent: no answer"));
        assert!(row[2..6].iter().all(|value| value.is_nan()) && row[0] == 8.0, "{row:?}");
        watch.begin();
        watch.begin();
        assert_eq!(watch.faults().count(), 0, "numbers came back, as far as is known");
    }
}
