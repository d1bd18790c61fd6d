//! A simulation on its clock: actuation ticks and samples in order. Identical scenes give identical frames.

use crate::frame::{Frame, GraspFailure, Plan, Quality};
use crate::gripper::{Phase, Programme, Side};
use crate::objects::ObjectModel;
#[cfg(feature = "rapier")]
use crate::physics::RapierSimulation;
use crate::physics::{Engine, Placement, Refinement, Simulation, SimulationError};
use crate::scene::{Effect, EngineKind, Scene};
use glam::DVec3;

/// The next event of a simulation.
#[derive(Clone, Debug, PartialEq)]
pub enum SimEvent {
    /// Actuation tick `tick` begins: the line pressure for it is due.
    ActuationDue {
        /// Number of the tick, from 0.
        tick: u32,
    },
    /// A sample.
    Sampled(Frame),
    /// The end of the trial.
    Finished,
}

/// A simulation on its clock.
#[derive(Clone, Debug)]
pub struct SimRun {
    engine: EngineRun,
    /// The last actuation tick reported, so that each is reported once.
    reported: Option<u32>,
    phase: Phase,
    static_residual: Option<f64>,
    hold: HoldWatch,
    /// The frame before the first step, and how deep the open fingers stand inside something there (m).
    start: Frame,
    overlap: f64,
}

/// A start this deep inside something is wrong (m).
const DEEPEST_START: f64 = 5e-4;

/// Counts changes of force while nothing is commanded.
#[derive(Clone, Debug)]
struct HoldWatch {
    /// Taxels of a finger.
    taxels: usize,
    /// Time at which the hand starts to move (s).
    still_until: f64,
    /// Time of the first sample of the hold (s).
    since: Option<f64>,
    /// Normal force on each finger in the last sample (N).
    force: [f64; 2],
    /// Changes in the whole hold, and those once it has settled.
    all: [u32; 2],
    settled: [u32; 2],
    /// Sum over the samples of the settled hold of the force on the object (N), their number, and whether pads touched
    /// anything else in any of them.
    on_object: ([f64; 2], u32, bool),
    /// The object is touched, or has left the hand, before the release.
    touched: bool,
    lost: bool,
}

/// After this much of the hold (s) what was pushed has settled.
const SETTLED_AFTER: f64 = 0.5;
/// Change of a finger's force (N) from one sample to the next that counts.
const CHANGE: f64 = 0.05;

impl HoldWatch {
    fn new(taxels: usize, still_until: f64) -> Self {
        let (force, all, settled) = ([0.0; 2], [0; 2], [0; 2]);
        let on_object = ([0.0; 2], 0, false);
        Self { taxels, still_until, since: None, force, all, settled, on_object, touched: false, lost: false }
    }

    /// Notes a sample, given the frame before the first step and the force on the object where pads touch more.
    fn note(&mut self, frame: &Frame, start: &Frame, on_object: Option<[f64; 2]>) {
        let force = Side::BOTH.map(|side| frame.normal_force(side, self.taxels));
        let into_hold = match frame.phase {
            Phase::Hold if frame.t <= self.still_until => frame.t - *self.since.get_or_insert(frame.t),
            Phase::Close | Phase::Hold | Phase::Release => {
                self.since = None;
                0.0
            }
        };
        for side in Side::BOTH.map(Side::index) {
            let changed = (force[side] - self.force[side]).abs() > CHANGE;
            self.all[side] += u32::from(changed && into_hold > 0.0);
            self.settled[side] += u32::from(changed && into_hold > SETTLED_AFTER);
        }
        self.force = force;
        let held = on_object.unwrap_or(force);
        if into_hold > SETTLED_AFTER {
            let (sum, count, met) = &mut self.on_object;
            (0..2).for_each(|side| sum[side] += held[side]);
            (*count, *met) = (*count + 1, *met || on_object.is_some());
        }
        if frame.phase != Phase::Release && frame.t <= self.still_until {
            self.touched |= held != [0.0; 2];
            self.lost |= frame.has_lost_object(start);
        }
    }

    /// Mean force on the object in the settled hold (N), where pads touched anything else.
    fn hold_force(&self) -> Option<[f64; 2]> {
        let (sum, count, met) = self.on_object;
        met.then(|| sum.map(|sum| sum / f64::from(count)))
    }
}

/// The engine of the scene.
#[derive(Clone, Debug)]
enum EngineRun {
    Palpate(Box<Simulation>),
    #[cfg(feature = "rapier")]
    Rapier(Box<RapierSimulation>),
}

impl EngineRun {
    fn new(scene: &Scene, object: Option<&ObjectModel>, refinement: Refinement) -> (Self, Placement) {
        match scene.solver.engine {
            EngineKind::Palpate => {
                let (simulation, placement) = Simulation::refined(scene, object, refinement);
                (Self::Palpate(Box::new(simulation)), placement)
            }
            #[cfg(feature = "rapier")]
            EngineKind::Rapier => {
                let (simulation, placement) = RapierSimulation::refined(scene, object, refinement);
                (Self::Rapier(Box::new(simulation)), placement)
            }
            #[cfg(not(feature = "rapier"))]
            EngineKind::Rapier => panic!("Scene::check refuses the engine rapier in a build without it"),
        }
    }

