//! Grasps computed again at finer accuracy: where forces change in the hold, or until three levels agree.
//!
//! No flag detects that a free object slipped in the wrong direction, because this depends on the path, not on the
//! state at the end. A run at a tenth of the tolerance detects most such cases. If the two disagree, finer runs decide:
//!
//! ```text
//! asked for --> a tenth --> a hundredth --> ..  until three in a row end alike; the finest of them is reported
//! ```
//!
//! [`compare`] asks less: whether a grasp can be trusted as it is. Two coarser runs, from starts 50 µm away on either side, cost
//! less than the grasp. Where both give the same result, the grasp is taken as right; otherwise a run at a tenth of the
//! tolerance decides, or nothing does if that takes too long. All of them stop once their end is decided.
//!
//! Two in a row are not enough: one in a hundred extreme scenes ends in the same wrong place at two coarse levels. Levels
//! end one below the accuracy `reference`, but up to three are always computed. `palpate study stability` measures how
//! often the reported result is wrong, and what it costs.

use super::run::{grasp, prepare};
use glam::DVec3;
use palpate_sim::frame::{Frame, GraspFailure, Quality, RecomputeCause, Recomputed};
use palpate_sim::gripper::Phase;
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::{Accuracy, Scene, Solver};
use palpate_tactile::trial::SimulatedTrial;
use serde::Serialize;

/// When a grasp is computed again at a finer accuracy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Recompute {
    /// If forces change repeatedly in its hold, or it does not come to rest.
    #[default]
    Unsettled,
    /// Until three levels of accuracy in a row agree.
    UntilAgreement,
}

/// Where a grasp ends.
#[derive(Clone, Debug, PartialEq)]
pub enum EndState {
    /// The object has left the hand.
    Lost,
    /// Means over the hold from half a second on, when the object has settled; without a hold, values of the last
    /// sample.
    Held {
        /// Joint angles (rad).
        q: Vec<f64>,
        /// Position of the object (m); zero for an empty hand.
        place: DVec3,
    },
}

/// Time into the hold after which samples count (s).
const SETTLED_S: f64 = 0.5;
/// Largest difference of joint angles between ends that are alike (rad): 1.1 degrees, of eight at 1 bar.
const SAME_ANGLE: f64 = 0.02;
/// Largest distance of objects between ends that are alike (m).
const SAME_PLACE: f64 = 2e-3;

impl EndState {
    /// Reads the end of a grasp; `None` without samples.
    pub fn of(frames: &[Frame]) -> Option<Self> {
        let first = frames.first()?;
        let hold = |frame: &&Frame| frame.phase == Phase::Hold;
        let last = frames.iter().rfind(hold).or(frames.last())?;
        if last.has_lost_object(first) {
            return Some(Self::Lost);
        }
        let since = frames.iter().find(hold).map_or(f64::INFINITY, |frame| frame.t + SETTLED_S);
        let settled: Vec<&Frame> = frames.iter().filter(hold).filter(|frame| frame.t > since).collect();
        let settled = if settled.is_empty() { vec![last] } else { settled };
        let count = settled.len() as f64;
        let q = (0..last.q.len()).map(|k| settled.iter().map(|frame| frame.q[k]).sum::<f64>() / count).collect();
        let places = settled.iter().filter_map(|frame| frame.world_from_object);
        Some(Self::Held { q, place: places.map(|pose| pose.position).sum::<DVec3>() / count })
    }

    /// True if two grasps end alike: joints within 1.1 degrees and objects within 2 mm, or both objects lost.
    pub fn is_like(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Lost, Self::Lost) => true,
            (Self::Held { q, place }, Self::Held { q: other_q, place: other_place }) => {
                let angle = q.iter().zip(other_q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                angle <= SAME_ANGLE && (*place - *other_place).length() <= SAME_PLACE
            }
            _ => false,
        }
    }
}

/// Time for which nothing may move until the end of a grasp is decided (s).
const STILL_S: f64 = 0.12;
/// Largest change of a joint angle (rad) and of the object's place (m) in that time: a fortieth of what ends may differ by.
const STILL_ANGLE: f64 = SAME_ANGLE / 40.0;
const STILL_PLACE: f64 = SAME_PLACE / 40.0;

/// Watches a grasp for the moment from which on its end is decided: the object has left the hand, or nothing moves in the
/// hold.
#[derive(Clone, Debug)]
pub struct EndWatch {
    first: Frame,
    /// What the frames since are compared with.
    still_since: Option<Frame>,
}

