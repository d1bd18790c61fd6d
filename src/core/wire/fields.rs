//! One line to named numbers, in each format that boards speak:
//!
//! ```text
//! plotter   flexL:512,flexR:498 fsrL:30     names and numbers; commas, spaces, tabs or semicolons between (Arduino);
//!                                           the last may be a checksum, `ck:23641`
//! CSV       512,498,30                      numbers, with or without a line of names at any time
//! Teleplot  >flexL:1627551892437:512§ADC|g  one number to a line, its time in ms
//! JSON      {"flexL":512,"flexR":498}       one flat object to a line
//! ```

use crate::board::Sensor;
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};

/// Most numbers that a line may carry.
pub(super) const MAX_FIELDS: usize = 64;
/// Longest name of a channel (bytes).
const MAX_NAME: usize = 40;
/// What boards and their libraries print for a number that they do not have.
const NOTHING: [&str; 10] = ["", "nan", "-nan", "inf", "-inf", "ovf", "null", "none", "n/a", "-"];

/// How a board writes its lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Format {
    /// Names and numbers, as Arduino's plotter takes them.
    Plotter,
    /// Numbers in columns.
    Csv,
    /// One named number to a line.
    Teleplot,
    /// A flat JSON object to a line.
    JsonLines,
}

impl Format {
    /// What it is called on screen.
    pub fn label(self) -> &'static str {
        match self {
            Self::Plotter => "Arduino plotter lines",
            Self::Csv => "CSV",
            Self::Teleplot => "Teleplot",
            Self::JsonLines => "JSON lines",
        }
    }

    /// The mark by which it was told from the others.
    pub fn mark(self) -> &'static str {
        match self {
            Self::Plotter => "each number stands behind its name and a colon",
            Self::Csv => "the lines are numbers in columns",
            Self::Teleplot => "the lines begin with >",
            Self::JsonLines => "the lines begin with {",
        }
    }
}

/// A line's fields in its order. A number is none where the board had none to print.
pub(super) type Fields = Vec<(String, Option<f64>)>;

/// What a line turned out to be.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Parsed {
    /// Named numbers.
    Named(Format, Fields),
    /// Numbers of a CSV line.
    Columns(Vec<Option<f64>>),
    /// The names of CSV columns.
    Header(Vec<String>),
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
        Some(b'{') => json(text).map(|fields| Parsed::Named(Format::JsonLines, fields)),
        Some(b'>') => teleplot(&text[1..]).map(|fields| Parsed::Named(Format::Teleplot, fields)),
        Some(_) if text.contains(':') => plotter(text).map(|fields| Parsed::Named(Format::Plotter, fields)),
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

fn is_name(text: &str) -> bool {
    let letter = |c: char| c.is_alphanumeric() || "_-.[]()/%°".contains(c);
    (1..=MAX_NAME).contains(&text.len()) && text.starts_with(char::is_alphabetic) && text.chars().all(letter)
}

/// A name that may be one, once, in a line that is not too long.
fn add(fields: &mut Fields, name: &str, value: Option<f64>) -> Result<(), &'static str> {
    if !is_name(name) {
        return Err("a name is not one");
    }
    if fields.iter().any(|(known, _)| known == name) {
        return Err("a name comes twice");
    }
    if fields.len() >= MAX_FIELDS {
        return Err("it has too many fields");
    }
    fields.push((name.to_owned(), value));
    Ok(())
}

fn plotter(text: &str) -> Result<Fields, &'static str> {
    let mut fields = Fields::new();
    let mut rest = text;
    while !rest.is_empty() {
        let (name, after) = rest.split_once(':').ok_or("a number has no name")?;
        // `flexL: 512` is common; `flexL:,` and `flexL: flexR:3` have no number.
        let after = after.trim_start_matches([' ', '\t']);
        let end = after.find([',', ';', ' ', '\t']).unwrap_or(after.len());
        let (value, behind) = after.split_at(end);
        if value.contains(':') {
            add(&mut fields, name, None)?;
            rest = after;
        } else {
            add(&mut fields, name, number(value)?)?;
            rest = separator(behind);
        }
    }
    Ok(fields)
}

/// What follows a separator: blanks around at most one comma or semicolon.
fn separator(text: &str) -> &str {
    let text = text.trim_start_matches([' ', '\t']);
    text.strip_prefix([',', ';']).unwrap_or(text).trim_start_matches([' ', '\t'])
}