    fn get(&self) -> &dyn Engine {
        match self {
            Self::Palpate(simulation) => simulation.as_ref(),
            #[cfg(feature = "rapier")]
            Self::Rapier(simulation) => simulation.as_ref(),
        }
    }

    fn get_mut(&mut self) -> &mut dyn Engine {
        match self {
            Self::Palpate(simulation) => simulation.as_mut(),
            #[cfg(feature = "rapier")]
            Self::Rapier(simulation) => simulation.as_mut(),
        }
    }
}

impl SimRun {
    /// A scene at rest, and where everything was put.
    pub fn new(scene: &Scene, object: Option<&ObjectModel>) -> (Self, Placement) {
        Self::refined(scene, object, Refinement::None)
    }

    /// Sets up a scene with a refinement.
    pub fn refined(scene: &Scene, object: Option<&ObjectModel>, refinement: Refinement) -> (Self, Placement) {
        let (mut engine, placement) = EngineRun::new(scene, object, refinement);
        let taxels = scene.gripper.taxels().count();
        let shaken = scene.hand_motion().filter(|_| engine.get().plan().is_on(Effect::Shaking.name()));
        let still_until = shaken.map_or(f64::INFINITY, |motion| motion.begins_s());
        let hold = HoldWatch::new(taxels, still_until);
        let start = engine.get().frame();
        let overlap = engine.get_mut().starting_overlap();
        let run = Self { engine, reported: None, phase: Phase::Close, static_residual: None, hold, start, overlap };
        (run, placement)
    }

    /// Runs a programme from here to the end of the trial and returns the samples.
    pub fn run_programme(&mut self, programme: &Programme) -> Result<Vec<Frame>, SimulationError> {
        let mut frames = Vec::new();
        loop {
            match self.next_event()? {
                SimEvent::ActuationDue { tick } => {
                    let (bar, phase) = programme.command(tick);
                    self.command(bar, phase);
                }
                SimEvent::Sampled(frame) => frames.push(frame),
                SimEvent::Finished => return Ok(frames),
            }
        }
    }

    /// The state before the first step, as a frame.
    pub fn first_look(&self) -> Frame {
        self.engine.get().frame()
    }

    /// Overlap of the open fingers with the object or its support before the first step (m).
    pub fn starting_overlap(&self) -> f64 {
        self.overlap
    }

    /// Effects simulated, with the reason for each.
    pub fn plan(&self) -> &Plan {
        self.engine.get().plan()
    }

    /// Pulls at the object (N, world axes) from now on.
    pub fn pull_object(&mut self, force: DVec3) {
        self.engine.get_mut().pull_object(force);
    }

    /// Moves the object, as if it had been put down elsewhere: a shift (m) and a turn about its centre of mass (axis times
    /// angle, rad), world axes.
    pub fn move_object(&mut self, shift: DVec3, turn: DVec3) {
        self.engine.get_mut().move_object(shift, turn);
        self.start.world_from_object = self.engine.get().frame().world_from_object;
    }

    /// Simulates up to the next event.
    pub fn next_event(&mut self) -> Result<SimEvent, SimulationError> {
        let clock = self.engine.get().clock();
        loop {
            let tick = self.engine.get().tick();
            if tick >= clock.total_ticks() {
                return Ok(SimEvent::Finished);
            }
            let actuation_tick = (tick / u64::from(clock.ticks_per_actuation)) as u32;
            if tick.is_multiple_of(u64::from(clock.ticks_per_actuation)) && self.reported != Some(actuation_tick) {
                self.reported = Some(actuation_tick);
                return Ok(SimEvent::ActuationDue { tick: actuation_tick });
            }
            // Nothing happens before the nearer of the next sample and the next change of pressure.
            let until = |period: u32| u64::from(period) - tick % u64::from(period);
            let ticks = until(clock.ticks_per_sample).min(until(clock.ticks_per_actuation));
            self.engine.get_mut().advance_by(ticks)?;
            if self.engine.get().tick().is_multiple_of(u64::from(clock.ticks_per_sample)) {
                let frame = self.engine.get().frame();
                self.hold.note(&frame, &self.start, self.engine.get().force_on_object());
                // A hand that moves leaves nothing at rest: the last sample before counts.
                if self.phase == Phase::Hold && self.hold.still_until.is_finite() && frame.t <= self.hold.still_until {
                    self.static_residual = Some(self.engine.get().quality().static_residual);
                }
                return Ok(SimEvent::Sampled(frame));
            }
        }
    }

    /// Sets the line pressure (bar) from now on.
    pub fn command(&mut self, bar: f64, phase: Phase) {
        if self.phase == Phase::Hold && phase == Phase::Release && self.hold.still_until.is_infinite() {
            self.static_residual = Some(self.engine.get().quality().static_residual);
        }
        self.phase = phase;
        self.engine.get_mut().command(bar, phase);
    }

    /// Convex minimisations so far.
    pub fn solves(&self) -> u64 {
        self.engine.get().solves()
    }

