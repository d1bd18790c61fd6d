//! Checks of the sensors: converter, wiring, movement and crosstalk.

use super::CheckStatus::{Failed, NotChecked, Note, Passed, Skipped};
use super::evidence::{Evidence, SensorChannel};
use super::{ChannelTrace, CheckFinding};
use crate::protocol::{AdcRange, Saturation};
use palpate_geometry::units::three_digits;
use palpate_tactile::board::Sensor;

/// Spikes from which on a contact is loose.
const FEWEST_SPIKES: u64 = 3;

/// Largest count of ten bits.
const TEN_BITS: f64 = 1023.0;

/// Largest count of the widest converter that is usual on a board, of 16 bits.
const MOST_COUNTS: f64 = 65_535.0;

/// Time of readings after which their largest count shows that the converter has ten bits (s).
const BITS_S: f64 = 5.0;

pub(super) fn sensors(seen: &Evidence<'_>) -> CheckFinding {
    let (board, channels) = (&seen.link.board, seen.link.board.channels.join(", "));
    if seen.sensors.is_empty() {
        let names: Vec<&str> = board.sensors.iter().map(Sensor::channel).collect();
        let (last, others) = names.split_last().map_or(("", &names[..]), |(last, others)| (*last, others));
        let values: Vec<String> =
            names.iter().zip([512, 498, 30, 28]).map(|(name, count)| format!("{name}:{count}")).collect();
        return Failed.seen(format!("none of {} and {last}, but {channels}", others.join(", "))).because(
            columns(&seen.all.traces.channels, board.sensors.len()),
            format!("Name them in the sketch, as in {}, or print a header line {}", values.join(","), names.join(",")),
        );
    }
    if seen.is_swapped() {
        return Failed.seen("strips read as pads do, and pads as strips do").because(
            "The columns, or the wires, are in another order",
            "Print a header line with the names of the columns, or exchange the wires",
        );
    }
    if let Some([strip, pad]) = seen.swapped_pair() {
        return Failed
            .seen(format!("{strip} falls to zero, as only a pad does, and {pad} reads as a strip does"))
            .because(
                "The two are swapped, in the sketch or in the wiring",
                "Exchange their names in the sketch, or their wires",
            );
    }
    let missing = board.sensors.iter().filter(|sensor| board.channel_of(*sensor).is_none());
    let missing: Vec<&str> = missing.map(Sensor::channel).collect();
    if missing.is_empty() {
        return Passed.seen(format!("{} of {channels}", seen.link.cadence.samples));
    }
    Note.seen(format!("no {}, but {channels}", missing.join(", ")))
        .because("The board has fewer sensors, or names them otherwise", "Name them as the gripper file does")
}

/// What the columns are that have no name of a sensor.
fn columns(traces: &[ChannelTrace], sensors: usize) -> String {
    let is_digit = |trace: &ChannelTrace| trace.least >= 0.0 && trace.most <= 9.0 && !trace.decimals;
    let many = if sensors == 4 { "four".to_owned() } else { sensors.to_string() };
    match traces {
        [first, others @ ..] if others.len() == sensors && first.rises && first.numbers > 2 => {
            format!("The first column rises from line to line, as a time does: the {many} others are the sensors")
        }
        _ if traces.len() >= 4 && traces.iter().skip(1).step_by(2).all(is_digit) => {
            "Every second column is a single digit: numbers with decimal commas".to_owned()
        }
        _ => format!("Their names are unknown, or they are columns without a header, of which there are not {many}"),
    }
}

