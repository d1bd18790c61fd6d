//! From one tick to the next: one step, or as many as a tolerance takes.
//!
//! Under a tolerance every step is taken twice, whole and as two halves, after CENIC (Kurtz and Castro 2025, arXiv
//! 2511.08771): their distance, over 2^p - 1 for a method of order p, estimates the error of the halves, which are
//! kept. A step whose error is too large is taken again, shorter. The wanted length is carried on to the next step and
//! over ticks; no step crosses a tick that is waited for, so that samples and actuation stay where they are.
//!
//! The error is the largest of: joint angles and turn of the object (rad), fingertips and position of the object as
//! shares of the finger's length. Velocities and forces do not enter: at an impact they jump, and no step is short
//! enough for a jump. Energy does: a second stage that continues along the slope of the first can be thrown into the
//! skin and come out of it faster than it went in, with angles that agree. So what a step gains beyond the work done on
//! it counts as error too, as the angle by which joints as bent as these would have to be off for it.

use super::energy::{mechanical_energy, work_done};
use super::integrator::{Integrator, Surroundings};
use super::model::PhysicsModel;
use super::solve::Unbalanced;
use super::state::State;
use super::step::{NotFinite, StepReport};
use super::workspace::Workspace;
use crate::gripper::SegmentPose;
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
    /// No step is made shorter because of its error (s).
    least: f64,
    /// The step taken whole.
    whole: State,
    /// The state at its beginning.
    origin: State,
    segments: [Vec<SegmentPose>; 2],
    /// Scratch for energies, so that the forces of the last step stay intact.
    aside: Workspace,
}

/// The shortest step as a share of the longest: 1/75 s becomes 13 µs.
const LEAST_SHARE: f64 = 1.0 / 1024.0;
/// The next step is planned to have this share of the tolerance's error, to the power of 1 / (p + 1).
const SAFETY: f64 = 0.9;
/// Energy (J) that the longest step may always gain: for rounding, where nothing is bent.
const UNFELT_GAIN: f64 = 1e-9;
/// A step becomes at most this much longer than the one before it, and at most this much shorter.
const FASTEST_GROWTH: f64 = 4.0;
const FASTEST_SHRINKING: f64 = 0.2;

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
            whole: state.clone(),
            origin: state.clone(),
            segments: [(); 2].map(|()| vec![SegmentPose::default(); model.chain.joints + 1]),
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
            let report = integrator.advance(within, state, span)?;
            totals.add(&report, span, integrator.solves());
            return Ok(report);
        };
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

    /// Takes a step whole and in halves; `None` where it must be taken again, shorter, from the state it began in.
    fn attempt(
        &mut self,
        integrator: &mut Integrator,
        within: &mut Surroundings<'_>,
        state: &mut State,
        h: f64,
        totals: &mut Totals,
    ) -> Result<Option<StepReport>, NotFinite> {
        self.origin.copy_from(state);
        let stages = integrator.solves();
        let shortest = h <= self.least * (1.0 + 1e-9);
        let both = self.take_twice(integrator, within, state, h);
        let (report, error) = match both {
            Ok(taken) => taken,
            Err(cause) if shortest => return Err(cause),
            Err(_) => (StepReport::default(), f64::INFINITY),
        };
        let ratio =
            if error < self.tolerance { error.max(self.gain(within, state, h)) } else { error } / self.tolerance;
        if ratio > 1.0 && !shortest {
            state.copy_from(&self.origin);
            self.wanted = (h * Self::factor(ratio, integrator.order())).max(self.least);
            totals.rejected += 1;
            totals.solves += 3 * stages;
            totals.newton += u64::from(report.newton_iterations);
            return Ok(None);
        }
        totals.missed += u64::from(ratio > 1.0);
        totals.add(&report, h, 3 * stages);
        let planned = h * Self::factor(ratio, integrator.order());
        // A step cut short by a tick is no measure of the possible length.
        let cut = h < self.wanted;
        self.wanted = if cut { planned.max(self.wanted) } else { planned }.max(self.least);
        Ok(Some(report))
    }

    /// Leaves the halves in `state`; returns how they went, and their estimated error.
    fn take_twice(
        &mut self,
        integrator: &mut Integrator,
        within: &mut Surroundings<'_>,
        state: &mut State,
        h: f64,
    ) -> Result<(StepReport, f64), NotFinite> {
        self.whole.copy_from(state);
        let whole = integrator.advance(within, &mut self.whole, h)?;
        let first = integrator.advance(within, state, 0.5 * h)?;
        let second = integrator.advance(within, state, 0.5 * h)?;
        let [own, other] = &mut self.segments;
        let distance = state.distance(&self.whole, within.model, own, other);
        let halves = first.followed_by(&second);
        let newton_iterations = halves.newton_iterations + whole.newton_iterations;
        Ok((StepReport { newton_iterations, ..halves }, distance / (2f64.powi(integrator.order()) - 1.0)))
    }

    /// Energy from nowhere in a step of `h` (s), as the error (rad) by which joints as bent as these would have to be
    /// off for it, or by which a free object would have to be turned. Joints may gain in a step its share of what they
    /// may in the longest, for their gains add up; the energy of a turning object swings about what its momentum
    /// allows.
    fn gain(&mut self, within: &Surroundings<'_>, state: &State, h: f64) -> f64 {
        let model = within.model;
        let before = mechanical_energy(model, &self.origin, &mut self.aside);
        let work = work_done(model, within.drive, &self.origin, state, &mut self.aside);
        let gain = mechanical_energy(model, state, &mut self.aside).total - before.total - work;
        let bent: f64 = state.q.iter().zip(&self.origin.q).map(|(a, b)| a.abs().max(b.abs())).sum();
        let share = h / self.longest;
        let worth = model.chain.stiffness * bent * share + before.spin;
        (gain - UNFELT_GAIN * share).max(0.0) / worth.max(f64::MIN_POSITIVE)
    }

    /// Growth factor of the next step from the error over the tolerance: errors grow with h^(p + 1).
    fn factor(ratio: f64, order: i32) -> f64 {
        (SAFETY * ratio.powf(-1.0 / f64::from(order + 1))).clamp(FASTEST_SHRINKING, FASTEST_GROWTH)
    }
}
