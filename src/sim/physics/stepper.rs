//! From one tick to the next: one step, or as many as a tolerance takes.
//!
//! After CENIC (Kurtz and Castro 2025, arXiv 2511.08771) steps over a convex contact model are chosen by their error.
//! Every step comes with an estimate of it, which costs nothing (see [`Integrator`]); a step whose error is too large
//! is taken again, shorter. The wanted length is carried on to the next step and over ticks; no step crosses a tick
//! that is waited for, so that samples and actuation stay where they are. Fingers swing after each change of pressure
//! as they did after the last one, so the length that did then is tried first.
//!
//! The error is the largest of: joint angles and turn of the object (rad), fingertips and position of the object as
//! shares of the finger's length. Velocities and forces do not enter: at an impact they jump, and no step is short
//! enough for a jump. Energy does: a second stage that continues along the slope of the first can be thrown into the
//! skin and come out of it faster than it went in, with angles that agree. So what a step gains beyond the work done on
//! it counts as error too, as the angle by which joints as bent as these would have to be off for it. Fingers that
//! close slowly, with far less energy in their motion than in their bend, gain nothing, and nothing is computed. A step
//! that is still too wrong at the least length is taken by Euler, which damps what it cannot resolve.

use super::energy::{mechanical_energy, work_done};
use super::integrator::{Integrator, Surroundings};
use super::model::PhysicsModel;
use super::solve::Unbalanced;
use super::state::State;
use super::step::{Drive, NotFinite, StepReport};
use super::workspace::Workspace;
use crate::scene::IntegrationMethod;

/// Takes steps and counts them.
#[derive(Clone, Debug)]
pub(super) struct Stepper {
    integrator: Integrator,
    control: Option<Control>,
    pub(super) totals: Totals,
}

/// Sums over all steps so far.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Totals {
    pub(super) steps: u64,
    pub(super) rejected: u64,
    pub(super) solves: u64,
    pub(super) newton: u64,
    pub(super) newton_max: u32,
    pub(super) unconverged: u64,
    pub(super) missed: u64,
    /// Shortest step taken (s); infinite before the first.
    pub(super) shortest: Option<f64>,
    pub(super) friction_residual: f64,
    /// The worst imbalance of steps that missed the solver's tolerance, until it is read.
    pub(super) unbalanced: Option<Unbalanced>,
}

/// Chooses steps so that their error stays below a tolerance.
#[derive(Clone, Debug)]
struct Control {
    tolerance: f64,
    /// Length that the next step should have (s).
    wanted: f64,
    /// No step is longer (s).
    longest: f64,
    /// No step is made shorter because of its error (s); grows where most steps miss the tolerance.
    least: f64,
    /// The state at the beginning of the step.
    origin: State,
    /// Inputs of the last step, and the length that was accepted when they last changed (s).
    drive: Drive,
    after_change: f64,
    changed: bool,
    /// Scratch for energies, so that the forces of the last step stay intact.
    aside: Workspace,
}

/// The shortest step as a share of the longest: 1/75 s becomes 13 µs.
const LEAST_SHARE: f64 = 1.0 / 1024.0;
/// Steps that may miss the tolerance before the shortest step grows: more than in any of 144 000 grasps of presets
/// (16 059). Deep inside something no step is short enough, and the grasp would take minutes to be no better.
pub(super) const PATIENCE: u64 = 20_000;
/// From then on the shortest step doubles with so many of them.
const MISSES_PER_DOUBLING: u64 = 500;
/// The next step is planned to have this share of the tolerance's error, to the power of 1 / (p + 1).
const SAFETY: f64 = 0.9;
/// Motion with less than this share of the energy of bent joints is not guarded.
const SLOW: f64 = 0.1;
/// Energy (J) that the longest step may always gain: for rounding, where nothing is bent.
const UNFELT_GAIN: f64 = 1e-9;
/// A step becomes at most this much longer than the one before it, and at most this much shorter.
const FASTEST_GROWTH: f64 = 4.0;
const FASTEST_SHRINKING: f64 = 0.2;
/// The first step after a change of inputs is at most this much longer than after the change before.
const AFTER_CHANGE_GROWTH: f64 = 1.2;

impl Stepper {
    /// Under a tolerance no step is longer than `longest` (s), and the shortest is a share of it.
    pub(super) fn new(
        model: &PhysicsModel,
        state: &State,
        method: IntegrationMethod,
        tolerance: Option<f64>,
        longest: f64,
    ) -> Self {
        let control = tolerance.map(|tolerance| Control {
            tolerance,
            wanted: longest,
            longest,
            least: longest * LEAST_SHARE,
            origin: state.clone(),
            drive: Drive::default(),
            after_change: longest,
            changed: false,
            aside: Workspace::new(model),
        });
        Self { integrator: Integrator::new(method, state), control, totals: Totals::default() }
    }

    /// True when steps are chosen by their error.
    pub(super) fn is_controlled(&self) -> bool {
        self.control.is_some()
    }

