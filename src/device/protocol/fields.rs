//! One line to named numbers, in each format that boards speak:
//!
//! ```text
//! plotter   flexL:512,flexR:498 fsrL:30     names and numbers; commas, spaces, tabs or semicolons between, as many as one
//!                                           likes (Arduino); the last may be a checksum, `ck:23641`
//! CSV       512,498,30                      numbers, with or without a line of names at any time
//! Teleplot  >flexL:1627551892437:512§ADC|g  one number to a line, its time in ms
//! JSON      {"flexL":512,"flexR":498}       one flat object to a line
//! ```
//!
//! A unit may follow a number, `12.5N`; a word in a number's place, `err`, says that there is none, and costs that field
//! alone. What is let pass here is believed by [`super::shape`] only when the board repeats it.

use palpate_tactile::board::{Format, Sensor};
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};

/// Most numbers that a line may carry.
pub(super) const MAX_FIELDS: usize = 64;
/// Longest name of a channel (bytes).
const MAX_NAME: usize = 40;
/// Longest unit behind a number (bytes).
const MAX_UNIT: usize = 8;
/// What boards and their libraries print for a number that they do not have.
const NOTHING: [&str; 19] = [
    "", "nan", "-nan", "inf", "-inf", "ovf", "null", "none", "n/a", "-", "--", "---", "?", "err", "error", "open",
    "fail", "ol", "off",
];

/// One number of a line.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Field {
    pub(super) name: String,
    /// What stands behind the number, most often nothing.
    pub(super) unit: String,
    /// None where the board had none to print.
    pub(super) value: Option<f64>,
}

/// A line's fields in its order.
pub(super) type Fields = Vec<Field>;

/// What a line turned out to be.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Parsed {
    /// Named numbers. Odd ones have words among them that are no numbers: a remark may look like that, too.
    Named {
        /// How they are written.
        format: Format,
        /// They.
        fields: Fields,
        /// Words are among them.
        odd: bool,
    },
    /// Numbers of a CSV line.
    Columns(Vec<Cell>),
    /// The names of CSV columns.
    Header(Vec<String>),
}

/// What stands in a number's place.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cell {
    pub(super) value: Option<f64>,
    pub(super) unit: String,
    /// It is a number, or one of the words that boards have for none: not just any word.
    pub(super) plain: bool,
}

impl Cell {
    /// Without a number.
    fn none(plain: bool) -> Self {
        Self { value: None, unit: String::new(), plain }
    }
}

/// Reads a line; the fault says why it is none of a board's.
pub(super) fn parse(line: &[u8]) -> Result<Parsed, &'static str> {
    let text = std::str::from_utf8(line).map_err(|_not_text| "it holds bytes that are no text")?;
    let text = text.trim();
    if text.chars().any(|c| c.is_control() && c != '\t') {
        return Err("it holds control characters");
    }
    match text.bytes().next() {
        None => Err("it is blank"),
        Some(b'{') => json(text).map(|fields| Parsed::Named { format: Format::JsonLines, fields, odd: false }),
        Some(b'>') => teleplot(&text[1..]).map(|fields| Parsed::Named { format: Format::Teleplot, fields, odd: false }),
        Some(_) if text.contains(':') => {
            plotter(text).map(|(fields, odd)| Parsed::Named { format: Format::Plotter, fields, odd })
        }
        Some(_) => csv(text),
    }
}

/// A number, or that there is none; an error where it is neither.
fn number(text: &str) -> Result<Option<f64>, &'static str> {
    let text = text.trim();
    if NOTHING.iter().any(|word| text.eq_ignore_ascii_case(word)) {
        return Ok(None);
    }
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(Some(value)),
        Ok(_infinite) => Ok(None),
        Err(_) => Err("a value is not a number"),
    }
}

/// A number with its unit, or a word in its place. What has a digit where none belongs was most likely damaged, and is
/// neither.
fn cell(text: &str) -> Result<Cell, &'static str> {
    let text = text.trim();
    if let Ok(value) = number(text) {
        return Ok(Cell { value, ..Cell::none(true) });
    }
    let is_of_number = |c: char| c.is_ascii_digit() || "+-.".contains(c);
    let (digits, unit) = text.split_at(text.find(|c| !is_of_number(c)).unwrap_or(text.len()));
    if digits.is_empty() {
        let is_word = text.len() <= MAX_NAME && !text.contains(|c: char| c.is_whitespace() || c.is_numeric());
        return is_word.then(|| Cell::none(false)).ok_or("a value is not a number");
    }
    let unit = unit.trim_start();
    let is_unit = unit.len() <= MAX_UNIT && unit.chars().all(|c| c.is_alphabetic() || "°%/²³·".contains(c));
    match number(digits)?.filter(|_| is_unit) {
        Some(value) => Ok(Cell { value: Some(value), unit: unit.to_owned(), plain: true }),
        None => Err("a value is not a number"),
    }
}

