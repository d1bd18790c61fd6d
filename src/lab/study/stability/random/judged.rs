//! A random scene judged: its results at several accuracies against the truth.
//!
//! The truth is the second-order method under a tolerance so tight that the next level ends alike: from the reference
//! accuracy on, down to the least tolerance. Where a result differs from it, or the truth itself took more than two
//! levels, the object's start is changed by a micrometre in twelve ways. The scene has no single answer if at least two of
//! them end apart. Where no two levels agree and the twelve do, or where runs had to be given up, it stays undecided.

use super::scene::{Push, Ran, RandomScene};
use crate::grasping::until_agreement;
use palpate_sim::scene::{Accuracy, Solver};
use serde::{Deserialize, Serialize};

/// Levels that every scene is computed at: down to the reference, and the one that the reference is compared with.
pub(super) const LEVELS: [Accuracy; 5] =
    [Accuracy::Draft, Accuracy::Standard, Accuracy::Tolerance(1e-5), Accuracy::Reference, Accuracy::Tolerance(1e-7)];

/// What is known about the truth of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// It has one end.
    Single,
    /// Small changes of the start change the end.
    NoAnswer,
    /// No two levels agree, or they cost too much.
    Undecided,
}

/// Pushes that must end apart from the truth for a scene to have no single answer.
const APART: u32 = 2;

/// Result of a scene at one accuracy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LevelResult {
    /// Tolerance of a step.
    pub tolerance: f64,
    /// Ends like the truth.
    pub right: bool,
    /// Comes to rest and ends like the level before; absent for the first.
    pub agrees: Option<bool>,
    /// No number left the range, and the run was not given up.
    pub ended: bool,
    /// Steps that missed the solver's tolerance.
    pub unconverged: u64,
    /// Steps of the least length that missed the accuracy.
    pub missed: u64,
    /// Did not come to rest; see [`palpate_sim::frame::Quality::is_restless`].
    pub restless: bool,
    /// Changes of force in the hold.
    pub hold_changes: u32,
    /// Share of the torque that is not balanced at the end.
    pub static_residual: f64,
    /// Largest outer friction residual.
    pub friction_residual: f64,
    /// Steps.
    pub steps: u64,
    /// Convex minimisations: the cost that does not depend on the machine.
    pub solves: u64,
    /// Mean Newton iterations per minimisation.
    pub newton_mean: f64,
    /// Most Newton iterations in a step.
    pub newton_max: u32,
}

impl LevelResult {
    fn new(accuracy: Accuracy, ran: &Ran, truth: &Ran, before: Option<&Ran>) -> Self {
        let quality = &ran.quality;
        Self {
            tolerance: accuracy.step_tolerance(),
            right: ran.ends_like(truth),
            agrees: before.map(|before| agree(before, ran)),
            ended: ran.has_ended(),
            unconverged: quality.unconverged_steps,
            missed: quality.missed_steps,
            restless: quality.is_restless(),
            hold_changes: quality.hold_changes,
            static_residual: quality.static_residual,
            friction_residual: quality.friction_residual,
            steps: quality.steps,
            solves: quality.solves,
            newton_mean: quality.newton_mean,
            newton_max: quality.newton_max,
        }
    }

    /// True where a trial with this result is flagged: it is not sound, or missed its accuracy.
    pub fn is_flagged(&self) -> bool {
        !self.ended || self.unconverged > 0 || self.restless || self.missed > 0
    }
}

/// True if a result can be reported by the rule of [`until_agreement`].
fn agree(coarse: &Ran, fine: &Ran) -> bool {
    fine.quality.is_sound() && coarse.ends_like(fine)
}

/// A scene with its results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JudgedScene {
    /// Its number.
    pub number: u64,
    /// Results at the levels that every scene is computed at, coarsest first.
    pub levels: Vec<LevelResult>,
    /// Results from the drawn tolerance on, until two levels agree.
    pub drawn: Vec<LevelResult>,
    /// Tolerance of the truth.
    pub truth: f64,
    /// What is known about it.
    pub verdict: Verdict,
    /// True if a number left the range in any run.
    pub diverged: bool,
    /// CPU time of all runs (s).
    pub cpu_s: f64,
}

