//! The sensors of a gripper: a list, described in a file (TOML). The paper's two strips and two pads (section IV-B) are
//! the default.
//!
//! ```toml
//! [[sensor]]
//! name = "fsrL2"          # the board's column
//! finger = "left"
//! kind = "force"          # flex, force or raw
//! place = "distal"        # where several are on a finger: proximal, distal, pair_1 .., joint_1 .., or a name
//! rows = [10, 20]         # of the pad's taxels, the last one not included; strips: from_m and length_m
//! pin = "A3"
//! divider_ohm = 4700
//! ```

use crate::unit::{KNOWN_UNITS, Unit};
use palpate_sim::gripper::Side;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::path::Path;
use std::sync::Mutex;

/// Largest gripper file (bytes).
const LARGEST_FILE: u64 = 1 << 20;
/// Most sensors of a gripper.
const MOST_SENSORS: usize = 64;
/// Longest name of a sensor or a finger (characters); boards with our firmware take 15.
const LONGEST_NAME: usize = 40;
/// Names that boards give to times and the line pressure.
const TAKEN: [&str; 9] = ["t_us", "t_ms", "t_s", "millis", "micros", "time", "seq", "p_bar", "ck"];

/// Kind of a sensor: what it is calibrated against.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SensorKind {
    /// A strip that reads an angle.
    Flex,
    /// A pad that reads a force.
    #[serde(alias = "force")]
    Pad,
    /// Anything else, read as it comes: less its reading at rest, times a scale.
    Raw,
}

/// What a raw sensor measures, where simulation and emulator can give it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Measures {
    /// Air pressure in the finger (Pa).
    ChamberPressure,
    /// Distance from the palm to the middle of the object (m).
    PalmDistance,
}

/// One sensor of a gripper file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SensorRow {
    /// The board's name of its column.
    pub name: Cow<'static, str>,
    /// Finger that carries it, by any name; empty for a sensor of the whole hand.
    #[serde(skip_serializing_if = "str::is_empty")]
    pub finger: Cow<'static, str>,
    pub kind: SensorKind,
    /// Place along the finger; empty for the only one of its kind on its finger.
    #[serde(skip_serializing_if = "str::is_empty")]
    pub place: Cow<'static, str>,
    /// Name of the part that is mounted there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub part: Option<Cow<'static, str>>,
    /// Pin of the board.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pin: Option<Cow<'static, str>>,
    /// Fixed resistor of its divider (ohm).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub divider_ohm: Option<f64>,
    /// Beginning of the strip or the pad's sensing length, from the palm (m).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_m: Option<f64>,
    /// Length that it covers (m).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_m: Option<f64>,
    /// First row of taxels from the palm, and the one after the last.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rows: Option<[usize; 2]>,
    /// Unit of a raw sensor's values.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<Cow<'static, str>>,
    /// Units of a raw sensor in one count.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
    /// What a raw sensor measures, for simulation and emulator.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measures: Option<Measures>,
}

impl Default for SensorRow {
    fn default() -> Self {
        Self::of_paper("", "", SensorKind::Raw, None, None)
    }
}

impl SensorRow {
    const fn of_paper(
        name: &'static str,
        finger: &'static str,
        kind: SensorKind,
        pin: Option<Cow<'static, str>>,
        divider_ohm: Option<f64>,
    ) -> Self {
        let (name, finger, place) = (Cow::Borrowed(name), Cow::Borrowed(finger), Cow::Borrowed(""));
        let (part, from_m, length_m, rows, unit, scale, measures) = (None, None, None, None, None, None, None);
        Self { name, finger, kind, place, part, pin, divider_ohm, from_m, length_m, rows, unit, scale, measures }
    }

    /// True for the names that boards may give its column: case, blanks, hyphens and underscores are ignored.
    fn is_called(&self, name: &str) -> bool {
        let letters = |name: &str| -> Vec<char> {
            name.chars().filter(|c| !" -_".contains(*c)).map(|c| c.to_ascii_lowercase()).collect()
        };
        letters(name) == letters(&self.name)
    }

