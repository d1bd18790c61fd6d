//! Scores of a recogniser, their confidence intervals, and tests for differences between recognisers.
//!
//! - [`Confusion`] counts decisions: accuracy, precision, recall, F1.
//! - [`Forecasts`] scores probabilities: calibration error, log-likelihood, top-k accuracy.
//! - [`Bootstrap`] puts an [`Interval`] around any of these, or around the difference of two models on the same trials.
//! - [`McNemar`] and [`holm`] test differences: on one test set, and many at a time.
//!
//! Objects and decisions are class numbers from zero, trials are indices of the slices passed in. Nothing here panics or
//! returns NaN: undefined numbers are `None`.

mod bootstrap;
mod calibration;
mod confusion;
mod difference;
mod interval;

pub use bootstrap::{Bootstrap, draws_sessions};
pub use calibration::{CALIBRATION_BINS, Confident, Forecasts, PROBABILITY_FLOOR, ReliabilityPoint};
pub use confusion::{ClassScores, Confusion, Scores};
pub use difference::{McNemar, holm};
pub use interval::{Interval, LEVEL, largest_share};
