//! Progress and cancellation of a fit.

use super::FingerFitError;
use super::least_squares::Problem;
use std::sync::atomic::{AtomicBool, Ordering};

/// Observer of a fit.
pub struct FitWatch<'a> {
    /// Receives the number of steps done, with fractions, of [`super::MOST_STEPS`] at most.
    pub progress: &'a dyn Fn(f64),
    /// Flag that cancels the fit.
    pub stop: &'a AtomicBool,
}

impl FitWatch<'_> {
    /// True once cancelled.
    pub(super) fn is_over(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// Problem that counts evaluations of its residuals.
pub(super) struct Watched<'a, P> {
    problem: &'a mut P,
    watch: &'a FitWatch<'a>,
    evaluations: u32,
}

impl<'a, P: Problem> Watched<'a, P> {
    pub(super) fn new(problem: &'a mut P, watch: &'a FitWatch<'a>) -> Self {
        Self { problem, watch, evaluations: 0 }
    }
}

impl<P: Problem> Problem for Watched<'_, P> {
    fn residuals(&mut self, x: &[f64]) -> Result<Vec<f64>, FingerFitError> {
        if self.watch.is_over() {
            return Err(FingerFitError::Stopped);
        }
        let residuals = self.problem.residuals(x);
        self.evaluations += 1;
        // Each step evaluates the residuals at its end and once per parameter, and so does the start.
        let in_steps = f64::from(self.evaluations) / (x.len() + 1) as f64 - 1.0;
        (self.watch.progress)(in_steps.max(0.0));
        residuals
    }

    fn step(&self, parameter: usize) -> f64 {
        self.problem.step(parameter)
    }

    fn least(&self, parameter: usize) -> f64 {
        self.problem.least(parameter)
    }
}