impl EndWatch {
    /// Takes the first look at the grasp.
    pub fn new(first: Frame) -> Self {
        Self { first, still_since: None }
    }

    /// Takes a sample; returns the end once it is decided.
    pub fn note(&mut self, frame: &Frame) -> Option<EndState> {
        if frame.has_lost_object(&self.first) {
            return Some(EndState::Lost);
        }
        if frame.phase != Phase::Hold {
            self.still_since = None;
            return None;
        }
        let stands = |since: &&Frame| {
            let still = since.q.iter().zip(&frame.q).all(|(a, b)| (a - b).abs() <= STILL_ANGLE);
            let places = since.world_from_object.zip(frame.world_from_object);
            still && places.is_none_or(|(a, b)| (a.position - b.position).length() <= STILL_PLACE)
        };
        match self.still_since.as_ref().filter(stands) {
            Some(since) if frame.t - since.t >= STILL_S => EndState::of(std::slice::from_ref(frame)),
            Some(_) => None,
            None => {
                self.still_since = Some(frame.clone());
                None
            }
        }
    }
}

/// Number of levels in a row that must agree.
const AGREEING: usize = 3;

/// Result of runs at finer and finer accuracy.
#[derive(Clone, Debug, PartialEq)]
pub struct Agreed<T> {
    /// The last run: the finest of those that agree.
    pub result: T,
    /// Its settings.
    pub solver: Solver,
    /// False where not enough levels in a row agree.
    pub agree: bool,
}

/// Runs at an accuracy and at finer ones, until so many in a row agree, each with the one before.
pub fn until_agreement<T>(
    first: &Solver,
    in_a_row: usize,
    mut run: impl FnMut(&Solver) -> T,
    mut agree: impl FnMut(&T, &T) -> bool,
) -> Agreed<T> {
    let least = Accuracy::Reference.finer().step_tolerance();
    let mut solver = first.clone();
    let mut result = run(first);
    let (mut levels, mut agreeing) = (1, 1);
    while agreeing < in_a_row
        && let Some(finer) = solver.finer()
        && (levels < in_a_row || finer.accuracy.step_tolerance() >= least)
    {
        let refined = run(&finer);
        agreeing = if agree(&result, &refined) { agreeing + 1 } else { 1 };
        levels += 1;
        (solver, result) = (finer, refined);
    }
    Agreed { result, solver, agree: agreeing >= in_a_row }
}

/// The next level of accuracy, down to the reference.
fn next_level(solver: &Solver) -> Option<Solver> {
    let least = Accuracy::Reference.step_tolerance();
    solver.finer().filter(|finer| finer.accuracy.step_tolerance() >= least)
}

/// Runs a simulated grasp to its end, and again at finer accuracies if needed. The trial has the scene that it was
/// finally computed from; its quality gives the accuracy asked for, and why that was not enough.
pub fn grasp_soundly(scene: &Scene, object: Option<&ObjectModel>, seed: u64, recompute: Recompute) -> SimulatedTrial {
    match recompute {
        Recompute::Unsettled => {
            let mut trial = grasp(scene, object, seed);
            while trial.data.quality.is_unsettled()
                && let Some(solver) = next_level(&trial.header.scene.solver)
            {
                trial = grasp(&Scene { solver, ..scene.clone() }, object, seed);
            }
            noted(trial, scene, RecomputeCause::Unsettled)
        }
        Recompute::UntilAgreement => grasp_until_agreement(scene, object, seed, &|| false).expect("is never cancelled"),
    }
}

/// Runs a grasp until three levels of accuracy in a row agree, and come to rest; `None` if it was cancelled.
pub fn grasp_until_agreement(
    scene: &Scene,
    object: Option<&ObjectModel>,
    seed: u64,
    cancelled: &dyn Fn() -> bool,
) -> Option<SimulatedTrial> {
    let run = |solver: &Solver| {
        let scene = Scene { solver: solver.clone(), ..scene.clone() };
        prepare(&scene, object, seed).run_to_end(&scene, cancelled)
    };
    // A run that was cancelled ends the search at once: those that follow are cancelled too.
    let agree = |coarse: &Option<SimulatedTrial>, fine: &Option<SimulatedTrial>| match (coarse, fine) {
        (Some(coarse), Some(fine)) => fine.data.quality.is_solved() && ends_alike(coarse, fine),
        _ => true,
    };
    let Agreed { result, agree, .. } = until_agreement(&scene.solver, AGREEING, run, agree);
    let mut trial = noted(result?, scene, RecomputeCause::UntilAgreement);
    // An engine that controls no error has one level only.
    trial.data.quality.agrees = scene.solver.finer().map(|_| agree);
    Some(trial)
}

