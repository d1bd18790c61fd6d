//! A random scene judged: its results at several accuracies against the truth.
//!
//! The truth is the second-order method under a tolerance so tight that the next level ends alike: from the reference
//! accuracy on, down to the least tolerance. Where a result differs from it, or the truth itself took more than two
//! levels, the object's start is changed by a micrometre in twelve ways. The scene has no single answer if at least two of
//! them end apart. Where no two levels agree and the twelve do, or where runs had to be given up, it stays undecided.

use super::scene::{Ran, RandomScene};
use palpate_lab::grasping::{EndComparison, Push, compare_end, until_agreement};
use palpate_sim::scene::{Accuracy, Solver};
use serde::{Deserialize, Serialize};
use std::cell::RefCell;

/// Levels that every scene is computed at: down to the reference, and the one that the reference is compared with.
pub(super) const LEVELS: [Accuracy; 5] =
    [Accuracy::Draft, Accuracy::Standard, Accuracy::Tolerance(1e-5), Accuracy::Reference, Accuracy::Tolerance(1e-7)];

/// What is known about the truth of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SceneVerdict {
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

    /// True where a trial with this result is flagged as unsound.
    pub fn is_flagged(&self) -> bool {
        !self.ended || self.unconverged > 0 || self.restless
    }
}

/// Results that decide the trust light of a trial at standard.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ComparedResult {
    /// The coarser runs from starts nearby give the same result.
    pub coarser: bool,
    /// Their convex minimisations.
    pub coarser_solves: u64,
    /// The grasp is confirmed: by these runs or, where they differ, by a run at a tenth of the tolerance.
    pub confirmed: bool,
    /// Convex minimisations of that run; zero where there was none.
    pub tenth_solves: u64,
    /// A run at the reference accuracy is solved and gives the same result.
    pub reference: bool,
}

impl ComparedResult {
    fn new(runs: &Runs<'_>, standard: &Ran, reference: &Ran) -> Self {
        let run = |solver: &Solver, push, most| Some(runs.scene.run_until_decided(solver, push, most));
        let found = standard.end.as_ref().and_then(|end| compare_end(&solver(LEVELS[1]), end, run));
        let confirmed = found.as_ref().is_some_and(EndComparison::agrees);
        let (coarser, coarser_solves, tenth) =
            found.map_or((false, 0, None), |found| (found.coarser, found.coarser_solves, found.tenth));
        let tenth_solves = tenth.map_or(0, |(run, _)| run.solves);
        Self { coarser, coarser_solves, confirmed, tenth_solves, reference: agree(standard, reference) }
    }
}

/// True if a result can be reported by the rule of [`until_agreement`].
fn agree(coarse: &Ran, fine: &Ran) -> bool {
    fine.quality.is_solved() && coarse.ends_like(fine)
}

/// A scene with its results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JudgedScene {
    pub number: u64,
    /// Results at the levels that every scene is computed at, coarsest first.
    pub levels: Vec<LevelResult>,
    /// Results from the drawn tolerance on, until two levels agree.
    pub drawn: Vec<LevelResult>,
    /// Comparison of a trial at standard.
    pub compared: ComparedResult,
    /// Tolerance of the truth.
    pub truth: f64,
    /// What is known about it.
    pub verdict: SceneVerdict,
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
        let runs = Runs::of(&scene);
        let truth = Truth::of(&runs);
        let ran = LEVELS.map(|accuracy| runs.at(accuracy));
        let level = |k: usize| LevelResult::new(LEVELS[k], &ran[k], &truth.run, k.checked_sub(1).map(|k| &ran[k]));
        let levels: Vec<LevelResult> = (0..LEVELS.len()).map(level).collect();
        let drawn = from_drawn(&runs, &truth);
        let compared = ComparedResult::new(&runs, &ran[1], &ran[3]);
        let disputed = truth.accuracy != LEVELS[4] || levels.iter().chain(&drawn).any(|level| !level.right);
        let verdict = if disputed { truth.pushed(&runs) } else { SceneVerdict::Single };
        let diverged = runs.any_diverged();
        let cpu_s = start.elapsed().as_secs_f64();
        Self { number, levels, drawn, compared, truth: truth.accuracy.step_tolerance(), verdict, diverged, cpu_s }
    }

    /// Results from one of the levels on.
    pub(super) fn ladder(&self, first: usize) -> &[LevelResult] {
        &self.levels[first..]
    }
}

fn solver(accuracy: Accuracy) -> Solver {
    Solver { accuracy, ..Solver::default() }
}

/// Runs of a scene by tolerance. Finer runs than one that was given up are given up at once.
struct Runs<'a> {
    scene: &'a RandomScene,
    known: RefCell<Vec<(f64, Ran)>>,
}

