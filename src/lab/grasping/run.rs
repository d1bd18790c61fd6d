//! Running a grasp frame by frame, so that a window can show it while it happens and a command can run it through.

use crate::gripper::{Event, Rig};
use palpate_sim::frame::Frame;
use palpate_sim::gripper::{BentFinger, Programme, Side};
use palpate_sim::objects::ObjectModel;
use palpate_sim::physics::Refinement;
use palpate_sim::run::SimRun;
use palpate_sim::scene::{Effect, Scene, Setting};
use palpate_tactile::trial::{Trial, TrialInfo};

/// A grasp in progress on a rig.
#[derive(Clone, Debug)]
pub struct GraspRun<R> {
    rig: R,
    programme: Programme,
    info: TrialInfo,
    frames: Vec<Frame>,
    finished: bool,
}

/// Sets up a simulated grasp. `seed` is recorded; it does not change the scene (see [`super::jittered`]).
pub fn prepare(scene: &Scene, object: Option<&ObjectModel>, seed: u64) -> GraspRun<SimRun> {
    prepare_refined(scene, object, seed, Refinement::None)
}

/// The same grasp computed more finely, sampled at the same times: what the error of the other is estimated from.
pub fn prepare_companion(scene: &Scene, object: Option<&ObjectModel>, seed: u64) -> GraspRun<SimRun> {
    prepare_refined(scene, object, seed, Refinement::Refined)
}

fn prepare_refined(scene: &Scene, object: Option<&ObjectModel>, seed: u64, refinement: Refinement) -> GraspRun<SimRun> {
    let (rig, placement) = SimRun::refined(scene, object, refinement);
    let mut warnings = object.map(|o| o.warnings.clone()).unwrap_or_default();
    warnings.extend(placement.warnings);
    warnings.extend(programme_warnings(scene));
    let info = TrialInfo {
        rig: rig.name().to_owned(),
        object: object.map_or("empty", |o| &o.name).to_owned(),
        seed,
        collection: None,
        scene: scene.to_toml(),
        world_from_gripper: placement.world_from_gripper,
        plan: rig.plan().clone(),
        quality: rig.quality(),
        warnings,
        version: env!("CARGO_PKG_VERSION").to_owned(),
    };
    let mut run = GraspRun::new(rig, scene.programme.clone(), info);
    run.warn_of_overlap();
    run
}

/// Sets up and runs a simulated grasp to its end.
pub fn grasp(scene: &Scene, object: Option<&ObjectModel>, seed: u64) -> Trial {
    let mut run = prepare(scene, object, seed);
    while run.next_frame().is_some() {}
    run.finish(scene)
}

fn programme_warnings(scene: &Scene) -> Vec<String> {
    let mut warnings = Vec::new();
    let needed = f64::from(scene.programme.total_ticks()) / f64::from(scene.timing.actuation_hz);
    if needed > scene.timing.duration_s + 1e-9 {
        let lasts = scene.timing.duration_s;
        warnings.push(format!("the programme takes {needed:.1} s but the trial ends after {lasts:.1} s"));
    }
    let actuation = &scene.gripper.actuation;
    let programme = &scene.programme;
    for (key, bar) in [
        ("peak_bar", programme.peak_bar),
        ("close_bar_per_tick", programme.close_bar_per_tick),
        ("release_bar_per_tick", programme.release_bar_per_tick),
    ] {
        let nearest = actuation.nearest_command(bar);
        if (nearest - bar).abs() > 1e-9 {
            let step = actuation.step_bar;
            warnings.push(format!("programme.{key} = {bar} is not a multiple of the control box's {step} bar"));
        }
    }
    warnings
}

impl<R: Rig> GraspRun<R> {
    /// A grasp about to begin.
    pub fn new(rig: R, programme: Programme, info: TrialInfo) -> Self {
        Self { rig, programme, info, frames: Vec::new(), finished: false }
    }

    /// What is known of the trial so far.
    pub fn info(&self) -> &TrialInfo {
        &self.info
    }

    /// The rig it runs on.
    pub fn rig_mut(&mut self) -> &mut R {
        &mut self.rig
    }

    /// Adds something that should be known of the trial.
    pub fn warn(&mut self, text: String) {
        self.info.warnings.push(text);
    }

    /// Frames sampled so far.
    pub fn frames(&self) -> &[Frame] {
        &self.frames
    }

    /// Runs on to the next sample; `None` at the end. A rig that fails ends the trial with a warning; what was
    /// sampled before is kept.
    pub fn next_frame(&mut self) -> Option<&Frame> {
        while !self.finished {
            match self.rig.next_event() {
                Ok(Event::ActuationDue { tick }) => {
                    let (bar, phase) = self.programme.command(tick);
                    self.rig.command(bar, phase);
                }
                Ok(Event::Sampled(frame)) => {
                    self.frames.push(frame);
                    return self.frames.last();
                }
                // A board is recorded by `record_board`.
                Ok(Event::Heard(_) | Event::Commanded(_)) => {}
                Ok(Event::Finished) => self.finished = true,
                Err(error) => {
                    self.info.warnings.push(error.to_string());
                    self.info.quality.finite = false;
                    self.finished = true;
                }
            }
        }
        None
    }

