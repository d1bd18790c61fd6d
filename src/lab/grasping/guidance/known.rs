//! Grasps of known objects in known poses as files: readings without answers, for any model that reads these channels.

use super::library::{TouchLibrary, usual_end_s};
use super::stance::Stance;
use palpate_learn::{Arrays, Model, Sequence, Shipped, TensorFile, encode};
use serde::{Deserialize, Serialize};

/// Readings of a grasp that are kept: means over equal times, two for each step of the networks.
const KEPT: usize = 60;
/// Time by which rounding may put a reading behind a border (s).
const BORDER_S: f32 = 1e-4;
/// Kept readings are shares of the largest of their channel, in this unit.
const UNIT: f32 = 1.0 / 32_000.0;
/// Numbers that describe a stance.
const POSE: usize = 7;

/// Names of the arrays.
const CLASSES: &str = "class";
const STANCES: &str = "stance";
const READINGS: &str = "readings";
const LARGEST: &str = "largest";

/// Grasps of known objects in known poses.
#[derive(Clone, Debug)]
pub struct KnownTouches {
    card: Card,
    grasps: Vec<(usize, Stance, Sequence)>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Card {
    channels: Vec<String>,
    classes: Vec<String>,
    /// Duration of a grasp (s).
    duration_s: f32,
    /// Origin of the grasps, for people.
    about: Vec<String>,
}

/// Reason why a file of grasps cannot be used.
#[derive(Clone, Debug, thiserror::Error)]
#[error("the grasps in known poses cannot be read: {0}")]
pub struct TouchesError(String);

impl KnownTouches {
    /// Keeps these grasps: class, pose and readings of each. They end together.
    pub fn new(
        channels: Vec<String>,
        classes: Vec<String>,
        about: Vec<String>,
        grasps: &[(usize, Stance, &Sequence)],
    ) -> Self {
        let duration_s = usual_end_s(grasps.iter().map(|(_, _, grasp)| *grasp));
        let card = Card { channels, classes, duration_s, about };
        let grasps = grasps.iter().map(|(class, stance, grasp)| (*class, *stance, card.means(grasp))).collect();
        Self { card, grasps }
    }

    /// Name of the file for a shipped model.
    pub fn file(which: Shipped) -> &'static str {
        match which {
            Shipped::PerfectSensors => "touches.safetensors",
            Shipped::AnyGripper => "touches-any-gripper.safetensors",
            Shipped::FixedObjects => "touches-fixed.safetensors",
        }
    }

    /// Those that come with the program, for the shipped models.
    pub fn shipped(which: Shipped) -> Result<Self, TouchesError> {
        Self::from_bytes(match which {
            Shipped::PerfectSensors => include_bytes!("../../../../models/touches.safetensors"),
            Shipped::AnyGripper => include_bytes!("../../../../models/touches-any-gripper.safetensors"),
            Shipped::FixedObjects => include_bytes!("../../../../models/touches-fixed.safetensors"),
        })
    }

    /// A model's answers to these grasps; none if it reads other channels.
    pub fn library(&self, model: &Model) -> Option<TouchLibrary> {
        let place = |channel: &String| self.card.channels.iter().position(|own| own == channel);
        let places: Vec<usize> = model.card.channels.iter().map(place).collect::<Option<_>>()?;
        let width = self.card.channels.len();
        let classes = &model.card.labels.classes;
        let class_of = |own: &usize| classes.iter().position(|class| class.name == self.card.classes[*own]);
        let known = self.grasps.iter().filter_map(|(class, stance, grasp)| {
            let rows = grasp.values.chunks_exact(width);
            let values = rows.flat_map(|row| places.iter().map(|place| row[*place])).collect();
            Some((class_of(class)?, *stance, Sequence { t_s: grasp.t_s.clone(), values }))
        });
        let known: Vec<(usize, Stance, Sequence)> = known.collect();
        let answered: Vec<_> = known
            .iter()
            .map(|(class, stance, grasp)| (*class, *stance, grasp, model.recogniser.recognise(grasp, None).pmf))
            .collect();
        Some(TouchLibrary::new(&model.card.channels, classes.len(), &answered))
    }

