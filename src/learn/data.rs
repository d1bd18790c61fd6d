//! Labelled grasps as recognisers see them, and how they are split.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Readings of one grasp: rows of channels over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sequence {
    /// Times since the start of the grasp, rising (s).
    pub t_s: Vec<f32>,
    /// One row per time, in the order of the data set's channels.
    pub values: Vec<f32>,
}

impl Sequence {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.t_s.len()
    }

    /// True when nothing was sampled.
    pub fn is_empty(&self) -> bool {
        self.t_s.is_empty()
    }

    /// Samples in order: time (s) and one value per channel.
    pub fn rows(&self) -> impl Iterator<Item = (f32, &[f32])> {
        let width = self.values.len() / self.t_s.len().max(1);
        self.t_s.iter().copied().zip(self.values.chunks_exact(width.max(1)))
    }

    /// The first part of it, up to a time (s).
    pub fn until(&self, t: f32) -> Self {
        let count = self.t_s.partition_point(|&own| own <= t);
        let width = self.values.len() / self.t_s.len().max(1);
        Self { t_s: self.t_s[..count].to_vec(), values: self.values[..count * width].to_vec() }
    }
}

/// What can be recognised, in words and as stage one sees it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Class {
    /// Its label.
    pub name: String,
    /// Its size class, where it has one: an index into [`Labels::sizes`].
    pub size: Option<usize>,
    /// Its shape class, where it has one: an index into [`Labels::shapes`].
    pub shape: Option<usize>,
}

/// All that a recogniser can answer.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Labels {
    /// Classes by name.
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

    /// True when every class has a size and a shape, so that stage one has something to learn.
    pub fn have_properties(&self) -> bool {
        self.classes.iter().any(|class| class.size.is_some()) && self.classes.iter().any(|class| class.shape.is_some())
    }
}

/// One labelled grasp.
#[derive(Clone, Debug, PartialEq)]
pub struct Example {
    /// What names it in its source: the trial's number in the store.
    pub id: i64,
    /// Index of its class.
    pub class: usize,
    /// Its readings.
    pub grasp: Arc<Sequence>,
}

/// Where grasps come from, as told beside every number.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DataCard {
    /// Collections the grasps are from.
    pub collections: Vec<String>,
    /// Pose preset, where all grasps were simulated with the same one.
    pub preset: Option<String>,
    /// `free` or `fixed`, where all objects were simulated alike; `recorded` for imported grasps.
    pub object: String,
    /// Number of grasps.
    pub grasps: usize,
    /// Sensor layout of simulated grasps.
    pub layout: Option<String>,
    /// Sensor model of simulated grasps.
    pub sensors: Option<String>,
    /// Grasps left out because their simulation did not stay finite or did not converge.
    #[serde(default)]
    pub left_out: usize,
}

impl DataCard {
    /// In a line: `preset B, object free, virtual sensors, C1+F`.
    pub fn described(&self) -> String {
        let mut parts = Vec::new();
        parts.extend(self.preset.as_ref().map(|preset| format!("preset {preset}")));
        parts.push(if self.object == "recorded" {
            "recorded grasps".to_owned()
        } else {
            format!("object {}", self.object)
        });
        parts.extend(self.sensors.as_ref().map(|sensors| format!("{sensors} sensors")));
        parts.extend(self.layout.clone());
        parts.extend((self.left_out > 0).then(|| format!("{} left out as not sound", self.left_out)));
        parts.join(", ")
    }
}

/// Labelled grasps with the same channels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Dataset {
    /// Names of the channels.
    pub channels: Vec<String>,
    /// What there is to recognise.
    pub labels: Labels,
    /// The grasps.
    pub examples: Vec<Example>,
    /// Where they come from.
    pub about: DataCard,
}

impl Dataset {
    /// The same data set with some of its grasps.
    pub fn part(&self, of: &[usize]) -> Self {
        Self {
            channels: self.channels.clone(),
            labels: self.labels.clone(),
            examples: of.iter().map(|&k| self.examples[k].clone()).collect(),
            about: DataCard { grasps: of.len(), ..self.about.clone() },
        }
    }

    /// The same grasps with classes numbered as another list of labels has them; `None` where it does not know one.
    pub fn relabelled(&self, labels: &Labels) -> Option<Self> {
        let known: Option<Vec<usize>> =
            self.examples.iter().map(|e| labels.class(&self.labels.classes[e.class].name)).collect();
        let mut other = Self { labels: labels.clone(), ..self.clone() };
        other.examples.iter_mut().zip(known?).for_each(|(example, class)| example.class = class);
        Some(other)
    }

    /// The same grasps with their labels exchanged at random: a control, from which nothing can be learned.
    pub fn with_shuffled_labels(&self, seed: u64) -> Self {
        let mut truth = self.truth();
        truth.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
        let mut shuffled = self.clone();
        shuffled.examples.iter_mut().zip(truth).for_each(|(example, class)| example.class = class);
        shuffled
    }

    /// The class of every grasp.
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

    /// Splits off the first `count` grasps of each class: what comes later never depends on how many come first.
    pub fn first_of_each(&self, count: usize) -> (Self, Self) {
        let (mut first, mut rest) = (Vec::new(), Vec::new());
        let mut met = vec![0; self.labels.classes.len()];
        for (k, example) in self.examples.iter().enumerate() {
            met[example.class] += 1;
            if met[example.class] <= count { first.push(k) } else { rest.push(k) }
        }
        (self.part(&first), self.part(&rest))
    }

    /// A part number from 0 to `parts - 1` for every grasp: random, but as even within each class as can be.
    pub fn folds(&self, parts: usize, seed: u64) -> Vec<usize> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut fold = vec![0; self.examples.len()];
        // Classes begin at different parts, so that parts are even in all.
        for (class, mut members) in self.by_class().into_iter().enumerate() {
            members.shuffle(&mut random);
            for (n, k) in members.into_iter().enumerate() {
                fold[k] = (n + class) % parts.max(1);
            }
        }
        fold
    }

    /// Splits into shares of each class, as in the paper's 40/40/20; the last share takes what is left.
    pub fn shares(&self, shares: &[f64], seed: u64) -> Vec<Self> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut parts = vec![Vec::new(); shares.len()];
        for mut members in self.by_class() {
            members.shuffle(&mut random);
            let (total, mut from, mut sum) = (members.len() as f64, 0, 0.0);
            for (k, (share, part)) in shares.iter().zip(&mut parts).enumerate() {
                sum += share;
                let to = if k + 1 == shares.len() { members.len() } else { (total * sum).round() as usize };
                part.extend_from_slice(&members[from..to.clamp(from, members.len())]);
                from = to.clamp(from, members.len());
            }
        }
        parts
            .into_iter()
            .map(|mut part| {
                part.sort_unstable();
                self.part(&part)
            })
            .collect()
    }
}
