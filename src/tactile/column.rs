//! Names of channels with the unit that stands beside them in a file.

use crate::layout::Quantity;
use crate::unit::{KNOWN_UNITS, Unit};

/// Name of a channel whose text in a file names a unit, and the factor of its values: `pressure_left [kPa]` is
/// `pressure_left` in units of 1000 Pa. A name that says nothing of the quantity keeps the unit, as in `grip [Pa]`.
pub fn channel_with_unit(name: &str, unit: &str) -> Result<(String, f64), String> {
    let Some(known) = Unit::parse(unit) else {
        return Err(format!(
            "\"{unit}\" is not a unit that is known ({KNOWN_UNITS}); correct it, or remove the brackets to take the values as \
             they are"
        ));
    };
    match Quantity::of_name(name) {
        Some((quantity, _)) if quantity.dimension() != Some(known.dimension) => Err(format!(
            "\"{unit}\" is no unit of {}, which \"{name}\" names; its own is {}",
            quantity.name(),
            quantity.unit()
        )),
        Some(_) => Ok((name.to_owned(), known.factor)),
        None => Ok((format!("{name} [{}]", known.dimension.unit()), known.factor)),
    }
}

/// Name of a channel without its unit, and the unit of its values; empty where it is not known.
pub fn unit_of_channel(name: &str) -> (&str, &'static str) {
    if let Some((quantity, _)) = Quantity::of_name(name) {
        return (name, quantity.unit());
    }
    let named = name.strip_suffix(']').and_then(|rest| rest.rsplit_once(" ["));
    named.and_then(|(name, unit)| Some((name, Unit::parse(unit)?.dimension.unit()))).unwrap_or((name, ""))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_keep_a_unit_that_their_names_do_not_tell() {
        assert_eq!(channel_with_unit("pressure_left", "kPa"), Ok(("pressure_left".to_owned(), 1e3)));
        assert_eq!(channel_with_unit("grip", "kPa"), Ok(("grip [Pa]".to_owned(), 1e3)));
        assert!(channel_with_unit("grip", "cups").is_err_and(|text| text.contains("kgf")));
        assert!(channel_with_unit("force_left", "kPa").is_err_and(|text| text.contains("no unit of force")));
        assert_eq!(unit_of_channel("grip [Pa]"), ("grip", "Pa"));
        assert_eq!(unit_of_channel("pressure_left_distal"), ("pressure_left_distal", "Pa"));
        assert_eq!(unit_of_channel("grip [odd]"), ("grip [odd]", ""));
        assert_eq!(unit_of_channel("grip"), ("grip", ""));
    }
}
