//! The fitted model: signals of a finger with given parameters, simulated under the recorded line pressure.

use super::FingerFitError;
use super::least_squares::Problem;
use super::observation::{Observation, Track};
use palpate_sim::gripper::{GripperModel, Phase, TorquePoint};
use palpate_sim::run::{SimEvent, SimRun};
use palpate_sim::scene::{Accuracy, Effect, Scene, Setting, Timing};
use palpate_tactile::{Sensors, SignalDefinition, Signals};

/// Actuation rate of the fitted model (Hz). At 50 Hz, commands of a control box would be 10 ms late on average, which
/// biases lag and damping.
const COMMAND_HZ: u32 = 300;

/// Sampling rate of the fitted model (Hz). A finger swings at about 7 Hz; linear interpolation of samples at 50 Hz would
/// lose a twelfth of the amplitude, which biases stiffness.
const SAMPLE_HZ: u32 = 300;

/// Indices of the finger's parameters; those of the sensors follow.
pub(super) const STIFFNESS: usize = 0;
pub(super) const DAMPING: usize = 1;
pub(super) const LAG: usize = 2;
pub(super) const TORQUES: usize = 3;

/// Indices of the sensors' parameters after those of the finger: gain and offset of each strip, gain of each pad and its
/// load by bending, then the time shift of each observation.
pub(super) const STRIP_GAIN: usize = 0;
pub(super) const STRIP_OFFSET: usize = 2;
pub(super) const PAD_GAIN: usize = 4;
pub(super) const PAD_BENDING: usize = 6;
pub(super) const SHIFT: usize = 8;

/// Least-squares problem of the fit.
pub(super) struct FittedModel<'a> {
    observations: &'a [Observation],
    tracks: Vec<Vec<Track>>,
    /// Pressures of the torque curve's points (bar).
    knots: Vec<f64>,
    /// Finger's parameters and signals of the last simulation.
    last: Option<(Vec<f64>, Vec<Signals>)>,
}

impl<'a> FittedModel<'a> {
    pub(super) fn new(observations: &'a [Observation], knots: Vec<f64>) -> Self {
        let tracks = observations.iter().map(Observation::tracks).collect();
        Self { observations, tracks, knots, last: None }
    }

    /// Number of parameters of the finger.
    pub(super) fn of_finger(&self) -> usize {
        TORQUES + self.knots.len()
    }

    /// The gripper with these parameters: logarithms of stiffness and damping time, filling time, logarithms of torques
    /// over stiffness. Torque itself is strongly correlated with stiffness, which would take many steps.
    pub(super) fn gripper(&self, gripper: &GripperModel, x: &[f64]) -> GripperModel {
        let mut gripper = gripper.clone();
        gripper.finger.bending_stiffness = x[STIFFNESS].exp();
        gripper.finger.damping_time = x[DAMPING].exp();
        gripper.actuation.filling_time = x[LAG].max(0.0);
        let torque = |ratio: f64| (ratio + x[STIFFNESS]).exp();
        let points = self.knots.iter().zip(&x[TORQUES..]);
        let points = points.map(|(bar, ratio)| TorquePoint { bar: *bar, torque: torque(*ratio) });
        gripper.actuation.curve = std::iter::once(TorquePoint { bar: 0.0, torque: 0.0 }).chain(points).collect();
        gripper
    }

    fn simulate(&mut self, finger: &[f64]) -> Result<(), FingerFitError> {
        if self.last.as_ref().is_none_or(|(own, _)| own.as_slice() != finger) {
            let shown = |seen: &Observation| shown(seen, self.gripper(&seen.scene.gripper, finger));
            let signals: Result<Vec<Signals>, FingerFitError> = self.observations.iter().map(shown).collect();
            self.last = Some((finger.to_vec(), signals?));
        }
        Ok(())
    }

    /// Place of each residual: observation, track and sample, in the order of [`Problem::residuals`].
    pub(super) fn places(&self) -> impl Iterator<Item = (usize, &Track, usize)> + '_ {
        self.tracks.iter().enumerate().flat_map(move |(number, tracks)| {
            let seen = &self.observations[number].signals;
            tracks.iter().flat_map(move |track| {
                let used = move |k: &usize| track.deviation(f64::from(seen.row(*k)[track.column])).is_some();
                (0..seen.len()).filter(used).map(move |k| (number, track, k))
            })
        })
    }
}

