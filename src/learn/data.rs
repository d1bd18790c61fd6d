//! Labelled grasps, and their splits into training and test sets.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Readings of one grasp: rows of channels over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sequence {
    /// Times since the start of the grasp, ascending (s).
    pub t_s: Vec<f32>,
    /// Readings, `[samples][channels]`, in the units of the channels.
    pub values: Vec<f32>,
}

impl Sequence {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.t_s.len()
    }

    /// True without samples.
    pub fn is_empty(&self) -> bool {
        self.t_s.is_empty()
    }

    /// Iterates over samples: time (s) and one value per channel.
    pub fn rows(&self) -> impl Iterator<Item = (f32, &[f32])> {
        let width = self.values.len() / self.t_s.len().max(1);
        self.t_s.iter().copied().zip(self.values.chunks_exact(width.max(1)))
    }

    /// Hash of times and readings: equal for copies of one grasp.
    pub fn content(&self) -> u64 {
        fnv_1a(self.t_s.iter().chain(&self.values).flat_map(|x| x.to_bits().to_le_bytes()))
    }

    /// Truncates the sequence after a time (s).
    pub fn until(&self, t: f32) -> Self {
        let count = self.t_s.partition_point(|&own| own <= t);
        let width = self.values.len() / self.t_s.len().max(1);
        Self { t_s: self.t_s[..count].to_vec(), values: self.values[..count * width].to_vec() }
    }
}

/// Hash of bytes (Fowler-Noll-Vo, FNV-1a).
pub(crate) fn fnv_1a(bytes: impl IntoIterator<Item = u8>) -> u64 {
    let mix = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    bytes.into_iter().fold(0xcbf2_9ce4_8422_2325, mix)
}

/// Class of objects that are none of the other classes. Methods that know it give it the prior of one class, however many grasps it has.
pub const OTHER: &str = "other";

/// Object class, with its size and shape class for stage one.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Class {
    pub name: String,
    /// Size class, an index into [`Labels::sizes`]; `None` if unknown.
    pub size: Option<usize>,
    /// Shape class, an index into [`Labels::shapes`]; `None` if unknown.
    pub shape: Option<usize>,
}

/// Classes, sizes and shapes that a recogniser distinguishes.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Labels {
    /// Object classes.
    pub classes: Vec<Class>,
    /// Names of the size classes.
    pub sizes: Vec<String>,
    /// Names of the shape classes.
    pub shapes: Vec<String>,
}

impl Labels {
    /// Index of a class by its name.
    pub fn class(&self, name: &str) -> Option<usize> {
        self.classes.iter().position(|class| class.name == name)
    }

    /// Index of the class [`OTHER`].
    pub fn other(&self) -> Option<usize> {
        self.class(OTHER)
    }

    /// These classes, and after them those of others that are not among them.
    pub fn with(&self, others: &Self) -> Self {
        let mut both = self.clone();
        let place = |names: &mut Vec<String>, name: &String| {
            let at = names.iter().position(|own| own == name);
            at.unwrap_or_else(|| {
                names.push(name.clone());
                names.len() - 1
            })
        };
        for class in others.classes.iter().filter(|class| self.class(&class.name).is_none()) {
            let size = class.size.and_then(|k| others.sizes.get(k)).map(|name| place(&mut both.sizes, name));
            let shape = class.shape.and_then(|k| others.shapes.get(k)).map(|name| place(&mut both.shapes, name));
            both.classes.push(Class { name: class.name.clone(), size, shape });
        }
        both
    }

    /// True if at least one class has a size and one a shape, as stage one requires.
    pub fn have_properties(&self) -> bool {
        self.classes.iter().any(|class| class.size.is_some()) && self.classes.iter().any(|class| class.shape.is_some())
    }
}

/// One labelled grasp.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Example {
    /// Number of the trial in the store.
    pub id: i64,
    /// Index of its class.
    pub class: usize,
    /// Readings.
    pub grasp: Arc<Sequence>,
    /// Hash of the grasp: trials with equal content are the same grasp, stored twice.
    pub content: u64,
    /// Number of the trial made just before, if the object has stayed as that one released it.
    pub after: Option<i64>,
    /// Group of similar poses, to leave poses out of the training.
    pub pose: u32,
    /// Session of a trial that was not simulated.
    pub session: u32,
    /// Readings before the gripper began to close, of trials that have them.
    pub rest: Option<Arc<Sequence>>,
    /// Readings of the same grasp by other sensors, which models learn too and nobody is tested on.
    pub further: Vec<Arc<Sequence>>,
}

