//! One line to named numbers. Values are counts of the converter.
//!
//! ```text
//! plotter   flexL:512,flexR:498 fsrL:30     names and numbers, separated by commas, spaces, tabs or semicolons (Arduino);
//!                                           the last may be a checksum, `ck:23641`
//! CSV       512,498,30                      numbers, with or without a header at any time
//! JSON      {"flexL":512,"flexR":498}       one flat object to a line
//! ```
//!
//! If a number is replaced by `nan`, `err` or nothing, only that channel has no value; with any other word the line is
//! refused. [`super::shape`] accepts the fields found here only when the board repeats them.

use palpate_tactile::board::{Format, SensorList};

/// Most numbers that a line may carry.
pub(super) const MAX_FIELDS: usize = 64;
/// Longest name of a channel (bytes).
const MAX_NAME: usize = 40;
/// What boards and their libraries print for a missing number.
const NOTHING: [&str; 19] = [
    "", "nan", "-nan", "inf", "-inf", "ovf", "null", "none", "n/a", "-", "--", "---", "?", "err", "error", "open",
    "fail", "ol", "off",
];

/// One number of a line.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Field {
    pub(super) name: String,
    /// None if the board had no number.
    pub(super) value: Option<f64>,
}

/// A line's fields in its order.
pub(super) type Fields = Vec<Field>;

/// A parsed line.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Parsed {
    /// Named numbers.
    Named(Format, Fields),
    /// Numbers of a CSV line.
    Columns(Vec<Option<f64>>),
    /// The names of CSV columns.
    Header(Vec<String>),
}

/// Parses a line of a board with these sensors; an error says why it is refused, and what the line is where that is known.
pub(super) fn parse(line: &[u8], sensors: SensorList) -> Result<Parsed, &'static str> {
    let text = match std::str::from_utf8(line) {
        Ok(text) => text.trim(),
        Err(_) if line.iter().all(|byte| byte.is_ascii_graphic() || b" \t\xB0\xB5\xB1".contains(byte)) => {
            return Err("a sign such as ° or µ is not in UTF-8; leave it out");
        }
        Err(_) => return Err("not text"),
    };
    parse_text(text, sensors).map_err(|why| if why == NO_NUMBER { form_of(text).unwrap_or(why) } else { why })
}

const NO_NUMBER: &str = "a value is not a number";

/// Form of a line that is known and not read.
fn form_of(text: &str) -> Option<&'static str> {
    let is_hex = |word: &str| {
        let digits = word.rsplit([':', '=']).next().unwrap_or(word).trim_start();
        digits
            .strip_prefix("0x")
            .or(digits.strip_prefix("0X"))
            .is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_hexdigit()))
    };
    if text.starts_with('>') {
        return Some("Teleplot's form; print name:value, separated by commas, in one line for each sample");
    }
    if text.split(SEPARATORS).any(is_hex) {
        return Some("hexadecimal values; print decimal ones");
    }
    if text.contains('=') && !text.contains(':') {
        return Some("names and values are joined by =; print name:value");
    }
    let words: Vec<&str> = text.split(':').next()?.split_whitespace().collect();
    let is_word = |word: &&str| word.starts_with(|c: char| c.is_alphabetic());
    (text.contains(':') && words.len() > 1 && words.iter().all(is_word)).then_some("a name has a blank in it")
}

fn parse_text(text: &str, sensors: SensorList) -> Result<Parsed, &'static str> {
    if text.chars().any(|c| c.is_control() && c != '\t') {
        return Err("control characters");
    }
    match text.bytes().next() {
        None => Err("blank"),
        Some(b'{') => json(text).map(|fields| Parsed::Named(Format::JsonLines, fields)),
        Some(_) if text.contains(':') => plotter(text).map(|fields| Parsed::Named(Format::Plotter, fields)),
        Some(_) => csv(text, sensors),
    }
}

/// A number or one of the words for none.
fn number(text: &str) -> Result<Option<f64>, &'static str> {
    let text = text.trim();
    if NOTHING.iter().any(|word| text.eq_ignore_ascii_case(word)) {
        return Ok(None);
    }
    let value: f64 = text.parse().map_err(|_no_number| NO_NUMBER)?;
    Ok(Some(value).filter(|value| value.is_finite()))
}

