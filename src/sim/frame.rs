//! Samples of a simulation and their numerical quality: plain records, raw quantities only.

use crate::gripper::{GripperModel, Phase, PlacedFinger, Side, Sway};
use crate::scene::Accuracy;
use glam::DVec3;
use palpate_geometry::Pose;
use serde::{Deserialize, Serialize};

/// Load on one taxel at one sample, in the axes of its segment: the force on the finger.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TaxelLoad {
    /// Left pad's taxels first, then the right pad's; see [`crate::gripper::TaxelGrid`].
    pub taxel: u16,
    /// Force into the pad (N).
    pub normal: f32,
    /// Shear force towards the tip (N).
    pub along: f32,
    /// Shear force across the finger, along the gripper's y (N).
    pub across: f32,
}

/// Everything sampled at one instant.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Index of the sample, from 0.
    pub sample: u32,
    /// Time since the start of the trial (s).
    pub t: f64,
    /// Commanded line pressure (bar).
    pub line_bar: f64,
    /// Phase of the programme.
    pub phase: Phase,
    /// Joint angles, left finger then right, from palm to tip (rad).
    pub q: Vec<f64>,
    /// Shape of the left and of the right finger out of its plane; none unless they bend sideways and twist.
    pub sways: [Sway; 2],
    /// Way of the hand from where it began, in the world (m); zero unless it is shaken.
    pub hand: DVec3,
    /// The object's frame in the world; absent for an empty hand.
    pub world_from_object: Option<Pose>,
    /// Loaded taxels, in rising order; those not listed carry nothing.
    pub taxels: Vec<TaxelLoad>,
}

impl Frame {
    /// Joint angles of one finger (rad).
    pub fn joints(&self, side: Side) -> &[f64] {
        let n = self.q.len() / 2;
        &self.q[side.index() * n..(side.index() + 1) * n]
    }

    /// A finger as it is bent, in the gripper frame.
    pub fn placed(&self, gripper: &GripperModel, side: Side) -> PlacedFinger {
        PlacedFinger::new(gripper, side, self.joints(side), self.sways[side.index()])
    }

    /// Pose of the gripper in the world, given the one in which the trial began.
    pub fn world_from_gripper(&self, begun: &Pose) -> Pose {
        Pose { position: begun.position + self.hand, ..*begun }
    }

    /// Loads on one pad that has `count` taxels, with indices counted from that pad's first taxel.
    pub fn loads(&self, side: Side, count: usize) -> impl Iterator<Item = (usize, TaxelLoad)> + '_ {
        let from = side.index() * count;
        self.taxels
            .iter()
            .map(move |load| (usize::from(load.taxel).wrapping_sub(from), *load))
            .filter(move |(index, _)| *index < count)
    }

    /// Sum of the normal forces on one pad (N).
    pub fn normal_force(&self, side: Side, count: usize) -> f64 {
        self.loads(side, count).map(|(_, load)| f64::from(load.normal)).sum()
    }
}

/// Numerical quality of a simulated trial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Quality {
    /// False when a number became infinite or NaN; the trial ends before that step.
    pub finite: bool,
    /// False when any step missed the solver's tolerance.
    pub converged: bool,
    /// Solver steps taken.
    pub steps: u64,
    /// Steps taken again, shorter, because their estimated error was above the scene's tolerance.
    pub rejected_steps: u64,
    /// Steps of the least length whose estimated error was above it nevertheless.
    pub missed_steps: u64,
    /// The shortest step (s); zero in trials from before it was recorded.
    pub least_step_s: f64,
    /// Convex minimisations, those of rejected steps included; zero in trials from before it was recorded.
    pub solves: u64,
    /// Steps that missed the solver's tolerance.
    pub unconverged_steps: u64,
    /// Mean Newton iterations per minimisation; at fixed Euler steps that is per step.
    pub newton_mean: f64,
    /// Most Newton iterations in one step.
    pub newton_max: u32,
    /// Largest outer friction residual of any step; see [`crate::physics::StepReport`].
    pub friction_residual: f64,
    /// Largest torque at any joint that neither springs nor contacts account for at the end of the hold, as a share
    /// of the actuation torque. Far from zero means the grasp had not come to rest.
    pub static_residual: f64,
    /// Changes of a finger's force by more than 50 mN from one sample to the next, later than half a second into the
    /// hold, where nothing is commanded: the finger with more of them.
    pub hold_changes: u32,
    /// The same over the whole hold, in which an object may still settle.
    pub all_hold_changes: u32,
    /// Place and time of the imbalance; absent where every step reached its tolerance.
    pub imbalance: Option<Imbalance>,
    /// Why the trial was computed more finely than its scene asked for; absent where it was not.
    pub recomputed: Option<Recomputed>,
    /// Whether other simulations of the grasp give the same result; absent where there were none.
    pub agrees: Option<bool>,
    /// Why the grasp itself failed, though its numbers may be right; absent where it did not.
    pub failure: Option<GraspFailure>,
    /// Mean normal force of each finger on the object in the settled hold, left and right (N): contact between the fingers
    /// is not part of it. Absent where pads touch nothing but the object.
    pub hold_force: Option<[f64; 2]>,
}