    /// Advances the state by a span of time (s): in one step or, under a tolerance, in as few as it allows.
    pub(super) fn cover(
        &mut self,
        within: &mut Surroundings<'_>,
        state: &mut State,
        span: f64,
    ) -> Result<StepReport, NotFinite> {
        let Self { integrator, control, totals } = self;
        let Some(control) = control else {
            let report = integrator.advance(within, state, span)?.report;
            totals.add(&report, span, integrator.solves());
            return Ok(report);
        };
        control.note_drive(within.drive);
        let mut left = span;
        loop {
            let h = control.next_length(left);
            if let Some(report) = control.attempt(integrator, within, state, h, totals)? {
                left -= h;
                // The last step is the remainder, so that this becomes zero exactly.
                if left <= 0.0 {
                    return Ok(report);
                }
            }
        }
    }
}

impl Totals {
    fn add(&mut self, report: &StepReport, h: f64, solves: u64) {
        self.steps += 1;
        self.solves += solves;
        self.newton += u64::from(report.newton_iterations);
        self.newton_max = self.newton_max.max(report.newton_iterations);
        self.unconverged += u64::from(!report.converged);
        self.shortest = Some(self.shortest.map_or(h, |shortest| shortest.min(h)));
        self.friction_residual = self.friction_residual.max(report.friction_residual);
        self.unbalanced = Unbalanced::worse(self.unbalanced, report.unbalanced);
    }
}

impl Control {
    /// Step length, adjusted so that the rest `left` (s) is not cut into a long step and a tiny one.
    fn next_length(&self, left: f64) -> f64 {
        let wanted = self.wanted.min(self.longest);
        if wanted >= left {
            left
        } else if 2.0 * wanted > left {
            0.5 * left
        } else {
            wanted
        }
    }

    /// Plans a shorter step where the inputs have changed.
    fn note_drive(&mut self, drive: &Drive) {
        self.changed |= self.drive != *drive;
        if self.changed {
            self.drive = *drive;
            self.wanted = self.wanted.min(self.after_change);
        }
    }

    /// Takes a step; `None` where it must be taken again, shorter, from the state it began in.
    fn attempt(
        &mut self,
        integrator: &mut Integrator,
        within: &mut Surroundings<'_>,
        state: &mut State,
        h: f64,
        totals: &mut Totals,
    ) -> Result<Option<StepReport>, NotFinite> {
        self.origin.copy_from(state);
        let shortest = h <= self.least * (1.0 + 1e-9);
        let taken = integrator.advance(within, state, h).ok();
        totals.solves += integrator.solves();
        let error = match taken {
            Some(taken) if taken.error <= self.tolerance => taken.error.max(self.gain(within, state, h)),
            Some(taken) => taken.error,
            None => f64::INFINITY,
        };
        let ratio = error / self.tolerance;
        let planned = (h * Self::factor(ratio, integrator.order())).max(self.least);
        let report = match taken {
            Some(taken) if ratio <= 1.0 => taken.report,
            _ => {
                state.copy_from(&self.origin);
                totals.newton += taken.map_or(0, |taken| u64::from(taken.report.newton_iterations));
                if !shortest {
                    self.wanted = planned;
                    totals.rejected += 1;
                    return Ok(None);
                }
                totals.missed += 1;
                totals.solves += 1;
                if totals.missed > PATIENCE && totals.missed.is_multiple_of(MISSES_PER_DOUBLING) {
                    self.least = (2.0 * self.least).min(self.longest);
                }
                within.step(state, h)?
            }
        };
        totals.add(&report, h, 0);
        // A step cut short by a tick is no measure of the possible length.
        let cut = h < self.wanted;
        if self.changed && !cut {
            self.after_change = planned.min(h * AFTER_CHANGE_GROWTH);
        }
        self.changed = false;
        self.wanted = if cut { planned.max(self.wanted) } else { planned };
        Ok(Some(report))
    }

    /// Energy from nowhere in a step of `h` (s), as the error (rad) by which joints as bent as these would have to be
    /// off for it, or by which a free object would have to be turned. Joints may gain in a step its share of what they
    /// may in the longest, for their gains add up; the energy of a turning object swings about what its momentum
    /// allows.
    fn gain(&mut self, within: &Surroundings<'_>, state: &State, h: f64) -> f64 {
        let model = within.model;
        let share = h / self.longest;
        let bent: f64 = state.q.iter().zip(&self.origin.q).map(|(a, b)| a.abs().max(b.abs())).sum();
        let swayed =
            model.sideways.as_ref().map_or((0.0, 0.0), |sideways| sideways.strain(&self.origin.sways, &state.sways));
        let strained = (model.chain.stiffness * bent + swayed.0) * share;
        // A holds inertia and more.
        let moving: f64 = 0.5 * state.velocity.iter().zip(&within.ws.a_velocity).map(|(v, p)| v * p).sum::<f64>();
        let elastic: f64 = 0.5 * model.chain.stiffness * self.origin.q.iter().map(|q| q * q).sum::<f64>() + swayed.1;
        if moving <= SLOW * elastic {
            return 0.0;
        }
        let before = mechanical_energy(model, &self.origin, &mut self.aside);
        let work = work_done(within, &self.origin, state, &mut self.aside);
        let gain = mechanical_energy(model, state, &mut self.aside).total - before.total - work;
        (gain - UNFELT_GAIN * share).max(0.0) / (strained + before.spin).max(f64::MIN_POSITIVE)
    }

    /// Growth factor of the next step from the error over the tolerance: errors grow with h^(p + 1).
    fn factor(ratio: f64, order: i32) -> f64 {
        (SAFETY * ratio.powf(-1.0 / f64::from(order + 1))).clamp(FASTEST_SHRINKING, FASTEST_GROWTH)
    }
}