pub(super) fn bits(seen: &Evidence<'_>) -> CheckFinding {
    if let Some(most) = seen.volts() {
        return Failed
            .seen(format!("no value above {}, with decimals", three_digits(most)))
            .because("The sketch prints volts, or shares of the range", "Print the counts of analogRead() instead");
    }
    let (full, stated, most) = (seen.link.board.full_scale, seen.link.board.firmware.is_some(), seen.most());
    if let Some(most) = seen.scaled() {
        return Failed.seen(format!("no strip above {most:.0} of {full}")).because(
            "The sketch scales the values, to 8 bits or percent: counts of a strip never fall so low",
            "Print the counts of analogRead() as they are, after analogReadResolution(12)",
        );
    }
    if most > MOST_COUNTS && seen.link.adc_range == AdcRange::Exceeded {
        return Failed.seen(format!("values up to {most:.0}, which no usual converter has")).because(
            "The sketch prints computed values, such as ohms",
            "Print the counts of analogRead() instead; a wider converter states its bits in the handshake",
        );
    }
    if let Some(missing) = seen.no_counts().filter(|_| seen.link.adc_range != AdcRange::Exceeded) {
        return NotChecked.seen(missing);
    }
    if let Some(own) = seen.sensors.iter().find(|own| own.trace.numbers > 0 && own.trace.least < 0.0) {
        return Failed.seen(format!("{} reads down to {:.0}", own.name, own.trace.least)).because(
            "Counts are never negative: the sketch subtracts a zero, or prints a negative number for a fault",
            "Print the counts of analogRead() as they are",
        );
    }
    let watched = seen.all.traces.seconds();
    match seen.link.adc_range {
        AdcRange::Exceeded => Failed.seen(format!("counts exceed {full}")).because(
            format!(
                "The converter has more {}",
                if stated { "bits than the handshake states" } else { "than the assumed 12 bits" }
            ),
            "State its bits in the handshake, as in adc=16",
        ),
        AdcRange::LooksTenBit => {
            let assumed = if stated { "the handshake states" } else { "assumed:" };
            Failed.seen(format!("no count above {most:.0}; {assumed} a range of {full}")).because(
                "analogRead gives 10 bits by default",
                "Call analogReadResolution(12) in setup(), or state adc=10 in the handshake",
            )
        }
        AdcRange::Fits if full < 4095 => Note.seen(format!("the converter's range is {full}")).because(
            "The handshake states it",
            "A Due has 12 bits: call analogReadResolution(12), and state adc=12 in the handshake",
        ),
        AdcRange::Fits if most > TEN_BITS => Passed.seen(format!("counts up to {most:.0} of {full}")),
        AdcRange::Fits if watched < BITS_S => {
            let watched = three_digits(watched);
            NotChecked.seen(format!("no count above {most:.0} in {watched} s; {BITS_S} s are needed"))
        }
        AdcRange::Fits => Skipped.seen(format!("no count above {most:.0}, which ten bits would give as well")),
    }
}

pub(super) fn saturation(seen: &Evidence<'_>) -> CheckFinding {
    // A strip at the upper end has come off, which is the next check's finding.
    let high = seen.named(|own| own.is_high() && !own.is_flex);
    if !high.is_empty() {
        return Failed.seen(format!("{} saturated for more than half a second", high.join(", "))).because(
            "The divider is on 5 V, which damages a Due; or the pad is shorted; or its resistor to ground is missing or far too \
             large",
            "Unplug and measure: the divider belongs on 3.3 V, with 4.7 kΩ from the pin to ground",
        );
    }
    match seen.traces(false).map(|trace| trace.most).reduce(f64::max) {
        Some(most) => Passed.seen(format!("no pad above {most:.0} of {}", seen.link.board.full_scale)),
        None => Skipped.seen("no pads"),
    }
}

pub(super) fn open_circuit(seen: &Evidence<'_>) -> CheckFinding {
    for (names, what, cause, fix) in [
        (
            seen.named(|own| own.is_flex && own.is_high()),
            "at full scale",
            "The strip is disconnected: nothing pulls the pin to ground",
            "Check the strip's crimp, which is brittle, and its wire to ground",
        ),
        (
            seen.named(|own| own.trace.without > own.trace.numbers),
            "without a number in most lines",
            "The sketch has no value to print: the sensor is disconnected",
            "Check the plug and the wires of that sensor; the other channels keep working",
        ),
        (
            seen.named(|own| own.is_flex && own.saturation == Some(Saturation::Low)),
            "at zero",
            "The pin is shorted to ground, or the resistor to 3.3 V is missing",
            "Measure 47 kΩ from 3.3 V to the pin, and 17 to 70 kΩ from the pin to ground",
        ),
    ] {
        if !names.is_empty() {
            return Failed.seen(format!("{} {what}", names.join(", "))).because(cause, fix);
        }
    }
    let spikes = seen.named(|own| own.trace.spikes >= FEWEST_SPIKES);
    if !spikes.is_empty() {
        let many = seen.sensors.iter().map(|own| own.trace.spikes).max().unwrap_or(0);
        return Failed
            .seen(format!("{} jumps there and back within two readings, {many} times", spikes.join(", ")))
            .because(
                "A loose contact, or a pin that nothing is connected to",
                "Move the plug and the wires of that sensor while you watch its curve; crimp or solder what is loose",
            );
    }
    let gappy = seen
        .sensors
        .iter()
        .filter(|own| own.trace.without > 0)
        .map(|own| format!("{} ({})", own.name, own.trace.without));
    let gappy: Vec<String> = gappy.collect();
    if !gappy.is_empty() {
        return Note.seen(format!("lines without a number: {}", gappy.join(", "))).because(
            "The sketch had no value to print, or printed a word such as nan",
            "Check the plug of that sensor; the readings are gaps",
        );
    }
    let idle = seen.named(|own| !own.is_flex && own.trace.most <= seen.idle());
    if idle.is_empty() {
        return Passed.seen("every strip is within its range, every pad was pressed");
    }
    NotChecked
        .seen(format!("{} never pressed", idle.join(", ")))
        .because("An untouched pad reads zero, and so does a disconnected one", "Press each pad during the check")
}