/// A grasp that holds nothing, or began where no grasp can.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GraspFailure {
    /// The open fingers stood this deep inside the object or its support (m).
    StartedInside(f64),
    /// No finger touched the object.
    NeverTouched,
    /// The object fell or rolled out of the hand before the release.
    LostObject,
    /// A push of a micrometre changes how the grasp ends: it has no single answer.
    NoSingleAnswer,
}

impl std::fmt::Display for GraspFailure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::StartedInside(depth) => {
                write!(
                    f,
                    "the open fingers start {:.1} mm inside something: move the gripper or the object",
                    depth * 1e3
                )
            }
            Self::NeverTouched => f.write_str("no finger touched the object"),
            Self::NoSingleAnswer => f.write_str("a push of a micrometre decides how it ends"),
            Self::LostObject => f.write_str("the object left the hand before the release"),
        }
    }
}

/// An object this far from its start, or this far below it, has left the hand (m).
const GONE: f64 = 0.15;
const FALLEN: f64 = 0.03;

impl Frame {
    /// True if the object has left the hand since `start`.
    pub fn has_lost_object(&self, start: &Self) -> bool {
        let moved =
            start.world_from_object.zip(self.world_from_object).map(|(start, now)| now.position - start.position);
        moved.is_some_and(|moved| moved.length() > GONE || moved.z < -FALLEN)
    }
}

/// A trial that was computed again at a finer accuracy than its scene asked for. The scene of the trial has the
/// accuracy that it was computed at in the end.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recomputed {
    /// Accuracy that was asked for.
    pub asked: Accuracy,
    pub cause: RecomputeCause,
}

/// Cause for computing a trial again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RecomputeCause {
    /// Forces changed repeatedly in its hold, or it did not come to rest.
    Unsettled,
    /// Three levels of accuracy had to agree.
    UntilAgreement,
}

/// How far the numbers of a trial can be trusted: a light of three colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum TrustLevel {
    /// Runs at other accuracies end alike, and nothing was flagged.
    Green,
    /// Not compared with runs at other accuracies, or some steps missed the accuracy.
    Amber,
    /// Runs at other accuracies end elsewhere, or the trial is unsound or failed.
    Red,
}

impl TrustLevel {
    /// Its name: green, amber or red.
    pub fn name(self) -> &'static str {
        match self {
            Self::Green => "green",
            Self::Amber => "amber",
            Self::Red => "red",
        }
    }
}

impl std::fmt::Display for Recomputed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { asked, cause } = self;
        match cause {
            RecomputeCause::Unsettled => write!(f, "forces change in the hold at {asked}"),
            RecomputeCause::UntilAgreement => write!(f, "three levels had to agree, beginning at {asked}"),
        }
    }
}

/// Steps whose forces did not balance to the solver's tolerance: the first of them, and the worst.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Imbalance {
    /// Tick at which the first such step began.
    pub first_tick: u64,
    /// Its time (s).
    pub first_s: f64,
    /// Place of the largest imbalance: `joint 4 of the left finger`, `the object`.
    pub worst_at: String,
    /// Residual there over the residual that the tolerance allows.
    pub worst_excess: f64,
}

impl Quality {
    /// True when the trial may be learned from: it was solved, no other simulation gives another result, and the fingers
    /// started outside of everything. One that misses or loses the object may: a hand in use does so too.
    pub fn is_sound(&self) -> bool {
        self.is_solved() && self.agrees != Some(false) && !matches!(self.failure, Some(GraspFailure::StartedInside(_)))
    }

    /// True when every number was finite, every step reached its tolerance, and the hold came to rest.
    pub fn is_solved(&self) -> bool {
        self.finite && self.converged && !self.is_restless()
    }

    /// True when the hold did not come to rest: forces kept changing, or do not balance at its end.
    pub fn is_restless(&self) -> bool {
        self.hold_changes >= RESTLESS_CHANGES || self.static_residual > RESTLESS_RESIDUAL
    }

    /// True when forces changed repeatedly anywhere in the hold of an object, or it did not come to rest: a finer run tells
    /// whether the object really moves.
    pub fn is_unsettled(&self) -> bool {
        // Fingers that have lost the object swing against each other.
        let held = self.failure != Some(GraspFailure::LostObject);
        self.is_restless() || held && self.all_hold_changes >= RESTLESS_CHANGES
    }

    /// How far the trial can be trusted, and why, in a few words.
    pub fn trust(&self) -> (TrustLevel, String) {
        let missed = self.missed_steps;
        let diverged = (!self.finite).then(|| "the simulation diverged".to_owned());
        match (diverged.or_else(|| self.misses()), self.agrees) {
            (Some(cause), _) => (TrustLevel::Red, cause),
            (None, _) if missed > 0 => (TrustLevel::Amber, format!("{missed} steps missed the accuracy")),
            (None, None | Some(false)) => {
                (TrustLevel::Amber, "not verified: no run at another accuracy to compare with".to_owned())
            }
            (None, Some(true)) => (TrustLevel::Green, "runs at other accuracies end alike".to_owned()),
        }
    }

