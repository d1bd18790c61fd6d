//! A grasp as a row of features, for classifiers without a notion of time: means over windows of time, or the same extended
//! by events and by sums and differences of both fingers.

use crate::data::{Dataset, Sequence};
use crate::gaps;
use crate::mirror::mirror;
use serde::{Deserialize, Serialize};

/// Kind of features.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum FeatureKind {
    /// Means of each channel over 30 equal windows of time.
    Course,
    /// Means of each channel over 30 equal windows of time on a compressed scale; half sum and absolute half difference of
    /// both fingers in each window; maximum, its time, last value and onsets of each channel.
    ExtendedCourse,
}

/// Mapping from grasps to rows, fitted to training data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Features {
    kind: FeatureKind,
    /// Number of channels.
    channels: usize,
    /// Median duration of the training grasps (s).
    duration_s: f32,
    /// Counterpart of each channel on the other finger.
    mirror: Option<Vec<usize>>,
    /// Fixed levels of each channel; only for the extended course.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    levels: Vec<Levels>,
}

/// Fixed levels of a channel, in its unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Levels {
    /// Start of the logarithmic range of asinh(x / knee); zero for a linear scale.
    knee: f32,
    /// Levels whose first crossing is an onset, the lowest first.
    pub(crate) onsets: Vec<f32>,
}

impl Levels {
    /// Levels of a channel, by the quantity in its name. A pressure is a force over the area of a pad, 170 mm², a contact
    /// pressure one over the smaller area of contact. Others keep their scale; their onset is at `risen`.
    pub(crate) fn of(channel: &str, risen: f32) -> Self {
        let starts = |quantity: &str| channel.starts_with(quantity);
        match () {
            () if starts("force") => Self { knee: 0.08, onsets: vec![0.02, 0.1] },
            () if starts("pressure") => Self { knee: 470.0, onsets: vec![120.0, 590.0] },
            () if starts("contact_pressure") => Self { knee: 3000.0, onsets: vec![500.0, 3000.0] },
            () if starts("curvature") => Self { knee: 0.0, onsets: Vec::new() },
            () => Self { knee: 0.0, onsets: vec![risen] },
        }
    }

    fn compressed(&self, x: f32) -> f32 {
        if self.knee > 0.0 { (x / self.knee).asinh() } else { x }
    }
}

/// Version of the features, part of the fingerprint of methods that use them.
pub(crate) const REVISION: u32 = 1;

/// Number of windows: three per tenth of a grasp.
pub(crate) const WINDOWS: usize = 30;
/// Largest number of onsets of a channel.
const MOST_ONSETS: usize = 8;

impl Features {
    pub(crate) fn fit(kind: FeatureKind, data: &Dataset) -> Self {
        let channels = data.channels.len();
        let duration_s = data.median_duration_s().max(1e-3);
        let levels = match kind {
            FeatureKind::Course => Vec::new(),
            FeatureKind::ExtendedCourse => {
                data.channels.iter().zip(risen(data)).map(|(c, r)| Levels::of(c, r)).collect()
            }
        };
        Self { kind, channels, duration_s, mirror: mirror(&data.channels), levels }
    }

    /// Number of features.
    pub(crate) fn width(&self) -> usize {
        match self.kind {
            FeatureKind::Course => self.channels * WINDOWS,
            FeatureKind::ExtendedCourse => {
                let onsets: usize = self.levels.iter().map(|levels| levels.onsets.len()).sum();
                (self.channels + 2 * self.pairs().count()) * WINDOWS + 3 * self.channels + onsets
            }
        }
    }

    /// True if a mapping from a file is valid for this number of channels.
    pub(crate) fn is_sound(&self, channels: usize) -> bool {
        channels > 0
            && self.channels == channels
            && self.duration_s.is_finite()
            && self.duration_s > 0.0
            && self.mirror.as_ref().is_none_or(|m| m.len() == channels && m.iter().all(|to| *to < channels))
            && match self.kind {
                FeatureKind::Course => self.levels.is_empty(),
                FeatureKind::ExtendedCourse => {
                    let sound = |l: &Levels| {
                        l.knee.is_finite() && l.onsets.len() <= MOST_ONSETS && l.onsets.iter().all(|x| x.is_finite())
                    };
                    self.levels.len() == channels && self.levels.iter().all(sound)
                }
            }
    }