impl<'a> Runs<'a> {
    /// Computes the reference first: where that is given up, the levels between it and standard are not computed.
    fn of(scene: &'a RandomScene) -> Self {
        let runs = Self { scene, known: RefCell::default() };
        if !runs.at(LEVELS[3]).has_ended() {
            runs.known.borrow_mut().push((LEVELS[2].step_tolerance(), Ran::given_up()));
        }
        runs
    }

    fn at(&self, accuracy: Accuracy) -> Ran {
        let tolerance = accuracy.step_tolerance();
        let holds = |(known, ran): &&(f64, Ran)| *known == tolerance || *known > tolerance && !ran.has_ended();
        let known = self.known.borrow().iter().find(holds).map(|(_, ran)| ran.clone());
        known.unwrap_or_else(|| {
            let ran = self.scene.run(&solver(accuracy), Push::default());
            self.known.borrow_mut().push((tolerance, ran.clone()));
            ran
        })
    }

    fn any_diverged(&self) -> bool {
        self.known.borrow().iter().any(|(_, ran)| !ran.quality.finite)
    }
}

/// Results from the drawn tolerance on, until two levels agree.
fn from_drawn(runs: &Runs<'_>, truth: &Truth) -> Vec<LevelResult> {
    let mut levels: Vec<LevelResult> = Vec::new();
    let mut accuracy = Accuracy::Tolerance(runs.scene.tolerance);
    until_agreement(
        &solver(accuracy),
        2,
        |solver| runs.at(solver.accuracy),
        |coarse, fine| {
            if levels.is_empty() {
                levels.push(LevelResult::new(accuracy, coarse, &truth.run, None));
            }
            accuracy = accuracy.finer();
            levels.push(LevelResult::new(accuracy, fine, &truth.run, Some(coarse)));
            agree(coarse, fine)
        },
    );
    levels
}

/// The truth about a scene.
struct Truth {
    run: Ran,
    /// Accuracy of that run.
    accuracy: Accuracy,
    /// The level before, if it agrees.
    coarser: Option<Accuracy>,
}

impl Truth {
    fn of(runs: &Runs<'_>) -> Self {
        let mut accuracy = LEVELS[3];
        let mut run = runs.at(accuracy);
        while run.has_ended()
            && let Some(finer) = solver(accuracy).finer().map(|solver| solver.accuracy)
        {
            let finer_run = runs.at(finer);
            let coarser = finer_run.ends_like(&run).then_some(accuracy);
            (accuracy, run) = (finer, finer_run);
            if coarser.is_some() {
                return Self { run, accuracy, coarser };
            }
        }
        Self { run, accuracy, coarser: None }
    }

    /// Changes the start in twelve ways: at the coarser of two levels that agree, or at the reference accuracy.
    fn pushed(&self, runs: &Runs<'_>) -> SceneVerdict {
        let accuracy = self.coarser.unwrap_or(LEVELS[3]);
        let run = runs.at(accuracy);
        let mut apart = 0;
        // A run that was given up tells nothing.
        for push in runs.scene.pushes().into_iter().take_while(|_| run.has_ended()) {
            let pushed = runs.scene.run(&solver(accuracy), push);
            apart += u32::from(pushed.has_ended() && !pushed.ends_like(&run));
            if apart == APART {
                return SceneVerdict::NoAnswer;
            }
        }
        if self.coarser.is_some() { SceneVerdict::Single } else { SceneVerdict::Undecided }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_is_judged_the_same_again_and_a_quiet_one_has_one_end() {
        let scenes: Vec<JudgedScene> = [5, 10, 25].map(|number| JudgedScene::new(1, number)).to_vec();
        for scene in &scenes {
            assert_eq!((scene.verdict, scene.truth, scene.diverged), (SceneVerdict::Single, 1e-7, false), "{scene:?}");
            assert!(scene.levels.iter().all(|level| level.right && level.agrees != Some(false)), "{scene:?}");
            let tolerances: Vec<f64> = scene.levels.iter().map(|level| level.tolerance).collect();
            assert_eq!(tolerances, [1e-3, 1e-4, 1e-5, 1e-6, 1e-7]);
            assert!(scene.levels.windows(2).all(|pair| pair[1].solves > pair[0].solves));
            assert!(scene.drawn.len() == 2 && scene.drawn[1].agrees == Some(true));
            assert_eq!((scene.ladder(0).len(), scene.ladder(3).len()), (5, 2));
        }
        let mut again = JudgedScene::new(1, 10);
        again.cpu_s = scenes[1].cpu_s;
        assert_eq!(again, scenes[1]);
    }
}