/// Change of an object's start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Push {
    /// Shift (m).
    pub shift: DVec3,
    /// Turn about the centre of mass, axis times angle (rad).
    pub turn: DVec3,
}

/// Push that changes nothing in a grasp with a single answer (m).
pub const PUSH: f64 = 1e-6;

/// Coarser simulations that a grasp is compared with: how many times its tolerance they have, and how far to the side the object
/// starts (m).
const COARSER: [(f64, f64); 2] = [(30.0, -5e-5), (10.0, 5e-5)];
/// Turn of the object with that shift (rad/m).
const TURNED: f64 = 30.0;
/// Minimisations after which the simulation that decides is given up, at accuracy standard. Finer ones get more, as a method
/// of second order needs.
const MOST_SOLVES: f64 = 5000.0;

/// Simulation that a grasp is compared with.
#[derive(Clone, Debug, PartialEq)]
pub struct OtherRun {
    /// Its end; absent where it was given up.
    pub end: Option<EndState>,
    /// Convex minimisations.
    pub solves: u64,
}

/// Result of comparing where a grasp ends with other simulations of it.
#[derive(Clone, Debug, PartialEq)]
pub struct EndComparison {
    /// Both coarser simulations give the same result.
    pub coarser: bool,
    /// Convex minimisations of these.
    pub coarser_solves: u64,
    /// The simulation at a tenth of the tolerance, where the coarser ones differ, and whether it gives the same result.
    pub tenth: Option<(OtherRun, bool)>,
}

impl EndComparison {
    /// Whether the grasp is confirmed.
    pub fn agrees(&self) -> bool {
        self.tenth.as_ref().map_or(self.coarser, |(_, agrees)| *agrees)
    }
}

/// Compares the end of a grasp with other simulations of it; see the top of this file. `run` simulates the grasp with other
/// settings and another start until its end is decided or it has taken so many minimisations; `None` cancels the comparison.
pub fn compare_end(
    solver: &Solver,
    end: &EndState,
    mut run: impl FnMut(&Solver, Push, u64) -> Option<OtherRun>,
) -> Option<EndComparison> {
    let alike = |other: &OtherRun| other.end.as_ref().is_some_and(|other| other.is_like(end));
    let most = most_solves(solver);
    let mut found = EndComparison { coarser: true, coarser_solves: 0, tenth: None };
    for (factor, shift) in COARSER {
        let push = Push { shift: DVec3::X * shift, turn: DVec3::Z * (TURNED * shift) };
        let other = run(&solver.coarser(factor)?, push, most)?;
        found.coarser_solves += other.solves;
        found.coarser = alike(&other);
        if !found.coarser {
            let tenth = run(&solver.finer()?, Push::default(), most)?;
            let agrees = alike(&tenth);
            found.tenth = Some((tenth, agrees));
            break;
        }
    }
    Some(found)
}

/// Minimisations after which a simulation that a grasp is compared with is given up.
fn most_solves(solver: &Solver) -> u64 {
    let finer = Accuracy::Standard.step_tolerance() / solver.accuracy.step_tolerance();
    (MOST_SOLVES * finer.max(1.0).cbrt()) as u64
}

/// Result of comparing a grasp with other simulations of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GraspComparison {
    /// Whether they give the same result.
    pub agrees: bool,
    /// True where a push of a micrometre changes the end.
    pub undecided: bool,
}

impl GraspComparison {
    /// Notes it in the quality of the grasp.
    pub fn note(self, quality: &mut Quality) {
        quality.agrees = Some(self.agrees);
        if self.undecided {
            quality.failure = Some(GraspFailure::NoSingleAnswer);
        }
    }
}