/// True for what a name may be made of.
fn is_of_name(c: char) -> bool {
    c.is_alphanumeric() || "_-.[]()/%°".contains(c)
}

fn is_name(text: &str) -> bool {
    let begins = text.starts_with(|c: char| c.is_alphanumeric() || c == '_');
    (1..=MAX_NAME).contains(&text.len()) && begins && text.chars().all(is_of_name)
}

/// Adds a field with a valid name that is new.
fn add(fields: &mut Fields, name: &str, value: Option<f64>) -> Result<(), &'static str> {
    if !is_name(name) {
        return Err("invalid channel name");
    }
    if fields.iter().any(|known| known.name == name) {
        return Err("duplicate channel name");
    }
    if fields.len() >= MAX_FIELDS {
        return Err("too many fields");
    }
    fields.push(Field { name: name.to_owned(), value });
    Ok(())
}

/// Separators of the plotter.
const SEPARATORS: [char; 4] = [',', ';', ' ', '\t'];

/// Begins the name of a number that has none, `#1`: it is not shown, but a line that should not have it was damaged.
pub(super) const NAMELESS: char = '#';

/// Parses names and values. A number without a name is passed over, as Arduino's plotter does; but its presence is kept,
/// for it may be the other half of a number, with a blank where a digit was.
fn plotter(text: &str) -> Result<Fields, &'static str> {
    let mut fields = Fields::new();
    let mut rest = text.trim_start_matches(SEPARATORS);
    while !rest.is_empty() {
        let (word, behind) = rest.split_at(rest.find(SEPARATORS).unwrap_or(rest.len()));
        rest = behind.trim_start_matches(SEPARATORS);
        let Some((name, mut value)) = word.split_once(':') else {
            let name = format!("{NAMELESS}{}", fields.len());
            fields.push(Field { name, value: number(word)? });
            continue;
        };
        if value.is_empty() {
            // `flexL: 512` is common; `flexL:,` and `flexL: flexR:3` have no number.
            let after = behind.trim_start_matches([' ', '\t']);
            let (next, behind) = after.split_at(after.find(SEPARATORS).unwrap_or(after.len()));
            if !next.contains(':') {
                value = next;
                rest = behind.trim_start_matches(SEPARATORS);
            }
        }
        add(&mut fields, name, number(value)?)?;
    }
    let named = |field: &Field| !field.name.starts_with(NAMELESS);
    match fields.len() {
        0..=MAX_FIELDS if fields.iter().any(named) => Ok(fields),
        0..=MAX_FIELDS => Err("no number"),
        _ => Err("too many fields"),
    }
}

fn csv(text: &str, sensors: SensorList) -> Result<Parsed, &'static str> {
    let separator = [';', ',', '\t'].into_iter().find(|separator| text.contains(*separator));
    let texts: Vec<&str> = match separator {
        Some(separator) => text.split(separator).collect(),
        None => text.split(' ').filter(|field| !field.is_empty()).collect(),
    };
    if texts.len() > MAX_FIELDS {
        return Err("too many fields");
    }
    if let Some(names) = header(&texts, separator.is_some(), sensors) {
        return Ok(Parsed::Header(names));
    }
    // Between semicolons a comma may stand for a point.
    let read = |text: &&str| if separator == Some(';') { number(&text.replace(',', ".")) } else { number(text) };
    let cells = texts.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    let says_none = cells.len() >= 2 && texts.iter().any(|text| !text.trim().is_empty());
    if says_none || cells.iter().any(Option::is_some) { Ok(Parsed::Columns(cells)) } else { Err("no number") }
}

