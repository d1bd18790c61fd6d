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

/// Space between a number and its unit: it is seen, and no line ends there.
pub const SPACE: char = '\u{a0}';

/// A unit as the window and pictures write it: `m⁻¹` for the `1/m` of files.
pub fn symbol(unit: &str) -> String {
    unit.replace("1/m", "m\u{207b}\u{b9}")
}

/// Decimals of numbers in a unit, or in the change of it per second; none where their size decides.
fn decimals(unit: &str) -> Option<usize> {
    match unit.strip_suffix("/s").unwrap_or(unit) {
        "N" | "1/m" | "bar" | "s" => Some(2),
        "kPa" | "mm" | "°" => Some(1),
        "Hz" | "%" | "counts" => Some(0),
        _ => None,
    }
}

/// A number with a true minus and so many decimals; never `−0.0`, and an en dash where it is not finite.
pub fn fixed(value: f64, decimals: usize) -> String {
    if value.is_finite() { true_minus(&format!("{value:.decimals$}")) } else { "–".to_owned() }
}

/// Percentage, rounded down so that a probability below a threshold never seems to reach it; above 99 % with a decimal.
pub fn percent(p: f64) -> String {
    let tenths = (p * 1e3 + 1e-6).floor().clamp(0.0, 999.0);
    if tenths > 990.0 { format!("{:.1} %", tenths / 10.0) } else { format!("{:.0} %", (tenths / 10.0).floor()) }
}

/// A text with a capital at its beginning.
pub fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// A message as the window says it: with a capital, and without the numbers of the system's errors.
pub fn message(text: &str) -> String {
    let mut parts = text.split(" (os error ");
    let mut said = parts.next().unwrap_or_default().to_owned();
    parts.for_each(|part| said.push_str(part.split_once(')').map_or("", |(_number, rest)| rest)));
    capital(&said)
}

/// A printed number with a true minus; without a sign where it is zero. Nothing printed is a dash.
pub fn true_minus(text: &str) -> String {
    match text.trim_start_matches(['-', '+']) {
        "" => "–".to_owned(),
        size if size.chars().all(|c| c == '0' || c == '.') => size.to_owned(),
        size if text.starts_with('-') => format!("\u{2212}{size}"),
        _ => text.to_owned(),
    }
}

/// A value in a unit as people read it, without the unit: with the decimals of its quantity, or with three digits.
pub fn number(value: f64, unit: &str) -> String {
    decimals(unit).map_or_else(|| true_minus(&three_digits(value)), |decimals| fixed(value, decimals))
}

/// The unit in which people read values of this unit, and the factor to it.
pub fn read_in(unit: &str) -> (&str, f64) {
    if unit == "Pa" { ("kPa", 1e-3) } else { (unit, 1.0) }
}

/// The same with its unit: `0.57 N`, `31.0 kPa`, `7.29 m⁻¹`.
pub fn shown(value: f64, unit: &str) -> String {
    format!("{}{SPACE}{}", number(value, unit), symbol(unit))
}

/// A difference of two such values, with its sign; with a decimal more where it would read as none.
pub fn difference(value: f64, unit: &str) -> String {
    let text = decimals(unit).map_or_else(
        || true_minus(&three_digits(value)),
        |decimals| fixed(value, decimals + usize::from(value.abs() < 0.5 * 0.1_f64.powi(decimals as i32))),
    );
    if value > 0.0 { format!("+{text}") } else { text }
}

/// A number at an axis: without trailing zeros.
pub fn mark(value: f64) -> String {
    let text = true_minus(&three_digits(value));
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_quantity_has_its_decimals_and_a_true_minus() {
        let texts = [(0.5749, "N"), (-0.00201, "N"), (31.04, "kPa"), (-7.286, "1/m"), (-1.5, "1/m/s"), (0.00412, "V")]
            .map(|(value, unit)| shown(value, unit).replace(SPACE, " "));
        assert_eq!(texts, ["0.57 N", "0.00 N", "31.0 kPa", "−7.29 m⁻¹", "−1.50 m⁻¹/s", "0.00412 V"]);
        assert_eq!([mark(-0.5), mark(20.0), mark(0.25), mark(-1e-9)], ["−0.5", "20", "0.25", "0"]);
        assert_eq!(number(f64::NAN, "N"), "–");
        assert_eq!([0.0071, -0.0719, 0.004].map(|n| difference(n, "N")), ["+0.01", "−0.07", "+0.004"]);
    }

    #[test]
    fn messages_begin_with_a_capital_and_have_no_numbers_of_the_system() {
        assert_eq!(message("cannot read \"a\": No such file (os error 2)"), "Cannot read \"a\": No such file");
        assert_eq!(message("twice (os error 2), twice (os error 13)."), "Twice, twice.");
        assert_eq!(message(""), "");
    }

    #[test]
    fn a_percentage_never_seems_to_reach_what_it_does_not() {
        assert_eq!([0.8999, 0.9, 0.997, 0.9999, 1.0].map(percent), ["89 %", "90 %", "99.7 %", "99.9 %", "99.9 %"]);
    }

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