/// What a name may be made of.
fn is_of_name(c: char) -> bool {
    c.is_alphanumeric() || "_-.[]()/%°".contains(c)
}

fn is_name(text: &str) -> bool {
    let begins = text.starts_with(|c: char| c.is_alphanumeric() || c == '_');
    (1..=MAX_NAME).contains(&text.len()) && begins && text.chars().all(is_of_name)
}

/// A name that may be one, once, in a line that is not too long.
fn add(fields: &mut Fields, name: &str, Cell { value, unit, .. }: Cell) -> Result<(), &'static str> {
    if !is_name(name) {
        return Err("a name is not one");
    }
    if fields.iter().any(|known| known.name == name) {
        return Err("a name comes twice");
    }
    if fields.len() >= MAX_FIELDS {
        return Err("it has too many fields");
    }
    fields.push(Field { name: name.to_owned(), unit, value });
    Ok(())
}

/// Separators of the plotter.
const SEPARATORS: [char; 4] = [',', ';', ' ', '\t'];

/// Begins the name of a number that has none, `#1`: nobody shows it, but a line that should not have it was damaged.
pub(super) const NAMELESS: char = '#';

/// Names and values, and whether words are among them. What has no colon is passed over, as Arduino's plotter does; but that
/// a number stands there is remembered, for it may be the other half of one, with a blank where a digit was.
fn plotter(text: &str) -> Result<(Fields, bool), &'static str> {
    let mut fields = Fields::new();
    let (mut any_plain, mut odd, mut nameless) = (false, false, 0);
    let mut rest = text.trim_start_matches(SEPARATORS);
    while !rest.is_empty() {
        let (word, behind) = rest.split_at(rest.find(SEPARATORS).unwrap_or(rest.len()));
        rest = behind.trim_start_matches(SEPARATORS);
        let Some((name, mut value)) = word.split_once(':') else {
            odd = true;
            if word.contains(|c: char| c.is_ascii_digit()) {
                nameless += 1;
                let name = format!("{NAMELESS}{nameless}");
                fields.push(Field { name, unit: String::new(), value: number(word).unwrap_or_default() });
            }
            if fields.len() > MAX_FIELDS {
                return Err("it has too many fields");
            }
            continue;
        };
        if value.contains(':') {
            return Err("two colons stand in one value");
        }
        if value.is_empty() {
            // `flexL: 512` is common; `flexL:,` and `flexL: flexR:3` have no number.
            let after = behind.trim_start_matches([' ', '\t']);
            let (next, behind) = after.split_at(after.find(SEPARATORS).unwrap_or(after.len()));
            if !next.contains(':') {
                value = next;
                rest = behind.trim_start_matches(SEPARATORS);
            }
        }
        let cell = cell(value)?;
        any_plain |= cell.plain;
        odd |= !cell.plain;
        add(&mut fields, name, cell)?;
    }
    if any_plain { Ok((fields, odd)) } else { Err("it has no number") }
}

fn csv(text: &str) -> Result<Parsed, &'static str> {
    let separator = [';', ',', '\t'].into_iter().find(|separator| text.contains(*separator));
    let texts: Vec<&str> = match separator {
        Some(separator) => text.split(separator).collect(),
        None => text.split(' ').filter(|field| !field.is_empty()).collect(),
    };
    if texts.len() > MAX_FIELDS {
        return Err("it has too many fields");
    }
    if let Some(names) = header(&texts, separator.is_some()) {
        return Ok(Parsed::Header(names));
    }
    // Behind semicolons a comma may stand for a point.
    let read = |text: &&str| if separator == Some(';') { cell(&text.replace(',', ".")) } else { cell(text) };
    let cells = texts.iter().map(read).collect::<Result<Vec<Cell>, &str>>()?;
    let is_number = |cell: &Cell| cell.value.is_some();
    let says_none = |(text, cell): (&&str, &Cell)| cell.plain && !text.trim().is_empty();
    // Words with mere blanks between them are a remark, a number among them or not.
    if separator.is_none() && !cells.iter().all(|cell| cell.plain) {
        return Err("a value is not a number");
    }
    if cells.iter().any(is_number) || (cells.len() >= 2 && texts.iter().zip(&cells).any(says_none)) {
        Ok(Parsed::Columns(cells))
    } else {
        Err("it has no number")
    }
}