/// Origin of a data set.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DataCard {
    /// Collections of the grasps.
    pub collections: Vec<String>,
    /// Pose preset; `None` unless all grasps were simulated with the same one.
    pub preset: Option<String>,
    /// `free`, `fixed` or `free and fixed` for simulated grasps; `recorded` for others.
    pub object: String,
    /// Number of grasps.
    pub grasps: usize,
    /// Sensor layout of simulated grasps.
    pub layout: Option<String>,
    /// Sensors of the gripper file through which grasps were read, as JSON; none for those of a layout.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gripper: Option<String>,
    /// Sensor model of simulated grasps.
    pub sensors: Option<String>,
    /// Number of times that drawn or noisy sensors read each simulated grasp, where it is not one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub draws: Option<u32>,
    /// Definition of the signals of simulated grasps: `parts`, as on a real gripper, or `contact` or `hull`, which only
    /// simulations have.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub signals: Option<String>,
    /// Rate at which the readings were read (Hz); as they were sampled if `None`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<f64>,
    /// End of the readings, other than the end of the hold: `whole`, or a time (s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cut: Option<String>,
    /// Number of grasps left out.
    #[serde(default)]
    pub left_out: usize,
    /// The same by reason: not sound, pulled by hand, flagged, copies of other trials, not calibrated.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub left_out_for: BTreeMap<String, usize>,
    /// Query that chose the grasps: `preset B, since 2026-11-21`; empty for all.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub query: String,
    /// What grasps of different kinds were mixed without being asked for, and how to choose one kind.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mixed: Vec<String>,
    /// True where grasps of an emulated gripper are among the recorded ones.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub emulated: bool,
    /// Version of the physics; `None` unless all simulated grasps have the same one, and where it is unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub physics: Option<u32>,
    /// Hashes of the fingers of simulated grasps, none for those by default; empty where all had these.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fingers: Vec<Option<String>>,
    /// Numbers of the calibrations of recorded grasps.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub calibrations: Vec<i64>,
}

impl DataCard {
    /// True where no grasp was simulated.
    pub fn is_recorded(&self) -> bool {
        self.object == "recorded"
    }

    /// True for simulated grasps read through perfect sensors.
    pub fn from_perfect_sensors(&self) -> bool {
        self.sensors.as_deref() == Some("virtual")
    }

    /// The supports of objects for which a model of these grasps answers: fixed (true), free, or both.
    pub fn supports(&self) -> impl Iterator<Item = bool> + use<> {
        let learned = self.fixed();
        [false, true].into_iter().filter(move |fixed| learned.is_none_or(|learned| learned == *fixed))
    }

    /// True where grasps of these fingers, by their hash, were among them.
    pub fn has_fingers(&self, fingers: &Option<String>) -> bool {
        if self.fingers.is_empty() { fingers.is_none() } else { self.fingers.contains(fingers) }
    }

    /// Whether the object was fixed in place in all simulated grasps (true) or in none; `None` for mixed and recorded ones.
    pub fn fixed(&self) -> Option<bool> {
        match self.object.split(',').next() {
            Some("fixed") => Some(true),
            Some("free") => Some(false),
            _ => None,
        }
    }

    /// One-line summary: `preset B, object free, virtual sensors, C1`.
    pub fn described(&self) -> String {
        let mut parts = Vec::new();
        parts.extend(self.preset.as_ref().map(|preset| format!("preset {preset}")));
        parts.push(if self.is_recorded() { "recorded grasps".to_owned() } else { format!("object {}", self.object) });
        parts.extend(self.emulated.then(|| "some of an emulated gripper".to_owned()));
        parts.extend(self.sensors.as_ref().map(|sensors| match self.draws {
            Some(draws) => format!("{draws} times {sensors} sensors"),
            None => format!("{sensors} sensors"),
        }));
        parts.extend(self.layout.clone());
        parts.extend(self.signals.as_ref().filter(|own| *own != "parts").map(|own| format!("{own} pressure")));
        parts.extend(self.rate_hz.map(|rate_hz| format!("{rate_hz} Hz")));
        parts.extend(self.cut.as_ref().map(|cut| match cut.as_str() {
            "whole" => "with the release".to_owned(),
            seconds => format!("first {seconds} s"),
        }));
        parts.extend((self.left_out > 0).then(|| match self.left_out_for.len() {
            0 => format!("{} left out as not sound", self.left_out),
            _ => format!("{} left out ({})", self.left_out, counted(&self.left_out_for)),
        }));
        parts.join(", ")
    }

