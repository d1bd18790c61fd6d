//! Sets of classes that hold the true one as often as they promise, whenever grasping stops.
//!
//! Split conformal prediction (Vovk, Gammerman and Shafer, *Algorithmic learning in a random world*, 2005) over whole rounds of
//! grasps, run to the limit. A class is as strange after grasp k as one minus its probability, counted in ranks among other
//! rounds after as many grasps; a round is as strange as its true class at its strangest. A class leaves the set for good when
//! it is stranger than all but a share of its own rounds have ever been. Which grasp is the last, and why, does not matter,
//! since every earlier one has been counted.
//!
//! An automatic stop promises more: few wrong among the stopped. Its confidence is chosen on further rounds, by the upper
//! Clopper-Pearson bound with Bonferroni's correction over the levels that were tried.

use crate::arrays::ModelError;
use crate::belief::{Belief, Rejection, Round, StopReason, StopRule};
use crate::data::Labels;
use crate::metrics::largest_share;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Rounds that a class needs to be calibrated by itself.
pub const ROUNDS_OF_A_CLASS: usize = 100;
/// Confidence levels that are tried for automatic stops.
const LEVELS: [f64; 9] = [0.8, 0.85, 0.9, 0.95, 0.975, 0.99, 0.995, 0.999, 0.9999];

/// Which rounds calibrate a class.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CalibratedBy {
    /// Its own.
    Class,
    /// Those of all classes of its shape: its own are too few.
    Shape,
    /// All rounds: those of its shape are too few, too.
    All,
}

/// Sets of classes for a model, calibrated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AnswerSets {
    /// Share of rounds that may lose the true class.
    pub risk: f64,
    /// Which rounds calibrated each class.
    pub by: Vec<CalibratedBy>,
    /// Number of rounds.
    pub rounds: usize,
    /// How the object lay between the grasps of a round, as in scene files.
    #[serde(default = "reposed")]
    pub between: String,
    /// Least probability with which each class stays after one grasp, two, and so on.
    least: Vec<Vec<f64>>,
    /// Automatic stops.
    pub stop: StopLevel,
}

/// Of models from before this was a choice.
fn reposed() -> String {
    "reposed".to_owned()
}

/// Confidence at which grasping stops by itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StopLevel {
    /// None where no level keeps the promise.
    pub level: Option<f64>,
    /// Rounds that stopped at this level, or at the highest that was tried.
    pub stopped: usize,
    /// Wrong ones among them.
    pub wrong: usize,
    /// With 95 % confidence at most this share of stops is wrong.
    pub at_most: f64,
}

impl AnswerSets {
    /// Calibrates on rounds that were run to the limit of grasps, a third each for ranks, for the sets and for automatic stops.
    /// None where there are fewer than three times [`ROUNDS_OF_A_CLASS`], or without a grasp.
    pub fn calibrate(
        labels: &Labels,
        rounds: &[Round],
        rejection: Option<&Rejection>,
        risk: f64,
        seed: u64,
    ) -> Option<Self> {
        let grasps = rounds.iter().map(|round| round.belief.grasps()).min()?;
        if rounds.len() < 3 * ROUNDS_OF_A_CLASS || grasps == 0 {
            return None;
        }
        let [reference, own, further] = thirds(rounds, seed);
        let ranks: Vec<Ranks> = (0..grasps).map(|k| Ranks::of(&reference, k)).collect();
        let strangest = |round: &Round| {
            let after = |k: usize| ranks[k].rank(strangeness(&round.belief, k, round.truth));
            (0..grasps).map(after).max().unwrap_or(0)
        };
        let scores: Vec<(usize, usize)> = own.iter().map(|round| (round.truth, strangest(round))).collect();
        let (mut by, mut least) = (Vec::new(), vec![Vec::new(); grasps]);
        for class in 0..labels.classes.len() {
            let (how, scores) = calibrating(labels, &scores, class);
            let limit = conformal_quantile(scores, risk);
            by.push(how);
            for (least, ranks) in least.iter_mut().zip(&ranks) {
                least.push(limit.map_or(0.0, |limit| 1.0 - ranks.strangest_within(limit)));
            }
        }
        let stop = StopLevel::chosen(&further, grasps, rejection, risk);
        Some(Self { risk, by, rounds: rounds.len(), between: reposed(), least, stop })
    }

