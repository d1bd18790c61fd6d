//! Evidence by occlusion: a channel, a phase, or a channel in a phase is replaced by the mean over all classes (the mean
//! of the class signatures), and the model answers again. What the answer loses is what the replaced part spoke for it.
//!
//! With p the answer as it was and q the answer without the part, the evidence of the part is
//!
//! ```text
//! points   = 100 (p1 - q1)                              of the first class
//! decibans = 10 (log10(p1 / p2) - log10(q1 / q2))       for the first against the second class
//! ```
//!
//! Parts overlap, so that their evidence does not add up: two channels that say the same each count little.
//!
//! A channel replaced in one phase alone, beside its own other phases, is like no grasp, and the answer loses far more than
//! without the whole channel. These losses serve as proportions only: the evidence of a channel in a phase is the share that
//! the phase has in that of the channel.
//!
//! Cost: 1 + C + P + C P answers of the model, with C channels and P phases; 28 for six channels and three phases.

use super::bands::two_likeliest;
use super::phases::{phase_at, phases_of, unloaded};
use crate::grasping::RecognisedGrasp;
use crate::inspection::PhaseSpan;
use palpate_learn::{Belief, Labels, Pmf, Sequence, Signatures};
use serde::Serialize;
use std::sync::atomic::{AtomicBool, Ordering};

/// Evidence of a part of a grasp for the first class; negative where it spoke against.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Evidence {
    /// Change of the probability of the first class (percent points).
    pub points: f64,
    /// Change of the logarithm of the ratio of first to second class (decibans: 10 is a factor of ten).
    pub decibans: f64,
}

/// Class and its probability.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ClassShare {
    /// Index of the class.
    #[serde(skip)]
    pub class: usize,
    /// Name of the class.
    pub name: String,
    /// Probability.
    pub probability: f64,
}

/// Course of the belief over one grasp: probability of the first class, then of the second.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BeliefMove {
    /// Before the grasp; the same for all classes before the first.
    pub before: [f64; 2],
    /// By the grasp alone.
    pub alone: [f64; 2],
    /// After the grasp.
    pub after: [f64; 2],
}

/// Why a model gave its answer to a grasp.
#[derive(Clone, Debug, PartialEq)]
pub struct Attribution {
    /// Likeliest class.
    pub first: ClassShare,
    /// Second class.
    pub second: ClassShare,
    /// Channels of the model.
    pub channels: Vec<String>,
    /// Phases of the grasp.
    pub phases: Vec<PhaseSpan>,
    /// Evidence of each channel over the whole grasp.
    pub by_channel: Vec<Evidence>,
    /// Evidence of all channels in each phase.
    pub by_phase: Vec<Evidence>,
    /// Evidence of each channel shared out over the phases, `[channels][phases]`.
    pub by_both: Vec<Vec<Evidence>>,
    /// Where a channel is that of a pad without load: what spoke is that it touches nothing, `[channels][phases]`.
    pub unloaded: Vec<Vec<bool>>,
    /// Course of the belief over the grasps of this object.
    pub grasps: Vec<BeliefMove>,
    /// Answers of the model that it took.
    pub calls: usize,
}

/// Reason why an answer cannot be explained.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WhyError {
    /// The model file is of an older version.
    #[error(
        "this model has no class signatures, which stand in for what is left out; train it again with this version \
         (panel Training, or `palpate train`)"
    )]
    NoSignatures,
    /// The grasp has no readings.
    #[error("the grasp has no readings; grasp again")]
    NoReadings,
    /// The model has one class.
    #[error("the model knows only one class, so there is nothing to compare with")]
    OneClass,
    /// The caller stopped it.
    #[error("stopped")]
    Stopped,
}