    /// Encodes them as a safetensors file.
    pub fn to_bytes(&self) -> Result<Vec<u8>, TouchesError> {
        let failed = |cause: &dyn std::fmt::Display| TouchesError(cause.to_string());
        let width = self.card.channels.len();
        let all = || self.grasps.iter().flat_map(|(_, _, grasp)| grasp.values.iter().copied().enumerate());
        let mut largest = vec![f32::MIN_POSITIVE; width];
        all().for_each(|(k, x)| largest[k % width] = largest[k % width].max(x.abs()));
        let mut arrays = Arrays::default();
        arrays.put_integers(CLASSES, self.grasps.iter().map(|(class, ..)| *class));
        let stances = self.grasps.iter().flat_map(|(_, stance, _)| stance.to_array()).collect();
        arrays.put(STANCES, &[self.grasps.len(), POSE], stances);
        // A conversion from floats saturates.
        let readings = all().map(|(k, x)| (x / largest[k % width] / UNIT).round() as i16).collect();
        arrays.put_small(READINGS, &[self.grasps.len(), KEPT * width], readings);
        arrays.put(LARGEST, &[width], largest);
        let card = serde_json::to_string(&self.card).map_err(|cause| failed(&cause))?;
        encode(card, &arrays).map_err(|cause| failed(&cause))
    }

    /// Decodes a file.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, TouchesError> {
        let failed = |cause: &dyn std::fmt::Display| TouchesError(cause.to_string());
        let file = TensorFile::decode(bytes).map_err(|cause| failed(&cause))?;
        let card: Card = serde_json::from_str(&file.card).map_err(|cause| failed(&cause))?;
        let arrays = file.arrays().map_err(|cause| failed(&cause))?;
        let read = || {
            let classes = arrays.indices(CLASSES, card.classes.len(), "a class")?;
            let width = card.channels.len();
            let stances = arrays.f32s(STANCES, &[classes.len(), POSE])?;
            let readings = arrays.small(READINGS, &[classes.len(), KEPT * width])?;
            let largest = arrays.f32s(LARGEST, &[width])?;
            let grasp = |readings: &[i16]| {
                let values = readings.iter().enumerate().map(|(k, x)| f32::from(*x) * UNIT * largest[k % width]);
                Sequence { t_s: card.times(), values: values.collect() }
            };
            let poses = stances.as_chunks::<POSE>().0.iter().map(|pose| Stance::from_array(*pose));
            let grasps = readings.chunks_exact((KEPT * width).max(1)).map(grasp);
            Ok(classes.into_iter().zip(poses).zip(grasps).map(|((class, pose), grasp)| (class, pose, grasp)).collect())
        };
        let grasps = read().map_err(|cause: palpate_learn::ModelError| failed(&cause))?;
        Ok(Self { card, grasps })
    }
}

impl Card {
    /// Times of the kept readings (s): the ends of equal parts, as a reading stands for the time before it.
    fn times(&self) -> Vec<f32> {
        (1..=KEPT).map(|k| self.duration_s * k as f32 / KEPT as f32).collect()
    }

