//! Scene files. An unknown key is an error that names the nearest key there is: a misspelt `modulus` must not
//! leave the default in force in silence.

use super::Scene;
use crate::gripper::FittedRanges;
use crate::objects::anchored;
use std::path::Path;

/// Error of a scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    #[error("the scene is not understood: {0}")]
    Syntax(String),
    #[error("{0}")]
    Refused(String),
}

/// A key of the scene file that holds a value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneKey {
    /// Its name with its tables: `gripper.pad.modulus`.
    pub name: String,
    /// Default value, as TOML writes it.
    pub default: String,
}

impl SceneKey {
    /// True where it holds numbers that need not be whole, or could.
    pub fn holds_fractions(&self) -> bool {
        !matches!(Scene::default().with_settings(&[self.with("1.5")]), Err(SceneError::Syntax(_)))
    }

    /// A setting of it, for [`Scene::with_settings`], in which its first number is another.
    pub fn with(&self, number: &str) -> String {
        let mut value = self.default.clone();
        match self.number() {
            Some(place) => value.replace_range(place, number),
            None => number.clone_into(&mut value),
        }
        format!("{}={value}", self.name)
    }

    /// Range of its first number in the default.
    fn number(&self) -> Option<std::ops::Range<usize>> {
        let from = self.default.find(|c: char| c.is_ascii_digit() || c == '-')?;
        let end = self.default[from..].find(|c: char| !(c.is_ascii_alphanumeric() || "+-._".contains(c)));
        Some(from..end.map_or(self.default.len(), |end| from + end))
    }
}

/// Keys that say which object it is.
const OF_OBJECT: [&str; 2] = ["object.source", "object.name"];

/// Scene files larger than this are refused before parsing (bytes).
const LARGEST_FILE: u64 = 1 << 20;

impl SceneError {
    /// A key that no scene has, and the known one that looks most like it.
    fn unknown_key(key: &str, nearest: Option<String>) -> Self {
        let nearest = nearest.map_or_else(String::new, |nearest| format!("; did you mean \"{nearest}\"?"));
        Self::Refused(format!("the scene has no key \"{key}\"{nearest}"))
    }
}

impl Scene {
    /// Reads, checks keys, fills in defaults and checks ranges.
    pub fn from_toml(text: &str) -> Result<Self, SceneError> {
        let written: toml::Table = text.parse().map_err(|e| syntax(&e))?;
        check_keys(&written, &known_keys(), "")?;
        let scene: Self = toml::from_str(text).map_err(|e| syntax(&e))?;
        scene.check()?;
        Ok(scene)
    }

    /// The scene with some keys changed, each written as `gripper.finger.joints=20`.
    ///
    /// Text values need no quotes: `object.source=lemon`.
    pub fn with_settings(&self, settings: &[String]) -> Result<Self, SceneError> {
        let mut document: toml::Table = self.to_toml().parse().map_err(|e| syntax(&e))?;
        for setting in settings {
            let (key, value) = setting
                .split_once('=')
                .ok_or_else(|| SceneError::Syntax(format!("\"{setting}\" does not set anything; write KEY=VALUE")))?;
            set_key(&mut document, key.trim(), parse_value(value.trim()))?;
        }
        Self::from_toml(&document.to_string())
    }

    /// Reads a scene file. A relative path of an object file counts from the scene file's folder.
    pub fn from_file(path: &Path) -> Result<Self, SceneError> {
        let unreadable =
            |cause: String| SceneError::Refused(format!("cannot read the scene \"{}\": {cause}", path.display()));
        let text = palpate_geometry::read_text(path, LARGEST_FILE).map_err(|e| unreadable(e.to_string()))?;
        let mut scene = Self::from_toml(&text)?;
        let beside = path.parent().unwrap_or(Path::new("")).join(&scene.object.source);
        let beside = beside.to_str().filter(|_| beside.is_file());
        scene.object.source = anchored(beside.unwrap_or(&scene.object.source));
        Ok(scene)
    }

    /// All keys that hold a value, or a list of them.
    pub fn keys() -> Vec<SceneKey> {
        let mut keys = Vec::new();
        collect_values(&known_keys(), "", &mut keys);
        keys
    }

    /// Settings that differ from the defaults, one a line, without the object's name or path: equal for equal scenes, also
    /// for a later version that has more settings. Whoever changes a default raises [`crate::PHYSICS_VERSION`]: the same
    /// lines then stand for another scene.
    pub fn differences(&self) -> String {
        let values = |table: &toml::Table| {
            let mut values = Vec::new();
            collect_values(table, "", &mut values);
            values
        };
        let usual = values(&known_keys());
        let own = toml::Table::try_from(self).expect("a scene is a table");
        let own =
            values(&own).into_iter().filter(|key| !OF_OBJECT.contains(&key.name.as_str()) && !usual.contains(key));
        own.map(|SceneKey { name, default: value }| format!("{name}={value}\n")).collect()
    }

