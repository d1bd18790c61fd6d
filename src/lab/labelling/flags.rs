//! Flags of a trial of the real gripper, derived from its readings when it ends. A flag is a hint: the trial is kept
//! and used for training unless the user discards it.
//!
//! | flag | raised when |
//! |---|---|
//! | no contact | no pad was loaded while the hand closed and held |
//! | late start | the line had pressure, or a pad was loaded, before the grasp was seen to begin |
//! | saturated | a channel was at an end of its range for more than 2 % of that time |
//! | interrupted | the connection broke, readings are missing for over 0.1 s, or a sensor is missing in most readings |
//! | cadence | readings were lost, the rate is off by more than 2 %, or the jitter is above half a period |
//! | sensor fault | a sensor failed, as [`SensorWatch`] finds |

use super::sensor_watch::SensorWatch;
use palpate_sim::gripper::Phase;
use palpate_store::labels::{Flag, FlagRemark};
use palpate_tactile::board::{Board, Gap, Reading, Sensor, SensorKind};
use palpate_tactile::cadence::Cadence;
use palpate_tactile::calibration::{Calibration, Input, RangeEnd, Readout};
use palpate_tactile::electronics::PadPart;
use palpate_tactile::trial::{Control, PhaseMark};

/// Consecutive readings that count as contact: a single one may be a knock.
const IN_A_ROW: usize = 3;
/// Smallest rise of an uncalibrated pad that counts as contact, in standard deviations of its noise at rest.
const DEVIATIONS: f64 = 6.0;
/// Smallest contact force of a pad whose calibration has no bending correction (N): bending alone may read as up to
/// 0.3 N.
const BENT_FORCE: f64 = 0.4;
/// Share of the closed time at an end of the range above which the flag is raised.
const SATURATED_SHARE: f64 = 0.02;
/// Shortest gap that counts as an interruption (s); at low rates, at least three missing readings.
const LEAST_GAP_S: f64 = 0.1;
/// Largest deviation of the rate, as a share of it.
const RATE_SHARE: f64 = 0.02;
/// Length of the rest window if the start of the closing is unknown (s).
const REST_S: f64 = 0.3;

/// Pressure step of the control box (bar).
const PRESSURE_STEP_BAR: f64 = 0.05;

/// Content of a finished trial.
#[derive(Clone, Copy, Debug)]
pub struct Observed<'a> {
    /// The board.
    pub board: &'a Board,
    /// Its readings; for a long trial, an evenly spaced subset.
    pub readings: &'a [Reading],
    /// Gaps in the readings.
    pub gaps: &'a [Gap],
    /// Cause of each broken connection.
    pub interruptions: &'a [String],
    /// Timing statistics of the board.
    pub cadence: &'a Cadence,
    /// Phases of the grasp, if known.
    pub phases: &'a [PhaseMark],
    /// Who actuated: a driven hand opens first.
    pub control: Control,
    /// Calibrations of its parts, if any.
    pub calibrations: &'a [(Sensor, Calibration)],
}

/// Faults of a trial, as flags.
pub fn flags_of(trial: &Observed<'_>) -> Vec<FlagRemark> {
    let late_start = trial.late_start();
    let raised = [
        (Flag::NoContact, trial.no_contact().filter(|_| late_start.is_none())),
        (Flag::LateStart, late_start),
        (Flag::Saturated, trial.saturated()),
        (Flag::Interrupted, trial.interrupted()),
        (Flag::Cadence, trial.bad_cadence()),
        (Flag::SensorFault, trial.sensor_fault()),
    ];
    raised.into_iter().filter_map(|(flag, remark)| Some(FlagRemark { flag, remark: remark? })).collect()
}

