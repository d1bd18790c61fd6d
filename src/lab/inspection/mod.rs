//! Inspection: a stored trial of any source, opened for looking at: its channels over time, the fingers at each sample, the
//! phases of the grasp, and what the recogniser answered.

mod comparison;
mod figures;
mod open_trial;
mod phases;
mod replayed;
#[cfg(test)]
pub(crate) mod test_trials;

pub use crate::recording::OpenTrialError;
pub use comparison::{Alignment, MeanColumn, MeanTrial};
pub use figures::{FigureDataError, FigureOptions, HeatKind, caption, comparison_figure, trial_numbers};
pub use open_trial::{Column, Instant, Keep, OpenOptions, OpenTrial, SimulatedFacts};
pub(crate) use phases::onset;
pub use phases::{PhaseSpan, TouchPhase, phases_of_frames};
