//! Checks of the sensors: converter, wiring, movement and crosstalk.

use super::outcome::{Outcome, either, readings};
use super::{ChannelTrace, Observations};
use crate::protocol::{AdcRange, Saturation};
use crate::serial::LinkStatus;
use palpate_geometry::units::three_digits;
use palpate_tactile::board::{Board, Sensor};

/// Counts of 4095 that an idle pad may read: 10 MOhm over 4.7 kOhm is 2.
const IDLE_COUNTS: f64 = 20.0;

/// Counts of 4095 below which a strip never reads, however it is bent.
const LEAST_OF_A_STRIP: f64 = 400.0;

/// Largest count of ten bits.
const TEN_BITS: f64 = 1023.0;

/// Time of readings after which their largest count shows that the converter has ten bits (s).
const BITS_S: f64 = 5.0;

/// A channel counts as saturated after half a second (s).
const ENDS_S: f64 = 1.0;

/// No board has a higher supply (V).
const MOST_VOLT: f64 = 5.5;

/// The sensor on a channel.
fn sensor(board: &Board, channel: usize) -> Option<Sensor> {
    Sensor::ALL.into_iter().find(|sensor| board.channel_of(*sensor) == Some(channel))
}

/// Names of the channels of sensors for which something holds.
fn named(link: &LinkStatus, holds: impl Fn(usize, Sensor) -> bool) -> Vec<String> {
    let channels = link.board.channels.iter().enumerate();
    let held = channels.filter(|(channel, _)| sensor(&link.board, *channel).is_some_and(|s| holds(*channel, s)));
    held.map(|(_, name)| name.clone()).collect()
}

/// Traces of the strips, or of the pads.
fn traces<'a>(seen: &'a Observations, link: &LinkStatus, flex: bool) -> Vec<&'a ChannelTrace> {
    let of_kind = Sensor::ALL.into_iter().filter(|sensor| sensor.is_flex() == flex);
    let traces = of_kind.filter_map(|sensor| seen.traces.channels.get(link.board.channel_of(sensor)?));
    traces.filter(|trace| trace.numbers > 0).collect()
}

/// Counts of this converter for one of 4095.
fn scale(link: &LinkStatus) -> f64 {
    f64::from(link.board.full_scale) / 4095.0
}

/// Largest value of the sensors, where all are as small as volts, and not whole.
fn volts(seen: &Observations, link: &LinkStatus) -> Option<f64> {
    let all = [traces(seen, link, true), traces(seen, link, false)].concat();
    let most = all.iter().map(|trace| trace.most).fold(0.0, f64::max);
    (all.iter().any(|trace| trace.decimals) && most > 0.1 && most < MOST_VOLT).then_some(most)
}

/// True where every pad reads as only a strip does, and every strip falls to zero, as only a pad does.
fn is_swapped(seen: &Observations, link: &LinkStatus) -> bool {
    let [strips, pads] = [true, false].map(|flex| traces(seen, link, flex));
    let idle = |trace: &&ChannelTrace| trace.least <= IDLE_COUNTS * scale(link) && trace.moves();
    let bent = |trace: &&ChannelTrace| trace.least >= LEAST_OF_A_STRIP * scale(link);
    !strips.is_empty() && !pads.is_empty() && strips.iter().all(idle) && pads.iter().all(bent)
}

/// Readings of the sensors for so long (s), of values that are counts of the sensors they are said to be.
fn sensed(seen: &Observations, seconds: f64) -> Result<&LinkStatus, Outcome> {
    let link = readings(seen, seconds)?;
    if named(link, |_, _| true).is_empty() {
        return Err(Outcome::not_checked("none of the channels is known to be a sensor"));
    }
    if volts(seen, link).is_some() {
        return Err(Outcome::not_checked("the values are not counts"));
    }
    if is_swapped(seen, link) {
        return Err(Outcome::not_checked("strips and pads are swapped"));
    }
    Ok(link)
}

pub(super) fn sensors(seen: &Observations) -> Outcome {
    either(readings(seen, 0.0).map(|link| {
        let (found, channels) = (named(link, |_, _| true), link.board.channels.join(", "));
        if found.is_empty() {
            return Outcome::failed(format!("none of flexL, flexR, fsrL and fsrR, but {channels}")).because(
                "Their names are unknown, or they are columns without a header, of which there are not four",
                "Name them in the sketch, as in flexL:512,flexR:498,fsrL:30,fsrR:28, or print a header line flexL,flexR,fsrL,fsrR",
            );
        }
        if is_swapped(seen, link) {
            return Outcome::failed("strips read as pads do, and pads as strips do").because(
                "The columns, or the wires, are in another order",
                "Print a header line with the names of the columns, or exchange the wires",
            );
        }
        let missing = Sensor::ALL.into_iter().filter(|sensor| link.board.channel_of(*sensor).is_none());
        let missing: Vec<&str> = missing.map(Sensor::channel).collect();
        if missing.is_empty() {
            return Outcome::passed(format!("{} of {channels}", link.cadence.samples));
        }
        Outcome::note(format!("no {}, but {channels}", missing.join(", ")))
            .because("The board has fewer sensors, or names them otherwise", "Name them as the firmware does")
    }))
}