    /// The unit of its values, where it is raw; none where the file says none that is known.
    pub(crate) fn raw_unit(&self) -> Option<Unit> {
        self.unit.as_deref().and_then(Unit::parse)
    }

    fn check(&self) -> Result<(), String> {
        let (name, plain) = (&self.name, |text: &str| !text.chars().any(|c| c.is_control() || "\"\\,:;[]".contains(c)));
        let fits = |text: &str| plain(text) && text.trim() == text && text.chars().count() <= LONGEST_NAME;
        if name.is_empty() || !fits(name) || TAKEN.iter().any(|taken| self.is_called(taken)) {
            return Err(format!(
                "\"{name}\" is no name for a sensor: write the board's name of its column, at most {LONGEST_NAME} characters \
                 without quotes, commas, colons and brackets; {} are taken",
                TAKEN.join(", ")
            ));
        }
        if !fits(&self.finger) || !fits(&self.place) {
            return Err(format!("finger and place of \"{name}\" must be short names, such as left and distal"));
        }
        if self.kind != SensorKind::Raw && self.finger.is_empty() {
            return Err(format!("\"{name}\" needs its finger, as in finger = \"left\""));
        }
        let positive = |value: Option<f64>| value.is_none_or(|value| value.is_finite() && value > 0.0);
        if !positive(self.divider_ohm) || !positive(self.length_m) {
            return Err(format!("divider_ohm and length_m of \"{name}\" must be positive"));
        }
        if self.from_m.is_some_and(|from| !(0.0..10.0).contains(&from)) || self.length_m.is_some_and(|own| own > 10.0) {
            return Err(format!("from_m and length_m of \"{name}\" are lengths along the finger, in metres"));
        }
        if self.rows.is_some_and(|[from, to]| from >= to || to > 10_000) {
            return Err(format!(
                "rows of \"{name}\" are the first one and the one after the last, as in rows = [10, 20]"
            ));
        }
        if self.scale.is_some_and(|scale| !scale.is_finite() || scale == 0.0) {
            return Err(format!("scale of \"{name}\" must be a number other than zero: units in one count"));
        }
        match self.unit.as_deref() {
            Some(unit) if self.raw_unit().is_none() => {
                Err(format!("\"{unit}\", the unit of \"{name}\", is not known ({KNOWN_UNITS})"))
            }
            _ => Ok(()),
        }
    }
}

/// The paper's sensors, in the order in which our firmware prints them.
static PAPER: [SensorRow; 4] = {
    const fn pin(name: &'static str) -> Option<Cow<'static, str>> {
        Some(Cow::Borrowed(name))
    }
    [
        SensorRow::of_paper("flexL", "left", SensorKind::Flex, pin("A0"), Some(47e3)),
        SensorRow::of_paper("flexR", "right", SensorKind::Flex, pin("A1"), Some(47e3)),
        SensorRow::of_paper("fsrL", "left", SensorKind::Pad, pin("A2"), Some(4.7e3)),
        SensorRow::of_paper("fsrR", "right", SensorKind::Pad, pin("A3"), Some(4.7e3)),
    ]
};

/// The sensors of a gripper, in the order of its file. Equal lists are one in memory and stay there, so that a sensor is
/// copied like a number.
#[derive(Clone, Copy, Debug)]
pub struct SensorList(&'static [SensorRow]);

impl Eq for SensorList {}

impl PartialEq for SensorList {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self.0, other.0)
    }
}

impl Default for SensorList {
    /// The paper's.
    fn default() -> Self {
        Self(&PAPER)
    }
}

/// A sensor of a list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sensor {
    list: SensorList,
    index: usize,
}

/// Lists other than the paper's that were read so far.
static READ: Mutex<Vec<&'static [SensorRow]>> = Mutex::new(Vec::new());

/// A gripper file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct GripperFile {
    sensor: Vec<SensorRow>,
}

