//! Grasps sample by sample, so that a window can show them as they happen and a command can run them through.

use super::controller::{GraspController, GraspPlan, PressureCommand};
use crate::gripper::{Gripper, GripperError, GripperEvent, SimulatedGripper};
use glam::DVec3;
use palpate_sim::frame::Frame;
use palpate_sim::gripper::{BentFinger, Side};
use palpate_sim::objects::ObjectModel;
use palpate_sim::physics::Refinement;
use palpate_sim::run::SimRun;
use palpate_sim::scene::{Effect, Scene, Setting};
use palpate_sim::{PHYSICS_VERSION, fingerprint};
use palpate_tactile::trial::{GraspOrigin, SimulatedData, SimulatedTrial, Trial, TrialHeader};
use std::time::Duration;

/// A simulated grasp in progress, sample by sample.
#[derive(Clone, Debug)]
pub struct GraspRun {
    gripper: SimulatedGripper,
    controller: GraspController,
    header: TrialHeader,
    frames: Vec<Frame>,
    finished: bool,
    /// The gripper has failed.
    failed: bool,
}

/// Sets up a simulated grasp. `seed` is recorded; it does not change the scene.
pub fn prepare(scene: &Scene, object: Option<&ObjectModel>, seed: u64) -> GraspRun {
    prepare_with(scene, object, seed, Refinement::None)
}

/// Sets up the same grasp computed more finely, sampled at the same times: the error of the other is estimated from it.
pub fn prepare_refined(scene: &Scene, object: Option<&ObjectModel>, seed: u64) -> GraspRun {
    prepare_with(scene, object, seed, Refinement::Refined)
}

fn prepare_with(scene: &Scene, object: Option<&ObjectModel>, seed: u64, refinement: Refinement) -> GraspRun {
    let (simulation, placement) = SimRun::refined(scene, object, refinement);
    let mut warnings = object.map(|o| o.warnings.clone()).unwrap_or_default();
    warnings.extend(placement.warnings);
    warnings.extend(programme_warnings(scene));
    warnings.extend(simulation.quality().failure.map(|failure| failure.to_string()));
    let origin = GraspOrigin {
        physics: PHYSICS_VERSION,
        object: object.map_or(0, |object| object.content),
        ..GraspOrigin::default()
    };
    let header = TrialHeader {
        seed,
        warnings,
        origin: Some(origin),
        ..TrialHeader::new(object.map_or("empty", |o| &o.name), scene.clone())
    };
    let actuation_hz = f64::from(scene.timing.actuation_hz);
    let gripper = SimulatedGripper::new(simulation, placement.world_from_gripper, actuation_hz);
    let controller = GraspController::new(GraspPlan::simulated(scene), gripper.now_s());
    GraspRun { gripper, controller, header, frames: Vec::new(), finished: false, failed: false }
}