/// Two names or more, all different; a single word is more likely a remark, and so are words with mere blanks between them,
/// unless one is the name of a sensor.
fn header(texts: &[&str], separated: bool) -> Option<Vec<String>> {
    let names: Vec<String> = texts.iter().map(|text| text.trim().trim_matches('"').trim().to_owned()).collect();
    let different = names.iter().enumerate().all(|(i, name)| !names[..i].contains(name));
    let meant = separated || names_a_sensor(&names);
    let is_one = |name: &String| {
        // With a digit it would begin as numbers do.
        name.starts_with(|c: char| c.is_alphabetic() || c == '_')
            && name.len() <= MAX_NAME
            && name.chars().all(|c| is_of_name(c) || c == ' ')
            && !NOTHING.iter().any(|word| name.eq_ignore_ascii_case(word))
    };
    (names.len() >= 2 && different && meant && names.iter().all(is_one)).then_some(names)
}

/// True where one of the names is that of a gripper's sensor.
pub(super) fn names_a_sensor(names: &[String]) -> bool {
    names.iter().any(|name| Sensor::called(name).is_some())
}

/// `name:value`, or `name:time:value` with the time in ms; a unit and flags may follow.
fn teleplot(text: &str) -> Result<Fields, &'static str> {
    let (text, flags) = text.split_once('|').unwrap_or((text, ""));
    if flags.contains('t') {
        return Err("it is text, not a number");
    }
    let text = text.split('§').next().unwrap_or(text);
    let mut parts = text.split(':');
    let name = parts.next().unwrap_or_default();
    let parts: Vec<&str> = parts.collect();
    let mut fields = Fields::new();
    match parts.as_slice() {
        [value] => add(&mut fields, name, cell(value)?)?,
        [time, value] => {
            add(&mut fields, name, cell(value)?)?;
            add(&mut fields, "ms", Cell { value: number(time)?, ..Cell::none(true) })?;
        }
        _ => return Err("it has no number"),
    }
    Ok(fields)
}

fn json(text: &str) -> Result<Fields, &'static str> {
    let Pairs(pairs) = serde_json::from_str(text).map_err(|_not_json| "it is not a JSON object of numbers")?;
    let mut fields = Fields::new();
    for (name, value) in pairs {
        add(&mut fields, &name, Cell { value, ..Cell::none(true) })?;
    }
    Ok(fields)
}

/// Members of a JSON object in their order; those that are no numbers have none.
struct Pairs(Vec<(String, Option<f64>)>);

impl<'de> Deserialize<'de> for Pairs {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Members;
        impl<'de> Visitor<'de> for Members {
            type Value = Pairs;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Pairs, A::Error> {
                let mut pairs = Vec::new();
                while let Some((name, value)) = map.next_entry::<String, serde_json::Value>()? {
                    pairs.push((name, value.as_f64().filter(|value| value.is_finite())));
                }
                Ok(Pairs(pairs))
            }
        }
        deserializer.deserialize_map(Members)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(line: &str) -> Vec<(String, Option<f64>)> {
        match parse(line.as_bytes()) {
            Ok(Parsed::Named { fields, .. }) => fields.into_iter().map(|field| (field.name, field.value)).collect(),
            other => panic!("{line}: {other:?}"),
        }
    }

    fn columns(line: &str) -> Vec<Option<f64>> {
        match parse(line.as_bytes()) {
            Ok(Parsed::Columns(cells)) => cells.into_iter().map(|cell| cell.value).collect(),
            other => panic!("{line}: {other:?}"),
        }
    }

    fn pairs(expected: &[(&str, f64)]) -> Vec<(String, Option<f64>)> {
        expected.iter().map(|(name, value)| ((*name).to_owned(), (!value.is_nan()).then_some(*value))).collect()
    }