    /// Means over equal times; if one has no reading, the mean before it. Two of them have the mean of all readings in both, as
    /// networks read them: one that is a few milliseconds off is another grasp to them.
    fn means(&self, grasp: &Sequence) -> Sequence {
        let width = self.channels.len();
        let mut values = Vec::with_capacity(KEPT * width);
        let (mut row, mut last) = (0, vec![0.0; width]);
        for ends in self.times().chunks_exact(2) {
            let parts: Vec<&[f32]> = ends
                .iter()
                .map(|end_s| {
                    let from = row;
                    // A reading on the border belongs to the time before.
                    while grasp.t_s.get(row).is_some_and(|t_s| *t_s < end_s + BORDER_S) {
                        row += 1;
                    }
                    &grasp.values[from * width..row * width]
                })
                .collect();
            let mean = |part: &[f32], channel: usize| {
                let count = part.len() / width;
                (count > 0).then(|| part.iter().skip(channel).step_by(width).sum::<f32>() / count as f32)
            };
            let both = parts.concat();
            let pair: Vec<[f32; 2]> = (0..width)
                .map(|channel| {
                    let first = mean(parts[0], channel).unwrap_or(last[channel]);
                    let second = mean(parts[1], channel).unwrap_or(first);
                    let shift = mean(&both, channel).map_or(0.0, |mean| mean - 0.5 * (first + second));
                    last[channel] = second + shift;
                    [first + shift, second + shift]
                })
                .collect();
            (0..2).for_each(|part| values.extend(pair.iter().map(|own| own[part])));
        }
        Sequence { t_s: self.times(), values }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_holds_what_was_kept() {
        let channels = ["curvature_left", "pressure_left"].map(str::to_owned).to_vec();
        let t_s: Vec<f32> = (1..=300).map(|k| k as f32 / 75.0).collect();
        let values = t_s.iter().flat_map(|t| [2.0 * t, -100.0 * t]).collect();
        let grasp = Sequence { t_s, values };
        let stance = Stance::of(&palpate_sim::scene::Scene::default());
        let touches = KnownTouches::new(channels, vec!["a".to_owned()], Vec::new(), &[(0, stance, &grasp)]);
        let read = KnownTouches::from_bytes(&touches.to_bytes().expect("encodes")).expect("decodes");
        assert_eq!((read.card.clone(), read.grasps.len()), (touches.card, 1));
        let (class, own, kept) = &read.grasps[0];
        assert_eq!((*class, kept.t_s.len()), (0, KEPT));
        assert!(own.to_array().iter().zip(stance.to_array()).all(|(a, b)| (a - b).abs() < 1e-6));
        for (t, row) in kept.t_s.iter().zip(kept.values.chunks_exact(2)) {
            // A reading stands for the time before it: the mean of those up to the end is half a part earlier.
            let middle = t - 0.5 * 4.0 / KEPT as f32 + 0.5 / 75.0;
            assert!((row[0] - 2.0 * middle).abs() < 1e-3 && (row[1] + 100.0 * middle).abs() < 0.02, "{t}: {row:?}");
        }
        let mut bytes = read.to_bytes().expect("encodes");
        bytes.pop();
        assert!(KnownTouches::from_bytes(&bytes).is_err());
    }

    #[test]
    fn the_shipped_models_answer_those_that_come_with_the_program() {
        for which in Shipped::ALL {
            let (touches, model) = (KnownTouches::shipped(which).expect("valid"), which.model().expect("valid"));
            let library = touches.library(&model).expect("the same channels");
            let counts: Vec<usize> = library.touches.iter().map(Vec::len).collect();
            let other = model.card.labels.other();
            // Both views of a hundred grasps of fixed objects, of two hundred of free ones.
            let least = if which == Shipped::FixedObjects { 150 } else { 300 };
            assert!((0..counts.len()).all(|class| (counts[class] >= least) == (Some(class) != other)), "{counts:?}");
            // They are those to the grasps as they were read: seven in ten, nine in ten by perfect sensors of free objects.
            let right = |(class, own): (usize, &Vec<super::super::library::KnownTouch>)| {
                own.iter().filter(|touch| touch.answer.top().0 == class).count()
            };
            let right: usize = library.touches.iter().enumerate().map(right).sum();
            let all: usize = counts.iter().sum();
            assert!(right as f64 > 0.65 * all as f64, "{which:?}: {right} of {all}");
        }
    }
}