    /// The trial, with its quality and what was noticed about it.
    pub fn finish(mut self, scene: &Scene) -> Trial {
        let finite = self.info.quality.finite;
        self.info.quality = self.rig.quality();
        self.info.quality.finite &= finite;
        self.info.warnings.extend(self.info.quality.misses());
        let quality = &self.info.quality;
        if quality.missed_steps > 0 {
            let (missed, steps, least) = (quality.missed_steps, quality.steps, quality.least_step_s * 1e6);
            let tolerance = scene.solver.accuracy;
            self.info.warnings.push(format!(
                "{missed} of {steps} steps missed the accuracy {tolerance}, though they were as short as steps get ({least:.1} \
                 µs): try a larger tolerance"
            ));
        }
        self.info.warnings.extend(self.rig.notes());
        let passable = scene.effects.get(Effect::FingerContact) == Setting::Off;
        if let Some(t) = fingers_cross(scene, &self.frames).filter(|_| passable) {
            let text = format!("the fingers pass through each other from {t:.2} s: effects.finger-contact is off");
            self.info.warnings.push(text);
        }
        Trial { info: self.info, frames: self.frames }
    }
}

impl GraspRun<SimRun> {
    /// Notes when the open fingers already stand inside the object or its support.
    fn warn_of_overlap(&mut self) {
        let depth = self.rig.starting_overlap();
        if depth > DEEPEST_START {
            let mm = depth * 1e3;
            let text = format!("the open fingers start {mm:.1} mm inside something: move the gripper or the object");
            self.info.warnings.push(text);
        }
    }
}

/// A start this deep inside something is mentioned (m).
const DEEPEST_START: f64 = 5e-4;

/// When, if ever, the pads of the two fingers have changed sides.
fn fingers_cross(scene: &Scene, frames: &[Frame]) -> Option<f64> {
    let gripper = &scene.gripper;
    let grid = gripper.taxels();
    let reach = |frame: &Frame, side: Side| {
        let bent = BentFinger::new(&gripper.finger, frame.joints(side));
        (0..grid.rows)
            .map(|row| {
                let (segment, along) = grid.place(row * grid.columns, &gripper.finger);
                bent.segments[segment].point(along, gripper.pad.thickness).x
            })
            .fold(0.0, f64::max)
    };
    let room = 2.0 * gripper.half_gap();
    let crossed = |frame: &&Frame| reach(frame, Side::Left) + reach(frame, Side::Right) > room;
    // Fingers move little between samples; every fifth frame is enough to notice.
    frames.iter().step_by(5).find(crossed).map(|frame| frame.t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_geometry::Primitive;
    use palpate_sim::frame::Quality;

    fn ball() -> ObjectModel {
        ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.02 }, 400.0, 0.6)
    }

    #[test]
    fn a_grasp_of_a_ball_is_sound() {
        let trial = grasp(&Scene::default(), Some(&ball()), 0);
        assert_eq!(trial.frames.len(), 300);
        assert!(trial.info.warnings.is_empty(), "{:?}", trial.info.warnings);
        let Quality { finite, converged, steps, static_residual, .. } = trial.info.quality;
        assert!(finite && converged && steps == 1200);
        assert!(static_residual < 1e-3, "{static_residual}");
    }

    #[test]
    fn an_empty_hand_closes_on_itself_unless_it_is_told_not_to() {
        let mut scene = Scene::default();
        let trial = grasp(&scene, None, 0);
        assert_eq!(trial.info.object, "empty");
        assert!(trial.info.warnings.is_empty() && trial.info.plan.is_on("finger-contact"), "{:?}", trial.info);
        scene.effects.set(Effect::FingerContact, Setting::Off);
        let trial = grasp(&scene, None, 0);
        assert!(trial.info.warnings.iter().any(|w| w.contains("pass through")), "{:?}", trial.info.warnings);
    }

    #[test]
    fn fingers_that_meet_against_the_plan_are_mentioned() {
        // Held so far to the side that it is not in the way, though it is large enough to be.
        let mut scene = Scene::default();
        scene.object.fixed = true;
        scene.gripper.mount.offset = [0.0, 0.08, 0.0];
        let block = ObjectModel::from_primitive("block", Primitive::Sphere { radius: 0.03 }, 400.0, 0.6);
        let trial = grasp(&scene, Some(&block), 0);
        assert!(!trial.info.plan.is_on("finger-contact") && trial.info.quality.converged);
        let noted = |w: &String| w.contains("finger-contact was turned on at");
        assert_eq!(trial.info.warnings.iter().filter(|w| noted(w)).count(), 1, "{:?}", trial.info.warnings);
    }

    #[test]
    fn a_start_inside_the_object_is_mentioned() {
        let mut scene = Scene::default();
        scene.gripper.mount.offset = [0.03, 0.0, 0.0];
        let run = prepare(&scene, Some(&ball()), 0);
        assert!(run.info().warnings.iter().any(|w| w.contains("start")), "{:?}", run.info().warnings);
    }

    #[test]
    fn programmes_that_do_not_fit_are_mentioned() {
        let mut scene = Scene::default();
        scene.programme.peak_bar = 0.97;
        scene.timing.duration_s = 1.0;
        let warnings = programme_warnings(&scene);
        assert_eq!(warnings.len(), 2, "{warnings:?}");
    }
}
