//! Units that people write beside a reading, and their factors to the units that Palpate computes in.

use palpate_geometry::units::STANDARD_GRAVITY;

/// Kind of quantity that a unit measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    Time,
    Force,
    Pressure,
    Curvature,
    Angle,
    Voltage,
    Current,
    Length,
    Acceleration,
    /// Steps of a converter.
    Counts,
}

impl Dimension {
    /// The unit in which values are kept.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Time => "s",
            Self::Force => "N",
            Self::Pressure => "Pa",
            Self::Curvature => "1/m",
            Self::Angle => "rad",
            Self::Voltage => "V",
            Self::Current => "A",
            Self::Length => "m",
            Self::Acceleration => "m/s2",
            Self::Counts => "counts",
        }
    }
}

/// A unit by its dimension and its factor to the unit of that dimension.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// What it measures.
    pub dimension: Dimension,
    /// Its size in the dimension's own unit.
    pub factor: f64,
}

/// Units with their factors. Those marked also take prefixes, as in `kPa`.
const UNITS: &[(&str, Dimension, f64, bool)] = &[
    ("s", Dimension::Time, 1.0, true),
    ("sec", Dimension::Time, 1.0, false),
    ("second", Dimension::Time, 1.0, false),
    ("seconds", Dimension::Time, 1.0, false),
    ("min", Dimension::Time, 60.0, false),
    ("N", Dimension::Force, 1.0, true),
    ("gf", Dimension::Force, 1e-3 * STANDARD_GRAVITY, false),
    ("kgf", Dimension::Force, STANDARD_GRAVITY, false),
    ("lbf", Dimension::Force, 4.448_221_615_260_5, false),
    ("Pa", Dimension::Pressure, 1.0, true),
    ("N/m2", Dimension::Pressure, 1.0, false),
    ("N/cm2", Dimension::Pressure, 1e4, false),
    ("N/mm2", Dimension::Pressure, 1e6, false),
    ("bar", Dimension::Pressure, 1e5, true),
    ("psi", Dimension::Pressure, 6_894.757_293_168_361, false),
    ("1/m", Dimension::Curvature, 1.0, false),
    ("1/km", Dimension::Curvature, 1e-3, false),
    ("1/cm", Dimension::Curvature, 1e2, false),
    ("1/mm", Dimension::Curvature, 1e3, false),
    ("rad", Dimension::Angle, 1.0, true),
    ("deg", Dimension::Angle, std::f64::consts::PI / 180.0, false),
    ("°", Dimension::Angle, std::f64::consts::PI / 180.0, false),
    ("degrees", Dimension::Angle, std::f64::consts::PI / 180.0, false),
    ("V", Dimension::Voltage, 1.0, true),
    ("A", Dimension::Current, 1.0, true),
    ("m", Dimension::Length, 1.0, true),
    ("cm", Dimension::Length, 1e-2, false),
    ("m/s2", Dimension::Acceleration, 1.0, false),
    ("counts", Dimension::Counts, 1.0, false),
    ("count", Dimension::Counts, 1.0, false),
    ("lsb", Dimension::Counts, 1.0, false),
];

/// Prefixes of units (SI brochure, 9th edition, table 7).
const PREFIXES: &[(&str, f64)] =
    &[("", 1.0), ("n", 1e-9), ("µ", 1e-6), ("u", 1e-6), ("m", 1e-3), ("h", 1e2), ("k", 1e3), ("M", 1e6)];

/// Units in words, for errors and help.
pub const KNOWN_UNITS: &str = "s, ms, us, ns; N, mN, gf, kgf, lbf; Pa, hPa, kPa, MPa, N/cm2, mbar, bar, psi; 1/m, 1/cm, 1/mm; rad, deg; V, mV; A, mA; m, cm, mm; m/s2; counts";

impl Unit {
    /// The unit of a text such as `kPa` or `m^-1`; none where it is not known. Capitals matter only where two units would
    /// differ by nothing else.
    pub fn parse(text: &str) -> Option<Self> {
        let text: String = text.trim().replace('μ', "µ").replace("^2", "2").replace('²', "2");
        let text = ["^-1", "⁻¹", "-1"]
            .iter()
            .find_map(|power| text.strip_suffix(power))
            .map_or_else(|| text.clone(), |base| if base.ends_with('m') { format!("1/{base}") } else { text.clone() });
        let all = UNITS.iter().flat_map(|(symbol, dimension, factor, prefixed)| {
            let prefixes = if *prefixed { PREFIXES } else { &PREFIXES[..1] };
            let of = move |(prefix, times): &(&str, f64)| {
                (format!("{prefix}{symbol}"), Self { dimension: *dimension, factor: factor * times })
            };
            prefixes.iter().map(of)
        });
        let alike: Vec<(String, Self)> = all.filter(|(symbol, _)| symbol.eq_ignore_ascii_case(&text)).collect();
        let exact = alike.iter().find(|(symbol, _)| *symbol == text);
        let only = || alike.first().filter(|first| alike.iter().all(|other| other.1 == first.1));
        exact.or_else(only).map(|(_, unit)| *unit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_known_by_any_of_their_spellings() {
        let cases = [
            ("kPa", Dimension::Pressure, 1e3),
            ("KPA", Dimension::Pressure, 1e3),
            ("MPa", Dimension::Pressure, 1e6),
            ("hPa", Dimension::Pressure, 1e2),
            ("mbar", Dimension::Pressure, 1e2),
            ("N/cm²", Dimension::Pressure, 1e4),
            ("mN", Dimension::Force, 1e-3),
            ("gf", Dimension::Force, 9.80665e-3),
            ("µs", Dimension::Time, 1e-6),
            ("us", Dimension::Time, 1e-6),
            ("ns", Dimension::Time, 1e-9),
            ("1/mm", Dimension::Curvature, 1e3),
            ("m^-1", Dimension::Curvature, 1.0),
            ("mm⁻¹", Dimension::Curvature, 1e3),
            ("deg", Dimension::Angle, 1f64.to_radians()),
            ("mV", Dimension::Voltage, 1e-3),
            ("Counts", Dimension::Counts, 1.0),
        ];
        for (text, dimension, factor) in cases {
            let unit = Unit::parse(text).unwrap_or_else(|| panic!("{text}"));
            assert_eq!(unit.dimension, dimension, "{text}");
            assert!((unit.factor / factor - 1.0).abs() < 1e-12, "{text}: {}", unit.factor);
        }
        // A pound per square inch is 4.4482216152605 N on 0.0254 m squared.
        let psi = Unit::parse("psi").expect("known").factor;
        assert!((psi - 4.448_221_615_260_5 / (0.0254 * 0.0254)).abs() < 1e-9);
        // "mpa" is a million or a thousandth.
        for text in ["", "mpa", "furlong", "kbaar", "s-1", "-1", "Pam", "1/s"] {
            assert_eq!(Unit::parse(text), None, "{text}");
        }
    }
}