    /// Refuses sets from a file that do not fit a number of classes, or hold numbers that are no probabilities.
    pub(crate) fn check(&self, classes: usize) -> Result<(), ModelError> {
        let is_share = |p: &f64| (0.0..=1.0).contains(p);
        let fits = |least: &Vec<f64>| least.len() == classes && least.iter().all(is_share);
        let sound = self.by.len() == classes
            && !self.least.is_empty()
            && self.least.iter().all(fits)
            && is_share(&self.risk)
            && self.stop.level.iter().all(is_share);
        if sound { Ok(()) } else { Err(ModelError::card("the sets of classes with a promise")) }
    }

    /// Largest number of grasps of the promise.
    pub fn most_grasps(&self) -> usize {
        self.least.len()
    }

    /// Classes left after the grasps so far; grasps beyond [`Self::most_grasps`] take none away. None left: the object is like
    /// no known class.
    pub fn left(&self, belief: &Belief) -> Vec<bool> {
        let classes = self.least.first().map_or(0, Vec::len);
        let stays = |class: usize| {
            let mut after = belief.steps().iter().zip(&self.least);
            after.all(|(pmf, least)| pmf.probabilities().get(class).is_some_and(|p| *p >= least[class]))
        };
        (0..classes).map(stays).collect()
    }
}

/// Rounds of each class in three parts, drawn at random.
fn thirds(rounds: &[Round], seed: u64) -> [Vec<&Round>; 3] {
    let mut by_class: BTreeMap<usize, Vec<&Round>> = BTreeMap::new();
    rounds.iter().for_each(|round| by_class.entry(round.truth).or_default().push(round));
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut parts = [const { Vec::new() }; 3];
    for members in by_class.values_mut() {
        members.shuffle(&mut random);
        members.iter().enumerate().for_each(|(k, round)| parts[k % 3].push(*round));
    }
    parts
}

/// How strange a class is after grasp `k` (from 0): one minus its probability.
fn strangeness(belief: &Belief, k: usize, class: usize) -> f64 {
    1.0 - belief.steps()[k].probabilities()[class]
}

/// Strangeness of the true classes of other rounds after as many grasps, rising.
struct Ranks(Vec<f64>);

impl Ranks {
    fn of(rounds: &[&Round], k: usize) -> Self {
        let mut all: Vec<f64> = rounds.iter().map(|round| strangeness(&round.belief, k, round.truth)).collect();
        all.sort_by(f64::total_cmp);
        Self(all)
    }

    /// Number of rounds that are less strange.
    fn rank(&self, strangeness: f64) -> usize {
        self.0.partition_point(|own| *own < strangeness)
    }

    /// The largest strangeness whose rank is at most this.
    fn strangest_within(&self, rank: usize) -> f64 {
        self.0.get(rank).copied().unwrap_or(1.0)
    }
}

/// Scores of the rounds that calibrate a class: its own, where they are enough, else those of its shape, else all.
fn calibrating(labels: &Labels, scores: &[(usize, usize)], class: usize) -> (CalibratedBy, Vec<usize>) {
    let of = |wanted: &dyn Fn(usize) -> bool| -> Vec<usize> {
        scores.iter().filter(|(truth, _)| wanted(*truth)).map(|(_, score)| *score).collect()
    };
    let own = of(&|truth| truth == class);
    if own.len() >= ROUNDS_OF_A_CLASS {
        return (CalibratedBy::Class, own);
    }
    let shape = labels.classes[class].shape;
    let alike = of(&|truth| truth == class || shape.is_some() && labels.classes[truth].shape == shape);
    if alike.len() >= ROUNDS_OF_A_CLASS {
        return (CalibratedBy::Shape, alike);
    }
    (CalibratedBy::All, of(&|_| true))
}

