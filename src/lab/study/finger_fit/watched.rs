//! Progress and cancellation of a fit.

use super::least_squares::Problem;
use std::sync::atomic::{AtomicBool, Ordering};

/// Observer of a fit.
pub struct FitWatch<'a> {
    /// Hears how many steps of [`super::MOST_STEPS`] at most are done, and parts of one; few fits need them all.
    pub progress: &'a dyn Fn(f64),
    /// Set from outside to end the work.
    pub stop: &'a AtomicBool,
}

impl FitWatch<'_> {
    /// True once the work is to end.
    pub(super) fn is_over(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// A problem whose looks at residuals are counted.
pub(super) struct Watched<'a, P> {
    problem: &'a mut P,
    watch: &'a FitWatch<'a>,
    looks: u32,
}

impl<'a, P: Problem> Watched<'a, P> {
    pub(super) fn new(problem: &'a mut P, watch: &'a FitWatch<'a>) -> Self {
        Self { problem, watch, looks: 0 }
    }
}

impl<P: Problem> Problem for Watched<'_, P> {
    fn residuals(&mut self, x: &[f64]) -> Result<Vec<f64>, String> {
        if self.watch.is_over() {
            return Err("it was stopped".to_owned());
        }
        let residuals = self.problem.residuals(x);
        self.looks += 1;
        // A step evaluates the residuals at its end and along each parameter; so does the preparation of the first one.
        let in_steps = f64::from(self.looks) / (x.len() + 1) as f64 - 1.0;
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