/// Explains the answer to a grasp; ends early once `stop` is set.
pub fn explain(of: &RecognisedGrasp, stop: &AtomicBool) -> Result<Attribution, WhyError> {
    let signatures = of.model.signatures.as_deref().ok_or(WhyError::NoSignatures)?;
    if of.grasp.is_empty() {
        return Err(WhyError::NoReadings);
    }
    let mut model = CountedModel { of, stop, calls: 0 };
    let answer = model.answer(&of.grasp)?;
    let two = two_likeliest(&answer).ok_or(WhyError::OneClass)?;
    let phases = phases_of(&of.grasp, signatures, of.hold_s);
    let channels = signatures.channels();
    let phase_of: Vec<Option<usize>> = of.grasp.t_s.iter().map(|t| phase_at(&phases, f64::from(*t))).collect();
    let mut without = |channel: Option<usize>, phase: Option<usize>| {
        let is_left_out = |own: Option<usize>| phase.is_none() || own == phase;
        let rows: Vec<bool> = phase_of.iter().map(|own| is_left_out(*own)).collect();
        let occluded = model.answer(&occluded(&of.grasp, signatures, channel, &rows))?;
        Ok(evidence(&answer, &occluded, two))
    };
    let by_channel = (0..channels.len()).map(|c| without(Some(c), None)).collect::<Result<Vec<_>, _>>()?;
    let by_phase = (0..phases.len()).map(|p| without(None, Some(p))).collect::<Result<_, _>>()?;
    let mut in_phases = |c| {
        let alone = (0..phases.len()).map(|p| without(Some(c), Some(p))).collect::<Result<Vec<_>, _>>()?;
        Ok(shared_out(by_channel[c], &alone))
    };
    let by_both = (0..channels.len()).map(&mut in_phases).collect::<Result<_, WhyError>>()?;
    let unloaded = unloaded(&of.grasp, signatures, &phases);
    let labels = &of.model.card.labels;
    let [first, second] = two.map(|class| share(labels, &answer, class));
    let (channels, grasps, calls) = (channels.to_vec(), moves(&of.belief, two), model.calls);
    Ok(Attribution { first, second, channels, phases, by_channel, by_phase, by_both, unloaded, grasps, calls })
}

/// A model whose answers are counted.
struct CountedModel<'a> {
    of: &'a RecognisedGrasp,
    stop: &'a AtomicBool,
    calls: usize,
}

impl CountedModel<'_> {
    fn answer(&mut self, grasp: &Sequence) -> Result<Pmf, WhyError> {
        if self.stop.load(Ordering::Relaxed) {
            return Err(WhyError::Stopped);
        }
        self.calls += 1;
        Ok(self.of.model.recogniser.recognise(grasp, self.of.before().as_ref()).pmf)
    }
}

fn share(labels: &Labels, pmf: &Pmf, class: usize) -> ClassShare {
    let name = labels.classes.get(class).map_or_else(String::new, |class| class.name.clone());
    ClassShare { class, name, probability: pmf.probabilities()[class] }
}

/// A copy of a grasp in which a channel (or all) is replaced by the mean over all classes, in these rows.
fn occluded(grasp: &Sequence, signatures: &Signatures, channel: Option<usize>, rows: &[bool]) -> Sequence {
    let width = signatures.channels().len();
    let mut copy = grasp.clone();
    let each = copy.values.chunks_exact_mut(width.max(1)).zip(&grasp.t_s).zip(rows);
    for ((row, t), _) in each.filter(|(_, left_out)| **left_out) {
        for (c, value) in row.iter_mut().enumerate() {
            if channel.is_none_or(|channel| channel == c) {
                *value = signatures.average_at(c, *t);
            }
        }
    }
    copy
}

fn evidence(answer: &Pmf, without: &Pmf, [first, second]: [usize; 2]) -> Evidence {
    let points = 100.0 * (answer.probabilities()[first] - without.probabilities()[first]);
    let ratio = |pmf: &Pmf| -> f64 {
        let logarithms: Vec<f64> = pmf.logarithms().collect();
        (logarithms[first] - logarithms[second]) * 10.0 / std::f64::consts::LN_10
    };
    Evidence { points, decibans: ratio(answer) - ratio(without) }
}

/// The evidence of a channel over the phases, in proportion to what they lose alone to the same end.
fn shared_out(whole: Evidence, alone: &[Evidence]) -> Vec<Evidence> {
    let weight = |own: &Evidence| (own.points * whole.points.signum()).max(0.0);
    let all: f64 = alone.iter().map(weight).sum();
    let share = |own: &Evidence| if all > 0.0 { weight(own) / all } else { 0.0 };
    let shares = alone.iter().map(share);
    shares.map(|share| Evidence { points: share * whole.points, decibans: share * whole.decibans }).collect()
}