pub(super) fn movement(seen: &Evidence<'_>) -> CheckFinding {
    // Ends of the range and idle pads are other checks'.
    let shows = |own: &&SensorChannel<'_>| own.saturation.is_none() && (own.is_flex || own.trace.most > seen.idle());
    let mut stuck = seen.sensors.iter().filter(shows).filter_map(|own| Some((own, seen.all.traces.stuck(own.index)?)));
    if let Some((SensorChannel { name, .. }, [count, lasted])) = stuck.next() {
        let lasted = three_digits(lasted);
        return Failed.seen(format!("{name} stays at {count} for {lasted} s while others move")).because(
            "The sketch prints an old value or reads another pin, or the sensor is not wired to that pin",
            "Compare the sketch's pin with the wiring, and measure the pin while the finger is bent",
        );
    }
    if seen.traces(true).next().is_none() {
        return Skipped.seen("no strips");
    }
    let strips = seen.named(|own| own.is_flex && shows(&own) && own.trace.numbers > 0);
    let still = seen.named(|own| own.is_flex && shows(&own) && !own.trace.moves());
    if still.is_empty() && !strips.is_empty() {
        let moved = seen.sensors.iter().filter(|own| own.is_flex && shows(own) && own.trace.numbers > 0);
        let range: Vec<String> = moved.map(|own| format!("{:.0}", own.trace.range())).collect();
        return Passed.seen(format!("{} moved by {} counts", strips.join(" and "), range.join(" and ")));
    }
    let any = seen.all.traces.channels.iter().any(ChannelTrace::moves);
    let what = if any { format!("{} did not move", still.join(", ")) } else { "nothing moved".to_owned() };
    NotChecked.seen(what).because(
        "A strip that is not bent looks like one that is not connected to its finger",
        "Bend each finger during the check",
    )
}

pub(super) fn crosstalk(seen: &Evidence<'_>) -> CheckFinding {
    let pads = seen.sensors.iter().filter(|own| !own.is_flex && own.trace.numbers > 0);
    let found = pads.filter_map(|pad| bleeding(seen, pad)).max_by_key(|finding| finding.verdict);
    found.unwrap_or_else(|| NotChecked.seen("no pad is read after a channel that has counts"))
}

/// Finding for a pad and the channel before it, where that has counts: the pad reads zero beside it, or may follow it.
fn bleeding(seen: &Evidence<'_>, pad: &SensorChannel<'_>) -> Option<CheckFinding> {
    let index = pad.index.checked_sub(1)?;
    let (name, before, source) = (pad.name, &seen.link.board.channels[index], seen.all.traces.channels.get(index)?);
    let is_high = |channel: usize| seen.link.saturation.get(channel) == Some(&Some(Saturation::High));
    // A saturated channel hides crosstalk in both directions.
    if is_high(index) || is_high(pad.index) {
        return None;
    }
    let least = pad.trace.least;
    if least <= seen.idle() {
        let evidence = source.numbers > 0 && source.least >= seen.least_of_a_strip();
        let beside = || format!("{name} reads {least:.0} beside {before}, which is never below {:.0}", source.least);
        return evidence.then(|| Passed.seen(beside()));
    }
    if let Some(share) = pad.trace.takes().filter(|share| (0.01..1.0).contains(share)) {
        let percent = 100.0 * share;
        let follows = format!("{name} follows {before} by {percent:.0} %, and is never below {least:.0} counts");
        return Some(Failed.seen(follows).because(
            "The converter's multiplexer does not settle behind the high resistance of the divider",
            "Solder 100 nF from each pin to ground, and discard the first conversion of each channel, as our firmware does",
        ));
    }
    Some(Note.seen(format!("{name} is never below {least:.0} counts")).because(
        format!("Something presses the pad all the time, or {before} bleeds into it"),
        "Move one sensor after the other: that says which",
    ))
}