/// The ceil((n + 1)(1 - risk))-th smallest of n scores; none where n is too small for that.
fn conformal_quantile(mut scores: Vec<usize>, risk: f64) -> Option<usize> {
    scores.sort_unstable();
    let place = ((scores.len() as f64 + 1.0) * (1.0 - risk)).ceil() as usize;
    scores.get(place.checked_sub(1)?).copied()
}

impl StopLevel {
    /// The lowest level whose stops are wrong in at most a share of cases.
    fn chosen(rounds: &[&Round], most_grasps: usize, rejection: Option<&Rejection>, risk: f64) -> Self {
        let tried = LEVELS.map(|level| {
            let rule = StopRule { threshold: level, most_grasps };
            let right: Vec<bool> = rounds.iter().filter_map(|round| stopped(round, rule, rejection)).collect();
            let (stopped, wrong) = (right.len(), right.iter().filter(|right| !**right).count());
            let at_most = largest_share(wrong, stopped, 0.05 / LEVELS.len() as f64);
            Self { level: (stopped > 0 && at_most <= risk).then_some(level), stopped, wrong, at_most }
        });
        let [.., highest] = &tried;
        tried.iter().find(|own| own.level.is_some()).unwrap_or(highest).clone()
    }
}

/// Whether a round that stops by itself is right; none where it does not.
fn stopped(round: &Round, rule: StopRule, rejection: Option<&Rejection>) -> Option<bool> {
    let mut beliefs = (1..=round.belief.grasps()).map(|grasps| round.belief.first(grasps));
    let end = beliefs.find_map(|belief| Some((rule.judge(&belief, rejection)?, belief)));
    let (_, belief) = end.filter(|(reason, _)| *reason == StopReason::Sure)?;
    belief.now().map(|pmf| pmf.top().0 == round.truth)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::Class;
    use crate::pmf::Pmf;
    use rand::RngExt;

    const CLASSES: usize = 4;

    fn labels() -> Labels {
        let class = |k: usize| Class { name: format!("c{k}"), size: None, shape: Some(k / 2) };
        let shapes = ["round", "flat"].map(str::to_owned).to_vec();
        Labels { classes: (0..CLASSES).map(class).collect(), shapes, ..Labels::default() }
    }

    /// Rounds of a recogniser that is too sure of itself: its scores are sharpened, and classes 0 and 1 resemble each other.
    fn rounds(of_each: usize, grasps: usize, seed: u64) -> Vec<Round> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let round = |k: usize, random: &mut ChaCha8Rng| {
            let truth = k % CLASSES;
            let mut belief = Belief::default();
            for _ in 0..grasps {
                let mut score = |class: usize| {
                    let alike = if truth < 2 && class < 2 { 0.8 } else { 0.0 };
                    4.0 * (f64::from(u8::from(class == truth)).max(alike) + 1.2 * random.random::<f64>())
                };
                let alone = Pmf::from_scores((0..CLASSES).map(&mut score).collect::<Vec<_>>());
                let with = belief.now().map_or_else(|| alone.clone(), |before| before.times(&alone));
                belief.add(with, alone);
            }
            Round { truth, belief }
        };
        (0..of_each * CLASSES).map(|k| round(k, &mut random)).collect()
    }

    #[test]
    fn sets_hold_the_true_class_as_often_as_they_promise_whenever_it_stops() {
        let sets = AnswerSets::calibrate(&labels(), &rounds(900, 4, 1), None, 0.1, 1).expect("enough rounds");
        assert_eq!((sets.by.as_slice(), sets.most_grasps()), (&[CalibratedBy::Class; CLASSES][..], 4));
        let test = rounds(2500, 4, 2);
        // At the limit, and at the worst moment for the promise, which is the limit, too: what has left stays away.
        for class in 0..CLASSES {
            let own: Vec<&Round> = test.iter().filter(|round| round.truth == class).collect();
            let lost = own.iter().filter(|round| !sets.left(&round.belief)[class]).count();
            let share = lost as f64 / own.len() as f64;
            // Of 300 calibrating rounds the promise itself varies by 1.7 points.
            assert!((0.03..0.1 + 3.0 * 0.018).contains(&share), "class {class}: {share}");
        }
        let size = |grasps: usize| {
            let all = test.iter().map(|round| sets.left(&round.belief.first(grasps)));
            all.map(|left| left.iter().filter(|own| **own).count()).sum::<usize>() as f64 / test.len() as f64
        };
        let sizes = [1, 2, 3, 4].map(size);
        assert!(sizes.windows(2).all(|pair| pair[1] < pair[0]), "{sizes:?}");
        assert!(sizes[3] < 2.0, "{sizes:?}");
    }

    #[test]
    fn automatic_stops_keep_their_promise_or_there_are_none() {
        let sets = AnswerSets::calibrate(&labels(), &rounds(900, 4, 3), None, 0.1, 1).expect("enough rounds");
        let level = sets.stop.level.expect("a level");
        assert!(level > 0.8 && sets.stop.at_most <= 0.1, "{:?}", sets.stop);
        let rule = StopRule { threshold: level, most_grasps: 4 };
        let test = rounds(2500, 4, 4);
        let right: Vec<bool> = test.iter().filter_map(|round| stopped(round, rule, None)).collect();
        let wrong = right.iter().filter(|right| !**right).count() as f64 / right.len() as f64;
        assert!(wrong <= 0.1, "{wrong} of {}", right.len());
        // A thousandth is more than so few rounds can show.
        let strict = AnswerSets::calibrate(&labels(), &rounds(900, 4, 3), None, 0.001, 1).expect("enough rounds");
        assert_eq!(strict.stop.level, None);
        assert!(strict.stop.at_most > 0.001);
    }

    #[test]
    fn few_rounds_are_pooled_and_fewer_are_refused() {
        let by = |of_each| AnswerSets::calibrate(&labels(), &rounds(of_each, 2, 5), None, 0.1, 1).map(|sets| sets.by);
        assert_eq!(by(300), Some(vec![CalibratedBy::Class; CLASSES]));
        assert_eq!(by(180), Some(vec![CalibratedBy::Shape; CLASSES]));
        assert_eq!(by(90), Some(vec![CalibratedBy::All; CLASSES]));
        assert_eq!(by(74), None);
        assert_eq!(AnswerSets::calibrate(&labels(), &[], None, 0.1, 1), None);
    }

    #[test]
    fn sets_from_a_file_are_checked() {
        let sets = AnswerSets::calibrate(&labels(), &rounds(90, 2, 1), None, 0.1, 1).expect("enough rounds");
        assert!(sets.check(CLASSES).is_ok() && sets.check(CLASSES + 1).is_err());
        let damaged = |damage: &dyn Fn(&mut AnswerSets)| {
            let mut own = sets.clone();
            damage(&mut own);
            own.check(CLASSES).is_err()
        };
        assert!(damaged(&|own| own.least[1].truncate(2)) && damaged(&|own| own.least.clear()));
        assert!(damaged(&|own| own.least[0][1] = f64::NAN) && damaged(&|own| own.risk = -1.0));
        assert!(damaged(&|own| own.by.clear()) && damaged(&|own| own.stop.level = Some(7.0)));
    }

    #[test]
    fn nothing_is_left_of_an_object_like_no_class() {
        let sets = AnswerSets::calibrate(&labels(), &rounds(900, 4, 1), None, 0.1, 1).expect("enough rounds");
        // Grasps that contradict each other: each rules out what the other is sure of.
        let mut torn = Belief::default();
        for class in [0, 2] {
            let sure = Pmf::from_weights((0..CLASSES).map(|own| if own == class { 1.0 } else { 1e-3 }));
            torn.add(sure.clone(), sure);
        }
        assert_eq!(sets.left(&torn), [false; CLASSES]);
        assert_eq!(sets.left(&Belief::default()), [true; CLASSES], "before the first grasp");
    }
}