    /// Numerical quality of the frames so far.
    pub fn quality(&self) -> Quality {
        let mut quality = self.engine.get().quality();
        // A hand that moves before the hold leaves none to be judged.
        let unjudged = self.hold.still_until.is_finite().then_some(0.0);
        if let Some(at_hold) = self.static_residual.or(unjudged) {
            quality.static_residual = at_hold;
        }
        quality.hold_changes = self.hold.settled[0].max(self.hold.settled[1]);
        quality.all_hold_changes = self.hold.all[0].max(self.hold.all[1]);
        quality.failure = self.failure();
        quality.hold_force = self.hold.hold_force();
        quality
    }

    /// Failure of the grasp: of its start at once, of the hold once there is one.
    fn failure(&self) -> Option<GraspFailure> {
        if self.overlap > DEEPEST_START {
            return Some(GraspFailure::StartedInside(self.overlap));
        }
        let missed = self.phase != Phase::Close && !self.hold.touched;
        match self.start.world_from_object {
            Some(_) if self.hold.lost => Some(GraspFailure::LostObject),
            Some(_) if missed => Some(GraspFailure::NeverTouched),
            _ => None,
        }
    }

    /// Remarks on the frames so far.
    pub fn notes(&self) -> Vec<String> {
        let turned_on = self.engine.get().finger_contact_turned_on();
        let note = |t| format!("finger contact switched on at {t:.2} s (fingers about to touch)");
        turned_on.map(note).into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::TaxelLoad;
    use glam::DQuat;
    use palpate_geometry::Primitive;

    #[test]
    fn samples_and_actuation_interleave_on_the_clock() {
        let mut scene = Scene::default();
        scene.timing.duration_s = 0.4;
        let (mut rig, _) = SimRun::new(&scene, None);
        let (mut ticks, mut samples) = (Vec::new(), Vec::new());
        loop {
            match rig.next_event().expect("finite") {
                SimEvent::ActuationDue { tick } => {
                    ticks.push(tick);
                    let (bar, phase) = scene.programme.command(tick);
                    rig.command(bar, phase);
                }
                SimEvent::Sampled(frame) => samples.push((frame.sample, frame.t)),
                SimEvent::Finished => break,
            }
        }
        assert_eq!(ticks, [0, 1, 2, 3]);
        assert_eq!(samples.len(), 30);
        assert_eq!(samples[0].0, 0);
        assert!((samples[0].1 - 1.0 / 75.0).abs() < 1e-15 && (samples[29].1 - 0.4).abs() < 1e-15);
    }

    #[test]
    fn objects_are_moved_in_world_axes_by_both_engines() {
        let ball = ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.02 }, 400.0, 0.6);
        for engine in EngineKind::ALL {
            let mut scene = Scene::default();
            scene.solver.engine = engine;
            scene.gripper.mount.yaw_deg = 90.0;
            let (mut run, _) = SimRun::new(&scene, Some(&ball));
            let place = |run: &SimRun| run.first_look().world_from_object.expect("a ball");
            let before = place(&run);
            run.move_object(DVec3::new(0.003, 0.0, 0.001), DVec3::new(0.0, 0.2, 0.0));
            let after = place(&run);
            let moved = after.position - before.position;
            assert!((moved - DVec3::new(0.003, 0.0, 0.001)).length() < 1e-6, "{engine:?}: {moved}");
            let turned = after.rotation * before.rotation.inverse();
            assert!(turned.abs_diff_eq(DQuat::from_rotation_y(0.2), 1e-5), "{engine:?}: {turned}");
        }
    }

    #[test]
    fn changes_of_force_count_once_the_hold_has_settled() {
        let mut watch = HoldWatch::new(10, f64::INFINITY);
        let mut push = |phase, k: u32, left: f32| {
            let taxels = vec![TaxelLoad { taxel: 3, normal: left, along: 0.0, across: 0.0 }];
            let t = f64::from(k) / 75.0;
            let frame = Frame {
                sample: k,
                t,
                line_bar: 1.0,
                phase,
                q: vec![],
                sways: [crate::gripper::Sway::NONE; 2],
                hand: DVec3::ZERO,
                world_from_object: None,
                taxels,
            };
            watch.note(&frame, &frame, None);
            (watch.settled, watch.all[0])
        };
        // 0.8 N on and off, in every phase.
        let force = |k: u32| if k.is_multiple_of(2) { 0.8 } else { 0.0 };
        assert_eq!((0..30).map(|k| push(Phase::Close, k, force(k))).last(), Some(([0, 0], 0)));
        assert_eq!((30..68).map(|k| push(Phase::Hold, k, force(k))).last(), Some(([0, 0], 37)), "within half a second");
        assert_eq!((68..78).map(|k| push(Phase::Hold, k, force(k))).last(), Some(([10, 0], 47)));
        let drifting = (78..98).map(|k| push(Phase::Hold, k, 0.8 + 0.002 * (k as f32))).last();
        assert!(drifting.is_some_and(|(settled, all)| settled[0] <= 11 && all <= 48), "{drifting:?}");
        let released = (98..130).map(|k| push(Phase::Release, k, force(k))).last();
        assert_eq!(released, drifting);
    }
}