impl SensorList {
    /// Checks the rows of a list.
    pub fn new(rows: Vec<SensorRow>) -> Result<Self, String> {
        if rows.is_empty() || rows.len() > MOST_SENSORS {
            return Err(format!("a gripper has 1 to {MOST_SENSORS} sensors, not {}", rows.len()));
        }
        rows.iter().try_for_each(SensorRow::check)?;
        let twice = |k: usize| rows[..k].iter().any(|other| other.is_called(&rows[k].name));
        if let Some(k) = (1..rows.len()).find(|k| twice(*k)) {
            return Err(format!("two sensors are called \"{}\"", rows[k].name));
        }
        if rows[..] == PAPER[..] {
            return Ok(Self::default());
        }
        let mut read = READ.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let known = read.iter().find(|known| ***known == rows[..]).copied();
        let list = Self(known.unwrap_or_else(|| {
            read.push(Box::leak(rows.into_boxed_slice()));
            read[read.len() - 1]
        }));
        let same = |a: Sensor, b: Sensor| (a.kind(), a.finger(), a.place()) == (b.kind(), b.finger(), b.place());
        let twice = |sensor: &Sensor| list.iter().any(|other| other.index < sensor.index && same(other, *sensor));
        match list.iter().filter(|sensor| sensor.kind() != SensorKind::Raw).find(twice) {
            Some(sensor) => Err(format!(
                "two sensors are the {}: give each a place of its own, as in place = \"proximal\" and place = \"distal\"",
                sensor.label()
            )),
            None => Ok(list),
        }
    }

    /// Reads a gripper file; errors name it.
    pub fn from_file(path: &Path) -> Result<Self, String> {
        palpate_geometry::read_text(path, LARGEST_FILE)
            .map_err(|error| error.to_string())
            .and_then(|text| Self::parse(&text))
            .map_err(|error| format!("{}: {error}", path.display()))
    }

    /// True for a file that lists sensors, sound or not.
    pub fn is_in(path: &Path) -> bool {
        palpate_geometry::read_text(path, LARGEST_FILE)
            .is_ok_and(|text| text.lines().any(|line| line.trim_start().starts_with("[[sensor]]")))
    }

    /// Reads the text of a gripper file.
    pub fn parse(text: &str) -> Result<Self, String> {
        let file: GripperFile = toml::from_str(text).map_err(|error| error.to_string())?;
        Self::new(file.sensor)
    }

    /// The sensors of a board with these columns: those of this list, and a raw one for each other column.
    pub fn of_columns(self, columns: &[String]) -> Result<Self, String> {
        let raw = |name: &String| SensorRow { name: Cow::Owned(name.clone()), ..SensorRow::default() };
        let row = |name: &String| self.called(name).map_or_else(|| raw(name), |sensor| sensor.row().clone());
        Self::new(columns.iter().map(row).collect())
    }

    /// Writes it as a gripper file.
    pub fn to_toml(self) -> String {
        let file = GripperFile { sensor: self.0.to_vec() };
        toml::to_string(&file).unwrap_or_default()
    }

    /// Number of sensors.
    #[expect(clippy::len_without_is_empty, reason = "a list is never empty")]
    pub fn len(self) -> usize {
        self.0.len()
    }

    /// The sensors.
    pub fn iter(self) -> impl DoubleEndedIterator<Item = Sensor> + ExactSizeIterator + Clone {
        (0..self.0.len()).map(move |index| Sensor { list: self, index })
    }

    /// The sensor that the board may call so; see [`Sensor::is_called`].
    pub fn called(self, name: &str) -> Option<Sensor> {
        self.iter().find(|sensor| sensor.is_called(name))
    }

    /// Sensors of a kind on a finger.
    pub fn on(self, kind: SensorKind, finger: &str) -> impl Iterator<Item = Sensor> {
        self.iter().filter(move |sensor| sensor.kind() == kind && sensor.finger() == finger)
    }

    /// The first sensor of a kind on a side.
    pub fn first_on(self, kind: SensorKind, side: Side) -> Option<Sensor> {
        self.on(kind, side.name()).next()
    }