    #[test]
    fn the_same_readings_in_every_format() {
        let wanted = pairs(&[("flexL", 512.0), ("flexR", 498.5), ("fsrL", f64::NAN)]);
        for line in [
            "flexL:512,flexR:498.5,fsrL:nan",
            "flexL:512 flexR:498.5 fsrL:",
            "flexL:512\tflexR:498.5\tfsrL:NaN\t",
            "flexL: 512, flexR: 498.5, fsrL: ",
            "flexL:512;flexR:+498.5;fsrL:-",
            "flexL:512,,flexR:498.5 , ,\tfsrL:err",
            "Reading: flexL:512 flexR:498.5 N fsrL:open",
            "grasp 7 flexL:512mV, flexR:498.5°, fsrL:disconnected",
            r#"{"flexL":512, "flexR":498.5, "fsrL":null}"#,
        ] {
            let mut found = named(line);
            found.retain(|(name, _)| name != "Reading" && !name.starts_with(NAMELESS));
            assert_eq!(found, wanted, "{line}");
        }
        assert_eq!(named("flexL: flexR:3"), pairs(&[("flexL", f64::NAN), ("flexR", 3.0)]));
        assert_eq!(named("0:512,1:498,_x:3,2nd:4"), pairs(&[("0", 512.0), ("1", 498.0), ("_x", 3.0), ("2nd", 4.0)]));
        for line in [
            "512,498.5,nan",
            "512;498,5;",
            "512\t498.5\tnan",
            "512  498.5 NAN",
            "512, 498.5 N, disconnected",
            "512mV 498.5N err",
            "512,498.5,---",
        ] {
            assert_eq!(columns(line), [Some(512.0), Some(498.5), None], "{line}");
        }
        assert_eq!(columns("nan,err,,open"), [None; 4]);
        assert_eq!(named(">flexL:1627551892437:512§ADC|g"), pairs(&[("flexL", 512.0), ("ms", 1_627_551_892_437.0)]));
        assert_eq!(named(">flexL:512"), pairs(&[("flexL", 512.0)]));
    }

    #[test]
    fn a_unit_is_kept_beside_its_number() {
        let units = |line: &str| match parse(line.as_bytes()) {
            Ok(Parsed::Named { fields, .. }) => fields.into_iter().map(|field| field.unit).collect::<Vec<_>>(),
            Ok(Parsed::Columns(cells)) => cells.into_iter().map(|cell| cell.unit).collect(),
            other => panic!("{line}: {other:?}"),
        };
        assert_eq!(units("a:12.5N,b:3m/s²,c:7"), ["N", "m/s²", ""]);
        assert_eq!(units("12.5 N,3%"), ["N", "%"]);
    }

    #[test]
    fn headers_are_told_from_remarks() {
        let header = |line: &str| match parse(line.as_bytes()) {
            Ok(Parsed::Header(names)) => Some(names.join("|")),
            _ => None,
        };
        assert_eq!(header("flexL,flexR,t_us").as_deref(), Some("flexL|flexR|t_us"));
        assert_eq!(header("\"Flex L\"; \"_pad\"").as_deref(), Some("Flex L|_pad"));
        assert_eq!(header("\"One word\",two").as_deref(), Some("One word|two"));
        assert_eq!(header("Time (ms), Bend left, Force").as_deref(), Some("Time (ms)|Bend left|Force"));
        assert_eq!(header("flexL fsrL").as_deref(), Some("flexL|fsrL"));
        for line in [
            "Calibrating...",
            "waiting for sensors",
            "waiting for 3 sensors",
            "Status: ready",
            "flexL,flexL",
            "err,open",
            ",,,",
            "--------",
        ] {
            assert_eq!(header(line), None, "{line}");
            assert!(parse(line.as_bytes()).is_err() || line == "err,open", "{line}");
        }
    }

    #[test]
    fn damaged_values_and_lines_run_together_are_refused() {
        for line in [
            "flexL:512,p_bar:0.5flexL:513,flexR:3",
            "flexL:512,flexL:513",
            "flexL:5x2",
            "flexL:0x1f",
            "flexL:x12",
            "flexL:5\u{1}2",
            "flexL:5:12",
            r#"{"flexL":512,"#,
            "[1,2]",
            "512,4 98",
            "512,5l2",
            "",
        ] {
            assert!(parse(line.as_bytes()).is_err(), "{line}");
        }
        assert!(parse(&[b'1', 0xff, b'2']).is_err());
        assert!(parse(vec!["1"; 100].join(",").as_bytes()).is_err());
    }
}
