//! What checks need and judge by, and the findings that they make of it.

use super::CheckStatus::NotChecked;
use super::{ChannelTrace, CheckFinding, CheckStatus, Observations};
use crate::protocol::{AdcRange, Saturation};
use crate::serial::LinkStatus;
use palpate_geometry::units::three_digits;
use palpate_tactile::board::SensorKind;

/// Counts of 4095 that an idle pad may read: 10 MΩ over 4.7 kΩ is 2.
const IDLE_COUNTS: f64 = 20.0;

/// Counts of 4095 below which a strip never reads, however it is bent.
const LEAST_OF_A_STRIP: f64 = 400.0;

/// No board has a higher supply (V).
const MOST_VOLT: f64 = 5.5;

impl CheckStatus {
    /// A finding with this status: what was seen.
    pub(super) fn seen(self, seen: impl Into<String>) -> CheckFinding {
        CheckFinding { check: "", verdict: self, seen: seen.into(), cause: None, fix: None, command: None }
    }
}

impl CheckFinding {
    /// Adds the likely cause and the remedy.
    pub(super) fn because(self, cause: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { cause: Some(cause.into()), fix: Some(fix.into()), ..self }
    }
}

/// Judges an open port.
type Judge = fn(&Evidence<'_>) -> CheckFinding;

/// What a check needs, and how it judges. Where something is missing, that is its finding: not checked.
#[derive(Clone, Copy, Debug)]
pub(super) enum Needs {
    Nothing(fn(&Observations) -> CheckFinding),
    /// An open port.
    Port(Judge),
    /// Readings for so long (s).
    Readings(f64, Judge),
    /// The same, of counts of sensors that are what they are said to be.
    Counts(f64, Judge),
}

impl Needs {
    /// The finding, without the name of its check.
    pub(super) fn judged(self, all: &Observations) -> CheckFinding {
        let (judge, seconds, counts) = match self {
            Self::Nothing(judge) => return judge(all),
            Self::Port(judge) => (judge, None, false),
            Self::Readings(seconds, judge) => (judge, Some(seconds), false),
            Self::Counts(seconds, judge) => (judge, Some(seconds), true),
        };
        let Some(seen) = Evidence::of(all) else { return NotChecked.seen("the port did not open") };
        let missing = seconds.and_then(|seconds| seen.too_short(seconds));
        match missing.or_else(|| seen.no_counts().filter(|_| counts)) {
            Some(missing) => NotChecked.seen(missing),
            None => judge(&seen),
        }
    }
}

/// An open port.
pub(super) struct Evidence<'a> {
    pub(super) all: &'a Observations,
    pub(super) link: &'a LinkStatus,
    /// Channels of sensors, in the order of the board.
    pub(super) sensors: Vec<SensorChannel<'a>>,
}

/// Channel of a sensor.
pub(super) struct SensorChannel<'a> {
    pub(super) index: usize,
    pub(super) name: &'a str,
    pub(super) is_flex: bool,
    pub(super) trace: ChannelTrace,
    pub(super) saturation: Option<Saturation>,
}

impl<'a> Evidence<'a> {
    /// None where the port did not open.
    fn of(all: &'a Observations) -> Option<Self> {
        let link = all.link.as_ref()?;
        let channel = |(index, name): (usize, &'a String)| {
            // Of a raw sensor nothing is known that its readings could contradict.
            let sensor = link.board.sensor_of(index).filter(|sensor| sensor.kind() != SensorKind::Raw)?;
            let trace = all.traces.channels.get(index).cloned().unwrap_or_default();
            let saturation = link.saturation.get(index).copied().flatten();
            Some(SensorChannel { index, name, is_flex: sensor.is_flex(), trace, saturation })
        };
        Some(Self { all, link, sensors: link.board.channels.iter().enumerate().filter_map(channel).collect() })
    }