impl Problem for FittedModel<'_> {
    fn residuals(&mut self, x: &[f64]) -> Result<Vec<f64>, FingerFitError> {
        let of_finger = self.of_finger();
        self.simulate(&x[..of_finger])?;
        let sensors = &x[of_finger..];
        let Some((_, simulated)) = &self.last else { return Ok(Vec::new()) };
        let mut residuals = Vec::new();
        for (number, track, k) in self.places() {
            let seen = &self.observations[number].signals;
            let value = f64::from(seen.row(k)[track.column]);
            let column = 4 * usize::from(track.is_force) + track.side.index();
            let t = seen.t_s[k] - sensors[SHIFT + number];
            let shown = at(&simulated[number], column, t);
            let side = track.side.index();
            let read = match track.is_force {
                true => {
                    let curvature = at(&simulated[number], side, t);
                    shown * sensors[PAD_GAIN + side].exp() + sensors[PAD_BENDING + side] * curvature
                }
                false => shown * sensors[STRIP_GAIN + side].exp() + sensors[STRIP_OFFSET + side],
            };
            // Samples without a deviation are not among the places.
            residuals.push((read - value) / track.deviation(value).unwrap_or(f64::INFINITY));
        }
        Ok(residuals)
    }

    fn step(&self, parameter: usize) -> f64 {
        match parameter {
            LAG => 1e-3,
            _ if parameter >= self.of_finger() + SHIFT => 1e-3,
            _ => 2e-3,
        }
    }

    fn least(&self, parameter: usize) -> f64 {
        if parameter == LAG { 0.0 } else { f64::NEG_INFINITY }
    }
}

/// Value of a channel between the samples of a simulation (s); the finger hangs at rest before the first.
fn at(signals: &Signals, column: usize, t: f64) -> f64 {
    let after = signals.t_s.partition_point(|own| *own <= t);
    let value = |k: usize| f64::from(signals.row(k)[column]);
    match (after.checked_sub(1), after < signals.len()) {
        (Some(before), true) => {
            let share = (t - signals.t_s[before]) / (signals.t_s[after] - signals.t_s[before]);
            value(before) + (value(after) - value(before)) * share
        }
        (Some(last), false) => value(last),
        (None, true) => value(0),
        (None, false) => 0.0,
    }
}

/// Signals of the fitted model for an observation: curvature, pressure and force, left and right.
fn shown(seen: &Observation, gripper: GripperModel) -> Result<Signals, FingerFitError> {
    let lag = gripper.actuation.filling_time > 0.0;
    let mut scene = Scene { gripper, ..seen.scene.clone() };
    scene.timing = Timing { sample_hz: SAMPLE_HZ, actuation_hz: COMMAND_HZ, duration_s: seen.duration() + 0.1 };
    // Errors of steps would be taken for the finger's, and differences between two fingers would jump with their number.
    scene.solver.accuracy = Accuracy::Reference;
    // A small lag stays in: `auto` would switch it off and make the residuals jump.
    scene.effects.set(Effect::PneumaticLag, if lag { Setting::On } else { Setting::Off });
    let sensors = Sensors::whole_fingers(&scene.gripper, SignalDefinition::Parts);
    let (mut rig, _) = SimRun::new(&scene, seen.object.as_ref());
    let channels = sensors.channels().iter().map(palpate_tactile::Channel::name).collect();
    let mut signals = Signals { channels, ..Signals::default() };
    let mut bar = 0.0;
    loop {
        match rig.next_event().map_err(|cause| FingerFitError::Simulation { name: seen.name.clone(), cause })? {
            SimEvent::ActuationDue { tick } => {
                // Tolerance for times computed as tick over rate.
                let now = f64::from(tick) / f64::from(COMMAND_HZ) + 1e-6;
                let before = bar;
                bar = seen.line.iter().rev().find(|(t, _)| *t <= now).map_or(0.0, |(_, bar)| *bar);
                rig.command(bar, if bar < before { Phase::Release } else { Phase::Close });
            }
            SimEvent::Sampled(frame) => {
                let row: Vec<f32> = sensors.read(&frame).into_iter().map(|v| v.unwrap_or_default() as f32).collect();
                signals.push(frame.t, &row);
            }
            SimEvent::Finished => return Ok(signals),
        }
    }
}