impl JudgedScene {
    /// Computes a scene at all levels.
    pub fn new(seed: u64, number: u64) -> Self {
        let scene = RandomScene::draw(seed, number);
        let start = cpu_time::ThreadTime::now();
        let truth = Truth::of(&scene);
        let below = LEVELS.len() - truth.first_two.len();
        let mut runs: Vec<Ran> =
            LEVELS[..below].iter().map(|accuracy| scene.run(&solver(*accuracy), Push::default())).collect();
        runs.extend(truth.first_two.clone());
        let level = |k: usize| LevelResult::new(LEVELS[k], &runs[k], &truth.run, k.checked_sub(1).map(|k| &runs[k]));
        let levels: Vec<LevelResult> = (0..LEVELS.len()).map(level).collect();
        let drawn = from_drawn(&scene, &truth);
        let disputed = !truth.at_once || levels.iter().chain(&drawn).any(|level| !level.right);
        let verdict = if disputed { truth.pushed(&scene) } else { Verdict::Single };
        let diverged = runs.iter().any(|ran| !ran.quality.finite);
        let cpu_s = start.elapsed().as_secs_f64();
        Self { number, levels, drawn, truth: truth.solver.accuracy.step_tolerance(), verdict, diverged, cpu_s }
    }

    /// Results from one of the levels on, as many as there may be until two agree: down to the reference.
    pub(super) fn ladder(&self, first: usize) -> &[LevelResult] {
        &self.levels[first..(LEVELS.len() - 1).max(first + 2)]
    }
}

fn solver(accuracy: Accuracy) -> Solver {
    Solver { accuracy, ..Solver::default() }
}

/// Results from the drawn tolerance on, until two levels agree.
fn from_drawn(scene: &RandomScene, truth: &Truth) -> Vec<LevelResult> {
    let mut levels: Vec<LevelResult> = Vec::new();
    let mut accuracy = Accuracy::Tolerance(scene.tolerance);
    let run = |solver: &Solver| scene.run(solver, Push::default());
    until_agreement(&solver(accuracy), run, |coarse, fine| {
        if levels.is_empty() {
            levels.push(LevelResult::new(accuracy, coarse, &truth.run, None));
        }
        accuracy = accuracy.finer();
        levels.push(LevelResult::new(accuracy, fine, &truth.run, Some(coarse)));
        agree(coarse, fine)
    });
    levels
}

/// The truth about a scene.
struct Truth {
    /// Runs at the reference accuracy and at the next level.
    first_two: [Ran; 2],
    run: Ran,
    /// Settings of that run.
    solver: Solver,
    /// Settings of the level before.
    coarser: Solver,
    /// Two levels agree.
    settled: bool,
    /// The first two do.
    at_once: bool,
}

impl Truth {
    fn of(scene: &RandomScene) -> Self {
        let first_two = [LEVELS[3], LEVELS[4]].map(|accuracy| scene.run(&solver(accuracy), Push::default()));
        let at_once = first_two[1].ends_like(&first_two[0]);
        let mut truth = Self {
            run: first_two[1].clone(),
            coarser: solver(LEVELS[3]),
            solver: solver(LEVELS[4]),
            settled: at_once,
            at_once,
            first_two,
        };
        while let Some(finer) = truth.solver.finer().filter(|_| !truth.settled && truth.run.has_ended()) {
            let run = scene.run(&finer, Push::default());
            truth.settled = run.ends_like(&truth.run);
            truth.coarser = std::mem::replace(&mut truth.solver, finer);
            truth.run = run;
        }
        truth
    }

    /// Changes the start in twelve ways: at the coarser of two levels that agree, or at the reference accuracy.
    fn pushed(&self, scene: &RandomScene) -> Verdict {
        let (solver, run) = match self.settled {
            true => (&self.coarser, &self.run),
            false => (&solver(LEVELS[3]), &self.first_two[0]),
        };
        let mut apart = 0;
        // A run that was given up tells nothing.
        for push in scene.pushes().into_iter().take_while(|_| run.has_ended()) {
            let pushed = scene.run(solver, push);
            apart += u32::from(pushed.has_ended() && !pushed.ends_like(run));
            if apart == APART {
                return Verdict::NoAnswer;
            }
        }
        if self.settled { Verdict::Single } else { Verdict::Undecided }
    }
}
