//! Conversions at the edges. Inside Palpate every quantity is SI (m, rad, N, Pa, s, kg); people and
//! instruments speak degrees, bar, millimetres, grams and counts.

/// Standard gravity (m/s²) (ISO 80000-3).
pub const STANDARD_GRAVITY: f64 = 9.80665;

/// Metres to millimetres.
pub fn mm(metres: f64) -> f64 {
    metres * 1e3
}

/// Newtons to the mass in kilograms whose weight they are ("kg of load" in data sheets).
pub fn kg_of_load(newtons: f64) -> f64 {
    newtons / STANDARD_GRAVITY
}

/// A value with at most three significant digits, as live read-outs show it: `12.3`, `0.00412`, `1230`.
///
/// Values that are not finite are shown as an en dash, never as `NaN`.
pub fn three_digits(value: f64) -> String {
    digits(value, 3)
}

/// The same with two, for estimates.
pub fn two_digits(value: f64) -> String {
    digits(value, 2)
}

fn digits(value: f64, count: u8) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let magnitude = value.abs().log10().floor();
    let decimals = (f64::from(count) - 1.0 - magnitude).clamp(0.0, 6.0) as usize;
    let text = format!("{value:.decimals$}");
    if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') {
        return "0".to_owned();
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn read_outs_have_three_digits() {
        assert_eq!(three_digits(12.345), "12.3");
        assert_eq!(three_digits(-0.0041249), "-0.00412");
        assert_eq!(three_digits(1234.5), "1234");
        assert_eq!((two_digits(0.0964), two_digits(1.304)), ("0.096".to_owned(), "1.3".to_owned()));
        assert_eq!(three_digits(0.0), "0");
        assert_eq!(three_digits(-1e-9), "0");
        assert_eq!(three_digits(f64::NAN), "–");
    }

    #[test]
    fn half_a_kilogram_of_load() {
        assert!((kg_of_load(4.903325) - 0.5).abs() < 1e-12);
        assert!((mm(0.0123) - 12.3).abs() < 1e-12);
    }
}