pub(super) fn bits(seen: &Observations) -> Outcome {
    let outcome = readings(seen, 0.0).and_then(|link| {
        if let Some(most) = volts(seen, link) {
            return Ok(Outcome::failed(format!("no value above {}, with decimals", three_digits(most)))
                .because("The sketch prints volts", "Print the counts of analogRead() instead"));
        }
        Ok(bits_of(seen, sensed(seen, 0.0)?))
    });
    either(outcome)
}

fn bits_of(seen: &Observations, link: &LinkStatus) -> Outcome {
    let (full, stated) = (link.board.full_scale, link.board.firmware.is_some());
    let all = [traces(seen, link, true), traces(seen, link, false)].concat();
    let most = all.iter().map(|trace| trace.most).fold(0.0, f64::max);
    let watched = seen.traces.seconds();
    match link.adc_range {
        AdcRange::Exceeded => Outcome::failed(format!("counts exceed {full}")).because(
            if stated {
                "The converter has more bits than the handshake states"
            } else {
                "The converter has more than the assumed 12 bits"
            },
            "State its bits in the handshake, as in adc=16",
        ),
        AdcRange::LooksTenBit => {
            let assumed = if stated { "the handshake states" } else { "assumed:" };
            Outcome::failed(format!("no count above {most:.0}; {assumed} a range of {full}")).because(
                "analogRead gives 10 bits by default",
                "Call analogReadResolution(12) in setup(), or state adc=10 in the handshake",
            )
        }
        AdcRange::Fits if full < 4095 => Outcome::note(format!("the converter's range is {full}")).because(
            "The handshake states it",
            "A Due has 12 bits: call analogReadResolution(12), and state adc=12 in the handshake",
        ),
        AdcRange::Fits if most > TEN_BITS => Outcome::passed(format!("counts up to {most:.0} of {full}")),
        AdcRange::Fits if watched < BITS_S => Outcome::not_checked(format!(
            "no count above {most:.0} in {} s; {BITS_S} s are needed",
            three_digits(watched)
        )),
        AdcRange::Fits => Outcome::skipped(format!("no count above {most:.0}, which ten bits would give as well")),
    }
}

fn saturation_of(link: &LinkStatus, channel: usize) -> Option<Saturation> {
    link.saturation.get(channel).copied().flatten()
}

fn is_high(link: &LinkStatus, channel: usize) -> bool {
    saturation_of(link, channel) == Some(Saturation::High)
}

pub(super) fn saturation(seen: &Observations) -> Outcome {
    either(sensed(seen, ENDS_S).map(|link| {
        // A strip at the upper end has come off, which is the next check's finding.
        let high = named(link, |channel, sensor| is_high(link, channel) && !sensor.is_flex());
        if !high.is_empty() {
            return Outcome::failed(format!("{} saturated for more than half a second", high.join(", "))).because(
                "The divider is on 5 V, which damages a Due; or the pad is shorted; or its resistor to ground is missing or \
                 far too large",
                "Unplug and measure: the divider belongs on 3.3 V, with 4.7 kOhm from the pin to ground",
            );
        }
        match traces(seen, link, false).iter().map(|trace| trace.most).reduce(f64::max) {
            Some(most) => Outcome::passed(format!("no pad above {most:.0} of {}", link.board.full_scale)),
            None => Outcome::skipped("no pads"),
        }
    }))
}

pub(super) fn open_circuit(seen: &Observations) -> Outcome {
    either(sensed(seen, ENDS_S).map(|link| {
        let trace = |channel: usize| seen.traces.channels.get(channel).cloned().unwrap_or_default();
        let without = named(link, |channel, _| trace(channel).without > trace(channel).numbers);
        let off = named(link, |channel, sensor| sensor.is_flex() && is_high(link, channel));
        let shorted = named(link, |channel, s| s.is_flex() && saturation_of(link, channel) == Some(Saturation::Low));
        if !off.is_empty() {
            return Outcome::failed(format!("{} at full scale", off.join(", "))).because(
                "The strip is disconnected: nothing pulls the pin to ground",
                "Check the strip's crimp, which is brittle, and its wire to ground",
            );
        }
        if !without.is_empty() {
            return Outcome::failed(format!("{} without a number in most lines", without.join(", "))).because(
                "The sketch has no value to print: the sensor is disconnected",
                "Check the plug and the wires of that sensor; the other channels keep working",
            );
        }
        if !shorted.is_empty() {
            return Outcome::failed(format!("{} at zero", shorted.join(", "))).because(
                "The pin is shorted to ground, or the resistor to 3.3 V is missing",
                "Measure 47 kOhm from 3.3 V to the pin, and 17 to 70 kOhm from the pin to ground",
            );
        }
        let idle = IDLE_COUNTS * scale(link);
        let idle = named(link, |channel, sensor| !sensor.is_flex() && trace(channel).most <= idle);
        if idle.is_empty() {
            return Outcome::passed("every strip is within its range, every pad was pressed");
        }
        Outcome::not_checked(format!("{} never pressed", idle.join(", ")))
            .because("An untouched pad reads zero, and so does a disconnected one", "Press each pad during the check")
    }))
}