    /// The whole scene as TOML, every key written out.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("a scene holds only tables, numbers and text, which TOML can write")
    }
}

/// A value as TOML reads it, or else the text itself.
fn parse_value(text: &str) -> toml::Value {
    let document = format!("x = {text}").parse::<toml::Table>();
    let value = document.ok().and_then(|mut table| table.remove("x"));
    value.unwrap_or_else(|| toml::Value::String(text.to_owned()))
}

/// Sets a dotted key; an optional table begins with its defaults.
fn set_key(document: &mut toml::Table, key: &str, value: toml::Value) -> Result<(), SceneError> {
    let known = known_keys();
    let beside =
        |prefix: &str| prefix.split_terminator('.').try_fold(&known, |table, name| table.get(name)?.as_table());
    let unknown = |prefix: &str, last: &str| {
        let beside = beside(prefix);
        let nearest = nearest_key(last, beside.unwrap_or(&known), if beside.is_some() { prefix } else { "" });
        SceneError::unknown_key(key, nearest)
    };
    let (tables, last) = key.rsplit_once('.').unwrap_or(("", key));
    let mut table = document;
    let mut prefix = String::new();
    for name in tables.split_terminator('.') {
        if let Some(optional) = beside(&prefix).and_then(|own| own.get(name)).filter(|_| !table.contains_key(name)) {
            table.insert(name.to_owned(), optional.clone());
        }
        let inner = table.get_mut(name).and_then(toml::Value::as_table_mut);
        table = inner.ok_or_else(|| unknown(&prefix, name))?;
        prefix.push_str(name);
        prefix.push('.');
    }
    if let Some(optional) = beside(&prefix).and_then(|own| own.get(last)).filter(|_| !table.contains_key(last)) {
        table.insert(last.to_owned(), optional.clone());
    }
    match table.get_mut(last) {
        // A whole number where a fraction is expected is what people write.
        Some(slot @ toml::Value::Float(_)) => {
            *slot = match value {
                toml::Value::Integer(x) => toml::Value::Float(x as f64),
                other => other,
            };
            Ok(())
        }
        Some(slot) => {
            *slot = value;
            Ok(())
        }
        None => Err(unknown(&prefix, last)),
    }
}

fn syntax(error: &toml::de::Error) -> SceneError {
    SceneError::Syntax(error.to_string().trim_end().to_owned())
}

/// The default scene with everything optional as a table: its keys are the keys there are.
fn known_keys() -> toml::Table {
    let mut scene = Scene::default();
    scene.gripper.fitted = Some(FittedRanges::default());
    scene.object.name = Some(String::new());
    toml::Table::try_from(scene).expect("a scene is a table")
}

fn check_keys(written: &toml::Table, known: &toml::Table, prefix: &str) -> Result<(), SceneError> {
    for (key, value) in written {
        let Some(template) = known.get(key) else {
            return Err(SceneError::unknown_key(&format!("{prefix}{key}"), nearest_key(key, known, prefix)));
        };
        let inner = format!("{prefix}{key}.");
        match (value, template) {
            (toml::Value::Table(written), toml::Value::Table(known)) => check_keys(written, known, &inner)?,
            // A list of numbers has one length; further numbers would be dropped in silence.
            (toml::Value::Array(rows), toml::Value::Array(templates))
                if templates.iter().all(|template| template.is_float()) && rows.len() != templates.len() =>
            {
                let (found, wanted) = (rows.len(), templates.len());
                return Err(SceneError::Refused(format!("{prefix}{key} has {found} numbers; it takes {wanted}")));
            }
            (toml::Value::Array(rows), toml::Value::Array(templates)) => {
                for (row, template) in rows.iter().zip(templates.iter().cycle()) {
                    if let (toml::Value::Table(row), toml::Value::Table(template)) = (row, template) {
                        check_keys(row, template, &inner)?;
                    }
                }
            }
            _ => {}
        }
    }
    Ok(())
}

/// The known key most like the unknown one: first beside it, then anywhere in the scene.
fn nearest_key(key: &str, beside: &toml::Table, prefix: &str) -> Option<String> {
    let mut candidates: Vec<(String, String)> = beside.keys().map(|k| (k.clone(), format!("{prefix}{k}"))).collect();
    collect_keys(&known_keys(), "", &mut candidates);
    let likeness = |name: &str| strsim::jaro_winkler(key, name);
    candidates
        .into_iter()
        .map(|(name, full)| (likeness(&name), full))
        .filter(|(likeness, _)| *likeness > 0.7)
        // The first of equals wins, so that a key in the same table is preferred.
        .reduce(|best, next| if next.0 > best.0 { next } else { best })
        .map(|(_, full)| full)
}

fn collect_keys(table: &toml::Table, prefix: &str, into: &mut Vec<(String, String)>) {
    for (key, value) in table {
        into.push((key.clone(), format!("{prefix}{key}")));
        if let toml::Value::Table(inner) = value {
            collect_keys(inner, &format!("{prefix}{key}."), into);
        }
    }
}