    /// Sensors of a kind.
    pub fn of_kind(self, kind: SensorKind) -> impl Iterator<Item = Sensor> {
        self.iter().filter(move |sensor| sensor.kind() == kind)
    }

    /// Names of the columns, for messages: `flexL, flexR, fsrL, fsrR`.
    pub fn names(self) -> String {
        self.iter().map(Sensor::channel).collect::<Vec<_>>().join(", ")
    }

    /// Sensors that a simulation cannot give.
    pub fn not_simulated(self) -> impl Iterator<Item = Sensor> {
        self.iter().filter(|sensor| match sensor.kind() {
            SensorKind::Raw => sensor.row().measures.is_none(),
            SensorKind::Flex | SensorKind::Pad => sensor.side().is_none(),
        })
    }
}

impl Serialize for SensorList {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for SensorList {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::new(Vec::deserialize(deserializer)?).map_err(serde::de::Error::custom)
    }
}

impl Serialize for Sensor {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.channel())
    }
}

impl Sensor {
    /// The paper's flex strip of the left finger.
    pub const FLEX_LEFT: Self = Self::of_paper(0);
    /// The paper's flex strip of the right finger.
    pub const FLEX_RIGHT: Self = Self::of_paper(1);
    /// The paper's pad of the left finger.
    pub const PAD_LEFT: Self = Self::of_paper(2);
    /// The paper's pad of the right finger.
    pub const PAD_RIGHT: Self = Self::of_paper(3);

    /// The paper's four, in the order in which our firmware prints them.
    pub const PAPER: [Self; 4] = [Self::FLEX_LEFT, Self::FLEX_RIGHT, Self::PAD_LEFT, Self::PAD_RIGHT];

    const fn of_paper(index: usize) -> Self {
        Self { list: SensorList(&PAPER), index }
    }

