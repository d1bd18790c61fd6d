//! Belief after successive grasps of one object, and the rule when to stop.

use crate::pmf::Pmf;
use serde::{Deserialize, Serialize};

/// Belief after successive grasps of the same object.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Belief {
    /// PMF after each grasp, combined with those before.
    steps: Vec<Pmf>,
    /// PMF of each grasp alone.
    alone: Vec<Pmf>,
}

impl Belief {
    /// Adds a grasp: its PMF combined with those before, and alone.
    pub fn add(&mut self, with_before: Pmf, alone: Pmf) {
        self.steps.push(with_before);
        self.alone.push(alone);
    }

    /// The belief after grasps with these probabilities: combined with those before, and alone. None where their numbers of
    /// classes differ.
    pub fn resumed(judged: &[[Vec<f64>; 2]], classes: usize) -> Option<Self> {
        let fits =
            judged.iter().flatten().all(|pmf| pmf.len() == classes && pmf.iter().all(|p| (0.0..=1.0).contains(p)));
        let all = |which: usize| judged.iter().map(|pair| Pmf::as_stored(&pair[which])).collect();
        fits.then(|| Self { steps: all(0), alone: all(1) })
    }

    /// Probabilities of each grasp, for [`Self::resumed`].
    pub fn judged(&self) -> Vec<[Vec<f64>; 2]> {
        self.pairs().map(|(step, alone)| [step, alone].map(|pmf| pmf.probabilities().to_vec())).collect()
    }

    /// Current belief; `None` before the first grasp.
    pub fn now(&self) -> Option<&Pmf> {
        self.steps.last()
    }

    /// Belief after each grasp.
    pub fn steps(&self) -> &[Pmf] {
        &self.steps
    }

    /// PMFs of each grasp, combined with those before and alone.
    pub fn pairs(&self) -> impl Iterator<Item = (&Pmf, &Pmf)> {
        self.steps.iter().zip(&self.alone)
    }

    /// Number of grasps.
    pub fn grasps(&self) -> usize {
        self.steps.len()
    }

    /// The belief after the first grasps.
    #[must_use]
    pub fn first(&self, grasps: usize) -> Self {
        let own = |all: &[Pmf]| all[..grasps.min(all.len())].to_vec();
        Self { steps: own(&self.steps), alone: own(&self.alone) }
    }

    /// Agreement of the grasps with the belief (nat, at most 0): mean logarithm of the probability that each grasp alone
    /// gives to it. Grasps of an unknown object contradict each other or are uncertain.
    pub fn agreement(&self) -> f64 {
        agreement(self.now(), &self.alone)
    }
}

pub(crate) fn agreement(belief: Option<&Pmf>, alone: &[Pmf]) -> f64 {
    let Some(belief) = belief.filter(|_| !alone.is_empty()) else { return 0.0 };
    let explained = |pmf: &Pmf| -> f64 {
        let p: f64 = belief.probabilities().iter().zip(pmf.probabilities()).map(|(b, p)| b * p).sum();
        p.max(1e-12).ln()
    };
    alone.iter().map(explained).sum::<f64>() / alone.len() as f64
}

/// Successive grasps of one object, with the belief after each.
#[derive(Clone, Debug, PartialEq)]
pub struct Round {
    /// True class.
    pub truth: usize,
    pub belief: Belief,
}

/// Smallest agreement of known objects, calibrated on held-out grasps.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Rejection {
    /// Share of known objects rejected as unknown.
    pub share: f64,
    /// Smallest agreement after one grasp, two, and so on; the last applies to more.
    pub least: Vec<f64>,
}

impl Rejection {
    /// True if the agreement of a belief is below the threshold.
    pub fn rejects(&self, belief: &Belief) -> bool {
        let at = belief.grasps().clamp(1, self.least.len().max(1)) - 1;
        self.least.get(at).is_some_and(|least| belief.agreement() < *least)
    }
}

/// Stop rule for successive grasps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StopRule {
    /// Confidence threshold on the most likely class, 0 to 1; never reached at 1.
    pub threshold: f64,
    /// Largest number of grasps.
    pub most_grasps: usize,
}

impl Default for StopRule {
    fn default() -> Self {
        // The paper's plateau is at three to four grasps (section V-E).
        Self { threshold: 0.9, most_grasps: 4 }
    }
}

/// Reason why grasping stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StopReason {
    /// One class reached the threshold.
    Sure,
    /// The grasp limit was reached first.
    GraspLimit,
    /// The grasps agree with no known class.
    Unknown,
}

impl StopReason {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sure => "sure",
            Self::GraspLimit => "grasp-limit",
            Self::Unknown => "unknown",
        }
    }
}

impl StopRule {
    /// Decides whether to stop; `None` to grasp again.
    pub fn judge(&self, belief: &Belief, rejection: Option<&Rejection>) -> Option<StopReason> {
        let sure = belief.now()?.top().1 >= self.threshold && self.threshold < 1.0;
        let unknown = rejection.is_some_and(|rejection| rejection.rejects(belief));
        if belief.grasps() >= self.most_grasps {
            return Some(match (unknown, sure) {
                (true, _) => StopReason::Unknown,
                (false, true) => StopReason::Sure,
                (false, false) => StopReason::GraspLimit,
            });
        }
        (sure && !unknown).then_some(StopReason::Sure)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grasp(belief: &mut Belief, weights: [f64; 3]) {
        let alone = Pmf::from_weights(weights);
        let with = belief.now().map_or_else(|| alone.clone(), |now| now.times(&alone));
        belief.add(with, alone);
    }

    #[test]
    fn it_stops_when_sure_or_at_the_limit() {
        let rule = StopRule { threshold: 0.9, most_grasps: 3 };
        let mut belief = Belief::default();
        assert_eq!(rule.judge(&belief, None), None);
        grasp(&mut belief, [0.7, 0.2, 0.1]);
        assert_eq!(rule.judge(&belief, None), None);
        grasp(&mut belief, [0.8, 0.1, 0.1]);
        assert_eq!(rule.judge(&belief, None), Some(StopReason::Sure));
        let mut torn = Belief::default();
        for weights in [[0.5, 0.5, 0.0], [0.4, 0.4, 0.2], [0.5, 0.5, 0.0]] {
            grasp(&mut torn, weights);
        }
        assert_eq!(rule.judge(&torn, None), Some(StopReason::GraspLimit));
    }

    #[test]
    fn contradicting_grasps_are_unknown() {
        let rejection = Rejection { share: 0.05, least: vec![-2.0, -1.0, -1.0] };
        let rule = StopRule { threshold: 0.9, most_grasps: 2 };
        let mut torn = Belief::default();
        grasp(&mut torn, [0.98, 0.01, 0.01]);
        assert_eq!(rule.judge(&torn, Some(&rejection)), Some(StopReason::Sure));
        grasp(&mut torn, [0.01, 0.98, 0.01]);
        assert!(torn.agreement() < -0.6 && torn.agreement() > -1.0);
        let strict = Rejection { least: vec![-0.5], ..rejection };
        assert_eq!(rule.judge(&torn, Some(&strict)), Some(StopReason::Unknown));
    }
}