impl Observed<'_> {
    /// Splits off the readings before the closing, and those of closing and hold: by the phases if known, otherwise by
    /// the reported pressure, otherwise at [`REST_S`] after the first reading.
    fn split(&self) -> (&[Reading], &[Reading]) {
        let start = |phase: Phase| self.phases.iter().find(|mark| mark.phase == phase).map(|mark| mark.from_s);
        let pressures = || self.readings.iter().filter_map(|reading| Some((reading.t_s, reading.line_bar?)));
        let most = pressures().map(|(_, bar)| bar).fold(0.0, f64::max);
        let first = self.readings.first().map_or(0.0, |reading| reading.t_s);
        let (closing, release) = match (start(Phase::Close), pressures().find(|(_, bar)| *bar > 0.0)) {
            (Some(closing), _) => (closing, start(Phase::Release)),
            (None, Some((closing, _))) => {
                let full = pressures().rfind(|(_, bar)| *bar > most - PRESSURE_STEP_BAR);
                (closing, full.map(|(t_s, _)| t_s.next_up()))
            }
            (None, None) => (first + REST_S, None),
        };
        let release = release.filter(|release| *release > closing).unwrap_or(f64::INFINITY);
        let from = self.readings.partition_point(|reading| reading.t_s < closing);
        let to = self.readings.partition_point(|reading| reading.t_s < release).max(from);
        (&self.readings[..from], &self.readings[from..to])
    }

    /// Remark for a trial without contact; `None` if a pad was loaded or there are no pads.
    fn no_contact(&self) -> Option<String> {
        let (rest, pressed) = self.split();
        if pressed.is_empty() {
            return (!self.readings.is_empty()).then(|| "ended before the fingers closed".to_owned());
        }
        let pads = self.board.sensors.of_kind(SensorKind::Pad);
        let rises: Vec<PadRise> = pads.filter_map(|pad| self.rise(pad, rest, pressed)).collect();
        if rises.is_empty() || rises.iter().any(|pad| pad.rise > pad.least) {
            return None;
        }
        let each: Vec<String> = rises.iter().map(PadRise::summary).collect();
        let mut least: Vec<String> = rises.iter().map(PadRise::needed).collect();
        least.dedup();
        Some(format!("{} (needs {})", each.join(", "), least.join(" and ")))
    }

    /// Remark for a trial that began while the hand was closed; its sensors have no rest to be zeroed at.
    fn late_start(&self) -> Option<String> {
        const ADVICE: &str = "when the recording began: begin with open fingers";
        let (rest, pressed) = self.split();
        // A hand that the board does not drive may have opened and begun to close once more.
        let first = if self.control == Control::Driven { None } else { self.readings.first() };
        let before = [first, Some(rest.last().or(pressed.first())?)];
        if let Some(bar) = before.iter().flatten().filter_map(|reading| reading.line_bar).reduce(f64::max) {
            let told = || format!("the line was at {bar:.2} bar {ADVICE}");
            return (bar >= PRESSURE_STEP_BAR).then(told);
        }
        let pads = self.board.sensors.of_kind(SensorKind::Pad);
        let loaded = |pad: Sensor| {
            let column = self.board.channel_of(pad)?;
            let counts = |reading: &Reading| reading.counts.get(column).copied().flatten().map(f64::from);
            let (first, _) = middle_and_deviation(rest.iter().filter_map(counts).collect())?;
            let later = self.readings[rest.len()..].iter().map(counts);
            let open = -lasting_peak(later.map(|count| count.map(|count| -count)))?;
            let is_loaded = first - open > self.least_counts(pad);
            is_loaded.then(|| format!("{} was loaded ({first:.0} counts, later {open:.0}) {ADVICE}", pad.label()))
        };
        pads.into_iter().find_map(loaded)
    }

    /// Counts of an uncalibrated pad at the smallest force that counts as contact.
    fn least_counts(&self, pad: Sensor) -> f64 {
        let nominal = PadPart::NOMINAL_SIEMENS * BENT_FORCE.powf(PadPart::NOMINAL_EXPONENT);
        Input::on(self.board, pad).counts(1.0 / nominal)
    }

    /// Rise of a pad: in newtons if it is calibrated, otherwise in counts.
    fn rise(&self, pad: Sensor, rest: &[Reading], pressed: &[Reading]) -> Option<PadRise> {
        let column = self.board.channel_of(pad)?;
        if let Some((_, calibration)) = self.calibrations.iter().find(|(sensor, _)| *sensor == pad) {
            let readout = Readout::new(self.board, self.calibrations).ok()?;
            let readout = readout.clone().with_zero(readout.zero_from(rest));
            let rise = lasting_peak(pressed.iter().map(|reading| readout.estimate(reading).value(pad)));
            let least = if calibration.record.bending.is_some() { PadPart::LEAST_FORCE } else { BENT_FORCE };
            return Some(PadRise { pad, rise: rise?, least, unit: "N" });
        }
        let counts = |reading: &Reading| reading.counts.get(column).copied().flatten().map(f64::from);
        let (middle, deviation) = middle_and_deviation(rest.iter().filter_map(counts).collect())?;
        let peak = lasting_peak(pressed.iter().map(counts))?;
        let least = (DEVIATIONS * deviation).max(self.least_counts(pad));
        Some(PadRise { pad, rise: peak - middle, least, unit: "counts" })
    }

    fn saturated(&self) -> Option<String> {
        let (_, pressed) = self.split();
        let remark = |sensor: Sensor| {
            let column = self.board.channel_of(sensor)?;
            let made_with = self.calibrations.iter().find(|(own, _)| *own == sensor).map(|(_, c)| c.record.input);
            let usual = Input::on(self.board, sensor);
            let input = made_with.map_or(usual, |input| input.seen_by(self.board, sensor));
            let counts = pressed.iter().filter_map(|reading| reading.counts.get(column).copied().flatten());
            let at_its_end = |count: &f32| match input.range_end(f64::from(*count)) {
                // An unloaded pad reads as an open circuit.
                Some(RangeEnd::Open) => sensor.is_flex(),
                Some(RangeEnd::Short) => true,
                None => false,
            };
            let (count, all) = (counts.filter(at_its_end).count(), pressed.len());
            let worth_it = count >= IN_A_ROW && count as f64 > SATURATED_SHARE * all as f64;
            let percent = 100.0 * count as f64 / all.max(1) as f64;
            worth_it.then(|| format!("{} saturated for {percent:.0} % of the grasp", sensor.label()))
        };
        let parts = self.board.sensors.iter().filter(|sensor| sensor.kind() != SensorKind::Raw);
        joined(parts.filter_map(remark))
    }

    fn interrupted(&self) -> Option<String> {
        let period = self.rate().map_or(0.0, |rate| 1.0 / rate);
        let long = |gap: &&Gap| gap.to_s - gap.from_s > LEAST_GAP_S.max(3.5 * period);
        let began = self.readings.first().map_or(0.0, |reading| reading.t_s);
        let remark = |gap: &Gap| {
            let (from, length) = (gap.from_s - began, gap.to_s - gap.from_s);
            format!("no readings for {length:.2} s from {from:.2} s: {}", gap.cause)
        };
        let gaps = self.gaps.iter().filter(long).map(remark);
        // If readings follow, a broken connection is also the cause of a gap: it is listed only once.
        let has_no_gap = |cause: &&String| !self.gaps.iter().any(|gap| gap.cause.contains(cause.as_str()));
        let broken = self.interruptions.iter().filter(has_no_gap).cloned();
        joined(gaps.chain(broken).chain(self.board.sensors.iter().filter_map(|sensor| self.without_numbers(sensor))))
    }

    /// Remark for a sensor without a value in most readings: probably an open circuit.
    fn without_numbers(&self, sensor: Sensor) -> Option<String> {
        let column = self.board.channel_of(sensor)?;
        let is_missing = |reading: &&Reading| reading.counts.get(column).copied().flatten().is_none();
        let (missing, all) = (self.readings.iter().filter(is_missing).count(), self.readings.len());
        let percent = 100.0 * missing as f64 / all.max(1) as f64;
        (percent > 50.0).then(|| format!("{}: no value in {percent:.0} % of readings", sensor.label()))
    }

    fn bad_cadence(&self) -> Option<String> {
        let Cadence { lost, gaps, rate_hz, jitter_p95_ms, samples, .. } = self.cadence;
        let mut faults = Vec::new();
        if *samples > 0 && *lost > 0 {
            let share = 100.0 * *lost as f64 / (*samples + *lost) as f64;
            faults.push(format!("{lost} readings lost, {share:.1} %"));
        }
        if let Some(stated) = self.board.rate_hz.filter(|stated| *stated > 0.0 && *gaps == 0 && *rate_hz > 0.0) {
            let off = rate_hz / stated - 1.0;
            if off.abs() > RATE_SHARE {
                faults.push(format!("{rate_hz:.2} Hz instead of {stated:.0}, {:+.1} %", 100.0 * off));
            }
        }
        let half_period_ms = self.rate().map_or(f64::INFINITY, |rate| 500.0 / rate);
        if *jitter_p95_ms > half_period_ms {
            faults.push(format!("jitter {jitter_p95_ms:.1} ms, limit {half_period_ms:.1} ms (half a period)"));
        }
        joined(faults.into_iter())
    }

    fn sensor_fault(&self) -> Option<String> {
        let began = self.readings.first().map_or(0.0, |reading| reading.t_s);
        let watch = SensorWatch::of_trial(self.board, [self.split().0, self.readings], self.phases, self.calibrations);
        joined(watch.faults().map(|fault| format!("{}, found at {:.2} s", fault.words(), fault.found_s - began)))
    }

    /// Readings per second: as the board states, otherwise as measured.
    fn rate(&self) -> Option<f64> {
        self.board.rate_hz.or(Some(self.cadence.rate_hz)).filter(|rate| rate.is_finite() && *rate > 0.0)
    }
}