/// Parses a header: two different names or more. A single word is more likely a remark, and so are words with mere blanks
/// between them, unless one is the name of a sensor.
fn header(texts: &[&str], separated: bool, sensors: SensorList) -> Option<Vec<String>> {
    let names: Vec<String> = texts.iter().map(|text| text.trim().trim_matches('"').trim().to_owned()).collect();
    let different = names.iter().enumerate().all(|(i, name)| !names[..i].contains(name));
    let meant = separated || names_a_sensor(&names, sensors);
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
pub(super) fn names_a_sensor(names: &[String], sensors: SensorList) -> bool {
    names.iter().any(|name| sensors.called(name).is_some())
}

/// Members that are not numbers have no value.
fn json(text: &str) -> Result<Fields, &'static str> {
    let members: serde_json::Map<String, serde_json::Value> =
        serde_json::from_str(text).map_err(|_not_json| "not a JSON object of numbers")?;
    let nested = |value: &serde_json::Value| value.is_array() || value.is_object();
    if members.values().any(nested) && !members.values().any(serde_json::Value::is_number) {
        return Err("nested values: each number needs a name of its own");
    }
    let mut fields = Fields::new();
    for (name, value) in &members {
        add(&mut fields, name, value.as_f64().filter(|value| value.is_finite()))?;
    }
    Ok(fields)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(line: &[u8]) -> Result<Parsed, &'static str> {
        super::parse(line, SensorList::default())
    }

    fn named(line: &str) -> Vec<(String, Option<f64>)> {
        match parse(line.as_bytes()) {
            Ok(Parsed::Named(_, fields)) => fields.into_iter().map(|field| (field.name, field.value)).collect(),
            other => panic!("{line}: {other:?}"),
        }
    }

    fn columns(line: &str) -> Vec<Option<f64>> {
        match parse(line.as_bytes()) {
            Ok(Parsed::Columns(cells)) => cells,
            other => panic!("{line}: {other:?}"),
        }
    }

    fn pairs(expected: &[(&str, f64)]) -> Vec<(String, Option<f64>)> {
        expected.iter().map(|(name, value)| ((*name).to_owned(), (!value.is_nan()).then_some(*value))).collect()
    }

    #[test]
    fn forms_that_are_not_read_are_named() {
        let cases: [(&[u8], &str); 6] = [
            (b">flexL:1760000000000:1433|g", "Teleplot"),
            (b"Left flex: 1433  Right flex: 1552", "a blank"),
            (b"A0=1433 A1=1552", "joined by ="),
            (b"flexL:0x599,flexR:0x610", "hexadecimal"),
            (b"flexL:1433,ang:45\xb0", "UTF-8"),
            (b"flexL:12a", "not a number"),
        ];
        for (line, wanted) in cases {
            assert!(parse(line).is_err_and(|why| why.contains(wanted)), "{wanted}");
        }
    }

    #[test]
    fn every_format_gives_the_same_readings() {
        let wanted = pairs(&[("flexL", 512.0), ("flexR", 498.5), ("fsrL", f64::NAN)]);
        for line in [
            "flexL:512,flexR:498.5,fsrL:nan",
            "flexL:512 flexR:498.5 fsrL:",
            "flexL:512\tflexR:498.5\tfsrL:NaN\t",
            "flexL: 512, flexR: 498.5, fsrL: ",
            "flexL:512;flexR:+498.5;fsrL:-",
            "flexL:512,,flexR:498.5 , ,\tfsrL:err",
            r#"{"flexL":512, "flexR":498.5, "fsrL":null}"#,
        ] {
            assert_eq!(named(line), wanted, "{line}");
        }
        assert_eq!(named("flexL: flexR:3"), pairs(&[("flexL", f64::NAN), ("flexR", 3.0)]));
        assert_eq!(named("0:512,1:498,_x:3,2nd:4"), pairs(&[("0", 512.0), ("1", 498.0), ("_x", 3.0), ("2nd", 4.0)]));
        assert_eq!(named("7 flexL:512 0"), pairs(&[("#0", 7.0), ("flexL", 512.0), ("#2", 0.0)]));
        for line in ["512,498.5,nan", "512;498,5;", "512\t498.5\tnan", "512  498.5 NAN", "512,498.5,---"] {
            assert_eq!(columns(line), [Some(512.0), Some(498.5), None], "{line}");
        }
        assert_eq!(columns("nan,err,,open"), [None; 4]);
    }

    #[test]
    fn headers_differ_from_remarks() {
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
            "flexL:512mV",
            "flexL:512,flexR:disconnected",
            "Sensor: 1 ok",
            ">flexL:512",
            "512,498 N",
            r#"{"flexL":512,"#,
            r#"{"flex":[512,498]}"#,
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