    /// Describes why a trial is not sound, in a sentence.
    pub fn misses(&self) -> Option<String> {
        let (missed, steps) = (self.unconverged_steps, self.steps);
        let place = |imbalance: &Imbalance| {
            let Imbalance { first_tick, first_s, worst_at, .. } = imbalance;
            format!(", the first at {first_s:.3} s (tick {first_tick}), worst at {worst_at}")
        };
        if !self.converged {
            let place = self.imbalance.as_ref().map(place).unwrap_or_default();
            return Some(format!("{missed} of {steps} steps missed the solver's tolerance{place}"));
        }
        let (changes, residual) = (self.hold_changes, 100.0 * self.static_residual);
        if self.is_restless() {
            return Some(format!(
                "the hold did not come to rest: {changes} changes of force above 50 mN, {residual:.0} % of the torque \
                 unbalanced at its end"
            ));
        }
        let elsewhere = (self.agrees == Some(false)).then(|| "runs at other accuracies end elsewhere".to_owned());
        self.failure.map(|failure| failure.to_string()).or(elsewhere)
    }
}

/// Changes of force in the hold from which on it counts as restless.
const RESTLESS_CHANGES: u32 = 5;
/// Static residual above which the hold has not come to rest.
const RESTLESS_RESIDUAL: f64 = 0.2;

impl Default for Quality {
    fn default() -> Self {
        Self {
            finite: true,
            converged: true,
            steps: 0,
            rejected_steps: 0,
            missed_steps: 0,
            least_step_s: 0.0,
            solves: 0,
            unconverged_steps: 0,
            newton_mean: 0.0,
            newton_max: 0,
            friction_residual: 0.0,
            static_residual: 0.0,
            hold_changes: 0,
            all_hold_changes: 0,
            imbalance: None,
            recomputed: None,
            agrees: None,
            failure: None,
            hold_force: None,
        }
    }
}

/// Decision about one effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlannedEffect {
    /// Its name in the scene's `[effects]`.
    pub name: String,
    /// Setting in the scene: `off`, `auto` or `on`.
    pub setting: String,
    /// True where it was simulated.
    pub on: bool,
    /// Dimensionless number that is compared with the threshold; never infinite.
    pub number: f64,
    /// `auto` means on where the number is above this.
    pub threshold: f64,
    pub reason: String,
}

/// Effects of a simulation, with the reason for each; decided once, when the scene is built.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Plan {
    /// In the order of [`Effect::ALL`](crate::scene::Effect::ALL); empty for trials of versions without effects.
    pub effects: Vec<PlannedEffect>,
}

impl Plan {
    /// True where an effect is simulated; false where the plan does not list it.
    pub fn is_on(&self, name: &str) -> bool {
        self.effects.iter().any(|effect| effect.name == name && effect.on)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trust_is_green_only_where_a_finer_run_agrees_and_nothing_is_flagged() {
        let light = |change: &dyn Fn(&mut Quality)| {
            let mut quality = Quality { agrees: Some(true), ..Quality::default() };
            change(&mut quality);
            quality.trust()
        };
        assert_eq!(light(&|_| ()).0, TrustLevel::Green);
        assert_eq!(light(&|q| q.agrees = None).0, TrustLevel::Amber);
        assert_eq!(light(&|q| q.missed_steps = 3), (TrustLevel::Amber, "3 steps missed the accuracy".to_owned()));
        for change in [
            (|q| q.agrees = Some(false)) as fn(&mut Quality),
            |q| q.converged = false,
            |q| q.finite = false,
            |q| q.hold_changes = 5,
            |q| q.static_residual = 0.3,
            |q| q.failure = Some(GraspFailure::NeverTouched),
        ] {
            assert_eq!(light(&change).0, TrustLevel::Red);
        }
        assert!(light(&|q| q.hold_changes = 7).1.contains("7 changes of force"));
    }

    #[test]
    fn loads_are_separated_by_side() {
        let load = |taxel, normal| TaxelLoad { taxel, normal, along: 0.0, across: 0.0 };
        let frame = Frame {
            sample: 0,
            t: 0.0,
            line_bar: 0.0,
            phase: Phase::Close,
            q: vec![1.0, 2.0, 3.0, 4.0],
            sways: [Sway::NONE; 2],
            hand: DVec3::ZERO,
            world_from_object: None,
            taxels: vec![load(3, 1.0), load(9, 2.0), load(10, 4.0), load(19, 8.0)],
        };
        assert_eq!(frame.joints(Side::Right), [3.0, 4.0]);
        let indices: Vec<usize> = frame.loads(Side::Right, 10).map(|(i, _)| i).collect();
        assert_eq!(indices, [0, 9]);
        assert_eq!((frame.normal_force(Side::Left, 10), frame.normal_force(Side::Right, 10)), (3.0, 12.0));
    }
}