    /// Its row of the gripper file.
    pub fn row(self) -> &'static SensorRow {
        &self.list.0[self.index]
    }

    /// Its place in the list.
    pub fn index(self) -> usize {
        self.index
    }

    /// The list that it belongs to.
    pub fn list(self) -> SensorList {
        self.list
    }

    /// Name of its column in the board's lines.
    pub fn channel(self) -> &'static str {
        &self.row().name
    }

    /// True for the names that boards may give its column: case, blanks, hyphens and underscores are ignored.
    pub fn is_called(self, name: &str) -> bool {
        self.row().is_called(name)
    }

    /// Its kind.
    pub fn kind(self) -> SensorKind {
        self.row().kind
    }

    /// True for the strips, which read curvature.
    pub fn is_flex(self) -> bool {
        self.kind() == SensorKind::Flex
    }

    /// The finger that carries it; empty for a sensor of the whole hand.
    pub fn finger(self) -> &'static str {
        &self.row().finger
    }

    /// The simulated finger of that name.
    pub fn side(self) -> Option<Side> {
        Side::BOTH.into_iter().find(|side| side.name() == self.finger())
    }

    /// Display name: `left flex strip`, `left distal pad`, `chamber`.
    pub fn label(self) -> String {
        let row = self.row();
        let kind = match row.kind {
            SensorKind::Raw => return row.name.to_string(),
            SensorKind::Flex => "flex strip",
            SensorKind::Pad => "pad",
        };
        let place = self.place().replace('_', " ");
        [&row.finger, place.as_str(), kind].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" ")
    }

    /// The strip that tells how its finger is bent under it: that of the same place, else the first.
    pub fn strip(self) -> Option<Self> {
        let mut strips = self.list.on(SensorKind::Flex, self.finger());
        let same = strips.find(|strip| strip.place() == self.place());
        same.or_else(|| self.list.on(SensorKind::Flex, self.finger()).next())
    }

    /// Place along the finger in names of channels: that of the file, or the sensor's name where others of its kind are on
    /// the finger.
    pub fn place(self) -> &'static str {
        let row = self.row();
        let alone = self.list.on(row.kind, &row.finger).count() == 1;
        if !row.place.is_empty() || alone { &row.place } else { &row.name }
    }

    /// The unit of a raw sensor's values; empty where it is not known.
    pub fn raw_unit_name(self) -> &'static str {
        self.row().raw_unit().map_or("", |unit| unit.dimension.unit())
    }

    /// The value of a raw sensor's counts, in its unit's base unit.
    pub fn raw_value(self, counts: f64) -> f64 {
        let row = self.row();
        counts * row.scale.unwrap_or(1.0) * row.raw_unit().map_or(1.0, |unit| unit.factor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Channel, SignalDefinition};

    const SEVEN: &str = r#"
        [[sensor]]
        name = "flexL"
        finger = "left"
        kind = "flex"
        [[sensor]]
        name = "padL1"
        finger = "left"
        kind = "force"
        place = "proximal"
        [[sensor]]
        name = "padL2"
        finger = "left"
        kind = "force"
        place = "distal"
        [[sensor]]
        name = "flexT"
        finger = "thumb"
        kind = "flex"
        from_m = 0.02
        length_m = 0.05
        [[sensor]]
        name = "chamber"
        kind = "raw"
        unit = "kPa"
        scale = 0.05
    "#;

    #[test]
    fn a_file_names_channels_and_what_is_wrong_with_it() {
        let list = SensorList::parse(SEVEN).expect("sound");
        let names: Vec<String> = list.channels().iter().map(Channel::name).collect();
        assert_eq!(
            names,
            [
                "curvature_left",
                "curvature_thumb",
                "pressure_left_proximal",
                "pressure_left_distal",
                "force_left_proximal",
                "force_left_distal",
                "chamber [Pa]"
            ]
        );
        let columns = ["pad_L2", "t1"].map(str::to_owned);
        let of_board = list.of_columns(&columns).expect("sound");
        let found: Vec<(&str, SensorKind)> = of_board.iter().map(|own| (own.channel(), own.kind())).collect();
        assert_eq!(found, [("padL2", SensorKind::Pad), ("t1", SensorKind::Raw)]);
        assert_eq!(list.called("PAD_L2").map(Sensor::label).as_deref(), Some("left distal pad"));
        assert_eq!(list.called("padL1").and_then(Sensor::strip).map(Sensor::channel), Some("flexL"));
        assert!((list.called("chamber").expect("there").raw_value(10.0) - 500.0).abs() < 1e-9);
        for channel in list.channels() {
            assert_eq!(list.iter().filter(|sensor| sensor.gives(&channel)).count(), 1, "{}", channel.name());
        }
        let refused = |from: &str, to: &str| SensorList::parse(&SEVEN.replace(from, to)).expect_err(to);
        assert!(refused("\"distal\"", "\"proximal\"").contains("two sensors are the left proximal pad"));
        assert!(refused("\"chamber\"", "\"p_bar\"").contains("are taken"));
        assert!(refused("kPa", "cups").contains("not known"));
        assert!(refused("padL2", "pad_l1").contains("two sensors are called"));
        assert!(refused("finger = \"thumb\"", "fingr = \"thumb\"").contains("fingr"));
    }

    #[test]
    fn the_papers_list_is_the_default_and_survives_its_file() {
        let paper = SensorList::default();
        assert_eq!(SensorList::parse(&paper.to_toml()), Ok(paper));
        let names = paper.channels().iter().map(Channel::name).collect::<Vec<_>>();
        let whole = crate::whole_fingers(SignalDefinition::Parts).iter().map(Channel::name).collect::<Vec<_>>();
        assert_eq!(names, whole);
        let again = SensorList::parse(SEVEN).expect("sound");
        let text = serde_json::to_string(&again).expect("plain");
        assert_eq!(serde_json::from_str::<SensorList>(&text).expect("just written"), again);
        assert_eq!(Sensor::PAD_LEFT.strip(), Some(Sensor::FLEX_LEFT));
        assert_eq!(Sensor::FLEX_RIGHT.label(), "right flex strip");
    }
}