/// Sets up and runs a simulated grasp to its end.
pub fn grasp(scene: &Scene, object: Option<&ObjectModel>, seed: u64) -> SimulatedTrial {
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

impl GraspRun {
    /// Header of the trial so far.
    pub fn header(&self) -> &TrialHeader {
        &self.header
    }

    /// The simulation.
    pub fn simulation_mut(&mut self) -> &mut SimRun {
        &mut self.gripper.run
    }

    /// Records that the object has stayed as the grasp of this identity released it.
    pub fn set_after(&mut self, identity: Option<String>) {
        if let Some(origin) = &mut self.header.origin {
            origin.after = identity;
        }
    }

    /// Adds a warning to the trial.
    pub fn warn(&mut self, text: String) {
        self.header.warnings.push(text);
    }

    /// Pulls at the object (N, world axes) from now on. The grasp is then another than the scene alone gives.
    pub fn pull_object(&mut self, force: DVec3) {
        if let Some(origin) = &mut self.header.origin {
            let samples = self.frames.len() as f64;
            let numbers = [samples, force.x, force.y, force.z].map(f64::to_le_bytes);
            let before = origin.pulls.to_le_bytes();
            origin.pulls =
                fingerprint(std::iter::once(before.as_slice()).chain(numbers.iter().map(<[u8; 8]>::as_slice)));
        }
        self.gripper.run.pull_object(force);
    }

    /// Samples so far.
    pub fn frames(&self) -> &[Frame] {
        &self.frames
    }

    /// Convex minimisations so far.
    pub fn solves(&self) -> u64 {
        self.gripper.run.solves()
    }

    /// Runs to the next sample; `None` at the end. A gripper that fails ends the trial with a warning; earlier samples
    /// are kept.
    pub fn next_frame(&mut self) -> Option<&Frame> {
        while !self.finished {
            match self.advance() {
                Ok(Some(frame)) => {
                    self.frames.push(frame);
                    return self.frames.last();
                }
                Ok(None) => {}
                Err(error) => {
                    self.header.warnings.push(error.to_string());
                    (self.finished, self.failed) = (true, true);
                }
            }
        }
        None
    }

    fn advance(&mut self) -> Result<Option<Frame>, GripperError> {
        match self.gripper.next_event(Duration::ZERO)? {
            GripperEvent::Tick => {
                if let Some(PressureCommand { bar, phase, .. }) = self.controller.command(self.gripper.now_s()) {
                    self.gripper.set_pressure(bar, phase)?;
                }
            }
            GripperEvent::Sampled(frame) => return Ok(Some(frame)),
            GripperEvent::Board(_) | GripperEvent::Signals { .. } => {}
            GripperEvent::Finished => self.finished = true,
        }
        Ok(None)
    }

    /// Runs to the end; `None` if it was cancelled.
    pub(crate) fn run_to_end(mut self, scene: &Scene, cancelled: &dyn Fn() -> bool) -> Option<SimulatedTrial> {
        while self.next_frame().is_some() {
            if cancelled() {
                return None;
            }
        }
        Some(self.finish(scene))
    }

    /// The trial so far, without its samples.
    pub fn begun(&self) -> SimulatedTrial {
        let simulation = &self.gripper.run;
        let data = SimulatedData {
            world_from_gripper: self.gripper.world_from_gripper,
            plan: simulation.plan().clone(),
            quality: simulation.quality(),
            frames: Vec::new(),
        };
        Trial { header: self.header.clone(), data }
    }

    /// The trial, with its quality and warnings. The samples leave the run.
    pub fn finish(&mut self, scene: &Scene) -> SimulatedTrial {
        let Trial { mut header, mut data } = self.begun();
        let warnings = &mut header.warnings;
        data.quality.finite &= !self.failed;
        let misses = data.quality.misses().filter(|cause| !warnings.contains(cause));
        warnings.extend(misses);
        if data.quality.missed_steps > 0 {
            let (missed, steps, least) =
                (data.quality.missed_steps, data.quality.steps, data.quality.least_step_s * 1e6);
            let tolerance = scene.solver.accuracy;
            warnings.push(format!(
                "{missed} of {steps} steps missed the accuracy {tolerance}, though steps became as short as {least:.1} µs: try \
                 a larger tolerance"
            ));
        }
        warnings.extend(self.gripper.run.notes());
        data.frames = std::mem::take(&mut self.frames);
        let passable = scene.effects.get(Effect::FingerContact) == Setting::Off;
        if let Some(t) = fingers_cross(scene, &data.frames).filter(|_| passable) {
            warnings.push(format!("the fingers pass through each other from {t:.2} s: effects.finger-contact is off"));
        }
        Trial { header, data }
    }
}

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
    use palpate_sim::frame::{GraspFailure, Quality, TrustLevel};

    fn ball() -> ObjectModel {
        ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.02 }, 400.0, 0.6)
    }

    #[test]
    fn a_grasp_of_a_ball_is_sound() {
        let trial = grasp(&Scene::default(), Some(&ball()), 0);
        assert_eq!(trial.frames().len(), 300);
        assert!(trial.header.warnings.is_empty(), "{:?}", trial.header.warnings);
        let Quality { finite, converged, steps, static_residual, .. } = trial.data.quality;
        assert!(finite && converged && (320..600).contains(&steps), "{steps} steps");
        assert!(static_residual < 1e-3, "{static_residual}");
    }

    #[test]
    fn an_empty_hand_closes_on_itself_unless_it_is_told_not_to() {
        let mut scene = Scene::default();
        let trial = grasp(&scene, None, 0);
        assert_eq!(trial.header.object, "empty");
        assert!(trial.header.warnings.is_empty() && trial.data.plan.is_on("finger-contact"), "{:?}", trial.header);
        scene.effects.set(Effect::FingerContact, Setting::Off);
        let trial = grasp(&scene, None, 0);
        assert!(trial.header.warnings.iter().any(|w| w.contains("pass through")), "{:?}", trial.header.warnings);
    }

    #[test]
    fn fingers_that_meet_against_the_plan_are_mentioned() {
        // Held so far to the side that it is not in the way, though it is large enough to be.
        let mut scene = Scene::default();
        scene.object.fixed = true;
        scene.gripper.mount.offset = [0.0, 0.08, 0.0];
        let block = ObjectModel::from_primitive("block", Primitive::Sphere { radius: 0.03 }, 400.0, 0.6);
        let trial = grasp(&scene, Some(&block), 0);
        assert!(!trial.data.plan.is_on("finger-contact") && trial.data.quality.converged);
        let noted = |w: &String| w.contains("switched on at");
        assert_eq!(trial.header.warnings.iter().filter(|w| noted(w)).count(), 1, "{:?}", trial.header.warnings);
    }

    #[test]
    fn a_start_inside_the_object_is_mentioned() {
        let mut scene = Scene::default();
        scene.gripper.mount.offset = [0.03, 0.0, 0.0];
        let run = prepare(&scene, Some(&ball()), 0);
        assert!(run.header().warnings.iter().any(|w| w.contains("start")), "{:?}", run.header().warnings);
        let trial = grasp(&scene, Some(&ball()), 0);
        assert!(matches!(trial.data.quality.failure, Some(GraspFailure::StartedInside(depth)) if depth > 1e-3));
        assert_eq!(trial.header.warnings.iter().filter(|w| w.contains("start")).count(), 1);
    }

    #[test]
    fn a_grasp_that_holds_nothing_is_red_with_its_reason() {
        let end = |scene: &Scene, pull: f64| {
            let mut run = prepare(scene, Some(&ball()), 0);
            run.pull_object(DVec3::X * pull);
            while run.next_frame().is_some() {}
            let quality = run.finish(scene).data.quality;
            (quality.failure, quality.is_sound(), quality.trust().0)
        };
        let held = end(&Scene::default(), 0.0);
        assert_eq!(held, (None, true, TrustLevel::Amber));
        let mut aside = Scene::default();
        aside.gripper.mount.offset = [0.0, 0.08, 0.0];
        assert_eq!(end(&aside, 0.0), (Some(GraspFailure::NeverTouched), true, TrustLevel::Red));
        // Pulled off its pedestal, far beyond the fingers.
        aside.gripper.mount.offset = [0.0, 0.0, 0.0];
        let (failure, sound, light) = end(&aside, 20.0);
        assert_eq!((failure, sound, light), (Some(GraspFailure::LostObject), true, TrustLevel::Red));
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
