//! The simulated gripper. Stepped without a thread it gives identical frames for identical scenes.

use super::{Event, Rig, RigError};
use crate::gripper::Phase;
use crate::objects::ObjectModel;
use crate::physics::{Placement, Refinement, Simulation};
use crate::scene::Scene;
use crate::trial::{Frame, Plan, Quality};
use glam::DVec3;

/// A simulation on its clock.
#[derive(Clone, Debug)]
pub struct SimRig {
    simulation: Simulation,
    /// The actuation tick that has been asked for, so that it is asked for once.
    asked: Option<u32>,
    phase: Phase,
    static_residual: Option<f64>,
}

impl SimRig {
    /// A scene at rest, and where everything was put.
    pub fn new(scene: &Scene, object: Option<&ObjectModel>) -> (Self, Placement) {
        Self::refined(scene, object, Refinement::NONE)
    }

    /// The same, computed more finely than the scene asks for.
    pub fn refined(scene: &Scene, object: Option<&ObjectModel>, refinement: Refinement) -> (Self, Placement) {
        let (simulation, placement) = Simulation::refined(scene, object, refinement);
        let rig = Self { simulation, asked: None, phase: Phase::Close, static_residual: None };
        (rig, placement)
    }

    /// The state before the first step, as a frame: what a picture of the start shows.
    pub fn first_look(&self) -> Frame {
        self.simulation.frame()
    }

    /// How deep the open fingers stand inside the object or its support before the first step (m).
    pub fn starting_overlap(&mut self) -> f64 {
        self.simulation.starting_overlap()
    }

    /// Which effects are simulated, and why.
    pub fn plan(&self) -> &Plan {
        self.simulation.model().plan()
    }

    /// Pulls at the object (N, world axes) from now on.
    pub fn pull_object(&mut self, force: DVec3) {
        self.simulation.pull_object(force);
    }
}

impl Rig for SimRig {
    fn name(&self) -> &'static str {
        "sim"
    }

    fn next_event(&mut self) -> Result<Event, RigError> {
        let clock = self.simulation.clock();
        loop {
            let tick = self.simulation.tick();
            if tick >= clock.total_ticks() {
                return Ok(Event::Finished);
            }
            let actuation_tick = (tick / u64::from(clock.ticks_per_actuation)) as u32;
            if tick.is_multiple_of(u64::from(clock.ticks_per_actuation)) && self.asked != Some(actuation_tick) {
                self.asked = Some(actuation_tick);
                return Ok(Event::ActuationDue { tick: actuation_tick });
            }
            // Nothing happens before the nearer of the next sample and the next change of pressure.
            let until = |period: u32| u64::from(period) - tick % u64::from(period);
            self.simulation.advance_by(until(clock.ticks_per_sample).min(until(clock.ticks_per_actuation)))?;
            if self.simulation.tick().is_multiple_of(u64::from(clock.ticks_per_sample)) {
                return Ok(Event::Sampled(self.simulation.frame()));
            }
        }
    }

    fn command(&mut self, bar: f64, phase: Phase) {
        if self.phase == Phase::Hold && phase == Phase::Release {
            self.static_residual = Some(self.simulation.quality().static_residual);
        }
        self.phase = phase;
        self.simulation.command(bar, phase);
    }

    fn quality(&self) -> Quality {
        let mut quality = self.simulation.quality();
        if let Some(at_hold) = self.static_residual {
            quality.static_residual = at_hold;
        }
        quality
    }

    fn notes(&self) -> Vec<String> {
        let turned_on = self.simulation.finger_contact_turned_on();
        let note = |t| format!("finger-contact was turned on at {t:.2} s: the fingers came near each other after all");
        turned_on.map(note).into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_and_actuation_interleave_on_the_clock() {
        let mut scene = Scene::default();
        scene.timing.duration_s = 0.4;
        let (mut rig, _) = SimRig::new(&scene, None);
        let (mut ticks, mut samples) = (Vec::new(), Vec::new());
        loop {
            match rig.next_event().expect("finite") {
                Event::ActuationDue { tick } => {
                    ticks.push(tick);
                    let (bar, phase) = scene.programme.command(tick);
                    rig.command(bar, phase);
                }
                Event::Sampled(frame) => samples.push((frame.sample, frame.t)),
                Event::Finished => break,
            }
        }
        assert_eq!(ticks, [0, 1, 2, 3]);
        assert_eq!(samples.len(), 30);
        assert_eq!(samples[0].0, 0);
        assert!((samples[0].1 - 1.0 / 75.0).abs() < 1e-15 && (samples[29].1 - 0.4).abs() < 1e-15);
    }
}
