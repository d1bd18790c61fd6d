//! Why points make no calibration: what is wrong, the likely cause, and what to do.

use palpate_geometry::units::three_digits as digits;

/// What is wrong with a calibration.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Fault {
    /// A divider that cannot be.
    #[error(
        "a divider of {ohm} ohm at {volt} V is not possible; give the fixed resistor in ohm, such as 47000 beside a flex \
         strip and 4700 beside a pad"
    )]
    Divider {
        /// Its resistor (ohm).
        ohm: f64,
        /// Its reference (V).
        volt: f64,
    },
    /// Fewer points than the curve needs.
    #[error("{have} of at least {need} {what}: take {more}")]
    TooFew {
        /// How many there are.
        have: usize,
        /// How many are needed.
        need: usize,
        /// What is counted.
        what: &'static str,
        /// What to do.
        more: &'static str,
    },
    /// Points that hardly differ.
    #[error("the {kind} was only tried from {from} to {to}: {wanted}")]
    TooClose {
        /// What is calibrated.
        kind: &'static str,
        /// The smallest stimulus.
        from: String,
        /// The largest.
        to: String,
        /// What would do.
        wanted: &'static str,
    },
    /// An angle or weight that the sensor is not made for.
    #[error("{at} is outside what a {kind} is calibrated for: take 0 to {most}")]
    OutOfRange {
        /// The stimulus.
        at: String,
        /// The most that is possible.
        most: String,
        /// What is calibrated.
        kind: &'static str,
    },
    /// A reading that no converter gives.
    #[error("{counts} is not a reading of a converter that counts to {full_scale} (at {at})")]
    NotCounts {
        /// The stimulus.
        at: String,
        /// What was read (counts).
        counts: f64,
        /// Its largest count.
        full_scale: u32,
    },
    /// A strip that carries no current.
    #[error(
        "at {at} the strip reads {counts:.0} counts, the end of the range: its circuit is open. Check the solder tabs and \
         the plug; a strip's crimp breaks when it is bent where the cable begins"
    )]
    OpenCircuit {
        /// The stimulus.
        at: String,
        /// What was read (counts).
        counts: f64,
    },
    /// A strip without resistance.
    #[error("at {at} the strip reads {counts:.0} counts: it is short-circuited, or its pin is connected to ground")]
    ShortCircuit {
        /// The stimulus.
        at: String,
        /// What was read (counts).
        counts: f64,
    },
    /// A pad at the end of the converter's range.
    #[error(
        "at {at} the pad reads {counts:.0} counts, the end of the range: with {} kOhm in its divider it saturates. Take \
         smaller weights, or a smaller resistor (3.3 kOhm)", digits(resistor_ohm * 1e-3)
    )]
    Saturated {
        /// The stimulus.
        at: String,
        /// What was read (counts).
        counts: f64,
        /// The divider's resistor (ohm).
        resistor_ohm: f64,
    },
    /// A reading that falls where it should rise.
    #[error("between {from} and {to} the {what} falls from {falls}, but it must rise: {likely}")]
    NotMonotone {
        /// The stimulus before.
        from: String,
        /// The stimulus after.
        to: String,
        /// What should rise.
        what: &'static str,
        /// Its values, as in `3 kOhm to 2 kOhm`.
        falls: String,
        /// The likely cause, and what to do.
        likely: &'static str,
    },
    /// A flat resistance that no part of this kind has.
    #[error(
        "the flat strip comes out at {} kOhm, but such parts have 17.5 to 32.5: {hint}", digits(flat_ohm * 1e-3)
    )]
    FlatResistance {
        /// What came out (ohm).
        flat_ohm: f64,
        /// What may be the matter.
        hint: String,
    },
    /// A rise with the angle that no part of this kind has.
    #[error(
        "bent by 90 degrees the strip comes out at {} times its flat resistance, but such parts rise to 1.5 to 3.5 times: \
         {hint}", digits(*ratio)
    )]
    BentResistance {
        /// What came out.
        ratio: f64,
        /// What may be the matter.
        hint: String,
    },
    /// A pad's conductance that no part of this kind has.
    #[error("under 1 N the pad comes out at {} kOhm, but such parts have about 6 (1.5 to 25): {hint}", digits(ohm * 1e-3))]
    PadResistance {
        /// What came out (ohm).
        ohm: f64,
        /// What may be the matter.
        hint: String,
    },
    /// A curve of a pad that no part of this kind has.
    #[error(
        "the pad's conductance grows with the power {} of the force, but such parts have 0.6 to 1.2: weights that rest \
         partly beside the pad do this. Put a small stiff disc between, and the weight on its middle", digits(*exponent)
    )]
    Exponent {
        /// What came out.
        exponent: f64,
    },
    /// A point far from the curve through the others.
    #[error("{at} is {off} off the curve through the others: take it again")]
    Outlier {
        /// The stimulus.
        at: String,
        /// How far it is off.
        off: String,
    },
    /// A calibration of one kind for a sensor of the other.
    #[error("\"{part}\" is calibrated as a {made}, but the {place} is a {wanted}")]
    WrongKind {
        /// The part.
        part: String,
        /// What it was calibrated as.
        made: &'static str,
        /// Where it is to be used.
        place: &'static str,
        /// What that is.
        wanted: &'static str,
    },
    /// Points of bending for something that is not a pad.
    #[error("only a pad has a zero that moves with the bending of its finger")]
    NoBending,
    /// A pad's zero over bending is wanted, but the strip that says how far the finger bends is not calibrated.
    #[error("how far the finger bends is read by the {strip}, which is not calibrated: do that first")]
    NoStrip {
        /// Which strip.
        strip: &'static str,
    },
    /// Points of bending that tell nothing.
    #[error(
        "the empty close has {have} usable readings over {} 1/m of curvature: it must go to at least 5 1/m with the \
         finger's flex strip calibrated, and not touch anything", digits(*span)
    )]
    BendingTooShort {
        /// Usable readings.
        have: usize,
        /// Curvature that they span (1/m).
        span: f64,
    },
    /// A part without a name.
    #[error(
        "the part needs a name, such as the number on its tail: calibrations belong to parts, and parts get swapped"
    )]
    NoName,
}