    /// What is missing where readings did not come for so long (s).
    fn too_short(&self, seconds: f64) -> Option<String> {
        let came = self.all.traces.seconds();
        let short = || format!("readings came for {} s; {seconds} s are needed", three_digits(came));
        match self.link.cadence.samples {
            0 => Some("no readings".to_owned()),
            _ => (came < seconds).then(short),
        }
    }

    /// Reason why the values are not counts of the sensors.
    pub(super) fn no_counts(&self) -> Option<String> {
        let missing = [
            (self.sensors.is_empty(), "none of the channels is known to be a sensor"),
            (self.volts().or(self.scaled()).is_some(), "the values are not counts"),
            (self.link.adc_range == AdcRange::Exceeded, "the values exceed the converter's range"),
            (self.is_swapped(), "strips and pads are swapped"),
        ];
        missing.into_iter().find(|(is_missing, _)| *is_missing).map(|(_, what)| what.to_owned())
    }

    /// Traces of the strips, or of the pads, that have numbers.
    pub(super) fn traces(&self, flex: bool) -> impl Iterator<Item = &ChannelTrace> + Clone {
        self.sensors.iter().filter(move |own| own.is_flex == flex && own.trace.numbers > 0).map(|own| &own.trace)
    }

    /// Largest value of all sensors.
    pub(super) fn most(&self) -> f64 {
        self.sensors.iter().map(|own| own.trace.most).fold(0.0, f64::max)
    }

    /// That, where it is as small as volts, and some values are not whole.
    pub(super) fn volts(&self) -> Option<f64> {
        let (most, decimals) = (self.most(), self.sensors.iter().any(|own| own.trace.decimals));
        (decimals && most > 0.1 && most < MOST_VOLT).then_some(most)
    }

    /// Largest value of the strips, where it is below what a strip reads however it is bent.
    pub(super) fn scaled(&self) -> Option<f64> {
        let most = self.traces(true).map(|trace| trace.most).reduce(f64::max)?;
        let fits = self.link.adc_range == AdcRange::Fits && !self.is_swapped();
        (fits && most > self.idle() && most < self.least_of_a_strip()).then_some(most)
    }

    /// A strip that falls to zero, as only a pad does, and a pad that never does, as a strip.
    pub(super) fn swapped_pair(&self) -> Option<[&'a str; 2]> {
        let strip =
            self.sensors.iter().find(|own| own.is_flex && own.trace.least <= self.idle() && own.trace.moves())?;
        let of_strip = |own: &&SensorChannel<'_>| {
            !own.is_flex && own.trace.numbers > 0 && own.trace.least >= self.least_of_a_strip()
        };
        let pad = self.sensors.iter().find(of_strip)?;
        Some([strip.name, pad.name])
    }

    /// True where every pad reads as only a strip does, and every strip falls to zero, as only a pad does.
    pub(super) fn is_swapped(&self) -> bool {
        let [mut strips, mut pads] = [true, false].map(|flex| self.traces(flex).peekable());
        strips.peek().is_some()
            && pads.peek().is_some()
            && strips.all(|trace| trace.least <= self.idle() && trace.moves())
            && pads.all(|trace| trace.least >= self.least_of_a_strip())
    }

    /// Most counts of an idle pad.
    pub(super) fn idle(&self) -> f64 {
        IDLE_COUNTS * f64::from(self.link.board.full_scale) / 4095.0
    }

    /// Least counts of a strip, however it is bent.
    pub(super) fn least_of_a_strip(&self) -> f64 {
        LEAST_OF_A_STRIP * f64::from(self.link.board.full_scale) / 4095.0
    }

    /// Names of the sensors for which something holds.
    pub(super) fn named(&self, holds: impl Fn(&SensorChannel<'_>) -> bool) -> Vec<&'a str> {
        self.sensors.iter().filter(|own| holds(own)).map(|own| own.name).collect()
    }
}

impl SensorChannel<'_> {
    /// True where it is saturated at full scale.
    pub(super) fn is_high(&self) -> bool {
        self.saturation == Some(Saturation::High)
    }
}