    /// Lines for the head of a table: the summary, the query, and a warning for each kind of grasps that were mixed.
    pub fn lines(&self) -> Vec<String> {
        let query = if self.query.is_empty() { "all trials" } else { &self.query };
        let mixed = self.mixed.iter().map(|mixed| format!("warning: mixed {mixed}"));
        [self.described(), format!("query: {query}")].into_iter().chain(mixed).collect()
    }
}

/// Counts in a sentence: `2 flagged, 3 not sound`.
pub fn counted(counts: &BTreeMap<String, usize>) -> String {
    counts.iter().map(|(reason, count)| format!("{count} {reason}")).collect::<Vec<_>>().join(", ")
}

/// Labelled grasps with the same channels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Dataset {
    /// Names of the channels.
    pub channels: Vec<String>,
    /// Classes, sizes and shapes.
    pub labels: Labels,
    /// The grasps.
    pub examples: Vec<Example>,
    /// Origin.
    pub about: DataCard,
}

impl Dataset {
    /// Selects some of the grasps, by index.
    pub fn part(&self, of: &[usize]) -> Self {
        Self {
            channels: self.channels.clone(),
            labels: self.labels.clone(),
            examples: of.iter().map(|&k| self.examples[k].clone()).collect(),
            about: DataCard { grasps: of.len(), ..self.about.clone() },
        }
    }

    /// The same grasps with other channels: values from the number of a grasp and each of its rows of readings.
    pub fn with_channels(&self, channels: Vec<String>, values: impl Fn(usize, &[f32]) -> Vec<f32>) -> Self {
        let example = |(k, example): (usize, &Example)| {
            let values = example.grasp.rows().flat_map(|(_, row)| values(k, row)).collect();
            Example { grasp: Arc::new(Sequence { t_s: example.grasp.t_s.clone(), values }), ..example.clone() }
        };
        let examples = self.examples.iter().enumerate().map(example).collect();
        Self { channels, examples, labels: self.labels.clone(), about: self.about.clone() }
    }

    /// Renumbers classes by another list of labels; `None` if that lacks one of the classes.
    pub fn relabelled(&self, labels: &Labels) -> Option<Self> {
        let known: Option<Vec<usize>> =
            self.examples.iter().map(|e| labels.class(&self.labels.classes[e.class].name)).collect();
        let mut other = Self { labels: labels.clone(), ..self.clone() };
        other.examples.iter_mut().zip(known?).for_each(|(example, class)| example.class = class);
        Some(other)
    }

    /// The same without classes that have no grasps.
    pub fn without_empty_classes(&self) -> Self {
        let by_class = self.by_class();
        let mut labels = self.labels.clone();
        let mut number = 0;
        labels.classes.retain(|_| {
            number += 1;
            !by_class[number - 1].is_empty()
        });
        // All remaining examples belong to remaining classes.
        self.relabelled(&labels).unwrap_or_else(|| self.clone())
    }

    /// These grasps and those of another data set, whose further classes come after these; `None` where that has other channels.
    pub fn with(&self, other: &Self) -> Option<Self> {
        let labels = self.labels.with(&other.labels);
        let (mut both, other) = (self.relabelled(&labels)?, other.relabelled(&labels)?);
        (both.channels == other.channels).then(|| {
            both.examples.extend(other.examples);
            both.about.grasps = both.examples.len();
            both
        })
    }

    /// Adds the readings of the same grasps in another data set as further ones.
    pub fn add_readings(&mut self, other: &Self) {
        let of: BTreeMap<i64, &Example> = other.examples.iter().map(|example| (example.id, example)).collect();
        for example in &mut self.examples {
            let other = of.get(&example.id).into_iter();
            example.further.extend(other.flat_map(|own| std::iter::once(&own.grasp).chain(&own.further).cloned()));
        }
    }

    /// Shuffles the labels among the grasps, as a control.
    pub fn with_shuffled_labels(&self, seed: u64) -> Self {
        let mut truth = self.truth();
        truth.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
        let mut shuffled = self.clone();
        shuffled.examples.iter_mut().zip(truth).for_each(|(example, class)| example.class = class);
        shuffled
    }