/// Compares a grasp with other simulations of it, and where they differ with pushes of a micrometre. `None` where the engine
/// controls no error, without an end, and if it was cancelled.
pub fn compare(
    scene: &Scene,
    object: Option<&ObjectModel>,
    seed: u64,
    end: Option<&EndState>,
    cancelled: &dyn Fn() -> bool,
) -> Option<GraspComparison> {
    let run = |solver: &Solver, push: Push, most: u64| {
        let scene = Scene { solver: solver.clone(), ..scene.clone() };
        let mut grasp = prepare(&scene, object, seed);
        if object.is_some() {
            grasp.simulation_mut().move_object(push.shift, push.turn);
        }
        let mut watch = EndWatch::new(grasp.simulation_mut().first_look());
        let end = loop {
            if cancelled() {
                return None;
            }
            match grasp.next_frame().map(|frame| watch.note(frame)) {
                Some(None) if grasp.solves() <= most => {}
                Some(None) => break None,
                Some(decided) => break decided,
                None => break EndState::of(grasp.frames()),
            }
        };
        Some(OtherRun { end, solves: grasp.solves() })
    };
    let found = compare_end(&scene.solver, end?, run)?;
    let mut undecided = false;
    if let Some((OtherRun { end: Some(tenth), .. }, false)) = &found.tenth
        && object.is_some()
        && let Some(finer) = scene.solver.finer()
    {
        for axis in [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y] {
            let push = Push { shift: axis * PUSH, ..Push::default() };
            let pushed = run(&finer, push, most_solves(&scene.solver))?.end;
            undecided = undecided || pushed.is_some_and(|pushed| !pushed.is_like(tenth));
        }
    }
    Some(GraspComparison { agrees: found.agrees(), undecided })
}

/// True if two grasps end alike.
pub fn ends_alike(a: &SimulatedTrial, b: &SimulatedTrial) -> bool {
    match (EndState::of(a.frames()), EndState::of(b.frames())) {
        (Some(a), Some(b)) => a.is_like(&b),
        (a, b) => a.is_none() && b.is_none(),
    }
}