pub(super) fn movement(seen: &Observations) -> Outcome {
    either(sensed(seen, ENDS_S).map(|link| {
        let trace = |channel: usize| seen.traces.channels.get(channel).cloned().unwrap_or_default();
        // Ends of the range and idle pads are other checks'.
        let shows = |channel: usize, sensor: Sensor| match saturation_of(link, channel) {
            Some(_) => false,
            None => sensor.is_flex() || trace(channel).most > IDLE_COUNTS * scale(link),
        };
        let stuck = |channel: usize| Some((&link.board.channels[channel], seen.traces.stuck(channel)?));
        let looked_at = |channel: &usize| sensor(&link.board, *channel).is_some_and(|s| shows(*channel, s));
        let stuck = (0..link.board.channels.len()).filter(looked_at).find_map(stuck);
        if let Some((name, [count, lasted])) = stuck {
            let lasted = three_digits(lasted);
            return Outcome::failed(format!("{name} stays at {count} for {lasted} s while others move")).because(
                "The sketch prints an old value or reads another pin, or the sensor is not wired to that pin",
                "Compare the sketch's pin with the wiring, and measure the pin while the finger is bent",
            );
        }
        let strips = named(link, |channel, s| s.is_flex() && shows(channel, s) && trace(channel).numbers > 0);
        let still = named(link, |channel, s| s.is_flex() && shows(channel, s) && !trace(channel).moves());
        let range = traces(seen, link, true).into_iter().map(|trace| format!("{:.0}", trace.range()));
        let range = range.collect::<Vec<_>>().join(" and ");
        if still.is_empty() && !strips.is_empty() {
            return Outcome::passed(format!("{} moved by {range} counts", strips.join(" and ")));
        }
        let any = seen.traces.channels.iter().any(ChannelTrace::moves);
        let what = if any { format!("{} did not move", still.join(", ")) } else { "nothing moved".to_owned() };
        Outcome::not_checked(what).because(
            "A strip that is not bent looks like one that is not connected to its finger",
            "Bend each finger during the check",
        )
    }))
}

pub(super) fn crosstalk(seen: &Observations) -> Outcome {
    let outcome = sensed(seen, ENDS_S).map(|link| {
        let pads = (1..link.board.channels.len()).filter(|channel| {
            // A saturated channel hides crosstalk in both directions.
            let saturated = |channel: usize| is_high(link, channel);
            sensor(&link.board, *channel).is_some_and(|sensor| !sensor.is_flex())
                && !saturated(*channel)
                && !saturated(channel - 1)
        });
        let found = pads.filter_map(|channel| bleeding(seen, link, channel));
        let found = found.max_by_key(|outcome| outcome.verdict);
        found.unwrap_or_else(|| Outcome::not_checked("no pad is read after a channel that has counts"))
    });
    either(outcome)
}

/// Finding for a pad and the channel before it, where that has counts: the pad reads zero beside it, or may follow it.
fn bleeding(seen: &Observations, link: &LinkStatus, channel: usize) -> Option<Outcome> {
    let [trace, source] = [channel, channel - 1].map(|channel| seen.traces.channels.get(channel));
    let (trace, source, idle) = (trace?, source?, IDLE_COUNTS * scale(link));
    if trace.numbers == 0 {
        return None;
    }
    let (name, before) = (&link.board.channels[channel], &link.board.channels[channel - 1]);
    let least = trace.least;
    if least <= idle {
        let evidence = source.numbers > 0 && source.least >= LEAST_OF_A_STRIP * scale(link);
        return evidence.then(|| {
            Outcome::passed(format!(
                "{name} reads {least:.0} beside {before}, which is never below {:.0}",
                source.least
            ))
        });
    }
    if let Some(share) = trace.takes().filter(|share| (0.01..1.0).contains(share)) {
        let percent = 100.0 * share;
        let seen = format!("{name} follows {before} by {percent:.0} %, and is never below {least:.0} counts");
        return Some(Outcome::failed(seen).because(
            "The converter's multiplexer does not settle behind the high resistance of the divider",
            "Solder 100 nF from each pin to ground, and discard the first conversion of each channel, as our firmware does",
        ));
    }
    Some(Outcome::note(format!("{name} is never below {least:.0} counts")).because(
        format!("Something presses the pad all the time, or {before} bleeds into it"),
        "Move one sensor after the other: that says which",
    ))
}