fn csv(text: &str) -> Result<Parsed, &'static str> {
    let fields: Vec<&str> = if text.contains(';') {
        text.split(';').collect()
    } else if text.contains(',') {
        text.split(',').collect()
    } else if text.contains('\t') {
        text.split('\t').collect()
    } else {
        text.split(' ').filter(|field| !field.is_empty()).collect()
    };
    if fields.len() > MAX_FIELDS {
        return Err("it has too many fields");
    }
    let decimal_comma = text.contains(';');
    let numbers: Result<Vec<Option<f64>>, &str> = fields
        .iter()
        .map(|field| if decimal_comma { number(&field.replace(',', ".")) } else { number(field) })
        .collect();
    match numbers {
        Ok(numbers) if numbers.iter().any(Option::is_some) => Ok(Parsed::Columns(numbers)),
        Ok(_) => Err("it has no number"),
        Err(cause) => header(&fields, text.contains([';', ',', '\t'])).map(Parsed::Header).ok_or(cause),
    }
}

/// Two names or more, all different; a single word is more likely a remark, and so are words with mere blanks between
/// them, unless one is the name of a sensor.
fn header(fields: &[&str], separated: bool) -> Option<Vec<String>> {
    let names: Vec<String> = fields.iter().map(|field| field.trim().trim_matches('"').to_owned()).collect();
    let different = names.iter().enumerate().all(|(i, name)| !names[..i].contains(name));
    let known = |name: &String| Sensor::ALL.iter().any(|sensor| name.eq_ignore_ascii_case(sensor.channel()));
    let meant = separated || names.iter().any(known);
    (names.len() >= 2 && different && meant && names.iter().all(|name| is_name(name))).then_some(names)
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
        [value] => add(&mut fields, name, number(value)?)?,
        [time, value] => {
            add(&mut fields, name, number(value)?)?;
            add(&mut fields, "ms", number(time)?)?;
        }
        _ => return Err("it has no number"),
    }
    Ok(fields)
}

fn json(text: &str) -> Result<Fields, &'static str> {
    let Pairs(pairs) = serde_json::from_str(text).map_err(|_not_json| "it is not a JSON object of numbers")?;
    let mut fields = Fields::new();
    for (name, value) in pairs {
        add(&mut fields, &name, value)?;
    }
    Ok(fields)
}

/// Members of a JSON object in their order; those that are no numbers have none.
struct Pairs(Fields);

impl<'de> Deserialize<'de> for Pairs {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Members;
        impl<'de> Visitor<'de> for Members {
            type Value = Pairs;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Pairs, A::Error> {
                let mut pairs = Fields::new();
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
            Ok(Parsed::Named(_, fields)) => fields,
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
            r#"{"flexL":512, "flexR":498.5, "fsrL":null}"#,
        ] {
            assert_eq!(named(line), wanted, "{line}");
        }
        assert_eq!(named("flexL: flexR:3"), pairs(&[("flexL", f64::NAN), ("flexR", 3.0)]));
        for line in ["512,498.5,nan", "512;498,5;", "512\t498.5\tnan", "512  498.5 NAN"] {
            assert_eq!(parse(line.as_bytes()), Ok(Parsed::Columns(vec![Some(512.0), Some(498.5), None])), "{line}");
        }
        assert_eq!(named(">flexL:1627551892437:512§ADC|g"), pairs(&[("flexL", 512.0), ("ms", 1_627_551_892_437.0)]));
        assert_eq!(named(">flexL:512"), pairs(&[("flexL", 512.0)]));
    }

    #[test]
    fn headers_are_told_from_remarks() {
        let names = Parsed::Header(vec!["flexL".into(), "flexR".into(), "t_us".into()]);
        assert_eq!(parse(b"flexL,flexR,t_us"), Ok(names));
        assert!(matches!(parse(b"flexL fsrL"), Ok(Parsed::Header(_))));
        assert!(parse(b"Calibrating...").is_err());
        assert!(parse(b"waiting for sensors").is_err());
        assert!(parse(b"flexL,flexL").is_err());
        assert!(parse(b"nan,nan").is_err());
    }

    #[test]
    fn halves_of_lines_and_lines_run_together_are_refused() {
        for line in [
            "512,flexR:498",
            "flexL:512,flexR",
            "flexL:512,p_bar:0.5flexL:513,flexR:3",
            "flexL:512,flexL:513",
            "flexL:51x",
            "flexL:5\u{1}2",
            r#"{"flexL":512,"#,
            "[1,2]",
            "512,4 98",
            "",
        ] {
            assert!(parse(line.as_bytes()).is_err(), "{line}");
        }
        assert!(parse(&[b'1', 0xff, b'2']).is_err());
        assert!(parse(vec!["1"; 100].join(",").as_bytes()).is_err());
    }
}
