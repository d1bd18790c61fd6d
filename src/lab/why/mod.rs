//! Why a model gave its answer: what its likeliest classes feel like, which channels and phases spoke for the answer, and
//! which stored trials are most like the grasp.
//!
//! | file | holds |
//! |---|---|
//! | `bands` | mean and spread of the two likeliest classes, for plots |
//! | `phases` | phases of a grasp, from what the model reads |
//! | `occlusion` | evidence of each channel and phase, and of each grasp |
//! | `nearest` | the stored trials nearest to a grasp |
//! | `words` | sentences |

mod bands;
#[cfg(test)]
pub(crate) mod fixtures;
mod nearest;
mod occlusion;
mod phases;
mod words;

pub use bands::{Band, bands_for};
pub use nearest::{NEWEST_TRIALS, NearestQuery, NearestReport, NearestTrial, TrialIndex};
pub use occlusion::{Attribution, BeliefMove, ClassShare, Evidence, WhyError, explain};
pub use palpate_geometry::units::percent;
pub use phases::phases_of;
pub use words::{MEASURED_HOW, Reason, channel_words, points_words};