/// How each grasp moved the belief in two classes.
fn moves(belief: &Belief, two: [usize; 2]) -> Vec<BeliefMove> {
    let of = |pmf: &Pmf| two.map(|class| pmf.probabilities()[class]);
    let pairs: Vec<(&Pmf, &Pmf)> = belief.pairs().collect();
    let one = |(k, (after, alone)): (usize, &(&Pmf, &Pmf))| {
        let before = k.checked_sub(1).map_or([1.0 / after.classes() as f64; 2], |k| of(pairs[k].0));
        BeliefMove { before, alone: of(alone), after: of(after) }
    };
    pairs.iter().enumerate().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inspection::TouchPhase;
    use crate::why::fixtures::{grasp, linear};
    use palpate_learn::Model;
    use std::sync::Arc;

    static NEVER: AtomicBool = AtomicBool::new(false);

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() < 1e-6, "{a} instead of {b}");
    }

    #[test]
    fn a_linear_recogniser_has_the_evidence_of_its_weights() {
        let (weights, levels) = ([0.5, -0.25, 0.0], [4.0_f32, 4.0, 9.0]);
        let (model, calls) = linear(weights);
        let of = RecognisedGrasp::alone(model, grasp(levels), Some(2.0));
        calls.store(0, Ordering::Relaxed);
        let found = explain(&of, &NEVER).unwrap();
        // 0.5 * 4 - 0.25 * 4 = 1: the first class is "lemon" at 1 / (1 + 1/e).
        close(found.first.probability, 1.0 / (1.0 + (-1.0_f64).exp()));
        assert_eq!((found.first.name.as_str(), found.second.name.as_str()), ("lemon", "tomato"));
        // Replaced by their means 1, 2 and 3, the score loses w (level - mean) nats, in decibans 10 / ln 10 times that.
        let nats = [0.5 * 3.0, -0.25 * 2.0, 0.0];
        let logistic = |score: f64| 1.0 / (1.0 + (-score).exp());
        for (own, nats) in found.by_channel.iter().zip(nats) {
            close(own.decibans, nats * 10.0 / std::f64::consts::LN_10);
            close(own.points, 100.0 * (logistic(1.0) - logistic(1.0 - nats)));
        }
        // The ignored channel has no evidence at all, in no phase.
        let ignored = [&found.by_channel[2]].into_iter().chain(&found.by_both[2]);
        ignored.for_each(|none| assert_eq!(*none, Evidence::default()));
        // Before the hold and in it: half of the samples each, so half of the evidence.
        let names: Vec<TouchPhase> = found.phases.iter().map(|span| span.phase).collect();
        assert_eq!(names, [TouchPhase::PreShaping, TouchPhase::Hold]);
        for (phase, both) in found.by_phase.iter().zip([0, 1]) {
            close(phase.decibans, 0.5 * (found.by_channel[0].decibans + found.by_channel[1].decibans));
            close(found.by_both[0][both].decibans, 0.5 * found.by_channel[0].decibans);
        }
        // Phases of a channel add up to it, however much one does alone; one that speaks to the other end has no share.
        let of = |points: f64| Evidence { points, decibans: 2.0 * points };
        let shared = shared_out(of(2.0), &[of(90.0), of(-20.0), of(10.0)]);
        assert_eq!(shared, [of(1.8), of(0.0), of(0.2)]);
        assert_eq!(shared_out(of(2.0), &[of(0.0), of(-20.0)]), [of(0.0); 2]);
        // One answer as it is, three channels, two phases, and their pairs.
        assert_eq!((found.calls, calls.load(Ordering::Relaxed)), (1 + 3 + 2 + 6, 12));
    }

    #[test]
    fn earlier_grasps_count_as_they_did() {
        let (model, _) = linear([0.5, 0.0, 0.0]);
        let mut of = RecognisedGrasp::alone(model, grasp([4.0, 0.0, 0.0]), None);
        let alone = of.belief.steps()[0].clone();
        of.belief.add(alone.times(&alone), alone.clone());
        let found = explain(&of, &NEVER).unwrap();
        let p = alone.probabilities()[0];
        close(found.first.probability, p * p / (p * p + (1.0 - p) * (1.0 - p)));
        assert_eq!(found.grasps.len(), 2);
        assert_eq!((found.grasps[0].before, found.grasps[1].before[0]), ([0.5; 2], p));
        close(found.grasps[1].after[0], found.first.probability);
    }

    #[test]
    fn what_cannot_be_explained_says_why() {
        let (model, _) = linear([1.0, 0.0, 0.0]);
        let bare = Arc::new(Model { signatures: None, ..Model::clone(&model) });
        let of = RecognisedGrasp::alone(bare, grasp([0.0; 3]), None);
        assert_eq!(explain(&of, &NEVER), Err(WhyError::NoSignatures));
        let of = RecognisedGrasp::alone(Arc::clone(&model), grasp([0.0; 3]), None);
        assert_eq!(explain(&of, &AtomicBool::new(true)), Err(WhyError::Stopped));
        let empty = RecognisedGrasp { grasp: Sequence::default(), ..of };
        assert_eq!(explain(&empty, &NEVER), Err(WhyError::NoReadings));
    }
}