fn collect_values(table: &toml::Table, prefix: &str, into: &mut Vec<SceneKey>) {
    for (key, value) in table {
        let name = format!("{prefix}{key}");
        match value {
            toml::Value::Table(inner) => collect_values(inner, &format!("{name}."), into),
            value => into.push(SceneKey { name, default: value.to_string() }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Accuracy, Auto};

    #[test]
    fn differences_are_those_from_the_defaults() {
        let mut scene = Scene::default();
        scene.object.source = "lemon".to_owned();
        assert_eq!(scene.differences(), "");
        scene.object.mass = Auto::Value(0.25);
        scene.gripper.mount.yaw_deg = 12.5;
        assert_eq!(scene.differences(), "gripper.mount.yaw_deg=12.5\nobject.mass=0.25\n");
    }

    #[test]
    fn a_scene_survives_a_round_trip() {
        let mut scene = Scene::default();
        scene.object.mass = Auto::Value(0.25);
        scene.solver.accuracy = Accuracy::Reference;
        assert_eq!(Scene::from_toml(&scene.to_toml()), Ok(scene));
        assert_eq!(Scene::from_toml(""), Ok(Scene::default()));
    }

    #[test]
    fn a_few_keys_are_enough() {
        let scene = Scene::from_toml("[object]\nsource = \"ball\"\nmass = 1\n[gripper.finger]\njoints = 20\n");
        let scene = scene.expect("valid");
        assert_eq!((scene.object.source.as_str(), scene.gripper.finger.joints), ("ball", 20));
        assert_eq!(scene.object.mass, Auto::Value(1.0));
    }

    #[test]
    fn a_misspelt_key_is_named_with_the_nearest() {
        let message = |text: &str| Scene::from_toml(text).expect_err("unknown").to_string();
        let text = message("[gripper.pad]\nmodolus = 2e5\n");
        assert!(text.contains("gripper.pad.modolus") && text.contains("\"gripper.pad.modulus\""), "{text}");
        // A key in the wrong table is found where it belongs.
        assert!(message("[solver]\nopening = 0.1\n").contains("gripper.mount.opening"));
        assert!(message("[gripper.actuation]\ncurve = [{bar = 0, torqe = 1}]\n").contains("torque"));
        assert!(message("zzzz = 1\n").contains("no key \"zzzz\""));
    }

    #[test]
    fn every_key_can_be_set_to_its_own_value() {
        let keys = Scene::keys();
        assert!(keys.len() > 40 && keys.iter().filter(|key| key.holds_fractions()).count() > 30);
        for key in &keys {
            let setting = format!("{}={}", key.name, key.default);
            let mut same = Scene::default();
            same.gripper.fitted = key.name.starts_with("gripper.fitted.").then(FittedRanges::default);
            same.object.name = (key.name == "object.name").then(String::new);
            assert_eq!(Scene::default().with_settings(&[setting]), Ok(same), "{}", key.name);
        }
        let key = |name: &str| keys.iter().find(|key| key.name == name).expect("there");
        assert_eq!(key("object.rotation_deg").with("7"), "object.rotation_deg=[7, 0.0, 0.0]");
        assert_eq!(key("object.mass").with("nan"), "object.mass=nan");
        assert_eq!(key("gripper.pad.modulus").with("-inf"), "gripper.pad.modulus=-inf");
    }

    #[test]
    fn settings_change_single_keys() {
        let set = |settings: &[&str]| {
            let settings: Vec<String> = settings.iter().map(|s| (*s).to_owned()).collect();
            Scene::default().with_settings(&settings)
        };
        let scene = set(&["gripper.finger.joints=20", "object.source=ball", "world.gravity = 0", "object.mass=0.1"]);
        let scene = scene.expect("valid");
        assert_eq!((scene.gripper.finger.joints, scene.object.source.as_str()), (20, "ball"));
        assert_eq!((scene.world.gravity, scene.object.mass), (0.0, Auto::Value(0.1)));
        let message = |setting: &str| set(&[setting]).expect_err("refused").to_string();
        assert!(message("gripper.finger.joint=20").contains("gripper.finger.joints"));
        assert!(message("gripper.fingr.joints=20").contains("gripper.finger"));
        assert!(message("nonsense").contains("KEY=VALUE"));
        assert!(message("gripper.finger.joints=500").contains("between 2 and 80"));
    }

    #[test]
    fn wrong_kinds_and_broken_text_give_different_errors() {
        assert!(matches!(Scene::from_toml("[solver\n"), Err(SceneError::Syntax(_))));
        assert!(matches!(Scene::from_toml("[solver]\naccuracy = \"best\"\n"), Err(SceneError::Syntax(_))));
        assert!(matches!(Scene::from_toml("[object]\nmass = \"heavy\"\n"), Err(SceneError::Syntax(_))));
        assert!(matches!(Scene::from_toml("[world]\ngravity = nan\n"), Err(SceneError::Refused(_))));
    }
}