    /// Window of a reading, from the time since the start of the grasp (s); the last one has no end.
    pub(crate) fn window_of(&self, t: f32) -> usize {
        ((t / self.duration_s * WINDOWS as f32 - 1e-3) as usize).min(WINDOWS - 1)
    }

    /// End of a window (s).
    pub(crate) fn end_of_window(&self, windows: usize) -> f32 {
        self.duration_s * windows as f32 / WINDOWS as f32
    }

    /// Replaces by NaN what is unknown after the first windows, in a row of the whole grasp or of its beginning.
    pub(crate) fn forget_after(&self, windows: usize, row: &mut [f32]) {
        let pairs = 2 * self.pairs().count();
        let (own, rest) = row.split_at_mut(self.channels * WINDOWS);
        own[self.channels * windows..].fill(f32::NAN);
        if self.kind != FeatureKind::ExtendedCourse {
            return;
        }
        let (both, mut events) = rest.split_at_mut(pairs * WINDOWS);
        both[pairs * windows..].fill(f32::NAN);
        let end = self.end_of_window(windows);
        for levels in &self.levels {
            let (of_channel, others) = events.split_at_mut(3 + levels.onsets.len());
            let (peak, onsets) = of_channel.split_at_mut(3);
            peak.fill(f32::NAN);
            onsets.iter_mut().filter(|onset| **onset >= end).for_each(|onset| *onset = f32::NAN);
            events = others;
        }
    }

    /// True if grasps can be mirrored.
    pub(crate) fn has_mirror(&self) -> bool {
        self.mirror.is_some()
    }

    /// Channels of the same sensor on both fingers.
    fn pairs(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.mirror.iter().flatten().copied().enumerate().filter(|(own, other)| own < other)
    }

    /// Features of a grasp.
    pub(crate) fn row(&self, grasp: &Sequence) -> Vec<f32> {
        let grasp = &*gaps::filled(grasp);
        match self.kind {
            FeatureKind::Course => self.course(grasp),
            FeatureKind::ExtendedCourse => self.extended_course(grasp),
        }
    }

    /// Features of a grasp with left and right exchanged; `None` without mirrored channels.
    pub(crate) fn mirrored(&self, grasp: &Sequence) -> Option<Vec<f32>> {
        let mirror = self.mirror.as_ref()?;
        let exchanged = grasp.rows().flat_map(|(_, row)| mirror.iter().map(|from| row[*from]));
        Some(self.row(&Sequence { t_s: grasp.t_s.clone(), values: exchanged.collect() }))
    }

    fn extended_course(&self, grasp: &Sequence) -> Vec<f32> {
        let mut row = self.course(grasp);
        row.reserve_exact(self.width() - row.len());
        for window in row.chunks_exact_mut(self.channels) {
            window.iter_mut().zip(&self.levels).for_each(|(x, levels)| *x = levels.compressed(*x));
        }
        for start in (0..self.channels * WINDOWS).step_by(self.channels) {
            for (own, other) in self.pairs() {
                let (a, b) = (row[start + own], row[start + other]);
                row.extend([0.5 * (a + b), 0.5 * (a - b).abs()]);
            }
        }
        for (channel, levels) in self.levels.iter().enumerate() {
            let values = || grasp.rows().map(|(t, row)| (t, row[channel]));
            let (mut highest, mut at, mut last) = (0.0, 0.0, 0.0);
            for (number, (t, x)) in values().enumerate() {
                if number == 0 || x > highest {
                    (highest, at) = (x, t);
                }
                last = x;
            }
            row.extend([levels.compressed(highest), at, levels.compressed(last)]);
            for level in &levels.onsets {
                row.push(values().find(|(_, x)| x > level).map_or(self.duration_s, |(t, _)| t));
            }
        }
        row.iter_mut().filter(|x| !x.is_finite()).for_each(|x| *x = 0.0);
        row
    }

    fn course(&self, grasp: &Sequence) -> Vec<f32> {
        let mut sums = vec![0.0; self.channels * WINDOWS];
        let mut counts = [0u32; WINDOWS];
        for (t, row) in grasp.rows() {
            let window = self.window_of(t);
            counts[window] += 1;
            sums[window * self.channels..].iter_mut().zip(row).for_each(|(sum, x)| *sum += x);
        }
        let mut before = vec![0.0; self.channels];
        for (window, count) in sums.chunks_exact_mut(self.channels.max(1)).zip(counts) {
            // A window without samples, after the end of a short grasp, repeats the window before.
            if count == 0 {
                window.copy_from_slice(&before);
            } else {
                window.iter_mut().for_each(|x| *x /= count as f32);
            }
            before.copy_from_slice(window);
        }
        sums
    }
}