    /// The data set with an example for each further reading. It follows the first of its grasp, so that no split parts them.
    pub(crate) fn with_further(&self) -> Cow<'_, Self> {
        if self.examples.iter().all(|example| example.further.is_empty()) {
            return Cow::Borrowed(self);
        }
        let all_of = |example: &Example| {
            let first = Example { further: Vec::new(), ..example.clone() };
            let read = |grasp| Example { grasp: Arc::clone(grasp), after: Some(example.id), ..first.clone() };
            let further = example.further.iter().map(read);
            std::iter::once(first.clone()).chain(further).collect::<Vec<_>>()
        };
        Cow::Owned(Self { examples: self.examples.iter().flat_map(all_of).collect(), ..self.clone() })
    }

    /// Median duration of the grasps (s); 1 without grasps.
    pub(crate) fn median_duration_s(&self) -> f32 {
        let mut ends: Vec<f32> = self.examples.iter().filter_map(|e| e.grasp.t_s.last().copied()).collect();
        ends.sort_by(f32::total_cmp);
        ends.get(ends.len() / 2).copied().unwrap_or(1.0)
    }

    /// Session of each grasp; empty where all are of one.
    pub fn sessions(&self) -> Vec<u32> {
        let own: Vec<u32> = self.examples.iter().map(|example| example.session).collect();
        if own.windows(2).all(|pair| pair[0] == pair[1]) { Vec::new() } else { own }
    }

    /// Class of each grasp.
    pub fn truth(&self) -> Vec<usize> {
        self.examples.iter().map(|example| example.class).collect()
    }

    /// Indices of the grasps of each class, in order.
    pub fn by_class(&self) -> Vec<Vec<usize>> {
        let mut by_class = vec![Vec::new(); self.labels.classes.len()];
        for (k, example) in self.examples.iter().enumerate() {
            by_class[example.class].push(k);
        }
        by_class
    }

    /// Successions of one class: series of grasps between which the object stays as released.
    pub(crate) fn successions(&self, members: &[usize]) -> Vec<Vec<usize>> {
        let mut ends: BTreeMap<i64, usize> = BTreeMap::new();
        let mut successions: Vec<Vec<usize>> = Vec::new();
        for &k in members {
            let example = &self.examples[k];
            let place = example.after.and_then(|before| ends.remove(&before)).unwrap_or_else(|| {
                successions.push(Vec::new());
                successions.len() - 1
            });
            successions[place].push(k);
            ends.insert(example.id, place);
        }
        successions
    }

    /// Assigns each grasp a random part, 0 to `parts - 1`, stratified by class. A succession stays in one part, unless
    /// it is the only one of its class: then the class would be missing when that part is left out.
    pub(crate) fn folds(&self, parts: usize, seed: u64) -> Vec<usize> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut fold = vec![0; self.examples.len()];
        // Classes start at different parts, so that parts have equal size.
        for (class, members) in self.by_class().into_iter().enumerate() {
            let mut successions = self.successions(&members);
            if successions.len() == 1 {
                successions = members.into_iter().map(|k| vec![k]).collect();
            }
            successions.shuffle(&mut random);
            for (n, succession) in successions.into_iter().enumerate() {
                succession.into_iter().for_each(|k| fold[k] = (n + class) % parts.max(1));
            }
        }
        fold
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hashes_are_those_of_its_authors() {
        assert_eq!(fnv_1a([]), 0xcbf2_9ce4_8422_2325);
        assert_eq!(fnv_1a("foobar".bytes()), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn readings_of_the_same_grasps_are_added_to_them() {
        let read = |value: f32| Arc::new(Sequence { t_s: vec![0.0], values: vec![value] });
        let example = |id: i64, values: &[f32]| Example {
            id,
            grasp: read(values[0]),
            further: values[1..].iter().map(|value| read(*value)).collect(),
            ..Example::default()
        };
        let of = |examples: Vec<Example>| Dataset { examples, ..Dataset::default() };
        let mut data = of(vec![example(1, &[1.0]), example(2, &[2.0]), example(3, &[3.0])]);
        data.add_readings(&of(vec![example(3, &[3.1, 3.2]), example(1, &[1.1]), example(9, &[9.0])]));
        let wanted = [example(1, &[1.0, 1.1]), example(2, &[2.0]), example(3, &[3.0, 3.1, 3.2])];
        assert_eq!(data.examples, wanted);
        assert_eq!(data.with_further().examples.len(), 6);
    }

    #[test]
    fn the_median_is_that_of_the_ends() {
        let example = |end: f32| Example {
            grasp: Arc::new(Sequence { t_s: vec![0.0, end], values: vec![0.0; 2] }),
            ..Example::default()
        };
        let of = |ends: &[f32]| {
            let examples = ends.iter().copied().map(example).collect();
            Dataset { examples, ..Dataset::default() }.median_duration_s()
        };
        assert_eq!([of(&[]), of(&[4.0, 2.0, 9.0]), of(&[2.0, 4.0])], [1.0, 4.0, 4.0]);
    }
}