/// Rise of a pad while the hand was closed.
struct PadRise {
    pad: Sensor,
    rise: f64,
    least: f64,
    unit: &'static str,
}

impl PadRise {
    fn summary(&self) -> String {
        format!("{} {}", self.pad.label(), self.shown(self.rise))
    }

    fn needed(&self) -> String {
        self.shown(self.least)
    }

    fn shown(&self, value: f64) -> String {
        let digits = if self.unit == "N" { 2 } else { 0 };
        format!("{value:.digits$} {}", self.unit)
    }
}

fn joined(parts: impl Iterator<Item = String>) -> Option<String> {
    let parts: Vec<String> = parts.collect();
    (!parts.is_empty()).then(|| parts.join("; "))
}

/// Largest value held for [`IN_A_ROW`] consecutive readings; readings without a value are skipped.
fn lasting_peak(values: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    let values: Vec<f64> = values.flatten().filter(|value| value.is_finite()).collect();
    let least = |window: &[f64]| window.iter().copied().fold(f64::INFINITY, f64::min);
    values.windows(IN_A_ROW.min(values.len().max(1))).map(least).max_by(f64::total_cmp)
}

/// Median, and standard deviation from the median absolute deviation, so that a knock has no influence. The deviation
/// is at least that of rounding to whole counts.
pub(super) fn middle_and_deviation(mut values: Vec<f64>) -> Option<(f64, f64)> {
    let middle = median(&mut values)?;
    let mut off: Vec<f64> = values.iter().map(|value| (value - middle).abs()).collect();
    // Ratio of standard to median absolute deviation for normally distributed noise.
    let deviation = 1.4826 * median(&mut off)?;
    Some((middle, deviation.max(12f64.sqrt().recip())))
}

fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_sim::objects::EMPTY;
    use palpate_store::labels::{cadence_line, flaws};

    /// Three seconds at 50 Hz: at rest, closed from 0.5 s on, released from 2.5 s on; the pads rise by `rise` counts.
    fn readings(rise: f32) -> Vec<Reading> {
        let reading = |k: u32| {
            let t_s = 0.02 * f64::from(k);
            let noise = (k % 3) as f32;
            let pressed = (1.0..2.5).contains(&t_s);
            let pad = if pressed { rise } else { 0.0 } + noise;
            let counts = vec![Some(1400.0 + noise), Some(1400.0), Some(pad), Some(pad)];
            Reading { t_s, arrived_s: t_s, seq: Some(k.into()), counts, line_bar: None }
        };
        (0..150).map(reading).collect()
    }

    fn marks() -> Vec<PhaseMark> {
        let mark = |from_s, phase| PhaseMark { from_s, phase, line_bar: None };
        vec![mark(0.5, Phase::Close), mark(1.5, Phase::Hold), mark(2.5, Phase::Release)]
    }

    fn good() -> Cadence {
        Cadence { samples: 150, rate_hz: 50.0, jitter_p95_ms: 0.4, ..Cadence::default() }
    }

    fn flags(readings: &[Reading], gaps: &[Gap], interruptions: &[String], cadence: &Cadence) -> Vec<FlagRemark> {
        flags_under(Control::Free, readings, gaps, interruptions, cadence)
    }

    fn flags_under(
        control: Control,
        readings: &[Reading],
        gaps: &[Gap],
        interruptions: &[String],
        cadence: &Cadence,
    ) -> Vec<FlagRemark> {
        let board = Board { rate_hz: Some(50.0), ..Board::default() };
        let (phases, calibrations) = (marks(), &[]);
        let phases = &phases;
        flags_of(&Observed { board: &board, readings, gaps, interruptions, cadence, phases, control, calibrations })
    }

    #[test]
    fn a_good_trial_has_no_flags() {
        assert_eq!(flags(&readings(1500.0), &[], &[], &good()), []);
        assert_eq!(cadence_line(&good()), "50.00 Hz, jitter 0.4 ms, 0 lost");
    }

    #[test]
    fn a_hand_that_missed_is_flagged_and_an_empty_one_may() {
        for missed in [readings(0.0), readings(600.0), {
            // A single reading is a knock.
            let mut knocked = readings(0.0);
            knocked[80].counts[2] = Some(3000.0);
            knocked
        }] {
            let found = flags(&missed, &[], &[], &good());
            assert_eq!(found.iter().map(|found| found.flag).collect::<Vec<_>>(), [Flag::NoContact]);
            assert!(found[0].remark.starts_with("left pad ") && found[0].remark.contains("(needs "), "{found:?}");
            assert_eq!(flaws(found.clone(), Some("lemon")), found);
            assert_eq!(flaws(found, Some(EMPTY)), []);
        }
    }

    #[test]
    fn a_hand_that_was_closed_before_is_not_blamed_for_missing() {
        // Pressed from the beginning until the release.
        let mut closed = readings(0.0);
        closed[..125].iter_mut().for_each(|reading| reading.counts[3] = Some(1500.0));
        let of = |readings: &[Reading]| flags(readings, &[], &[], &good());
        let found = of(&closed);
        assert_eq!(found.iter().map(|found| found.flag).collect::<Vec<_>>(), [Flag::LateStart]);
        assert!(found[0].remark.starts_with("right pad was loaded (1500 counts, later 2)"), "{found:?}");
        // The line pressure says it where it is read.
        closed.iter_mut().for_each(|reading| reading.line_bar = Some(if reading.t_s < 2.5 { 0.8 } else { 0.0 }));
        assert!(of(&closed)[0].remark.starts_with("the line was at 0.80 bar"), "{:?}", of(&closed));
        // Opened, and closed once more.
        closed.iter_mut().for_each(|reading| reading.line_bar = Some(if reading.t_s < 0.4 { 0.7 } else { 0.0 }));
        assert!(of(&closed)[0].remark.starts_with("the line was at 0.70 bar"), "{:?}", of(&closed));
        // A driven hand opens first.
        assert_eq!(flags_under(Control::Driven, &closed, &[], &[], &good())[0].flag, Flag::NoContact);
        // A grasp from rest is none, with or without line pressure.
        let mut open = readings(1500.0);
        assert_eq!(of(&open), []);
        open.iter_mut().for_each(|r| r.line_bar = Some(if (0.5..2.5).contains(&r.t_s) { 1.0 } else { 0.0 }));
        assert_eq!(of(&open), []);
    }

    #[test]
    fn a_pad_at_its_end_is_saturated_only_while_it_is_pressed() {
        let found = flags(&readings(4095.0), &[], &[], &good());
        // For so long, it has failed as well.
        assert_eq!(found.iter().map(|found| found.flag).collect::<Vec<_>>(), [Flag::Saturated, Flag::SensorFault]);
        assert!(found[0].remark.contains("left pad") && found[0].remark.contains("75 %"), "{found:?}");
        let mut strip = readings(1500.0);
        strip.iter_mut().for_each(|reading| reading.counts[1] = Some(4095.0));
        assert!(flags(&strip, &[], &[], &good())[0].remark.contains("right flex strip"));
        let mut before = readings(1500.0);
        before[..12].iter_mut().for_each(|reading| reading.counts[3] = Some(4095.0));
        assert_eq!(flags(&before, &[], &[], &good()), []);
    }

    #[test]
    fn pressure_replaces_missing_phases() {
        let mut readings = readings(0.0);
        readings.iter_mut().for_each(|r| r.line_bar = Some(if (0.5..2.5).contains(&r.t_s) { 1.0 } else { 0.0 }));
        let (board, cadence) = (Board::default(), good());
        let mut observed = Observed {
            board: &board,
            readings: &readings,
            gaps: &[],
            interruptions: &[],
            cadence: &cadence,
            phases: &[],
            control: Control::Free,
            calibrations: &[],
        };
        let (rest, pressed) = observed.split();
        assert_eq!((rest.len(), pressed.len()), (25, 100));
        let phases = marks();
        observed.phases = &phases;
        assert_eq!(observed.split().1.len(), 100);
    }

    #[test]
    fn gaps_are_flagged_with_their_length() {
        let gap = |from_s, to_s, cause: &str| Gap { from_s, to_s, lost: Some(1), cause: cause.to_owned() };
        assert_eq!(flags(&readings(1500.0), &[gap(1.0, 1.04, "lost")], &[], &good()), []);
        let found = flags(&readings(1500.0), &[gap(1.0, 2.25, "the board was unplugged")], &[], &good());
        assert_eq!(found[0].flag, Flag::Interrupted);
        assert_eq!(found[0].remark, "no readings for 1.25 s from 1.00 s: the board was unplugged");
        let causes = ["the board was unplugged".to_owned(), "the port is gone".to_owned()];
        let found = flags(&readings(1500.0), &[gap(1.0, 2.25, "the board was unplugged")], &causes, &good());
        assert!(found[0].remark.ends_with("unplugged; the port is gone"), "{found:?}");
    }

    #[test]
    fn a_board_with_bad_timing_is_flagged_with_numbers() {
        let cases = [
            (Cadence { lost: 3, gaps: 1, ..good() }, "3 readings lost, 2.0 %"),
            (Cadence { rate_hz: 48.5, ..good() }, "48.50 Hz instead of 50, -3.0 %"),
            (Cadence { jitter_p95_ms: 11.0, ..good() }, "jitter 11.0 ms, limit 10.0 ms (half a period)"),
        ];
        for (cadence, want) in cases {
            let found = flags(&readings(1500.0), &[], &[], &cadence);
            assert_eq!((found.len(), found[0].flag, found[0].remark.as_str()), (1, Flag::Cadence, want));
        }
        let within = Cadence { rate_hz: 49.2, jitter_p95_ms: 9.9, ..good() };
        assert_eq!(flags(&readings(1500.0), &[], &[], &within), []);
    }

    #[test]
    fn without_readings_no_flag_is_raised() {
        assert_eq!(flags(&[], &[], &[], &Cadence::default()), []);
        let short = &readings(0.0)[..10];
        assert!(flags(short, &[], &[], &good())[0].remark.contains("before the fingers closed"));
    }

    #[test]
    fn medians_of_few_values() {
        assert_eq!(median(&mut []), None);
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), Some(2.0));
        let (middle, deviation) = middle_and_deviation(vec![10.0, 12.0, 11.0, 500.0, 10.0]).expect("five");
        assert!((middle, deviation) == (11.0, 1.4826), "{middle} {deviation}");
    }
}