/// Notes in a trial that it was computed at another accuracy than the scene asks for.
fn noted(mut trial: SimulatedTrial, scene: &Scene, cause: RecomputeCause) -> SimulatedTrial {
    let asked = scene.solver.accuracy;
    trial.data.quality.recomputed =
        (trial.header.scene.solver.accuracy != asked).then_some(Recomputed { asked, cause });
    trial
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_geometry::Primitive;
    use palpate_sim::scene::{EngineKind, Integrator};

    fn ladder(first: Accuracy, in_a_row: usize, agree_from: f64) -> (Vec<String>, bool) {
        let mut levels = Vec::new();
        let solver = Solver { accuracy: first, ..Solver::default() };
        let agreed = until_agreement(
            &solver,
            in_a_row,
            |solver| {
                levels.push(solver.accuracy.to_string());
                solver.accuracy.step_tolerance()
            },
            |_, fine| *fine <= agree_from,
        );
        assert_eq!(agreed.result, agreed.solver.accuracy.step_tolerance());
        (levels, agreed.agree)
    }

    #[test]
    fn levels_end_where_enough_agree_or_below_the_reference() {
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let all = ["draft", "standard", "1e-5", "reference", "1e-7"];
        assert_eq!(ladder(Accuracy::Draft, 2, 1.0), (names(&all[..2]), true));
        assert_eq!(ladder(Accuracy::Draft, 2, 1e-5), (names(&all[..3]), true));
        assert_eq!(ladder(Accuracy::Draft, 3, 1.0), (names(&all[..3]), true));
        assert_eq!(ladder(Accuracy::Draft, 3, 1e-5), (names(&all[..4]), true));
        assert_eq!(ladder(Accuracy::Draft, 3, 0.0), (names(&all), false));
        assert_eq!(ladder(Accuracy::Reference, 3, 1.0), (names(&["reference", "1e-7", "1e-8"]), true));
        assert_eq!(ladder(Accuracy::Tolerance(1e-9), 3, 1.0), (names(&["1e-9"]), false));
        let rapier = Solver { engine: EngineKind::Rapier, ..Solver::default() };
        assert_eq!(until_agreement(&rapier, 2, |_| (), |(), ()| true).solver, rapier);
        let euler = Solver { integrator: Integrator::Euler, ..Solver::default() };
        assert_eq!(until_agreement(&euler, 2, |_| (), |(), ()| true).solver.integrator, Integrator::Auto);
    }

    #[test]
    fn ends_are_alike_within_a_degree_and_two_millimetres() {
        let end = |q: f64, z: f64| EndState::Held { q: vec![0.1, q], place: DVec3::new(0.0, 0.0, z) };
        let here = end(0.1, 0.05);
        assert!(here.is_like(&end(0.119, 0.0515)));
        for other in [end(0.121, 0.05), end(0.1, 0.0525), EndState::Lost] {
            assert!(!here.is_like(&other), "{other:?}");
        }
        assert!(EndState::Lost.is_like(&EndState::Lost));
    }

    #[test]
    fn the_end_is_the_mean_of_the_settled_hold() {
        let frame = |k: u32, phase, q: f64, z: f64| Frame {
            sample: k,
            t: f64::from(k) / 75.0,
            line_bar: 1.0,
            phase,
            q: vec![q; 2],
            sways: [palpate_sim::gripper::Sway::NONE; 2],
            hand: glam::DVec3::ZERO,
            world_from_object: Some(palpate_geometry::Pose::new(DVec3::new(0.0, 0.0, z), glam::DQuat::IDENTITY)),
            taxels: Vec::new(),
        };
        let ringing = |k: u32| 0.2 + if k.is_multiple_of(2) { 0.05 } else { -0.05 };
        let mut frames: Vec<Frame> = (0..76).map(|k| frame(k, Phase::Hold, ringing(k), 0.05)).collect();
        let Some(EndState::Held { q, place }) = EndState::of(&frames) else { panic!("held") };
        assert!((q[0] - 0.2).abs() < 2e-3 && (place.z - 0.05).abs() < 1e-12, "{q:?} {place}");
        // What the release does is not part of it.
        frames.push(frame(76, Phase::Release, 0.0, -1.0));
        assert_eq!(EndState::of(&frames), Some(EndState::Held { q, place }));
        frames.push(frame(77, Phase::Hold, 0.2, 0.0));
        assert_eq!(EndState::of(&frames), Some(EndState::Lost));
        let closing = frame(0, Phase::Close, 0.3, 0.05);
        assert_eq!(
            EndState::of(std::slice::from_ref(&closing)),
            Some(EndState::Held { q: vec![0.3; 2], place: DVec3::Z * 0.05 })
        );
        assert_eq!(EndState::of(&[]), None);
    }

    #[test]
    fn a_grasp_that_three_levels_agree_on_is_that_of_the_finest() {
        let ball = ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.02 }, 400.0, 0.6);
        let mut scene = Scene::default();
        scene.solver.accuracy = Accuracy::Draft;
        let draft = grasp_soundly(&scene, Some(&ball), 0, Recompute::Unsettled);
        assert!(draft == grasp(&scene, Some(&ball), 0), "a grasp at rest is computed once");
        let agreed = grasp_soundly(&scene, Some(&ball), 0, Recompute::UntilAgreement);
        assert_eq!(agreed.header.scene.solver.accuracy, Accuracy::Tolerance(1e-5));
        let finest = grasp(&Scene { solver: agreed.header.scene.solver.clone(), ..scene.clone() }, Some(&ball), 0);
        assert!(agreed.frames() == finest.frames());
        let quality = &agreed.data.quality;
        assert_eq!(quality.agrees, Some(true));
        let cause = RecomputeCause::UntilAgreement;
        assert_eq!(quality.recomputed, Some(Recomputed { asked: Accuracy::Draft, cause }));
        assert_eq!(grasp_until_agreement(&scene, Some(&ball), 0, &|| true), None);
    }

    #[test]
    fn a_quiet_grasp_is_confirmed_by_a_cheaper_run_and_a_wrong_end_is_not() {
        let ball = ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.02 }, 400.0, 0.6);
        let scene = Scene::default();
        let end = EndState::of(grasp(&scene, Some(&ball), 0).frames());
        let checked = |end: &Option<EndState>| compare(&scene, Some(&ball), 0, end.as_ref(), &|| false);
        assert_eq!(checked(&end), Some(GraspComparison { agrees: true, undecided: false }));
        // All other runs hold the ball.
        let lost = checked(&Some(EndState::Lost)).expect("is compared");
        assert_eq!(lost, GraspComparison { agrees: false, undecided: false });
        let mut quality = Quality::default();
        lost.note(&mut quality);
        assert_eq!((quality.agrees, quality.failure), (Some(false), None));
        GraspComparison { agrees: false, undecided: true }.note(&mut quality);
        assert_eq!(quality.misses().as_deref(), Some("a push of a micrometre decides how it ends"));
        assert_eq!(compare(&scene, Some(&ball), 0, end.as_ref(), &|| true), None);
        let mut rapier = scene.clone();
        rapier.solver.engine = EngineKind::Rapier;
        assert_eq!(compare(&rapier, Some(&ball), 0, end.as_ref(), &|| false), None);
    }
}
