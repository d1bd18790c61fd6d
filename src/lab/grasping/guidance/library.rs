//! Grasps of known objects in known poses, with a recogniser's answers.

use super::stance::{GripperMove, Stance};
use palpate_learn::{Pmf, Sequence, mirror};

/// Number of nearest poses used for a prediction: several, because answers vary between similar poses.
const NEAREST: usize = 6;

/// Times of a grasp at which readings are compared, from this share of it to its end.
const TIMES: usize = 12;
const FROM: f32 = 0.2;

/// A grasp in a known pose.
#[derive(Clone, Debug)]
pub(super) struct KnownTouch {
    pub(super) stance: Stance,
    /// Readings at [`TIMES`] times, in deviations.
    pub(super) felt: Vec<f32>,
    /// Answer of the recogniser.
    pub(super) answer: Pmf,
}

/// Grasps of known objects in known poses, for one recogniser that did not learn from them.
#[derive(Clone, Debug)]
pub struct TouchLibrary {
    /// Grasps of each class, each also with both fingers exchanged.
    pub(super) touches: Vec<Vec<KnownTouch>>,
    scale: Scale,
}

/// Scale on which readings are compared.
#[derive(Clone, Debug)]
struct Scale {
    /// End of the last time (s).
    end_s: f32,
    /// Start of the logarithmic range of each channel; 0 for a linear one.
    knees: Vec<f32>,
    /// Deviation of each channel over all grasps and times.
    deviations: Vec<f32>,
}

impl Scale {
    /// Readings at all times.
    fn felt(&self, grasp: &Sequence) -> Vec<f32> {
        let width = self.knees.len();
        let mut felt = Vec::with_capacity(TIMES * width);
        let mut row = 0;
        for k in 0..TIMES {
            let t_s = self.end_s * (FROM + (1.0 - FROM) * k as f32 / (TIMES - 1) as f32);
            while grasp.t_s.get(row + 1).is_some_and(|next| *next <= t_s) {
                row += 1;
            }
            let values = grasp.values.get(row * width..(row + 1) * width).unwrap_or(&[]);
            for (channel, x) in values.iter().enumerate() {
                let knee = self.knees[channel];
                let x = if knee > 0.0 { (x / knee).asinh() } else { *x };
                felt.push(x / self.deviations[channel]);
            }
        }
        felt
    }
}

/// Median of the ends of grasps (s).
pub(super) fn usual_end_s<'g>(grasps: impl Iterator<Item = &'g Sequence>) -> f32 {
    let mut ends: Vec<f32> = grasps.filter_map(|grasp| grasp.t_s.last().copied()).collect();
    ends.sort_by(f32::total_cmp);
    ends.get(ends.len() / 2).copied().unwrap_or(1.0)
}

impl TouchLibrary {
    /// A library of so many classes in these channels: class, pose, readings and answer of each grasp.
    pub fn new(channels: &[String], classes: usize, grasps: &[(usize, Stance, &Sequence, Pmf)]) -> Self {
        let width = channels.len();
        let readings = |channel: usize| {
            let of = move |grasp: &&Sequence| {
                grasp.values.iter().skip(channel).step_by(width.max(1)).copied().collect::<Vec<f32>>()
            };
            grasps.iter().map(|(_, _, grasp, _)| *grasp).collect::<Vec<_>>().iter().flat_map(of).collect::<Vec<f32>>()
        };
        // Forces and pressures span decades; a twentieth of the largest is a light touch.
        let knee = |channel: usize| match channels[channel].starts_with("curvature") {
            true => 0.0,
            false => 0.05 * readings(channel).into_iter().fold(0.0, f32::max),
        };
        let end_s = usual_end_s(grasps.iter().map(|(_, _, grasp, _)| *grasp));
        let mut scale = Scale { end_s, knees: (0..width).map(knee).collect(), deviations: vec![1.0; width] };
        let raw: Vec<Vec<f32>> = grasps.iter().map(|(_, _, grasp, _)| scale.felt(grasp)).collect();
        let deviation = |channel: usize| {
            let all = || raw.iter().flat_map(move |felt| felt.iter().skip(channel).step_by(width));
            let count = all().count().max(1) as f32;
            let mean = all().sum::<f32>() / count;
            (all().map(|x| (x - mean) * (x - mean)).sum::<f32>() / count).sqrt().max(f32::MIN_POSITIVE)
        };
        scale.deviations = (0..width).map(deviation).collect();
        let counterparts = mirror(channels).unwrap_or_else(|| (0..width).collect());
        let half_turn = GripperMove { turn_deg: 180.0, ..GripperMove::default() };
        let mut touches = vec![Vec::new(); classes];
        for (class, stance, grasp, answer) in grasps {
            let felt = scale.felt(grasp);
            let exchanged = (0..felt.len()).map(|k| felt[k / width * width + counterparts[k % width]]).collect();
            let answer = || answer.clone();
            touches[*class].push(KnownTouch { stance: *stance, felt, answer: answer() });
            touches[*class].push(KnownTouch { stance: stance.moved(&half_turn), felt: exchanged, answer: answer() });
        }
        Self { touches, scale }
    }

    /// A grasp's readings, as they are compared.
    pub(super) fn felt(&self, grasp: &Sequence) -> Vec<f32> {
        self.scale.felt(grasp)
    }

    /// Indices of the grasps of a class in the nearest stances, nearest first.
    pub(super) fn nearest(&self, class: usize, stance: &Stance) -> Vec<usize> {
        let mut nearest: Vec<(f64, usize)> = Vec::with_capacity(NEAREST + 1);
        for (touch, own) in self.touches[class].iter().enumerate() {
            let distance2 = own.stance.distance2(stance);
            if nearest.len() < NEAREST || nearest.last().is_some_and(|(most, _)| distance2 < *most) {
                let at = nearest.partition_point(|(own, _)| *own <= distance2);
                nearest.insert(at, (distance2, touch));
                nearest.truncate(NEAREST);
            }
        }
        nearest.into_iter().map(|(_, touch)| touch).collect()
    }
}