/// Onset threshold of each channel, in its unit: a tenth of its range above its minimum.
fn risen(data: &Dataset) -> Vec<f32> {
    let mut range = vec![(f32::INFINITY, f32::NEG_INFINITY); data.channels.len()];
    for (_, row) in data.examples.iter().flat_map(|e| e.grasp.rows()) {
        for ((low, high), x) in range.iter_mut().zip(row) {
            if x.is_finite() {
                (*low, *high) = (low.min(*x), high.max(*x));
            }
        }
    }
    range.iter().map(|(low, high)| if high > low { low + 0.1 * (high - low) } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::{Class, DataCard, Example, Labels};
    use std::sync::Arc;

    /// A step to 2 at 0.5 s on the left, to 4 on the right.
    fn data() -> Dataset {
        let t_s: Vec<f32> = (1..=100).map(|i| i as f32 * 0.01).collect();
        let values = t_s.iter().flat_map(|t| if *t > 0.5 { [2.0, 4.0] } else { [0.0, 0.0] }).collect();
        let grasp = Arc::new(Sequence { t_s, values });
        let class = Class { name: "a".to_owned(), size: None, shape: None };
        Dataset {
            channels: ["force_left", "force_right"].map(str::to_owned).to_vec(),
            labels: Labels { classes: vec![class], ..Labels::default() },
            examples: vec![Example { id: 1, class: 0, grasp, ..Example::default() }],
            about: DataCard::default(),
        }
    }

    #[test]
    fn the_extended_course_adds_both_fingers_and_events() {
        let data = data();
        let features = Features::fit(FeatureKind::ExtendedCourse, &data);
        assert!(features.is_sound(2));
        let row = features.row(&data.examples[0].grasp);
        assert_eq!((row.len(), features.width()), (130, 130));
        let [low, high] = [2.0_f32, 4.0].map(|force| (force / 0.08).asinh());
        assert_eq!(row[58..60], [low, high]);
        assert_eq!((row[60], row[61]), (0.0, 0.0));
        assert_eq!(row[118..120], [0.5 * (low + high), 0.5 * (high - low)]);
        assert_eq!(row[120..], [low, 0.51, low, 0.51, 0.51, high, 0.51, high, 0.51, 0.51]);
        let mirrored = features.mirrored(&data.examples[0].grasp).expect("has two sides");
        assert_eq!((mirrored[58..60].to_vec(), &mirrored[60..120]), (vec![high, low], &row[60..120]));
        assert!(features.row(&Sequence::default()).iter().all(|x| x.is_finite()));
    }

    #[test]
    fn levels_follow_the_quantity_and_mirrors_need_two_fingers() {
        let mut data = data();
        data.channels = ["contact_pressure_left_distal", "grip"].map(str::to_owned).to_vec();
        let features = Features::fit(FeatureKind::ExtendedCourse, &data);
        assert_eq!(features.levels[0], Levels { knee: 3000.0, onsets: vec![500.0, 3000.0] });
        assert_eq!(features.levels[1], Levels { knee: 0.0, onsets: vec![0.4] });
        assert_eq!((features.width(), features.has_mirror()), (2 * WINDOWS + 6 + 3, false));
        assert_eq!(features.row(&data.examples[0].grasp).len(), features.width());
        let damaged = Features { levels: Vec::new(), ..features };
        assert!(!damaged.is_sound(2));
    }

    #[test]
    fn windows_after_the_end_repeat_the_last_value() {
        let data = data();
        let features = Features::fit(FeatureKind::Course, &data);
        let whole = features.row(&data.examples[0].grasp);
        assert_eq!((whole[0], whole[2 * WINDOWS - 1]), (0.0, 4.0));
        let short = features.row(&data.examples[0].grasp.until(0.7));
        assert_eq!(short[2 * WINDOWS - 2], 2.0);
        assert!(features.row(&Sequence::default()).iter().all(|x| *x == 0.0));
    }
}
